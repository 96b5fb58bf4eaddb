"""A log on an even time grid: values at the time of their samples, linear interpolation in between, gaps remain
gaps.

Accuracy: the mean of a bin is placed at the mean time of its samples, so jitter of the stamps moves no edge; a
straight line between two samples h apart is off by at most h^2/8 of the second derivative (tip: 0.01 mm at 10 ms and 1
m/s^2, 1 mm at 0.1 s), an edge of a command is extended to h. A gap is bridged up to `BRIDGED` (5 mm of tip at 1
m/s^2), marked as doubtful and counted as lost; a longer one is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import ValidateError
from stillhook.logs.types import Log
from stillhook.units import number
from stillhook.validate.data_set.campaign import CraneTest
from stillhook.variables import PHYSICAL

BRIDGED = 0.2
"""Longest gap bridged by linear interpolation [s], if it is longer than HOLE spacings of the log as well."""
HOLE = 2.5
"""Spacings of the log: a larger distance between samples is a loss, not jitter of the stamps."""
CYCLES = 0.1
"""Relative tolerance of the mean spacing against an integer number of PLC cycles."""
SPIKES = {"s_tip": 0.03, "v_tip": 0.3, "s_w": 0.03, "e_c_measured": 0.03}
"""Smallest spike by signal [SI]. Neither tip nor wire moves and returns within two samples; pressures and speeds of the
winch may."""
BEYOND = 12.0
"""Times the median distance from the median of five samples: noise reaches 6."""
FASTEST = 3.0
"""Acceleration that neither tip nor wire exceeds [m/s^2]: curvature below it within five samples is no spike."""
LONGEST = 3_000_000
"""Samples of a test on the grid, 8 h at 10 ms: more do not fit into the memory of a small computer."""
HELD = ("mode",)
"""Signals that jump: the value before holds until the next sample."""


@dataclass(frozen=True)
class Grid:
    """Signals (n,) at t [s], even by step [s], NaN where not known; doubtful (n,) by signal; zero: time of t = 0 in the
    log [s]; lost: share of the expected samples that are missing; longest_hole [s]."""

    t: FloatArray
    step: float
    signals: Mapping[str, FloatArray]
    doubtful: Mapping[str, BoolArray]
    zero: float
    lost: float
    longest_hole: float
    spikes: Mapping[str, int]
    """Samples left out as spikes, because no mass moves and returns that fast, by signal."""


def even(log: Log, test: CraneTest, t_cycle: float) -> Grid:
    """The part of a log that counts, every PLC cycle t_cycle [s], or every few of them where the log is slower.

    Errors: ValidateError where the log holds nothing between start and end of the test, or more time than LONGEST
    samples.
    """
    at = log.t if log.at is None else log.at
    use = np.flatnonzero((at >= test.start) & (at <= test.end))
    if len(use) < 2:
        bounds = " and ".join(
            f"{key} = {number(x)} s" for key, x in (("start", test.start), ("end", test.end)) if np.isfinite(x)
        )
        raise ValidateError(
            f'test "{test.name}": {bounds}: {log.source} goes from 0 s to {log.duration:.4g} s and has no samples in'
            " that range."
        )
    t, spacing = at[use], 1.0 / log.rate
    step = t_cycle * max(1, round(spacing / t_cycle))
    if (t[-1] - t[0]) / step > LONGEST:
        raise ValidateError(
            f'test "{test.name}": {log.source} holds {len(use)} samples in {t[-1] - t[0]:.4g} s, and a test may take '
            f"{LONGEST * step:.4g} s. Check the time stamps, or take a part with start and end."
        )
    longest = max(BRIDGED, HOLE * max(spacing, log.every))
    grid = t[0] + step * np.arange(int(np.floor((t[-1] - t[0]) / step + 1e-6)) + 1)
    signals, doubtful, spikes = {}, {}, {}
    for name, values in log.signals.items():
        known = np.isfinite(values[use]) & ~_stuck(log, name)[use]
        spike = _spikes(values[use], log.every, name)
        if spike.any():
            known &= ~spike
            spikes[name] = int(spike.sum())
        signals[name], bridged = _filled(
            grid, t[known], values[use][known], longest, HOLE * max(spacing, log.every), name in HELD
        )
        nearest = np.clip(np.searchsorted(t, grid - 0.5 * step), 0, len(t) - 1)
        doubtful[name] = log.doubtful[name][use][nearest] | bridged | np.isnan(signals[name])
    present = len(use) if log.number is None else int(log.number[use].sum())
    lost = _lost(np.diff(t), present, spacing, t_cycle)
    return Grid(grid - grid[0], step, signals, doubtful, float(t[0]), lost, float(np.diff(t).max()), spikes)


def _lost(apart: FloatArray, present: int, spacing: float, t_cycle: float) -> float:
    """Share of missing samples. A log that records every few PLC cycles on average does so by design, however
    uneven."""
    holes = apart > HOLE * spacing
    mean = float(apart[~holes].sum()) / max(1, present - 1 - int(holes.sum()))
    cycles = t_cycle * max(1, round(mean / t_cycle))
    due = cycles if abs(mean - cycles) < CYCLES * mean else spacing
    return max(0.0, 1.0 - (present - 1) * due / float(apart.sum()))


def _stuck(log: Log, name: str) -> BoolArray:
    """Bins in which a signal is constant while others of its kind move."""
    stuck = np.zeros(len(log.t), np.bool_)
    for finding in log.findings:
        if finding.kind == "stuck" and finding.signal == name:
            stuck |= (log.t >= finding.start - 1e-9) & (log.t <= finding.end + 1e-9)
    return stuck & log.doubtful[name]


def _spikes(x: FloatArray, every: float, name: str) -> BoolArray:
    """One or two samples far from their neighbours."""
    if name not in SPIKES or len(x) < 5:
        return np.zeros(len(x), np.bool_)
    known = np.isfinite(x)
    filled = np.interp(np.arange(len(x)), np.flatnonzero(known), x[known]) if known.any() else np.zeros(len(x))
    distance = np.abs(filled - median_filter(filled, 5, mode="nearest"))
    bent = FASTEST * (2.0 * every) ** 2 if PHYSICAL[name].kind == "length" else FASTEST * 2.0 * every
    return np.asarray(known & (distance > max(SPIKES[name] + bent, BEYOND * float(np.median(distance)))), np.bool_)


def _filled(
    grid: FloatArray, t: FloatArray, values: FloatArray, longest: float, usual: float, held: bool
) -> tuple[FloatArray, BoolArray]:
    """Values on the grid, NaN in gaps that are too long, and where a gap was bridged."""
    if len(t) < 2:
        return np.full(len(grid), np.nan), np.zeros(len(grid), np.bool_)
    after = np.clip(np.searchsorted(t, grid, side="right"), 1, len(t) - 1)
    apart = t[after] - t[after - 1]
    outside = (grid < t[0] - usual) | (grid > t[-1] + usual)
    hole = outside | ((apart > longest) & (grid > t[after - 1] + 1e-9) & (grid < t[after] - 1e-9))
    line = values[np.where(grid >= t[after], after, after - 1)] if held else np.interp(grid, t, values)
    return np.where(hole, np.nan, line), (apart > usual) & ~hole & (grid > t[after - 1]) & (grid < t[after])
