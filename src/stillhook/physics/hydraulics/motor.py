"""Hydraulic motors: torque, torque loss by MJ4 (others: `stillhook.physics.hydraulics.motor_laws`) and leakage."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar


class TorqueLossFit(NamedTuple):
    """Parameters of MJ4 for one motor: X_1 [N m s/rad], X_2 [N m s^2/rad^2 / (m^3/rad)^3], X_3 [-], X_4 [N m], X_5 [N
    m/Pa^2]."""

    X_1: float
    X_2: float
    X_3: float
    X_4: float
    X_5: float


class Motors(NamedTuple):
    """A set of equal motors on the drum's gear: D_max [m^3/rad] of one motor; C_1 [m^3/s/Pa], C_2 [m^3/rad/Pa] leak of
    one; fit its torque loss: MJ4, or the record of another model (`stillhook.physics.hydraulics.motor_laws`), for
    which a kernel is compiled of its own."""

    count: float
    D_max: float
    C_1: float
    C_2: float
    fit: TorqueLossFit


@scalar
def torque_loss(omega_m, D_m, dp_m, fit):
    r"""Torque that one motor shaft loses to friction, never negative [N m].

    .. math:: T_{fm} = X_1|\omega_m| + X_2\omega_m^2 D_m^3 + X_3|\Delta p_m| D_m + X_4 + X_5\Delta p_m^2

    Parameters: omega_m motor shaft speed, hoisting positive [rad/s]; D_m displacement now [m^3/rad];
    dp_m = p_a - p_b [Pa]; fit TorqueLossFit.
    Source: Moslatt 2020 eq. 2.12 (MJ4 of paper A); fitted for 400-2500 rev/min, 50-350 bar.
    Differs from print: bars on omega_m and dp_m, so the loss is even in both.
    """
    return torque_loss_moving(omega_m, D_m, fit) + torque_loss_dry(D_m, dp_m, fit)


@scalar
def torque_loss_moving(omega_m, D_m, fit):
    """The part of `torque_loss` that grows with speed (viscous and turbulent), zero at standstill [N m]."""
    return fit.X_1 * abs(omega_m) + fit.X_2 * omega_m * omega_m * D_m * D_m * D_m


@scalar
def torque_loss_dry(D_m, dp_m, fit):
    """The part of `torque_loss` that is there at any speed: the level of the dry friction [N m]."""
    return fit.X_3 * abs(dp_m) * D_m + fit.X_4 + fit.X_5 * dp_m * dp_m


@scalar
def motor_torque(D_m, dp_m):
    """Torque of the oil on the shaft before losses, hoisting positive [N m]; D_m [m^3/rad], dp_m = p_a - p_b [Pa]."""
    return D_m * dp_m


@scalar
def motor_leakage(omega_m, motors):
    """Total leak conductance of the whole set of motors [m^3/s/Pa].

    Source: Moslatt 2020 eq. 2.18, C = C_1 + C_2 n_m per motor. Differs from print: bars on the speed.
    """
    return motors.count * (motors.C_1 + motors.C_2 * abs(omega_m))
