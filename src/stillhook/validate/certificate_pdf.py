"""A certificate as PDF: its data and figures set by typst, with fonts of its own, the certificate's date and nothing of this machine."""

from __future__ import annotations

import datetime
import json
import tempfile
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from stillhook.errors import ValidateError
from stillhook.validate.certificate_sheet import sheet_of

TEMPLATE, DATA = "certificate.typ", "sheet.json"
ARCHIVE = "a-2u"
"""PDF/A-2u: everything that is needed to show it is inside, for as long as a crane lives, and its text can be searched."""


def pdf(data: Mapping[str, Any], figures: Mapping[str, bytes]) -> bytes:
    """The document. data of a certificate; figures: PNG by stem, as of `stillhook.validate.figures.pictures`.

    Texts with letters that typst's own fonts lack (Chinese, say) cannot be archived: they are set all the same, with boxes for those
    letters, which the JSON has. Errors: ValidateError where it cannot be set.
    """
    try:
        return _typeset(data, figures, format="pdf", pdf_standards=[ARCHIVE])[0]
    except ValidateError:
        return _typeset(data, figures, format="pdf")[0]


def pages(data: Mapping[str, Any], figures: Mapping[str, bytes], ppi: float = 100.0) -> list[bytes]:
    """The pages of the document as PNG, to look at."""
    return _typeset(data, figures, format="png", ppi=ppi)


def _typeset(data: Mapping[str, Any], figures: Mapping[str, bytes], **how: Any) -> list[bytes]:
    import typst  # 80 MB: only where a document is wanted

    date = datetime.datetime.combine(datetime.date.fromisoformat(data["date"]), datetime.time(), datetime.UTC)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / TEMPLATE).write_bytes((files("stillhook.validate") / "template" / TEMPLATE).read_bytes())
        (folder / DATA).write_text(json.dumps(sheet_of(data, tuple(figures)), ensure_ascii=False), encoding="utf-8")
        for stem, content in figures.items():
            (folder / f"{stem}.png").write_bytes(content)
        compiler = typst.Compiler(folder / TEMPLATE, root=folder, ignore_system_fonts=True)
        try:
            found = compiler.compile(timestamp=date, **how)
        except typst.TypstError as problem:
            reason = " ".join(str(problem.message).split())[:200]
            raise ValidateError(f"certificate: the document cannot be set ({reason}).") from None
    assert found is not None
    return found if isinstance(found, list) else [found]
