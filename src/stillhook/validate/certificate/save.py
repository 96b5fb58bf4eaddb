"""What a validation leaves in a folder: report, numbers, tables, figures, the tuned crane, and the certificate."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.errors import ValidateError
from stillhook.formats.results import save_json
from stillhook.library import crane_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.report.html import html
from stillhook.report.kit import drawn
from stillhook.units import quote
from stillhook.validate.certificate.certificate import CERTIFICATE, CRANE, NOT_PASSED, certificate_files
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.dynamics.check import tuned_crane
from stillhook.validate.figures.all import pictures
from stillhook.validate.report.document import deviations_table, report, segments_table, to_dict
from stillhook.validate.validation import Validation

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
    """Refuse a folder that cannot be written to, or in which an input of the campaign would be written over. Errors:
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
        summary = json.loads((out / NUMBERS).read_bytes())
    except (OSError, ValueError, RecursionError):
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


def save_validation(validation: Validation, folder: str | Path, *, certificate: bool = True) -> tuple[str, ...]:
    """Write everything that a validation gives, all or nothing, and take away what an earlier one has left there.

    Parameters
    ----------
    validation : Validation
        What `validate` gave.
    folder : str or Path
        Folder to write.
    certificate : bool, default True
        Also the certificate, or what stands for one that was not passed; there is none unless all steps were taken.

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
    with atomic_folder(out) as part:
        images = drawn(lambda: pictures(validation))
        content = {f"{stem}.png": data for stem, data in images.items()}
        content[REPORT] = html(report(validation, images)).encode()
        if certificate and validation.complete:
            content |= certificate_files(validation, images)
        tuned = _tuned(validation)
        if tuned is not None:
            content[TUNED] = tuned.encode()
        for name, data in content.items():
            (part / name).write_bytes(data)
        save_json(to_dict(validation), part / NUMBERS)
        segments_table(validation).to_csv(part / SEGMENTS, index=False)
        deviations = deviations_table(validation)
        if deviations is not None:
            deviations.to_csv(part / DEVIATIONS, index=False)
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
