"""What the leakage of the active circuit goes with: published forms fitted to the flow balance, and the choice between
them by evidence.

Forms: one conductance ("constant", Moslatt 2020 E eq. 11), with the pumps' setting ("stroke", tables 2.5 and 2.6 times
a number), with the motors' speed ("speed", eq. 2.18), with both, and the crane file's own law times a number. In heave
compensation setting and speed go together, so that the data may leave several of them: the interval then holds across
these.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.library.leakage import Point, form_of, pump_leak, stated_leak
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.circuits import LeakForm, LeakPoint
from stillhook.spec.crane import Crane
from stillhook.statistics.between_cases import t_factor
from stillhook.statistics.jackknife_regression import Estimate, Fit, fit
from stillhook.units import parse, show

FEWEST_FOR_FORM = 8
"""Blocks from which forms are compared: their covariance is of as many numbers less one."""
AGAINST = 0.01
"""Probability below which a form is refuted by the data."""
NOTABLE = 0.02
"""Least part of the leakage by which the twin's law must bend another way than the log's before its form is called
wrong [-]: slip of the electric motors and the lines' resistance bend a right one by a hundredth."""
ALIVE = 0.05
"""Weight over that of the best form from which a form counts as not told apart."""
SLIP, SLIP_SPREAD = 0.01, 0.006
"""Slip of electric motors at full flow and SLIP_PRESSURE before any data, and its deviation [-]: data sheets of 200 to
500 kW motors have 0.5 to 1.5 %, and the passive circuit's pumps load them too."""
SLIP_PRESSURE = parse("250 bar", "pressure")
UNCLOSED = 0.0013
"""Flow over that of the pumps that the balance leaves open, whatever the samples [-]: leakage that rises with the
stroke looks like slip, and no pump's law is one of the forms to the letter. On 85 simulated cranes the leakage came out
low by 0.1 % of the
pumps' flow."""
SIGNS = {"C_h": -1.0, "slip": -1.0}
"""Sign of those that take flow."""
PARTS = ("head", "stroke", "speed")
LINEAR = ("head", "alpha")
"""Parts of a leak that rises in proportion to the pumps' setting: of the form "stroke", but no table of the library."""
ONE_SLOPE = (LINEAR, ("head", "speed"))
"""Laws of a leak with one slope, the least that says how sure the data are of its rise."""
EXTRAPOLATED = 0.25
"""Half width of the interval at the crane file's point beyond which the data do not tell the leakage there [-]: the
criteria's limit."""
NUISANCE = ("Q_p", "way", "C_h", "rate", "slip")
"""Columns beside the leak: ratio of the displacements, zero of the pumps' setting, capacitance of the line, lag of the
speed, and slip of the electric motors that drive the pumps, which takes flow as a leak that rises with setting and
pressure would."""


@dataclass(frozen=True)
class LeakRows:
    """Windows of the flow balance towards the higher line, each (n,). Q_m, Q_p motor and pump flow, C_h flow of the
    capacitance [m^3/s]; rate flow of the motors' acceleration [m^3/s^2]; way 1 or -1; block of time; head pressure that
    drives the leak per total conductance [Pa]; stroke flow of the pumps' table [m^3/s]; speed head times speed [Pa
    rad/s]; own flow of the crane file's law [m^3/s]; slip flow of electric motors with a slip of 1 [m^3/s]; alpha head
    times setting [Pa]; dp
    pressure
    difference [Pa]."""

    Q_m: FloatArray
    Q_p: FloatArray
    way: FloatArray
    C_h: FloatArray
    rate: FloatArray
    block: IntArray
    head: FloatArray
    stroke: FloatArray
    speed: FloatArray
    own: FloatArray
    slip: FloatArray
    alpha: FloatArray
    dp: FloatArray

    @classmethod
    def joined(cls, rows: Sequence[LeakRows]) -> LeakRows:
        return cls(*(np.concatenate([getattr(r, n) for r in rows]) for n in cls.__dataclass_fields__))

    @property
    def used(self) -> BoolArray:
        """Rows that a fit rests on, (n,)."""
        return np.isfinite(self.Q_m) & np.isfinite(
            self.Q_p + self.C_h + self.rate + self.head + self.stroke + self.speed
        )

    def column(self, name: str) -> FloatArray:
        """Leak flow per coefficient of one part of a law, or of the crane file's own."""
        out: FloatArray = getattr(self, name)
        return out

    def total(self, name: str) -> float:
        """Sum of a column over the rows in use."""
        return float(np.sum(self.column(name)[self.used]))

    @property
    def unclosed(self) -> float:
        """Flow that the balance leaves open, over what the crane file's law would take [-]."""
        return UNCLOSED * float(np.sum(np.abs(self.Q_p[self.used]))) / self.total("own")

    @property
    def at(self) -> WorkingPoint:
        """Where the leakage of these rows flows; setting and speed by the pressure that drives it."""
        head = self.total("head")
        return WorkingPoint(float(np.mean(self.dp[self.used])), self.total("alpha") / head, self.total("speed") / head)


class WorkingPoint(NamedTuple):
    """Where the leakage of the data flows: mean pressure difference [Pa], setting of the pumps [-], speed of the motors
    [rad/s]."""

    p: float
    alpha_p: float
    n_m: float


@dataclass(frozen=True)
class Candidate:
    """A form fitted to the balance. parts: its columns, ("own",) for the crane file's law times a number; fit: of
    `NUISANCE`, with or without slip, and these; value: leak flow over the crane file's in the data, less 1; reference:
    conductance at the crane file's point [m^3/s/Pa]; p: probability of data that speak as much against the form, were
    it true; weight among the forms; one of several that the data leave (alive)."""

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
        """Coefficient of each part: head and speed are conductances [m^3/s/Pa, m^3/rad/Pa], stroke and own numbers
        [-]."""
        return dict(zip(self.parts, (float(b) for b in self.fit.b[-len(self.parts) :]), strict=True))


@dataclass(frozen=True)
class LeakChoice:
    """The form that the data speak for: the crane file's own where they leave it, otherwise that of most weight. value:
    leakage over the crane file's at the working point of the data, less 1, whose interval holds across the forms that
    the data leave; reference: conductance at the crane file's point; stated: the crane file's there; twin: the crane
    file's law at the working point [m^3/s/Pa]; bend: part of the leakage by which the crane file's law, scaled, differs
    from the chosen one over the data, as a deviation [-]; refuted: the crane file's form is; in_own_form: value that
    the crane file's law, scaled, would give; sloped: the laws of `ONE_SLOPE` that the data leave by their parts,
    whatever the sign of
    their
    slope; file_at: the
    crane file's
    point."""

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
    in_own_form: Estimate
    sloped: tuple[tuple[tuple[str, ...], Fit], ...]
    file_at: LeakPoint

    @property
    def judged_at_file_point(self) -> bool:
        """Whether the leakage is judged at the crane file's point: its form is refuted, and the data tell the leakage
        there."""
        return self.refuted and self.at_file_point.half <= EXTRAPOLATED

    @property
    def judged(self) -> Estimate:
        """Leakage over the crane file's, less 1, at the point where it is judged: the crane file's, or else the working
        point."""
        return self.at_file_point if self.judged_at_file_point else self.value

    @property
    def judged_at(self) -> Point:
        """The point of `judged`."""
        return self.file_at if self.judged_at_file_point else self.at

    @property
    def at_file_point(self) -> Estimate:
        """Leakage at the crane file's point over the one that it states there, less 1."""
        r = self.reference
        return Estimate(r.value / self.stated - 1.0, r.half / self.stated, r.blocks, r.structural / self.stated)

    @property
    def offered(self) -> bool:
        """Whether the chosen law may go into a crane file instead of its own: the data tell its number there, and a
        file can state it. One that rises in proportion to the pumps' setting is in no table."""
        return self.judged_at_file_point and self.chosen.parts != LINEAR

    def beside(self, name: str, add: float = 0.0, factor: float = 1.0) -> Estimate:
        """Coefficient of one of `NUISANCE` times a factor, and a number added to it, with an interval across the
        forms."""
        i = NUISANCE.index(name)

        def of(c: Candidate) -> Estimate:
            return Estimate(factor * float(c.fit.b[i]) + add, factor * c.fit.half(i), c.fit.blocks)

        return _across(of(self.chosen), [(c.weight, of(c)) for c in self.candidates], self.chosen.fit.blocks)

    def over(self, rows: LeakRows) -> Estimate:
        """Leakage over the crane file's at the working point of other rows, less 1, with an interval across the
        forms."""
        each = [(c.weight, _value(rows, c.parts, c.fit)) for c in self.candidates]
        free = [_value(rows, parts, f) for parts, f in self.sloped]
        return _across(
            _value(rows, self.chosen.parts, self.chosen.fit), each, self.chosen.fit.blocks, free, rows.unclosed
        )

    @property
    def slip(self) -> Estimate | None:
        """Slip of the electric motors at full flow and the pressure for which its column was made [-]; None where it
        was not fitted."""
        c = self.chosen
        return self.beside("slip") if len(c.fit.b) == len(NUISANCE) + len(c.parts) else None

    @property
    def left(self) -> tuple[LeakForm, ...]:
        """Forms that the data leave, the best first."""
        return tuple(dict.fromkeys(c.form for c in self.candidates if c.alive))


Option = tuple[LeakForm, tuple[str, ...], Fit, tuple[float, int]]


def choose(crane: Crane, rows: LeakRows) -> LeakChoice | None:
    """Fit the forms and weigh them; None where not even the crane file's own law can be fitted.

    The widest law that the data carry is fitted with a covariance from blocks left out in turn, so that errors may hang
    together within a block. A form is a plane in its coefficients; how far they lie from it, in that covariance, is
    Hotelling's T^2. Evidence is m ln(1 + T^2/(m-1)) + k ln m over m blocks and k coefficients (BIC with the blocks as
    the data). A form with a negative conductance is none.
    """
    beside = _beside(rows)
    own = _fitted(rows, beside, ("own",))
    if own is None:
        return None
    widest = _widest(rows, beside) if own.blocks >= FEWEST_FOR_FORM else None
    file = form_of(crane.active)
    options: list[Option] = [(file.form, ("own",), own, _distance(rows, widest, ("own",)))]
    if widest is None:
        return _chosen(crane, rows, options, 0, ())
    forms = _forms(widest[0])
    fitted = {parts: _fitted(rows, beside, parts) for parts in {*(parts for _, parts in forms), *ONE_SLOPE}}
    laws = {parts: (found, _distance(rows, widest, parts)) for parts, found in fitted.items() if found is not None}
    for form, parts in forms:
        if parts == ("head",) and file.form is LeakForm.CONSTANT:
            continue  # the crane file's own
        if parts == LINEAR and len(widest[0]) < len(LINEAR):
            continue  # the data tell no slope at all
        if parts in laws and (laws[parts][0].b[-len(parts) :] >= 0.0).all():
            options.append((form, parts, *laws[parts]))
    left = {
        parts: found for parts, (found, distance) in laws.items() if _probability(*distance, found.blocks) >= AGAINST
    }
    sloped = tuple((parts, left[parts]) for parts in ONE_SLOPE if parts in left)
    return _chosen(crane, rows, options, len(widest[0]), sloped)


def _forms(carried: tuple[str, ...]) -> list[tuple[LeakForm, tuple[str, ...]]]:
    every: list[tuple[LeakForm, tuple[str, ...]]] = [
        (LeakForm.CONSTANT, ("head",)),
        (LeakForm.STROKE, ("head", "stroke")),
        (LeakForm.STROKE, LINEAR),
        (LeakForm.SPEED, ("head", "speed")),
        (LeakForm.STROKE_SPEED, PARTS),
    ]
    return [(form, parts) for form, parts in every if parts == LINEAR or set(parts) <= set(carried)]


def _beside(rows: LeakRows) -> tuple[str, ...]:
    """Columns beside the leak: slip is among them only where the data carry it and it comes out as slip, that is not
    negative."""
    whole = _widest(rows, NUISANCE)
    return NUISANCE if whole is not None and whole[1].b[NUISANCE.index("slip")] > 0.0 else NUISANCE[:-1]


def _fitted(rows: LeakRows, beside: tuple[str, ...], parts: tuple[str, ...]) -> Fit | None:
    """Least squares, then what is known of slip beforehand."""
    columns = [SIGNS.get(n, 1.0) * rows.column(n) for n in beside]
    found = fit((*columns, *(-rows.column(p) for p in parts)), rows.Q_m, rows.block)
    return _informed(found, beside.index("slip")) if found is not None and "slip" in beside else found


def _informed(found: Fit, i: int) -> Fit:
    """The fit with the slip, coefficient i, drawn to what is known of it, by the covariance of the blocks (Bayes,
    normal)."""
    gain = found.cov[:, i] / (found.cov[i, i] + SLIP_SPREAD**2)
    cov = found.cov - np.outer(gain, found.cov[i])
    return replace(found, b=found.b + gain * (SLIP - found.b[i]), cov=0.5 * (cov + cov.T))


def _widest(rows: LeakRows, beside: tuple[str, ...]) -> tuple[tuple[str, ...], Fit] | None:
    """The law with most parts that the data carry, and its fit."""
    for parts in (PARTS, ("head", "speed"), ("head", "stroke"), ("head",)):
        found = _fitted(rows, beside, parts)
        if found is not None and found.blocks > len(parts) + 1:
            return parts, found
    return None


def _distance(rows: LeakRows, widest: tuple[tuple[str, ...], Fit] | None, parts: tuple[str, ...]) -> tuple[float, int]:
    """Hotelling's T^2 of the widest law's coefficients against a form, and the number of conditions that the form
    makes."""
    if widest is None:
        return 0.0, 0
    names, found = widest
    k = len(names)
    theta, V = found.b[-k:], found.cov[-k:, -k:]
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
    file, per = form_of(crane.active), _per(crane)
    m = options[0][2].blocks
    evidence = np.array([m * math.log1p(T2 / (m - 1)) + (carried - q) * math.log(m) for *_, (T2, q) in options])
    weights = np.exp(-0.5 * (evidence - evidence.min()))
    weights /= weights.sum()
    least = ALIVE * float(weights.max())
    found = sorted(
        (
            Candidate(
                form,
                parts,
                f,
                _value(rows, parts, f),
                _reference(per, parts, f),
                _probability(T2, q, m),
                float(w),
                bool(w >= least),
            )
            for (form, parts, f, (T2, q)), w in zip(options, weights, strict=True)
        ),
        key=lambda c: -c.weight,
    )
    own = next(c for c in found if c.parts == ("own",))
    best = own if own.alive else found[0]
    bend = _bend(rows, best)
    refuted = own is not best and own.p < AGAINST and bend > NOTABLE
    return LeakChoice(
        chosen=best,
        candidates=tuple(found),
        file_form=file.form,
        value=_across(
            best.value,
            [(c.weight, c.value) for c in found],
            best.fit.blocks,
            [_value(rows, *x) for x in sloped],
            rows.unclosed,
        ),
        reference=_across(
            best.reference,
            [(c.weight, c.reference) for c in found],
            best.fit.blocks,
            [_reference(per, *x) for x in sloped],
            rows.unclosed * per["own"],
        ),
        stated=per["own"],
        twin=rows.total("own") / rows.total("head"),
        at=rows.at,
        bend=bend,
        refuted=refuted,
        in_own_form=own.value,
        sloped=sloped,
        file_at=file.at,
    )


def _across(
    best: Estimate,
    each: Sequence[tuple[float, Estimate]],
    blocks: int,
    free: Sequence[Estimate] = (),
    unclosed: float = 0.0,
) -> Estimate:
    """The best form's estimate with an interval across the forms by their weights (Burnham and Anderson 2002), and what
    is unclosed.

    It is never narrower than that of a law with one slope (free) and what that differs by: evidence prefers a law
    without a slope to one with a slope that is small but not nil, and a crane's own law is none of the published ones
    to the letter.
    """
    apart = math.sqrt(sum(w * (e.value - best.value) ** 2 for w, e in each))
    least = max((math.hypot(e.half, e.value - best.value) for e in free), default=0.0)
    structural = math.hypot(max(t_factor(blocks - 1) * apart, math.sqrt(max(least**2 - best.half**2, 0.0))), unclosed)
    return Estimate(best.value, math.hypot(best.half, structural), best.blocks, structural)


def _linear(found: Fit, weights: FloatArray) -> Estimate:
    """A linear function of a form's coefficients."""
    k = len(weights)
    variance = float(weights @ found.cov[-k:, -k:] @ weights)
    return Estimate(
        float(weights @ found.b[-k:]), t_factor(found.blocks - 1) * math.sqrt(max(variance, 0.0)), found.blocks
    )


def _value(rows: LeakRows, parts: tuple[str, ...], found: Fit) -> Estimate:
    own = rows.total("own")
    e = _linear(found, np.array([rows.total(p) / own for p in parts]))
    return Estimate(e.value - 1.0, e.half, e.blocks)


def _per(crane: Crane) -> Mapping[str, float]:
    """Conductance at the crane file's point per coefficient of each part."""
    at = form_of(crane.active).at
    stroke = float(pump_leakage(at.alpha_p, pump_leak(crane.active.pump)))
    return {"head": 1.0, "stroke": stroke, "alpha": at.alpha_p, "speed": at.n_m, "own": stated_leak(crane.active)}


def _reference(per: Mapping[str, float], parts: tuple[str, ...], found: Fit) -> Estimate:
    return _linear(found, np.array([per[p] for p in parts]))


def _bend(rows: LeakRows, best: Candidate) -> float:
    """Deviation of the crane file's law, scaled to the same flow, from the chosen one over the data, over the mean leak
    flow [-]."""
    good = rows.used
    law = np.sum([b * rows.column(p)[good] for p, b in best.coefficients.items()], axis=0)
    own = rows.own[good] * (np.sum(law) / np.sum(rows.own[good]))
    return float(np.sqrt(np.mean((law - own) ** 2)) / abs(float(np.mean(law))))


IN_WORDS = {
    LeakForm.CONSTANT: "is constant",
    LeakForm.STROKE: "goes with the pumps' stroke",
    LeakForm.SPEED: "goes with the motors' speed",
    LeakForm.STROKE_SPEED: "goes with stroke and speed",
}


def form_says(leak: LeakChoice) -> str:
    """What refutes the crane file's form, in words."""
    here, file = IN_WORDS[leak.chosen.form], IN_WORDS[leak.file_form]
    if leak.chosen.form is leak.file_form:
        here, file = f"{here} in other parts", "and not as they stand"
    others = [form for form in leak.left if form is not leak.chosen.form]
    apart = f" (not told from {' or '.join(others)})" if others else ""
    reference = f"{show(leak.reference.value, 'leakage', 3)} +- {show(leak.reference.half, 'leakage', 2)}"
    return (
        f"the form of the leakage does not fit: it {here} in the log{apart}, {file} in the crane file; at the crane"
        f" file's point {reference} where it has {show(leak.stated, 'leakage', 3)}; structural error of its law, scaled"
        f" to these data: {100.0 * leak.bend:.1f} %; in its form they would read {100.0 * leak.in_own_form.value:+.1f}"
        f" %, so no number in it is offered; {_judged_where(leak)}"
    )


def _judged_where(leak: LeakChoice) -> str:
    if leak.judged_at_file_point:
        return "judged at the crane file's point"
    return (
        "judged at the working point of the data, for at the crane file's they leave it open by +-"
        f" {100.0 * leak.at_file_point.half:.0f} %"
    )
