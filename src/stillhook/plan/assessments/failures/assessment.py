"""The failure cases of a plan, and what follows for its decision page and its limits card."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.errors import StillhookError
from stillhook.plan.assessments.failures.bands import actions, stops, touch_down_rule, without_ahc
from stillhook.plan.assessments.failures.cases import AHC_TRIP, BOTTLES, DRIFT, FAILURES, OVERREAD, Failure
from stillhook.plan.assessments.failures.depths import braked, with_low_weight
from stillhook.plan.assessments.failures.drive_off import drive_off
from stillhook.plan.assessments.failures.judging import (
    FAILED_RUN,
    HALF_HOUR,
    height_from,
    next_height,
    row_of,
    still,
    used,
    worst,
)
from stillhook.plan.assessments.failures.runs import (
    AFTER,
    HELD_RUNS,
    HOIST,
    HOLD,
    MOMENTS,
    TRAINS,
    FailureRuns,
    Request,
)
from stillhook.plan.assessments.failures.wave_zone import heights_in_wave_zone, reversal_time, worst_in_wave_zone
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.tiers.frequency import forcing_at
from stillhook.plan.tiers.other_vessel import hook_on_deck
from stillhook.plan.tiers.time_domain.cells import Cells
from stillhook.plan.tiers.time_domain.lowering import KINDS, SeaState
from stillhook.spec.lift.joining import STANDS
from stillhook.spec.lift.phase import APART, Phase, PhaseKind

OK, NOT_OK, NOT_ASSESSED, NOT_APPLICABLE = "ok", "not-ok", "not-assessed", "does-not-apply"
TWIN, CLOSED_FORM, FREQUENCY = "twin", "closed-form", "frequency"
LEAST_HEIGHT = 0.05
"""Lowest limit of a column that is a sea [m]."""


@dataclass(eq=False)
class Work:
    """An assessment on its way."""

    state: PlanState
    progress: Parts
    runs: FailureRuns
    seas: Sequence[SeaState]
    tried: dict[tuple[str, str, float | None, float, float], dict[float, float]] = field(default_factory=dict)

    @property
    def plan(self) -> LiftPlan:
        """The plan."""
        return self.runs.plan

    @cached_property
    def places(self) -> list[tuple[Phase, float | None]]:
        """Phases, and heights of them (None: the phase's worst), in which the winch can fail: where it moves or follows
        the tip. A stop at depth that is like the stand-off is not run twice; of the first way down under water its top,
        where the wire is shortest, is looked at besides."""
        phases = [p for p in self.plan.phases if p.kind in KINDS and not p.held and (p.compensated or p.speed)]
        stand_off = [p for p in phases if p.kind is PhaseKind.STAND_OFF]
        deepest = min((p.z_end or 0.0 for p in stand_off), default=0.0)
        result: list[tuple[Phase, float | None]] = []
        for phase in phases:
            if (
                phase.kind is PhaseKind.DEEP
                and stand_off
                and abs((phase.z_end or 0.0) - deepest) < ALIKE * abs(deepest)
            ):
                continue
            if phase.kind is PhaseKind.LOWERING and not any(p.kind is PhaseKind.LOWERING for p, _ in result):
                result.append((phase, max(phase.z_start or 0.0, phase.z_end or 0.0)))
            result.append((phase, None))
        return result

    def places_of(self, failure: Failure) -> list[tuple[Phase, float | None]]:
        """Places in which a failure says something; none on a winch that cannot have it."""
        if failure.of_crane is not None and failure.of_crane(self.plan.crane) is None:
            return []
        return [(p, z) for p, z in self.places if p.compensated or not failure.only_compensated]

    def at(
        self, places: Sequence[tuple[Phase, float | None]], failure: Failure, seas: Sequence[SeaState]
    ) -> list[Request]:
        """A failure in places and seas."""
        return [Request(failure.key, phase.name, sea, z) for phase, z in places for sea in seas]

    def requests(self, failure: Failure) -> list[Request]:
        """A failure in all its places and seas; at a stop before a landing in those of the fastest tip alone."""
        return [
            each
            for place in self.places_of(failure)
            for each in self.at([place], failure, self.fastest(place[0]) if self._like_landing(place[0]) else self.seas)
        ]

    def _like_landing(self, phase: Phase) -> bool:
        """Whether a phase stands over the seabed before a landing, which is looked at more closely."""
        return phase.kind in STANDS and any(p.kind is PhaseKind.LANDING and p.compensated for p in self.plan.phases)

    def after_trip(
        self, failure: Failure, severe: Mapping[tuple[str, float | None], Mapping[str, Any]]
    ) -> list[Request]:
        """A failure where the trip is the worst; on a winch that does not follow the tip in the seas of the fastest
        tip."""
        result = []
        for phase, z in self.places_of(failure):
            if self._like_landing(phase) and not failure.stands:
                continue
            row = severe.get((phase.name, z))
            seas = self.seas[:1] if row is None else [sea_of(row)]
            if not phase.compensated:
                seas = self.fastest(phase)
            result += self.at([(phase, z)], failure, seas)
        return result

    def fastest(self, phase: Phase) -> list[SeaState]:
        """The `FASTEST` seas of the limit in which the tip moves fastest, at a deck against that."""
        at = self.plan.tip_of(phase)
        seas = Seas(*(np.array(column) for column in zip(*self.seas, strict=True)))
        v = forcing_at(self.plan, seas, at.x, at.y).deviation(1)
        if phase.kind in APART:
            v = hook_on_deck(self.plan, phase, seas)[1]
        return [self.seas[int(i)] for i in np.argsort(-v)[:FASTEST]]

    def judge(self, wanted: Sequence[Request], progress: Progress | None = None) -> None:
        """Run what is wanted, and where a limit is passed lower seas as well, twice at the most."""
        self.runs.request(wanted, progress)
        for _ in range(2):
            more = []
            for each in wanted:
                points = self.points(each)
                below = [Hs for Hs, part_used in points.items() if part_used > 1.0]
                if below and not any(part_used <= 1.0 for part_used in points.values()):
                    Hs = min(below)
                    more.append(each._replace(sea=each.sea._replace(Hs=self._lower(each, Hs, points[Hs]))))
            self.runs.request(more)

    def _lower(self, each: Request, Hs: float, part: float) -> float:
        top = worst(used(self.plan, each._replace(sea=each.sea._replace(Hs=Hs)), self._numbers(each, Hs)))
        rest = 0.0 if top is None else still(self.plan, self.plan.phase(each.phase), top.rule)
        return next_height(Hs, part, min(rest, 0.9))

    def _numbers(self, each: Request, Hs: float) -> dict[str, FloatArray]:
        return self.runs.runs[each._replace(sea=each.sea._replace(Hs=Hs))]

    def points(self, each: Request) -> dict[float, float]:
        """Heights at which a request's column was run -> the most that is used there of any limit."""
        result = {}
        for other, numbers in self.runs.runs.items():
            if other._replace(sea=each.sea) == each and other.sea[1:] == each.sea[1:]:
                top = worst(used(self.plan, other, numbers))
                result[other.sea.Hs] = 0.0 if top is None else top.used
        return result

    def rows(self, wanted: Sequence[Request]) -> list[dict[str, Any]]:
        """Worst of every request as plain data, with the height from which a limit is passed (None: not up to the
        limit)."""
        result = []
        for each in wanted:
            row = row_of(self.plan, self.runs, each)
            rest = 0.0 if row["rule"] is None else still(self.plan, self.plan.phase(each.phase), row["rule"])
            Hs_from = height_from(self.points(each), min(rest, 1.0))
            result.append(
                {"phase": each.phase, "z": each.z, **row, "Hs_from": Hs_from if math.isfinite(Hs_from) else None}
            )
        return result


FASTEST = 3
"""Seas in which a stop of a winch that lowers without compensation is run."""
RUNS_AWAY = 1.5
"""Motion of the payload over that on the brake in the same waves from which a winch that goes on with a fault runs away
with it [-]. Assumed."""
ALIKE = 0.02
"""Part of the depth by which a stop at depth and the stand-off may differ and be alike."""


def assess(state: PlanState, progress: Progress) -> Mapping[str, Any] | None:
    """Failure cases of a plan as plain data [SI]; with runs of the twin where the plan has them, else what other
    methods give, and the rest as not assessed."""
    if state.last is Tier.CLOSED_FORM:
        return None
    alternative = state.answered.shown()
    seas = seas_of_limit(state, alternative)
    parts = Parts(progress, {"depths": 4.0, "trip": 12.0, "others": 6.0, "wave zone": 5.0})
    work = Work(state, parts, FailureRuns(Cells(state.plan, state.execution), alternative), seas)
    facts: dict[str, Any] = {
        "alternative": alternative.value,
        "seas": [{"Tp": s.Tp, "beta": s.beta, "Hs": s.Hs} for s in seas],
        "moments": MOMENTS,
        "trains": TRAINS,
        "after": AFTER,
        "held_runs": HELD_RUNS,
        "assumed": {"drift": DRIFT / 3600.0, "load_cell_over": OVERREAD, "bottles": BOTTLES, "hold": HALF_HOUR},
    }
    parts("depths")
    heights = np.zeros(len(state.plan.environment.table().columns))
    for i, (Tp, beta, _) in enumerate(state.plan.environment.table().columns):
        heights[i] = next((s.Hs for s in seas if (s.Tp, s.beta) == (float(Tp), float(beta))), 0.0)
    places = with_low_weight(state.plan, braked(state.plan, heights), heights) if seas else []
    cases = list(_cases(work)) if seas else []
    touch = touch_down_rule(state.plan)
    fast = bool(touch and too_fast(cases, touch[1]))
    facts |= without_ahc(state.plan, places, seas, heights, fallen(state.plan, cases), fast=fast)
    cases = [with_touch_down(c, facts["steady"]) if c["key"] in STAND else c for c in cases]
    facts["cases"] = [*cases, drive_off(state.plan, seas)]
    facts["no_stop"] = stops(state.plan, places, heights, cases, facts["near_seabed"])
    facts["actions"] = actions(state.plan, facts["no_stop"], cases)
    facts["page"] = page(facts)
    progress(1.0)
    return facts


def fallen(plan: LiftPlan, cases: Sequence[Mapping[str, Any]]) -> float:
    """How far the payload moved down from a stop over the seabed in runs in which the winch comes to its brake [m]."""
    rows = [row for case in cases if case["key"] in STAND for row in case["rows"] if row["z_min"] is not None]
    stops_at = {p.name: p.z_end for p in plan.phases if p.kind is PhaseKind.STAND_OFF and p.z_end is not None}
    return max((stops_at[row["phase"]] - row["z_min"] for row in rows if row["phase"] in stops_at), default=0.0)


STAND = tuple(f.key for f in FAILURES if f.stands)
"""Cases in which the winch comes to its brake."""


def too_fast(cases: Sequence[Mapping[str, Any]], limit: float) -> list[float]:
    """Heights [m] from which runs in which the winch comes to its brake touch the seabed faster than a limit [m/s];
    where another rule is passed sooner, from there."""
    rows = [row for case in cases if case["key"] in STAND for row in case["rows"] if "at_deck" not in row]
    fast = [row for row in rows if row["v_landed"] is not None and row["v_landed"] > limit]
    return [row["Hs"] if row["Hs_from"] is None else row["Hs_from"] for row in fast]


def seas_of_limit(state: PlanState, alternative: Alternative) -> list[SeaState]:
    """The sea of the claimable limit in every period at the heading in which it is the lowest, up to the highest sea of
    the table; periods in which nothing is within limits are left out."""
    table, axes = state.answered.claimed, state.answered.axes
    Hs = np.minimum(table.Hs[axes.alternatives.index(alternative)], max(state.plan.environment.Hs))
    seas = []
    for j, Tp in enumerate(axes.periods):
        if np.isnan(Hs[:, j]).all():
            continue
        i = int(np.nanargmin(Hs[:, j]))
        height = math.floor(float(Hs[i, j]) * 100.0) / 100.0
        if height >= LEAST_HEIGHT:
            seas.append(SeaState(height, float(Tp), float(axes.headings[i])))
    return seas


def _cases(work: Work) -> Iterator[dict[str, Any]]:
    """All cases but those of the vessel's place."""
    if work.runs.alternative.twin and work.state.twin is not None:
        yield from _of_winch(work)
    else:
        yield from (
            {"key": f.key, "title": f.title, "verdict": NOT_ASSESSED, "reason": "no-runs", "rows": []} for f in FAILURES
        )
    progress = work.progress("wave zone")
    yield _stop_in_wave_zone(work, progress)
    yield _reversal(work)


def _of_winch(work: Work) -> Iterator[dict[str, Any]]:
    """The trip is run in every period, other failures of the winch where the trip is the worst, all together."""
    trip = next(f for f in FAILURES if f.key == AHC_TRIP)
    first = _case(work, trip, work.requests(trip), work.progress("trip"))
    severe: dict[tuple[str, float | None], Mapping[str, Any]] = {}
    for row in first["rows"]:
        at = row["phase"], row["z"]
        if row["used"] is not None and (at not in severe or row["used"] > severe[at]["used"]):
            severe[at] = row
    wanted = {f.key: work.after_trip(f, severe) for f in FAILURES if f is not trip}
    progress = work.progress("others")
    with suppress(StillhookError):  # each case is run by itself then, and says so
        work.runs.request([each for requests in wanted.values() for each in requests], progress)
    for failure in FAILURES:
        case = first if failure is trip else _case(work, failure, wanted[failure.key])
        yield case if failure.stands else _running_away(case, severe)


def _running_away(case: dict[str, Any], severe: Mapping[tuple[str, float | None], Mapping[str, Any]]) -> dict[str, Any]:
    """A case in which the winch goes on with a fault: not OK either where it moves the payload far more than the waves
    do on the brake."""
    for row in case["rows"]:
        on_brake = severe.get((row["phase"], row["z"]), {}).get("load_pp")
        moved = row["load_pp"] is not None and on_brake is not None and row["load_pp"] > RUNS_AWAY * on_brake
        row["runs_away"] = bool(moved)
    away = [row for row in case["rows"] if row["runs_away"]]
    if not away or case["verdict"] == NOT_OK:
        return case
    return case | {"verdict": NOT_OK, "reason": "runs-away", "worst": max(away, key=lambda row: row["load_pp"])}


def with_touch_down(case: Mapping[str, Any], steady: Mapping[str, Any]) -> dict[str, Any]:
    """A case in which the winch stands on its brake near the seabed, with the touch-down there: not OK where it is
    beyond its limit in the seas of the plan's own."""
    beyond = [r for r in steady["touch_down"]["by_period"] if r["Hs_from"] is not None and r["Hs_from"] < r["Hs_limit"]]
    limit = steady["touch_down"]["limit"]
    fast = limit is not None and too_fast([case], limit)
    result = {**case, "loads": case["verdict"], "touch_down": NOT_OK if beyond or fast else OK}
    if not beyond or case["verdict"] == NOT_ASSESSED:
        return result
    least = min([r["Hs_from"] for r in beyond] + [x for x in [case.get("Hs_from")] if x is not None])
    return result | {"verdict": NOT_OK, "Hs_from": least}


def sea_of(row: Mapping[str, Any]) -> SeaState:
    """The sea of a row."""
    return SeaState(row["Hs"], row["Tp"], row["beta"])


def _case(work: Work, failure: Failure, wanted: Sequence[Request], progress: Progress | None = None) -> dict[str, Any]:
    """One failure of the winch."""
    case: dict[str, Any] = {"key": failure.key, "title": failure.title, "basis": TWIN, "rows": []}
    if failure.of_crane is not None and failure.of_crane(work.plan.crane) is None:
        return case | {"verdict": NOT_APPLICABLE, "reason": "no-gas"}
    if not wanted:
        return case | {"verdict": NOT_APPLICABLE, "reason": "no-phase"}
    try:
        work.judge(wanted, progress)
    except StillhookError as e:
        return case | {"verdict": NOT_ASSESSED, "reason": "refused", "text": str(e)}
    return case | judged(work.rows(wanted))


def judged(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Verdict of rows: that of the worst of them."""
    judged_rows = [row for row in rows if row["used"] is not None]
    if not judged_rows:
        return {"verdict": NOT_ASSESSED, "reason": "no-rule", "rows": list(rows)}
    top = max(judged_rows, key=lambda row: row["used"])
    beyond = [row["Hs_from"] for row in judged_rows if row["Hs_from"] is not None]
    return {
        "verdict": OK if top["used"] <= 1.0 and top["rule"] != FAILED_RUN else NOT_OK,
        "worst": top,
        "Hs_from": min(beyond, default=None),
        "rows": list(rows),
    }


def _stop_in_wave_zone(work: Work, progress: Progress) -> dict[str, Any]:
    """The payload stopped in the wave zone for half an hour: at the submergence at which the slings lose most, in every
    period, and at others in that in which it is the worst; the worst of all counts."""
    case: dict[str, Any] = {"key": "wave-zone-stop", "title": "Stop in the wave zone for half an hour", "basis": TWIN}
    phase = passage(work.plan)
    if phase is None:
        return case | {"verdict": NOT_APPLICABLE, "reason": "no-passage", "rows": []}
    if work.state.twin is None:
        return case | {"verdict": NOT_ASSESSED, "reason": "no-runs", "rows": []}
    wanted = [Request(HOLD, phase.name, sea, worst_in_wave_zone(work.plan, phase, sea)) for sea in work.seas]
    work.judge(wanted, progress)
    result = judged(work.rows(wanted))
    sea = next(s for s in work.seas if s.Tp == result["worst"]["Tp"])
    by_depth = [Request(HOLD, phase.name, sea, z) for z in heights_in_wave_zone(work.plan, phase)]
    work.runs.request(by_depth)
    rows = work.rows(by_depth)
    return case | judged([*result["rows"], *rows]) | {"rows": result["rows"], "by_depth": rows}


def passage(plan: LiftPlan) -> Phase | None:
    """The phase that passes the surface."""
    return next((p for p in plan.phases if p.kind is PhaseKind.SPLASH and not p.held and p.speed), None)


def _reversal(work: Work) -> dict[str, Any]:
    """The payload hoisted back through the surface, and how long that takes from any depth."""
    case: dict[str, Any] = {"key": "reversal", "title": "Reversal: hoisting back to the deck", "basis": TWIN}
    case |= {"time": reversal_time(work.plan)}
    phase = passage(work.plan)
    if phase is None or work.state.twin is None:
        return case | {"verdict": NOT_ASSESSED, "reason": "no-runs" if phase is not None else "no-passage", "rows": []}
    wanted = [Request(HOIST, phase.name, sea) for sea in work.seas]
    work.judge(wanted)
    return case | judged(work.rows(wanted))


def page(facts: Mapping[str, Any]) -> dict[str, Any]:
    """What the decision page says: AHC lost in the same seas, and the verdict of every case."""
    trip = next((c for c in facts["cases"] if c["key"] == AHC_TRIP), None)
    fails = trip is not None and trip.get("loads") == NOT_OK
    by_trip = [row["Hs_from"] for row in trip["rows"]] if trip is not None and fails else []
    steady, touch = facts["steady"]["loads"], facts["steady"]["touch_down"]
    loads = [x for x in (*by_trip, steady["Hs_from"]) if x is not None]
    fast = [] if touch["limit"] is None else too_fast(facts["cases"], touch["limit"])
    landed = [x for x in (*fast, touch["Hs_from"]) if x is not None]
    return {
        "loads_to": min(loads, default=None),
        "loads_highest": facts["steady"]["highest"],
        "trip_run_to": max((sea["Hs"] for sea in facts["seas"]), default=None),
        "touch_down_from": min(landed, default=None),
        "touch_down_limit": touch["limit"],
        "no_stop_below": facts["near_seabed"]["depth"],
        "clearance": facts["near_seabed"]["fall"],
        "verdicts": {c["key"]: c["verdict"] for c in facts["cases"]},
    }
