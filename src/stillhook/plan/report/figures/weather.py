"""Figures of waiting: by month, and what each alternative gains over the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.plan.report.figures.style import COLOUR, CREDITED, THICK, TWIN, canvas, key_below, named, names
from stillhook.plan.result.distinguishable import columns, references
from stillhook.plan.result.result import PlanResult
from stillhook.report.plots.run import GREY

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
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
    return f"SYNTHETIC WEATHER. {title}" if int(block.attrs.get("synthetic", 0)) else title


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
    figure.suptitle(
        marked(block, "Operability and waiting for a window by month of readiness, credited limits"), fontsize="medium"
    )
    key_below(figure, [top])
    return figure


def gained(block: xarray.Dataset, result: PlanResult) -> Figure:
    """Vessel days that an alternative saves each operation, against no compensation, the cap and the best classic
    controller; alternatives that are not told apart have one bar."""
    over = references(block, result.facts.get("tiers", ()))
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
        ax.axhline(0.0, color=GREY, lw=0.8)
        ax.set_xticks(
            x, [", ".join(named(n) for n in group) for group in groups], rotation=40, ha="right", fontsize="x-small"
        )
        ax.set_title(f"over {OVER.get(against, against)}", fontsize="small")
    axes[0, 0].set_ylabel("days gained each operation\n(pale: twin, full: credited)", fontsize="small")
    figure.suptitle(marked(block, "Vessel days gained, whole year"), fontsize="medium")
    return figure
