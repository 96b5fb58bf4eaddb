"""One way to draw: canvases, axes with units, lines with bands, bars with intervals, heat maps, legends, saving;
and what is left out where a library that draws, or one that sets a PDF, is not installed.

Pictures are made of these, so that sizes of letters, grids and legends are alike in all of them. Colours are those of
`stillhook.report.plots.colours`. Nothing here imports matplotlib before the first picture is wanted.
"""

from __future__ import annotations

import functools
import io
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.base.extras import how_to_get, installed, need
from stillhook.errors import StillhookError
from stillhook.report import document
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.units import KINDS, in_display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

T = TypeVar("T")
RESOLUTION = 120
"""Of pictures [dots per inch]."""
ON_LIGHT, ON_DARK = "#111111", "#fefefe"
"""Inks of letters on coloured cells; unlike black and white they stay as they are on a dark page."""
HEAVY = 400_000
"""Letters of an SVG from which on the picture is lighter: a page has that."""
WRAP = 110
"""Characters of a line of a title."""
STRIPS = "strips"
"""Marks a figure that the end of a page may part."""

_POWER = re.compile(r"\$\\mathdefault\{[-−0-9.]*(\\times)?(10\^\{[-−0-9.]+\})?\}\$")
"""A label of a logarithmic axis, as matplotlib writes it."""


@functools.cache
def _picture() -> type[Figure]:
    """A figure that a notebook shows without a backend, and whose texts are what they say: those of files may have
    dollar signs. Powers of ten along an axis alone are formulae."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted
    from matplotlib.text import Text

    class Picture(Figure):
        def draw(self, renderer: Any) -> None:
            for text in self.findobj(Text):
                if words := text.get_text():
                    text.set_parse_math(_POWER.fullmatch(words) is not None)
            super().draw(renderer)

        def _repr_png_(self) -> bytes:
            return png(self)

    return Picture


def canvas(width: float, height: float, title: str = "", *, wrap: int = WRAP) -> Figure:
    """An empty figure of this size [inch] whose parts do not overlap, with a title folded after so many characters."""
    need("matplotlib", "pictures", StillhookError)
    figure = _picture()(figsize=(width, height), layout="constrained")
    if title:
        lines = (textwrap.fill(line, wrap) for line in title.splitlines())
        figure.suptitle("\n".join(lines), fontsize="medium")
    return figure


def panels(
    rows: int, columns: int, size: tuple[float, float], title: str = "", *, grid: str = "both", **more: Any
) -> tuple[Figure, NDArray[Any]]:
    """A figure of a size [inch] with its axes (rows, columns); grid: "both", "x", "y" or "" for none; more: as
    `Figure.subplots` takes it (sharex, sharey, width_ratios)."""
    figure = canvas(*size, title)
    axes = figure.subplots(rows, columns, squeeze=False, **more)
    for ax in axes.flat if grid else ():
        ax.grid(axis=grid, alpha=0.3)
        ax.set_axisbelow(True)
    return figure, axes


def panel(size: tuple[float, float], title: str = "", *, grid: str = "both") -> tuple[Figure, Axes]:
    """A figure of a size [inch] with one pair of axes."""
    figure, axes = panels(1, 1, size, title, grid=grid)
    return figure, axes[0, 0]


def hide(axes: Iterable[Axes]) -> None:
    """Axes that are left over in a rectangle of panels."""
    for ax in axes:
        ax.set_visible(False)


def display(values: ArrayLike, kind: str) -> FloatArray:
    """SI values in the display unit of their kind, one of `stillhook.units.KINDS`; as they are without a kind."""
    numbers = np.asarray(values, dtype=np.float64)
    return numbers if not kind else in_display(1.0, kind) * numbers


def with_unit(words: str, kind: str) -> str:
    """A quantity with the display unit of its kind: "wire speed [m/min]"; "-" for a pure number."""
    return f"{words} [{KINDS[kind].display if kind else '-'}]"


def axis(ax: Axes, x: str = "", y: str = "", *, zero: str = "", title: str = "", size: str = "medium") -> None:
    """Words with units along both axes; zero: "x", "y" or "xy", the axes that begin at 0; title above the panel; size
    of all these letters."""
    if x:
        ax.set_xlabel(x, fontsize=size)
    if y:
        ax.set_ylabel(y, fontsize=size)
    if title:
        ax.set_title(title, fontsize=size)
    if "x" in zero:
        ax.set_xlim(left=0.0)
    if "y" in zero:
        ax.set_ylim(bottom=0.0)


def band(
    ax: Axes,
    x: ArrayLike,
    y: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    color: str = COLOURS[0],
    label: str = "",
    alpha: float = 0.15,
    where: ArrayLike | None = None,
    **line: Any,
) -> None:
    """A line with its interval as a band of the same colour; where: at which x there is a band."""
    where_drawn = None if where is None else np.asarray(where, dtype=bool).tolist()
    ax.fill_between(np.asarray(x), np.asarray(low), np.asarray(high), where=where_drawn, color=color, alpha=alpha, lw=0)
    ax.plot(np.asarray(x), np.asarray(y), color=color, label=label or None, **line)


def bars(
    ax: Axes,
    places: ArrayLike,
    values: ArrayLike,
    *,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
    width: float = 0.7,
    horizontal: bool = False,
    label: str = "",
    **style: Any,
) -> None:
    """Bars, and their intervals as thin lines where they have one (NaN: none); horizontal: places along the y axis."""
    at = np.asarray(places, dtype=float)
    draw = ax.barh if horizontal else ax.bar
    draw(at, np.nan_to_num(np.asarray(values, dtype=float)), width, label=label or None, **style)
    if low is not None and high is not None:
        lines = ax.hlines if horizontal else ax.vlines
        lines(at, np.asarray(low, dtype=float), np.asarray(high, dtype=float), color="black", lw=0.9)


def heat(
    ax: Axes,
    colours: NDArray[Any],
    rows: Sequence[str],
    columns: Sequence[str],
    texts: Sequence[Sequence[str]] = (),
    *,
    inks: NDArray[Any] | None = None,
    size: str = "small",
) -> None:
    """Cells (rows, columns) of these colours (rows, columns, 4), the first row on top, each with its text; inks: colour
    of each text, `ON_LIGHT` unless stated."""
    height, width = colours.shape[:2]
    ax.pcolormesh(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5, colours, edgecolors="white", linewidth=0.8)
    for i, line in enumerate(texts):
        for k, text in enumerate(line):
            ink = ON_LIGHT if inks is None else str(inks[i, k])
            ax.text(k, i, text, fontsize=size, color=ink, ha="center", va="center", in_layout=False)
    ax.set_xlim(-0.5, width - 0.5)
    ax.set_ylim(height - 0.5, -0.5)
    ax.set_xticks(range(width), list(columns), fontsize="small")
    ax.set_yticks(range(height), list(rows), fontsize="small")
    ax.tick_params(length=0)


def varies(*series: ArrayLike, least: float = 0.01) -> bool:
    """Whether any of some series varies by more than this part of the largest of all: what does not is a sentence, no
    panel."""
    known = [x[np.isfinite(x)] for x in (np.asarray(each, dtype=float) for each in series)]
    known = [x for x in known if x.size]
    largest = max((float(np.abs(x).max()) for x in known), default=0.0)
    return any(float(np.ptp(x)) > least * largest for x in known)


def threshold(ax: Axes, value: float, label: str = "", *, along: str = "x", note: str = "") -> None:
    """A dashed grey line at a limit, along the x or the y axis; label for the legend, note at its end."""
    (ax.axhline if along == "x" else ax.axvline)(value, color=GREY, ls="--", lw=1.0, label=label or None)
    if note:
        edge = ax.get_yaxis_transform()
        ax.text(1.0, value, f"{note} ", color=GREY, transform=edge, ha="right", va="top", fontsize="small")


def legend(ax: Axes, loc: str = "best", **more: Any) -> None:
    """A legend inside a panel, without a frame; none where nothing has a label."""
    if ax.get_legend_handles_labels()[1]:
        ax.legend(**{"loc": loc, "fontsize": "small", "frameon": False, **more})


def legend_above(ax: Axes, columns: int | None = None) -> None:
    """A legend in lines above a panel."""
    labels = ax.get_legend_handles_labels()[1]
    legend(ax, "lower center", bbox_to_anchor=(0.5, 1.0), ncols=columns or len(labels))


def legend_below(figure: Figure, axes: Iterable[Axes], columns: int = 6, *, place: str = "lower center") -> None:
    """One legend of some axes outside of the whole figure, each label once; place: "lower center", "right center"."""
    pairs = {label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    style: dict[str, Any] = {"loc": f"outside {place}", "ncols": columns, "fontsize": "small", "frameon": False}
    if pairs:
        figure.legend(list(pairs.values()), list(pairs), **style)


def can_draw() -> bool:
    """Whether pictures can be drawn."""
    return installed("matplotlib")


def can_set() -> bool:
    """Whether a PDF can be set."""
    return installed("typst")


def draw_if_possible(draw: Callable[[], Mapping[str, T]]) -> dict[str, T]:
    """Pictures or figures by name, as `draw` gives them; none where they cannot be drawn."""
    return dict(draw()) if can_draw() else {}


def left_out(*, pdf: bool = False) -> str:
    """A line on what a command leaves out, and how to get it; empty where it leaves out nothing. pdf: whether one
    belongs to what it writes."""
    parts = [] if can_draw() else ["Pictures"]
    parts += ["the PDF"] if pdf and not can_set() else []
    if not parts:
        return ""
    line = f"{' and '.join(parts)} {'are' if parts != ['the PDF'] else 'is'} left out. Install what makes them:"
    return f"{line[0].upper()}{line[1:]} {how_to_get('matplotlib')}."


def png(figure: Figure, resolution: int = RESOLUTION) -> bytes:
    """A figure as PNG at this resolution in dots per inch, for a file and for a page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # heavy

    memory = io.BytesIO()
    figure.set_dpi(resolution)
    FigureCanvasAgg(figure).print_png(memory)  # type: ignore[no-untyped-call]  # savefig draws twice, once for the layout
    return memory.getvalue()


def pngs(figures: Mapping[str, Figure], resolution: int = RESOLUTION) -> dict[str, bytes]:
    """Figures as PNG by name, in their order, at this resolution in dots per inch."""
    return {name: png(figure, resolution) for name, figure in figures.items()}


def caption(figure: Figure, text: str) -> Figure:
    """The figure with the sentence that is printed below it in a document: what is drawn, of what, in which units."""
    figure.set_label(text)
    return figure


def strips(figure: Figure) -> Figure:
    """The figure, of rows of panels that are read alone: the end of a page may come between two rows."""
    figure.set_gid(STRIPS)
    return figure


def _cuts(figure: Figure) -> tuple[float, ...]:
    """Middles between the rows of panels of a figure that was drawn, as shares of its height from the top."""
    rows: dict[int, list[Any]] = {}
    for ax in figure.axes:
        of, box = ax.get_subplotspec(), ax.get_tightbbox()
        if of is not None and box is not None:
            rows.setdefault(of.rowspan.start, []).append(box)
    ordered = [rows[i] for i in sorted(rows)]
    middles = [0.5 * (min(b.y0 for b in upper) + max(b.y1 for b in lower)) for upper, lower in pairwise(ordered)]
    return tuple(round(1.0 - float(middle) / figure.bbox.height, 4) for middle in middles)


def svg(figure: Figure) -> str:
    """A figure as SVG whose bytes depend on its content alone; letters stay text."""
    import matplotlib  # heavy
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    memory = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "stillhook", "svg.fonttype": "none"}):
        canvas = FigureCanvasSVG(figure)
        canvas.print_svg(memory, metadata={"Date": None, "Creator": None})  # type: ignore[no-untyped-call]
    return memory.getvalue().decode()


def printed(figures: Mapping[str, Figure], resolution: int = RESOLUTION) -> dict[str, document.Figure]:
    """Figures with their captions as parts of a document, by name: the same with any settings of matplotlib
    here."""
    lines = {name: svg(each) for name, each in figures.items()}
    return {
        name: document.Figure(
            png(each, resolution),
            str(each.get_label()),
            svg=lines[name] * (len(lines[name]) <= HEAVY),
            cuts=_cuts(each) if each.get_gid() == STRIPS else (),
        )
        for name, each in figures.items()
    }


def save(figure: Figure, path: str | Path) -> Path:
    """Write a picture as PNG; the file appears only when it is complete."""
    target = Path(path)
    with atomic_file(target) as part:
        part.write_bytes(png(figure))
    return target
