"""Defects between a crane and its twin, or in a log: a closed list, each with a size, to test whether validation
detects them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ValidateError
from stillhook.physics.load_path.drum import wire_to_layer
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.units import parse, quote, show
from stillhook.validate.synthetic.scatter import Setting


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
