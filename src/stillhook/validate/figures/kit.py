"""Kit of the figures of a validation: panels, curves of crane and twin over time, clouds of samples, one legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import kit
from stillhook.report.plots.colours import BLACK, BLUE, GREEN, GREY, RED
from stillhook.validate.data_set.campaign import Campaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED, SIMULATED, OTHER, CRANE_FILE, FITTED = BLUE, RED, GREEN, GREY, BLACK
"""Colours: of the crane, the twin, a second run of it, a value of the crane file, and a fit to the logs."""
SHADE = "#DDDDDD"
POINTS = 1500
"""Points of a curve or dots of a cloud: twice the dots that a picture has."""


def panels(
    campaign: Campaign, title: str, rows: int, columns: int, size: tuple[float, float], **more: Any
) -> tuple[Figure, Any]:
    """A figure with its axes (rows, columns), always two-dimensional; size [inch]. The title says where the data are
    synthetic."""
    return kit.panels(rows, columns, size, f"SYNTHETIC. {title}" if campaign.synthetic else title, **more)


@dataclass(frozen=True)
class Curves:
    """A panel over time: t (n,) [s]; measured (n,), None where it was not logged; simulated: label, colour and series
    (n,) of each run of the twin; shaded: spans of time."""

    t: FloatArray
    measured: FloatArray | None
    simulated: Sequence[tuple[str, str, FloatArray]] = ()
    shaded: Sequence[tuple[float, float]] = ()


def over_time(
    campaign: Campaign,
    title: str,
    columns: Sequence[tuple[str, Sequence[Curves]]],
    names: Sequence[str],
    size: tuple[float, float],
    *,
    time: str = "time [s]",
) -> Figure:
    """Measured and simulated curves: columns with a title each, and a panel for each name [unit]."""
    figure, axes = panels(campaign, title, len(names), len(columns), size, sharex="col")
    for column, (heading, curves) in zip(axes.T, columns, strict=True):
        for ax, c in zip(column, curves, strict=True):
            crane(ax, c.t, c.measured)
            for label, colour, y in c.simulated:
                twin(ax, c.t, y, label, colour)
            for a, b in c.shaded:
                ax.axvspan(a, b, color=SHADE, lw=0.0, zorder=0)
        column[0].set_title(heading, fontsize="small")
        column[-1].set(xlabel=time, xlim=(curves[0].t[0], curves[0].t[-1]))
    return finish(figure, axes, names, 4)


def finish(figure: Figure, axes: Any, names: Sequence[str], columns: int) -> Figure:
    """The figure with names of its vertical axes from the top, and one legend of all axes below it."""
    for ax, name in zip(axes[:, 0], names, strict=True):
        ax.set_ylabel(name)
    figure.align_ylabels(axes[:, 0])
    kit.legend_below(figure, np.ravel(axes), columns)
    return figure


def crane(ax: Any, t: FloatArray, y: FloatArray | None) -> None:
    """A measured signal over time; nothing where it was not logged."""
    if y is not None:
        ax.plot(t, y, color=MEASURED, lw=1.6, label="measured")


def twin(ax: Any, t: FloatArray, y: FloatArray, label: str = "simulated", colour: str = SIMULATED) -> None:
    """A simulated signal over time."""
    ax.plot(t, y, color=colour, lw=1.1, ls="--", label=label)


def cloud(ax: Any, x: FloatArray, y: FloatArray, colour: str, label: str) -> None:
    """Samples or windows as dots, some `POINTS` of them."""
    some = slice(None, None, max(1, len(x) // POINTS))
    ax.plot(x[some], y[some], ".", ms=3, alpha=0.6, color=colour, label=label, rasterized=True)


def line(ax: Any, slope: float, ends: Sequence[float], colour: str, label: str | None, style: str = "-") -> None:
    """A straight line through the origin between two places."""
    x = np.asarray(ends)
    ax.plot(x, slope * x, color=colour, lw=1.5, ls=style, label=label)
