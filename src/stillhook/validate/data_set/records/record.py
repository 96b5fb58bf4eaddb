"""A test of a campaign as the steps use it: signals on one even grid, its uninterrupted parts, and its load
cases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.spec.scenario import Mode

if TYPE_CHECKING:
    from stillhook.logs.types import Log
    from stillhook.validate.data_set.campaign import CraneTest


@dataclass(frozen=True)
class Segment:
    """An uninterrupted part of a record in one mode with one load, repeated by a run of the twin.

    first, last: samples [first, last) of the record; load: payload on the hook without the hook [kg]; s_w: wire out at
    its start [m]; s_w_min, s_w_max [m]; s_tip_pp: largest peak-to-peak of the tip over 30 s [m], 0 where it does not
    move; period: mean zero-crossing period of the tip [s], NaN where it does not move; mode of the PLC.
    """

    test: str
    first: int
    last: int
    start: float
    """Time of its first sample [s]."""
    duration: float
    load: float
    s_w: float
    s_w_min: float
    s_w_max: float
    s_tip_pp: float
    period: float
    mode: Mode


@dataclass(frozen=True)
class SegmentLag:
    """Lag of `late` behind `ahead` in a segment: seconds with standard uncertainty u [s], and the gain between
    both [-].

    s_w behind s_tip: lag of the winch with its control; e_c_measured + s_w behind s_tip: lag of the PLC's own tip
    behind the logged one, 0 where the PLC's tip was logged.
    """

    segment: int
    ahead: str
    late: str
    seconds: float
    u: float
    gain: float


@dataclass(frozen=True)
class ClockError:
    """Another clock of a log. signals stamped by it; against: reference of the comparison, "" where only roughly
    aligned; offset [s] and drift [-] that were corrected; u: standard uncertainty of the remainder [s]; u_drift."""

    signals: tuple[str, ...]
    against: str
    offset: float
    drift: float
    u: float
    u_drift: float


@dataclass(frozen=True)
class Record:
    """One test, read. `signals` on the even grid `t` (n,) [s from the first sample that counts], SI, NaN where unknown;
    step [s], an integer number of PLC cycles.

    Names of signals are those of `stillhook.variables`. s_tip, v_tip, a_tip are those that the PLC sees; e_c_measured
    is its error; mode by the numbers of `stillhook.variables` whatever the log's numbers. Signals that were not logged
    but follow from others (v_w from omega_m) are not filled in; see `Record.has`. Only wire out and tip height are
    derived where possible; see `derived`.
    """

    test: CraneTest
    log: Log
    t: FloatArray
    step: float
    signals: Mapping[str, FloatArray]
    segments: tuple[Segment, ...]
    statements: tuple[str, ...]
    """Statements from reading: quality, clocks, lags."""
    doubtful: Mapping[str, BoolArray] = field(default_factory=dict)
    """(n,) samples at a sensor limit, bridged over a short gap, or unknown, by
    signal."""
    derived: frozenset[str] = frozenset()
    """Signals that were not logged but derived from others: s_w from a speed, s_tip from the PLC's error."""
    zero: float = 0.0
    """Time of t = 0 in the log [s from its first sample]."""
    lost: float = 0.0
    """Share of the expected samples (by the log's rate) that are missing."""
    longest_hole: float = 0.0
    """Longest time between two samples [s]."""
    lags: tuple[SegmentLag, ...] = ()
    """Lag of the wire behind the tip, by segment with heave compensation."""
    clocks: tuple[ClockError, ...] = ()
    """Other clocks of the log: errors that were corrected."""

    def has(self, *names: str) -> bool:
        """Whether these signals are available, logged or derived."""
        return all(name in self.signals for name in names)

    def part(self, segment: Segment, name: str) -> FloatArray:
        """A signal during a segment."""
        return self.signals[name][segment.first : segment.last]
