"""Which of the uncertain factors the spread of a result comes from: variance-based indices of first and total order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.uncertainty.draws import MOST, Draws, Uncertainty, shaped, unit_points
from stillhook.analysis.uncertainty.factors import Distribution, Law
from stillhook.analysis.uncertainty.monte_carlo import base_drawings, case_labels, run_draws
from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.base.progress import Progress
from stillhook.engine.arguments import paired
from stillhook.engine.runner import FAILED
from stillhook.engine.scenario.summary import numbers_of
from stillhook.errors import SimulationError, SpecError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.statistics.estimate import CONFIDENCE, Estimate
from stillhook.units import quote

RESAMPLES = 200
"""Bootstrap resamples: the ends of a 95 % interval are then within about a tenth of its width."""
SETTLED = 0.1
"""Change of an index from half the draws to all of them that counts as converged [-]."""
MATTERS = 0.05
"""Total index from which a factor is named [-]: a twentieth of the variance."""
LEAST = 16
OUTPUTS = ("e_c_pp", "p_max")


class Index(NamedTuple):
    """Share of the variance of a result: by this factor alone (first), and with all its interactions (total), with 95 %
    intervals."""

    first: Estimate
    total: Estimate


@dataclass(frozen=True)
class Sensitivity:
    """Indices of one number of one case: factor -> index, largest total first.

    change: how far the indices are from settled, see `indices`; n rows of each of the two tables of draws; runs made
    for it. mean, deviation of the number over the draws [SI]. Where the number does not vary there are no indices.
    """

    case: str
    output: str
    indices: dict[str, Index]
    mean: float
    deviation: float
    change: float
    n: int
    runs: int

    @property
    def converged(self) -> bool:
        """Whether half the draws give the same indices within `SETTLED`, and no first order is beyond its total one by
        more."""
        return bool(self.change <= SETTLED)

    def convergence(self) -> str:
        """Convergence of the indices, in words."""
        if not self.indices:
            return ""
        if self.converged:
            return f"settled within {self.change:.2f}: half the draws give the same"
        return f"not converged: indices are settled within {self.change:.2f} only; take more draws"


def largest_totals(results: Sequence[Sensitivity]) -> dict[str, float]:
    """Factor -> its largest total index among some results, the largest first."""
    largest: dict[str, float] = {}
    for result in results:
        for name, x in result.indices.items():
            largest[name] = max(largest.get(name, 0.0), x.total.value)
    return dict(sorted(largest.items(), key=lambda item: -item[1]))


def design(A: FloatArray, B: FloatArray, groups: Sequence[Sequence[int]]) -> FloatArray:
    """Saltelli's tables one below the other, shape (n (groups + 2), columns): A, B, and A with one group of columns
    taken from B; the columns of a group may depend on each other, groups may not."""
    AB = np.repeat(A[None], len(groups), axis=0)
    for i, columns in enumerate(groups):
        AB[i][:, list(columns)] = B[:, list(columns)]
    return np.concatenate([A, B, *AB])


def indices(f: FloatArray, d: int, n: int, seed: int = 0) -> tuple[list[Index], float]:
    """Indices of every group from the values f at the rows of `design`, shape (n (d + 2),), and how far they are from
    settled: the largest change of one from half the draws, or the excess of a first order over its total one, which can
    only be chance.

    Saltelli 2010 for the first order, Jansen for the total one, by scipy.stats.sobol_indices; 95 % intervals by
    bootstrap.
    """
    from scipy.stats import bootstrap  # heavy

    rows = f.reshape(d + 2, n)
    first, total = _orders(rows)
    half = np.stack(_orders(rows[:, : n // 2]))
    change = max(float(np.max(np.abs(half - np.stack([first, total])))), float(np.max(first - total)))
    samples = bootstrap(
        (np.arange(n),),
        lambda i: np.concatenate(_orders(rows[:, i])),
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        vectorized=False,
        rng=np.random.default_rng(seed),
    ).confidence_interval
    low, high = samples.low.reshape(2, d), samples.high.reshape(2, d)
    ends = list(zip((first, total), low, high, strict=True))
    return [Index(*(Estimate(float(x[i]), float(a[i]), float(b[i]), n) for x, a, b in ends)) for i in range(d)], change


def _orders(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and total order of every group; rows: f at A, at B, at every AB, shape (d + 2, n)."""
    from scipy.stats import sobol_indices  # heavy

    result = sobol_indices(func={"f_A": rows[None, 0], "f_B": rows[None, 1], "f_AB": rows[2:, None]}, n=rows.shape[1])
    return np.reshape(result.first_order, -1), np.reshape(result.total_order, -1)  # scipy drops dimensions of one


def sensitivity(
    crane: Crane | Sequence[Crane],
    case: Scenario | Sequence[Scenario],
    uncertainty: Uncertainty | None = None,
    *,
    outputs: Sequence[str] = (),
    against: str | None = None,
    n: int = 128,
    seed: int = 0,
    labels: Sequence[str] | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> list[Sensitivity]:
    """From which factors the spread of a result comes, for every case and output.

    Parameters
    ----------
    crane : Crane or sequence of Crane
        As in `stillhook.analysis.monte_carlo`.
    case : Scenario or sequence of Scenario
        As there.
    uncertainty : Uncertainty, optional
        As there. Factors with a fixed value have no index; the parameters of a set count together.
    outputs : sequence of str, default ()
        Numbers of the summary; empty: those of `OUTPUTS` that the winch type has.
    against : str, optional
        Label of a case; the others' numbers over those of that case are then analysed too ("ssc / hs"): what a
        difference depends on.
    n : int, default 128
        Rows of the tables, a power of two; there are n (factors + 2) runs a case.
    seed : int, default 0
        The same seed gives the same tables.
    labels : sequence of str, optional
        Names of the cases.
    progress : callable, optional
        Called with the share done, 0 to 1.
    **options : Any
        How to run: step, threads, store, client of `stillhook.simulate`.

    Returns
    -------
    list of Sensitivity
        Indices of every case and output.

    Raises
    ------
    SpecError, ScenarioError
        One line.
    SimulationError
        Where a run diverged: indices of the rest would mislead.
    """
    cranes, cases = paired(crane, case)
    columns = numbers_of(cranes[0])
    outputs = outputs or [name for name in OUTPUTS if name in columns]
    _check(outputs, columns, n)
    names = case_labels(cases, labels)
    if against is not None and against not in names:
        raise SpecError(f"against = {quote(against)}: unknown case. Allowed: {', '.join(names)}.")
    uncertain = (uncertainty or Uncertainty.default()).on(*zip(cranes, cases, strict=True))
    table, rows, varied = _tables(uncertain, n, seed)
    drawings = base_drawings(cranes, cases, uncertain, table._replace(values=rows))
    numbers, status, _ = run_draws(drawings, rows, progress=progress, **options)
    failed = sum(s in FAILED for row in status for s in row)
    if failed:
        raise SimulationError(
            f"{failed} of {numbers.shape[0] * numbers.shape[1]} runs diverged or were refused, and indices of the rest"
            " would mislead. Take a finer step, or narrower distributions."
        )
    results = {(c, o): numbers[i, :, columns.index(o)] for i, c in enumerate(names) for o in outputs}
    if against is not None:
        results |= {
            (f"{c} / {against}", o): results[c, o] / results[against, o] for c in names if c != against for o in outputs
        }
    return [_indices(c, o, f, varied, n, seed) for (c, o), f in results.items()]


def _check(outputs: Sequence[str], available: Sequence[str], n: int) -> None:
    for name in outputs:
        if name not in available:
            raise SpecError(f"output {quote(name)}: not a result of the summary{nearest(str(name), available)}")
    if type(n) is not int or not LEAST <= n <= MOST or n & (n - 1):
        raise SpecError(f"n = {quote(n)}: give a power of two from {LEAST}, such as 128.")


def _tables(uncertain: Uncertainty, n: int, seed: int) -> tuple[Draws, FloatArray, list[str]]:
    """Draws of the first table, the plan of all runs, and the factors that vary."""
    first, second = unit_points(n, seed, 2)
    A, B = shaped(uncertain, first, (seed, 1)), shaped(uncertain, second, (seed, 2))
    fixed = [name for name, x in uncertain.factors.items() if isinstance(x, Distribution) and x.law is Law.FIXED]
    varied = [name for name in uncertain.factors if name not in fixed]
    if not varied:
        raise SpecError("factors: all are fixed, so nothing has an index. Give one a distribution.")
    return A, design(A.values, B.values, [A.groups[name] for name in varied]), varied


def _indices(case: str, output: str, f: FloatArray, varied: Sequence[str], n: int, seed: int) -> Sensitivity:
    """Indices of one number; none where it does not vary or is not there."""
    deviation = float(np.std(f[: 2 * n]))
    ranked: dict[str, Index] = {}
    change = 0.0
    if deviation > 0.0:
        values, change = indices(f, len(varied), n, seed)
        ranked = dict(sorted(zip(varied, values, strict=True), key=lambda pair: -pair[1].total.value))
    return Sensitivity(case, output, ranked, float(np.mean(f[: 2 * n])), deviation, change, n, len(f))
