"""A document as PDF, or as pictures of its pages: set by typst with its own fonts and the document's date, with
nothing of this machine.

Typst runs in a process of its own (`stillhook.formats.binary`): it ends the one that it runs in where memory runs out.
"""

from __future__ import annotations

import dataclasses
import datetime
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from statistics import fmean
from typing import Any

from stillhook.base.extras import installed
from stillhook.base.kept.leftovers import temporary_folder
from stillhook.errors import StillhookError, UnreadableError
from stillhook.formats.binary import in_own_process
from stillhook.report.document import (
    Bullets,
    Cell,
    Columns,
    Document,
    Figure,
    Grey,
    Part,
    Section,
    Table,
    Text,
    Verdict,
    words,
)
from stillhook.report.formatting import typeset

DATA, TEMPLATE = "document.json", "document.typ"
ARCHIVE = "a-2u"
"""PDF/A-2u: everything that is needed to show it is inside, for as long as a crane lives, and its text can be
searched."""


LONGEST = 600.0
"""Time within which a document is set, on a machine that does much else [s]; the longest take some seconds."""
SHORT = 30
"""Letters of cells that are better not folded."""
MOST_ROWS, MOST_LETTERS = 9, 1500
"""Of a table that is not parted by the end of a page."""


class Unset(StillhookError):
    """A document that typst cannot set."""


class Lost(Unset):
    """A document whose setting ended before it was done, as for lack of memory."""


def pdf(document: Document) -> bytes:
    """The document as PDF/A where that is possible.

    Texts with letters that typst's own fonts lack (Chinese, say) cannot be archived: they are set all the same, with
    boxes for those letters. Errors: Unset, a line without the name of the document, where it cannot be set.
    """
    try:
        return _typeset(document, format="pdf", pdf_standards=[ARCHIVE])[0]
    except Lost:
        raise
    except Unset:
        return _typeset(document, format="pdf")[0]


def pages(document: Document, ppi: float = 100.0) -> list[bytes]:
    """The pages of the document as PNG, to look at."""
    return _typeset(document, format="png", ppi=ppi)


def _typeset(document: Document, **options: Any) -> list[bytes]:
    if not installed("typst"):
        raise ModuleNotFoundError("typst is not installed", name="typst")
    date = datetime.datetime.combine(datetime.date.fromisoformat(document.date), datetime.time(), datetime.UTC)
    with temporary_folder("report") as name:
        folder = Path(name)
        (folder / TEMPLATE).write_bytes((files("stillhook.report") / TEMPLATE).read_bytes())
        data = typeset(json.dumps(_data(document, folder), ensure_ascii=False))
        (folder / DATA).write_text(data, encoding="utf-8")
        try:
            return in_own_process(LONGEST, _set, folder, date, options)
        except UnreadableError as problem:
            raise Lost(f"the document cannot be set ({problem}).") from None


def _set(folder: Path, date: datetime.datetime, options: Mapping[str, Any]) -> list[bytes]:
    """In the process of its own: the file, or the pictures, of the template in a folder."""
    import typst  # 80 MB: only where a document is wanted

    compiler = typst.Compiler(folder / TEMPLATE, root=folder, ignore_system_fonts=True)
    try:
        result = compiler.compile(timestamp=date, **options)
    except typst.TypstError as problem:
        reason = " ".join(str(problem.message).split())[:200]
        raise Unset(f"the document cannot be set ({reason}).") from None
    assert result is not None
    return result if isinstance(result, list) else [result]


def _data(document: Document, folder: Path) -> dict[str, Any]:
    """What the template reads; figures are written into the folder."""
    date = datetime.date.fromisoformat(document.date)
    fields = {field.name: getattr(document, field.name) for field in dataclasses.fields(document)}
    day = {"year": date.year, "month": date.month, "day": date.day}
    parts = {"front": _parts(document.front, folder), "sections": _parts(document.sections, folder)}
    return {**fields, **day, **parts, "heading": document.heading}


def _parts(parts: Sequence[Part], folder: Path) -> list[dict[str, Any]]:
    return [_part(part, folder) for part in parts]


def _part(part: Part, folder: Path) -> dict[str, Any]:
    match part:
        case Text(text):
            return {"kind": "text", "text": text}
        case Bullets(lines):
            return {"kind": "bullets", "lines": list(lines)}
        case Verdict(word, passed, paragraphs):
            return {"kind": "verdict", "word": word, "passed": passed, "text": list(paragraphs)}
        case Table():
            return _table(part)
        case Figure(png, caption, height, cuts=cuts):
            file = f"figure-{sum(1 for _ in folder.glob('figure-*'))}.png"
            (folder / file).write_bytes(png)
            return {"kind": "figure", "file": file, "caption": caption, "height": height, "cuts": list(cuts)}
        case Columns(inner, widths):
            return {"kind": "columns", "parts": _parts(inner, folder), "widths": list(widths)}
        case Section(title, inner):
            return {"kind": "section", "title": title, "parts": _parts(inner, folder)}


def _table(table: Table) -> dict[str, Any]:
    kinds = [kind.value for kind in table.kinds]
    lengths = [[len(words(row[i])) for row in table.rows if words(row[i])] for i in range(len(kinds))]
    letters = sum(map(sum, lengths))
    return {
        "kind": "table",
        "title": table.title,
        "header": table.heads(),
        "kinds": kinds,
        "widths": [_width(column or [1]) ** 0.5 for column in lengths],  # of folded columns, relative to each other
        "one_page": len(table.rows) <= MOST_ROWS and letters <= MOST_LETTERS,
        "rows": [[_cell(cell) for cell in row] for row in table.rows],
        "bold_rows": list(table.bold_rows),
        "bold_columns": list(table.bold_columns),
    }


def _width(lengths: Sequence[int]) -> float:
    """Letters that set the width of a folded column: of the longest cell where all are short, else of a usual one."""
    return max(lengths) if max(lengths) <= SHORT else fmean(lengths)


def _cell(cell: Cell) -> dict[str, Any]:
    if isinstance(cell, Verdict):
        return {"text": cell.word, "notes": [], "verdict": True, "passed": cell.passed}
    first, *notes = cell.split("\n")
    return {"text": first, "notes": notes, "verdict": False, "passed": None, "grey": isinstance(cell, Grey)}
