"""Defects between a crane and its twin, or in a log: a closed list, each with a size, to test whether validation
detects them.

Which truth a seed stands for: truth plant, sensors and clock, drawn within a believable scatter around the twin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ValidateError
from stillhook.logs.synthetic import Calibration, Clock
from stillhook.physics.load_path.drum import wire_to_layer
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.units import parse, quote, show
from stillhook.validate.synthetic.reference.crane import ReferenceCrane

STATED_DELAY = 0.04
"""Delay of the motion unit that a campaign states [s]."""
APART = (0.1, 0.3)
"""By how much C_h, leakage and inertia lie off where a truth is drawn apart from its twin."""
EVEN = {
    "capacitance": 0.03,
    "leakage": 0.05,
    "inertia": 0.03,
    "motor_omega": 0.06,
    "motor_zeta": 0.08,
    "pump_omega": 0.05,
    "pump_zeta": 0.06,
    "pump_speed": 0.003,
    "cell_gain": 0.004,
    "precharge": 0.01,
    "gas_volume": 0.05,
    "piston_oil": 0.3,
    "p_low": 0.05,
    "boost": 0.03,
}
"""Half width of the even distribution around 1 of factors over the twin's numbers (assumed: see `ReferenceCrane`)."""
FRICTION = 0.05
"""The same of the mean friction (assumed: what oil and wear change on a crane whose friction was identified)."""
MOTOR = 0.004
"""Standard deviation of one motor's displacement, part of nominal, and of three times that the most (assumed: sorted
units of one type)."""
RANGES = {
    "motor_hysteresis": (0.004, 0.015),
    "pump_late": (2e-3, 8e-3),
    "slip": (0.006, 0.012),
    "line_split": (0.35, 0.6),
    "line_omega": (120.0, 260.0),
    "line_drop": (0.8e5, 2.0e5),
    "tau_cell": (0.05, 0.15),
    "wire_zeta": (0.3, 0.6),
    "bristle": (0.5, 1.5),
    "friction_difference": (0.05, 0.12),
    "uneven": (-0.04, 0.04),
    "stribeck": (1.0, 2.0),
    "friction_lag": (0.01, 0.05),
    "oil_swing": (1.0, 4.0),
    "oil_phase": (0.0, 2.0 * np.pi),
    "gas_T": (283.0, 303.0),
    "gas_tau": (60.0, 300.0),
    "piston_dry": (1e5, 3e5),
    "p_low_rise": (0.0, 2e5),
    "leak_stroke": (0.05, 0.15),
    "leak_speed": (0.05, 0.15),
    "leak_edges": (0.0, 0.1),
    "leak_across": (0.6, 0.72),
    "p_case": (0.0, 2e5),
    "cell_zero": (-2e3, 2e3),
    "wire_beta": (10.0, 30.0),
    "wire_strands": (0.005, 0.02),
    "wire_pressed": (0.0, 0.015),
}
"""Ranges of the other numbers. The leak rises about as fast with stroke and speed as in published tables (0.11 and
0.10): a crane whose file is right leaks at the file's point, four times the stroke of these tests, what the file says,
to some 15 %."""
BITS = (12.0, 13.0, 14.0)
"""Resolutions of a PLC's outputs."""
CLOCK = 1e-4
"""Half width of the drift of the log's clock (assumed: a quartz, 100 parts in a million)."""
DRIFT, PERIODS = 0.3e5, (900.0, 3600.0)
"""Amplitude of the slow zero drift of a pressure transmitter [Pa], and between what periods it lies [s] (assumed: 0.1 %
of its range, as deck and oil warm up)."""
TRANSMITTERS = ("p_a", "p_b", "p_hp")
GAINS = {"p_a": 0.003, "p_b": 0.003, "p_hp": 0.003, "alpha_p": 0.003, "alpha_pm": 0.003}
"""Half width of the calibration error of a sensor, part of the reading (assumed: class of a transmitter)."""


@dataclass(frozen=True)
class LogFaults:
    """What the logger gets wrong: swapped 1 where the pressure lines are; gap of so many seconds in the middle of the
    longest log; cell_unit value of the unit that the load cell is really logged in over the one that is stated; zero_a
    what the transmitter of line A shows without pressure [Pa]."""

    swapped: float = 0.0
    gap: float = 0.0
    cell_unit: float = 1.0
    zero_a: float = 0.0


@dataclass(frozen=True)
class Drift:
    """Slow swing of a sensor's zero over the whole campaign: size [SI], period [s], phase [rad]."""

    size: float
    period: float
    phase: float

    def at(self, t: FloatArray) -> FloatArray:
        """What the sensor shows too much at times t (n,) since the campaign began [s]."""
        return np.asarray(self.size * np.sin(2.0 * np.pi * t / self.period + self.phase))


@dataclass(frozen=True)
class Setting:
    """Origin of a campaign's logs: reference crane; delay of the motion unit [s] and the one that the
    campaign states; clock, calibration, drift of zeros and faults of the logger."""

    reference: ReferenceCrane
    delay: float
    clock: Clock
    calibration: Mapping[str, Calibration] = field(default_factory=dict)
    drift: Mapping[str, Drift] = field(default_factory=dict)
    faults: LogFaults = LogFaults()
    stated_delay: float = STATED_DELAY


def setting(seed: int, *, apart: bool = False, motors: int = 5, passive_motors: int = 16) -> Setting:
    """The reference crane of a seed: every seed is another crane that its twin matches well. apart: C_h, leakage and
    inertia deviate by 10 to 30 %. motors, passive_motors: how many of them there are, each with a displacement of its
    own; on one shaft only their sum counts.
    """
    rng = np.random.default_rng([seed, 0])
    numbers = {name: 1.0 + half * rng.uniform(-1.0, 1.0) for name, half in EVEN.items()}
    numbers |= {name: rng.uniform(lo, hi) for name, (lo, hi) in RANGES.items()}
    numbers |= {name: rng.uniform(-1.0, 1.0) for name in ("shape_load", "shape_viscous")}
    numbers["shape_stribeck"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)
    numbers |= {
        "motor_D": _mean_of(motors, rng),
        "passive": _mean_of(passive_motors, rng),
        "dac_bits": rng.choice(BITS),
    }
    reference = ReferenceCrane(**{name: float(x) for name, x in numbers.items()})
    calibration = {name: Calibration(1.0 + half * float(rng.uniform(-1.0, 1.0))) for name, half in GAINS.items()}
    clock = Clock(drift=CLOCK * float(rng.uniform(-1.0, 1.0)), jitter=1e-3 * float(rng.uniform(0.5, 2.0)))
    delay = STATED_DELAY + 5e-3 * float(rng.uniform(-1.0, 1.0))
    reference = replace(reference, friction=1.0 + FRICTION * float(rng.uniform(-1.0, 1.0)))
    drift = {
        name: Drift(DRIFT, float(rng.uniform(*PERIODS)), float(rng.uniform(0.0, 2.0 * np.pi))) for name in TRANSMITTERS
    }
    if apart:
        reference = replace(reference, **{n: _apart(rng) for n in ("capacitance", "leakage", "inertia")})
    return Setting(reference, delay, clock, calibration, drift)


def _mean_of(motors: int, rng: np.random.Generator) -> float:
    """Mean displacement of so many motors over nominal."""
    return 1.0 + MOTOR * float(np.clip(rng.standard_normal(motors), -3.0, 3.0).mean())


def _apart(rng: np.random.Generator) -> float:
    off = float(rng.uniform(*APART))
    return 1.0 + off if rng.random() < 0.5 else 1.0 - off


class Defect(StrEnum):
    """The crane, or its log, differs from the twin and the campaign file."""

    LEAKAGE = "leakage"
    FRICTION = "friction"
    LAYER = "layer"
    GEAR = "gear"
    PRESSURE_LINES = "pressure-lines"
    MRU_DELAY = "mru-delay"
    MOTOR_OFFSET = "motor-offset"
    K_1 = "k-1"
    CLOCK = "clock"
    SATURATION = "saturation"
    GAP = "gap"
    LOAD_CELL = "load-cell"
    PRECHARGE = "precharge"
    GAS_VOLUME = "gas-volume"
    PASSIVE_MOTORS = "passive-motors"
    MOTOR_COUNT = "motor-count"
    ACTIVE_COUNT = "active-count"
    SENSOR_A = "sensor-a"
    LEAK_CONSTANT = "leak-constant"
    LEAK_STROKE = "leak-stroke"
    LEAK_SPEED = "leak-speed"
    DISPLACEMENT = "displacement"
    BOOST = "boost"


class Change(NamedTuple):
    """meaning of a defect with its size as {}; size by default, lo and hi what it may be; made: the setting with the
    defect of a size; ladder: increasing sizes at which the detection limit is tested; kind of quantity of the size
    ("": a pure number).
    """

    meaning: str
    size: float
    lo: float
    hi: float
    made: Callable[[Setting, Crane, float], Setting]
    ladder: tuple[float, ...]
    kind: str = ""


def _grown(name: str) -> Callable[[Setting, Crane, float], Setting]:
    """A parameter of the reference crane increases by a part of itself."""
    return lambda s, _, size: replace(
        s, reference=replace(s.reference, **{name: (1.0 + size) * getattr(s.reference, name)})
    )


def _set(name: str) -> Callable[[Setting, Crane, float], Setting]:
    """A parameter of the reference crane is the size of the defect."""
    return lambda s, _, size: replace(s, reference=replace(s.reference, **{name: size}))


def _layers_less(s: Setting, crane: Crane, size: float) -> Setting:
    drum = drum_record(crane)
    missing = wire_to_layer(drum.layers, drum) - wire_to_layer(drum.layers - size, drum)
    return replace(s, reference=replace(s.reference, wire_short=float(missing)))


def _later(s: Setting, _: Crane, size: float) -> Setting:
    return replace(s, delay=s.stated_delay + size)


def _faster(s: Setting, _: Crane, size: float) -> Setting:
    return replace(s, clock=replace(s.clock, drift=s.clock.drift + size))


def _fault(name: str) -> Callable[[Setting, Crane, float], Setting]:
    """A fault of the logger."""
    return lambda s, _, size: replace(s, faults=replace(s.faults, **{name: size}))


DEFECTS: Mapping[Defect, Change] = {
    Defect.LEAKAGE: Change(
        "active pumps and motors leak {:+.0%} against the twin's crane file",
        0.5,
        -0.9,
        4.0,
        _grown("leakage"),
        (0.1, 0.2, 0.3, 0.4, 0.5),
    ),
    Defect.FRICTION: Change(
        "friction of the whole winch {:+.0%} against the twin's",
        0.4,
        -0.9,
        1.0,
        _grown("friction"),
        (0.1, 0.2, 0.25, 0.3, 0.4),
    ),
    Defect.LAYER: Change(
        "the drum holds {:g} full layers of wire less than the twin's",
        1.0,
        0.0,
        2.0,
        _layers_less,
        (0.1, 0.25, 0.5, 1.0),
    ),
    Defect.GEAR: Change(
        "gear ratio motor to drum {:+.1%} against the twin's",
        0.02,
        -0.3,
        0.3,
        _grown("gear"),
        (0.005, 0.01, 0.015, 0.02),
    ),
    Defect.PRESSURE_LINES: Change(
        "the transmitters of lines A and B are swapped in the log", 1.0, 1.0, 1.0, _fault("swapped"), (1.0,)
    ),
    Defect.MRU_DELAY: Change(
        "the motion unit is {} later than the campaign states",
        0.15,
        0.0,
        2.0,
        _later,
        (0.02, 0.04, 0.06, 0.1, 0.15),
        "time",
    ),
    Defect.MOTOR_OFFSET: Change(
        "active motors stand {:+.0%} of D_max above their command",
        0.1,
        0.0,
        0.4,
        _set("motor_offset"),
        (0.01, 0.02, 0.05, 0.1),
    ),
    Defect.K_1: Change(
        "speed feedforward of the PLC {:+.0%} against the twin's",
        -0.1,
        -0.9,
        1.0,
        _grown("K_1"),
        (-0.01, -0.02, -0.03, -0.05, -0.1),
    ),
    Defect.CLOCK: Change(
        "the clock of the log runs {:+.2%} fast", 5e-3, -0.05, 0.05, _faster, (5e-4, 1e-3, 2e-3, 5e-3)
    ),
    Defect.SATURATION: Change(
        "the PLC holds the pump command within {:.0%}, unlike the twin",
        0.7,
        0.3,
        1.0,
        _set("pump_limit"),
        (0.95, 0.9, 0.8, 0.7),
    ),
    Defect.GAP: Change("the longest log has a gap of {}", 20.0, 0.0, 600.0, _fault("gap"), (0.1, 1.0, 20.0), "time"),
    Defect.LOAD_CELL: Change(
        "the load cell is logged in units of {:.4g} times the stated one",
        G,
        1e-6,
        1e6,
        _fault("cell_unit"),
        (1.02, 1.05, 1.1, G),
    ),
    Defect.PRECHARGE: Change(
        "pressure of the gas at mid stroke {:+.1%} against the twin's",
        -0.1,
        -0.5,
        0.3,
        _grown("precharge"),
        (-0.02, -0.04, -0.06, -0.1),
    ),
    Defect.GAS_VOLUME: Change(
        "volume of gas {:+.0%} against the twin's",
        -4.0 / 9.0,
        -0.7,
        4.0,
        _grown("gas_volume"),
        (-0.1, -0.2, -0.3, -4.0 / 9.0),
    ),
    Defect.PASSIVE_MOTORS: Change(
        "{:g} passive motors take no oil and give no torque",
        2.0,
        0.0,
        15.0,
        _set("passive_dead"),
        (1.0, 2.0, 3.0, 4.0),
    ),
    Defect.MOTOR_COUNT: Change(
        "the crane has {:+g} passive motors against its crane file",
        -2.0,
        -15.0,
        16.0,
        _set("passive_more"),
        (-1.0, -2.0, -3.0, 2.0),
    ),
    Defect.ACTIVE_COUNT: Change(
        "the crane has {:+g} active motors against its crane file",
        -1.0,
        -4.0,
        5.0,
        _set("active_more"),
        (-1.0, 1.0),
    ),
    Defect.SENSOR_A: Change(
        "the transmitter of line A shows {} too much",
        6e5,
        -50e5,
        50e5,
        _fault("zero_a"),
        (1e5, 2e5, 3e5, 4e5, 6e5),
        "pressure",
    ),
    Defect.LEAK_CONSTANT: Change(
        "{:.0%} of the leak that the crane file states is there at any stroke and speed",
        1.0,
        0.0,
        1.0,
        _set("all_constant"),
        (0.5, 1.0),
    ),
    Defect.LEAK_STROKE: Change(
        "{:.0%} of the leak that the crane file states goes with the pumps' stroke",
        1.0,
        0.0,
        1.0,
        _set("all_stroke"),
        (0.25, 0.5, 0.75, 1.0),
    ),
    Defect.LEAK_SPEED: Change(
        "{:.0%} of the leak that the crane file states goes with the motors' speed",
        1.0,
        0.0,
        1.0,
        _set("all_speed"),
        (0.25, 0.5, 0.75, 1.0),
    ),
    Defect.DISPLACEMENT: Change(
        "displacement of the active motors {:+.1%} against the twin's",
        0.05,
        -0.3,
        0.3,
        _grown("motor_D"),
        (0.01, 0.02, 0.03, 0.05),
    ),
    Defect.BOOST: Change(
        "boost pressure {:+.0%} against the twin's", -0.2, -0.9, 1.0, _grown("boost"), (-0.05, -0.1, -0.2, -0.4)
    ),
}
"""Sizes of the ladders end at, or hold, the default; signs are those that the issue of a defect most often has."""


def defect_of(text: Defect | str) -> Defect:
    """The defect of this name. Errors: ValidateError naming those there are."""
    try:
        return Defect(text)
    except ValueError:
        raise ValidateError(f"Unknown defect {quote(text)}. Choose one of {', '.join(Defect)}.") from None


def size_of(defect: Defect, text: str, where: str = "size") -> float:
    """The size of a defect as text, with its unit where it is a quantity. Errors: UnitError, ValidateError."""
    if kind := DEFECTS[defect].kind:
        return parse(text, kind, where)
    try:
        return float(text)
    except ValueError:
        raise ValidateError(
            f"{where} = {quote(text)}: the defect {defect} needs a plain number, such as {DEFECTS[defect].size:g}."
        ) from None


def with_defect(setting: Setting, crane: Crane, defect: Defect, size: float | None = None) -> Setting:
    """The setting with a defect of its default size, or of another one; nothing else changes. Errors: ValidateError."""
    change = DEFECTS[defect]
    value = change.size if size is None else size
    if not change.lo <= value <= change.hi:
        raise ValidateError(
            f"size = {quote(size)}: the defect {defect} allows {change.lo:g} to {change.hi:g}. Choose a size in this"
            " range."
        )
    return change.made(setting, crane, value)


def defect_text(defect: Defect, size: float | None = None) -> str:
    """A defect in words, with its size."""
    return DEFECTS[defect].meaning.format(size_text(defect, size) if DEFECTS[defect].kind else _size(defect, size))


def size_text(defect: Defect, size: float | None = None) -> str:
    """The size of a defect with its unit, as `--size` reads it."""
    kind, value = DEFECTS[defect].kind, _size(defect, size)
    return show(value, kind) if kind else f"{value:.4g}"


def _size(defect: Defect, size: float | None) -> float:
    return DEFECTS[defect].size if size is None else size
