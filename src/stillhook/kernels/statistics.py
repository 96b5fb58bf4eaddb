"""Running statistics of one trajectory, folded once per PLC cycle; no series is stored."""

from typing import NamedTuple

from stillhook.physics.scalar import fmax, fmin, scalar
from stillhook.winches.records import Powers

BIG = 1.0e300


class Stats(NamedTuple):
    """Extremes, times [cycles] and sums over the part of the run that counts (after the warm-up).

    `_cycles` fields count PLC cycles; `e_sum`, `e2_sum`, the tip's sums and the powers are trapezoidal sums over
    cycles.
    """

    cycles: float
    e_min: float
    e_max: float
    em_min: float
    em_max: float
    tip_min: float
    tip_max: float
    p_a_max: float
    p_b_max: float
    p_min: float
    p_hp_min: float
    p_hp_max: float
    alpha_p_max: float
    alpha_m_min: float
    u_p_max: float
    u_raw_max: float
    omega_max: float
    v_w_max: float
    v_tip_max: float
    F_min: float
    F_max: float
    V_min: float
    V_max: float
    saturation_cycles: float
    relief_cycles: float
    overspeed_cycles: float
    stroke_cycles: float
    slack_cycles: float
    cavitation_cycles: float
    wire_cycles: float
    power_cycles: float
    boost_cycles: float
    P_min: float
    P_max: float
    e_sum: float
    e2_sum: float
    tip_sum: float
    tip2_sum: float
    pump_abs: float
    E_start: float
    E_end: float
    power: Powers


def blank() -> Stats:
    """Statistics of nothing yet."""
    values = dict.fromkeys(Stats._fields, 0.0)
    for low in ("e_min", "em_min", "tip_min", "p_min", "p_hp_min", "alpha_m_min", "F_min", "V_min", "P_min"):
        values[low] = BIG
    for high in ("e_max", "em_max", "tip_max", "F_max", "V_max", "P_max"):
        values[high] = -BIG
    values["power"] = Powers(*[0.0] * len(Powers._fields))  # type: ignore[assignment]
    return Stats(**values)  # type: ignore[arg-type]


@scalar
def add_powers(a, b, w):
    return Powers(
        a.pump + w * b.pump,
        a.boost + w * b.boost,
        a.passive_pump + w * b.passive_pump,
        a.tip + w * b.tip,
        a.friction + w * b.friction,
        a.leakage + w * b.leakage,
        a.relief + w * b.relief,
        a.flushing + w * b.flushing,
        a.wire + w * b.wire,
        a.drag + w * b.drag,
        a.passive + w * b.passive,
    )


@scalar
def flag(condition):
    return 1.0 if condition else 0.0


@scalar
def fold(a, y, power, E, limits, w):
    """Statistics with one more cycle: y Signals, power Powers, E stored energy [J], limits Limits, w weight of the
    cycle in integrals.

    w is 1, and 0.5 at both ends of the part that counts (trapezoidal rule).
    """
    E_start = E if a.cycles == 0.0 else a.E_start
    return Stats(
        cycles=a.cycles + 1.0,
        e_min=fmin(a.e_min, y.e_c),
        e_max=fmax(a.e_max, y.e_c),
        em_min=fmin(a.em_min, y.e_c_measured),
        em_max=fmax(a.em_max, y.e_c_measured),
        tip_min=fmin(a.tip_min, y.s_tip),
        tip_max=fmax(a.tip_max, y.s_tip),
        p_a_max=fmax(a.p_a_max, y.p_a),
        p_b_max=fmax(a.p_b_max, y.p_b),
        p_min=fmin(a.p_min, fmin(y.p_a, y.p_b)),
        p_hp_min=fmin(a.p_hp_min, y.p_hp),
        p_hp_max=fmax(a.p_hp_max, y.p_hp),
        alpha_p_max=fmax(a.alpha_p_max, abs(y.alpha_p)),
        alpha_m_min=fmin(a.alpha_m_min, y.alpha_m),
        u_p_max=fmax(a.u_p_max, abs(y.u_p)),
        u_raw_max=fmax(a.u_raw_max, abs(y.u_raw)),
        omega_max=fmax(a.omega_max, abs(y.omega_m)),
        v_w_max=fmax(a.v_w_max, abs(y.v_w)),
        v_tip_max=fmax(a.v_tip_max, abs(y.v_tip)),
        F_min=fmin(a.F_min, y.F_w),
        F_max=fmax(a.F_max, y.F_w),
        V_min=fmin(a.V_min, y.V_acc),
        V_max=fmax(a.V_max, y.V_acc),
        saturation_cycles=a.saturation_cycles + flag(abs(y.u_raw) > 1.0),
        relief_cycles=a.relief_cycles + fmax(flag(y.Q_relief > 0.0), limits.relief_p),
        overspeed_cycles=a.overspeed_cycles + limits.too_fast,
        stroke_cycles=a.stroke_cycles + limits.at_end,
        slack_cycles=a.slack_cycles + flag(y.F_w <= 0.0),
        cavitation_cycles=a.cavitation_cycles + flag(fmin(y.p_a, y.p_b) <= 0.0),
        wire_cycles=a.wire_cycles + limits.wire_end,
        power_cycles=a.power_cycles + limits.power,
        boost_cycles=a.boost_cycles + limits.boost,
        P_min=fmin(a.P_min, y.P_hpu),
        P_max=fmax(a.P_max, y.P_hpu),
        e_sum=a.e_sum + w * y.e_c,
        e2_sum=a.e2_sum + w * y.e_c * y.e_c,
        tip_sum=a.tip_sum + w * y.s_tip,
        tip2_sum=a.tip2_sum + w * y.s_tip * y.s_tip,
        pump_abs=a.pump_abs + w * (abs(power.pump) + abs(power.passive_pump)),
        E_start=E_start,
        E_end=E,
        power=add_powers(a.power, power, w),
    )
