"""`stillhook thesis [NUMBER] [OUT]`: figures and tables of the thesis, listed and drawn again."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Json, check_out, present
from stillhook.report.terminal import MOST_LINES, Answer, Line, columns, print_table

if TYPE_CHECKING:
    from stillhook.thesis.gallery import Drawing, Item


def thesis(
    number: Annotated[
        str | None, typer.Argument(metavar="[NUMBER]", help="2.17 of the thesis, E19 of paper E, T2.7 or ET2: a table.")
    ] = None,
    out: Annotated[
        Path | None, typer.Argument(metavar="[OUT]", help="Folder for the picture, its data as CSV and summary.json.")
    ] = None,
    json: Json = False,
) -> None:
    """Figures and tables of Moslatt's thesis (2020): all with their state, or one of them drawn again.

    Ours against what is printed where the text gives numbers; what the thesis does not give is stated. Validation pages
    judge the same runs.

    Example: stillhook thesis

    Example: stillhook thesis E19 e19
    """
    from stillhook.thesis.gallery import STATES, drawing, item

    if number is None:
        _list(json)
        return
    one = item(number)
    if one.function:
        check_out(out, (f"{one.number}.png", f"{one.number}.svg", "data.csv", "summary.json"))
    elif one.state != "no data" and not json:
        print(f"{one.number}: {one.caption}. Nothing to draw: {STATES[one.state].partition(':')[0]}.")
        return
    _show(one, drawing(number) if one.function else None, out, json=json)


def _list(json: bool) -> None:
    from stillhook.thesis.gallery import STATES, items

    answer = [one._asdict() for one in items().values()]
    cells = [[one.number, one.state, one.caption, one.missing] for one in items().values()]
    counts = Counter(one.state for one in items().values())

    of_states = [[state, str(counts[state]), text] for state, text in STATES.items()]
    head = ["number", "state", "what it shows", "not given by the thesis"]
    lines: list[Line] = [
        *columns(("state", "items", ""), of_states, left=(0, 2)),
        partial(print_table, head, cells, left=4),
    ]
    title = f"Moslatt 2020: {len(answer)} figures and tables"
    present(answer, brief=lambda: Answer(title, lines, "stillhook thesis E19", "every item"), json=json)


def _show(one: Item, drawn: Drawing | None, out: Path | None, *, json: bool) -> None:
    answer: dict[str, Any] = {**one._asdict(), "title": "", "printed": [], "note": "", "data": {}}
    if drawn is not None:
        tables = drawn.data()
        data = {name: {"head": list(t.head), "rows": [list(r) for r in t.rows]} for name, t in tables.items()}
        rows = [p._asdict() for p in drawn.printed]
        answer |= {"title": drawn.title, "printed": rows, "note": drawn.note, "data": data}
    head, cells = ("", "printed", "ours"), [list(p) for p in drawn.printed] if drawn else []
    tails = [f"Not given by the thesis: {one.missing}."] if one.missing else []
    tails += [drawn.note] if drawn and drawn.note else []
    tails += [f"Differs from print: {one.differs}."] if one.differs else []
    tails += [f"Judged in docs/validation/{one.page}."] if one.page.endswith(".md") and "/" not in one.page else []

    lines: list[Line] = [drawn.title] if drawn else []
    for table in drawn.data().values() if drawn and not drawn.pictured else ():
        of_table, n = [list(map(str, row)) for row in table.rows], len(table.head)
        if of_table != cells:
            lines += [] if cells else columns(table.head, of_table, left=range(n), most=MOST_LINES - 4)
            lines.append(partial(print_table, table.head, of_table, left=n))
    if cells:
        lines += [*columns(head, cells, left=(0, 1, 2)), partial(print_table, head, cells, left=3)]
    step = f"stillhook thesis {one.number} OUT" if drawn and out is None else ""
    answer_of = Answer(f"{one.number}: {one.caption}", [*lines, *tails], step)
    files: dict[str, Any] | None = None
    if drawn is not None:
        files = {f"{name}.csv": table.csv() for name, table in drawn.data().items()}
        files |= {f"{one.number}.svg": drawn.svg} if drawn.svg else {}
        files["summary.json"] = {k: v for k, v in answer.items() if k != "data"}
    pictures = (lambda: {f"{one.number}.png": drawn.figure()}) if drawn and drawn.pictured else None
    present(answer, out, files, brief=lambda: answer_of, json=json, pictures=pictures)
