"""Loops of the drive: current loop as a first-order lag, PI speed loop with anti-windup. Both run at a millisecond or
faster and are continuous here."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar

CURRENT_RATE = 450.0
"""Fastest rate at which the current loop is integrated [1/s], so that a step of 5 ms follows it (limit 2.6/h).

A loop of 300 Hz has 1885 1/s; its torque is then late by 2.2 ms in place of 0.5 ms. docs/validation/electric.md
shows what that costs."""


class SpeedLoop(NamedTuple):
    """K torque of all machines over missing speed [N m s/rad]; i_T inverse of integral time and of tracking time, i_tau
    inverse of the time in which set-points are smoothed [1/s]."""

    K: float
    i_T: float
    i_tau: float


def current_loop_rate(omega_i: float) -> float:
    """Rate of the current loop of a bandwidth omega_i [rad/s], as it is integrated [1/s]."""
    return min(omega_i, CURRENT_RATE)


@scalar
def current_rate(i, i_ref, rate):
    r"""Rate of the current [A/s], a first-order lag: :math:`\dot i = \lambda (i_{ref} - i)`; rate lambda [1/s]."""
    return rate * (i_ref - i)


@scalar
def smoothing_rate(x, target, loop):
    """Rate of a smoothed set-point, per second: the PLC's steps, one a cycle, would be steps of torque."""
    return loop.i_tau * (target - x)


@scalar
def torque_demand(omega_ref, omega_m, T_ff, T_n, loop):
    r"""Torque that the speed loop demands [N m]: :math:`T_{ff} + K(\omega_{ref} - \omega_m) + T_n`.

    T_ff feedforward of load and acceleration, T_n integral part [N m]; speeds [rad/s].
    """
    return T_ff + loop.K * (omega_ref - omega_m) + T_n


@scalar
def integral_rate(omega_ref, omega_m, T_demand, T_ref, loop):
    r"""Rate of the integral part [N m/s], with back-calculation at the torque limit.

    .. math:: \dot T_n = \frac{K (\omega_{ref} - \omega_m) + T_{ref} - T_{demand}}{T_i}

    T_demand torque demanded, T_ref the same within the limits [N m]. The tracking time is the integral time.
    Source: back-calculation as in Astrom and Hagglund, PID Controllers, 1995.
    """
    return loop.i_T * (loop.K * (omega_ref - omega_m) + T_ref - T_demand)
