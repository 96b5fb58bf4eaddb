"""Pictures of the operating envelope: load over speed, settings over speed, speed by layer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.analysis.steady.envelope import PHYSICAL
from stillhook.analysis.steady.limits import Direction, Limit
from stillhook.base.arrays import FloatArray
from stillhook.library import crane_from_toml
from stillhook.report import kit
from stillhook.report.plots.colours import GREY, colours_of
from stillhook.units import in_display

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from stillhook.spec.crane import Crane

RECTANGLES = ("ns", "hs")
"""Modes drawn as filled areas, as in paper C figure 4."""
MACHINE: dict[str, Any] = {"color": "black", "lw": 5.0, "alpha": 0.3, "zorder": 1, "label": "machine, any controller"}
"""The line of what the machine can do, behind the modes."""
ROOM, MOST_ROOM = 1.12, 1.5
"""Width of the picture over the highest speed in it; more where a hyperbola would else be outside, up to the second."""
FINE = 200
"""Points of a hyperbola."""
HYPERBOLAS = (
    ("v_w_power", "constant power at relief pressure", "-."),
    ("v_w_power_rule", "constant power of the 30 % rule", ":"),
)


def slower(data: xarray.Dataset) -> xarray.DataArray:
    """Highest wire speed in both directions: that of the slower one [m/s], NaN where a mode may not be used."""
    return data["v_w_top"].min("direction", skipna=False)


def load_speed_figure(data: xarray.Dataset) -> Figure:
    """Load over highest wire speed of each mode, with the rectangles of the classic modes and lines of equal power.

    On the outermost of the layers, the slower of hoisting and lowering. Arrangement: Moslatt 2020 paper C figure 4.

    Parameters
    ----------
    data : Dataset
        From `stillhook.analysis.envelope`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    crane, number = _crane(data), int(data["layer"].max())
    of_layer = data.sel(layer=number)
    v, tonnes = slower(of_layer), kit.display(of_layer["load"].values, "mass")
    place = f"{crane.name}, layer {number} of {crane.drum.layers}"
    figure, ax = kit.panel((9.0, 6.0), f"{place}: steady speed that each mode follows, losses included")
    for mode, colour in _coloured(of_layer):
        speeds = kit.display(v.sel(mode=mode).values, "speed")
        if mode in RECTANGLES:
            most = in_display(float(of_layer["load_most"].sel(mode=mode)), "mass")
            _rectangle(ax, speeds, tonnes, most, colour, mode)
        elif mode == PHYSICAL:
            ax.plot(speeds, tonnes, **MACHINE)
            _labels(ax, of_layer, speeds, tonnes)
        else:
            ax.plot(speeds, tonnes, color=colour, lw=2.0, label=mode)
    right = _right(of_layer, float(np.nanmax(kit.display(v.values, "speed"))))
    _hyperbolas(ax, of_layer, crane, right)
    SWL = in_display(crane.SWL, "mass")
    ax.axhline(SWL, color=GREY, lw=0.8, ls=":")
    ax.set(xlim=(0.0, right), ylim=(0.0, 1.08 * SWL), xlabel="wire speed [m/min]", ylabel="load [t]")
    kit.legend_below(figure, [ax], 4)
    return figure


def setting_figure(data: xarray.Dataset, *, title: str = "") -> Figure:
    """Displacement of motors and pumps over wire speed by mode, with losses and (dashed) for the ideal machine.

    Arrangement: Moslatt 2020 figure 2.17 and paper E figure 4.

    Parameters
    ----------
    data : Dataset
        From `stillhook.analysis.setting_curves`.
    title : str, default ""
        Above the figure, in place of crane, load and direction.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    load, way = in_display(float(data.attrs["load"]), "mass"), Direction(data.attrs["direction"])
    place = f"{_crane(data).name}, {load:g} t, layer {data.attrs['layer']}, {way}"
    title = title or f"{place}: settings of motors and pumps at a steady wire speed"
    figure, axes = kit.panels(2, 1, (9.0, 6.5), title, sharex=True)
    axes = axes.ravel()
    x = kit.display(data["v_w"].values, "speed")
    for mode, colour in _coloured(data):
        of_mode = data.sel(mode=mode)
        for ax, name in zip(axes, ("alpha_m", "alpha_p"), strict=True):
            ax.plot(x, of_mode[name], color=colour, lw=1.8, label=mode)
            ax.plot(x, of_mode[f"{name}_ideal"], color=colour, lw=1.0, ls="--")
        meets = of_mode["v_w_cross"].values
        meets = meets[np.isfinite(meets)]
        at = np.interp(meets, data["v_w"], of_mode["alpha_m"])
        axes[0].plot(kit.display(meets, "speed"), at, "o", color=colour, ms=5)
    axes[1].axhline(1.0, color="black", lw=0.8)
    axes[1].text(0.0, 1.0, " pumps full", va="bottom", fontsize="small")
    axes[0].set(ylabel="motors alpha_m [-]", ylim=(0.4, 1.05))
    axes[1].set(ylabel="pumps alpha_p [-]", ylim=(0.0, 1.3), xlabel="wire speed [m/min]", xlim=(0.0, float(x[-1])))
    axes[0].plot([], [], color=GREY, ls="--", lw=1.0, label="without leakage, published diameter")
    kit.legend_below(figure, [axes[0]], data.sizes["mode"] + 1)
    return figure


def layer_figure(data: xarray.Dataset) -> Figure:
    """Highest wire speed over the layer of wire, a panel for each load.

    Parameters
    ----------
    data : Dataset
        From `stillhook.analysis.envelope` with several layers.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    v, title = slower(data), f"{_crane(data).name}: highest steady wire speed by layer"
    figure, axes = kit.panels(1, data.sizes["load"], (9.0, 5.0), title, sharey=True)
    axes = axes.ravel()
    for ax, load in zip(axes, data["load"].values, strict=True):
        for mode, colour in _coloured(data):
            style = MACHINE if mode == PHYSICAL else {"color": colour, "lw": 1.6, "marker": "o", "ms": 3, "label": mode}
            ax.plot(data["layer"], kit.display(v.sel(mode=mode, load=load).values, "speed"), **style)
        ax.set(xlabel="layer, 1 on the bare drum", title=f"{in_display(float(load), 'mass'):g} t")
    axes[0].set(ylabel="highest wire speed [m/min]")
    axes[0].set_ylim(bottom=0.0)
    kit.legend_below(figure, [axes[0]], data.sizes["mode"])
    return figure


def _rectangle(ax: Any, speeds: FloatArray, tonnes: FloatArray, most: float, colour: str, mode: str) -> None:
    """A classic mode's range: filled up to the load that it may carry."""
    inside = [(v, t) for v, t in zip(speeds, tonnes, strict=True) if np.isfinite(v)]
    if not inside:
        return
    xs, ys = [v for v, _ in inside], [t for _, t in inside]
    ax.fill([0.0, *xs, xs[-1], 0.0], [0.0, *ys, min(most, ys[-1]), min(most, ys[-1])], color=colour, alpha=0.15, lw=0)
    ax.plot([*xs, 0.0], [*ys, ys[-1]], color=colour, lw=1.6, label=f"{mode} (to {most:g} t)")


def _labels(ax: Any, of_layer: xarray.Dataset, speeds: FloatArray, tonnes: FloatArray) -> None:
    """What binds the machine where it is not the pumps' flow, once for each limit, at its lowest load."""
    way = of_layer["v_w_top"].sel(mode=PHYSICAL).fillna(np.inf).argmin("direction")
    names = of_layer["binds"].sel(mode=PHYSICAL).isel(direction=way).values
    for name in dict.fromkeys(str(n) for n in names if n != Limit.PUMP.value):
        i = next(i for i, n in enumerate(names) if n == name and np.isfinite(speeds[i]))
        ax.annotate(f" {name}", (speeds[i], tonnes[i]), fontsize="small", va="bottom")


def _right(of_layer: xarray.Dataset, top: float) -> float:
    """Right end of the speed axis [m/min]."""
    hyperbola = in_display(float(of_layer["v_w_power"].min()), "speed") if "v_w_power" in of_layer else 0.0
    return max(ROOM * top, min(ROOM * hyperbola, MOST_ROOM * top), 1.0)


def _hyperbolas(ax: Any, of_layer: xarray.Dataset, crane: Crane, right: float) -> None:
    """The forces that belong to full pumps at one pressure: load against speed at constant power."""
    loads = np.linspace(0.0, crane.SWL, FINE)
    for name, label, style in HYPERBOLAS if "v_w_power" in of_layer else ():
        weight = of_layer["load"].values + crane.hook_mass
        power = float(np.nanmedian(of_layer[name].values * weight))  # speed times weight is the same at every load
        speeds = kit.display(power / (loads + crane.hook_mass), "speed")
        inside = speeds <= right
        if inside.any():
            ax.plot(speeds[inside], kit.display(loads[inside], "mass"), color=GREY, lw=1.3, ls=style, label=label)


def _coloured(data: xarray.Dataset) -> list[tuple[str, str]]:
    return list(colours_of(map(str, data["mode"].values)).items())


def _crane(data: xarray.Dataset) -> Crane:
    return crane_from_toml(str(data.attrs["crane"]), "stored crane")
