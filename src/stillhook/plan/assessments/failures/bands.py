"""What follows by depth where AHC is lost: the sea up to which loads stay within limits, depths that must not be
stopped in, and what to do in every band of depth."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.assessments.failures.depths import Braked, time_between
from stillhook.plan.assessments.failures.judging import TOUCH_DOWN, rules_of_failure
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.limits import limits_in
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.time_domain.lowering import SeaState
from stillhook.spec.lift.phase import APART, OFF_DECK, ON_DECK, PhaseKind

HOLD, HOIST, LOWER, NOT_ASSESSED = "hold", "hoist", "lower-on", "not-assessed"
ROUNDED = 1e-3
"""Part by which a limit may be below the sea of the plan's own limit and be the same."""


def touch_down_rule(plan: LiftPlan) -> tuple[str, float] | None:
    """Rule of the speed at touch-down, and its limit [m/s]; None where the plan has no landing, or no such rule."""
    phase = next((p for p in plan.phases if p.kind is PhaseKind.LANDING), None)
    rules = [] if phase is None else [r for r in rules_of_failure(plan, phase) if r.rule.quantity == TOUCH_DOWN]
    return (rules[0].rule.key, rules[0].limit) if rules else None


def without_ahc(
    plan: LiftPlan,
    places: Sequence[Braked],
    seas: Sequence[SeaState],
    heights: FloatArray,
    fallen: float,
    *,
    fast: bool,
) -> dict[str, Any]:
    """The payload on the brake, by the frequency-domain method: least seas from which loads, or touch-down, are beyond
    a limit in the phases in which AHC can be lost; how far the payload moves down near the seabed; and every depth.

    heights (c,) of the plan's own limit in the columns of the table [m], 0 where it is not asked for; fallen: how far
    the payload moved down in runs [m], 0 without any; fast: whether it touched down faster there than it may.
    """
    columns = plan.environment.table().columns
    touch = touch_down_rule(plan)
    compensated = {p.name for p in plan.phases if p.compensated}
    lost = [*(place for place in places if place.phase in compensated), *_at_decks(plan)]
    loads = [
        row
        for place in lost
        for row in [_least(place, [k for k in place.Hs if touch is None or k != touch[0]], columns)]
        if row
    ]
    landing = [place for place in lost if touch is not None and touch[0] in place.Hs]
    touches = [row for place in landing for row in [_least(place, [touch[0]] if touch else [], columns)] if row]
    nothing = {"Hs_from": None}
    steady = {
        "method": "frequency",
        "highest": max(plan.environment.Hs),
        "loads": min(loads, key=lambda row: row["Hs_from"], default=nothing),
        "touch_down": min(touches, key=lambda row: row["Hs_from"], default=nothing)
        | {"limit": None if touch is None else touch[1], "by_period": _by_period(landing, touch, seas, columns)},
    }
    fall = max((max(float(np.nanmax(place.fall)), fallen) for place in landing), default=None)
    beyond = fast or _lands_too_fast(landing, touch, heights)
    return {
        "steady": steady,
        "near_seabed": {
            "fall": fall,
            "touch_down_beyond": beyond,
            "depth": plan.depth - fall if beyond and fall is not None else None,
        },
        "by_depth": [_row(place, touch, columns, heights) for place in places],
    }


def _at_decks(plan: LiftPlan) -> list[Braked]:
    """Lift-offs and set-downs at a deck that moves otherwise, whose compensation is lost: by the closed form."""
    seas, result = plan.environment.table(), []
    for phase in plan.phases:
        if phase.kind in APART and phase.compensated and phase.z_end is not None:
            limits = limits_in(plan, closed_form(plan, phase, seas))
            known = {key: Hs for key, Hs in limits.Hs.items() if not np.isnan(Hs).all()}
            unknown = np.full(len(seas.columns), np.nan)
            result.append(Braked(phase.name, phase.z_end, math.nan, known, unknown))
    return result


def _least(place: Braked, rules: Sequence[str], columns: Sequence[Any]) -> dict[str, Any] | None:
    """Least height of some rules over all columns; None where none is passed up to the highest sea."""
    exceeded = [
        (float(Hs[i]), key, i)
        for key in rules
        for Hs in [place.Hs[key]]
        for i in [int(np.nanargmin(Hs))]
        if np.isfinite(Hs[i])
    ]
    if not exceeded:
        return None
    Hs, key, i = min(exceeded)
    row = {"Hs_from": Hs, "rule": key, "phase": place.phase, "z": place.z}
    return row | {"Tp": float(columns[i][0]), "beta": float(columns[i][1])}


def _lands_too_fast(places: Sequence[Braked], touch: tuple[str, float] | None, heights: FloatArray) -> bool:
    """Whether touch-down on the brake is beyond its limit in the sea of the plan's own limit of any column."""
    return touch is not None and any(_beyond(place, touch[:1], heights) for place in places if touch[0] in place.Hs)


def _by_period(
    landing: Sequence[Braked], touch: tuple[str, float] | None, seas: Sequence[SeaState], columns: Sequence[Any]
) -> list[dict[str, Any]]:
    """Height from which touch-down is beyond, at the worst heading of every period, beside the sea of the limit."""
    rows = []
    for sea in seas if touch and landing else ():
        alike = [k for k, (Tp, _, _) in enumerate(columns) if float(Tp) == sea.Tp]
        Hs = min(float(np.nanmin(place.Hs[touch[0]][alike])) for place in landing) if touch else math.inf
        rows.append({"Tp": sea.Tp, "beta": sea.beta, "Hs_limit": sea.Hs, "Hs_from": Hs if math.isfinite(Hs) else None})
    return rows


def _beyond(place: Braked, rules: Sequence[str], heights: FloatArray) -> bool:
    """Whether the sea of the plan's own limit is beyond a rule in any column."""
    return bool(((heights > 0.0) & (place.least(rules) < heights * (1.0 - ROUNDED))).any())


def _row(place: Braked, touch: tuple[str, float] | None, columns: Sequence[Any], heights: FloatArray) -> dict[str, Any]:
    loads = [key for key in place.Hs if touch is None or key != touch[0]]
    least = _least(place, loads, columns) or {"Hs_from": None, "rule": None}
    return {
        "phase": place.phase,
        "z": place.z,
        "T_0": place.T_0,
        "ok": not _beyond(place, loads, heights),
        **{key: least[key] for key in ("Hs_from", "rule")},
    }


def stops(
    plan: LiftPlan,
    places: Sequence[Braked],
    heights: FloatArray,
    cases: Sequence[Mapping[str, Any]],
    near_seabed: Mapping[str, Any],
) -> list[dict[str, Any]]:
    """Bands of depth in which the payload must not be stopped in the seas of the limit, from the top: between places
    that are inside, so that what was not looked at counts as beyond."""
    touch = touch_down_rule(plan)
    deep = [(p.z, p.phase, _beyond(p, [k for k in p.Hs if touch is None or k != touch[0]], heights)) for p in places]
    result = [_band(run, deep, "frequency") for run in _runs_of(deep)]
    zone = next((c for c in cases if c["key"] == "wave-zone-stop"), {})
    rows = zone.get("by_depth", [])
    alike = [row for row in zone.get("rows", []) if rows and row["Tp"] == rows[0]["Tp"]]
    rows = sorted([*rows, *alike], key=lambda row: -row["z"])
    held = [(r["z"], r["phase"], (r["used"] or 0.0) > 1.0) for r in rows]
    result += [_band(run, held, "twin") for run in _runs_of(held)]
    result.sort(key=lambda band: -band["top"])
    if near_seabed["depth"] is not None:
        last = next(p.name for p in reversed(plan.phases) if p.kind is PhaseKind.LANDING)
        by = "frequency" if _lands_too_fast(places, touch, heights) else "twin"
        ends = {"top": -near_seabed["depth"], "bottom": -plan.depth}
        result.append({"phase": last, **ends, "reason": "touch-down", "method": by})
    return result


Spot = tuple[float, str, bool]
"""Height [m], phase, and whether a stop there is beyond a limit."""


def _runs_of(spots: Sequence[Spot]) -> Iterator[list[int]]:
    """Numbers of neighbours that are beyond, from the top."""
    for beyond, group in groupby(range(len(spots)), key=lambda i: spots[i][2]):
        if beyond:
            yield list(group)


def _band(run: Sequence[int], spots: Sequence[Spot], method: str) -> dict[str, Any]:
    """The band about places that are beyond, out to the next ones that are inside."""
    top, bottom = spots[max(run[0] - 1, 0)][0], spots[min(run[-1] + 1, len(spots) - 1)][0]
    return {"phase": spots[run[0]][1], "top": top, "bottom": bottom, "reason": "loads", "method": method}


def actions(
    plan: LiftPlan, no_stop: Sequence[Mapping[str, Any]], cases: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """What to do by phase and band of depth where AHC is lost, from the top: hold where the payload may hang on the
    brake; elsewhere hoist or lower on, whichever leads out of the band sooner; the time is the longest of the band [s],
    0 where the payload is safe as it hangs. A payload is never lowered on to the seabed. In the wave zone nothing is
    said where no stop was run."""
    stopped = next((c for c in cases if c["key"] == "wave-zone-stop"), {}).get("by_depth")
    result: list[dict[str, Any]] = []
    for phase in plan.phases:
        if phase.held or phase.kind is None or phase.z_start is None or phase.z_end is None:
            continue
        if phase.kind in (*OFF_DECK, *ON_DECK, PhaseKind.SEABED_LIFT_OFF):
            continue
        top, bottom = max(phase.z_start, phase.z_end), min(phase.z_start, phase.z_end)
        if phase.kind is PhaseKind.SPLASH and not stopped:
            result.append(_action(phase.name, top, bottom, NOT_ASSESSED, None))
        else:
            result += _of_way(plan, phase.name, top, bottom, no_stop)
    return result


def _of_way(
    plan: LiftPlan, name: str, top: float, bottom: float, no_stop: Sequence[Mapping[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Bands of one way."""
    at = top
    for band in no_stop:
        upper, lower = min(band["top"], top), max(band["bottom"], bottom)
        if lower > upper or (lower == upper and top != bottom) or upper < bottom or lower > top:
            continue
        if at > upper:
            yield _action(name, at, upper, HOLD, 0.0)
        yield from _out_of(plan, name, upper, lower, band)
        at = lower
    if at > bottom or (top == bottom and at == top and not _inside(top, no_stop)):
        yield _action(name, at, bottom, HOLD, 0.0)


def _inside(z: float, no_stop: Sequence[Mapping[str, Any]]) -> bool:
    return any(band["bottom"] <= z <= band["top"] for band in no_stop)


def _out_of(plan: LiftPlan, name: str, upper: float, lower: float, band: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Ways out of a band for its part between two heights: at the seabed up alone."""
    if band["bottom"] <= -plan.depth:
        yield _action(name, upper, lower, HOIST, time_between(plan, lower, band["top"]), band["top"])
        return
    middle = _turn(plan, band)
    if upper > middle or upper == lower:
        end = max(lower, middle)
        yield _action(name, upper, end, HOIST, time_between(plan, end, band["top"]), band["top"])
    if lower < middle:
        begin = min(upper, middle)
        yield _action(name, begin, lower, LOWER, time_between(plan, begin, band["bottom"]), band["bottom"])


def _turn(plan: LiftPlan, band: Mapping[str, Any]) -> float:
    """Height of a band from which both ways out take as long [m]."""
    top, bottom = float(band["top"]), float(band["bottom"])
    for _ in range(40):
        z = 0.5 * (top + bottom)
        if time_between(plan, z, band["top"]) < time_between(plan, z, band["bottom"]):
            top = z
        else:
            bottom = z
    return 0.5 * (top + bottom)


def _action(
    name: str, top: float, bottom: float, action: str, time: float | None, to: float | None = None
) -> dict[str, Any]:
    return {"phase": name, "top": top, "bottom": bottom, "action": action, "time": time, "to": to}
