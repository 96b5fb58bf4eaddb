"""Files that commands leave: of a lowering, of a response, of the crane tip's motion."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_folder
from stillhook.control.supervisor import wire_weight
from stillhook.engine.inputs import twin_line
from stillhook.engine.pack.programme import settings
from stillhook.formats.lift_file import LiftFile, describe_stage
from stillhook.formats.results import save_json, save_run
from stillhook.physics.scalar import G
from stillhook.report.pictures import drawn
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.report.plots.run import Limits, lowering_panels, new_figure, save_animation, save_figure, strip
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.text import motion_to_json
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, tip_motion, tip_motion_exact
from stillhook.sea.vessel.tip import TipPoint, TipResponse, tip_response, tip_responses
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LOWERING_FILES = ("lowering.png", "strip.png", "lowering.nc", "summary.json")
ANIMATION = "lowering.gif"


def lowering_answer(run: xarray.Dataset, file: LiftFile) -> dict[str, Any]:
    """Numbers of one lowering by their names in `stillhook.variables`, SI; those of each stage that was begun in a
    list."""
    single = {str(name): run[name].item() for name in run.data_vars if run[name].dims == ()}
    notes = single.pop("notes")
    names = [str(name) for name in run.data_vars if run[name].dims == ("stage",)]
    stages: list[dict[str, Any]] = []
    for i, label in enumerate(run["stage"].values):
        row = {name.removeprefix("stage_"): float(run[name][i]) for name in names}
        if not math.isnan(row["t_begin"]):
            stage = file.lift.programme[i] if i < len(file.lift.programme) else None
            text = "joystick at rest, the last law goes on" if stage is None else describe_stage(stage)
            stages.append(
                {"name": str(label), "mode": "" if stage is None else stage.mode.value, "described": text, **row}
            )
    head = {"lift": file.lift.name, "crane": file.crane.name, "payload": file.lift.payload.name, "place": file.place}
    status = {"twin": twin_line(file.crane), "status": single.pop("status")}
    return {**head, **status, **single, "notes": [*file.notes, *(notes.split("; ") if notes else [])], "stages": stages}


def static_tension(run: xarray.Dataset, crane: Crane, lift: Lowering) -> FloatArray:
    """Tension at the crane tip with everything at rest at the wetness and wire out of each moment, the load hanging
    free [N]."""
    s = settings(crane, lift)
    h = np.clip(run["eta"].values - run["z_load"].values, 0.0, lift.payload.reach(lift.rho))
    hook = (lift.payload.mass - lift.rho * lift.payload.at(h, lift.rho).V + crane.hook_mass + lift.link_mass) * G
    return np.asarray(hook + np.array([wire_weight(float(x), s) for x in run["s_w"].values]))


def write_lowering(
    out: Path, run: xarray.Dataset, file: LiftFile, answer: dict[str, Any], *, animation: bool
) -> tuple[str, ...]:
    """Write the files of a lowering; all of them or none. Gives their names."""
    crane, lift = file.crane, file.lift
    title = f"{lift.name}: {crane.name}, {file.place}"
    p_relief = crane.active.relief.p if "active" in crane.circuits else None
    limits = Limits(crane.SWL * G + crane.hook_mass * G, p_relief)
    panels, moments, series, numbers = LOWERING_FILES

    def pictures() -> dict[str, Figure]:
        tension = static_tension(run, crane, lift)
        return {
            panels: lowering_panels(run, lift, tension, limits, title=title),
            moments: strip(run, lift, title=lift.name),
        }

    with atomic_folder(out) as part:
        figures = drawn(pictures)
        for name, figure in figures.items():
            save_figure(figure, part / name)
        save_run(run, part / series)
        save_json(answer, part / numbers)
        if animation:
            save_animation(run, lift, part / ANIMATION, title=lift.name)
    return (*figures, series, numbers, *((ANIMATION,) if animation else ()))


RESPONSE_FILES = ("response.png", "response.nc", "summary.json")
GAP = 3.0
"""Spacings of records from which a line is broken: months without measurements are not drawn over."""


def write_response(
    out: Path, data: xarray.Dataset, answer: dict[str, Any], draw: Callable[[], Figure]
) -> tuple[str, ...]:
    """Write the files of a response, all of them or none. Gives their names."""
    picture, numbers, summary = RESPONSE_FILES
    with atomic_folder(out) as part:
        figures = drawn(lambda: {picture: draw()})
        for name, figure in figures.items():
            save_figure(figure, part / name)
        save_run(data, part / numbers)
        save_json(answer, part / summary)
    return (*figures, numbers, summary)


def year_figure(data: xarray.Dataset, title: str) -> Figure:
    """Speed of the tip, and motion of the load compensated and on the brake: over time, and against the height of the
    sea."""
    figure = new_figure(11.0, 10.0)
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
    figure = new_figure(9.0, 5.5)
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
        for name, figure in drawn(lambda: {picture: tip_figure(rao, sea, at, summary, motion)}).items():
            save_figure(figure, part / name)
        (part / harmonics).write_text(motion_to_json(motion) + "\n", encoding="utf-8")
        rows = "".join(f"{x:.1f},{y:.6f}\n" for x, y in zip(t, s, strict=True))
        (part / table).write_text(f"# {motion.describe()}. {motion.report}\ntime [s],tip [m]\n{rows}", encoding="utf-8")
        save_json({**summary, "series": series}, part / numbers)
    return series


def tip_figure(rao: Rao, sea: Sea, at: TipPoint, summary: dict[str, Any], motion: IrregularTip) -> Figure:
    """Spectra of sea and tip, where speed and acceleration come from, sigma_v over the heading, and the fastest two
    minutes."""
    response = tip_response(rao, sea, at.x, at.y)
    figure = new_figure(11.0, 8.5)
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
