"""Limits over the seabed on the twin's own distributions: tables from what `trials/limits/crossings.py` computed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks, percent, picture, save

from stillhook.plan.definition.rules import Alternative
from stillhook.report.plots.colours import COLOURS, GREY
from trials.limits.crossings import STORE
from trials.limits.curves_page import within

SCRIPT = "limit_crossings"

NEAR = 0.03
"""Points by which the share of fresh runs beyond a limit may be off what the rule allows."""
KNOWN = 0.04
"""Error of a reference, in ln of the height, up to which intervals are held against it."""
Rows = Sequence[Mapping[str, Any]]


def shares(rows: Rows, runs: int) -> tuple[int, float, float, float]:
    """Number of limits, mean share of fresh runs beyond them, its standard error, and mean share allowed."""
    beyond = np.array([row["beyond"] for row in rows])
    error = math.sqrt(float(np.sum(beyond * (1.0 - beyond))) / runs) / len(rows)
    return len(rows), float(beyond.mean()), error, float(np.mean([row["allowed"] for row in rows]))


def told(rows: Rows) -> list[Mapping[str, Any]]:
    """Limits that have two ends, in seas that are analysed."""
    return [row for row in rows if row["beyond"] is not None]


def of_fresh(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A row of the table for each lift, phase, controller and rule with limits."""
    rows, keys = found["fresh"]["rows"], ("lift", "phase", "alternative", "rule")
    lines = []
    for key in dict.fromkeys(tuple(row[k] for k in keys) for row in rows):
        every = [row for row in rows if tuple(row[k] for k in keys) == key]
        if not (of := told(every)):
            continue
        n, beyond, error, allowed = shares(of, found["fresh"]["runs"])
        half = np.mean([0.5 * math.log(row["high"] / row["low"]) for row in of])
        lift, phase, alternative, rule = key
        lines.append({**locals()})
    return lines


def of_passage(rows: Rows, runs: int) -> list[tuple[str, ...]]:
    """A row for each rule and period of the passage through the surface, and one for all periods."""
    lines = []
    for rule in dict.fromkeys(row["rule"] for row in rows):
        of_rule = [row for row in rows if row["rule"] == rule]
        periods = sorted({row["Tp"] for row in of_rule})
        for name, of in (
            *((f"{T:g}", [row for row in of_rule if row["Tp"] == T]) for T in periods),
            ("all", of_rule),
        ):
            n, beyond, error, allowed = shares(of, runs)
            ends = f"{min(row['Hs'] for row in of):.2f} to {max(row['Hs'] for row in of):.2f}"
            lines.append(
                (
                    rule,
                    name,
                    str(n),
                    ends,
                    f"{percent(beyond, digits=1)} ± {percent(error, digits=1)}",
                    percent(allowed, digits=1),
                )
            )
    return lines


def of_coverage(rows: Rows) -> list[dict[str, Any]]:
    """A row for each phase, controller and rule of the repeated plans."""
    keys = ("phase", "alternative", "rule")
    lines = []
    for key in dict.fromkeys(tuple(row[k] for k in keys) for row in rows):
        every = [row for row in rows if tuple(row[k] for k in keys) == key]
        of = known(every)
        if not of:
            continue
        held, n = sum(row["held"] for row in of), sum(row["told"] for row in of)
        off = np.concatenate([row["off"] for row in of])
        phase, alternative, rule = key
        ends = [f"{min(row['H'] for row in of):.2f}", f"{max(row['H'] for row in of):.2f}"]
        lines.append({**locals()})
    return lines


def known(rows: Rows) -> list[Mapping[str, Any]]:
    """Limits that all runs together know well, and that plans gave."""
    return [row for row in rows if row["H"] is not None and row["sd"] <= KNOWN and row["told"] > 0]


def compute() -> tuple[Blocks, dict[str, Any]]:
    found: dict[str, Any] = json.loads(STORE.read_text(encoding="utf-8"))
    fresh, runs = told(found["fresh"]["rows"]), found["fresh"]["runs"]
    lifts = {lift: [row for row in fresh if row["lift"] == lift] for lift in dict.fromkeys(r["lift"] for r in fresh)}
    off = {lift: shares(rows, runs) for lift, rows in lifts.items()}
    worst = max(beyond - allowed for _, beyond, _, allowed in off.values())
    _, beyond, error, allowed = shares(fresh, runs)
    passage, passages = found["passage"]["rows"], found["passage"]["runs"]
    _, through, its_error, may = shares(passage, passages)
    cover = known(found["coverage"]["rows"])
    held = sum(row["held"] for row in cover) / sum(row["told"] for row in cover)

    covers = within([held])
    blocks = {
        "claims": locals(),
        "fresh": of_fresh(found),
        "coverage": of_coverage(found["coverage"]["rows"]),
        "passage": of_passage(passage, passages),
        "runs": {"found": found},
    }
    return blocks, found


def draw(found: Mapping[str, Any]) -> None:
    figure = picture(8.0, 3.4)
    fresh, errors = figure.subplots(1, 2)
    rows = told(found["fresh"]["rows"])
    for k, lift in enumerate(dict.fromkeys(row["lift"] for row in rows)):
        of = [row for row in rows if row["lift"] == lift]
        x, y = ([100.0 * row[name] for row in of] for name in ("allowed", "beyond"))
        spread = np.random.default_rng(k).uniform(-1.2, 1.2, len(x)) + 3.0 * (k - 1)
        fresh.scatter(np.array(x) + spread, y, s=9, color=COLOURS[k], alpha=0.6, label=lift)
    fresh.plot([0.0, 70.0], [0.0, 70.0], color=GREY, lw=1.0)
    fresh.set(xlabel="allowed [%]", ylabel="fresh runs beyond the limit [%]", xlim=(0.0, 70.0), ylim=(0.0, 100.0))
    for k, name in enumerate(dict.fromkeys(row["alternative"] for row in found["coverage"]["rows"])):
        of = known([row for row in found["coverage"]["rows"] if row["alternative"] == name])
        if of:
            off = 100.0 * np.concatenate([row["off"] for row in of])
            errors.hist(
                off, bins=np.arange(-60.0, 62.0, 4.0), color=COLOURS[k], alpha=0.5, label=Alternative(name).label
            )
    errors.axvline(0.0, color=GREY, lw=1.0)
    errors.set(xlabel="error of a limit [%]", ylabel="limits of repeated plans")
    for ax in (fresh, errors):
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    save(figure, "limit-crossings.png")
