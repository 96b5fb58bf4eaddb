"""Controllers in a plan: tables of docs/validation/controllers-in-a-plan.md from the outcome beside this file,
which `python -m benchmarks.control.days > benchmarks/control/days/outcome.json` writes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from blocks import Blocks, Table, panel, picture, save

from stillhook.report.plots.colours import CONTROLLERS, GREEN, PINK, RED

SCRIPT = "controllers_in_a_plan"
CAP, NONE, STRONG, FF = "cap-80", "none", "strong-ssc", "ff"
SIMULATED, CLAIMABLE = "simulated", "claimable"
Outcome = Mapping[str, Any]
STYLES = {
    "ssc-optimal": (RED, ":"),
    "ff": (GREEN, "-"),
    "rope": (GREEN, "--"),
    "strong-ssc, 200 ms late": (PINK, "--"),
    "the same with prediction": (PINK, ":"),
}
"""Colour and line of rows that have none of their own."""


def estimate(x: Sequence[float | None] | None, digits: int = 0) -> str:
    """A number with its interval."""
    if x is None:
        return "–"
    if x[0] is None:
        return "never"
    if x[1] is None or x[1] == x[2]:
        return f"{x[0]:.{digits}f}"
    return f"{x[0]:.{digits}f} ({x[1]:.{digits}f} to {x[2]:.{digits}f})".replace("-", "−")


def limits_table(found: Outcome) -> Table:
    """Limiting heights by period, simulated."""
    rows = [
        (name, *("above 6" if x is None else f"{x:.2f}" for x in row[SIMULATED]["Hs"]))
        for name, row in found["rows"].items()
    ]
    return Table(["limiting Hs [m] at Tp", *(f"{T:g} s" for T in found["Tp"])], rows)


def governs_table(found: Outcome) -> Table:
    """What governs, by the periods at which it does."""
    rows = []
    for name, row in found["rows"].items():
        of, by = row[SIMULATED], dict[str, list[float]]()
        for T, *what in zip(found["Tp"], of["phase"], of["rule"], of["tier"], strict=True):
            by.setdefault("{}: {} [{}]".format(*what), []).append(T)
        rows.append((name, "; ".join(f"{spans(periods)} s {what}" for what, periods in by.items())))
    return Table(["", "periods, phase: rule [tier]"], rows)


def spans(periods: Sequence[float]) -> str:
    """Periods in a row, neighbours joined."""
    groups: list[list[float]] = []
    for T in periods:
        if groups and T - groups[-1][-1] <= 1.0:
            groups[-1].append(T)
        else:
            groups.append([T])
    return ", ".join(f"{g[0]:g}" if len(g) == 1 else f"{g[0]:g} to {g[-1]:g}" for g in groups)


def days_table(found: Outcome) -> Table:
    """Workable days and waiting, simulated and claimable."""
    rows = []
    for name, row in found["rows"].items():
        a, b = row[SIMULATED], row[CLAIMABLE]
        days, wait = [estimate(x["days"], 1) for x in (a, b)], [estimate(x["wait_p50"]) for x in (a, b)]
        over = [estimate(a["over"].get(of), 1) for of in (NONE, CAP, STRONG)]
        by_limits = "{:.0f} to {:.0f}".format(*a["days_by_limits"])
        rows.append((name, days[0], by_limits, *over, wait[0], days[1], estimate(b["over"].get(CAP), 1), wait[1]))
    simulated = ["workable days a year", "by errors of limits", "over none", "over the cap", "over strong SSC"]
    return Table(
        ["", *simulated, "waiting, P50 [d]", "claimable days a year", "over the cap", "waiting, P50 [d]"], rows
    )


def compute() -> tuple[Blocks, Any]:
    found: Outcome = json.loads(Path(__file__).with_name("outcome.json").read_text(encoding="utf-8"))
    rows = found["rows"]
    numbers = {
        f"{name}_{credit}": rows[of][credit]["days"][0]
        for name, of in {"none": NONE, "cap": CAP, "strong": STRONG, "ff": FF}.items()
        for credit in (SIMULATED, CLAIMABLE)
    }
    numbers["over_strong"] = rows[FF][SIMULATED]["over"][STRONG]
    tables = {"days": days_table, "limits": limits_table, "governs": governs_table}
    return {"claims": numbers, **{name: of(found) for name, of in tables.items()}}, found


def draw(found: Outcome) -> None:
    rows = found["rows"]
    styles = {name: (CONTROLLERS[name], "-") if name in CONTROLLERS else STYLES[name] for name in rows}
    result = picture(11.0, 5.2)
    over, bars = result.subplots(1, 2, width_ratios=(3, 2))
    for name, row in rows.items():
        Hs = [np.nan if x is None else x for x in row[SIMULATED]["Hs"]]
        wide = {"linewidth": 3.0, "zorder": 3} if name == CAP else {"linewidth": 1.3}
        colour, line = styles[name]
        over.plot(found["Tp"], Hs, line, color=colour, label=name, **wide)
    panel(over, "Limits, simulated", "peak period [s]", "limiting Hs [m]", legend=False)
    result.legend(
        *over.get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False, fontsize="small"
    )
    y = np.arange(len(rows))[::-1]
    for place, (name, row) in zip(y, rows.items(), strict=True):
        days, low, high = row[SIMULATED]["days"]
        bars.barh(place, days, color=styles[name][0], alpha=0.8, height=0.6)
        bars.plot([max(low, 0.0), high], [place, place], color="black", linewidth=1.0)
        bars.plot(row[CLAIMABLE]["days"][0], place, "D", color="black", markersize=4)
    bars.axvline(rows[CAP][SIMULATED]["days"][0], color=styles[CAP][0], linewidth=2.0)
    bars.set_yticks(y, list(rows), fontsize="small")
    panel(bars, "bar: simulated; diamond: claimable", "workable days a year", legend=False)
    save(result, "controllers-in-a-plan.png")
