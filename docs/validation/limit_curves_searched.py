"""Limits of made-up responses whose cells are placed by the search of the tool: growth without end, and growth that
levels off about the limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stillhook.plan.tiers.time_domain.curves import ColumnRuns, CurveLimits, curve_of, limits_of_curve
from stillhook.plan.tiers.time_domain.measures import Measure
from stillhook.plan.tiers.time_domain.search import Search, next_height
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
    """A number that rises with the height: period [s], angle [rad] of columns (c,); level over its limit; scatter (c,)
    of ln of its largest value in a run; end: largest value that there is; guess (c,): about its limits [m]."""

    period: Array
    angle: Array
    level: Level
    scatter: Array
    guess: Array
    end: float = math.inf
    limits: Array = field(init=False)

    def __post_init__(self) -> None:
        beyond = self.level(FINE) > 1.0
        first = np.where(beyond.any(axis=1), FINE[beyond.argmax(axis=1)], math.inf)
        object.__setattr__(self, "limits", first)

    def runs(self, rng: np.random.Generator, i: int, Hs: float, n: int) -> Array:
        """Largest values of n runs of a column."""
        z = rng.gumbel(size=n) + math.log(-math.log(P90))
        level = self.level(np.array([Hs]))[i, 0]
        return np.minimum(level * np.exp(self.scatter[i] / 1.2826 * z), self.end)


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
        period, angle, lambda Hs: (Hs / H[:, None]) ** growth[:, None], 0.4 + 0.08 * np.cos(period / 2.0), H, 1.11
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

    return Response(period, angle, level, np.full(30, 0.25), 1.6 * (period / 9.0) ** 0.3)


@dataclass(eq=False)
class Column:
    """Cells of a column under way."""

    guess: float
    cells: dict[float, Array] = field(default_factory=dict)
    done: bool = False

    @property
    def heights(self) -> list[float]:
        return sorted(self.cells)


def searched_plan(
    rng: np.random.Generator, response: Response, search: Search | None = None, highest: float = HIGHEST
) -> tuple[CurveLimits, int]:
    """Limits of one plan whose cells are placed, and given more runs, as `stillhook.plan.tiers.time_domain.search`
    does for one phase, and the number of its runs."""
    search = search or Search()
    every = [Column(g * math.exp(rng.normal(0.0, GUESS_OFF))) for g in response.guess]
    found: CurveLimits | None = None
    for _ in range(60):
        asked = [_asked(column, i, found, search, highest) for i, column in enumerate(every)]
        for i, ask in enumerate(asked):
            if ask is not None:
                old = every[i].cells.get(ask[0], np.zeros(0))
                new = response.runs(rng, i, ask[0], ask[1])
                every[i].cells[ask[0]] = np.concatenate((old, new))
        if all(ask is None for ask in asked):
            break
        of = [column_runs(response, i, column, found) for i, column in enumerate(every)]
        found = limits_of_curve(curve_of(of), np.ones(len(of)), highest)
    assert found is not None
    return found, sum(len(x) for column in every for x in column.cells.values())


def _asked(
    column: Column, i: int, found: CurveLimits | None, search: Search, highest: float
) -> tuple[float, int] | None:
    """Height and number of runs that a column gets next."""
    if column.done:
        return None
    Hs = column.heights
    limit = math.inf if found is None else float(np.nan_to_num(found.Hs[i], nan=math.inf))
    seen = math.inf if found is None else min(limit, float(found.direct[i]))
    wanted = next_height(Hs, seen, column.guess, highest, search)
    if wanted is not None:
        return wanted, search.seeds
    runs = sum(map(len, column.cells.values()))
    assert found is not None
    if 0.0 < limit < math.inf and found.half[i] > search.width and runs < search.most_seeds:
        return min(Hs, key=lambda h: abs(h - limit)), search.more
    column.done = True
    return None


def column_runs(response: Response, i: int, column: Column, found: CurveLimits | None) -> ColumnRuns:
    """Runs of a column, looked at about its limit."""
    Hs = column.heights
    limit = math.inf if found is None else float(np.nan_to_num(found.Hs[i], nan=math.inf))
    measure = Measure("x", q=P90, end=response.end)
    cells = tuple((h, {"duration": np.ones(len(x)), "x": x}) for h, x in sorted(column.cells.items()))
    about = min(max(limit, Hs[0]), Hs[-1])
    return ColumnRuns(float(response.period[i]), float(response.angle[i]), measure, about, 0.0, cells)


def covers(found: CurveLimits, limits: Array) -> Array:
    """Whether the interval of each limit holds it; one that is open above ends at infinity."""
    low = np.where(np.isnan(found.low), found.Hs, found.low)
    high = np.where(np.isnan(found.high), math.inf, found.high)
    return (low <= limits) & (limits <= high)


def judged(plans: Sequence[tuple[CurveLimits, int]], limits: Array) -> dict[str, Any]:
    """Coverage and errors of repeated plans."""
    Hs = np.array([np.nan_to_num(found.Hs, nan=HIGHEST, posinf=HIGHEST) for found, _ in plans])
    off = np.log(np.minimum(Hs, HIGHEST) / np.minimum(limits, HIGHEST))
    covered = np.array([covers(found, limits) for found, _ in plans])
    by_plan = covered.mean(axis=1)
    return {
        "coverage": float(covered.mean()),
        "error": float(by_plan.std(ddof=1) / math.sqrt(len(plans))),
        "rms": float(np.sqrt(np.mean(off**2))),
        "bias": float(off.mean()),
        "unsafe": float((off > 0.1).mean()),
        "too_low": float(np.mean([(found.low > limits).mean() for found, _ in plans])),
        "above": float(np.mean([(found.high < limits).mean() for found, _ in plans])),
        "open": float(np.mean([np.mean(~np.isfinite(found.high)) for found, _ in plans])),
        "half": float(np.nanmedian([found.half for found, _ in plans])),
        "runs": float(np.mean([n for _, n in plans])) / len(limits),
        "limited": float(np.isfinite(limits).mean()),
    }


def responses() -> Mapping[str, Response]:
    """All by name."""
    of = {f"plateau at {p:.2f}": plateau(p) for p in PLATEAUS}
    of |= {f"plateau at {p:.2f}, rises beyond 2.5 m": plateau(p, rises=True) for p in (0.85, 0.93, 0.98)}
    return {"power of the height": power()} | of


def trial(name: str, plans: int) -> dict[str, Any]:
    """Repeated plans of one response."""
    response = responses()[name]
    rng = np.random.default_rng(11)
    return {"name": name} | judged([searched_plan(rng, response) for _ in range(plans)], response.limits)
