"""What is measured against the twin, sample by sample, and how much friction it shows; without a process or a clock."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.live.estimate import FrictionEstimator, FrictionState
from stillhook.live.estimate.balance import ENCODER
from stillhook.live.estimate.half_waves import LONGEST
from stillhook.live.observer.panel import Proposal
from stillhook.live.observer.settings import ObserverSettings, estimator
from stillhook.live.observer.signals import SIGNALS, other_unit
from stillhook.live.observer.stream import SenderClock, Stream
from stillhook.live.residual import ResidualModel, read_model
from stillhook.live.servers.served import ALARM
from stillhook.live.watch import comparison as watch
from stillhook.live.watch.comparison import Comparison
from stillhook.live.watch.journal import Entry
from stillhook.spec.crane import Crane

STEP = 0.02
"""Time between two rows for the estimator [s]."""
PER_SAMPLE = 5
"""Rows to a sample that is compared: the median of so many."""
DELAY = 0.8
"""How far the rows stay behind the present [s]: values that are on their way come in."""
BLOCK = 500
"""Rows that are worked off together at most."""
SETTLE = 10.0
"""Begin of a comparison in which standing offsets are measured, and nothing is compared [s]."""
STANDING = ("s_w",)
"""Signals that are compared from where each side began: a counter has a zero of its own."""
MOST_OFFSET = 0.5
"""Largest offset of the encoder's clock that is put right [s]."""
LEAST_OFFSET = 0.01
"""Change of that offset that is followed [s]: a wire at 1 m/s moves by a centimetre."""
NEAR = 0.1
"""Longest time between two rows of the twin that a sample may lie between [s]."""
UNITS_EVERY = 100
"""Samples over which units are looked at."""
FACTOR = "friction_factor"
ESTIMATE = (f"estimate.{FACTOR}", f"low.{FACTOR}", f"high.{FACTOR}", f"{ALARM}.{FACTOR}")
"""Numbers of the estimate: value, 95 % interval, and 1 from a step of friction until an estimate after it is known."""

LEARNED = ("level4.T_f", "level4_half.T_f", "level4_applied.T_f")
"""Numbers of a model of level 4: what it adds to the friction torque of the estimate, half of its interval, and what of
it may be used, 0 where it is vetoed. They are shown; no twin runs with them."""


class Task(NamedTuple):
    """crane; names of the twin's rows; settings; speed: the winch's time over that of the wall."""

    crane: Crane
    names: tuple[str, ...]
    settings: ObserverSettings
    speed: float = 1.0


def shown_names(settings: ObserverSettings) -> tuple[str, ...]:
    """Numbers that an observer publishes."""
    learned = () if settings.residual is None else LEARNED
    return (*watch.shown_names(settings.signals, settings.virtual), *ESTIMATE, *learned)


class Observer:
    """Compares and estimates. Parameters: task; begin: UTC of its time 0 [s]; tell: takes name, text and value of an
    event.

    `hear` takes messages, `see` takes rows of the twin, `advance` works off what is DELAY old. `values` are then the
    numbers of `shown_names`, `proposal` what there is to say of friction.
    """

    def __init__(self, task: Task, begin: float, tell: Callable[[str, str, float], None]) -> None:
        self._task, self._begin, self._tell = task, begin, tell
        self._names = task.names
        self._at = {name: task.names.index(name) for name in ("time_utc", "lateness")}
        self._cycle = task.crane.control.t_cycle
        self._stream, self._clock = Stream(), SenderClock()
        self._twin: deque[tuple[float, FloatArray]] = deque(maxlen=4096)
        self._next = 0
        self._comparison = Comparison(task.crane, every=PER_SAMPLE * STEP, accuracies=task.settings.accuracies)
        self._standing: dict[str, list[float]] = {name: [] for name in STANDING}
        self._first = math.nan
        self._squares: dict[str, FloatArray] = {}
        self._units: dict[str, str] = {}
        self._estimator: FrictionEstimator | None
        try:
            self._estimator = estimator(task.crane, task.settings)
        except IdentifyError:
            self._estimator = None
        self._residual: ResidualModel | None = None
        if (s := task.settings).residual is not None:
            self._residual = ResidualModel(task.crane, read_model(s.residual, task.crane), gas_side=s.gas_side)
        self._state: FrictionState | None = None
        self._last_step = math.nan
        self._offset = 0.0
        self.values = dict.fromkeys(shown_names(task.settings), math.nan)
        self.proposal = Proposal(begin)

    def hear(self, arrival: float, stamp: float, values: Mapping[str, float]) -> None:
        """A message of measured values. arrival, stamp: UTC [s]."""
        t = self._clock.at(arrival, stamp)
        if math.isfinite(self._clock.jump):
            text = f"The clock of the measured values jumped by {self._clock.jump:.6g} s; their arrival counts again."
            self._tell("clock", text, self._clock.jump)
        if t is not None:
            self._stream.add(self._time(t), values)

    def see(self, row: FloatArray) -> None:
        """A row of the twin."""
        t = self._time(row[self._at["time_utc"]] - row[self._at["lateness"]]) + self._cycle
        if not self._twin or t > self._twin[-1][0]:
            self._twin.append((t, row[: len(self._names)]))

    def advance(self, now: float) -> None:
        """Work off what is old enough at a time, UTC [s]."""
        end = math.floor((self._time(now) - DELAY * self._task.speed) / STEP)
        if end - self._next > 100 * BLOCK:
            self._next = end - BLOCK  # halted for longer than anything that is kept
        while self._next + PER_SAMPLE <= end:
            count = min(BLOCK, (end - self._next) // PER_SAMPLE * PER_SAMPLE)
            self._block(self._next, count)
            self._next += count
        self._propose(now)

    # What is behind it

    def _time(self, utc: float) -> float:
        """Time of the observer: of the winch since it began [s]."""
        return (utc - self._begin) * self._task.speed

    def _block(self, first: int, count: int) -> None:
        times: FloatArray = STEP * np.arange(first, first + count, dtype=np.float64)
        rows = self._stream.rows(times)
        self._stream.forget(times[-1] - MOST_OFFSET)
        if rows:
            self._compare(times, rows)
            self._estimate(times, rows)

    def _compare(self, times: FloatArray, rows: Mapping[str, FloatArray]) -> None:
        middle = times[PER_SAMPLE // 2 :: PER_SAMPLE]
        if self._offset:
            late = self._stream.rows(times + self._offset, ENCODER)
            rows = {**rows, **late}
        medians = {name: np.median(x.reshape(-1, PER_SAMPLE), axis=1) for name, x in rows.items()}
        for i, t in enumerate(middle.tolist()):
            simulated = self._simulated(t)
            measured = {name: float(x[i]) for name, x in medians.items() if math.isfinite(x[i])}
            if simulated is None or not measured.keys() & SIGNALS.keys():
                continue
            if not math.isfinite(self._first):
                self._first = t
            self._weigh(measured, simulated)
            if t - self._first < SETTLE:
                for name in measured.keys() & self._standing.keys():
                    self._standing[name].append(measured[name] - simulated[name])
                continue
            for name, offsets in self._standing.items():
                if name in measured:
                    measured[name] -= _middle(offsets, measured[name] - simulated[name])
            self._judge(self._comparison.add(measured, simulated))

    def _simulated(self, t: float) -> dict[str, float] | None:
        """The twin at a time; None where no rows are near it."""
        while len(self._twin) > 1 and self._twin[1][0] <= t:
            self._twin.popleft()
        if len(self._twin) < 2:
            return None
        (before, a), (after, b) = self._twin[0], self._twin[1]
        if not before <= t <= after or after - before > NEAR * self._task.speed:
            return None
        row = a + (t - before) / (after - before) * (b - a)
        return dict(zip(self._names, row.tolist(), strict=True))

    def _judge(self, changes: Sequence[Entry]) -> None:
        self.values |= {name: x for name, x in self._comparison.shown.items() if name in self.values}
        for entry in changes:
            self._tell(entry.event, entry.text, math.nan)

    def _weigh(self, measured: Mapping[str, float], simulated: Mapping[str, float]) -> None:
        """Say where a signal seems to be in another unit than SI; the estimator goes without it meanwhile."""
        for name in measured.keys() & SIGNALS.keys() & simulated.keys():
            sums = self._squares.setdefault(name, np.zeros(3))
            sums += (1.0, measured[name] ** 2, simulated[name] ** 2)
            if sums[0] < UNITS_EVERY:
                continue
            unit = other_unit(name, math.sqrt(sums[1]), math.sqrt(sums[2]))
            if unit and unit != self._units.get(name):
                text = f"{name} seems to be in {unit}. It is left out of the estimate. Send it in SI."
                self._tell("unit", text, math.sqrt(sums[1] / sums[0]))
            self._units[name] = unit
            sums[:] = 0.0

    def _estimate(self, times: FloatArray, rows: Mapping[str, FloatArray]) -> None:
        if self._estimator is None:
            return
        doubted = [name for name, unit in self._units.items() if unit]
        known = {n: np.full_like(x, np.nan) if n in doubted else x for n, x in rows.items()}
        state = self._state = self._estimator.update({"time": times, **known})
        if self._residual is not None and not self._estimator.missing(known):
            learned = self._residual.update({"time": times, **known}, state)
            self.values |= dict(zip(LEARNED, (learned.torque, learned.half, learned.applied), strict=True))
        self._follow_clock(state)
        if state.alarms and state.alarms[-1].t != self._last_step:
            alarm = state.alarms[-1]
            self._last_step = alarm.t
            ago = f"{(self._next * STEP - alarm.onset) / self._task.speed:.0f} s before this event"
            text = alarm.message.replace(f"since {alarm.onset:.0f} s", f"since {ago}")
            self._tell("alarm", text, alarm.rise.value)
            self.proposal = self.proposal._replace(steps=self.proposal.steps + 1, step=text)

    def _follow_clock(self, state: FrictionState) -> None:
        """Compare the encoder's values at the times that the estimator finds for them."""
        clock = None if state.estimate is None else state.estimate.clock
        if clock is None or not clock.found or abs(clock.offset) > MOST_OFFSET:
            return
        if abs(clock.offset - self._offset) > LEAST_OFFSET:
            self._offset = clock.offset
            text = (
                f"{', '.join(ENCODER)} come {1e3 * self._offset:.0f} ms later than the pressures, which is taken out."
            )
            self._tell("encoder-clock", text, self._offset)

    def _propose(self, now: float) -> None:
        state, t = self._state, self._time(now)
        estimate = None if state is None else state.estimate
        deviating = ", ".join(sorted(d.name for d in self._comparison.deviations if d.alarm))
        before = self.proposal._replace(time=now, known=False, value=None, deviating=deviating)
        if self._estimator is None:
            self.proposal = before._replace(reason="friction of this winch type is not estimated")
            return
        if state is None or estimate is None or t - estimate.end > LONGEST + DELAY:
            reason = "no rows yet" if state is None else "; ".join(state.reasons) or "no half waves any more"
            self.proposal = before._replace(reason=reason if estimate is None else "no half waves any more")
            self.values |= dict.fromkeys(ESTIMATE[:3], math.nan)
        else:
            x = estimate.system
            self.values |= dict(zip(ESTIMATE, (x.value, x.low, x.high), strict=False))
            reason = "; ".join(state.bounds)
            self.proposal = before._replace(known=True, value=state.applied, low=x.low, high=x.high, reason=reason)
        stepped = state is not None and bool(state.alarms)
        after = estimate is not None and stepped and estimate.start > state.alarms[-1].onset  # type: ignore[union-attr]
        self.values[ESTIMATE[3]] = float(stepped and not after)


def _middle(offsets: list[float], now: float) -> float:
    """Median of standing offsets; without any the one of now begins."""
    if not offsets:
        offsets.append(now)
    return float(np.median(offsets))
