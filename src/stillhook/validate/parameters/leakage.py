"""Form of the leakage of the active circuit: published forms fitted to the flow balance, and the choice between them
by evidence.

Forms: one conductance ("constant", Moslatt 2020 E eq. 11), with the pumps' setting ("stroke", tables 2.5 and 2.6 times
a number), with the motors' speed ("speed", eq. 2.18), with both, and the crane file's own law times a number. In heave
compensation setting and speed are correlated, so the data may not exclude several of them: the interval then covers
these.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.library.leakage import form_of, pump_leak, stated_leak
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.crane import Crane
from stillhook.statistics.blocks import Fit, fit
from stillhook.statistics.estimate import NORMAL_95, Estimate, t_factor
from stillhook.units import parse
from stillhook.winches.circuits.tables import LeakForm, LeakPoint

FEWEST_FOR_FORM = 8
"""Least number of blocks to compare forms: their covariance is estimated from as many values less one."""
AGAINST = 0.01
"""Probability below which a form is refuted by the data."""
NOTABLE = 0.02
"""Least deviation in shape between the twin's law and the log's, as a part of the leakage, from which its form counts
as wrong [-]: slip of the electric motors and the lines' resistance cause one per cent."""
ALIVE = 0.05
"""Weight over that of the best form from which a form counts as not distinguished."""
SLIP, SLIP_SPREAD = 0.01, 0.006
"""Slip of electric motors at full flow and SLIP_PRESSURE before any data, and its deviation [-]: data sheets of 200 to
500 kW motors have 0.5 to 1.5 %, and the passive circuit's pumps load them too."""
SLIP_PRESSURE = parse("250 bar", "pressure")
UNCLOSED = 0.0013
"""Flow over that of the pumps that the balance leaves open regardless of the samples [-]: leakage that rises with
the stroke resembles slip, and no pump follows one of the forms exactly. On 85 simulated cranes the leakage was low by
0.1 % of the pumps' flow."""
PRESSURE_SPREAD = 0.2
"""Deviation of the rise of a leak's conductance up to SLIP_PRESSURE, over that without pressure [-]: gaps open, oil
flows past edges. No form has it and no column shows it, for setting, slip and pressure rise together: what it makes at
the pressure of the data is an error of the leakage there."""
SIGNS = {"C_h": -1.0, "slip": -1.0}
"""Sign of those that take flow."""
PARTS = ("head", "stroke", "speed")
LINEAR = ("head", "alpha")
"""Parts of a leak that rises in proportion to the pumps' setting: of the form "stroke", but no table of the library."""
ONE_SLOPE = (LINEAR, ("head", "speed"))
"""Leak laws with one slope, the simplest that show the uncertainty of the slope."""
EXTRAPOLATED = 0.25
"""Half width of the interval at the crane file's setting and speed beyond which the data do not determine the leakage
there, so that no law is offered [-]: the criteria's limit."""
OUTER = 0.02
"""Share of the rows at either end that do not count for the range of the data [-]."""
NUISANCE = ("Q_p", "way", "C_h", "rate", "slip")
"""Columns in addition to the leak: ratio of the displacements, zero of the pumps' setting, capacitance of the line, lag
of the speed, and slip of the electric motors that drive the pumps, which takes flow like a leak that rises with setting
and pressure."""


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
        of_pumps = UNCLOSED * float(np.sum(np.abs(self.Q_p[self.used]))) / self.total("file")
        return math.hypot(of_pumps, NORMAL_95 * PRESSURE_SPREAD * abs(self.at.p) / SLIP_PRESSURE)

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


@dataclass(frozen=True)
class Candidate:
    """A form fitted to the balance. parts: its columns, ("file",) for the crane file's law times a number; fit: of
    `NUISANCE`, with or without slip, and these; value: leak flow over the crane file's in the data, less 1; reference:
    conductance at the crane file's point [m^3/s/Pa]; p: probability of data that contradict the form as much if it
    were true; weight among the forms; alive: not excluded by the data."""

    form: LeakForm
    parts: tuple[str, ...]
    fit: Fit
    value: Estimate
    reference: Estimate
    p: float
    weight: float
    alive: bool

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficient of each part: head and speed are conductances [m^3/s/Pa, m^3/rad/Pa], stroke and file numbers
        [-]."""
        return dict(zip(self.parts, (float(b) for b in self.fit.b[-len(self.parts) :]), strict=True))


@dataclass(frozen=True)
class LeakChoice:
    """The form supported by the data: the crane file's where it is not excluded, otherwise that of most weight. value:
    leakage over the crane file's at the working point of the data, less 1, whose interval covers the forms not excluded
    by the data; reference: conductance at the crane file's point; stated: the crane file's there; twin: the crane
    file's law at the working point [m^3/s/Pa]; bend: part of the leakage by which the crane file's law, scaled, differs
    from the chosen one over the data, as a deviation [-]; refuted: the crane file's form is; in_file_form: value that
    the crane file's law, scaled, would give; sloped: the laws of `ONE_SLOPE` that the data leave by their parts,
    whatever the sign of their slope; file_at: the crane file's point; span: pressures, settings and speeds of the
    data."""

    chosen: Candidate
    candidates: tuple[Candidate, ...]
    file_form: LeakForm
    value: Estimate
    reference: Estimate
    stated: float
    twin: float
    at: WorkingPoint
    bend: float
    refuted: bool
    in_file_form: Estimate
    sloped: tuple[tuple[tuple[str, ...], Fit], ...]
    file_at: LeakPoint
    span: Span

    @property
    def at_file_point(self) -> Estimate:
        """Leakage at the crane file's point over the one that it states there, less 1."""
        r = self.reference
        return Estimate.around(r.value / self.stated - 1.0, r.half / self.stated, r.n, r.structural / self.stated)

    @property
    def offered(self) -> bool:
        """Whether the chosen law may replace that of a crane file, at the pressure of the data: they determine its
        value at the file's setting and speed, and a file can state it. One that rises in proportion to the pumps'
        setting is in no table."""
        return self.refuted and self.at_file_point.half <= EXTRAPOLATED and self.chosen.parts != LINEAR

    @property
    def beyond_pressure(self) -> float:
        """Pressure by which the crane file's point is outside the data, above positive [Pa]; 0 inside, or where the
        file states none. Leakage measured at one pressure says nothing of another: every form is proportional to
        pressure, and no form is fitted over it."""
        return outside_of(self.file_at.p, self.span.p)

    def nuisance(self, name: str, add: float = 0.0, factor: float = 1.0) -> Estimate:
        """Coefficient of one of `NUISANCE` times a factor, plus a number, with an interval across the forms."""
        i = NUISANCE.index(name)

        def of(c: Candidate) -> Estimate:
            return Estimate.around(factor * float(c.fit.b[i]) + add, factor * c.fit.half(i), c.fit.blocks)

        return _across(of(self.chosen), [(c.weight, of(c)) for c in self.candidates], self.chosen.fit.blocks)

    def over(self, rows: LeakRows) -> Estimate:
        """Leakage over the crane file's at the working point of other rows, less 1; interval across the forms."""
        each = [(c.weight, _value(rows, c.parts, c.fit)) for c in self.candidates]
        free = [_value(rows, *law) for law in self.sloped]
        best = _value(rows, self.chosen.parts, self.chosen.fit)
        return _across(best, each, self.chosen.fit.blocks, free, rows.unclosed)

    @property
    def slip(self) -> Estimate | None:
        """Slip of the electric motors at full flow and the pressure for which its column was made [-]; None where it
        was not fitted."""
        c = self.chosen
        return self.nuisance("slip") if len(c.fit.b) == len(NUISANCE) + len(c.parts) else None

    @property
    def remaining_forms(self) -> tuple[LeakForm, ...]:
        """Forms not excluded by the data, the best first."""
        return tuple(dict.fromkeys(c.form for c in self.candidates if c.alive))


FORMS: tuple[tuple[LeakForm, tuple[str, ...]], ...] = (
    (LeakForm.CONSTANT, ("head",)),
    (LeakForm.STROKE, ("head", "stroke")),
    (LeakForm.STROKE, LINEAR),
    (LeakForm.SPEED, ("head", "speed")),
    (LeakForm.STROKE_SPEED, PARTS),
)
Option = tuple[LeakForm, tuple[str, ...], Fit, tuple[float, int]]


def choose(crane: Crane, rows: LeakRows) -> LeakChoice | None:
    """Fit the forms and weigh them; None where not even the crane file's own law can be fitted.

    The widest law that the data carry is fitted with a covariance from blocks left out in turn, so that errors may be
    autocorrelated within a block. A form is a plane in its coefficients; how far they lie from it, in that covariance,
    is Hotelling's T^2. Evidence is m ln(1 + T^2/(m-1)) + k ln m over m blocks and k coefficients (BIC with the blocks
    as the data). A form with a negative conductance is none.
    """
    nuisance = _nuisance_columns(rows)
    file_fit = _fitted(rows, nuisance, ("file",))
    if file_fit is None:
        return None
    widest = _widest(rows, nuisance) if file_fit.blocks >= FEWEST_FOR_FORM else None
    file = form_of(crane.active)
    options: list[Option] = [(file.form, ("file",), file_fit, _distance(rows, widest, ("file",)))]
    if widest is None:
        return _chosen(crane, rows, options, 0, ())
    forms = [(form, parts) for form, parts in FORMS if parts == LINEAR or set(parts) <= set(widest[0])]
    fitted = {parts: _fitted(rows, nuisance, parts) for parts in {*(parts for _, parts in forms), *ONE_SLOPE}}
    laws = {parts: (fitted, _distance(rows, widest, parts)) for parts, fitted in fitted.items() if fitted is not None}
    for form, parts in forms:
        if parts == ("head",) and file.form is LeakForm.CONSTANT:
            continue  # the crane file's own
        if parts == LINEAR and len(widest[0]) < len(LINEAR):
            continue  # the data determine no slope
        if parts in laws and (laws[parts][0].b[-len(parts) :] >= 0.0).all():
            options.append((form, parts, *laws[parts]))
    misfits = {
        parts: fitted for parts, (fitted, distance) in laws.items() if _probability(*distance, fitted.blocks) >= AGAINST
    }
    sloped = tuple((parts, misfits[parts]) for parts in ONE_SLOPE if parts in misfits)
    return _chosen(crane, rows, options, len(widest[0]), sloped)


def _nuisance_columns(rows: LeakRows) -> tuple[str, ...]:
    """Columns in addition to the leak: slip is included only where the data support it and it is not negative."""
    widest = _widest(rows, NUISANCE)
    return NUISANCE if widest is not None and widest[1].b[NUISANCE.index("slip")] > 0.0 else NUISANCE[:-1]


def _fitted(rows: LeakRows, nuisance: tuple[str, ...], parts: tuple[str, ...]) -> Fit | None:
    """Least squares, then the prior knowledge of slip."""
    columns = [SIGNS.get(n, 1.0) * rows.column(n) for n in nuisance]
    fitted = fit((*columns, *(-rows.column(p) for p in parts)), rows.Q_m, rows.block)
    return _informed(fitted, nuisance.index("slip")) if fitted is not None and "slip" in nuisance else fitted


def _informed(fitted: Fit, i: int) -> Fit:
    """The fit with the slip, coefficient i, and its prior, by the covariance of the blocks (Bayes, normal)."""
    gain = fitted.cov[:, i] / (fitted.cov[i, i] + SLIP_SPREAD**2)
    cov = fitted.cov - np.outer(gain, fitted.cov[i])
    return replace(fitted, b=fitted.b + gain * (SLIP - fitted.b[i]), cov=0.5 * (cov + cov.T))


def _widest(rows: LeakRows, nuisance: tuple[str, ...]) -> tuple[tuple[str, ...], Fit] | None:
    """The law with most parts supported by the data, and its fit."""
    for parts in (PARTS, ("head", "speed"), ("head", "stroke"), ("head",)):
        fitted = _fitted(rows, nuisance, parts)
        if fitted is not None and fitted.blocks > len(parts) + 1:
            return parts, fitted
    return None


def _distance(rows: LeakRows, widest: tuple[tuple[str, ...], Fit] | None, parts: tuple[str, ...]) -> tuple[float, int]:
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


def _probability(T2: float, q: int, m: int) -> float:
    """Probability of at least this T^2 with q conditions, from m blocks."""
    from scipy.special import fdtrc  # heavy: only where something is fitted

    return 1.0 if q == 0 else float(fdtrc(q, m - q, T2 * (m - q) / (q * (m - 1))))


def _chosen(
    crane: Crane,
    rows: LeakRows,
    options: Sequence[Option],
    carried: int,
    sloped: tuple[tuple[tuple[str, ...], Fit], ...],
) -> LeakChoice:
    file = form_of(crane.active)
    stroke = float(pump_leakage(file.at.alpha_p, pump_leak(crane.active.pump)))
    stated = stated_leak(crane.active)
    # conductance at the crane file's point per coefficient of each part
    per = {
        "head": 1.0,
        "stroke": stroke,
        "alpha": file.at.alpha_p,
        "speed": file.at.n_m,
        "file": stated,
    }
    m = options[0][2].blocks
    evidence = np.array([m * math.log1p(T2 / (m - 1)) + (carried - q) * math.log(m) for *_, (T2, q) in options])
    weights = np.exp(-0.5 * (evidence - evidence.min()))
    weights /= weights.sum()
    least = ALIVE * float(weights.max())
    unsorted = [
        Candidate(
            form=form,
            parts=parts,
            fit=f,
            value=_value(rows, parts, f),
            reference=_reference(per, parts, f),
            p=_probability(T2, q, m),
            weight=float(w),
            alive=bool(w >= least),
        )
        for (form, parts, f, (T2, q)), w in zip(options, weights, strict=True)
    ]
    candidates = sorted(unsorted, key=lambda c: -c.weight)
    file_candidate = next(c for c in candidates if c.parts == ("file",))
    best = file_candidate if file_candidate.alive else candidates[0]
    bend = _bend(rows, best)
    values, references = ([(c.weight, getattr(c, name)) for c in candidates] for name in ("value", "reference"))
    free_values = [_value(rows, *law) for law in sloped]
    free_references = [_reference(per, *law) for law in sloped]
    blocks, unclosed = best.fit.blocks, rows.unclosed
    return LeakChoice(
        chosen=best,
        candidates=tuple(candidates),
        file_form=file.form,
        value=_across(best.value, values, blocks, free_values, unclosed),
        reference=_across(best.reference, references, blocks, free_references, unclosed * stated),
        stated=stated,
        twin=rows.total("file") / rows.total("head"),
        at=rows.at,
        bend=bend,
        refuted=file_candidate is not best and file_candidate.p < AGAINST and bend > NOTABLE,
        in_file_form=file_candidate.value,
        sloped=sloped,
        file_at=file.at,
        span=rows.span,
    )


def _across(
    best: Estimate,
    each: Sequence[tuple[float, Estimate]],
    blocks: int,
    free: Sequence[Estimate] = (),
    unclosed: float = 0.0,
) -> Estimate:
    """The best form's estimate with an interval across the forms by their weights (Burnham and Anderson 2002), and the
    unclosed flow.

    It is never narrower than that of a law with one slope (free) and what that differs by: evidence prefers a law
    without a slope to one with a slope that is small but not nil, and a crane's law matches none of the published ones
    exactly.
    """
    apart = math.sqrt(sum(w * (e.value - best.value) ** 2 for w, e in each))
    least = max((math.hypot(e.half, e.value - best.value) for e in free), default=0.0)
    structural = math.hypot(max(t_factor(blocks - 1) * apart, math.sqrt(max(least**2 - best.half**2, 0.0))), unclosed)
    return Estimate.around(best.value, math.hypot(best.half, structural), best.n, structural)


def _linear(fitted: Fit, weights: FloatArray) -> Estimate:
    """A linear function of a form's coefficients."""
    k = len(weights)
    variance = float(weights @ fitted.cov[-k:, -k:] @ weights)
    return Estimate.around(
        float(weights @ fitted.b[-k:]), t_factor(fitted.blocks - 1) * math.sqrt(max(variance, 0.0)), fitted.blocks
    )


def _value(rows: LeakRows, parts: tuple[str, ...], fitted: Fit) -> Estimate:
    total = rows.total("file")
    e = _linear(fitted, np.array([rows.total(p) / total for p in parts]))
    return Estimate.around(e.value - 1.0, e.half, e.n)


def _reference(per: Mapping[str, float], parts: tuple[str, ...], fitted: Fit) -> Estimate:
    return _linear(fitted, np.array([per[p] for p in parts]))


def _bend(rows: LeakRows, best: Candidate) -> float:
    """Deviation of the crane file's law, scaled to the same flow, from the chosen one over the mean leak flow [-]."""
    good = rows.used
    law = np.sum([b * rows.column(p)[good] for p, b in best.coefficients.items()], axis=0)
    file_flow = rows.file[good] * (np.sum(law) / np.sum(rows.file[good]))
    return float(np.sqrt(np.mean((law - file_flow) ** 2)) / abs(float(np.mean(law))))


IN_WORDS = {
    LeakForm.CONSTANT: "is constant",
    LeakForm.STROKE: "rises with the pumps' stroke",
    LeakForm.SPEED: "rises with the motors' speed",
    LeakForm.STROKE_SPEED: "rises with stroke and speed",
}
