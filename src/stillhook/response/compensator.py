"""A passive heave compensator, linearised about the stroke at which the load hangs still."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.programme import static_stroke
from stillhook.spec.lift.lowering import Lowering
from stillhook.statistics.extremes import share_beyond


@dataclass(frozen=True)
class LinearCompensator:
    """s stroke at rest, of 0 to s_max [m]; k stiffness n p A^2/V [N/m], 0 where the rod stands at an end; C orifice
    [N s^2/m^2]; F_f friction of the seals [N], whole from the speed v_f on [m/s]."""

    s: float
    s_max: float
    k: float
    C: float = 0.0
    F_f: float = 0.0
    v_f: float = 0.01

    @property
    def moves(self) -> bool:
        """Whether the rod hangs between the ends of its stroke."""
        return self.k > 0.0

    @property
    def lossy(self) -> bool:
        """Whether its damping depends on how fast it moves."""
        return self.C > 0.0 or self.F_f > 0.0

    @property
    def room(self) -> float:
        """Way to the nearer end of the stroke [m]."""
        return min(self.s, self.s_max - self.s)

    def share_at_end(self, sigma: ArrayLike) -> FloatArray:
        """Share of the time in which a Gaussian stroke of deviation sigma [m] about that at rest would be beyond an end
        [-]."""
        return np.asarray(0.5 * (share_beyond(self.s, sigma) + share_beyond(self.s_max - self.s, sigma)))

    def damping(self, sigma: ArrayLike) -> FloatArray:
        r"""Linear damping of a Gaussian speed of the rod of deviation sigma [m/s] [N s/m].

        .. math:: c = \sqrt{8/\pi}\,C\,\sigma + \min\left(\sqrt{2/\pi}\,F_f/\sigma,\ F_f/v_f\right)

        It takes out the power that orifice and seals do. Source: Gaussian (equivalent) linearisation.
        """
        v = np.asarray(sigma, dtype=np.float64)
        seals = np.minimum(math.sqrt(2.0 / math.pi) * self.F_f / v, self.F_f / self.v_f)
        return np.asarray(math.sqrt(8.0 / math.pi) * self.C * v + seals)


def linear_compensator(lift: Lowering, z: float) -> LinearCompensator | None:
    """The compensator of a lift with the payload hanging still, its underside at z [m]; None where there is none."""
    unit = lift.compensator
    if unit is None:
        return None
    s = static_stroke(lift, z)
    moves = 1e-6 < s / unit.stroke < 1.0 - 1e-6
    return LinearCompensator(
        s=s,
        s_max=unit.stroke,
        k=unit.stiffness(s) if moves else 0.0,
        C=unit.orifice,
        F_f=unit.friction,
        v_f=unit.v_friction,
    )
