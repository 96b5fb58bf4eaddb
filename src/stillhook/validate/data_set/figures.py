"""Figure of step 0: an overview of every test."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.plots.colours import BLUE, GREEN, GREY, RED
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.plots import POINTS, SHADE, panels
from stillhook.validate.data_set.records.record import Record, stretches_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS = 8
"""Tests in one overview; further ones are in the tables only."""
SHOWN = (
    ("s_tip", "crane tip [m], up positive", BLUE, 1.0),
    ("s_w", "wire paid out [m]", GREEN, 1.0),
    ("F_w", "load cell [kN]", RED, 1e-3),
)
"""Signals of the overview, their titles and colours, and the factor to the unit of their axis."""


def figures(estimates: Any, campaign: Campaign, records: tuple[Record, ...]) -> dict[str, Figure]:
    """Tip, wire and load cell of every test over time; unused parts shaded."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown = records[:ROWS]
    if not shown:
        return {}
    title, size = "The tests; shaded parts are not used", (11.0, 1.5 + 1.35 * len(shown))
    figure, axes = panels(campaign, title, len(shown), len(SHOWN), size)
    for row, record in zip(axes, shown, strict=True):
        for ax, (name, _, colour, scale) in zip(row, SHOWN, strict=True):
            _panel(ax, record, name, colour, scale)
        row[0].set_ylabel(f'test "{record.test.name}"', fontsize="small")
    for ax, (_, name, *_) in zip(axes[0], SHOWN, strict=True):
        ax.set_title(name, fontsize="small")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    handles: list[Any] = [
        Patch(color=SHADE, label="not used"),
        Line2D([], [], color=GREY, ls=":", label="start of another load case"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize="small", frameon=False)
    return {"tests": figure}


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
    ax.fill_between(np.linspace(t[0], t[-1], len(low)), low, high, color=colour, lw=0.6, edgecolor=colour)
    if np.nanmax(high) - np.nanmin(low) < 0.02 * scale:  # noise alone needs no full axis
        middle = 0.5 * float(np.nanmax(high) + np.nanmin(low))
        ax.set_ylim(middle - 0.5, middle + 0.5)


def _envelope(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest value of every piece, NaN where nothing is known."""
    edges = np.linspace(0, len(x), min(len(x), POINTS) + 1).astype(int)
    pieces = [x[a:b][np.isfinite(x[a:b])] for a, b in pairwise(edges)]
    low, high = (np.array([f(p) if len(p) else np.nan for p in pieces]) for f in (np.min, np.max))
    return low, high
