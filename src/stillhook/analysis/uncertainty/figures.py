"""Pictures of many draws: bands of every case with its limits, indices as bars."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.analysis.uncertainty.report import Limit, bands
from stillhook.analysis.uncertainty.sobol import MATTERS, Sensitivity, largest_totals
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import in_display

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

SHOWN = {"e_c_pp": ("control error peak-to-peak [mm]", "diameter"), "p_max": ("peak pressure [bar]", "pressure")}
"""Numbers of the figures, their labels and the kind that gives their display unit; those that a winch type does not
have are left out."""
SHARE = 100.0


def band_figure(run: xarray.Dataset, title: str = "", limits: Sequence[Limit] = ()) -> Figure:
    """Every draw of every case as a point, its median and 5-95 % band, the crane at its nominal values, and limits as
    lines."""
    cases = [str(c) for c in run["case"].values]
    shown = [name for name in SHOWN if name in run]
    at_values, results = json.loads(run.attrs["at_values"]), bands(run, shown)
    size = (5.0 * len(shown), 1.6 + 0.75 * len(cases))
    figure, axes = kit.panels(1, len(shown), size, title, grid="x", sharey=True)
    axes = axes.ravel()
    for ax, name in zip(axes, shown, strict=True):
        words, kind = SHOWN[name]
        for y, (case, colour) in enumerate(zip(cases, COLOURS * len(cases), strict=False)):
            values = kit.display(run[name].sel(case=case).values, kind)
            spread = 0.16 * (np.argsort(np.argsort(run["factor_value"].values[:, 0])) / max(len(values) - 1, 1) - 0.5)
            ax.plot(values, y + 0.22 + spread, ".", color=colour, alpha=0.45, ms=4, mew=0)
            b = results[case][name]
            low, median, high = kit.display((b.low, b.median, b.high), kind)
            of_band, of_base = ("5 to 95 %", "as described") if y == 0 else (None, None)
            ax.plot([low, high], [y - 0.08, y - 0.08], color=colour, lw=5, solid_capstyle="butt", label=of_band)
            ax.plot(median, y - 0.08, "|", color="white", ms=9, mew=2)
            ax.plot(kit.display(at_values[case][name], kind), y - 0.28, "^", color=GREY, ms=6, label=of_base)
        for limit in (limit for limit in limits if limit.name == name):
            ax.axvline(in_display(limit.value, kind), color=GREY, ls="--", lw=1)
        ax.set(xlabel=words, yticks=range(len(cases)), ylim=(len(cases) - 0.5, -0.5))
        ax.set_yticklabels([c.upper() if len(c) < 4 else c for c in cases])
    axes[-1].legend(fontsize="small", frameon=False, loc="best")
    return figure


def index_figure(results: Sequence[Sensitivity], title: str = "", least: float = MATTERS) -> Figure:
    """Indices as bars, one panel for each case and output: first order and, lighter, total order, with 95 % intervals.

    Factors whose total index is below `least` in every panel are left out.
    """
    largest = largest_totals(results)
    names = [name for name, x in largest.items() if x >= least] or list(largest)[:1]
    cases, outputs = list(dict.fromkeys(s.case for s in results)), list(dict.fromkeys(s.output for s in results))
    size = (4.2 * len(cases) + 1.0, len(outputs) * (0.34 * len(names) + 1.1) + 0.6)
    figure, axes = kit.panels(len(outputs), len(cases), size, title, grid="x", sharex=True, sharey=True)
    axes = axes.ravel()
    for s in results:
        ax = axes[outputs.index(s.output) * len(cases) + cases.index(s.case)]
        _bars(ax, s, names)
        output = SHOWN[s.output][0].split(" [")[0] if s.output in SHOWN else s.output
        ax.set_title(f"{s.case}: {output}", fontsize="small")
    for ax in axes[-len(cases) :]:
        ax.set_xlabel("share of the variance [%]")
    if with_bars := [ax for ax in axes[: len(cases)] if ax.get_legend_handles_labels()[0]]:
        with_bars[-1].legend(fontsize="small", frameon=False, loc="lower right")
    return figure


def _bars(ax: Any, s: Sensitivity, names: Sequence[str]) -> None:
    for y, name in enumerate(names):
        if (x := s.indices.get(name)) is None:
            continue
        labels = ("with interactions (total)", "alone (first order)", "95 % of the first") if y == 0 else (None,) * 3
        ax.barh(y, SHARE * x.total.value, height=0.7, color=COLOURS[5], alpha=0.5, label=labels[0])
        ax.barh(y, SHARE * max(x.first.value, 0.0), height=0.4, color=COLOURS[0], label=labels[1])
        ax.plot([SHARE * x.first.low, SHARE * x.first.high], [y, y], color="black", lw=1, label=labels[2])
    ax.set_yticks(range(len(names)), names)
    ax.set(ylim=(len(names) - 0.5, -0.5), xlim=(-0.1 * SHARE, 1.1 * SHARE))
    ax.axvline(0.0, color=GREY, lw=0.8)
