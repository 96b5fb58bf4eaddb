"""An electric machine with its inverter: torque, losses, and the current that its power allows.

One machine stands for its three phases: its current i is the torque-producing one, scaled so that torque constant and
voltage constant are one number in SI (K_e = K_t). Flux and with it K_t are constant; the current that weakens the field
above the corner speed and its copper loss are left out.
"""

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
