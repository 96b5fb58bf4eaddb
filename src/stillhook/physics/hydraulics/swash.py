"""Swash-plate and bent-axis displacement controls."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar

STOPPING = 4.0
"""Rate at which a plate that runs into its stop comes to rest, over the natural frequency of its control [-]: within
milliseconds for a pump, as metal on metal, and slow enough for the steps of a run."""


class Servo(NamedTuple):
    """Second-order displacement control: omega_n [rad/s], zeta [-], stroke lo..hi [-]; rate, rate_down
    highest speeds of the setting as it rises and as it falls [1/s]; dead_time by which its command u is late [s]."""

    omega_n: float
    zeta: float
    lo: float
    hi: float
    rate: float
    rate_down: float
    dead_time: float = 0.0


class MotorControl(NamedTuple):
    """How the motors' displacement is set: `offset` and half of the `hysteresis` width as part of the full displacement
    (both 0 in closed loop), and `feedback` 1 where the displacement is measured, 0 where the PLC knows only its
    command.
    """

    offset: float
    half_width: float
    feedback: float


@scalar
def swash_acceleration(alpha, alpha_dot, u, servo):
    """Second derivative of the displacement setting [1/s^2]. Source: Moslatt 2020 eq. C 10, E eqs 7 and 8.

    Differs from print: the setting gets no faster than `servo.rate`, falling `servo.rate_down`, the flow that its
    control valve lets through, and a plate that meets its stop comes to rest there.
    """
    a = servo.omega_n * (servo.omega_n * (u - alpha) - 2.0 * servo.zeta * alpha_dot)
    a = fmin(a, 0.0) if alpha_dot >= servo.rate else a
    a = fmax(a, 0.0) if alpha_dot <= -servo.rate_down else a
    rebound = -STOPPING * servo.omega_n * alpha_dot
    a = fmin(a, rebound) if alpha >= servo.hi and alpha_dot > 0.0 else a
    return fmax(a, rebound) if alpha <= servo.lo and alpha_dot < 0.0 else a


@scalar
def swash_rate(alpha, alpha_dot, servo):
    """Rate of the displacement setting [1/s]: within the servo's limit, and none into a stop."""
    v = clip(alpha_dot, -servo.rate_down, servo.rate)
    v = fmin(v, 0.0) if alpha >= servo.hi else v
    return fmax(v, 0.0) if alpha <= servo.lo else v


@scalar
def displacement(alpha, servo):
    """Setting that the unit really has [-]: the plate stands at its stop where the servo would pass it."""
    return clip(alpha, servo.lo, servo.hi)


@scalar
def play(u, held, half_width):
    """Hysteresis of an open-loop control: the output follows only once the command has crossed the play."""
    return clip(held, u - half_width, u + half_width)


@scalar
def pilot(u_m, held, control):
    """Command that reaches the motors' servo [-] and the play's memory: hysteresis, then the offset towards more
    displacement.

    Source: Moslatt 2020 E section 5.1.1 (offset 5-10 %, up to 20 cm^3/rev, noticeable hysteresis).
    """
    out = play(u_m, held, control.half_width)
    return clip(out + control.offset, 0.0, 1.0), out


@scalar
def known_displacement(alpha_m, u_m, control):
    """Displacement that the heave compensation uses: measured with feedback, else the command."""
    return control.feedback * alpha_m + (1.0 - control.feedback) * u_m
