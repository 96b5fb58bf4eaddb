"""The figures and tables of the thesis by number: what each shows, whether it can be drawn again, and by what.

A function gives a `Drawing`: panels of curves, or a figure of an analysis; the numbers behind it as tables; and ours
against what is printed. Validation pages take their runs and pictures from the same functions.
"""

from __future__ import annotations

import csv
import difflib
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import CommandError
from stillhook.report import kit
from stillhook.report.formatting import kind_of
from stillhook.report.plots.colours import COLOURS, colours_of
from stillhook.units import KINDS, quote
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DATA = Path(__file__).parent / "data"
"""Items, printed numbers and circuits."""
STATES = {
    "drawn": "drawn by `stillhook thesis NUMBER`",
    "numbers": "a table, calculated or from the library",
    "circuit": "a circuit, drawn by its winch type",
    "text": "a table of words or of test conditions",
    "picture": "a photograph or sketch: nothing to calculate",
    "no data": "needs data that the thesis does not give",
}
"""States of an item."""


class Item(NamedTuple):
    """A figure or table: its number (2.17 and T2.7 of the thesis, E19 and ET2 of paper E), what it shows, its state,
    the function that draws it with its arguments, the page that judges it, what the thesis does not give, and why ours
    differs from print, as far as the page varied it."""

    number: str
    caption: str
    state: str
    function: str
    page: str
    missing: str
    differs: str


class Axis(NamedTuple):
    """Words of an axis and the kind of its values, one of `stillhook.units.KINDS`; "" a pure number."""

    words: str
    kind: str = ""

    @property
    def column(self) -> str:
        """Heading of a column of the data, in SI."""
        return f"{self.words} [{KINDS[self.kind].si if self.kind else '-'}]"


class Curve(NamedTuple):
    """A line, in SI; style as matplotlib writes it."""

    label: str
    x: FloatArray
    y: FloatArray
    style: str = "-"


class Panel(NamedTuple):
    """Curves on one pair of axes."""

    x: Axis
    y: Axis
    curves: Sequence[Curve]
    title: str = ""


class Table(NamedTuple):
    """Cells under a head; numbers in SI, or texts as they are printed."""

    head: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def csv(self) -> str:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([self.head, *self.rows])
        return text.getvalue()


class Printed(NamedTuple):
    """A number of the thesis against ours, as texts."""

    quantity: str
    printed: str
    ours: str


@dataclass(frozen=True)
class Drawing:
    """What a function gives: title; panels, or `draw` where a figure of an analysis is drawn; tables by name; ours
    against what is printed; the settings that the thesis leaves open; the file of a circuit."""

    title: str
    panels: Sequence[Panel] = ()
    draw: Callable[[], Figure] | None = None
    tables: Mapping[str, Table] = field(default_factory=dict)
    printed: Sequence[Printed] = ()
    note: str = ""
    svg: str = ""

    def figure(self) -> Figure:
        """The picture. Errors: StillhookError without matplotlib."""
        if self.draw is not None:
            return self.draw()
        across = 1 if len(self.panels) < 4 else 2
        down = -(-len(self.panels) // across)
        figure, axes = kit.panels(
            down, across, (9.0, 1.0 + (4.5 if down == 1 else 3.2 * down)), self.title, sharey="row"
        )
        kit.hide(axes.flat[len(self.panels) :])
        for ax, panel in zip(axes.flat, self.panels, strict=False):
            _draw(ax, panel)
        return figure

    def draw_on(self, ax: Axes, title: str) -> None:
        """The one panel in a picture of several."""
        _draw(ax, self.panels[0]._replace(title=title))

    def data(self) -> dict[str, Table]:
        """Tables by name: of each panel a row a point, in SI, and those of the function."""
        many = len(self.panels) > 1
        of_panels = {f"data-{i + 1}" if many else "data": _points(panel) for i, panel in enumerate(self.panels)}
        return {**of_panels, **self.tables}

    @property
    def pictured(self) -> bool:
        return bool(self.panels) or self.draw is not None


def _draw(ax: Axes, panel: Panel) -> None:
    """Curves of one colour where their labels begin alike."""
    names = [curve.label.split(", ")[0] for curve in panel.curves]
    colours = colours_of(list(dict.fromkeys(names)))
    for name, curve in zip(names, panel.curves, strict=True):
        x, y = kit.display(curve.x, panel.x.kind), kit.display(curve.y, panel.y.kind)
        ax.plot(x, y, curve.style, color=colours.get(name, COLOURS[0]), lw=1.3, label=curve.label or None)
    kit.axis(ax, kit.with_unit(*panel.x), kit.with_unit(*panel.y), title=panel.title)
    kit.legend(ax)


def _points(panel: Panel) -> Table:
    return Table(
        ("curve", panel.x.column, panel.y.column),
        [(c.label, float(x), float(y)) for c in panel.curves for x, y in zip(c.x, c.y, strict=True)],
    )


@cache
def items() -> dict[str, Item]:
    """Every figure and table of the thesis by number, in the order of its pages."""
    with (DATA / "items.csv").open(encoding="utf-8", newline="") as file:
        return {row["number"]: Item(**row) for row in csv.DictReader(file)}


def item(number: str) -> Item:
    """The item of this number, with a capital or not. Errors: CommandError, one line."""
    of = {name.lower(): name for name in items()}
    if (wanted := number.strip().lower()) not in of:
        near = difflib.get_close_matches(wanted, of, 3, 0.5) or ["2.17", "e19", "et2"]
        raise CommandError(
            f"thesis {quote(number)}: no figure or table has this number. Choose one of stillhook thesis, such as"
            f" {', '.join(of[n] for n in near)}."
        )
    return items()[of[wanted]]


def drawing(number: str) -> Drawing:
    """The item of this number, computed. Errors: CommandError, one line, where there is nothing to compute."""
    one = item(number)
    if not one.function:
        why = one.missing or STATES[one.state]
        raise CommandError(f"thesis {one.number}: {why}. Choose an item that stillhook thesis lists as drawn.")
    name, *arguments = one.function.split()
    module, _, function = name.rpartition(".")
    result = getattr(import_module(f"stillhook.thesis.{module}"), function)(*arguments)
    assert isinstance(result, Drawing)
    return result


WORDS = {"e_c": "control error", "p_a": "A-side pressure", "p_b": "B-side pressure", "s_tip": "height of the crane tip"}
"""Shorter names of signals than their meanings."""
PAIRED = {"alpha_p": "pumps", "alpha_m": "motors", "p_a": "A side", "p_b": "B side"}
"""What tells two signals of one panel apart."""


def over_time(runs: Mapping[str, xarray.Dataset], signals: Sequence[str], start: float, end: float) -> Panel:
    """Signals of runs from start to end [s], by label: the first solid, the second dotted."""
    first, curves = signals[0], []
    for label, run in runs.items():
        cut = run.sel(time=slice(start, end))
        for signal, style in zip(signals, ("-", ":"), strict=False):
            name = f"{label}, {PAIRED[signal]}" if len(signals) > 1 else label
            curves.append(Curve(name, cut["time"].values, np.asarray(cut[signal].values), style))
    words = WORDS.get(first, BY_NAME[first].meaning.partition(";")[0])
    both = {"alpha_p": "displacement over its maximum", "p_a": "pressure"}.get(first, words)
    return Panel(Axis("time", "time"), Axis(both if len(signals) > 1 else words, kind_of(first)), curves)
