"""Text with a unit to SI floats and back, on a closed table.

A quantity enters Stillhook as text, ``"215 cm^3/rev"``, and is a float in SI from then on. Three rules keep it safe:

1. The number is strict: optional sign, digits, point, exponent. No comma, no expression, no nan.
2. The unit is one of the few listed for its kind in ``KINDS``. Nothing is guessed: ``cm^3`` never passes for
   ``cm^3/rev``.
3. Factors come from a table of definitions, in which angle is a dimension and ``rev = 2*pi rad``.
"""

from __future__ import annotations

import functools
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from stillhook.errors import UnitError, printed

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

__all__ = [
    "KINDS",
    "Kind",
    "Quantity",
    "exact",
    "from_display",
    "in_display",
    "in_unit",
    "parse",
    "parse_ratio",
    "quote",
    "show",
]

LONGEST_TEXT = 100  # characters; a longer text is no quantity
LARGEST = 1e30  # in SI; far above everything measured, far below where squares and products overflow


@dataclass(frozen=True, slots=True)
class Kind:
    """What a number measures: its SI unit, the unit it prints in, and every unit it may be written in."""

    si: str
    display: str
    allowed: tuple[str, ...]


def _kinds() -> dict[str, Kind]:
    """The rows of `units.toml`: SI unit, display unit, others."""
    rows = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {name: Kind(row[0], row[1], tuple(dict.fromkeys(row))) for name, row in rows.items()}


KINDS: Mapping[str, Kind] = MappingProxyType(_kinds())

BASE = ("m", "kg", "s", "K", "rad", "A")
"""Units of the dimensions. Angle is one of them."""
_LINES = (
    *("mm = 1e-3 m", "cm = 1e-2 m", "km = 1e3 m", "L = 1e-3 m^3", "cc = 1e-6 m^3", "t = 1e3 kg", "te = 1e3 kg"),
    *("ms = 1e-3 s", "min = 60 s", "h = 3600 s", "d = 86400 s", "kn = 1852 m/h"),
    *(f"rev = {2 * math.pi!r} rad", f"deg = {math.pi / 180!r} rad", "Hz = rev/s", "rpm = rev/min"),
    *("N = kg m/s^2", "kN = 1e3 N", "MN = 1e6 N"),
    *("Pa = N/m^2", "kPa = 1e3 Pa", "MPa = 1e6 Pa", "GPa = 1e9 Pa", "bar = 1e5 Pa"),
    *("J = N m", "kJ = 1e3 J", "MJ = 1e6 J", "W = J/s", "kW = 1e3 W", "MW = 1e6 W", "kWh = 3.6e6 J"),
    *("kA = 1e3 A", "V = W/A", "kV = 1e3 V", "ohm = V/A", "mohm = 1e-3 ohm", "F = A s/V"),
    "degC = K",
)
_DEFINITIONS = {line.partition(" = ")[0]: line.partition(" = ")[2] for line in _LINES}
_ZERO = {"degC": 273.15}
"""Zero of a scale, in its SI unit."""
_WORD = re.compile(r"[A-Za-z]+|[0-9.]+(?:e-?[0-9]+)?|\^[0-9]+|[/()]")


def _product(words: list[str]) -> tuple[float, dict[str, int]]:
    """Number, and exponents of the units, of a product such as ``m^3/s/Pa/(rad/s)``: words are taken from the front up
    to a closing bracket. A stroke divides by the one factor that follows it."""
    value, exponents, sign = 1.0, dict[str, int](), 1
    while words and (word := words.pop(0)) != ")":
        if word == "/":
            sign = -1
            continue
        if word == "(":
            number, factors = _product(words)
        else:
            number, factors = (1.0, {word: 1}) if word[0].isalpha() else (float(word), {})
        power = sign * (int(words.pop(0)[1:]) if words and words[0][0] == "^" else 1)
        value *= number**power
        for unit, exponent in factors.items():
            exponents[unit] = exponents.get(unit, 0) + power * exponent
        sign = 1
    return value, {unit: exponent for unit, exponent in exponents.items() if exponent}


def _factors(exponents: Mapping[str, int]) -> Iterator[tuple[float, int, str]]:
    """Factors of a product of units, down to the base units: number, exponent, base unit. Errors: UnitError for a unit
    without a definition."""
    for unit, power in exponents.items():
        if unit in BASE:
            yield 1.0, power, unit
        elif unit in _DEFINITIONS:
            number, units = _product(_WORD.findall(_DEFINITIONS[unit]))
            yield number, power, ""
            yield from _factors({name: power * exponent for name, exponent in units.items()})
        else:
            raise UnitError(f'Unknown unit "{unit}": it is not one of {", ".join((*BASE, *_DEFINITIONS))}.')


@functools.cache
def _scale(unit: str, si: str) -> tuple[float, float]:
    """Factor and offset with value_si = factor*value + offset. The offset is 0 for all but temperatures. Errors:
    UnitError where the two do not measure the same."""
    factor, dimension = 1.0, dict.fromkeys(("", *BASE), 0)
    for number, power, base in _factors(_product(_WORD.findall(f"({unit})/({si})"))[1]):
        factor *= number**power
        dimension[base] += power if base else 0
    if any(dimension.values()):
        raise UnitError(f'"{unit}" does not measure what "{si}" does.')
    return factor, _ZERO.get(unit, 0.0)


def _kind_entry(name: str) -> Kind:
    if name not in KINDS:
        raise UnitError(f'Unknown kind "{name}": it is not one of {", ".join(KINDS)}.')
    return KINDS[name]


def text_at(data: Any, loc: Sequence[int | str], otherwise: Any) -> Any:
    """What was written at a place of nested tables and lists: "-80 L", where a validator reports the -0.08 that it was
    read as."""
    for part in loc:
        if isinstance(data, str):  # one text in place of a list
            return otherwise
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return otherwise
    return data


def quote(value: object) -> str:
    """What the user gave, quoted on one line: texts in double quotes, long ones cut, control characters escaped."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        cut = value if len(value) <= LONGEST_TEXT else value[: LONGEST_TEXT - 3] + "..."
        return f'"{printed(cut)}"'
    try:
        text = "".join(c if c.isprintable() else " " for c in repr(value))
    except Exception:  # of a number with thousands of digits, of lists in lists without end, of anybody's own
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 3] + "..."


_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER})[ \t]+(\S.*)")
_BARE = re.compile(_NUMBER)
_GLUED = re.compile(rf"({_NUMBER})([^\s0-9.].*)")
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(\s.*)?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf(inity)?)\b.*", re.IGNORECASE)


def _tidy(unit: str) -> str:
    return re.sub(r"\s*([/()^])\s*", r"\1", " ".join(unit.split()))


def _problem(text: object, kind: Kind) -> str:
    """Why ``text`` is not a quantity of this kind, and what to write instead."""
    units = ", ".join(kind.allowed)
    if isinstance(text, float) and not math.isfinite(text):
        return f'not a finite number; write one as text with its unit, such as "1 {kind.display}".'
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        return f'a bare number; write it as text with its unit, "{text!s} {kind.display}" (allowed: {units}).'
    if not isinstance(text, str):
        return f'write a number and a unit as text, such as "1 {kind.display}" (allowed: {units}).'
    text = text.strip()
    if len(text) > LONGEST_TEXT:
        return f'too long for a number and a unit, such as "1 {kind.display}" (allowed: {units}).'
    if not text:
        return f'empty; write a number and a unit, such as "1 {kind.display}" (allowed: {units}).'
    if _BARE.fullmatch(text):
        return f'no unit; write "{text} {kind.display}" (allowed: {units}).'
    if _COMMA.fullmatch(text):
        return f'a comma in the number; write a point, "{text.replace(",", ".", 1)}".'
    if _NOT_FINITE.fullmatch(text):
        return f'not a finite number; write one with a unit, such as "1 {kind.display}".'
    glued = _GLUED.fullmatch(text)
    if glued and _tidy(glued[2]) in kind.allowed:
        return f'no space before the unit; write "{glued[1]} {_tidy(glued[2])}".'
    return f'not a number, a space and a unit, such as "1 {kind.display}" (allowed: {units}).'


def _read(text: object, kind: str) -> float:
    """The SI value of ``text``; ValueError with the problem alone, for callers that know the place."""
    entry = _kind_entry(kind)
    match = _QUANTITY.fullmatch(text.strip()) if isinstance(text, str) and len(text) <= LONGEST_TEXT else None
    if match is None:
        raise ValueError(_problem(text, entry))
    unit = _tidy(match[2])
    if unit not in entry.allowed:
        raise ValueError(f"unit {quote(match[2])} is not one of {', '.join(entry.allowed)}.")
    factor, offset = _scale(unit, entry.si)
    value = float(match[1]) * factor + offset
    if abs(value) > LARGEST:
        raise ValueError(f'too large a number; write one with a unit, such as "1 {entry.display}".')
    return value


def parse(text: object, kind: str, where: str = "") -> float:
    """The SI value of a text such as ``"215 cm^3/rev"``.

    Parameters: text number, space, unit; kind one of ``KINDS``; where the file and field, put first in the error.
    Errors: UnitError of one line that names where, what came and the allowed units.
    Negative values pass here; whether they make sense is for the field to say.
    """
    try:
        return _read(text, kind)
    except ValueError as problem:
        place = f"{where} = " if where else ""
        raise UnitError(f"{place}{quote(text)}: {problem}") from None


_RATIO = re.compile(rf"(?:i\s*=\s*)?({_NUMBER})(?:\s*:\s*1)?")


def parse_ratio(value: object, where: str = "") -> float:
    """A gear ratio, turns of the motor for one of the drum, as data sheets print it: 35.4, "35.4", "35.4:1", "i =
    35.4".

    Errors: UnitError of one line; "1:35.4" is refused, as it may mean either.
    """
    try:
        return _read_ratio(value)
    except ValueError as problem:
        place = f"{where} = " if where else ""
        raise UnitError(f"{place}{quote(value)}: {problem}") from None


def _read_ratio(value: object) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise ValueError("too large a number for a gear ratio.") from None
    match = _RATIO.fullmatch(value.strip()) if isinstance(value, str) and len(value) <= LONGEST_TEXT else None
    if match is None:
        raise ValueError('not a gear ratio; write the turns of the motor for one turn of the drum, 35.4 or "35.4:1".')
    return float(match[1])


def in_display(value: float, kind: str) -> float:
    """An SI value in the unit that its kind prints in (m^3/rad to cm^3/rev)."""
    return in_unit(value, _kind_entry(kind).display, kind)


def in_unit(value: float, unit: str, kind: str) -> float:
    """An SI value in one of the units of its kind (0.05 m to 5 cm). Errors: UnitError where the unit is not one of
    them."""
    entry = _kind_entry(kind)
    if unit not in entry.allowed:
        raise UnitError(f"unit {quote(unit)} is not one of {', '.join(entry.allowed)}.")
    factor, offset = _scale(unit, entry.si)
    return (value - offset) / factor


def bound(value: float, kind: str, written: object) -> str:
    """A bound in SI as text in the unit of what was written, else in its display unit: 5 m/s as "300 m/min" to "400
    m/min"."""
    match = _QUANTITY.fullmatch(written.strip()) if isinstance(written, str) else None
    unit = (
        _tidy(match[2])
        if match is not None and _tidy(match[2]) in _kind_entry(kind).allowed
        else _kind_entry(kind).display
    )
    return f"{number(in_unit(value, unit, kind))} {unit}"


def from_display(value: float, kind: str) -> float:
    """The SI value of a number given in the unit that its kind prints in; the inverse of ``in_display``."""
    entry = _kind_entry(kind)
    factor, offset = _scale(entry.display, entry.si)
    return value * factor + offset


def show(value: float, kind: str, digits: int = 4) -> str:
    """An SI value as text in its display unit with ``digits`` significant digits: ``"215 cm^3/rev"``."""
    return f"{number(in_display(value, kind), digits)} {_kind_entry(kind).display}"


EXACT_DIGITS = 12
"""Significant digits that are tried in display units before SI with all digits."""


def exact(value: float, kind: str) -> str:
    """An SI value as text that `parse` reads as the same number: in its display unit where that loses nothing, else in
    SI with all digits."""
    text = show(value, kind, EXACT_DIGITS)
    return text if parse(text, kind) == value else f"{float(value)!r} {_kind_entry(kind).si}"


def number(value: float, digits: int = 4) -> str:
    """A number with ``digits`` significant digits, without an exponent from 1e-4 up to 1e9."""
    if not math.isfinite(value):
        return str(value)
    rounded = float(f"{value:.{digits - 1}e}")
    if rounded == 0.0:
        return "0"
    if 1e-4 <= abs(rounded) < 1e9:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(rounded))))
        text = f"{rounded:.{decimals}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{rounded:.{digits}g}"


@dataclass(frozen=True, slots=True)
class Quantity:
    """Marks a pydantic field as a quantity: text with a unit in, SI float inside. Bare numbers are refused."""

    kind: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read the text before the float is validated, so that ``Field(gt=0)`` checks the SI value."""
        from pydantic_core import core_schema  # here, not above: units alone must not load pydantic

        return core_schema.no_info_before_validator_function(_reader(self.kind), handler(source))


_STORED: ContextVar[bool] = ContextVar("stored", default=False)


@contextmanager
def stored_numbers() -> Iterator[None]:
    """Inside, the quantities of models are not texts with units but finite numbers in SI, as a result stores them; all
    else that a model asks of them holds."""
    token = _STORED.set(True)
    try:
        yield
    finally:
        _STORED.reset(token)


def _stored(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"not a number in SI, up to {LARGEST:g}.")
    return float(value)


@dataclass(frozen=True, slots=True)
class Ratio:
    """Marks a pydantic field as a gear ratio: a number, or text as data sheets print it, "35.4:1"."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema  # as in Quantity

        return core_schema.no_info_before_validator_function(_refusing(_read_ratio), handler(source))


def _reader(kind: str) -> Callable[[object], float]:
    return _refusing(lambda value: _stored(value) if _STORED.get() else _read(value, kind))


def _refusing(read: Callable[[object], float]) -> Callable[[object], float]:
    """A reader whose ValueError becomes the error of type "unit" that `stillhook.library.toml.file` puts into one
    line."""

    def refusing(value: object) -> float:
        from pydantic_core import PydanticCustomError

        try:
            return read(value)
        except ValueError as problem:
            raise PydanticCustomError("unit", "{problem}", {"problem": str(problem)}) from None

    return refusing


Length = Annotated[float, Quantity("length")]
Diameter = Annotated[float, Quantity("diameter")]
Area = Annotated[float, Quantity("area")]
Volume = Annotated[float, Quantity("volume")]
Mass = Annotated[float, Quantity("mass")]
MassPerLength = Annotated[float, Quantity("mass_per_length")]
Density = Annotated[float, Quantity("density")]
Time = Annotated[float, Quantity("time")]
Hours = Annotated[float, Quantity("hours")]
Speed = Annotated[float, Quantity("speed")]
Acceleration = Annotated[float, Quantity("acceleration")]
Angle = Annotated[float, Quantity("angle")]
Rotation = Annotated[float, Quantity("rotation")]
Frequency = Annotated[float, Quantity("frequency")]
Displacement = Annotated[float, Quantity("displacement")]
Pressure = Annotated[float, Quantity("pressure")]
Modulus = Annotated[float, Quantity("modulus")]
Flow = Annotated[float, Quantity("flow")]
Leakage = Annotated[float, Quantity("leakage")]
LeakagePerSpeed = Annotated[float, Quantity("leakage_per_speed")]
FlowResistance = Annotated[float, Quantity("flow_resistance")]
FlowResistanceSquared = Annotated[float, Quantity("flow_resistance_squared")]
Force = Annotated[float, Quantity("force")]
ForcePerSpeed = Annotated[float, Quantity("force_per_speed")]
ForcePerSpeedSquared = Annotated[float, Quantity("force_per_speed_squared")]
Stiffness = Annotated[float, Quantity("stiffness")]
Torque = Annotated[float, Quantity("torque")]
TorqueLossTurbulent = Annotated[float, Quantity("torque_loss_turbulent")]
TorqueLossPressure = Annotated[float, Quantity("torque_loss_pressure")]
ViscousTorque = Annotated[float, Quantity("viscous_torque")]
StiffnessTorsion = Annotated[float, Quantity("stiffness_torsion")]
Inertia = Annotated[float, Quantity("inertia")]
Energy = Annotated[float, Quantity("energy")]
Power = Annotated[float, Quantity("power")]
TorqueConstant = Annotated[float, Quantity("torque_constant")]
Resistance = Annotated[float, Quantity("resistance")]
Capacitance = Annotated[float, Quantity("capacitance")]
Voltage = Annotated[float, Quantity("voltage")]
Current = Annotated[float, Quantity("current")]
Temperature = Annotated[float, Quantity("temperature")]
TemperatureRise = Annotated[float, Quantity("temperature_rise")]
GainPerLength = Annotated[float, Quantity("gain_per_length")]
GainPerPressure = Annotated[float, Quantity("gain_per_pressure")]
GainPerTime = Annotated[float, Quantity("gain_per_time")]
TimePerLength = Annotated[float, Quantity("time_per_length")]
GearRatio = Annotated[float, Ratio()]
TimeSquaredPerLength = Annotated[float, Quantity("time_squared_per_length")]
