"""Peak-to-peak control errors over moving windows, measured and simulated, and their deviation.

Source: Moslatt 2020 paper F, eqs 2, 3, 6, 7 and figures 11 to 13.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.metrics import peak_to_peak

EVERY = 0.5
"""Spacing of the windows' ends [s]: a sixtieth of paper F's window, fine enough that values between two of them do not
matter."""


@dataclass(frozen=True)
class Windows:
    """Moving windows of one unbroken part: each of shape (n,). ends [s from the record's first sample]; peak-to-peak
    errors and tip [m]."""

    test: str
    ends: FloatArray
    measured: FloatArray
    simulated: FloatArray
    s_tip_pp: FloatArray

    @property
    def x(self) -> FloatArray:
        """Deviation |e_c_pp simulated - e_c_pp measured| of every window [m]."""
        return np.abs(self.simulated - self.measured)

    @property
    def eta_measured(self) -> FloatArray:
        """Compensation efficiency, measured [-]; NaN where the tip does not move."""
        return efficiency(self.measured, self.s_tip_pp)

    @property
    def eta_simulated(self) -> FloatArray:
        """Compensation efficiency, simulated [-]; NaN where the tip does not move."""
        return efficiency(self.simulated, self.s_tip_pp)


def efficiency(e_c_pp: FloatArray, s_tip_pp: FloatArray) -> FloatArray:
    """1 - e_c_pp / s_tip_pp [-], NaN where the tip does not move. Source: paper F eq. 3."""
    moves = s_tip_pp > 0.0
    return np.where(moves, 1.0 - e_c_pp / np.where(moves, s_tip_pp, 1.0), np.nan)


def windows(
    test: str, t: FloatArray, step: float, measured: FloatArray, simulated: FloatArray, s_tip: FloatArray, window: float
) -> Windows:
    """Windows over an unbroken part, trailing and full of numbers in all three signals.

    Parameters: t (n,) [s] even by step [s]; measured and simulated error, tip (n,) [m], NaN where not known; window
    [s].
    """
    import xarray  # heavy: only where data are at hand

    table = xarray.DataArray(np.stack([measured, simulated, s_tip]), coords={"time": t}, dims=("signal", "time"))
    if len(t) < 2 or t[-1] - t[0] < window - 1e-9:
        return Windows(test, *(np.zeros(0) for _ in range(4)))
    pp = peak_to_peak(table, step, window).values[:, :: max(1, round(EVERY / step))]
    full = np.isfinite(pp).all(axis=0)
    return Windows(test, t[:: max(1, round(EVERY / step))][full], pp[0, full], pp[1, full], pp[2, full])


def mean_and_s(x: FloatArray) -> tuple[float, float]:
    """Average and standard deviation of deviations. Source: paper F eqs 7 and 6."""
    if len(x) < 2:
        return (float(x[0]) if len(x) else math.nan), math.nan
    return float(np.mean(x)), float(np.std(x, ddof=1))


def gaussian_share(limit: float, mean: float, s: float) -> float:
    """Share of deviations below a limit, as in paper F: assumed Gaussian about their mean.

    Print reads 96 % below 6 cm and 86 % below 5 cm off a mean of 3.3 cm and s of 1.5 cm; the latter is 87 %.
    """
    if not s > 0.0:
        return float(mean < limit)
    return 0.5 * (1.0 + math.erf((limit - mean) / (s * math.sqrt(2.0))))


def counted_share(limit: float, x: FloatArray) -> float:
    """Share of deviations below a limit, counted."""
    return float(np.mean(x < limit))


def by_motion(parts: Sequence[Windows], width: float) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.intp]]:
    """Average deviations against tip motion, as in paper F figures 12 and 13.

    Returns: middles of bins of this width [m], mean deviation of e_c_pp [m], mean |deviation| of the efficiency [-],
    windows in each bin.
    """
    tip = np.concatenate([w.s_tip_pp for w in parts])
    x, eta = (
        np.concatenate([w.x for w in parts]),
        np.concatenate([np.abs(w.eta_simulated - w.eta_measured) for w in parts]),
    )
    cell = np.floor(tip / width).astype(np.intp)
    cells = np.unique(cell)
    count = np.array([(cell == c).sum() for c in cells], dtype=np.intp)
    error, efficient = (np.array([np.nanmean(y[cell == c]) for c in cells], dtype=np.float64) for y in (x, eta))
    return np.asarray((cells + 0.5) * width, dtype=np.float64), error, efficient, count
