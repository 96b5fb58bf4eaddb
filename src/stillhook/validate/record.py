"""A test of a campaign as the steps use it: signals on one even grid, its unbroken parts, and the load cases that it holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stillhook.scenario import Mode

if TYPE_CHECKING:
    from stillhook.io.log_types import Log
    from stillhook.validate.campaign import CraneTest

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Segment:
    """An unbroken part of a record in one mode with one load: what a run of the twin repeats.

    first, last: samples [first, last) of the record; load: payload on the hook without the hook [kg]; s_w: wire out at its start [m];
    s_w_min, s_w_max [m]; s_tip_pp: largest peak-to-peak of the tip over 30 s [m], 0 where it does not move; period: mean zero-crossing
    period of the tip [s], NaN where it does not move; mode of the PLC.
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
class Record:
    """One test, read. `signals` on the even grid `t` (n,) [s from the first sample], SI, NaN where nothing is known; step [s].

    Names of signals are those of `stillhook.variables`. s_tip, v_tip, a_tip are those that the PLC sees; e_c_measured is its error.
    Signals that were not logged but follow from others (v_w from omega_m) are not filled in; see `Record.has`.
    """

    test: CraneTest
    log: Log
    t: FloatArray
    step: float
    signals: Mapping[str, FloatArray]
    segments: tuple[Segment, ...]
    statements: tuple[str, ...]
    """What was found on the way: quality, clocks, lags."""

    def has(self, *names: str) -> bool:
        """Whether these signals were logged."""
        return all(name in self.signals for name in names)

    def part(self, segment: Segment, name: str) -> FloatArray:
        """A signal during a segment."""
        return self.signals[name][segment.first : segment.last]
