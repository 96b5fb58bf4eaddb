"""A crane as a complete crane file, sources included, and as a readable sheet."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from stillhook.library.leakage import form_of, point_text, stated_leak
from stillhook.library.toml.tree import LABELS, Leaf, Tree, nested
from stillhook.spec.crane import Crane, Source, SourceKind, effective_inertia, wire_capacity
from stillhook.tables.plausible import marks
from stillhook.tables.table import Spec
from stillhook.units import KINDS, Quantity, exact, number, show

_UNSTATED = Source(text="not stated", kind=SourceKind.USER)
COMPANIONS = ("sources", "certified")
"""Fields of a crane that are not values of it."""


class Item(NamedTuple):
    """One value of a crane: dotted path, meaning, SI value, kind of quantity (None for ratios and texts), source."""

    path: str
    meaning: str
    value: Any
    quantity: str | None
    source: Source


def items(crane: Crane) -> Iterator[Item]:
    """Every value of a crane, depth first; absent options are left out."""
    return leaves(crane, crane.sources)


def leaves(spec: Spec, sources: Mapping[str, Source]) -> Iterator[Item]:
    """Every value of a table of a crane file, depth first, with its source; absent options are left out."""
    for path, name, field, value in _walk(spec, ""):
        yield Item(path, field.description or name, value, quantity_of(field), sources.get(path, _UNSTATED))


def _walk(spec: Spec, path: str) -> Iterator[tuple[str, str, FieldInfo, Any]]:
    for name, field in type(spec).model_fields.items():
        value = spec.__dict__.get(name)
        place = f"{path}.{name}" if path else name
        if value is None or name in COMPANIONS:
            continue
        if isinstance(value, Spec):
            yield from _walk(value, place)
        else:
            yield place, name, field, str(value) if isinstance(value, str) else value


def quantity_of(field: FieldInfo) -> str | None:
    """Kind of quantity of a field, also of an optional one or of a list."""
    every = (*field.metadata, *marks(field.annotation))
    return next((mark.kind for mark in every if isinstance(mark, Quantity)), None)


def file_value(value: Any, quantity: str | None) -> Any:
    """A value as a file has it: in display units where that loses nothing, else in SI with all digits."""
    if isinstance(value, tuple):
        return [file_value(v, quantity) for v in value]
    return value if quantity is None else exact(value, quantity)


def crane_tree(crane: Crane) -> Tree:
    """A crane as a tree of leaves, as read from a file."""
    out = leaf_tree(crane, crane.sources)
    return out if crane.certified is None else {**out, "certified": Leaf(crane.certified, _UNSTATED)}


def leaf_tree(spec: Spec, sources: Mapping[str, Source]) -> Tree:
    """A table of a crane file as a tree of leaves."""
    return nested(
        (item.path, Leaf(file_value(item.value, item.quantity), item.source)) for item in leaves(spec, sources)
    )


def crane_toml(crane: Crane) -> str:
    """A crane as a complete crane file with sources and its certificate's record; ``load_crane`` reads it back."""
    tables = leaf_tables(crane, crane.sources)
    return joined(tables if crane.certified is None else tables | record_tables(crane.certified, "certified"))


def certified_crane_toml(crane: Crane, certificate: str = "certificate.json") -> str:
    """A crane as a complete crane file that names its certificate, a path seen from that file; it is self-contained
    next to it."""
    tables = leaf_tables(crane, crane.sources)
    tables[""].insert(0, f"certificate = {toml_value(certificate)}")
    return joined(tables)


def record_tables(record: BaseModel, name: str) -> dict[str, list[str]]:
    """The lines of a record without sources, by their table: quantities as texts, records and mappings within as tables
    of their own."""
    tables: dict[str, list[str]] = {name: []}
    for key, field in type(record).model_fields.items():
        value = getattr(record, key)
        if isinstance(value, BaseModel):
            tables |= record_tables(value, f"{name}.{key}")
        elif isinstance(value, Mapping):
            tables[f"{name}.{key}"] = [f"{toml_value(k)} = {toml_value(v)}" for k, v in value.items()]
        elif value is not None:
            tables[name].append(f"{key} = {toml_value(file_value(value, quantity_of(field)))}")
    return tables


def leaf_tables(spec: Spec, sources: Mapping[str, Source]) -> dict[str, list[str]]:
    """The lines of a file by their table ("": top), every value with kind and source."""
    tables: dict[str, list[str]] = {"": []}
    for item in leaves(spec, sources):
        table, _, name = item.path.rpartition(".")
        value = toml_value(file_value(item.value, item.quantity))
        if item.path not in LABELS:
            kind, source = toml_value(item.source.kind.value), toml_value(item.source.text)
            value = f"{{ value = {value}, kind = {kind}, source = {source} }}"
        tables.setdefault(table, []).append(f"{name} = {value}")
    return tables


def joined(tables: Mapping[str, list[str]]) -> str:
    """The text of a file from the lines of its tables."""
    return "\n\n".join("\n".join([f"[{t}]", *lines] if t else lines) for t, lines in tables.items()) + "\n"


def toml_value(value: Any) -> str:
    """A text, a number, a list or a table of them as TOML writes it, a table in one line."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {toml_value(v)}' for key, v in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(toml_value(v) for v in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    return repr(value)


MOST_SHOWN = 30  # numbers of a list on the sheet
DIGITS = 6  # significant digits on the sheet; published numbers have up to 5


class Row(NamedTuple):
    """One number: dotted field, what it means, its value in display units, its reliability, its source."""

    field: str
    meaning: str
    value: str
    kind: str
    source: str


class Section(NamedTuple):
    """Rows of one table of the crane file."""

    title: str
    rows: tuple[Row, ...]


def sheet(crane: Crane) -> tuple[Section, ...]:
    """Sections of rows, in the order of the crane file; the last one follows from the others.

    Values are in display units (bar, L/min, rev/min, cm^3/rev, mm, t). ``sheet_json`` has the same in SI.
    """
    sections: dict[str, list[Row]] = {}
    for item in _numbers(crane):
        table = item.path.rpartition(".")[0] or "crane"
        value = _text(item.value, item.quantity).replace(" + ", ", " if ".pump.table." in item.path else " + ")
        row = Row(item.path, item.meaning, value, item.source.kind.value, item.source.text)
        sections.setdefault(table, []).append(row)
    sections["derived"] = list(_derived(crane))
    return tuple(Section(title, tuple(rows)) for title, rows in sections.items())


def sheet_json(crane: Crane) -> dict[str, Any]:
    """The sheet in SI, ready for JSON: dotted field to value, unit (none for ratios and texts), kind and source."""
    fields = {}
    for item in _numbers(crane):
        value = list(item.value) if isinstance(item.value, tuple) else item.value
        unit = KINDS[item.quantity].si if item.quantity else None
        fields[item.path] = {"value": value, "unit": unit, "kind": item.source.kind.value, "source": item.source.text}
    return {"name": crane.name, "title": crane.title, "fields": fields}


def _numbers(crane: Crane) -> Iterator[Item]:
    return (item for item in items(crane) if item.path not in {"name", "title"})


def _text(value: Any, quantity: str | None) -> str:
    if isinstance(value, tuple) and len(value) > MOST_SHOWN:
        return f"{_text(min(value), quantity)} to {_text(max(value), quantity)} ({len(value)} values)"
    if isinstance(value, tuple):
        return " + ".join(_text(v, quantity) for v in value) if quantity else " x ".join(_text(v, None) for v in value)
    if isinstance(value, str):
        return value
    return show(value, quantity, DIGITS) if quantity else number(float(value), DIGITS)


def _derived(crane: Crane) -> Iterator[Row]:
    """Totals that a reader checks first. Speeds are without leakage, at the outer diameter as in published numbers."""
    kind = SourceKind.DERIVED.value
    for name, circuit in crane.circuits.items():
        D_m, D_p = circuit.motor.D_total, circuit.pump.D_total
        yield Row(f"{name}.motor.D_total", "all motors", show(D_m, "displacement", DIGITS), kind, "count x D_max")
        yield Row(f"{name}.pump.D_total", "all pumps", show(D_p, "displacement", DIGITS), kind, "sum of D")
    for name, circuit in crane.circuits.items():
        leak, total = form_of(circuit), show(stated_leak(circuit), "leakage", 4)
        source = f'table, C_1 and C_2; form "{leak.form}"'
        yield Row(f"{name}.leak", f"pumps and motors at {point_text(leak.at)}", total, kind, source)
    winch, drum = crane.plant.type, crane.drum
    v_w = winch.full_speed(crane, 1.0) / crane.i_hD * drum.d_max / 2
    yield Row("v_w", "wire speed at full command", show(v_w, "speed"), kind, "paper E eq. 9 without leakage")
    alpha_min = winch.least_displacement(crane)
    if alpha_min < 1.0:
        fast = show(v_w / alpha_min, "speed")
        yield Row("v_w_max", "wire speed at full command, motors at alpha_min", fast, kind, "v_w / alpha_min")
    length = show(wire_capacity(drum, crane.wire), "length")
    yield Row("drum.capacity", "wire on the full drum", length, kind, "layers x turns at wire centres")
    J = show(effective_inertia(crane), "inertia")
    yield Row("inertia.sum", "effective inertia from its parts", J, kind, "motors + J_gear + (J_drum + wire) / i_hD^2")
