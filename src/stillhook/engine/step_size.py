"""Is the step short enough? Step times fastest eigenvalue of the packed plant, before anything runs."""

import math

from stillhook.engine.pack.winch import Packed
from stillhook.errors import SpecError
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.load_path.wire import wire_damping
from stillhook.winches.interface import Stiffness
from stillhook.winches.load_path import Hoist, drum_geometry, shaft_inertia_without_wire

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
    h, own = p.hoist, packed.plant.stiffness(p)
    J = shaft_inertia_without_wire(h)
    rates = {
        **own.rates,
        "bristle with its damping": (h.bristle.sigma_1 + (h.bristle.sigma_0 * J) ** 0.5) / J,
        **_hoist_rates(h, J, own.n_max, float(wire_damping(h.s_w_0, h.load.m, h.wire)) if c is None else c),
        "viscous friction against the winch's inertia": (h.n_motors * h.friction.Y_5 + own.viscous) / J,
    }
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


def dry_level_bound(packed: Packed) -> float:
    """Upper bound of the dry friction of the whole winch [N m]: at rest, motors at full displacement, active pressure
    at relief."""
    h = packed.params.hoist
    T_d = h.load.W * 0.5 * h.drum.d_max
    own: Stiffness = packed.plant.stiffness(packed.params)
    return float(h.n_motors * system_friction_dry(0.0, T_d, h.friction) + own.dry)


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
