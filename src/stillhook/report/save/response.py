"""Files of `stillhook response`: picture, numbers of every sea, summary."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.atomic import atomic_folder
from stillhook.formats.results import save_json, save_run
from stillhook.report.plots.run import COLOURS, GREY, save_figure

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    FloatArray = NDArray[np.float64]

RESPONSE_FILES = ("response.png", "response.nc", "summary.json")
GAP = 3.0
"""Spacings of records from which a line is broken: months without measurements are not drawn over."""


def write_response(out: Path, data: xarray.Dataset, answer: dict[str, Any], figure: Figure) -> None:
    """Write the files of a response, all of them or none."""
    picture, numbers, summary = RESPONSE_FILES
    with atomic_folder(out) as part:
        save_figure(figure, part / picture)
        save_run(data, part / numbers)
        save_json(answer, part / summary)


def year_figure(data: xarray.Dataset, title: str) -> Figure:
    """Speed of the tip, and motion of the load compensated and on the brake: over time, and against the height of the
    sea."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(11.0, 10.0), layout="constrained")
    rows = figure.add_gridspec(3, 2, height_ratios=(1.0, 1.2, 1.5))
    top = figure.add_subplot(rows[0, :])
    middle = figure.add_subplot(rows[1, :], sharex=top)
    tip, load = figure.add_subplot(rows[2, 0]), figure.add_subplot(rows[2, 1])
    H_s, T_z = data["H_m0"].values, data["T_m02"].values
    _over_time(top, data, (("sigma_v", 60.0, COLOURS[0], "crane tip"),))
    lines = (
        ("sigma_load_braked", 1.0, COLOURS[1], "load, winch on its brake"),
        ("sigma_load", 1.0, COLOURS[2], "load, compensated"),
    )
    _over_time(middle, data, (*lines, ("sigma_u", 1.0, GREY, "wire's upper end, compensated")))
    middle.set_yscale("log")
    dots = tip.scatter(H_s, 60.0 * data["sigma_v"].values, c=T_z, s=3.0, cmap="viridis", linewidths=0.0)
    figure.colorbar(dots, ax=tip, label="zero-crossing period of the waves [s]")
    for name, _, colour, label in lines:
        load.scatter(H_s, data[name].values, color=colour, s=3.0, linewidths=0.0, label=label)
    load.set_yscale("log")
    _finish(top, "", "sigma of the\ntip's speed [m/min]", legend=False)
    _finish(middle, "time (UTC)", "sigma of height [m]", legend=False)
    middle.set_ylim(top=2.5 * middle.get_ylim()[1])
    middle.legend(fontsize="small", frameon=False, loc="upper center", ncols=3)
    _finish(tip, "H_m0 [m]", "sigma of the tip's speed [m/min]", legend=False)
    _finish(load, "H_m0 [m]", "sigma of the load's height [m]")
    for ax in (top, tip):
        ax.set_ylim(bottom=0.0)
    for ax in (tip, load):
        ax.set_xlim(left=0.0)
    figure.suptitle(_folded(title), fontsize="medium")
    return figure


def _over_time(ax: Axes, data: xarray.Dataset, lines: tuple[tuple[str, float, str, str], ...]) -> None:
    """Numbers over time, broken at gaps; a dot for a single record."""
    t = data["time"].values
    step = np.diff(t)
    gaps = np.flatnonzero(step > GAP * np.median(step)) + 1 if len(step) else np.zeros(0, dtype=int)
    for name, factor, colour, label in lines:
        y = np.insert(factor * data[name].values, gaps, np.nan)
        ax.plot(np.insert(t, gaps, t[gaps]), y, color=colour, lw=0.7, marker="." if len(t) < 50 else "", label=label)


def sea_figure(omega: FloatArray, spectra: dict[str, FloatArray], T_wire: float, title: str) -> Figure:
    """Densities of height over frequency in one sea [m^2 s/rad], by what moves; the load's first natural period
    marked."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(9.0, 5.5), layout="constrained")
    ax = figure.subplots()
    highest = max(float(S.max()) for S in spectra.values())
    colours = (COLOURS[0], GREY, COLOURS[1], COLOURS[2])
    for (label, S), colour in zip(spectra.items(), colours, strict=True):
        ax.plot(omega, np.maximum(S, 1e-12), color=colour, lw=1.4, label=label)
    natural = 2.0 * math.pi / T_wire
    if natural < omega[-1]:
        ax.axvline(natural, color=GREY, ls=":", lw=1.0, label=f"natural period of load and wire, {T_wire:.3g} s")
    ax.set_yscale("log")
    if highest > 0.0:
        ax.set_ylim(1e-6 * highest, 3.0 * highest)
    ax.set_xlim(float(omega[0]), min(float(omega[-1]), 2.0))
    _finish(ax, "angular frequency [rad/s]", "density of height [m² s/rad]")
    figure.suptitle(f"{_folded(title)}\nshown of the compensated: the part that follows the tip", fontsize="medium")
    return figure


def _folded(title: str) -> str:
    return "\n".join(textwrap.fill(line, 100) for line in title.splitlines())


def _finish(ax: Axes, x: str, y: str, *, legend: bool = True) -> None:
    ax.set(xlabel=x, ylabel=y)
    ax.grid(alpha=0.3)
    if legend:
        ax.legend(fontsize="small", frameon=False, markerscale=4.0)
