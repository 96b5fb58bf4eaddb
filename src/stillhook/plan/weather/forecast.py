"""A forecast compared with a plan: under each alternative, may the lift start now, and if not, when.

A start is a go if for T_R from it on the forecast height stays within OP_WF of its period and direction
(`LimitTable.at`), and every additional limit (wind, say) holds. Cells of the plan without an OP_WF are
never a go. A vessel free to turn keeps one heading for T_R, the best one (`stillhook.plan.weather.value`); limits
in addition that depend on beta need a heading that is held.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import WeatherError
from stillhook.plan.result import Credit, PlanResult
from stillhook.plan.weather.limit_table import KeptHeadings, LimitTable
from stillhook.plan.weather.records import free_to_turn, systems
from stillhook.units import show
from stillhook.weather.forecast import Bound, bounds, reason_against, rows_of, started, starts_of
from stillhook.weather.limit_text import Limit, inside
from stillhook.weather.series import Weather

OP_WF = "Hs <= OP_WF of the plan"
"""What the plan's own limit is called where a start names the limit that governs."""


def plan_forecast(
    result: PlanResult,
    weather: Weather,
    *,
    limits: Sequence[Limit] = (),
    credit: Credit = "credited",
    start: np.datetime64 | None = None,
    horizon: float = 72.0 * 3600.0,
    ship: float | None = None,
) -> dict[str, Any]:
    """Go or no-go of every alternative of a plan, by name [SI]; start, horizon [s] and limits as in
    `stillhook.weather.forecast`.

    ship: where the bow points, clockwise from north [rad]; None: free to turn. Errors: WeatherError where the forecast
    does not give the height, or no direction though a heading is held.
    """
    operation = result.facts["operation"]
    T_R = float(operation["T_R"])
    rows = rows_of(weather, start, horizon)
    of_both = systems(weather, result.facts.get("settings", {}).get("swell"))
    weather = of_both.weather
    Hs, Tp, come_from, notes = _seas(weather, ship)
    swell_most = float(operation.get("swell_wf") or math.nan)
    more, covered = inside(limits, weather, ship)
    other_bounds = bounds(weather, limits, ship)
    entries = []
    for alternative in result.alternatives:
        table = _table(result, alternative.value, credit)
        limit = KeptHeadings.of(table, len(weather), come_from, ship).limits(table, (Tp,))
        valid = covered & np.isfinite(Hs)
        workable = valid & more & (Hs <= limit) & (limit > 0.0) & of_both.within(ship, len(limit), swell_most)
        starts = starts_of(weather, workable, valid, (Bound(OP_WF, Hs, limit), *other_bounds), rows, T_R)
        restricted = bool(operation["weather_restricted"])
        go = restricted and bool(starts[0].go)
        first = next((s for s in starts if s.go), None) if restricted else None
        reason = "not weather restricted: no forecast lets it start"
        if restricted:
            reason = "" if go else reason_against(starts[0], T_R, weather)
        when = None if first is None else started([first])[0]["time"]
        one = {"alternative": alternative.value, "go": go, "first_start": when, "reason": reason}
        entries.append(
            one | {"n_starts": len(starts), "n_go": sum(s.go is True for s in starts), "starts": started(starts)}
        )
    return {key: operation[key] for key in ("T_POP", "T_R", "weather_restricted")} | {
        "plan": result.name,
        "file": weather.source,
        "credit": credit,
        "limits": [limit.text for limit in limits],
        "horizon": horizon,
        "ship": "free" if ship is None else ship,
        "alternatives": entries,
        "notes": [*of_both.notes, *notes, *of_both.outside(swell_most), *weather.notes],
    }


def _table(result: PlanResult, alternative: str, credit: Credit) -> LimitTable:
    """OP_WF of one alternative as it is read on board."""
    data = result.data
    op_wf = data["op_wf"].sel(credit=credit, alternative=alternative).transpose("heading", "period").values
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
