"""Paper D sections 4.2 and 4.3: pressure drop across the motors in the running twin, hoisting, lowering and in heave
compensation, next to the printed numbers; and what `identify friction --verify` flags."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks, percent
from trials.campaigns import friction as staircases
from trials.campaigns import write_campaign as write_sea_trials
from trials.campaigns.examples import short_trials
from trials.campaigns.plc_log import AHC_COLUMNS
from trials.independent_crane import crane as independent
from trials.independent_crane.sea_trial import COLUMNS, TESTS

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.engine.pack.winch import active_record, drum_record, friction_record
from stillhook.identify.system_friction.campaign import load_campaign
from stillhook.library import load_set
from stillhook.library.draws import crane_with
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.physics.load_path.drum import layer_diameter, wire_to_layer
from stillhook.physics.scalar import G
from stillhook.spec.scenario import RHO_SEA, Commands
from stillhook.units import from_display
from stillhook.validate.dynamics.friction.report import by_range
from stillhook.validate.dynamics.friction.verify import (
    PressureStretch,
    Verification,
    deviation,
    friction_parts,
    verify_friction,
)

SLOW_PAGE = True
CC, RPM, BAR = (from_display(1.0, kind) for kind in ("displacement", "rotation", "pressure"))
CRANE = load_crane("nov-150t")
SECOND = ("crane-2-second-loop", "A6VM215-crane-2-second-loop")
LOAD, LAYER = 55e3, 11  # kg, outermost
ACTIVE, PASSIVE = CRANE.active.motor.count, CRANE.circuits["passive"].motor.count
PRINTED, OFF = 130.0, 20.0  # bar: pressure drop, and the model's error when paying out
D_PASSIVE, DP_PASSIVE = 70.0, 275.0  # cm^3/rev, bar
PERIOD, END = 20.0, 60.0  # s
SPEEDS = (250.0, 500.0, 1000.0, 2000.0)  # rev/min: the profile is printed as a picture
PER_SPEED = 0.35 / 963.0  # pump command per rev/min at full displacement
RADII = (1.0, 2.5)  # m: drum with its outermost layer, of any winch of this size
SEED = 0
FRICTION_MORE = 0.4


class Quay(NamedTuple):
    """Mean over the plateaus of heave compensation on the quay: pressure drop of the active motors [Pa] and speed
    [rad/s] hauling in and paying out; pressure drop [Pa] and displacement of the passive motors [m^3/rad], and by how
    much less they hold hauling in than in the mean of both [N m a motor]."""

    up: float
    down: float
    omega: float
    dp_passive: float
    D_passive: float
    swing: float

    @property
    def friction(self) -> float:
        """Half the difference of both directions [Pa]."""
        return 0.5 * (self.up - self.down)


def quay(crane: Crane, D: float, speed: float) -> Quay:
    """55 t on the outermost layer, tip at rest, the winch moved as by waves of constant speed; D [cm^3/rev], speed
    [rev/min]."""
    motor, drum, t = crane.active.motor, drum_record(crane), np.arange(0.0, END + 0.005, 0.01)
    alpha, sign = D * CC / motor.D_max, np.clip(3.0 * np.sin(2.0 * math.pi * t / PERIOD), -1.0, 1.0)
    case = Scenario(
        load=f"{LOAD} kg",
        s_w=f"{drum.L_full - wire_to_layer(LAYER - 0.5, drum)!r} m",
        mode="ns",
        ramp="0 s",
        warm_up="0 s",
        commands=Commands(t, PER_SPEED * speed * alpha * sign, np.full_like(t, alpha)),
    )
    run = simulate(crane, case, every="10 ms")
    n, dp = run.omega_m.values, run.p_a.values - run.p_b.values
    flat = (np.abs(sign) == 1.0) & (run.time.values > PERIOD) & (np.mod(t, 0.5 * PERIOD) > 0.25 * PERIOD)
    passive = crane.circuits["passive"]
    dp_passive, D_passive = run.p_hp.values - passive.p_lp, run.alpha_pm.values * passive.motor.D_max
    held = [float((dp_passive * D_passive)[flat & (way * n > 0.0)].mean()) for way in (1, -1)]
    return Quay(
        float(dp[flat & (n > 0.0)].mean()),
        float(dp[flat & (n < 0.0)].mean()),
        float(np.abs(n[flat]).mean()),
        float(np.median(dp_passive)),
        float(np.median(D_passive)),
        0.5 * (held[1] - held[0]),
    )


def load_torque(crane: Crane) -> float:
    """Of 55 t and the hook, at the drum [N m]."""
    return (LOAD + crane.hook_mass) * G * 0.5 * float(layer_diameter(float(LAYER), drum_record(crane)))


def closed_form(crane: Crane, D: float, q: Quay, T_d: float | None = None) -> float:
    """The same pressure from the equations of friction and motor loss alone [Pa]; T_d another drum torque [N m]."""
    fit, T_d = active_record(crane).motors.fit, load_torque(crane) if T_d is None else T_d
    T = (ACTIVE + PASSIVE) * float(system_friction(q.omega, T_d, friction_record(crane.friction.system)))
    T += PASSIVE * (q.swing + float(torque_loss(q.omega, q.D_passive, q.dp_passive, fit)))
    dp = 0.0
    for _ in range(20):  # the active motors' own loss rises a little with the pressure that it takes
        dp = (T + ACTIVE * float(torque_loss(q.omega, D * CC, dp, fit))) / (ACTIVE * D * CC)
    return dp


def radius_for(crane: Crane, dp: float, q: Quay) -> float:
    """Outer radius of a drum at which friction would take this pressure in each direction: the torque at the shafts is
    printed, so that the drum torque rises with the gear ratio, and that with the radius [m]."""
    low, high, r = 0.1, 100.0, 0.5 * float(layer_diameter(float(LAYER), drum_record(crane)))
    for _ in range(60):
        mid = 0.5 * (low + high)
        low, high = (mid, high) if closed_form(crane, 215.0, q, load_torque(crane) * mid / r) < dp else (low, mid)
    return low


def bars_of_215(runs: Mapping[tuple[float, float], tuple[Quay, Quay]]) -> Iterator[tuple[float, float]]:
    """Pressure drop in each direction, and between both, by speed [bar]."""
    for (D, _), (q, _) in runs.items():
        if D == 215.0:
            yield q.friction / BAR, 2.0 * q.friction / BAR


def printed_case() -> tuple[float, float]:
    """20 bar too little when paying out and none hauling in, as `--verify` counts it: of the measured pressure, and of
    the nominal torque of eight passive motors [-]."""
    T_N = PASSIVE * D_PASSIVE * CC * DP_PASSIVE * BAR / ACTIVE
    rows = [(1, PRINTED, PRINTED), (-1, -PRINTED, -PRINTED + OFF)]
    d = deviation([PressureStretch("", 0.0, 1.0, w, w, w, m * BAR, s * BAR, 0.0, 215.0 * CC, T_N) for w, m, s in rows])
    return d.of_pressure, d.of_torque


def crane_file_of(path: Path, friction: str) -> Verification:
    campaign = load_campaign(path)
    return verify_friction(replace(campaign, verify=campaign.verify.model_copy(update={"friction": friction})))


def staircase_logs(folder: Path, sets: tuple[str, ...]) -> Path:
    """Tests 2, 3 and 5 to 6 of paper D on a crane with these sets."""
    plan = staircases.campaign_plan("crane-2")
    plan = replace(plan, tests=tuple(t for t in plan.tests if t.name in ("2", "3", "5", "6")))
    truth = crane_with(CRANE, *map(load_set, sets)) if sets else None
    return staircases.write_campaign(plan, folder, reference=truth, duration="4 min").campaign


def at_sea(
    folder: Path, crane: str, columns: Mapping[str, tuple[str, str]], tests: Mapping[str, tuple[str, float]]
) -> Path:
    """A friction campaign of logs of sea trials: columns by signal, heading and unit; tests by log, load [kg]."""
    count = sum(c.motor.count for c in load_crane(crane).circuits.values())
    rows = [f'{name} = {{ column = "{heading}", unit = "{unit}" }}' for name, (heading, unit) in columns.items()]
    lines = ['title = "SYNTHETIC"', f'crane = "{crane}"', f"motors = {count}", "[signals]", *rows]
    for name, (log, load) in tests.items():
        lines += ["[[test]]", f'name = "{name}"', f'log = "{log}"', f'load = "{load!r} kg"', "ahc = true"]
    path = folder / "verify.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


SIGNALS = ("s_tip", "v_tip", "s_w", "omega_m", "p_a", "p_b", "u_p", "u_m", "alpha_m")


def independent_crane(folder: Path, friction: float) -> Path:
    """Tests A1 and A4 of the independent crane, whose laws, PLC and sensors are other code."""
    case = independent.Case("made", "", independent.Must.PASS, defect=independent.Defect(friction=friction))
    kept, independent.TESTS = independent.TESTS, tuple(t for t in TESTS if t.name in ("A1", "A4"))
    try:
        independent.write_campaign(folder, case)
    finally:
        independent.TESTS = kept
    columns = {c.signal: (c.header, c.unit) for c in COLUMNS if c.signal in SIGNALS} | {"time": _time()}
    return at_sea(
        folder, "nov-250t", columns, {t.name: (f"{t.name}.txt", t.load) for t in TESTS if t.name in ("A1", "A4")}
    )


def _time() -> tuple[str, str]:
    column = next(c for c in COLUMNS if c.signal == "time")
    return column.header, column.unit


def reference_crane(folder: Path, more: float) -> Path:
    """Tests 1 and 3 of the example's sea trials on the reference plant, with more friction, of a Stribeck law."""
    plan = short_trials()
    plan = replace(plan, tests=tuple(t for t in plan.tests if t.name in ("1", "3")))
    write_sea_trials(folder, plan=plan, seed=SEED, defect="friction" if more else None, size=more or None)
    columns = {c.name: (c.heading, c.unit) for c in AHC_COLUMNS if c.name in SIGNALS} | {"time": ("Time", "s")}
    loads = {t.name: t.load - (RHO_SEA * t.water.volume if t.water else 0.0) for t in plan.tests}
    return at_sea(folder, "nov-250t", columns, {name: (f"logs/{name}.csv", load) for name, load in loads.items()})


def trials() -> Iterator[tuple[str, ...]]:
    """What was verified, against what, largest deviations, verdict, and what it must be."""
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        same, crane_1 = staircase_logs(folder / "same", ()), staircase_logs(folder / "crane-1", ("crane-1",))
        motors = staircase_logs(folder / "motors", SECOND)
        a, b = independent_crane(folder / "i", 1.0), independent_crane(folder / "j", 1.4)
        c, d = reference_crane(folder / "r", 0.0), reference_crane(folder / "s", FRICTION_MORE)
        cases = (
            ("staircases of the twin", "its own", same, "crane", True),
            ("staircases of the twin", "set of crane 1", same, "crane-1", False),
            ("staircases of a crane with the friction of crane 1", "crane file", crane_1, "crane", False),
            ("the same", "set of crane 1", crane_1, "crane-1", True),
            ("staircases of a crane with the second-loop sets", "crane file", motors, "crane", None),
            ("independent crane in AHC", "crane file", a, "crane", True),
            ("independent crane in AHC, friction +40 %", "crane file", b, "crane", False),
            ("reference plant in AHC, law 8 % off the twin's", "crane file", c, "crane", None),
            ("the same, friction +40 %", "crane file", d, "crane", False),
        )
        for logs, against, path, friction, must in cases:
            v = crane_file_of(path, friction)
            of = [deviation(r.judged) for r in v.runs]
            verdict = "within the limits" if v.passed else "flagged"
            expected = "-" if must is None else "within the limits" if must else "flagged"
            torque = percent(max(d.of_torque for d in of), digits=1)
            parts = [friction_parts(same) for group, _, same in by_range(v) if group.endswith("rotation")]
            shares = [p[0].value / p[1] for p in parts if p is not None]
            of_friction = " to ".join(percent(round(end(shares), 3) + 0.0, sign=True, digits=1) for end in (min, max))
            pressure = percent(max(d.of_pressure for d in of), digits=1)
            yield logs, against, pressure, torque, of_friction, verdict, expected


def compute() -> tuple[Blocks, None]:
    """Blocks of the page and its claims."""
    second = crane_with(CRANE, *map(load_set, SECOND))
    runs = {(D, n): (quay(CRANE, D, n), quay(second, D, n)) for D in (215.0, 160.0) for n in SPEEDS}
    rows = [{"D": D, "one": one, "two": two} for (D, _), (one, two) in runs.items()]
    middle = runs[215.0, 500.0][0]
    r_now = 0.5 * float(layer_diameter(float(LAYER), drum_record(CRANE)))
    ends = [closed_form(CRANE, 215.0, middle, load_torque(CRANE) * r / r_now) / BAR for r in RADII]
    of_pressure, of_torque = printed_case()
    needed = radius_for(CRANE, PRINTED * BAR, middle)
    results = list(trials())
    wrong = [row for row in results if row[6] not in ("-", row[5])]
    fastest = CRANE.active.motor.n_max_full
    most = closed_form(CRANE, 215.0, middle._replace(omega=fastest)) / BAR
    each, both = (f"{min(x):.0f} to {max(x):.0f} bar" for x in zip(*bars_of_215(runs), strict=True))
    less = (runs[215.0, 500.0][1].friction - middle.friction) / BAR
    judged = [row for row in results if row[6] != "-"]
    numbers: dict[str, Any] = locals()
    return {"claims": numbers, "pressures": rows, "size": numbers, "parts": numbers, "trials": results}, None
