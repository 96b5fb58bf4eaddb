"""How commands print: an answer of a dozen lines, JSON in SI for machines, documents and tables in human units for
people."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from stillhook.base.progress import RUNS, Monitor, Relay
from stillhook.report.document import (
    Bullets,
    Column,
    Columns,
    Document,
    Figure,
    Part,
    Section,
    Table,
    Text,
    Verdict,
    words,
)
from stillhook.report.formatting import counted, display_number, display_unit, plain, wrapped

if TYPE_CHECKING:
    from rich.table import Table as Grid

    from stillhook.base.progress import Event, Progress
    from stillhook.kernels.build import Setup
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Scenario


PLAIN_WIDTH = 160
"""Width of tables that go to a file or a pipe."""
FREE = ("status", "meaning")
"""Columns of text among the numbers."""
FOLDED, BORDER = 10, 3
"""Narrowest column of text that is folded; the width that a column needs in addition to its content: a border and a
space on either side."""


BAR = 40
"""Width of a bar with its share and its time."""
OUTCOME = 10
"""Width of a verdict at the start of a line."""
MOST_LINES, MOST_COLUMNS = 12, 100
"""Size of an answer, with the lines that say which files were written."""
FILE_LINES, TITLE_LINES, MOST_ROWS = 2, 2, 6
"""Lines of an answer that are kept for written files; of its title at most; rows of a table in it."""


Line = str | Callable[[], None]
"""A line of an answer; a function prints what --verbose has in addition."""


class Cells(str):
    """A row of a small table, in whose place --verbose prints a full one."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """What a command answers unless --json requests numbers: a dozen lines, or with --verbose all of it."""

    title: str  # the subject, in a line
    lines: Sequence[Line] = ()  # verdict, numbers with units, what governs; the most important first
    step: str = ""  # what to do next
    more: str = ""  # what --verbose prints besides
    notes: Sequence[str] = ()  # after the lines
    shown: int = 1  # how many of them without --verbose

    def text(self, *, files: bool = True) -> list[str]:
        """Lines to print; what has no place among them is counted in the last one. files: leave room for those that
        name the files."""
        title = _cut(folded(self.title), TITLE_LINES)
        step = _cut(folded(f"Next: {self.step}"), TITLE_LINES) if self.step else []
        texts = [each for each in (*self.lines, *self.notes[: self.shown]) if isinstance(each, str)]
        lines = [line for each in texts for line in folded(each)]
        room = MOST_LINES - FILE_LINES * files - 1 - len(title) - len(step)
        hidden = len(lines) - room if len(lines) > room else 0
        notes = counted(len(self.notes), "note") if len(self.notes) > self.shown else ""
        more = [", ".join(filter(None, (self.more, notes))), counted(hidden, "more line") if hidden else ""]
        end = f"More with --verbose: {'; '.join(filter(None, more))}." if any(more) else ""
        return [*title, *lines[:room], *step, *(_cut(folded(end), 1) if end else [])]


def answer_of(document: Document, step: str = "", more: str = "", lines: Sequence[str] = ()) -> Answer:
    """The answer of a document: its marks, the verdict, facts and first sentences of its front; lines go after them."""
    front: list[str] = list(document.marks)
    for part in document.front:
        match part:
            case Verdict(word, _, paragraphs):
                front += [word, *paragraphs]
            case Text(text):
                front.append(text)
            case Table(header, rows) if not header:
                front += [": ".join(filter(None, (words(name), "  ".join(map(words, of))))) for name, *of in rows]
            case _:
                pass
    return Answer(document.heading, [*map(first_sentence, front), *lines], step, more)


def sentences(text: str) -> list[str]:
    """The sentences of a text."""
    import re

    return re.split(r"(?<=[a-z0-9)%°][.!]) (?=[A-Z])", text)


def first_sentence(text: str, most: int = 1) -> str:
    """The first sentences of a text."""
    return " ".join(sentences(text)[:most])


def print_answer(answer: Answer, *, files: bool = True) -> None:
    print("\n".join(answer.text(files=files)))


def print_in_full(answer: Answer) -> None:
    """All of an answer, nothing cut."""
    wrapped(answer.title, "  ")
    for each in (*answer.lines, *answer.notes, f"Next: {answer.step}" if answer.step else ""):
        if not isinstance(each, str):
            each()
        elif each and not isinstance(each, Cells):
            wrapped(each, "  ")


def folded(text: str) -> list[str]:
    """Running text in lines of an answer, those after the first indented: no text is taken for another line."""
    import shutil
    import sys
    import textwrap

    width = min(MOST_COLUMNS, shutil.get_terminal_size().columns) if sys.stdout.isatty() else MOST_COLUMNS
    fold = textwrap.TextWrapper(width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    first, *others = map(plain, text.split("\n"))
    return [*fold.wrap(first), *(line for other in others for line in fold.wrap(f"  {other.strip()}"))]


def _cut(lines: list[str], most: int) -> list[str]:
    """Lines, the last one marked where some are left out."""
    return lines if len(lines) <= most else [*lines[: most - 1], f"{lines[most - 1][: MOST_COLUMNS - 4].rstrip()} ..."]


def columns(
    header: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[int] = (0,), most: int = MOST_ROWS
) -> list[Cells]:
    """A small table without rules as lines of an answer: of many rows the first. left: columns of text."""
    shown = [list(row) for row in rows[: most if len(rows) <= most else most - 1]]
    table = [list(header), *shown] if any(header) else shown
    if not table:
        return []
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    while sum(widths) + 2 * len(widths) > MOST_COLUMNS and (widest := max(left, key=widths.__getitem__)) is not None:
        if widths[widest] <= FOLDED:
            break
        widths[widest] -= 1
    cells = [[_fitted(cell, width) for cell, width in zip(row, widths, strict=True)] for row in table]
    lines = [
        "  ".join(c.ljust(w) if i in left else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True)))
        for row in cells
    ]
    hidden = len(rows) - len(shown)
    return [Cells(line.rstrip()) for line in lines] + ([Cells(f"... and {hidden} more")] if hidden else [])


def _fitted(cell: str, width: int) -> str:
    return cell if len(cell) <= width else f"{cell[: width - 3].rstrip()}..."


def print_written(folder: str, names: Sequence[str]) -> None:
    """Files that were written, on two lines at most: what has no place there is counted."""
    for shown in range(len(names), 0, -1):
        hidden = f" and {len(names) - shown} more" if shown < len(names) else ""
        lines = folded(f"written to {folder}: {', '.join(names[:shown])}{hidden}")
        if len(lines) <= FILE_LINES:
            break
    print("\n".join(lines))


def print_json(data: Any) -> None:
    from stillhook.formats.results import to_json

    print(to_json(data))


def print_values(values: dict[str, Any]) -> None:
    """Name, value, unit and meaning, one line each."""
    from rich.console import Console
    from rich.table import Table as Grid

    from stillhook.variables import BY_NAME

    table = Grid(box=None, show_header=False, pad_edge=False)
    for name, value in values.items():
        meaning = BY_NAME[name].meaning if name in BY_NAME else ""
        table.add_row(*(_escaped(text) for text in (name, display_number(name, value), display_unit(name), meaning)))
    Console().print(table)


def print_document(document: Document) -> None:
    """A document without its pictures."""
    wrapped(document.heading)
    for text in (document.subtitle, *document.marks):
        if text:
            wrapped(text)
    for part in (*document.front, *document.sections):
        print_part(part)


def print_part(part: Part) -> None:
    """One part of a document."""
    match part:
        case Text(text):
            wrapped(text)
        case Bullets(lines):
            for line in lines:
                wrapped(f"- {line}", "  ")
        case Verdict(word, _, paragraphs):
            for text in (word, *paragraphs):
                wrapped(text)
        case Table():
            _print_cells(part)
        case Section(title, parts):
            print()
            wrapped(title)
            for inner in parts:
                print_part(inner)
        case Columns(parts):
            for inner in parts:
                print_part(inner)
        case Figure():
            pass  # for pages only


def _print_cells(table: Table) -> None:
    """A table; facts as lines, a name and its values each."""
    rows = [[words(cell) for cell in row] for row in table.rows]
    if table.header:
        kinds = [Column.TEXT if kind is Column.WORD and i else kind for i, kind in enumerate(table.kinds)]
        _print_columns(table.header, rows, kinds, 1, table.title, table.bold_rows)
        return
    if table.title:
        wrapped(f"{table.title}:")
    for row, (name, *values) in zip(table.rows, rows, strict=True):
        text = "  ".join(values)
        if isinstance(row[0], Verdict):
            wrapped(f"{name:<{OUTCOME - 1}} {text}", " " * OUTCOME)
        else:
            wrapped(f"{name}: {text}" if name else text, "  ")


def print_table(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, title: str = "", left: int = 1, texts: Collection[int] = ()
) -> None:
    """A table; the first `left` columns are text, the others numbers, but for those whose place (from 0) is in `texts`:
    text that folds.

    Numbers are never cut: on a terminal too narrow for all of them the table continues below, the texts at its left
    repeated.
    """
    texts_at = [name in FREE or i in texts or (i < left and left > 1) for i, name in enumerate(header)]
    kinds = [Column.TEXT if text else Column.WORD if i < left else Column.NUMBER for i, text in enumerate(texts_at)]
    _print_columns(header, rows, kinds, left, title)


def _print_columns(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    kinds: Sequence[Column],
    left: int,
    title: str,
    bold_rows: Collection[int] = (),
) -> None:
    """A table whose first `left` columns are repeated where it continues below. Texts fold, numbers do not."""
    from rich.console import Console

    console = Console()
    least = [_least_width([name, *(row[i] for row in rows)], _folds(kinds[i])) for i, name in enumerate(header)]
    if not console.is_terminal:
        console = Console(width=max(console.width, PLAIN_WIDTH, sum(least) + 1))
    for columns in _side_by_side(least, left, console.width):
        cells = [[row[i] for i in columns] for row in rows]
        table = _grid([header[i] for i in columns], cells, [kinds[i] for i in columns], bold_rows)
        table.title, title = title and _escaped(title), ""
        width = max(console.width, sum(least[i] for i in columns) + 1)  # what no terminal holds runs over its edge
        console.print(table, width=width, soft_wrap=width > console.width)


def _folds(kind: Column) -> bool:
    return kind in (Column.TEXT, Column.CODE)


def _side_by_side(least: Sequence[int], left: int, width: int) -> Iterator[list[int]]:
    """Columns of tables that fit the width, each with the first `left` columns."""
    indices = list(range(min(left, len(least))))
    columns = list(indices)
    for i in range(len(indices), len(least)):
        if len(columns) > len(indices) and sum(least[k] for k in columns) + least[i] + 1 > width:
            yield columns
            columns = list(indices)
        columns.append(i)
    yield columns


def _least_width(cells: Sequence[str], folds: bool) -> int:
    """Least width of a column, with its border and padding."""
    from rich.cells import cell_len

    widest = max(cell_len(line) for cell in cells for line in cell.split("\n"))
    return BORDER + (min(widest, FOLDED) if folds else widest)


def _grid(
    header: Sequence[str], rows: Sequence[Sequence[str]], kinds: Sequence[Column], bold_rows: Collection[int]
) -> Grid:
    from rich.table import Table as Grid

    table = Grid(title_justify="left", title_style="bold", header_style="bold")
    for name, kind in zip(header, kinds, strict=True):
        justify: Literal["left", "right"] = "right" if kind is Column.NUMBER else "left"
        table.add_column(_escaped(name), justify=justify, no_wrap=not _folds(kind), overflow="fold")
    for i, row in enumerate(rows):
        table.add_row(*(_escaped(cell) for cell in row), style="bold" if i in bold_rows else "")
    return table


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape("\n".join(map(plain, text.split("\n"))))


def twin_lines(crane: Crane, *cases: Scenario) -> list[Line]:
    """How far the twin is validated, with --verbose its range, and where these cases leave that; each line once."""
    from stillhook.engine.certificate import doubts, envelope_line, twin_line

    notes = [] if crane.certified is None else [note for case in cases for note in doubts(crane, case)]
    within = envelope_line(crane)
    return [twin_line(crane), *([partial(wrapped, within)] if within else []), *dict.fromkeys(notes)]


def say(text: str) -> None:
    """A line on standard error for the user."""
    import sys

    print(plain(text), file=sys.stderr)


def say_if_compiling(crane: Crane, *, series: bool = False, setup: Setup | None = None) -> None:
    """Message that the first run of a winch type takes longer; with series one trajectory runs at a time; setup of its
    kernel, default the load on its wire."""
    from stillhook.engine.pack.winch import kernel_of
    from stillhook.kernels.build import LOAD_ON_WIRE, is_compiled
    from stillhook.kernels.control_laws import controllers_of_winch
    from stillhook.kernels.lanes import VL

    winch = crane.plant.type
    lanes, of, kernel = 1 if series else VL, LOAD_ON_WIRE if setup is None else setup, kernel_of(crane)
    if not is_compiled(
        winch.name, lanes, of._replace(losses=kernel.losses, ports=kernel.ports), controllers_of_winch(winch)
    ):
        say("compiling the winch model for this machine (once, about 10 s) ...")


def started(
    crane: Crane, bar: Progress | None, *, series: bool = False, report: str = "", setup: Setup | None = None
) -> Progress:
    """Progress of a run that prints remarks once all inputs have been checked.

    series: whether series are kept; report: a line on the motion; setup of the kernel: that of a crane, or of a
    lowering.
    """

    def report_progress(share: float) -> None:
        if share == 0.0:
            if report:
                say(report)
            say_if_compiling(crane, series=series, setup=setup)
        if bar is not None:
            bar(share)

    return Relay(report_progress, bar)


@contextmanager
def progress_bar(title: str) -> Iterator[Progress | None]:
    """A bar on a terminal, nothing elsewhere: the same events that a program gets."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn
    from rich.progress import Progress as Bar

    time_left = TextColumn("{task.fields[left]}", style="progress.remaining")
    with Bar(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), time_left, console=console, transient=True
    ) as bar:

        def show(event: Event) -> None:
            count = f"{event.done:,} of {event.total:,}" if event.total > 1 else ""
            stage = "" if event.stage == RUNS or title.startswith(event.stage) else event.stage
            words = ", ".join(text for text in (title, stage, count) if text)
            if stage and len(words) > console.width - BAR:
                words = words.removeprefix(f"{title}, ")
            bar.update(task, completed=event.share, description=_escaped(words))

        monitor = Monitor(show)
        task = bar.add_task(_escaped(title), total=1.0, left=monitor.left)
        yield monitor
