"""Pictures of a tuning: error against pressure, and before and after side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from stillhook.analysis.tune import Tuned
from stillhook.analysis.tune_compare import Outcome, Point
from stillhook.io.figures import COLOURS, GREY
from stillhook.units import in_display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def pareto_figure(fronts: Mapping[str, Sequence[Point]], tuned: Sequence[Tuned], *, title: str = "") -> Figure:
    """Mean control error against highest pressure: a front for each controller, its start hollow, its best filled.

    fronts: controller -> points of `tune_compare.front`; tuned: the tunings whose start and best are marked. Down and left is better.
    """
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    ax = figure.subplots()
    for colour, t in zip(COLOURS * 2, tuned, strict=False):
        name = t.start.name
        points = fronts.get(name, ())
        ax.step(
            [in_display(p.p_max, "pressure") for p in points], [in_display(p.e_c_pp_mean, "diameter") for p in points],
            where="post", color=colour, lw=1.4, label=name,
        )  # fmt: skip
        for score, fill in ((t.before, "none"), (t.after, colour)):
            at = in_display(score.p_max, "pressure"), in_display(score.e_c_pp_mean, "diameter")
            ax.plot(*at, "o", ms=8, mec=colour, mfc=fill, label=None if points or fill == "none" else name)
    ax.set_xlabel("highest pressure over all scenarios [bar]")
    ax.set_ylabel("mean control error, peak-to-peak [mm]")
    ax.set_ylim(bottom=0.0)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, title="hollow: as it starts, filled: at its best")
    figure.suptitle(title, fontsize="medium")
    return figure


def bars_figure(tuned: Sequence[Tuned], held_out: Sequence[tuple[Outcome, Outcome]], *, title: str = "") -> Figure:
    """Mean error and highest pressure of every controller before and after, on the tuning's scenarios and on those it never saw.

    held_out: outcome before and after, for each of the tunings.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    errors = [[in_display(s.e_c_pp_mean, "diameter") for s in (t.before, t.after, *h)] for t, h in zip(tuned, held_out, strict=True)]
    pressures = [[in_display(s.p_max, "pressure") for s in (t.before, t.after, *h)] for t, h in zip(tuned, held_out, strict=True)]
    _bars(upper, errors, "mean error p-p [mm]")
    _bars(lower, pressures, "highest pressure [bar]")
    lower.set_xticks(range(len(tuned)), [t.start.name for t in tuned])
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
