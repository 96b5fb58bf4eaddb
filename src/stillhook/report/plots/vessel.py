"""The picture of a vessel: its six motions over the wave period, from head to following sea."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.plots.run import COLOURS, GREY
from stillhook.sea.vessel.long_wave import long_wave_limits, long_wave_scales
from stillhook.sea.vessel.rao import DOFS, Rao

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADINGS = ((0, "following"), (45, ""), (90, "from starboard"), (135, ""), (180, "head"))
LONGEST = 30.0  # s: shown of longer tables


def vessel_figure(rao: Rao, point: tuple[float, float] | None = None) -> Figure:
    """Amplitudes over period of six motions, and with a point (x, y) [m] of its vertical motion; dots: the table,
    curves: what is used."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(11.0, 8.0 if point is None else 10.5), layout="constrained")
    axes = figure.subplots(2 if point is None else 3, 3)
    period = np.linspace(2.0 * math.pi / rao.omega[-1], min(LONGEST, 2.0 * math.pi / rao.omega[0]), 800)
    omega = 2.0 * math.pi / period
    for d, (dof, ax) in enumerate(zip(DOFS, axes.flat, strict=False)):
        scale, unit = (1.0, "m/m") if d < 3 else (180.0 / math.pi, "deg/m")
        _curves(ax, rao, period, scale * np.abs(rao.at(omega, _beta())[d]))
        _dots(ax, rao, scale, d)
        limit = scale * float(np.abs(long_wave_limits(np.array([_STEEPEST[dof]]))[d, 0]))
        top = ax.get_ylim()[1]
        ax.plot(
            period,
            limit * long_wave_scales(omega, rao.depth)[d],
            color=GREY,
            lw=0.8,
            ls=":",
            label="body that rides on the water",
        )
        ax.set_ylim(top=top)
        ax.set_title(f"{dof} [{unit}]", fontsize="medium")
    if point is not None:
        _points(figure, axes[2], rao, period, point)
    for ax in axes.flat:
        ax.grid(alpha=0.3)
        ax.set_ylim(bottom=0.0)
    for ax in [*axes[:2].flat, *axes[2:, :2].flat]:
        ax.set_xlim(period[0], period[-1])
    for ax in axes[-1, : 3 if point is None else 2]:
        ax.set_xlabel("wave period [s]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize="small", frameon=False)
    figure.suptitle(
        "\n".join(textwrap.wrap(f"{rao.name}, reference point: {rao.origin or 'not stated'}", 110)), fontsize="medium"
    )
    return figure


_STEEPEST = {
    "surge": 0.0,
    "sway": math.pi / 2.0,
    "heave": 0.0,
    "roll": math.pi / 2.0,
    "pitch": 0.0,
    "yaw": math.pi / 4.0,
}
"""Heading of the largest limit [rad]."""


def _beta() -> FloatArray:
    return np.radians([float(h) for h, _ in HEADINGS])


def _curves(ax: Any, rao: Rao, period: FloatArray, sizes: FloatArray) -> None:
    for (heading, word), size, colour in zip(HEADINGS, sizes, COLOURS, strict=False):
        ax.plot(period, size, color=colour, lw=1.3, label=f"{heading} deg{' ' + word if word else ''}")


def _dots(ax: Any, rao: Rao, scale: float, d: int) -> None:
    for (heading, _), colour in zip(HEADINGS, COLOURS, strict=False):
        near = np.flatnonzero(np.abs(rao.beta - math.radians(heading)) < 1e-3)
        if len(near):
            ax.plot(2.0 * math.pi / rao.omega, scale * np.abs(rao.H[d, near[0]]), ".", color=colour, ms=3.5)


def _points(figure: Any, axes: Any, rao: Rao, period: FloatArray, point: tuple[float, float]) -> None:
    """Vertical motion of the point with waves from starboard, along, and from port."""
    x, y = point
    omega = 2.0 * math.pi / period
    for ax, side, title in (
        (axes[0], 1.0, "from starboard (0 to 180 deg)"),
        (axes[1], -1.0, "from port (360 to 180 deg)"),
    ):
        _curves(ax, rao, period, np.abs(rao.vertical(omega, side * _beta(), x, y)))
        ax.set_title(f"point x {x:g} m, y {y:g} m, waves\n{title} [m/m]", fontsize="medium")
    angles = np.radians(np.arange(0.0, 361.0, 5.0))
    for T, colour in ((6.0, COLOURS[0]), (8.0, COLOURS[1]), (10.0, COLOURS[2]), (14.0, COLOURS[3])):
        sizes = np.abs(rao.vertical([2.0 * math.pi / T], angles, x, y)[:, 0])
        axes[2].plot(np.degrees(angles), sizes, color=colour, lw=1.3, label=f"{T:g} s")
    axes[2].set_title("the same over the heading [m/m]", fontsize="medium")
    axes[2].set_xlabel("waves travel, ccw from the bow [deg]")
    axes[2].set_xticks(range(0, 361, 90))
    axes[2].legend(fontsize="small")
