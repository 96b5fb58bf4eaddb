"""Whether facts and numbers that were read from disk have the shape of a plan's: so that who reads them need not look
at each."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from types import NoneType
from typing import TYPE_CHECKING, Any

from stillhook.plan.definition.compensation import Alternative
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray

Shape = Any
"""A tuple of types; [shape] for a list of such; a mapping of names to shapes, where a name that ends in ? may be
missing."""
TEXT, YES, NUMBER, MAYBE = (str,), (bool,), (int, float), (int, float, NoneType)
WORDS: Mapping[type, str] = {str: "text", bool: "true or false", int: "number", float: "number", NoneType: "null"}
TEXTS = [TEXT]
ROW = 2
"""Texts in a payload's row at least: what it is, and its value."""
PHASE = {
    "name": TEXT,
    "kind": TEXT,
    "mode": TEXT,
    "start": MAYBE,
    "end": MAYBE,
    "speed": MAYBE,
    "duration": MAYBE,
    "compensated": YES,
    "tiers?": TEXTS,
    "reason?": TEXT,
}
RULE = {
    "key": TEXT,
    "title": TEXT,
    "quantity": TEXT,
    "limit": (str, int, float, NoneType),
    "standard": TEXT,
    "edition": TEXT,
    "clause": TEXT,
    "note": TEXT,
    "sense": TEXT,
    "level": TEXT,
    "requirement?": TEXT,
}
OPERATION = {
    "T_POP": NUMBER,
    "T_C": MAYBE,
    "T_R": NUMBER,
    "weather_restricted": YES,
    "T_POP_given?": YES,
    "alternative?": TEXT,
    "Tp?": MAYBE,
    "beta?": MAYBE,
    "OP_LIM?": MAYBE,
    "alpha?": MAYBE,
    "op_wf?": MAYBE,
    "notes?": TEXTS,
    "alpha_table?": (
        {f"{key}?": TEXT for key in ("name", "version", "standard", "edition", "clause", "note")}
        | {"Hs_lowest?": NUMBER}
    ),
}
FACTS: Mapping[str, Shape] = {
    "name": TEXT,
    "source": TEXT,
    "digest": TEXT,
    "notes": TEXTS,
    "version": TEXT,
    "code": TEXT,
    "date": TEXT,
    "tiers": TEXTS,
    "shown": TEXT,
    "settings": {
        "wave": TEXT,
        "gamma": MAYBE,
        "spread": MAYBE,
        "heading_tolerance": NUMBER,
        "Hs": [NUMBER],
        "Tp": [NUMBER],
        "headings": [NUMBER],
    },
    "crane": {
        "name": TEXT,
        "title": TEXT,
        "SWL": NUMBER,
        "digest": TEXT,
        "twin": TEXT,
        "certificate": (None, {"number": TEXT, "statement": TEXT, "synthetic?": YES, "unsigned?": TEXT}),
    },
    "vessel": {"name": TEXT, "title": TEXT, "notes": TEXTS},
    "payload": {"name": TEXT, "title?": TEXT, "mass": NUMBER, "height": NUMBER, "digest": TEXT, "rows": [TEXTS]},
    "place": {"h_tip": NUMBER, "depth": NUMBER, "rho": NUMBER, "text": TEXT},
    "phases": [PHASE],
    "rules": {"name": TEXT, "version": TEXT, "digest": TEXT, "changes": TEXTS, "rows": [RULE]},
    "limited": [
        {
            "phase": TEXT,
            "alternative": TEXT,
            "rule": TEXT,
            "limit": (str, int, float, NoneType),
            "basis": (str, NoneType),
        }
    ],
    "alternatives": [{"name": TEXT, "description": TEXT, "credit_note?": TEXT}],
    "inputs": [{"item": TEXT, "file": TEXT, "sha256": TEXT}],
    "not_covered": TEXTS,
    "remarks": TEXTS,
    "operation": OPERATION,
    "runs": {},
    "not_computed": {},
    "weather": {},
    "summary": {"shown": TEXT, "alternatives": {}},
    "limits": [{"credit": TEXT, "alternative": TEXT, "Hs_limit": MAYBE}],
}
"""What facts are where they are told (`stillhook.plan.answer.metadata`, `stillhook.plan.answer.remarks`)."""
CELL = {"credit", "alternative", "heading", "period"}
COLUMN = {"alternative", "phase", "heading", "period"}
DATA: Mapping[str, set[str]] = {
    **dict.fromkeys(
        ("Hs_limit", "Hs_limit_low", "Hs_limit_high", "governing_phase", "governing_rule", "governing_tier"), CELL
    ),
    **dict.fromkeys(("alpha", "op_wf"), CELL),
    **dict.fromkeys(("counts", "n_seeds", "inside"), COLUMN),
    "Hs_rule": {"credit", "tier", "rule", *CELL, *COLUMN},
}
"""Dimensions of a result's numbers."""


def odd_fact(facts: Mapping[str, Any]) -> str:
    """The first fact that is told and is not what it should be, in words; empty where all are."""
    for key, shape in FACTS.items():
        if key in facts and (error := _odd(facts[key], shape, key)):
            return error
    if any(len(row) < ROW for row in facts.get("payload", {}).get("rows", ())):
        return "payload.rows: a row without a value"
    if "date" in facts:
        try:
            datetime.date.fromisoformat(facts["date"])
        except ValueError:
            return f"date = {quote(facts['date'])}: it must be a date"
    return ""


def _odd(value: Any, shape: Shape, where: str) -> str:
    if isinstance(shape, tuple) and shape[0] is None:
        return "" if value is None else _odd(value, shape[1], where)
    if isinstance(shape, tuple):
        right = isinstance(value, shape) and (not isinstance(value, bool) or bool in shape)
        return (
            ""
            if right
            else f"{where} = {quote(value)}: it must be a {' or '.join(dict.fromkeys(WORDS[each] for each in shape))}"
        )
    if isinstance(shape, list):
        if not isinstance(value, list | tuple):
            return f"{where} = {quote(value)}: it must be a list"
        return next((error for i, each in enumerate(value) if (error := _odd(each, shape[0], f"{where}[{i}]"))), "")
    if not isinstance(value, Mapping):
        return f"{where} = {quote(value)}: it must be a table"
    for key, inner in shape.items():
        name = key.removesuffix("?")
        if name not in value and name == key:
            return f"{where}.{name}: missing"
        if name in value and (error := _odd(value[name], inner, f"{where}.{name}")):
            return error
    return ""


def odd_numbers(data: xarray.Dataset) -> str:
    """The first of a result's numbers that is not what it should be, in words; empty where all are."""
    for name, dims in DATA.items():
        if name not in data:
            return f"{name}: missing"
        if set(data[name].dims) != dims:
            return f"{name}: over {', '.join(map(str, data[name].dims))} in place of {', '.join(sorted(dims))}"
    names = [*dict.fromkeys(("credit", *sorted(DATA["Hs_rule"])))]
    if missing := [name for name in names if name not in data.coords]:
        return f"{', '.join(missing)}: missing"
    return next(
        (
            f"alternative {quote(str(a))}: unknown"
            for a in data["alternative"].values
            if str(a) not in list(Alternative)
        ),
        "",
    )


def of_two(data: xarray.Dataset, facts: Mapping[str, Any]) -> str:
    """Where facts name other phases, rules or alternatives than the numbers, in words; empty where they do not."""
    named = {"phase": facts["phases"], "alternative": facts["alternatives"], "rule": facts["rules"]["rows"]}
    for name, rows in named.items():
        keys = [row["key" if name == "rule" else "name"] for row in rows]
        if sorted(keys) != sorted(map(str, data[name].values)):
            return f"its facts name other {name}s than its numbers"
    return ""
