"""Limits of repeated plans against those of many more runs: tables from what `trials/limits/curves.py` computed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from blocks import Blocks, minus, percent, picture, save

from stillhook.plan.weather.value import DAY
from stillhook.report.plots.colours import COLOURS, GREY
from trials.limits.curves import NUMBERS, STORE
from trials.limits.days import NAMES

SCRIPT = "limit_curves"

COVERS = (0.90, 0.98)
"""Share of repeated plans whose 95 % interval is to hold the limit."""


def within(shares: Sequence[float]) -> str:
    """Verdict on shares of intervals that hold what they are of."""
    return "holds" if COVERS[0] <= min(shares) and max(shares) <= COVERS[1] else "does not hold"


def shown(number: str, x: float) -> str:
    """A number of the weather as text: shares in per cent, times in days."""
    if number == "operability":
        return percent(x, digits=1)
    return minus(f"{x / DAY if number == 'wait_mean' else x:.2f} d")


def compute() -> tuple[Blocks, dict[str, Any]]:
    found: dict[str, Any] = json.loads(STORE.read_text(encoding="utf-8"))
    own = {row["runs"]: row["rms"] for row in found["order_statistics"]}

    days, before = found["days"], {row["name"]: row for row in found["searched_before"]}
    of_days = [r["coverage"] for r in days]
    placed = {r["name"]: r["coverage"] for r in found["searched"]}
    levelled = [c for name, c in placed.items() if name != "power of the height"]
    covered = [r["coverage"] for key in ("made_up", "splash") for r in found[key]]
    five = {level: [r for r in found["extremes"] if r["level"] == level] for level in ("P90", "MPM")}
    better = all(r["rms_5"] <= r["rms_20"] for r in five["P90"] if r["x"] != "e_c_pp")
    middle = found["splash"][1]
    exact = max(middle["rms"] ** 2 - found["reference"] ** 2, 0.0) ** 0.5

    return {
        "claims": locals(),
        "searched": [r | {"before": before[r["name"]]} for r in found["searched"]],
        "days": [r | {"name": NAMES[r["number"]], "weather": r["number"]} for r in days],
        "made_up": found["made_up"],
        "splash": found["splash"],
        "cells": [r | {"own": own[r["runs"]]} for r in found["splash"]],
        "reference": {"found": found},
        "extremes": [r | {"number": NUMBERS[r["x"]]} for r in found["extremes"]],
    }, found


def draw(found: Mapping[str, Any]) -> None:
    figure = picture(8.0, 3.4)
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
