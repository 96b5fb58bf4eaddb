"""The operator's staircase of a friction test: hoisting and lowering in turn at rising speed (Moslatt 2020 figure
2.5).

The friction tests that the thesis made on real cranes, in `published.toml`: displacement, load, use.

Synthetic friction tests: the twin runs a campaign of hoist/lower staircases, and its PLC logs them.

Everything that it writes is marked SYNTHETIC. The reference crane behind the logs is stored next to them as a crane
file, for a blind test of the workflow from log to parameters.
"""

from __future__ import annotations

import math
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_folder
from stillhook.engine.pack.winch import active_record, drum_record, friction_record
from stillhook.engine.simulate import simulate
from stillhook.errors import IdentifyError
from stillhook.identify.system_friction.closed_circuit import closed_circuit, down_to
from stillhook.library import crane_toml, load_crane
from stillhook.library.examples import CAMPAIGN_FILE, LOG_FOLDER, MARK, REFERENCE_FILE
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.physics.load_path.drum import LAST_TURNS, layer_diameter, wire_to_layer, wire_usable
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import LONGEST, Operator, Scenario
from stillhook.units import parse, quote, show
from trials.campaigns.plc_log import (
    COLUMNS,
    Instruments,
    Noise,
    Sensors,
    WrittenCampaign,
    check_campaign_folder,
    log_file,
    logged,
    mapping_lines,
    write_log,
)


@dataclass(frozen=True)
class PlannedTest:
    """One hoist/lower staircase: D_m displacement of one motor [m^3/rad]; load on the hook, without the hook [kg];
    hold_out: not used to fit, kept to check the fit; layer of wire to work on, None where the plan's own is meant."""

    name: str
    D_m: float
    load: float
    hold_out: bool = False
    layer: int | None = None


@dataclass(frozen=True)
class TestPlan:
    """The tests of one campaign on a crane of the library. motors: all motors in the circuit during the tests."""

    __test__ = False  # no test of pytest's

    name: str
    title: str
    crane: str
    motors: int
    tests: tuple[PlannedTest, ...]
    source: str


def _published() -> dict[str, TestPlan]:
    table = tomllib.loads(Path(__file__).with_name("published.toml").read_text(encoding="utf-8"))
    plans = {}
    for name, row in table.items():
        hold_out, motors = row.pop("hold_out", ()), row["motors"]
        tests = tuple(
            PlannedTest(test, parse(D_total, "displacement") / motors, parse(load, "mass"), test in hold_out)
            for test, (D_total, load) in row.pop("tests").items()
        )
        plans[name] = TestPlan(name=name, tests=tests, **row)
    return plans


CAMPAIGNS = _published()
"""Published test campaigns by name."""


HOLD = 12.0
"""How long each speed is held [s]: speed and pressures come to their means within three; a load that rings on its wire
averages out."""
RAMP = 2.0
"""Time from rest to a speed and back [s]."""
PAUSE = 5.0
"""Rest before the first and at least after the last step [s]."""
LEAST_PAIRS = 3
SLOWEST = 20.0 * math.pi / 30.0
"""Lowest speed of the staircase [rad/s], 20 rev/min: break-away friction shows below some 250 rev/min."""
SLOW = 200.0 * math.pi / 30.0
"""Up to here the speeds are dense [rad/s]."""
SLOW_SHARE = 0.3
"""Share of the speeds that are dense."""
PUMP_USE = 0.97
"""Largest pump command of the staircase [-]: the highest step must not saturate."""
RELIEF_USE = 0.8
"""Largest share of the pressure up to the relief valves that breaking loose may take [-]; the rest is for acceleration
and speed."""
ROUNDING = 1e-9
"""Relative difference of displacements that is rounding alone."""


@dataclass(frozen=True)
class Staircase:
    """One test as the operator runs it. speeds: motor speeds aimed at [rad/s], each hoisted and then lowered; D_m
    displacement of one motor [m^3/rad]; d diameter of the wire's centre on the layer [m]; dp_L pressure that holds the
    load [Pa]; notes: what the test cannot keep to, one line each."""

    case: Scenario
    speeds: FloatArray
    D_m: float
    d: float
    dp_L: float
    layer: int
    notes: tuple[str, ...]


def staircase(crane: Crane, test: PlannedTest, *, layer: int, duration: float = 1200.0) -> Staircase:
    """The scenario of one test on a crane whose motors all sit in its active circuit.

    The joystick rises from pair to pair; each speed is held `HOLD`, reached and left within `RAMP`. The command is
    trimmed by the leakage that the crane's sheet names (`C_leak`), so that slow hoisting and slow lowering are both
    reached; what the leakage really is then shows as different speeds up and down. It starts in the middle of the
    layer.

    Errors: IdentifyError where the test is too short, or the crane cannot run it.
    """
    motor, alpha = crane.active.motor, test.D_m / crane.active.motor.D_max
    if not motor.alpha_min <= alpha * (1.0 + ROUNDING) or alpha > 1.0 + ROUNDING:
        raise IdentifyError(
            f'test "{test.name}": D_m {show(test.D_m, "displacement", 6)}: the motors of "{crane.name}" have '
            f"{show(motor.alpha_min * motor.D_max, 'displacement', 6)} to {show(motor.D_max, 'displacement', 6)}."
            " Choose one in between."
        )
    alpha = min(max(alpha, motor.alpha_min), 1.0)
    least = 2.0 * PAUSE + LEAST_PAIRS * 2.0 * (HOLD + 2.0 * RAMP)
    if not least <= duration <= LONGEST:
        raise IdentifyError(
            f"duration = {show(duration, 'time')}: a staircase takes {least:g} s to {LONGEST:g} s. Change it."
        )
    pairs = math.floor((duration - 2.0 * PAUSE) / (2.0 * (HOLD + 2.0 * RAMP)))
    d = float(layer_diameter(float(layer), drum_record(crane)))
    dp_L = holding_pressure(crane, test, d)
    leak = crane.active.C_leak * dp_L / (alpha * motor.D_total)
    pump = crane.active.pump
    fastest = min(PUMP_USE * pump.D_total * pump.omega_p / (alpha * motor.D_total) - leak, motor.speed_limit(alpha))
    if fastest < 2.0 * SLOWEST:
        raise IdentifyError(
            f'test "{test.name}": the pumps of "{crane.name}" reach {show(max(fastest, 0.0), "rotation")} against the'
            " leakage. Lower the load or the displacement."
        )
    speeds = _speeds(fastest, pairs)
    r_eff = 0.5 * d / crane.i_hD
    s_w, notes = _start(crane, layer, float(speeds.max()) * r_eff * (HOLD + RAMP))
    case = Scenario(
        name=test.name,
        load=f"{test.load!r} kg",
        s_w=f"{s_w!r} m",
        mode="manual",
        ramp="0 s",
        duration=f"{duration!r} s",
        warm_up=f"{PAUSE!r} s",
        operator=Operator(profile=_profile(speeds, leak, r_eff), alpha_m=alpha),
    )
    return Staircase(case, speeds, alpha * motor.D_max, d, dp_L, layer, notes)


def holding_pressure(crane: Crane, test: PlannedTest, d: float) -> float:
    """Pressure drop that holds load and hook without friction, on diameter d [m], all motors at the test's displacement
    [Pa]."""
    return (test.load + crane.hook_mass) * G * 0.5 * d / crane.i_hD / (crane.active.motor.count * test.D_m)


def break_away_pressure(crane: Crane, test: PlannedTest, d: float) -> float:
    """Pressure drop that breaks the load loose upwards, on diameter d [m] [Pa]."""
    dp_L, motor = holding_pressure(crane, test, d), crane.active.motor
    T_d = (test.load + crane.hook_mass) * G * 0.5 * d
    T_fs = system_friction(0.0, T_d, friction_record(crane.friction.system))
    T_fm = torque_loss(0.0, test.D_m, dp_L, active_record(crane).motors.fit)
    return dp_L + float(T_fs + T_fm) * motor.count / (motor.count * test.D_m)


def outermost_layer(crane: Crane, tests: tuple[PlannedTest, ...]) -> int:
    """The outermost layer on which every test can be hoisted without the relief valves: as little wire out as the
    pressures allow.

    Errors: IdentifyError where even the innermost layer takes too much.
    """
    drum, a = drum_record(crane), crane.active
    for layer in range(crane.drum.layers, 0, -1):
        d = float(layer_diameter(float(layer), drum))
        if all(break_away_pressure(crane, t, d) < RELIEF_USE * (a.relief.p - a.boost.p) for t in tests):
            return layer
    worst = max(tests, key=lambda t: break_away_pressure(crane, t, float(layer_diameter(1.0, drum))))
    raise IdentifyError(
        f'test "{worst.name}": at {show(worst.D_m, "displacement")} a motor "{crane.name}" lifts'
        f" {show(worst.load, 'mass')} on no layer without its relief valves. Lower the load or raise the displacement."
    )


def _speeds(fastest: float, pairs: int) -> FloatArray:
    """Rising speeds [rad/s]: geometric up to 200 rev/min, then evenly up to the fastest."""
    bend = min(SLOW, 0.5 * fastest)
    n = max(1, round(SLOW_SHARE * pairs))
    slow = np.geomspace(SLOWEST, bend, n) if n > 1 else np.array([bend])
    return np.concatenate([slow, np.linspace(bend, fastest, pairs - n + 1)[1:]])


def _profile(speeds: FloatArray, leak: float, r_eff: float) -> tuple[tuple[str, str], ...]:
    """Joystick over time: wire speeds whose pump flow makes up for the leak as well, hoisting positive."""
    t, rows = PAUSE, [("0 s", "0 m/s")]
    for speed in speeds:
        for v in ((speed + leak) * r_eff, (leak - speed) * r_eff):
            for after, value in ((0.0, 0.0), (RAMP, v), (RAMP + HOLD, v), (2.0 * RAMP + HOLD, 0.0)):
                rows.append((f"{t + after!r} s", f"{float(value)!r} m/s"))
            t += 2.0 * RAMP + HOLD
    return tuple(rows)


def _start(crane: Crane, layer: int, travel: float) -> tuple[float, tuple[str, ...]]:
    """Wire paid out in the middle of a layer [m], and a note where the fastest step, which takes in `travel` of wire
    [m], leaves the layer. Errors: IdentifyError for a layer that the drum does not have."""
    drum = drum_record(crane)
    if not 1 <= layer <= crane.drum.layers:
        raise IdentifyError(f'layer = {layer}: the drum of "{crane.name}" has layers 1 to {crane.drum.layers}.')
    inner, outer = (drum.L_full - wire_to_layer(float(n), drum) for n in (layer - 1, layer))
    inner = min(inner, wire_usable(drum))
    s_w = 0.5 * (inner + outer)
    if travel <= 0.5 * (inner - outer):
        return s_w, ()
    text = (
        f"the fastest step moves {travel:.3g} m of wire, and there are {inner - outer:.3g} m on layer {layer}"
        f" ({LAST_TURNS:.0f} turns kept): the test leaves the layer"
    )
    return s_w, (text,)


LAYER_ROOM = 1e-6
"""Layers by which a wire that stays on its layer may seem to leave it: rounding."""


def campaign_plan(name: str) -> TestPlan:
    """A published campaign by name. Errors: IdentifyError naming those there are."""
    if name not in CAMPAIGNS:
        raise IdentifyError(f"campaign {quote(name)}: not one of {', '.join(CAMPAIGNS)}.")
    return CAMPAIGNS[name]


def crane_of(plan: TestPlan, reference: Crane | None = None) -> Crane:
    """The crane of a campaign as it is tested; reference: another one that is tested in its place, with its circuits as
    they are at sea.

    Its motors go down to the smallest displacement of the tests. Errors: SpecError, UnitError, IdentifyError of one
    line.
    """
    crane = closed_circuit(load_crane(plan.crane) if reference is None else reference)
    motor = crane.active.motor
    if motor.count != plan.motors:
        raise IdentifyError(
            f'campaign "{plan.name}": {plan.motors} motors, and "{crane.name}" has {motor.count} in one circuit.'
        )
    return down_to(crane, min(t.D_m for t in plan.tests))


def write_campaign(
    plan: TestPlan,
    out: str | Path,
    *,
    instruments: Instruments | None = None,
    duration: str = "20 min",
    reference: Crane | None = None,
    layer: int | None = None,
    threads: int = 2,
) -> WrittenCampaign:
    """Simulate the tests of a campaign and write what the PLC logs: `campaign.toml`, `logs/*.csv` and `reference.toml`.

    Parameters
    ----------
    plan: which tests on which crane, see `CAMPAIGNS`. out: folder, without a campaign in it yet.
    instruments: sensors (default: typical noise, seed 0). duration: of each test.
    reference: the crane that is really tested, for a blind test: the campaign file names the plan's crane all the same.
    Make it with `stillhook.library.changed` or `stillhook.identify.system_friction.fitting.uncertainty.crane_with`.
    layer: layer of wire to work on (default: the outermost that the pressures allow).

    Returns what was written, with notes. Errors: IdentifyError, SpecError, SimulationError, one line; nothing is left
    half-written.
    """
    folder, instruments, length = Path(out), instruments or Instruments(), parse(duration, "time", "duration")
    check_campaign_folder(folder)
    crane = crane_of(plan, reference)
    chosen = outermost_layer(crane, plan.tests) if layer is None else layer
    stairs = [staircase(crane, t, layer=chosen if t.layer is None else t.layer, duration=length) for t in plan.tests]
    sensors = instruments.sensors(crane, max(float(s.speeds.max()) for s in stairs))
    files = [log_file(t.name) for t in plan.tests]
    with atomic_folder(folder) as part:
        (part / LOG_FOLDER).mkdir()

        def work(i: int) -> list[str]:
            return _write_log(crane, stairs[i], sensors, np.random.default_rng([instruments.seed, i]), part / files[i])

        with ThreadPoolExecutor(threads) as pool:
            notes = [
                f'test "{plan.tests[i].name}": {note}'
                for i, log in enumerate(pool.map(work, range(len(stairs))))
                for note in log
            ]
        text = f"# {MARK}. The crane that made the logs.\n{crane_toml(crane)}"
        (part / REFERENCE_FILE).write_text(text, encoding="utf-8")
        text = campaign_text(plan, stairs, files, noise=instruments.noise, sensors=sensors)
        (part / CAMPAIGN_FILE).write_text(text, encoding="utf-8")
    return WrittenCampaign.of(folder, files, sensors, notes, chosen)


def _write_log(crane: Crane, stairs: Staircase, sensors: Sensors, rng: np.random.Generator, path: Path) -> list[str]:
    """Simulate one test and write its log; returns what it could not keep to."""
    t_cycle = crane.control.t_cycle
    run = simulate(crane, stairs.case, every=f"{t_cycle!r} s", threads=1)
    signals = {c.name: logged(run[c.name].values, sensors[c.name], t_cycle, rng) for c in COLUMNS}
    write_log(path, np.round(run["time"].values, 9), signals, COLUMNS, sensors)
    return [*stairs.notes, *_limits(run, stairs)]


def _limits(run: Any, stairs: Staircase) -> list[str]:
    """Limits that the test went beyond."""
    notes, status = [], str(run["status"].item())
    layers = np.ceil(run["layer"].values - LAYER_ROOM)
    if np.any(layers != stairs.layer):
        notes.append(f"the wire went from layer {layers.max():.0f} to layer {layers.min():.0f}")
    if status != "ok":
        notes.append(f"went beyond limits: {status}")
    return notes


def campaign_text(plan: TestPlan, stairs: list[Staircase], files: list[str], *, noise: Noise, sensors: Sensors) -> str:
    """The campaign file: crane, signals, tests, as the reader of measured campaigns takes it."""
    crane = load_crane(plan.crane)
    lines = [
        f"# {MARK} (noise: {noise.value}). Plan: {plan.source}.",
        f'title = "SYNTHETIC {plan.title}"',
        f'crane = "{plan.crane}"',
        f"motors = {plan.motors}",
        f'motor = "{crane.active.motor.type}"',
        "",
        "[signals]",
        *mapping_lines(COLUMNS, sensors),
    ]
    for test, stair, file in zip(plan.tests, stairs, files, strict=True):
        lines += [
            "",
            "[[test]]",
            f'name = "{test.name}"',
            f'log = "{file}"',
            f'D_m = "{show(stair.D_m, "displacement", 12)}"',
            f'load = "{show(test.load, "mass", 12)}"',
            f"layer = {stair.layer}",
            f"hold_out = {str(test.hold_out).lower()}",
        ]
    return "\n".join(lines) + "\n"
