"""The readable crane sheet: every number of a crane with its value, its kind and its source."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from stillhook.library.leakage import form_of, point_text, stated_leak
from stillhook.library.write import Item, items
from stillhook.spec.crane import Crane, SourceKind, effective_inertia, wire_capacity
from stillhook.units import KINDS, number, show

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
        value = _text(item.value, item.quantity)
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
        leak = form_of(circuit)
        meaning = f"pumps and motors at {point_text(leak.at)}"
        yield Row(
            f"{name}.leak",
            meaning,
            show(stated_leak(circuit), "leakage", 4),
            kind,
            f'table, C_1 and C_2; form "{leak.form}"',
        )
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
