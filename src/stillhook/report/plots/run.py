"""The four-panel figure of the thesis (wire speed, A-side pressure, control error, pump and motor setting) for any set
of runs."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.base.atomic import atomic_file
from stillhook.units import KINDS, in_display
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's palette: distinguishable by colour-blind readers and in print."""
GREY = "#777777"
EFFORTS = ("pressure", "torque")
"""Kinds of a signal that shows how hard a winch works."""


def four_panels(
    runs: Mapping[str, xarray.Dataset], *, title: str = "", start: float = 0.0, end: float | None = None
) -> Figure:
    """Wire speed, A-side pressure, control error, pump and motor setting over time, one colour a run.

    Parameters: runs label -> Dataset with the names of `stillhook.variables` (simulated or measured); start, end [s].
    Source of the arrangement: Moslatt 2020 paper E figures 15-22. Displacements are shown as part of the full one.
    """
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(10.0, 11.0), layout="constrained")
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
    for colour, (label, run) in zip(COLOURS * 2, runs.items(), strict=False):
        cut = run.sel(window)
        _panel(axes[0], cut, "v_w", "speed", colour, label)
        _panel(axes[1], cut, effort, BY_NAME[effort].kind, colour, label)
        _panel(axes[2], cut, "e_c", "diameter", colour, label)
        if "alpha_p" in cut:
            _panel(axes[3], cut, "alpha_p", "", colour, f"{label} pump")
            _panel(axes[3], cut, "alpha_m", "", colour, f"{label} motor", ls=":")
        else:
            _panel(axes[3], cut, "u_p", "", colour, f"{label} command")
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
    axes[3].set_ylim(-1.1, 1.1)
    axes[3].set_xlabel("time [s]")
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
    """The signal that shows how hard a winch works: A-side pressure, else a pressure or torque of its own, else the
    tension of the wire."""
    own = (str(n) for n, x in run.data_vars.items() if "time" in x.dims and BY_NAME[str(n)].kind in EFFORTS)
    return "p_a" if "p_a" in run else next(own, "F_w")


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
