"""Figure of the landing's limits over tolerance, payload and depth."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stillhook.plan.report.figures.style import COLOUR, MARKER, page
from stillhook.plan.report.words import named, names
from stillhook.report import kit
from stillhook.report.formatting import direction
from stillhook.report.plots.colours import GREY

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


TICKS = (0.05, 0.1, 0.2, 0.5)
"""Tolerances that are labelled [m]."""
ROWS = {"period": "Tp", "payload": "mass", "depth": "depth", "delay": "delay"}
"""What a row of panels varies, and the coordinate by which its panels are in order."""


def sweep(block: xarray.Dataset) -> Figure:
    """Limit over tolerance: rows of panels for periods, payloads, depths and delays, each with the plan as it is in its
    middle period; a line with its 95 % interval for every alternative."""
    varied = [str(x) for x in block["varied"].values]
    rows: list[list[int]] = []
    for name, coordinate in ROWS.items():
        places = [i for i, what in enumerate(varied) if what in ("", name)]
        if name in varied:
            order = np.argsort(block[coordinate].values[places], kind="stable")
            rows.append([places[i] for i in order])
    rows = rows or [[0]]
    across = max(map(len, rows))
    title = f"Over the seabed: limit over tolerance, waves at {direction(block.attrs['beta'])}"
    figure, axes = page(len(rows), across, 0.7 + 2.5 * len(rows), title, sharex=True, sharey=True)
    for line, places in zip(axes, rows, strict=True):
        for ax, i in zip(line, places, strict=False):
            _panel(ax, block.isel(variant=i))
        kit.hide(line[len(places) :])
    first = axes[0, 0]
    first.set_xscale("log")
    first.set_xticks(TICKS, [f"{x:g}" for x in TICKS])
    first.minorticks_off()
    first.set_ylim(0.0, 1.04 * float(block["height"].values[-1]))
    for ax in axes[:, 0]:
        kit.axis(ax, y="limiting Hs [m]", size="small")
    for ax in axes[-1]:
        kit.axis(ax, "tolerance [m]", size="small")
    kit.legend_below(figure, [first])
    return figure


def _panel(ax: Axes, of: xarray.Dataset) -> None:
    """One payload at one depth. Lines end where the limit leaves the ladder of heights."""
    x, top = of["landing_tolerance"].values, float(of["height"].values[-1])
    for name in names(of):
        value, low, high = (
            np.asarray(of[f"Hs_landing{end}"].sel(alternative=name).values, dtype=float)
            for end in ("", "_low", "_high")
        )
        shown = np.where(value > 0.0, np.minimum(value, top), np.nan)
        inside, ends = (value > 0.0) & (low < math.inf), (np.minimum(low, top), np.minimum(high, top))
        style = {"color": COLOUR[name], "marker": MARKER[name], "label": named(name)}
        kit.band(ax, x, shown, *ends, where=inside, alpha=0.1, ms=3, lw=1.2, **style)
    own = float(of.attrs["own"])
    if math.isfinite(own):
        ax.axvline(own, color=GREY, lw=0.9, ls=":")
    planned = " (as planned)" if str(of["varied"].values) in ("", "period") else ""
    kit.axis(ax, title=f"{of['variant'].values}{planned}", size="small")
