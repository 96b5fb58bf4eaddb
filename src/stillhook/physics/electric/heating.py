"""Temperature of a winding as one body."""

import math
from typing import NamedTuple

from stillhook.physics.scalar import scalar


class Winding(NamedTuple):
    """theta_c coolant [K]; R_th temperature rise over loss of one machine [K/W]; i_tau inverse of the thermal time
    constant [1/s]; theta_max highest temperature [K]."""

    theta_c: float
    R_th: float
    i_tau: float
    theta_max: float


@scalar
def heating_rate(theta, P_loss, winding):
    r"""Rate of the winding's temperature [K/s]; theta [K], P_loss copper and iron loss of one machine [W].

    .. math:: \tau_{th}\dot\theta = R_{th} P - (\theta - \theta_c)

    Source: Siemens, 1FW6 built-in torque motors, configuration manual 05/2009, section 5.3 (one body, first order).
    Differs from print: iron loss heats the same body.
    """
    return winding.i_tau * (winding.R_th * P_loss - (theta - winding.theta_c))


def time_to_limit(theta: float, P_loss: float, winding: Winding) -> float:
    r"""Time for which a steady loss P_loss of one machine [W] may last from the temperature theta [K], in s.

    .. math:: t = \tau_{th} \ln\frac{\theta_\infty - \theta}{\theta_\infty - \theta_{max}}

    0 above the limit, infinite where it is never reached.
    """
    end = winding.theta_c + winding.R_th * P_loss
    if theta >= winding.theta_max:
        return 0.0
    return math.log((end - theta) / (end - winding.theta_max)) / winding.i_tau if end > winding.theta_max else math.inf
