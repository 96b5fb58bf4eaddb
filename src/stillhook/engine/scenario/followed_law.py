"""A controller's law followed without a run: what it answers to an error and what it remembers of it, and the control
error that stays while it holds a command against leakage."""

from __future__ import annotations

import math
from typing import Any

from stillhook.control.interface import Demand, Reading, Sensed
from stillhook.control.registry import ControlLaw
from stillhook.engine.pack.winch import plc_record
from stillhook.spec.control import own_settings
from stillhook.spec.crane import Crane

CYCLE = 0.1
"""PLC cycle with which a law is followed to its steady state, which does not depend on it [s]; shorter for a stiff
position loop."""
LOOP_SHARE = 0.2
"""Longest such cycle over the time constant of the position loop [-]."""
LONGEST = 600.0
"""Time for which a law is followed [s]: ten times the slowest integral part that `tune` searches."""
WINDOW = 200
"""Cycles over which the error must be constant to be the one that stays."""
STILL = 1e-4
"""Change over that window, over the error of a proportional law, that counts as standing still [-]."""
SMALL_SHARE = 2.0**-10
"""Feedback by which the share that reaches the pumps is found [-]: within a law's limits, and a power of two, so that a
law that passes it on has exactly 1."""
LEAST_GAIN = 1e-12
"""In place of a position gain of 0 where it is divided by [1/m]."""


class FollowedLaw:
    """A law on a crane: weight F on the load cell [N], motors at alpha_m [-] on the layer of K_wire [-], the tip at
    v_tip [m/s]; t_cycle [s], default the crane's."""

    def __init__(
        self,
        crane: Crane,
        law: ControlLaw,
        F: float,
        *,
        K_wire: float = 1.0,
        alpha_m: float = 1.0,
        v_tip: float = 0.0,
        t_cycle: float | None = None,
    ) -> None:
        self.law, self.plc, own = law, plc_record(crane), own_settings(crane.control, law)
        plc = self.plc if t_cycle is None else self.plc._replace(t_cycle=t_cycle)
        self._shared = [plc] if own is None else [plc, own]
        self.y = Sensed(*(0.0,) * len(Sensed._fields))._replace(
            F=F, K_wire=K_wire, alpha_m=alpha_m, v_tip=v_tip, mode=law.code, f_pump=1.0
        )

    @property
    def K_p(self) -> float:
        """Position gain [1/m]."""
        return max(float(self.plc.gains.K_p), LEAST_GAIN)

    def start(self) -> Any:
        """What it remembers when it comes into force; None for a law without memory."""
        return None if self.law.memory is None else self.law.memory()

    def after(self, u_fb: float, memory: Any, u_ff: float = 0.0) -> tuple[Demand, Any]:
        """Demand and memory after a cycle with these shares of feedback and feedforward [-]."""
        reading = Reading(y=self.y, e_c=-u_fb / self.K_p, F=self.y.F, u_ff=u_ff, u_fb=u_fb)
        if self.law.memory is None:
            return self.law.cycle(reading, *self._shared), None
        demand, memory = self.law.cycle(reading, *self._shared, memory)
        return demand, memory

    @property
    def feedback_share(self) -> float:
        """Part of the feedback that it commands the pumps when it comes into force [-]."""
        (with_feedback, _), (without, _) = (self.after(u, self.start()) for u in (SMALL_SHARE, 0.0))
        return (with_feedback.u_p - without.u_p) / SMALL_SHARE

    def is_proportional(self, u: float) -> bool:
        """Whether it adds a feedback u [-] to the command as it is, and remembers nothing."""
        return self.law.memory is None and self.after(u, None)[0].u_p == u


def standing_error(crane: Crane, law: ControlLaw, u: float, v_full: float, **at: float) -> float:
    r"""Error that stays under a law that has to hold a pump command u [-], without sign [m].

    The law is run against a winch without lag, :math:`\dot e_c = v_{full} (u_p - u)`, until the error is constant.

    Parameters: u command that leakage takes, hoisting positive; v_full wire speed at full command [m/s]; at as in
    `FollowedLaw`.
    """
    followed = FollowedLaw(crane, law, **at)
    proportional = u / followed.K_p
    if followed.is_proportional(u):
        return proportional
    t = min(CYCLE, LOOP_SHARE / max(followed.K_p * v_full, LEAST_GAIN))
    followed = FollowedLaw(crane, law, t_cycle=t, **at)
    memory, e_c, before = followed.start(), 0.0, 0.0
    for k in range(1, math.ceil(LONGEST / t) + 1):
        demand, memory = followed.after(-followed.K_p * e_c, memory)
        e_c += t * v_full * (demand.u_p - u)
        if k % WINDOW == 0:
            if abs(e_c - before) <= STILL * proportional:
                break
            before = e_c
    return abs(e_c)
