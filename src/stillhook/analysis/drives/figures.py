"""Picture of drives side by side: error and energy with their bands."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from stillhook.analysis.drives.comparison import DriveComparison
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS
from stillhook.units import in_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def bars_figure(comparison: DriveComparison, *, title: str = "") -> Figure:
    """Error and net energy of every drive, bars at the nominal values and the 5 to 95 % band of the draws."""
    runs = comparison.ordered()
    bands = f", lines: 5 to 95 % of {comparison.n} draws" if comparison.n else ", nothing drawn"
    text = f"{title}{bands}; not validated"
    figure, axes = kit.panels(1, 2, (10.0, 1.8 + 0.5 * len(runs)), text, grid="x", sharey=True)
    axes = axes.ravel()
    scales: dict[str, tuple[Callable[[float], float], str]] = {
        "e_c_pp": (lambda x: in_unit(x, "mm", "length"), "error, peak to peak [mm]"),
        "energy_net": (lambda x: in_unit(x, "kWh", "energy"), "net energy [kWh per hour]"),
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
        places, [run.name if run.ok else f"{run.name}\n({run.status})" for run in runs], fontsize="small"
    )
    axes[0].invert_yaxis()
    return figure
