"""Moments of a lowering drawn to scale, side by side as a strip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS
from stillhook.report.plots.run import SEABED, STEEL, WATER
from stillhook.spec.lift.lowering import Lowering

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOMENTS = 8
"""Pictures in a row of the strip."""


class TimeSegment(NamedTuple):
    """A part of a run that is worth a picture: samples, and what happens."""

    name: str
    first: int
    last: int


def time_segments(run: xarray.Dataset, lift: Lowering) -> list[TimeSegment]:
    """The passage through the surface and the landing, where there are such."""
    z, out = run["z_load"].values, []
    H = max(lift.payload.height, 2.0)
    wet = np.flatnonzero((z < 0.6 * H) & (z > -1.8 * H))
    if len(wet) > MOMENTS:
        out.append(TimeSegment("through the surface", int(wet[0]), int(wet[-1])))
    down = np.flatnonzero(z <= -lift.depth)
    if len(down):
        above = np.flatnonzero(z[: down[0]] > -lift.depth + 1.0 * H)
        first = int(above[-1]) if len(above) else 0
        dt = float(run["time"][1] - run["time"][0])
        out.append(
            TimeSegment("landing", first, min(int(down[0] + max(10.0 / dt, 0.2 * (down[0] - first))), len(z) - 1))
        )
    return out


def strip(run: xarray.Dataset, lift: Lowering, *, title: str = "") -> Figure:
    """Moments of a lowering side by side: payload, slings, water and seabed, to scale; a row for the surface, one for
    the seabed."""
    rows = time_segments(run, lift) or [TimeSegment("", 0, run.sizes["time"] - 1)]
    views = [_bounds(run, lift, row) for row in rows]
    heights = [1.5 * 0.5 * (b.high - b.low) / b.left for b in views]
    size = 13.0, sum(heights) + 0.7 * len(rows) + 0.5
    text = f"{title} (below each time: tension of the slings)"
    figure, grid = kit.panels(len(rows), MOMENTS, size, text, grid="", height_ratios=heights)
    for row, axes, bounds in zip(rows, grid, views, strict=True):
        for ax, i in zip(axes, np.linspace(row.first, row.last, MOMENTS).astype(int), strict=True):
            draw(ax, run, lift, int(i), bounds)
            F = float(kit.display(run["F_sling"][i], "force"))
            kit.axis(ax, title=f"{float(run['time'][i]):.1f} s\n{F:.0f} kN", size="small")
        axes[0].set_ylabel(f"{row.name}\nheight above still water [m]")
        for ax in axes[1:]:
            ax.set_yticklabels([])
    return figure


class Bounds(NamedTuple):
    """Heights that a picture shows [m], and how far to the left and to the right of the payload."""

    low: float
    high: float
    left: float
    right: float


def _bounds(run: xarray.Dataset, lift: Lowering, row: TimeSegment) -> Bounds:
    z = run["z_load"].values[row.first : row.last + 1]
    H, rig = lift.payload.height, lift.rigging.height
    low = float(z.min()) - 0.3 * H - 1.0
    unit = lift.compensator
    link = 0.0 if unit is None else unit.shortest + unit.travel
    high = float(z.max()) + H + rig + link + 0.3 * H + 1.0
    half = max(0.25 * (high - low), 0.75 * _width(lift))
    return Bounds(low, high, half, half)


def _width(lift: Lowering) -> float:
    """Side of a square as large as the payload's projected area [m]."""
    return max(math.sqrt(lift.payload.covered(lift.rho).A_p), 0.3 * lift.payload.height)


def draw(
    ax: Axes,
    run: xarray.Dataset,
    lift: Lowering,
    i: int,
    bounds: Bounds,
    *,
    tip: float = math.inf,
    water: tuple[FloatArray, FloatArray] | None = None,
) -> None:
    """One moment: sample i, within the bounds; tip: height at which the wire ends [m]; water: the surface as places
    and heights [m], level unless given."""
    from matplotlib.patches import Rectangle

    z, eta = float(run["z_load"][i]), float(run["eta"][i])
    H, w = lift.payload.height, 0.5 * _width(lift)
    sides = np.array([-bounds.left, bounds.right])
    place, surface = (sides, np.array([eta, eta])) if water is None else water
    top, hook, unit = z + H, z + H + lift.rigging.height, lift.compensator
    if unit is not None:
        s = float(run[lift.extension_signal][i])
        ax.plot([0.0, 0.0], [hook, hook + s], color=STEEL, lw=2.0)
        ax.plot([0.0, 0.0], [hook + s, hook + s + unit.shortest], color="black", lw=5.0, solid_capstyle="butt")
    ax.fill_between(place, bounds.low, np.clip(surface, bounds.low, bounds.high), color=WATER, lw=0)
    if -lift.depth > bounds.low:
        ax.fill_between(sides, bounds.low, -lift.depth, color=SEABED, lw=0)
    slack = float(run["F_sling"][i]) <= 0.0
    ax.add_patch(Rectangle((-w, z), 2.0 * w, H, facecolor=STEEL, edgecolor="black", lw=0.8, alpha=0.9))
    for side in (-w, w):
        sag = 0.25 * w if slack else 0.0
        x, y = [side, 0.5 * side + math.copysign(sag, side), 0.0], [top, 0.5 * (top + hook), hook]
        ax.plot(x, y, color=COLOURS[1], lw=1.0)
    wire = hook if unit is None else hook + float(run[lift.extension_signal][i]) + unit.shortest
    ax.plot([0.0, 0.0], [wire, min(bounds.high, tip)], color="black", lw=1.2)
    ax.plot([0.0], [wire], marker="s", color="black", ms=4)
    ax.set(xlim=tuple(sides), ylim=(bounds.low, bounds.high))
    ax.set_aspect("equal")
    ax.set_xticks([])
