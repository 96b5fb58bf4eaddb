"""Form of the twin's laws: one parameter of a law estimated in groups of turns; where it differs by more than sampling,
the form of the law does not fit.

A law of another form (leakage that rises with the stroke, say, against a constant one) gives another value in slow
turns than in fast ones. The best common value then has a small sampling error about a value that is not true in either;
the difference between the groups shows it.

Tuning of capacitance, leakage and inertia: the twin fitted to a test of the winch's dynamics by its outputs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import NORMAL_95, t_factor
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.record import Transient, filled, smoothed
from stillhook.validate.dynamics.model import C_LEAK, NAMES, PLACE, TUNED, Twin
from stillhook.validate.dynamics.output_error import Fit, fit
from stillhook.validate.dynamics.runs import SIGNALS, SMOOTH, DynamicsSegment

LEVEL = 0.9975
"""Of Student's t, one side: with some seven comparisons, a twin whose laws fit shows a difference in 3 to 4 of 100
campaigns."""
FEWEST = 3
"""Turns that a group must hold: with fewer the scatter within it says nothing."""
SLOW_AND_FAST, BOTH_WAYS, OTHER_TESTS = (
    ("slow turns", "fast turns"),
    ("hoisting", "lowering"),
    ("these turns", "heave compensation"),
)


@dataclass(frozen=True)
class GroupDifference:
    """One number in two groups of data: difference of its logarithm, second less first; its deviation; dof: degrees of
    freedom."""

    name: str
    groups: tuple[str, str]
    difference: float
    deviation: float
    dof: int

    @property
    def beyond_sampling(self) -> bool:
        """Whether the groups differ by more than their sampling errors explain."""
        from scipy.special import stdtrit  # heavy: only where something is fitted

        return abs(self.difference) > float(stdtrit(max(self.dof, 1), LEVEL)) * self.deviation

    @property
    def unseen(self) -> float:
        """Half of the largest difference of the logarithm that sampling would conceal at 95 %."""
        return 0.5 * t_factor(self.dof) * self.deviation

    def note(self) -> Note:
        """The difference, as a reason why the law does not fit."""
        first, second = self.groups
        spread = NORMAL_95 * self.deviation
        return Note("groups-differ", first=first, second=second, times=math.exp(self.difference), spread=spread)


def group_differences(
    fit: Fit, turns: Sequence[Transient], known: Mapping[str, tuple[float, float]]
) -> tuple[GroupDifference, ...]:
    """Every tuned number by groups of turns, and the leakage against that of other tests (known: logarithms and
    deviations). Each difference is one Gauss-Newton step from the common optimum with this number alone free to differ
    between the groups; its deviation is from leaving out one turn after the other."""
    used = [turns[i] for i in fit.names]
    speed = np.array([max(abs(x.before), abs(x.after)) for x in used])
    way = np.array([x.before + x.after for x in used])
    fast = np.where(speed > np.median(speed), 0.5, -0.5) if np.ptp(speed) > 0.0 else np.full(len(used), -0.5)
    split = {SLOW_AND_FAST: fast, BOTH_WAYS: np.where(way > 0.0, -0.5, 0.5)}
    out = []
    for groups, side in split.items():
        if min(int((side > 0.0).sum()), int((side < 0.0).sum())) >= FEWEST:
            out += [GroupDifference(name, groups, *_between(fit, PLACE[name], side), len(used) - 2) for name in TUNED]
    if C_LEAK in known and len(used) >= 2 * FEWEST:
        out.append(_elsewhere(fit, *known[C_LEAK]))
    return tuple(x for x in out if math.isfinite(x.difference) and math.isfinite(x.deviation))


def structural(name: str, differences: Sequence[GroupDifference]) -> tuple[float, GroupDifference | None]:
    """Half of the largest difference of a value's logarithm between groups that is beyond sampling, and that
    difference; 0, None without."""
    clear = [x for x in differences if x.name == name and x.beyond_sampling]
    worst = max(clear, key=lambda x: abs(x.difference), default=None)
    return (0.5 * abs(worst.difference), worst) if worst else (0.0, None)


def hidden(name: str, differences: Sequence[GroupDifference], most: float) -> tuple[float, Note | None]:
    """Largest difference of a number's logarithm between groups of turns that sampling could hide, and what is not
    shown by it; 0, None where half of that is no more than `most`, or where other tests agree with these turns within
    it. inf: the turns make no groups.

    The whole difference, not half of it: the common number may be that of one group alone, in whose turns more can be
    seen.
    """
    if any(
        x.name == name and x.groups == OTHER_TESTS and not x.beyond_sampling and x.unseen <= most for x in differences
    ):
        return 0.0, None
    worst = max(
        (x for x in differences if x.name == name and x.groups != OTHER_TESTS), key=lambda x: x.unseen, default=None
    )
    if worst is None:
        return math.inf, Note("no-groups", least=FEWEST)
    if worst.unseen <= most:
        return 0.0, None
    times, (first, second) = math.exp(min(2.0 * worst.unseen, 5.0)), worst.groups
    return 2.0 * worst.unseen, Note("groups-unseen", first=first, second=second, times=times)


def _between(fit: Fit, i: int, side: FloatArray) -> tuple[float, float]:
    """Difference of parameter i between two groups of clusters (side: -0.5, 0.5), and its deviation."""
    p = len(fit.theta)
    A = np.zeros((len(side), p + 1, p + 1))
    b = np.zeros((len(side), p + 1))
    A[:, :p, :p], b[:, :p] = fit.H, fit.g
    A[:, :p, p] = A[:, p, :p] = side[:, None] * fit.H[:, :, i]
    A[:, p, p] = side**2 * fit.H[:, i, i]
    b[:, p] = side * fit.g[:, i]
    prior, off = np.append(fit.prior, 0.0), np.append(fit.off, 0.0)
    return _jackknifed(A, b, prior, off, p)


def _elsewhere(fit: Fit, centre: float, deviation: float) -> GroupDifference:
    """The leakage of the turns alone against that of other tests."""
    i = PLACE[C_LEAK]
    prior = fit.prior.copy()
    prior[i] = 0.0
    step, spread = _jackknifed(fit.H, fit.g, prior, fit.off, i)
    return GroupDifference(
        C_LEAK, OTHER_TESTS, centre - (float(fit.theta[i]) + step), math.hypot(spread, deviation), len(fit.H) - 1
    )


def _jackknifed(A: FloatArray, b: FloatArray, prior: FloatArray, off: FloatArray, i: int) -> tuple[float, float]:
    """Gauss-Newton step of parameter i from sums of clusters (n, p, p), (n, p), and its deviation by leaving each
    out."""
    total, slope = A.sum(axis=0) + np.diag(prior), b.sum(axis=0) + prior * off
    value = _step(total, slope, i)
    estimates = np.array([_step(total - one, slope - g, i) for one, g in zip(A, b, strict=True)])
    n = len(estimates)
    return value, math.sqrt((n - 1) / n * float(np.sum((estimates - estimates.mean()) ** 2)))


def _step(A: FloatArray, b: FloatArray, i: int) -> float:
    d = np.sqrt(np.maximum(np.diag(A), 0.0))
    d = np.where(d > 0.0, d, 1.0)
    return float(-np.linalg.lstsq(A / np.outer(d, d), b / d, rcond=1e-10)[0][i] / d[i])


@dataclass(frozen=True)
class Tuning:
    """Result of the fit, in the order of `model.NAMES`; low, high: bounds; before, after: the twin's outputs for each
    segment (n, SIGNALS), with the crane as it is and as tuned, as the sensors show them."""

    fit: Fit
    low: FloatArray
    high: FloatArray
    before: tuple[FloatArray, ...]
    after: tuple[FloatArray, ...]


def tune(
    crane: Crane,
    time_segments: Sequence[DynamicsSegment],
    clusters: Sequence[NDArray[np.int64]],
    known: Mapping[str, tuple[float, float]],
    progress: Callable[[float], None],
) -> Tuning:
    """Fit the twin to stretches of a test by Levenberg-Marquardt, from the best of a grid of starts. clusters: for each
    sample its transient, -1 for none; known: logarithms of factors from other tests, with their deviations."""
    twin = Twin(crane, time_segments, clusters)
    start, model = twin.best_start(), twin.model(known)
    progress(0.34)
    result = fit(model, start)
    progress(0.95)
    return Tuning(result, model.low, model.high, twin.outputs(np.zeros(len(NAMES))), twin.outputs(result.theta))


def normalised_rms(time_segments: Sequence[DynamicsSegment], outputs: Sequence[FloatArray]) -> Mapping[str, float]:
    """Root mean square of each signal's deviation over its own standard deviation [-], over all stretches. Both are of
    centred means over SMOOTH: a line of a winch that lifts an empty hook swings by a few bar, of which its
    transmitter's noise alone is a fifth."""
    out = {}
    for k, name in enumerate(SIGNALS):
        pairs = [
            _counted(s, s.measured[name], o[:, k])
            for s, o in zip(time_segments, outputs, strict=True)
            if name in s.measured
        ]
        if not pairs:
            continue
        y, x = (np.concatenate(p) for p in zip(*pairs, strict=True))
        ok = np.isfinite(x) & np.isfinite(y)
        if ok.any() and np.std(y[ok]) > 0.0:
            out[name] = float(np.sqrt(np.mean((x[ok] - y[ok]) ** 2)) / np.std(y[ok]))
    return out


def _counted(s: DynamicsSegment, measured: FloatArray, simulated: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measured and simulated samples that count, smooth; NaN where a sample is unknown."""
    known = np.isfinite(measured)
    smooth = (smoothed(filled(measured), s.record.step, SMOOTH), smoothed(simulated, s.record.step, SMOOTH))
    y, x = (np.where(known, each, np.nan)[s.counted] for each in smooth)
    return y, x


def clusters_of(time_segment: DynamicsSegment, transients: Sequence[Transient]) -> NDArray[np.int64]:
    """For each sample of a segment the number of its transient, -1 for none."""
    out = np.full(len(time_segment.t), -1)
    for i, x in enumerate(transients):
        if time_segment.holds(x):
            out[x.first - time_segment.first : x.last - time_segment.first] = i
    return out
