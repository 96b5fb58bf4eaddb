"""Figures of the limits: what is workable in every cell and what governs there, and height over period for all
alternatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.detail import detail_figures
from stillhook.plan.report.figures.style import COLOUR, MARKER, THICK, WIDTH, page
from stillhook.plan.report.figures.sweep import sweep
from stillhook.plan.report.words import CREDITED, TWIN, codes, differs, height, highest, limits, named, names
from stillhook.plan.result import Credit, PlanResult, grouped
from stillhook.report import kit
from stillhook.report.formatting import direction
from stillhook.report.kit import pngs
from stillhook.report.plots.colours import GREY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


RESOLUTION = 150
"""Of pictures [dots per inch]."""
ROWS = 21
"""Rows of cells in one picture at most; more alternatives go to a second one."""
ROW, PANEL, FRAME = 0.33, 0.42, 0.8
"""Height of a row of cells, of the margins of each strip, and of the margins of the picture [inch]."""
COLOURS, NOTHING, UNKNOWN, DARK = "YlGnBu", "#E8A598", "#E0E0E0", 0.62
"""Scale of limits; colour of a cell with the limit 0, and of an undetermined one; part of the scale from which letters
are white."""
MANY = 14
"""Periods beyond which letters of cells are small."""
PANELS = 3
"""Headings side by side at most."""
CLOSED = "closed-form"


def pictures(result: PlanResult) -> dict[str, bytes]:
    """Every figure as PNG, by file stem: the same bytes whatever the settings of matplotlib here."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return pngs(figures(result), RESOLUTION)


def figures(result: PlanResult) -> dict[str, Figure]:
    """Every figure of a plan by file stem, in the order in which a report shows them."""
    of_limits = {"limits-over-period": curves(result)}
    swept = {"sweep": sweep(result["sweep"])} if "sweep" in result else {}
    tables = limit_tables(result, CREDITED) | limit_tables(result, TWIN)
    return of_limits | tables | detail_figures(result) | swept


def highest_shown(result: PlanResult) -> float:
    """Top of the scales: the highest sea state analysed, or less where no limit comes near it [m]."""
    most = np.nan_to_num(result.data["Hs_limit"].values, nan=0.0, posinf=highest(result)).max()
    return min(highest(result), max(1.0, float(np.ceil(2.4 * most) / 2.0)))


def limit_tables(result: PlanResult, credit: Credit) -> dict[str, Figure]:
    """Limits by heading and period with the phase and the rule that govern; by the twin only of those that credit takes
    something from."""
    wanted = names(result.data)
    if credit == TWIN:
        wanted = [name for name in wanted if differs(result, name)]
    strips, each = equal_tables(result, credit, wanted), max(1, ROWS // result.data.sizes["heading"])
    parts = [strips[i : i + each] for i in range(0, len(strips), each)]
    return {
        f"limits-{credit}{f'-{i + 1}' if len(parts) > 1 else ''}": limit_table(result, credit, part)
        for i, part in enumerate(parts)
    }


def equal_tables(result: PlanResult, credit: Credit, alternatives: Sequence[str]) -> list[list[str]]:
    """Alternatives whose tables are the same, limit by limit and by what governs, side by side."""

    def content(name: str) -> bytes:
        cells = result.data.sel(credit=credit, alternative=name)
        texts = [cells[key].values.astype("<U200").tobytes() for key in ("governing_phase", "governing_rule")]
        return b"".join([np.round(cells["Hs_limit"].values, 2).tobytes(), *texts])

    return list(grouped((content(name), name) for name in alternatives).values())


def limit_table(result: PlanResult, credit: Credit, strips: Sequence[Sequence[str]]) -> Figure:
    """A strip of cells for alternatives that are alike: rows are headings, columns periods; in each the limit, below it
    what governs."""
    label = "credited" if credit == CREDITED else "simulated (not creditable)"
    title = f"Limiting significant wave height Hs [m], {label}"
    tall = FRAME + len(strips) * (PANEL + ROW * result.data.sizes["heading"])
    figure, axes = kit.panels(len(strips), 1, (WIDTH, tall), title, grid="")
    for ax, labels in zip(axes[:, 0], strips, strict=True):
        _strip(ax, result, credit, labels[0])
        ax.set_title(", ".join(named(name) for name in labels), fontsize="small", loc="left", pad=3)
    kit.axis(axes[-1, 0], "peak period Tp [s]", size="small")
    return figure


def _strip(ax: Axes, result: PlanResult, credit: Credit, name: str) -> None:
    cells, Hs = result.data.sel(credit=credit, alternative=name), limits(result, credit, name)
    part = np.clip(np.nan_to_num(Hs, nan=0.0, posinf=highest(result)) / highest_shown(result), 0.0, 1.0)
    governing = [cells[f"governing_{key}"].values for key in ("phase", "rule")]

    def text(i: int, k: int) -> str:
        of = codes(result, *(str(each[i, k]) for each in governing))
        return "\n".join(line for line in (height(float(Hs[i, k]), highest(result)), of) if line)

    texts = [[text(i, k) for k in range(Hs.shape[1])] for i in range(Hs.shape[0])]
    rows = [direction(b) for b in result.data["heading"].values]
    columns = [f"{T:g}" for T in result.data["period"].values]
    inks = np.where(part > DARK, "white", "black")
    size = "xx-small" if Hs.shape[1] > MANY else "x-small"
    kit.heat(ax, _colours(Hs, part), rows, columns, texts, inks=inks, size=size)


def _colours(Hs: FloatArray, part: FloatArray) -> FloatArray:
    """Colours of cells (heading, period, 4)."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgba

    colours = colormaps[COLOURS](0.85 * part)
    colours[np.isnan(Hs)] = to_rgba(UNKNOWN)
    colours[Hs <= 0.0] = to_rgba(NOTHING)
    return np.asarray(colours)


def closed_form(result: PlanResult) -> FloatArray:
    """Least limit over phases and rules by the closed form alone (alternative, heading, period) [m]; NaN where none
    is determined."""
    Hs = result.data["Hs_rule"].sel(credit=TWIN, tier=CLOSED).min(dim=("phase", "rule"))
    return np.asarray(Hs.transpose("alternative", "heading", "period").values, dtype=float)


def telling(result: PlanResult) -> list[int]:
    """Headings that are drawn side by side: all of a few; of many the one with the least limits in the mean, the one
    with the largest, and that nearest to a head sea."""
    beta = result.data["heading"].values
    if len(beta) <= PANELS:
        return list(range(len(beta)))
    Hs = result.data["Hs_limit"].sel(credit=CREDITED).values
    mean = np.nan_to_num(Hs, nan=0.0, posinf=highest(result)).mean(axis=(0, 2))
    return sorted({int(mean.argmin()), int(mean.argmax()), int(np.abs(beta - np.pi).argmin())})


def curves(result: PlanResult) -> Figure:
    """Limiting height over peak period, a panel a heading, all alternatives: credited drawn out, by the twin dashed,
    closed form dotted."""
    data, most, chosen = result.data, highest(result), telling(result)
    title = f"Limits over period by alternative (full lines: credited; analysed up to {most:g} m)"
    figure, axes = page(1, len(chosen), 4.1, title, sharey=True)
    T, closed = data["period"].values, closed_form(result)
    for ax, i in zip(axes[0], chosen, strict=True):
        for a, name in enumerate(names(data)):
            credited, twin = (np.minimum(limits(result, c, name)[i], most) for c in (CREDITED, TWIN))
            style = {"color": COLOUR[name], "lw": THICK[name]}
            ax.plot(T, credited, marker=MARKER[name], ms=3.5, label=named(name), **style)
            if differs(result, name):
                ax.plot(T, twin, ls="--", **style)
            if name in ("none", "cap-80"):
                ax.plot(T, np.minimum(closed[a, i], most), ls=":", **style)
        kit.axis(ax, "peak period Tp [s]", title=f"waves at {direction(data['heading'].values[i])}", size="small")
        ax.axhline(most, color=GREY, lw=0.8)
    first = axes[0, 0]
    first.set_ylim(0.0, 1.04 * highest_shown(result))
    kit.axis(first, y="limiting significant wave height Hs [m]", size="small")
    for ls, label in (("--", "simulated (not creditable)"), (":", "closed form alone")):
        first.plot([], [], color=GREY, ls=ls, label=label)
    kit.legend_below(figure, [first], 4)
    return figure
