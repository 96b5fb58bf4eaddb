"""May a plan credit the certificate of a crane? Signature, trust and expiry are judged where the crane is read; here
the complete certificate is looked at: its logs, campaign, criteria, code and crane by their hashes, and everything
recomputed from the logs, once for each certificate and code.

The answer of a recomputation is kept in the cache folder, which nobody else may write to, under a hash of all that it
follows from: the certificate (with the hashes of its logs, campaign, criteria and crane) and the code with its
libraries. docs/decisions/0037-signed-certificates.md has its cost.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from stillhook.base.atomic import atomic_file
from stillhook.base.kept.sealed import canonical, read_sealed, sealed
from stillhook.engine.certificate import objections
from stillhook.errors import StillhookError, ValidateError
from stillhook.kernels.cache import kernel_folder, make_private
from stillhook.spec.crane import Crane
from stillhook.units import quote

if TYPE_CHECKING:
    from stillhook.validate.certificate.certificate import Certificate

FORMAT = "stillhook recomputed certificate 1"
FOLDER = "certificates"
"""Folder of the cache with the kept answers."""
ALONE = "the crane file has its record alone: name the certificate itself, next to its campaign and logs, to credit it"


def checked(crane: Crane, *, recompute: bool, progress: Callable[[float], None] | None = None) -> Crane:
    """The crane with what speaks against its certificate (`Certified.objections`) after the complete check.

    Parameters: recompute: also compute everything again from the logs, where no answer is kept; without, by hashes.
    A certificate that is credited in no case (untrusted, synthetic, of another crane or code) is left as it is.
    """
    record = crane.certified
    if record is None or not record.real or objections(crane):
        return crane
    return crane.model_copy(update={"certified": record.checked(_against(crane, recompute, progress))})


def _against(crane: Crane, recompute: bool, progress: Callable[[float], None] | None) -> tuple[str, ...]:
    from stillhook.validate.certificate.certificate import load_certificate  # heavy
    from stillhook.validate.certificate.recheck import check  # heavy

    record = crane.certified
    assert record is not None
    if not record.file:
        return (ALONE,)
    file = Path(record.file)
    try:
        certificate = load_certificate(file)
        if certificate.digest != record.digest:
            return (f"{quote(file.name)} was changed since the crane was read",)
        if found := check(file, certificate, quick=True).against:
            return tuple(f"it cannot be verified: {line}" for line in found)
        if not recompute:
            return ()
        answer = _kept(certificate)
        if answer is None:
            again = check(file, certificate, numbers=True, progress=progress)
            answer = again.against
            if again.computed:
                _keep(certificate, answer)
    except StillhookError as problem:
        return (f"it cannot be verified: {problem}",)
    return tuple(f"recomputed from its logs it is another one: {line}" for line in answer)


def _place(certificate: Certificate) -> Path:
    """File of the answer for this certificate by this code."""
    from stillhook.validate.certificate.content import versions  # heavy

    key = canonical({"certificate": certificate.digest, **versions()})
    return kernel_folder(FOLDER) / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}.json"


def _kept(certificate: Certificate) -> tuple[str, ...] | None:
    """What an equal check found, None where none is kept or its file is damaged: it is then made again."""
    with suppress(StillhookError):
        data = read_sealed(_place(certificate), FORMAT, "an answer", "It is made again.", ValidateError)
        if data.get("certificate") == certificate.digest and isinstance(data.get("against"), list):
            return tuple(str(line) for line in data["against"])
    return None


def _keep(certificate: Certificate, against: tuple[str, ...]) -> None:
    """Keep an answer; where that is impossible, the next plan computes again."""
    place = _place(certificate)
    with suppress(StillhookError, OSError):
        make_private(place.parent)
        with atomic_file(place) as part:
            data = {"format": FORMAT, "certificate": certificate.digest, "against": list(against)}
            part.write_text(sealed(data), encoding="utf-8", newline="\n")
