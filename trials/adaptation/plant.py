"""The independent crane (`trials.independent_crane.plant`) with system friction of its own factor that steps in time,
oil that warms, a law of another form, and faults: leakage that grows, a gas vessel that is shut off, pumps whose
control becomes slow.

Records, servos, lines, drum, wire and gas are those of that plant; what turns the shaft is written here, because motor
loss and system friction have factors of their own and the truth is logged beside the signals.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from trials.independent_crane.plant import (
    FLOW_OF_PISTON,
    VISCOSITY_PER_KELVIN,
    VISCOUS_PART_OF_DRY,
    Inputs,
    Servo,
    Spooled,
    State,
    Winch,
    at_rest,
    bristle,
    gas_pressure,
    lines,
    loss_at_any_speed,
    loss_with_speed,
    servo,
    spooled,
    wire_force,
    with_settings,
)
from trials.independent_crane.plc import MANUAL, Commands, Memory, Reading, Settings, plc_cycle

FILE_FORM, OTHER_FORM = 0.0, 1.0
"""Laws: of the crane file's form; of another."""
STEEPER, REFERENCE_SPEED = 0.6, 100.0
"""Law of another form: the part with speed goes with speed to this power, and is the file's at REFERENCE_SPEED [rad/s]
(assumed)."""
PER_DECADE = 0.12
"""Law of another form: rise of the part at any speed per decade of speed [-] (assumed)."""
FloatArray = np.ndarray


class Drift(NamedTuple):
    """What changes in time: factors on system friction before and from cycle `at`; factor on the motors' loss; form of
    the law; oil's temperature at the start over nominal [K], what it warms by [K] and over which time [s]."""

    before: float
    after: float
    at: float
    motors: float
    form: float
    start: float
    warming: float
    tau: float


class Faults(NamedTuple):
    """Cycles from which on a fault is there, and its size: factor on the leakage of the active circuit; part of the gas
    that is shut off with its vessel; factor on the natural frequency of the pumps' control."""

    leak_at: float
    leak: float
    gas_at: float
    gas: float
    pumps_at: float
    pumps: float


class Log(NamedTuple):
    """What is logged, one value a cycle, as it is at the beginning of the cycle."""

    s_w: FloatArray  # wire paid out [m]
    omega: FloatArray  # motor speed [rad/s]
    p_a: FloatArray  # [Pa]
    p_b: FloatArray  # [Pa]
    p_hp: FloatArray  # at the passive motors [Pa]
    u_p: FloatArray  # commands to pumps
    u_m: FloatArray  # and motors
    alpha_p: FloatArray  # settings of pumps,
    alpha_m: FloatArray  # active motors
    alpha_pm: FloatArray  # and passive motors
    F: FloatArray  # load cell [N]
    T_loss: FloatArray  # truth: torque of all friction against hoisting positive [N m]
    F_true: FloatArray  # truth: force in the wire [N]
    rise: FloatArray  # truth: sliding friction after the step over that before it, at this state
    viscosity: FloatArray  # truth: over nominal
    p_gas: FloatArray  # truth: gas [Pa]
    V_gas: FloatArray  # truth: its volume [m^3]


@njit
def losses(x: State, p_gas: float, T_drum: float, winch: Winch, d: Drift, scale: float) -> tuple[float, float]:
    """Torques of all shafts at any speed and with speed, at nominal oil [N m]; scale of system friction."""
    act, pas, y = winch.active.motors, winch.passive.motors, winch.friction
    speed, dp, dp_pm = abs(x.omega), x.p_a - x.p_b, p_gas - winch.passive.p_lp
    D_a, D_p, shafts = act.D * x.a_m, pas.D * x.a_pm, act.installed + pas.installed
    motors = act.working * loss_at_any_speed(dp, D_a, winch.loss) + pas.working * loss_at_any_speed(
        dp_pm, D_p, winch.loss
    )
    turning = act.working * loss_with_speed(speed, D_a, winch.loss) + pas.working * loss_with_speed(
        speed, D_p, winch.loss
    )
    q = speed / y.Y_4
    fading = math.exp(-q) if d.form == 0.0 else math.exp(-q * q)
    dry = (y.Y_1 * T_drum + y.Y_3) * fading + y.Y_2 + y.Y_6 * T_drum
    if d.form == 0.0:
        viscous = y.Y_5 * speed
    else:
        viscous = y.Y_5 * REFERENCE_SPEED * (speed / REFERENCE_SPEED) ** STEEPER
        dry *= 1.0 + PER_DECADE * math.log10(1.0 + speed / 10.0)
    return d.motors * motors + scale * shafts * dry, d.motors * turning + scale * shafts * viscous


@njit
def advance(x, u, tip, start, viscosity, drum: Spooled, winch: Winch, d: Drift, scale, leaks, left, pumps: Servo, h):
    """The plant one step of h later, and the friction torque, wire force and passive pressure of this step. leaks:
    factor on the leakage; left: part of the gas that is not shut off; pumps: their control.

    A vessel is shut off at the pressure of the moment: what is left of the gas moves as all of it would by so much more
    oil."""
    act, pas, hoist, y = winch.active, winch.passive, winch.hoist, winch.friction
    s_tip, v_tip = tip
    force = wire_force(x, s_tip, v_tip, start, drum.r, hoist)
    D_a, D_p = act.motors.D * act.motors.working * x.a_m, pas.motors.D * pas.motors.working * x.a_pm
    p_gas = gas_pressure(x.T_gas, x.V_oil, pas)
    level, rising = losses(x, p_gas, 0.5 * drum.d * force, winch, d, scale)
    level = level * (1.0 - VISCOUS_PART_OF_DRY + VISCOUS_PART_OF_DRY * viscosity)
    z, rate = bristle(x.z, x.omega, level, u.brake_closed, y, h)
    a_p, da_p = servo(x.a_p, x.da_p, u.u_p, pumps, h)
    a_m, da_m = servo(x.a_m, x.da_m, u.u_m, winch.motors, h)
    a_pm, da_pm = servo(x.a_pm, x.da_pm, u.u_pm, winch.passive_motors, h)
    p_a, p_b = lines(x, a_p, D_a * x.omega, viscosity / leaks, act, h)
    inflow = pas.D_pumps * pas.omega_p * u.u_pp - D_p * x.omega - pas.leak * (p_gas - pas.p_lp)
    T_gas = x.T_gas + h * (p_gas * inflow / left + pas.hA * (pas.T_vessel - x.T_gas)) / pas.c_v
    p_hp = p_gas + pas.R * inflow + pas.F * math.tanh(inflow / FLOW_OF_PISTON)
    damping = y.ratio * math.sqrt(y.sigma_0 * winch.drum.J_shaft) * math.exp(-((x.omega / y.omega_fade) ** 2))
    drive = D_a * (p_a - p_b) + D_p * (p_hp - pas.p_lp)
    opposing = rising * viscosity * np.sign(x.omega) + y.sigma_0 * z + damping * (x.omega - rate * z)
    omega = x.omega + h * (drive - force * drum.r - opposing) / drum.J
    v_l = x.v_l + h * (force - hoist.W) / hoist.m
    F_cell = x.F_cell + h * (force - x.F_cell) / hoist.tau_cell
    s_w, s_l, V_oil = x.s_w - h * drum.r * omega, x.s_l + h * v_l, x.V_oil + h * inflow / left
    after = State(
        omega,
        s_w,
        z,
        a_p,
        da_p,
        a_m,
        da_m,
        a_pm,
        da_pm,
        p_a,
        p_b,
        V_oil,
        T_gas,
        p_gas,
        s_l,
        v_l,
        F_cell,
    )
    return after, opposing, force, p_hp


@njit
def run(
    inputs: Inputs, start: float, offset_F: float, winch: Winch, d: Drift, f: Faults, c: Settings, log: Log
) -> None:
    """Fill the log of one test that begins at rest with so much wire paid out [m]; offset_F zero error of the load cell
    [N]."""
    n, h = inputs.s_tip.shape[0], c.cycle / c.steps
    x = at_rest(start, inputs.s_tip[0], winch)
    m = Memory(winch.hoist.W, c.p_set, 0.0, 0.0, MANUAL, 0.0, 0.0, 0.0, winch.motors.high)
    p_port = winch.passive.p_lp
    quick = winch.pumps
    slow = Servo(quick.omega_n * f.pumps, quick.zeta, quick.rate_max, quick.low, quick.high)
    for i in range(n):
        drum = spooled(x.s_w, winch.drum)
        p_gas = gas_pressure(x.T_gas, x.V_oil, winch.passive)
        p_port = p_gas if i == 0 else p_port
        F = winch.hoist.gain_cell * x.F_cell + offset_F + inputs.noise_F[i]
        r = Reading(
            inputs.s_mru[i],
            inputs.v_mru[i],
            inputs.a_mru[i],
            x.s_w + inputs.noise_s_w[i],
            F,
            p_gas,
            drum.d,
            x.a_m,
            inputs.v_op[i],
            inputs.mode[i],
        )
        before = m
        m, u, _ = plc_cycle(r, m, c)
        if i == 0:
            x = with_settings(x, u)
        log.s_w[i], log.omega[i], log.p_a[i], log.p_b[i], log.p_hp[i] = x.s_w, x.omega, x.p_a, x.p_b, p_port
        log.u_p[i], log.u_m[i] = u.u_p, u.u_m
        log.alpha_p[i], log.alpha_m[i], log.alpha_pm[i], log.F[i] = x.a_p, x.a_m, x.a_pm, F
        late = Commands(before.u_p, u.u_m if i == 0 else before.u_m, u.u_pm, u.u_pp, u.brake_closed)
        warm = d.start + d.warming * (1.0 - math.exp(-i * c.cycle / d.tau))
        viscosity = math.exp(-VISCOSITY_PER_KELVIN * warm)
        scale = d.before if i < d.at else d.after
        leaks, left = (f.leak if i >= f.leak_at else 1.0), (1.0 - f.gas if i >= f.gas_at else 1.0)
        pumps = slow if i >= f.pumps_at else quick
        dry = 1.0 - VISCOUS_PART_OF_DRY + VISCOUS_PART_OF_DRY * viscosity
        level, rising = losses(x, p_gas, 0.5 * drum.d * x.F_cell, winch, d, d.before)
        level_after, rising_after = losses(x, p_gas, 0.5 * drum.d * x.F_cell, winch, d, d.after)
        log.rise[i] = (level_after * dry + rising_after * viscosity) / (level * dry + rising * viscosity)
        log.viscosity[i], log.p_gas[i], log.V_gas[i] = viscosity, p_gas, left * (winch.passive.V - x.V_oil)
        nxt = min(i + 1, n - 1)
        for j in range(c.steps):
            part = j / c.steps
            tip = (
                inputs.s_tip[i] + (inputs.s_tip[nxt] - inputs.s_tip[i]) * part,
                inputs.v_tip[i] + (inputs.v_tip[nxt] - inputs.v_tip[i]) * part,
            )
            x, T, force, p_port = advance(x, late, tip, start, viscosity, drum, winch, d, scale, leaks, left, pumps, h)
            if j == 0:
                log.T_loss[i], log.F_true[i] = T, force
