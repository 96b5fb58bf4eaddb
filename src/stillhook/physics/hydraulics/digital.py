"""Digital displacement: each cylinder is enabled or idle for a stroke, decided when its piston turns.

Averaged over the cylinders of all units on one shaft; the pattern of the strokes is bounded, see `torque_of_pattern`.
"""

import functools
import math
from typing import Any

from stillhook.physics.hydraulics.motor import Motors, TorqueLossFit
from stillhook.physics.hydraulics.motor_laws import FITTED, FittedLoss
from stillhook.physics.records import record
from stillhook.physics.scalar import by_record, scalar, sqrt

STROKE_DAMPING = 0.5 * math.pi
"""Damping term of a stroke's response by shaft angle [-]; see `setting_acceleration`."""


@scalar
def setting_acceleration(alpha, alpha_dot, u, omega_m, servo):
    r"""Second derivative of the mean setting of digital units [1/s^2].

    A cylinder that is enabled turns its torque over half a revolution, :math:`h(\theta) = \frac{1}{2}\sin\theta`. Its
    mean :math:`\pi/2` and variance :math:`\pi^2/4 - 2` are those of

    .. math:: \frac{d^2\alpha}{d\theta^2} + \frac{\pi}{2}\frac{d\alpha}{d\theta} + \alpha = u, \quad
              \theta = \int|\omega_m|\,dt

    so the setting lags its command by a quarter of a revolution. At standstill it follows by partial strokes, as
    `servo` says; frequencies and dampings of both add as squares.
    Parameters: alpha setting [-], alpha_dot [1/s]; u command [-]; omega_m shaft speed [rad/s]; servo response at
    standstill.
    """
    w_2 = servo.omega_n * servo.omega_n
    c_2 = 4.0 * servo.zeta * servo.zeta * w_2
    n_2 = omega_m * omega_m
    damping = sqrt(c_2 + STROKE_DAMPING * STROKE_DAMPING * n_2)
    return (w_2 + n_2) * (u - alpha) - damping * alpha_dot


@scalar
def _enabled_mj4(share, idle, D_max, fit):
    """As the other models, term by term: X_3 goes with the setting as in all units, so it is left."""
    moved = share + idle * (1.0 - share)
    return TorqueLossFit(moved * fit.X_1, moved * fit.X_2, fit.X_3, moved * fit.X_4, share * fit.X_5)


@functools.cache
def _enabled(of: Any) -> Any:
    """Function f(share, idle, D_max, fit) -> record of the loss of units with a share of their cylinders enabled."""
    if of is TorqueLossFit:
        return _enabled_mj4
    dry_of, moving_of = FITTED[of].dry, FITTED[of].moving
    part = record("Enabled", f"{__name__} {FITTED[of].label}", fit=of, share=float, idle=float, D_max=float)

    @scalar
    def dry(omega_m, D_m, dp_m, now):
        rest = now.idle * dry_of(omega_m, now.D_max, 0.0, now.fit)
        return now.share * dry_of(omega_m, now.D_max, dp_m, now.fit) + rest

    @scalar
    def moving(omega_m, D_m, dp_m, now):
        rest = now.idle * moving_of(omega_m, now.D_max, 0.0, now.fit)
        return now.share * moving_of(omega_m, now.D_max, dp_m, now.fit) + rest

    @scalar
    def torque(omega_m, D_m, dp_m, now):
        return dry(omega_m, D_m, dp_m, now) + moving(omega_m, D_m, dp_m, now)

    @scalar
    def enabled_of(share, idle, D_max, fit):
        return part(fit, share, idle * (1.0 - share), D_max)

    FITTED[part] = FittedLoss(f"enabled {FITTED[of].label}", torque, dry, moving)
    return enabled_of


enabled_loss = by_record(_enabled)


@scalar
def enabled(motors, share, idle):
    r"""Units of which a share of the cylinders is enabled [-]: these leak and lose as at full displacement, the others
    neither leak nor carry pressure, and lose `idle` of what they would lose without pressure [-].

    .. math:: T_f = s\,T(\omega, D_{max}, \Delta p) + k_{idle}(1 - s)\,T(\omega, D_{max}, 0)

    T torque loss of the units by the model of their motor; pistons move over their full stroke.
    """
    now = enabled_loss(share, idle, motors.D_max, motors.fit)
    return Motors(motors.count, motors.D_max, share * motors.C_1, share * motors.C_2, now)


def torque_of_pattern(D: float, dp: float, cylinders: int) -> float:
    r"""Most by which the torque of a pattern of full strokes differs from its mean [N m].

    .. math:: |T - \bar T| \le \hat T = \pi D\,\Delta p/N, \quad
              |\Delta(\tfrac{1}{2}J\omega_m^2)| \le \hat T \cdot 1\,\mathrm{rad}

    A sigma-delta of first order is never more than half a stroke ahead or behind. Summed by parts, that is half of the
    total variation of the pulse, which rises to the peak torque of one cylinder and falls again; of its integral over
    the angle half of its rise. D of all units [m^3/rad]; dp pressure over them [Pa]; cylinders N of all units.
    """
    return math.pi * D * dp / cylinders
