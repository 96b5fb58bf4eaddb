"""Over-centre variable pumps at constant speed, and the displacement controls of pumps and motors."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar

LEAK_KNOTS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Displacements of the measured leak tables 2.5 and 2.6, as part of the full one (71, 142, 213, 284, 355 cm^3/rev)."""


class PumpLeak(NamedTuple):
    """Leak conductance of a set of pumps [m^3/s/Pa] at 20, 40, 60, 80 and 100 % displacement."""

    C_20: float
    C_40: float
    C_60: float
    C_80: float
    C_100: float


class Pumps(NamedTuple):
    """A set of pumps seen as one: D_max total displacement [m^3/rad], omega_p shaft speed [rad/s]."""

    D_max: float
    omega_p: float
    leak: PumpLeak


@scalar
def pump_flow(alpha_p, pumps):
    """Flow towards the hoisting side A [m^3/s]; alpha_p in [-1, 1], hoisting positive. Source: Moslatt 2020 E eq.
    11."""
    return pumps.D_max * pumps.omega_p * alpha_p


@scalar
def pump_leakage(alpha_p, leak):
    """Total leak conductance at displacement alpha_p [m^3/s/Pa], linear between the measured points.

    Source: Moslatt 2020 tables 2.5 and 2.6 (A4VSG 355), scaled with the installed size as section 2.5.2.4 says.
    Differs from print: the row "384 cm^3/rev" reads 284. Below 20 % displacement the value at 20 % is held.
    """
    a = abs(alpha_p)
    C = leak.C_20 + (leak.C_40 - leak.C_20) * clip(5.0 * a - 1.0, 0.0, 1.0)
    C = C + (leak.C_60 - leak.C_40) * clip(5.0 * a - 2.0, 0.0, 1.0)
    C = C + (leak.C_80 - leak.C_60) * clip(5.0 * a - 3.0, 0.0, 1.0)
    return C + (leak.C_100 - leak.C_80) * clip(5.0 * a - 4.0, 0.0, 1.0)


STOPPING = 4.0
"""Rate at which a plate that runs into its stop comes to rest, over the natural frequency of its control [-]: within
milliseconds for a pump, as metal on metal, and slow enough for the steps of a run."""


class Servo(NamedTuple):
    """Second-order displacement control: omega_n [rad/s], zeta [-], stroke lo..hi [-], rate highest speed of the
    setting [1/s]."""

    omega_n: float
    zeta: float
    lo: float
    hi: float
    rate: float


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

    Differs from print: the setting gets no faster than `servo.rate`, the flow that its control valve lets through, and
    a plate that meets its stop comes to rest there.
    """
    a = servo.omega_n * (servo.omega_n * (u - alpha) - 2.0 * servo.zeta * alpha_dot)
    a = fmin(a, 0.0) if alpha_dot >= servo.rate else a
    a = fmax(a, 0.0) if alpha_dot <= -servo.rate else a
    rebound = -STOPPING * servo.omega_n * alpha_dot
    a = fmin(a, rebound) if alpha >= servo.hi and alpha_dot > 0.0 else a
    return fmax(a, rebound) if alpha <= servo.lo and alpha_dot < 0.0 else a


@scalar
def swash_rate(alpha, alpha_dot, servo):
    """Rate of the displacement setting [1/s]: within the servo's limit, and none into a stop."""
    v = clip(alpha_dot, -servo.rate, servo.rate)
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
    """Displacement that the heave compensation reckons with: measured with feedback, else the command."""
    return control.feedback * alpha_m + (1.0 - control.feedback) * u_m
