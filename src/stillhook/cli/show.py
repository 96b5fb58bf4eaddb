"""How commands print: JSON in SI for machines, tables in human units for people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from stillhook.units import in_display, number
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    from stillhook.crane import Crane
    from stillhook.engine.run import Progress


LANES = 16
"""Trajectories side by side where statistics alone are wanted (`stillhook.engine.lanes.VL`, without its imports)."""
PLAIN_WIDTH = 160
"""Width of tables that go to a file or a pipe."""


def print_json(data: Any) -> None:
    from stillhook.io.results import to_json

    print(to_json(data))


def human(name: str, value: Any, digits: int = 6) -> str:
    """A value of a variable in display unit, as text without its unit."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return str(value)
    kind = BY_NAME[name].kind if name in BY_NAME else ""
    return number(in_display(float(value), kind) if kind else float(value), digits)


def unit_of(name: str) -> str:
    from stillhook.units import KINDS

    v = BY_NAME.get(name)
    return KINDS[v.kind].display if v is not None and v.kind else ""


def print_values(values: dict[str, Any]) -> None:
    """Name, value, unit and meaning, one line each."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    for name, value in values.items():
        meaning = BY_NAME[name].meaning if name in BY_NAME else ""
        table.add_row(name, human(name, value), unit_of(name), escape(meaning))
    Console().print(table)


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]], *, title: str = "", left: int = 1) -> None:
    """A table; the first `left` columns are text, the others numbers."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title) or None, title_justify="left", title_style="bold", header_style="bold")
    for i, name in enumerate(header):
        free = name == "status"
        text = i < left  # texts fold on a narrow terminal, so that numbers stay whole
        folds = free or (text and left > 1)
        table.add_column(escape(name), justify="left" if text or free else "right", no_wrap=not folds, overflow="fold")
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    console = Console()
    (console if console.is_terminal else Console(width=max(console.width, PLAIN_WIDTH))).print(table)


def say(text: str) -> None:
    """A line for the person, not for the machine that reads standard output."""
    import sys

    print(text, file=sys.stderr)


def say_if_compiling(crane: Crane, lanes: int = LANES) -> None:
    """A word on why the first run of a winch type takes longer."""
    from stillhook.engine.build import is_compiled

    if not is_compiled(crane.plant.value, lanes):
        say("compiling the winch model for this machine (once, about 10 s) ...")


def started(crane: Crane, bar: Progress | None, *, lanes: int = LANES, report: str = "") -> Progress:
    """Progress of a run that says what there is to say once everything that was given has been found good.

    lanes: trajectories side by side, 1 with series or 16 without; report: a line on the motion.
    """

    def told(share: float) -> None:
        if share == 0.0:
            if report:
                say(report)
            say_if_compiling(crane, lanes)
        if bar is not None:
            bar(share)

    return told


@contextmanager
def progress_bar(title: str) -> Iterator[Progress | None]:
    """A bar on a terminal, nothing elsewhere."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda share: bar.update(task, completed=share)
