"""Friction verified in the running twin: the logged pump command, motor displacement and load of crane tests drive the
twin, and its pressure drop across the motors is compared with the measured one, direction by direction.

Source: Moslatt 2020 paper D sections 4.2 and 4.3. Limits: 10 % of the measured pressure, 1 % of the nominal torque (that
of the load at the motor shafts), both from 250 rev/min on (paper D, conclusions).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.pack.lift import wire_carried
from stillhook.engine.pack.winch import drum_record
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import IdentifyError, LogError, StillhookError
from stillhook.identify.system_friction.campaign import OWN_FRICTIONS, Campaign, CraneTest, load_campaign
from stillhook.identify.system_friction.closed_circuit import closed_circuit, down_to
from stillhook.identify.system_friction.identify import JUDGED_FROM, Friction
from stillhook.identify.system_friction.measure import Measured, cut, measure, pressure_drop, shaft_speed
from stillhook.identify.system_friction.result import friction_set, second_loop_sets
from stillhook.library.draws import crane_with
from stillhook.library.parameter_sets import FrictionSet, LossSet, load_friction
from stillhook.logs.log import Log, read_log
from stillhook.physics.load_path.drum import wire_to_layer
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import show
from stillhook.validate.data_set.record import filled, stretches_of
from stillhook.validate.dynamics.runs import logged_commands, on_samples, tip_motion

SETTLE = 10.0
"""Start of a run in heave compensation that does not count [s]: the twin begins at rest, the crane in motion."""
LEAST = 0.5
"""Shortest part of a half-wave at or above `JUDGED_FROM` that counts [s]: a period of the winch's own oscillation."""
LOADED = 0.25
"""Load torque over that of the SWL from which 1 % of it is more than pressure sensors resolve, and is judged."""
MOST_MISSING = 0.05
"""Share of a command's samples that may be missing: they are filled by straight lines."""
SIGNALS = ("p_a", "p_b", "omega_m")
WAYS = {1: "hauling in", -1: "paying out"}


class Use(StrEnum):
    """What a test was to the friction that is verified."""

    FITTED = "fitted"
    UNSEEN = "not fitted"
    AHC = "AHC"


class Deviation(NamedTuple):
    """Deviation of the simulated pressure drop over some stretches: mean, rms and mean magnitude [Pa], mean magnitude of
    the measured one [Pa]; the mean magnitude as part of the latter, and as torque of all motors over that of the load
    [-]; n stretches."""

    mean: float
    rms: float
    magnitude: float
    measured: float
    of_pressure: float
    of_torque: float
    n: int


class PressureStretch(NamedTuple):
    """A steady stretch of a staircase, or a fast part of a half-wave: start, end [s in the log]; direction, hauling in
    positive; mean motor speeds [rad/s] and pressure drops [Pa], logged and of the twin; rms difference of their samples
    [Pa]; displacement of a motor [m^3/rad]; T_nominal of the load over all motors of the circuit [N m a motor]."""

    test: str
    start: float
    end: float
    direction: int
    omega_m: float
    omega_sim: float
    dp_m: float
    dp_sim: float
    rms: float
    D_m: float
    T_nominal: float


@dataclass(frozen=True)
class Repeated:
    """A test and its repetition by the twin. t (n,) [s in the log]; omega_m, dp_m: logged and of the twin (n, 2)."""

    test: CraneTest
    use: Use
    t: FloatArray
    omega_m: FloatArray
    dp_m: FloatArray
    stretches: tuple[PressureStretch, ...]
    judged_torque: bool

    @property
    def judged(self) -> tuple[PressureStretch, ...]:
        """Stretches fast enough for the limits."""
        return tuple(s for s in self.stretches if abs(s.omega_m) >= JUDGED_FROM)

    @property
    def deviation(self) -> Deviation | None:
        """Over the judged stretches; None where there is none."""
        return deviation(self.judged) if self.judged else None


@dataclass(frozen=True)
class Verification:
    """friction: which one, in words; crane: with it, as in heave compensation; runs by test."""

    campaign: Campaign
    friction: str
    crane: Crane
    runs: tuple[Repeated, ...]

    def exceeded(self, run: Repeated) -> list[str]:
        """The limits that a test exceeds, in words."""
        d, limits = run.deviation, self.campaign.verify
        if d is None:
            return []
        out = [] if d.of_pressure <= limits.pressure else [f"{d.of_pressure:.1%} of the measured pressure"]
        return out + [f"{d.of_torque:.1%} of the load torque"] * (run.judged_torque and d.of_torque > limits.torque)

    @property
    def unseen(self) -> tuple[Repeated, ...]:
        """Judged tests that the friction was not fitted to."""
        return tuple(r for r in self.runs if r.use is not Use.FITTED and r.judged)

    @property
    def passed(self) -> bool:
        """Whether every test is within the limits, and one at least was not fitted."""
        return bool(self.unseen) and not any(self.exceeded(r) for r in self.runs)


def deviation(stretches: Sequence[PressureStretch]) -> Deviation:
    """Statistics of some stretches, each counted once."""
    off = np.array([s.dp_sim - s.dp_m for s in stretches])
    measured = float(np.mean([abs(s.dp_m) for s in stretches]))
    torque = [
        abs(x) * s.D_m / s.T_nominal if s.T_nominal > 0.0 else math.nan for x, s in zip(off, stretches, strict=True)
    ]
    size = float(np.mean(np.abs(off)))
    part = size / measured if measured > 0.0 else math.inf
    return Deviation(
        float(off.mean()), float(np.sqrt(np.mean(off**2))), size, measured, part, float(np.mean(torque)), len(off)
    )


def verify_friction(
    source: Campaign | str, result: Friction | None = None, *, progress: Progress | None = None
) -> Verification:
    """Repeat the tests of a friction campaign in the twin and compare pressure drops.

    Parameters
    ----------
    source : Campaign or path
        The campaign; its table [verify] names the friction and the limits.
    result : Friction, optional
        What `stillhook.identify.friction` made of the campaign: needed where its own friction is verified.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Verification
        Every test with the twin's pressure drop next to the measured one.

    Raises
    ------
    StillhookError
        One line: a log without a pump command, displacement or load, too short, or in one direction only.
    """
    campaign = source if isinstance(source, Campaign) else load_campaign(source)
    words, sets = _friction(campaign, result)
    crane = crane_with(campaign.crane, *sets)
    measured = {} if result is None else {m.test.name: m for m in result.measured}
    tests = [_read(campaign, crane, test, measured.get(test.name)) for test in campaign.tests]
    runs, total = [], sum(t.case.duration for t in tests)
    fitted = campaign.verify.friction in OWN_FRICTIONS
    for i, test in enumerate(tests):
        runs.append(_repeated(test, fitted=fitted))
        if progress is not None:
            progress(sum(t.case.duration for t in tests[: i + 1]) / total)
    verification = Verification(campaign, words, crane, tuple(runs))
    if not any(r.judged for r in runs):
        raise IdentifyError(
            f"{campaign.source}: no test runs faster than {show(JUDGED_FROM, 'rotation', 3)} in the log, so no deviation"
            " is judged. Add a faster test."
        )
    return verification


def _friction(campaign: Campaign, result: Friction | None) -> tuple[str, list[FrictionSet | LossSet]]:
    """The friction to verify, in words and as sets for the crane. Errors: IdentifyError of one line."""
    name = campaign.verify.friction
    motors: list[FrictionSet | LossSet] = [] if campaign.motor is campaign.crane.active.motor else [campaign.losses]
    if name == "crane":
        return f"that of the crane file {campaign.crane.name}", motors
    if name not in OWN_FRICTIONS:
        item = load_friction(name)
        return f"the set {item.name}", [*motors, item]
    if result is None:
        raise IdentifyError(f'verify.friction = "{name}": needs the result of identify.friction. Give it as well.')
    fitted = ", ".join(t.name for t in result.campaign.tests if not t.hold_out)
    if name == "identified":
        return f"identified from the tests {fitted}", [*motors, friction_set(result)]
    if result.second is None:
        raise IdentifyError('verify.friction = "second-loop": no second loop was run. Give fit.loops = 1 or more.')
    return f"second loop, fitted to the tests {fitted}", list(second_loop_sets(result))


class _Read(NamedTuple):
    """A test that is ready to be repeated: signals of its log on times t [s]; spans in samples, by direction."""

    crane: Crane
    test: CraneTest
    log: Log
    case: Scenario
    omega_m: FloatArray
    dp_m: FloatArray
    D_m: FloatArray
    spans: tuple[tuple[int, int, int], ...]
    T_nominal: float


def _read(campaign: Campaign, crane: Crane, test: CraneTest, measured: Measured | None) -> _Read:
    """A test's log, its repetition as a scenario, and its stretches. Errors: of one line, with the test's name."""
    try:
        return _read_ahc(campaign, crane, test) if test.ahc else _read_staircase(campaign, crane, test, measured)
    except StillhookError as e:
        place = f'{campaign.source}: test "{test.name}": '
        raise type(e)(str(e) if str(e).startswith(place) else place + str(e)) from None


def _read_staircase(campaign: Campaign, crane: Crane, test: CraneTest, measured: Measured | None) -> _Read:
    m = measured or measure(campaign, test)
    total = sum(c.motor.count for c in crane.circuits.values())
    if campaign.count != total:
        raise IdentifyError(
            f'motors = {campaign.count}: the twin repeats a staircase with all {total} motors of "{crane.name}" in one'
            " circuit. Verify tests of all motors."
        )
    spans = [
        (*(int(i) for i in np.searchsorted(m.log.t, (w.start, w.end))), 1 if w.direction > 0 else -1)
        for w in m.steady.windows
    ]
    signals = m.log.signals
    return _ready(campaign, closed_circuit(crane), m.test, m.log, signals["omega_m"], signals["dp_m"], spans, test.wire)


def _read_ahc(campaign: Campaign, crane: Crane, test: CraneTest) -> _Read:
    log = cut(read_log(test.log, test.mapping), test)
    omega, dp = filled(shaft_speed(campaign, test, log)[0]), pressure_drop(log)
    seconds = float(log.t[-1] - log.t[0])
    if seconds < 2.0 * SETTLE:
        raise LogError(
            f"{log.source}: {show(seconds, 'time', 3)} long. Give {2.0 * SETTLE:g} s or more of heave compensation: the"
            f" first {SETTLE:g} s do not count."
        )
    late = (log.t - log.t[0] >= SETTLE) & np.isfinite(dp)
    least, spans = LEAST * (len(log.t) - 1) / seconds, []
    for way in WAYS:
        spans += [(a, b, way) for a, b in stretches_of(late & (way * omega >= JUDGED_FROM)) if b - a >= least]
    ways = {way for *_, way in spans}
    if len(ways) < 2:
        speed = show(JUDGED_FROM, "rotation", 3)
        missing = " or ".join(words for way, words in WAYS.items() if way not in ways)
        raise LogError(
            f"{log.source}: no stretch of {missing} at {speed} or more after the first {SETTLE:g} s. Verification needs"
            " both directions: check the sign of omega_m, or give another part of the log."
        )
    s_w = _wire_out(campaign, test, log)
    wire = 0.0 if test.hook is None else wire_carried(crane, s_w, test.hook.tip_height(s_w))
    return _ready(campaign, crane, test, log, omega, dp, sorted(spans), wire)


def _ready(
    campaign: Campaign,
    crane: Crane,
    test: CraneTest,
    log: Log,
    omega_m: FloatArray,
    dp_m: FloatArray,
    spans: Sequence[tuple[int, int, int]],
    wire: float,
) -> _Read:
    """The scenario that repeats a test. Errors: LogError, IdentifyError of one line."""
    t, motor = log.t - log.t[0], campaign.motor
    u_p, s_w = _command(log, "u_p"), _wire_out(campaign, test, log)
    D_m = _displacement(log, test, motor.D_max)
    u_m = _command(log, "u_m") if "u_m" in log.signals else D_m / motor.D_max
    crane = down_to(crane, max(float(D_m.min()), 0.0))
    load = test.load + wire
    case = Scenario(
        name=test.name,
        load=f"{load!r} kg",
        s_w=f"{s_w!r} m",
        mode="manual",
        ramp="0 s",
        warm_up="0 s",
        tip=tip_motion(log.signals, t, test.name),
        commands=logged_commands(crane, t, u_p, u_m),
    )
    d = campaign.diameter(test) or campaign.layer_diameter(s_w)
    T_nominal = (load + crane.hook_mass) * G * 0.5 * d / crane.i_hD / crane.active.motor.count
    return _Read(crane, replace(test, wire=wire), log, case, omega_m, dp_m, D_m, tuple(spans), T_nominal)


def _command(log: Log, name: str) -> FloatArray:
    """A command of the log without gaps. Errors: LogError where it is missing, or much of it."""
    if name not in log.signals:
        raise LogError(f"{log.source}: no signal {name}. Map the pump command {name}: the twin is driven by it.")
    x = log.signals[name]
    missing = float(np.mean(~np.isfinite(x)))
    if missing > MOST_MISSING:
        raise LogError(
            f"{log.source}: {missing:.0%} of {name} is missing, allowed is {MOST_MISSING:.0%}. Give a part of the log"
            " without the gap (start, end)."
        )
    return filled(x)


def _displacement(log: Log, test: CraneTest, D_max: float) -> FloatArray:
    """Displacement of one motor at every sample [m^3/rad]. Errors: IdentifyError where nothing states it."""
    for name, unit in (("D_m", 1.0), ("alpha_m", D_max), ("u_m", D_max)):
        if name in log.signals:
            return unit * _command(log, name)
    if test.D_m is None:
        raise IdentifyError("D_m: missing, and the log has no D_m, alpha_m or u_m. Give the displacement of one motor.")
    return np.full(len(log.t), test.D_m)


def _wire_out(campaign: Campaign, test: CraneTest, log: Log) -> float:
    """Wire out at the start [m]: the middle of the stated layer, or what file or log have."""
    if test.layer is not None:
        drum = drum_record(campaign.crane)
        return float(drum.L_full - wire_to_layer(test.layer - 0.5, drum))
    return float(filled(log.signals["s_w"])[0]) if test.s_w is None else test.s_w


def _repeated(r: _Read, *, fitted: bool) -> Repeated:
    """One test, run. Errors: SimulationError where the run diverges."""
    t = r.log.t - r.log.t[0]
    every = max(1, int(np.median(np.diff(t)) / r.crane.control.t_cycle + 0.5))
    (run,) = run_cases(r.crane, r.case, every=every, keep=unchanged, lanes=1)
    p_a, p_b, omega = on_samples(run, SIGNALS, t).T
    both_dp, both_omega = np.column_stack([r.dp_m, p_a - p_b]), np.column_stack([r.omega_m, omega])
    use = Use.AHC if r.test.ahc else Use.UNSEEN if r.test.hold_out or not fitted else Use.FITTED
    crane = r.crane
    swl = (crane.SWL + crane.hook_mass) / (r.case.load + crane.hook_mass)
    loaded = not r.test.ahc and swl * LOADED <= 1.0
    return Repeated(r.test, use, r.log.t, both_omega, both_dp, tuple(_stretches(r, both_omega, both_dp)), loaded)


def _stretches(r: _Read, omega: FloatArray, dp: FloatArray) -> Iterator[PressureStretch]:
    for a, b, way in r.spans:
        known = np.isfinite(dp[a:b]).all(axis=1) & np.isfinite(omega[a:b]).all(axis=1)
        if not known.any():
            continue
        (omega_m, omega_sim), (dp_m, dp_sim) = omega[a:b][known].mean(axis=0), dp[a:b][known].mean(axis=0)
        rms = float(np.sqrt(np.mean((dp[a:b][known, 1] - dp[a:b][known, 0]) ** 2)))
        times, D_m = (float(r.log.t[a]), float(r.log.t[b - 1])), float(r.D_m[a:b].mean())
        numbers = map(float, (omega_m, omega_sim, dp_m, dp_sim))
        yield PressureStretch(r.test.name, *times, way, *numbers, rms, D_m, r.T_nominal)
