"""What `stillhook tip --out` writes: picture, series of the tip's motion, summary."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.atomic import atomic_folder
from stillhook.formats.results import save_json
from stillhook.report.plots.run import COLOURS, GREY, save_figure
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.text import motion_to_json
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, tip_motion, tip_motion_exact
from stillhook.sea.vessel.tip import TipPoint, TipResponse, tip_response, tip_responses

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CSV_STEP = 0.1  # s
SHOWN = 60.0  # s: shown of the series, either side of its fastest moment


def write_tip(
    out: Path,
    names: tuple[str, ...],
    rao: Rao,
    sea: Sea,
    at: TipPoint,
    summary: dict[str, Any],
    *,
    seed: int,
    exact: bool = False,
    amplitudes: str = "fixed",
) -> dict[str, Any]:
    """Picture, series as exact motion (JSON, which runs read) and as table (CSV), summary, together or not at all.

    exact: with the ship's rotations in full, for which the tip's height is needed. amplitudes: as `realise` takes them.
    Returns the facts of the series: seed, repeat [s] and the largest of height, speed and acceleration [SI].
    """
    waves = realise(sea, summary["duration"], seed, amplitudes=amplitudes)
    motion = tip_motion(waves, rao, at.x, at.y) if not exact else tip_motion_exact(waves, rao, at.x, at.y, at.z or 0.0)
    t = np.arange(0.0, motion.repeat, CSV_STEP)
    s, v, a = motion.sample(t)
    series = {
        "seed": seed,
        "repeat": motion.repeat,
        "report": motion.report,
        **{f"{n}_max": float(np.abs(x).max()) for n, x in (("z", s), ("v", v), ("a", a))},
    }
    picture, harmonics, table, numbers = names
    with atomic_folder(out) as part:
        save_figure(tip_figure(rao, sea, at, summary, motion), part / picture)
        (part / harmonics).write_text(motion_to_json(motion) + "\n", encoding="utf-8")
        rows = "".join(f"{x:.1f},{y:.6f}\n" for x, y in zip(t, s, strict=True))
        (part / table).write_text(f"# {motion.describe()}. {motion.report}\ntime [s],tip [m]\n{rows}", encoding="utf-8")
        save_json({**summary, "series": series}, part / numbers)
    return series


def tip_figure(rao: Rao, sea: Sea, at: TipPoint, summary: dict[str, Any], motion: IrregularTip) -> Figure:
    """Spectra of sea and tip, where speed and acceleration come from, sigma_v over the heading, and the fastest two
    minutes."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    response = tip_response(rao, sea, at.x, at.y)
    figure = Figure(figsize=(11.0, 8.5), layout="constrained")
    axes = figure.subplots(2, 2)
    _spectra(axes[0, 0], response)
    _origins(axes[0, 1], response)
    _headings(axes[1, 0], rao, sea, at)
    _series(axes[1, 1], motion)
    for ax in axes.flat:
        ax.grid(alpha=0.3)
    figure.suptitle(
        f"{rao.name}, crane tip at {at.describe()}\n{textwrap.fill(sea.describe(), 120)}\nsigma_z"
        f" {summary['sigma_z']:.3g} m, sigma_v {60.0 * summary['sigma_v']:.3g} m/min, sigma_a {summary['sigma_a']:.3g}"
        f" m/s², T_z {summary['T_z']:.3g} s",
        fontsize="medium",
    )
    return figure


def _reach(response: TipResponse) -> float:
    """Frequency up to which the sea has something to show [rad/s]."""
    grown = np.cumsum(response.S_wave * response.weight)
    return float(response.omega[np.searchsorted(grown, 0.985 * grown[-1])])


def _spectra(ax: Any, response: TipResponse) -> None:
    ax.plot(response.omega, response.S_wave, color=COLOURS[0], lw=1.5, label="surface of the sea")
    ax.plot(response.omega, response.S, color=COLOURS[1], lw=1.5, label="height of the tip")
    ax.set(xlabel="frequency [rad/s]", ylabel="density [m² s/rad]", xlim=(0.0, _reach(response)), ylim=(0.0, None))
    ax.legend(fontsize="small", frameon=False)


def _origins(ax: Any, response: TipResponse) -> None:
    ends = response.omega_table[1]
    parts = ((0, "height", COLOURS[1]), (2, "speed", COLOURS[2]), (4, "acceleration", COLOURS[3]))
    for order, label, colour in parts:
        grown = np.cumsum(response.omega**order * response.S * response.weight)
        if grown[-1] > 0.0:
            ax.plot(response.omega, 100.0 * grown / grown[-1], color=colour, lw=1.5, label=label)
    ax.axvline(ends, color=GREY, ls=":", label="end of the vessel's table")
    ax.set(
        xlabel="frequency [rad/s]",
        ylabel="variance of the tip up to there [%]",
        xlim=(0.0, 1.1 * ends),
        ylim=(0.0, 103.0),
    )
    ax.legend(fontsize="small", frameon=False, loc="center")


def _headings(ax: Any, rao: Rao, sea: Sea, at: TipPoint) -> None:
    first = sea.trains[0].beta
    turns = np.radians(np.arange(0.0, 361.0, 10.0))
    for colour, label, y in ((COLOURS[1], "this tip", at.y), (COLOURS[5], "tip on the other side", -at.y)):
        sigma_v = [60.0 * response.sigma_v for response in tip_responses(rao, sea, at.x, y, turns - first)]
        ax.plot(np.degrees(turns), sigma_v, color=colour, lw=1.5, label=label)
    ax.axvline(math.degrees(first) % 360.0, ymax=0.85, color=GREY, ls=":", label="heading here")
    waves = "waves" if len(sea.trains) == 1 else "first waves, all of them turned"
    ax.set(
        xlabel=f"heading of the {waves} [deg]\n0 following, 90 from starboard, 180 head sea, 270 from port",
        ylabel="sigma_v [m/min]",
    )
    ax.set(xlim=(0.0, 360.0), ylim=(0.0, 1.25 * ax.get_ylim()[1]), xticks=range(0, 361, 45))
    ax.legend(fontsize="small", frameon=False, loc="upper center", ncols=3)


def _series(ax: Any, motion: IrregularTip) -> None:
    t = np.arange(0.0, motion.repeat, CSV_STEP)
    fastest = t[np.argmax(np.abs(motion.sample(t)[1]))]
    start = min(max(0.0, fastest - SHOWN), max(0.0, motion.repeat - 2.0 * SHOWN))
    t = np.arange(start, min(start + 2.0 * SHOWN, motion.repeat), CSV_STEP)
    s, v, _ = motion.sample(t)
    ax.plot(t, s, color=COLOURS[1], lw=1.5, label="height [m]")
    ax.plot(t, v, color=COLOURS[2], lw=1.0, label="speed [m/s]")
    ax.set(xlabel="time [s], about the fastest moment of the series", xlim=(t[0], t[-1]))
    ax.legend(fontsize="small", frameon=False, loc="upper right")
