"""The readable crane sheet: every number of a crane with its value, its kind and its source."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple, get_args

from pydantic.fields import FieldInfo

from stillhook.crane import Crane, Source, SourceKind, Spec, effective_inertia
from stillhook.units import KINDS, Quantity, number, show

DIGITS = 6  # significant digits on the sheet; published numbers have up to 5


class Row(NamedTuple):
    """One number: dotted field, what it means, its value in display units, how far to trust it, where it is from."""

    field: str
    meaning: str
    value: str
    kind: str
    source: str


class Section(NamedTuple):
    """Rows of one table of the crane file."""

    title: str
    rows: tuple[Row, ...]


class _Item(NamedTuple):
    path: str
    meaning: str
    value: Any
    quantity: str | None


def sheet(crane: Crane) -> tuple[Section, ...]:
    """Sections of rows, in the order of the crane file; the last one follows from the others.

    Values are in display units (bar, L/min, rev/min, cm^3/rev, mm, t). ``sheet_json`` has the same in SI.
    """
    sections: dict[str, list[Row]] = {}
    for item in _items(crane):
        table = item.path.rpartition(".")[0] or "crane"
        source = _source(crane, item.path)
        row = Row(item.path, item.meaning, _text(item.value, item.quantity), source.kind.value, source.text)
        sections.setdefault(table, []).append(row)
    sections["derived"] = list(_derived(crane))
    return tuple(Section(title, tuple(rows)) for title, rows in sections.items())


def sheet_json(crane: Crane) -> dict[str, Any]:
    """The sheet in SI, ready for JSON: dotted field to value, unit (none for ratios and texts), kind and source."""
    fields = {}
    for item in _items(crane):
        source = _source(crane, item.path)
        value = list(item.value) if isinstance(item.value, tuple) else item.value
        unit = KINDS[item.quantity].si if item.quantity else None
        fields[item.path] = {"value": value, "unit": unit, "kind": source.kind.value, "source": source.text}
    return {"name": crane.name, "title": crane.title, "fields": fields}


def _items(spec: Spec, path: str = "") -> Iterator[_Item]:
    """Every value below a table, depth first; absent options and the sources themselves are left out."""
    for name, field in type(spec).model_fields.items():
        value = getattr(spec, name)
        place = f"{path}.{name}" if path else name
        if value is None or name == "sources":
            continue
        if isinstance(value, Spec):
            yield from _items(value, place)
        else:
            plain = str(value) if isinstance(value, str) else value
            yield _Item(place, field.description or name, plain, _quantity(field))


def _quantity(field: FieldInfo) -> str | None:
    """Kind of quantity of a field, also of an optional one or of a list."""
    marks = list(field.metadata)
    for inner in get_args(field.annotation):
        marks += getattr(inner, "__metadata__", ())
    return next((mark.kind for mark in marks if isinstance(mark, Quantity)), None)


def _source(crane: Crane, path: str) -> Source:
    named = {"name", "title"}
    without = "name of the crane" if path in named else "not stated"
    if path == "i_hD":
        return crane.sources.get(path, Source(text="product of gear_ratios", kind=SourceKind.DERIVED))
    return crane.sources.get(path, Source(text=without, kind=SourceKind.USER))


def _text(value: Any, quantity: str | None) -> str:
    if isinstance(value, tuple):
        return " + ".join(_text(v, quantity) for v in value) if quantity else " x ".join(_text(v, None) for v in value)
    if isinstance(value, str):
        return value
    return show(value, quantity, DIGITS) if quantity else number(float(value), DIGITS)


def _derived(crane: Crane) -> Iterator[Row]:
    """Totals that a reader checks first. Speeds are without leakage, at the outer diameter as in published numbers."""
    kind = SourceKind.DERIVED.value
    for name in ("active", "passive"):
        circuit = getattr(crane, name)
        if circuit is not None:
            D_m, D_p = circuit.motor.D_total, circuit.pump.D_total
            yield Row(f"{name}.motor.D_total", "all motors", show(D_m, "displacement", DIGITS), kind, "count x D_max")
            yield Row(f"{name}.pump.D_total", "all pumps", show(D_p, "displacement", DIGITS), kind, "sum of D")
    pump, motor, drum = crane.active.pump, crane.active.motor, crane.drum
    v_w = pump.D_total * pump.omega_p / motor.D_total / crane.i_hD * drum.d_max / 2
    yield Row("v_w", "wire speed, full pumps and motors", show(v_w, "speed"), kind, "paper E eq. 9 without leakage")
    fast = show(v_w / motor.alpha_min, "speed")
    yield Row("v_w_max", "wire speed, full pumps, motors at alpha_min", fast, kind, "v_w / alpha_min")
    length = sum(math.pi * (drum.d + (2 * i + 1) * crane.wire.d) * drum.turns for i in range(drum.layers))
    yield Row("drum.capacity", "wire on the full drum", show(length, "length"), kind, "layers x turns at wire centres")
    J = show(effective_inertia(crane), "inertia")
    yield Row("inertia.sum", "effective inertia from its parts", J, kind, "motors + J_gear + (J_drum + wire) / i_hD^2")
