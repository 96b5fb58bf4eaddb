"""Figures behind the limits: depth, efficiency, landing, sensitivity of the limit, and convergence over the seeds.

Figures of waiting: by month, and what each alternative gains over the others.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.plan.report.words import (
    COLOUR,
    CREDITED,
    THICK,
    TWIN,
    canvas,
    key_below,
    lines,
    named,
    names,
    sea_words,
)
from stillhook.plan.result import PlanResult, columns, references
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import in_display
from stillhook.weather.persistence import MONTHS

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


FACTORS = {
    "C_A": "added mass",
    "C_D": "drag",
    "friction": "friction of the winch",
    "delay": "delay of the motion signal",
}
"""Inputs that a limit depends on, in words."""


def detail_figures(result: PlanResult) -> dict[str, Figure]:
    """Figures of the blocks that are there, by file stem."""
    highest = float(result.data.attrs["Hs_highest"])
    functions: dict[str, Callable[[xarray.Dataset], Figure]] = {
        "depth": depth,
        "efficiency": efficiency,
        "landing": landing,
        "sensitivity": lambda block: sensitivity(block, highest),
        "convergence": convergence,
    }
    return {name: draw(result[name]) for name, draw in functions.items() if name in result}


def depth(block: xarray.Dataset) -> Figure:
    """Tension at the tip, dynamic factor, least sling tension and natural period against depth, with the depth of
    resonance."""
    z = -np.asarray(block["z"].values, dtype=float)
    figure, axes = canvas(1, 4, 4.4, sharey=True)
    row = axes[0]
    kN = in_display(1.0, "force")
    for name in names(block):
        style = {"color": COLOUR[name], "lw": THICK[name]}
        row[0].plot(kN * block["F_top_max"].sel(alternative=name), z, label=named(name), **style)
        row[1].plot(block["DAF"].sel(alternative=name), z, **style)
        row[2].plot(block["sling_ratio"].sel(alternative=name), z, **style)
    row[0].plot(kN * block["F_top_static"].values, z, color=GREY, lw=1.0, ls="--", label="at rest")
    row[2].axvline(0.0, color=GREY, lw=0.8)
    row[3].plot(block["T_0"].values, z, color="black", lw=1.3)
    row[3].axvline(float(block.attrs["Tp"]), color=GREY, lw=0.8, ls="--")
    titles = [
        "tension at tip [kN]",
        "DAF [-]: sling tension\nover weight in air",
        "least sling tension\nover that at rest [-]",
        "natural period on\nthe wire [s] (dashed: Tp)",
    ]
    at = float(block.attrs["z_resonance"])
    for ax, title in zip(row, titles, strict=True):
        ax.set_xlabel(title, fontsize="small")
        if math.isfinite(at):
            ax.axhline(-at, color=COLOURS[1], lw=0.9, ls=":")
    row[0].set_ylabel("depth of the payload's underside [m]", fontsize="small")
    row[0].set_ylim(float(z.max()), float(z.min()))
    resonance = f"resonance at {-at:.0f} m (dotted)" if math.isfinite(at) else "no resonance on the way"
    figure.suptitle(f"Against depth: {sea_words(block.attrs)}; {resonance}", fontsize="medium")
    key_below(figure, [row[0]], 7)
    return figure


def efficiency(block: xarray.Dataset) -> Figure:
    """Share of the tip's motion that compensation takes away, at the wire and at the payload."""
    figure, axes = canvas(1, 2, 3.2, sharey=True)
    for ax, name, title in zip(axes[0], ("eta_wire", "eta_load"), ("at the wire", "at the payload"), strict=True):
        lines(ax, block["period"].values, block[name], 100.0, marker="o", ms=3)
        ax.axhline(0.0, color=GREY, lw=0.8)
        ax.set_title(title, fontsize="small")
        ax.set_xlabel("peak period Tp [s]", fontsize="small")
    low = min(float(np.nanmin(block[name].values)) for name in ("eta_wire", "eta_load"))
    axes[0, 0].set_ylim(max(-100.0, min(0.0, 105.0 * low)), 103.0)
    axes[0, 0].set_ylabel("compensation efficiency [%]", fontsize="small")
    where = f"{-float(block.attrs['z']):.0f} m depth"
    figure.suptitle(f"Compensation efficiency at {where}: {sea_words(block.attrs)}", fontsize="medium")
    key_below(figure, [axes[0, 0]])
    return figure


def landing(block: xarray.Dataset) -> Figure:
    """Share of the landings that were faster than a speed, one per seed."""
    figure, axes = canvas(1, 1, 3.4)
    ax = axes[0, 0]
    for name in names(block):
        v = np.asarray(block["v_landed"].sel(alternative=name).values, dtype=float)
        v = np.sort(v[np.isfinite(v)])
        if len(v):
            share = 100.0 * (1.0 - (np.arange(len(v)) + 0.5) / len(v))
            ax.step(v, share, where="mid", color=COLOUR[name], lw=THICK[name], label=f"{named(name)} ({len(v)})")
    if math.isfinite(float(block.attrs["limit"])):
        ax.axvline(float(block.attrs["limit"]), color=GREY, lw=1.0, ls="--", label="limit")
    ax.set(ylim=(0.0, 100.0))
    ax.set_xlim(left=0.0)
    ax.set_xlabel("speed at touch-down [m/s]", fontsize="small")
    ax.set_ylabel("landings that are faster [%]", fontsize="small")
    figure.suptitle(
        f"Landing speed exceeded, in brackets the number of seeds: {sea_words(block.attrs)}", fontsize="medium"
    )
    key_below(figure, [ax], 4)
    return figure


def sensitivity(block: xarray.Dataset, highest: float) -> Figure:
    """Limit with one input taken lower and higher, alternatives side by side; one above the highest sea state analysed
    [m] stands there."""
    shown = [n for n in names(block) if not np.isnan(block["Hs_base"].sel(alternative=n).values).all()]
    rows = block.sizes["factor"]
    figure, axes = canvas(1, max(1, len(shown)), 1.4 + 0.5 * rows, sharey=True, sharex=True)
    y = np.arange(rows)
    for ax, name in zip(axes[0], shown, strict=False):
        base, low, high = (
            np.minimum(block[k].sel(alternative=name).values, highest) for k in ("Hs_base", "Hs_low", "Hs_high")
        )
        ax.plot(base, y, color="black", marker="|", ms=14, ls="none", label="as planned")
        for ends, colour, marker, label in (
            (low, COLOURS[0], "o", "first value"),
            (high, COLOURS[1], "s", "second value"),
        ):
            ax.hlines(y, base, np.where(np.isnan(ends), base, ends), color=colour, lw=2.0)
            ax.plot(ends, y, color=colour, marker=marker, ms=5, ls="none", label=label)
        for i in np.flatnonzero(np.isnan(low) & np.isnan(high)):
            ax.text(float(base[i]), float(y[i]) - 0.2, "not analysed", fontsize="xx-small", ha="center", color=GREY)
        ax.axvline(highest, color=GREY, lw=0.8, ls="--")
        ax.set_title(named(name), fontsize="small")
    axes[0, 0].set_yticks(y, [_factor(block, i) for i in range(rows)], fontsize="x-small")
    axes[0, 0].set_ylim(rows - 0.5, -0.5)
    limits = np.minimum(np.concatenate([block[k].values.ravel() for k in ("Hs_base", "Hs_low", "Hs_high")]), highest)
    limits = limits[np.isfinite(limits)]
    if limits.size:
        room = max(0.1, 0.12 * float(np.ptp(limits)))
        axes[0, 0].set_xlim(max(0.0, float(limits.min()) - room), float(limits.max()) + room)
    where = ", ".join(block.attrs[key] for key in ("phase", "rule"))
    figure.suptitle(f"Limiting Hs [m] with other inputs: {sea_words(block.attrs)} ({where})", fontsize="medium")
    key_below(figure, [axes[0, 0]])
    return figure


def _factor(block: xarray.Dataset, i: int) -> str:
    name, low, high = (str(block[key].values[i]) for key in ("factor", "low_text", "high_text"))
    return "\n".join(textwrap.wrap(f"{FACTORS.get(name, name)}: {low} to {high}", 28))


def convergence(block: xarray.Dataset) -> Figure:
    """Limits of the middle column as runs are added, with their 95 % interval."""
    cells = names(block, "cell")
    columns = min(3, max(1, len(cells)))
    figure, axes = canvas(-(-len(cells) // columns), columns, 0.6 + 2.3 * -(-len(cells) // columns), sharex=True)
    flat: list[Any] = list(np.ravel(axes))
    for ax, name in zip(flat, cells, strict=False):
        run = block.sel(cell=name)
        n = run["n"].values
        ax.fill_between(n, run["low"].values, run["high"].values, color=COLOURS[0], alpha=0.2, lw=0)
        ax.plot(n, run["Hs_limit"].values, color=COLOURS[0], lw=1.3, marker="o", ms=2.5)
        ax.axhline(float(run["Hs_limit"].values[-1]), color=GREY, lw=0.9, ls="--")
        ax.set_title("\n".join(textwrap.wrap(name, 34)), fontsize="x-small")
    for ax in flat[len(cells) :]:
        ax.set_visible(False)
    for ax in axes[-1]:
        ax.set_xlabel("runs of each cell", fontsize="small")
    for ax in axes[:, 0]:
        ax.set_ylabel("limiting Hs [m]", fontsize="small")
    figure.suptitle(
        "Convergence: limit by the first runs of every cell of the table; band is the 95 % interval",
        fontsize="medium",
    )
    return figure


DAY = 86400.0
OVER = {"none": "no compensation", "cap-80": "the 80 % cap", "best-classic": "the best classic controller"}


def weather_figures(result: PlanResult) -> dict[str, Figure]:
    """Figures of the weather that the plan was held against, if it was."""
    if "weather" not in result:
        return {}
    block = result["weather"]
    return {"waiting-by-month": waiting(block), "days-gained": gained(block, result)}


def marked(block: xarray.Dataset, title: str) -> str:
    """A title that says where the weather is synthetic."""
    return f"SYNTHETIC WEATHER. {title}" if block.attrs["synthetic"] else title


def waiting(block: xarray.Dataset) -> Figure:
    """Operability and waiting by month: lines are means, the mark above each month what 90 % of the starts stay
    below."""
    figure, axes = canvas(2, 1, 5.4, sharex=True)
    top, low = axes[:, 0]
    month = np.arange(1, 13)
    for name in names(block):
        months = block.sel(credit=CREDITED, alternative=name, month=month)
        style = {"color": COLOUR[name], "lw": THICK[name], "marker": "o", "ms": 3, "label": named(name)}
        top.plot(month, 100.0 * months["operability"].values, **style)
        low.plot(month, months["wait_mean"].values / DAY, **style)
        low.plot(month, months["wait_p90"].values / DAY, color=COLOUR[name], ls="none", marker="_", ms=7)
    top.set_ylabel("operability [%]", fontsize="small")
    low.set_ylabel("waiting [days]\nline: mean, dash: P90", fontsize="small")
    top.set_ylim(0.0, 100.0)
    low.set_ylim(bottom=0.0)
    low.set_xticks(month, MONTHS)
    title = "Operability and waiting for a window by month of readiness, credited limits"
    figure.suptitle(marked(block, title), fontsize="medium")
    key_below(figure, [top])
    return figure


def gained(block: xarray.Dataset, result: PlanResult) -> Figure:
    """Vessel days that an alternative saves each operation, against no compensation, the cap and the best classic
    controller; alternatives that are not distinguished have one bar."""
    over = references(block, result.facts["tiers"])
    figure, axes = canvas(1, max(1, len(over)), 3.4, sharey=True)
    groups = columns(result)
    labels = [group[0] for group in groups]
    x = np.arange(len(labels))
    for ax, against in zip(axes[0], over, strict=False):
        days = block["days_gained"].sel(over=against, month=0, alternative=labels)
        ax.bar(
            x - 0.2, np.nan_to_num(days.sel(credit=TWIN).values), 0.38, color=[COLOUR[n] for n in labels], alpha=0.35
        )
        ax.bar(x + 0.2, np.nan_to_num(days.sel(credit=CREDITED).values), 0.38, color=[COLOUR[n] for n in labels])
        if "days_gained_low" in block:
            low, high = (block[f"days_gained_{end}"].sel(over=against, alternative=labels) for end in ("low", "high"))
            for at, credit in ((x - 0.2, TWIN), (x + 0.2, CREDITED)):
                ax.vlines(at, low.sel(credit=credit).values, high.sel(credit=credit).values, color="black", lw=0.9)
        ax.axhline(0.0, color=GREY, lw=0.8)
        ax.set_xticks(
            x, [", ".join(named(n) for n in group) for group in groups], rotation=40, ha="right", fontsize="x-small"
        )
        ax.set_title(f"over {OVER.get(against, against)}", fontsize="small")
    axes[0, 0].set_ylabel("days gained each operation\n(pale: twin, full: credited)", fontsize="small")
    figure.suptitle(marked(block, "Vessel days gained, whole year"), fontsize="medium")
    return figure
