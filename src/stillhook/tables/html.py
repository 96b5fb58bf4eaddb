"""Short HTML tables in which a notebook shows a crane, a payload and any other record; every text is escaped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterator, Sequence
from enum import Enum
from html import escape
from typing import Any

from pydantic import BaseModel

from stillhook.tables.plausible import marks
from stillhook.units import Quantity, show

HIDDEN = ("name", "title", "sources", "source")
"""Fields that are in the heading, or too long for a table."""
SHORT = 24
"""Characters of a cell that is not folded."""
LONGEST = 200
"""Characters of a text that are shown."""


def table(rows: Sequence[Sequence[object]], header: Sequence[str] = (), title: str = "") -> str:
    """A table as HTML; without a header the first cell of each row is its name."""
    caption = f"<caption><b>{_shown(title)}</b></caption>" if title else ""
    head = f"<tr>{''.join(f'<th>{_shown(cell)}</th>' for cell in header)}</tr>" if header else ""
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"<table>{caption}{head}{body}</table>"


def _cell(text: object) -> str:
    wrap = ";white-space:nowrap" if len(str(text)) <= SHORT else ""
    return f'<td style="text-align:left;vertical-align:top{wrap}">{_shown(text)}</td>'


def record_html(record: BaseModel, more: Sequence[tuple[str, str]] = (), without: Container[str] = ()) -> str:
    """A record as its numbers with their units, and its tables folded; more: rows that follow from it; without: fields
    that these rows replace."""
    sources = getattr(record, "sources", None)
    kinds = Counter(str(each.kind) for each in sources.values()) if sources else {}
    of = f"<p>Sources: {_shown(', '.join(f'{n} {kind}' for kind, n in kinds.items()))}.</p>" if kinds else ""
    return f"<div>{_body(record, ' '.join(_named(record)), more, without)}{of}</div>"


def _body(
    record: BaseModel, title: str = "", more: Sequence[tuple[str, str]] = (), without: Container[str] = ()
) -> str:
    inner = (f"<details><summary>{_shown(name)}</summary>{_body(part)}</details>" for name, part in _tables(record))
    return table([*_rows(record, without), *more], title=title) + "".join(inner)


def _named(record: BaseModel) -> Iterator[str]:
    yield type(record).__name__
    if name := getattr(record, "name", ""):
        yield f'"{name}"'
    if title := getattr(record, "title", ""):
        yield f"({title})"


def _rows(record: BaseModel, without: Container[str]) -> Iterator[tuple[str, str]]:
    for name, field in type(record).model_fields.items():
        value = record.__dict__.get(name)
        if name in HIDDEN or name in without or value is None or value == ():
            continue
        every = (*field.metadata, *marks(field.annotation))
        kind = next((mark.kind for mark in every if isinstance(mark, Quantity)), "")
        if (text := _text(value, kind)) is not None:
            yield field.description or name, text


def _text(value: Any, kind: str) -> str | None:
    """A value with its unit; None for a table."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Enum | str):
        return str(value)
    if isinstance(value, int | float):
        return show(float(value), kind, 4) if kind else f"{value:.4g}"
    if isinstance(value, tuple) and all(isinstance(each, int | float) for each in value):
        return ", ".join(str(_text(each, kind)) for each in value)
    describe = getattr(value, "describe", None)
    return str(describe()) if callable(describe) else None


def _tables(record: BaseModel) -> Iterator[tuple[str, BaseModel]]:
    for name in type(record).model_fields:
        value = record.__dict__.get(name)
        parts = value if isinstance(value, tuple) else (value,)
        for i, part in enumerate(parts):
            if isinstance(part, BaseModel) and _text(part, "") is None:
                yield f"{name} {i + 1}" if isinstance(value, tuple) else name, part


def _shown(text: object) -> str:
    words = str(text)
    return escape(words if len(words) <= LONGEST else f"{words[: LONGEST - 3]}...")
