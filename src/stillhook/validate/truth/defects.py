"""What can be wrong between a crane and its twin, or in a log: a closed list, each with a size, to see whether validation finds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

from stillhook.crane import Crane
from stillhook.engine.pack import drum_record
from stillhook.errors import ValidateError
from stillhook.physics.drum import wire_to_layer
from stillhook.physics.scalar import G
from stillhook.units import came
from stillhook.validate.truth.scatter import Setting


class Defect(StrEnum):
    """The crane, or its log, is not as the twin and the campaign file say."""

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


class Change(NamedTuple):
    """meaning of a defect with its size as {}; size by default; made: the setting with the defect of that size."""

    meaning: str
    size: float
    made: Callable[[Setting, Crane, float], Setting]


def _truth(name: str) -> Callable[[Setting, Crane, float], Setting]:
    """A number of the truth grows by a part of itself."""
    return lambda s, _, size: replace(s, truth=replace(s.truth, **{name: (1.0 + size) * getattr(s.truth, name)}))


def _layer(s: Setting, crane: Crane, size: float) -> Setting:
    drum = drum_record(crane)
    missing = wire_to_layer(drum.layers, drum) - wire_to_layer(drum.layers - size, drum)
    return replace(s, truth=replace(s.truth, wire_short=float(missing)))


def _set(name: str) -> Callable[[Setting, Crane, float], Setting]:
    return lambda s, _, size: replace(s, truth=replace(s.truth, **{name: size}))


DEFECTS: Mapping[Defect, Change] = {
    Defect.LEAKAGE: Change("active pumps and motors leak {:+.0%} against the twin's crane file", 0.5, _truth("leakage")),
    Defect.FRICTION: Change("friction of the whole winch {:+.0%} against the twin's", 0.4, _truth("friction")),
    Defect.LAYER: Change("the drum holds {:g} full layers of wire less than the twin's", 1.0, _layer),
    Defect.GEAR: Change("gear ratio motor to drum {:+.1%} against the twin's", 0.02, _truth("gear")),
    Defect.PRESSURE_LINES: Change(
        "the transmitters of lines A and B are swapped in the log",
        1.0,
        lambda s, _, size: replace(s, faults=replace(s.faults, swapped=size > 0.0)),
    ),
    Defect.MRU_DELAY: Change(
        "the motion unit is {:g} s later than the campaign states", 0.15, lambda s, _, size: replace(s, delay=s.stated_delay + size)
    ),
    Defect.MOTOR_OFFSET: Change("displacement of the active motors {:+.0%} of D_max above their command", 0.1, _set("motor_offset")),
    Defect.K_1: Change("speed feedforward of the PLC {:+.0%} against the twin's", -0.1, _truth("K_1")),
    Defect.CLOCK: Change(
        "the clock of the log runs {:+.2%} fast", 5e-3, lambda s, _, size: replace(s, clock=replace(s.clock, drift=s.clock.drift + size))
    ),
    Defect.SATURATION: Change("the PLC holds the pump command within {:.0%}, and the twin does not know", 0.7, _set("pump_limit")),
    Defect.GAP: Change(
        "the log of test 2 has a gap of {:g} s", 20.0, lambda s, _, size: replace(s, faults=replace(s.faults, gap=("2", 600.0, size)))
    ),
    Defect.LOAD_CELL: Change(
        "the load cell is logged in units of {:.4g} times the stated one",
        G,
        lambda s, _, size: replace(s, faults=replace(s.faults, cell_unit=size)),
    ),
}


def defect_of(text: Defect | str) -> Defect:
    """The defect of this name. Errors: ValidateError naming those there are."""
    try:
        return Defect(text)
    except ValueError:
        raise ValidateError(f"defect {came(text)}: not one of {', '.join(Defect)}.") from None


def with_defect(setting: Setting, crane: Crane, defect: Defect, size: float | None = None) -> Setting:
    """The setting with a defect of its default size, or of another one; nothing else changes."""
    change = DEFECTS[defect]
    return change.made(setting, crane, change.size if size is None else size)


def told(defect: Defect, size: float | None = None) -> str:
    """A defect in words, with its size."""
    change = DEFECTS[defect]
    return change.meaning.format(change.size if size is None else size)
