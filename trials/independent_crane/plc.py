"""The PLC of the independent crane: heave compensation, make-up, brake; written without the twin's control code, SI
throughout.

Signs: hoisting positive for pump command and the operator's speed; up positive for the tip; s_w is wire paid out.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

LEAST_PASSIVE_PRESSURE = 1e6
"""Pressure difference below which the PLC does not calculate the passive setting [Pa] (assumed)."""
STOPPED = 1e-3
"""Pump command below which the winch counts as stopped [-] (assumed)."""
MANUAL, NS, SSC = 0.0, 3.0, 5.0
"""Codes of the PLC's modes in the log: manual, heave compensation at normal speed, the same with secondary control."""


class Settings(NamedTuple):
    """Numbers of the PLC."""

    K_1: float  # speed feedforward [s/m]
    K_2: float  # acceleration feedforward [s^2/m]
    K_p: float  # position gain [1/m]
    u_thr: float  # feedforward from which the motors are reduced
    alpha_min: float  # smallest setting of the active motors
    alpha_ns: float  # their setting at normal speed
    alpha_swl: float  # and what they keep for the safe working load
    F_swl: float  # weight of the safe working load with hook [N]
    d_max: float  # published diameter of the full drum [m]
    d_outer: float  # the same as its layers stack up [m]
    i: float  # gear ratio
    tau_F: float  # filter of the load cell [s]
    tau_acc: float  # filter of the passive pressure [s]
    p_set: float  # pressure that make-up holds [Pa]
    K_acc: float  # gain of make-up [1/Pa]
    D_passive: float  # passive motors that it counts on, all together [m^3/rad]
    p_lp: float  # low side of the passive circuit [Pa]
    Q_passive: float  # full flow of the passive pumps [m^3/s]
    brake: float  # 1 where the brake is used
    t_wait: float  # at rest until it closes [s]
    t_brake: float  # that it takes to close or open [s]
    cycle: float  # [s]
    steps: int  # of the plant in a cycle


class Reading(NamedTuple):
    """What the PLC reads in a cycle."""

    s_mru: float  # tip from the motion unit [m]
    v_mru: float  # [m/s]
    a_mru: float  # [m/s^2]
    s_w: float  # wire counter [m]
    F: float  # load cell [N]
    p_hp: float  # passive pressure [Pa]
    d: float  # drum diameter of the layer in use [m]
    alpha_m: float  # setting of the active motors
    v_op: float  # operator's speed [m/s]
    mode: float


class Commands(NamedTuple):
    """Commands of a cycle."""

    u_p: float  # active pumps, -1 to 1
    u_m: float  # active motors
    u_pm: float  # passive motors
    u_pp: float  # passive pumps, -1 to 1
    brake_closed: float  # 0 or 1


class Memory(NamedTuple):
    """What the PLC keeps between cycles."""

    F: float  # filtered force [N]
    p: float  # filtered passive pressure [Pa]
    datum: float  # of the position loop [m]
    s_op: float  # wire that the operator has taken in since [m]
    mode: float
    idle: float  # time at rest [s]
    brake: float  # 0 open to 1 closed
    u_p: float  # commands to pumps
    u_m: float  # and motors


@njit
def clip(x: float, low: float, high: float) -> float:
    """x held between low and high."""
    return min(high, max(low, x))


@njit
def motor_reduction(F: float, u_ff: float, K_out: float, K_wire: float, mode: float, c: Settings) -> float:
    """Command of the active motors: fixed at normal speed; with secondary control full below u_thr, then falling
    linearly with the feedforward to what the load allows (Moslatt 2020 eq. 2.9 to 2.11).

    F filtered load cell [N]; u_ff feedforward; K_out, K_wire published diameter over that of the full drum and of the
    layer in use.
    """
    lowest = max(c.alpha_min, min(1.0, c.alpha_swl * F / c.F_swl * K_out / K_wire))
    part = clip((abs(u_ff) - c.u_thr) / (1.0 - c.u_thr), 0.0, 1.0)
    u_m = 1.0 - part * (1.0 - lowest)
    if mode == NS:
        u_m = c.alpha_ns * K_out / K_wire
    return clip(u_m, c.alpha_min, 1.0)


@njit
def brake_and_rest(r: Reading, m: Memory, c: Settings) -> tuple[float, float]:
    """Time at rest [s] and the brake, 0 open to 1 closed: it closes after t_wait at rest and opens at once."""
    at_rest = r.mode == MANUAL and r.v_op == 0.0 and abs(m.u_p) < STOPPED
    idle = m.idle + c.cycle if at_rest else 0.0
    brake = m.brake
    if c.brake > 0.0:
        if idle > c.t_wait:
            brake = min(1.0, brake + c.cycle / c.t_brake)
        elif idle == 0.0:
            brake = max(0.0, brake - c.cycle / c.t_brake)
    return idle, brake


@njit
def plc_cycle(r: Reading, m: Memory, c: Settings) -> tuple[Memory, Commands, float]:
    """One cycle: reading r, memory m, settings c. Returns memory, commands and control error [m].

    Form: speed and acceleration feedforward with a position loop, Moslatt 2020 papers C and E; the passive setting
    holds the load cell's force, make-up holds the pressure and takes what the operator's speed needs (assumed).
    """
    idle, brake = brake_and_rest(r, m, c)
    compensates = 1.0 if r.mode > MANUAL else 0.0
    if m.mode > MANUAL and r.mode > MANUAL:
        datum, s_op = m.datum, m.s_op + r.v_op * c.cycle
    else:
        datum, s_op = r.s_w - r.s_mru, 0.0
    e = datum + r.s_mru - s_op - r.s_w
    F = m.F + (r.F - m.F) * c.cycle / (c.tau_F + c.cycle)
    p = m.p + (r.p_hp - m.p) * c.cycle / (c.tau_acc + c.cycle)
    K_wire, K_out = c.d_max / r.d, c.d_max / c.d_outer
    u_ff = -(c.K_1 * (compensates * r.v_mru - r.v_op) + c.K_2 * compensates * r.a_mru) * K_wire * r.alpha_m
    u_p = clip(u_ff - compensates * c.K_p * e, -1.0, 1.0)
    if brake > 0.0:
        u_p = 0.0
    u_m = motor_reduction(F, u_ff, K_out, K_wire, r.mode, c)
    lever = 0.5 * r.d / c.i
    u_pm = clip(F * lever / (c.D_passive * max(r.p_hp - c.p_lp, LEAST_PASSIVE_PRESSURE)), 0.0, 1.0)
    u_pp = clip(c.K_acc * (c.p_set - p) + c.D_passive * u_pm * r.v_op / lever / c.Q_passive, -1.0, 1.0)
    closed = 1.0 if brake > 0.5 else 0.0
    return Memory(F, p, datum, s_op, r.mode, idle, brake, u_p, u_m), Commands(u_p, u_m, u_pm, u_pp, closed), e
