"""Documents set by typst: data and pictures in, PDF or pages out, with fonts of its own, a date that is given, nothing
of this machine."""

from __future__ import annotations

import datetime
import json
import tempfile
from collections.abc import Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from stillhook.errors import StillhookError

DATA, LOOK = "sheet.json", "look.typ"
ARCHIVE = "a-2u"
"""PDF/A-2u: everything that is needed to show it is inside, for as long as a crane lives, and its text can be
searched."""


class Unset(StillhookError):
    """A document that typst cannot set."""


def set_pdf(template: Traversable, data: Any, figures: Mapping[str, bytes], date: str) -> bytes:
    """The document as PDF/A where that is possible.

    Parameters: template reads its texts from "sheet.json" and its look from "look.typ" next to it; figures: PNG by
    stem; date ISO 8601. Texts with letters that typst's own fonts lack (Chinese, say) cannot be archived: they are set
    all the same, with boxes for those letters. Errors: Unset, a line without the name of the document, where it cannot
    be set.
    """
    try:
        return _typeset(template, data, figures, date, format="pdf", pdf_standards=[ARCHIVE])[0]
    except Unset:
        return _typeset(template, data, figures, date, format="pdf")[0]


def set_pages(
    template: Traversable, data: Any, figures: Mapping[str, bytes], date: str, ppi: float = 100.0
) -> list[bytes]:
    """The pages of the document as PNG, to look at."""
    return _typeset(template, data, figures, date, format="png", ppi=ppi)


def _typeset(template: Traversable, data: Any, figures: Mapping[str, bytes], date: str, **options: Any) -> list[bytes]:
    import typst  # 80 MB: only where a document is wanted

    day = datetime.datetime.combine(datetime.date.fromisoformat(date), datetime.time(), datetime.UTC)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / template.name).write_bytes(template.read_bytes())
        (folder / LOOK).write_bytes((files("stillhook.report") / LOOK).read_bytes())
        (folder / DATA).write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")
        for stem, content in figures.items():
            (folder / f"{stem}.png").write_bytes(content)
        compiler = typst.Compiler(folder / template.name, root=folder, ignore_system_fonts=True)
        try:
            result = compiler.compile(timestamp=day, **options)
        except typst.TypstError as problem:
            reason = " ".join(str(problem.message).split())[:200]
            raise Unset(f"the document cannot be set ({reason}).") from None
    assert result is not None
    return result if isinstance(result, list) else [result]
