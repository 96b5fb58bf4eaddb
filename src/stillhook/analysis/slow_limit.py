"""Does a loaded winch oscillate at low speed? The gain limit of the complete plant where friction falls with speed."""

from __future__ import annotations

from typing import NamedTuple

from stillhook.analysis.controllers import Controller
from stillhook.analysis.loop_stability.governing import (
    SLOW,
    Place,
    payloads_of_mode,
    plant_loop_at,
    slow_places,
    wire_range,
    with_damped_wire,
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
        """Operating point of the plant."""
        return Place(self.load, self.s_w, self.v_tip)


def slow_limit(
    crane: Crane, selected: Controller, *, load: float | None = None, s_w: float | None = None, delay: float = 0.0
) -> SlowLimit | None:
    """The position gain with which this controller makes the winch oscillate at low speed; None where no slow point can
    be held.

    The published loop has a viscous coefficient instead of friction and does not know of this: break-away friction
    falls with speed, which takes damping away, most where a small displacement makes pressure per torque large. SSC is
    at full displacement there, HS is not.
    Parameters: load payload [kg], default empty hook and the heaviest that the mode carries; s_w wire paid out [m],
    default short, middle and long wire; delay of the position feedback [s].
    The load does not ring on its wire here; its oscillation whatever the gain is in
    `stillhook.analysis.loop_stability.governing.Governing.swings`. Valid: small oscillations about a sliding winch;
    beyond the limit they grow to a limit cycle of stick and slip.
    """
    machine = with_damped_wire(selected.on(crane))
    wires = wire_range(machine) if s_w is None else (s_w,)
    limits = []
    for place in slow_places(payloads_of_mode(machine, selected.mode) if load is None else (load,), wires):
        loop = plant_loop_at(machine, selected.mode, place, delay=delay)
        if loop is not None:
            limits.append(
                SlowLimit(
                    K_p_ms=gain_limit_of(loop.loop)[0],
                    v_tip=place.v_tip,
                    alpha_m=loop.alpha_m,
                    load=place.load,
                    s_w=place.s_w,
                )
            )
    return min(limits, default=None)
