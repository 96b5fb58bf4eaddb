"""Where a winch compensates: payload, wire paid out, speed of the tip; the places at which margins are looked at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.engine.pack.winch import drum_record, wire_speed_max
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import wire_usable
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import show

SLOW = tuple(v / 60.0 for v in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0))
"""Slow tip speeds that are looked at, in both directions [m/s], 0.5 to 20 m/min: there friction falls with speed."""
FAST = (0.7, 1.2)
"""Fast ones, over the wire speed with the pumps and the motors full [-]; above 1 motors are at less displacement."""
SHARES = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Payloads over the heaviest of the mode [-]; 0 is the empty hook."""
SHORTEST = 15.0
"""Shortest wire paid out that is looked at [m]."""
LENGTHS = 5
"""Lengths of wire from the shortest to all that the drum can pay out, in geometric steps."""


STROKES = (-0.4, 0.4)
"""Where a stroke that limits the winch is looked at: the tip from its middle over the stroke [-], near both ends;
between them limits rise and fall steadily."""


class Place(NamedTuple):
    """Where the winch compensates: payload load [kg], wire paid out s_w [m], constant speed of the tip v_tip, up
    positive [m/s]; stroke where a stroke that limits the winch is: the tip from its middle, up positive, over the
    stroke [-]."""

    load: float
    s_w: float
    v_tip: float
    stroke: float = 0.0

    def describe(self) -> str:
        """In words, such as "150 t at 2 m/min on 100 m of wire, tip going up"."""
        way = "up" if self.v_tip > 0.0 else "down"
        load = show(self.load, "mass", 4) if self.load > 0.0 else "empty hook"
        at = f", tip {self.stroke:+.0%} of the stroke from its middle" if self.stroke else ""
        wire = show(self.s_w, "length", 4)
        return f"{load} at {show(abs(self.v_tip), 'speed', 3)} on {wire} of wire, tip going {way}{at}"


def payloads_of_mode(
    crane: Crane, mode: Mode, most: float = math.inf, shares: Sequence[float] = SHARES
) -> tuple[float, ...]:
    """Payloads from the empty hook, where there is one, to the heaviest that a mode carries (HS 60 % of the SWL, the
    others all of it), `most` at most [kg]."""
    heaviest = min(mode.law.swl_share * crane.SWL, most)
    least = 0.0 if crane.hook_mass > 0.0 else min(shares[1:])
    return tuple(dict.fromkeys(share * heaviest for share in shares if share >= least)) or (heaviest,)


def wire_range(crane: Crane) -> tuple[float, ...]:
    """Wire paid out from the shortest to all that the drum can pay out [m], in geometric steps."""
    longest = wire_usable(drum_record(crane))
    return tuple(float(s) for s in np.geomspace(min(SHORTEST, longest), longest, LENGTHS))


def tip_speeds(crane: Crane) -> tuple[float, ...]:
    """Tip speeds without sign that are looked at [m/s], slow to fast."""
    full = wire_speed_max(crane)
    return (*SLOW, *(share * full for share in FAST if share * full > SLOW[-1]))


def strokes_of(crane: Crane) -> tuple[float, ...]:
    """Where a stroke that limits the winch is looked at [-]; one place for a winch without."""
    return STROKES if has_cylinder(crane) else (0.0,)


def has_cylinder(crane: Crane) -> bool:
    """Whether a cylinder in the wire's path compensates, whose place in its stroke changes the loop."""
    return getattr(crane, "cylinder", None) is not None


def places_of(
    loads: Sequence[float],
    wires: Sequence[float],
    speeds: Sequence[float] = SLOW,
    strokes: Sequence[float] = (0.0,),
) -> tuple[Place, ...]:
    """Every payload [kg] on each length of wire [m], at speeds of the tip of both signs [m/s] and places of the stroke.

    Errors: StillhookError for a speed that is 0 or not finite.
    """
    for v in speeds:
        if not (math.isfinite(v) and v != 0.0):
            raise StillhookError(f"v_tip = {v:g} m/s: a winch at rest sticks. Give a finite speed that is not 0.")
    return tuple(
        Place(m, s_w, sign * v, at)
        for m in dict.fromkeys(loads)
        for s_w in dict.fromkeys(wires)
        for v in speeds
        for sign in (1.0, -1.0)
        for at in strokes
    )
