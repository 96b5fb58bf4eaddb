"""`stillhook thesis [NUMBER] [OUT]`: figures and tables of the thesis, listed and drawn again."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Json, check_out, present
from stillhook.report.terminal import MOST_LINES, Answer, columns, print_table

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
    from stillhook.thesis.gallery import Drawing, drawing, item

    if number is None:
        _list(json)
        return
    one = item(number)
    if one.function:
        check_out(out, (f"{one.number}.png", f"{one.number}.svg", "data.csv", "summary.json"))
    elif one.state != "no data" and not json:
        _nothing(one)
        return
    _show(one, drawing(number) if one.function else Drawing(""), out, json=json)


def _nothing(one: Item) -> None:
    from stillhook.thesis.gallery import STATES

    print(f"{one.number}: {one.caption}. Nothing to draw: {STATES[one.state].partition(':')[0]}.")


def _list(json: bool) -> None:
    from stillhook.thesis.gallery import STATES, items

    answer = [one._asdict() for one in items().values()]
    cells = [[one.number, one.state, one.caption, one.missing] for one in items().values()]
    counts = Counter(one.state for one in items().values())

    def brief() -> Answer:
        lines = columns(("state", "items", ""), [[s, str(counts[s]), text] for s, text in STATES.items()], left=(0, 2))
        title = f"Moslatt 2020: {len(answer)} figures and tables"
        return Answer(title, lines, "stillhook thesis E19", "every item")

    head = ["number", "state", "what it shows", "not given by the thesis"]
    present(answer, lambda: print_table(head, cells, left=4), brief=brief, json=json)


def _show(one: Item, drawn: Drawing, out: Path | None, *, json: bool) -> None:
    tables = drawn.data()
    answer: dict[str, Any] = {**one._asdict(), "title": drawn.title, "printed": [p._asdict() for p in drawn.printed]}
    answer |= {"note": drawn.note, "data": {name: table._asdict() for name, table in tables.items()}}
    head, cells = ("", "printed", "ours"), [list(p) for p in drawn.printed]
    tails = [f"Not given by the thesis: {one.missing}."] * bool(one.missing) + [drawn.note] * bool(drawn.note)
    listed = [] if drawn.pictured else [(t.head, [list(map(str, row)) for row in t.rows]) for t in tables.values()]

    def brief() -> Answer:
        lines = [drawn.title] * bool(one.function)
        if cells:
            lines += columns(head, cells, left=(0, 1, 2))
        for heads, rows in [] if cells else listed:
            lines += columns(heads, rows, left=range(len(heads)), most=MOST_LINES - 4)
        step = f"stillhook thesis {one.number} OUT" if one.function and out is None else ""
        return Answer(f"{one.number}: {one.caption}", [*lines, *tails], step)

    def in_full() -> None:
        print(f"{one.number}: {one.caption}")
        for heads, rows in listed:
            print_table(list(heads), rows, left=len(heads))
        if cells:
            print_table(list(head), cells, left=3)
        print(*tails, sep="\n")

    files: dict[str, Any] | None = None
    if one.function:
        files = {f"{name}.csv": table.csv() for name, table in tables.items()}
        files |= {f"{one.number}.svg": drawn.svg} if drawn.svg else {}
        files["summary.json"] = {k: v for k, v in answer.items() if k != "data"}
    pictures = (lambda: {f"{one.number}.png": drawn.figure()}) if drawn.pictured else None
    present(answer, in_full, out, files, brief=brief, json=json, pictures=pictures)
