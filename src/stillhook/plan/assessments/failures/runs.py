"""Runs of the twin with a failure: phases of a plan that are broken off by it at one of many moments of the same waves,
and the payload held, or hoisted, in the wave zone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.lowering.case import Case
from stillhook.plan.assessments.failures.cases import FAILURES, Failure
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.tiers.time_domain.cells import Cells, seed_of
from stillhook.plan.tiers.time_domain.lowering import (
    BLOCK,
    HANGS,
    ROOM,
    SETTLE,
    Course,
    SeaState,
    Winch,
    course_of,
    in_sea,
    lowering_of,
    machine_of,
    winch_of,
)
from stillhook.spec.crane import Crane
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase, PhaseKind, WinchMode

MOMENTS, TRAINS = 32, 4
"""Moments at which a failure begins, and wave trains that they are of."""
AFTER = 60.0
"""Time after a failure that is run [s]: some ten periods of the load on its wire."""
BEFORE = 10.0
"""Time before the first moment of a phase that stands or goes a long way [s]."""
LEAST = 0.1
"""Shortest phase of a programme before a failure [s]."""
LONGEST_APPROACH = 60.0
"""Longest way of a landing on which failures begin [s]."""
HELD_RUNS = 16
"""Runs of a payload that is held, or hoisted, in the wave zone in one sea."""
NUMBERS = (
    "duration",
    "F_w_max",
    "F_sling_min",
    "DAF",
    "snap",
    "load_pp",
    "v_load_min",
    "v_load_max",
    "z_load_min",
    "v_landed",
    "v_hit_max",
    "sling_slack_time",
)
"""Numbers of a run after the failure."""
Numbers = dict[str, FloatArray]
BY_KEY = {failure.key: failure for failure in FAILURES}


class Request(NamedTuple):
    """What is run: a failure, or "hold" or "hoist" in the wave zone; in which phase and sea; z height of the underside
    at which it stands [m], None for that of the phase."""

    failure: str
    phase: str
    sea: SeaState
    z: float | None = None


HOLD, HOIST = "hold", "hoist"


@dataclass(eq=False)
class FailureRuns:
    """All runs of a plan's failures so far, under the alternative whose limits are shown."""

    cells: Cells
    alternative: Alternative
    runs: dict[Request, Numbers] = field(default_factory=dict)

    @property
    def plan(self) -> LiftPlan:
        """The plan."""
        return self.cells.plan

    def request(self, wanted: Sequence[Request], progress: Progress | None = None) -> None:
        """Run what is wanted and not there yet, all of it together."""
        missing = [each for each in dict.fromkeys(wanted) if each not in self.runs]
        made = [self._cases(each) for each in missing]
        cranes = [crane for crane, cases, _ in made for _ in cases]
        if not cranes:
            return
        data = self.cells.simulated(cranes, [case for _, cases, _ in made for case in cases], progress)
        start = 0
        for each, (_, cases, counts) in zip(missing, made, strict=True):
            rows = slice(start, start + len(cases))
            self.runs[each] = {name: data[f"phase_{name}"].values[rows, counts] for name in NUMBERS}
            start += len(cases)

    def _cases(self, each: Request) -> tuple[Crane, list[Case], int]:
        """Crane, runs, and the number of the phase that counts."""
        phase = self.plan.phase(each.phase)
        if each.failure in (HOLD, HOIST):
            return self._in_wave_zone(each, phase)
        return self._broken_off(each, phase, BY_KEY[each.failure])

    def _in_wave_zone(self, each: Request, phase: Phase) -> tuple[Crane, list[Case], int]:
        """The payload held at a height, or hoisted all the way that the phase lowers it."""
        winch = Winch()
        course = (
            standing(phase, each.z or 0.0) if each.failure == HOLD else course_of(self.plan, reversed_(phase), winch)
        )
        crane, mode = self.plan.once(machine_of, winch)
        calm = lowering_of(self.plan, phase, course, mode)
        held = phase.model_copy(update={"hold": course.counted})
        seeds = [seed_of(each.sea, k, self.cells.execution.seed) for k in range(1, HELD_RUNS + 1)]
        one = in_sea(self.plan, held, winch, course, calm, each.sea, seeds[0])
        return crane, [replace(one, seed=seed) for seed in seeds], course.counts

    def _broken_off(self, each: Request, phase: Phase, failure: Failure) -> tuple[Crane, list[Case], int]:
        """A phase with the failure at every moment."""
        winch = winch_of(phase, self.alternative)
        crane, mode = self.plan.once(machine_of, winch)
        if failure.of_crane is not None:
            crane = self.plan.once(_with_failure, winch, failure.key)
        course = begun(self.plan, self.cells, phase, winch, each)
        lasts = SETTLE + window(phase, course, each.sea.Tp) + AFTER + ROOM
        calm = lowering_of(self.plan, phase, replace(course, duration=lasts), mode)
        seeds = [seed_of(each.sea, k, self.cells.execution.seed) for k in range(1, TRAINS + 1)]
        one = in_sea(self.plan, phase, winch, course, calm, each.sea, seeds[0])
        cases: list[Case] = []
        for k, t in enumerate(moments(phase, course, each.sea.Tp).tolist()):
            lift = calm.model_copy(
                update={
                    "programme": programme(course, failure, t, each.sea.Tp),
                    "sensors": failure.sensors(crane, calm.sensors, SETTLE + t),
                }
            )
            cases.append(replace(one, lift=lift, seed=seeds[k % TRAINS]))
        return crane, cases, course.counts + 1


def _with_failure(plan: LiftPlan, winch: Winch, key: str) -> Crane:
    """The crane of a way of running the winch with a failure that it can have."""
    make = BY_KEY[key].of_crane
    changed = None if make is None else make(plan.once(machine_of, winch)[0])
    assert changed is not None
    return changed


def reversed_(phase: Phase) -> Phase:
    """The same way, back."""
    return phase.model_copy(update={"start_depth": phase.depth, "depth": phase.start_depth, "mode": WinchMode.MANUAL})


def standing(phase: Phase, z: float) -> Course:
    """The payload held at a height for as long as a run counts."""
    half = Phase(mode=WinchMode.MANUAL, time=f"{0.5 * SETTLE!r} s")
    held = Phase(mode=WinchMode.MANUAL, time=f"{BLOCK!r} s")
    return Course(z, (half, half, held), SETTLE + BLOCK + ROOM, BLOCK, 2, 1.0, 1.0, z)


def begun(plan: LiftPlan, cells: Cells, phase: Phase, winch: Winch, each: Request) -> Course:
    """How a phase goes until a failure: as its own runs, or about the height that is asked for; a landing is lowered
    from its stand-off, or from what it comes down in `LONGEST_APPROACH`."""
    if phase.kind is not PhaseKind.LANDING:
        if each.z is None:
            return cells.course(phase, winch, each.sea)
        return winch.hangs(plan).once(course_of, phase, winch, each.z)
    v = phase.speed or 0.0
    high = min(phase.stand_off or HANGS, LONGEST_APPROACH * v)
    mode = WinchMode.MANUAL if phase.compensated and winch.controller is None else phase.mode
    mode = WinchMode.AHC if mode is WinchMode.LANDING else mode
    still, down = (
        Phase(mode=mode, speed=f"{speed!r} m/s", time=f"{time!r} s") for speed, time in ((0.0, SETTLE), (v, high / v))
    )
    z = high - plan.depth
    return Course(z, (still, down), SETTLE + high / v, high / v, 1, 1.0, 1.0, z)


def moments(phase: Phase, course: Course, Tp: float) -> FloatArray:
    """Times after `SETTLE` at which the failure begins (MOMENTS,) [s]: over the way of a passage, of a landing and at a
    deck; elsewhere over a period of the waves, each train at phases between those of the others."""
    if _over_way(phase):
        begin = off_deck_from(phase, course, Tp)
        return np.asarray(begin + (np.arange(MOMENTS) + 0.5) / MOMENTS * (course.counted - begin))
    return np.asarray(BEFORE + Tp * np.arange(MOMENTS) / MOMENTS)


def off_deck_from(phase: Phase, course: Course, Tp: float) -> float:
    """Time from which on failures begin in a phase over its way [s]: of a lift-off a period before the wire is taut."""
    if phase.kind not in OFF_DECK or phase.z_end is None or phase.z_start is None or not phase.speed:
        return 0.0
    return max(course.counted - (phase.z_end - phase.z_start) / phase.speed - Tp, 0.0)


def window(phase: Phase, course: Course, Tp: float) -> float:
    """Time after `SETTLE` in which failures begin [s]."""
    return course.counted if _over_way(phase) else BEFORE + Tp


def _over_way(phase: Phase) -> bool:
    return phase.kind in (PhaseKind.LANDING, *APART) or (phase.kind is PhaseKind.SPLASH and not phase.held)


def programme(course: Course, failure: Failure, t: float, Tp: float) -> tuple[Phase, ...]:
    """The programme of a course with the failure t after `SETTLE` [s]. Compensation may begin later than planned by
    half a period: where the programme goes on, what counts begins so much before the failure, and the joystick is
    released."""
    last = course.programme[course.counts]
    mode = WinchMode.AHC if last.mode is WinchMode.LANDING else last.mode
    v = last.speed or 0.0
    until = t if failure.stands else max(t - 0.5 * Tp, LEAST)
    lasts = AFTER + t - until
    before = Phase(mode=mode, speed=f"{v!r} m/s", time=f"{until!r} s")
    after = Phase(mode=failure.mode or mode, speed="0 m/s", time=f"{lasts!r} s")
    return (*course.programme[: course.counts], before, after)
