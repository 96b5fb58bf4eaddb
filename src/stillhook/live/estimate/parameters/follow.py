"""Parameters of one balance, followed over the half waves."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.live.estimate.accuracy import Accuracies, half_width
from stillhook.live.estimate.parameters.catalogue import PARAMETERS, Parameter
from stillhook.live.estimate.parameters.sums import Sums, apart, effect, fit, series
from stillhook.live.estimate.steps import Alarm, Split, Watch, nuisances, step_of
from stillhook.statistics.estimate import NORMAL_95, Estimate

FEWEST = 8
"""Half waves from which an estimate is stated."""


@dataclass(frozen=True)
class ParameterEstimate:
    """What a window says of a parameter. value with its interval; limits: largest error from each source, random:
    standard uncertainty from the scatter, both in the parameter's unit. start, end of the window [s]."""

    value: Estimate
    limits: Mapping[str, float]
    random: float
    start: float
    end: float
    half_waves: int


@dataclass(frozen=True)
class ParameterState:
    """estimate: None where there is none, and `reasons` say why; applied: value that may be used in the twin, None where
    it may not, and `bounds` say why; alarms since the start."""

    meaning: str
    unit: str
    estimate: ParameterEstimate | None
    reasons: tuple[str, ...]
    applied: float | None
    bounds: tuple[str, ...]
    alarms: tuple[Alarm, ...]


def estimate(rows: Sequence[Sums], of: Parameter, accuracies: Accuracies) -> ParameterEstimate | None:
    """A parameter over a window, with its 95 % interval."""
    if len(rows) < FEWEST:
        return None
    x, y = of.x, of.y
    found = fit(rows, x, y)
    if found is None:
        return None
    b, errors = float(found.b[0]), of.errors(accuracies)
    limits = {n: abs(effect(rows, x, found, of.unit_of(column))) * size for n, (column, size) in errors.items()}
    structural = max(apart(rows, x, y), of.structural)
    half = half_width([*limits.values(), structural], found.u * found.t / NORMAL_95)
    slope = of.around(b, 1.0, 0).half
    return ParameterEstimate(
        value=of.around(b, half, len(rows), structural),
        limits={n: slope * size for n, size in limits.items()},
        random=slope * found.u,
        start=rows[0].t,
        end=rows[-1].t,
        half_waves=len(rows),
    )


def split_of(rows: Sequence[Sums], of: Parameter) -> Split | None:
    """The step of a parameter that fits the last half waves best."""
    said = series(rows, of.x, of.y)
    if said is None:
        return None
    m, y = said
    sign, speed, t = (np.array([getattr(r, name) for r in rows]) for name in ("sign", "speed", "t"))
    columns = np.column_stack([nuisances(m, speed, t), m * sign])
    return step_of(m, y, columns, sign, of.floor, lambda before, after: abs(of.rise(before, after)) >= of.least)


class Follower:
    """The parameters of one balance, their last half waves and steps. A step of one begins the window of all anew."""

    def __init__(self, balance: str, rows: deque[Sums]) -> None:
        self.rows = rows
        self.parameters = tuple(p for p in PARAMETERS if p.balance == balance)
        self.watch = Watch()

    def alarms(self, name: str) -> list[Alarm]:
        """The last alarms of a parameter."""
        return [a for a in self.watch.alarms if a.parameter == name]

    def look(self) -> None:
        """Look for a step that the last half wave shows; of several parameters that of the most standard errors."""
        best: list[Parameter] = []

        def split(recent: Sequence[Sums]) -> Split | None:
            tried = [(s, p) for p in self.parameters if (s := split_of(recent, p)) is not None]
            if not tried:
                return None
            found, parameter = max(tried, key=lambda one: one[0].significance)
            best[:] = [parameter]
            return found

        def alarm(t: float, onset: float, found: Split) -> Alarm:
            of = best[0]
            half = found.half * of.around(found.before, 1.0, 0).half / (1.0 if of.unit else abs(of.value(found.before)))
            rise = Estimate.around(of.rise(found.before, found.after), half, found.n)
            return Alarm(t, onset, rise, of.name, of.unit, of.meaning, of.cause)

        self.watch.look(self.rows, split, alarm)

    def window(self, since: float) -> list[Sums]:
        """Half waves of the window."""
        return [r for r in self.rows if r.t > max(since, self.watch.since)]
