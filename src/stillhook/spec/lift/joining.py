"""Phases as a file has them made into phases that join: depths, speeds and times of what was left out, and what cannot
be; and those of them that one run can follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from stillhook.errors import LiftError
from stillhook.spec.lift.phase import OFF_DECK, ON_DECK, RUN_ENDS, Phase, PhaseKind, WinchMode, called
from stillhook.units import quote, show

K = PhaseKind
IN_AIR = (*OFF_DECK, K.IN_AIR, *ON_DECK)
"""Phases in which the payload is wholly above the water."""
UNDER_WATER = (K.LOWERING, K.DEEP, K.STAND_OFF, K.LANDING, K.SEABED_LIFT_OFF)
"""Phases in which it is wholly below."""
SPEED = {
    **dict.fromkeys(OFF_DECK, 0.1),
    K.IN_AIR: 0.1,
    K.SPLASH: 0.25,
    K.LOWERING: 0.5,
    K.LANDING: 0.1,
    K.SEABED_LIFT_OFF: 0.1,
    **dict.fromkeys(ON_DECK, 0.05),
}
"""Speed of a phase that moves, where its file has none [m/s]: usual of each kind (assumed)."""
TIME = {K.IN_AIR: 600.0, K.DEEP: 1800.0, K.STAND_OFF: 300.0}
"""Duration of a phase at rest, where its file has none [s]: slewing over the side, half an hour above the place of
landing, and a stop for the last look of the ROV (assumed)."""
CLEAR_OF_DECK = 3.0
"""How far a payload is lifted off the deck before it goes over the side [m]."""
ABOVE_WATER = 5.0
"""Height to which a payload is brought up out of the water [m]."""
BELOW_WAVES = 10.0
"""Depth below full cover to which the splash zone is taken [m]."""
STANDS = (K.DEEP, K.STAND_OFF)
"""Phases at one depth under water."""
STAND_OFF = 3.0
"""Height above the seabed of a stand-off, where its file has none [m]."""
ABOVE_SEABED = 20.0
"""Height above the seabed at which a landing begins, or to which a payload is lifted off it [m]."""
AFTER_LANDING = 60.0
"""How long a run continues after touch-down, where the landing has no time [s]."""
CLOSE = 0.01
"""Gap between two phases that does not count [m]."""


class Water(NamedTuple):
    """depth of the water, and submergence from which the payload is covered [m]."""

    depth: float
    reach: float


def joined(phases: Sequence[Phase], start_depth: float | None, water: Water) -> tuple[Phase, ...]:
    """The phases with start_depth, depth, time and, where they move, speed: each starts where the one before it ends,
    the first at the start depth of the lift (None: that of its kind) [m].

    Errors: LiftError, one line, that names the phase: no kind, depths that do not join or that its kind cannot have, a
    planned time too short for the way, two phases of one name.
    """
    names = [phase.name for phase in phases]
    done: list[Phase] = []
    for i, phase in enumerate(phases):
        if phase.kind is None:
            raise LiftError(f"{called(phase)}: kind: missing. Give one of {', '.join(K)}.")
        if names.count(phase.name) > 1:
            raise LiftError(f"phase {quote(phase.name)}: is given twice. Give every phase its own name.")
        of_run = next((end for end in phase.ends if end in RUN_ENDS), None)
        if of_run is not None:
            raise LiftError(
                f"{called(phase)}: {of_run} ends it, and its depth is then known in a run only. Give depth, or leave"
                " kind out."
            )
        after = phases[i + 1] if i + 1 < len(phases) else None
        start = _start(phase, start_depth, water) if not done else done[-1].depth
        assert start is not None
        end = _end(phase, start, after, done, water)
        _check_depths(phase, start, end, water)
        done.append(_timed(phase, start, end))
    return tuple(done)


def _start(phase: Phase, start_depth: float | None, water: Water) -> float:
    if start_depth is not None:
        return start_depth
    usual = {K.SEABED_LIFT_OFF: water.depth, K.LANDING: water.depth - ABOVE_SEABED}
    if phase.kind in usual:
        return usual[phase.kind]
    example = (
        '"-4 m", the deck above still water' if phase.kind in IN_AIR else '"-5 m" above still water, or "25 m" under it'
    )
    raise LiftError(
        f"start_depth: missing, the depth of the payload's underside as the lift begins (negative above the water)."
        f" Give it: {example}."
    )


def _end(phase: Phase, start: float, after: Phase | None, done: Sequence[Phase], water: Water) -> float:
    if phase.depth is not None:
        return phase.depth
    usual = {
        **dict.fromkeys(OFF_DECK, start - CLEAR_OF_DECK),
        K.IN_AIR: start,
        K.SPLASH: -ABOVE_WATER if start > 0.0 else water.reach + BELOW_WAVES,
        K.DEEP: start,
        K.STAND_OFF: start,
        K.LANDING: water.depth,
        K.SEABED_LIFT_OFF: water.depth - ABOVE_SEABED,
    }
    if phase.kind in usual:
        return usual[phase.kind]
    if phase.kind is K.LOWERING and after is not None:
        if after.kind is K.STAND_OFF:
            return water.depth - STAND_OFF
        if after.kind in (K.DEEP, K.LANDING):
            return water.depth - ABOVE_SEABED
        if after.kind is K.SPLASH:
            return water.reach + BELOW_WAVES
    deck = next((p.start_depth for p in done if p.kind is K.LIFT_OFF), None)
    if phase.kind is K.SET_DOWN and deck is not None:
        return deck
    example = '"-4 m", the deck above still water' if phase.kind in ON_DECK else '"1475 m"'
    raise LiftError(
        f"{called(phase)}: depth: missing, that of the payload's underside as the phase ends. Give it, such as"
        f" {example}."
    )


def _check_depths(phase: Phase, start: float, end: float, water: Water) -> None:
    way = f"from {_at(start)} to {_at(end)}"
    for name, depth in (("starts", start), ("ends", end)):
        if depth > water.depth + CLOSE:
            raise LiftError(
                f"{called(phase)}: {name} at {_at(depth)}, below the seabed at {_at(water.depth)}. Depths count down"
                " from still water."
            )
    if phase.kind in IN_AIR and max(start, end) > 0.0:
        raise LiftError(
            f"{called(phase)}: {way}, and its kind is above the water. Use splash-zone through it; a height above the"
            " water is a negative depth."
        )
    if phase.kind is K.SPLASH and not (min(start, end) <= 0.0 and max(start, end) >= water.reach - CLOSE):
        raise LiftError(
            f"{called(phase)}: {way}. Let it go between 0 m or less and {_at(water.reach)} or"
            " deeper, where the payload is covered."
        )
    if phase.kind not in (*IN_AIR, K.SPLASH) and min(start, end) < water.reach - CLOSE:
        raise LiftError(
            f"{called(phase)}: {way}, and the payload is not covered above {_at(water.reach)}. Let splash-zone end"
            " deeper."
        )
    _check_way(phase, start, end, water)


def _check_way(phase: Phase, start: float, end: float, water: Water) -> None:
    way = f"from {_at(start)} to {_at(end)}"
    ups = {**dict.fromkeys((*OFF_DECK, K.SEABED_LIFT_OFF), True), **dict.fromkeys((*ON_DECK, K.LANDING), False)}
    up = ups.get(phase.kind or K.DEEP)
    if up is not None and (start - end) * (1.0 if up else -1.0) < CLOSE:
        raise LiftError(f"{called(phase)}: {way}, and it goes {'up' if up else 'down'}. Exchange or correct them.")
    if phase.kind in STANDS and abs(end - start) > CLOSE:
        raise LiftError(f"{called(phase)}: {way}, and it does not move. Use lowering to move, or leave depth out.")
    if phase.kind is K.LOWERING and abs(end - start) < CLOSE:
        raise LiftError(
            f"{called(phase)}: starts and ends at {_at(start)}. Use deep for a stop, or give where it goes."
        )
    bottom = {K.LANDING: end, K.SEABED_LIFT_OFF: start}.get(phase.kind or K.DEEP)
    if bottom is not None and abs(bottom - water.depth) > CLOSE:
        verb = "ends" if phase.kind is K.LANDING else "starts"
        raise LiftError(
            f"{called(phase)}: {verb} at {_at(bottom)}, and the seabed is at {_at(water.depth)}. Leave it out, or"
            " correct one."
        )


def _timed(phase: Phase, start: float, end: float) -> Phase:
    """The phase with its depths, speed and time."""
    way = abs(end - start)
    if way <= CLOSE:
        if phase.speed is not None:
            raise LiftError(
                f"{called(phase)}: speed is given, and it does not move from {_at(start)}. Leave speed out, or give"
                " where it goes."
            )
        time = TIME[phase.kind or K.DEEP] if phase.duration is None else phase.duration
        return phase.model_copy(update={"start_depth": start, "depth": start, "time": time, "planned": None})
    speed = SPEED[phase.kind or K.LOWERING] if phase.speed is None else abs(phase.speed)
    if phase.speed is not None and phase.speed < 0.0 and end > start:
        raise LiftError(
            f"{called(phase)}: speed {show(phase.speed, 'speed')} hoists, and it goes from {_at(start)} down to"
            f" {_at(end)}. Give speed without a sign: the depth says the direction."
        )
    least = way / speed
    if phase.time is not None and phase.kind is not K.LANDING:
        raise LiftError(
            f"{called(phase)}: time {show(phase.time, 'time')}, and it goes from {_at(start)} to {_at(end)}. Time that"
            " the operation plans for a way is planned."
        )
    if phase.planned is not None and phase.planned < least * (1.0 - 1e-3):
        raise LiftError(
            f"{called(phase)}: planned {show(phase.planned, 'time')}, and {show(way, 'length')} at"
            f" {show(speed, 'speed')} take {show(least, 'time')}. Give more time or more speed."
        )
    planned = least if phase.planned is None else phase.planned
    return phase.model_copy(update={"start_depth": start, "depth": end, "speed": speed, "planned": planned})


def _at(depth: float) -> str:
    return show(depth, "length")


class OneRun(NamedTuple):
    """What one run follows of a lift: depth at its start [m], its programme, and what of the phases is not run."""

    start_depth: float
    programme: tuple[Phase, ...]
    notes: tuple[str, ...]


NO_RUN = (*OFF_DECK, *ON_DECK, K.SEABED_LIFT_OFF)
"""Phases that need a ground under the load at the start or the end, which no run has."""


def one_run(
    phases: Sequence[Phase], elsewhere: Callable[[Phase], bool], tension: Callable[[], float], bottom: float
) -> OneRun:
    """The joined phases that one run follows, as a programme.

    elsewhere: whether the crane tip is at another place in a phase than in the lift; tension: that a landing keeps
    where its phase has none [N]; bottom: depth of the water [m]. Phases at both ends that no run can follow are left
    out, with a note. Errors: LiftError where there is one in between, or nothing is left.
    """
    follows = [not (phase.kind in NO_RUN or elsewhere(phase)) for phase in phases]
    if True not in follows:
        raise LiftError("phase: no run can follow any of them: give one that moves the load at the place of the tip.")
    first, last = follows.index(True), len(follows) - follows[::-1].index(True)
    if False in follows[first:last]:
        broken = phases[first + follows[first:last].index(False)]
        reason = "begins or ends on a ground" if broken.kind in NO_RUN else "has its crane tip at another place"
        raise LiftError(
            f"{called(broken)}: {reason}, and one run cannot continue after it. Lower the phases before and after it in"
            " two files."
        )
    left_out = [phase.name for phase in (*phases[:first], *phases[last:])]
    notes = [f"not run, for a run has one place of the tip and no deck: {', '.join(left_out)}"] if left_out else []
    programme: list[Phase] = []
    for phase in phases[first:last]:
        if phase.kind is K.SPLASH and phase.hold != 0.0:
            notes.append(f"{phase.name}: its hold at the worst depth is assessed by a plan, and not run")
        programme += _run_of(phase, tension, bottom)
    start = phases[first].start_depth
    assert start is not None
    return OneRun(start, tuple(programme), tuple(notes))


def _run_of(phase: Phase, tension: Callable[[], float], bottom: float) -> list[Phase]:
    """A joined phase as one or more phases of a programme, each with one end."""
    bare: dict[str, object] = {
        "start_depth": None,
        "planned": None,
        "limits": {},
        "tip": None,
        "hold": None,
        "stand_off": None,
        "deck": None,
        "reference": None,
    }
    if phase.speed is None:
        return [phase.model_copy(update={**bare, "depth": None})]
    if phase.kind is not K.LANDING:
        return [phase.model_copy(update=bare)]
    ends: dict[str, object] = {"depth": None, "time": None, "landed": True}
    if phase.mode is WinchMode.LANDING:
        F, time = phase.tension or tension(), phase.time or AFTER_LANDING
        ends = {"depth": None, "time": time, "tension": F}
    return [*_stop(phase, bare, bottom), phase.model_copy(update={**bare, **ends})]


def _stop(phase: Phase, bare: dict[str, object], bottom: float) -> list[Phase]:
    """The way to the stand-off of a landing and the stop there, where its file has one."""
    usual = 0.0 if phase.stand_off is None else TIME[K.STAND_OFF]
    time, height = usual if phase.hold is None else phase.hold, phase.stand_off or STAND_OFF
    assert phase.start_depth is not None
    if time <= 0.0:
        return []
    mode = WinchMode.AHC if phase.compensated else WinchMode.MANUAL
    still = {**bare, "mode": mode, "kind": K.STAND_OFF, "tension": None, "name": f"{phase.name}, held"}
    stands = phase.model_copy(update={**still, "speed": None, "depth": None, "time": time})
    goal = bottom - height
    if goal - phase.start_depth <= CLOSE:
        return [stands]
    way = {"kind": K.LOWERING, "name": f"{phase.name}, to the stand-off", "depth": goal, "time": None}
    return [phase.model_copy(update={**still, **way}), stands]
