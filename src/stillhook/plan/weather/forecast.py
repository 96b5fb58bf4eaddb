"""A forecast compared with a plan: under each alternative, may the lift start now, and if not, when.

A start is a go if for operation and contingency from it on the forecast height stays within OP_WF of its period and
direction (`LimitTable.at`), and every additional limit (wind, say) holds. T_POP counts from the issue of the forecast:
OP_WF of a start is its limit times the plan's factor for lead time and operation. Cells of the plan without an OP_WF
are never a go. A vessel free to turn keeps one heading for T_R, the best one (`stillhook.plan.weather.value`); limits
in addition that depend on beta need a heading that is held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import WeatherError
from stillhook.plan.result import Credit, PlanResult
from stillhook.plan.weather.limit_table import KeptHeadings, LimitTable
from stillhook.plan.weather.records import free_to_turn, swell_forecast, systems
from stillhook.units import show
from stillhook.weather.alpha import AlphaTable, alphas
from stillhook.weather.forecast import (
    Bound,
    Start,
    bounds,
    by_lead,
    issue_notes,
    lead_times,
    reason_against,
    rows_of,
    started,
    starts_of,
)
from stillhook.weather.limit_text import Limit, inside
from stillhook.weather.series import Weather

OP_WF = "Hs <= OP_WF of the plan"
"""What the plan's own limit is called where a start names the limit that governs."""


def plan_forecast(
    result: PlanResult,
    weather: Weather,
    *,
    limits: Sequence[Limit] = (),
    credit: Credit | None = None,
    start: np.datetime64 | None = None,
    horizon: float = 72.0 * 3600.0,
    ship: float | None = None,
    issue: np.datetime64 | None = None,
) -> dict[str, Any]:
    """Go or no-go of every alternative of a plan, by name [SI]; start, horizon [s] and limits as in
    `stillhook.weather.forecast`.

    credit: of the limits; default what may be claimed; ship: where the bow points, clockwise from north [rad]; None:
    free to turn; issue as there. Errors: WeatherError where the forecast does not give the height, or no direction
    though a heading is held.
    """
    credit, operation = credit or result.claim, result.facts["operation"]
    rows = rows_of(weather, start, horizon)
    lead = lead_times(weather, rows, issue)
    if issue is None:
        lead = np.maximum(lead, float(operation.get("lead", 0.0)))
    planned = float(operation["T_POP"]) - float(operation.get("lead", 0.0))
    T_C = float(operation["T_R"]) - float(operation["T_POP"])
    groups = _groups(operation, lead, planned, T_C)
    of_both = systems(weather, result.facts.get("settings", {}).get("swell"))
    weather = of_both.weather
    Hs, Tp, come_from, notes = _seas(weather, ship)
    swell_most = float(operation.get("swell_wf") or math.nan)
    more, covered = inside(limits, weather, ship)
    other_bounds = bounds(weather, limits, ship)
    entries, valid = [], covered & np.isfinite(Hs)
    for alternative in result.alternatives:
        looked = [Start(weather.time[i], None) for i in rows]
        for group, factors in groups:
            table = _table(result, alternative.value, credit, factors)
            limit = KeptHeadings.of(table, len(weather), come_from, ship).limits(table, (Tp,))
            swell = swell_most
            if factors is not None and of_both.swell is not None:
                swell = swell_forecast(factors.table, float(of_both.swell["Hs"]), factors.T_POP)
            workable = valid & more & (Hs <= limit) & (limit > 0.0) & of_both.within(ship, len(limit), swell)
            bound = Bound(OP_WF, Hs, limit)
            each = starts_of(weather, workable, valid, (bound, *other_bounds), rows[group], planned + T_C)
            for k, one in zip(group, each, strict=True):
                looked[k] = one
        starts = tuple(looked)
        restricted = bool(operation["weather_restricted"])
        go = restricted and bool(starts[0].go)
        first = next((s for s in starts if s.go), None) if restricted else None
        reason = "not weather restricted: no forecast lets it start"
        if restricted:
            reason = "" if go else reason_against(starts[0], planned + T_C, weather)
        when = None if first is None else started([first])[0]["time"]
        entry = {"alternative": alternative.value, "go": go, "first_start": when, "reason": reason}
        entries.append(
            entry | {"n_starts": len(starts), "n_go": sum(s.go is True for s in starts), "starts": started(starts)}
        )
    return {key: operation[key] for key in ("T_POP", "T_R", "weather_restricted")} | {
        "plan": result.name,
        "file": weather.source,
        "credit": credit,
        "limits": [limit.text for limit in limits],
        "horizon": horizon,
        "ship": "free" if ship is None else ship,
        "alternatives": entries,
        "notes": [
            *of_both.notes,
            *_issued(operation, weather, rows, lead, planned, T_C, issue),
            *notes,
            *of_both.outside(swell_most),
            *weather.notes,
        ],
    }


class Factors(NamedTuple):
    """Table of forecast factors, and T_POP from the issue of the forecast [s]."""

    table: AlphaTable
    T_POP: float


def _numbers(operation: Mapping[str, Any]) -> AlphaTable | None:
    """Table of forecast factors of a saved plan; None of one that was saved without."""
    of = operation.get("alpha_table", {})
    return AlphaTable.of_numbers(of["name"], of["numbers"]) if "numbers" in of else None


def _groups(
    operation: Mapping[str, Any], lead: FloatArray, planned: float, T_C: float
) -> list[tuple[NDArray[np.intp], Factors | None]]:
    """Starts of one factor, and what it is; None for that of the plan."""
    table = _numbers(operation)
    if table is None or not operation["weather_restricted"]:
        return [(np.arange(len(lead)), None)]
    return [(group, Factors(table, T)) for group, T in by_lead(table, lead, planned, T_C)]


def _issued(
    operation: Mapping[str, Any],
    weather: Weather,
    rows: NDArray[np.intp],
    lead: FloatArray,
    planned: float,
    T_C: float,
    issue: np.datetime64 | None,
) -> list[str]:
    """Notes on the issue of the forecast."""
    table = _numbers(operation)
    if table is None:
        return ["the plan was saved without its table of forecast factors: its OP_WF counts for every start"]
    return issue_notes(weather, rows, lead, planned, T_C, table, issue)


def _table(result: PlanResult, alternative: str, credit: Credit, factors: Factors | None) -> LimitTable:
    """OP_WF of one alternative as it is read on board."""
    data = result.data
    of = data["op_wf" if factors is None else "Hs_limit"].sel(credit=credit, alternative=alternative)
    op_wf = of.transpose("heading", "period").values
    if factors is not None:
        op_wf = np.minimum(op_wf, float(data.attrs["Hs_highest"]))
        op_wf = np.where(op_wf == 0.0, 0.0, op_wf * alphas(factors.table, op_wf, factors.T_POP))
    tolerance, highest = float(data.attrs["heading_tolerance"]), float(data.attrs["Hs_highest"])
    return LimitTable(np.nan_to_num(op_wf, nan=0.0), data["heading"].values, data["period"].values, tolerance, highest)


def _seas(weather: Weather, ship: float | None) -> tuple[FloatArray, FloatArray, FloatArray | None, list[str]]:
    """Heights [m], peak periods [s], where waves come from [rad from north] or None, and notes."""
    if "H_m0" not in weather.columns:
        raise WeatherError(
            f"{weather.source}: no wave height. Give a forecast with a column of significant wave height."
        )
    Hs, notes = weather.columns["H_m0"], []
    if "T_p" not in weather.columns:
        notes.append("no peak period in the forecast: the worst period of the table counts in every record")
    Tp, come_from = weather.columns.get("T_p", np.full(len(Hs), np.nan)), weather.columns.get("come_from")
    if ship is None:
        notes.append(free_to_turn(come_from is not None))
    elif come_from is None:
        advice = next(
            (note for note in weather.notes if "direction" in note),
            "Leave --ship out, or give a forecast with directions.",
        )
        raise WeatherError(
            f"{weather.source}: gives no direction of waves, and the heading is held at {show(ship, 'angle')}. {advice}"
        )
    return Hs, Tp, come_from, notes
