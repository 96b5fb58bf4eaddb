"""Excitation of the twin of a winch for its residual: sines and irregular motions."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from stillhook.kernels.lanes import VL
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.spectra.parametric import Jonswap

SEED = 20
SETTLED = 60.0
"""Part of an irregular motion that is left out at its start [s]."""


@dataclass(frozen=True)
class ExcitationGrid:
    """periods [s] and speeds, amplitudes [m/s], of the sines; mean_periods, zero-crossing periods [s], and deviations
    of speed [m/s] of the irregular motions, and their length [s], start included; all ascending."""

    periods: tuple[float, ...]
    speeds: tuple[float, ...]
    mean_periods: tuple[float, ...]
    deviations: tuple[float, ...]
    length: float

    def motions(self) -> list[Irregular]:
        """The irregular motions, by mean period and within it by deviation; each has separate random phases, always
        the same."""
        pairs = [(T, sigma) for T in self.mean_periods for sigma in self.deviations]
        return [Irregular(T, sigma, _motion(T, sigma, self.length, SEED + n)) for n, (T, sigma) in enumerate(pairs)]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers that identify a grid."""
        return asdict(self)


class Irregular(NamedTuple):
    """An irregular motion of the tip: zero-crossing period [s], deviation of its speed [m/s]."""

    T_z: float
    sigma_v: float
    tip: IrregularTip


def _geometric(low: float, high: float, n: int) -> tuple[float, ...]:
    return tuple(float(x) for x in np.geomspace(low, high, n))


FINE = ExcitationGrid(
    periods=_geometric(2.5, 25.0, 8),
    speeds=_geometric(0.004, 4.0, 2 * VL),
    mean_periods=(4.5, 7.0, 10.5, 15.0),
    deviations=_geometric(0.004, 1.6, 12),
    length=1260.0,
)
"""Periods of ship motion, C changes by a third or less from one to the next; speeds, in whole blocks of runs side by
side, from a winch that sticks to three times what most reach; deviations to a winch that is saturated most of the
time."""
QUICK = ExcitationGrid(
    periods=FINE.periods,
    speeds=_geometric(0.004, 4.0, VL),
    mean_periods=FINE.mean_periods,
    deviations=tuple(FINE.deviations[i] for i in (0, 2, 4, 6, 7, 8, 9, 10)),
    length=660.0,
)
"""A third of the runs, for plans with many winches and duties: its results differ from those of `FINE` by as much as
other random phases do."""


def _motion(T_z: float, sigma_v: float, length: float, seed: int) -> IrregularTip:
    """A JONSWAP motion with this zero-crossing period and deviation of speed, fixed amplitudes, random phases."""
    k = np.arange(1, int(length / 1.5))
    omega = np.asarray(2.0 * math.pi / length * k, dtype=np.float64)
    T_p = 1.3 * T_z
    for _ in range(20):
        S = Jonswap(1.0, T_p, 2.0).density(omega)
        T_p *= T_z / (2.0 * math.pi * math.sqrt(S.sum() / (S @ omega**2)))
    S *= sigma_v**2 / (S @ omega**2)
    phases = np.random.default_rng(seed).random(len(k))
    return IrregularTip(np.concatenate(([0.0], np.sqrt(2.0 * S) * np.exp(2j * math.pi * phases))), length)
