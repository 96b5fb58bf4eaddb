"""Faults of crane, sensors, PLC and log, one at a time, on a crane, sea and sensors that a seed draws."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import stillhook
from stillhook.engine.pack.winch import gains
from stillhook.library import load_crane
from stillhook.live.watch.replay import Stretch, scenario_of
from trials.adaptation.crane import (
    CELL_GAIN,
    CELL_ZERO,
    CLOCK,
    COLD,
    CRANE_FILE,
    DISPLACEMENT,
    SETTLED,
    TAU,
    WARMING,
    logged,
    parameters_of,
    truth_of,
)
from trials.adaptation.plant import FILE_FORM, OTHER_FORM, Drift, Faults, Log, run
from trials.independent_crane import crane as base
from trials.independent_crane.plant import PRESSURE_OF_SLIP, Winch
from trials.independent_crane.plc import NS, SSC
from trials.independent_crane.sea_trial import BAR, CYCLE, STATED_DELAY, SeaTest, Wave, inputs_of, samples

FloatArray = NDArray[np.float64]
Rows = dict[str, FloatArray]
STREAM = 5203
DURATION = 400.0
"""Length of a run [s]: the twin settles, and one window of 5 min."""
EVERY = 0.1
"""Time between rows [s], as a log is read."""
NOTHING_STEPS = Faults(leak_at=math.inf, leak=1.0, gas_at=math.inf, gas=0.0, pumps_at=math.inf, pumps=1.0)


class Fault(NamedTuple):
    """cause: what must be named, "" for none; text for the page; defect of the crane; friction: factor on system
    friction; form of its law; gas: factors on gas volume and on its charge, which the PLC's set value does not follow;
    drawn, day: factors on what a seed draws of the crane; motors: factor on the motors' loss; boost: pressure more than
    the file's [Pa]; plc: factors on the PLC's settings; rows: what the log makes of its rows; load: stated over true;
    height: of the sea, over what was drawn; other_mode: the log states another."""

    cause: str
    text: str
    defect: Mapping[str, Any] = {}
    friction: float = 1.0
    form: float = FILE_FORM
    gas: tuple[float, float] = (1.0, 1.0)
    drawn: Mapping[str, float] = {}
    day: Mapping[str, float] = {}
    motors: float = 1.0
    boost: float = 0.0
    plc: Mapping[str, float] = {}
    rows: Callable[[Rows], Rows] = dict
    load: float = 1.0
    height: float = 1.0
    other_mode: bool = False


def scaled(name: str, gain: float = 1.0, zero: float = 0.0) -> Callable[[Rows], Rows]:
    """A signal that reads wrong."""
    return lambda x: {**x, name: gain * x[name] + zero}


def late(names: tuple[str, ...], by: float) -> Callable[[Rows], Rows]:
    """Signals that are late [s]."""
    return lambda x: {**x, **{name: np.interp(x["time"] - by, x["time"], x[name]) for name in names}}


def frozen(names: tuple[str, ...], since: float) -> Callable[[Rows], Rows]:
    """Signals that stand from a time on [s]."""
    return lambda x: {
        **x,
        **{
            name: np.where(x["time"] < since, x[name], x[name][round(since / CYCLE)] * (name == "s_tip"))
            for name in names
        },
    }


TIP = ("s_tip", "v_tip", "a_tip")
FAULTS: Mapping[str, Fault] = {
    "none": Fault("", "nothing wrong"),
    "other-law": Fault("", "friction law of another form", form=OTHER_FORM),
    "wire": Fault("", "wire 30 % softer", {"wire": 0.7}),
    "inertia": Fault("", "inertia +30 %", drawn={"inertia": 1.3}),
    "oil": Fault("", "lines 40 % softer (air in the oil)", drawn={"capacitance": 1.4}),
    "motor-servo": Fault("", "control of the motors half as fast", day={"motor_servo": 0.5}),
    "pump-servo": Fault("", "control of the pumps 0.6 times as fast", day={"pump_servo": 0.6}),
    "motor-loss": Fault("friction grown or fallen", "loss of all motors ×2", motors=2.0),
    "boost": Fault("boost pressure", "boost pressure +8 bar", boost=8.0 * BAR),
    "friction": Fault("friction grown or fallen", "system friction ×1.8", friction=1.8),
    "leakage": Fault("leakage of the active circuit", "leakage of the active circuit ×2.5", {"leakage": 2.5}),
    "displacement": Fault(
        "displacement of the active motors", "active motors −8 % of displacement", {"displacement": 0.92}
    ),
    "gas-lost": Fault("gas charge or volume", "gas charge −20 %, make-up holds the pressure", gas=(1.0, 0.8)),
    "gas-volume": Fault("gas charge or volume", "gas vessels shut: −50 % of gas volume", gas=(0.5, 1.0)),
    "dead-motors": Fault("passive motors without pressure", "2 of 16 passive motors dead", {"dead": 2}),
    "load": Fault("load other than stated", "load 12 % more than stated", load=1.0 / 1.12),
    "cell": Fault("reading of the load cell", "load cell reads 8 % too much in the log", rows=scaled("F_w", 1.08)),
    "p_a": Fault("reading of p_a", "transmitter p_a +8 bar", rows=scaled("p_a", zero=8.0 * BAR)),
    "p_b": Fault("reading of p_b", "transmitter p_b −8 bar", rows=scaled("p_b", zero=-8.0 * BAR)),
    "p_hp": Fault("reading of p_hp", "transmitter p_hp reads 8 % too much", rows=scaled("p_hp", 1.08)),
    "alpha_m": Fault(
        "reading of alpha_m, or offset of the motors' control",
        "reading of alpha_m −6 % of full",
        rows=scaled("alpha_m", zero=-0.06),
    ),
    "alpha_p": Fault(
        "reading of alpha_p, or control of the pumps", "reading of alpha_p 6 % too much", rows=scaled("alpha_p", 1.06)
    ),
    "omega_m": Fault("encoder of the motors", "encoder of the motors 4 % too fast", rows=scaled("omega_m", 1.04)),
    "s_w": Fault(
        "wire counter, or wire layer",
        "wire counter 4 % off",
        rows=lambda x: {**x, "s_w": x["s_w"][0] + 1.04 * (x["s_w"] - x["s_w"][0])},
    ),
    "clock": Fault("clock of the encoder", "encoder 250 ms late from 150 s on", rows=lambda x: _jump(x, 0.25, 150.0)),
    "tip-late": Fault(
        "tip motion delayed against the log", "tip in the log 150 ms later than the PLC's", rows=late(TIP, 0.15)
    ),
    "tip-stale": Fault("tip motion stale", "tip in the log is frozen from 150 s on", rows=frozen(TIP, 150.0)),
    "gain": Fault("gain of the PLC's feedforward", "K_1 of the PLC +8 %", plc={"K_1": 1.08}),
    "mode": Fault(
        "mode or controller other than the twin's",
        "log states NS where the PLC runs SSC, or the reverse",
        other_mode=True,
    ),
    "limit": Fault("", "sea 2.3 times as high: pumps at their end, in the twin too", height=2.3),
}


def _jump(x: Rows, by: float, since: float) -> Rows:
    moved = np.where(x["time"] < since, x["time"], x["time"] - by)
    return {**x, **{name: np.interp(moved, x["time"], x[name]) for name in ("omega_m", "s_w")}}


class Logs(NamedTuple):
    """Rows of crane and twin, side by side (n,), true values of virtual sensors, and what was drawn."""

    crane: Rows
    twin: Rows
    truth: Rows
    clock: float
    conditions: dict[str, float]


class Errors:
    """What `logged` draws: limits of error and drift of one crane's sensors, and the noise of one repeat."""

    def __init__(self, seed: int, repeat: int) -> None:
        self.uniform = np.random.default_rng([STREAM, seed, 1]).uniform
        self.normal = np.random.default_rng([STREAM, seed, 2, repeat]).normal


def logs_of(fault: Fault, seed: int, repeat: int = 0, duration: float = DURATION, *, perfect: bool = False) -> Logs:
    """The crane's log with a fault, and the twin driven by it. A repeat has another sea of the same height and period
    and other noise, with the same crane, sensors and drift. perfect: the log of sensors and a clock without error."""
    rng = np.random.default_rng([STREAM, seed])
    crane = load_crane(CRANE_FILE)
    wave = Wave(rng.uniform(1.3, 2.4) * fault.height, rng.uniform(8.0, 12.0), SETTLED)
    load, s_w, mode = 1e3 * rng.uniform(40.0, 160.0), rng.uniform(300.0, 2300.0), float(rng.choice([NS, SSC]))
    test = SeaTest("watch", "ahc", load, s_w, duration, mode, wave)
    factor = 1.0 + DISPLACEMENT * rng.uniform(-1.0, 1.0)
    defect = base.Defect(**{"displacement": factor, "friction": 1.0, **fault.defect})
    drawn, days = base.draw_crane(seed, defect)
    day = days[0]._replace(passive_displacement=1.0 + DISPLACEMENT * rng.uniform(-1.0, 1.0))
    settings = base.settings_of(crane, test, drawn)._replace(brake=0.0)
    settings = settings._replace(**{name: x * getattr(settings, name) for name, x in fault.plc.items()})
    drawn = drawn._replace(**{name: x * getattr(drawn, name) for name, x in fault.drawn.items()})
    day = day._replace(**{name: x * getattr(day, name) for name, x in fault.day.items()})
    drawn = drawn._replace(gas=drawn.gas * fault.gas[0], precharge=drawn.precharge * fault.gas[1])
    winch = base.winch_of(crane, test, defect, drawn, day)
    winch = winch._replace(hoist=winch.hoist._replace(gain_cell=1.0 + CELL_GAIN * rng.uniform(-1.0, 1.0)))
    winch = winch._replace(active=winch.active._replace(p_boost=winch.active.p_boost + fault.boost))
    scale = rng.uniform(0.85, 1.15) * fault.friction
    drift = Drift(scale, scale, 0, fault.motors, fault.form, rng.uniform(*COLD), rng.uniform(*WARMING), TAU)
    inputs = inputs_of(test, 1.0 / gains(crane).K_1, STATED_DELAY, np.random.default_rng([STREAM, seed, 3, repeat]))
    log = Log(*(np.zeros(samples(test)) for _ in Log._fields))
    run(inputs, s_w, CELL_ZERO * rng.uniform(-1.0, 1.0), winch, drift, NOTHING_STEPS, settings, log)
    clock = CLOCK * rng.uniform(-1.0, 1.0)
    rows = fault.rows(logged(log, inputs, clock, Errors(seed, repeat)))  # type: ignore[arg-type]
    if perfect:
        rows, clock = rows | {name: x for name, x in truth_of(log).items() if name in rows}, 0.0
    if fault.other_mode:
        rows["mode"] = np.full_like(rows["mode"], NS if mode == SSC else SSC)
    conditions = {"load": load, "s_w": s_w, "mode": mode, "height": wave.height, "period": wave.period}
    crane_rows, twin_rows = beside(rows, load * fault.load, crane)
    truth = {name: x[:: round(EVERY / CYCLE)] for name, x in of_virtual_sensors(log, crane, winch).items()}
    return Logs(crane_rows, twin_rows, truth, clock, conditions)


def of_virtual_sensors(log: Log, crane: stillhook.Crane, winch: Winch) -> Rows:
    """What the virtual sensors of the twin stand for, in the crane itself."""
    act, pas, dp = winch.active, winch.passive, log.p_a - log.p_b
    pumps = act.D_pumps * act.omega_p * log.alpha_p * (1.0 - act.slip * log.alpha_p * dp / PRESSURE_OF_SLIP)
    leakage = parameters_of(log, {"alpha_m": log.alpha_m}, crane, winch, NOTHING_STEPS)["leak"]
    return {
        "F_hook": log.F_true,
        "T_f": log.T_loss,
        "Q_m": act.motors.working * act.motors.D * log.alpha_m * log.omega,
        "Q_pm": pas.motors.working * pas.motors.D * log.alpha_pm * log.omega,
        "Q_leak": np.abs(leakage),
        "V_gas": log.V_gas,
        "T_gas": log.p_gas * log.V_gas / pas.mR,
        "P_p": pumps * dp,
    }


def beside(rows: Rows, load: float, crane: stillhook.Crane, every: float = EVERY) -> tuple[Rows, Rows]:
    """Rows every so many seconds, and the twin's at the same moments."""
    step = round(every / CYCLE)
    signals = {name: x[::step] for name, x in rows.items() if name != "time"}
    t = np.arange(len(signals["s_tip"])) * every
    base_case = stillhook.Scenario(load=f"{load!r} kg", s_w="100 m", tip="still", mode="ssc")
    case = scenario_of(Stretch(t, 0.0, signals, every), base_case, "trial")
    result = stillhook.simulate(crane, case, every=f"{every!r} s")
    n = min(len(t), result.sizes["time"])
    twin = {name: result[name].values[:n] for name in result.data_vars if result[name].dims == ("time",)}
    return {name: x[:n] for name, x in signals.items()}, {"time": t[:n], **twin}
