"""Uninterrupted parts of the records as the checks of step 1 use them: measured signals with the twin's parameters for
that load and wire.

Slopes of one curve against another from differences over seconds, corrected for the lag between the two.

Differences of positions against integrals of speeds: a derivative of noisy samples in a regressor would draw the slope
towards zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.engine.pack.winch import drum_record, pack
from stillhook.physics.load_path.drum import layer_diameter, wire_to_layer
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.statistics.blocks import Fit, fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import Record, Segment, filled, stretches_of
from stillhook.winches.load_path.load import drum_geometry

SHORTEST = 10.0
"""Shorter parts are left out [s]: one wave."""
BLOCK = 30.0
"""Length of the blocks within which errors may be autocorrelated [s]: some waves, the window of paper F."""
OIL = ("p_hp", "alpha_pm")
"""Signals, in addition to a motor speed, from which the oil that the passive motors move and the pressure that it makes
are known."""
FEW = 8
"""Number of blocks of a short test: with fewer the interval of its estimate is unreliable."""


@dataclass(frozen=True)
class LogPart:
    """An uninterrupted part of a test. number: its place among all parts of the campaign, for the blocks."""

    crane: Crane
    record: Record
    segment: Segment
    number: int

    @property
    def test(self) -> str:
        return self.record.test.name

    @property
    def kind(self) -> Kind:
        return self.record.test.kind

    @property
    def step(self) -> float:
        return self.record.step

    @property
    def n(self) -> int:
        return self.segment.last - self.segment.first

    @cached_property
    def t(self) -> FloatArray:
        """Time of the samples from the start of the part, (n,) [s]."""
        return np.arange(self.n, dtype=np.float64) * self.step

    def has(self, *names: str) -> bool:
        """Whether these signals were logged, not derived from others, and have values in this part."""
        return not self.record.derived.intersection(names) and self.knows(*names)

    def knows(self, *names: str) -> bool:
        """Whether these signals are available, logged or derived from others, and have values in this part."""
        return self.record.has(*names) and all(np.isfinite(self[name]).any() for name in names)

    def lacking(self, *names: str) -> tuple[str, ...]:
        """Which of these signals were not logged; a motor speed may follow from that of the wire."""
        return tuple(n for n in names if not (self.has(n) or (n == "omega_m" and self.omega_m is not None)))

    def __getitem__(self, name: str) -> FloatArray:
        """A signal, (n,), SI. Errors: KeyError."""
        return self.record.part(self.segment, name)

    @cached_property
    def params(self) -> Any:
        """The twin's records for this load and wire."""
        part, middle = self.segment, float(np.nanmean(self.wire_out)) if np.isfinite(self.wire_out).any() else 0.0
        s_w = min(max(middle, 0.0), drum_record(self.crane).L_full)
        case = Scenario(load=f"{part.load!r} kg", s_w=f"{s_w!r} m", mode=part.mode, water=self.record.test.water)
        return pack(self.crane, case).params

    @cached_property
    def wire_out(self) -> FloatArray:
        """Wire paid out, (n,) [m]; that of the start where it was not logged."""
        return self["s_w"] if self.knows("s_w") else np.full(self.n, self.segment.s_w)

    @cached_property
    def weight(self) -> float:
        """Weight of hook and payload, in water less buoyancy [N]."""
        return float(self.params.hoist.load.W)

    @cached_property
    def layer(self) -> FloatArray:
        """Number of the layer that the twin winds on, (n,)."""
        return layer_of(self.crane, self.wire_out)

    @cached_property
    def r_eff(self) -> FloatArray:
        """Wire per motor angle that the twin has at the wire that is out, (n,) [m/rad]."""
        return 0.5 * diameter_of(self.crane, self.layer) / self.crane.i_hD

    @cached_property
    def inertia(self) -> float:
        """Inertia at the motor shaft in the middle of the part [kg m^2]."""
        return 1.0 / float(drum_geometry(float(self.params.hoist.s_w_0), self.params.hoist).i_J)

    @cached_property
    def omega_m(self) -> FloatArray | None:
        """Motor speed, from the wire speed where it was not logged, (n,) [rad/s]; None where neither was."""
        if self.has("omega_m"):
            return self["omega_m"]
        return self["v_w"] / self.r_eff if self.has("v_w") else None

    def blocks(self, at: NDArray[Any]) -> IntArray:
        """Block of time of each moment [s from the start of the part], unique to this part."""
        length = min(BLOCK, max(self.segment.duration / FEW, 2.0))
        return self.number * 1_000_000 + np.asarray(at / length, dtype=np.intp)


def parts_of(campaign: Campaign, records: Sequence[Record]) -> tuple[LogPart, ...]:
    """All uninterrupted parts that are long enough, in the order of the campaign."""
    pairs = [(r, s) for r in records for s in r.segments if s.duration >= SHORTEST]
    return tuple(LogPart(campaign.crane, r, s, i) for i, (r, s) in enumerate(pairs))


def by_test(parts: Sequence[LogPart]) -> dict[str, list[LogPart]]:
    """Parts by the name of their test."""
    out: dict[str, list[LogPart]] = {}
    for part in parts:
        out.setdefault(part.test, []).append(part)
    return out


@dataclass(frozen=True)
class ByTest:
    """One number of all tests together, the scatter between them in its interval, and of each."""

    all: Estimate
    tests: Mapping[str, Estimate]

    @classmethod
    def of(cls, tests: Mapping[str, Estimate]) -> ByTest | None:
        """None where no test has one."""
        return cls(pooled(list(tests.values())), tests) if tests else None


Columns = tuple[NDArray[Any], ...]


class TestFit(NamedTuple):
    """Least squares of one test: its parts; columns (n,), the fitted signal last; the fit."""

    test: str
    parts: list[LogPart]
    columns: Columns
    fit: Fit


def fits(parts: Sequence[LogPart], rows: Callable[[LogPart], Columns | None]) -> Iterator[TestFit]:
    """Least squares of every test whose data determine it. rows(part): columns, fitted signal, and blocks; None
    without."""
    for test, same in by_test(parts).items():
        columns = [row for p in same if (row := rows(p)) is not None]
        if not columns:
            continue
        *X, block = stacked(columns)
        if (fitted := fit(X[:-1], X[-1], block)) is not None:
            yield TestFit(test, same, tuple(X), fitted)


def mean_rows(name: str, every: int = 10) -> Callable[[LogPart], Columns]:
    """Rows of `fits` for the mean of a signal, every so many samples."""

    def rows(p: LogPart) -> Columns:
        x = p[name][::every]
        return np.ones_like(x), x, p.blocks(p.t[::every])

    return rows


def stacked(rows: Iterable[Iterable[NDArray[Any]]]) -> Columns:
    """Columns of several parts, one after the other."""
    return tuple(np.concatenate(column) for column in zip(*rows, strict=True))


def layer_of(crane: Crane, s_w: FloatArray) -> FloatArray:
    """Number of the layer in use with s_w paid out [m], NaN where s_w is."""
    drum = drum_record(crane)
    full = np.array([wire_to_layer(float(n), drum) for n in range(1, crane.drum.layers)])
    with np.errstate(invalid="ignore"):
        layer = np.minimum(np.searchsorted(full, drum.L_full - s_w, side="left") + 1.0, crane.drum.layers)
        return np.where(np.isfinite(s_w), layer, np.nan)


def diameter_of(crane: Crane, layer: FloatArray) -> FloatArray:
    """Diameter of the wire's centre on the layers of the drum [m], NaN where the layer is."""
    drum = drum_record(crane)
    table = np.array([layer_diameter(float(n), drum) for n in range(1, crane.drum.layers + 1)])
    finite = np.isfinite(layer)
    return np.where(finite, table[np.where(finite, layer, 1.0).astype(np.intp) - 1], np.nan)


def layer_at(crane: Crane, diameter: float) -> float:
    """Layer whose wire centre has this diameter [m], as a real number that may exceed the layers of the drum."""
    drum = drum_record(crane)
    return 1.0 + (diameter - float(layer_diameter(1.0, drum))) / layer_step(crane)


def layer_step(crane: Crane) -> float:
    """By how much the diameter grows from one layer to the next [m]."""
    return 2.0 * crane.wire.d


def wire_of_layer(crane: Crane, layer: int) -> tuple[float, float]:
    """Least and most wire paid out at which this layer is in use [m]."""
    drum = drum_record(crane)
    return drum.L_full - wire_to_layer(float(layer), drum), drum.L_full - wire_to_layer(float(layer - 1), drum)


WINDOW = 2.0
"""Time over which differences are taken [s]: a fifth of a wave, in which the winch moves a hundred steps of its
encoder."""
SMOOTH = 0.2
"""Part of the window over which both curves are averaged at its ends [-]: noise is removed, and waves are attenuated
equally in both."""
BRIDGED = 0.1
"""Longest hole in a signal that a straight line may fill [s]."""
LAGS = 3
"""Rounds of the estimate of the lag: the second leaves it within a millisecond."""
LONGEST_LAG = 1.0
"""Largest lag that is corrected [s]."""
LEAST_MOTION = 1e-6


@dataclass(frozen=True)
class Slope:
    """fit: coefficients slope, and slope times lag left; lag: by which y comes later than x [s]; x: the differences."""

    fit: Fit
    lag: float
    x: FloatArray

    @property
    def value(self) -> float:
        return float(self.fit.b[0])

    @property
    def half(self) -> float:
        """Half of the 95 % interval."""
        return self.fit.half(0)


def bridged(x: FloatArray, step: float) -> FloatArray:
    """The signal with short holes filled by straight lines; longer ones stay."""
    finite = np.isfinite(x)
    if finite.all() or not finite.any():
        return x
    out = filled(x)
    for a, b in stretches_of(~finite):
        if (b - a) * step > BRIDGED or a == 0 or b == len(x):
            out[a:b] = np.nan
    return out


def integral(x: FloatArray, step: float) -> FloatArray:
    """Integral from the start by trapezoids, (n,), NaN in holes; `differences` leaves out what is across one."""
    values = bridged(x, step)
    safe = np.where(np.isfinite(values), values, 0.0)
    total = np.concatenate(([0.0], np.cumsum(0.5 * (safe[1:] + safe[:-1]) * step)))
    return np.where(np.isfinite(values), total, np.nan)


def smoothed(x: FloatArray, step: float, width: float = BRIDGED) -> FloatArray:
    """Mean over a window of odd samples, NaN where it holds one or reaches beyond an end."""
    half = max(1, round(0.5 * width / step))
    out = np.full(len(x), np.nan)
    if len(x) > 2 * half:
        out[half:-half] = np.convolve(x, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")
    return out


def means(x: FloatArray, step: float, width: float) -> FloatArray:
    """Means over a width [s], one a width."""
    every = max(1, round(width / step))
    return smoothed(x, step, every * step)[::every]


def rates(x: FloatArray, step: float, width: float) -> FloatArray:
    """Rates of such means [1/s]."""
    every = max(1, round(width / step))
    return np.asarray(np.gradient(smoothed(x, step, every * step), step)[::every])


def differences(x: FloatArray, step: float, window: float = WINDOW) -> FloatArray:
    """Change of a curve from one knot to the next, a window apart; NaN where there is a gap between."""
    every = max(1, round(window / step))
    knots = smoothed(x, step, SMOOTH * window)[::every]
    holes = np.cumsum(~np.isfinite(x))[::every]
    return np.where(np.diff(holes) == 0, np.diff(knots), np.nan)


def moments(part: LogPart, window: float = WINDOW) -> FloatArray:
    """Middles of the windows of `differences` [s from the start of the part]."""
    every = max(1, round(window / part.step))
    return part.t[::every][:-1] + 0.5 * every * part.step


def later(x: FloatArray, step: float, lag: float) -> FloatArray:
    """The curve as it is lag [s] later: y(t) = x(t - lag), NaN beyond its ends and next to its holes."""
    at = np.arange(len(x)) - lag / step
    return np.asarray(np.interp(at, np.arange(len(x)), x, left=np.nan, right=np.nan))


def slope(
    parts: Sequence[LogPart], curves: Sequence[tuple[FloatArray, FloatArray]], window: float = WINDOW
) -> Slope | None:
    """Slope of y against x: pairs of curves, one per part, (n,); None where not determined. A constant rate between
    them (an offset of a speed) is taken out part by part, and so is the lag."""
    lag, fitted = 0.0, None
    for _ in range(LAGS + 1):
        dx, dv, dy, block = stacked(_rows(p, x, y, lag, window) for p, (x, y) in zip(parts, curves, strict=True))
        if not np.isfinite(dx).any() or np.nanstd(dx) < LEAST_MOTION:
            return None
        fitted = fit((dx, dv), dy, block)
        if fitted is None:
            return None
        result = Slope(fitted, lag, dx)
        lag = float(np.clip(lag - fitted.b[1] / fitted.b[0], -LONGEST_LAG, LONGEST_LAG)) if fitted.b[0] != 0.0 else lag
    return result


def _rows(part: LogPart, x: FloatArray, y: FloatArray, lag: float, window: float) -> tuple[NDArray[Any], ...]:
    moved = later(x, part.step, lag)
    dx, dy = differences(moved, part.step, window), differences(y, part.step, window)
    dv = differences(np.gradient(moved, part.step), part.step, window)
    use = np.isfinite(dx) & np.isfinite(dy) & np.isfinite(dv)
    levelled = [np.where(use, c, np.nan) for c in (dx, dv, dy)]
    centred = [c - np.nanmean(c) if use.any() else c for c in levelled]
    return (*centred, part.blocks(moments(part, window)))
