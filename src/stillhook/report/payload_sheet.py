"""Numbers of a payload: covered, over submergence, near the bottom, and their
picture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from pydantic import BaseModel

from stillhook.engine.pack.payload import COLUMNS, pack_payload
from stillhook.physics.load_path.payload import WettedLevel
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.lift.payload import RHO_STEEL, Payload
from stillhook.spec.scenario import RHO_SEA
from stillhook.units import Quantity, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OF_LEVEL = ("h", "V", "A33", "dA33", "B")
"""Numbers of a level on the sheet; dA33 is the slope just below the level."""
SLOPES = [COLUMNS.index("dA33"), COLUMNS.index("dA33_next")]
DEPTH = 1000.0
"""Depth in the record [m]; no number of the sheet depends on it."""


def payload_numbers(payload: Payload, rho: float) -> dict[str, Any]:
    """Numbers of a payload in water of density rho [kg/m^3], in SI, named as in `stillhook.variables`.

    Errors: LiftError where it floats.
    """
    record, rows = pack_payload(payload, rho, DEPTH)
    covered, slopes = WettedLevel(*rows[-1].tolist()), rows[:, SLOPES]
    V, A33, B = covered.V, covered.A33, covered.B
    W_sub = record.W - rho * record.g * V
    heaviest, (level, end) = float(slopes.max()), np.unravel_index(slopes.argmax(), slopes.shape)
    return {
        "payload": payload.name,
        "title": payload.title,
        "shape": "levels" if payload.shape is None else payload.shape.kind,
        "mass": payload.mass,
        "height": payload.height,
        "rho": rho,
        "V": V,
        "W_sub": W_sub,
        "A33": A33,
        "A_p": payload.covered(rho).A_p,
        "C_D": payload.C_D,
        "v_sink": math.sqrt(W_sub / B) if B > 0.0 else None,
        "F_slam_1": heaviest,
        "h_slam": float(rows[level + end, 0]) if heaviest > 0.0 else None,
        "reach": record.reach,
        "gap": record.gap_0,
        "settlement": payload.seabed.settlement,
        "v_bottom": math.sqrt(W_sub / (B * (1.0 + record.bottom_B))) if B > 0.0 else None,
        "levels": [{name: row[COLUMNS.index(name)] for name in OF_LEVEL} for row in rows.tolist()],
        "sources": (
            [{"field": k, "kind": s.kind.value, "source": s.text} for k, s in payload.sources.items()]
            + _unstated(payload)
        ),
    }


def _unstated(payload: Payload) -> list[dict[str, str]]:
    """Values used for relevant numbers that were not given."""
    if payload.shape is None:
        return []
    defaults = {
        "C_D": "default of the shape",
        "C_s": "default of the shape",
        "engaged": "default, a quarter of the height under the roof",
    }
    has = {"C_D", *type(payload.shape).model_fields}
    rows = {name: ("assumed", text) for name, text in defaults.items() if name in has}
    if payload.volume is None:
        rows["volume"] = ("derived", f"mass over that of steel, {RHO_STEEL:g} kg/m^3")
    rows |= {f"seabed.{name}": ("assumed", "default") for name in ("settlement", "zeta")}
    return [
        {"field": name, "kind": kind, "source": text}
        for name, (kind, text) in rows.items()
        if name not in payload.sources
    ]


DERIVED = (
    ("displaced volume", "V", "volume"),
    ("submerged weight", "W_sub", "force"),
    ("added mass in heave", "A33", "mass"),
    ("area that drag acts on", "A_p", "area"),
)
LEFT_OUT = ("shape",)
"""Fields that name a model and have no number."""


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
            rows.append([*entry, source.kind.value, source.text])
    return rows


def _entry(payload: Payload, path: str) -> tuple[str, str] | None:
    """Subject of a field and its value with its unit; None for a field without a number. Parts are in the order in
    which they are named."""
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


def payload_figure(of: Payload, *, rho: float = RHO_SEA) -> Figure:
    """Displaced volume, added mass, slamming at 1 m/s and drag of a payload over its submergence.

    Dots: the levels that a run uses.

    Parameters
    ----------
    of : Payload
        From `stillhook.read_payload`.
    rho : float, default 1025.0
        Density of the water [kg/m^3].

    Returns
    -------
    Figure
        Of matplotlib.
    """
    record, rows = pack_payload(of, rho, DEPTH)
    h = rows[:, COLUMNS.index("h")]
    smooth = of.curve(rho)
    title = f"{of.name}: {of.title or 'payload of your own'}"
    figure, grid = kit.panels(1, 4, (11.0, 4.5), title, sharey=True)
    axes = grid[0]
    for ax, name, x, y in (
        (axes[0], "displaced volume [m^3]", smooth.V, rows[:, COLUMNS.index("V")]),
        (axes[1], "added mass [t]", smooth.A33 / 1e3, rows[:, COLUMNS.index("A33")] / 1e3),
        (axes[3], "drag at 1 m/s [kN]", 0.5 * rho * of.C_D * smooth.A_p / 1e3, rows[:, COLUMNS.index("B")] / 1e3),
    ):
        ax.plot(x, smooth.h, color=COLOURS[0], lw=1.2)
        ax.plot(y, h, ".", ms=2, color=COLOURS[1])
        kit.axis(ax, name)
    axes[2].plot(rows[:-1, SLOPES].ravel() / 1e3, np.repeat(h, 2)[1:-1], color=COLOURS[1], lw=1.2)
    kit.axis(axes[2], "slamming at 1 m/s [kN]")
    for ax in axes:
        ax.axhline(of.height, color=GREY, lw=0.8, ls=":")
        ax.set_xlim(left=0.0)
    kit.axis(axes[0], y="underside under the surface [m]\n(dotted: covered)")
    axes[0].set_ylim(record.reach, 0.0)
    return figure
