"""An electric machine with its inverter: torque, losses, the current that its power allows, the loops of its drive, and
its temperature.

One machine stands for its three phases: its current i is the torque-producing one, scaled so that torque constant and
voltage constant are one number in SI (K_e = K_t). Flux and with it K_t are constant; the current that weakens the field
above the corner speed and its copper loss are left out. Its current loop is a first-order lag, its speed loop a PI with
anti-windup: both run at a millisecond or faster and are continuous here.
"""

import math
from typing import NamedTuple

from stillhook.physics.scalar import fmax, fmin, scalar, sqrt

STILL = 1.0e-9
"""Speed below which a power no longer bounds a torque [rad/s]: a billionth, far below any shaft that turns."""


class Machines(NamedTuple):
    """count machines of one kind on one shaft; of one: K_t torque constant [N m/A]; R winding, warm, and R_inverter
    what the inverter loses as one [ohm]; k_iron iron loss over speed squared [N m s/rad]; P_idle loss of the inverter
    without current [W]. T_max largest torque [N m] and P_max largest power at the shaft [W] of all of them; n_max
    highest speed [rad/s]."""

    count: float
    K_t: float
    R: float
    R_inverter: float
    k_iron: float
    P_idle: float
    T_max: float
    P_max: float
    n_max: float


@scalar
def torque(i, machines):
    r"""Torque of all machines at the shaft [N m], hoisting positive; i current of one [A].

    .. math:: T = n K_t i

    Iron loss is charged to the DC link and not to the shaft, see `iron_loss`.
    """
    return machines.count * machines.K_t * i


@scalar
def current(T, machines):
    """Current of one machine [A] for the torque T of all of them [N m]."""
    return T / (machines.count * machines.K_t)


@scalar
def copper_loss(i, machines):
    r"""Loss in the windings of all machines, never negative [W]: :math:`n R i^2`, at the warm resistance throughout.

    At a steady torque T of one machine that is R T^2/K_t^2 each.
    """
    return machines.count * machines.R * i * i


@scalar
def iron_loss(omega_m, machines):
    r"""Hysteresis and eddy currents of all machines, never negative [W]: :math:`n k \omega_m^2`; omega_m [rad/s].

    Charged to the DC link: the supply pays for it, the shaft does not feel it. Most of it is of eddy currents, whence
    the square.
    """
    return machines.count * machines.k_iron * omega_m * omega_m


@scalar
def inverter_loss(i, machines):
    r"""Loss of all inverters, never negative [W]: :math:`n (P_0 + R_i i^2)`, without the part that goes with |i|."""
    return machines.count * (machines.P_idle + machines.R_inverter * i * i)


@scalar
def link_power(i, omega_m, machines):
    r"""Power that the inverters take from the DC link [W]; negative: fed back.

    .. math:: P_{dc} = n K_t i\,\omega_m + n R i^2 + n k \omega_m^2 + n (P_0 + R_i i^2)
    """
    loss = copper_loss(i, machines) + iron_loss(omega_m, machines) + inverter_loss(i, machines)
    return torque(i, machines) * omega_m + loss


@scalar
def motoring_current(omega_m, P, machines):
    r"""Largest current of one machine that takes no more than P [W] from the link for all of them; omega_m [rad/s].

    .. math:: i = \frac{-K_t\omega + \sqrt{(K_t\omega)^2 + 4 (R + R_i) P'}}{2 (R + R_i)},\quad
        P' = P/n - k\omega^2 - P_0
    """
    R = machines.R + machines.R_inverter
    e = machines.K_t * omega_m
    left = P / machines.count - machines.k_iron * omega_m * omega_m - machines.P_idle
    return 0.5 * (sqrt(fmax(e * e + 4.0 * R * left, 0.0)) - e) / R


@scalar
def regenerating_current(omega_m, P, machines):
    """Largest current of one machine, against its speed omega_m >= 0 [rad/s], that feeds back no more than P [W] for
    all of them; the other root of the same equation. Without limit at standstill."""
    R = machines.R + machines.R_inverter
    e = machines.K_t * omega_m
    left = P / machines.count + machines.k_iron * omega_m * omega_m + machines.P_idle
    return 2.0 * left / fmax(e + sqrt(fmax(e * e - 4.0 * R * left, 0.0)), STILL)


@scalar
def torque_limit(omega_m, P_supply, P_back, machines):
    r"""Largest torque of all machines in the direction of positive omega_m [N m], never negative.

    .. math:: T \le \min(T_{max}, P_{max}/|\omega_m|, n K_t i)

    P_supply power that the DC link gives and P_back power that it takes [W], both not negative. The largest torque the
    other way is that at -omega_m.
    """
    i = fmin(motoring_current(omega_m, P_supply, machines), regenerating_current(fmax(-omega_m, 0.0), P_back, machines))
    at_shaft = fmin(machines.T_max, machines.P_max / fmax(abs(omega_m), STILL))
    return fmin(at_shaft, fmax(torque(i, machines), 0.0))


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


class Body(NamedTuple):
    """theta_c coolant [K]; R_th temperature rise over loss, of one machine or of the whole store [K/W]; i_tau inverse
    of the thermal time constant [1/s]; theta_max highest temperature [K]."""

    theta_c: float
    R_th: float
    i_tau: float
    theta_max: float


@scalar
def heating_rate(theta, P_loss, body):
    r"""Rate of the body's temperature [K/s]; theta [K], P_loss what heats it [W]: copper and iron loss of one machine,
    loss of the store.

    .. math:: \tau_{th}\dot\theta = R_{th} P - (\theta - \theta_c)

    Source: Siemens, 1FW6 built-in torque motors, configuration manual 05/2009, section 5.3 (one body, first order).
    Differs from print: iron loss heats the same body.
    """
    return body.i_tau * (body.R_th * P_loss - (theta - body.theta_c))


def time_to_limit(theta: float, P_loss: float, body: Body) -> float:
    r"""Time for which a steady loss P_loss [W] may last from the temperature theta [K], in s.

    .. math:: t = \tau_{th} \ln\frac{\theta_\infty - \theta}{\theta_\infty - \theta_{max}}

    0 above the limit, infinite where it is never reached.
    """
    end = body.theta_c + body.R_th * P_loss
    if theta >= body.theta_max:
        return 0.0
    return math.log((end - theta) / (end - body.theta_max)) / body.i_tau if end > body.theta_max else math.inf
