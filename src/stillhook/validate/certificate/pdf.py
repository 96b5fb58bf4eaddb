"""A certificate as PDF: its data and figures set by typst, with the certificate's date."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from stillhook.errors import ValidateError
from stillhook.report.pdf import Unset, set_pdf
from stillhook.validate.certificate.document import sheet_of

TEMPLATE = files("stillhook.validate.certificate") / "certificate.typ"


def pdf(data: Mapping[str, Any], figures: Mapping[str, bytes]) -> bytes:
    """The document. data of a certificate; figures: PNG by stem, as of `stillhook.validate.report.figures.pictures`.

    Letters that the fonts lack print as boxes; the JSON has them. Errors: ValidateError where it cannot be set.
    """
    try:
        return set_pdf(TEMPLATE, sheet_of(data, tuple(figures)), figures, data["date"])
    except Unset as problem:
        raise ValidateError(f"certificate: {problem}") from None
