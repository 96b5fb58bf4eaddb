"""Boosted trees as an array of nodes: trained by LightGBM, calculated here, so that a twin beside a crane needs no
library and reads no foreign format."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.extras import need
from stillhook.errors import LiveError

FEATURE, THRESHOLD, LEFT, RIGHT, VALUE = range(5)
"""A node: the condition that is looked at, the value up to which the next node is `left`, else `right`; a leaf is its
own left and right, and has a value [N m]."""
LEAVES, DEPTH, RATE, FEWEST = 12, 4, 0.05, 200
"""Leaves and depth of a tree, part of it that counts, and samples of a leaf: 40 s, several half waves."""
MOST_TREES = 400
TOGETHER = 4096
"""Samples that are calculated together."""
NONE: FloatArray = np.zeros((0, 1, 5))


def values(nodes: FloatArray, conditions: FloatArray) -> FloatArray:
    """Value of every tree (trees, n) of nodes (trees, nodes, 5) at conditions (n, features) [N m]."""
    out = np.zeros((len(nodes), len(conditions)))
    trees = np.arange(len(nodes))[:, None]
    for start in range(0, len(conditions), TOGETHER):
        x = conditions[start : start + TOGETHER]
        rows, at = np.arange(len(x)), np.zeros((len(trees), len(x)), dtype=np.intp)
        for _ in range(DEPTH):
            node = nodes[trees, at]
            below = x[rows, node[..., FEATURE].astype(np.intp)] <= node[..., THRESHOLD]
            at = np.where(below, node[..., LEFT], node[..., RIGHT]).astype(np.intp)
        out[:, start : start + TOGETHER] = nodes[trees, at, VALUE]
    return out


def checked(nodes: FloatArray, features: int) -> FloatArray:
    """Nodes out of a file. Errors: ValueError where they are not trees whose ways all end in leaves."""
    if nodes.ndim != 3 or nodes.shape[2] != 5 or len(nodes) > MOST_TREES or not np.isfinite(nodes).all():
        raise ValueError("trees: shape or numbers")
    feature, left, right = (nodes[..., k] for k in (FEATURE, LEFT, RIGHT))
    place = np.arange(nodes.shape[1])
    ways = ((left == place) & (right == place)) | ((left > place) & (right > place))
    valid = all((x == np.floor(x)).all() and (x >= 0).all() for x in (feature, left, right))
    if not (valid and ways.all() and (feature < features).all() and (np.maximum(left, right) < nodes.shape[1]).all()):
        raise ValueError("trees: nodes that lead nowhere")
    return nodes


def boosted(conditions: FloatArray, torque: FloatArray, weight: FloatArray, count: int) -> FloatArray:
    """Nodes of so many trees fitted to a torque (n,) at conditions (n, features), with weights; the same samples give
    the same trees."""
    need("lightgbm", "Learning what is left over", LiveError)
    import lightgbm

    settings = {
        "objective": "huber",
        "alpha": 3.0 * float(np.median(np.abs(torque))) + 1e-9,
        "num_leaves": LEAVES,
        "max_depth": DEPTH,
        "learning_rate": RATE,
        "min_data_in_leaf": FEWEST,
        "lambda_l2": 10.0,
        "boost_from_average": False,
        "num_threads": 1,
        "deterministic": True,
        "force_row_wise": True,
        "seed": 1,
        "verbose": -1,
    }
    data = lightgbm.Dataset(conditions, torque, weight=weight, params={"verbose": -1})
    tables = [_rows(tree["tree_structure"]) for tree in lightgbm.train(settings, data, count).dump_model()["tree_info"]]
    width = max(len(rows) for rows in tables)
    return np.array([[*rows, *([0, 0.0, k, k, 0.0] for k in range(len(rows), width))] for rows in tables], np.float64)


def _rows(tree: Mapping[str, Any]) -> list[list[float]]:
    """A tree of LightGBM as nodes, each before those that it leads to."""
    rows: list[list[float]] = []

    def add(node: Mapping[str, Any]) -> int:
        at = len(rows)
        if "leaf_value" in node:
            rows.append([0, 0.0, at, at, node["leaf_value"]])
        else:
            rows.append([node["split_feature"], node["threshold"], at, at, 0.0])
            rows[at][LEFT], rows[at][RIGHT] = add(node["left_child"]), add(node["right_child"])
        return at

    add(tree)
    return rows
