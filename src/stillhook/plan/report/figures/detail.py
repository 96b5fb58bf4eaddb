"""Figures behind the limits: depth, efficiency, landing, convergence over the seeds, and waiting by month."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from stillhook.plan.report.figures.style import COLOUR, THICK, lines, page
from stillhook.plan.report.words import CREDITED, named, names, sea_words
from stillhook.plan.result import PlanResult
from stillhook.report import kit
from stillhook.report.formatting import DAY
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import in_display
from stillhook.weather.persistence import MONTHS

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


ACROSS = 3
"""Panels of a convergence side by side at most."""


def detail_figures(result: PlanResult) -> dict[str, Figure]:
    """Figures of the blocks that are there, by file stem."""
    functions: dict[str, tuple[str, Callable[[xarray.Dataset], Figure]]] = {
        "waiting-by-month": ("weather", waiting),
        "depth": ("depth", depth),
        "efficiency": ("efficiency", efficiency),
        "landing": ("landing", landing),
        "convergence": ("convergence", convergence),
    }
    return {stem: draw(result[block]) for stem, (block, draw) in functions.items() if block in result}


def depth(block: xarray.Dataset) -> Figure:
    """Tension at the tip, dynamic factor, least sling tension and natural period against depth, with the depth of
    resonance."""
    z, at = -np.asarray(block["z"].values, dtype=float), float(block.attrs["z_resonance"])
    resonance = f"resonance at {-at:.0f} m (dotted)" if math.isfinite(at) else "no resonance on the way"
    figure, axes = page(1, 4, 4.4, f"Against depth: {sea_words(block.attrs)}; {resonance}", sharey=True)
    tension, factor, slings, period = row = axes[0]
    kN = in_display(1.0, "force")
    for name in names(block):
        of, style = block.sel(alternative=name), {"color": COLOUR[name], "lw": THICK[name]}
        tension.plot(kN * of["F_top_max"], z, label=named(name), **style)
        factor.plot(of["DAF"], z, **style)
        slings.plot(of["sling_ratio"], z, **style)
    tension.plot(kN * block["F_top_static"].values, z, color=GREY, lw=1.0, ls="--", label="at rest")
    slings.axvline(0.0, color=GREY, lw=0.8)
    period.plot(block["T_0"].values, z, color="black", lw=1.3)
    kit.threshold(period, float(block.attrs["Tp"]), along="y")
    titles = (
        "tension at tip [kN]",
        "DAF [-]: sling tension\nover weight in air",
        "least sling tension\nover that at rest [-]",
        "natural period on\nthe wire [s] (dashed: Tp)",
    )
    for ax, title in zip(row, titles, strict=True):
        kit.axis(ax, title, size="small")
        if math.isfinite(at):
            ax.axhline(-at, color=COLOURS[1], lw=0.9, ls=":")
    kit.axis(tension, y="depth of the payload's underside [m]", size="small")
    tension.set_ylim(float(z.max()), float(z.min()))
    kit.legend_below(figure, [tension], 7)
    return figure


def efficiency(block: xarray.Dataset) -> Figure:
    """Share of the tip's motion that compensation takes away, at the wire and at the payload."""
    title = f"Compensation efficiency at {-float(block.attrs['z']):.0f} m depth: {sea_words(block.attrs)}"
    figure, axes = page(1, 2, 3.2, title, sharey=True)
    pairs = (("eta_wire", "at the wire"), ("eta_load", "at the payload"))
    for ax, (name, where) in zip(axes[0], pairs, strict=True):
        lines(ax, block["period"].values, block[name], 100.0, marker="o", ms=3)
        ax.axhline(0.0, color=GREY, lw=0.8)
        kit.axis(ax, "peak period Tp [s]", title=where, size="small")
    low = min(float(np.nanmin(block[name].values)) for name, _ in pairs)
    axes[0, 0].set_ylim(max(-100.0, min(0.0, 105.0 * low)), 103.0)
    kit.axis(axes[0, 0], y="compensation efficiency [%]", size="small")
    kit.legend_below(figure, [axes[0, 0]])
    return figure


def landing(block: xarray.Dataset) -> Figure:
    """Share of the landings that were faster than a speed, one per seed."""
    title = f"Landing speed exceeded, in brackets the number of seeds: {sea_words(block.attrs)}"
    figure, axes = page(1, 1, 3.4, title)
    ax = axes[0, 0]
    for name in names(block):
        v = np.asarray(block["v_landed"].sel(alternative=name).values, dtype=float)
        v = np.sort(v[np.isfinite(v)])
        share = 100.0 * (1.0 - (np.arange(len(v)) + 0.5) / max(len(v), 1))
        ax.step(v, share, where="mid", color=COLOUR[name], lw=THICK[name], label=f"{named(name)} ({len(v)})")
    if math.isfinite(float(block.attrs["limit"])):
        kit.threshold(ax, float(block.attrs["limit"]), "limit", along="y")
    kit.axis(ax, "speed at touch-down [m/s]", "landings that are faster [%]", zero="x", size="small")
    ax.set_ylim(0.0, 100.0)
    kit.legend_below(figure, [ax], 4)
    return figure


def convergence(block: xarray.Dataset) -> Figure:
    """Limits of the middle column as runs are added, with their 95 % interval."""
    cells = names(block, "cell")
    across = min(ACROSS, max(1, len(cells)))
    down = -(-len(cells) // across)
    title = "Convergence: limit by the first runs of every cell of the table; band is the 95 % interval"
    figure, axes = page(down, across, 0.6 + 2.3 * down, title, sharex=True)
    for ax, name in zip(axes.flat, cells, strict=False):
        run = block.sel(cell=name)
        kit.band(ax, run["n"], run["Hs_limit"], run["low"], run["high"], alpha=0.2, lw=1.3, marker="o", ms=2.5)
        kit.threshold(ax, float(run["Hs_limit"].values[-1]))
        kit.axis(ax, title="\n".join(textwrap.wrap(name, 34)), size="x-small")
    kit.hide(axes.flat[len(cells) :])
    for ax in axes[-1]:
        kit.axis(ax, "runs of each cell", size="small")
    for ax in axes[:, 0]:
        kit.axis(ax, y="limiting Hs [m]", size="small")
    return figure


def waiting(block: xarray.Dataset) -> Figure:
    """Operability and waiting by month: lines are means, the mark above each month what 90 % of the starts stay
    below."""
    title = "Operability and waiting for a window by month of readiness, credited limits"
    mark = "SYNTHETIC WEATHER. " if block.attrs["synthetic"] else ""
    figure, axes = page(2, 1, 5.4, f"{mark}{title}", sharex=True)
    top, low = axes[:, 0]
    month = np.arange(1.0, 13.0)
    months = block.sel(credit=CREDITED, month=month)
    lines(top, month, months["operability"].transpose("alternative", ...), 100.0, marker="o", ms=3)
    for key, style in (("wait_mean", {"marker": "o", "ms": 3}), ("wait_p90", {"ls": "none", "marker": "_", "ms": 7})):
        lines(low, month, months[key].transpose("alternative", ...), 1.0 / DAY, **style)
    kit.axis(top, y="operability [%]", size="small")
    kit.axis(low, y="waiting [days]\nline: mean, dash: P90", zero="y", size="small")
    top.set_ylim(0.0, 100.0)
    low.set_xticks(month, MONTHS)
    kit.legend_below(figure, [top])
    return figure
