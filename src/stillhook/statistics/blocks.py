"""Intervals of numbers and of regressions from series whose samples are autocorrelated, by blocks of time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.statistics.estimate import NORMAL_95, Estimate, random_effects, t_factor
from stillhook.statistics.time_lag import dot

Statistic = Callable[[FloatArray], float]

DRAWS = 1000
SEED = 20201101
FEWEST = 3.0
"""Blocks that the data must hold at least: beyond that the block is shortened, since two blocks do not show how
blocks differ."""

COPY_LENGTH = 20
"""Length of a block from which it is quicker to copy it than to count out its samples."""
TOGETHER = 100_000
"""Blocks that are drawn at once, which bounds memory; draws are the same for any value."""


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
    together = max(1, TOGETHER // count)
    for done in range(0, draws, together):
        u = rng.random((min(together, draws - done), 2, count))
        part = np.minimum(np.searchsorted(chance, u[:, 0], side="right"), len(sizes) - 1)
        starts, long = begin[part] + np.floor(u[:, 1] * sizes[part]).astype(np.intp), reach[part]
        if length >= COPY_LENGTH:
            for of_draw in zip(starts.tolist(), (starts + long).tolist(), strict=True):
                yield np.concatenate([ring[i:j] for i, j in zip(*of_draw, strict=True)])
        else:
            for i, n in zip(starts, long, strict=True):
                yield ring[np.repeat(i - np.cumsum(n) + n, n) + np.arange(int(n.sum()))]


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


FEWEST_BLOCKS = 4
"""Least number of blocks for an interval: with fewer, the t factor on a variance of two values is
meaningless."""
SAFE = 1e-10
"""Least eigenvalue of the scaled normal matrix, over the largest, from which columns count as different."""


@dataclass(frozen=True)
class Fit:
    """b (k,) coefficients; cov (k, k) their covariance from the blocks; blocks (m,) coefficients without each block; sd
    of the residuals; rows used."""

    b: FloatArray
    cov: FloatArray
    leave_out: FloatArray
    sd: float
    rows: int

    @property
    def blocks(self) -> int:
        return len(self.leave_out)

    @property
    def u(self) -> FloatArray:
        """Standard errors (k,)."""
        return np.sqrt(np.diag(self.cov))

    def half(self, i: int) -> float:
        """Half of the 95 % interval of coefficient i."""
        return t_factor(self.blocks - 1) * float(self.u[i])

    def estimate(self, i: int, offset: float = 0.0) -> Estimate:
        """Coefficient i plus an offset."""
        return Estimate.around(float(self.b[i]) + offset, self.half(i), self.blocks)

    def ratio(self, i: int, j: int) -> tuple[float, float]:
        """Coefficient i over j, and half of its 95 % interval."""
        value = self.b[i] / self.b[j]
        return float(value), t_factor(self.blocks - 1) * _jackknife(self.leave_out[:, i] / self.leave_out[:, j])


def fit(columns: Sequence[FloatArray], y: FloatArray, block: IntArray) -> Fit | None:
    """Least squares of y on the columns; rows with a NaN are left out. None where blocks or differences between columns
    are too few.

    Parameters: columns k times (n,); y (n,); block (n,) number of the block of time that a row is in. A coefficient's
    variance is that among the fits which leave out one block each, so that errors may be autocorrelated within a block
    in any way.
    """
    X = np.column_stack(columns)
    good = np.isfinite(X).all(axis=1) & np.isfinite(y)
    X, y, block = X[good], y[good], block[good]
    names, place = np.unique(block, return_inverse=True)
    m, k = len(names), X.shape[1]
    if m < FEWEST_BLOCKS or len(y) < 2 * k:
        return None
    A, c = np.zeros((m, k, k)), np.zeros((m, k))
    np.add.at(A, place, X[:, :, None] * X[:, None, :])
    np.add.at(c, place, X * y[:, None])
    return _solved(A, c, X, y)


def _solved(A: FloatArray, c: FloatArray, X: FloatArray, y: FloatArray) -> Fit | None:
    total, right = A.sum(axis=0), c.sum(axis=0)
    scale = np.sqrt(np.diag(total))
    if (scale == 0.0).any() or _singular(total, scale):
        return None
    rests = total - A
    if any(_singular(rest, scale) for rest in rests):
        return None
    b = np.linalg.solve(total / np.outer(scale, scale), right / scale) / scale
    leave_out = np.stack(
        [
            np.linalg.solve(r / np.outer(scale, scale), (right - ci) / scale) / scale
            for r, ci in zip(rests, c, strict=True)
        ]
    )
    m, apart = len(A), leave_out - leave_out.mean(axis=0)
    residual = y - np.sum(X * b, axis=1)
    sd = math.sqrt(dot(residual, residual) / max(1, len(y) - len(b)))
    return Fit(b, (m - 1) / m * apart.T @ apart, leave_out, sd, len(y))


def _singular(A: FloatArray, scale: FloatArray) -> bool:
    values = np.linalg.eigvalsh(A / np.outer(scale, scale))
    return bool(values[0] <= SAFE * values[-1])


def _jackknife(values: FloatArray) -> float:
    m = len(values)
    return math.sqrt((m - 1) / m * float(np.sum((values - values.mean()) ** 2)))


def pooled(estimates: Sequence[Estimate]) -> Estimate:
    """The mean of one quantity over tests, each with its own true value about it: the scatter between the tests is in
    its interval (`stillhook.statistics.estimate`), and the largest structural error of them stays."""
    if len(estimates) == 1:
        return estimates[0]
    value, half = random_effects([e.value for e in estimates], [e.half for e in estimates])
    structural = max(e.structural for e in estimates)
    return Estimate.around(value, max(half, structural), sum(e.n for e in estimates), structural)


def one_number(estimates: Sequence[Estimate]) -> Estimate:
    """The mean of several readings of one and the same number, weighted by their intervals, which grow where the
    readings differ by more than they allow.

    Source: the ratio of Birge 1932, as for physical constants.
    """
    half, value = np.array([e.half for e in estimates]), np.array([e.value for e in estimates])
    if len(estimates) == 1:
        return estimates[0]
    w = 1.0 / np.maximum(half, 1e-12) ** 2
    mean = dot(w, value) / float(w.sum())
    spread = math.sqrt(dot(w, (value - mean) ** 2) * NORMAL_95**2 / (len(estimates) - 1))
    return Estimate.around(mean, max(1.0, spread) / math.sqrt(float(w.sum())), sum(e.n for e in estimates))
