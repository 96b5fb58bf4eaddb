"""Defects between a crane and its twin, or in a log: a closed list, each with a size, to test whether validation
detects them.

The reference crane of a seed with its sensors and clock, drawn within a believable scatter around the twin.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ValidateError
from stillhook.physics.load_path.drum import wire_to_layer
from stillhook.spec.crane import Crane
from stillhook.units import parse, quote, show
from trials.campaigns.plc_log import Calibration, Clock
from trials.reference_plant.parameters import PARAMETERS, ReferenceCrane

STATED_DELAY = 0.04
"""Delay of the motion unit that a campaign states [s]."""
APART = (0.1, 0.3)
"""Deviation of C_h, leakage and inertia where a reference crane is drawn apart from its twin."""
FRICTION = 0.05
"""Half width of the even distribution around 1 of the mean friction (assumed: what oil and wear change on a crane whose
friction was identified)."""
MOTOR = 0.004
"""Standard deviation of one motor's displacement, part of nominal, and of three times that the most (assumed: sorted
units of one type)."""
BITS = (12.0, 13.0, 14.0)
"""Resolutions of a PLC's outputs."""
CLOCK = 1e-4
"""Half width of the drift of the log's clock (assumed: a quartz, 100 parts in a million)."""
DRIFT, PERIODS = 0.3e5, (900.0, 3600.0)
"""Amplitude of the slow zero drift of a pressure transmitter [Pa], and the range of its periods [s] (assumed: 0.1 %
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
    """Slow swing of a sensor's zero over the campaign: size [SI], period [s], phase [rad]."""

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
    numbers = {n: 1.0 + row["even"] * rng.uniform(-1.0, 1.0) for n, row in PARAMETERS.items() if "even" in row}
    numbers |= {n: rng.uniform(*row["range"]) for n, row in PARAMETERS.items() if "range" in row}
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


@dataclass(frozen=True)
class Change:
    """meaning of a defect with its size as {}; size by default; allowed: least and most size; ladder: increasing sizes
    at which the detection limit is tested; kind of quantity of the size ("": a pure number). grows, sets: parameter of
    the reference crane that increases by a part of itself, or is the size; fault: field of `LogFaults` that is the
    size; none of them for a defect that `with_defect` applies itself.
    """

    meaning: str
    size: float
    allowed: Sequence[float]
    ladder: Sequence[float]
    kind: str = ""
    grows: str = ""
    sets: str = ""
    fault: str = ""


_TABLE = tomllib.loads(Path(__file__).with_name("defects.toml").read_text(encoding="utf-8"))
DEFECTS: Mapping[Defect, Change] = {defect: Change(**_TABLE[defect]) for defect in Defect}


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
    change, reference = DEFECTS[defect], setting.reference
    value, (least, most) = _size(defect, size), change.allowed
    if not least <= value <= most:
        raise ValidateError(
            f"size = {quote(size)}: the defect {defect} allows {least:g} to {most:g}. Choose a size in this range."
        )
    if change.fault:
        return replace(setting, faults=replace(setting.faults, **{change.fault: value}))
    if defect is Defect.MRU_DELAY:
        return replace(setting, delay=setting.stated_delay + value)
    if defect is Defect.CLOCK:
        return replace(setting, clock=replace(setting.clock, drift=setting.clock.drift + value))
    if defect is Defect.LAYER:
        drum = drum_record(crane)
        missing = wire_to_layer(drum.layers, drum) - wire_to_layer(drum.layers - value, drum)
        changed = {"wire_short": float(missing)}
    elif change.grows:
        changed = {change.grows: (1.0 + value) * getattr(reference, change.grows)}
    else:
        changed = {change.sets: value}
    return replace(setting, reference=replace(reference, **changed))


def defect_text(defect: Defect, size: float | None = None) -> str:
    """A defect in words, with its size."""
    return DEFECTS[defect].meaning.format(size_text(defect, size) if DEFECTS[defect].kind else _size(defect, size))


def size_text(defect: Defect, size: float | None = None) -> str:
    """The size of a defect with its unit, as `--size` reads it."""
    kind, value = DEFECTS[defect].kind, _size(defect, size)
    return show(value, kind) if kind else f"{value:.4g}"


def _size(defect: Defect, size: float | None) -> float:
    return DEFECTS[defect].size if size is None else size
