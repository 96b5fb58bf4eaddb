"""What a number of a crane, payload or lift can be: a possible range, outside which it is refused, and within it what
was ever built.

A wrong unit is the mistake of a data sheet that is copied manually: 90 MPa for 90 GPa, 380 MPa for 380 bar. Where the
result is impossible the file is refused in one line. Where it is only outside of what was ever built, it is read, and
every result carries the status ``implausible`` and a note that names the field. Nothing is clipped.

The ranges are engineering judgement, a factor of a few beyond the data sheets of marine cranes, wire ropes, subsea
structures and closed hydraulic circuits; each line says what it spans. They find slips of units, they do not certify a
design.
"""

from __future__ import annotations

import functools
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from stillhook.base.kept.identity import remembered
from stillhook.units import Quantity, number, parse, show

IMPLAUSIBLE = "implausible"
"""Status of a result that follows from a number outside of what was ever built."""

ROUNDING = 1e-9
"""Relative; a mark and a value may be written in different units."""

Mark = str | float
Row = tuple[Mark, Mark, Mark, Mark, str]
"""Least that is possible, least and largest that was built, largest that is possible, and what these are."""


def _rows() -> dict[str, tuple[Row, ...]]:
    """The ranges of `plausible.toml` by model and field."""
    models = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {
        f"{model}.{field}": tuple(tuple(row) for row in (rows if isinstance(rows[0], list) else [rows]))
        for model, fields in models.items()
        for field, rows in fields.items()
    }


RANGES: Mapping[str, tuple[Row, ...]] = MappingProxyType(_rows())
"""Model and field to its range, or to a range for each number of a pair. A field that a model inherits is under the
model that has it."""


class Range(NamedTuple):
    """A row in SI, and its kind of quantity ("": a pure number)."""

    least: float
    low: float
    high: float
    most: float
    kind: str
    built: str

    def text(self, value: float) -> str:
        """A value as a person reads it."""
        return show(value, self.kind) if self.kind else number(value)


class Ranged(BaseModel):
    """A model whose numbers are refused, as they are read, outside of what is possible."""

    model_config = ConfigDict(defer_build=True)  # a command uses a third of the models that it imports

    @field_validator("*")
    @classmethod
    def _possible(cls, value: Any, info: ValidationInfo) -> Any:
        for x, bounds in _numbers(cls, str(info.field_name), value):
            if _outside(x, bounds.least, bounds.most):
                raise PydanticCustomError(
                    "impossible",
                    "it must be between {least} and {most} ({built}); check its unit",
                    {"least": bounds.text(bounds.least), "most": bounds.text(bounds.most), "built": bounds.built},
                )
        return value


@remembered
def implausible_values(model: BaseModel, path: str = "") -> tuple[str, ...]:
    """A note for every number outside of what was ever built, with its place under `path`."""
    return tuple(_implausible(model, path))


def marked(status: str, notes: Sequence[str]) -> str:
    """The status of a result that follows from numbers with these notes: never "ok" where there are any."""
    if not notes or status in ("diverged", "refused"):
        return status
    return IMPLAUSIBLE if status == "ok" else f"{status}, {IMPLAUSIBLE}"


def _implausible(model: BaseModel, path: str) -> Iterator[str]:
    for name in type(model).model_fields:
        value, place = model.__dict__.get(name), f"{path}.{name}" if path else name
        for x, bounds in _numbers(type(model), name, value):
            if _outside(x, bounds.low, bounds.high):
                built = f"{bounds.text(bounds.low)} to {bounds.text(bounds.high)} ({bounds.built})"
                yield f"{place} {bounds.text(x)} is implausible, outside {built}: check its unit"
        rows = value if isinstance(value, tuple) else (value,)
        for i, row in enumerate(rows):
            if isinstance(row, BaseModel):
                yield from implausible_values(row, f"{place}[{i}]" if isinstance(value, tuple) else place)


def _outside(x: float, low: float, high: float) -> bool:
    """Beyond a mark by more than the rounding of its unit."""
    return x < low - ROUNDING * abs(low) or x > high + ROUNDING * abs(high)


def _numbers(model: type[BaseModel], name: str, value: Any) -> Iterator[tuple[float, Range]]:
    """The numbers of a field, each with its range."""
    rows = ranges_of(model, name)
    if not rows:
        return
    for item in value if isinstance(value, tuple) else (value,):
        for x, bounds in zip(item if isinstance(item, tuple) else (item,), rows, strict=False):
            if isinstance(x, int | float) and not math.isnan(x):
                yield float(x), bounds


@functools.cache
def ranges_of(model: type[BaseModel], name: str) -> tuple[Range, ...]:
    """Ranges of a field in SI, one for each number of a pair; none where it has none."""
    keys = (f"{cls.__name__}.{name}" for cls in model.__mro__)
    rows = next((RANGES[key] for key in keys if key in RANGES), ())
    field = model.model_fields[name]
    kinds = [mark.kind for mark in (*field.metadata, *marks(field.annotation)) if isinstance(mark, Quantity)] or [""]
    return tuple(_range(row, kind) for row, kind in zip(rows, kinds, strict=False))


def marks(annotation: Any) -> Iterator[Any]:
    """What is in Annotated anywhere in a type."""
    if get_origin(annotation) is Annotated:
        yield from annotation.__metadata__
    for part in get_args(annotation):
        yield from marks(part)


def _range(row: Row, kind: str) -> Range:
    least, low, high, most = (float(mark) if isinstance(mark, int | float) else parse(mark, kind) for mark in row[:4])
    return Range(least, low, high, most, kind, row[4])
