"""Is the step short enough? Step times fastest eigenvalue of the packed plant, before anything runs."""

import math
from typing import Any

from stillhook.engine.pack.winch import Packed
from stillhook.errors import SpecError
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.hydraulics.motor import Motors, motor_leakage, torque_loss_dry
from stillhook.physics.hydraulics.swash import STOPPING, Servo
from stillhook.physics.load_path.wire import wire_damping
from stillhook.winches.hoist import Hoist, drum_geometry

RK4_LIMIT = 2.6
"""Largest |h lambda| that is accepted; the method itself is stable up to 2.785 (negative real axis) and 2.83 (imaginary
axis)."""

MOST_STEPS = 10000
"""Steps per PLC cycle beyond which a run would never end."""

SUBSTEPS = (1, 2, 4, 5, 8)
"""Times a power of ten: steps per cycle that give a step with few digits."""


def fastest_rates(packed: Packed, c: float | None = None) -> dict[str, float]:
    """Upper bounds of the fast modes that the Runge-Kutta step has to follow [1/s]; the bristle is stepped exactly.

    c damping of the wire [N s/m], default that of the load on it.
    """
    p = packed.params
    a, h = p.active, p.hoist
    J = h.inertia.J_motor + h.inertia.J_gear + h.inertia.J_drum * h.inertia.i_i2
    D_m = a.motors.count * a.motors.D_max
    leak = max(a.pumps.leak) + float(motor_leakage(a.n_max, a.motors))
    rates = {
        "boost valve against the line's oil": a.boost.G * a.i_C_h,
        "relief valve against the line's oil": a.relief.G * a.i_C_h,
        "flushing valve against the line's oil": a.flushing.G * a.i_C_h,
        "leakage against the line's oil": 2.0 * leak * a.i_C_h,
        "motors against the line's oil": D_m * math.sqrt(2.0 * a.i_C_h / J),
        "pump displacement control": servo_rate(a.pump_servo),
        "motor displacement control": servo_rate(a.motor_servo),
        "bristle with its damping": (h.bristle.sigma_1 + (h.bristle.sigma_0 * J) ** 0.5) / J,
        **_hoist_rates(h, J, a.n_max, float(wire_damping(h.s_w_0, h.load.m, h.wire)) if c is None else c),
    }
    viscous = h.n_motors * h.friction.Y_5 + _moving(a.motors, a.n_max)
    if hasattr(p, "passive"):
        rates |= _passive_rates(p.passive, J)
        viscous += _moving(p.passive.motors, p.passive.n_max)
    rates["viscous friction against the winch's inertia"] = viscous / J
    if h.bristle.regular > 0.5:
        rates["regularised friction"] = dry_level_bound(packed) * h.bristle.i_omega_r * drum_geometry(packed.s_w, h).i_J
    return rates


def _hoist_rates(h: Hoist, J: float, n_max: float, c: float) -> dict[str, float]:
    """Wire, with its damping c [N s/m], and load, and drag at the highest speed that the motors can give the wire."""
    r_eff = 0.5 * h.drum.d_max * h.i_i
    k = h.wire.EA / (h.wire.L_0 + h.s_w_0)
    mass = 1.0 / (1.0 / h.load.m + r_eff**2 / J)
    return {
        "wire with its damping": c / mass + (k / mass) ** 0.5,
        "drag of the water": 2.0 * h.load.b * n_max * r_eff * h.load.i_m,
    }


def _passive_rates(P: Any, J: float) -> dict[str, float]:
    """Modes of the passive circuit; with the piston at an end the oil of its line alone is the spring."""
    acc, D_m = P.accumulator, P.motors.count * P.motors.D_max
    leak = max(P.pumps.leak) + float(motor_leakage(P.n_max, P.motors)) + acc.C_leak
    return {
        "passive relief valve against the trapped oil": P.relief.G * acc.i_C,
        "leakage of the passive circuit against the trapped oil": leak * acc.i_C,
        "passive motors against the trapped oil": D_m * math.sqrt(acc.i_C / J),
        "friction of the accumulator piston": D_m * D_m * acc.R / J,
        "passive pump displacement control": servo_rate(P.pump_servo),
        "passive motor displacement control": servo_rate(P.motor_servo),
    }


def servo_rate(servo: Servo) -> float:
    """Magnitude of the faster eigenvalue of a displacement control, or of its plate at a stop [1/s]."""
    return servo.omega_n * max(max(servo.zeta, 1.0) + max(servo.zeta**2 - 1.0, 0.0) ** 0.5, STOPPING)


def _moving(motors: Motors, omega_m: float) -> float:
    """Slope of the moving loss of all motors of a set at their highest speed [N m s/rad]."""
    return motors.count * (motors.fit.X_1 + 2.0 * motors.fit.X_2 * omega_m * motors.D_max**3)


def dry_level_bound(packed: Packed) -> float:
    """Upper bound of the dry friction of the whole winch [N m]: at rest, motors at full displacement, active pressure
    at relief."""
    p = packed.params
    a, h = p.active, p.hoist
    T_d = h.load.W * 0.5 * h.drum.d_max
    g = h.n_motors * system_friction_dry(0.0, T_d, h.friction) + a.motors.count * torque_loss_dry(
        a.motors.D_max, a.relief.p, a.motors.fit
    )
    if hasattr(p, "passive"):
        m = p.passive.motors
        g += m.count * torque_loss_dry(m.D_max, p.passive.relief.p, m.fit)
    return float(g)


def substeps(t_cycle: float, longest: float) -> int:
    """Steps per PLC cycle for a step of at most `longest` [s]: the least number that gives a step with few digits."""
    least = math.ceil(min(t_cycle / longest, 1e12) * (1.0 - 1e-9))
    scale = 1
    while True:
        for part in SUBSTEPS:
            if part * scale >= least:
                return part * scale
        scale *= 10


def check_step(packed: Packed, step: float) -> None:
    """Refuse a step that the integration cannot follow. Errors: SpecError naming the fastest mode and the step to
    take."""
    name, rate = max(fastest_rates(packed).items(), key=lambda i: i[1])
    if rate * step <= RK4_LIMIT:
        return
    t_cycle = packed.params.plc.t_cycle
    parts = substeps(t_cycle, RK4_LIMIT / rate)
    advice = (
        f'Use a step of "{t_cycle / parts * 1e3:.6g} ms" or less.'
        if parts <= MOST_STEPS
        else "Check the number behind it."
    )
    raise SpecError(
        f"step {step * 1e3:.3g} ms is too long for this crane: {name} has {rate:.0f} 1/s, step times rate"
        f" {rate * step:.2f} (allowed {RK4_LIMIT}). {advice}"
    )
