"""Pictures of the operating envelope: load over speed, settings over speed, speed by layer."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.analysis.operating_envelope.load_speed import PHYSICAL
from stillhook.analysis.steady.limits import Direction, Limit
from stillhook.library import crane_from_toml
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import in_display

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from stillhook.spec.crane import Crane

RECTANGLES = ("ns", "hs")
"""Modes drawn as filled areas, as in paper C figure 4."""
ANY, MACHINE = "machine, any controller", 5.0
"""Label and width of the line of what the machine can do, which is drawn behind the modes."""
ROOM, MOST_ROOM = 1.12, 1.5
"""Width of the picture over the highest speed in it; more where a hyperbola would else be outside, up to the second."""
FINE = 200
"""Points of a hyperbola."""


def slower(data: xarray.Dataset) -> xarray.DataArray:
    """Highest wire speed in both directions: that of the slower one [m/s], NaN where a mode may not be used."""
    return data["v_w_top"].min("direction", skipna=False)


def load_speed_figure(data: xarray.Dataset, layer: int | None = None, *, title: str = "") -> Figure:
    """Load over highest wire speed by mode, with the classic rectangles, the machine's own limit and hyperbolas of
    constant power.

    Parameters: data from `envelope`; layer one of its layers, None the outermost in it. Of hoisting and lowering the
    slower one counts. Source of the arrangement: Moslatt 2020 paper C figure 4.
    """
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    crane, number = _crane(data), _layer(data, layer)
    layer_data = data.sel(layer=number)
    v = slower(layer_data)
    tonnes = [in_display(float(x), "mass") for x in layer_data["load"].values]
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    ax = figure.subplots()
    for mode, colour in _coloured(layer_data):
        speeds = _display(v.sel(mode=mode).values, "speed")
        most = in_display(float(layer_data["load_most"].sel(mode=mode)), "mass")
        if mode in RECTANGLES:
            _rectangle(ax, speeds, tonnes, most, colour, mode)
        elif mode == PHYSICAL:
            ax.plot(speeds, tonnes, color="black", lw=MACHINE, alpha=0.3, label=ANY, zorder=1)
            _labels(ax, layer_data, speeds, tonnes)
        else:
            ax.plot(speeds, tonnes, color=colour, lw=2.0, label=mode)
    right = _right(layer_data, float(np.nanmax(_display(v.values, "speed"))))
    _hyperbolas(ax, layer_data, crane, right)
    ax.axhline(in_display(crane.SWL, "mass"), color=GREY, lw=0.8, ls=":")
    ax.set(
        xlim=(0.0, right),
        ylim=(0.0, 1.08 * in_display(crane.SWL, "mass")),
        xlabel="wire speed [m/min]",
        ylabel="load [t]",
    )
    ax.grid(alpha=0.3)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small", frameon=False)
    place = f"{crane.name}, layer {number} of {crane.drum.layers}"
    words = title or f"{place}: steady speed that each mode follows, losses included"
    figure.suptitle("\n".join(textwrap.wrap(words, 100)), fontsize="medium")
    return figure


def setting_figure(curves: xarray.Dataset, *, title: str = "") -> Figure:
    """Motor and pump setting over wire speed: complete plant in full lines, the ideal machine of the published figures
    dashed.

    Source of the arrangement: Moslatt 2020 figure 2.17 and paper E figure 4.
    """
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    x = _display(curves["v_w"].values, "speed")
    for mode, colour in _coloured(curves):
        layer_data = curves.sel(mode=mode)
        for ax, name in zip(axes, ("alpha_m", "alpha_p"), strict=True):
            ax.plot(x, layer_data[name], color=colour, lw=1.8, label=mode)
            ax.plot(x, layer_data[f"{name}_ideal"], color=colour, lw=1.0, ls="--")
        for meets in layer_data["v_w_cross"].values:
            if np.isfinite(meets):
                axes[0].plot(
                    in_display(float(meets), "speed"),
                    np.interp(meets, curves["v_w"], layer_data["alpha_m"]),
                    "o",
                    color=colour,
                    ms=5,
                )
    axes[1].axhline(1.0, color="black", lw=0.8)
    axes[1].text(0.0, 1.0, " pumps full", va="bottom", fontsize="small")
    axes[0].set(ylabel="motors alpha_m [-]", ylim=(0.4, 1.05))
    axes[1].set(ylabel="pumps alpha_p [-]", ylim=(0.0, 1.3), xlabel="wire speed [m/min]", xlim=(0.0, float(x[-1])))
    for ax in axes:
        ax.grid(alpha=0.3)
    axes[0].plot([], [], color=GREY, ls="--", lw=1.0, label="without leakage, published diameter")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize="small", frameon=False)
    figure.suptitle("\n".join(textwrap.wrap(title or _curve_title(curves), 100)), fontsize="medium")
    return figure


def layer_figure(data: xarray.Dataset, *, title: str = "") -> Figure:
    """Highest wire speed by layer, one panel a load of the data, one colour a mode; the slower direction counts."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    crane, v = _crane(data), slower(data)
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, data.sizes["load"], sharey=True))
    for ax, load in zip(axes, data["load"].values, strict=True):
        for mode, colour in _coloured(data):
            black = mode == PHYSICAL
            speeds = _display(v.sel(mode=mode, load=load).values, "speed")
            style = (
                {"color": "black", "lw": MACHINE, "alpha": 0.3, "zorder": 1}
                if black
                else {"color": colour, "lw": 1.6, "marker": "o", "ms": 3}
            )
            ax.plot(data["layer"], speeds, label=ANY if black else mode, **style)
        ax.set(xlabel="layer, 1 on the bare drum", title=f"{in_display(float(load), 'mass'):g} t")
        ax.grid(alpha=0.3)
    axes[0].set(ylabel="highest wire speed [m/min]")
    axes[0].set_ylim(bottom=0.0)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize="small", frameon=False)
    figure.suptitle(title or f"{crane.name}: highest steady wire speed by layer", fontsize="medium")
    return figure


def _rectangle(ax: Any, speeds: Sequence[float], tonnes: Sequence[float], most: float, colour: str, mode: str) -> None:
    """A classic mode's range: filled up to the load that it may carry."""
    inside = [(v, t) for v, t in zip(speeds, tonnes, strict=True) if np.isfinite(v)]
    if not inside:
        return
    xs, ys = [v for v, _ in inside], [t for _, t in inside]
    ax.fill([0.0, *xs, xs[-1], 0.0], [0.0, *ys, min(most, ys[-1]), min(most, ys[-1])], color=colour, alpha=0.15, lw=0)
    ax.plot([*xs, 0.0], [*ys, ys[-1]], color=colour, lw=1.6, label=f"{mode} (to {most:g} t)")


def _labels(ax: Any, layer_data: xarray.Dataset, speeds: Sequence[float], tonnes: Sequence[float]) -> None:
    """What binds the machine where it is not the pumps' flow, once for each limit, at its lowest load."""
    way = layer_data["v_w_top"].sel(mode=PHYSICAL).fillna(np.inf).argmin("direction")
    names = layer_data["binds"].sel(mode=PHYSICAL).isel(direction=way).values
    for name in dict.fromkeys(str(n) for n in names if n != Limit.PUMP.value):
        i = next(i for i, n in enumerate(names) if n == name and np.isfinite(speeds[i]))
        ax.annotate(f" {name}", (speeds[i], tonnes[i]), fontsize="small", va="bottom")


def _right(layer_data: xarray.Dataset, top: float) -> float:
    """Right end of the speed axis [m/min]."""
    if "v_w_power" not in layer_data:
        return max(ROOM * top, 1.0)
    hyperbola = in_display(float(layer_data["v_w_power"].min()), "speed")
    return max(ROOM * top, min(ROOM * hyperbola, MOST_ROOM * top), 1.0)


def _hyperbolas(ax: Any, layer_data: xarray.Dataset, crane: Crane, right: float) -> None:
    """The forces that go with full pumps at one pressure: load against speed at constant power."""
    loads = np.linspace(0.0, crane.SWL, FINE)
    both = (
        ("v_w_power", "constant power at relief pressure", "-."),
        ("v_w_power_rule", "constant power of the 30 % rule", ":"),
    )
    for name, label, style in both:
        if name not in layer_data:
            continue
        weight = layer_data["load"].values + crane.hook_mass
        power = float(np.nanmedian(layer_data[name].values * weight))  # speed times weight is the same at every load
        speeds = _display(power / (loads + crane.hook_mass), "speed")
        inside = speeds <= right
        if inside.any():
            ax.plot(speeds[inside], _display(loads[inside], "mass"), color=GREY, lw=1.3, ls=style, label=label)


def _coloured(data: xarray.Dataset) -> list[tuple[str, str]]:
    modes = [str(m) for m in data["mode"].values]
    return list(zip(modes, COLOURS * 3, strict=False))


def _curve_title(curves: xarray.Dataset) -> str:
    load, crane = in_display(float(curves.attrs["load"]), "mass"), _crane(curves)
    way = Direction(curves.attrs["direction"])
    return (
        f"{crane.name}, {load:g} t, layer {curves.attrs['layer']}, {way}: settings of motors and pumps at a steady wire"
        " speed"
    )


def _crane(data: xarray.Dataset) -> Crane:
    return crane_from_toml(str(data.attrs["crane"]), "stored crane")


def _layer(data: xarray.Dataset, layer: int | None) -> int:
    return int(data["layer"].max()) if layer is None else layer


def _display(values: Any, kind: str) -> Any:
    return np.array([in_display(float(v), kind) for v in np.asarray(values).ravel()])
