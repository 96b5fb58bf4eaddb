"""The numbers of step 5 with their intervals, over all load cases, with the scatter between the cases in it.

Correlation of simulated and measured control error: of each case Fisher's z = atanh(r), on which correlations scatter
evenly, with the deviation of its own blocks of time; over the cases the mean of z, with the scatter between cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.spec.crane import Crane
from stillhook.statistics.blocks import Statistic, interval
from stillhook.statistics.estimate import ENDS, LEAST, NORMAL_95, Estimate, half_of_mean, mean_of_few, t_factor
from stillhook.statistics.time_lag import dot
from stillhook.validate.ahc.comparison import (
    EVERY,
    Comparison,
    Shape,
    by_case,
    counted_share,
    gaussian_share,
    mean_and_s,
)
from stillhook.validate.ahc.replay import SMOOTH
from stillhook.validate.criteria.results import OF_SIGNAL, Measure, Note
from stillhook.variables import Variable

SCATTER = 0.6
"""Scale of the prior of the scatter of z between load cases of one crane: half of its weight is below 0.4, 5 % above
1.2. About r = 0.95 a scatter of 0.5 is 0.87 to 0.98. Independent cranes have 0.3 to 0.6 (docs/validation,
error-correlation)."""
HIGHEST = 1.0 - 1e-9
"""Largest correlation that has a z."""


@dataclass(frozen=True)
class CaseCorrelation:
    """One load case. r: correlation [-]; deviation of its z by sampling; effective number of independent samples."""

    r: float
    deviation: float
    effective: float

    @property
    def z(self) -> float:
        """Fisher's z [-]."""
        return _z(self.r)

    @property
    def estimate(self) -> Estimate:
        """The correlation with the interval of the case alone."""
        low, high = (math.tanh(self.z + sign * NORMAL_95 * self.deviation) for sign in (-1.0, 1.0))
        return Estimate(self.r, low, high, self.effective)


def _z(r: float) -> float:
    return math.atanh(min(max(r, -HIGHEST), HIGHEST))


def case_correlation(parts: Sequence[FloatArray], block: int) -> CaseCorrelation | None:
    """Correlation of the two columns over the unbroken parts (n, 2) of one load case, each about its own mean; None
    where one column does not move.

    The sampling variance of z is that of the mean of its influence function, in u and v, the columns over their
    standard deviations,

    .. math:: psi = (u v - r (u^2 + v^2) / 2) / (1 - r^2)

    from its sums over blocks of time [samples], some waves long: errors and what they differ by may be autocorrelated
    in any way within a block. Student's factor of the number of blocks less one is in the deviation. (The memory of psi
    read off its autocovariance is too short in 200 s of narrow-banded waves: it passes zero within each wave.)
    Source: Devlin, Gnanadesikan and Kettenring 1975, Biometrika 62, 531-545 (influence function of z).
    """
    centred = [np.asarray(p, dtype=np.float64) - np.mean(p, axis=0) for p in parts if len(p) > 1]
    if not centred:
        return None
    rows = np.concatenate(centred)
    size = np.sqrt(np.mean(rows**2, axis=0))
    if not (size > 0.0).all():
        return None
    r = float(np.mean((rows[:, 0] / size[0]) * (rows[:, 1] / size[1])))
    bounded = min(max(r, -HIGHEST), HIGHEST)
    influence = [_influence(p / size, bounded) for p in centred]
    least = 1 if len(influence) > 1 else 2
    pieces = [x for p in influence for x in np.array_split(p, max(least, round(len(p) / block)))]
    sums, count = np.array([float(x.sum()) for x in pieces]), len(pieces)
    variance = count / (count - 1) * dot(sums, sums) / len(rows) ** 2
    effective = float(np.mean(np.concatenate(influence) ** 2)) / max(variance, LEAST**2)
    return CaseCorrelation(r, math.sqrt(variance) * t_factor(count - 1) / NORMAL_95, min(effective, len(rows)))


def _influence(x: FloatArray, r: float) -> FloatArray:
    u, v = x[:, 0], x[:, 1]
    return np.asarray((u * v - 0.5 * r * (u**2 + v**2)) / (1.0 - r**2))


def mean_correlation(cases: Mapping[str, CaseCorrelation]) -> Estimate:
    """Correlation that the load cases have in the mean of their z, with the scatter between them in its interval; one
    case alone: its own interval, for it shows no scatter."""
    if len(cases) == 1:
        return next(iter(cases.values())).estimate
    e = mean_of_few([c.z for c in cases.values()], [c.deviation for c in cases.values()], SCATTER)
    return Estimate(math.tanh(e.value), math.tanh(e.low), math.tanh(e.high), sum(c.effective for c in cases.values()))


ENOUGH = 4
"""Least number of load cases to estimate their scatter: Student's t is 12.7 with two, 4.3 with three, 3.2 with
four, as in paper F."""


@dataclass(frozen=True)
class OverCases:
    """pooled: the number over all samples, with an interval that holds the scatter between the load cases; cases: of
    each alone."""

    pooled: Estimate
    cases: Mapping[str, Estimate]

    def notes(self, form: str) -> list[Note]:
        """The smallest and the largest case, in a form of `notes`; a remark where there are few."""
        values = {name: case.value for name, case in self.cases.items() if math.isfinite(case.value)}
        if len(values) < 2:
            return [Note("one-case")]
        few = [Note("few-cases", n=len(values), enough=ENOUGH)] if len(values) < ENOUGH else []
        return [Note("by-case", each=values, form=form), *few]


def over_cases(
    statistic: Statistic,
    parts: Mapping[str, Sequence[FloatArray]],
    *,
    at_least: int,
    bounds: tuple[float, float] = (-math.inf, math.inf),
) -> OverCases:
    """A statistic of all parts together, by load case. The interval is that of the blocks, widened to that of a mean of
    the cases, each with the weight of its samples and its own true value."""
    filled = {name: [p for p in rows if len(p)] for name, rows in parts.items()}
    filled = {name: rows for name, rows in filled.items() if rows}
    cases = {name: interval(statistic, rows, at_least=at_least, bounds=bounds) for name, rows in filled.items()}
    total = interval(statistic, [p for rows in filled.values() for p in rows], at_least=at_least, bounds=bounds)
    names = [name for name, case in cases.items() if math.isfinite(case.value)]
    if len(names) < 2 or not math.isfinite(total.value):
        return OverCases(total, cases)
    weights = [sum(map(len, filled[name])) for name in names]
    half = half_of_mean([cases[name].value for name in names], [_half(cases[name]) for name in names], weights)
    low, high = (min(max(total.value + sign * half, bounds[0]), bounds[1]) for sign in (-1.0, 1.0))
    low, high = np.fmin(low, total.low), np.fmax(high, total.high)
    return OverCases(Estimate(total.value, float(low), float(high), total.n), cases)


def _half(case: Estimate) -> float:
    """The longer side of an interval: the other may end at a bound. NaN where it has no interval."""
    return float(np.fmax(case.high - case.value, case.value - case.low))


NEAR, FAR = 0.05, 0.06
"""Deviations whose probability paper F states [m]."""
SAME = 1e-9
"""Width of an interval of a share that counts as zero."""
THIN = 0.1
"""Spacing of the samples whose correlation gets an interval [s]."""


def measures(comparisons: Sequence[Comparison], like: Shape, settings: Mapping[str, float]) -> tuple[Measure, ...]:
    """Every measure of step 5 over all load cases; mean deviation and largest error of each load case as well."""
    block = round(2.0 * settings["window"] / EVERY)
    parts = parts_by_case(comparisons, lambda c: c.windows.x)
    mean = over_cases(np.mean, parts, at_least=block, bounds=(0.0, math.inf))
    return (
        *_deviations(comparisons, parts, mean, settings["window"]),
        *_by_case(comparisons, mean.cases, settings["window"]),
        *_largest(comparisons),
        _efficiency(comparisons, settings["eta_above"], block),
        *_shape(comparisons, like, settings["window"]),
    )


def parts_by_case(
    comparisons: Sequence[Comparison], values: Callable[[Comparison], FloatArray]
) -> dict[str, list[FloatArray]]:
    """Rows of every unbroken part, by load case."""
    return {name: [values(c) for c in rows] for name, rows in by_case(comparisons).items()}


def _deviations(
    comparisons: Sequence[Comparison], parts: Mapping[str, Sequence[FloatArray]], over_all: OverCases, window: float
) -> tuple[Measure, ...]:
    names = ("e_c_pp_deviation", "e_c_pp_deviation_s", "e_c_pp_below_5cm", "e_c_pp_below_6cm", "e_c_pp_bias")
    x = [part for rows in parts.values() for part in rows if len(part)]
    if not x:
        return tuple(Measure.of(name, None) for name in names)
    mean, s = mean_and_s(np.concatenate(x))
    block = round(2.0 * window / EVERY)
    pooled = [over_all, *(over_cases(statistic, parts, at_least=block, bounds=ends) for statistic, ends in _STATISTICS)]
    differences = parts_by_case(comparisons, lambda c: c.windows.simulated - c.windows.measured)
    signed = over_cases(np.mean, differences, at_least=block)
    estimates = [*(_with_share_end(p.pooled) for p in pooled), signed.pooled]
    level = float(np.mean(np.concatenate([c.windows.measured for c in comparisons])))
    data = f"{_extent(comparisons)}, {estimates[0].n:.0f} effective windows of {window:g} s"
    gauss = [[Note("gaussian", share=gaussian_share(limit, mean, s))] for limit in (NEAR, FAR)]
    first = [Note("e_c_pp-measured", level=level), *pooled[0].notes("cm")]
    notes = (first, pooled[1].notes("cm"), *gauss, [Note("signed"), *signed.notes("cm")])
    return tuple(Measure.of(name, e, *n, data=data) for name, e, n in zip(names, estimates, notes, strict=True))


def _by_case(comparisons: Sequence[Comparison], cases: Mapping[str, Estimate], window: float) -> tuple[Measure, ...]:
    """Mean deviation of every load case: the mean over all would hide a short bad case behind a long good one."""
    name, out = "e_c_pp_deviation_case", []
    for case, rows in by_case(comparisons).items():
        e, test = cases.get(case), f"load case {case}"
        if e is None:
            out.append(Measure.of(name, None, test=test))
        else:
            data = f"{_extent(rows)}, {e.n:.0f} effective windows of {window:g} s"
            out.append(Measure.of(name, e, test=test, data=data))
    return tuple(out)


def _with_share_end(estimate: Estimate) -> Estimate:
    """A share of nothing or all, alike in every draw: its end is that of so many independent windows that all agree."""
    if estimate.high - estimate.low > SAME or estimate.value not in (0.0, 1.0):
        return estimate
    end = ENDS[0] ** (1.0 / max(estimate.n, 1.0))
    return replace(estimate, low=end) if estimate.value == 1.0 else replace(estimate, high=1.0 - end)


_STATISTICS: tuple[tuple[Callable[[FloatArray], float], tuple[float, float]], ...] = (
    (lambda x: mean_and_s(x)[1], (0.0, math.inf)),
    (lambda x: counted_share(NEAR, x), (0.0, 1.0)),
    (lambda x: counted_share(FAR, x), (0.0, 1.0)),
)


def _extent(comparisons: Sequence[Comparison]) -> str:
    cases, seconds = len(by_case(comparisons)), sum(c.seconds for c in comparisons)
    return f"{cases} load case{'s' if cases > 1 else ''}, {seconds:.0f} s"


def _largest(comparisons: Sequence[Comparison]) -> tuple[Measure, ...]:
    """Both readings of paper F table 2, item 2a: largest error of every load case, and largest difference at one
    moment."""
    nonempty = [c for c in comparisons if len(c.pair[0])]
    if not nonempty:
        return Measure.of("e_c_max_difference", None), Measure.of("e_c_deviation_max", None)
    out = []
    for case, rows in by_case(nonempty).items():
        measured, simulated = (max(float(np.abs(c.pair[k]).max()) for c in rows) for k in (0, 1))
        note = Note("largest", simulated=simulated, measured=measured)
        test, apart = f"load case {case}", simulated - measured
        out.append(Measure.of("e_c_max_difference", apart, note, test=test, data=_extent(rows)))
    off = [np.nan_to_num(np.abs(c.e_simulated - c.e_measured)) for c in nonempty]
    worst = int(np.argmax([x.max() for x in off]))
    moment = _moment(nonempty[worst], int(np.argmax(off[worst])))
    return *out, Measure.of("e_c_deviation_max", off[worst].max(), *moment, data=_extent(comparisons))


def _moment(c: Comparison, i: int) -> list[Note]:
    """Time of a sample and the pump commands at it: they show a limit that only one of the two has."""
    out, u_p = [Note("moment", test=c.name, t=c.replay.t[i] + c.replay.record.zero)], c.replay.measured("u_p")[i]
    return [*out, Note("commands-then", log=u_p, twin=c.simulated["u_p"][i])] if math.isfinite(u_p) else out


def _efficiency(comparisons: Sequence[Comparison], above: float, block: int) -> Measure:
    """Mean |eta_c simulated - eta_c measured| over windows with high tip motion."""
    high = {id(c): c.windows.s_tip_pp >= above for c in comparisons}
    parts = parts_by_case(comparisons, lambda c: c.windows.eta_deviation[high[id(c)]])
    if not any(len(part) for rows in parts.values() for part in rows):
        return Measure.of("eta_c_deviation_high", None, Note("low-waves", above=above))
    estimate = over_cases(np.mean, parts, at_least=block, bounds=(0.0, 1.0))
    share = float(np.mean(np.concatenate(list(high.values()))))
    data = f"windows with {above:g} m or more, {100.0 * share:.0f} % of all"
    return Measure.of("eta_c_deviation_high", estimate.pooled, *estimate.notes("% 3"), data=data)


MISFIT_KINDS = ("speed", "rotation", "force", "torque", "pressure", "power", "current")
"""Quantities whose signals are judged: those that a load makes from moment to moment, not levels of stores or
temperatures, which depend on a history before the log."""
SETTINGS = ("alpha_s",)
"""Settings that make a drive's torque where its pressure is held: they show the size of its units, which its torque
does not. Those of pumps and valves are judged by what they give."""
COMMON = {"v_w": "speed", "F_w": "force"}
"""Judged signals that every winch has."""
LEAST_LEVEL = 0.05
"""Part of the rms level of the largest signal of its quantity that a signal's own deviation counts as at least [-]: a
compensated load hardly moves, and its tension is then what the load cell's class leaves; a drum at rest does not move
either."""


def judged_signal(row: Variable) -> bool:
    """Whether a signal of a winch type is judged."""
    return row.kind in MISFIT_KINDS or row.name in SETTINGS


def signal_misfits(crane: Crane, comparisons: Sequence[Comparison], window: float) -> tuple[Measure, ...]:
    """What the twin leaves of every logged signal of the drive: rms of simulated less measured over its own deviation,
    about means."""
    name, block = "signal_misfit", round(2.0 * window / THIN)
    kinds = COMMON | {row.name: row.kind for row in crane.plant.type.rows if judged_signal(row)}
    out = []
    for signal, kind in kinds.items():
        same = [other for other in kinds if kinds[other] == kind]
        parts = {
            k: [x for x in rows if len(x)] for k, rows in parts_by_case(comparisons, _pairs_of(signal, same)).items()
        }
        parts = {k: rows for k, rows in parts.items() if rows}
        if parts:
            e = over_cases(_misfit, parts, at_least=block, bounds=(0.0, math.inf))
            of, data = OF_SIGNAL + signal, _extent(comparisons)
            out.append(Measure.of(name, e.pooled, *e.notes("% 3"), test=of, data=data))
    own = [signal for signal in kinds if signal not in COMMON]
    if not any(m.test.removeprefix(OF_SIGNAL) in own for m in out):
        out.append(Measure.of(name, None, Note("no-drive-signal", signals=own)))
    return tuple(out)


def _pairs_of(signal: str, same: Sequence[str]) -> Callable[[Comparison], FloatArray]:
    """Columns every THIN seconds, smooth: measured and simulated about their means, and the level of the largest signal
    of the same quantity. Noise of tip and sensors, which a stiff speed loop turns into torque, is not the twin's to
    repeat."""

    def pairs(c: Comparison) -> FloatArray:
        from scipy.ndimage import gaussian_filter1d  # heavy: only where data are at hand

        m, s = c.replay.measured(signal), c.simulated[signal]
        rows, step = np.column_stack([m, s])[np.isfinite(m) & np.isfinite(s)], c.replay.record.step
        level = math.sqrt(max(float(np.mean(np.nan_to_num(c.replay.measured(x)) ** 2)) for x in same))
        rows = gaussian_filter1d(rows, SMOOTH / step, axis=0)[:: max(1, round(THIN / step))]
        return np.column_stack([rows - rows.mean(axis=0), np.full(len(rows), level)]) if len(rows) else np.zeros((0, 3))

    return pairs


def _misfit(x: FloatArray) -> float:
    own = max(float(np.mean(x[:, 0] ** 2)), LEAST_LEVEL**2 * float(np.mean(x[:, 2] ** 2)))
    return math.sqrt(float(np.mean((x[:, 1] - x[:, 0]) ** 2)) / own) if own > 0.0 else math.nan


def _thin(c: Comparison) -> FloatArray:
    """Measured and simulated error about their means and without the tip's noise, a row every THIN seconds."""
    return np.column_stack([x - x.mean() for x in c.quiet])[:: max(1, round(THIN / c.replay.record.step))]


def _shape(comparisons: Sequence[Comparison], like: Shape, window: float) -> tuple[Measure, ...]:
    data = _extent(comparisons)
    band = "" if math.isfinite(like.distance) else Note("no-minute")
    return (
        _correlation(comparisons, like.correlation, window),
        Measure.of("e_c_spectral_distance", like.distance, band, data=data),
    )


def _correlation(comparisons: Sequence[Comparison], together: float, window: float) -> Measure:
    """Correlation over the load cases; together: that of all samples, in which the largest errors count most."""
    rows = parts_by_case([c for c in comparisons if len(c.pair[0])], _thin)
    block = round(window / THIN)
    cases = {name: c for name, x in rows.items() if (c := case_correlation(x, block)) is not None}
    if not cases:
        return Measure.of("e_c_correlation", None)
    estimate = mean_correlation(cases)
    data = f"{_extent(comparisons)}, {estimate.n:.0f} effective samples"
    notes = OverCases(estimate, {name: c.estimate for name, c in cases.items()}).notes(".3g")
    return Measure.of("e_c_correlation", estimate, *notes, Note("together", r=together), data=data)
