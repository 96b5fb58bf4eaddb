"""Limits of repeated plans against those of many more runs: tables from what limit_curves_trials.py computed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from blocks import claims_table, save, table
from limit_curves_days import NAMES as NUMBERS_OF_WEATHER
from limit_curves_trials import NUMBERS, STORE
from matplotlib.figure import Figure

from stillhook.plan.weather.value import DAY
from stillhook.report.plots.colours import COLOURS, GREY

PAGE = "limit-curves.md"
COVERS = (0.90, 0.98)
"""Share of repeated plans whose 95 % interval is to hold the limit."""


def part(x: float, digits: int = 1) -> str:
    """0.0123 as 1.2 %."""
    return f"{100.0 * x:.{digits}f} %".replace("-", "−")


def within(shares: Sequence[float]) -> str:
    """Verdict on shares of intervals that hold what they are of."""
    return "holds" if COVERS[0] <= min(shares) and max(shares) <= COVERS[1] else "does not hold"


def shown(number: str, x: float) -> str:
    """A number of the weather as text: shares in per cent, times in days."""
    if number == "operability":
        return part(x)
    return f"{x / DAY if number == 'wait_mean' else x:.2f} d".replace("-", "−")


def compute() -> tuple[dict[str, str], dict[str, Any]]:
    found: dict[str, Any] = json.loads(STORE.read_text(encoding="utf-8"))
    own = {row["runs"]: row["rms"] for row in found["order_statistics"]}
    head = ("runs of a column", "error, rms", "mean", "half of the 95 % interval", "covers", "columns without a limit")

    def rows(key: str) -> list[tuple[str, ...]]:
        return [
            (str(r["runs"]), part(r["rms"]), part(r["bias"]), part(r["half"]), part(r["coverage"]), part(r["open"]))
            for r in found[key]
        ]

    days, before = found["days"], {row["name"]: row for row in found["searched_before"]}
    of_days = [r["coverage"] for r in days]
    placed = {r["name"]: r["coverage"] for r in found["searched"]}
    levelled = [c for name, c in placed.items() if name != "power of the height"]
    covered = [r["coverage"] for key in ("made_up", "splash") for r in found[key]]
    five = {level: [r for r in found["extremes"] if r["level"] == level] for level in ("P90", "MPM")}
    better = all(r["rms_5"] <= r["rms_20"] for r in five["P90"] if r["x"] != "e_c_pp")
    middle = found["splash"][1]
    exact = max(middle["rms"] ** 2 - found["reference"] ** 2, 0.0) ** 0.5
    claims = {
        "95 % intervals of limits hold the limit": (
            "90 to 98 of 100 plans",
            f"{part(min(covered))} to {part(max(covered))}",
            within(covered),
        ),
        "the same where the search places the cells, growth by a power": (
            "90 to 98 of 100 plans",
            part(placed["power of the height"]),
            within([placed["power of the height"]]),
        ),
        "the same where a number levels off about its limit": (
            "90 of 100 plans or more",
            f"{part(min(levelled))} to {part(max(levelled))}",
            "holds" if min(levelled) >= COVERS[0] else "does not hold",
        ),
        "95 % intervals of operability, mean waiting and days gained hold the true number": (
            "90 to 98 of 100 plans",
            f"{part(min(of_days), 0)} to {part(max(of_days), 0)} (of {days[0]['n']} plans)",
            within(of_days),
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
        "searched": table(
            ("response", "covers", "before", "unbounded above", "limits 10 % too high", "mean", "runs of a column"),
            [
                (
                    r["name"],
                    f"{part(r['coverage'])} ± {part(r['error'])}",
                    f"{part(before[r['name']]['coverage'])} ± {part(before[r['name']]['error'])}",
                    part(r["unbounded"], 0),
                    part(r["unsafe"]),
                    part(r["bias"]),
                    f"{r['runs']:.0f}",
                )
                for r in found["searched"]
            ],
        ),
        "days": table(
            (
                "number",
                "alternative",
                "over",
                "covers",
                "true",
                "mean error",
                "error, rms",
                "half of the 95 % interval",
            ),
            [
                (
                    NUMBERS_OF_WEATHER[r["number"]],
                    r["alternative"],
                    r["over"],
                    f"{part(r['coverage'], 0)} ± {part(r['error'], 0)}",
                    *(shown(r["number"], r[key]) for key in ("truth", "bias", "rms", "half")),
                )
                for r in days
            ],
        ),
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
