"""The controllers at a steady speed and their linear loop: reduction of the displacement, setting curves, operating
range, stability, and the block diagram."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.analysis.loop_stability.stability import gain_limit
from stillhook.analysis.loop_stability.sweeps import gain_limit_figure, slow_sweep, sweep
from stillhook.analysis.steady.envelope import envelope, setting_curves
from stillhook.analysis.steady.figures import load_speed_figure, setting_figure
from stillhook.analysis.steady.limits import Direction, Station
from stillhook.analysis.steady.steady_state import wire_out_on
from stillhook.control.commands import displacement_ssc, reduction_cubic, reduction_linear
from stillhook.engine.pack.winch import gains, wire_speed_max
from stillhook.library import load_crane
from stillhook.report import kit
from stillhook.spec.scenario import Mode
from stillhook.thesis.gallery import Axis, Curve, Drawing, Panel, Printed, Table
from stillhook.thesis.quay import CRANE

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from stillhook.spec.crane import Crane

SETTINGS_TITLE = "nov-250t, empty hook, outermost layer: motors and pumps at a steady wire speed"
MODES = ("ns", "hs", "ssc", "ssc-cubic")
HS_LOAD = 90e3
"""60 % of the SWL of the 150 t crane [kg]."""


def reduction(law: str, alpha_min: str) -> Drawing:
    """Displacement that SSC commands over the feedforward (2.16, E3: linear; C13: cubic)."""
    u_ff, linear = np.linspace(-1.0, 1.0, 201), law == "linear"
    k_red = [reduction_linear(u, 0.6) if linear else reduction_cubic(u, 0.6) for u in u_ff]
    alpha = np.array([displacement_ssc(k, float(alpha_min)) for k in k_red])
    curve = Curve(f"{law}, least displacement {alpha_min}", u_ff, alpha)
    axes = Axis("feedforward of the pumps"), Axis("motor displacement over its maximum")
    printed = [
        Printed("full displacement up to", "60 %", f"{100.0 * float(u_ff[alpha > 1.0 - 1e-9].max()):.0f} %"),
        Printed("least displacement at", "100 %", f"{100.0 * float(u_ff[np.argmin(alpha)]):+.0f} %"),
    ]
    return Drawing("Motor displacement by the feedforward", [Panel(*axes, [curve])], printed=printed)


def settings(found: xarray.Dataset | None = None) -> Drawing:
    """Motors and pumps at a steady wire speed by controller (2.17, E4)."""
    curves = setting_curves(CRANE, modes=MODES) if found is None else found
    cross = 60.0 * float(curves["v_w_cross_ideal"].sel(mode="ssc", classic="ns"))
    top, top_ns = tops(CRANE, 0.0, "ssc", "ns")
    data = curves[["u_p", "alpha_m"]] if {"u_p", "alpha_m"} <= set(curves) else curves
    return Drawing(
        SETTINGS_TITLE,
        draw=lambda: setting_figure(curves, title=SETTINGS_TITLE),
        tables={"data": _table(data)},
        printed=[
            Printed("highest speed of SSC", "above NS and HS at the same load", f"{top:.0f} m/min, NS {top_ns:.0f}"),
            Printed("the curves of SSC and NS cross", "at some point", f"at {cross:.0f} m/min"),
        ],
    )


def tops(crane: Crane, load: float, *modes: str) -> list[float]:
    """Highest speed of each controller with a load [kg] on the outermost layer [m/min]."""
    station = Station(crane, load, wire_out_on(crane, crane.drum.layers), Direction.HOISTING)
    return [60.0 * station.top_of_mode(Mode(mode)).v_w for mode in modes]


def _table(data: xarray.Dataset) -> Table:
    frame = data.to_dataframe().dropna(how="all").reset_index()
    return Table(list(frame.columns), frame.values.tolist())


def operating_range() -> Drawing:
    """Highest wire speed by load, the rectangles of NS and HS in it (C4)."""
    crane = load_crane("nov-150t")
    data = envelope(crane)
    hs, ns, ssc = tops(crane, HS_LOAD, "hs", "ns", "ssc-cubic")
    return Drawing(
        "nov-150t: highest wire speed by load",
        draw=lambda: load_speed_figure(data),
        tables={"data": _table(data["v_w_top"].to_dataset())},
        printed=[
            Printed("HS with 90 t", "90 m/min", f"{hs:.1f} m/min"),
            Printed("speed above 90 t, SSC over NS", "up to 30 %", f"{100.0 * (ssc / ns - 1.0):.0f} % at 90 t"),
        ],
    )


def gain_limits() -> Drawing:
    """Gain K_p of marginal stability over the motor displacement (E5)."""
    data = sweep(CRANE)
    limits = [gain_limit(CRANE, D / 1075).K_p_ms for D in (1075, 645)]
    return Drawing(
        "nov-250t: gain of marginal stability over displacement",
        draw=lambda: gain_limit_figure(CRANE, data, slow_sweep(CRANE)),
        tables={"data": _table(data)},
        printed=[
            Printed("gain used", "0.16 1/m, well below", f"{CRANE.control.K_p:g} 1/m"),
            Printed("at less displacement", "lower", f"{limits[0]:.3f} 1/m full, {limits[1]:.3f} 1/m at 645 cm³/rev"),
        ],
    )


BLOCKS = {
    "tip": (0.0, 2.0, "crane tip\nv_tip, a_tip"),
    "feedforward": (2.6, 2.0, "feedforward\n−(K_1 v + K_2 a) K_wire α_m"),
    "sum": (4.9, 2.0, "+"),
    "pumps": (6.4, 2.0, "pumps\nwith swash servo"),
    "winch": (8.8, 2.0, "circuit, motors,\nwinch, wire"),
    "least": (2.6, 0.0, "least displacement\nmax(absMin, calcMin(F))"),
    "reduction": (4.9, 0.0, "reduction\n1 − k_red (1 − α_min)"),
    "motors": (7.2, 0.0, "motors\nwith swash servo"),
    "error": (2.6, 3.8, "control error\ne = ∫ (v_tip + v_w) dt"),
    "gain": (4.9, 3.8, "−K_p"),
}
"""Blocks of the controller: place and text."""
ARROWS = (
    *(("tip", "feedforward", ""), ("feedforward", "sum", "u_ff"), ("sum", "pumps", "u_p"), ("pumps", "winch", "α_p")),
    *(("tip", "error", "v_tip"), ("error", "gain", "e"), ("gain", "sum", ""), ("feedforward", "reduction", "u_ff")),
    *(("least", "reduction", "α_min"), ("reduction", "motors", "u_m"), ("motors", "winch", "α_m")),
    *(("winch", "error", "v_w"), ("motors", "feedforward", "α_m measured")),
)
BENT = {("winch", "error"): 0.35, ("motors", "feedforward"): -0.12}
"""Arrows that go around other blocks: how far."""
NEW = ("least", "reduction")
"""Blocks that the classic controller has not."""


def _diagram() -> Figure:
    figure, ax = kit.panel(
        (11.0, 5.5), "The controller of the PLC; red is what the classic controller has not", grid=""
    )
    boxes = {}
    for name, (x, y, text) in BLOCKS.items():
        box = {"boxstyle": "round,pad=0.5", "facecolor": "white", "edgecolor": "#C0392B" if name in NEW else "#333333"}
        boxes[name] = ax.text(x, y, text, ha="center", va="center", fontsize=9, bbox=box, zorder=3).get_bbox_patch()
    for start, end, text in ARROWS:
        (x_1, y_1, _), (x_2, y_2, _) = BLOCKS[start], BLOCKS[end]
        bend = BENT.get((start, end), 0.0)
        style = {"arrowstyle": "-|>", "color": "#333333", "patchA": boxes[start], "patchB": boxes[end]}
        ax.annotate("", (x_2, y_2), (x_1, y_1), arrowprops=style | {"connectionstyle": f"arc3,rad={bend}"})
        x, y = 0.5 * (x_1 + x_2) + 0.5 * bend * (y_2 - y_1), 0.5 * (y_1 + y_2) - 0.5 * bend * (x_2 - x_1)
        ax.text(x, y, text, fontsize=9, ha="center", va="bottom", bbox={"facecolor": "white", "lw": 0, "pad": 1.0})
    ax.set(xlim=(-1.2, 10.2), ylim=(-0.8, 5.0))
    ax.axis("off")
    return figure


def block_diagram() -> Drawing:
    """The controller: feedforward and position loop of the pumps, displacement of the motors (2.15, C14, E2)."""
    ours = f"{gains(CRANE).K_1:.4f} s/m = 1/({60.0 * wire_speed_max(CRANE):.2f} m/min)"
    numbers = [Printed("K_1 of nov-250t", "0.68 s/m (an erratum)", ours)]
    tables = {"data": Table(("from", "to", "signal"), ARROWS)}
    return Drawing("The controller", draw=_diagram, tables=tables, printed=numbers)
