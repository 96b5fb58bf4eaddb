"""Figures of a plan: the limits of the first page with what governs them, those of all alternatives, height over
period, tension against depth, and waiting by month."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative
from stillhook.plan.report.words import (
    CREDITED,
    TEXTS,
    TWIN,
    codes,
    differs,
    few,
    governing_of,
    governs,
    height,
    highest,
    leading,
    limits,
    named,
    names,
    sea_words,
    worst_heading,
    write,
)
from stillhook.plan.result import Credit, PlanResult, claim_in, grouped
from stillhook.report import document, kit
from stillhook.report.formatting import DAY, direction, fixed
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.units import in_display
from stillhook.weather.persistence import MONTHS

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RESOLUTION = 150
"""Of pictures [dots per inch]."""
ROWS = 10
"""Rows of cells in one picture at most; more alternatives go to another one."""
ANSWER, CLAIM = "answer", "claim"
"""Stems of the figure of the claimable limits cell by cell, and of the small one of the first page."""
HEADINGS, COLUMNS = 5, 14
"""Rows and columns of cells on the first page at most; all are in the section of the limits."""
ROW, PANEL, FRAME = 0.33, 0.42, 0.8
"""Height of a row of cells, of the margins of each strip, and of the margins of the picture [inch]."""
SCALE, NOTHING, UNKNOWN, DARK, BOXED = "YlGnBu", "#E8A598", "#E0E0E0", 0.62, "#D55E00"
"""Scale of limits; colour of a cell with the limit 0, and of an undetermined one; part of the scale from which letters
are white; colour of the box of the worst heading."""
STEEP, NOT_CREDITED = "steepness", "#707070"
"""End of limits that are cut at the steepest sea, and the colour of their letters."""
MANY = 14
"""Periods beyond which letters of cells are small."""
PANELS = 3
"""Headings side by side at most."""


def pictures(result: PlanResult) -> dict[str, document.Figure]:
    """Every figure with its caption, by file stem: the same bytes with any settings of matplotlib."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return kit.printed(figures(result), RESOLUTION)


def captioned(figure: Figure, key: str, *more: str, **values: Any) -> Figure:
    """The figure with its caption of `TEXTS`, and with sentences in the place of panels whose values do not vary."""
    return kit.caption(figure, " ".join([write(TEXTS["captions"][key], **values), *filter(None, more)]).strip())


def figures(result: PlanResult) -> dict[str, Figure]:
    """Every figure of a plan by file stem, in the order in which a report shows them."""
    first = answer(result)
    of_limits = (
        {CLAIM: claim_curves(result)}
        | ({} if first is None else {ANSWER: first})
        | {"limits-over-period": curves(result)}
    )
    tables = limit_tables(result, CREDITED) | limit_tables(result, TWIN)
    return of_limits | tables | detail_figures(result)


def answer(result: PlanResult) -> Figure | None:
    """The claimable limits of the leading alternative by heading and period with what governs, the worst heading of
    each period in a box; none where all cells are alike."""
    name = leading(result)
    Hs = limits(result, result.claim, name)
    if not kit.varies(np.nan_to_num(Hs, nan=-1.0, posinf=highest(result)).ravel()):
        return None
    data, worst = result.data, worst_heading(Hs)
    rows = sorted({*few(data.sizes["heading"], HEADINGS), int(np.nan_to_num(Hs, posinf=99.0).mean(axis=1).argmin())})
    columns = few(data.sizes["period"], COLUMNS)
    part = PlanResult(data.isel(heading=rows, period=columns), result.facts, result.blocks)
    figure, ax = kit.panel((WIDTH, FRAME - 0.2 + (ROW if len(rows) < HEADINGS else 0.8 * ROW) * len(rows)), grid="")
    _strip(ax, part, result.claim, name, scale=result)
    for k, column in enumerate(columns):
        if worst[column] in rows:
            _box(ax, rows.index(worst[column]), k)
    kit.axis(ax, "peak period Tp [s]", "waves travel to", size="small")
    counted = Counter(governing_of(part.data.sel(credit=result.claim, alternative=name)))
    words = [
        f"{code}: {governs(*of).replace(': ', ', ', 1)}"
        for of, _ in counted.most_common()
        if (code := codes(result, *of))
    ]
    left_out = (len(rows), len(columns)) != Hs.shape
    more = TEXTS["captions"]["part"].format(rows=len(rows), columns=len(columns)) if left_out else ""
    of = {"name": named(name), "credit": result.claim, "codes": "; ".join(words) or "nothing"}
    return captioned(figure, ANSWER, more, **of)


def claim_curves(result: PlanResult) -> Figure:
    """The claimable limits over period, a line a heading (of many headings the best and the worst of all), and below
    them OP_WF at the worst heading."""
    data, name = result.data, leading(result)
    Hs = np.minimum(limits(result, result.claim, name), highest(result))
    T, worst = data["period"].values, worst_heading(Hs)
    figure, ax = kit.panel(SMALL)
    shown = range(len(Hs)) if len(Hs) <= HEADINGS else sorted({int(i) for i in (Hs.mean(axis=1).argsort()[[0, -1]])})
    for i in shown:
        label = f"OP_LIM, {direction(data['heading'].values[i])}"
        ax.plot(T, Hs[i], marker="o", ms=2.5, lw=1.1, label=label)
    op_wf = data["op_wf"].sel(credit=result.claim, alternative=name).values[worst, range(len(T))]
    if np.isfinite(op_wf).any():
        ax.plot(T, op_wf, color="black", marker="s", ms=2.5, lw=1.1, ls="--", label="OP_WF, worst heading")
    kit.axis(ax, "Tp [s]", "Hs [m]", zero="y", size="small")
    ax.tick_params(labelsize="small")
    ax.legend(fontsize="xx-small", frameon=False)
    return captioned(figure, CLAIM)


SMALL = (3.3, 1.9)
"""Size of the figure of the first page [inch]: letters as they are, beside a table."""


def _box(ax: Axes, i: int, k: int) -> None:
    from matplotlib.patches import Rectangle

    ax.add_patch(Rectangle((k - 0.47, i - 0.45), 0.94, 0.9, fill=False, edgecolor=BOXED, lw=1.6))


def highest_shown(result: PlanResult) -> float:
    """Top of the scales: the highest sea state analysed, or less where no limit comes near it [m]."""
    most = np.nan_to_num(result.data["Hs_limit"].values, nan=0.0, posinf=highest(result)).max()
    return min(highest(result), max(1.0, float(np.ceil(2.4 * most) / 2.0)))


def limit_tables(result: PlanResult, credit: Credit) -> dict[str, Figure]:
    """Limits by heading and period with what governs; by the twin only of those that credit takes something from."""
    wanted = names(result.data)
    if credit == TWIN:
        wanted = [name for name in wanted if differs(result, name, other=CREDITED)]
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
        return b"".join([np.round(cells["Hs_limit"].values, 2).tobytes(), repr(governing_of(cells)).encode()])

    return list(grouped((content(name), name) for name in alternatives).values())


def limit_table(result: PlanResult, credit: Credit, strips: Sequence[Sequence[str]]) -> Figure:
    """A strip of cells for alternatives that are alike, headings by periods: the limit, below it what governs."""
    label = "credited" if credit == CREDITED else "simulated (not creditable)"
    title = f"Limiting significant wave height Hs [m], {label}"
    tall = FRAME + len(strips) * (PANEL + ROW * result.data.sizes["heading"])
    figure, axes = kit.panels(len(strips), 1, (WIDTH, tall), title, grid="")
    for ax, labels in zip(axes[:, 0], strips, strict=True):
        _strip(ax, result, credit, labels[0])
        ax.set_title(", ".join(named(name) for name in labels), fontsize="small", loc="left", pad=3)
    kit.axis(axes[-1, 0], "peak period Tp [s]", size="small")
    shown = ", ".join(named(name) for labels in strips for name in labels)
    return kit.strips(captioned(figure, f"limits-{credit}", names=shown))


def _strip(ax: Axes, result: PlanResult, credit: Credit, name: str, *, scale: PlanResult | None = None) -> None:
    """scale: the result that sets the scale of colours, where this one is a part of it."""
    cells, Hs = result.data.sel(credit=credit, alternative=name), limits(result, credit, name)
    top = highest_shown(result if scale is None else scale)
    part = np.clip(np.nan_to_num(Hs, nan=0.0, posinf=highest(result)) / top, 0.0, 1.0)
    governing = governing_of(cells)
    steep = np.array([end == STEEP for _, _, end in governing]).reshape(Hs.shape)

    def text(i: int, k: int) -> str:
        of = codes(result, *governing[i * Hs.shape[1] + k])
        return "\n".join(line for line in (height(float(Hs[i, k]), highest(result)), of) if line)

    texts = [[text(i, k) for k in range(Hs.shape[1])] for i in range(Hs.shape[0])]
    rows = [direction(b) for b in result.data["heading"].values]
    columns = [f"{T:g}" for T in result.data["period"].values]
    inks = np.where(steep, NOT_CREDITED, np.where(part > DARK, kit.ON_DARK, kit.ON_LIGHT))
    size = "xx-small" if Hs.shape[1] > MANY else "x-small"
    kit.heat(ax, _colours(Hs, part, steep), rows, columns, texts, inks=inks, size=size)


def _colours(Hs: FloatArray, part: FloatArray, steep: BoolArray) -> FloatArray:
    """Colours of cells (heading, period, 4); steep: those that steepness cuts."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgba

    colours = colormaps[SCALE](0.85 * part)
    colours[np.isnan(Hs) | steep] = to_rgba(UNKNOWN)
    colours[Hs <= 0.0] = to_rgba(NOTHING)
    return np.asarray(colours)


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
    """Limiting height over peak period, a panel a heading, all alternatives: credited drawn out, by the twin dashed."""
    data, most, chosen = result.data, highest(result), telling(result)
    title = f"Limits over period by alternative (full lines: credited; analysed up to {most:g} m)"
    figure, axes = page(1, len(chosen), 4.1, title, sharey=True)
    T = data["period"].values
    for ax, i in zip(axes[0], chosen, strict=True):
        for name in names(data):
            credited, twin = (np.minimum(limits(result, c, name)[i], most) for c in (CREDITED, TWIN))
            style = {"color": COLOUR[name], "lw": THICK[name]}
            ax.plot(T, credited, marker=MARKER[name], ms=3.5, label=named(name), **style)
            if differs(result, name, other=CREDITED):
                ax.plot(T, twin, ls="--", **style)
        kit.axis(ax, "peak period Tp [s]", title=f"waves at {direction(data['heading'].values[i])}", size="small")
        ax.axhline(most, color=GREY, lw=0.8)
    first = axes[0, 0]
    first.set_ylim(0.0, 1.04 * highest_shown(result))
    kit.axis(first, y="limiting significant wave height Hs [m]", size="small")
    first.plot([], [], color=GREY, ls="--", label="simulated (not creditable)")
    kit.legend_below(figure, [first], 4)
    return captioned(figure, "limits-over-period", headings=[direction(data["heading"].values[i]) for i in chosen])


WIDTH = 7.5
"""Of every figure [inch]: about that of a page, so that its letters are of one size."""
FIRST = (*ALTERNATIVES, *(alternative for alternative in Alternative if alternative not in ALTERNATIVES))
"""Alternatives in the order in which markers are taken: those of every plan first."""
COLOUR: Mapping[str, str] = colours_of(FIRST)
MARKER: Mapping[str, str] = {name: "xsv^oDP*"[i % 8] for i, name in enumerate(FIRST)}
THICK: Mapping[str, float] = {name: max(3.2 - 0.45 * i, 0.5) for i, name in enumerate(FIRST)}
"""Widths of lines: the later drawn is the thinner, so that lines that are one on the other are all seen."""


def page(rows: int, columns: int, tall: float, title: str, **more: Any) -> tuple[Figure, NDArray[Any]]:
    """A figure of the width of a page with its axes (rows, columns); tall [inch]."""
    figure, axes = kit.panels(rows, columns, (WIDTH, tall), title, **more)
    for ax in axes.flat:
        ax.tick_params(labelsize="small")
    return figure, axes


def lines(ax: Axes, x: FloatArray, of: xarray.DataArray, factor: float = 1.0, **style: Any) -> None:
    """A line for every alternative over x; of (alternative, ...)."""
    for name in names(of.to_dataset(name="value")):
        y = factor * np.asarray(of.sel(alternative=name).values, dtype=float)
        if np.isfinite(y).any():
            ax.plot(x, y, **{"color": COLOUR[name], "lw": THICK[name], "label": named(name), **style})


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
    return {stem: draw(result[block]) for stem, (block, draw) in functions.items() if drawn(result, block)}


def drawn(result: PlanResult, block: str) -> bool:
    """Whether a block is there with something to draw: no convergence of one number of runs."""
    return block in result and result[block].sizes.get("n", 2) > 1


DEPTH = {
    "F_top_max": "tension at tip [kN]",
    "DAF": "DAF [-]: sling tension\nover weight in air",
    "sling_ratio": "least sling tension\nover that at rest [-]",
    "T_0": "natural period on\nthe wire [s] (dashed: Tp)",
}
"""Panels of `depth`: variables and their axes."""


def depth(block: xarray.Dataset) -> Figure:
    """Tension at the tip, dynamic factor, least sling tension, natural period and depth of resonance against depth."""
    z, at = -np.asarray(block["z"].values, dtype=float), float(block.attrs["z_resonance"])
    resonance = f"resonance at {-at:.0f} m (dotted)" if math.isfinite(at) else "no resonance on the way"
    drawn = [key for key in DEPTH if kit.varies(*np.atleast_2d(block[key].values))] or ["F_top_max"]
    title = f"Against depth: {sea_words(block.attrs)}; {resonance}"
    figure, axes = page(1, len(drawn), 4.4, title, sharey=True)
    kN = in_display(1.0, "force")
    for ax, key in zip(axes[0], drawn, strict=True):
        factor = kN if key == "F_top_max" else 1.0
        if key == "T_0":
            ax.plot(block[key].values, z, color="black", lw=1.3)
            kit.threshold(ax, float(block.attrs["Tp"]), along="y")
        else:
            for name in names(block):
                values = factor * block[key].sel(alternative=name).values
                ax.plot(values, z, color=COLOUR[name], lw=THICK[name], label=named(name))
        if key == "F_top_max":
            ax.plot(kN * block["F_top_static"].values, z, color=GREY, lw=1.0, ls="--", label="at rest")
        if key == "sling_ratio":
            ax.axvline(0.0, color=GREY, lw=0.8)
        kit.axis(ax, DEPTH[key], size="small")
        if math.isfinite(at):
            ax.axhline(-at, color=COLOURS[1], lw=0.9, ls=":")
    kit.axis(axes[0, 0], y="depth of the payload's underside [m]", size="small")
    axes[0, 0].set_ylim(float(z.max()), float(z.min()))
    kit.legend_below(figure, axes[0], 7)
    same = [
        f"{DEPTH[key].partition(' [')[0]}: {fixed(float(np.nanmean(block[key].values)), 2)} at"
        " every depth, not drawn.".replace("\n", " ")
        for key in DEPTH
        if key not in drawn
    ]
    dotted = TEXTS["captions"]["resonance"] if math.isfinite(at) else ""
    return captioned(figure, "depth", dotted, *same)


def efficiency(block: xarray.Dataset) -> Figure:
    """Share of the tip's motion that compensation takes away, at the wire and at the payload."""
    title = f"Compensation efficiency at {-float(block.attrs['z']):.0f} m depth: {sea_words(block.attrs)}"
    every = (("eta_wire", "at the wire"), ("eta_load", "at the payload"))
    pairs = [pair for pair in every if kit.varies(*block[pair[0]].values)] or every[:1]
    figure, axes = page(1, len(pairs), 3.2, title, sharey=True)
    for ax, (name, where) in zip(axes[0], pairs, strict=True):
        lines(ax, block["period"].values, block[name], 100.0, marker="o", ms=3)
        ax.axhline(0.0, color=GREY, lw=0.8)
        kit.axis(ax, "peak period Tp [s]", title=where, size="small")
    low = min(float(np.nanmin(block[name].values)) for name, _ in pairs)
    axes[0, 0].set_ylim(max(-100.0, min(0.0, 105.0 * low)), 103.0)
    kit.axis(axes[0, 0], y="compensation efficiency [%]", size="small")
    kit.legend_below(figure, [axes[0, 0]])
    same = [f"The same in every period {where}, not drawn." for name, where in every if (name, where) not in pairs]
    return captioned(figure, "efficiency", *same)


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
    return captioned(figure, "landing")


def convergence(block: xarray.Dataset) -> Figure:
    """Limits of the middle column as runs are added, with their 95 % interval."""
    every = names(block, "cell")
    kept = [i for i in range(len(every)) if kit.varies(*(block[k].values[i] for k in ("Hs_limit", "low", "high")))]
    cells = [every[i] for i in kept] or every[:1]
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
    same = [
        f"{name}: {fixed(float(block['Hs_limit'].sel(cell=name).values[-1]), 2)} m by any number of runs, not drawn."
        for name in every
        if name not in cells
    ]
    return captioned(figure, "convergence", *same)


def waiting(block: xarray.Dataset) -> Figure:
    """Operability and waiting by month: lines are means, marks what 90 % of the starts stay below."""
    claim = claim_in(block)
    title = f"Operability and waiting for a window by month of readiness, {claim} limits"
    mark = "SYNTHETIC WEATHER. " if block.attrs["synthetic"] else ""
    month = np.arange(1.0, 13.0)
    months = block.sel(credit=claim, month=month)
    waits = bool(np.isfinite(months["wait_mean"].values).any())
    figure, axes = page(1 + waits, 1, 2.8 + 2.2 * waits, f"{mark}{title}", sharex=True)
    top, low = axes[0, 0], axes[-1, 0]
    lines(top, month, months["operability"].transpose("alternative", ...), 100.0, marker="o", ms=3)
    shares = (("wait_mean", {"marker": "o", "ms": 3}), ("wait_p90", {"ls": "none", "marker": "_", "ms": 7}))
    for key, style in shares if waits else ():
        lines(low, month, months[key].transpose("alternative", ...), 1.0 / DAY, **style)
        kit.axis(low, y="waiting [days]\nline: mean, dash: P90", zero="y", size="small")
    kit.axis(top, y="operability [%]", size="small")
    most = 100.0 * float(np.nanmax(np.nan_to_num(months["operability"].values)))
    top.set_ylim(0.0, min(100.0, max(5.0, 1.15 * most)))
    low.set_xticks(month, MONTHS)
    kit.legend_below(figure, [top])
    return captioned(figure, "waiting-by-month", "" if waits else TEXTS["captions"]["no-waiting"])
