"""Numbers of a payload: covered, over submergence, near the bottom, and their
picture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.engine.pack.payload import COLUMNS, pack_payload
from stillhook.physics.load_path.payload import WettedLevel
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.lift.payload import RHO_STEEL, Payload

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


def payload_figure(payload: Payload, rho: float) -> Figure:
    """Displaced volume, added mass, its slope as slamming at 1 m/s, and drag over submergence; dots: the levels that a
    run uses."""
    record, rows = pack_payload(payload, rho, DEPTH)
    h = rows[:, COLUMNS.index("h")]
    smooth = payload.curve(rho)
    title = f"{payload.name}: {payload.title or 'payload of your own'}"
    figure, grid = kit.panels(1, 4, (11.0, 4.5), title, sharey=True)
    axes = grid[0]
    for ax, name, x, y in (
        (axes[0], "displaced volume [m^3]", smooth.V, rows[:, COLUMNS.index("V")]),
        (axes[1], "added mass [t]", smooth.A33 / 1e3, rows[:, COLUMNS.index("A33")] / 1e3),
        (axes[3], "drag at 1 m/s [kN]", 0.5 * rho * payload.C_D * smooth.A_p / 1e3, rows[:, COLUMNS.index("B")] / 1e3),
    ):
        ax.plot(x, smooth.h, color=COLOURS[0], lw=1.2)
        ax.plot(y, h, ".", ms=2, color=COLOURS[1])
        kit.axis(ax, name)
    axes[2].plot(rows[:-1, SLOPES].ravel() / 1e3, np.repeat(h, 2)[1:-1], color=COLOURS[1], lw=1.2)
    kit.axis(axes[2], "slamming at 1 m/s [kN]")
    for ax in axes:
        ax.axhline(payload.height, color=GREY, lw=0.8, ls=":")
        ax.set_xlim(left=0.0)
    kit.axis(axes[0], y="underside under the surface [m]\n(dotted: covered)")
    axes[0].set_ylim(record.reach, 0.0)
    return figure
