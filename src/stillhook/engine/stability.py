"""Is the step short enough? Step times fastest eigenvalue of the packed plant, before anything runs."""

from stillhook.engine.pack import Packed
from stillhook.errors import SpecError
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.motor import torque_loss_dry
from stillhook.plants.hoist import drum_geometry

RK4_LIMIT = 2.6
"""Largest |h lambda| on the negative real axis that is accepted; the method itself is stable up to 2.785."""


def fastest_rates(packed: Packed) -> dict[str, float]:
    """Upper bounds of the fast modes that the Runge-Kutta step has to follow [1/s]; the bristle is stepped exactly."""
    p = packed.params
    a, h = p.active, p.hoist
    lever = 0.5 * h.drum.d_max * h.i_i
    J = h.inertia.J_motor + h.inertia.J_gear + h.inertia.J_drum * h.inertia.i_i2
    k = h.wire.EA / (h.wire.L_0 + h.s_w_0)
    mass = 1.0 / (1.0 / h.load.m + lever**2 / J)
    rates = {
        "boost valve against the line's oil": a.boost.G * a.i_C_h,
        "relief valve against the line's oil": a.relief.G * a.i_C_h,
        "flushing valve against the line's oil": a.flushing.G * a.i_C_h,
        "wire with its damping": h.wire.c / mass + (k / mass) ** 0.5,
        "pump displacement control": a.pump_servo.omega_n * (a.pump_servo.zeta + max(a.pump_servo.zeta**2 - 1.0, 0.0) ** 0.5),
        "bristle with its damping": (h.bristle.sigma_1 + (h.bristle.sigma_0 * J) ** 0.5) / J,
    }
    if hasattr(p, "passive"):
        acc = p.passive.accumulator
        rates["passive relief valve against the trapped oil"] = p.passive.relief.G * acc.i_C
    if h.bristle.regular > 0.5:
        rates["regularised friction"] = dry_level_bound(packed) * h.bristle.i_omega_r * drum_geometry(packed.s_w, h).i_J
    return rates


def dry_level_bound(packed: Packed) -> float:
    """Upper bound of the dry friction of the whole winch [N m]: at rest, motors at full displacement, active pressure at relief."""
    p = packed.params
    a, h = p.active, p.hoist
    T_d = h.load.W * 0.5 * h.drum.d_max
    g = h.n_motors * system_friction_dry(0.0, T_d, h.friction) + a.motors.count * torque_loss_dry(a.motors.D_max, a.relief.p, a.motors.fit)
    if hasattr(p, "passive"):
        m = p.passive.motors
        g += m.count * torque_loss_dry(m.D_max, p.passive.relief.p, m.fit)
    return float(g)


def check_step(packed: Packed, step: float) -> None:
    """Refuse a step that the integration cannot follow. Errors: SpecError naming the fastest mode and the step to take."""
    name, rate = max(fastest_rates(packed).items(), key=lambda i: i[1])
    if rate * step > RK4_LIMIT:
        raise SpecError(
            f"step {step * 1e3:.3g} ms is too long for this crane: {name} has {rate:.0f} 1/s, step times rate {rate * step:.2f} "
            f"(allowed {RK4_LIMIT}). Use a step of {RK4_LIMIT / rate * 1e3:.2g} ms or less."
        )
