"""Replay of a segment: its measured tip motion, load, wire, mode and joystick through the complete
twin.

Possible causes of the deviation of the control error: the twin with one parameter changed at a time, and a
regression on the effects.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.arguments import SERIES_STEP, STATISTICS_STEP, steps_per_cycle
from stillhook.engine.pack.winch import gains
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import SimulationError, ValidateError
from stillhook.kernels.lanes import VL
from stillhook.sea.motion.recorded import Recorded
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, Scenario, Sensors
from stillhook.statistics.time_lag import dot
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import Record, Segment
from stillhook.validate.data_set.signals import Tip, smooth_tip
from stillhook.validate.dynamics.model import C_H, C_LEAK, INERTIA, bent, scaled, with_change
from stillhook.winches.circuits.tables import ServoVariant

SETTLE = 30.0
"""Start of a segment that does not count [s]: the twin begins at rest without error, the crane in motion. The transient
decays with the position loop, 1/(K_p v_max) = 5 s on `nov-250t`, so to 0.3 % of the first error;
tests/validate/test_ahc.py
shows 1 mm."""
LEAST_SPEED = 1e-3
"""Joystick speeds below this count as zero [m/s]: 0.06 m/min, the zero error of a joystick."""
STICK_STEP = 2e-3
"""Change of the joystick speed that makes a new point of the scenario's profile [m/s]."""


@dataclass(frozen=True)
class Replay:
    """A segment and its run; tip as the PLC saw it, and its noise; skipped: samples at the start that do not count."""

    record: Record
    segment: Segment
    case: Scenario
    tip: Tip
    skipped: int

    @property
    def name(self) -> str:
        return self.segment.test

    @property
    def t(self) -> FloatArray:
        """Times that count, as in the record [s]."""
        return self.record.t[self.first : self.last]

    @property
    def first(self) -> int:
        return self.segment.first + self.skipped

    @property
    def last(self) -> int:
        """One past the last sample reached by the twin: its tip is ahead of the PLC's by the delay."""
        reach = self.record.t[self.segment.first] + self.case.duration
        return min(self.segment.last, int(np.searchsorted(self.record.t, reach + 1e-9, side="right")))

    def measured(self, name: str) -> FloatArray:
        """A signal of the log over the samples that count; NaN where it was not logged."""
        if not self.record.has(name):
            return np.full(self.last - self.first, np.nan)
        return self.record.signals[name][self.first : self.last]

    @property
    def s_tip(self) -> FloatArray:
        """Smooth tip height as the PLC reads it [m]."""
        return self.tip.motion.sample(np.minimum(self.t - self.record.t[self.segment.first], self.tip.motion.duration))[
            0
        ]

    @property
    def noise(self) -> FloatArray:
        """Measured tip height less the smooth one [m], 0 where not measured."""
        return np.nan_to_num(self.tip.noise[self.skipped :][: self.last - self.first])

    def shortened(self, duration: float) -> Replay:
        """The same for the first part of the segment [s]."""
        return replace(self, case=self.case.model_copy(update={"duration": min(duration, self.case.duration)}))


def replay(campaign: Campaign, record: Record, segment: Segment) -> Replay:
    """The run that repeats a segment. Errors: ValidateError, ScenarioError of one line."""
    part = slice(segment.first, segment.last)
    t = record.t[part] - record.t[segment.first]
    place = f'test "{segment.test}"'
    v_tip = record.part(segment, "v_tip") if record.has("v_tip") else None
    tip = smooth_tip(t, record.part(segment, "s_tip"), v_tip, place=place)
    delay = campaign.delay
    s_w = _si(_wire_out(record, segment), "m")
    case = Scenario(
        name=segment.test,
        load=_si(segment.load, "kg"),
        s_w=s_w,
        mode=segment.mode,
        water=record.test.water,
        tip=_ahead(tip.motion, delay),
        duration=_si(t[-1] - delay, "s"),
        ramp="0 s",
        warm_up=_si(min(SETTLE, 0.5 * t[-1]), "s"),
        operator=_operator(t, record, segment),
        sensors=Sensors(delay=_si(delay, "s")),
    )
    return Replay(record, segment, case, tip, round(SETTLE / record.step))


def _wire_out(record: Record, segment: Segment) -> float:
    """Wire out at the start of a segment [m]: the first that is known, where a gap ends. Errors: ValidateError where
    none is."""
    if math.isfinite(segment.s_w):
        return segment.s_w
    logged = record.part(segment, "s_w") if record.has("s_w") else np.zeros(0)
    values = logged[np.isfinite(logged)]
    if not len(values):
        raise ValidateError(Note("no-wire-at", test=segment.test, t=segment.start))
    return float(values[0])


def _si(x: float, unit: str) -> str:
    return f"{float(x)!r} {unit}"


def _ahead(motion: Recorded, delay: float) -> Recorded:
    """The true tip motion, seen by the PLC `delay` later. Spacing of the points as before: the same curve to 0.1 mm."""
    if delay == 0.0:
        return motion
    count = len(motion.times) - 1
    t = np.linspace(delay, motion.duration, count + 1)
    return Recorded(t, motion.sample(t)[0], source=motion.source)


def _operator(t: FloatArray, record: Record, segment: Segment) -> Operator:
    """The joystick as straight lines through the points where it moves."""
    if not record.has("v_op"):
        return Operator()
    v = record.part(segment, "v_op")
    finite = np.isfinite(v)
    if not finite.any() or np.abs(v[finite]).max() < LEAST_SPEED:
        return Operator()
    v = np.interp(t, t[finite], v[finite])
    keep = [0]
    for i in range(1, len(v) - 1):
        if abs(v[i] - v[keep[-1]]) >= STICK_STEP or (v[i] != v[i + 1] and v[i] == v[i - 1]):
            keep.append(i)
    keep.append(len(v) - 1)
    return Operator(profile=tuple((_si(t[i], "s"), _si(v[i], "m/s")) for i in keep))


def run_twin(
    cranes: Sequence[Crane], replays: Sequence[Replay], names: Sequence[str], *, quick: bool = False
) -> list[dict[str, FloatArray]]:
    """Series of the twin over the samples that count, one dict a pair of crane and replay; quick: sixteen runs side by
    side, at the longer step of statistics. Errors: SimulationError where a run diverges."""
    n_sub = steps_per_cycle(cranes[0], None, STATISTICS_STEP if quick else SERIES_STEP)
    every = max(1, round((0.05 if quick else replays[0].record.step) / cranes[0].control.t_cycle))
    lanes = VL if quick and len(cranes) > 1 else 1
    results = run_cases(cranes, [r.case for r in replays], step=n_sub, lanes=lanes, every=every, keep=unchanged)
    out = []
    for r, result in zip(replays, results, strict=True):
        if result.diverged:
            raise SimulationError(Note("diverges", test=r.name, t=result.t_end))
        t = np.arange(len(result.series)) * result.dt + r.record.t[r.segment.first]
        out.append({name: np.interp(r.t, t, result.column(name)) for name in names})
    return out


def usable(records: Sequence[Record], window: float) -> tuple[list[tuple[Record, Segment]], list[Note]]:
    """Segments of AHC tests that step 5 can use, and a note for each that it cannot."""
    good, notes = [], []
    for record, s in ((r, s) for r in records if r.test.kind is Kind.AHC for s in r.segments):
        if s.mode.compensates and s.duration >= SETTLE + window + record.step:
            good.append((record, s))
        else:
            code, of = "too-short" if s.mode.compensates else "manual-part", {"settle": SETTLE, "window": window}
            notes.append(Note(code, test=s.test, seconds=s.duration, start=s.start, **of))
    return good, notes


def measured_error(replays: Sequence[Replay]) -> tuple[list[FloatArray], bool]:
    """The crane's control error over the samples that count [m], and whether the PLC logged it. Where it did not: e_c =
    s_tip - s_w plus the wire taken in by the joystick, about its mean, because the datum of the reference is not
    known."""
    logged = all(r.record.has("e_c_measured") for r in replays)
    if logged:
        return [r.measured("e_c_measured") for r in replays], True
    return [about_mean(r.s_tip + r.noise - r.measured("s_w") - _s_op(r)) for r in replays], False


def _s_op(r: Replay) -> FloatArray:
    """Wire requested by the joystick, hoisting positive [m]."""
    v = np.nan_to_num(r.measured("v_op"))
    return np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(r.t))))


def about_mean(x: FloatArray) -> FloatArray:
    return x - np.nanmean(x)


LONGEST = 270.0
"""Part of a segment that is run again for every cause [s]: some 30 waves."""
SMOOTH = 0.15
"""Width of the Gaussian filter for deviations and effects [s]: passes 1 Hz to two thirds, and no sensor
noise."""
MUCH = 0.5
"""Share of the deviation's energy from which a cause is reported."""
ALIKE = 0.1
"""Causes whose shares differ by less than this are reported together."""
SMALL = 2e-3
"""Deviation of the control error that needs no cause [m rms]: twice the resolution of a PLC's error in millimetres."""
SMALL_DP = 2e5
"""Deviation of the pressure drop that needs no cause [Pa rms]: 2 bar, 0.5 % of a transmitter's 400 bar."""


class Cause(NamedTuple):
    """bend(crane, x): a crane of `with_gains` with the parameter changed by the part x of itself; x: simulated change;
    most: largest plausible change; needs: circuit without which it has no meaning."""

    name: str
    words: str
    bend: Callable[[Crane, float], Crane]
    x: float
    most: float
    needs: str = "active"


class CauseEstimate(NamedTuple):
    """amount: relative change that explains most of the deviation; share: part of the deviation's energy that it
    explains, control error and pressure drop together, each over its SMALL; share_e: the same of e_c alone."""

    cause: Cause
    amount: float
    share: float
    share_e: float


class Deviation(NamedTuple):
    """Smooth deviation: e_c [m rms], pressure drop over the active motors [Pa rms], NaN where not logged."""

    e_c: float
    dp_m: float


def _bent(*names: str) -> Callable[[Crane, float], Crane]:
    return lambda crane, x: bent(crane, dict.fromkeys(names, math.log1p(x)))


def _scaled(path: str) -> Callable[[Crane, float], Crane]:
    return lambda crane, x: scaled(crane, 1.0 + x, path)


def _motor_offset(crane: Crane, x: float) -> Crane:
    update = {"variant": ServoVariant.OPEN_LOOP, "offset": x, "hysteresis": 0.0}
    changed: Crane = with_change(crane, "active.motor", lambda motor: motor.model_copy(update=update))
    return changed


CAUSES = (
    Cause("leakage", "leakage of the active pumps and motors", _bent(C_LEAK), 0.1, 3.0),
    Cause("friction", "friction of the winch", _bent("dry", "breakaway", "viscous", "pressure_loss"), 0.1, 3.0),
    Cause("K_1", "K_1 of the crane's controller", _scaled("control.K_1"), 0.01, 0.3, ""),
    Cause("K_2", "K_2 of the crane's controller", _scaled("control.K_2"), 0.1, 3.0, ""),
    Cause("K_p", "K_p of the crane's controller", _scaled("control.K_p"), 0.1, 3.0, ""),
    Cause("speed", "wire speed per pump command (layer, gear ratio, pump flow)", _bent("pump_flow"), 0.01, 0.3),
    Cause("motor_offset", "displacement of the active motors over their command", _motor_offset, 0.05, 0.3),
    Cause("C_h", "capacitance of the active lines", _bent(C_H), 0.1, 3.0),
    Cause("J_m_eff", "inertia at the motor shaft", _bent(INERTIA), 0.1, 1.0),
    Cause("pump_servo", "natural frequency of the pumps' displacement control", _bent("pump_omega_n"), 0.1, 1.0),
    Cause(
        "motor_servo",
        "natural frequency of the motors' displacement control",
        _scaled("active.motor.servo.omega_n"),
        0.2,
        3.0,
    ),
)


def explain(
    crane: Crane, replays: Sequence[Replay], measured: Sequence[FloatArray]
) -> tuple[tuple[CauseEstimate, ...], Deviation]:
    """Share of the deviation explained by each cause, the largest first, and the deviation; no cause where it is small.
    measured: the crane's control error, one array a replay [m]."""
    crane, possible = with_gains(crane), [c for c in CAUSES if not c.needs or c.needs in crane.circuits]
    lines = tuple(name for name in ("p_a", "p_b") if "active" in crane.circuits)
    cranes = [crane, *(c.bend(crane, c.x) for c in possible)]
    e, dp = [], []
    for r, e_measured in zip(replays, measured, strict=True):
        short = r.shortened(SETTLE + LONGEST)
        runs = run_twin(cranes, [short] * len(cranes), ("e_c_measured", *lines), quick=True)
        n = len(runs[0]["e_c_measured"])
        e.append(_effects(possible, e_measured[:n], [x["e_c_measured"] for x in runs], r.record.step))
        drop = r.measured("p_a") - r.measured("p_b") if lines else np.full(n, np.nan)
        twins = [x["p_a"] - x["p_b"] if lines else np.zeros(n) for x in runs]
        dp.append(_effects(possible, drop[:n], twins, r.record.step))
    E, P = np.hstack(e) / SMALL, np.hstack(dp) / SMALL_DP
    both, deviation = np.hstack([E, P]), Deviation(_rms(E[0]) * SMALL, _rms(P[0]) * SMALL_DP)
    if not (deviation.e_c > SMALL or deviation.dp_m > SMALL_DP):
        return (), deviation
    causes = []
    for k, cause in enumerate(possible, start=1):
        amount = _amount(both[0], both[k], cause)
        causes.append(CauseEstimate(cause, amount, _share(both[0], amount * both[k]), _share(E[0], amount * E[k])))
    return tuple(sorted(causes, key=lambda x: -x.share)), deviation


def with_gains(crane: Crane) -> Crane:
    """The crane with explicit gains of its PLC: constant when the winch is changed."""
    original = gains(crane)
    return crane.model_copy(
        update={"control": crane.control.model_copy(update={"K_1": original.K_1, "K_2": original.K_2})}
    )


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else math.nan


def _effects(possible: Sequence[Cause], measured: FloatArray, runs: Sequence[FloatArray], step: float) -> FloatArray:
    """Row 0: measured less simulated; then the effect of every cause for a change of all of it; smooth, every 0.1 s."""
    from scipy.ndimage import gaussian_filter1d  # heavy: only where data are at hand

    rows = np.stack([measured - runs[0], *((x - runs[0]) / c.x for c, x in zip(possible, runs[1:], strict=True))])
    finite = np.isfinite(rows[0])
    rows[0, ~finite] = 0.0
    smooth = gaussian_filter1d(rows, SMOOTH / step, axis=1)
    every = max(1, round(0.1 / step))
    out: FloatArray = smooth[:, ::every][:, finite[::every]]
    return out


def _amount(deviation: FloatArray, effect: FloatArray, cause: Cause) -> float:
    size = dot(effect, effect)
    best = dot(deviation, effect) / size if size > 0.0 else 0.0
    return best if abs(best) <= cause.most else 0.0


def _share(deviation: FloatArray, effect: FloatArray) -> float:
    """Share of the deviation's energy removed by subtracting the effect."""
    size = dot(deviation, deviation)
    return 1.0 - float(np.sum((deviation - effect) ** 2)) / size if size > 0.0 else math.nan


def statements(causes: Sequence[CauseEstimate], deviation: Deviation) -> tuple[Note, ...]:
    """Statements on causes: none where no cause explains much of the deviation."""
    if not causes or causes[0].share < MUCH:
        return ()
    alike = [_cause(x) for x in causes if x.share > causes[0].share - ALIKE]
    code = "explains-with-drop" if math.isfinite(deviation.dp_m) else "explains"
    return (Note(code, causes=alike, mm=1e3 * deviation.e_c, dp=deviation.dp_m),)


def _cause(x: CauseEstimate) -> Note:
    code = "cause-offset" if x.cause.name == "motor_offset" else "cause"
    return Note(code, what=x.cause.words, amount=x.amount, share=x.share)
