"""The smallest displacement of SSC from torque and speeds, as its PLC holds it: a line over the torque of the load.

Friction is that of the plant with full pumps, where SSC asks for the smallest displacement; the line is nowhere below
what the plant needs from the empty hook to the SWL.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from stillhook.control.commands import DisplacementLimits
from stillhook.engine.pack.shaft import lost
from stillhook.physics.friction import SystemFriction, system_friction
from stillhook.physics.scalar import G
from stillhook.spec.control import DisplacementLimit
from stillhook.spec.crane import Crane, effective_inertia
from stillhook.winches.interface import OtherMotors

POINTS = 21
"""Loads from the empty wire to the SWL at which the line is compared with what it stands for."""
LEAST = 0.05
"""Smallest displacement that is looked at [-]: no motor of a winch swings that far in under load."""
EXACT = 1e-12


def displacement_limits(crane: Crane, friction: SystemFriction) -> DisplacementLimits:
    """The limits of a crane whose file asks for them, else none."""
    if crane.control.displacement_limit is not DisplacementLimit.TORQUE:
        return DisplacementLimits()
    r, torques = _outer(crane), np.linspace(0.0, (crane.SWL + crane.hook_mass) * G * _outer(crane), POINTS)
    speeds = np.array([speed_floor(crane, T) for T in torques])
    needed = np.array([torque_needed(crane, friction, T) for T in torques])
    c_T = (needed[-1] - needed[0]) / torques[-1]
    rising = speeds > speeds[0]
    return DisplacementLimits(
        by_torque=1.0,
        T_0=float(np.max(needed - c_T * torques)),
        c_T=float(c_T),
        i_T=1.0 / (crane.active.motor.D_total * permitted(crane)),
        J=effective_inertia(crane),
        r_outer=r,
        alpha_speed=float(speeds[0]),
        i_T_speed=float(np.max(speeds[rising] / torques[rising], initial=0.0)),
    )


def permitted(crane: Crane) -> float:
    """Largest pressure difference over the active motors that the rule by torque allows [Pa]."""
    a = crane.active
    return (crane.control.p_most or a.relief.p) - a.boost.p


def _outer(crane: Crane) -> float:
    """Wire per motor angle on the full drum [m/rad]."""
    return 0.5 * crane.drum.d_max / crane.i_hD


def _others(crane: Crane, T: float) -> list[OtherMotors]:
    """Motors that hold a torque T of the load [N m] next to the active ones."""
    others = crane.plant.type.other_motors(crane, T / _outer(crane), crane.drum.d_max)
    return [o._replace(alpha=min(o.alpha, 1.0)) for o in others]


def speed_floor(crane: Crane, T: float) -> float:
    """Smallest displacement of the active motors with which full pumps turn every motor and the gears within their
    limits, at a torque T of the load at the shaft [N m] [-]; at most 1."""
    n_full = crane.active.pump.Q_max / crane.active.motor.D_total
    n_held = min([crane.n_gear or math.inf, *(o.motor.speed_limit(o.alpha) for o in _others(crane, T))])

    def room(alpha: float) -> float:
        return min(crane.active.motor.speed_limit(alpha), n_held) * alpha - n_full

    alphas = np.linspace(1.0, LEAST, 96)
    i = next((i for i, alpha in enumerate(alphas) if room(alpha) < 0.0), None)
    if not i:
        return LEAST if i is None else 1.0
    return float(scipy.optimize.brentq(room, alphas[i], alphas[i - 1], xtol=EXACT))


def torque_needed(crane: Crane, friction: SystemFriction, T: float) -> float:
    """Torque that the active motors need with full pumps to hoist steadily, at a torque T of the load at the shaft
    [N m]: what others do not hold of it, and the friction of all motors and gears [N m]."""
    active, dp = crane.active.motor, permitted(crane)
    Q, others = crane.active.pump.Q_max, _others(crane, T)
    least = max(crane.plant.type.least_displacement(crane), speed_floor(crane, T))
    count = sum(m.count for m in crane.motors)

    def needed(alpha: float) -> float:
        omega = Q / (max(alpha, least) * active.D_total)
        carried = sum(x.alpha * x.motor.D_total * (x.dp - x.R * x.alpha * x.motor.D_total * omega) for x in others)
        losses = lost(active, omega, alpha, dp) + sum(lost(x.motor, omega, x.alpha, x.dp) for x in others)
        gears = count * system_friction(omega, T * crane.i_hD, friction)
        return float(max(T - carried, 0.0) + losses + gears)

    def spare(alpha: float) -> float:
        return alpha * active.D_total * dp - needed(alpha)

    if spare(1.0) <= 0.0:
        return needed(1.0)
    return needed(LEAST if spare(LEAST) >= 0.0 else float(scipy.optimize.brentq(spare, LEAST, 1.0, xtol=EXACT)))
