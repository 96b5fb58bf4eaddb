"""The independent crane and its campaigns: a healthy one, and cases in which crane or crane file are wrong in one
thing.

Only numbers are the twin's: those of the crane file, and of `drum_record`, `inertia_record` and `gains`. Laws,
integration, PLC, sea, sensors and log format are those of this file and of `plant.py`, `plc.py` and
`sea_trial.py`.
"""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook import Crane
from stillhook.engine.pack.winch import drum_record, gains, inertia_record
from stillhook.library import load_crane
from trials.independent_crane.plant import (
    Active,
    Drum,
    Friction,
    Hoist,
    Log,
    Loss,
    Motors,
    Oil,
    Passive,
    Servo,
    Winch,
    run,
)
from trials.independent_crane.plc import Settings
from trials.independent_crane.sea_trial import (
    BAR,
    COLUMNS,
    CYCLE,
    STATED_DELAY,
    TESTS,
    SeaTest,
    inputs_of,
    logged,
    samples,
)

CRANE_FILE = "nov-250t"
G = 9.80665  # m/s^2
LPM_PER_BAR = 1e-3 / 60.0 / BAR  # m^3/s/Pa
STEPS = 10
"""Steps of the plant in a cycle of the PLC."""

# Numbers that are not in the crane file
PUMP_LEAK_20, PUMP_LEAK_100 = 0.033 * LPM_PER_BAR, 0.0478 * LPM_PER_BAR
"""Leak of one pump of 355 cm^3/rev at 20 and 100 % stroke [m^3/s/Pa], linear between (Moslatt 2020 tables 2.5 and 2.6,
interpolated to 1800 rev/min)."""
PUMPS_OVER_TABLE = 1355.0 / 355.0
"""Installed pumps over the one of those tables."""
CONSTANT_LEAK = 0.4 * LPM_PER_BAR
STROKE_LEAK = (0.13 * LPM_PER_BAR, 0.27 * LPM_PER_BAR)
"""Leak of the cases with another form [m^3/s/Pa]: all of it; at rest, and its rise to full stroke."""
PRESSURE_LEAK, PRESSURE_RISE = 0.286 * LPM_PER_BAR, 0.4 / (225.0 * BAR)
"""Leak of the case whose conductance rises with pressure: without pressure [m^3/s/Pa], and its rise [1/Pa]: 0.4
L/min/bar at 225 bar."""
ZETA_WIRE = 0.02  # assumed
SLIP = 0.008  # assumed: asynchronous motors of the power units
TAU_CELL, GAIN_CELL = 0.08, 1.002  # s, -; assumed
OIL_SWING, SLOWEST_OIL = 2.0, 300.0  # K, s; assumed: one swing a test, not quicker than this
VESSEL = 293.0  # K
HEAT_CAPACITY = 2.6  # c_v over R of nitrogen: 2.5, a little more at pressure
GAS_TAU = 300.0  # s, in which gas takes on the temperature of its vessels; assumed
PISTON_DRY = (0.5 * BAR, 1.5 * BAR)  # assumed
SCATTER = {
    "wire": 0.05,
    "leak": 0.05,
    "displacement": 0.003,
    "friction": 0.05,
    "gas": 0.02,
    "precharge": 0.01,
    "capacitance": 0.03,
    "inertia": 0.03,
    "passive displacement": 0.003,
    "pump speed": 0.002,
    "pump servo": 0.05,
    "pump damping": 0.05,
    "motor servo": 0.05,
    "piston": 0.3,
}
"""Half width of the even distribution around 1 of factors over the twin's numbers (assumed: what differs between a
crane and its file)."""

CRANE_STREAM, TEST_STREAM = 77, 78
"""First number of the random streams."""
DATE = "2026-11-22"
"""Of the tests, in the campaign file."""


class Leak(StrEnum):
    """What the leakage of the active circuit goes with."""

    LIKE_FILE = "stroke and speed"
    CONSTANT = "constant"
    STROKE = "stroke"
    PRESSURE = "pressure"


class Defect(NamedTuple):
    """What is wrong with the crane, its sensors or the campaign; the defaults are a healthy one. friction, displacement
    (active motors), wire (stiffness): factors in place of the drawn ones; gear, leakage: factors; dead passive motors;
    zero_a of the transmitter of line A [Pa]; delay of the motion unit [s], where the campaign states STATED_DELAY."""

    leak: Leak = Leak.LIKE_FILE
    leakage: float = 1.0
    friction: float | None = None
    displacement: float | None = None
    wire: float | None = None
    gear: float = 1.0
    dead: int = 0
    zero_a: float = 0.0
    delay: float = STATED_DELAY


class Must(StrEnum):
    """What a campaign must give."""

    PASS = "passed"
    TURN_DOWN = "turned down"
    NOT_REFUTE = "not refuted"
    NAME_FORM = "form of the leakage named"


class Case(NamedTuple):
    """One campaign."""

    name: str
    text: str  # for the page
    must: Must
    lines: tuple[str, ...] = ()  # of the verdict; what it must give is read off them
    defect: Defect = Defect()
    file: str = ""  # what the crane file says otherwise than the library's (TOML)
    seed: int = 0


def entry(table: str, key: str, value: str) -> str:
    """A value of a crane file, as TOML, with a source."""
    return (
        f'[{table}]\n{key} = {{ value = {value}, kind = "assumed", source = "independent crane: wrong on purpose" }}\n'
    )


FILE_PRECHARGE = entry("passive.accumulator.gas", "p_0", '"310 bar"')
FILE_GAS = entry("passive.accumulator.gas", "V_0", '"9 m^3"')
FILE_MOTORS = entry("passive.motor", "count", "14") + entry("inertia", "J_m_eff", '"4.028 kg m^2"')
"""Two motors less, with the inertia of two rotors less (0.036 kg m^2 each)."""
FILE_BOOST = entry("active.boost", "p", '"35 bar"')
LEAKAGE_LINES = ("p-leakage", "4-leakage")
CASES: tuple[Case, ...] = (
    *(Case(f"healthy-{seed}", f"nothing wrong, crane {seed}", Must.PASS, seed=seed) for seed in range(4)),
    Case("precharge", "file: precharge 310 bar; crane: 280 bar", Must.TURN_DOWN, ("6-precharge",), file=FILE_PRECHARGE),
    Case("gas-volume", "file: 9 m³ of gas; crane: 5 m³", Must.TURN_DOWN, ("6-gas",), file=FILE_GAS),
    Case(
        "motor-count", "file: 14 passive motors; crane: 16", Must.TURN_DOWN, ("6-motors", "6-setting"), file=FILE_MOTORS
    ),
    Case("dead-1", "1 of 16 passive motors dead", Must.TURN_DOWN, ("6-motors",), Defect(dead=1)),
    Case("dead-2", "2 of 16 passive motors dead", Must.TURN_DOWN, ("6-motors",), Defect(dead=2)),
    Case("dead-3", "3 of 16 passive motors dead", Must.TURN_DOWN, ("6-motors",), Defect(dead=3)),
    Case(
        "zero-a",
        "transmitter of line A shows 6 bar too much",
        Must.TURN_DOWN,
        ("p-rest-pressures",),
        Defect(zero_a=6.0 * BAR),
    ),
    Case(
        "leak-constant", "leakage constant, 0.4 L/min/bar", Must.NOT_REFUTE, LEAKAGE_LINES, Defect(leak=Leak.CONSTANT)
    ),
    Case(
        "leak-pressure",
        "leakage 0.286 L/min/bar, rising to 0.4 at 225 bar",
        Must.NOT_REFUTE,
        LEAKAGE_LINES,
        Defect(leak=Leak.PRESSURE),
    ),
    Case(
        "leak-stroke", "leakage 0.13 + 0.27 L/min/bar × stroke", Must.NAME_FORM, LEAKAGE_LINES, Defect(leak=Leak.STROKE)
    ),
    Case("delay", "motion unit 120 ms late; campaign: 40 ms", Must.TURN_DOWN, ("p-tip-delay",), Defect(delay=0.12)),
    Case("friction", "friction +40 %", Must.TURN_DOWN, ("p-friction",), Defect(friction=1.4)),
    Case("wire", "wire 30 % softer", Must.TURN_DOWN, ("p-wire",), Defect(wire=0.7)),
    Case("gear", "gear ratio +2 %", Must.TURN_DOWN, ("p-lever",), Defect(gear=1.02)),
    Case("leakage", "leakage +50 %", Must.TURN_DOWN, ("p-leakage", "4-leakage"), Defect(leakage=1.5)),
    Case(
        "displacement",
        "active motors −5 % of displacement",
        Must.TURN_DOWN,
        ("p-displacement",),
        Defect(displacement=0.95),
    ),
    Case("boost", "file: boost 35 bar; crane: 25 bar", Must.TURN_DOWN, ("p-boost",), file=FILE_BOOST),
)


class Drawn(NamedTuple):
    """What a seed makes of the crane: factors over the twin's numbers, the same in all tests."""

    wire: float
    leak: float
    displacement: float
    friction: float
    gas: float
    precharge: float
    capacitance: float
    inertia: float


class DrawnOfTest(NamedTuple):
    """What differs from test to test, for tests lie days apart: factors over the twin's numbers, and dry friction of
    the pistons [Pa]."""

    passive_displacement: float
    pump_speed: float
    pump_servo: float
    pump_damping: float
    motor_servo: float
    piston: float
    piston_dry: float


def draw_crane(seed: int, defect: Defect) -> tuple[Drawn, list[DrawnOfTest]]:
    """The crane of a seed, and what each of its tests changes."""
    rng = np.random.default_rng([CRANE_STREAM, seed])

    def near(name: str) -> float:
        return 1.0 + SCATTER[name] * rng.uniform(-1.0, 1.0)

    drawn = Drawn(
        wire=near("wire") if defect.wire is None else defect.wire,
        leak=near("leak"),
        displacement=near("displacement") if defect.displacement is None else defect.displacement,
        friction=near("friction") if defect.friction is None else defect.friction,
        gas=near("gas"),
        precharge=near("precharge"),
        capacitance=near("capacitance"),
        inertia=near("inertia"),
    )

    def day() -> DrawnOfTest:
        return DrawnOfTest(
            passive_displacement=near("passive displacement"),
            pump_speed=near("pump speed"),
            pump_servo=near("pump servo"),
            pump_damping=near("pump damping"),
            motor_servo=near("motor servo"),
            piston=near("piston"),
            piston_dry=rng.uniform(*PISTON_DRY),
        )

    return drawn, [day() for _ in TESTS]


def leakage(crane: Crane, defect: Defect, factor: float) -> tuple[float, float, float]:
    """Leak of the active circuit at rest [m^3/s/Pa], its rise to full stroke [m^3/s/Pa] and with motor speed
    [m^3/rad/Pa]."""
    motor, (at_20, at_100) = crane.active.motor, (PUMPS_OVER_TABLE * PUMP_LEAK_20, PUMPS_OVER_TABLE * PUMP_LEAK_100)
    rise = (at_100 - at_20) / 0.8
    forms = {
        Leak.LIKE_FILE: (at_20 - 0.2 * rise + motor.count * motor.C_1, rise, motor.count * motor.C_2),
        Leak.CONSTANT: (CONSTANT_LEAK, 0.0, 0.0),
        Leak.STROKE: (*STROKE_LEAK, 0.0),
        Leak.PRESSURE: (PRESSURE_LEAK, 0.0, 0.0),
    }
    at_rest, stroke, speed = forms[defect.leak]
    scale = defect.leakage * factor
    return scale * at_rest, scale * stroke, scale * speed


def active_circuit(crane: Crane, defect: Defect, drawn: Drawn, day: DrawnOfTest) -> Active:
    """The closed circuit of the active motors."""
    a = crane.active
    at_rest, stroke, speed = leakage(crane, defect, drawn.leak)
    count = float(a.motor.count)
    return Active(
        motors=Motors(count, count, a.motor.D_max * drawn.displacement),
        D_pumps=a.pump.D_total,
        omega_p=a.pump.omega_p * day.pump_speed,
        slip=SLIP,
        leak=at_rest,
        leak_stroke=stroke,
        leak_speed=speed,
        leak_pressure=PRESSURE_RISE if defect.leak is Leak.PRESSURE else 0.0,
        C_h=a.line.V / a.line.bulk_modulus * drawn.capacitance,
        p_boost=a.boost.p,
        G_boost=a.boost.conductance,
        p_relief=a.relief.p,
        G_relief=a.relief.conductance,
        dp_open=a.flushing.dp_open,
        dp_shuttle=a.flushing.dp_shuttle,
        G_flushing=a.flushing.conductance,
    )


def passive_circuit(crane: Crane, defect: Defect, drawn: Drawn, day: DrawnOfTest) -> Passive:
    """The circuit that carries the load, with gas at the vessels' temperature."""
    p = crane.passive
    assert p is not None
    gas, count = p.accumulator.gas, float(p.motor.count)
    V = gas.V_0 * drawn.gas
    mR = gas.p_0 * drawn.precharge * V / VESSEL
    c_v = HEAT_CAPACITY * mR
    motors = Motors(count, count - defect.dead, p.motor.D_max * day.passive_displacement)
    return Passive(
        motors=motors,
        D_pumps=p.pump.D_total,
        omega_p=p.pump.omega_p,
        p_lp=p.p_lp,
        mR=mR,
        c_v=c_v,
        hA=c_v / GAS_TAU,
        T_vessel=VESSEL,
        V=V,
        R=p.accumulator.R_piston * day.piston,
        F=day.piston_dry,
        leak=p.accumulator.C_leak,
    )


def winch_of(crane: Crane, test: SeaTest, defect: Defect, drawn: Drawn, day: DrawnOfTest) -> Winch:
    """The whole plant in a test."""
    loss, y, f, wire = crane.active.motor.loss, crane.friction.system, crane.friction, crane.wire
    drum, inertia, servo, pump = (
        drum_record(crane),
        inertia_record(crane),
        crane.active.motor.servo,
        crane.active.pump.servo,
    )
    assert servo.rate_max is not None
    assert pump.rate_max is not None
    m = test.load + crane.hook_mass
    EA = wire.E * wire.fill * math.pi / 4.0 * wire.d**2 * drawn.wire
    J_shaft, omega_m = (inertia.J_motor + inertia.J_gear) * drawn.inertia, servo.omega_n * day.motor_servo
    return Winch(
        Loss(loss.X_1, loss.X_2, loss.X_3, loss.X_4, loss.X_5),
        Friction(y.Y_1, y.Y_2, y.Y_3, y.Y_4, y.Y_5, y.Y_6, drawn.friction, f.sigma_0, f.sigma_1_ratio, f.omega_fade),
        active_circuit(crane, defect, drawn, day),
        passive_circuit(crane, defect, drawn, day),
        Servo(pump.omega_n * day.pump_servo, pump.zeta * day.pump_damping, pump.rate_max, -1.0, 1.0),
        Servo(omega_m, servo.zeta, servo.rate_max, 0.0, 1.0),
        Servo(omega_m, servo.zeta, math.inf, 0.0, 1.0),
        Drum(
            drum.d,
            drum.d_wire,
            drum.turns,
            drum.L_full,
            drum.m_wire,
            crane.i_hD * defect.gear,
            J_shaft,
            inertia.J_drum * drawn.inertia,
        ),
        Hoist(EA, wire.L_0, ZETA_WIRE, m, m * G, TAU_CELL, GAIN_CELL),
        Oil(OIL_SWING, 2.0 * math.pi / max(test.duration, SLOWEST_OIL)),
    )


def settings_of(crane: Crane, test: SeaTest, drawn: Drawn) -> Settings:
    """Numbers of the PLC: those of the healthy crane file; make-up holds the crane's own precharge. In the quick turns
    of the empty hook the brake stays open."""
    c, k, drum, a, p = crane.control, gains(crane), drum_record(crane), crane.active, crane.passive
    assert p is not None
    assert crane.brake is not None
    alpha_swl = c.alpha_ns if c.alpha_swl is None else c.alpha_swl
    return Settings(
        K_1=k.K_1,
        K_2=k.K_2,
        K_p=k.K_p,
        u_thr=c.u_thr,
        alpha_min=a.motor.alpha_min,
        alpha_ns=c.alpha_ns,
        alpha_swl=alpha_swl,
        F_swl=(crane.SWL + crane.hook_mass) * G,
        d_max=drum.d_max,
        d_outer=drum.d + (2.0 * drum.layers - 1.0) * drum.d_wire,
        i=crane.i_hD,
        tau_F=c.tau_F,
        tau_acc=c.tau_acc,
        p_set=p.accumulator.gas.p_0 * drawn.precharge,
        K_acc=c.K_acc,
        D_passive=p.motor.D_total,
        p_lp=p.p_lp,
        Q_passive=p.pump.D_total * p.pump.omega_p,
        brake=0.0 if test.kind == "dynamics" else 1.0,
        t_wait=crane.brake.t_wait,
        t_brake=crane.brake.t_close,
        cycle=CYCLE,
        steps=STEPS,
    )


def campaign_text(case: Case, crane_file: str) -> str:
    """The campaign file: the mapping of the columns, and the tests."""
    lines = [f'title = "independent crane, {case.name}"', f"date = {DATE}", f'crane = "{crane_file}"']
    lines += [f'delay = "{1e3 * STATED_DELAY:g} ms"']
    lines += ["", "[signals]", *(f'{c.signal} = {{ column = "{c.header}", unit = "{c.unit}" }}' for c in COLUMNS)]
    for test in TESTS:
        lines += ["", "[[test]]", f'name = "{test.name}"', f'log = "{test.name}.txt"', f'kind = "{test.kind}"']
        lines += [f'load = "{test.load / 1e3:g} t"']
    return "\n".join(lines) + "\n"


def write_campaign(folder: Path, case: Case) -> Path:
    """Simulate all tests of a case and write logs, crane file and campaign file into a folder; returns the campaign
    file."""
    folder.mkdir(parents=True, exist_ok=True)
    crane = load_crane(CRANE_FILE)
    drawn, days = draw_crane(case.seed, case.defect)
    head, forms = ";".join(c.header for c in COLUMNS), [c.form for c in COLUMNS]
    for k, (test, day) in enumerate(zip(TESTS, days, strict=True)):
        rng = np.random.default_rng([TEST_STREAM, case.seed, k])
        inputs = inputs_of(test, 1.0 / gains(crane).K_1, case.defect.delay, rng)
        log = Log(*(np.zeros(samples(test)) for _ in Log._fields))
        run(inputs, test.s_w, winch_of(crane, test, case.defect, drawn, day), settings_of(crane, test, drawn), log)
        rows = logged(log, inputs, test, case.defect.zero_a, rng)
        np.savetxt(folder / f"{test.name}.txt", rows, fmt=forms, delimiter=";", header=head, comments="")
    if case.file:
        (folder / "twin.toml").write_text(f'base = "{CRANE_FILE}"\n{case.file}', encoding="utf-8", newline="\n")
    file = folder / "campaign.toml"
    file.write_text(campaign_text(case, "twin.toml" if case.file else CRANE_FILE), encoding="utf-8", newline="\n")
    return file
