"""Pictures of a tuning: error against pressure, and before and after side by side."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.units import in_display

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Rating(Protocol):
    """Anything with a mean control error [m] and a highest pressure [Pa]: a score, an outcome, a point of a front."""

    @property
    def e_c_pp_mean(self) -> float: ...

    @property
    def p_max(self) -> float: ...


def pareto_figure(
    fronts: Mapping[str, Sequence[Rating]], marks: Mapping[str, tuple[Rating, Rating]], *, title: str = ""
) -> Figure:
    """Mean control error against highest pressure: a front for each controller, its start hollow, its best filled.

    fronts: controller -> points of `front`; marks: controller -> start and best. Down and left is better.
    """
    figure, ax = kit.panel((8.0, 5.6), title)
    colours = colours_of(marks)
    for name, (start, best) in marks.items():
        at, colour = [_at(p) for p in fronts.get(name, ())], colours[name]
        ax.step([x for x, _ in at], [y for _, y in at], where="post", color=colour, lw=1.4)
        ax.plot(*_at(start), "o", ms=8, mec=colour, mfc="none")
        ax.plot(*_at(best), "o", ms=8, mec=colour, mfc=colour, label=name)
    ax.set(xlabel="highest pressure over all scenarios [bar]", ylabel="mean control error, peak-to-peak [mm]")
    ax.set_ylim(bottom=0.0)
    ax.legend(frameon=False, title="hollow: as it starts, filled: at its best,\nline: what it can trade")
    return figure


def _at(p: Rating) -> tuple[float, float]:
    return in_display(p.p_max, "pressure"), in_display(p.e_c_pp_mean, "diameter")


STYLES = (
    ("as it starts", GREY, ""),
    ("at its best", COLOURS[0], ""),
    ("as it starts, hold-out", "#CCCCCC", "//"),
    ("at its best, hold-out", COLOURS[5], "//"),
)
WIDTH = 0.2


def bars_figure(rows: Mapping[str, Sequence[Rating]], *, title: str = "") -> Figure:
    """Mean error and highest pressure of every controller: before and after, then the same in scenarios that the tuning
    never saw."""
    without = any(math.isnan(r.p_max) for row in rows.values() for r in row)  # a winch without pressure
    labels = ("mean error p-p [mm]",) if without else ("mean error p-p [mm]", "highest pressure [bar]")
    figure, axes = kit.panels(len(labels), 1, (9.0, 6.4), title, grid="y", sharex=True)
    axes = axes.ravel()
    for i, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        for k, (name, colour, hatch) in enumerate(STYLES):
            at = [j + (k - 1.5) * WIDTH for j in range(len(rows))]
            heights = [_at(row[k])[1 - i] for row in rows.values()]
            bars = ax.bar(at, heights, WIDTH, color=colour, hatch=hatch, edgecolor="white", label=name)
            ax.bar_label(bars, fmt="%.0f", fontsize=7)
        ax.set_ylabel(label)
        ax.margins(y=0.12)
    axes[-1].set_xticks(range(len(rows)), list(rows))
    axes[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False, fontsize="small")
    figure.align_ylabels(axes)
    return figure
