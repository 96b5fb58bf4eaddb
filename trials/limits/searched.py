"""Limits of made-up responses whose cells are placed by the search of the tool: growth without end, and growth that
levels off about the limit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from stillhook.plan.tiers.time_domain.curves import ColumnRuns, CurveLimits, curve_of, limits_of_curve
from stillhook.plan.tiers.time_domain.measures import Measure
from stillhook.plan.tiers.time_domain.placing import Search, next_height, runs_for
from stillhook.statistics.extremes import P90

HIGHEST = 6.0
GUESS_OFF = 0.06
"""Standard deviation of the guess of a limit, in ln of the height."""
Array = np.ndarray
Level = Callable[[Array], Array]
"""Level over the limit (c, n) of heights (n,) [m], in every column."""
FINE = np.geomspace(0.05, HIGHEST, 2000)


@dataclass(frozen=True, eq=False)
class Response:
    """Numbers that rise with the height: period [s], angle [rad] of columns (c,); levels over its limit, of every rule;
    scatter (c,) of ln of a largest value in a run; end: largest value that there is; guess (c,): about its limits [m];
    waves: part of the scatter that is that of the waves, alike for all numbers in the same ones."""

    period: Array
    angle: Array
    levels: tuple[Level, ...]
    scatter: Array
    guess: Array
    end: float = math.inf
    waves: float = 0.0
    limits: Array = field(init=False)

    def __post_init__(self) -> None:
        beyond = [level(FINE) > 1.0 for level in self.levels]
        first = [np.where(over.any(axis=1), FINE[over.argmax(axis=1)], math.inf) for over in beyond]
        object.__setattr__(self, "limits", np.array(first))

    @property
    def least(self) -> Array:
        """Lowest limit of each column (c,) [m]."""
        return np.asarray(self.limits.min(axis=0))

    def runs(self, rng: np.random.Generator, i: int, Hs: float, z_waves: Array) -> Array:
        """Largest values (rule, n) of runs of a column in waves (n,)."""
        shape = len(self.levels), len(z_waves)
        own = rng.standard_normal(shape)
        normal = math.sqrt(self.waves) * z_waves + math.sqrt(1.0 - self.waves) * own
        z = -np.log(-log_ndtr(normal)) + math.log(-math.log(P90))
        level = np.array([of(np.array([Hs]))[i, 0] for of in self.levels])[:, None]
        return np.minimum(level * np.exp(self.scatter[i] / 1.2826 * z), self.end)


class Waves:
    """Waves of one plan: how severe each run of a sea is, the same for all numbers."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def of(self, i: int, Hs: float, first: int, n: int) -> Array:
        """Normal numbers of n runs of a column's sea, from number `first` on."""
        return np.random.default_rng((self.seed, i, round(1000.0 * Hs))).standard_normal(first + n)[first:]


def columns() -> tuple[Array, Array]:
    """Period [s] and angle [rad] of thirty columns."""
    return np.repeat(np.arange(5.0, 15.0), 3), np.tile(np.radians([165.0, 180.0, 195.0]), 10)


def power(seed: int = 5) -> Response:
    """Growth by a power of the height, to the end where slings are slack."""
    period, angle = columns()
    rng = np.random.default_rng(seed)
    H = np.exp(math.log(2.0) + 0.5 * np.log(period / 9.0) + 0.15 * np.sin(period / 1.7) + rng.normal(0.0, 0.02, 30))
    growth = 1.6 + 0.2 * np.sin(period)
    return Response(
        period, angle, (lambda Hs: (Hs / H[:, None]) ** growth[:, None],), 0.4 + 0.08 * np.cos(period / 2.0), H, 1.11
    )


PLATEAUS = (0.85, 0.93, 0.98, 1.02, 1.10)


def plateau(part: float, *, rises: bool = False, seed: int = 7) -> Response:
    """Growth that levels off at a part of the limit, as an error that friction makes; rises: a winch that saturates
    lets it grow again over 2.5 m. The guess is that of who sees it grow from below."""
    period, angle = columns()
    rng = np.random.default_rng(seed)
    a = part * np.exp(0.02 * np.sin(period / 2.0) + rng.normal(0.0, 0.01, 30))
    b = 1.1 * (period / 9.0) ** 0.3

    def level(Hs: Array) -> Array:
        flat = a[:, None] * -np.expm1(-((Hs / b[:, None]) ** 1.6))
        return flat + (0.4 * np.maximum(Hs - 2.5, 0.0) if rises else 0.0)

    return Response(period, angle, (level,), np.full(30, 0.25), 1.6 * (period / 9.0) ** 0.3)


@dataclass(eq=False)
class Column:
    """Cells of a column under way."""

    guess: float
    cells: dict[float, Array] = field(default_factory=dict)
    done: bool = False

    @property
    def heights(self) -> list[float]:
        return sorted(self.cells)


@dataclass(frozen=True, eq=False)
class Plan:
    """Limits of every rule that one plan gives, and the number of its runs."""

    rules: tuple[CurveLimits, ...]
    runs: int

    def least(self, i: int) -> tuple[float, float]:
        """Lowest limit of a column [m], and half of its interval in ln."""
        rows = [(float(np.nan_to_num(of.Hs[i], nan=math.inf)), float(of.half[i])) for of in self.rules]
        return min(rows, key=lambda row: row[0])

    def direct(self, i: int) -> float:
        """Lowest limit of a column by its own runs [m]."""
        return min(float(of.direct[i]) for of in self.rules)


def searched_plan(
    rng: np.random.Generator,
    response: Response,
    search: Search | None = None,
    highest: float = HIGHEST,
    waves: Waves | None = None,
) -> Plan:
    """Limits of one plan whose cells are placed, and given more runs, as `stillhook.plan.tiers.time_domain.search`
    does for one phase."""
    search, waves = search or Search(), waves or Waves(int(rng.integers(2**31)))
    every = [Column(g * math.exp(rng.normal(0.0, GUESS_OFF))) for g in response.guess]
    plan: Plan | None = None
    for _ in range(60):
        asked = [_asked(column, i, plan, search, highest) for i, column in enumerate(every)]
        for i, ask in enumerate(asked):
            if ask is not None:
                old = every[i].cells.get(ask[0], np.zeros((len(response.levels), 0)))
                new = response.runs(rng, i, ask[0], waves.of(i, ask[0], old.shape[1], ask[1]))
                every[i].cells[ask[0]] = np.concatenate((old, new), axis=1)
        if all(ask is None for ask in asked):
            break
        rules = []
        for rule in range(len(response.levels)):
            of = [column_runs(response, rule, i, column, plan) for i, column in enumerate(every)]
            rules.append(limits_of_curve(curve_of(of), np.ones(len(of)), highest))
        plan = Plan(tuple(rules), sum(x.shape[1] for column in every for x in column.cells.values()))
    assert plan is not None
    return plan


def _asked(column: Column, i: int, plan: Plan | None, search: Search, highest: float) -> tuple[float, int] | None:
    """Height and number of runs that a column gets next."""
    if column.done:
        return None
    Hs = column.heights
    limit, half = (math.inf, math.nan) if plan is None else plan.least(i)
    seen = math.inf if plan is None else min(limit, plan.direct(i))
    wanted = next_height(Hs, seen, column.guess, highest, search)
    if wanted is not None:
        return wanted, search.seeds
    runs = sum(x.shape[1] for x in column.cells.values())
    if 0.0 < limit < math.inf and half > search.width and (more := runs_for(runs, half / search.width, search)):
        return min(Hs, key=lambda h: abs(h - limit)), more
    column.done = True
    return None


def column_runs(response: Response, rule: int, i: int, column: Column, plan: Plan | None) -> ColumnRuns:
    """Runs of a column, looked at about its limit."""
    Hs = column.heights
    limit = math.inf if plan is None else plan.least(i)[0]
    measure = Measure(f"x{rule}", q=P90, end=response.end)
    cells = tuple(
        (h, {"duration": np.ones(x.shape[1]), **{f"x{k}": row for k, row in enumerate(x)}})
        for h, x in sorted(column.cells.items())
    )
    about = min(max(limit, Hs[0]), Hs[-1])
    return ColumnRuns(float(response.period[i]), float(response.angle[i]), measure, about, 0.0, cells)


def covers(found: CurveLimits, limits: Array) -> Array:
    """Whether the interval of each limit holds it; one that is open above ends at infinity."""
    low = np.where(np.isnan(found.low), found.Hs, found.low)
    high = np.where(np.isnan(found.high), math.inf, found.high)
    return (low <= limits) & (limits <= high)


def judged(plans: Sequence[Plan], limits: Array) -> dict[str, Any]:
    """Coverage and errors of repeated plans of one rule."""
    found = [plan.rules[0] for plan in plans]
    Hs = np.array([np.nan_to_num(of.Hs, nan=HIGHEST, posinf=HIGHEST) for of in found])
    off = np.log(np.minimum(Hs, HIGHEST) / np.minimum(limits, HIGHEST))
    covered = np.array([covers(of, limits) for of in found])
    by_plan = covered.mean(axis=1)
    return {
        "coverage": float(covered.mean()),
        "error": float(by_plan.std(ddof=1) / math.sqrt(len(plans))),
        "rms": float(np.sqrt(np.mean(off**2))),
        "bias": float(off.mean()),
        "unsafe": float((off > 0.1).mean()),
        "too_high": float(np.mean([(of.low > limits).mean() for of in found])),
        "too_low": float(np.mean([(of.high < limits).mean() for of in found])),
        "unbounded": float(np.mean([np.mean(~np.isfinite(of.high)) for of in found])),
        "half": _finite(float(np.nanmedian([of.half for of in found]))),
        "runs": float(np.mean([plan.runs for plan in plans])) / len(limits),
        "limited": float(np.isfinite(limits).mean()),
    }


def _finite(x: float) -> float | None:
    """x, None where it is infinite: JSON has no such number."""
    return x if math.isfinite(x) else None


def responses() -> Mapping[str, Response]:
    """All by name."""
    of = {f"plateau at {p:.2f}": plateau(p) for p in PLATEAUS}
    of |= {f"plateau at {p:.2f}, rises beyond 2.5 m": plateau(p, rises=True) for p in (0.85, 0.93, 0.98)}
    return {"power of the height": power()} | of


def trial(name: str, plans: int) -> dict[str, Any]:
    """Repeated plans of one response."""
    response = responses()[name]
    rng = np.random.default_rng(11)
    return {"name": name} | judged([searched_plan(rng, response) for _ in range(plans)], response.limits[0])


PLANS = 25
"""Plans of each response, of thirty columns each."""


def trials() -> list[dict[str, Any]]:
    """All responses, as many at a time as there are cores."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(trial, responses(), itertools.repeat(PLANS)))
