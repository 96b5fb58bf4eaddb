r"""Height that a share of runs passes, from runs that say yes or no at a few heights, by the height alone.

.. math:: P(\text{beyond at } H) = \Phi\big((\ln H - \mu)/s\big),\qquad \ln H_p = \mu + s\,\Phi^{-1}(p)

A run says only whether it passed a limit, so that nothing is assumed on how its number is distributed. Location and
scale count by their likelihood, evenly over a grid: the posterior is exact. Validity: the share beyond rises with the
height. Where that of all heights is near p the interval is as wide as the grid.
"""

from __future__ import annotations

import numpy as np
import scipy

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.statistics.crossing_fit import FARTHEST

SCALES = np.geomspace(0.03, 8.0, 26)
"""Standard deviations s of ln of the height at which a run crosses."""
BESIDE, STEP = 1.5, 0.02
"""How far below the lowest and above the highest height mu may lie, and its step, in ln of the height."""
ENDS = (0.5, 0.025, 0.975)


def share_crossing(H: FloatArray, n: IntArray, beyond: IntArray, p: float) -> FloatArray:
    """Height that a share p (0..1) of runs passes and ends of its 95 % interval (3,) [unit of H], of heights H (k,)
    above 0 with n runs each, of which some were beyond."""
    ln_H = np.log(H)
    mu = np.arange(ln_H.min() - BESIDE, ln_H.max() + BESIDE, STEP)
    z = np.clip((ln_H - mu[:, None, None]) / SCALES[:, None], -FARTHEST, FARTHEST)
    ln_L = (beyond * scipy.special.log_ndtr(z) + (n - beyond) * scipy.special.log_ndtr(-z)).sum(axis=2)
    weight = np.exp(ln_L - ln_L.max()).ravel()
    at = (mu[:, None] + SCALES * scipy.special.ndtri(p)).ravel()
    order = np.argsort(at)
    share = np.cumsum(weight[order]) / weight.sum()
    return np.asarray(np.exp(at[order][np.searchsorted(share, ENDS)]))
