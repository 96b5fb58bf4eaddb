"""A payload's numbers as a reader wants them: in words and units, each with how far it can be trusted and where it is
from."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel

from stillhook.report.payload_sheet import payload_numbers
from stillhook.spec.crane import Source
from stillhook.spec.lift.payload import Payload
from stillhook.units import Quantity, show

DERIVED = (
    ("displaced volume", "V", "volume"),
    ("submerged weight", "W_sub", "force"),
    ("added mass in heave", "A33", "mass"),
    ("area that drag acts on", "A_p", "area"),
)
LEFT_OUT = ("shape",)
"""Fields that name a model and tell no number."""


def payload_rows(payload: Payload, rho: float) -> list[list[str]]:
    """Rows of what it is, value with unit, kind, source: what follows from the payload in water of density rho
    [kg/m^3], and all that was given."""
    numbers = payload_numbers(payload, rho)
    rows = [
        [words, _shown(numbers[name], kind), "derived", "from shape and volume, under water"]
        for words, name, kind in DERIVED
    ]
    if "C_D" not in payload.sources:
        rows.append(["drag coefficient", f"{payload.C_D:.4g}", "assumed", "default of the shape"])
    for path, source in payload.sources.items():
        entry = _entry(payload, path)
        if entry is not None:
            rows.append([*entry, *_stated(source)])
    return rows


def _stated(source: Source) -> tuple[str, str]:
    return source.kind.value, source.text


def _entry(payload: Payload, path: str) -> tuple[str, str] | None:
    """What a field is of and its value with its unit; None for what tells no number. Parts lie in the order in which
    they are named."""
    head, *names = path.split(".")
    if (names[-1:] or [head])[0] in LEFT_OUT:
        return None
    at: Any = payload
    if head == "parts" and len(names) == 2:
        order = list(dict.fromkeys(p.split(".")[1] for p in payload.sources if p.startswith("parts.")))
        parts = getattr(payload.shape, "parts", ())
        if names[0] not in order or order.index(names[0]) >= len(parts):
            return None
        at, prefix, name = parts[order.index(names[0])], f"{names[0]}: ", names[1]
    elif names:
        at, prefix, name = getattr(payload, head, None), f"{head}: ", names[-1]
    else:
        prefix, name = "", head
    owner = next(
        (m for m in (at, getattr(at, "shape", None)) if isinstance(m, BaseModel) and name in type(m).model_fields), None
    )
    if owner is None:
        return None
    field = type(owner).model_fields[name]
    text = _text(getattr(owner, name), field)
    return None if text is None else (f"{prefix}{field.description or name}", text)


def _text(value: Any, field: Any) -> str | None:
    marks = [*field.metadata, *(m for inner in get_args(field.annotation) for m in getattr(inner, "__metadata__", ()))]
    kind = next((m.kind for m in marks if isinstance(m, Quantity)), None)
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    if isinstance(value, str):
        return value
    return f"{value:.6g}" if kind is None else _shown(float(value), kind)


def _shown(value: float, kind: str) -> str:
    """With the unit that one writes for a payload: volumes in cubic metres, not in litres of oil."""
    return f"{value:.5g} m^3" if kind == "volume" else show(value, kind, 5)
