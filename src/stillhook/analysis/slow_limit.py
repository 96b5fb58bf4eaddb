"""Does a loaded winch swing when it is slow? The gain limit of the whole plant where friction falls with speed."""

from __future__ import annotations

from typing import NamedTuple

from stillhook.analysis.controllers import Controller
from stillhook.analysis.loop_stability import full_stability
from stillhook.analysis.operation import NoSteadyOperation
from stillhook.crane import Crane

SLOW = (2.0 / 60.0, 5.0 / 60.0)
"""Tip speeds that are looked at [m/s], 2 and 5 m/min: there friction falls with speed most."""


class SlowLimit(NamedTuple):
    """Least gain limit K_p_ms with PLC [1/m] among slow speeds of either sign; tip speed [m/s] and displacement [-] of that point."""

    K_p_ms: float
    v_tip: float
    alpha_m: float


def slow_limit(crane: Crane, which: Controller, *, load: float, s_w: float, delay: float = 0.0) -> SlowLimit | None:
    """The position gain with which this controller makes the loaded winch swing at low speed; None where no slow point can be held.

    The published loop has a viscous coefficient instead of friction and does not know of this: break-away friction falls with speed, which
    takes damping away, most where a small displacement makes pressure per torque large. SSC is at full displacement there, HS is not.
    Parameters: load payload [kg]; s_w wire paid out [m]; delay of the position feedback [s].
    Valid: small swings about a sliding winch; beyond the limit they grow to a limit cycle of stick and slip.
    """
    machine = which.on(crane)
    found = []
    for v in (sign * v for v in SLOW for sign in (1.0, -1.0)):
        try:
            s, _ = full_stability(machine, load=load, s_w=s_w, v_tip=v, mode=which.mode, delay=delay)
        except NoSteadyOperation:
            continue
        found.append(SlowLimit(s.K_p_ms_plc, v, s.alpha_m))
    return min(found, default=None)
