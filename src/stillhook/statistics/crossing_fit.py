r"""Heights at which seeds of a sea cross a limit, from runs that say yes or no.

The phases of a seed are the same at every height, so a seed has a height H* at which its number crosses the limit. It
follows a feature F of the same waves that needs no run, such as the largest tip speed in the linear sea:

.. math:: \ln H^* = \mu_c - \ln f + s\,\varepsilon,\qquad P(\text{beyond at } H) = \Phi\big((\ln F - \mu_c)/s\big)

with f the feature for each metre of height, F = f H that of the height that was run, and one offset mu_c for each
column (period and heading). Offsets are one smooth field (`stillhook.statistics.smooth_field`). The limit that a share
p of the seeds may pass is read from the features of very many seeds, which are linear and cost nothing:

.. math:: \frac{1}{J} \sum_j \Phi\big((\ln H + \ln f_j - \mu_c)/s\big) = p

Nothing is assumed on how the number grows with the height, or how it is distributed: it may have two peaks. A feature
that says little makes s large and the interval wide, and the limit no worse. Validity: a seed crosses once. Where
friction makes a number level off, seeds of a column scatter more than those of others: s is the column's own part of a
common one, as far as its runs show (`widths`). Expectation propagation was not needed: the posterior of an offset is
near normal (Laplace).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import scipy

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.statistics.smooth_field import covariances

SCALES = (0.03, 0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 1.0, 2.0)
"""Standard deviations s of ln H* about its feature, all of which count by their likelihood; the largest stand for
numbers that hardly grow with the height, as friction makes them."""
AMPLITUDES, OWN, OF_PERIOD, OF_ANGLE = (0.05, 0.15, 0.4), (0.03, 0.1, 0.25), (0.15, 0.5), (0.2, 1.0)
"""As in `stillhook.statistics.smooth_field`, a coarser grid: each combination is fitted for every scale."""
STEPS, SETTLED = 30, 1e-4
"""Steps of Newton at the most, and the change of an offset or a limit below which it goes no further."""
DRAWS, SEED = 200, 1866
FARTHEST = 8.0
"""Largest distance of a run from its offset, in s: beyond it one run decides nothing more."""
SHARE_SCALES = np.geomspace(0.03, 8.0, 26)
"""Standard deviations s of ln of the height at which a run crosses."""
SHARE_BESIDE, SHARE_STEP = 1.5, 0.02
"""How far below the lowest and above the highest height mu may lie, and its step, in ln of the height."""
SHARE_ENDS = (0.5, 0.025, 0.975)


@dataclass(frozen=True, eq=False)
class Crossings:
    """Runs: column (n,) its number; ln_F (n,) ln of its feature; beyond (n,) whether it passed the limit."""

    column: IntArray = field(repr=False)
    ln_F: FloatArray = field(repr=False)
    beyond: BoolArray = field(repr=False)

    def of_column(self, columns: int) -> FloatArray:
        """1 where a run is of a column, else 0 (n, columns)."""
        return np.asarray(self.column[:, None] == np.arange(columns), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Limit:
    """ln of limiting heights (c,), ends of their 95 % intervals, and draws (m, c)."""

    value: FloatArray = field(repr=False)
    low: FloatArray = field(repr=False)
    high: FloatArray = field(repr=False)
    draws: FloatArray = field(repr=False)


@dataclass(frozen=True, eq=False)
class CrossingFit:
    """Offsets of all columns as a mixture: weight (k,) of a combination, its offsets (k, c) and their covariance (k, c,
    c), and its scale (k,); parts (c, q): chance that a column's own scale is so many times that (`PARTS`);
    evidence: ln of the marginal likelihood, to compare features."""

    weight: FloatArray = field(repr=False)
    offset: FloatArray = field(repr=False)
    cov: FloatArray = field(repr=False)
    scale: FloatArray = field(repr=False)
    parts: FloatArray = field(repr=False)
    evidence: float

    @property
    def offsets(self) -> FloatArray:
        """Offsets (c,), the mean of all combinations."""
        return np.asarray(self.weight @ self.offset)

    def limits(self, ln_f: FloatArray, p: FloatArray, *, draws: int = DRAWS, seed: int = SEED) -> Limit:
        """Heights that a share p (c,) of the seeds pass; ln_f (c, J) features of many seeds for each metre of
        height."""
        rng = np.random.default_rng(seed)
        chosen = rng.choice(len(self.weight), size=draws, p=self.weight)
        c = self.offset.shape[1]
        part = np.array([rng.choice(PARTS, size=draws, p=each) for each in self.parts]).T
        scale = self.scale[chosen][:, None] * part
        at, table = _shifts(ln_f, p, float(scale.min()), float(scale.max()))
        shift, error = (np.array([np.interp(scale[:, i], at, each[:, i]) for i in range(c)]).T for each in table)
        z = rng.standard_normal((2, draws, c))
        out = self.offset[chosen] + shift + error * z[1]
        wider = part / self.width
        for k in np.unique(chosen):
            rows = chosen == k
            values, vectors = np.linalg.eigh(0.5 * (self.cov[k] + self.cov[k].T))
            root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
            out[rows] += wider[rows] * (z[0, rows] @ root.T)
        low, value, high = np.quantile(out, (0.025, 0.5, 0.975), axis=0)
        return Limit(value, low, high, out)

    @property
    def width(self) -> FloatArray:
        """Scale of each column over the common one (c,), the mean of its ln."""
        return np.asarray(np.exp(self.parts @ np.log(PARTS)))


STEPS_OF_SCALE = 12
"""Scales between which a limit is interpolated."""
PARTS = np.geomspace(0.3, 6.0, 11)
"""Parts of the common scale that a column may have."""
SPREAD_OF_PARTS, BESIDE, PLACES, ROUNDS = 0.5, 0.25, 15, 2
"""Standard deviation of ln of them between columns (assumed); that of a column's offset about the common fit in ln of
the height, in addition to half of its scale; number of places at which it is tried, and of rounds."""
ALIKE = np.where(np.arange(len(PARTS)) == np.abs(np.log(PARTS)).argmin(), 1.0, 0.0)
"""Chances of parts of a column like all."""
FINE = (SCALES, AMPLITUDES, OWN, OF_PERIOD, OF_ANGLE)
COARSE = ((0.08, 0.15, 0.3, 0.8), (0.15, 0.4), (0.1,), (0.3,), (0.5,))
"""Scales and grid of a fit, and of a coarse one for placing runs."""


def fit_crossings(
    runs: Crossings,
    period: FloatArray,
    angle: FloatArray,
    expected: FloatArray | None = None,
    *,
    coarse: bool = False,
    alike: bool = False,
) -> CrossingFit:
    """Offsets of columns of a period [s] and an angle [rad] (c,), with runs or without; expected (c,): offsets that a
    cheaper method predicts, about which the field is smooth but for a factor (None: none); coarse: by few combinations,
    which is enough to place runs; alike: with one scale in all columns, which is enough to compare features.

    Errors: ValueError without any run.
    """
    if not len(runs.ln_F):
        raise ValueError("no run: a field of offsets needs one.")
    flat = np.zeros(len(period))
    bases = [flat] if expected is None or not np.isfinite(expected).all() else [np.asarray(expected, float), flat]
    result = _mixture(runs, period, angle, bases[:1], np.tile(ALIKE, (len(period), 1)), *COARSE)
    if alike:
        return result
    for _ in range(ROUNDS):
        parts = own_parts(runs, result)
        result = _mixture(runs, period, angle, bases[:1], parts, *COARSE)
    return result if coarse else _mixture(runs, period, angle, bases, parts, *FINE)


def _mixture(
    runs: Crossings,
    period: FloatArray,
    angle: FloatArray,
    bases: Sequence[FloatArray],
    parts: FloatArray,
    scales: Sequence[float],
    *grid: Sequence[float],
) -> CrossingFit:
    """Every combination of a scale, a grid of the field and a base about which it is smooth."""
    K, width = covariances(period, angle, np.ones(len(period)), *grid), np.exp(parts @ np.log(PARTS))
    starts = np.array([base + float(np.mean(runs.ln_F - base[runs.column])) for base in bases])
    scale = np.repeat(scales, len(bases) * len(K))
    base, cov = (
        np.tile(np.repeat(starts, len(K), axis=0), (len(scales), 1)),
        np.tile(K, (len(scales) * len(bases), 1, 1)),
    )
    offset, left, ln_weight = _laplace(runs, base, cov, scale[:, None] * width)
    weight = np.exp(ln_weight - ln_weight.max())
    evidence = float(ln_weight.max() + math.log(weight.mean()))
    return CrossingFit(weight / weight.sum(), offset, left, scale, parts, evidence)


def own_parts(runs: Crossings, fit: CrossingFit) -> FloatArray:
    """Chances (c, q) of the parts of the common scale that each column may have, by its own runs."""
    s = float(np.exp(fit.weight @ np.log(fit.scale)))
    z = np.linspace(-2.5, 2.5, PLACES)
    ln_prior = -0.5 * (np.log(PARTS) / SPREAD_OF_PARTS) ** 2
    result = np.tile(ALIKE, (len(fit.parts), 1))
    for i in np.unique(runs.column):
        own = runs.column == i
        sign = np.where(runs.beyond[own], 1.0, -1.0)
        mu = fit.offsets[i] + z[:, None] * (BESIDE + 0.5 * PARTS * s)
        at = (runs.ln_F[own, None, None] - mu) / (PARTS * s)
        ln_L = _ln_ndtr(np.clip(sign[:, None, None] * at, -FARTHEST, FARTHEST)).sum(axis=0)
        ln_L += -0.5 * z[:, None] ** 2 + ln_prior
        weight = np.exp(ln_L - ln_L.max()).sum(axis=0)
        result[i] = weight / weight.sum()
    return result


def _laplace(
    runs: Crossings, base: FloatArray, K: FloatArray, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mode of the offsets (g, c), their covariance (g, c, c) and ln of the marginal likelihood (g,) about every base
    (g, c) under its prior covariance K (g, c, c) and scales s (g, c), by Newton's method (Rasmussen and Williams 2006,
    algorithm 3.1)."""
    of_column, sign = runs.of_column(base.shape[1]), np.where(runs.beyond, 1.0, -1.0)
    sign_ln_F = sign * runs.ln_F

    def likelihood(offset: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gradient and negative second derivative in the offsets (g, c), and ln of the likelihood (g,)."""
        z = np.clip((sign_ln_F - sign * offset[:, runs.column]) / s[:, runs.column], -FARTHEST, FARTHEST)
        ln_P = _ln_ndtr(z)
        ratio = np.exp(-0.5 * z**2 - ln_P) / math.sqrt(2.0 * math.pi)
        gradient = -((sign * ratio) @ of_column) / s
        return gradient, np.maximum(((ratio * (z + ratio)) @ of_column) / s**2, 1e-12), ln_P.sum(axis=1)

    f, a = np.zeros(base.shape), np.zeros(base.shape)
    eye, live = np.eye(base.shape[1]), np.arange(len(base))
    for _ in range(STEPS):
        of, before = K[live], f[live]
        gradient, W, _ = likelihood(base[live] + before, s[live])
        root = np.sqrt(W)
        b = W * before + gradient
        B = eye + root[:, :, None] * of * root[:, None, :]
        a[live] = b - root * np.linalg.solve(B, root[..., None] * (of @ b[..., None]))[..., 0]
        f[live] = (of @ a[live][..., None])[..., 0]
        live = live[np.abs(f[live] - before).max(axis=1) >= SETTLED]
        if not len(live):
            break
    _, W, ln_lik = likelihood(base + f, s)
    root = np.sqrt(W)
    B = eye + root[:, :, None] * K * root[:, None, :]
    inside = root[:, :, None] * K
    cov = K - np.swapaxes(inside, 1, 2) @ np.linalg.solve(B, inside)
    ln_det = np.linalg.slogdet(B)[1]
    return base + f, cov, ln_lik - 0.5 * np.sum(a * f, axis=1) - 0.5 * ln_det


def _ln_ndtr(z: FloatArray) -> FloatArray:
    """ln of the normal distribution function within `FARTHEST`."""
    return np.asarray(np.log(scipy.special.ndtr(z)))


def _shifts(
    ln_f: FloatArray, p: FloatArray, least: float, most: float
) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """Scales (k,) from the least to the most; and for each of them ln of the height over its offset (k, c) at which a
    share p of the seeds is beyond, and its standard deviation for the number of seeds."""
    scales = np.geomspace(least, most, STEPS_OF_SCALE) if least < most else np.array([least])
    x, result = -np.quantile(ln_f, 0.5, axis=1), []
    for s in scales[::-1]:  # from the largest on, where the share is near to normal
        x, density = _shift(ln_f, p, float(s), x)
        result.append((x, np.sqrt(p * (1.0 - p) / ln_f.shape[1]) / np.maximum(density, 1e-6)))
    shift, error = (np.array(rows[::-1]) for rows in zip(*result, strict=True))
    return scales, (shift, error)


def _shift(ln_f: FloatArray, p: FloatArray, s: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ln of the height over its offset (c,) at which a share p of the seeds of ln_f (c, J) is beyond, and how the share
    grows there; sought from x (c,) on by Newton's method on the normal scale, and halving where that would leave the
    span."""
    low, high = -ln_f.max(axis=1) - 6.0 * s, -ln_f.min(axis=1) + 6.0 * s
    x, wanted = np.clip(x, low, high), scipy.special.ndtri(p)
    for _ in range(STEPS):
        z = (x[:, None] + ln_f) / s
        share = scipy.special.ndtr(z).mean(axis=1)
        density = np.exp(-0.5 * z**2).mean(axis=1) / (s * math.sqrt(2.0 * math.pi))
        low, high = np.where(share > p, low, x), np.where(share > p, x, high)
        at = scipy.special.ndtri(np.clip(share, 1e-15, 1.0 - 1e-15))
        rise = density * math.sqrt(2.0 * math.pi) * np.exp(0.5 * at**2)
        new = x + np.divide(wanted - at, rise, out=np.full(x.shape, np.inf), where=rise > 0.0)
        new = np.where((new > low) & (new < high), new, 0.5 * (low + high))
        change, x = float(np.abs(new - x).max()), new
        if change < SETTLED:
            break
    return x, density


def share_crossing(H: FloatArray, n: IntArray, beyond: IntArray, p: float) -> FloatArray:
    r"""Height that a share p (0..1) of runs passes and ends of its 95 % interval (3,) [unit of H], of heights H (k,)
    above 0 with n runs each, of which some were beyond: by the height alone, without features.

    .. math:: P(\text{beyond at } H) = \Phi\big((\ln H - \mu)/s\big),\qquad \ln H_p = \mu + s\,\Phi^{-1}(p)

    Location and scale count by their likelihood, evenly over a grid: the posterior is exact. Validity: the share beyond
    rises with the height. Where that of all heights is near p the interval is as wide as the grid.
    """
    ladder = tuple(map(float, H))
    _, ln_beyond, ln_inside = _share_table(ladder)
    order, ln_H_p = _share_order(ladder, float(p))
    ln_L = (beyond[:, None, None] * ln_beyond + (n - beyond)[:, None, None] * ln_inside).sum(axis=0)
    weight = np.exp(ln_L - ln_L.max()).ravel()
    share = np.cumsum(weight[order]) / weight.sum()
    return np.asarray(np.exp(ln_H_p[np.searchsorted(share, SHARE_ENDS)]))


@lru_cache(maxsize=8)
def _share_table(H: tuple[float, ...]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Locations mu (m,) of the grid over heights H (k,), ln of [unit of H]; ln of the chances that a run at each height
    is beyond, and that it is not (k, m, scale). Calculated once for all limits on the same heights."""
    ln_H = np.log(H)
    mu = np.arange(ln_H.min() - SHARE_BESIDE, ln_H.max() + SHARE_BESIDE, SHARE_STEP)
    z = np.clip((ln_H[:, None, None] - mu[:, None]) / SHARE_SCALES, -FARTHEST, FARTHEST)
    return mu, scipy.special.log_ndtr(z), scipy.special.log_ndtr(-z)


@lru_cache(maxsize=32)
def _share_order(H: tuple[float, ...], p: float) -> tuple[IntArray, FloatArray]:
    """Order of the grid over heights H (m * scale,) by ln of the height that a share p passes, and these, rising."""
    at = (_share_table(H)[0][:, None] + SHARE_SCALES * scipy.special.ndtri(p)).ravel()
    order = np.argsort(at)
    return order, at[order]
