"""Pictures of drives side by side: error and energy with their bands, and where the energy of each goes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stillhook.analysis.drives.comparison import DriveComparison, DriveRun
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import in_unit, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_FLOW = 0.01
"""Share of all that comes in below which a flow is added to `others` in a Sankey."""
SMALL = 2e-3
"""Share below which `others` are not drawn."""
HEIGHT = 1.0
"""Height of all that comes in, in the units of a Sankey's axes."""
GAP = 0.06
"""Gap between two bands at one side."""


def kwh(E: float) -> float:
    """An energy [J] in kWh."""
    return in_unit(E, "kWh", "energy")


def bars_figure(comparison: DriveComparison, *, title: str = "") -> Figure:
    """Error and net energy of every drive, bars at the nominal values and the 5 to 95 % band of the draws."""
    runs = comparison.ordered()
    bands = f", lines: 5 to 95 % of {comparison.n} draws" if comparison.n else ", no draws"
    text = f"{title}{bands}; not validated"
    figure, axes = kit.panels(1, 2, (10.0, 1.8 + 0.5 * len(runs)), text, grid="x", sharey=True)
    axes = axes.ravel()
    scales: dict[str, tuple[Callable[[float], float], str]] = {
        "e_c_pp": (lambda x: in_unit(x, "mm", "length"), "error, peak to peak [mm]"),
        "energy_net": (kwh, "net energy [kWh per hour]"),
    }
    places = range(len(runs))
    for ax, (name, (scale, label)), colour in zip(axes, scales.items(), COLOURS, strict=False):
        values = [scale(run.value(name)) for run in runs]
        ax.barh(places, values, color=colour, alpha=0.6)
        for place, run in zip(places, runs, strict=True):
            band = run.band(name)
            if math.isfinite(band.low):
                ax.plot(
                    [scale(band.low), scale(band.high)], [place, place], color="black", lw=2.0, solid_capstyle="butt"
                )
        ax.axvline(0.0, color="black", lw=0.8)
        ax.set_xlabel(label)
    axes[0].set_yticks(
        places, [run.label if run.ok else f"{run.label}\n({run.status})" for run in runs], fontsize="small"
    )
    axes[0].invert_yaxis()
    return figure


def sankey_figure(run: DriveRun) -> Figure:
    """Energy per hour of one drive, from supply (left) to losses (right), the height of a band its energy.

    What a power gives on the whole is on the left, what it takes on the right; flows below 1 % are added up.

    Parameters
    ----------
    run : DriveRun
        One of a comparison of drives.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    e = run.energy
    drawn = {"drawn": e.drawn, **{name: x for name, x in e.supplied.items() if name == "tip"}}
    sinks = {**e.lost, "returned": e.returned, "into stores": e.stored}
    left = {**{k: x for k, x in drawn.items() if x > 0.0}, **{_from(k): -x for k, x in sinks.items() if x < 0.0}}
    right = {**{k: x for k, x in sinks.items() if x > 0.0}, **{f"to the {k}": -x for k, x in drawn.items() if x < 0.0}}
    total = max(sum(left.values()), sum(right.values()), 1.0)
    passing, net = number(kwh(total)), number(kwh(e.net))
    title = f"{run.label}: {passing} kWh per hour pass through; net {net} kWh per hour"
    figure, ax = kit.panel((9.0, 4.0), title, grid="")
    _side(ax, _large(left, total), total, -1.0)
    _side(ax, _large(right, total), total, 1.0)
    ax.set(xlim=(-2.1, 2.1), ylim=(-0.3, HEIGHT + 0.3))
    ax.axis("off")
    return figure


def _from(name: str) -> str:
    return "from stores" if name == "into stores" else f"from {name}"


def _large(flows: Mapping[str, float], total: float) -> list[tuple[str, float]]:
    """Flows, the largest first, those too small to draw added up."""
    large = [(name, x) for name, x in flows.items() if x >= LEAST_FLOW * total]
    small = sum(x for x in flows.values() if x < LEAST_FLOW * total)
    rows = sorted(large, key=lambda row: -row[1])
    return [*rows, ("others", small)] if small > SMALL * total else rows


def _side(ax: Any, flows: Sequence[tuple[str, float]], total: float, side: float) -> None:
    """Bands from the middle to one side, -1 left, 1 right."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    spread = HEIGHT + GAP * (len(flows) - 1)
    inner, outer = HEIGHT, HEIGHT + 0.5 * (spread - HEIGHT)
    for i, (name, x) in enumerate(flows):
        h = HEIGHT * x / total
        top_in, top_out = inner, outer
        a, b, m = 0.12 * side, 1.1 * side, 0.6 * side
        points = [(a, top_in), (m, top_in), (m, top_out), (b, top_out)]
        points += [(b, top_out - h), (m, top_out - h), (m, top_in - h), (a, top_in - h), (a, top_in)]
        codes = [Path.MOVETO, *[Path.CURVE4] * 3, Path.LINETO, *[Path.CURVE4] * 3, Path.CLOSEPOLY]
        grey = name in ("others", "into stores", "from stores")
        colour = GREY if grey else COLOURS[(i + (0 if side > 0 else 2)) % len(COLOURS)]
        ax.add_patch(PathPatch(Path(points, codes), facecolor=colour, alpha=0.6, lw=0.0))
        place = {"va": "center", "ha": "left" if side > 0 else "right", "fontsize": "small"}
        ax.text(b + 0.04 * side, top_out - 0.5 * h, f"{name} {number(kwh(x), 3)}", **place)
        inner, outer = inner - h, outer - h - GAP
    filled = HEIGHT * sum(x for _, x in flows) / total
    ax.fill_between([0.0, 0.12 * side], HEIGHT - filled, HEIGHT, color=GREY, alpha=0.35, lw=0.0)
