"""Gradients, periods and damping of every turn, as paper F compares them: the crane's with the twin's, by its file and
tuned; capacitance, leakage and inertia by the fit, with intervals and whether the data determine them; measures and
tables of step 4.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.library.leakage import stated_leak
from stillhook.report.document import Table
from stillhook.report.formatting import change, percent_fixed
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.units import show
from stillhook.validate.criteria.results import Measure, Note
from stillhook.validate.data_set.record import Transient, filled, smoothed
from stillhook.validate.dynamics.form import GroupDifference, Tuning, hidden, normalised_rms, structural
from stillhook.validate.dynamics.model import C_H, C_LEAK, INERTIA, MOST, PLACE
from stillhook.validate.dynamics.runs import SIGNALS, SMOOTH, DynamicsSegment
from stillhook.validate.parameters.flow import Balance
from stillhook.validate.parameters.leakage import form_refuted

LEAST_RISE = 10e5
"""Least rise of a line's pressure for a gradient [Pa]: some twenty deviations of a transmitter's noise."""
SIGNIFICANT = 0.1
LEAST_PEAK = 3e5
"""A peak of p_a - p_b is significant above this part of the largest one, and above this height [Pa]."""
LOWER, UPPER = 0.25, 0.75
"""Part of a rise between which its gradient is taken: neither its rounded foot nor its rounded top."""
MOST_PEAKS = 4
LOOK = 3.0
"""Time after a turn in which peaks are detected [s]."""


class Swing(NamedTuple):
    """One turn. gradient of the line that rises first [Pa/s], and the line ("A", "B"); period between its first two
    significant peaks of p_a - p_b [s]; zeta damping ratio from the first two swings [-]; peaks (k,) [s]; NaN where it
    shows none."""

    line: str
    gradient: float
    period: float
    zeta: float
    peaks: FloatArray


def swing_of(turn: Transient, t: FloatArray, p_a: FloatArray, p_b: FloatArray, samples: slice) -> Swing:
    """The swing after a turn; t [s], p_a, p_b [Pa] (n,) of one machine; samples: those of the turn."""
    step = float(t[1] - t[0])
    times = t[samples]
    ahead = _at(times, turn.start)
    a, b = (smoothed(filled(p[samples]), step, SMOOTH) for p in (p_a, p_b))
    up = turn.change > 0.0
    end = min(len(times), ahead + round(LOOK / step))
    y = (a - b if up else b - a)[:end]
    tops, heights = _peaks(y[ahead:], times[ahead:end])
    period = float(tops[1] - tops[0]) if len(tops) > 1 else math.nan
    return Swing(
        "A" if up else "B", _gradient((a if up else b)[:end], times[:end], ahead), period, _damping(heights), tops
    )


def _at(t: FloatArray, time: float) -> int:
    return int(np.clip(np.searchsorted(t, time - 1e-9), 0, len(t) - 1))


def _peaks(y: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and prominences of the first significant peaks, each refined by a parabola through three samples."""
    from scipy.signal import find_peaks

    if len(y) < 3:
        return np.empty(0), np.empty(0)
    least = max(LEAST_PEAK, SIGNIFICANT * float(np.ptp(y)))
    tops, properties = find_peaks(y, prominence=least)
    tops, heights = tops[:MOST_PEAKS], properties["prominences"][:MOST_PEAKS]
    l, m, r = y[tops - 1], y[tops], y[tops + 1]
    bend = l - 2.0 * m + r
    shift = np.where(bend < 0.0, 0.5 * (l - r) / np.where(bend < 0.0, bend, -1.0), 0.0)
    return t[tops] + shift * (t[1] - t[0]), heights


def _damping(heights: FloatArray) -> float:
    """Damping ratio from the prominences of second and third peak, whose feet are both troughs of the same swing."""
    if len(heights) < 3 or not heights[1] > heights[2] > 0.0:
        return math.nan
    decrement = math.log(heights[1] / heights[2])
    return decrement / math.hypot(decrement, 2.0 * math.pi)


def _gradient(p: FloatArray, t: FloatArray, ahead: int) -> float:
    """Slope of the first rise of a line's pressure between LOWER and UPPER of it [Pa/s]; NaN where it hardly rises."""
    low = float(np.median(p[: ahead + 1]))
    tops, _ = _peaks(p[ahead:], t[ahead:])
    if not len(tops):
        return math.nan
    top = ahead + _at(t[ahead:], float(tops[0])) + 1
    rise = p[ahead:top] - low
    high = float(rise.max()) if len(rise) else 0.0
    if high < LEAST_RISE:
        return math.nan
    foot, head = (_crossing(rise, t[ahead:top], x * high) for x in (LOWER, UPPER))
    return (UPPER - LOWER) * high / (head - foot) if head > foot else math.nan


def _crossing(y: FloatArray, t: FloatArray, level: float) -> float:
    """Time at which y first reaches a level, between samples."""
    k = int(np.argmax(y >= level))
    if k == 0:
        return float(t[0])
    return float(t[k - 1] + (level - y[k - 1]) / (y[k] - y[k - 1]) * (t[k] - t[k - 1]))


A, B = SIGNALS.index("p_a"), SIGNALS.index("p_b")


@dataclass(frozen=True)
class SwingComparison:
    """Swings of all turns: crane, twin as its file has it (before), twin tuned (after); misfit before and after:
    normalised rms of each signal's deviation [-]."""

    crane: tuple[Swing, ...]
    before: tuple[Swing, ...]
    after: tuple[Swing, ...]
    misfit_before: dict[str, float]
    misfit_after: dict[str, float]

    def error(self, name: str, tuned: bool, line: str = "") -> Estimate:
        """Errors of a field of `Swing`, simulated over measured, less 1; of the turns of one line where it is
        stated."""
        pairs = zip(self.crane, self.after if tuned else self.before, strict=True)
        values = [(getattr(c, name), getattr(x, name)) for c, x in pairs if line in ("", c.line)]
        measured, simulated = np.reshape(values, (-1, 2)).T
        shown = np.isfinite(measured) & np.isfinite(simulated) & (measured != 0.0)
        return Estimate.of_mean(simulated[shown] / measured[shown] - 1.0, t_factor(int(shown.sum()) - 1))


def compare_swings(
    time_segments: Sequence[DynamicsSegment], turns: Sequence[Transient], tuning: Tuning
) -> SwingComparison:
    """The swings of every turn of crane and twin, evaluated alike; none for a line that was not logged."""
    rows: list[list[Swing]] = [[], [], []]
    for time_segment, before, after in zip(time_segments, tuning.before, tuning.after, strict=True):
        nothing = np.full(len(time_segment.t), np.nan)
        crane = tuple(time_segment.measured.get(name, nothing) for name in ("p_a", "p_b"))
        machines = (crane, (before[:, A], before[:, B]), (after[:, A], after[:, B]))
        time = time_segment.record.t[time_segment.first : time_segment.first + len(time_segment.t)]
        for turn in (x for x in turns if time_segment.holds(x)):
            samples = slice(turn.first - time_segment.first, turn.last - time_segment.first)
            for k, (p_a, p_b) in enumerate(machines):
                rows[k].append(swing_of(turn, time, p_a, p_b, samples))
    crane_swings, before_swings, after_swings = (tuple(swings) for swings in rows)
    misfits = [dict(normalised_rms(time_segments, outputs)) for outputs in (tuning.before, tuning.after)]
    return SwingComparison(crane_swings, before_swings, after_swings, *misfits)


ERROR = {C_H: "C_h_error", C_LEAK: "C_leak_error", INERTIA: "J_m_eff_error"}
"""Name of the measure of each tuned number: tuned over crane file, less 1."""
UNSEEN: Mapping[str, float] = {C_H: 0.02, C_LEAK: 0.045, INERTIA: 0.015}
"""Deviation of the logarithm that no residual shows, added to that of the fit: gain errors of the pressure transmitters
and the tolerance of the motors' displacement scale what is found, and the twin's one volume a line, its friction law
and its leakage law stand for more than they are. On 85 simulated cranes, whose lines have two ends and whose leakage is
none of the published forms, the capacitance read 2 % low and the inertia 1.3 % high in the median, the leakage 3.6 %
low with a
scatter of 6 %: with
these the intervals hold
that."""
WIDEST: Mapping[str, float] = {C_H: 0.2, C_LEAK: 0.4, INERTIA: 0.2}
"""Half width of the interval of the logarithm beyond which the data do not determine a value."""
MOST_FORM: Mapping[str, float] = {C_H: 0.06, C_LEAK: 0.12, INERTIA: 0.05}
"""Half difference of the logarithm between groups of turns beyond which no tuned value is proposed: half of the
criteria's limit. Nor is one proposed where such a difference could be hidden."""
MOST_LEFT = 0.25
"""Largest residual of a tuned twin over a signal's own deviation; beyond it the twin does not represent this winch and
its values are meaningless. Another friction law, lines with two ends and sensors leave 0.02 to 0.07."""
JUDGED = ("p_a", "p_b", "omega_m")


class Compared(NamedTuple):
    """A quantity of the swings: its measure, field of `Swing`, line ("": both), and in words."""

    measure: str
    field: str
    line: str
    words: str


COMPARED = (
    Compared("pressure_gradient_error", "gradient", "A", "pressure gradient, line A"),
    Compared("pressure_gradient_error", "gradient", "B", "pressure gradient, line B"),
    Compared("swing_period_error", "period", "", "period between peaks"),
    Compared("swing_damping_error", "zeta", "", "damping ratio"),
)


@dataclass(frozen=True)
class TunedValue:
    """factor: tuned over crane file; reason: why the data do not determine it, None where they do; fits: whether the
    law fits well enough to adopt the number, form: why not; of: the twin's value that the factor refers to, None for
    the crane file's."""

    name: str
    factor: Estimate
    reason: Note | None = None
    fits: bool = True
    form: tuple[Note, ...] = ()
    of: float | None = None

    @property
    def known(self) -> bool:
        """Whether the data determine it."""
        return self.reason is None

    @property
    def offered(self) -> bool:
        """Whether it is proposed as a tuned value."""
        return self.known and self.fits


def tuned_value(
    tuning: Tuning, name: str, misfit: Mapping[str, float], differences: Sequence[GroupDifference] = ()
) -> TunedValue:
    """The tuned number, by Student's t with as many degrees of freedom as there are turns less one. misfit: residual of
    the tuned twin in each signal over the signal's own deviation; differences between groups of turns."""
    i, fit = PLACE[name], tuning.fit
    x = float(fit.theta[i])
    spread = math.hypot(math.sqrt(float(fit.covariance[i, i])), UNSEEN[name])
    half = t_factor(fit.clusters - 1) * spread if fit.clusters > 1 else math.inf
    worst = max((s for s in misfit if s in JUDGED), key=lambda s: misfit[s], default="")
    reason = None
    if worst and misfit[worst] > MOST_LEFT:
        reason = Note("misfit", left=misfit[worst], signal=worst)
    elif not fit.converged:
        reason = Note("not-converged", runs=fit.runs, end=fit.message)
    elif min(x - float(tuning.low[i]), float(tuning.high[i]) - x) < 0.01 * MOST:
        reason = Note("at-bound", factor=math.exp(x))
    elif half > WIDEST[name]:
        reason = Note("undetermined", factor=math.exp(half))
    form, apart = structural(name, differences)
    dark, unseen = hidden(name, differences, MOST_FORM[name])
    form = max(form, dark if math.isfinite(dark) else 0.0)
    edge, factor = min(half + form, 5.0), math.exp(x)
    wide = factor * math.sinh(min(form, 5.0))
    fits = max(form, dark) <= MOST_FORM[name]
    notes: tuple[Note, ...] = (apart.note(),) if apart else (unseen, Note("open-brake")) if unseen else ()
    notes += (Note("no-single-value"),) if apart and not fits else ()
    estimate = Estimate(factor, math.exp(x - edge), math.exp(x + edge), fit.clusters, wide)
    return TunedValue(name, estimate, reason, fits, notes)


def in_form(f: TunedValue, flow: Balance | None) -> TunedValue:
    """The leakage of the flow balance in the form supported by the logs, where they refute the crane file's form."""
    if f.name != C_LEAK or flow is None or not flow.leak.refuted:
        return f
    e = flow.leak.value
    factor = Estimate(1.0 + e.value, max(1.0 + e.low, 0.0), 1.0 + e.high, e.n, e.structural)
    form = (*form_refuted(flow.leak), Note("by-balance"))
    return replace(f, factor=factor, reason=None, fits=False, form=form, of=flow.leak.twin)


def measures_of(
    values: Sequence[TunedValue],
    swings: SwingComparison,
    time_segments: Sequence[DynamicsSegment],
    turns: Sequence[Transient],
    tuning: Tuning,
) -> tuple[Measure, ...]:
    """The measures of step 4."""
    seconds = sum(len(s.t) * s.record.step for s in time_segments)
    data = f"{len(turns)} turns, {seconds:.0f} s"
    out = [_change(f, data) for f in values]
    for tuned in (False, True):
        end = "_tuned" if tuned else ""
        out += [_error(f"{x.measure}{end}", swings.error(x.field, tuned, x.line), x.line) for x in COMPARED]
        misfit = swings.misfit_after if tuned else swings.misfit_before
        out += [Measure.of(f"dynamics_misfit{end}", misfit[n], test=n, data=data) for n in JUDGED if n in misfit]
    return tuple(out)


def _change(f: TunedValue, data: str) -> Measure:
    if f.reason is not None:
        return Measure.of(ERROR[f.name], None, f.reason, data=data)
    x = f.factor
    e = Estimate(x.value - 1.0, x.low - 1.0, x.high - 1.0, x.n, x.structural)
    return Measure.of(ERROR[f.name], e, Note("tuned-over-file"), *f.form, data=data)


FEWEST_PLACES = 3
"""Source: paper F step 4 measures the period in three places."""


def _error(name: str, error: Estimate, line: str) -> Measure:
    test, data = f"line {line}" if line else "", f"{error.n:g} places"
    if error.n >= FEWEST_PLACES:
        return Measure.of(name, error, Note("simulated-over-measured"), test=test, data=data)
    return Measure.of(name, None, Note("few-places", n=error.n, least=FEWEST_PLACES), test=test, data=data)


WORDS = {C_H: "capacitance of the lines", C_LEAK: "leakage", INERTIA: "inertia"}
LETTERS = {C_H: "C_h", C_LEAK: "C_leak", INERTIA: "J_m_eff"}


def reference(crane: Crane, f: TunedValue) -> tuple[float, str]:
    """What the factor of a tuned value refers to [SI], and its kind of quantity; or the twin's value `of`."""
    a = crane.active
    values = {
        C_H: (a.line.V, "volume"),
        C_LEAK: (stated_leak(a), "leakage"),
        INERTIA: (crane.inertia.J_m_eff, "inertia"),
    }
    value, kind = values[f.name]
    return (value if f.of is None else f.of), kind


def statements_of(
    values: Sequence[TunedValue], tuning: Tuning, elsewhere: bool, notes: Sequence[Note]
) -> tuple[Note, ...]:
    """What is not proposed and why, how the fit ended, and what the tests lack; elsewhere: other tests also determined
    the leakage."""
    fit = tuning.fit
    left = [f for f in values if f.known and not f.fits]
    return (
        *(Note("not-proposed", name=WORDS[f.name], letter=LETTERS[f.name], why="; ".join(f.form)) for f in left),
        Note("fit", end=fit.message, runs=fit.runs, turns=fit.clusters),
        *([Note("leakage-of-both")] if elsewhere else []),
        *notes,
    )


def tables_of(crane: Crane, values: Sequence[TunedValue], swings: SwingComparison) -> tuple[Table, ...]:
    """Tuned values; before and after."""
    return (_tuned(crane, values), _before_after(swings))


def _tuned(crane: Crane, values: Sequence[TunedValue]) -> Table:
    rows = []
    for f in values:
        value, kind = reference(crane, f)
        cells = [show(x * value, kind, 4) for x in (f.factor.value, f.factor.low, f.factor.high)]
        tuned = (*cells, change(f.factor.value - 1.0)) if f.known else ("-",) * 4
        rows.append((LETTERS[f.name], show(value, kind, 4), *tuned))
    title = "Tuned on the winch's dynamics (C_h as oil in a line; leakage with the pumps full, motors at 1000 rev/min)"
    return Table(("", "crane\nfile", "tuned", "95 %\nfrom", "95 %\nto", "change"), tuple(rows), title)


def _before_after(swings: SwingComparison) -> Table:
    rows = []
    for x in COMPARED:
        errors = [swings.error(x.field, tuned, x.line) for tuned in (False, True)]
        rows.append((x.words, *(change(e.value) if e.n else "-" for e in errors), f"{errors[0].n:g}"))
    misfits = (swings.misfit_before, swings.misfit_after)
    for name in swings.misfit_before:
        rows.append((f"rms of {name}, part of its own", *(percent_fixed(m[name], 1) for m in misfits), "all"))
    header = ("twin over crane, less 1", "crane\nfile", "tuned, and\nrest free", "places")
    return Table(header, tuple(rows), "Twin against crane, driven by the measured commands")
