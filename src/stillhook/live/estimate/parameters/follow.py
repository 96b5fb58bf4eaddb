"""Parameters of one balance, followed over the half waves."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import Accuracies, half_width
from stillhook.live.estimate.parameters.catalogue import PARAMETERS, Parameter
from stillhook.live.estimate.parameters.informed import SHAPES, Informed, informed
from stillhook.live.estimate.parameters.sums import Sums, Window, apart, scatter_of, sides, window_of
from stillhook.live.estimate.steps import SIGNIFICANCE, Alarm, Split, Watch, step_places
from stillhook.statistics.estimate import NORMAL_95, Estimate, t_factor

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
    """estimate: None where there is none, and `reasons` say why; applied: value that may be used in the twin, None
    where it may not, and `bounds` say why; alarms since the start."""

    meaning: str
    unit: str
    estimate: ParameterEstimate | None
    reasons: tuple[str, ...]
    applied: float | None
    bounds: tuple[str, ...]
    alarms: tuple[Alarm, ...]


def fitted(rows: Window, of: Parameter, X: FloatArray) -> Informed | None:
    """A parameter's columns X (n, p, k), and what may be next to them, over half waves."""
    scaled = dict.fromkeys(SHAPES, of.by.index("leak")) if "leak" in of.by else {}
    return informed(rows, X, of.limited(rows.G.sum(axis=0)), of.y, scaled, of.unclosed)


def uncertain(of: Parameter, found: Informed, g: FloatArray, accuracies: Accuracies) -> tuple[dict[str, float], float]:
    """What is uncertain of a combination g (p,) of the coefficients: limits by source, and standard uncertainty from
    the scatter."""
    answer = g @ found.answer
    limits = {n: abs(float(answer @ of.unit_of(c))) * size for n, (c, size) in of.errors(accuracies).items()}
    limits |= {name: abs(float(g @ effect)) for name, effect in found.effects.items()}
    return limits, scatter_of(found.influence @ g, found.free)


def estimate(rows: Window, of: Parameter, accuracies: Accuracies) -> ParameterEstimate | None:
    """A parameter over a window, with its 95 % interval."""
    n = len(rows.t)
    columns = np.array([of.unit_of(name) for name in of.by])
    if n < FEWEST or (found := fitted(rows, of, np.broadcast_to(columns, (n, *columns.shape)))) is None:
        return None
    b = float(found.b[0])
    limits, u = uncertain(of, found, np.eye(len(found.b))[0], accuracies)
    law = max(apart(rows, of.x, of.y - found.limited), of.structural)
    half = half_width([*limits.values(), law], u * t_factor(max(n - found.free, 1)) / NORMAL_95)
    structural = float(np.hypot(law, sum(limits.get(name, 0.0) for name in SHAPES)))
    slope = of.around(b, 1.0, 0).half
    return ParameterEstimate(
        value=of.around(b, half, n, structural),
        limits={name: slope * size for name, size in limits.items()},
        random=slope * u,
        start=float(rows.t[0]),
        end=float(rows.t[-1]),
        half_waves=n,
    )


def rise_of(rows: Window, of: Parameter, split: Split, accuracies: Accuracies) -> Estimate | None:
    """The change of a parameter at a step, with its 95 % interval: the first coefficient before and after it, all
    others in common, with what drifts as oil warms. None where that is not a step: within the interval, or fewer than
    SIGNIFICANCE standard errors."""
    n, place = len(rows.t), split.place
    columns = np.array([of.unit_of(name) for name in (*of.by, *of.with_time, *of.with_speed, of.by[0])])
    X = np.tile(columns, (n, 1, 1))
    X[place:, 0], X[:place, -1] = 0.0, 0.0
    time, p = (rows.t - rows.t[place]) / max(float(np.ptp(rows.t)), 1.0), len(of.by) + len(of.with_time)
    X[:, len(of.by) : p] *= time[:, None, None]
    X[:, p:-1] *= (rows.speed / rows.speed.mean() - 1.0)[:, None, None]
    others = [i for i in range(n) if i != place]  # half of that one is before, half after
    found = fitted(Window(*(x[others] for x in rows)), of, X[others])
    if found is None:
        return None
    before, after = float(found.b[0]), float(found.b[found.free - 1])
    g, eps = np.zeros(len(found.b)), 1e-6
    g[0] = (of.rise(before + eps, after) - of.rise(before - eps, after)) / (2.0 * eps)
    g[found.free - 1] = (of.rise(before, after + eps) - of.rise(before, after - eps)) / (2.0 * eps)
    limits, u = uncertain(of, found, g, accuracies)
    t = t_factor(max(n - 1 - found.free, 1))
    u = max(u, abs(g[found.free - 1]) * split.half / t)  # scatter of a quiet stretch is no measure of what follows
    rise, half = of.rise(before, after), half_width(limits.values(), u * t / NORMAL_95)
    return Estimate.around(rise, half, split.n) if abs(rise) > max(half, SIGNIFICANCE * u, of.least) else None


def split_of(w: Window, of: Parameter) -> Split | None:
    """The step of a parameter that fits the last half waves best."""
    n = len(w.t)
    places = step_places(n)
    found = sides(w, of.x, of.y, places, of.floor) if len(places) else None
    if found is None:
        return None
    steps = [
        Split(
            int(place), float(before), float(after), t_factor(n - 6) * float(u), n - 1 - int(place), size, float(left)
        )
        for place, before, after, u, left in zip(places, *found, strict=True)
        if (size := float(abs(after - before) / u)) >= SIGNIFICANCE
        and abs(of.rise(float(before), float(after))) >= of.least
        and np.ptp(w.sign[place + 1 :]) > 0.0
    ]
    return min(steps, key=lambda step: step.left, default=None)


class Follower:
    """The parameters of one balance, their last half waves and steps. A step of one begins the window of all again."""

    def __init__(self, balance: str, rows: deque[Sums], accuracies: Accuracies) -> None:
        self.rows, self.accuracies = rows, accuracies
        self.parameters = tuple(p for p in PARAMETERS if p.balance == balance)
        self.watch = Watch()

    def alarms(self, name: str) -> list[Alarm]:
        """The last alarms of a parameter."""
        return [a for a in self.watch.alarms if a.parameter == name]

    def look(self) -> None:
        """Look for a step that the last half wave shows; of several parameters that which leaves least."""
        best: list[tuple[Parameter, Estimate]] = []

        def split(recent: Sequence[Sums]) -> Split | None:
            side_by_side = window_of(recent)
            tried = [(s, p) for p in self.parameters if (s := split_of(side_by_side, p)) is not None]
            if not tried:
                return None
            found, parameter = min(tried, key=lambda one: one[0].left)
            if (rise := rise_of(side_by_side, parameter, found, self.accuracies)) is None:
                return None
            best[:] = [(parameter, rise)]
            return found

        def alarm(t: float, onset: float, found: Split) -> Alarm:
            of, rise = best[0]
            return Alarm(t, onset, rise, of.name, of.unit, of.meaning, of.cause)

        self.watch.look(self.rows, split, alarm)

    def window(self, since: float) -> Window:
        """Half waves of the window."""
        return window_of([r for r in self.rows if r.t > max(since, self.watch.since)])
