"""Criteria of validation on sliding windows of a stream: value, 95 % interval, limit and status of each."""

from __future__ import annotations

import math
import tomllib
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from enum import StrEnum
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import Accuracies
from stillhook.live.watch.windows.batches import BATCH, WINDOWS, Sums
from stillhook.live.watch.windows.calibration import Calibration
from stillhook.live.watch.windows.measures import Measures, errors
from stillhook.live.watch.windows.rows import Piece
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.validate.criteria.criteria import Criteria, Criterion, load_criteria
from stillhook.validate.criteria.judge import in_words, interval_words, verdict_of
from stillhook.validate.criteria.results import Measure, Verdict

_TABLE = tomllib.loads((files("stillhook.live.watch.windows") / "stream.toml").read_text(encoding="utf-8"))
NOT_JUDGED: Mapping[str, str] = {key: _TABLE["reasons"][why] for key, why in _TABLE["not_judged"].items()}
"""Criteria that no stream can judge, with the reason."""
REMARKS: Mapping[str, str] = _TABLE["remarks"]
"""Where the stream's figure is not quite that of validation."""
STRUCTURAL: Mapping[str, float] = _TABLE["structural"]
"""Half widths that form of the laws, clock and resolution add [unit of the measure]."""
EXTREMES = ("e_c_max_difference", "length_jump", "p_max_over_relief")
OVERLAPPING = ("e_c_pp_deviation", "eta_c_deviation_high")
"""Measures of windows that are 30 s long themselves: over 30 s they are one value, which has no interval."""
NO_DATA = "signals are not logged, or say nothing in this window"


class Status(StrEnum):
    """Of a criterion in a window: all of the interval within the limit, none of it, some of it; not enough rows yet."""

    OK = "ok"
    NOT_OK = "not ok"
    CANNOT_TELL = "cannot tell"
    FILLING = "filling"


_STATUS = {Verdict.SHOWN: Status.OK, Verdict.REFUTED: Status.NOT_OK}


class WindowResult(NamedTuple):
    """One criterion in one window. key, title of the criterion; window; value, low, high of its measure [SI], NaN where
    there is none; limit and text as people read them; status; of: signal that it is of, "" for all."""

    key: str
    title: str
    window: str
    value: float
    low: float
    high: float
    limit: str
    text: str
    status: Status
    of: str = ""

    @property
    def filling(self) -> WindowResult:
        """The same without a verdict yet."""
        nan = math.nan
        return self._replace(value=nan, low=nan, high=nan, text="-", status=Status.FILLING)


class CriteriaWatch:
    """Every criterion that a stream can judge, over its windows."""

    def __init__(self, crane: Crane, accuracies: Accuracies | None = None) -> None:
        self.criteria: Criteria = load_criteria("paper-f" if "active" in crane.circuits else "any-drive")
        self.measures = Measures(crane)
        self._calibration = Calibration(self.measures.balances.balance, accuracies)
        self._relief = crane.circuits["active"].relief.p if "active" in crane.circuits else math.nan
        self._sums = {key: Sums(of) for key, of in self.measures.statistics.items()}
        most = round(max(WINDOWS.values()) / BATCH)
        self._extremes: deque[FloatArray] = deque(maxlen=most)
        self.batches = 0
        self._known: dict[tuple[str, str], Estimate | None] = {}  # of the batches so far

    @property
    def not_judged(self) -> dict[str, str]:
        """Criteria without a line, and why."""
        own = {c.key for c in self.criteria.criteria} - {c.key for c in self.judged}
        return {c.key: NOT_JUDGED.get(c.key, NO_DATA) for c in self.criteria.criteria if c.key in own}

    @property
    def judged(self) -> tuple[Criterion, ...]:
        """Criteria that have a statistic."""
        known = {key.partition("/")[0] for key in self._sums} | set(EXTREMES)
        return tuple(c for c in self.criteria.criteria if c.key not in NOT_JUDGED and c.measure in known)

    def add(self, piece: Piece) -> None:
        """One more batch."""
        sums = self.measures.sums(piece)
        for key, of in self._sums.items():
            width = len(sums[key]) if key in sums else of.width
            if width:
                of.add(sums.get(key, np.zeros(width)))
        self._extremes.append(_extremes(piece, self._relief))
        self._calibration.add(piece)
        self.batches += 1
        self._known = {}

    def estimate(self, key: str, window: str) -> Estimate | None:
        """Of a statistic; None while the window fills."""
        if (key, window) not in self._known:
            full = self.batches >= round(WINDOWS[window] / BATCH)
            self._known[key, window] = self._sums[key].estimate(window) if full else None
        return self._known[key, window]

    def calibrated(self, key: str, window: str) -> Estimate | None:
        """The same with what the calibration of the sensors adds to the interval."""
        found = self.estimate(key, window)
        return found and _widened(found, self._calibration.half(key, window))

    def structural(self, measure: str, window: str) -> float:
        """Half width that no row shows [unit of the measure]: calibration of the sensors, form of a law, clock."""
        return STRUCTURAL.get(measure, 0.0) + self._calibration.half(measure, window)

    def results(self) -> Iterator[WindowResult]:
        """All lines, a window after the other."""
        for window in WINDOWS:
            for c in self.judged:
                yield from self._lines(c, window)

    def _lines(self, c: Criterion, window: str) -> Iterator[WindowResult]:
        if window == "30 s" and c.measure in OVERLAPPING:
            return
        for of, found in self._estimates(c.measure, window):
            if found is None:
                yield WindowResult(
                    c.key, c.title, window, math.nan, math.nan, math.nan, c.limit_text, "-", Status.FILLING, of
                )
            elif math.isfinite(found.value):
                found = _widened(found, self.structural(c.measure, window))
                m = Measure.of(c.measure, found)
                status = _STATUS.get(verdict_of(c, m), Status.CANNOT_TELL)
                interval = interval_words(c, m)
                text = in_words(c, found.value) + (f" ({interval})" if interval else "")
                yield WindowResult(
                    c.key, c.title, window, found.value, found.low, found.high, c.limit_text, text, status, of
                )

    def _estimates(self, measure: str, window: str) -> Iterable[tuple[str, Estimate | None]]:
        if measure in EXTREMES:
            return [("", self._extreme(measure, window))]
        same = [key for key in self._sums if key.partition("/")[0] == measure]
        return [(key.partition("/")[2].removeprefix("signal "), self.estimate(key, window)) for key in same]

    def _extreme(self, measure: str, window: str) -> Estimate | None:
        count = round(WINDOWS[window] / BATCH)
        if self.batches < count:
            return None
        x = np.stack(list(self._extremes)[-count:])
        if measure == "length_jump":
            return Estimate(float(np.nanmax(x[:, 6])) if np.isfinite(x[:, 6]).any() else math.nan)
        if measure == "p_max_over_relief":
            return Estimate(float(np.nanmax(x[:, 7])) if np.isfinite(x[:, 7]).any() else math.nan)
        if not np.isfinite(x[:, 0]).any():
            return Estimate(math.nan)
        low_m, low_s = (float(np.nanmin(x[:, k])) for k in (0, 3))
        high_m, high_s = (float(np.nanmax(x[:, k])) for k in (1, 4))
        mean_m, mean_s = (float(np.nanmean(x[:, k])) for k in (2, 5))
        largest = [
            max(high - mean, mean - low) for low, high, mean in ((low_m, high_m, mean_m), (low_s, high_s, mean_s))
        ]
        return Estimate(float(largest[1] - largest[0]))


def _widened(e: Estimate, by: float) -> Estimate:
    return Estimate(e.value, e.low - by, e.high + by, e.n, by) if by else e


def _extremes(p: Piece, relief: float) -> FloatArray:
    """Least, largest and mean control error of crane and twin [m]; largest jump of the wire that its speed does not
    explain [m]; highest pressure over the relief setting, less 1."""
    out = np.full(8, np.nan)
    both = errors(p)
    if both is not None:
        m, s = (x[p.new] for x in both)
        good = np.isfinite(m) & np.isfinite(s)
        if good.any():
            out[:6] = [f(x[good]) for x in (m, s) for f in (np.min, np.max, np.mean)]
    x = p.crane
    if "s_w" in x and "v_w" in x:
        jump = np.abs(np.diff(x["s_w"][p.new]) + 0.5 * p.every * (x["v_w"][p.new][1:] + x["v_w"][p.new][:-1]))
        out[6] = np.nanmax(jump) if np.isfinite(jump).any() else np.nan
    if "p_a" in x and "p_b" in x:
        top = np.fmax(x["p_a"], x["p_b"])[p.new]
        out[7] = np.nanmax(top) / relief - 1.0 if np.isfinite(top).any() else np.nan
    return out
