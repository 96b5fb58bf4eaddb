"""Picture of the crane tip's motion in a sea: spectra, where speed and acceleration come from, headings, time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.tip import TipPoint, TipResponse, tip_response, tip_responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN, STEP = 60.0, 0.1
"""Of the series: what is shown either side of its fastest moment, and the spacing of its points [s]."""
WAVES = 0.985
"""Part of the sea's variance that the spectra show."""


def tip_figure(rao: Rao, sea: Sea, at: TipPoint, summary: dict[str, Any], motion: IrregularTip) -> Figure:
    """Spectra of sea and tip, where speed and acceleration come from, sigma_v over the heading, and the fastest two
    minutes."""
    response = tip_response(rao, sea, at.x, at.y)
    title = (
        f"{rao.name}, crane tip at {at.describe()}\n{sea.describe()}\nsigma_z {summary['sigma_z']:.3g} m, sigma_v"
        f" {60.0 * summary['sigma_v']:.3g} m/min, sigma_a {summary['sigma_a']:.3g} m/s², T_z {summary['T_z']:.3g} s"
    )
    figure, axes = kit.panels(2, 2, (11.0, 8.5), title)
    _spectra(axes[0, 0], response)
    _origins(axes[0, 1], response)
    _headings(axes[1, 0], rao, sea, at)
    _series(axes[1, 1], motion)
    return figure


def _spectra(ax: Axes, response: TipResponse) -> None:
    ax.plot(response.omega, response.S_wave, color=COLOURS[0], lw=1.5, label="surface of the sea")
    ax.plot(response.omega, response.S, color=COLOURS[1], lw=1.5, label="height of the tip")
    kit.axis(ax, "frequency [rad/s]", "density [m² s/rad]", zero="y")
    grown = np.cumsum(response.S_wave * response.weight)
    ax.set_xlim(0.0, float(response.omega[np.searchsorted(grown, WAVES * grown[-1])]))
    kit.legend(ax)


def _origins(ax: Axes, response: TipResponse) -> None:
    ends = response.omega_table[1]
    parts = ((0, "height", COLOURS[1]), (2, "speed", COLOURS[2]), (4, "acceleration", COLOURS[3]))
    for order, label, colour in parts:
        grown = np.cumsum(response.omega**order * response.S * response.weight)
        if grown[-1] > 0.0:
            ax.plot(response.omega, 100.0 * grown / grown[-1], color=colour, lw=1.5, label=label)
    ax.axvline(ends, color=GREY, ls=":", label="end of the vessel's table")
    kit.axis(ax, "frequency [rad/s]", "variance of the tip up to there [%]")
    ax.set(xlim=(0.0, 1.1 * ends), ylim=(0.0, 103.0))
    kit.legend(ax, "center")


def _headings(ax: Axes, rao: Rao, sea: Sea, at: TipPoint) -> None:
    first = sea.trains[0].beta
    turns = np.radians(np.arange(0.0, 361.0, 10.0))
    for colour, label, y in ((COLOURS[1], "this tip", at.y), (COLOURS[5], "tip on the other side", -at.y)):
        sigma_v = [60.0 * response.sigma_v for response in tip_responses(rao, sea, at.x, y, turns - first)]
        ax.plot(np.degrees(turns), sigma_v, color=colour, lw=1.5, label=label)
    ax.axvline(math.degrees(first) % 360.0, ymax=0.85, color=GREY, ls=":", label="this heading")
    waves = "waves" if len(sea.trains) == 1 else "first waves, all of them turned"
    where = "0 following, 90 from starboard, 180 head sea, 270 from port"
    kit.axis(ax, f"heading of the {waves} [deg]\n{where}", "sigma_v [m/min]")
    ax.set(xlim=(0.0, 360.0), ylim=(0.0, 1.25 * ax.get_ylim()[1]), xticks=range(0, 361, 45))
    kit.legend(ax, "upper center", ncols=3)


def _series(ax: Axes, motion: IrregularTip) -> None:
    t = np.arange(0.0, motion.repeat, STEP)
    fastest = t[np.argmax(np.abs(motion.sample(t)[1]))]
    start = min(max(0.0, fastest - SHOWN), max(0.0, motion.repeat - 2.0 * SHOWN))
    t = np.arange(start, min(start + 2.0 * SHOWN, motion.repeat), STEP)
    s, v, _ = motion.sample(t)
    ax.plot(t, s, color=COLOURS[1], lw=1.5, label="height [m]")
    ax.plot(t, v, color=COLOURS[2], lw=1.0, label="speed [m/s]")
    kit.axis(ax, "time [s], about the fastest moment of the series")
    ax.set_xlim(t[0], t[-1])
    kit.legend(ax, "upper right")
