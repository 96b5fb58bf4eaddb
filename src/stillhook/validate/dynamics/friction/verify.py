"""Friction verified in the running twin: the logged pump command, motor displacement and load of crane tests drive the
twin, and its pressure drop across the motors is compared with the measured one, direction by direction.

Source: Moslatt 2020 paper D sections 4.2 and 4.3. Limits: 10 % of the measured pressure, 1 % of the nominal torque
(that of the load at the motor shafts), both from 250 rev/min on (paper D, conclusions).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
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
from stillhook.identify.system_friction.measure import cut, measure, pressure_drop, shaft_speed
from stillhook.identify.system_friction.result import friction_set, second_loop_sets
from stillhook.library.draws import crane_with
from stillhook.library.parameter_sets import FrictionSet, LossSet, load_friction
from stillhook.logs.log import Log, read_log
from stillhook.physics.load_path.drum import wire_to_layer
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.units import show
from stillhook.validate.data_set.record import filled, stretches_of
from stillhook.validate.dynamics.runs import logged_commands, on_samples, tip_motion

SETTLE = 10.0
"""Start of a run in heave compensation that does not count [s]: the twin begins at rest, the crane in motion."""
LEAST = 0.5
"""Shortest part of a half-wave at or above `JUDGED_FROM` that counts [s]: a period of the winch's own oscillation."""
LOADED = 0.25
"""Load over the SWL, both with the hook, from which 1 % of its torque is more than pressure sensors resolve."""
MOST_MISSING = 0.05
"""Share of a command's samples that may be missing: they are filled by straight lines."""
FEWEST = 2
"""Stretches in each direction that an interval needs."""
PASSIVE = ("p_hp", "alpha_pm")
"""Signals of the passive circuit that are compared where a log has them."""
WAYS = {1: "hauling in", -1: "paying out"}
SPEED = show(JUDGED_FROM, "rotation", 3)


class Use(StrEnum):
    """What a test was to the friction that is verified."""

    FITTED = "fitted"
    UNSEEN = "not fitted"
    AHC = "AHC"


class Deviation(NamedTuple):
    """Deviation of the simulated pressure drop over n stretches, each counted once: mean, rms and mean magnitude [Pa];
    the latter as part of the mean magnitude measured, and as torque of all motors over that of the load [-]."""

    mean: float
    rms: float
    magnitude: float
    of_pressure: float
    of_torque: float
    n: int


class PressureStretch(NamedTuple):
    """A steady stretch of a staircase, or a fast part of a half-wave: start, end [s in the log]; direction, hauling in
    positive; mean motor speeds [rad/s] and pressure drops [Pa], logged and of the twin; rms difference of their samples
    [Pa]; displacement of a motor [m^3/rad]; T_nominal of the load over the motors of the circuit [N m a motor]."""

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


def deviation(stretches: Sequence[PressureStretch]) -> Deviation:
    """Statistics of some stretches."""
    off = np.array([s.dp_sim - s.dp_m for s in stretches])
    measured = float(np.mean([abs(s.dp_m) for s in stretches]))
    D_m, T_nominal = np.array([(s.D_m, s.T_nominal) for s in stretches]).T
    size = float(np.mean(np.abs(off)))
    torque = float(np.mean(np.abs(off) * D_m / T_nominal)) if T_nominal.all() else math.nan
    part = size / measured if measured > 0.0 else math.inf
    return Deviation(float(off.mean()), float(np.sqrt(np.mean(off**2))), size, part, torque, len(off))


def friction_parts(stretches: Sequence[PressureStretch]) -> tuple[Estimate, float] | None:
    """Half the difference of the deviations of both directions, the part that friction makes, with its 95 % interval
    from their scatter; and the same of the measured pressures [Pa]. None with fewer than two stretches in a
    direction."""
    rows = np.array([(s.dp_sim - s.dp_m, s.dp_m, s.direction) for s in stretches]).reshape(-1, 3)
    up, down = (rows[rows[:, 2] == way, :2] for way in WAYS)
    if min(len(up), len(down)) < FEWEST:
        return None
    u = 0.5 * math.sqrt(sum(x[:, 0].var(ddof=1) / len(x) for x in (up, down)))
    part, measured = 0.5 * (up.mean(axis=0) - down.mean(axis=0))
    return Estimate.around(float(part), t_factor(len(rows) - 2) * u, len(rows)), float(measured)


@dataclass(frozen=True)
class Repetition:
    """A test that the twin repeated. t (n,) [s in the log]; omega_m, dp_m (n, 2): logged, and of the twin; loaded:
    whether the limit of torque applies; passive: means of accumulator pressure [Pa] and displacement [-] of the passive
    motors, logged and of the twin, by name, of those that a run in heave compensation has."""

    test: CraneTest
    use: Use
    t: FloatArray
    omega_m: FloatArray
    dp_m: FloatArray
    stretches: tuple[PressureStretch, ...]
    loaded: bool
    passive: Mapping[str, tuple[float, float]]

    @property
    def judged(self) -> tuple[PressureStretch, ...]:
        """Stretches fast enough for the limits."""
        return tuple(s for s in self.stretches if abs(s.omega_m) >= JUDGED_FROM)


@dataclass(frozen=True)
class Verification:
    """friction: which one, in words; runs by test."""

    campaign: Campaign
    friction: str
    runs: tuple[Repetition, ...]

    def exceeded(self, run: Repetition) -> list[str]:
        """The limits that a test exceeds, in words."""
        if not run.judged:
            return []
        d, limits = deviation(run.judged), self.campaign.verify
        out = [f"{d.of_pressure:.1%} of the measured pressure"] * (d.of_pressure > limits.pressure)
        return out + [f"{d.of_torque:.1%} of the load torque"] * (run.loaded and d.of_torque > limits.torque)

    @property
    def unseen(self) -> tuple[Repetition, ...]:
        """Judged tests that the friction was not fitted to."""
        return tuple(r for r in self.runs if r.use is not Use.FITTED and r.judged)

    @property
    def passed(self) -> bool:
        """Whether every test is within the limits, and one at least was not fitted."""
        return bool(self.unseen) and not any(self.exceeded(r) for r in self.runs)


def verify_friction(
    source: Campaign | str | Path, result: Friction | None = None, *, progress: Progress | None = None
) -> Verification:
    """Repeat the tests of a friction campaign in the twin and compare pressure drops.

    Parameters
    ----------
    source : Campaign, str or Path
        The campaign, or path of its file; its table [verify] names the friction and the limits.
    result : Friction, optional
        What `stillhook.identify.friction` made of it, where that friction is verified.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Verification
        Every test with the twin's pressure drop next to the measured one.

    Raises
    ------
    StillhookError
        One line: a log without a pump command or displacement, too short, or in one direction only.
    """
    campaign = source if isinstance(source, Campaign) else load_campaign(source)
    words, sets = _friction(campaign, result)
    crane, runs = crane_with(campaign.crane, *sets), list[Repetition]()
    for i, test in enumerate(campaign.tests, start=1):
        try:
            runs.append(_ahc(campaign, crane, test) if test.ahc else _staircase(campaign, crane, test))
        except StillhookError as e:
            place = f'{campaign.source}: test "{test.name}": '
            raise type(e)(str(e) if str(e).startswith(place) else place + str(e)) from None
        if progress is not None:
            progress(i / len(campaign.tests))
    return Verification(campaign, words, tuple(runs))


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


def _staircase(campaign: Campaign, crane: Crane, test: CraneTest) -> Repetition:
    """A staircase, all motors in one closed circuit. Errors: LogError, IdentifyError of one line."""
    total = sum(c.motor.count for c in crane.circuits.values())
    if campaign.count != total:
        raise IdentifyError(
            f'motors = {campaign.count}: the twin repeats a staircase with all {total} motors of "{crane.name}" in one'
            " circuit. Verify tests of all motors."
        )
    m = measure(campaign, test)
    ends = np.searchsorted(m.log.t, [(w.start, w.end) for w in m.steady.windows]).tolist()
    spans = [(a, b, 1 if w.direction > 0 else -1) for (a, b), w in zip(ends, m.steady.windows, strict=True)]
    omega_m, dp_m = (m.log.signals[name] for name in ("omega_m", "dp_m"))
    return _repeated(campaign, closed_circuit(crane), m.test, m.log, np.column_stack([omega_m, dp_m]), spans)


def _ahc(campaign: Campaign, crane: Crane, test: CraneTest) -> Repetition:
    """A run in heave compensation, by half-waves. Errors: LogError, IdentifyError of one line."""
    log = cut(read_log(test.log, test.mapping), test)
    omega_m, dp_m = filled(shaft_speed(campaign, test, log)[0]), pressure_drop(log)
    seconds = float(log.t[-1] - log.t[0])
    if seconds < 2.0 * SETTLE:
        raise LogError(
            f"{log.source}: {show(seconds, 'time', 3)} long. Give {2.0 * SETTLE:g} s or more of heave compensation: the"
            f" first {SETTLE:g} s do not count."
        )
    late, least, spans = log.t - log.t[0] >= SETTLE, LEAST * (len(log.t) - 1) / seconds, []
    for way, words in WAYS.items():
        fast = [(a, b, way) for a, b in stretches_of(late & (way * omega_m >= JUDGED_FROM)) if b - a >= least]
        if not fast:
            raise LogError(
                f"{log.source}: no stretch of {words} at {SPEED} or more after the first {SETTLE:g} s. Both directions"
                " are needed: check the sign of omega_m, or give another part of the log."
            )
        spans += fast
    if test.hook is not None:
        s_w = _wire_out(campaign, test, log)
        test = replace(test, wire=wire_carried(crane, s_w, test.hook.tip_height(s_w)))
    return _repeated(campaign, crane, test, log, np.column_stack([omega_m, dp_m]), sorted(spans))


def _repeated(
    campaign: Campaign,
    crane: Crane,
    test: CraneTest,
    log: Log,
    measured: FloatArray,
    spans: Sequence[tuple[int, int, int]],
) -> Repetition:
    """A test, repeated by the twin. measured (n, 2): omega_m [rad/s], dp_m [Pa]; spans: samples [a, b) and direction of
    each stretch. Errors: LogError, IdentifyError, SimulationError of one line."""
    t, s_w, D_m = log.t - log.t[0], _wire_out(campaign, test, log), _displacement(log, test, campaign.motor.D_max)
    u_m = _command(log, "u_m") if "u_m" in log.signals else D_m / campaign.motor.D_max
    crane, load = down_to(crane, max(float(D_m.min()), 0.0)), test.load + test.wire
    case = Scenario(
        name=test.name,
        load=f"{load!r} kg",
        s_w=f"{s_w!r} m",
        mode="manual",
        ramp="0 s",
        warm_up="0 s",
        tip=tip_motion(log.signals, t, test.name),
        commands=logged_commands(crane, t, _command(log, "u_p"), u_m),
    )
    every = max(1, round(float(np.median(np.diff(t))) / crane.control.t_cycle))
    (run,) = run_cases(crane, case, every=every, keep=unchanged, lanes=1)
    late = t >= SETTLE
    passive = {
        name: (float(np.nanmean(log.signals[name][late])), float(on_samples(run, (name,), t[late]).mean()))
        for name in PASSIVE
        if test.ahc and name in log.signals and name in run.signals
    }
    p_a, p_b, omega = on_samples(run, ("p_a", "p_b", "omega_m"), t).T
    both = np.stack([measured, np.column_stack([omega, p_a - p_b])])  # (2, n, 2)
    gross, d = load + crane.hook_mass, campaign.diameter(test) or campaign.layer_diameter(s_w)
    T_nominal, stretches = gross * G * 0.5 * d / crane.i_hD / crane.active.motor.count, []
    for a, b, way in spans:
        part = both[:, a:b][:, np.isfinite(both[:, a:b]).all(axis=(0, 2))]
        if part.size:
            (omega_m, dp_m), (omega_sim, dp_sim) = part.mean(axis=1).tolist()
            rms, D = float(np.sqrt(np.mean(np.diff(part[..., 1], axis=0) ** 2))), float(D_m[a:b].mean())
            ends, values = (float(log.t[a]), float(log.t[b - 1])), (omega_m, omega_sim, dp_m, dp_sim, rms, D, T_nominal)
            stretches.append(PressureStretch(test.name, *ends, way, *values))
    own = campaign.verify.friction in OWN_FRICTIONS
    use = Use.AHC if test.ahc else Use.FITTED if own and not test.hold_out else Use.UNSEEN
    loaded = not test.ahc and gross >= LOADED * (crane.SWL + crane.hook_mass)
    return Repetition(test, use, log.t, both[..., 0].T, both[..., 1].T, tuple(stretches), loaded, passive)


def _command(log: Log, name: str) -> FloatArray:
    """A command of the log without gaps. Errors: LogError where it is missing, or much of it."""
    if name not in log.signals:
        raise LogError(f"{log.source}: no signal {name}. Map the pump command {name}: the twin is driven by it.")
    missing = float(np.mean(~np.isfinite(log.signals[name])))
    if missing > MOST_MISSING:
        raise LogError(
            f"{log.source}: {missing:.0%} of {name} is missing, allowed is {MOST_MISSING:.0%}. Give a part of the log"
            " without the gap (start, end)."
        )
    return filled(log.signals[name])


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
