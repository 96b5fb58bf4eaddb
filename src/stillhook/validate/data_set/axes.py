"""Common parts of the validation figures: axes, legend outside the data, colours of measured and simulated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.report.plots.run import COLOURS
from stillhook.validate.data_set.campaign import Campaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED, SIMULATED = COLOURS[0], COLOURS[1]


def axes_of(rows: int, columns: int, size: tuple[float, float], title: str, **more: Any) -> tuple[Figure, Any]:
    """A figure with its axes (rows, columns), always two-dimensional; size [inch]."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **more)
    for ax in np.ravel(axes):
        ax.grid(alpha=0.3)
    figure.suptitle(title, fontsize="medium")
    return figure, axes


def legend_below(figure: Figure, axes: Sequence[Any], columns: int) -> None:
    """One legend of several axes below the figure."""
    pairs = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(
        list(pairs.values()), list(pairs), loc="outside lower center", ncols=columns, fontsize="small", frameon=False
    )


def mark(campaign: Campaign, figures: Iterable[Figure]) -> None:
    """Say in the title of every figure where the data are synthetic."""
    for figure in figures if campaign.synthetic else ():
        figure.suptitle(marked(campaign, figure.get_suptitle()), fontsize="medium")


def marked(campaign: Campaign, title: str) -> str:
    """A title that says where the data are synthetic."""
    return f"SYNTHETIC. {title}" if campaign.synthetic else title
