"""A register map: which number of the twin is in which Modbus registers, in which form."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field

from stillhook.errors import LiveError, UnitError
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.live.runtime.board import STATUS
from stillhook.live.servers.served import about, kind_of
from stillhook.tables.table import Spec, Text
from stillhook.units import parse, quote

LAST = 65_535
"""Largest address of a register."""
MOST = 2000
"""Rows of a map at most."""


class Form(StrEnum):
    """How a number is coded."""

    INT16 = "int16"
    UINT16 = "uint16"
    INT32 = "int32"
    UINT32 = "uint32"
    FLOAT32 = "float32"
    FLOAT64 = "float64"

    @property
    def code(self) -> str:
        """As `struct` calls it."""
        return {"int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}[self.value]

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return struct.calcsize(f">{self.code}") // 2

    @property
    def integer(self) -> bool:
        """Whether it holds whole numbers."""
        return self.code not in "fd"

    @property
    def ends(self) -> tuple[int, int]:
        """Least and largest whole number, less the one that stands for no value."""
        bits = 16 * self.words
        return (-(1 << (bits - 1)) + 1, (1 << (bits - 1)) - 1) if self.code in "hi" else (0, (1 << bits) - 2)

    @property
    def no_value(self) -> float:
        """What stands for a number that there is none of, or that does not go in: the least one of a signed form, the
        largest of an unsigned one, NaN."""
        if not self.integer:
            return math.nan
        return self.ends[0] - 1 if self.code in "hi" else self.ends[1] + 1


class Access(StrEnum):
    """Who changes a register."""

    READ = "read"
    WRITE = "write"


class Words(StrEnum):
    """Which register of a number comes first."""

    BIG = "big"
    LITTLE = "little"


class RegisterRow(Spec):
    """A row [[register]]."""

    name: Text = Field(description="number of the twin, or input")
    address: Annotated[int, Field(strict=True, ge=0, le=LAST)] = Field(description="first register, counted from 0")
    type: Form = Field(default=Form.FLOAT32, description="how the number is coded")
    scale: Annotated[float, Field(gt=0, allow_inf_nan=False)] = Field(default=1.0, description="unit of one count")
    unit: Text | None = Field(default=None, description="unit of the value; default SI")
    access: Access = Field(default=Access.READ, description="read, or write for an input")


class RegisterFile(Spec):
    """A register map."""

    words: Words = Field(default=Words.BIG, description="which register of a number comes first")
    rows: Annotated[tuple[RegisterRow, ...], Field(min_length=1, max_length=MOST)] = Field(
        alias="register", description="rows"
    )


class Register(NamedTuple):
    """A number in its registers. factor: SI value of one count."""

    name: str
    address: int
    form: Form
    factor: float
    access: Access
    words: Words

    @property
    def end(self) -> int:
        """First address behind it."""
        return self.address + self.form.words

    def encode(self, value: float) -> list[int]:
        """Registers of a value [SI]; `Form.no_value` where it is missing or does not go in."""
        x = value / self.factor
        form = self.form
        raw: float = form.no_value
        if form.integer and math.isfinite(x) and form.ends[0] <= round(x) <= form.ends[1]:
            raw = round(x)
        elif not form.integer and math.isfinite(x) and (form is Form.FLOAT64 or abs(x) < 3.4e38):
            raw = x
        packed = struct.pack(f">{form.code}", int(raw) if form.integer else raw)
        words = list(struct.unpack(f">{form.words}H", packed))
        return words if self.words is Words.BIG else words[::-1]

    def decode(self, words: Sequence[int]) -> float | None:
        """Value of registers [SI]; None where they hold none."""
        ordered = list(words) if self.words is Words.BIG else list(words)[::-1]
        (raw,) = struct.unpack(f">{self.form.code}", struct.pack(f">{self.form.words}H", *ordered))
        if not math.isfinite(raw) or (self.form.integer and raw == self.form.no_value):
            return None
        value = raw * self.factor
        return value if math.isfinite(value) else None


def read_registers(path: str | Path, names: Sequence[str], inputs: Sequence[str]) -> tuple[Register, ...]:
    """The rows of a map by address. names: of the twin's numbers; inputs: what may be written.

    Errors: LiveError, UnitError of one line: an unknown name, a unit of another quantity, registers that overlap or end
    behind the last one, a number that is not an input and may be written.
    """
    return read_toml_raising(
        LiveError, Path(path), FileKind.REGISTERS, lambda t: _registers(t, names, inputs), start=START
    )


START = "Write rows [[register]], or copy those of: stillhook example live FOLDER."


def _registers(table: TomlTable, names: Sequence[str], inputs: Sequence[str]) -> tuple[Register, ...]:
    file = table.read(RegisterFile)
    rows = []
    for i, row in enumerate(file.rows):
        place = table.at("register", i)
        writable = row.access is Access.WRITE
        allowed = inputs if writable else names
        if row.name not in allowed:
            noun = "input" if writable else "number of this twin"
            raise place.wrong(f"no {noun}. Choose one of {', '.join(allowed)}.", "name")
        rows.append(Register(row.name, row.address, row.type, _factor(place, row), row.access, file.words))
        if rows[-1].end - 1 > LAST:
            raise place.wrong(f"{row.type} takes {row.type.words} registers, and {LAST} is the last one.", "address")
    rows.sort(key=lambda r: r.address)
    for one, other in pairwise(rows):
        if other.address < one.end:
            raise LiveError(
                f"{other.name} at {other.address}: {one.name} takes registers {one.address} to {one.end - 1}. Move one."
            )
    written = [r.name for r in rows if r.access is Access.WRITE]
    if twice := sorted({name for name in written if written.count(name) > 1}):
        raise LiveError(f"{twice[0]}: may be written in two places. Leave one.")
    return tuple(rows)


def _factor(place: TomlTable, row: RegisterRow) -> float:
    """SI value of one count."""
    unit, _ = about(row.name)
    if row.unit is None or row.unit == unit:
        return row.scale
    side, _, signal = row.name.rpartition(".")
    kind = "" if row.name in STATUS or (side and unit != about(signal)[0]) else kind_of(signal)
    if not kind:
        percent = row.unit == "%" and unit == "1"
        if not percent:
            raise UnitError(
                f"{place.place('unit')} = {quote(row.unit)}: {row.name} is in {unit}. Write that, or nothing."
            )
        return 0.01 * row.scale
    return row.scale * parse(f"1 {row.unit}", kind, place.place("unit"))
