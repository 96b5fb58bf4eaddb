"""An active/passive heave-compensated winch, written without the twin's laws: own code, own integration, SI throughout.

Signs: hoisting positive for motor speed, pump command and the operator's speed; up positive for tip and load; s_w is
wire paid out. Every cycle of the PLC (`plc.py`) is followed by semi-implicit Euler steps of the plant.
Numbers come in the records below, from `crane.py`. What is named "assumed" here or there rests on no
publication.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trials.independent_crane.plc import MANUAL, Commands, Memory, Reading, Settings, clip, plc_cycle

FloatArray = NDArray[np.float64]

LEAK_ACROSS = 2.0 / 3.0
"""Part of the leak that flows from one line to the other; the rest of it goes from each line to the case (assumed)."""
PRESSURE_OF_SLIP = 250e5
"""Pressure difference at which slip of the pumps' electric motors is stated [Pa]."""
VISCOSITY_PER_KELVIN = 0.035
"""Relative fall of the oil's viscosity per kelvin (assumed: mineral oil at about 40 degC)."""
VISCOUS_PART_OF_DRY = 0.15
"""Part of the speed-independent friction that follows the viscosity (assumed)."""
TORQUE_OF_BRAKE = 60e3
"""Holding torque of the brake at the motor shaft, beyond what any load asks for [N m] (assumed)."""
FLOW_OF_PISTON = 2e-3
"""Flow over which dry friction of the accumulator piston turns [m^3/s] (assumed)."""
LEAST_FRICTION = 1e-3
"""Torque that keeps the bristle's rate finite [N m]."""
WHOLE_LAYER = 1e-9
"""Layers by which rounding may exceed a full layer [-]."""


class Loss(NamedTuple):
    """Torque loss of one motor shaft (form: Moslatt 2020 eq. 2.12)."""

    X_1: float  # with speed [N m s]
    X_2: float  # with speed squared and displacement cubed [N m s^2 rad/m^9]
    X_3: float  # with pressure times displacement [-]
    X_4: float  # constant [N m]
    X_5: float  # with pressure squared [N m/Pa^2]


class Motors(NamedTuple):
    """Motors of one circuit."""

    installed: float  # on the shaft
    working: float  # of them under pressure
    D: float  # displacement of one at full setting [m^3/rad]


class Friction(NamedTuple):
    """System friction of one motor shaft (form: Moslatt 2020, paper D), and the bristle that carries it at rest."""

    Y_1: float  # breaking away, per drum torque [-]
    Y_2: float  # at any speed [N m]
    Y_3: float  # breaking away [N m]
    Y_4: float  # speed over which breaking away fades [rad/s]
    Y_5: float  # with speed [N m s]
    Y_6: float  # at any speed, per drum torque [-]
    scale: float  # factor on this and on the motors' loss
    sigma_0: float  # stiffness of the bristle [N m/rad]
    ratio: float  # its damping over sqrt(sigma_0 J)
    omega_fade: float  # speed over which that damping fades [rad/s]


class Active(NamedTuple):
    """Closed circuit of the active pumps and motors."""

    motors: Motors
    D_pumps: float  # full displacement of all pumps [m^3/rad]
    omega_p: float  # their speed without load [rad/s]
    slip: float  # part of that speed lost at PRESSURE_OF_SLIP and full stroke
    leak: float  # at rest [m^3/s/Pa]
    leak_stroke: float  # its rise to full stroke [m^3/s/Pa]
    leak_speed: float  # its rise with motor speed [m^3/rad/Pa]
    leak_pressure: float  # rise of all of it with the pressure between the lines [1/Pa]
    C_h: float  # capacitance of one line [m^3/Pa]
    p_boost: float  # [Pa]
    G_boost: float  # [m^3/s/Pa]
    p_relief: float  # [Pa]
    G_relief: float  # [m^3/s/Pa]
    dp_open: float  # above boost, where flushing opens [Pa]
    dp_shuttle: float  # over which its shuttle moves [Pa]
    G_flushing: float  # [m^3/s/Pa]


class Passive(NamedTuple):
    """Circuit that carries the load: motors, make-up pumps, accumulators with piston and gas."""

    motors: Motors
    D_pumps: float  # full displacement of all pumps [m^3/rad]
    omega_p: float  # their speed [rad/s]
    p_lp: float  # low side [Pa]
    mR: float  # of the gas, p V/T [J/K]
    c_v: float  # heat capacity of all gas [J/K]
    hA: float  # heat to its vessels [W/K]
    T_vessel: float  # [K]
    V: float  # gas with the pistons at mid stroke [m^3]
    R: float  # viscous resistance of the pistons [Pa s/m^3]
    F: float  # their dry friction, as pressure [Pa]
    leak: float  # from high to low side [m^3/s/Pa]


class Servo(NamedTuple):
    """Displacement control, second order."""

    omega_n: float  # [rad/s]
    zeta: float
    rate_max: float  # full stroke over time [1/s]
    low: float  # stops of the setting
    high: float


class Drum(NamedTuple):
    """Drum, wire on it, and what turns with the motors."""

    d: float  # bare drum [m]
    d_wire: float  # [m]
    turns: float  # of a layer
    L_full: float  # wire on the full drum [m]
    mass: float  # of the wire [kg/m]
    i: float  # gear ratio, motor to drum
    J_shaft: float  # motors and gears, at the motor shaft [kg m^2]
    J_drum: float  # about the drum's axis [kg m^2]


class Hoist(NamedTuple):
    """Wire, load and load cell."""

    EA: float  # stiffness of a section of wire [N]
    L_0: float  # wire from drum to tip [m]
    zeta: float  # damping ratio of the load on the wire
    m: float  # load and hook [kg]
    W: float  # their weight [N]
    tau_cell: float  # lag of the load cell [s]
    gain_cell: float  # what it shows over the true force


class Oil(NamedTuple):
    """Slow swing of the oil's temperature about nominal."""

    size: float  # [K]
    omega: float  # [rad/s]


class Winch(NamedTuple):
    """The whole plant."""

    loss: Loss
    friction: Friction
    active: Active
    passive: Passive
    pumps: Servo
    motors: Servo
    passive_motors: Servo
    drum: Drum
    hoist: Hoist
    oil: Oil


class Inputs(NamedTuple):
    """One value a cycle."""

    s_tip: FloatArray  # true tip [m]
    v_tip: FloatArray  # [m/s]
    s_mru: FloatArray  # tip as the PLC receives it [m]
    v_mru: FloatArray  # [m/s]
    a_mru: FloatArray  # [m/s^2]
    noise_s_w: FloatArray  # of the wire counter [m]
    noise_F: FloatArray  # of the load cell [N]
    v_op: FloatArray  # operator's speed, hoisting positive [m/s]
    mode: FloatArray


class Log(NamedTuple):
    """What the PLC logs, one value a cycle: as it was at the beginning of the cycle, but for p_hp."""

    s_w: FloatArray  # wire paid out [m]
    v_w: FloatArray  # wire speed, hoisting positive [m/s]
    omega: FloatArray  # motor speed [rad/s]
    p_a: FloatArray  # [Pa]
    p_b: FloatArray  # [Pa]
    p_hp: FloatArray  # gas, at the end of the cycle [Pa]
    u_p: FloatArray  # commands to pumps
    u_m: FloatArray  # and motors
    alpha_p: FloatArray  # settings of pumps,
    alpha_m: FloatArray  # active motors
    alpha_pm: FloatArray  # and passive motors
    F: FloatArray  # load cell [N]
    e: FloatArray  # control error [m]


class State(NamedTuple):
    """State of the plant."""

    omega: float  # motor speed [rad/s]
    s_w: float  # wire paid out [m]
    z: float  # bristle [rad]
    a_p: float  # setting of the pumps,
    da_p: float  # its rate [1/s]
    a_m: float  # active motors
    da_m: float
    a_pm: float  # passive motors
    da_pm: float
    p_a: float  # lines [Pa]
    p_b: float
    V_oil: float  # oil in the accumulators beyond mid stroke [m^3]
    T_gas: float  # [K]
    p_gas: float  # [Pa]
    s_l: float  # load [m]
    v_l: float  # [m/s]
    F_cell: float  # wire force behind the load cell's lag [N]


class Spooled(NamedTuple):
    """Drum with the wire that is on it now."""

    d: float  # effective diameter of the layer in use [m]
    r: float  # wire per rad of the motors [m/rad]
    J: float  # inertia at the motor shaft [kg m^2]


@njit
def spooled(s_w: float, drum: Drum) -> Spooled:
    """Wire is wound square stacked and whole layer by layer; its inertia is that of a hollow cylinder of the broken
    number of layers."""
    left = drum.L_full - s_w
    c = left / (math.pi * drum.turns)
    layers = (math.sqrt(drum.d * drum.d + 4.0 * drum.d_wire * c) - drum.d) / (2.0 * drum.d_wire)
    in_use = math.ceil(layers - WHOLE_LAYER)
    d = drum.d + (2.0 * in_use - 1.0) * drum.d_wire
    outer = drum.d + 2.0 * layers * drum.d_wire
    J_wire = drum.mass * left * (drum.d * drum.d + outer * outer) / 8.0
    return Spooled(d, 0.5 * d / drum.i, drum.J_shaft + (drum.J_drum + J_wire) / (drum.i * drum.i))


@njit
def gas_pressure(T_gas: float, V_oil: float, passive: Passive) -> float:
    """Ideal gas: mR T over what the oil leaves of the volume [Pa]."""
    return passive.mR * T_gas / (passive.V - V_oil)


@njit
def servo(alpha: float, rate: float, command: float, s: Servo, h: float) -> tuple[float, float]:
    """Setting and its rate one step of h later: second order, held within rate and stops."""
    rate = rate + h * s.omega_n * (s.omega_n * (command - alpha) - 2.0 * s.zeta * rate)
    rate = clip(rate, -s.rate_max, s.rate_max)
    alpha = alpha + h * rate
    if alpha > s.high:
        return s.high, min(rate, 0.0)
    if alpha < s.low:
        return s.low, max(rate, 0.0)
    return alpha, rate


@njit
def loss_at_any_speed(dp: float, D: float, loss: Loss) -> float:
    """Part of a motor's torque loss that does not depend on speed [N m]; dp [Pa], D displacement now [m^3/rad]."""
    return loss.X_3 * abs(dp) * D + loss.X_4 + loss.X_5 * dp * dp


@njit
def loss_with_speed(speed: float, D: float, loss: Loss) -> float:
    """Part of a motor's torque loss that grows with its speed [N m]."""
    return loss.X_1 * speed + loss.X_2 * speed * speed * D**3


@njit
def friction(x: State, p_gas: float, T_drum: float, winch: Winch) -> tuple[float, float]:
    """Torques at the motor shaft of all motors, drum and gears that oppose motion, at nominal oil [N m]: at any speed,
    and with speed. Dead motors turn with the shaft and keep their bearings' friction (Y), not the loss of a motor under
    pressure
    (X)."""
    act, pas, y = winch.active.motors, winch.passive.motors, winch.friction
    speed, dp, dp_pm = abs(x.omega), x.p_a - x.p_b, p_gas - winch.passive.p_lp
    D_a, D_p, shafts = act.D * x.a_m, pas.D * x.a_pm, act.installed + pas.installed
    level = act.working * loss_at_any_speed(dp, D_a, winch.loss) + pas.working * loss_at_any_speed(
        dp_pm, D_p, winch.loss
    )
    level += shafts * ((y.Y_1 * T_drum + y.Y_3) * math.exp(-speed / y.Y_4) + y.Y_2 + y.Y_6 * T_drum)
    rising = act.working * loss_with_speed(speed, D_a, winch.loss) + pas.working * loss_with_speed(
        speed, D_p, winch.loss
    )
    return level, rising + shafts * y.Y_5 * speed


@njit
def bristle(z: float, omega: float, level: float, held: float, y: Friction, h: float) -> tuple[float, float]:
    """Bristle [rad] one step of h later and its rate r in dz/dt = omega - r z [1/s], exact for constant omega (form:
    LuGre).

    level torque that it carries when it slips [N m]; held 1: the closed brake does not slip.
    """
    rate = y.sigma_0 * abs(omega) / max(level, LEAST_FRICTION)
    if held > 0.0 and y.sigma_0 * abs(z) < level:
        rate = 0.0
    decay = math.exp(-rate * h)
    return z * decay + omega * ((1.0 - decay) / rate if rate * h > 1e-9 else h), rate


@njit
def valve_flow(p: float, p_other: float, a: Active) -> float:
    """Oil that boost, relief and flushing valves add to a line [m^3/s]."""
    boost = a.G_boost * max(a.p_boost - p, 0.0)
    relief = a.G_relief * max(p - a.p_relief, 0.0)
    shuttle = clip((p_other - p) / a.dp_shuttle, 0.0, 1.0)
    return boost - relief - shuttle * a.G_flushing * max(p - a.p_boost - a.dp_open, 0.0)


@njit
def lines(x: State, a_p: float, motor_flow: float, viscosity: float, a: Active, h: float) -> tuple[float, float]:
    """Pressures of lines A and B one step later [Pa]; a_p pump setting now, motor_flow [m^3/s], viscosity over
    nominal."""
    dp = x.p_a - x.p_b
    leak = (a.leak + a.leak_stroke * abs(a_p) + a.leak_speed * abs(x.omega)) / viscosity
    leak *= 1.0 + a.leak_pressure * abs(dp)
    pump_flow = a.D_pumps * a.omega_p * a_p * (1.0 - a.slip * (a_p * dp) / PRESSURE_OF_SLIP)
    across = pump_flow - motor_flow - LEAK_ACROSS * leak * dp
    to_case = (1.0 - LEAK_ACROSS) * leak
    p_a = x.p_a + h * (across - to_case * x.p_a + valve_flow(x.p_a, x.p_b, a)) / a.C_h
    p_b = x.p_b + h * (-across - to_case * x.p_b + valve_flow(x.p_b, x.p_a, a)) / a.C_h
    return p_a, p_b


@njit
def wire_force(x: State, s_tip: float, v_tip: float, start: float, r: float, hoist: Hoist) -> float:
    """Force in the wire, never pushing [N]; start wire paid out at t = 0 [m], r wire per rad of the motors [m]."""
    length = hoist.L_0 + x.s_w
    k = hoist.EA / length
    stretch = s_tip - x.s_l - (x.s_w - start)
    return max(0.0, k * stretch + 2.0 * hoist.zeta * math.sqrt(k * hoist.m) * (v_tip - x.v_l + r * x.omega))


@njit
def advance(
    x: State,
    u: Commands,
    tip: tuple[float, float],
    start: float,
    viscosity: float,
    drum: Spooled,
    winch: Winch,
    h: float,
) -> State:
    """The plant one step of h later. u commands; tip true position and speed; start wire paid out at t = 0 [m];
    viscosity over nominal."""
    act, pas, hoist, y = winch.active, winch.passive, winch.hoist, winch.friction
    s_tip, v_tip = tip
    force = wire_force(x, s_tip, v_tip, start, drum.r, hoist)
    D_a, D_p = act.motors.D * act.motors.working * x.a_m, pas.motors.D * pas.motors.working * x.a_pm
    p_gas = gas_pressure(x.T_gas, x.V_oil, pas)
    level, rising = friction(x, p_gas, 0.5 * drum.d * force, winch)
    level = (
        y.scale * level * (1.0 - VISCOUS_PART_OF_DRY + VISCOUS_PART_OF_DRY * viscosity)
        + TORQUE_OF_BRAKE * u.brake_closed
    )
    z, rate = bristle(x.z, x.omega, level, u.brake_closed, y, h)
    a_p, da_p = servo(x.a_p, x.da_p, u.u_p, winch.pumps, h)
    a_m, da_m = servo(x.a_m, x.da_m, u.u_m, winch.motors, h)
    a_pm, da_pm = servo(x.a_pm, x.da_pm, u.u_pm, winch.passive_motors, h)
    p_a, p_b = lines(x, a_p, D_a * x.omega, viscosity, act, h)
    inflow = (
        pas.D_pumps * pas.omega_p * u.u_pp - D_p * x.omega - pas.leak * (p_gas - pas.p_lp)
    )  # into the accumulators [m^3/s]
    T_gas = x.T_gas + h * (p_gas * inflow + pas.hA * (pas.T_vessel - x.T_gas)) / pas.c_v
    p_hp = p_gas + pas.R * inflow + pas.F * math.tanh(inflow / FLOW_OF_PISTON)
    damping = y.ratio * math.sqrt(y.sigma_0 * winch.drum.J_shaft) * math.exp(-((x.omega / y.omega_fade) ** 2))
    drive = D_a * (p_a - p_b) + D_p * (p_hp - pas.p_lp)
    opposing = y.scale * rising * viscosity * np.sign(x.omega) + y.sigma_0 * z + damping * (x.omega - rate * z)
    omega = x.omega + h * (drive - force * drum.r - opposing) / drum.J
    v_l = x.v_l + h * (force - hoist.W) / hoist.m
    F_cell = x.F_cell + h * (force - x.F_cell) / hoist.tau_cell
    s_w, s_l = x.s_w - h * drum.r * omega, x.s_l + h * v_l
    return State(
        omega, s_w, z, a_p, da_p, a_m, da_m, a_pm, da_pm, p_a, p_b, x.V_oil + h * inflow, T_gas, p_gas, s_l, v_l, F_cell
    )


@njit
def at_rest(s_w: float, s_tip: float, winch: Winch) -> State:
    """The load hangs still, lines at boost, accumulators at mid stroke, the passive motors not yet set."""
    hoist, act, pas = winch.hoist, winch.active, winch.passive
    s_l = s_tip - hoist.W / (hoist.EA / (hoist.L_0 + s_w))
    p_gas = gas_pressure(pas.T_vessel, 0.0, pas)
    return State(
        0.0,
        s_w,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
        0.0,
        0.0,
        act.p_boost,
        act.p_boost,
        0.0,
        pas.T_vessel,
        p_gas,
        s_l,
        0.0,
        hoist.W,
    )


@njit
def with_settings(x: State, u: Commands) -> State:
    """The state with the motors where the PLC's first cycle wants them."""
    return State(
        x.omega,
        x.s_w,
        x.z,
        x.a_p,
        x.da_p,
        u.u_m,
        x.da_m,
        u.u_pm,
        x.da_pm,
        x.p_a,
        x.p_b,
        x.V_oil,
        x.T_gas,
        x.p_gas,
        x.s_l,
        x.v_l,
        x.F_cell,
    )


@njit
def write_row(log: Log, i: int, x: State, u: Commands, r: Reading, e: float, drum: Spooled) -> None:
    """Sample i of the log."""
    log.s_w[i], log.v_w[i], log.omega[i] = r.s_w, drum.r * x.omega, x.omega
    log.p_a[i], log.p_b[i] = x.p_a, x.p_b
    log.u_p[i], log.u_m[i] = u.u_p, u.u_m
    log.alpha_p[i], log.alpha_m[i], log.alpha_pm[i] = x.a_p, x.a_m, x.a_pm
    log.F[i], log.e[i] = r.F, e


@njit
def run(inputs: Inputs, start: float, winch: Winch, c: Settings, log: Log) -> None:
    """Fill the log of one test that begins at rest with so much wire paid out [m]. Commands to active pumps and motors
    reach them one cycle after they are read off; the passive circuit takes its own at once (assumed)."""
    n, h = inputs.s_tip.shape[0], c.cycle / c.steps
    x = at_rest(start, inputs.s_tip[0], winch)
    on_brake = c.brake > 0.0 and inputs.mode[0] == MANUAL
    m = Memory(
        winch.hoist.W,
        c.p_set,
        0.0,
        0.0,
        MANUAL,
        2.0 * c.t_wait if on_brake else 0.0,
        1.0 if on_brake else 0.0,
        0.0,
        winch.motors.high,
    )
    for i in range(n):
        drum = spooled(x.s_w, winch.drum)
        p_hp = gas_pressure(x.T_gas, x.V_oil, winch.passive)
        F = winch.hoist.gain_cell * x.F_cell + inputs.noise_F[i]
        s_w = x.s_w + inputs.noise_s_w[i]
        r = Reading(
            inputs.s_mru[i],
            inputs.v_mru[i],
            inputs.a_mru[i],
            s_w,
            F,
            p_hp,
            drum.d,
            x.a_m,
            inputs.v_op[i],
            inputs.mode[i],
        )
        before = m
        m, u, e = plc_cycle(r, m, c)
        if i == 0:
            x = with_settings(x, u)
        write_row(log, i, x, u, r, e, drum)
        late = Commands(before.u_p, u.u_m if i == 0 else before.u_m, u.u_pm, u.u_pp, u.brake_closed)
        viscosity = math.exp(-VISCOSITY_PER_KELVIN * winch.oil.size * math.sin(winch.oil.omega * (i * c.cycle)))
        after = min(i + 1, n - 1)
        for j in range(c.steps):
            part = j / c.steps
            tip = (
                inputs.s_tip[i] + (inputs.s_tip[after] - inputs.s_tip[i]) * part,
                inputs.v_tip[i] + (inputs.v_tip[after] - inputs.v_tip[i]) * part,
            )
            x = advance(x, late, tip, start, viscosity, drum, winch, h)
        log.p_hp[i] = x.p_gas
