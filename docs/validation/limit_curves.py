"""Limits of repeated plans against those of many more runs: tables from what limit_curves_trials.py computed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from blocks import claims_table, save, table
from limit_curves_trials import NUMBERS, STORE
from matplotlib.figure import Figure

from stillhook.report.plots.run import COLOURS, GREY

PAGE = "limit-curves.md"
COVERS = (0.90, 0.98)
"""Share of repeated plans whose 95 % interval is to hold the limit."""


def part(x: float, digits: int = 1) -> str:
    """0.0123 as 1.2 %."""
    return f"{100.0 * x:.{digits}f} %".replace("-", "−")


def compute() -> tuple[dict[str, str], dict[str, Any]]:
    found: dict[str, Any] = json.loads(STORE.read_text(encoding="utf-8"))
    own = {row["runs"]: row["rms"] for row in found["order_statistics"]}
    head = ("runs of a column", "error, rms", "mean", "half of the 95 % interval", "covers", "columns without a limit")

    def rows(key: str) -> list[tuple[str, ...]]:
        return [
            (str(r["runs"]), part(r["rms"]), part(r["bias"]), part(r["half"]), part(r["coverage"]), part(r["open"]))
            for r in found[key]
        ]

    covered = [r["coverage"] for key in ("made_up", "splash") for r in found[key]]
    five = {level: [r for r in found["extremes"] if r["level"] == level] for level in ("P90", "MPM")}
    better = all(r["rms_5"] <= r["rms_20"] for r in five["P90"] if r["x"] != "e_c_pp")
    middle = found["splash"][1]
    exact = max(middle["rms"] ** 2 - found["reference"] ** 2, 0.0) ** 0.5
    claims = {
        "95 % intervals of limits hold the limit": (
            "90 to 98 of 100 plans",
            f"{part(min(covered))} to {part(max(covered))}",
            "holds" if COVERS[0] <= min(covered) and max(covered) <= COVERS[1] else "does not hold",
        ),
        "splash zone, 32 runs a column, against 256 seeds whose own error is taken off": (
            "within 3 %",
            part(exact),
            "holds" if exact <= 0.03 else "does not hold",
        ),
        "90 % level of a half hour: 5 runs with all peaks as good as 20 with Gumbel maxima (tension, motion)": (
            "yes",
            "yes" if better else "no",
            "holds" if better else "does not hold",
        ),
        "the same for the most probable largest": (
            "yes",
            f"{part(max(r['rms_5'] for r in five['MPM']))} against {part(max(r['rms_20'] for r in five['MPM']))}",
            "holds" if all(r["rms_5"] <= r["rms_20"] for r in five["MPM"]) else "does not hold",
        ),
    }
    names = [
        (
            r["level"],
            NUMBERS[r["x"]],
            f"{r['all']:.3f}",
            f"{r['gumbel']:.3f}",
            part(r["rms_5"]),
            part(r["cover_5"], 0),
            part(r["rms_20"]),
        )
        for r in found["extremes"]
    ]
    return {
        "claims": claims_table(claims),
        "made_up": table(head, rows("made_up")),
        "splash": table(head, rows("splash")),
        "cells": table(
            ("runs of a column", "by order statistics of two cells", "by the curve of all columns"),
            [(str(r["runs"]), part(own[r["runs"]]), part(r["rms"])) for r in found["splash"]],
        ),
        "reference": f"The limits by 256 seeds have an error of some {part(found['reference'])} themselves.",
        "extremes": table(
            ("level", "number", "all 768 runs, peaks", "all, Gumbel", "5 runs: rms", "covers", "20 runs, Gumbel: rms"),
            names,
        ),
    }, found


def draw(found: Mapping[str, Any]) -> None:
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    error, cover = figure.subplots(1, 2)
    for colour, key, label in ((COLOURS[0], "splash", "splash zone"), (COLOURS[1], "made_up", "made-up response")):
        runs = [r["runs"] for r in found[key]]
        error.plot(runs, [100.0 * r["rms"] for r in found[key]], color=colour, marker="o", label=label)
        cover.plot(runs, [100.0 * r["coverage"] for r in found[key]], color=colour, marker="o", label=label)
    own = found["order_statistics"]
    error.plot(
        [r["runs"] for r in own], [100.0 * r["rms"] for r in own], color=GREY, marker="s", label="order statistics"
    )
    error.set(xlabel="runs of a column", ylabel="error of a limit, rms [%]", ylim=(0.0, None))
    cover.axhspan(100.0 * COVERS[0], 100.0 * COVERS[1], color=GREY, alpha=0.2)
    cover.set(xlabel="runs of a column", ylabel="intervals that hold the limit [%]", ylim=(80.0, 100.0))
    for ax in (error, cover):
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    save(figure, "limit-curves.png")
