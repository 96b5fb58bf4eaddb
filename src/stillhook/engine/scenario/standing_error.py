"""The control error that stays while a controller holds a command against leakage, asked of its own law."""

from __future__ import annotations

import math
from typing import Any

from stillhook.control.interface import Reading, Sensed
from stillhook.control.registry import ControlLaw
from stillhook.engine.pack.winch import plc_record
from stillhook.spec.crane import Crane, own_settings

CYCLE = 0.1
"""PLC cycle with which a law is followed to its steady state, which does not depend on it [s]; shorter for a stiff
position loop."""
LOOP_SHARE = 0.2
"""Longest such cycle over the time constant of the position loop [-]."""
LONGEST = 600.0
"""Time for which a law is followed [s]: ten times the slowest integral part that `tune` searches."""
WINDOW = 200
"""Cycles over which the error must stand still to be the one that stays."""
STILL = 1e-4
"""Change over that window, over the error of a proportional law, that counts as standing still [-]."""


def proportional_error(crane: Crane, u: float) -> float:
    """Error with which a proportional feedback holds a command u [-], without sign [m]."""
    return u / max(crane.control.K_p, 1e-12)


def is_proportional(crane: Crane, law: ControlLaw, u: float, y: Sensed) -> bool:
    """Whether a law adds the feedback to the command as it is, and remembers nothing."""
    reading = Reading(y=y, e_c=-proportional_error(crane, u), F=y.F, u_ff=0.0, u_fb=u)
    return law.memory is None and law.demand(reading, plc_record(crane), own_settings(crane.control, law)).u_p == u


def standing_error(crane: Crane, law: ControlLaw, u: float, v_full: float, y: Sensed) -> float:
    r"""Error that stays under a law that has to hold a pump command u [-], without sign [m].

    The law is run against a winch without lag, :math:`\dot e_c = v_{full} (u_p - u)`, until the error stands still.

    Parameters: u command that leakage takes, hoisting positive; v_full wire speed at full command [m/s]; y what the PLC
    reads of a winch at rest.
    """
    if is_proportional(crane, law, u, y):
        return proportional_error(crane, u)
    plc = plc_record(crane)
    K_p, settings = plc.gains.K_p, own_settings(crane.control, law)
    t = min(CYCLE, LOOP_SHARE / max(K_p * v_full, 1e-12))
    first: list[Any] = [plc._replace(t_cycle=t)] if settings is None else [plc._replace(t_cycle=t), settings]
    memory = None if law.memory is None else law.memory()
    e_c = before = 0.0
    for k in range(1, math.ceil(LONGEST / t) + 1):
        reading = Reading(y=y, e_c=e_c, F=y.F, u_ff=0.0, u_fb=-K_p * e_c)
        if memory is None:
            demand = law.cycle(reading, *first)
        else:
            demand, memory = law.cycle(reading, *first, memory)
        e_c += t * v_full * (demand.u_p - u)
        if k % WINDOW == 0:
            if abs(e_c - before) <= STILL * proportional_error(crane, u):
                break
            before = e_c
    return abs(e_c)
