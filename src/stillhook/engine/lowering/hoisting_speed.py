"""The lowest hoisting speed at which a payload that was lifted off a moving deck is not hit by it again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.progress import Progress
from stillhook.engine.simulate import End, simulate
from stillhook.errors import LiftError
from stillhook.sea.motion.motion import Motion, Sine
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.units import show

SPAN = 120.0
"""Time over which starts are spread where the deck has no period [s]."""
STARTS, MOST_STARTS = 64, 256
"""Instants of the beginning: some 6 deg of a sine apart, for a hit may need a moment as short."""


class AtSpeed(NamedTuple):
    """One hoisting speed v [m/s] over all starts: share of them with a second hit, v_hit the fastest of these [m/s],
    F_hook largest tension below the hook, F_tip at the crane tip [N], slack longest time without tension once the
    payload hung free [s], v_w least of the largest wire speeds that the winch reached [m/s]."""

    v: float
    share: float
    v_hit: float
    F_hook: float
    F_tip: float
    slack: float
    v_w: float


class HoistingSpeed(NamedTuple):
    """rows by rising speed; lowest: of those speeds without a second hit above which none has one, NaN where the
    highest has one; starts: how many instants of the beginning, over span [s]."""

    lowest: float
    rows: tuple[AtSpeed, ...]
    starts: int
    span: float


def hoisting_speed(
    crane: Crane,
    lift: Lowering,
    speeds: Sequence[float],
    *,
    starts: int = STARTS,
    span: float | None = None,
    progress: Progress | None = None,
) -> HoistingSpeed:
    """Runs of a lift off a deck at several hoisting speeds [m/s].

    The first phase, which waits, is longer by starts even parts of span [s]; default a period of the deck. The first
    phase that hoists does so at each speed, reached by the joystick's ramp. Errors: LiftError.
    """
    if not 1 <= starts <= MOST_STARTS:
        raise LiftError(f"starts = {starts}: give 1 to {MOST_STARTS}.")
    hoists = next((i for i, phase in enumerate(lift.programme) if (phase.speed or 0.0) < 0.0), 0)
    if not lift.on_deck or hoists == 0 or lift.programme[0].time is None:
        raise LiftError(
            "hoisting speeds are of a lift off a deck: give deck.slack, a first phase that waits for a time, and one"
            " that hoists."
        )
    assert lift.deck is not None
    span = period_of(lift.deck.motion) if span is None else span
    wanted = sorted({float(v) for v in speeds})
    if not wanted or wanted[0] <= 0.0:
        raise LiftError("hoisting speeds: give one or more above 0 m/s.")
    later = [span * i / starts for i in range(starts)]
    lift = lasting(lift, hoists, wanted[0], wanted[-1], span)
    cases = [begun(lift, hoists, v, t) for v in wanted for t in later]
    data = simulate(crane, cases, end=End.PROGRAMME, progress=progress)
    names = ("v_second_hit_max", "F_sling_max", "F_w_max", "sling_slack_time", "v_w_max")
    rows = []
    for v, *of in zip(wanted, *(data[name].values.reshape(-1, starts) for name in names), strict=True):
        hit, F_hook, F_tip, slack, v_w = of
        again = np.isfinite(hit)
        fastest = float(hit[again].max()) if again.any() else 0.0
        forces = float(F_hook.max()), float(F_tip.max())
        rows.append(AtSpeed(v, float(again.mean()), fastest, *forces, float(slack.max()), float(v_w.min())))
    hit_at = [row.v for row in rows if row.share > 0.0]
    lowest = next((v for v in wanted if not hit_at or v > hit_at[-1]), math.nan)
    return HoistingSpeed(lowest, tuple(rows), starts, span)


def period_of(motion: Motion) -> float:
    """Time over which starts are spread [s]: the period of a sine, else `SPAN`."""
    return motion.period if isinstance(motion, Sine) else SPAN


def begun(lift: Lowering, hoists: int, v: float, later: float) -> Lowering:
    """The lift that hoists at v [m/s] in a phase and begins later [s]."""
    programme = list(lift.programme)
    programme[0] = programme[0].model_copy(update={"time": (programme[0].time or 0.0) + later})
    programme[hoists] = programme[hoists].model_copy(update={"speed": -v})
    return lift.model_copy(update={"programme": tuple(programme)})


def lasting(lift: Lowering, hoists: int, slowest: float, fastest: float, span: float) -> Lowering:
    """The lift, long enough for every speed [m/s] and start. Errors: LiftError where its motions are too short."""
    assert lift.deck is not None
    phase = lift.programme[hoists]
    way = 0.0 if phase.depth is None else lift.deck.height + phase.depth
    waits = sum(each.time or 0.0 for each in lift.programme)
    need = waits + span + ((lift.deck.slack or 0.0) + abs(way)) / slowest + fastest / lift.winch.ramp + lift.ramp
    known = [d for motion in (lift.tip, lift.deck.motion) if (d := motion.duration) is not None]
    if need > lift.duration and known:
        raise LiftError(
            f"duration = {show(lift.duration, 'time')}: all speeds and starts take {show(need, 'time')}. Give that, or"
            " fewer."
        )
    return lift.model_copy(update={"duration": max(need, lift.duration)})
