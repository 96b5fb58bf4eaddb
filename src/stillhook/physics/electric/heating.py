"""Temperature of a winding, or of a store, as one body."""

import math
from typing import NamedTuple

from stillhook.physics.scalar import scalar


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
