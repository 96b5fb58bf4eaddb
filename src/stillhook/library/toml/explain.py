"""Errors of pydantic in a file, as one line: where, what came, what is allowed, what to do."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from stillhook.errors import SpecError, StillhookError, UnitError
from stillhook.library.toml.tree import nearest
from stillhook.spec.crane import Crane
from stillhook.units import KINDS, Quantity, quote, text_at

# Typing errors first: a misspelt field is also a missing one, and the misspelling is to be corrected.
_ORDER = {"extra_forbidden": 0, "unit": 1, "missing": 3, "value_error": 4}
_OTHER = 2
_SHOULD = re.compile(r"^[A-Z]\w+ should")


def explain(error: ValidationError, model: type[BaseModel], where: str, data: Mapping[str, Any]) -> StillhookError:
    """The first problem of a validation of ``data`` as one line, with the number of further ones."""
    problems = sorted(error.errors(include_url=False), key=lambda p: _ORDER.get(p["type"], _OTHER))
    first = problems[0]
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    text = f"{where}: {_line(first, model, data)}{more}"
    return UnitError(text) if first["type"] == "unit" else SpecError(text)


def _line(problem: Any, model: type[BaseModel], data: Mapping[str, Any]) -> str:
    loc: tuple[int | str, ...] = problem["loc"]
    place, quoted = _dotted(loc), quote(text_at(data, loc, problem["input"]))
    kind, message = problem["type"], str(problem["msg"]).removeprefix("Value error, ")
    if kind == "extra_forbidden":
        fields = _fields(model, loc[:-1])
        return f"{place}: unknown field{nearest(str(loc[-1]), fields)} Fields here: {', '.join(fields)}."
    if kind == "missing":
        base = ", or start the file with base = <crane of the library>" if issubclass(model, Crane) else ""
        return f"{place}: missing{_meaning(model, loc)}. Add it{base}."
    if kind == "value_error":
        return f"{place}: {message}" if place else message
    if kind == "unit":
        return f"{place} = {quoted}: {message}"
    if kind in {"model_type", "model_attributes_type", "dict_type"}:
        return f"{place} = {quoted}: must be a table, with {', '.join(_fields(model, loc))}."
    return f"{place} = {quoted}: {_SHOULD.sub('it must', message, count=1)}."


def _dotted(loc: Sequence[int | str]) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).removeprefix(".")


def _fields(model: type[BaseModel], loc: Sequence[int | str]) -> list[str]:
    """Names of the fields of the table at ``loc``."""
    current = model
    for part in loc:
        field = current.model_fields.get(str(part))
        inner = _model_in(field.annotation) if field else None
        if inner is None:
            return []
        current = inner
    return [name for name in current.model_fields if name != "sources"]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    for one in (annotation, *get_args(annotation)):
        if isinstance(one, type) and issubclass(one, BaseModel):
            return one
    return None


def _meaning(model: type[BaseModel], loc: Sequence[int | str]) -> str:
    """Description and allowed units of the field at ``loc``, in brackets."""
    current: type[BaseModel] | None = model
    field = None
    for part in loc:
        field = current.model_fields.get(str(part)) if current else None
        current = _model_in(field.annotation) if field else None
    if field is None:
        return ""
    units = [", ".join(KINDS[m.kind].allowed) for m in field.metadata if isinstance(m, Quantity)]
    words = [w for w in (field.description, f"in {units[0]}" if units else None) if w]
    return f" ({'; '.join(words)})" if words else ""
