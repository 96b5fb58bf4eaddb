"""Motion of the crane tip from a record: a smooth curve through measured or computed heights.

Waves counted in a motion: how far it goes over a moving window, and from one upward crossing of its mean to the
next.
"""

from __future__ import annotations

import binascii
import math
import zlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ArrayRecord, FloatArray, decode_array, encode_array, fill
from stillhook.errors import MotionError
from stillhook.sea.motion.motion import Motion, Sample
from stillhook.units import parse

FEWEST_POINTS = 6  # a quintic spline needs six
EDGE = 1e-9  # s: how far a time may be outside the record by rounding alone


@dataclass(frozen=True, init=False, eq=False)
class Recorded(ArrayRecord, Motion):
    """Heights at given times, joined by a quintic spline that passes through every one and has four smooth derivatives.

    Parameters: times [s], strictly increasing, at least 6 (the first one becomes t = 0); heights [m], positive up, as
    many; source, where they are from; report, how they were read. Velocity and acceleration are the derivatives of
    the spline, so they agree with the height and with one another. Nothing is taken off the heights: see `about_mean`.

    What the spline makes of 1 Hz samples of a sea (periods of 5 s and longer, standard deviation 0.84 m), measured:
    from 5 s off the ends it is right to 0.2 mm, 0.5 mm/s and 2 mm/s^2; shorter waves come out worse (4 s: 0.2 % of
    the height, 1.3 % of the acceleration; 3 s: 3 and 7 %) and none below 2 s can. Nearer to either end, where nothing
    is known of the far side, it is wrong by up to 1 cm, 8 cm/s and 0.4 m/s^2 (not-a-knot ends; natural ends are two
    to three times worse): a ramped start covers the first. Heights rounded to 1 cm add 7 mm, 14 mm/s and 0.04 m/s^2.

    Errors: MotionError for a bad record, and for `sample` outside 0 .. duration.

    >>> import numpy as np, stillhook
    >>> t = np.arange(0.0, 60.0, 0.5)
    >>> record = stillhook.Recorded(t, np.sin(2.0 * np.pi * t / 10.0), source="a sine", report=())
    >>> record.sample(np.array([22.5, 27.5]))[0].round(4).tolist()
    [1.0, -1.0]
    """

    times: FloatArray = field(repr=False)
    heights: FloatArray = field(repr=False)
    source: str
    report: str = field(repr=False)
    kind: ClassVar[str] = "recorded"

    def __init__(self, times: ArrayLike, heights: ArrayLike, *, source: str = "", report: str = "") -> None:
        t, s = _column(times, "times", source), _column(heights, "heights", source)
        _check(t, s, source)
        fill(self, times=t - t[0], heights=s, source=source, report=report)

    @cached_property
    def _spline(self) -> tuple[Any, Any, Any]:
        from scipy.interpolate import make_interp_spline  # here, so that motions start without scipy

        s = make_interp_spline(self.times, self.heights, k=5)
        return s, s.derivative(1), s.derivative(2)

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    def sample(self, t: ArrayLike) -> Sample:
        time = np.asarray(t, dtype=np.float64)
        outside = ~((time >= -EDGE) & (time <= self.duration + EDGE))
        if outside.any():
            raise MotionError(
                f"{self.source or 'Recorded'}: no motion at t = {time[outside].flat[0]:g} s: the record runs from 0 s "
                f"to {self.duration:g} s. Run shorter or take a longer record."
            )
        inside = np.clip(time, 0.0, self.duration)
        s, v, a = (np.asarray(curve(inside), dtype=np.float64) for curve in self._spline)
        return s, v, a

    @property
    def mean(self) -> float:
        """Mean height over time [m] (trapezoids, so that uneven samples weigh what they last)."""
        middles = (self.heights[1:] + self.heights[:-1]) / 2.0
        return float(middles @ np.diff(self.times) / self.duration)

    def about_mean(self) -> Recorded:
        """The same motion with its mean height taken off."""
        report = f"{self.report} Mean height {self.mean:.4g} m removed.".strip()
        return Recorded(self.times, self.heights - self.mean, source=self.source, report=report)

    def thinned(self, every: str = "0.5 s") -> Recorded:
        """The same motion with a point every so often, least squares through the samples between them.

        For logs much faster than the sea: between 10 Hz samples rounded to 1 cm, a curve through every one swings by
        4 m/s^2 (20 at the ends), at 50 Hz by 60 m/s^2, and all of that is rounding. With a point every 0.5 s it is
        0.07 m/s^2 (0.3 at the ends), and waves of 3 s and longer pass with less than 0.01 % lost (2 s: 0.15 %), without
        delay. Gaps longer than two steps are bridged by a curve through samples a step or more apart.
        Errors: MotionError for a record shorter than 12 steps, and for a step shorter than twice the median interval.
        """
        from scipy.interpolate import LSQUnivariateSpline  # here, so that motions start without scipy

        step = parse(every, "time", "every")
        interval = float(np.median(np.diff(self.times)))
        count = round(self.duration / step) if step >= 2.0 * interval else 0
        if count < 2 * FEWEST_POINTS:
            raise MotionError(
                f"{self.source or 'Recorded'}: a point every {step:g} s is not possible with {self.duration:g} s of "
                f"samples every {interval:.3g} s: it takes two samples to a point and {2 * FEWEST_POINTS} points."
            )
        grid = np.linspace(0.0, self.duration, count + 1)
        t, s = self._bridged(2.0 * step, interval)
        # The knots of the curve through the new points (not-a-knot ends), so that this curve is that one.
        heights = LSQUnivariateSpline(t, s, grid[3:-3], k=5)(grid)
        report = f"{self.report} Least squares with a point every {grid[1]:.4g} s.".strip()
        return Recorded(grid, heights, source=self.source, report=report)

    def _bridged(self, longest: float, interval: float) -> tuple[FloatArray, FloatArray]:
        """Times and heights with gaps filled at the sampling interval, from a curve through well spaced samples."""
        edges = np.flatnonzero(np.diff(self.times) > longest)
        if not len(edges):
            return self.times, self.heights
        cells = np.unique(np.floor(self.times / (longest / 2.0)), return_index=True)[1]
        spaced = np.union1d(cells[::2], [0, len(self.times) - 1])
        coarse = Recorded(self.times[spaced], self.heights[spaced], source=self.source)
        missing = [np.arange(self.times[i] + interval, self.times[i + 1] - interval / 2.0, interval) for i in edges]
        filled = np.concatenate(missing)
        t = np.concatenate((self.times, filled))
        order = np.argsort(t, kind="stable")
        return t[order], np.concatenate((self.heights, coarse.sample(filled)[0]))[order]

    def describe(self) -> str:
        origin = f" from {self.source}" if self.source else ""
        return (
            f"recorded motion{origin}: {len(self.times)} points over {self.duration:.6g} s, "
            f"height {self.heights.min():.3g} to {self.heights.max():.3g} m"
        )

    def to_dict(self) -> dict[str, Any]:
        """Numbers as base64 of zlib of little-endian float64, exact to the bit: some 8 to 16 bytes a point."""
        columns = {"times": encode_array(self.times), "heights": encode_array(self.heights)}
        return {"type": self.kind, "source": self.source, "report": self.report, "points": len(self.times), **columns}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The record that `to_dict` stored."""
        try:
            columns = {name: decode_array(data[name]) for name in ("times", "heights")}
        except (KeyError, TypeError, AttributeError, ValueError, binascii.Error, zlib.error) as problem:
            raise MotionError(
                f"stored record: {type(problem).__name__}: times and heights are not what a run stores. Simulate again."
            ) from problem
        return cls(**columns, source=str(data.get("source", "")), report=str(data.get("report", "")))


def _column(values: ArrayLike, name: str, source: str) -> FloatArray:
    try:
        if np.iscomplexobj(values):
            raise TypeError
        column = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise MotionError(f"{source or 'Recorded'}: {name} are not numbers. Give one SI number a sample.") from None
    if column.ndim != 1:
        raise MotionError(f"{source or 'Recorded'}: {name} have {column.ndim} dimensions. Give one number a sample.")
    return column


def _check(t: FloatArray, s: FloatArray, source: str) -> None:
    place = source or "Recorded"
    if len(t) != len(s):
        raise MotionError(f"{place}: {len(t)} times but {len(s)} heights. Give one height for each time.")
    if len(t) < FEWEST_POINTS:
        raise MotionError(f"{place}: {len(t)} points. A recorded motion needs {FEWEST_POINTS} or more.")
    bad = ~(np.isfinite(t) & np.isfinite(s))
    if bad.any():
        i = int(np.argmax(bad))
        raise MotionError(f"{place}: point {i + 1} (time {t[i]:g} s, height {s[i]:g} m) is not finite. Remove it.")
    step = np.diff(t)
    if (step <= 0.0).any():
        i = int(np.argmax(step <= 0.0))
        raise MotionError(
            f"{place}: point {i + 2} at {t[i + 1]:.6f} s does not come after {t[i]:.6f} s. Times must increase: "
            "sort them and remove doubles."
        )
    if not math.isfinite(float(np.abs(np.diff(s) / step).max())):
        raise MotionError(f"{place}: two points are too close in time to make a velocity. Remove one of them.")


DEAD_BAND = 0.1
"""Part of the standard deviation that a wave must go beyond the mean, either way, to count: noise about the mean is no
wave."""


def trailing_spans(x: FloatArray, n: int, axis: int = -1) -> FloatArray:
    """Largest less smallest of each sample and the n - 1 before it, shape of x; NaN where one of them is. Of the first
    n - 1 samples it is that of what there is so far, mirrored."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # heavy: only where windows are requested

    unknown = np.isnan(x)
    trail = (n - 1) // 2  # shifts the centred filters so that the window ends at its sample
    hi = maximum_filter1d(np.where(unknown, -np.inf, x), n, axis=axis, origin=trail)
    lo = minimum_filter1d(np.where(unknown, np.inf, x), n, axis=axis, origin=trail)
    holes = maximum_filter1d(unknown.astype(float), n, axis=axis, origin=trail) > 0.0
    return np.where(holes, np.nan, hi - lo)


def window_spans(s: FloatArray, n: int) -> FloatArray:
    """Largest less smallest over every whole window of n samples; over all of them where there are fewer."""
    return trailing_spans(s, n)[n - 1 :] if len(s) > n else np.array([np.ptp(s)])


def wave_periods(s: FloatArray, dt: float) -> FloatArray:
    """Time between upward crossings of the mean, for every whole wave of a motion sampled every dt [s]."""
    y = s - s.mean() if len(s) else s
    band = DEAD_BAND * y.std() if len(s) else 0.0
    if band == 0.0:
        return np.zeros(0)
    side = np.where(y > band, 1, np.where(y < -band, -1, 0))
    last = np.maximum.accumulate(np.where(side != 0, np.arange(len(y)), 0))
    side = side[last]  # within the dead band the side of before counts
    into = np.flatnonzero((side[1:] > 0) & (side[:-1] < 0)) + 1
    up = np.flatnonzero((y[:-1] <= 0.0) & (y[1:] > 0.0))
    below = up[np.searchsorted(up, into) - 1]  # where the mean was crossed before the wave went beyond the dead band
    return np.asarray(np.diff(below + y[below] / (y[below] - y[below + 1])) * dt, dtype=np.float64)
