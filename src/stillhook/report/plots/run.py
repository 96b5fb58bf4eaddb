"""Pictures of runs and lowerings: the four panels of the thesis, a lowering over time, moments at surface and
seabed."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.spec.lift.lowering import Lowering, StageMode
from stillhook.units import KINDS, in_display
from stillhook.variables import BY_NAME
from stillhook.winches.joints.registry import UNITS

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


EFFORTS = ("pressure", "torque")
"""Kinds of a signal that shows how hard a winch works."""


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of this size [inch] whose parts do not overlap."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    return Figure(figsize=(width, height), layout="constrained")


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
    p_relief setting of the relief valves, shown beside the pressure [Pa].
    Source of the arrangement: Moslatt 2020 paper E figures 15-22. Displacements are shown as part of the full one.
    """
    figure = new_figure(10.0, 11.0)
    axes = figure.subplots(4, 1, sharex=True)
    first = next(iter(runs.values()))
    effort = effort_of(first)
    window = {"time": slice(start, end)}
    if "v_tip" in first:
        cut = first.sel(window)
        wanted = cut.get("v_op", 0.0 * cut["v_tip"]) - cut["v_tip"]
        axes[0].plot(
            cut["time"], [in_display(v, "speed") for v in wanted.values], color=GREY, ls="--", lw=1, label="wanted"
        )
    colours = colours_of(runs)
    for label, run in runs.items():
        cut, colour = run.sel(window), colours[label]
        _panel(axes[0], cut, "v_w", "speed", colour, label)
        _panel(axes[1], cut, effort, BY_NAME[effort].kind, colour, label)
        _panel(axes[2], cut, "e_c", "diameter", colour, label)
        if "alpha_p" in cut:
            _panel(axes[3], cut, "alpha_p", "", colour, f"{label} pump")
            _panel(axes[3], cut, "alpha_m", "", colour, f"{label} motor", ls=":")
        else:
            _panel(axes[3], cut, "u_p", "", colour, f"{label} command")
    if p_relief is not None and effort == "p_a":
        highest = in_display(p_relief, "pressure")
        axes[1].axhline(highest, color=GREY, ls="--", lw=1)
        axes[1].text(
            1.0,
            highest,
            "relief valves ",
            transform=axes[1].get_yaxis_transform(),
            ha="right",
            va="bottom",
            fontsize="small",
            color=GREY,
        )
    kind = BY_NAME[effort].kind
    names = (
        "wire speed [m/min]\n(hoisting positive)",
        "A-side pressure [bar]" if effort == "p_a" else f"{BY_NAME[effort].meaning} [{KINDS[kind].display}]",
        "control error [mm]",
        "displacement [-]\npump solid, motor dotted" if "alpha_p" in first else "command [-]",
    )
    for ax, name in zip(axes, names, strict=True):
        ax.set_ylabel(name)
        ax.grid(alpha=0.3)
    axes[3].set(ylim=(-1.1, 1.1), xlabel="time [s]")
    axes[0].set_xlim(start, float(first["time"][-1]) if end is None else end)
    figure.suptitle("\n".join(textwrap.wrap(title, 110)), fontsize="medium")
    handles, labels = axes[0].get_legend_handles_labels()
    axes[0].legend(
        handles,
        labels,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(labels),
        fontsize="small",
        frameon=False,
    )
    figure.align_ylabels(axes)
    return figure


def effort_of(run: xarray.Dataset) -> str:
    """The signal that shows how hard a winch works: A-side pressure, else its own pressure or torque, else the
    tension of the wire."""
    names = (str(n) for n, x in run.data_vars.items() if "time" in x.dims and BY_NAME[str(n)].kind in EFFORTS)
    return "p_a" if "p_a" in run else next(names, "F_w")


def _panel(ax: Any, run: xarray.Dataset, name: str, kind: str, colour: str, label: str, **style: Any) -> None:
    if name not in run:
        return
    values = run[name].values
    ax.plot(
        run["time"],
        [in_display(v, kind) for v in values] if kind else values,
        color=colour,
        lw=1.2,
        label=label,
        **style,
    )


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a picture; the file appears only when it is complete."""
    target = Path(path)
    with atomic_file(target) as part:
        figure.savefig(part, dpi=120)
    return target


WATER, SEABED, STEEL = "#CFE5F2", "#C9B48A", "#444444"
MOMENTS = 8
"""Pictures in a row of the strip."""
FRAMES_PER_SECOND, FRAMES = 10, 150
"""Of an animation; a stretch longer than fifteen seconds runs faster than it did."""
MEAN = 30.0
"""Window whose mean is taken off a height, so that the stretch of the wire goes with it [s]: the window of the control
error."""


class Limits(NamedTuple):
    """Lines that a picture shows: F_max highest tension at the crane tip [N]; p_relief relief of the active circuit
    [Pa], None without one."""

    F_max: float
    p_relief: float | None


def lowering_panels(
    run: xarray.Dataset, lift: Lowering, static: FloatArray, limits: Limits, *, title: str = ""
) -> Figure:
    """Depth, tension, dynamic factor, motion, control error and effort of the winch over time; stages are distinguished
    by their shade.

    run: series of one lowering, names of `stillhook.variables`; static: tension at the crane tip with everything at
    rest at the depth and wetness of the moment [N], one for each time.
    """
    figure = new_figure(10.0, 14.0)
    axes = figure.subplots(6, 1, sharex=True)
    t = run["time"].values
    _depth(axes[0], run, lift, t)
    _tension(axes[1], run, t, limits)
    axes[2].plot(t, run["F_w"].values / static, color=COLOURS[0], lw=0.8)
    axes[2].axhline(1.0, color=GREY, lw=0.8)
    axes[2].set_ylabel("tension at the tip\nover the static one [-]")
    _motion(axes[3], run, lift, t)
    axes[4].plot(t, _shown(run, "e_c", "diameter"), color=COLOURS[0], lw=0.8)
    axes[4].set_ylabel("control error [mm]\n(while compensating)")
    _effort(axes[5], run, t, limits)
    axes[5].set_xlabel("time [s]")
    axes[0].set_xlim(float(t[0]), float(t[-1]))
    for ax in axes:
        ax.grid(alpha=0.3)
        _stages(ax, run, t)
        if ax.get_legend_handles_labels()[0]:
            ax.legend(loc="upper right", fontsize="x-small", ncols=3, framealpha=0.8)
    _stage_names(axes[0], run, lift, t)
    figure.align_ylabels(axes)
    figure.suptitle("\n".join(textwrap.wrap(title, 110)), fontsize="medium")
    return figure


def _shown(run: xarray.Dataset, name: str, kind: str) -> FloatArray:
    return in_display(1.0, kind) * np.asarray(run[name].values, dtype=np.float64)


def _depth(ax: Axes, run: xarray.Dataset, lift: Lowering, t: FloatArray) -> None:
    z = run["z_load"].values
    if z.min() > -4.0 * lift.payload.height:
        ax.fill_between(t, run["eta"].values, min(z.min(), 0.0) - 1.0, color=WATER, lw=0, label="water")
    else:
        ax.axhline(0.0, color=COLOURS[5], lw=0.8, label="still water")
    ax.plot(t, z, color=STEEL, lw=1.2, label="underside of the payload")
    if z.min() < -0.9 * lift.depth:
        ax.axhline(-lift.depth, color=SEABED, lw=2, label="seabed")
    ax.set_ylabel("height above\nstill water [m]")


def _tension(ax: Axes, run: xarray.Dataset, t: FloatArray, limits: Limits) -> None:
    F_w, F_s = _shown(run, "F_w", "force"), _shown(run, "F_sling", "force")
    ax.plot(t, F_w, color=COLOURS[0], lw=0.8, label="at the crane tip")
    ax.plot(t, F_s, color=COLOURS[1], lw=0.8, label="slings")
    highest = in_display(limits.F_max, "force")
    if F_w.max() > 0.7 * highest:
        ax.axhline(highest, color=GREY, ls="--", lw=1, label="SWL and hook")
    ax.set_ylabel("tension [kN]")


def _motion(ax: Axes, run: xarray.Dataset, lift: Lowering, t: FloatArray) -> None:
    ax.plot(t, run["s_tip"].values - run["s_tip"].values[0], color=GREY, lw=0.7, label="crane tip")
    path = requested_path(run, lift, t)
    for name, label, colour in (("s_hook", "hook", COLOURS[1]), ("z_load", "payload", COLOURS[0])):
        ax.plot(t, about_mean(t, run[name].values - path), color=colour, lw=0.9, label=label)
    ax.set_ylabel("motion about the\nrequested path [m]")


def requested_path(run: xarray.Dataset, lift: Lowering, t: FloatArray) -> FloatArray:
    """Height requested by the joystick [m]: what splash mode adds to it counts as motion, and so does a correction of
    leakage."""
    v, stage = np.array(run["v_op"].values), run["stage_number"].values.astype(int)
    adds = [each.mode in (StageMode.SPLASH, StageMode.MANUAL) for each in lift.programme]
    step = lift.winch.ramp * float(t[1] - t[0])
    for i in np.flatnonzero(np.array([*adds, False])[np.minimum(stage, len(lift.programme))]):
        before = v[i - 1] if i else 0.0
        v[i] = before + min(max(-lift.programme[stage[i]].lower - before, -step), step)
    return np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))])


def about_mean(t: FloatArray, s: FloatArray) -> FloatArray:
    """A height less its mean over a window centred on the moment, which shrinks towards the ends [m]; t even [s]."""
    n = max(1, min(round(0.5 * MEAN / (t[1] - t[0])), (len(s) - 1) // 2)) if len(t) > 1 else 1
    i = np.arange(len(s))
    reach = np.minimum(n, np.minimum(i, len(s) - 1 - i))
    total = np.concatenate([[0.0], np.cumsum(s)])
    return np.asarray(s - (total[i + reach + 1] - total[i - reach]) / (2 * reach + 1))


def _effort(ax: Axes, run: xarray.Dataset, t: FloatArray, limits: Limits) -> None:
    """Pressures of the circuits; of a winch without circuits the signal that shows how hard it works."""
    if limits.p_relief is None:
        row = BY_NAME[effort_of(run)]
        ax.plot(t, _shown(run, row.name, row.kind), color=COLOURS[0], lw=0.8)
        ax.set_ylabel(f"{row.meaning}\n[{KINDS[row.kind].display}]")
        return
    lines = (("p_a", "hoisting side"), ("p_b", "lowering side"), ("p_hp", "passive"))
    for (name, label), colour in zip(lines, COLOURS, strict=False):
        if name in run:
            ax.plot(t, _shown(run, name, "pressure"), color=colour, lw=0.8, label=label)
    highest = in_display(limits.p_relief, "pressure")
    if run["p_a"].max() > 0.7 * limits.p_relief:
        ax.axhline(highest, color=GREY, ls="--", lw=1, label="relief")
    ax.set_ylabel("pressure [bar]")


def _turns(run: xarray.Dataset) -> list[tuple[int, int, int]]:
    """Stage, first and last sample of every stretch in one stage."""
    stage = run["stage_number"].values.astype(int)
    cuts = np.flatnonzero(np.diff(stage)) + 1
    starts, ends = [0, *cuts], [*cuts, len(stage) - 1]
    return [(int(stage[a]), int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def _stages(ax: Axes, run: xarray.Dataset, t: FloatArray) -> None:
    for i, (_, a, b) in enumerate(_turns(run)):
        if i % 2:
            ax.axvspan(float(t[a]), float(t[b]), color="black", alpha=0.05, lw=0)


def _stage_names(ax: Axes, run: xarray.Dataset, lift: Lowering, t: FloatArray) -> None:
    duration = float(t[-1] - t[0])
    for stage, a, b in _turns(run):
        text = "done" if stage >= len(lift.programme) else lift.programme[stage].name or str(lift.programme[stage].mode)
        if t[b] - t[a] > 0.02 * duration:
            middle = 0.5 * float(t[a] + t[b])
            ax.text(
                middle, 1.02, text, transform=ax.get_xaxis_transform(), ha="center", fontsize="small", clip_on=False
            )


class TimeSegment(NamedTuple):
    """A part of a run that is worth a picture: samples, and what happens."""

    name: str
    first: int
    last: int


def time_segments(run: xarray.Dataset, lift: Lowering) -> list[TimeSegment]:
    """The passage through the surface and the landing, where there are such."""
    z, out = run["z_load"].values, []
    H = max(lift.payload.height, 2.0)
    wet = np.flatnonzero((z < 0.6 * H) & (z > -1.8 * H))
    if len(wet) > MOMENTS:
        out.append(TimeSegment("through the surface", int(wet[0]), int(wet[-1])))
    down = np.flatnonzero(z <= -lift.depth)
    if len(down):
        above = np.flatnonzero(z[: down[0]] > -lift.depth + 1.0 * H)
        first = int(above[-1]) if len(above) else 0
        dt = float(run["time"][1] - run["time"][0])
        out.append(
            TimeSegment("landing", first, min(int(down[0] + max(10.0 / dt, 0.2 * (down[0] - first))), len(z) - 1))
        )
    return out


def strip(run: xarray.Dataset, lift: Lowering, *, title: str = "") -> Figure:
    """Moments of a lowering side by side: payload, slings, water and seabed, to scale; a row for the surface, one for
    the seabed."""
    rows = time_segments(run, lift) or [TimeSegment("", 0, run.sizes["time"] - 1)]
    views = [_bounds(run, lift, row) for row in rows]
    heights = [1.5 * 0.5 * (b.high - b.low) / b.half for b in views]
    figure = new_figure(13.0, sum(heights) + 0.7 * len(rows) + 0.5)
    grid = figure.subplots(len(rows), MOMENTS, squeeze=False, height_ratios=heights)
    for row, axes, bounds in zip(rows, grid, views, strict=True):
        for ax, i in zip(axes, np.linspace(row.first, row.last, MOMENTS).astype(int), strict=True):
            draw(ax, run, lift, int(i), bounds)
            ax.set_title(
                f"{float(run['time'][i]):.1f} s\n{in_display(float(run['F_sling'][i]), 'force'):.0f} kN",
                fontsize="small",
            )
        axes[0].set_ylabel(f"{row.name}\nheight above still water [m]")
        for ax in axes[1:]:
            ax.set_yticklabels([])
    figure.suptitle(
        "\n".join(textwrap.wrap(f"{title} (below each time: tension of the slings)", 140)), fontsize="medium"
    )
    return figure


class Bounds(NamedTuple):
    """Heights that a row of pictures shows [m], and half its width."""

    low: float
    high: float
    half: float


def _bounds(run: xarray.Dataset, lift: Lowering, row: TimeSegment) -> Bounds:
    z = run["z_load"].values[row.first : row.last + 1]
    H, rig = lift.payload.height, lift.rigging.height
    low = float(z.min()) - 0.3 * H - 1.0
    unit = lift.compensator
    link = 0.0 if unit is None else unit.shortest + unit.travel
    high = float(z.max()) + H + rig + link + 0.3 * H + 1.0
    return Bounds(low, high, max(0.25 * (high - low), 0.75 * _width(lift)))


def _width(lift: Lowering) -> float:
    """Side of a square as large as the payload's projected area [m]."""
    return max(math.sqrt(lift.payload.covered(lift.rho).A_p), 0.3 * lift.payload.height)


def draw(ax: Axes, run: xarray.Dataset, lift: Lowering, i: int, bounds: Bounds) -> None:
    """One moment: sample i, within the bounds."""
    from matplotlib.patches import Rectangle

    z, eta = float(run["z_load"][i]), float(run["eta"][i])
    H, half, w = lift.payload.height, bounds.half, 0.5 * _width(lift)
    top, hook, unit = z + H, z + H + lift.rigging.height, lift.compensator
    if unit is not None:
        s = float(run[UNITS[unit.type].EXTENSION][i])
        ax.plot([0.0, 0.0], [hook, hook + s], color=STEEL, lw=2.0)
        ax.plot([0.0, 0.0], [hook + s, hook + s + unit.shortest], color="black", lw=5.0, solid_capstyle="butt")
    ax.fill_between([-half, half], bounds.low, min(max(eta, bounds.low), bounds.high), color=WATER, lw=0)
    if -lift.depth > bounds.low:
        ax.fill_between([-half, half], bounds.low, -lift.depth, color=SEABED, lw=0)
    slack = float(run["F_sling"][i]) <= 0.0
    ax.add_patch(Rectangle((-w, z), 2.0 * w, H, facecolor=STEEL, edgecolor="black", lw=0.8, alpha=0.9))
    for side in (-w, w):
        sag = 0.25 * w if slack else 0.0
        ax.plot(
            [side, 0.5 * side + math.copysign(sag, side), 0.0],
            [top, 0.5 * (top + hook), hook],
            color=COLOURS[1],
            lw=1.0,
        )
    hung = hook if unit is None else hook + float(run[UNITS[unit.type].EXTENSION][i]) + unit.shortest
    ax.plot([0.0, 0.0], [hung, bounds.high], color="black", lw=1.2)
    ax.plot([0.0], [hung], marker="s", color="black", ms=4)
    ax.set(xlim=(-half, half), ylim=(bounds.low, bounds.high))
    ax.set_aspect("equal")
    ax.set_xticks([])


def save_animation(run: xarray.Dataset, lift: Lowering, path: str | Path, *, title: str = "") -> Path:
    """A GIF of the first stretch worth a picture: payload next to the tensions. The file appears only when it is
    complete."""
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    row = (time_segments(run, lift) or [TimeSegment("", 0, run.sizes["time"] - 1)])[0]
    t, count = run["time"].values, row.last - row.first + 1
    span = float(t[row.last] - t[row.first])
    frames = max(2, min(FRAMES, round(span * FRAMES_PER_SECOND)))
    faster = max(1.0, span * FRAMES_PER_SECOND / frames)
    figure = Figure(figsize=(8.0, 4.5), layout="constrained", dpi=72)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.6))
    bounds, cut = _bounds(run, lift, row), slice(row.first, row.last + 1, max(1, count // 1500))
    for name, label, colour in (("F_w", "at the crane tip", COLOURS[0]), ("F_sling", "slings", COLOURS[1])):
        right.plot(t[cut], _shown(run, name, "force")[cut], color=colour, lw=1.0, label=label)
    right.set(xlabel=f"time [s] (shown {faster:.1f} times as fast)", ylabel="tension [kN]")
    right.grid(alpha=0.3)
    right.legend(fontsize="small", loc="upper right")
    figure.suptitle("\n".join(textwrap.wrap(title, 90)), fontsize="small")
    now = right.axvline(t[row.first], color=GREY, lw=1.0)

    def show(i: Any) -> list[Any]:
        left.clear()
        draw(left, run, lift, int(i), bounds)
        left.set_ylabel("height above still water [m]")
        left.set_title(f"{t[int(i)]:.1f} s", fontsize="small")
        now.set_xdata([t[int(i)]] * 2)
        return []

    show(row.first)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    samples = np.linspace(row.first, row.last, frames).astype(int)
    target = Path(path)
    with atomic_file(target) as part:
        FuncAnimation(figure, show, frames=samples, blit=False).save(part, writer=PillowWriter(fps=FRAMES_PER_SECOND))
    return target
