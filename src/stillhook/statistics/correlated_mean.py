"""Means of correlated samples and what they are worth; drift against noise; the step of a converter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.statistics.estimate import NORMAL_95, t_factor

OF_SECOND_DIFFERENCES = 1.0 / (0.6745 * np.sqrt(6.0))
"""Differences of white noise weighted 1, -2, 1 have sqrt(6) times its deviation; their median magnitude is 0.6745 of
theirs."""
MOST_BLOCKS = 256
"""Samples of a mean are put together into so many blocks at most: enough for every correlation that matters, and
quick."""
FEWEST_FREEDOM = 2.0
"""Degrees of freedom below which Student's factor says nothing any more (4.3 at 2, 12.7 at 1)."""
LARGEST_CORRELATION = 0.95
"""Correlation of neighbours that is believed from a short stretch; a higher one is drift."""
TREND_SIGNIFICANCE = 3.0
"""Standard errors from which a drift counts as seen: with some twenty starts tried, one in a hundred by chance."""
LEAST_LEVELS = 256
"""A converter has 8 bits or more: fewer levels over the range are set values, not the steps of a sensor."""
HELD = 6
"""Equal bins in a row that count as held."""
SAME_LEVEL = 1e-7
"""Differences below this part of the range are rounding of the unit conversion."""
FEWEST_LEVELS, MOST_LEVELS, MOST_GAPS, FINEST, OFF_LEVEL, MOST_HELD = 4, 400, 64, 2.0**-17, 0.02, 0.9
"""Converter's step: values needed and values looked at; gaps between them that are tried, with their halves and thirds;
finest step over the range (17 bits); what counts as off a level, in steps; share of bins that must be on a level
(others mix two
levels)."""
SHARE_OF_RANGE = 2e-5
"""Least uncertainty that is stated, over the largest value in the log (0.008 bar in 400): half a step of a 16-bit
converter or so.

It is one number for all stretches of a log, so that stretches of a log without noise weigh the same."""


def noise_of(x: FloatArray) -> float:
    """Standard deviation of white noise on a piecewise smooth series, from its second differences (median, so steps do
    not count)."""
    if len(x) < 4:
        return 0.0
    second = np.sort(np.abs(x[2:] - 2.0 * x[1:-1] + x[:-2]))  # np.median takes ten times as long on a hundred samples
    return 0.5 * float(second[(len(second) - 1) // 2] + second[len(second) // 2]) * float(OF_SECOND_DIFFERENCES)


def blocks(x: FloatArray, most: int = MOST_BLOCKS) -> FloatArray:
    """Means of equal blocks along the last axis, the first few samples left out so that the end is kept: shape (..., <=
    most)."""
    n = x.shape[-1]
    size = -(-n // most)
    if size == 1:
        return x
    count = n // size
    return np.asarray(x[..., n - count * size :].reshape(*x.shape[:-1], count, size).mean(axis=-1), dtype=float)


def mean_and_uncertainty(
    x: FloatArray, *, step: float = 0.0, per_bin: float = 1.0, floor: float = 0.0
) -> tuple[float, float]:
    """Mean of one stationary stretch and its standard uncertainty.

    Parameters: x samples at equal spacing, shape (n,); step of the converter in the unit of x, 0 where it has none;
    per_bin raw samples in each of x; floor least uncertainty.
    The variance of a mean is the sum of autocovariances over n. The sum is cut where a pair of neighbouring terms is no
    longer positive (Geyer, Statistical Science 7, 1992), and corrected for the mean having been taken from the same
    samples. Student's factor for the effective number of samples is inside, so 1.96 standard uncertainties hold 95 %.
    Where raw samples scatter less than half a step, dithering does not average the steps out and step/sqrt(12) is
    added.
    """
    mean = float(np.mean(x))
    b = blocks(np.asarray(x, dtype=float))
    n = len(b)
    r = b - b.mean()
    gamma = np.correlate(r, r, "full")[n - 1 :] / n
    quantised = step / np.sqrt(12.0) if noise_of(x) * np.sqrt(per_bin) < 0.5 * step else 0.0
    if n < 2 or gamma[0] <= 0.0:
        return mean, float(np.hypot(quantised, floor))
    total = long_run_variance(gamma)
    freedom = max(n * gamma[0] * n / (n - 1) / total - 1.0, 1.0)
    u = np.sqrt(total / n) * students_factor(freedom)
    return mean, float(np.sqrt(u**2 + quantised**2 + floor**2))


def long_run_variance(gamma: FloatArray) -> float:
    """Sum of autocovariances over all lags, from those about the sample mean (biased, divided by n): shape (n,)."""
    n = len(gamma)
    even = n - n % 2
    pairs = gamma[:even:2] + gamma[1:even:2]
    # of a pair, by taking the mean from the same samples, over the sum
    lost = (2.0 - (4.0 * np.arange(len(pairs)) + 1.0) / n) / n
    least, total = float(gamma[0]), float(gamma[0]) * n / (n - 1)
    for _ in range(3):  # what is lost is a part of the sum itself; three rounds settle it to the percent
        corrected = pairs + total * lost
        end = int((corrected <= 0.0).argmax()) if corrected.min() <= 0.0 else len(corrected)
        total = min(max(2.0 * float(corrected[: max(end, 1)].sum()) - least - total / n, least), 0.5 * n * least)
    return total


def students_factor(freedom: float) -> float:
    """Student's 97.5 % point over the normal one."""
    return t_factor(max(freedom, FEWEST_FREEDOM)) / NORMAL_95


@dataclass(frozen=True)
class Trends:
    """Of stretches that begin at several starts and have one end: drift over the stretch and its head against its rest,
    with the differences that noise alone explains: arrays (channels, starts), in the channels' units. ``span`` of the
    stretches [s], (starts,).
    """

    drift: FloatArray
    drift_noise: FloatArray
    head: FloatArray
    head_noise: FloatArray
    span: FloatArray

    def worst(self, tolerance: FloatArray) -> FloatArray:
        """Largest of drift and head difference over tolerance where noise does not explain it, else 0: (channels,
        starts)."""
        drift = np.where(np.abs(self.drift) > self.drift_noise, np.abs(self.drift), 0.0)
        head = np.where(np.abs(self.head) > self.head_noise, np.abs(self.head), 0.0)
        return np.maximum(drift, head) / tolerance[:, None]

    def goes_on(self, k: int, tolerance: FloatArray) -> FloatArray:
        """Drift over stretch k if it continues as in a stretch twice as long, over tolerance; 0 where stretch k shows
        it to be over.

        For use where noise hides a drift of the tolerance in stretch k: a drift that was seen before is not over by
        being hidden.
        """
        longer = np.nonzero(self.span[:k] >= 2.0 * self.span[k])[0]
        j = int(longer[-1]) if len(longer) else max(k - 1, 0)
        expected = self.drift[:, j] * self.span[k] / self.span[j]
        hidden = (self.drift_noise[:, k] > tolerance) & (np.abs(self.drift[:, k] - expected) < self.drift_noise[:, k])
        return np.where(hidden & (np.abs(self.drift[:, j]) > self.drift_noise[:, j]), np.abs(expected) / tolerance, 0.0)


def trends(t: FloatArray, x: FloatArray, starts: IntArray, head: float) -> Trends:
    """Drift of the stretches t[k:] for every start k.

    Parameters: t times, shape (n,); x channels, shape (channels, n); starts indices with at least three samples behind
    each, shape (m,); head length of the stretch's beginning that must agree with its rest [s].
    The noise is that of the last half about its own straight line, with the correlation of neighbours put in as
    (1+r)/(1-r): the same for every start, so that a transient cannot hide behind the scatter it makes.
    """
    n = len(t)
    use = (np.arange(n)[None, :] >= starts[:, None]).astype(float)
    count = use.sum(axis=1)
    tc = (t[None, :] - (use @ t / count)[:, None]) * use
    spread = np.sum(tc * tc, axis=1)
    slope = (x @ tc.T) / spread
    span = (t[-1] - t[starts]) * count / (count - 1.0)
    variance, freedom = _noise(t, x, n - max(n // 2, min(n, 12)))
    limit = TREND_SIGNIFICANCE * (1.0 + 2.0 / freedom)
    first = np.minimum(np.searchsorted(t, t[starts] + np.maximum(head, 0.1 * (t[-1] - t[starts])), side="right"), n - 1)
    first = np.maximum(first, starts + 1)
    sums = np.concatenate([np.zeros((len(x), 1)), np.cumsum(x, axis=1)], axis=1)
    heads, rests = first - starts, n - first
    difference = (sums[:, first] - sums[:, starts]) / heads - (sums[:, n : n + 1] - sums[:, first]) / rests
    return Trends(
        drift=slope * span,
        drift_noise=limit * np.sqrt(variance[:, None] / spread) * span,
        head=difference,
        head_noise=limit * np.sqrt(variance[:, None] * (1.0 / heads + 1.0 / rests)),
        span=span,
    )


def _noise(t: FloatArray, x: FloatArray, begin: int) -> tuple[FloatArray, float]:
    """Long-run variance of each channel behind `begin`, about a straight line; and its degrees of freedom."""
    tb, xb = t[begin:], x[:, begin:]
    n = len(tb)
    tc = tb - tb.mean()
    r = xb - xb.mean(axis=1, keepdims=True)
    r = r - ((r @ tc) / (tc @ tc))[:, None] * tc
    squares = np.sum(r * r, axis=1)
    rho = np.sum(r[:, 1:] * r[:, :-1], axis=1) / np.where(squares > 0.0, squares, 1.0)
    rho = np.clip(rho + (1.0 + 4.0 * rho) / n, 0.0, LARGEST_CORRELATION)
    freedom = max(n - 2.0, 1.0)
    return squares / freedom * (1.0 + rho) / (1.0 - rho), freedom


def converter_step(x: FloatArray, per_bin: float = 1.0) -> float:
    """Step of the converter behind a signal, 0 where none shows: the common measure of its values.

    Parameters: x bin means, shape (n,); per_bin raw samples in each.
    Values that are held for six bins are levels of the converter for any bin; where too few are held, means of
    a fixed number of samples still have a common measure, the step over that number. Without quantisation there is none
    (or it is that of a few set speeds, which are too coarse to be a converter's levels). With noise on bins of varying
    count none shows: none is needed.
    """
    x = x[np.isfinite(x)]
    if len(x) <= HELD or float(np.ptp(x)) == 0.0:
        return 0.0
    changes = np.concatenate([[0], np.cumsum(np.diff(x) != 0.0)])
    constant = x[: len(x) - HELD + 1][changes[HELD - 1 :] == changes[: len(x) - HELD + 1]]
    count = max(round(per_bin), 1)
    return _common_measure(constant, float(np.ptp(x))) or count * _common_measure(x, float(np.ptp(x)) / count)


def _common_measure(x: FloatArray, range_: float) -> float:
    """Largest step on whose multiples nine in ten of the values lie, 0 where there is none; range_ over which they
    could lie."""
    levels, count = np.unique(x, return_counts=True)
    first = np.nonzero(np.diff(levels, prepend=-np.inf) > SAME_LEVEL * range_)[0]
    if len(first) < FEWEST_LEVELS:
        return 0.0
    levels, count = levels[first], np.add.reduceat(count, first)
    gaps = np.sort(np.diff(levels))[:MOST_GAPS]
    steps = np.unique(np.concatenate([gaps, gaps / 2.0, gaps / 3.0]))
    steps = steps[(steps > FINEST * range_) & (steps * LEAST_LEVELS <= range_)]
    if len(steps) == 0:
        return 0.0
    most = int(np.argmax(count))
    origin = levels[most]
    count = np.where(np.arange(len(count)) == most, 0, count)  # standstill, which is on every lattice
    some = slice(None, None, -(-len(levels) // MOST_LEVELS))
    at = (levels[None, some] - origin) / steps[:, None]
    fits = (np.abs(at - np.round(at)) < OFF_LEVEL) @ count[some] >= MOST_HELD * count[some].sum()
    return float(steps[fits].max(initial=0.0))
