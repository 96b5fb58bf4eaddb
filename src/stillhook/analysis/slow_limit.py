"""Does a loaded winch swing when it is slow? The gain limit of the whole plant where friction falls with speed."""

from __future__ import annotations

from typing import NamedTuple

from stillhook.analysis.controllers import Controller
from stillhook.analysis.loop_stability.governing import (
    SLOW,
    Place,
    calm,
    carried,
    plant_loop_at,
    slow_places,
    wire_range,
)
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.spec.crane import Crane

__all__ = ["SLOW", "SlowLimit", "slow_limit"]


class SlowLimit(NamedTuple):
    """Least gain limit K_p_ms with PLC [1/m] among slow speeds of either sign; tip speed [m/s] and displacement [-] of
    that point, its payload [kg] and wire paid out [m]."""

    K_p_ms: float
    v_tip: float
    alpha_m: float
    load: float
    s_w: float

    @property
    def place(self) -> Place:
        """Where the plant stands."""
        return Place(self.load, self.s_w, self.v_tip)


def slow_limit(
    crane: Crane, which: Controller, *, load: float | None = None, s_w: float | None = None, delay: float = 0.0
) -> SlowLimit | None:
    """The position gain with which this controller makes the winch swing at low speed; None where no slow point can be
    held.

    The published loop has a viscous coefficient instead of friction and does not know of this: break-away friction
    falls with speed, which takes damping away, most where a small displacement makes pressure per torque large. SSC is
    at full displacement there, HS is not.
    Parameters: load payload [kg], default empty hook and the heaviest that the mode carries; s_w wire paid out [m],
    default short, middle and long wire; delay of the position feedback [s].
    The load does not ring on its wire here: what its swing does whatever the gain is in
    `stillhook.analysis.loop_stability.governing.Governing.swings`. Valid: small swings about a sliding winch; beyond
    the limit they grow to a limit cycle of stick and slip.
    """
    machine = calm(which.on(crane))
    wires = wire_range(machine) if s_w is None else (s_w,)
    found = []
    for place in slow_places(carried(machine, which.mode) if load is None else (load,), wires):
        here = plant_loop_at(machine, which.mode, place, delay=delay)
        if here is not None:
            found.append(SlowLimit(gain_limit_of(here.loop)[0], place.v_tip, here.alpha_m, place.load, place.s_w))
    return min(found, default=None)
