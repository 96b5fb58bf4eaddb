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
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.library.leakage import form_of, point_text, pump_leak, stated_leak
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.crane import Crane
from stillhook.statistics.blocks import Fit
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.validate.criteria.results import Note
from stillhook.validate.parameters.leak_laws import (
    LINEAR,
    NUISANCE,
    PARTS,
    SLIP_PRESSURE,
    LeakRows,
    Span,
    WorkingPoint,
    distance_of_form,
    fitted_law,
    leak_size,
    nuisance_columns,
    outside_of,
    probability,
    probability_of_tension,
    tension,
    widest_law,
)
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
ONE_SLOPE = (LINEAR, ("head", "speed"))
"""Leak laws with one slope, the simplest that show the uncertainty of the slope."""
EXTRAPOLATED = 0.25
"""Half width of the interval at the crane file's setting and speed beyond which the data do not determine the leakage
there, so that no law is offered [-]: the criteria's limit."""


@dataclass(frozen=True)
class Candidate:
    """A form fitted to the balance. parts: its columns, ("file",) for the crane file's law times a number; value: leak
    flow over the crane file's, less 1; reference: conductance at the crane file's point [m^3/s/Pa]; p: probability of
    data that contradict the form as much if it were true; weight among the forms; alive: not excluded."""

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
        """Coefficient of each part: head and speed [m^3/s/Pa, m^3/rad/Pa], stroke and file [-]."""
        return dict(zip(self.parts, (float(b) for b in self.fit.b[-len(self.parts) :]), strict=True))


@dataclass(frozen=True)
class LeakChoice:
    """The form supported by the data: the crane file's where it is not excluded, otherwise that of most weight. value:
    leakage over the crane file's at the working point `at`, less 1, interval across the forms not excluded; reference:
    conductance at the crane file's point file_at; stated: the crane file's there; twin: its law at the working point
    [m^3/s/Pa]; bend: deviation of its law, scaled, from the chosen one, as a part of the leakage; refuted: its form is;
    in_file_form: value that its scaled law would give; sloped: the laws of `ONE_SLOPE` that the data leave by their
    parts; span of the data; pressure: where they have their mean conductance [Pa]."""

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
    pressure: float

    @property
    def at_file_point(self) -> Estimate:
        """Leakage at the crane file's point over the one that it states there, less 1."""
        r = self.reference
        return Estimate.around(r.value / self.stated - 1.0, r.half / self.stated, r.n, r.structural / self.stated)

    @property
    def offered(self) -> bool:
        """Whether the chosen law may replace that of a crane file, at the pressure of the data: they determine its
        value at the file's setting and speed, and a file can state it (none states one in proportion to the pumps'
        setting)."""
        return self.refuted and self.at_file_point.half <= EXTRAPOLATED and self.chosen.parts != LINEAR

    @property
    def beyond_pressure(self) -> float:
        """Pressure by which the crane file's point is outside the data, above positive [Pa]; 0 inside, or where the
        file states none: no form is fitted over pressure."""
        return outside_of(self.file_at.p, self.span.p)

    @property
    def ratio(self) -> Estimate:
        """Displacement of the pumps over that of the motors, over the twin's, less 1, with an interval across the
        forms."""
        each = [(c.weight, c.fit.estimate(NUISANCE.index("Q_p"), -1.0)) for c in self.candidates]
        best = self.chosen.fit.estimate(NUISANCE.index("Q_p"), -1.0)
        return _across(best, each, self.chosen.fit.blocks)

    def over(self, rows: LeakRows) -> Estimate:
        """Leakage over the crane file's at the working point of other rows, less 1; interval across the forms."""
        by_rise = rows.total("head") * (rows.pressure - self.pressure) / SLIP_PRESSURE
        each = [(c.weight, _value(rows, c.parts, c.fit, by_rise)) for c in self.candidates]
        free = [_value(rows, *law, by_rise) for law in self.sloped]
        best = _value(rows, self.chosen.parts, self.chosen.fit, by_rise)
        return _across(best, each, self.chosen.fit.blocks, free, rows.unclosed)

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
    as the data). A form with a negative conductance is left out.
    """
    size = leak_size(rows)
    nuisance = nuisance_columns(rows, size)
    file_fit = fitted_law(rows, nuisance, ("file",), size)
    if file_fit is None:
        return None
    widest = widest_law(rows, nuisance, size) if file_fit.blocks >= FEWEST_FOR_FORM else None
    file = form_of(crane.active)
    options: list[Option] = [(file.form, ("file",), file_fit, distance_of_form(rows, widest, ("file",)))]
    if widest is None:
        return _chosen(crane, rows, options, 0, (), size, 0.0)
    forms = [(form, parts) for form, parts in FORMS if parts == LINEAR or set(parts) <= set(widest[0])]
    fitted = {parts: fitted_law(rows, nuisance, parts, size) for parts in {*(parts for _, parts in forms), *ONE_SLOPE}}
    laws = {
        parts: (fitted, distance_of_form(rows, widest, parts)) for parts, fitted in fitted.items() if fitted is not None
    }
    for form, parts in forms:
        if parts == ("head",) and file.form is LeakForm.CONSTANT:
            continue  # the crane file's own
        if parts == LINEAR and len(widest[0]) < len(LINEAR):
            continue  # the data determine no slope
        if parts in laws and (laws[parts][0].b[-len(parts) :] >= 0.0).all():
            options.append((form, parts, *laws[parts]))
    misfits = {
        parts: fitted for parts, (fitted, distance) in laws.items() if probability(*distance, fitted.blocks) >= AGAINST
    }
    sloped = tuple((parts, misfits[parts]) for parts in ONE_SLOPE if parts in misfits)
    return _chosen(crane, rows, options, len(widest[0]), sloped, size, tension(widest[1], widest[0], size))


def _chosen(
    crane: Crane,
    rows: LeakRows,
    options: Sequence[Option],
    carried: int,
    sloped: tuple[tuple[tuple[str, ...], Fit], ...],
    size: float,
    widest_tension: float,
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
    tensions = np.array([tension(f, parts, size) for _, parts, f, _ in options])
    evidence += [
        t - widest_tension if parts == LINEAR else 0.0 for t, (_, parts, *_) in zip(tensions, options, strict=True)
    ]
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
            p=min(probability(T2, q, m), probability_of_tension(tension)),
            weight=float(w),
            alive=bool(w >= least),
        )
        for (form, parts, f, (T2, q)), w, tension in zip(options, weights, tensions, strict=True)
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
        pressure=rows.pressure,
    )


def _across(
    best: Estimate,
    each: Sequence[tuple[float, Estimate]],
    blocks: int,
    free: Sequence[Estimate] = (),
    unclosed: float = 0.0,
) -> Estimate:
    """The best form's estimate with an interval across the forms by their weights (Burnham and Anderson 2002), and the
    unclosed flow. It is never narrower than that of a law with one slope (free) and what that differs by: evidence
    prefers a law without a slope to one with a small slope, and a crane's law matches none of the published ones."""
    apart = math.sqrt(sum(w * (e.value - best.value) ** 2 for w, e in each))
    least = max((math.hypot(e.half, e.value - best.value) for e in free), default=0.0)
    structural = math.hypot(max(t_factor(blocks - 1) * apart, math.sqrt(max(least**2 - best.half**2, 0.0))), unclosed)
    return Estimate.around(best.value, math.hypot(best.half, structural), best.n, structural)


def _linear(fitted: Fit, weights: FloatArray, by_rise: float = 0.0) -> Estimate:
    """A linear function of a form's coefficients, and of the rise with pressure."""
    w = np.zeros(len(fitted.b))
    w[-len(weights) :], w[NUISANCE.index("rise")] = weights, by_rise
    variance = float(w @ fitted.cov @ w)
    return Estimate.around(
        float(w @ fitted.b), t_factor(fitted.blocks - 1) * math.sqrt(max(variance, 0.0)), fitted.blocks
    )


def _value(rows: LeakRows, parts: tuple[str, ...], fitted: Fit, by_rise: float = 0.0) -> Estimate:
    """Leak flow over the crane file's, less 1; by_rise: flow per coefficient of the rise with pressure [Pa]."""
    total = rows.total("file")
    e = _linear(fitted, np.array([rows.total(p) / total for p in parts]), by_rise / total)
    return Estimate.around(e.value - 1.0, e.half, e.n)


def _reference(per: Mapping[str, float], parts: tuple[str, ...], fitted: Fit) -> Estimate:
    return _linear(fitted, np.array([per[p] for p in parts]))


def _bend(rows: LeakRows, best: Candidate) -> float:
    """Deviation of the crane file's law, scaled to the same flow, from the chosen one over the mean leak flow [-]."""
    good = rows.used
    law = np.sum([b * rows.column(p)[good] for p, b in best.coefficients.items()], axis=0)
    file_flow = rows.file[good] * (np.sum(law) / np.sum(rows.file[good]))
    return float(np.sqrt(np.mean((law - file_flow) ** 2)) / abs(float(np.mean(law))))


def form_refuted(leak: LeakChoice) -> list[Note]:
    """Why the crane file's form is refuted."""
    other = leak.chosen.form is leak.file_form
    form = Note("form-in-other-parts" if other else "form-refuted", log=leak.chosen.form, file=leak.file_form)
    others = [form for form in leak.remaining_forms if form is not leak.chosen.form]
    apart = [Note("form-open", forms=others)] if others else []
    return [form, *apart, Note("form-error", bend=leak.bend, value=leak.in_file_form.value)]


def file_point(leak: LeakChoice) -> Note:
    """How far the crane file's point is from the data."""
    at, span, point = leak.file_at, leak.span, point_text(leak.file_at)
    outside = []
    for name in ("p", "alpha_p", "n_m"):
        x, (low, high) = getattr(at, name), getattr(span, name)
        if far := abs(outside_of(x, (low, high))):
            outside.append(Note(f"outside-{name}", far=far, low=low, high=high))
    return Note("point-outside", at=point, by=outside) if outside else Note("point-inside", at=point)
