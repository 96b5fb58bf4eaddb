"""Pictures of a tuning: error against pressure, and before and after side by side."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.units import in_display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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

    fronts: controller -> points of `tune_compare.front`; marks: controller -> start and best. Down and left is better.
    """
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    ax = figure.subplots()
    colours = colours_of(marks)
    for name, (start, best) in marks.items():
        colour = colours[name]
        at = [_at(p) for p in fronts.get(name, ())]
        ax.step([x for x, _ in at], [y for _, y in at], where="post", color=colour, lw=1.4)
        ax.plot(*_at(start), "o", ms=8, mec=colour, mfc="none")
        ax.plot(*_at(best), "o", ms=8, mec=colour, mfc=colour, label=name)
    ax.set_xlabel("highest pressure over all scenarios [bar]")
    ax.set_ylabel("mean control error, peak-to-peak [mm]")
    ax.set_ylim(bottom=0.0)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, title="hollow: as it starts, filled: at its best,\nline: what it can trade")
    figure.suptitle(title, fontsize="medium")
    return figure


def _at(p: Rating) -> tuple[float, float]:
    return in_display(p.p_max, "pressure"), in_display(p.e_c_pp_mean, "diameter")


def bars_figure(rows: Mapping[str, Sequence[Rating]], *, title: str = "") -> Figure:
    """Mean error and highest pressure of every controller: before and after, then the same in scenarios that the tuning
    never saw."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    errors = [[_at(r)[1] for r in row] for row in rows.values()]
    if any(math.isnan(r.p_max) for row in rows.values() for r in row):  # a winch without pressure
        upper = lower = figure.subplots()
        _bars(upper, errors, "mean error p-p [mm]")
    else:
        upper, lower = figure.subplots(2, 1, sharex=True)
        _bars(upper, errors, "mean error p-p [mm]")
        _bars(lower, [[_at(r)[0] for r in row] for row in rows.values()], "highest pressure [bar]")
    lower.set_xticks(range(len(rows)), list(rows))
    upper.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False, fontsize="small")
    figure.suptitle(title, fontsize="medium")
    figure.align_ylabels((upper, lower))
    return figure


STYLES = (
    ("as it starts", GREY, ""),
    ("at its best", COLOURS[0], ""),
    ("as it starts, hold-out", "#CCCCCC", "//"),
    ("at its best, hold-out", COLOURS[5], "//"),
)
WIDTH = 0.2


def _bars(ax: Axes, rows: Sequence[Sequence[float]], label: str) -> None:
    for k, (name, colour, hatch) in enumerate(STYLES):
        at = [i + (k - 1.5) * WIDTH for i in range(len(rows))]
        bars = ax.bar(at, [row[k] for row in rows], WIDTH, color=colour, hatch=hatch, edgecolor="white", label=name)
        ax.bar_label(bars, fmt="%.0f", fontsize=7)
    ax.set_ylabel(label)
    ax.margins(y=0.12)
    ax.grid(axis="y", alpha=0.3)
    ax.set_axisbelow(True)
