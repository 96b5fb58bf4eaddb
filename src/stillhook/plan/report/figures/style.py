"""How figures of a plan show its alternatives: colour, marker and width of line of each, as wide as a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative
from stillhook.plan.report.words import named, names
from stillhook.report import kit
from stillhook.report.plots.colours import colours_of

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.5
"""Of every figure [inch]: about that of a page, so that its letters are of one size."""
FIRST = (*ALTERNATIVES, *(alternative for alternative in Alternative if alternative not in ALTERNATIVES))
"""Alternatives in the order in which markers are taken: those of every plan first."""
COLOUR: Mapping[str, str] = colours_of(FIRST)
MARKER: Mapping[str, str] = {name: "xsv^oDP*"[i % 8] for i, name in enumerate(FIRST)}
THICK: Mapping[str, float] = {name: max(3.2 - 0.45 * i, 0.5) for i, name in enumerate(FIRST)}
"""Widths of lines: the later drawn is the thinner, so that lines that are one on the other are all seen."""


def page(rows: int, columns: int, tall: float, title: str, **more: Any) -> tuple[Figure, NDArray[Any]]:
    """A figure of the width of a page with its axes (rows, columns); tall [inch]."""
    figure, axes = kit.panels(rows, columns, (WIDTH, tall), title, **more)
    for ax in axes.flat:
        ax.tick_params(labelsize="small")
    return figure, axes


def lines(ax: Axes, x: FloatArray, of: xarray.DataArray, factor: float = 1.0, **style: Any) -> None:
    """A line for every alternative over x; of (alternative, ...)."""
    for name in names(of.to_dataset(name="value")):
        y = factor * np.asarray(of.sel(alternative=name).values, dtype=float)
        if np.isfinite(y).any():
            ax.plot(x, y, **{"color": COLOUR[name], "lw": THICK[name], "label": named(name), **style})
