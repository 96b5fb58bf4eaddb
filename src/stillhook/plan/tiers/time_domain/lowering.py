"""Phases of a plan as lowerings of the twin: what is run of a phase, for how long, and which part of the run counts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stillhook.engine.arguments import substeps
from stillhook.engine.lowering.case import lift_step
from stillhook.engine.lowering.checks import DECK_LIMIT
from stillhook.engine.lowering.run import longest_step
from stillhook.engine.pack.programme import tension_kept
from stillhook.errors import PlanError
from stillhook.physics.scalar import G
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.tiers.other_vessel import hook_on_deck, largest
from stillhook.plan.tiers.situations import natural_period
from stillhook.response.suspended_load import suspended_load
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import wavenumber
from stillhook.sea.vessel.realisation import Amplitudes, decay
from stillhook.spec.crane import Crane
from stillhook.spec.lift.deck import MOST_SLACK, Deck
from stillhook.spec.lift.joining import CLOSE
from stillhook.spec.lift.lowering import DeepWire, InSea, Lowering
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase, PhaseKind, WinchMode
from stillhook.spec.scenario import Mode
from stillhook.spec.validity import CAP

KINDS = (
    PhaseKind.LIFT_OFF_BARGE,
    PhaseKind.IN_AIR,
    PhaseKind.SPLASH,
    PhaseKind.LOWERING,
    PhaseKind.DEEP,
    PhaseKind.STAND_OFF,
    PhaseKind.LANDING,
    PhaseKind.SET_DOWN_PLATFORM,
)
"""Phases that the twin runs. Lift-off from and set-down on the vessel's own deck move with it, and a lift-off from the
seabed needs soil under the load at the start, which no lowering has: they are covered by the other tiers."""
SETTLE = 60.0
"""Time before the part that counts [s]: the sea grows for 10 s, compensation begins as the tip turns, and the load
comes to its swing (its drag at limiting motions damps it by 3 %, at 6 s within 30 s)."""
BLOCK = 240.0
"""Longest part that counts [s]; a longer phase is many of these."""
ROOM = 12.0
"""Time beyond the part that counts as planned [s]: compensation may begin later than planned, by the half of a long
period."""
FAINT = 0.01
"""Part of the water's vertical motion at the surface (standard deviations) at whose depth the waves are left out."""
TOUCH_ROOM = 30.0
"""Time beyond a landing as planned [s]: the load may swing, or the winch wait."""
APPROACH = 90.0
"""Of a landing the last time above the seabed is run [s], or the whole of its phase where this is shorter."""
HANGS, THROUGH = 3.0, 1.0
"""Without compensation a landing hangs at this height above the seabed at the most [m] while its tensions and motion
count, and is then lowered until it would be so far below it [m]. (In manual mode the winch is a decimetre behind the
joystick before its leakage is made up for: a load that is lowered would seem to move by that.)"""
SETTLEMENT = 2e-3
"""Settlement of a deck under the payload [m] (assumed): stiff, for a soft one helps the wire to take up the load."""
LOWEST_DECK = 0.5e-3
"""Height above still water from which a run has a deck [m]: one at the waterline is taken to be there."""
ABOVE_DECK = 15.0
"""Time for which a payload that was lifted off a deck hangs over it [s]: a long wave, which may reach it still."""
STEP = 10e-3
"""Step that is enough for the numbers of a phase [s] (docs/validation/step-size.md)."""
SAMPLING = 20e-3
"""Interval at which statistics of a run are taken, at the most [s] (docs/validation/step-size.md)."""
ELEMENT = 200.0
"""Longest element of the wire of a run [m] (docs/validation/step-size.md): waves take 0.06 s along it."""
LEAST_NODES = 2


class Winch(NamedTuple):
    """What the winch makes of the tip's motion. left: part of it that the wire's top end has where the winch rests;
    controller: the alternative whose controller compensates the motion, None where none does; below: alternative whose
    passive compensator hangs below it, None where none does."""

    left: float = 1.0
    controller: Alternative | None = None
    below: Alternative | None = None

    def hangs(self, plan: LiftPlan) -> LiftPlan:
        """The plan with what hangs below."""
        return plan.under(self.below or Alternative.NONE)


@dataclass(frozen=True)
class Course:
    """What is run of a phase once. z_0 height of the underside at the start [m]; programme; duration of the run,
    counted the part that is evaluated [s], which is phase number `counts`; times such parts that the phase holds, and
    swings those in which the load swings as here; z_top highest place of the underside while it counts [m]."""

    z_0: float
    programme: tuple[Phase, ...]
    duration: float
    counted: float
    counts: int
    times: float
    swings: float
    z_top: float


def winch_of(phase: Phase, alternative: Alternative) -> Winch:
    """How an alternative runs the winch in a phase: one and the same run where nothing follows the tip."""
    if alternative is Alternative.PHC:
        return Winch(below=alternative)
    if not phase.compensated or alternative is Alternative.NONE:
        return Winch()
    if alternative is Alternative.CAP:
        return Winch(left=1.0 - CAP)
    return Winch(controller=alternative)


def machine_of(plan: LiftPlan, winch: Winch) -> tuple[Crane, Mode]:
    """The crane with the settings of the controller, and its mode; the plan's own crane where nothing compensates."""
    if winch.controller is None:
        return plan.crane, plan.crane.plant.type.default_mode
    return plan.machine(winch.controller)


def course_of(plan: LiftPlan, phase: Phase, winch: Winch, z: float | None = None, about: float | None = None) -> Course:
    """What is run of a phase. Of a long way it is the piece about z [m] (its worst place), where the payload is for the
    time `about` [s]; None for its end, and for all of its time.

    A phase at one height, one that is held at z, or a part of a long way, is run for up to `BLOCK` and counts as often
    as it goes into the phase's duration; a passage of the splash zone is run whole, a landing from some metres above
    the seabed. Errors: PlanError for a phase that is not run.
    """
    if phase.kind not in KINDS:
        raise PlanError(f'phase "{phase.name}": {phase.kind} is not run in time. Runs are made of {", ".join(KINDS)}.')
    start, end = phase.z_start, phase.z_end
    if start is None or end is None:
        raise PlanError(
            f'phase "{phase.name}": it does not join. Read the plan with load_plan, which gives every phase its'
            " heights."
        )
    mode = _mode(phase, winch)
    if phase.kind in APART:
        return _at_deck(plan, phase, mode, start, end)
    if phase.kind is PhaseKind.LANDING:
        return _landing(plan, phase, mode, start)
    if phase.held or start == end:
        return _standing(phase, mode, start if z is None else z)
    if phase.kind is PhaseKind.SPLASH:
        return _passage(phase, mode, start, end)
    return _part(plan, phase, mode, (start, end), end if z is None else z, about)


def _mode(phase: Phase, winch: Winch) -> WinchMode:
    """Mode of the winch while it counts; in a phase that compensates, manual where nothing does."""
    return WinchMode.MANUAL if phase.compensated and winch.controller is None else phase.mode


def _driven(mode: WinchMode, v: float, **ends: str | bool) -> Phase:
    return Phase(mode=mode, speed=f"{v!r} m/s", **ends)


def _standing(phase: Phase, mode: WinchMode, z: float) -> Course:
    """A time at one height."""
    lasts = phase.duration or BLOCK
    counted = min(BLOCK, lasts)
    half = _driven(
        mode, 0.0, time=f"{0.5 * SETTLE!r} s"
    )  # two of them: as many phases as a way has, so that both fill blocks of lanes
    stages = (half, half, _driven(mode, 0.0, time=f"{counted!r} s"))
    return Course(z, stages, SETTLE + counted + ROOM, counted, len(stages) - 1, lasts / counted, lasts / counted, z)


def _part(
    plan: LiftPlan, phase: Phase, mode: WinchMode, ends: tuple[float, float], z: float, about: float | None
) -> Course:
    """A piece of a way."""
    (start, end), v = ends, _speed(phase)
    way, down = abs(end - start), math.copysign(1.0, start - end)
    counted = min(BLOCK, way / v)
    before = min(max(abs(z - start) - 0.5 * v * counted, 0.0), max(way - v * counted, 0.0))
    at = start - down * before
    ahead = _ahead(plan, mode, at, down * v, before)
    stages = (*ahead, _driven(mode, down * v, time=f"{counted!r} s"))
    times = max((phase.duration or counted) / counted, 1.0)
    swings = times if about is None else min(max(about / counted, 1.0), times)
    z_0, bottom = at + _covered(ahead), at - down * v * counted
    return Course(z_0, stages, SETTLE + counted + ROOM, counted, len(ahead), times, swings, max(at, bottom))


def _ahead(plan: LiftPlan, mode: WinchMode, z: float, v: float, room: float) -> tuple[Phase, ...]:
    """Phases of `SETTLE` before the part that counts, which begins at z and moves at v, lowering positive; room: way
    before z [m].

    The joystick is pushed in two halves, half a natural period of the load apart, so that what swings later is not its
    start: on the real way that has died away long before.
    """
    half = _half(plan, z)
    moves = min(max(room / abs(v) + 0.5 * half, 0.0), SETTLE)
    if moves <= half:
        return (_driven(mode, 0.0, time=f"{SETTLE!r} s"),)
    parts = ((SETTLE - moves, 0.0), (half, 0.5 * v), (moves - half, v))
    return tuple(_driven(mode, speed, time=f"{time!r} s") for time, speed in parts if time > 0.0)


def _half(plan: LiftPlan, z: float) -> float:
    """Half a natural period of the load on its wire [s]."""
    return 0.5 * min(natural_period(suspended_load(plan.crane, plan.hanging(z), z)), SETTLE)


def _covered(programme: Sequence[Phase]) -> float:
    """Way down of phases that end by time [m]."""
    return sum((each.speed or 0.0) * (each.time or 0.0) for each in programme)


def _passage(phase: Phase, mode: WinchMode, start: float, end: float) -> Course:
    """The whole way through the surface; as often as it goes into the phase's duration, where that is longer."""
    v = _speed(phase)
    counted = abs(end - start) / v
    times = max((phase.duration or counted) / counted, 1.0)
    down = math.copysign(v, start - end)
    stages = (_driven(mode, 0.0, time=f"{SETTLE!r} s"), _driven(mode, down, depth=f"{-end!r} m"))
    return Course(start, stages, SETTLE + 1.1 * counted + ROOM, counted, 1, times, times, max(start, end))


def _at_deck(plan: LiftPlan, phase: Phase, mode: WinchMode, start: float, end: float) -> Course:
    """Off a deck at hoisting speed, the wire slack before; or onto it, and on until the wire is as slack as the payload
    hung above it. A run lifts off, or sets down, at an instant of its own: once in a phase."""
    v, still = _speed(phase), _driven(mode, 0.0, time=f"{SETTLE!r} s")
    if phase.kind in OFF_DECK:
        counted = (end - start + slack_on_deck(plan, phase)) / v + v / plan.hanging(start).winch.ramp
        hoist, over = _driven(mode, -v, depth=f"{-end!r} m"), _driven(mode, 0.0, time=f"{ABOVE_DECK!r} s")
        return Course(
            start, (still, hoist, over), SETTLE + 1.1 * counted + ABOVE_DECK + ROOM, counted, 1, 1.0, 1.0, end
        )
    height = min(start - end, max(HANGS, APPROACH * v))
    counted, z = (height + HANGS) / v, end + height
    lower = _driven(mode, v, time=f"{counted!r} s")
    return Course(z, (still, lower), SETTLE + counted + ROOM, counted, 1, 1.0, 1.0, z)


@remembered
def slack_on_deck(plan: LiftPlan, phase: Phase) -> float:
    """How much longer than taut the wire is before a lift-off [m]: for the joystick to be at the hoisting speed as the
    load is taken up, and for no wave of the table to take it up before."""
    way = _speed(phase) ** 2 / (2.0 * plan.hanging(phase.z_start or 0.0).winch.ramp)
    z = largest(hook_on_deck(plan, phase, plan.environment.table()), BLOCK)[0]
    return min(way + max(float(np.nanmax(z)), HANGS), MOST_SLACK)


def deck_of(plan: LiftPlan, phase: Phase) -> Deck | None:
    """The deck of a phase at rest; None where it has none that moves otherwise than the vessel."""
    if phase.kind not in APART:
        return None
    off = phase.kind in OFF_DECK
    z, slack = (phase.z_start, slack_on_deck(plan, phase)) if off else (phase.z_end, None)
    return Deck.model_validate(
        {
            "height": f"{max(z or 0.0, LOWEST_DECK)!r} m",
            "settlement": f"{SETTLEMENT!r} m",
            "slack": None if slack is None else f"{slack!r} m",
            "followed": phase.follows_deck,
        }
    )


def _landing(plan: LiftPlan, phase: Phase, mode: WinchMode, start: float) -> Course:
    """The last metres, and the touch-down, from the stand-off where the landing has one: the winch rests there before
    with what its control and its friction make of that. Without compensation the load first hangs, which counts, and
    is then put down manually.

    All ways of running the winch take the same time, so that a seed is the same sea to all of them.
    """
    v, high = _speed(phase), start + plan.depth if phase.stand_off is None else phase.stand_off
    hangs, height = min(high, HANGS), min(high, APPROACH * v)
    half, down = _half(plan, hangs - plan.depth), (hangs + THROUGH) / v
    lasts = SETTLE + max(APPROACH + half + down, height / v) + TOUCH_ROOM
    if mode is WinchMode.MANUAL:
        still = (_driven(mode, 0.0, time=f"{SETTLE!r} s"),)
        put_down = (_driven(mode, 0.5 * v, time=f"{half!r} s"), _driven(mode, v, time=f"{down!r} s"))
        last = (_driven(mode, 0.0, time=f"{APPROACH!r} s"), *put_down)
        return _landed(phase, hangs - plan.depth, still, last, lasts, APPROACH)
    z = height - plan.depth
    before = _ahead(plan, WinchMode.AHC, z, v, high - height)
    if mode is WinchMode.AHC:
        return _landed(phase, z, before, (_driven(mode, v, landed=True),), lasts, height / v)
    tension = phase.tension or tension_kept(plan.crane, plan.payload, plan.rho)
    land = _driven(mode, v, tension=f"{tension!r} N", time="1 s")
    return _landed(phase, z, before, (land,), lasts, height / v)


def _landed(
    phase: Phase, z: float, before: tuple[Phase, ...], last: tuple[Phase, ...], lasts: float, counted: float
) -> Course:
    """The course of a landing whose counted phase begins at z, the first of `last`; what is not run counts as that."""
    times = max((phase.duration or counted) / counted, 1.0)
    return Course(z + _covered(before), (*before, *last), lasts, counted, len(before), times, times, z)


def _speed(phase: Phase) -> float:
    if phase.speed is None:
        raise PlanError(f'phase "{phase.name}": speed is missing, that of the wire. Give it, such as "12 m/min".')
    return phase.speed


def step_of(plan: LiftPlan) -> float:
    """Step of a plan's runs [s]: `STEP`, or `LIFT_STEP` where the winch, the wire's end, the seabed or a deck need a
    shorter one at an end of any phase, or what they need where that is shorter still."""
    phases = [phase for phase in plan.phases if phase.kind in KINDS]
    out = {(plan.tip_of(p).z or 0.0) - z: (p, z) for p in phases for z in (p.z_start, p.z_end) if z is not None}
    cranes = [plan.crane, *(machine_of(plan, Winch(controller=a))[0] for a in plan.alternatives if a.twin)]
    longest = math.inf
    for phase, z in {out[s] for s in (min(out), max(out))}:
        lift = plan.hanging(max(z, -plan.depth + CLOSE), plan.tip_of(phase).z)
        longest = min(longest, *(longest_step(crane, lift) for crane in cranes))
        if Alternative.PHC in plan.alternatives:
            linked = plan.under(Alternative.PHC).hanging(max(z, -plan.depth + CLOSE), plan.tip_of(phase).z)
            longest = min(longest, longest_step(plan.crane, linked))
    if any(phase.kind in APART for phase in phases):
        longest = min(longest, DECK_LIMIT * math.sqrt(SETTLEMENT / G))
    t_cycle = plan.crane.control.t_cycle
    step = t_cycle / substeps(t_cycle, STEP)
    return step if step <= longest else t_cycle / substeps(t_cycle, lift_step(longest))


def lowering_of(plan: LiftPlan, phase: Phase, course: Course, mode: Mode) -> Lowering:
    """The run of a course on a calm sea; mode of the controller."""
    return plan.hanging(course.z_0, plan.tip_of(phase).z).model_copy(
        update={
            "name": phase.name,
            "programme": course.programme,
            "duration": course.duration,
            "controller": mode,
            "wire": DeepWire(nodes=nodes_of(plan, phase)),
            "deck": deck_of(plan, phase),
        }
    )


def nodes_of(plan: LiftPlan, phase: Phase) -> int:
    """Nodes of the wire in the runs of a phase: as many as its longest wire needs, and no more than the plan's."""
    longest = (plan.tip_of(phase).z or plan.h_tip) - min(z for z in (phase.z_start, phase.z_end) if z is not None)
    return min(max(math.ceil(longest / ELEMENT), LEAST_NODES), plan.wire.nodes)


def sampling_of(plan: LiftPlan) -> float:
    """Interval at which statistics of a plan's runs are taken [s]: whole PLC cycles."""
    t_cycle = plan.crane.control.t_cycle
    return t_cycle * max(math.floor(SAMPLING / t_cycle * (1.0 + 1e-9)), 1)


class SeaState(NamedTuple):
    """One sea of a table: Hs [m], Tp [s], direction of travel from the bow [rad]."""

    Hs: float
    Tp: float
    beta: float


def in_sea(
    plan: LiftPlan, phase: Phase, winch: Winch, course: Course, calm: Lowering, spot: SeaState, seed: int
) -> InSea:
    """A course in one seed of a sea: the same waves for every alternative.

    Amplitudes are random (Rayleigh), as in a record of this length. What a flat cap leaves of the tip's motion moves
    the tip, the water keeps its waves. calm: the course as `lowering_of` gives it.
    """
    at = plan.tip_of(phase)
    sea = plan.environment.sea(*spot)
    water = phase.held or in_waves(plan, sea, course)
    unit = None if winch.controller is None and winch.left == 1.0 else plan.unit
    other = plan.against.other if plan.against is not None and phase.on_other_vessel else None
    place = plan.vessel, at.x, at.y, water, winch.left, Amplitudes.RAYLEIGH
    return InSea(calm, sea, seed, *place, other=other, unit=unit)


def in_waves(plan: LiftPlan, sea: Sea, course: Course) -> bool:
    """Whether the water moves the payload while it counts: never in air, and not where it has `FAINT` of its motion at
    the surface."""
    depth = course.programme[course.counts].depth
    goes_under = depth is not None and depth > 0.0
    if course.z_top >= 0.0:
        return goes_under or course.z_0 < 0.0
    z = np.array([min(course.z_top + plan.payload.height, 0.0)])
    total = remaining = 0.0
    for train in sea.trains:
        omega = train.spectrum.grid()
        rate = train.spectrum.density(omega) * omega**2
        under = rate * decay(wavenumber(omega, plan.depth), z, plan.depth)[0] ** 2
        total += float(np.sum(0.5 * (rate[1:] + rate[:-1]) * np.diff(omega)))
        remaining += float(np.sum(0.5 * (under[1:] + under[:-1]) * np.diff(omega)))
    return remaining > FAINT**2 * total
