"""Secondary control: over-centre units on a rail of nearly constant pressure, whose setting makes the torque.

Speed control of the units: feedforward of load, friction and acceleration, and a PI controller whose integral stops
where the setting is at its stop.
"""

from stillhook.physics.scalar import clip, fmin, scalar


@scalar
def setting_for_torque(T, D, dp):
    r"""Setting that gives a torque [-], hoisting positive; beyond -1 and 1 the units cannot.

    .. math:: \alpha = \frac{T}{D\,\Delta p}

    Parameters: T torque of all units [N m]; D their full displacement [m^3/rad]; dp pressure over them, positive [Pa].
    Source: WINCHES.md section 2, from T = D alpha p_o; Moslatt 2020 section 1.2.2, figures 1.10 and 1.12.
    Differs from print: the low side has a pressure of its own, so p_o reads p_o - p_lp.
    """
    return T / (D * dp)


@scalar
def speed_torque(omega_ref, omega_m, J, K):
    r"""Torque of the proportional speed control [N m].

    .. math:: T = J\,K\,(\omega_{ref} - \omega_m)

    Parameters: omega_ref, omega_m set-point and motor speed, hoisting positive [rad/s]; J inertia at the motor shaft
    [kg m^2]; K speed gain [1/s]. In the setting it is K J/(D dp) per speed, so that the loop does not depend on
    pressure and drum.
    """
    return J * K * (omega_ref - omega_m)


@scalar
def integral_rate(T_P, T_ref, T_most, T_I, T_i, held):
    r"""Rate of the integral part of the speed control [N m/s].

    .. math:: \dot T_I = \frac{T_P + \mathrm{clip}(T_{ref}, -T_{most}, T_{most}) - T_{ref}}{T_i}

    Back-calculation: what the units cannot give is taken from the integral. held: share to which a holding brake is
    closed [-]; behind it the integral runs out with T_i instead.
    Parameters: T_P proportional part, T_ref torque demanded, T_most the largest there is, T_I integral part [N m]; T_i
    integral time [s].
    """
    free = T_P + clip(T_ref, -T_most, T_most) - T_ref
    return ((1.0 - held) * free - held * T_I) / T_i


@scalar
def drive_share(omega_m, n_full, n_max):
    """Share of the setting that may still drive the shaft this way round [-]: 1 up to n_full, 0 from n_max on.

    omega_m motor speed in the direction of the torque [rad/s]; n_full speed at full command, n_max highest speed of the
    units [rad/s]. Guard against running away: beyond n_max the units may brake and no longer drive.
    """
    return clip((n_max - omega_m) / (n_max - n_full), 0.0, 1.0)


@scalar
def guarded_setting(alpha, omega_m, n_full, n_max):
    """Setting within its stops, and within what the guard leaves of it at this speed [-]; see `drive_share`."""
    return clip(alpha, -drive_share(-omega_m, n_full, n_max), drive_share(omega_m, n_full, n_max))


@scalar
def load_ahead(F_mean, F_now, most):
    """Load that the drive carries ahead of its speed control [N]: the filtered load cell, and no more than `most` times
    what the cell reads now.

    A load that is lost (wire slack, load set down) or a cell that reads zero takes the torque back within a cycle.
    """
    return fmin(F_mean, most * F_now)


@scalar
def friction_ahead(omega_ref, T_f, share, i_omega):
    """Friction that the drive carries ahead of its speed control [N m], with the sign of the set-point.

    Parameters: omega_ref set-point [rad/s]; T_f friction of the winch at this speed, not negative [N m]; share of it
    that is fed forward [-]; i_omega inverse of the speed over which the sign changes [s/rad].
    """
    return share * T_f * clip(omega_ref * i_omega, -1.0, 1.0)


@scalar
def largest_speed_gain(omega_n, zeta, T_i):
    r"""Speed gain K of marginal stability [1/s].

    .. math:: s^4 + 2\zeta\omega_n s^3 + \omega_n^2 s^2 + K\omega_n^2 s + K\omega_n^2/T_i = 0
              \;\Rightarrow\; K = 2\zeta\omega_n - 4\zeta^2/T_i

    Routh's criterion for an inertia behind a displacement control of second order. Parameters: omega_n [rad/s], zeta
    [-] of that control; T_i integral time [s].
    """
    return 2.0 * zeta * omega_n - 4.0 * zeta * zeta / T_i
