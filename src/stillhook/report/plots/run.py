"""Pictures of runs and lowerings over time: the four panels of the thesis, a lowering phase by phase; and of a lift's
response by the frequency-domain method: a year of records, and spectra in one sea."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import kit
from stillhook.report.formatting import kind_of
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import WinchMode
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EFFORTS = ("pressure", "torque")
"""Kinds of a signal that shows how hard a winch works."""
WATER, SEABED, STEEL = "#CFE5F2", "#C9B48A", "#444444"
MEAN = 30.0
"""Window whose mean is taken off a height, so that the stretch of the wire is removed with it [s]: the window of the
control error."""
NEAR = 0.7
"""Part of a limit from which on it is drawn."""
GAP = 3.0
"""Spacings of records from which a line is broken: months without measurements are not drawn over."""
FEW = 50
"""Records up to which each has a dot."""


def four_panels(
    runs: Mapping[str, xarray.Dataset],
    *,
    title: str = "",
    start: float = 0.0,
    end: float | None = None,
    p_relief: float | None = None,
) -> Figure:
    """Wire speed, A-side pressure, control error, pump and motor setting over time, one colour a run, a controller's
    own where the label is its name.

    Parameters: runs label -> Dataset with the names of `stillhook.variables` (simulated or measured); start, end [s];
    p_relief setting of the relief valves, shown with the pressure [Pa].
    Source of the arrangement: Moslatt 2020 paper E figures 15-22. Displacements are shown as part of the full one.
    """
    figure, grid = kit.panels(4, 1, (10.0, 11.0), title, sharex=True)
    speed, work, error, setting = grid[:, 0]
    first, window = next(iter(runs.values())), {"time": slice(start, end)}
    effort, pumps = effort_of(first), "alpha_p" in first
    if "v_tip" in first:
        cut = first.sel(window)
        wanted = cut.get("v_op", 0.0 * cut["v_tip"]) - cut["v_tip"]
        speed.plot(cut["time"], kit.display(wanted, "speed"), color=GREY, ls="--", lw=1, label="wanted")
    colours = colours_of(runs)
    for label, run in runs.items():
        cut = run.sel(window)
        of_setting = (
            (("alpha_p", "pump", "-"), ("alpha_m", "motor", ":")) if "alpha_p" in cut else (("u_p", "command", "-"),)
        )
        curves = [(ax, name, label, "-") for ax, name in ((speed, "v_w"), (work, effort), (error, "e_c"))]
        curves += [(setting, name, f"{label} {word}", ls) for name, word, ls in of_setting]
        for ax, name, text, ls in curves:
            if name in cut:
                ax.plot(cut["time"], _shown(cut, name), color=colours[label], lw=1.2, ls=ls, label=text)
    if p_relief is not None and effort == "p_a":
        kit.threshold(work, float(kit.display(p_relief, "pressure")), note="relief valves")
    meaning = "A-side pressure" if effort == "p_a" else BY_NAME[effort].meaning
    kit.axis(speed, y="wire speed [m/min]\n(hoisting positive)")
    kit.axis(work, y=kit.with_unit(meaning, BY_NAME[effort].kind))
    kit.axis(error, y="control error [mm]")
    kit.axis(setting, "time [s]", "displacement [-]\npump solid, motor dotted" if pumps else "command [-]")
    setting.set_ylim(-1.1, 1.1)
    speed.set_xlim(start, float(first["time"][-1]) if end is None else end)
    kit.legend_above(speed)
    figure.align_ylabels(grid[:, 0])
    return figure


def effort_of(run: xarray.Dataset) -> str:
    """The signal that shows how hard a winch works: A-side pressure, else its own pressure or torque, else the
    tension of the wire."""
    names = (str(n) for n, x in run.data_vars.items() if "time" in x.dims and BY_NAME[str(n)].kind in EFFORTS)
    return "p_a" if "p_a" in run else next(names, "F_w")


def _shown(run: xarray.Dataset, name: str) -> FloatArray:
    """A signal in its display unit, the control error in millimetres."""
    return kit.display(run[name].values, "diameter" if name == "e_c" else kind_of(name))


class Limits(NamedTuple):
    """Lines that a picture shows: F_max highest tension at the crane tip [N]; p_relief relief of the active circuit
    [Pa], None without one."""

    F_max: float
    p_relief: float | None


def lowering_panels(
    run: xarray.Dataset, lift: Lowering, static: FloatArray, limits: Limits, *, title: str = ""
) -> Figure:
    """Depth, tension, dynamic factor, motion, control error (where a phase compensates) and effort of the winch over
    time; phases are distinguished by their shade.

    run: series of one lowering, names of `stillhook.variables`; static: tension at the crane tip with everything at
    rest at the depth and wetness of the moment [N], one for each time.
    """
    compensates = any(phase.compensated for phase in lift.programme)
    n = 6 if compensates else 5
    figure, grid = kit.panels(n, 1, (10.0, 2.33 * n), title, sharex=True)
    axes = grid[:, 0]
    (depth, tension, factor, motion), effort = axes[:4], axes[-1]
    t = run["time"].values
    _depth(depth, run, lift, t)
    _lines(tension, run, (("F_w", "at the crane tip"), ("F_sling", "slings")), limits.F_max, "SWL and hook")
    kit.axis(tension, y="tension [kN]")
    factor.plot(t, run["F_w"].values / static, color=COLOURS[0], lw=0.8)
    factor.axhline(1.0, color=GREY, lw=0.8)
    kit.axis(factor, y="tension at the tip\nover the static one [-]")
    _motion(motion, run, lift, t)
    if compensates:
        _lines(axes[4], run, (("e_c", ""),))
        kit.axis(axes[4], y="control error [mm]\n(while compensating)")
    _effort(effort, run, limits.p_relief)
    kit.axis(effort, "time [s]")
    depth.set_xlim(float(t[0]), float(t[-1]))
    for ax in axes:
        for _, a, b in _turns(run)[1::2]:
            ax.axvspan(float(t[a]), float(t[b]), color="black", alpha=0.05, lw=0)
        kit.legend(ax, "upper right", fontsize="x-small", ncols=3, frameon=True, framealpha=0.8)
    _phase_names(depth, run, lift, t)
    figure.align_ylabels(axes)
    return figure


def _lines(
    ax: Axes, run: xarray.Dataset, lines: tuple[tuple[str, str], ...], limit: float = np.inf, name: str = ""
) -> None:
    """Signals with their labels over time, those that the run has; a limit [SI] of the first where it comes near."""
    for (signal, label), colour in zip(lines, COLOURS, strict=False):
        if signal in run:
            ax.plot(run["time"].values, _shown(run, signal), color=colour, lw=0.8, label=label or None)
    if run[lines[0][0]].max() > NEAR * limit:
        kit.threshold(ax, float(kit.display(limit, kind_of(lines[0][0]))), name)


def _depth(ax: Axes, run: xarray.Dataset, lift: Lowering, t: FloatArray) -> None:
    z = run["z_load"].values
    if z.min() > -4.0 * lift.payload.height:
        ax.fill_between(t, run["eta"].values, min(z.min(), 0.0) - 1.0, color=WATER, lw=0, label="water")
    else:
        ax.axhline(0.0, color=COLOURS[5], lw=0.8, label="still water")
    ax.plot(t, z, color=STEEL, lw=1.2, label="underside of the payload")
    if z.min() < -0.9 * lift.depth:
        ax.axhline(-lift.depth, color=SEABED, lw=2, label="seabed")
    if "z_deck" in run:
        ax.plot(t, run["z_deck"].values, color=SEABED, lw=1.0, label="deck")
    kit.axis(ax, y="height above\nstill water [m]")


def _motion(ax: Axes, run: xarray.Dataset, lift: Lowering, t: FloatArray) -> None:
    ax.plot(t, run["s_tip"].values - run["s_tip"].values[0], color=GREY, lw=0.7, label="crane tip")
    path = requested_path(run, lift, t)
    for name, label, colour in (("s_hook", "hook", COLOURS[1]), ("z_load", "payload", COLOURS[0])):
        ax.plot(t, about_mean(t, run[name].values - path), color=colour, lw=0.9, label=label)
    kit.axis(ax, y="motion about the\nrequested path [m]")


def requested_path(run: xarray.Dataset, lift: Lowering, t: FloatArray) -> FloatArray:
    """Height requested by the joystick [m]: what splash mode adds to it counts as motion, and so does a correction of
    leakage."""
    v, phase, moves = np.array(run["v_op"].values), run["phase_number"].values.astype(int), lift.moves
    adds = [each.mode in (WinchMode.SPLASH, WinchMode.MANUAL) for each in lift.programme]
    step = lift.winch.ramp * float(t[1] - t[0])
    for i in np.flatnonzero(np.array([*adds, False])[np.minimum(phase, len(lift.programme))]):
        before = v[i - 1] if i else 0.0
        v[i] = before + min(max(-moves[phase[i]].v - before, -step), step)
    return np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))])


def about_mean(t: FloatArray, s: FloatArray) -> FloatArray:
    """A height less its mean over a window centred on the moment, which shrinks towards the ends [m]; t even [s]."""
    n = max(1, min(round(0.5 * MEAN / (t[1] - t[0])), (len(s) - 1) // 2)) if len(t) > 1 else 1
    i = np.arange(len(s))
    reach = np.minimum(n, np.minimum(i, len(s) - 1 - i))
    total = np.concatenate([[0.0], np.cumsum(s)])
    return np.asarray(s - (total[i + reach + 1] - total[i - reach]) / (2 * reach + 1))


def _effort(ax: Axes, run: xarray.Dataset, p_relief: float | None) -> None:
    """Pressures of the circuits; of a winch without circuits the signal that shows how hard it works."""
    if p_relief is None:
        row = BY_NAME[effort_of(run)]
        _lines(ax, run, ((row.name, ""),))
        kit.axis(ax, y=kit.with_unit(f"{row.meaning}\n", row.kind))
        return
    _lines(ax, run, (("p_a", "hoisting side"), ("p_b", "lowering side"), ("p_hp", "passive")), p_relief, "relief")
    kit.axis(ax, y="pressure [bar]")


def _turns(run: xarray.Dataset) -> list[tuple[int, int, int]]:
    """Phase, first and last sample of every stretch in one phase."""
    phase = run["phase_number"].values.astype(int)
    cuts = np.flatnonzero(np.diff(phase)) + 1
    starts, ends = [0, *cuts], [*cuts, len(phase) - 1]
    return [(int(phase[a]), int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def _phase_names(ax: Axes, run: xarray.Dataset, lift: Lowering, t: FloatArray) -> None:
    duration = float(t[-1] - t[0])
    for phase, a, b in _turns(run):
        text = "done" if phase >= len(lift.programme) else lift.programme[phase].name or str(lift.programme[phase].mode)
        if t[b] - t[a] > 0.02 * duration:
            middle = 0.5 * float(t[a] + t[b])
            ax.text(
                middle, 1.02, text, transform=ax.get_xaxis_transform(), ha="center", fontsize="small", clip_on=False
            )


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
