"""Windows of the flow balance that the leakage is fitted to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.units import parse

SLIP_PRESSURE = parse("250 bar", "pressure")
UNCLOSED = 0.0013
"""Flow over that of the pumps that the balance leaves open regardless of the samples [-]: leakage that rises with
the stroke resembles slip, and no pump follows one of the forms exactly. On 85 simulated cranes the leakage was low by
0.1 % of the pumps' flow."""
OUTER = 0.02
"""Share of the rows at either end that do not count for the range of the data [-]."""


@dataclass(frozen=True)
class LeakRows:
    """Windows of the flow balance towards the higher line, each (n,). Q_m, Q_p motor and pump flow, C_h flow of the
    capacitance [m^3/s]; rate flow of the motors' acceleration [m^3/s^2]; way 1 or -1; block of time; head pressure that
    drives the leak per total conductance [Pa]; stroke flow of the pumps' table [m^3/s]; speed head times speed [Pa
    rad/s]; file flow of the crane file's law [m^3/s]; slip flow of electric motors with a slip of 1 [m^3/s]; alpha head
    times setting [Pa]; dp pressure difference [Pa]."""

    Q_m: FloatArray
    Q_p: FloatArray
    way: FloatArray
    C_h: FloatArray
    rate: FloatArray
    block: IntArray
    head: FloatArray
    stroke: FloatArray
    speed: FloatArray
    file: FloatArray
    slip: FloatArray
    alpha: FloatArray
    dp: FloatArray

    @property
    def used(self) -> BoolArray:
        """Rows used in a fit, (n,)."""
        return np.isfinite(self.Q_m) & np.isfinite(
            self.Q_p + self.C_h + self.rate + self.head + self.stroke + self.speed
        )

    def column(self, name: str) -> FloatArray:
        """Leak flow per coefficient of one part of a law, or of the crane file's law."""
        return np.asarray(getattr(self, name))

    def total(self, name: str) -> float:
        """Sum of a column over the rows in use."""
        return float(np.sum(self.column(name)[self.used]))

    @property
    def unclosed(self) -> float:
        """Flow that the balance leaves open over that of the crane file's law [-]."""
        return UNCLOSED * float(np.sum(np.abs(self.Q_p[self.used]))) / self.total("file")

    @property
    def pressure(self) -> float:
        """Pressure difference at which these rows have their mean conductance, for one that rises in proportion
        [Pa]."""
        return float(np.sum((self.head * self.dp)[self.used])) / self.total("head")

    @property
    def rise(self) -> FloatArray:
        """Leak flow per conductance that is added up to SLIP_PRESSURE, about the mean conductance of these rows: it
        adds nothing to their sum [Pa]."""
        return self.head * (self.dp - self.pressure) / SLIP_PRESSURE

    @property
    def at(self) -> WorkingPoint:
        """Working point of the leakage of these rows; setting and speed weighted by the driving pressure."""
        head = self.total("head")
        return WorkingPoint(float(np.mean(self.dp[self.used])), self.total("alpha") / head, self.total("speed") / head)

    @property
    def span(self) -> Span:
        """Range of the leakage in these rows."""
        good = self.used & (self.head > 0.0)

        def ends(x: FloatArray) -> tuple[float, float]:
            low, high = np.quantile(x[good], (OUTER, 1.0 - OUTER))
            return float(low), float(high)

        with np.errstate(divide="ignore", invalid="ignore"):
            return Span(ends(self.dp), ends(self.alpha / self.head), ends(self.speed / self.head))


class Span(NamedTuple):
    """Smallest and largest pressure difference [Pa], setting of the pumps [-] and speed of the motors [rad/s] of the
    data, without `OUTER` at either end."""

    p: tuple[float, float]
    alpha_p: tuple[float, float]
    n_m: tuple[float, float]


def outside_of(x: float | None, ends: tuple[float, float]) -> float:
    """How far a number is above or below a range; 0 inside."""
    return 0.0 if x is None else min(x - ends[0], 0.0) + max(x - ends[1], 0.0)


class WorkingPoint(NamedTuple):
    """Working point of the leakage in the data: mean pressure difference [Pa], setting of the pumps [-], speed of the
    motors [rad/s]."""

    p: float
    alpha_p: float
    n_m: float
