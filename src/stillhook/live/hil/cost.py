"""What a bus costs: the control error of the twin under a PLC over the bus, against the same crane in process."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.session import Session
from stillhook.live.hil.soft_plc import Cycle
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

SETTLE = 20.0
"""Time after the PLC took over that is left out [s]."""
LEAST = 15.0
"""Shortest time that is compared [s]."""
LONGEST = 3600.0
"""Longest time of the twin that is calculated again [s]."""
SAME_TIP = 1.0e-3
"""Difference of the tip at the same time up to which the motion is the scenario's [m]."""


class BusCost(NamedTuple):
    """Control error peak to peak over the bus and in process [m], and the tip's motion peak to peak [m], from begin to
    end [s]."""

    e_c_pp: float
    e_c_pp_in_process: float
    s_tip_pp: float
    begin: float
    end: float

    @property
    def cost(self) -> float:
        """What the bus costs [m]."""
        return self.e_c_pp - self.e_c_pp_in_process


def bus_cost(crane: Crane, scenario: Scenario, seen: list[Cycle]) -> BusCost | str:
    """The cost, or why there is none. crane: with the settings that it has in process; seen: what the PLC saw."""
    times, e_c, tips = np.array(seen, dtype=np.float64).reshape(-1, 3).T
    if not np.isfinite(times).all() or not np.isfinite(e_c).all():
        return "The twin's time and control error did not come over the bus."
    first, last = (times[0], times[-1]) if len(times) else (0.0, 0.0)
    kept = times >= first + SETTLE
    if last - first < SETTLE + LEAST:
        return f"{last - first:.0f} s is too short for the cost of the bus: {SETTLE + LEAST:.0f} s or more are needed."
    if last > LONGEST:
        return f"The twin runs for {last:.0f} s: the cost of the bus is worked out in its first {LONGEST:.0f} s."
    own = in_process(crane, scenario, last)
    at = np.clip(np.rint(times[kept] / crane.control.t_cycle).astype(int), 0, len(own) - 1)
    if np.abs(own[at, 1] - tips[kept]).max() > SAME_TIP:
        return "The tip did not move as the case file says: the cost of the bus is not known."
    over, within, tip = (float(np.ptp(x)) for x in (e_c[kept], own[at[0] : at[-1] + 1, 0], tips[kept]))
    return BusCost(over, within, tip, float(times[kept][0]), float(last))


def in_process(crane: Crane, scenario: Scenario, end: float) -> FloatArray:
    """Control error and tip (cycles, 2) of every PLC cycle up to a time [s], with the controller in process [m]."""
    session = Session(crane, scenario)
    out = np.empty((math.ceil(end / session.cycle) + 1, 2))
    for row in out:
        row[:] = session.get("e_c"), session.get("s_tip")
        session.step()
    return out
