r"""Level that a number stays below with some probability, over the height of the sea, from runs of many columns.

A column is one sea of given period and direction in which runs of several heights were made. What waves add to the
number grows as a power of the height there, and scatters in proportion to itself:

.. math:: y = \ln(x - x_0) = a_c + p_c \ln\frac{H}{H_c} + s_c z

with x_0 the number in a calm, and z of one distribution in all columns. So the few runs of a column give its location
and scale alone; runs of all columns together give the shape of the scatter, and with it the upper quantiles, which
extremes need. Slopes p_c and scales s_c of the columns are drawn towards their common mean by as much as their sampling
errors say (random effects).

Growth may change with the height: an error that friction makes levels off, and grows again where a winch saturates. How
much the exponent changes for each unit of ln of the height is of every column's own about a mean of all columns; cells
close together say little of it, which is then in the interval.

A number at the end of what there is, such as the loss of tension in slack slings, is known to be at least that: it
counts as censored. Validity: heights within a factor of about 1.5 of H_c, and a number that rises with the height.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.statistics.estimate import NORMAL_95, t_factor
from stillhook.statistics.extremes import extremal_index

STEPS, SETTLED = 25, 1e-4
"""Steps of the iteration between expected values of censored numbers and the parameters, at the most; and the change of
these values, over the scale, from which on it goes no further."""
LEAST_SCALE = 1e-6
LEAST_LEFT = 0.2
"""Least part of the variance of numbers that is taken to be left about a location fitted to them."""
SLOPES = (0.05, 6.0)
"""Exponents of growth that are possible: motions grow with the height, drag with its square, shares of time beyond a
threshold faster; the error of a winch that reverses its friction hardly grows."""
SLOPE, SLOPE_SD = 1.3, 0.8
"""Mean and standard deviation of the exponent of a largest value before any run is known."""
BETWEEN = 0.3
"""Standard deviation of the exponents of columns about their mean, over that of what the mean may be. Cells a tenth
apart say nothing of it: taken from them alone it was up to 0.9; one limit in a thousand was then off by a factor of
ten, and intervals of all columns of its plan had no ends."""
OF_SHARE, OF_SHARE_SD = 3.0, 1.5
"""The same of a share of time."""
BEND_SD = 1.0
"""Standard deviation of the change of the exponent for each unit of ln of the height, of a column about the mean of all
and of that mean: a number that levels off as 1 - exp(-(H/b)^1.6) has -0.9 at 0.8 to 0.95 of its plateau."""
BEND_REACH = 0.5
"""Distance in ln of the height up to which growth changes; beyond it continues as it is there."""
FEWEST_IN_TAIL = 40
"""Numbers about a quantile that its value is read from."""
WINDOW = 0.35
"""Half width of the part of the distribution that a quantile is read from, in ln(-ln S), S the share above."""
CLIP = 4.0
"""Standard deviations at which numbers are clipped for skewness, kurtosis and likeness of the parts of a run."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Runs of all columns.

    column (n,) number of the column; h (n,) ln of the height over the column's H_c; y (n, k) ln of what waves add, for
    k parts of a run of equal length, -inf where they add nothing; censored (n, k) where it is y or more; weight (n,) of
    a run.
    """

    column: IntArray = field(repr=False)
    h: FloatArray = field(repr=False)
    y: FloatArray = field(repr=False)
    censored: BoolArray = field(repr=False)
    weight: FloatArray = field(repr=False)


@dataclass(frozen=True, eq=False)
class LevelFit:
    """ln of the level in every column over o = h - `center`: level + slope o + bend (o^2 - lean o - width) / 2, each
    (c,), where lean and width make the parts of it independent of each other.

    var, var_slope, var_bend: variances of the column's own level, slope and bend; common: variance of the part of the
    level that all columns share.
    """

    level: FloatArray = field(repr=False)
    slope: FloatArray = field(repr=False)
    bend: FloatArray = field(repr=False)
    center: FloatArray = field(repr=False)
    lean: FloatArray = field(repr=False)
    width: FloatArray = field(repr=False)
    var: FloatArray = field(repr=False)
    var_slope: FloatArray = field(repr=False)
    var_bend: FloatArray = field(repr=False)
    common: float = 0.0

    def at(self, column: IntArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
        """ln of the level at places (n,), and its variance."""
        of = _of_columns(self, column).around(h)
        return of.level, of.var + of.common

    def around(self, h: FloatArray) -> Around:
        """The level about a place of every column (c,)."""
        level, slope = self._at_center
        off = h - self.center
        near = np.clip(off, -BEND_REACH, BEND_REACH)
        bent = 0.5 * (near**2 - self.lean * near - self.width)
        return Around(
            h,
            level + risen(slope, self.bend, off),
            np.clip(slope + self.bend * near, *SLOPES),
            self.bend,
            self.var + off**2 * self.var_slope + bent**2 * self.var_bend,
            self.var_slope + (near - 0.5 * self.lean) ** 2 * self.var_bend,
            self.var_bend,
            self.common,
        )

    def crossing(self, y: FloatArray) -> Around:
        """The level about where its ln is y (c,)."""
        level, slope = self._at_center
        return self.around(self.center + climbed(slope, self.bend, y - level))

    def among(self, places: IntArray, columns: int) -> LevelFit:
        """The same where its columns are those at some places of more: NaN in the others."""
        return LevelFit(*(_spread(x, places, columns) for x in vars(self).values()))

    @property
    def _at_center(self) -> tuple[FloatArray, FloatArray]:
        """ln of the level at the center, and its slope there."""
        return self.level - 0.5 * self.bend * self.width, np.clip(self.slope - 0.5 * self.bend * self.lean, *SLOPES)


@dataclass(frozen=True, eq=False)
class Around:
    """ln of the level about h in columns (c,): level, slope and bend there, and their variances; common: variance of
    the part of the level that all columns share."""

    h: FloatArray = field(repr=False)
    level: FloatArray = field(repr=False)
    slope: FloatArray = field(repr=False)
    bend: FloatArray = field(repr=False)
    var: FloatArray = field(repr=False)
    var_slope: FloatArray = field(repr=False)
    var_bend: FloatArray = field(repr=False)
    common: float = 0.0

    def __getitem__(self, columns: BoolArray) -> Around:
        """That of some columns."""
        return _of_columns(self, columns)


Columns = TypeVar("Columns", LevelFit, Around)


def _of_columns(record: Columns, columns: BoolArray | IntArray) -> Columns:
    """A record of columns with some of them alone."""
    parts: list[Any] = [x[columns] if isinstance(x, np.ndarray) else x for x in vars(record).values()]
    return type(record)(*parts)


def _spread(x: Any, places: IntArray, columns: int) -> Any:
    if not isinstance(x, np.ndarray):
        return x
    wide = np.full(columns, np.nan)
    wide[places] = x
    return wide


def risen(slope: FloatArray, bend: FloatArray, off: FloatArray) -> FloatArray:
    """How much a level of this slope and bend rises over a distance off, all of one shape. It never falls: where growth
    would end it continues with the least of `SLOPES`."""
    low, high = _bends_within(slope, bend)
    x = np.clip(off, low, high)
    return np.asarray(slope * x + 0.5 * bend * x**2 + np.maximum(slope + bend * x, SLOPES[0]) * (off - x))


def climbed(slope: FloatArray, bend: FloatArray, rise: FloatArray) -> FloatArray:
    """The distance over which a level rises so much: the inverse of `risen`."""
    low, high = _bends_within(slope, bend)
    bottom, top = (slope * x + 0.5 * bend * x**2 for x in (low, high))
    within = np.clip(rise, bottom, top)
    root = np.sqrt(np.maximum(slope**2 + 2.0 * bend * within, 0.0))
    x = np.clip(2.0 * within / np.maximum(slope + root, SLOPES[0]), low, high)
    return np.asarray(x + (rise - within) / np.maximum(slope + bend * x, SLOPES[0]))


def _bends_within(slope: FloatArray, bend: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances below and above between which a level bends."""
    spare = np.maximum(slope - SLOPES[0], 0.0)
    ends = np.divide(spare, np.abs(bend), out=np.full(np.shape(bend), BEND_REACH), where=np.abs(bend) > 1e-9)
    ends = np.minimum(ends, BEND_REACH)
    return np.where(bend > 0.0, -ends, -BEND_REACH), np.where(bend < 0.0, ends, BEND_REACH)


def fit_levels(samples: Samples, q: FloatArray, likeness: FloatArray | None = None) -> LevelFit:
    """Level that a part of a run would stay below with probability q (c,) if parts were independent, for every column,
    which has a run in which waves add something. How far they are not is seen in the runs, and taken into account
    (extremal index).

    likeness (c, c): weight of each column's runs in the shape and the usual scale of another's scatter (None: all
    alike).
    """
    columns, k = len(q), samples.y.shape[1]
    near = np.ones((columns, columns)) if likeness is None else likeness
    w, h = (np.repeat(x, k) for x in (samples.weight, samples.h))
    c = np.repeat(samples.column, k)
    y, over = samples.y.ravel(), samples.censored.ravel()
    under = ~np.isfinite(y)
    least = np.full(columns, np.inf)
    np.minimum.at(least, c, np.where(under, np.inf, y))
    y = np.where(under, least[c], y)
    a, p, bend, s, center, lean, width = _location_scale(c, h, y, under, over, w, near)
    off = h - center[c]
    line = a[c] + p.value[c] * off + 0.5 * bend.value[c] * (off**2 - lean[c] * off - width[c])
    z = (y - line) / (s.value[c] * _left_over(c, w, columns))
    order = np.argsort(z, kind="stable")
    shapes: dict[bytes, tuple[_Shape, float, float]] = {}
    quantiles: dict[tuple[bytes, float], tuple[float, float]] = {}
    Q, var_Q, skewness, kurtosis = (np.empty(columns) for _ in range(4))
    for i in range(columns):
        key = near[i].tobytes()
        if key not in shapes:
            weight = w * near[i][c]
            index = extremal_index(z.reshape(-1, k), weight.reshape(-1, k)[:, 0])
            shapes[key] = (_Shape.of(z[order], over[order], weight[order]), *index)
        shape, theta, error = shapes[key]
        level = float(q[i] ** (1.0 / theta))
        if (key, level) not in quantiles:
            quantiles[key, level] = shape.quantile(level, error)
        Q[i], var_Q[i] = quantiles[key, level]
        skewness[i], kurtosis[i] = shape.skewness, shape.kurtosis
    runs = np.bincount(samples.column, samples.weight, minlength=columns)
    parts = np.maximum(runs * k / _alike(z, k), 1e-9)
    of_scale = np.minimum(s.var / s.value**2, (kurtosis - 1.0) / (4.0 * parts))
    pooled = near @ runs
    few = np.array([(t_factor(max(n - 1.0, 1.0)) / NORMAL_95) ** 2 for n in pooled])
    usual = _mean(s.value**2, parts) * few
    shared = np.minimum(pooled / float(runs.sum()), 1.0)
    var = usual * (1.0 / parts + Q * skewness / parts + Q**2 * of_scale + var_Q * (1.0 - shared))
    least = 0.1 * usual / parts
    common = float(np.mean(usual * var_Q * shared))
    return LevelFit(
        a + Q * s.value,
        p.value,
        bend.value,
        center,
        lean,
        width,
        np.maximum(var, least),
        p.var,
        bend.var,
        common,
    )


def fit_means(column: IntArray, h: FloatArray, mean: FloatArray, var: FloatArray, columns: int) -> LevelFit:
    """ln of a mean over the height, such as a share of time, from means above 0 of cells (n,) and their variances."""
    y, error = np.log(mean), var / mean**2
    w = 1.0 / np.maximum(error, 1e-6)
    total = np.maximum(np.bincount(column, w, minlength=columns), 1e-300)
    center = np.bincount(column, w * h, minlength=columns) / total
    level = np.bincount(column, w * y, minlength=columns) / total
    off = h - center[column]
    spread = np.bincount(column, w * off**2, minlength=columns)
    slope = np.divide(
        np.bincount(column, w * off * y, minlength=columns), spread, out=np.full(columns, np.nan), where=spread > 1e-6
    )
    var_slope = np.divide(1.0, spread, out=np.full(columns, np.inf), where=spread > 1e-6)
    p = _shrunk_to_mean(slope, var_slope, (OF_SHARE, OF_SHARE_SD))
    known = np.bincount(column, minlength=columns) > 0
    level = np.where(known, level, np.nan)
    none, var = np.zeros(columns), np.where(known, 1.0 / total, np.nan)
    bends = np.full(columns, BEND_SD**2)
    width = np.divide(spread, total, out=np.zeros(columns), where=known)
    return LevelFit(level, np.clip(p.value, *SLOPES), none, center, none, width, var, p.var, bends)


def _left_over(c: IntArray, w: FloatArray, columns: int) -> FloatArray:
    """Standard deviation of what is left of numbers about the location that is fitted to them, over theirs (n,): few
    numbers pull it towards themselves."""
    total = np.maximum(np.bincount(c, w, minlength=columns), 1e-300)
    pull = np.bincount(c, w**2, minlength=columns) / total**2
    return np.asarray(np.sqrt(np.maximum(1.0 - 2.0 * w / total[c] + pull[c], LEAST_LEFT)))


@dataclass(frozen=True, eq=False)
class _Effects:
    """Values of columns and their variances."""

    value: FloatArray
    var: FloatArray


def _shrunk_to_mean(value: FloatArray, var: FloatArray, prior: tuple[float, float] | None = None) -> _Effects:
    """Values of columns drawn towards their mean, by random effects; one that is not known is that mean. prior: mean
    and standard deviation before any value is known; columns differ by `BETWEEN` of that."""
    known = np.isfinite(var) & np.isfinite(value)
    tau2 = _variance_between(value[known], var[known], 0.0 if prior is None else (BETWEEN * prior[1]) ** 2)
    w = 1.0 / (var[known] + max(tau2, 1e-12))
    about, certainty = (0.0, 0.0) if prior is None else (prior[0], prior[1] ** -2)
    certainty_of_mean = certainty + float(w.sum())
    mean = (certainty * about + float(np.sum(w * value[known]))) / certainty_of_mean
    if prior is not None and known.sum() < 3:
        tau2 = prior[1] ** 2
    share = np.where(known, tau2 / np.where(known, np.maximum(tau2 + var, 1e-300), 1.0), 0.0)
    drawn = share * np.where(known, value, 0.0) + (1.0 - share) * mean
    left = np.where(known, share * np.where(known, var, 0.0), tau2) + (1.0 - share) ** 2 / certainty_of_mean
    return _Effects(drawn, left)


def _variance_between(value: FloatArray, var: FloatArray, usual: float = 0.0) -> float:
    """Variance of true values about their mean, from values with these sampling variances (DerSimonian and Laird);
    usual: what it is about before any value is known, which it stays where values of large error do not say more."""
    if len(value) < 2:
        return usual
    w = 1.0 / np.maximum(var, 1e-12)
    total = float(w.sum())
    mean = float(np.sum(w * value)) / total
    excess = float(np.sum(w * (value - mean) ** 2)) - (len(value) - 1)
    tau2 = max(excess / max(total - float(np.sum(w**2)) / total, 1e-300), 0.0)
    if usual == 0.0:
        return tau2
    certainty, before = (len(value) - 1) / (2.0 * float(np.mean(var + tau2)) ** 2), 1.0 / usual**2
    return (certainty * tau2 + before * usual) / (certainty + before)


def _location_scale(
    c: IntArray, h: FloatArray, y: FloatArray, under: BoolArray, over: BoolArray, w: FloatArray, near: FloatArray
) -> tuple[FloatArray, _Effects, _Effects, _Effects, FloatArray, FloatArray, FloatArray]:
    """Location at the mean h of each column, slope, bend, scale, that mean, lean and width (`LevelFit`), by expectation
    and maximisation for normal numbers some of which are censored."""
    columns = len(near)
    total = np.maximum(np.bincount(c, w, minlength=columns), 1e-300)

    def mean(x: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(c, w * x, minlength=columns) / total)

    center = mean(h)
    off = h - center[c]
    spread = np.bincount(c, w * off**2, minlength=columns)
    width = spread / total
    third = np.bincount(c, w * off**3, minlength=columns)
    lean = np.divide(third, spread, out=np.zeros(columns), where=spread > 1e-9)
    bent = 0.5 * (off**2 - lean[c] * off - width[c])
    bending = np.bincount(c, w * bent**2, minlength=columns)
    a = mean(y)
    s = np.full(columns, max(math.sqrt(_mean((y - a[c]) ** 2, w)), LEAST_SCALE))
    p = scale = _Effects(np.full(columns, SLOPE), s**2)
    bend = _Effects(np.zeros(columns), np.full(columns, BEND_SD**2))
    filled, extra = y.copy(), np.zeros_like(y)
    marked = np.flatnonzero(under | over)
    of, from_above = c[marked], over[marked]
    for _ in range(STEPS if len(marked) else 3):
        if len(marked):
            about = a[of] + p.value[of] * off[marked] + bend.value[of] * bent[marked]
            before = filled[marked]
            filled[marked], extra[marked] = _expected(y[marked], about, s[of], from_above)
            if (np.abs(filled[marked] - before) < SETTLED * s[of]).all():
                break
        a = mean(filled)
        slope = np.divide(
            np.bincount(c, w * off * (filled - a[c]), minlength=columns),
            spread,
            out=np.full(columns, np.nan),
            where=spread > 1e-9,
        )
        usual = math.sqrt(_mean(s**2, total))
        var_slope = np.divide(usual**2, spread, out=np.full(columns, np.inf), where=spread > 1e-9)
        p = _shrunk_to_mean(slope, var_slope, (SLOPE, SLOPE_SD))
        p = _Effects(np.clip(p.value, *SLOPES), p.var)
        of_bend: FloatArray = np.bincount(c, w * bent * filled, minlength=columns).astype(np.float64)
        bend = _bends(of_bend, bending.astype(np.float64), usual**2)
        rest = filled - a[c] - p.value[c] * off - bend.value[c] * bent
        kurtosis = _kurtosis(rest / s[c], w)
        fitted = 1.0 + np.where(spread > 1e-9, np.minimum(p.var / var_slope, 1.0), 0.0)
        s = np.sqrt(mean(rest**2 + extra) / np.maximum(1.0 - fitted / np.maximum(total, 1.001), 0.2))
        ln_s = _scales(s, total, near, kurtosis)
        s = np.exp(ln_s.value)
        scale = _Effects(s, s**2 * ln_s.var)
    return a, p, bend, scale, center, lean, width


def _bends(total: FloatArray, square: FloatArray, scatter: float) -> _Effects:
    """Bends of columns by sums over their runs, of the bent part times the numbers and of its square: normal about a
    mean that is normal about 0."""
    var = scatter / np.maximum(square, 1e-12)
    value, w = total / np.maximum(square, 1e-12), 1.0 / (var + BEND_SD**2)
    certainty = BEND_SD**-2 + float(w.sum())
    mean, share = float(np.sum(w * value)) / certainty, BEND_SD**2 * w
    return _Effects(share * value + (1.0 - share) * mean, share * var + (1.0 - share) ** 2 / certainty)


def _kurtosis(z: FloatArray, w: FloatArray) -> float:
    """Fourth moment of numbers about 0 over the square of the second."""
    z = np.clip(z, -CLIP, CLIP)
    square = z**2
    return _mean(square**2, w) / max(_mean(square, w) ** 2, 1e-12)


def _mean(x: FloatArray, w: FloatArray) -> float:
    return float(x @ w) / float(w.sum())


def _scales(s: FloatArray, total: FloatArray, near: FloatArray, kurtosis: float) -> _Effects:
    """ln of the scales of columns with `total` runs, drawn towards that of the columns that are alike. Scales of
    numbers with a long tail scatter by more than those of normal ones."""
    ln_s, var = np.log(np.maximum(s, LEAST_SCALE)), 0.25 * max(kurtosis - 1.0, 0.2) / np.maximum(total - 1.0, 0.5)
    w = near * np.where(total > 1.5, 1.0 / var, 1e-6)
    usual = (w * ln_s).sum(axis=1) / w.sum(axis=1)
    tau2 = _variance_between(ln_s - usual, var)
    share = np.where(total > 1.5, tau2 / (tau2 + var), 0.0)
    return _Effects(share * ln_s + (1.0 - share) * usual, share * var + (1.0 - share) ** 2 / w.sum(axis=1))


def _expected(y: FloatArray, m: FloatArray, s: FloatArray, over: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Expected values of normal numbers about m that are y or more (over), or y or less, and their variances."""
    from scipy.special import log_ndtr  # heavy: only where runs are fitted

    side = np.where(over, 1.0, -1.0)
    t = side * np.clip((y - m) / s, -30.0, 30.0)
    beyond = np.exp(-0.5 * t**2 - 0.5 * math.log(2.0 * math.pi) - log_ndtr(-t))
    return m + side * s * beyond, s**2 * np.maximum(1.0 + t * beyond - beyond**2, 0.0)


@dataclass(frozen=True, eq=False)
class _Shape:
    """The common distribution of z: numbers that rise with ln(-ln S) of the share S above each, for some of which only
    the least is known (Kaplan and Meier). density: weight of each, less where numbers are dense."""

    axis: FloatArray
    z: FloatArray
    density: FloatArray
    n: float
    skewness: float
    kurtosis: float

    @classmethod
    def of(cls, z: FloatArray, over: BoolArray, w: FloatArray) -> _Shape:
        """Of rising numbers, `over` where they are only the least; w their weights."""
        total = float(w.sum())
        at_risk = np.maximum(total - np.concatenate(([0.0], np.cumsum(w)[:-1])), w)
        gone = np.minimum(w / at_risk, 1.0 - 1e-9)
        ln_S = np.cumsum(np.where(over, 0.0, np.log1p(-gone)))
        share = 0.5 * (np.exp(ln_S) + np.exp(np.concatenate(([0.0], ln_S[:-1]))))
        middle = np.log(np.maximum(share, 1e-300))
        use = ~over & (middle < -1e-12)
        about = np.clip(z, -CLIP, CLIP)
        d = about - _mean(about, w)
        square = d**2
        v = max(_mean(square, w), 1e-12)
        third, fourth = _mean(square * d, w), _mean(square**2, w)
        n = total**2 / float(np.sum(w**2))
        axis = np.log(-middle[use])
        apart = np.gradient(axis) if len(axis) > 1 else np.ones(len(axis))  # numbers are denser below than above
        density = w[use] * np.sqrt(np.maximum(apart, 1e-12))
        return cls(axis, z[use], density, n, third / v**1.5, fourth / v**2)

    def quantile(self, q: float, error: float = 0.0) -> tuple[float, float]:
        """Quantile of z and its variance; beyond the numbers themselves by a Weibull tail, which is straight on this
        axis. error: standard deviation of ln of the share above."""
        if len(self.z) < 2:
            return 0.0, 1.0
        S, wanted = 1.0 - q, math.log(-math.log1p(-q))
        off = np.abs(self.axis - wanted)
        rank = min(FEWEST_IN_TAIL, len(off)) - 1
        width = max(WINDOW, 1.05 * float(np.partition(off, rank)[rank]))
        near = np.maximum(1.0 - (off / width) ** 3, 0.0) ** 3 * self.density
        m_t, m_z = _mean(self.axis, near), _mean(self.z, near)
        lever = near * (self.axis - m_t)
        across = max(float(lever @ (self.axis - m_t)), 1e-300)
        rise = max(float(lever @ (self.z - m_z)) / across, 1e-9)
        density = -math.log(S) * S / rise
        of_share = (rise * error / math.log(S)) ** 2
        return float(m_z + rise * (wanted - m_t)), S * (1.0 - S) / (max(self.n, 4.0 / S) * density**2) + of_share


def _alike(z: FloatArray, k: int) -> float:
    """How many parts of a run count as one, for parts of one run may be alike."""
    if k == 1:
        return 1.0
    rows = np.clip(z.reshape(-1, k), -CLIP, CLIP)
    total = float(np.var(rows))
    alike = (float(np.var(rows.mean(axis=1))) - total / k) / max(total * (1.0 - 1.0 / k), 1e-12)
    return 1.0 + (k - 1) * max(alike, 0.0)
