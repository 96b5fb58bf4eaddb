"""The operator's staircase of a friction test: hoisting and lowering in turn at rising speed (Moslatt 2020 figure
2.5).

The friction tests that the thesis made on real cranes, in `published.toml`: displacement, load, use.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import active_record, drum_record, friction_record
from stillhook.engine.scenario.checks import speed_limit
from stillhook.errors import IdentifyError
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.physics.load_path.drum import LAST_TURNS, layer_diameter, wire_to_layer, wire_usable
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import LONGEST, Operator, Scenario
from stillhook.units import parse, show


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
    table = tomllib.loads(files(__package__).joinpath("published.toml").read_text(encoding="utf-8"))
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
    fastest = min(PUMP_USE * pump.D_total * pump.omega_p / (alpha * motor.D_total) - leak, speed_limit(motor, alpha))
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
