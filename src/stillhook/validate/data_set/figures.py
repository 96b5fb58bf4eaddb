"""Figures of step 0: tip motion by load case, after Moslatt 2020 paper F figure 13; and an overview of every test.

Common parts of the validation figures: axes, legend outside the data, colours of measured and simulated.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import cycle, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.check import DataStep, Motion
from stillhook.validate.data_set.records.record import Record, stretches_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


BIN = 0.25
"""Width of the bins of tip motion [m]."""
POINTS = 1500
"""Points of a curve over time: twice the dots that a picture has."""
ROWS = 8
"""Tests in one overview; further ones are in the tables only."""
SHOWN = (("s_tip", COLOURS[0], 1.0), ("s_w", COLOURS[2], 1.0), ("F_w", COLOURS[1], 1e-3))
"""Signals of the overview, their colours, and the factor to the unit of their axis."""
SHADE = "#DDDDDD"


def figures(step: Step, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Pictures of the data set by name."""
    mark = "SYNTHETIC. " if campaign.synthetic else ""
    out = {"tests": _overview(records[:ROWS], mark)} if records else {}
    if isinstance(step, DataStep) and any(len(m.s_tip_pp) for m in step.motions):
        window = campaign.criteria.settings["window"]
        out["tip-motion"] = _distribution([m for m in step.motions if len(m.s_tip_pp)], window, mark)
    return out


def _distribution(motions: Sequence[Motion], window: float, mark: str) -> Figure:
    """Share of all windows by tip motion, stacked by load case."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    spans = np.concatenate([m.s_tip_pp for m in motions])
    edges = np.arange(0.0, BIN * (np.floor(spans.max() / BIN) + 1.5), BIN)
    figure = Figure(figsize=(8.0, 4.8), layout="constrained")
    ax = figure.subplots()
    base = np.zeros(len(edges) - 1)
    for colour, motion in zip(cycle(COLOURS), motions, strict=False):
        share = 100.0 * np.histogram(motion.s_tip_pp, edges)[0] / len(spans)
        ax.bar(edges[:-1] + 0.5 * BIN, share, 0.92 * BIN, bottom=base, color=colour, label=motion.label)
        base = base + share
    ax.set_xlabel(f"peak-to-peak motion of the crane tip over {window:g} s [m]")
    ax.set_ylabel("share of all windows [%]")
    ax.set_xlim(0.0, edges[-1])
    ax.grid(alpha=0.3, axis="y")
    ax.set_axisbelow(True)
    ax.set_title(f"{mark}Tip motion in the data, by load case", fontsize="medium")
    columns = min(4, len(motions))
    figure.legend(loc="outside lower center", ncols=columns, fontsize="small", frameon=False)
    return figure


def _overview(records: Sequence[Record], mark: str) -> Figure:
    """Tip, wire and load cell of every test over time; unused parts shaded."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    rows = len(records)
    title = f"{mark}The tests; shaded parts are not used"
    figure, axes = axes_of(rows, 3, (11.0, 1.5 + 1.35 * rows), title)
    for row, record in zip(axes, records, strict=True):
        for ax, (name, colour, scale) in zip(row, SHOWN, strict=True):
            _panel(ax, record, name, colour, scale)
        row[0].set_ylabel(f'test "{record.test.name}"', fontsize="small")
    for ax, title in zip(axes[0], ("crane tip [m], up positive", "wire paid out [m]", "load cell [kN]"), strict=True):
        ax.set_title(title, fontsize="small")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    handles: list[Any] = [
        Patch(color=SHADE, label="not used"),
        Line2D([], [], color=GREY, ls=":", label="start of another load case"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize="small", frameon=False)
    return figure


def _panel(ax: Any, record: Record, name: str, colour: str, scale: float) -> None:
    t = record.t + record.zero
    unused = np.ones(len(t), np.bool_)
    for s in record.segments:
        unused[s.first : s.last] = False
    for a, b in stretches_of(unused):
        ax.axvspan(t[a], t[min(b, len(t) - 1)], color=SHADE, lw=0)
    for s in record.segments[1:]:
        ax.axvline(t[s.first], color=GREY, ls=":", lw=0.9)
    ax.set_xlim(t[0], t[-1])
    ax.tick_params(labelsize="x-small")
    if name not in record.signals or not np.isfinite(record.signals[name]).any():
        ax.text(0.5, 0.5, "not logged", transform=ax.transAxes, ha="center", va="center", color=GREY, fontsize="small")
        ax.set_yticks([])
        return
    low, high = _envelope(scale * record.signals[name])
    at = np.linspace(t[0], t[-1], len(low))
    ax.fill_between(at, low, high, color=colour, lw=0.6, edgecolor=colour)
    if np.nanmax(high) - np.nanmin(low) < 0.02 * scale:  # noise alone needs no full axis
        middle = 0.5 * float(np.nanmax(high) + np.nanmin(low))
        ax.set_ylim(middle - 0.5, middle + 0.5)


def _envelope(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smallest and largest value of every piece, NaN where nothing is known."""
    edges = np.linspace(0, len(x), min(len(x), POINTS) + 1).astype(int)
    pieces = [x[a:b][np.isfinite(x[a:b])] for a, b in pairwise(edges)]
    low = np.array([p.min() if len(p) else np.nan for p in pieces])
    return low, np.array([p.max() if len(p) else np.nan for p in pieces])


MEASURED, SIMULATED = COLOURS[0], COLOURS[1]


def axes_of(rows: int, columns: int, size: tuple[float, float], title: str, **more: Any) -> tuple[Figure, Any]:
    """A figure with its axes (rows, columns), always two-dimensional; size [inch]."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **more)
    for ax in np.ravel(axes):
        ax.grid(alpha=0.3)
    figure.suptitle(title, fontsize="medium")
    return figure, axes


def legend_below(figure: Figure, axes: Sequence[Any], columns: int) -> None:
    """One legend of several axes below the figure."""
    pairs = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(
        list(pairs.values()), list(pairs), loc="outside lower center", ncols=columns, fontsize="small", frameon=False
    )


def thinned(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Every so many of the values, for a scatter plot of at most some `POINTS` dots."""
    return x[:: max(1, len(x) // POINTS)]


def mark(campaign: Campaign, figures: Iterable[Figure]) -> None:
    """Say in the title of every figure where the data are synthetic."""
    for figure in figures if campaign.synthetic else ():
        figure.suptitle(marked(campaign, figure.get_suptitle()), fontsize="medium")


def marked(campaign: Campaign, title: str) -> str:
    """A title that says where the data are synthetic."""
    return f"SYNTHETIC. {title}" if campaign.synthetic else title
