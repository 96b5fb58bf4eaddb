"""What a certificate says, as plain data: independent of clock, random numbers and folders of the machine; and the hash
of the code that it follows from.
Source: Moslatt 2020 section 2.6 and paper F.
"""

from __future__ import annotations

import functools
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from stillhook._version import __version__
from stillhook.base.gateway import access
from stillhook.base.kept.sources import PACKAGE
from stillhook.errors import ValidateError
from stillhook.kernels.build import results_hash
from stillhook.library import crane_toml
from stillhook.library.certificate import FORMAT
from stillhook.spec.crane import Crane, content
from stillhook.spec.sub_models import levels_of
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.report.view import WORDS, limits_of, view_of, without_meaning
from stillhook.validate.validation import Validation

METHOD_FOLDERS = (
    *("formats/table", "logs", "statistics"),
    *(
        f"validate/{step}"
        for step in ("ahc", "controller", "criteria", "data_set", "dynamics", "parameters", "passive")
    ),
)
METHOD_FILES = (
    *("base/arrays.py", "base/contract.py", "base/extensions.py", "base/gateway/parse.py", "base/variable.py"),
    *("formats/binary.py", "units.py", "units.toml", "validate/certificate/content.py", "validate/report/view.py"),
    *("validate/speed_limits.py", "validate/validation.py"),
)
"""What the numbers of a validation follow from besides the twin (`results_hash`), by the imports of its steps; what
writes, keeps, signs or words them is none of it (docs/decisions/0037-signed-certificates.md)."""
LIBRARIES = ("numpy", "pandas", "scipy")
"""Libraries that compute the numbers of a validation in addition to Stillhook."""


class Level(NamedTuple):
    """Level and variant of a digital twin by Moslatt 2020 table 2.7, and what they mean."""

    level: int
    variant: int
    statement: str


def level_of(passed: bool, synthetic: bool, *, complete: bool = True) -> Level:
    """Level and variant of the twin; synthetic logs, and lines without a meaning for the winch type, are stated."""
    words = WORDS["levels"]
    if not passed:
        return Level(1, 1, words["not_verified"])
    parts = (words["verified"], "" if complete else words["partly"], words["synthetic"] if synthetic else "")
    return Level(2, 2, " ".join(filter(None, parts)))


def content_of(validation: Validation) -> dict[str, Any]:
    """What a validation certifies, or fails to: independent of the folder of campaign or certificate.

    Errors: ValidateError where not all steps were taken.
    """
    if not validation.complete:
        raise ValidateError("certificate: only some of the steps 0 to 6 were taken. A certificate needs all of them.")
    campaign, view = validation.campaign, view_of(validation)
    level = level_of(view["passed"], campaign.synthetic, complete=not without_meaning(validation))
    logs = {t.name: seen_from(t.log, campaign.file.parent) for t in campaign.tests}
    return {
        **view,
        "format": FORMAT,
        "crane": crane_part(campaign.crane),
        "twin": {**level._asdict(), "sub_models": levels_of(campaign.crane, view["lines"]), **versions()},
        "campaign": campaign_part(campaign),
        "data": [{**d, "file": logs[d["test"]]} for d in view["data"]],
        "envelope": view["envelope"] if view["passed"] else None,
        "detection_limits": limits_of(campaign.crane).to_dict(),
        "annex": None,
    }


def crane_part(crane: Crane) -> dict[str, Any]:
    """The crane under test: hash of every part of its content, and all of its numbers with their sources as a crane
    file."""
    bare = crane.model_copy(update={"certified": None})
    return {"name": crane.name, "title": crane.title, "content": content(bare), "toml": crane_toml(bare)}


def campaign_part(campaign: Campaign) -> dict[str, Any]:
    """The campaign file by its name, and the logs that it names, each with its hash."""
    tests = [
        {
            "test": t.name,
            "kind": t.kind.value,
            "file": seen_from(t.log, campaign.file.parent),
            "sha256": sha256_of(t.log),
        }
        for t in campaign.tests
    ]
    name, digest = campaign.file.name, sha256_of(campaign.file)
    return {"file": name, "sha256": digest, "delay": campaign.delay, "remarks": list(campaign.remarks), "logs": tests}


def versions() -> dict[str, Any]:
    """The code that computed: of the twin (`results_hash`), of the method, and the libraries under them."""
    libraries = {"python": f"{sys.version_info[0]}.{sys.version_info[1]}"} | {name: version(name) for name in LIBRARIES}
    return {"version": __version__, "code": results_hash(), "method": method_hash(), "libraries": libraries}


@functools.cache
def method_hash(without: str = "") -> str:
    """Hash of the code by which logs are read, compared and judged; without the files of that name."""
    names = [*PACKAGE.inside(METHOD_FOLDERS, (".py", ".toml")), *METHOD_FILES]
    return PACKAGE.hash(name for name in names if name.rpartition("/")[2] != without)[:16]


def sha256_of(path: Path) -> str:
    """Hash of a file. Errors: ValidateError where it cannot be read."""
    return access.sha256_of(path, ValidateError)


def seen_from(path: Path, folder: Path) -> str:
    """A path as seen from a folder, with forward slashes; the name alone where no way leads there (another drive)."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.name
