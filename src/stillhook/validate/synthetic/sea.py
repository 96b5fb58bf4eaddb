"""Irregular motion of a crane tip: sines with heights of a sea's spectrum, at frequencies that never come round."""

from __future__ import annotations

import numpy as np

from stillhook.sea.motion.motion import Motion, Ramped, Sine, Sum
from stillhook.variables import WINDOW

GAMMA = 3.3
"""Peakedness of the spectrum (mean JONSWAP)."""
LOWEST, HIGHEST = 0.55, 2.0
"""Band of frequencies over that of the peak: a hull follows no shorter waves."""
PER_SECOND = 0.06
FEWEST, MOST = 24, 90
"""Sines: so many a second of the run, within these bounds."""
STEP = 0.2
"""Spacing at which the largest peak-to-peak is looked for [s]."""


def irregular(period: float, duration: float, ramp: float, highest: float, rng: np.random.Generator) -> Sum:
    """Tip motion with a peak period [s] whose largest peak-to-peak over 30 s of a run is `highest` [m]; ramp of the run
    [s].

    Frequencies are drawn within even bands, so that the motion does not repeat itself. Source: JONSWAP spectrum
    (Hasselmann et al. 1973) of peak factor 3.3; heights then scaled.
    """
    n = int(np.clip(round(PER_SECOND * duration), FEWEST, MOST))
    edges = np.linspace(LOWEST, HIGHEST, n + 1)
    r = rng.uniform(edges[:-1], edges[1:])
    width = np.where(r < 1.0, 0.07, 0.09)
    S = r**-5.0 * np.exp(-1.25 * r**-4.0) * GAMMA ** np.exp(-0.5 * ((r - 1.0) / width) ** 2)
    size, phases = np.sqrt(S * np.diff(edges)), rng.uniform(0.0, 2.0 * np.pi, n)
    unit = _sum(size, period / r, phases)
    return _sum(size * highest / _largest(unit, duration, ramp), period / r, phases)


def _sum(sizes: np.ndarray, periods: np.ndarray, phases: np.ndarray) -> Sum:
    return Sum([Sine.from_si(float(a), float(T), float(p)) for a, T, p in zip(sizes, periods, phases, strict=True)])


def _largest(motion: Motion, duration: float, ramp: float) -> float:
    """Largest peak-to-peak over a moving window of 30 s [m]."""
    s = Ramped.from_si(motion, ramp).sample(np.arange(0.0, duration, STEP))[0]
    windows = np.lib.stride_tricks.sliding_window_view(s, min(round(WINDOW / STEP) + 1, len(s)))
    return float((windows.max(axis=1) - windows.min(axis=1)).max())
