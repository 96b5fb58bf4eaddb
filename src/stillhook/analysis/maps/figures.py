"""Pictures of a map: load over speed for every controller on one scale, where each cannot be used and why, and
changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.controllers import PLAIN
from stillhook.analysis.maps.result import BEST_CLASSIC, SHOWN, Map
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import CLASSIC
from stillhook.report import kit
from stillhook.units import show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEQUENTIAL, DIVERGING = "viridis", "PuOr_r"
"""Colours that colour-blind readers can distinguish, and that keep their order in grey."""
HATCHES = ("///", "...", "xx", "\\\\\\", "++", "oo", "--", "**", "||", "OO", "x.", "/.")
SHADE, LINES, LIGHT = "#d0d0d0", "#333333", "#e8e8e8"
BANDS = 21
"""Colours on a scale: few enough to be distinguished and to survive a small picture; odd, so that no change has a
colour of its own."""
LEVELS = 7
"""Contours, about."""
PANEL = (4.6, 3.4)
"""Size of one panel [inch]."""
TITLES = {"e_c_pp": "control error", "p_max": "peak pressure", "settling_time": "settling time"}


def figures(result: Map) -> dict[str, Figure]:
    """Every picture of a map by the name of its file: one for each value of `SHOWN`, and one of the changes against the
    best classic controller; maps over layers or periods choose one of each for every layer and period.
    """
    out: dict[str, Figure] = {}
    for k, layer in enumerate(result.axes.layers):
        for j, period in enumerate(result.axes.periods):
            tail = "".join(
                [f"-layer-{layer}" if layer is not None else "", f"-{period:g}-s" if period is not None else ""]
            )
            for name in SHOWN:
                if name in result.values:
                    out[f"{name}{tail}"] = value_figure(result, name, layer=k, period=j)
            if (changes := change_figure(result, layer=k, period=j)) is not None:
                out[f"change{tail}"] = changes
    return out


def value_figure(
    result: Map, name: str, *, layer: int = 0, period: int = 0, labels: Sequence[str] | None = None
) -> Figure:
    """One value over load and speed, a panel for each controller, all on one scale that the applicable cells set.

    Parameters: name of the value; layer, period places along those axes; labels: controllers to show (default all).
    Cells in which the controller is not applicable are grey, with a hatching for each cause.
    Source of the arrangement: Moslatt 2020 paper E figures 7, 8, 10 and 11.
    """
    words, factor, _ = SHOWN[name]
    rows = [result.labels.index(x) for x in labels or result.labels]
    usable = result.applicable[:, :, :, layer, period]
    values = result.values[name][:, :, :, layer, period] * factor
    finite = values[rows][usable[rows] & np.isfinite(values[rows])]
    low, high = (float(finite.min()), float(finite.max())) if finite.size and np.ptp(finite) > 0.0 else (0.0, 1.0)
    causes = _causes(result, rows, layer, period)
    figure, axes = _panels(len(rows), _title(result, layer, period))
    for ax, i in zip(axes, rows, strict=False):
        shown = np.where(usable[i], values[i], np.nan)
        mesh = _mesh(ax, result, shown, SEQUENTIAL, low, high)
        if result.labels[i] != BEST_CLASSIC:  # a patchwork, whose seam is no slope
            _contours(ax, result, shown, low, high)
        _forbidden(ax, result, result.cause[i, :, :, layer, period], causes)
        ax.set_title(_heading(result.labels[i]), fontsize="medium")
    figure.colorbar(mesh, ax=list(axes), label=words, shrink=0.9)
    _legend(figure, causes)
    return figure


def change_figure(result: Map, *, layer: int = 0, period: int = 0) -> Figure | None:
    """Change of error and pressure, or of settling time, against the best classic controller [%]; None where nothing is
    compared.

    A row of panels for each controller that is not classic, one panel for each value. Grey: one of the two is not
    applicable.
    """
    wanted = [x for x, m in zip(result.labels, result.modes, strict=True) if x != BEST_CLASSIC and m not in CLASSIC]
    changes = result.changes()
    if not changes or not wanted:
        return None
    title = f"{_title(result, layer, period)}; grey: {BEST_CLASSIC} or the new controller is not applicable"
    figure, axes = _panels(len(wanted) * len(changes), title, len(changes))
    panels = [(label, name) for label in wanted for name in changes]
    parts = {(x, n): 100.0 * changes[n][result.labels.index(x), :, :, layer, period] for x, n in panels}
    finite = np.concatenate([p[np.isfinite(p)] for p in parts.values()])
    most = float(np.max(np.abs(finite))) if finite.size else 1.0
    for ax, (label, name) in zip(axes, panels, strict=False):
        ax.set_facecolor(SHADE)
        mesh = _mesh(ax, result, parts[label, name], DIVERGING, -most, most)
        ax.set_title(f"{_heading(label)}: {TITLES[name]}", fontsize="medium")
    figure.colorbar(mesh, ax=list(axes), label="change against best classic [%]", shrink=0.9)
    return figure


def _panels(n: int, title: str, across: int | None = None) -> tuple[Figure, list[Any]]:
    """A figure of n panels, two across from four panels on."""
    columns = across or (n if n < 4 else 2)
    rows = -(-n // columns)
    size = (PANEL[0] * columns + 1.2, PANEL[1] * rows + 0.9)
    figure, axes = kit.panels(rows, columns, size, title, grid="", sharex=True, sharey=True)
    axes = axes.ravel()
    for ax in axes[-columns:]:
        ax.set_xlabel("speed [m/min]")
    for ax in axes[::columns]:
        ax.set_ylabel("load [t]")
    for ax in axes[n:]:
        ax.set_visible(False)
    return figure, list(axes[:n])


def _scales(result: Map) -> tuple[FloatArray, FloatArray]:
    """Speeds [m/min] and loads [t]."""
    return kit.display(result.axes.speeds, "speed"), kit.display(result.axes.loads, "mass")


def _edges(centres: FloatArray) -> FloatArray:
    """Borders of the cells round their centres."""
    if len(centres) == 1:
        half = 0.5 * centres[0] if centres[0] > 0.0 else 0.5
        return np.array([centres[0] - half, centres[0] + half])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2.0 * centres[0] - middle[0]], middle, [2.0 * centres[-1] - middle[-1]]])


def _mesh(ax: Any, result: Map, values: FloatArray, colours: str, low: float, high: float) -> Any:
    """Cells in colour."""
    from matplotlib import colormaps

    speeds, loads = _scales(result)
    bands = colormaps[colours].resampled(BANDS)
    return ax.pcolormesh(_edges(speeds), _edges(loads), np.ma.masked_invalid(values), cmap=bands, vmin=low, vmax=high)


def _contours(ax: Any, result: Map, values: FloatArray, low: float, high: float) -> None:
    """Contours at the same levels in every panel: light on dark colours, dark on light ones; none where the cells are
    too few or alike."""
    from matplotlib.ticker import MaxNLocator

    levels = [x for x in MaxNLocator(LEVELS).tick_values(low, high) if low < x < high]
    finite = values[np.isfinite(values)]
    crossed = [x for x in levels if finite.size and finite.min() < x < finite.max()]
    if min(values.shape) < 2 or not crossed:
        return
    colours = [LIGHT if x < 0.6 * high + 0.4 * low else LINES for x in crossed]
    lines = ax.contour(*_scales(result), np.ma.masked_invalid(values), levels=crossed, colors=colours, linewidths=0.8)
    ax.clabel(lines, fontsize="x-small", fmt="%g")


def _causes(result: Map, rows: Sequence[int], layer: int, period: int) -> dict[str, str]:
    """Cause -> hatching, for the causes that show."""
    causes = sorted({str(c) for i in rows for c in result.cause[i, :, :, layer, period].ravel() if c})
    return dict(zip(causes, HATCHES * 2, strict=False))


def _forbidden(ax: Any, result: Map, cause: NDArray[Any], causes: dict[str, str]) -> None:
    """Cells in which the controller is not applicable, hatched by cause."""
    from matplotlib.patches import Rectangle

    speeds, loads = (_edges(x) for x in _scales(result))
    for m in range(cause.shape[0]):
        for n in range(cause.shape[1]):
            if cause[m, n]:
                corner, width, height = (speeds[n], loads[m]), speeds[n + 1] - speeds[n], loads[m + 1] - loads[m]
                hatch = causes[str(cause[m, n])]
                ax.add_patch(
                    Rectangle(corner, width, height, facecolor=SHADE, edgecolor=LINES, hatch=hatch, linewidth=0.0)
                )


def _legend(figure: Figure, causes: dict[str, str]) -> None:
    from matplotlib.patches import Patch

    if causes:
        patches = [Patch(facecolor=SHADE, edgecolor=LINES, hatch=h, label=c, linewidth=0.0) for c, h in causes.items()]
        figure.legend(
            handles=patches,
            loc="outside lower center",
            ncols=min(len(patches), 3),
            fontsize="small",
            title="not applicable",
        )


def _heading(label: str) -> str:
    return PLAIN[label].law.label if label in PLAIN else label


def _title(result: Map, layer: int, period: int) -> str:
    """Crane, wire and motion in one line."""
    axes, about = result.axes, result.about
    parts = [result.crane.name, f"{show(axes.s_w[layer], 'length', 3)} of wire out"]
    if axes.layers[layer] is not None:
        parts.append(f"layer {axes.layers[layer]}")
    if (wave := axes.periods[period]) is not None:
        parts.append(f"sine of {show(wave, 'time')}")
    elif "motion" in about:
        parts.append(str(about["motion"]))
    if "wire_step" in about:
        parts.append(f"{'lowering' if about['lowering'] else 'hoisting'}, step of {show(about['wire_step'], 'speed')}")
    return ", ".join(parts)
