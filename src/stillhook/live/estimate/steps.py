"""Steps of a parameter: when, by how much, and what may be behind them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.live.estimate.half_waves import HalfWave
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.units import number

LEAST_STEP = 0.05
"""Smallest step of all losses that raises an alarm [-]: warming oil changes them by some per cent in minutes."""
SIGNIFICANCE = 6.0
"""Standard errors that a step must be: a day has some 17,000 half waves, with ten moments tried at each."""
AFTER_FEWEST, AFTER_MOST = 3, 12
"""Half waves since the step that are looked at."""
BEFORE_FEWEST, BEFORE_MOST = 10, 60
"""Half waves before it that are compared with."""
MOST_ALARMS = 100
"""Alarms that are kept, the last ones."""
EVEN = 1e-12
"""Ridge by which columns that go together are separated, of columns of unit length [-]."""
LEAST_SCATTER = 0.01
"""Scatter of a half wave over its loss that is taken at least [-]: a quiet stretch does not measure what follows."""


class Alarm(NamedTuple):
    """A step of a parameter. t: moment that it was found [s]; onset: middle of the half wave in which it fell [s];
    rise: change with its 95 % interval, of a factor over what it was before; parameter: its name, unit, meaning and
    what may be behind the step."""

    t: float
    onset: float
    rise: Estimate
    parameter: str = "friction"
    unit: str = ""
    meaning: str = "total loss"
    cause: str = (
        "friction, if leakage and displacement are as in the file; temperature of the oil, brake, sheaves, bearings"
    )

    @property
    def message(self) -> str:
        """One line: what was measured, and its cause as far as it is known."""
        word = "risen" if self.rise.value > 0.0 else "fallen"
        scale, unit = (1e3, "ms") if self.unit == "s" else (100.0, "%")
        low, high = sorted((scale * abs(self.rise.low), scale * abs(self.rise.high)))
        what = self.meaning[0].upper() + self.meaning[1:]
        return (
            f"{what} has {word} by {number(scale * abs(self.rise.value), 2)} {unit} ({number(low, 2)} to"
            f" {number(high, 2)} {unit}) since {self.onset:.0f} s. Check: {self.cause}."
        )


class Split(NamedTuple):
    """A step between half waves: number of the half wave in which it fell; coefficients before and after, half of the
    95 % interval of their difference, and n half waves after; standard errors that it is, and sum of squares that it
    leaves."""

    place: int
    before: float
    after: float
    half: float
    n: int
    significance: float
    left: float


def nuisances(m: FloatArray, speed: FloatArray, t: FloatArray) -> FloatArray:
    """Columns (n, 2) that both sides of a step share: slopes of the coefficient with the strength of the half waves, so
    that a sea that grows under a law of another form raises no alarm, and with time, so that oil that warms is not part
    of a step."""
    return np.column_stack([m * (speed / speed.mean() - 1.0), m * (t - t.mean()) / max(float(np.ptp(t)), 1.0)])


def step_places(n: int) -> IntArray:
    """Numbers of the half waves of n in which a step may have fallen."""
    return np.arange(n - AFTER_FEWEST - 1, max(n - AFTER_MOST - 2, BEFORE_FEWEST - 1), -1)


def step_of(
    m: FloatArray,
    y: FloatArray,
    shared: FloatArray,
    sign: FloatArray,
    floor: float,
    counts: Callable[[float, float], bool],
) -> Split | None:
    """The step of b in y = b m that fits half waves (n,) best, among those that are significant and count; None without
    one. shared (n, k): columns that both sides share; sign: of the motion; floor: least scatter of b.

    The half wave in which it fell belongs to neither side.
    """
    n, k = len(m), shared.shape[1]
    places = step_places(n)
    if not len(places):
        return None
    B = np.column_stack([m, shared, y, sign > 0.0, sign < 0.0])
    sums = np.concatenate([np.zeros((1, k + 4, k + 4)), np.cumsum(B[:, :, None] * B[:, None, :], axis=0)])
    old, new = sums[places], sums[-1] - sums[places + 1]  # before and after each place
    turns = [(side[:, -1, -1] > 0.0) & (side[:, -2, -2] > 0.0) for side in (old, new)]
    good = turns[0] & turns[1]  # hoisting and lowering are both there
    A, c = np.zeros((len(places), k + 2, k + 2)), np.zeros((len(places), k + 2))
    both = old + new
    A[:, 0, 0], A[:, 1, 1], A[:, 2:, 2:] = old[:, 0, 0], new[:, 0, 0], both[:, 1 : k + 1, 1 : k + 1]
    for i, side in ((0, old), (1, new)):
        A[:, i, 2:] = A[:, 2:, i] = side[:, 0, 1 : k + 1]
        c[:, i] = side[:, 0, k + 1]
    c[:, 2:] = both[:, 1 : k + 1, k + 1]
    scale = np.sqrt(np.einsum("nii->ni", A))
    good &= (scale > 0.0).all(axis=1)
    if not good.any():
        return None
    places, A, c, scale, yy = places[good], A[good], c[good], scale[good], both[good, k + 1, k + 1]
    unit = scale[:, :, None] * scale[:, None, :]
    H = np.linalg.inv(A / unit + EVEN * np.eye(k + 2)) / unit
    b = np.einsum("nij,nj->ni", H, c)
    left, freedom = np.maximum(yy - np.sum(b * c, axis=1), 0.0), n - 3 - k
    scatter = np.maximum(np.sqrt(left / freedom), floor * float(np.abs(m).mean()))
    u = scatter * np.sqrt(H[:, 0, 0] + H[:, 1, 1] - 2.0 * H[:, 0, 1])
    significance = np.abs(b[:, 1] - b[:, 0]) / u
    steps = [
        Split(
            int(place),
            float(b[i, 0]),
            float(b[i, 1]),
            t_factor(freedom) * float(u[i]),
            n - 1 - int(place),
            float(significance[i]),
            float(left[i]),
        )
        for i, place in enumerate(places)
        if significance[i] >= SIGNIFICANCE and counts(float(b[i, 0]), float(b[i, 1]))
    ]
    return min(steps, key=lambda step: step.left, default=None)


class Timed(Protocol):
    """A half wave."""

    @property
    def t(self) -> float: ...
    @property
    def seconds(self) -> float: ...


W = TypeVar("W", bound=Timed)


class Watch:
    """Steps of a stream of half waves. since: onset of the last one [s]; alarms: the last ones."""

    def __init__(self) -> None:
        self.since = self._before = -np.inf
        self.alarms: list[Alarm] = []

    def look(
        self,
        waves: Sequence[W],
        split: Callable[[Sequence[W]], Split | None],
        alarm: Callable[[float, float, Split], Alarm],
    ) -> None:
        """Look for a step at the end of the half waves; where one was just found, look again for the moment that it
        fits best."""
        now, last = waves[-1], self.alarms[-1] if self.alarms else None
        again = last is not None and sum(w.t > last.onset for w in waves) <= AFTER_MOST
        since = self._before if again else self.since
        recent = [w for w in itertools.islice(reversed(waves), BEFORE_MOST + AFTER_MOST) if w.t > since][::-1]
        if len(recent) < BEFORE_FEWEST + AFTER_FEWEST + 1 or (step := split(recent)) is None:
            return
        onset = recent[step.place].t
        if again and last is not None:
            self.alarms[-1] = alarm(last.t, onset, step)
        else:
            self._before = self.since
            self.alarms.append(alarm(now.t + 0.5 * now.seconds, onset, step))
            del self.alarms[:-MOST_ALARMS]
        self.since = onset


def friction_step(waves: Sequence[HalfWave]) -> Split | None:
    """The step of all losses. A standing torque is common to both sides, so that an error of load cell or pressures
    raises none. Its interval has what the form of the law makes of it: the difference to a step without a slope with
    the strength of the half waves."""
    model = np.array([w.system + w.motors for w in waves])
    torque, sign = (np.array([getattr(w, name) for w in waves]) for name in ("torque", "sign"))
    columns = nuisances(model, np.array([w.speed for w in waves]), np.array([w.t for w in waves]))

    def of(shared: FloatArray) -> Split | None:
        columns = np.column_stack([shared, np.ones(len(waves))])
        return step_of(model, torque, columns, sign, LEAST_SCATTER, _losses_step)

    step, without = of(columns), of(columns[:, 1:])
    if step is None or without is None:
        return step
    form = step.before * abs(without.after / without.before - step.after / step.before)
    return step._replace(half=float(np.hypot(step.half, form)))


def _losses_step(before: float, after: float) -> bool:
    """Whether a step of the scale counts."""
    return before > 0.0 and abs(after / before - 1.0) >= LEAST_STEP


def friction_alarm(t: float, onset: float, step: Split) -> Alarm:
    """Its alarm."""
    half = step.half / step.before
    return Alarm(t, onset, Estimate.around(step.after / step.before - 1.0, half, step.n))
