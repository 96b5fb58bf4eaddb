"""Parameters of one balance, followed over the half waves."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.live.estimate.accuracy import Accuracies, half_width
from stillhook.live.estimate.parameters.catalogue import PARAMETERS, Parameter
from stillhook.live.estimate.parameters.sums import Sums, Window, apart, effect, fit, sides, window_of
from stillhook.live.estimate.steps import BEFORE_MOST, SIGNIFICANCE, Alarm, Split, Watch, step_places
from stillhook.statistics.estimate import NORMAL_95, Estimate, t_factor

FEWEST = 8
"""Half waves from which an estimate is stated."""
NEARLY = 1.2
"""Sum of squares over that of the crane file's form up to which another form of the leakage counts [-]: the law of a
crane is none of the published ones, so the best fit excludes few."""


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


def estimate(rows: Window, of: Parameter, accuracies: Accuracies) -> ParameterEstimate | None:
    """A parameter over a window, with its 95 % interval."""
    if len(rows.t) < FEWEST:
        return None
    x, y = of.x, of.y
    found = fit(rows, x, y)
    if found is None:
        return None
    b, errors = float(found.b[0]), of.errors(accuracies)
    limits = {n: abs(effect(rows, x, found, of.unit_of(column))) * size for n, (column, size) in errors.items()}
    forms = max((abs(one - b) for one in by_other_forms(rows, of)), default=0.0)
    law = max(apart(rows, x, y), of.structural)
    half = half_width([*limits.values(), forms, law], found.u * found.t / NORMAL_95)
    structural = float(np.hypot(forms, law))
    slope = of.around(b, 1.0, 0).half
    return ParameterEstimate(
        value=of.around(b, half, len(rows.t), structural),
        limits={n: slope * size for n, size in limits.items()},
        random=slope * found.u,
        start=float(rows.t[0]),
        end=float(rows.t[-1]),
        half_waves=len(rows.t),
    )


def by_other_forms(rows: Window, of: Parameter) -> list[float]:
    """The coefficient with other forms of the leakage that fit nearly as well; of the leakage itself by the flow that
    leaks."""
    out, total, least = [], rows.G.sum(axis=0), np.inf
    for form in ("leak", *of.forms) if of.forms else ():
        other = of._replace(by=tuple(form if name == "leak" else name for name in of.by))
        if (found := fit(rows, other.x, other.y)) is None:
            continue
        left = other.y.copy()
        left[other.x] -= found.b
        misfit = float(left @ total @ left)
        least = misfit if form == "leak" else least
        if misfit <= NEARLY * least:
            flow = [float(total[of.columns.index(name), of.columns.index("side")]) for name in (form, "leak")]
            out.append(float(found.b[0]) * (flow[0] / flow[1] if of.by[0] == "leak" else 1.0))
    return out


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
    """The parameters of one balance, their last half waves and steps. A step of one begins the window of all anew."""

    def __init__(self, balance: str, rows: deque[Sums], accuracies: Accuracies) -> None:
        self.rows, self.accuracies = rows, accuracies
        self.parameters = tuple(p for p in PARAMETERS if p.balance == balance)
        self.watch = Watch()

    def alarms(self, name: str) -> list[Alarm]:
        """The last alarms of a parameter."""
        return [a for a in self.watch.alarms if a.parameter == name]

    def look(self) -> None:
        """Look for a step that the last half wave shows; of several parameters that which leaves least."""
        best: list[Parameter] = []

        def split(recent: Sequence[Sums]) -> Split | None:
            side_by_side = window_of(recent)
            tried = [(s, p) for p in self.parameters if (s := split_of(side_by_side, p)) is not None]
            if not tried:
                return None
            found, parameter = min(tried, key=lambda one: one[0].left)
            best[:] = [parameter]
            return found

        def alarm(t: float, onset: float, found: Split) -> Alarm:
            of, before = best[0], found.before
            half = found.half * of.around(before, 1.0, 0).half
            change = of.rise(before, found.after)
            if not of.unit:  # over what it was, which is known no better than an estimate
                first = window_of([r for r in self.rows if r.t < onset][-BEFORE_MOST:])
                known = estimate(first, of, self.accuracies)
                half = half / abs(of.value(before))
                half = np.inf if known is None else np.hypot(half, change * known.value.half / known.value.value)
            rise = Estimate.around(change, float(half), found.n)
            return Alarm(t, onset, rise, of.name, of.unit, of.meaning, of.cause)

        self.watch.look(self.rows, split, alarm)

    def window(self, since: float) -> Window:
        """Half waves of the window."""
        return window_of([r for r in self.rows if r.t > max(since, self.watch.since)])
