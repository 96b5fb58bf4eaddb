"""Pictures of a lift's response by the frequency-domain method: a year of records, and spectra in one sea."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GAP = 3.0
"""Spacings of records from which a line is broken: months without measurements are not drawn over."""
FEW = 50
"""Records up to which each has a dot."""


def year_figure(data: xarray.Dataset, title: str) -> Figure:
    """Speed of the tip, and motion of the load compensated and on the brake: over time, and against the height of the
    sea."""
    figure = kit.canvas(11.0, 10.0, title, wrap=100)
    rows = figure.add_gridspec(3, 2, height_ratios=(1.0, 1.2, 1.5))
    top = figure.add_subplot(rows[0, :])
    middle = figure.add_subplot(rows[1, :], sharex=top)
    tip, load = figure.add_subplot(rows[2, 0]), figure.add_subplot(rows[2, 1])
    H_s, speed = data["H_m0"].values, kit.display(data["sigma_v"].values, "speed")
    lines = (
        ("sigma_load_braked", COLOURS[1], "load, winch on its brake"),
        ("sigma_load", COLOURS[2], "load, compensated"),
    )
    _over_time(top, data, speed, COLOURS[0], "crane tip")
    for name, colour, label in (*lines, ("sigma_u", GREY, "wire's upper end, compensated")):
        _over_time(middle, data, data[name].values, colour, label)
    dots = tip.scatter(H_s, speed, c=data["T_m02"].values, s=3.0, cmap="viridis", linewidths=0.0)
    figure.colorbar(dots, ax=tip, label="zero-crossing period of the waves [s]")
    for name, colour, label in lines:
        load.scatter(H_s, data[name].values, color=colour, s=3.0, linewidths=0.0, label=label)
    for ax in (middle, load):
        ax.set_yscale("log")
    for ax in (top, middle, tip, load):
        ax.grid(alpha=0.3)
    kit.axis(top, y="sigma of the\ntip's speed [m/min]", zero="y")
    kit.axis(middle, "time (UTC)", "sigma of height [m]")
    kit.axis(tip, "H_m0 [m]", "sigma of the tip's speed [m/min]", zero="xy")
    kit.axis(load, "H_m0 [m]", "sigma of the load's height [m]", zero="x")
    middle.set_ylim(top=2.5 * middle.get_ylim()[1])
    kit.legend(middle, "upper center", ncols=3)
    kit.legend(load, markerscale=4.0)
    return figure


def _over_time(ax: Axes, data: xarray.Dataset, y: FloatArray, colour: str, label: str) -> None:
    """Numbers over time, broken at gaps; a dot for each record of few."""
    t = data["time"].values
    step = np.diff(t)
    gaps = np.flatnonzero(step > GAP * np.median(step)) + 1 if len(step) else np.zeros(0, dtype=int)
    dot = "." if len(t) < FEW else ""
    ax.plot(np.insert(t, gaps, t[gaps]), np.insert(y, gaps, np.nan), color=colour, lw=0.7, marker=dot, label=label)


def sea_figure(omega: FloatArray, spectra: dict[str, FloatArray], T_wire: float, title: str) -> Figure:
    """Densities of height over frequency in one sea [m^2 s/rad], by what moves; the load's first natural period
    marked."""
    figure, ax = kit.panel((9.0, 5.5), f"{title}\nshown of the compensated: the part that follows the tip")
    highest = max(float(S.max()) for S in spectra.values())
    for (label, S), colour in zip(spectra.items(), (COLOURS[0], GREY, COLOURS[1], COLOURS[2]), strict=True):
        ax.plot(omega, np.maximum(S, 1e-12), color=colour, lw=1.4, label=label)
    natural = 2.0 * math.pi / T_wire
    if natural < omega[-1]:
        ax.axvline(natural, color=GREY, ls=":", lw=1.0, label=f"natural period of load and wire, {T_wire:.3g} s")
    ax.set_yscale("log")
    if highest > 0.0:
        ax.set_ylim(1e-6 * highest, 3.0 * highest)
    ax.set_xlim(float(omega[0]), min(float(omega[-1]), 2.0))
    kit.axis(ax, "angular frequency [rad/s]", "density of height [m² s/rad]")
    kit.legend(ax)
    return figure
