"""Corrections to what a reader understands of a table, the same for every reader: which column is what, in which unit,
counted which way.

On the command line `--column "heave=MRU_Heave_m [m] down"`; kept in a mapping file, which every reader takes again:

    [columns]
    heave = "MRU_Heave_m [m] down"
    F_w = { column = "Hakenlast", unit = "t", sign = 1, scale = 1.0, offset = 0.0 }

A text is the heading (or the place of the column, counted from 1), its unit in brackets where the file gives none, and
"down" or "reversed" where the file counts against Stillhook; "up" says that it does not.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, Field, ValidationError, field_validator

from stillhook.errors import LogError, SpecError, StillhookError
from stillhook.formats.table.columns import ColumnChoice
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.tables.table import Number, Spec, first_problem
from stillhook.units import quote

TABLES = ("columns", "signals")
"""Tables of a mapping file; a log's may be called signals."""
SENSES = {"up": 1, "hoisting": 1, "down": -1, "lowering": -1, "reversed": -1}
"""Words behind a heading, and the sign that they are."""
EXAMPLE = '--column "heave=MRU_Heave_m [m] down"'
_TEXT = re.compile(r"(?P<column>.*\S)\s+(?P<sense>" + "|".join(SENSES) + r")\s*")


def _column(column: object) -> str:
    if isinstance(column, int) and not isinstance(column, bool) and column >= 1:
        return str(column)
    if not isinstance(column, str) or not column.strip():
        raise ValueError("write the heading of the column in the file, or its place counted from 1.")
    return column.strip()


Column = Annotated[str, BeforeValidator(_column)]


class ColumnRow(Spec):
    """A row of a mapping: value = sign * (scale * number + offset) in `unit`."""

    column: Column = Field(description="heading of the column in the file, or its place counted from 1")
    unit: Any = Field(default=None, description="unit of the numbers in the file")
    sign: Annotated[int, Field(strict=True)] = Field(default=1, description="1 or -1")
    scale: Number = Field(default=1.0, description="factor on the raw number, before the unit")
    offset: Number = Field(default=0.0, description="added to the raw number, before the unit")

    @field_validator("sign")
    @classmethod
    def _plus_or_minus_one(cls, sign: int) -> int:
        if sign not in (1, -1):
            raise ValueError("it must be 1 or -1.")
        return sign

    @field_validator("scale")
    @classmethod
    def _not_zero(cls, scale: float) -> float:
        if scale == 0.0:
            raise ValueError("give a number that is not 0.")
        return scale

    @property
    def choice(self) -> ColumnChoice:
        """The same for a reader of tables."""
        unit = None if self.unit is None else str(self.unit)
        return ColumnChoice(self.column, unit, self.sign, self.scale, self.offset)


Row = TypeVar("Row", bound=ColumnRow)


def row_of(row: Any, model: type[Row], where: str, error: type[StillhookError] = LogError) -> Row:
    """A row of a mapping, written as text or as a table. Errors: `error`, one line."""
    if isinstance(row, str):
        row = text_row(row)
    if not isinstance(row, Mapping):
        raise error(
            f'{where} = {quote(row)}: write a table such as {{ column = "PT101", unit = "bar" }}, or the heading as'
            " text."
        )
    try:
        return model.model_validate(row)
    except ValidationError as problem:
        raise error(first_problem(problem, model, row, where).line) from None


def text_row(text: str) -> dict[str, Any]:
    """A heading with its unit and "down", such as "MRU_Heave_m [m] down", as a row."""
    match = _TEXT.fullmatch(text)
    return {"column": text} if match is None else {"column": match["column"], "sign": SENSES[match["sense"]]}


def corrections(mapping: str | os.PathLike[str] | None, columns: Sequence[str] | None = None) -> dict[str, Any]:
    """Rows by name: those of a mapping file, then those of `--column`, which win. Errors: LogError, one line."""
    rows = {} if mapping is None else read_corrections(mapping)
    return rows | corrections_of(columns or ())


def corrections_of(texts: Sequence[str]) -> dict[str, Any]:
    """Rows by name from texts such as "heave=MRU_Heave_m [m] down". Errors: LogError, one line."""
    rows: dict[str, Any] = {}
    for text in texts:
        name, sign, row = text.partition("=")
        if not sign or not name.strip() or not row.strip():
            raise LogError(f"--column {quote(text)}: is not a name, =, and a heading. Write {EXAMPLE}.")
        if name.strip() in rows:
            raise LogError(f"--column {quote(text)}: {name.strip()} is given twice. Write it once.")
        rows[name.strip()] = text_row(row.strip())
    return rows


def read_corrections(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Rows by name of a mapping file, as they are written. Errors: LogError, one line."""
    file = Path(path)
    try:
        table = parsed(toml_text(file), file.name, FileKind.MAPPING, FileKind.WEATHER, start=f"Write [columns]. {ROWS}")
    except SpecError as problem:
        raise LogError(str(problem)) from None
    rows = next((table[name] for name in TABLES if isinstance(table.get(name), Mapping)), None)
    if not rows:
        raise LogError(f"{file.name}: no table [columns]. {ROWS}")
    return dict(rows)


ROWS = 'Write rows such as heave = "MRU_Heave_m [m] down" below it.'
