"""What the wanted motion alone takes of pressure, from steady operation of the complete plant and inertia."""

from __future__ import annotations

import numpy as np

from benchmarks.displacement.scoring import DURATION, WARM_UP
from stillhook import Crane, Scenario
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.engine.pack.winch import plc_record

STEP, SLOWEST, SPEEDS = 0.05, 0.02, 12
"""Step in time [s]; lowest wire speed at which the winch is looked at [m/s], and number of speeds of one sign."""


def highest_pressure(crane: Crane, case: Scenario) -> float:
    r"""Higher of both lines while the wire moves exactly against the tip, motors at full displacement [Pa].

    .. math:: p = p_{boost} + \left|\Delta p(v) + \frac{J \dot v}{r D_m}\right|

    dp and the low side p_boost are those of the operating point at the wire speed v, hoisting positive: load, friction
    and leakage. Valid where nothing oscillates, with the accumulator at mid stroke.
    """
    t = np.arange(WARM_UP, DURATION, STEP)
    _, v_tip, a_tip = case.tip.sample(t)
    v, a = -v_tip, -a_tip
    most = max(abs(v).max(), 2.0 * SLOWEST)
    positive = np.linspace(SLOWEST, most, SPEEDS)
    speeds = np.concatenate([-positive[::-1], positive])
    points = [operating_point(crane, x, 1.0, load=case.load, s_w=case.s_w, v_tip=-x) for x in speeds.tolist()]
    plant, r = plc_record(crane).plant, points[0].geometry.r_eff
    dp = np.interp(v, speeds, [p.dp_m for p in points]) + plant.J * a / (r * plant.D_m)
    low = np.interp(v, speeds, [min(p.p_a, p.p_b) for p in points])
    return float((low + abs(dp)).max())
