"""The certificate of a twin: results of a validation, as a document that can be checked and a record stored with a
crane.

A certificate is plain data in one canonical JSON text; the PDF is set from that text and the figures. The same logs,
campaign, criteria, crane and code give the same bytes of both, in any folder, time zone or locale.
Source: Moslatt 2020 section 2.6 and paper F.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.errors import ValidateError
from stillhook.library import certified_crane_toml, crane_from_toml
from stillhook.library.certificate import canonical, certified_of, digest_of, read_certificate
from stillhook.report.pdf import Unset, pdf
from stillhook.spec.validity import Certified
from stillhook.validate.certificate.content import content_of
from stillhook.validate.certificate.document import document
from stillhook.validate.validation import Validation

CERTIFICATE, NOT_PASSED, CRANE = "certificate", "not-passed", "crane.toml"
"""Names of the files: certificate.json and .pdf where it passed, not-passed.json and .pdf where not, crane.toml with
the certificate."""


@dataclass(frozen=True)
class Certificate:
    """What was certified, or the results of a validation that was not passed; data as
    `stillhook.validate.certificate.content` has it."""

    data: Mapping[str, Any]

    @property
    def digest(self) -> str:
        """SHA-256 of everything else in it: its number."""
        return str(self.data["digest"])

    @property
    def passed(self) -> bool:
        """Whether it certifies anything."""
        return bool(self.data["passed"])

    @property
    def short(self) -> Certified:
        """What a crane carries of it."""
        return certified_of(self.data, self.name)

    @property
    def name(self) -> str:
        """Name of its JSON file."""
        return f"{CERTIFICATE if self.passed else NOT_PASSED}.json"

    def text(self) -> str:
        """Its canonical text."""
        return canonical(self.data)

    def pdf(self, figures: Mapping[str, bytes]) -> bytes:
        """The document. figures: PNG by stem, of `stillhook.validate.report.figures.pictures`.

        Letters that the fonts lack print as boxes; the JSON has them. Errors: ValidateError where it cannot be set.
        """
        try:
            return pdf(document(self.data, figures))
        except Unset as problem:
            raise ValidateError(f"certificate: {problem}") from None

    def crane_toml(self) -> str:
        """The crane as a complete file that names this certificate in the same folder."""
        return certified_crane_toml(crane_from_toml(self.data["crane"]["toml"], CRANE), self.name)


def certificate_of(validation: Validation) -> Certificate:
    """The certificate of a validation. Errors: ValidateError where not all steps were taken."""
    data = json.loads(canonical(content_of(validation)))  # as a reader of the file will have it
    return Certificate({**data, "digest": digest_of(data)})


def load_certificate(path: str | Path) -> Certificate:
    """A certificate from its JSON file, complete and unchanged. Errors: ValidateError of one line."""
    return Certificate(read_certificate(Path(path)))


def certificate_files(validation: Validation, images: Mapping[str, bytes] | None = None) -> dict[str, bytes]:
    """Name and content of the files of a certificate: JSON, PDF, and where it passed the crane's file.

    drawn: the pictures of the validation (`stillhook.validate.report.figures.pictures`), where they already exist.
    A validation that was not passed gives a document that says so, and no crane. Errors: ValidateError where not all
    steps were taken.
    """
    from stillhook.validate.report.figures import pictures  # heavy

    made, figures = certificate_of(validation), pictures(validation) if images is None else images
    files = {made.name: made.text().encode(), Path(made.name).with_suffix(".pdf").name: made.pdf(figures)}
    return files | ({CRANE: made.crane_toml().encode()} if made.passed else {})
