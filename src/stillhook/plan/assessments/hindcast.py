"""The hindcast of a plan: what it is, in how much of each month windows of several lengths can start and how that
differs over the years, and waiting with its sampling error; for the leading alternative as may be claimed, and with a
SYNTHETIC certificate as it would be credited if that were real."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray
from stillhook.base.progress import Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.result import CLAIMABLE, CREDITS, Credit
from stillhook.plan.weather.value import SYNTHETIC, Workability
from stillhook.report.document import Part, Table, Text, facts
from stillhook.report.formatting import DAY, HOUR, display_unit, hours, percent
from stillhook.units import number
from stillhook.weather.hindcast import FEWEST_YEARS, FOLLOWS, by_month_and_year, table_of, waiting
from stillhook.weather.persistence import MONTHS, Window, month_of, waits

NAME, TITLE, EXPECTED = "hindcast", "Hindcast, windows and waiting", 0.5
LENGTHS = (6.0 * HOUR, 12.0 * HOUR, 24.0 * HOUR, 48.0 * HOUR, 72.0 * HOUR)
"""Lengths of windows in addition to the plan's own [s]."""
NOT_STATED = "not stated"
FRACTILES = {"wait_p50": 0.5, "wait_p90": 0.9}


def assess(state: PlanState, progress: Progress) -> dict[str, Any] | None:
    """Table, windows and waiting [SI]; None without weather, and where the operation is not weather restricted.

    as_credited, where that may not be claimed: the same windows and waiting by what is credited.
    """
    if state.records is None or not state.forecast.restricted:
        return None
    of, forecast = state.answered, state.forecast
    judge = Workability.of(state.plan, of.axes, state.records, forecast.swell)
    result = table_of(state.records) | _stated(state) | {"alternative": of.shown().value, "window": forecast.window}
    result |= _by_credit(state, judge, of.claim, progress)
    return result | ({"as_credited": _by_credit(state, judge, CREDITS[1], progress)} if of.claim == CLAIMABLE else {})


def _by_credit(state: PlanState, judge: Workability, credit: Credit, progress: Progress) -> dict[str, Any]:
    """windows and waiting with the leading alternative; the reason where it has no forecast limit."""
    shown, forecast, weather = state.answered.shown(), state.forecast, judge.weather
    op_wf = forecast.op_wf[forecast.credits.index(credit), judge.axes.alternatives.index(shown)]
    if not (op_wf > 0.0).any():
        return {"reason": f"no OP_WF with {shown.value}: no window is stated. {forecast.reason}".strip()}
    limits, valid = np.nan_to_num(op_wf, nan=0.0), np.isfinite(judge.seas.Hs)
    lengths = sorted({*LENGTHS, forecast.window})
    result: dict[str, Any] = {}
    rows: dict[str, list[Any]] = {}
    for i, length in enumerate(lengths):
        progress(i / len(lengths))
        window = Window.of(weather.time, weather.step, length)
        start = judge.starts(limits, window)[1]
        shares = by_month_and_year(start, window.starts(valid), weather.time, weather.step)
        for key, values in shares.items():
            rows.setdefault(key, []).append(values)
        if length == forecast.window:
            result["waiting"] = _waiting(start, weather.time, weather.step)
    return result | {"windows": {"length": lengths, **rows}}


def _waiting(start: BoolArray, time: Any, step: float) -> list[dict[str, Any]]:
    """Fractiles of waiting of the whole year (month 0) and of each month, with their interval."""
    wait, month = waits(start, time), month_of(time)
    rows = []
    for m in range(13):
        of = wait if m == 0 else np.where(month == m, wait, np.nan)
        if np.isfinite(of).any():
            estimates = waiting(of, time, step, tuple(FRACTILES.values()))
            ends = {
                name: {"value": e.value, "low": e.low, "high": e.high}
                for name, e in zip(FRACTILES, estimates, strict=True)
            }
            rows.append({"month": m, "n_years": int(estimates[0].n)} | ends)
    return rows


def _stated(state: PlanState) -> dict[str, Any]:
    """What the plan and the reader say of the series."""
    use, records = state.plan.weather, state.records
    assert records is not None
    directions = "come_from" in records.columns
    sense = NOT_STATED if use is None or use.sense is None else use.sense
    by_file = next(
        (note for note in records.notes if "direction" in note), "" if sense != NOT_STATED else "as the file states"
    )
    text = (f"{sense} by the plan" if sense != NOT_STATED else by_file) if directions else "no directions"
    synthetic = any(SYNTHETIC in line.lower() for line in (records.source, *records.notes))
    return {
        "model": (use.source if use is not None else "") or NOT_STATED,
        "bias": (use.bias if use is not None else "") or NOT_STATED,
        "directions": text,
        "synthetic": synthetic,
    }


def parts(answer: Mapping[str, Any]) -> list[Part]:
    """The section of the report."""
    of = answer[NAME]
    section: list[Part] = [facts(_rows(of)), *_answer(of, "claimable" if "as_credited" in of else "credited")]
    if (credited := of.get("as_credited")) is not None:
        section += _answer({key: of[key] for key in ("alternative", "window")} | credited, IF_REAL)
    stated = "windows" in of or "windows" in (credited or {})
    return [*section, Text(TEXT.format(fewest=FEWEST_YEARS, follows=FOLLOWS))] if stated else section


def _answer(of: Mapping[str, Any], credit: str) -> list[Part]:
    """Windows by month, and waiting, under a credit."""
    if "windows" not in of:
        return [Text(of["reason"])]
    name, w = of["alternative"], of["windows"]
    heads = ("month", *(hours(length) for length in w["length"]))
    cells = [[_range(*(w[key][i][m] for key in RANGE)) for i in range(len(w["length"]))] for m in range(12)]
    title = f"Starts of a window that the weather allows, {name}, {credit}: mean (least to most of a year) [%]"
    windows = Table(heads, [[month, *row] for month, row in zip(MONTHS, cells, strict=True)], title)
    rows = [
        [
            "year" if row["month"] == 0 else MONTHS[row["month"] - 1],
            *(in_days(row[key]) for key in FRACTILES),
            str(row["n_years"]),
        ]
        for row in of["waiting"]
    ]
    title = f"Waiting for a window of {hours(of['window'])}, {name}, {credit} [d], with its sampling error over years"
    return [windows, Table(("from", "P50", "P90", "years"), rows, title) if rows else Text(f"{title}: never a window.")]


IF_REAL = "with this certificate if it were real"
"""What windows and waiting are of that may not be claimed."""
RANGE = ("mean", "least", "most")
TEXT = """\
A window starts where operation and contingency find every record at or below OP_WF at one heading. In brackets the \
95 % interval of waiting: years drawn with replacement, with a correlation of {follows} from year to year allowed for \
(assumed); none from fewer than {fewest} years. Slow changes of the climate are not in it. P50 and P90 leave out \
starts that find no window before the series ends."""


def _rows(of: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The table of the hindcast."""
    missing = ", ".join(f"{name} {percent(share)}" for name, share in of["missing"].items())
    steps = "; ".join(
        f"{name} {'finer than 0.01' if step is None else number(step, 3)} {display_unit(name)},"
        f" {of['n_values'][name]} values"
        for name, step in of["resolution"].items()
    )
    years = f"{number(of['span'] / (365.25 * DAY), 3)} years, {of['n_years']} calendar years at least half covered"
    return [
        ("source", f"{of['source']}{' (SYNTHETIC)' if of['synthetic'] else ''}; model and grid point {of['model']}"),
        ("from, to", f"{of['first']} to {of['last']}: {years}"),
        ("records", f"{of['n_records']}, one every {hours(of['step'])}"),
        ("gaps", f"{of['n_gaps']}, {hours(of['absent'])} in them ({percent(of['absent_share'])} of the time)"),
        ("missing", missing),
        ("resolution", steps),
        ("directions", of["directions"]),
        ("known bias", of["bias"]),
    ]


def _range(mean: float | None, least: float | None, most: float | None) -> str:
    if mean is None or least is None or most is None or math.isnan(mean):
        return "-"
    return f"{100.0 * mean:.0f} ({100.0 * least:.0f} to {100.0 * most:.0f})"


def in_days(of: Mapping[str, float | None]) -> str:
    """A time with its interval, in days."""
    value, low, high = (
        math.nan if of[key] is None else float(of[key] or 0.0) / DAY for key in ("value", "low", "high")
    )
    if math.isnan(value):
        return "-"
    return f"{value:.1f}" + ("" if math.isnan(low) else f" ({low:.1f} to {high:.1f})")
