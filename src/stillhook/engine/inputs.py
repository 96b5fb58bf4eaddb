"""What drives a run from outside, one row per PLC cycle: tip motion, its measured image, operator, mode, faults,
noise."""

import bisect
import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from stillhook import units
from stillhook.base.arrays import FloatArray
from stillhook.control.interface import DISPLACEMENT
from stillhook.control.plc import MANUAL
from stillhook.control.registry import code_of
from stillhook.engine.saved import Range
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.lanes import room_for
from stillhook.kernels.tip_sampling import sampled
from stillhook.sea.motion.motion import Motion, Ramped
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, PowerLoss, Scenario, Sensors
from stillhook.winches.records import THIN, Tick

TICK = len(Tick._fields)
"""Columns of a full row of the drive; THIN is that of one that only moves the tip."""

COMMANDS = ("u_p", "u_m", "brake")
"""What the winch takes in place of the PLC's commands while the input override is 1."""
OVERRIDE = Tick._fields.index("override")
COMMAND_AT: Mapping[str, int] = {name: Tick._fields.index(name) for name in COMMANDS}
COLUMNS: Mapping[str, tuple[int, ...]] = {
    "s_tip": (0, 3),
    "v_tip": (1, 4),
    "a_tip": (2, 5),
    **{name: (Tick._fields.index(name),) for name in ("v_op", "s_op", "mode", "f_pump", "override", *COMMANDS)},
}
"""Inputs by name, with their columns in a row of the drive: the tip moves, and the motion unit measures it."""
WIRE_COLUMNS: Mapping[str, tuple[int, ...]] = {
    **COLUMNS,
    "s_tip": (3,),
    "v_tip": (4,),
    "a_tip": (5,),
    "F_w": (0,),
}
"""Inputs of a winch whose wire is the host's: the tip's place is that of the tension."""
MOTION = ("s_tip", "v_tip", "a_tip")
MEASURED: Mapping[str, tuple[int, ...]] = {"s_m": (3,), "v_m": (4,), "a_m": (5,)}
"""The tip as the PLC reads it where it is not the tip's own motion: made of the vessel's alone."""

ENDLESS = 2**40
"""Cycles for which there is no noise where there is none: more than any run has."""

CHUNK, SHORT = 4096, 1024
"""Cycles that are made and run at once, and those where a run may end soon."""


def hermite_weights(n_sub: int) -> FloatArray:
    """Weights of s, v, a at both ends of a cycle (t_cycle = 1) for s and v at the middle and end of each of n_sub
    steps.

    The quintic through both ends; rows of 12, to be scaled with `scale_weights`.
    """
    tau = np.arange(1, 2 * n_sub + 1) / (2 * n_sub)
    ends = np.array(
        [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 2, 0, 0, 0], [1] * 6, range(6), [0, 0, 2, 6, 12, 20]], float
    )
    solve = np.linalg.inv(ends)
    s = np.vander(tau, 6, increasing=True) @ solve
    powers = np.column_stack([k * tau ** max(k - 1, 0) for k in range(6)])
    return np.hstack([s, powers @ solve])


def scale_weights(H: FloatArray, t_cycle: float) -> FloatArray:
    """`hermite_weights` for a cycle of t_cycle [s], flat."""
    unit = np.array([1.0, t_cycle, t_cycle**2] * 2)
    return np.ascontiguousarray(np.hstack([H[:, :6] * unit, H[:, 6:] * unit / t_cycle])).ravel()


class MotionDemand(NamedTuple):
    """What tip and operator ask of the winch over a run: v_max highest wire speed [m/s]; s_tip_pp [m]; s_w_min, s_w_max
    wire out [m]."""

    v_max: float
    s_tip_pp: float
    s_w_min: float
    s_w_max: float


def shape(crane: Crane, case: Scenario) -> tuple[int, int, int]:
    """What runs must share to run side by side: PLC cycles, first one that counts, and columns of the drive."""
    t_cycle = crane.control.t_cycle
    n_ticks = max(1, math.floor(case.duration / t_cycle + 1e-9))
    thin = is_ideal(case.sensors) and not case.tip.separate and not _events(case)
    return n_ticks, min(round(case.warm_up / t_cycle), n_ticks), THIN if thin else TICK


def is_ideal(s: Sensors) -> bool:
    """Whether the PLC receives the tip, the wire and the load as they are."""
    return not any(
        (s.delay, s.noise_s_tip, s.noise_v_tip, s.noise_a_tip, s.noise_s_w, s.noise_F, s.step_s_tip, s.step_v_tip)
    )


def _events(case: Scenario) -> bool:
    """Whether mode, operator, pumps or recorded commands change over the run."""
    return bool(
        case.modes or case.operator.profile or case.operator.steps or case.power_loss or case.commands is not None
    )


def filled(drives: Sequence["CycleInputs"], k: int, n: int) -> FloatArray:
    """Cycles k .. k + n - 1 of several drives side by side, (n, cols, lanes); motions that are one are sampled once."""
    out = room_for((n, drives[0].cols, len(drives)))
    done: dict[tuple[int, float], int] = {}
    if drives[0].cols == TICK:
        out[:, 2 * THIN :, :] = np.column_stack([drive.rest for drive in drives])
    for l, drive in enumerate(drives):
        key = (id(drive.case.tip), drive.case.ramp) if drive.cols == THIN else (id(drive), 0.0)
        if key in done:
            out[:, :, l] = out[:, :, done[key]]
        else:
            drive.fill(k, n, out, l)
            done[key] = l
    return out


def _pieces(n_ticks: int, first: int, short_from: int | None = None) -> Iterator[tuple[int, int]]:
    ends = sorted({first, n_ticks if short_from is None else min(short_from, n_ticks), n_ticks})
    k = 0
    while k < n_ticks:
        most = CHUNK if short_from is None or k < short_from else SHORT
        count = min(most, next(end for end in ends if end > k) - k)
        yield k, count
        k += count


class CycleInputs:
    """Rows of Tick for one scenario on one crane, made piece by piece."""

    def __init__(self, crane: Crane, case: Scenario) -> None:
        self.case = case
        self.t_cycle = crane.control.t_cycle
        self.motion: Motion = Ramped.from_si(case.tip, case.ramp) if case.ramp > 0.0 else case.tip
        self.n_ticks, self.first, self.cols = shape(crane, case)
        self.s_tip_0 = float(self.motion.sample(np.zeros(1))[0][0])
        self._pumps, self._passive_pumps = crane.plant.type.pump_units(crane)
        self._noise = _Noise(case, self.n_ticks + 1)

    def pieces(self, short_from: int | None = None) -> Iterator[tuple[int, int]]:
        """First cycle and number of cycles of every piece in which the run is made; one begins where the warm-up ends,
        and from a cycle on they are short."""
        return _pieces(self.n_ticks, self.first, short_from)

    def rows(self, k: int, n: int) -> FloatArray:
        """Cycles k .. k + n - 1, shape (n, cols)."""
        t: FloatArray = np.arange(k, k + n, dtype=np.float64) * self.t_cycle
        thin = _tip(self.motion, k, n, self.t_cycle)
        return thin if self.cols == THIN else self._full(t, k, n, thin)

    def fill(self, k: int, n: int, out: FloatArray, lane: int) -> None:
        """Cycles k .. k + n - 1 into one lane of out (n, cols, lanes), where `rest` is written already."""
        if self.cols == THIN:
            if not sampled(self.motion, k, n, self.t_cycle, out, lane):
                out[:, :, lane] = self.rows(k, n)
            return
        tip = np.empty((n, THIN, 1))
        if not sampled(self.motion, k, n, self.t_cycle, tip, 0):
            tip[:, :, 0] = _tip(self.motion, k, n, self.t_cycle)
        t, thin = np.arange(k, k + n, dtype=np.float64) * self.t_cycle, tip[:, :, 0]
        if not self.steady:
            out[:, :, lane] = self._full(t, k, n, thin)
            return
        out[:, :THIN, lane] = thin
        out[:, THIN : 2 * THIN, lane] = self._measured(t, k, n, thin)

    @cached_property
    def steady(self) -> bool:
        """Whether tip and its image alone change over the run."""
        s = self.case.sensors
        return not _events(self.case) and s.noise_s_w == 0.0 and s.noise_F == 0.0

    @cached_property
    def rest(self) -> FloatArray:
        """What does not change then: the columns behind tip and image."""
        return self.first_row()[2 * THIN :]

    def demand(self) -> MotionDemand:
        """Extremes over the whole run; in manual mode the tip requires nothing."""
        case = self.case
        v_max, s_tip_pp, least, most = _extremes(
            self.motion, case.operator, case.mode, case.modes, self.n_ticks, self.first, self.t_cycle
        )
        return MotionDemand(v_max, s_tip_pp, case.s_w + least, case.s_w + most)

    def first_row(self) -> FloatArray:
        """The full first row."""
        return self._full(np.zeros(1), 0, 1, _tip(self.motion, 0, 1, self.t_cycle))[0]

    def full_row(self, k: int, *, still: bool = False) -> FloatArray:
        """See `full_rows`; that of one cycle."""
        return self.full_rows(k, 1, still=still)[0]

    def full_rows(self, k: int, n: int, *, still: bool = False) -> FloatArray:
        """The full rows of cycles k .. k + n - 1, also beyond the end of the run; still: with the tip at 0.

        Errors: SimulationError for noise beyond the end, MotionError for a motion that has ended.
        """
        if self._noise.ends and k + n > self.n_ticks + 1:
            raise SimulationError(
                f"Session: the scenario's noise is drawn for its duration of {self.case.duration:g} s, which is over."
                " Give it a longer duration, or no noise."
            )
        t: FloatArray = np.arange(k, k + n, dtype=np.float64) * self.t_cycle
        thin = np.zeros((n, THIN)) if still else np.column_stack(self.motion.sample(t))
        return self._full(t, k, n, thin, still=still)

    def _full(self, t: FloatArray, k: int, n: int, thin: FloatArray, *, still: bool = False) -> FloatArray:
        case, out = self.case, np.empty((n, TICK))
        out[:, :3] = thin
        out[:, 3:6] = thin if still else self._measured(t, k, n, thin)
        out[:, 6], out[:, 7] = operator_motion(case.operator, t)
        out[:, 8] = mode_codes(case.mode, case.modes, t)
        out[:, 9], out[:, 10] = pump_shares(case.power_loss, self._pumps, t)
        out[:, 11] = self._noise.wire[k : k + n]
        out[:, 12] = self._noise.load[k : k + n]
        out[:, 13], _ = pump_shares(case.power_loss, self._passive_pumps, t)
        out[:, 14:] = 0.0
        if case.commands is not None:
            out[:, 14:17] = np.column_stack([np.ones_like(t), *case.commands.at(t)])
        return out

    def _measured(self, t: FloatArray, k: int, n: int, thin: FloatArray) -> FloatArray:
        """The tip as the PLC receives it: delayed (constant before the start), noisy, quantised."""
        sensors = self.case.sensors
        late = sensors.delay > 0.0 or self.motion.separate
        seen = np.column_stack(self.motion.measured(np.maximum(t - sensors.delay, 0.0), self.t_cycle)) if late else thin
        seen = seen + self._noise.tip[k : k + n]
        for column, step in ((0, sensors.step_s_tip), (1, sensors.step_v_tip)):
            if step > 0.0:
                seen[:, column] = np.round(seen[:, column] / step) * step
        return seen


class RowsAhead:
    """Full rows of a drive one by one and without an end, made many at once."""

    MADE = (128, 16, 1)

    def __init__(self, drive: CycleInputs) -> None:
        self._drive = drive
        self._made: dict[bool, tuple[int, FloatArray]] = {}

    def at(self, k: int, *, still: bool) -> FloatArray:
        """The row of cycle k, which is not to be changed; still: with the tip at 0. Errors: as `full_rows`."""
        first, rows = self._made.get(still, (0, ()))
        if not first <= k < first + len(rows):
            first, rows = self._made[still] = k, self._rows(k, still)
        return rows[k - first]

    def _rows(self, k: int, still: bool) -> FloatArray:
        for n in self.MADE[:-1]:
            with contextlib.suppress(StillhookError):  # noise or motion end soon: the next row may be there
                return self._drive.full_rows(k, n, still=still)
        return self._drive.full_rows(k, self.MADE[-1], still=still)


@lru_cache(maxsize=64)
def _tip(motion: Motion, k: int, n: int, t_cycle: float) -> FloatArray:
    """True tip s, v, a of cycles k .. k + n - 1; remembered, because controllers are compared on the same motion."""
    rows = np.column_stack(motion.sample(np.arange(k, k + n) * t_cycle))
    rows.flags.writeable = False
    return rows


@lru_cache(maxsize=64)
def _extremes(
    motion: Motion,
    operator: Operator,
    mode: str,
    modes: tuple[tuple[float, str], ...],
    n_ticks: int,
    first: int,
    t_cycle: float,
) -> tuple[float, float, float, float]:
    """Highest wire speed requested [m/s], peak-to-peak of the tip, least and most wire out above that at the start [m].

    Taken in pieces; remembered, because cranes and loads are compared on the same motion.
    """
    v_max, tip, wire = 0.0, [], []
    s_tip_0 = float(motion.sample(np.zeros(1))[0][0])
    for k, count in _pieces(n_ticks, first):
        t = np.arange(k, k + count + 1, dtype=np.float64) * t_cycle
        thin = _tip(motion, k, count + 1, t_cycle)
        s, v = thin[:, 0], thin[:, 1]
        v_op, s_op = operator_motion(operator, t)
        follows = np.where(np.asarray(mode_codes(mode, modes, t)) > MANUAL, 1.0, 0.0)
        v_max = max(v_max, float(np.max(np.abs(v_op - follows * v))))
        tip += [float(s.min()), float(s.max())]
        out = follows * (s - s_tip_0) - s_op
        wire += [float(out.min()), float(out.max())]
    return v_max, max(tip) - min(tip), min(wire), max(wire)


class _Noise:
    """White noise of every noisy signal for a whole run, from the scenario's seed; one stream per signal."""

    def __init__(self, case: Scenario, n: int) -> None:
        s = case.sensors
        self.tip, self.wire, self.load = (np.broadcast_to(0.0, shape) for shape in ((ENDLESS, 3), ENDLESS, ENDLESS))
        self.ends = any((s.noise_s_tip, s.noise_v_tip, s.noise_a_tip, s.noise_s_w, s.noise_F))
        if not self.ends:
            return
        streams = np.random.SeedSequence(s.seed).spawn(5)
        levels = (s.noise_s_tip, s.noise_v_tip, s.noise_a_tip, s.noise_s_w, s.noise_F)
        columns = [
            np.random.default_rng(i).standard_normal(n) * level if level > 0.0 else np.broadcast_to(0.0, n)
            for i, level in zip(streams, levels, strict=True)
        ]
        self.tip = np.column_stack(columns[:3])
        self.wire, self.load = columns[3], columns[4]


def operator_motion(operator: Operator, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Joystick speed [m/s] and the way that it requests in all [m], hoisting positive; set-point steps add to the
    latter alone."""
    v, s = np.zeros_like(t), np.zeros_like(t)
    if operator.profile:
        knots = np.array([0.0, *(i for i, _ in operator.profile)])  # two points at one time are a jump of the speed
        at = np.array([operator.profile[0][1], *(i for _, i in operator.profile)])
        v = np.interp(t, knots, at)
        area = np.concatenate([[0.0], np.cumsum(0.5 * (at[1:] + at[:-1]) * np.diff(knots))])
        i = np.searchsorted(knots, t, side="right") - 1
        s = area[i] + 0.5 * (at[i] + v) * (t - knots[i])
    for time, step in operator.steps:
        s = s + np.where(t >= time, step, 0.0)
    return v, s


def mode_codes(mode: str, modes: Sequence[tuple[float, str]], t: FloatArray) -> FloatArray:
    """Code of the mode in force at each time: mode, then those chosen later."""
    times = [i for i, _ in modes]
    codes = [code_of(mode), *(code_of(m) for _, m in modes)]
    return np.array([codes[bisect.bisect_right(times, i)] for i in t]) if times else np.full_like(t, codes[0])


def pump_shares(loss: PowerLoss | None, pumps: tuple[float, ...], t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of a circuit's pump flow that is there, and the share that the PLC assumes; pumps one for each power
    unit."""
    share = np.ones_like(t)
    if loss is None or loss.unit > len(pumps):
        return share, share
    remaining = 1.0 - pumps[loss.unit - 1] / sum(pumps)
    lost_share = (
        np.clip((t - loss.time) / loss.run_down, 0.0, 1.0) if loss.run_down > 0.0 else (t >= loss.time).astype(float)
    )
    assumed = np.where(t >= loss.time + loss.detection, remaining, 1.0)
    return 1.0 - (1.0 - remaining) * lost_share, assumed


def lacking(crane: Crane) -> dict[str, str]:
    """Commands that mean nothing to a winch, with the reason."""
    out = {}
    if crane.plant.type.control != DISPLACEMENT:
        out["u_m"] = f'winch type "{crane.plant}" takes the speed command u_p alone'
    if crane.brake is None:
        out["brake"] = f'"{crane.name}" has no holding brake'
    return out


def check_motion(inputs: Mapping[str, Any]) -> None:
    """The tip's motion is given whole or not at all: a position without its speed would make the winch lag. Errors:
    SimulationError."""
    some = [name for name in MOTION if name in inputs]
    if some and len(some) < len(MOTION):
        missing = ", ".join(name for name in MOTION if name not in inputs)
        raise SimulationError(f"Session.step: {', '.join(some)} without {missing}. Give the tip's motion whole.")


def number_within(name: str, value: Any, allowed: Range) -> float:
    """A number that a session takes. Errors: SimulationError."""
    if type(value) is float and allowed[0] <= value <= allowed[1]:
        return value
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise SimulationError(f"Session: {name} = {units.quote(value)}: give one number in SI units.") from None
    if not math.isfinite(number):
        raise SimulationError(f"Session: {name} = {units.quote(value)}: not a number. Give a finite value in SI units.")
    if not allowed[0] <= number <= allowed[1]:
        raise SimulationError(
            f"Session: {name} = {units.quote(number)}: give a value from {allowed[0]:g} to {allowed[1]:g}."
        )
    return number
