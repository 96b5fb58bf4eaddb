"""What a crane log is, once it is read: signals in SI on bins of time, and everything that was found on the way.

`Signal` is one row of a mapping (which column of the file is which signal), `Finding` one thing that was found,
repaired or noted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.units import number, show

Action = Literal["repaired", "left out", "noted"]


@dataclass(frozen=True)
class Signal:
    """One row of a mapping: value in SI = sign * (scale * raw + offset) read in `unit`.

    name is "time", a variable of Stillhook (p_a, omega_m, ...), or a name of the user's own with its `quantity`.
    """

    name: str
    column: str
    """Heading of the column, or its place counted from 1; "Date + Time" joins two columns of stamps."""
    unit: str | None = None
    """A unit of the kind; for time also "UTC" (ISO 8601 stamps) or a pattern such as "%d.%m.%Y %H:%M:%S%.f". None: as
    the file says."""
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0
    clock: str | None = None
    """Column with the time stamps of this signal, where another clock than that of `time` stamped it."""
    lo: float | None = None
    hi: float | None = None
    """Ends of the sensor's range [SI, in the sign of the signal]: samples there count as saturated."""
    quantity: str = ""
    """A key of `stillhook.units.KINDS`; "" for a pure number."""
    words: tuple[tuple[str, float], ...] = ()
    """Cells that are words, and the raw numbers that they represent, such as ("on", 1.0); upper and lower case are
    alike."""

    def say(self, value: float, digits: int = 4) -> str:
        """A value of this signal [SI] as text in its display unit; a pure number as it is."""
        return show(value, self.quantity, digits) if self.quantity else number(value, digits)


@dataclass(frozen=True)
class Finding:
    """One thing that was found in a log. kind: "gap", "missing", "stuck", "saturated", "time-backwards", "clock-drift",
    ..."""

    signal: str
    kind: str
    start: float
    end: float
    """First and last moment it concerns [s from the first sample]."""
    count: int
    action: Action
    text: str
    """One clear line."""


@dataclass(frozen=True)
class OtherClock:
    """Another clock of a log, brought onto the main one: time of the main clock = offset + (1 + drift) * its own, both
    from their first sample [s]. signals that it stamped; column of its stamps; scatter of the parts of the log that it
    was found from [s].
    """

    signals: tuple[str, ...]
    column: str
    offset: float
    drift: float
    scatter: float


@dataclass(frozen=True)
class Log:
    """A log on bins of time, in SI. Nothing is dropped in silence: what was left out, repaired or doubted is in
    `findings`."""

    source: str
    """Name of the file."""
    t: FloatArray
    """(n,) centres of the bins [s from the first sample], increasing; empty bins are left out."""
    signals: Mapping[str, FloatArray]
    """(n,) means of the samples in each bin, SI, NaN where none is good."""
    doubtful: Mapping[str, BoolArray]
    """(n,) bins that hold stuck, saturated or missing samples, by signal."""
    gaps: tuple[tuple[float, float], ...]
    """Holes in the time [s]: last sample before, first sample after."""
    findings: tuple[Finding, ...]
    rate: float
    """Samples per second in the file (median)."""
    samples: int
    """Samples read."""
    every: float = 0.1
    """Width of the bins [s]."""
    mapping: Mapping[str, Signal] | None = None
    """What was read as what, "time" included."""
    at: FloatArray | None = None
    """(n,) mean stamps of the samples in each bin [s from the first sample]: what a mean is of, to less than a bin;
    None: the centres."""
    number: NDArray[np.int64] | None = None
    """(n,) samples in each bin."""
    clocks: tuple[OtherClock, ...] = ()
    """Other clocks that were brought onto the main one."""

    @property
    def duration(self) -> float:
        """From the first bin to the last [s]."""
        return float(self.t[-1] - self.t[0]) if len(self.t) else 0.0

    def kind(self, name: str) -> str:
        """Key of `stillhook.units.KINDS` of a signal, "" for a pure number."""
        return self.mapping[name].quantity if self.mapping and name in self.mapping else ""
