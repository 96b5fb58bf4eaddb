"""What every table of a file that users write is made of, and errors of pydantic in it as one line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from stillhook.base.choice import nearest
from stillhook.base.gateway.parse import UNPRINTED
from stillhook.errors import StillhookError
from stillhook.tables.html import record_html
from stillhook.tables.plausible import Ranged, marks
from stillhook.units import KINDS, Quantity, bound, quote, text_at

LARGEST = 1e12
"""Pure numbers beyond this size are slips of the pen."""
_PERCENT = re.compile(r"[+-]?[0-9]+(\.[0-9]*)? ?%")


def pure_number(value: object) -> float:
    """A number as it is, or a text such as "3 %" [-]. Errors: ValueError."""
    if isinstance(value, str) and _PERCENT.fullmatch(value.strip()) and abs(float(value.strip()[:-1])) < LARGEST:
        return float(value.strip()[:-1]) / 100.0
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST:
        return float(value)
    raise ValueError('give a number, or a text such as "3 %".')


def _one_line(text: str) -> str:
    if "\n" in text or UNPRINTED.search(text):
        raise ValueError("give a text of one line, without signs that are not for print.")
    return text


def _refused(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """An error of Stillhook as a problem with its place, which `stillhook.tables.table` puts into one line."""
    try:
        return handler(value)
    except StillhookError as e:
        raise PydanticCustomError("refused", "{problem}", {"problem": str(e), "error": e}) from None


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Fraction = Annotated[Number, Field(gt=0, le=1)]
Share = Annotated[float, BeforeValidator(pure_number)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Text = Annotated[str, Field(pattern=r"\S")]
Line = Annotated[str, AfterValidator(_one_line)]
"""A text that stands in a line of an answer, where it can be taken for no other line."""
Name = Annotated[Text, AfterValidator(_one_line)]
"""One that is not empty."""
Flag = Annotated[bool, Field(strict=True)]
Inner = TypeVar("Inner")
Part = Annotated[Inner, WrapValidator(_refused)]
"""A table that is itself a record, or anything else whose validation raises errors of Stillhook."""


class Spec(Ranged):
    """A table of a file that users write: frozen, and closed to unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def _repr_html_(self) -> str:
        """Its numbers with their units, for a notebook."""
        return record_html(self)


class SourceKind(StrEnum):
    """How far a number can be trusted."""

    PUBLISHED = "published"
    DATASHEET = "datasheet"
    FITTED = "fitted"
    DERIVED = "derived"
    ASSUMED = "assumed"
    USER = "user"


class Source(Spec):
    """Where a number is from."""

    text: Text
    kind: SourceKind


_ORDER = {"extra_forbidden": 0, "unit": 1, "missing": 3, "value_error": 4}
"""Misspelt fields come first: a misspelt field is also a missing one."""
_OTHER = 2
_BOUNDS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "greater than or equal to"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "less than or equal to"),
}
"""Problems with a bound -> its name in their context, and in words."""
_TYPES = {
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "date_type": "a date without quotes, such as 2026-11-21",
    "float_type": "a number",
    "int_type": "a whole number",
    "list_type": "a list",
    "string_pattern_mismatch": "a text",
    "string_too_short": "a text",
    "string_type": "a text",
    "tuple_type": "a list",
}
"""Problems with a type -> what is allowed, in words."""
_LISTS = ("list_type", "tuple_type")
_TABLES = ("model_type", "model_attributes_type", "dict_type", "mapping_type")
_CHOICES = ("enum", "literal_error")
_CHOICE = re.compile(r"'([^']*)'")
_ROW = re.compile(r' (?:".*"|\d+)$')
_RECORD = re.compile(r"[A-Z]\w+(?=[.:])")


class Problem(NamedTuple):
    """A problem of a validation. line: without the name of a file; kind: its type; total of all problems; cause: the
    error of Stillhook that it was, if any."""

    line: str
    kind: str
    total: int
    cause: StillhookError | None


def first_problem(error: ValidationError, model: type[BaseModel], data: Any, name: str = "") -> Problem:
    """The first problem of a validation of `data` by `model`; name: of the model, where no file names it."""
    return problems_of(error, model, data, name)[0]


def problems_of(error: ValidationError, model: type[BaseModel], data: Any, name: str = "") -> list[Problem]:
    """Every problem of a validation of `data` by `model`, the likeliest cause of the others first."""
    found = sorted(_real(error), key=lambda p: _ORDER.get(p["type"], _OTHER))
    problems = []
    for each in found:
        cause = each.get("ctx", {}).get("error")
        cause = cause if isinstance(cause, StillhookError) else None
        problems.append(Problem(_line(each, model, data, name, cause), each["type"], len(found), cause))
        for line in () if cause is None else cause.lines[1:]:  # of a record inside
            placed = line if name else with_place(line, place_of(each["loc"], data))
            problems.append(Problem(placed, each["type"], len(found), cause))
    return problems


def refused_by(
    error: ValidationError, model: type[BaseModel], data: Any, name: str, raised: type[StillhookError]
) -> StillhookError:
    """The error for a record that is made from `data`, with a line for every problem."""
    problems = problems_of(error, model, data, name)
    return raised(problems[0].line).with_lines([problem.line for problem in problems])


def _real(error: ValidationError) -> Iterator[Any]:
    """The problems of a validation, less lists that are short because a row in them has a problem."""
    problems = error.errors(include_url=False)
    for p in problems:
        loc = p["loc"]
        if p["type"] != "too_short" or not any(loc == q["loc"][: len(loc)] for q in problems if q is not p):
            yield p


def place_of(loc: Sequence[int | str], data: Any, name: str = "") -> str:
    """A place as messages name it: `active.motor.D_max`, `Hs[2]`, and `test "3": load` for a row of a list of
    tables. data: what was validated; name: of the model, where no file names it."""
    place = name
    for i, part in enumerate(loc):
        if not isinstance(part, int):
            dot = "" if not place or place.endswith(": ") else "."
            place += dot + (part if part.isprintable() else quote(part)[1:-1])
        elif isinstance(row := text_at(data, loc[: i + 1], None), Mapping) and not name:
            place += f" {_label(row, part)}" + (": " if i + 1 < len(loc) else "")
        else:
            place += f"[{part}]"
    return place


def statement(loc: Sequence[int | str], data: Any, written: Any, message: str, name: str = "") -> str:
    """A place, what is written there (less a table), and a message on it."""
    place = place_of(loc, data, name)
    if not place:
        return message
    shown = "" if isinstance(written, Mapping) else f" = {quote(written)}"
    return f"{place}{shown}: {message}"


def _label(row: Mapping[str, Any], index: int) -> str:
    """Name or key of a row in quotes, else its number."""
    label = row.get("name", row.get("key"))
    return quote(label) if isinstance(label, str) and label.strip() else str(index + 1)


def _line(problem: Any, model: type[BaseModel], data: Any, name: str, cause: StillhookError | None) -> str:
    loc: tuple[int | str, ...] = problem["loc"]
    written = text_at(data, loc, problem["input"])
    kind, message = problem["type"], str(problem["msg"]).removeprefix("Value error, ").removesuffix(".") + "."
    if cause is not None:
        return str(cause) if name else with_place(str(cause), place_of(loc, data))
    if kind == "extra_forbidden":
        fields = _fields(model, loc[:-1])
        if len(loc) == 1 and (meant := getattr(model, "MEANT", {}).get(str(loc[0]).lower())):
            return f"{place_of(loc, data, name)}: unknown field. {meant}"
        near = nearest(str(loc[-1]), fields)
        return f"{place_of(loc, data, name)}: unknown field{near} Allowed: {', '.join(fields)}."
    if kind == "missing":
        return f"{place_of(loc, data, name)}: missing{_meaning(model, loc)}. Add it."
    if kind in _TABLES:
        if isinstance(written, list) and written and loc and all(isinstance(row, Mapping) for row in written):
            return f"{place_of(loc, data, name)}: write one table, [{loc[-1]}]."
        table = f"a table, with {', '.join(_fields(model, loc))}" if _fields(model, loc) else "a table"
        return f"{place_of(loc, data, name) or 'It'} = {quote(written)}: it must be {table}."
    if kind == "value_error" and not loc:
        return f"{name}: {message}" if name else message
    return statement(loc, data, written, _allowed(problem, model, written) or message, name)


def _allowed(problem: Any, model: type[BaseModel], written: Any) -> str:
    """What is allowed in a field; empty where the problem's own message says so."""
    kind, ctx, field = problem["type"], problem.get("ctx", {}), _field(model, problem["loc"])
    meaning = f" ({field.description})" if field is not None and field.description else ""
    if kind in _LISTS and isinstance(written, Mapping):
        return f"write a list of tables, [[{problem['loc'][-1]}]]."
    if kind in _TYPES:
        return f"it must be {_TYPES[kind]}{meaning}."
    if kind == "too_short":
        return f"give at least {ctx['min_length']}{meaning}."
    if kind in _BOUNDS:
        end, words = _BOUNDS[kind]
        kinds = {mark.kind for mark in _marks(field) if isinstance(mark, Quantity)}
        value = bound(float(ctx[end]), kinds.pop(), written) if len(kinds) == 1 and ctx[end] else f"{ctx[end]:.12g}"
        return f"it must be {words} {value}."
    if kind in _CHOICES:
        choices = _CHOICE.findall(ctx["expected"])
        return f"it must be {ctx['expected']}{nearest(written, choices) if isinstance(written, str) else '.'}"
    if kind in ("unit", "value_error"):
        return ""
    return re.sub(r"^[A-Z]\w+ should", "it must", str(problem["msg"])) + "."


def with_place(text: str, place: str) -> str:
    """The text of an error with its place in place of a record's name: `water.volume` for `Water.volume`."""
    if (record := _RECORD.match(text)) is not None:
        rest = text[record.end() :]
        return f"{place}: {rest[1:]}" if rest.startswith(".") and _ROW.search(place) else place + rest
    return text if text.startswith(place) else f"{place}: {text}"


def _marks(field: FieldInfo | None) -> Iterator[Any]:
    if field is not None:
        yield from field.metadata
        yield from marks(field.annotation)


def _field(model: type[BaseModel], loc: Sequence[int | str]) -> FieldInfo | None:
    """The field at a place of a model; None where there is none."""
    return _field_and_table(model, loc)[0]


def _field_and_table(
    model: type[BaseModel], loc: Sequence[int | str]
) -> tuple[FieldInfo | None, type[BaseModel] | None]:
    """The field at a place of a model, and the model that its value is, or its rows are."""
    field: FieldInfo | None = None
    table: type[BaseModel] | None = model
    in_mapping = False
    for part in loc:
        if isinstance(part, int) or in_mapping or table is None:
            in_mapping = False  # an index, or the key of a mapping: the field stays
            continue
        field = table.model_fields.get(part)
        table = model_in(field.annotation) if field else None
        in_mapping = field is not None and any(
            get_origin(kind) is Mapping for kind in (field.annotation, *get_args(field.annotation))
        )
    return field, table


def model_in(annotation: Any) -> type[BaseModel] | None:
    """The model in a type, in a list or next to None too."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((inner for part in get_args(annotation) if (inner := model_in(part)) is not None), None)


def _fields(model: type[BaseModel], loc: Sequence[int | str]) -> list[str]:
    """Names of the fields of the table at a place."""
    table = _field_and_table(model, loc)[1]
    return [name for name in table.model_fields if name != "sources"] if table else []


def _meaning(model: type[BaseModel], loc: Sequence[int | str]) -> str:
    """Description and allowed units of the field at a place, in brackets."""
    field = _field(model, loc)
    if field is None:
        return ""
    units = [", ".join(KINDS[m.kind].allowed) for m in field.metadata if isinstance(m, Quantity)]
    words = [w for w in (field.description, f"in {units[0]}" if units else None) if w]
    return f" ({'; '.join(words)})" if words else ""
