"""Comparison of a segment of the crane with the twin: control errors of equal definition, and their windows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.series import dot
from stillhook.validate.ahc.replay import Replay, about_mean
from stillhook.validate.ahc.windows import Windows, windows

SLOW = 0.2
"""Noise of the tip is what moves faster than a moving mean of this width [s]."""


@dataclass(frozen=True)
class Comparison:
    """Comparison of a segment of the crane with the twin, over the samples that count: replay; simulated signals by
    name (n,) [SI]; measured and simulated control error (n,) [m]; noise: share of the tip signal's noise in the
    measured error [-]; moving windows.
    """

    replay: Replay
    simulated: dict[str, FloatArray]
    e_measured: FloatArray
    e_simulated: FloatArray
    noise: float
    windows: Windows

    @property
    def name(self) -> str:
        return self.replay.name

    @property
    def pair(self) -> tuple[FloatArray, FloatArray]:
        """Measured and simulated control error where both are known."""
        good = np.isfinite(self.e_measured) & np.isfinite(self.e_simulated)
        return self.e_measured[good], self.e_simulated[good]

    @property
    def quiet(self) -> tuple[FloatArray, FloatArray]:
        """The same without the tip's noise, which is common to both: noise would make errors of any two
        shapes similar."""
        good = np.isfinite(self.e_measured) & np.isfinite(self.e_simulated)
        noise = self.noise * self.replay.noise[good]
        return self.e_measured[good] - noise, self.e_simulated[good] - noise


def compare(r: Replay, run: dict[str, FloatArray], measured: FloatArray, window: float, *, logged: bool) -> Comparison:
    """The twin's error as the crane's PLC would show it: with the noise of the tip signal, as far as the crane's error
    contains it.

    Parameters: replay and its run; measured control error (n,) [m], logged by the PLC or, with logged False, made from
    tip and wire, about its mean; window [s].
    """
    share = noise_share(r, measured) if logged else 1.0
    simulated = run["e_c_measured"] + share * r.noise
    if not logged:
        simulated = about_mean(simulated)
    parts = windows(r.name, r.t, r.record.step, measured, simulated, r.s_tip, window)
    return Comparison(r, run, measured, simulated, share, parts)


def noise_share(r: Replay, measured: FloatArray) -> float:
    """Share of the noise of the logged tip in the PLC's error: 1 where the PLC received that signal, 0 where only the
    log's is noisy."""
    from scipy.ndimage import uniform_filter1d  # heavy: only where data are at hand

    known = np.isfinite(measured)
    e, n = np.where(known, measured, 0.0), np.where(known, r.noise, 0.0)
    size = max(3, round(SLOW / r.record.step)) | 1
    e, n = (x - uniform_filter1d(x, size) for x in (e, n))
    e, n = (x[known & (uniform_filter1d(known.astype(float), size) > 1.0 - 0.5 / size)] for x in (e, n))
    power = dot(n, n)
    return min(1.0, max(0.0, dot(e, n) / power)) if power > 0.0 else 0.0
