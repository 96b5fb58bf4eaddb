"""Picture of a map under many draws: median, the end of the band, and the chance that each controller is applicable."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.analysis.maps.figures import PANEL, SEQUENTIAL
from stillhook.analysis.maps.result import SHOWN
from stillhook.errors import SpecError
from stillhook.units import in_display, quote

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

CHANCES = "cividis"
"""Colours of the chance, distinct from those of values."""
HIGH_PROBABILITY = 0.95
"""Chance at which a line is drawn: applicable in 19 of 20 draws."""


def map_band_figure(data: xarray.Dataset, name: str = "e_c_pp") -> Figure:
    """A row for each controller: median and 95 % end of a value over load and speed on one scale, and the chance that
    it is applicable.

    Parameters: found of `stillhook.analysis.maps.monte_carlo.monte_carlo_map`, one layer and period (select them
    first); name of the value. The scale is that of cells in which the controller is applicable in at least half the
    draws; others are grey. White line: applicable in 95 % of the draws. Errors: SpecError for a value that the map does
    not hold.
    """
    from matplotlib.figure import Figure  # heavy

    if name not in data or name not in SHOWN:
        raise SpecError(f"value {quote(name)}: the map holds {', '.join(n for n in SHOWN if n in data)}.")
    words, factor, _ = SHOWN[name]
    share = data["applicable_chance"].sel(interval="share")
    values = factor * data[name].where(share >= 0.5)
    ends = [float(values.quantile(q)) for q in (0.0, 1.0)] if bool(np.isfinite(values).any()) else [0.0, 1.0]
    labels = [str(c) for c in data["controller"].values]
    figure = Figure(figsize=(3.0 * PANEL[0] + 1.5, PANEL[1] * len(labels) + 0.6), layout="constrained")
    axes = figure.subplots(len(labels), 3, sharex=True, sharey=True, squeeze=False)
    for row, label in zip(axes, labels, strict=True):
        cell = data.sel(controller=label)
        for ax, q, heading in zip(row[:2], data["quantile"].values[1:], ("median", "95 % end"), strict=True):
            mesh = _mesh(ax, cell, values.sel(controller=label, quantile=q), SEQUENTIAL, *ends)
            ax.set_title(f"{label}: {heading}", fontsize="medium")
        chance = share.sel(controller=label)
        chance_mesh = _mesh(row[2], cell, 100.0 * chance, CHANCES, 0.0, 100.0)
        row[2].set_title(f"{label}: applicable", fontsize="medium")
        if min(chance.shape) > 1 and float(chance.min()) < HIGH_PROBABILITY < float(chance.max()):
            for ax in row:
                ax.contour(
                    *_scales(cell),
                    chance.transpose("load", "speed").values,
                    levels=[HIGH_PROBABILITY],
                    colors="white",
                    linewidths=1.2,
                )
    figure.colorbar(mesh, ax=list(axes[:, :2].ravel()), label=words, shrink=0.9)
    figure.colorbar(chance_mesh, ax=list(axes[:, 2]), label="draws in which it is applicable [%]", shrink=0.9)
    for ax in axes[-1]:
        ax.set_xlabel("speed [m/min]")
    for ax in axes[:, 0]:
        ax.set_ylabel("load [t]")
    figure.suptitle(str(data.attrs.get("title", "")).removeprefix("Stillhook "), fontsize="medium")
    return figure


def _scales(cell: xarray.Dataset) -> tuple[Any, Any]:
    """Speeds [m/min] and loads [t]."""
    return tuple(
        np.array([in_display(float(x), kind) for x in cell[n].values])
        for n, kind in (("speed", "speed"), ("load", "mass"))
    )  # type: ignore[return-value]


def _mesh(ax: Any, cell: xarray.Dataset, values: xarray.DataArray, colours: str, low: float, high: float) -> Any:
    ax.set_facecolor("#d0d0d0")
    shown = np.ma.masked_invalid(values.transpose("load", "speed").values)
    return ax.pcolormesh(*_scales(cell), shown, cmap=colours, vmin=low, vmax=high, shading="nearest")
