"""Friction of a winch that compensates, followed on the stream of rows that its PLC logs."""

from __future__ import annotations

import itertools
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.live.estimate.accuracy import Accuracies
from stillhook.live.estimate.balance import ENCODER, Balance
from stillhook.live.estimate.bounds import PLAUSIBLE, Bounds, Seen
from stillhook.live.estimate.clock import Clock, ClockTracker, coarse_offset
from stillhook.live.estimate.half_waves import LONGEST, HalfWave, cut, reversals
from stillhook.live.estimate.parameters.balances import COMMANDS, standing
from stillhook.live.estimate.parameters.catalogue import NOT_PROVEN, PROVEN
from stillhook.live.estimate.parameters.commands import MakeUp, Setting
from stillhook.live.estimate.parameters.follow import Follower, ParameterState
from stillhook.live.estimate.parameters.follow import estimate as estimate_parameter
from stillhook.live.estimate.regression import FEWEST, FrictionEstimate, estimate
from stillhook.live.estimate.steps import Alarm, Watch, friction_alarm, friction_step
from stillhook.physics.hydraulics.pump import pump_flow
from stillhook.spec.crane import Crane

WINDOW = 300.0
"""Length of the window [s]: some thirty waves, in which oil warms by a kelvin at most."""
SHORTEST_WINDOW, LONGEST_WINDOW = 60.0, 3600.0
"""Windows that may be chosen [s]."""
MOST_WAVES = 600
"""Half waves that are kept."""
MOVE = 5e-3
"""Offset that a clock may lack before the rows are put together again [s]."""
TO_FIND = 60.0
"""Rows from which the offset of the clock is looked for first [s]."""
NO_CLOCK = "no alarms: the clock of the encoder is not found (alpha_p or u_p of a moving winch tells it)"
NOT_DETERMINED = "not determined: its interval is wider than half of what a winch can have"
TOGETHER = 1.0
"""Rows that are worked off together [s]."""
MARGIN = 0.5
"""Rows to either side of a half wave that are kept, besides the clock's reach [s]."""
NOTHING: tuple[str, ...] = ()
RATE = 0.1
"""Half of the time over which a speed is taken from a length [s]: the ringing of the circuit passes (0.2 s cost 0.8 %
of the losses), a wire counter's steps of a millimetre do not."""


@dataclass(frozen=True)
class FrictionState:
    """What is known after the last rows. t of the last row [s]; estimate: None where there is none; reasons: why it
    is missing, or no alarm; applied: factor on the crane file's system friction that may be used in the twin, None
    where it may not, and `bounds` say why; alarms: the last ones since the start; left_out: half waves that say
    nothing, by reason; parameters: leakage, displacement, gas and delays by name."""

    t: float
    estimate: FrictionEstimate | None
    reasons: tuple[str, ...]
    applied: float | None
    bounds: tuple[str, ...]
    alarms: tuple[Alarm, ...]
    left_out: Mapping[str, int]
    parameters: Mapping[str, ParameterState]


class FrictionEstimator:
    """Follows the losses of one crane. `update` takes rows as they come, of any number at a time; memory is bounded.

    Parameters: crane; load payload on the hook [kg], default what the load cell shows; accuracies of the sensors;
    window [s]; gas_side: p_hp is read at the gas instead of at the motors. Errors: IdentifyError for a winch without
    pressures of its motors, and for a window out of range.
    """

    def __init__(
        self,
        crane: Crane,
        *,
        load: float | None = None,
        accuracies: Accuracies | None = None,
        window: float = WINDOW,
        gas_side: bool = False,
    ) -> None:
        if not SHORTEST_WINDOW <= window <= LONGEST_WINDOW:
            raise IdentifyError(
                f"window = {window:g} s: allowed are {SHORTEST_WINDOW:g} s to {LONGEST_WINDOW:g} s; shorter ones hold"
                " too few waves, longer ones hide how friction changes."
            )
        self.balance = Balance(crane, gas_side)
        self.accuracies = accuracies or Accuracies()
        self.window = window
        self._bounds = Bounds(crane, load)
        self._seen = Seen(window)
        active = self.balance.params.active
        self._settings = {"u_p": Setting(active.pump_servo), "u_m": Setting(active.motor_servo)}
        self._make_up = MakeUp(self.balance.params) if self.balance.has_passive else None
        self._waves: deque[HalfWave] = deque(maxlen=MOST_WAVES)
        self._others = {
            name: Follower(name, deque(maxlen=MOST_WAVES), self.accuracies) for name in ("flow", "gas", *COMMANDS)
        }
        self._clock = ClockTracker(self._others["flow"].rows, MOST_WAVES // 4)
        self._watch = Watch()
        self._buffer: dict[str, FloatArray] = {}
        self._reach = self.accuracies.clock
        self._placed = False
        self._turned = np.nan
        self._left_out: Counter[str] = Counter()
        self._missing: tuple[str, ...] = ()
        self._read = True
        self._pending: list[dict[str, FloatArray]] = []
        self._last = np.nan
        self._known: FrictionState | None = None

    def missing(self, rows: Mapping[str, ArrayLike]) -> tuple[str, ...]:
        """Signals that these rows lack."""
        lacking = tuple(name for name in self.balance.needed if name not in rows)
        return lacking if any(name in rows for name in ENCODER) else (*lacking, " or ".join(ENCODER))

    def update(self, rows: Mapping[str, ArrayLike]) -> FrictionState:
        """Take rows, each signal (n,) in SI under its name in `stillhook.variables`, with "time" [s]; returns what is
        known then.

        Errors: IdentifyError where time is missing or does not increase, or columns differ in length.
        """
        block = self._checked(rows)
        if not len(block["time"]):
            return self.state()
        self._last = float(block["time"][-1])
        if (missing := self.missing(block)) != self._missing:
            self._missing, self._known = missing, None
        if missing:
            return self.state()
        block = self._completed(block)
        self._seen.add(block)
        if any(set(old) != set(block) for old in (*self._pending[-1:], *([self._buffer] if self._buffer else []))):
            self._pending, self._buffer = [], {}  # other signals than before: a new log
        self._pending.append(block)
        start = self._pending[0]["time"][0]
        if self._last - start >= TOGETHER:
            self._buffer = _joined([self._buffer, *self._pending] if self._buffer else self._pending)
            self._pending = []
            self._process()
        return self.state()

    def state(self) -> FrictionState:
        """What is known now."""
        if self._known is None or self._known.estimate is None or self._stale:
            self._known = self._state()
        return replace(self._known, t=self._last)

    @property
    def _stale(self) -> bool:
        """Whether the last half wave is long ago."""
        return not self._waves or self._last - self._waves[-1].t > LONGEST

    def _state(self) -> FrictionState:
        t = self._last if self._stale else self._waves[-1].t
        lacking = self._clock.remainder()
        window = [w for w in self._waves if w.t > max(t - self.window, self._watch.since)]
        extra = 0.0 if lacking.found else self.accuracies.clock
        if not self._read:
            extra += self.accuracies.pump_lag
        result = estimate(window, lacking, self.accuracies, extra)
        applied, bounds, reasons = None, NOTHING, self._reasons(t, window)
        if result is not None:
            clock = Clock(self._clock.offset + lacking.offset, lacking.u, lacking.t, lacking.half_waves)
            result, reasons = replace(result, clock=clock), () if lacking.found else (NO_CLOCK,)
            applied, bounds = self._bounds.judge("system friction", result.system.value, PLAUSIBLE, self._seen, window)
        return FrictionState(
            t=t,
            estimate=result,
            reasons=reasons,
            applied=applied,
            bounds=bounds,
            alarms=tuple(self._watch.alarms),
            left_out=dict(self._left_out),
            parameters=self._parameters(t, window),
        )

    def _parameters(self, t: float, waves: list[HalfWave]) -> dict[str, ParameterState]:
        """The other parameters, over their own windows."""
        out = {}
        for balance, of in self._others.items():
            window = of.window(t - self.window)
            for p in of.parameters:
                result, applied, bounds = estimate_parameter(window, p, self.accuracies), None, NOTHING
                reasons = NOTHING
                if result is None:
                    reasons = (self._missing_for(balance) or f"{len(window.t)} of {FEWEST} half waves",)
                elif result.value.half > 0.25 * (p.plausible[1] - p.plausible[0]):
                    result, reasons = None, (NOT_DETERMINED,)
                elif waves:
                    applied, bounds = self._bounds.judge(p.meaning, result.value.value, p.plausible, self._seen, waves)
                    if p.name not in PROVEN:
                        applied, bounds = None, (*bounds, NOT_PROVEN)
                out[p.name] = ParameterState(
                    p.meaning, p.unit, result, reasons, applied, bounds, tuple(of.alarms(p.name))
                )
        return out

    def _missing_for(self, balance: str) -> str:
        """What a balance lacks, "" where it is half waves alone."""
        if balance == "gas":
            return "" if self._make_up is not None else "no passive circuit"
        if balance == "flow":
            lacking = [] if "alpha_p" in self._buffer else ["alpha_p or u_p"]
        else:
            reading = COMMANDS[balance][1]
            read = reading in self._buffer and (reading != "alpha_p" or self._read)
            lacking = [] if read else [reading]
            lacking += [] if f"follow_{reading[-1]}" in self._buffer or not read else [f"u_{reading[-1]}"]
        return f"signals missing: {', '.join(lacking)}" if self._buffer and lacking else ""

    def _reasons(self, t: float, window: list[HalfWave]) -> tuple[str, ...]:
        if self._missing:
            return (f"signals missing: {', '.join(self._missing)}",)
        if not np.isfinite(self._last):
            return ("no rows yet",)
        out = [f"{len(window)} of {FEWEST} half waves"]
        if not self._placed and self._buffer:
            out.append("clock of the encoder not found yet: flow of the pumps and motor speed do not match")
        if not np.isfinite(self._turned) or self._last - self._turned > LONGEST:
            out.append("no reversals of the winch")
        return (*out, *(reason for reason, _ in self._left_out.most_common(2)))

    def _checked(self, rows: Mapping[str, ArrayLike]) -> dict[str, FloatArray]:
        if "time" not in rows:
            raise IdentifyError('Rows without "time": each row needs the time of its clock in s. Add it.')
        block = {name: np.atleast_1d(np.asarray(x, dtype=np.float64)) for name, x in rows.items()}
        t = block["time"]
        if wrong := next((name for name, x in block.items() if x.shape != t.shape), None):
            raise IdentifyError(
                f'Rows: "{wrong}" has shape {block[wrong].shape}, "time" {t.shape}: every signal needs one value a row.'
            )
        last = self._last
        since = f" after rows up to {last:g} s" if np.isfinite(last) else ""
        if not (np.isfinite(t).all() and (np.diff(t) > 0.0).all() and (not len(t) or not t[0] <= last)):
            raise IdentifyError(
                f"Rows from {t[0]:g} s to {t[-1]:g} s{since}: time must increase from row to row. Sort them, or begin"
                " a new estimator."
            )
        return block

    def _completed(self, block: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """With the settings that follow from the commands, for the pumps' own where it was not read, and what the
        make-up pumps give."""
        t, out = block["time"], dict(block)
        for command, setting in self._settings.items():
            if command in block:
                out[f"follow_{command[-1]}"] = setting.follow(t, block[command])
        if "alpha_p" not in block and "follow_p" in out:
            self._read = False
            out["alpha_p"] = out.pop("follow_p")
        if self._make_up is not None:
            s_w = block["s_w"][np.isfinite(block["s_w"])]
            r_eff = self.balance.geometry(float(s_w[-1]) if len(s_w) else 0.0).r_eff
            omega = block["omega_m"] if "omega_m" in block else np.zeros(len(t))
            out["make_up"] = self._make_up.flow(block, standing(block, omega, self.balance), r_eff)
        return out

    def _omega(self) -> FloatArray:
        """Motor speed of the buffer, from wire speed or wire out where it was not logged [rad/s]."""
        x = self._buffer
        if "omega_m" in x:
            return x["omega_m"]
        s_w = x["s_w"][np.isfinite(x["s_w"])]
        r_eff = self.balance.geometry(float(s_w.mean()) if len(s_w) else 0.0).r_eff
        return x["v_w"] / r_eff if "v_w" in x else -_slope(x["time"], x["s_w"]) / r_eff

    def _process(self) -> None:
        t, omega = self._buffer["time"], self._omega()
        if not self._placed and not self._place(t, omega):
            self._trim(0, t)
            return
        done = 0
        for first, last in reversals(np.nan_to_num(omega)):
            if t[last] + self._reach + MARGIN > t[-1]:
                break
            if t[last] <= self._turned:
                continue
            self._turned = float(t[last])
            self._take(first, last, omega)
            done = last
        self._trim(done, t)

    def _place(self, t: FloatArray, omega: FloatArray) -> bool:
        """Find the offset of the clock to some hundredths of a second; whether rows can be put together."""
        if t[-1] - t[0] < TO_FIND:
            return False
        if "alpha_p" in self._buffer:
            A = self.balance.params.active
            q = A.motors.count * A.motors.D_max * self._buffer["alpha_m"] * omega
            offset = coarse_offset(t, pump_flow(self._buffer["alpha_p"], A.pumps), q, self._reach + MARGIN)
            if offset is None:
                return False
            self._clock.offset = offset
            self._reach = max(self._reach, abs(offset))
        self._placed = True
        return True

    def _take(self, first: int, last: int, omega: FloatArray) -> None:
        self._known = None
        part = cut(self._buffer, omega, first, last, self._clock.offset, self.balance, MARGIN)
        if part.half_wave is None:
            self._left_out[part.reason] += 1
            return
        self._waves.append(part.half_wave)
        for name, row in part.sums.items():
            self._others[name].rows.append(row)
        self._correct()
        if not self._clock.remainder().found:  # a wrong clock moves weak and strong half waves apart
            return
        self._watch.look(self._waves, friction_step, friction_alarm)
        for name in part.sums:
            self._others[name].look()

    def _correct(self) -> None:
        """Put all half waves together with the clock's offset as it is known now."""
        lacking = self._clock.remainder()
        if lacking.found and abs(lacking.offset) > MOVE:
            self._clock.move(lacking.offset)
            self._waves = deque(
                (w._replace(torque=w.torque + lacking.offset * float(w.effects[-1])) for w in self._waves), MOST_WAVES
            )

    def _trim(self, done: int, t: FloatArray) -> None:
        """Forget the rows of half waves that are taken, and what is older than the longest one."""
        start = max(t[done] - self._reach - 2.0 * MARGIN, t[-1] - LONGEST - TO_FIND)
        begin = int(np.searchsorted(t, start))
        if begin:
            self._buffer = {name: x[begin:] for name, x in self._buffer.items()}


def _joined(blocks: list[dict[str, FloatArray]]) -> dict[str, FloatArray]:
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def _slope(t: FloatArray, s: FloatArray) -> FloatArray:
    """Rate of a length over RATE to either side of each sample, from straight lines between its samples."""
    good = np.isfinite(s)
    if good.sum() < 2:
        return np.full(len(t), np.nan)
    early, late = np.maximum(t - RATE, t[0]), np.minimum(t + RATE, t[-1])
    rise = np.interp(late, t[good], s[good]) - np.interp(early, t[good], s[good])
    return np.asarray(rise / np.maximum(late - early, 1e-9))


def follow_friction(
    estimator: FrictionEstimator, rows: Mapping[str, ArrayLike], every: float = 10.0
) -> tuple[FrictionState, ...]:
    """A whole log through an estimator: the state every so many seconds [s], and at its end."""
    columns = {name: np.asarray(x, dtype=np.float64) for name, x in rows.items()}
    t = columns.get("time", np.zeros(0))
    if not len(t):
        return (estimator.update(columns),)
    marks = np.searchsorted(t, np.arange(t[0] + every, t[-1], every))
    edges = [0, *marks.tolist(), len(t)]
    parts = [slice(a, b) for a, b in itertools.pairwise(edges) if b > a]
    return tuple(estimator.update({name: x[part] for name, x in columns.items()}) for part in parts)
