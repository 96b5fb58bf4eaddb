"""One shape for pictures of analyses: panels with a light grid, a title on top, a legend below, values in display
units."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.units import in_display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 100
"""Characters in a line of a title."""


def panels(
    size: tuple[float, float], rows: int = 1, columns: int = 1, *, title: str = "", grid: str = "both", **share: Any
) -> tuple[Figure, list[Axes]]:
    """A figure of so many inches with its panels, row by row. grid: "both", "x", "y" or "" for none; share: sharex and
    sharey of matplotlib."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=size, layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False, **share).ravel())
    for ax in axes if grid else ():
        ax.grid(axis=grid, alpha=0.3)
        ax.set_axisbelow(True)
    if title:
        figure.suptitle("\n".join(textwrap.wrap(title, COLUMNS)), fontsize="medium")
    return figure, axes


def legend_below(figure: Figure, ax: Axes, columns: int = 4) -> None:
    """What the lines of a panel are, below all panels."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize="small", frameon=False)


def displayed(values: Any, kind: str) -> Any:
    """Values of a kind of quantity in its display unit, flat; a pure number ("") as it is."""
    flat = np.asarray(values, dtype=np.float64).ravel()
    return np.array([in_display(float(x), kind) for x in flat]) if kind else flat
