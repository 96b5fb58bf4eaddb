"""Intervals for numbers from series whose samples are not independent: blocks of the series are drawn again, never
across a border.

    interval(lambda x: x.mean(), [first_part, second_part], at_least=120)

Parts are unbroken stretches of one series, each (n,) or (n, m), evenly spaced; blocks are drawn from all of them, each
part closed to a ring. A statistic of sums (a mean, a regression) may get rows that are sums over a second each, which
keeps the draws quick.
Source: Politis and Romano 1992 (circular blocks); block length by Politis and White 2004, corrected by Patton, Politis
and White 2009.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import NORMAL_95, Estimate, t_factor
from stillhook.statistics.time_lag import dot

Statistic = Callable[[FloatArray], float]

DRAWS = 1000
SEED = 20201101
FEWEST = 3.0
"""Blocks that the data must hold at least: beyond that the block is shortened, since two blocks do not show how
blocks differ."""

COPY_LENGTH = 20
"""Length of a block from which it is quicker to copy it than to count out its samples."""


@dataclass(frozen=True)
class Blocks:
    """length of a block [samples]; samples in all parts; effective: number of independent samples with the same
    information on the mean."""

    length: int
    samples: int
    effective: float


def blocks(parts: Sequence[FloatArray], *, at_least: int = 1) -> Blocks:
    """Length of the blocks for these parts, from the memory of the series; at_least [samples], such as two
    windows."""
    rows = [np.asarray(p, dtype=np.float64).reshape(len(p), -1) for p in parts]
    n = sum(map(len, rows))
    if n < 2:
        return Blocks(max(n, 1), n, float(n))
    memories = [_memory([r[:, k] for r in rows], n) for k in range(rows[0].shape[1])]
    length = max(at_least, *(math.ceil(b) for b, _ in memories))
    return Blocks(max(1, min(length, int(n / FEWEST))), n, min(e for _, e in memories))


def interval(
    statistic: Statistic,
    parts: Sequence[FloatArray],
    *,
    at_least: int = 1,
    draws: int = DRAWS,
    seed: int = SEED,
    bounds: tuple[float, float] = (-math.inf, math.inf),
) -> Estimate:
    """The statistic of all parts together and its 95 % interval.

    Percentiles of the draws, stretched about the value for the few blocks that there are: by sqrt(1 / (1 - block/n))
    for what closed rings leave out of the variance, and by Student's t over the normal quantile with n/block - 1
    degrees of freedom. bounds: values that the statistic cannot exceed (0 and 1 for a share).
    """
    rows = [np.asarray(p, dtype=np.float64) for p in parts if len(p)]
    if not rows:
        return Estimate(math.nan)
    joined = np.concatenate(rows)
    value = float(statistic(joined))
    b = blocks(rows, at_least=at_least)
    if b.samples < 2 or not math.isfinite(value):
        return Estimate(value, n=b.effective)
    sampled = np.array([statistic(x) for x in _draws(rows, b.length, draws, seed)], dtype=np.float64)
    ends = Estimate.of_draws(value, sampled)
    low, high = value + _stretch(b) * (np.array([min(ends.low, value), max(ends.high, value)]) - value)
    return Estimate(value, max(float(low), bounds[0]), min(float(high), bounds[1]), b.effective)


def _draws(rows: Sequence[FloatArray], length: int, draws: int, seed: int) -> Iterator[FloatArray]:
    """Samples of each draw: as many blocks as the data hold, so about as many samples. A part shorter than a block is
    one, and is drawn the more often for it, so that every sample is as likely as any other. Long blocks are copied
    whole, which is what takes the time.
    """
    rng = np.random.default_rng(seed)
    sizes = np.array([len(r) for r in rows])
    first = np.concatenate(([0], np.cumsum(sizes)[:-1]))
    reach = np.minimum(length, sizes)
    chance = np.cumsum(sizes / reach) / np.sum(sizes / reach)
    count = max(1, round(float(np.sum(sizes / reach))))
    rings = [np.concatenate([r, r[:n]]) for r, n in zip(rows, reach, strict=True)]
    ring, begin = np.concatenate(rings), first + np.concatenate(([0], np.cumsum(reach)[:-1]))
    for _ in range(draws):
        part = np.minimum(np.searchsorted(chance, rng.random(count), side="right"), len(sizes) - 1)
        starts = begin[part] + np.floor(rng.random(len(part)) * sizes[part]).astype(np.intp)
        long = reach[part]
        if length >= COPY_LENGTH:
            yield np.concatenate([ring[i : i + n] for i, n in zip(starts.tolist(), long.tolist(), strict=True)])
        else:
            yield ring[np.repeat(starts - np.cumsum(long) + long, long) + np.arange(int(long.sum()))]


def _stretch(b: Blocks) -> float:
    count = b.samples / b.length
    return math.sqrt(1.0 / (1.0 - 1.0 / count)) * t_factor(count - 1.0) / NORMAL_95 if count > 1.0 else math.inf


def _memory(columns: Sequence[FloatArray], n: int) -> tuple[float, float]:
    """Optimal length of circular blocks [samples] and effective number of samples, from the autocovariance over all
    parts."""
    R = _autocovariance(columns, n)
    if not R[0] > 0.0:
        return 1.0, float(n)
    rho = R / R[0]
    quiet = 2.0 * math.sqrt(math.log10(n) / n)
    run = max(5, math.ceil(math.sqrt(math.log10(n))))
    small = np.abs(rho[1:]) < quiet
    runs = np.convolve(small, np.ones(run), "valid") >= run if len(small) >= run else np.zeros(0, dtype=bool)
    m = int(np.argmax(runs)) if runs.any() else len(small)
    M = min(max(2 * m, 1), len(R) - 1)
    k = np.arange(1, M + 1)
    weight = np.minimum(1.0, 2.0 * (1.0 - k / M)) if M > 1 else np.zeros(1)
    g_0 = R[0] + 2.0 * dot(weight, R[1 : M + 1])
    G = 2.0 * dot(weight, k * R[1 : M + 1])
    if g_0 <= 0.0:
        return 1.0, float(n)
    length = (2.0 * G * G / (4.0 / 3.0 * g_0 * g_0)) ** (1.0 / 3.0) * n ** (1.0 / 3.0)
    return max(length, 1.0), float(min(n, max(1.0, n * R[0] / g_0)))


def _autocovariance(columns: Sequence[FloatArray], n: int) -> FloatArray:
    """Autocovariance up to a third of the longest part, over pairs within a part only."""
    mean = sum(float(c.sum()) for c in columns) / n
    lags = max(1, max(map(len, columns)) // 3)
    R = np.zeros(lags + 1)
    for c in columns:
        size = 1 << (2 * len(c) - 1).bit_length()
        f = np.fft.rfft(c - mean, size)
        r = np.fft.irfft(f * np.conj(f), size)[: min(lags + 1, len(c))]
        R[: len(r)] += r
    return R / n
