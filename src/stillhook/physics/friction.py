"""Friction of the power transmission outside the motors, and the stick-slip of the whole winch."""

from typing import NamedTuple

from stillhook.physics.scalar import copysign, exp, fmax, scalar

G_LEAST = 1.0e-3
"""Least level of dry friction that the bristle divides by [N m]: a winch without friction then keeps its numbers."""


class SystemFriction(NamedTuple):
    """Y_1 [-], Y_2 [N m], Y_3 [N m], i_Y_4 = 1 / Y_4 [s/rad], Y_5 [N m s/rad], Y_6 [-], per motor shaft."""

    Y_1: float
    Y_2: float
    Y_3: float
    i_Y_4: float
    Y_5: float
    Y_6: float


class Bristle(NamedTuple):
    """LuGre: sigma_0 [N m/rad], sigma_1 [N m s/rad] faded out over i_omega_f = 1 / fade speed [s/rad];
    `regular` 1 replaces the bristle by g tanh(omega / omega_r), i_omega_r = 1 / omega_r [s/rad]."""

    sigma_0: float
    sigma_1: float
    i_omega_f: float
    regular: float
    i_omega_r: float


@scalar
def system_friction(omega_m, T_d, fit):
    r"""Friction of gears, bearings, drum, sheaves and wire per motor shaft, never negative [N m].

    .. math:: T_{fs} = (Y_1 T_d + Y_3)\,e^{-|\omega_m|/Y_4} + Y_2 + Y_5|\omega_m| + Y_6 T_d

    Parameters: omega_m motor shaft speed [rad/s]; T_d drum torque, not negative [N m].
    Source: Moslatt 2020 eq. 2.7; speeds above 250 rev/min within 1 % of the nominal load (paper D).
    Differs from print: bars on omega_m; Y_4 in rad/s; Y_2 kept (eq. 2.13 drops it).
    """
    return system_friction_dry(omega_m, T_d, fit) + fit.Y_5 * abs(omega_m)


@scalar
def system_friction_dry(omega_m, T_d, fit):
    """The part of `system_friction` without the viscous term: level of the dry friction [N m]."""
    return (fit.Y_1 * T_d + fit.Y_3) * exp(-abs(omega_m) * fit.i_Y_4) + fit.Y_2 + fit.Y_6 * T_d


@scalar
def slip(omega_m, z, g, held, bristle):
    """Rate at which the bristle's deflection gives way [1/s]; g level of dry friction [N m], z deflection [rad].

    held above 0.5: the holding brake is on, and its discs stick: nothing gives way below the level g. (Without that, a
    bristle under a load that swings would creep by a part of every swing's path: Dupont, Armstrong and Hayward 2000,
    elasto-plastic friction.)
    """
    sticks = held > 0.5 and bristle.sigma_0 * abs(z) < g
    return 0.0 if sticks else bristle.sigma_0 * abs(omega_m) / fmax(g, G_LEAST)


@scalar
def bristle_rate(omega_m, z, g, held, bristle):
    """Rate of the bristle's deflection [rad/s]; g level of dry friction of the whole winch [N m], z deflection [rad],
    held as in `slip`."""
    return omega_m - slip(omega_m, z, g, held, bristle) * z


@scalar
def bristle_update(omega_m, z, g, held, tau, bristle):
    """Deflection after tau [s] with speed and level held: the exact solution of `bristle_rate` [rad].

    The bristle is the stiffest mode of the winch (thousands per second); stepping it exactly lets everything else take
    steps of milliseconds.
    """
    rate = slip(omega_m, z, g, held, bristle)
    E = exp(-rate * tau)
    grown = (1.0 - E) / rate if rate * tau > 1.0e-6 else tau
    return z * E + omega_m * grown


@scalar
def dry_torque(omega_m, z, g, held, bristle):
    """Dry friction torque of the whole winch at the motor shaft, against the motion [N m].

    LuGre: sigma_0 z + sigma_1 exp(-(omega/omega_f)^2) dz/dt. Regularised: g tanh(omega/omega_r); it cannot hold a load
    at rest (it creeps) and rounds the break-away peak. One exponential serves both. held as in `slip`: a brake holds in
    either model.
    """
    regular = bristle.regular > 0.5 and held < 0.5
    a = abs(omega_m)
    q = a * bristle.i_omega_f
    E = exp(-(2.0 * a * bristle.i_omega_r if regular else q * q))
    stick = bristle.sigma_0 * z + bristle.sigma_1 * E * bristle_rate(omega_m, z, g, held, bristle)
    return g * copysign((1.0 - E) / (1.0 + E), omega_m) if regular else stick
