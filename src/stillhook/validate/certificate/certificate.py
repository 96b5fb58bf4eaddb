"""The certificate of a twin: results of a validation, as a document that can be checked and a record stored with a
crane; and all files that a validation leaves in a folder.

A certificate is plain data in one canonical JSON text; the PDF is set from that text and the figures. The same logs,
campaign, criteria, crane and code give the same bytes of both, in any folder, time zone or locale: its content is
independent of clock, random numbers and folders of the machine.
Source: Moslatt 2020 section 2.6 and paper F.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.base.atomic import atomic_files, check_folder
from stillhook.base.gateway.parse import json_file
from stillhook.base.kept.sealed import SIGNATURE, canonical, digest_of
from stillhook.errors import ValidateError
from stillhook.formats.results import save_json
from stillhook.formats.table.cells import csv_of
from stillhook.library import certified_crane_toml, crane_from_toml, crane_toml
from stillhook.library.certificate import certified_of, read_certificate
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.report.document import Document, Figure
from stillhook.report.html import fragment, html
from stillhook.report.kit import can_set, draw_if_possible
from stillhook.report.pdf import Unset, pdf
from stillhook.spec.crane import identity
from stillhook.spec.validity import Certified
from stillhook.trust.keys import SigningKey
from stillhook.trust.results import result_folder, with_renewed_parts
from stillhook.trust.signature import Signed, sign
from stillhook.trust.standing import Judgement
from stillhook.trust.trust_list import TrustList, users_trust
from stillhook.units import quote
from stillhook.validate.certificate.content import content_of
from stillhook.validate.certificate.document import annex, document
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.dynamics.check import tuned_crane
from stillhook.validate.report.document import certificate_summary, deviations_table, report, segments_table, to_dict
from stillhook.validate.report.figures import pictures
from stillhook.validate.validation import Validation

CERTIFICATE, NOT_PASSED, CRANE = "certificate", "not-passed", "crane.toml"
"""Names of the files: certificate.json and .pdf where it passed, not-passed.json and .pdf where not, crane.toml with
the certificate."""


@dataclass(frozen=True)
class Certificate:
    """What was certified, or the results of a validation that was not passed."""

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

    def judged(self, trust: TrustList) -> Judgement:
        """Who vouches for it, by a trust list."""
        return self.short.judged(trust).judgement

    def signed(self, key: SigningKey) -> Certificate:
        """The certificate with a signature in place of any other; its digest stays. Signed twice it is the same."""
        return self.with_signature(sign(Signed.CERTIFICATE, self.short.statement, key).to_dict())

    def with_signature(self, signature: Mapping[str, str] | None) -> Certificate:
        """The certificate with a signature as its file has it; None: without."""
        bare = {name: value for name, value in self.data.items() if name != SIGNATURE}
        return Certificate(bare if signature is None else {**bare, SIGNATURE: dict(signature)})

    def text(self) -> str:
        """Its canonical text."""
        return canonical(self.data)

    @property
    def pdf_name(self) -> str:
        """Name of its PDF."""
        return Path(self.name).with_suffix(".pdf").name

    @property
    def annex_name(self) -> str:
        """Name of the PDF of its annex."""
        return f"{Path(self.name).stem}-annex.pdf"

    def summary(self) -> Document:
        """In short, for a terminal, with what the user's trust list says of its signature."""
        return certificate_summary(self.data, self.digest, self.short.envelope, self.judged(users_trust()))

    def _repr_html_(self) -> str:
        """The same, for a notebook."""
        return fragment(self.summary())

    def pdf(self) -> bytes:
        """The document; letters that the fonts lack print as boxes. Errors: ValidateError where it cannot be set."""
        return _set(document(self.data))

    def annex(self, figures: Mapping[str, Figure]) -> bytes:
        """The annex, of the contents without it; figures: by stem. Errors: as of `pdf`."""
        return _set(annex(_numbered({**self.data, "annex": None}), figures))

    def with_annex(self, content: bytes) -> Certificate:
        """The certificate with the hash of its annex."""
        named = {"file": self.annex_name, "sha256": hashlib.sha256(content).hexdigest()}
        return Certificate(_numbered({**self.data, "annex": named}))

    def crane_toml(self) -> str:
        """The crane as a complete file that names this certificate in the same folder."""
        return certified_crane_toml(crane_from_toml(self.data["crane"]["toml"], CRANE), self.name)


def _set(made: Document) -> bytes:
    try:
        return pdf(made)
    except Unset as problem:
        raise ValidateError(f"certificate: {problem}") from None


def _numbered(data: Mapping[str, Any]) -> dict[str, Any]:
    """Contents with their digest."""
    return {**data, "digest": digest_of(data)}


def certificate_of(validation: Validation) -> Certificate:
    """The certificate of a validation, without an annex.

    Parameters
    ----------
    validation : Validation
        What `validate` gave.

    Returns
    -------
    Certificate
        The certificate.

    Raises
    ------
    ValidateError
        Where not all steps were taken.
    """
    data = json.loads(canonical(content_of(validation)))  # as a reader of the file will have it
    return Certificate(_numbered(data))


def with_its_annex(made: Certificate, figures: Mapping[str, Figure]) -> tuple[Certificate, bytes | None]:
    """The certificate with the hash of its annex, and the annex; unchanged and None where no PDF can be set."""
    if not can_set():
        return made, None
    content = made.annex(figures)
    return made.with_annex(content), content


def load_certificate(path: str | Path) -> Certificate:
    """A certificate from its JSON file, complete and unchanged.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Certificate
        The certificate.

    Raises
    ------
    ValidateError
        One line.
    """
    return Certificate(read_certificate(Path(path)))


def certificate_files(
    validation: Validation, images: Mapping[str, Figure] | None = None, key: SigningKey | None = None
) -> dict[str, bytes]:
    """Files of a certificate: JSON, PDF and its annex (with the extra `report`), and where it passed the crane's file.

    Parameters
    ----------
    validation : Validation
        What `validate` gave. One that was not passed gives a document that says so, and no crane.
    images : mapping, optional
        Pictures of the validation (`stillhook.validate.report.figures.pictures`), where they already exist.
    key : SigningKey, optional
        Key that signs (`stillhook.trust.keys.read_key`); None leaves it unsigned, and no plan credits it.

    Returns
    -------
    dict
        Content (bytes) by name.

    Raises
    ------
    ValidateError
        Where not all steps were taken.
    """
    from stillhook.validate.report.figures import pictures  # heavy

    figures = draw_if_possible(lambda: pictures(validation)) if images is None else images
    made, annexed = with_its_annex(certificate_of(validation), figures)
    made = made if key is None else made.signed(key)
    files = {made.name: made.text().encode()}
    if annexed is not None:
        files |= {made.pdf_name: made.pdf(), made.annex_name: annexed}
    return files | ({CRANE: made.crane_toml().encode()} if made.passed else {})


REPORT, NUMBERS, SEGMENTS, DEVIATIONS, TUNED = (
    "report.html",
    "summary.json",
    "segments.csv",
    "deviations.csv",
    "tuned-crane.toml",
)
SOMETIMES = (
    DEVIATIONS,
    TUNED,
    CRANE,
    *(f"{stem}{end}" for stem in (CERTIFICATE, NOT_PASSED) for end in (".json", ".pdf", "-annex.pdf")),
)
"""Files that not every validation writes: one of an earlier validation must not stay next to the report of a later
one."""
PICTURES = "step-[0-6]-*.png"


def check_out(campaign: Campaign, folder: str | Path) -> None:
    """Refuse a folder that cannot be written to, or in which an input of the campaign would be lost. Errors:
    StillhookError."""
    out = Path(folder)
    names = (REPORT, NUMBERS, SEGMENTS, *SOMETIMES)
    check_folder(out, names)
    if folders := [path for path in out.glob(PICTURES) if path.is_dir()]:
        raise ValidateError(
            f"{out}: {quote(folders[0].name)} there is a folder in the way of a figure. Choose another folder."
        )
    foreign = [name for name in SOMETIMES if (out / name).exists() and not _ours(out)]
    if foreign:
        raise ValidateError(
            f"{out}: {quote(foreign[0])} there is not from an earlier validation, and could be lost. Choose another"
            " folder."
        )
    crane = campaign.file.parent / campaign.crane_name
    inputs = {path.resolve() for path in (campaign.file, *_crane_files(crane), *(t.log for t in campaign.tests))}
    for name in names:
        if (out / name).resolve() in inputs:
            raise ValidateError(
                f"{out}: {quote(name)} there belongs to the campaign, and would be written over. Choose another folder."
            )


def _ours(out: Path) -> bool:
    """Whether the numbers in a folder are those of a validation; other commands write a file of that name too."""
    try:
        summary = json_file(out / NUMBERS, "a validation", "", ValidateError)
    except ValidateError:
        return False
    return isinstance(summary, dict) and {"criteria", "complete", "verdict"} <= summary.keys()


def _crane_files(crane: Path) -> Iterator[Path]:
    """A crane's file, and those that it builds on."""
    while crane.is_file():
        yield crane
        base = parsed(toml_text(crane), crane.name, FileKind.CRANE).get("base")
        if not isinstance(base, str):
            return
        crane = crane.parent / base


def save_validation(
    validation: Validation, folder: str | Path, *, certificate: bool = True, key: SigningKey | None = None
) -> tuple[str, ...]:
    """Write everything that a validation gives, all or nothing, and take away what an earlier one has left there.

    Parameters
    ----------
    validation : Validation
        What `validate` gave.
    folder : str or Path
        Folder to write.
    certificate : bool, default True
        Also the certificate, or what stands for one that was not passed; there is none unless all steps were taken.
    key : SigningKey, optional
        Key that signs the certificate, as of `certificate_files`.

    Returns
    -------
    tuple of str
        Names of the files.

    Raises
    ------
    StillhookError
        Where the folder cannot be written to.
    """
    out = Path(folder)
    check_out(validation.campaign, out)
    with result_folder(out, "validation", [identity(validation.campaign.crane)], key=key) as part:
        images = draw_if_possible(lambda: pictures(validation))
        content = {f"{stem}.png": image.png for stem, image in images.items()}
        content[REPORT] = html(report(validation, images)).encode()
        if certificate and validation.complete:
            content |= certificate_files(validation, images, key)
        tuned = _tuned(validation)
        if tuned is not None:
            content[TUNED] = tuned.encode()
        for name, data in content.items():
            (part / name).write_bytes(data)
        save_json(to_dict(validation), part / NUMBERS)
        (part / SEGMENTS).write_text(csv_of(segments_table(validation)), encoding="utf-8", newline="")
        deviations = deviations_table(validation)
        if deviations is not None:
            (part / DEVIATIONS).write_text(csv_of(deviations), encoding="utf-8", newline="")
        written = tuple(sorted(p.name for p in part.iterdir()))
        _clear(out, written)
    return written


def _tuned(validation: Validation) -> str | None:
    steps = [s for s in validation.steps if s.number is StepNumber.DYNAMICS]
    crane = tuned_crane(steps[0].estimates, validation.campaign) if steps else None
    return crane_toml(crane) if crane is not None else None


def _clear(out: Path, written: tuple[str, ...]) -> None:
    """Take away what an earlier validation has left in this folder and the present one does not write."""
    if not _ours(out):
        return
    for path in (*(out / name for name in SOMETIMES), *out.glob(PICTURES)):
        if path.name not in written:
            path.unlink(missing_ok=True)


def sign_certificate(path: str | Path, key: SigningKey) -> Certificate:
    """Sign the certificate in a file with a key, in place of any signature before.

    A PDF next to it is set again and names the signer. Signed twice, both have the same bytes.

    Parameters
    ----------
    path : str or Path
        The file.
    key : SigningKey
        The key (`stillhook.trust.keys.read_key`).

    Returns
    -------
    Certificate
        The certificate with its signature.

    Raises
    ------
    StillhookError
        One line, where the file does not hold a certificate or cannot be written.
    """
    file = Path(path)
    made = load_certificate(file).signed(key)
    beside = file.with_suffix(".pdf")
    content = {file: made.text().encode()}
    if beside.exists() and can_set():
        content[beside] = made.pdf()
    content = with_renewed_parts(content, key)
    with atomic_files(*content) as parts:
        for part, data in zip(parts, content.values(), strict=True):
            part.write_bytes(data)
    return made
