"""Windows of the flow balance, and fits of leak laws to them, with what is known before any data of slip and of a rise
with pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.statistics.blocks import Fit, fit
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
    """Range of pressure difference [Pa], pumps' setting [-] and motors' speed [rad/s] in the data, without `OUTER` at
    either end."""

    p: tuple[float, float]
    alpha_p: tuple[float, float]
    n_m: tuple[float, float]


def outside_of(x: float | None, ends: tuple[float, float]) -> float:
    """How far a number is above or below a range; 0 inside."""
    return 0.0 if x is None else min(x - ends[0], 0.0) + max(x - ends[1], 0.0)


class WorkingPoint(NamedTuple):
    """Mean pressure difference [Pa], setting of the pumps [-], speed of the motors [rad/s] of the leakage in the
    data."""

    p: float
    alpha_p: float
    n_m: float


SLIP, SLIP_SPREAD = 0.01, 0.006
"""Slip of electric motors at full flow and SLIP_PRESSURE before any data, and its deviation [-]: data sheets of 200 to
500 kW motors have 0.5 to 1.5 %, and the passive circuit's pumps load them too."""
RISE = 0.6
"""Largest change of a leak's conductance up to SLIP_PRESSURE, over that without pressure, for which intervals hold [-].

No published table states it: Moslatt 2020 section 2.5.2.4 has "small variations" between 100 and 350 bar for the
A4VSG355, and public models of measured axial piston units have a slip without any (Pourmovahed et al. 1992, 107
cm^3/rev, as others quote it: turbulent slip 0). So it is what laminar gaps can do up to 250 bar, flow as h^3/mu. A bore
of 36 mm in a barrel with 6 mm of steel around it widens by 8 um and its piston shrinks by 1.5 um at 250 bar (Lame), on
18 um of clearance (assumed), and by nothing at the exit: 1.9 times the flow. Pistons have about half of the leak
(assumed), slippers and barrel are balanced: +45 %. Oil is thicker under pressure (Barus, 2e-8 1/Pa, mean over the gap):
-21 %. Throttling heats it by 15 K towards the exit, at 3 % per kelvin: +25 %. Together -20 to +45 %; the share of edges
(root of the pressure) falls. 0.6 either way leaves a margin."""
RISE_SPREAD = RISE / math.sqrt(3.0)
"""Deviation of that change where any within RISE is as likely [-]: what is known of it before any data."""
SIZE_ROUNDS, LEAST_SIZE = 2, 0.2
"""Rounds in which the size of the leak is found, and its least one over the twin's [-]."""
SIGNS = {"C_h": -1.0, "rise": -1.0, "slip": -1.0}
"""Sign of those that take flow."""
PARTS = ("head", "stroke", "speed")
LINEAR = ("head", "alpha")
"""Parts of a leak that rises in proportion to the pumps' setting: of the form "stroke", but no table of the library."""
NUISANCE = ("Q_p", "way", "C_h", "rate", "rise", "slip")
"""Columns in addition to the leak: ratio of the displacements, zero of the pumps' setting, capacitance of the line, lag
of the speed, change of the leak's conductance with pressure, and slip of the electric motors that drive the pumps,
which takes flow like a leak that rises with setting and pressure. Setting, slip and pressure rise together, so that the
last two rest on what is known before any data."""


def leak_size(rows: LeakRows) -> float:
    """Mean conductance of the leak in the data [m^3/s/Pa]: the twin's, and then that of the widest law."""
    twin = size = rows.total("file") / rows.total("head")
    for _ in range(SIZE_ROUNDS):
        widest = widest_law(rows, NUISANCE, size)
        if widest is None:
            return size
        parts, fitted = widest
        flow = sum(float(b) * rows.total(p) for b, p in zip(fitted.b[-len(parts) :], parts, strict=True))
        size = max(flow / rows.total("head"), LEAST_SIZE * twin)
    return size


def nuisance_columns(rows: LeakRows, size: float) -> tuple[str, ...]:
    """Columns in addition to the leak: slip is included only where the data support it and it is not negative."""
    widest = widest_law(rows, NUISANCE, size)
    return NUISANCE if widest is not None and widest[1].b[NUISANCE.index("slip")] > 0.0 else NUISANCE[:-1]


def fitted_law(rows: LeakRows, nuisance: tuple[str, ...], parts: tuple[str, ...], size: float) -> Fit | None:
    """Least squares, then the prior knowledge of the rise with pressure, of a leak of this size, and of the slip."""
    columns = [SIGNS.get(n, 1.0) * rows.column(n) for n in nuisance]
    fitted = fit((*columns, *(-rows.column(p) for p in parts)), rows.Q_m, rows.block)
    if fitted is None:
        return None
    fitted = _informed(fitted, nuisance.index("rise"), 0.0, RISE_SPREAD * size)
    return _informed(fitted, nuisance.index("slip"), SLIP, SLIP_SPREAD) if "slip" in nuisance else fitted


def _informed(fitted: Fit, i: int, value: float, spread: float) -> Fit:
    """The fit with what is known of coefficient i before, by the covariance of the blocks (Bayes, normal)."""
    gain = fitted.cov[:, i] / (fitted.cov[i, i] + spread**2)
    cov = fitted.cov - np.outer(gain, fitted.cov[i])
    return replace(fitted, b=fitted.b + gain * (value - fitted.b[i]), cov=0.5 * (cov + cov.T))


def widest_law(rows: LeakRows, nuisance: tuple[str, ...], size: float) -> tuple[tuple[str, ...], Fit] | None:
    """The law with most parts supported by the data, and its fit."""
    for parts in (PARTS, ("head", "speed"), ("head", "stroke"), ("head",)):
        fitted = fitted_law(rows, nuisance, parts, size)
        if fitted is not None and fitted.blocks > len(parts) + 1:
            return parts, fitted
    return None


def distance_of_form(
    rows: LeakRows, widest: tuple[tuple[str, ...], Fit] | None, parts: tuple[str, ...]
) -> tuple[float, int]:
    """Hotelling's T^2 of the widest law's coefficients against a form, and the number of the form's conditions."""
    if widest is None:
        return 0.0, 0
    names, fitted = widest
    k = len(names)
    theta, V = fitted.b[-k:], fitted.cov[-k:, -k:]
    if not set(parts) <= set(names):
        good = rows.used
        X = np.column_stack([rows.column(n)[good] for n in names])
        Z = np.column_stack([rows.column(p)[good] for p in parts])
        scale = np.sqrt(np.sum(X * X, axis=0))
        A = np.linalg.lstsq(X / scale, Z, rcond=None)[0] / scale[:, None]
    else:
        A = np.eye(len(names))[:, [names.index(p) for p in parts]]
    u = np.sqrt(np.diag(V))
    L = np.linalg.cholesky(V / np.outer(u, u))
    y, B = np.linalg.solve(L, theta / u), np.linalg.solve(L, A / u[:, None])
    B = B / np.sqrt(np.sum(B * B, axis=0))
    rest = y - B @ np.linalg.lstsq(B, y, rcond=None)[0]
    return float(np.sum(rest * rest)), len(names) - A.shape[1]


def probability(T2: float, q: int, m: int) -> float:
    """Probability of at least this T^2 with q conditions, from m blocks."""
    from scipy.special import fdtrc  # heavy: only where something is fitted

    return 1.0 if q == 0 else float(fdtrc(q, m - q, T2 * (m - q) / (q * (m - 1))))


def tension(fitted: Fit, parts: tuple[str, ...], size: float) -> float:
    """Squared distance, in deviations, of rise with pressure and slip that a law needs from what is known
    beforehand."""
    rise = float(fitted.b[NUISANCE.index("rise")]) / (RISE_SPREAD * size)
    slips = len(fitted.b) == len(NUISANCE) + len(parts)
    slip = (float(fitted.b[NUISANCE.index("slip")]) - SLIP) / SLIP_SPREAD if slips else 0.0
    return rise**2 + slip**2


def probability_of_tension(tension: float) -> float:
    """Probability of at least this distance of both."""
    return math.exp(-0.5 * tension)
