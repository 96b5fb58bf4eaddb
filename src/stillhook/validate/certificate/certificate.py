"""The certificate of a twin: results of a validation, as a document that can be checked and a record stored with a
crane.

A certificate is plain data in one canonical JSON text; the PDF is set from that text and the figures. The same logs,
campaign, criteria, crane and code give the same bytes of both, in any folder, time zone or locale.
Source: Moslatt 2020 section 2.6 and paper F.

Content of a certificate as plain data: independent of clock, random numbers and folders of the machine.

Texts of a certificate: the level of the twin, and what was not shown.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from stillhook._version import __version__
from stillhook.errors import ValidateError
from stillhook.kernels.build import PACKAGE, results_hash
from stillhook.library import certified_crane_toml, crane_from_toml, crane_toml
from stillhook.library.certificate import FORMAT, canonical, certified_of, digest_of, read_certificate
from stillhook.report.document import Document
from stillhook.report.formatting import fmt
from stillhook.report.pdf import Unset, pdf
from stillhook.report.pictures import can_set, drawn
from stillhook.spec.crane import Crane, content
from stillhook.spec.validity import Certified
from stillhook.validate.certificate.document import annex, document
from stillhook.validate.criteria.criteria import DetectionLimits, detection_limits
from stillhook.validate.criteria.results import MEASURES, CriterionResult, Measure, Outcome, Step, Verdict
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.report import texts
from stillhook.validate.report.texts import (
    SEGMENT_HEAD,
    decisive,
    decisive_cells,
    envelope_of,
    line_cells,
    risks,
    segment_cells,
    segments,
    sentence,
    step_verdict,
    unjudged,
)
from stillhook.validate.validation import Validation
from stillhook.winches.reference import plant as reference_plant


class Level(NamedTuple):
    """Level and variant of a digital twin by Moslatt 2020 table 2.7, and what they mean."""

    level: int
    variant: int
    statement: str


NOT_VERIFIED = Level(1, 1, "Level 1, variant 1: a model that data of a crane have not verified.")
VERIFIED = Level(
    2,
    3,
    "Level 2, variant 3: a model verified with batches of logs of the crane; not embedded, not in real time; updated"
    " manually"
    " only.",
)

PARTLY = (
    "It covers the lines judged: heave compensation of the winch as its PLC logs it. Lines without a meaning for the"
    " winch type are listed as not judged, and nothing is credited for what they would show."
)

SYNTHETIC = (
    "SYNTHETIC: these logs were simulated, not measured on a crane. Nothing here says anything about a real crane."
)

LEFT_OUT = (
    "The temperature of the oil: friction, leakage and stiffness are those at the working temperature of the tests.",
    "Backlash and flexibility of the gears; drum, gears and motors are one stiff body.",
    "Lines are one volume a side with an effective stiffness; pressure waves in them are not computed.",
    "Overload protection and other safety systems beyond the relief valves.",
    "Flexibility of the crane and its boom, swing of the load and horizontal motion.",
    "The wire is a spring with damping, without mass between tip and load.",
)
"""What the plant model leaves out. Source: Moslatt 2020 sections 2.5.2.1 to 2.5.2.3 and paper F, "Simplifications"."""

ALWAYS = (
    (
        "The verdict applies to the crane file as supplied, the code named here, and these logs. It lapses when one of"
        " them changes;"
        " stillhook certificate check verifies this."
    ),
    (
        "Conditions are judged one by one (a box). Not every combination inside the ranges was tested; between tests"
        " the model interpolates."
    ),
    (
        "The compared figure is the control error of the winch as its PLC sees it. What the load does below the wire"
        " was not compared."
    ),
    "Faults (loss of a hydraulic power unit, blackout, failed sensors) were not tested.",
    "Values proposed by step 4 are not part of this twin until a crane file contains them and has been validated"
    " again.",
)


def certified_outcome(validation: Validation, envelope: Mapping[str, Any] | None) -> tuple[Outcome, str]:
    """What a certificate says the validation came to, and the verdict in a sentence. Criteria that nothing counts in,
    or that do without heave compensation, certify nothing, even where all of them are met."""
    outcome = validation.outcome
    if outcome is Outcome.NOT_JUDGED:
        label = validation.campaign.criteria.label
        return outcome, f"NOT ASSESSED: no criterion of {label} counts on these data, so that nothing was shown."
    if outcome is Outcome.PASSED and envelope is None:
        text = "NOT SHOWN: no part of the logs with heave compensation could be compared, so the twin is not validated."
        return Outcome.NOT_SHOWN, text
    return outcome, sentence(validation)


def level_of(passed: bool, synthetic: bool, *, judged_whole: bool = True) -> Level:
    """Level and variant that a validation gives the twin; one on simulated logs says so, and one in which lines have no
    meaning for the winch type."""
    if not passed:
        return NOT_VERIFIED
    verified = VERIFIED if judged_whole else VERIFIED._replace(statement=f"{VERIFIED.statement} {PARTLY}")
    if synthetic:
        crane = (
            "SYNTHETIC: the logs are of a simulated crane, so this shows the method; the twin of a real crane stays at"
            " level 1."
        )
        return verified._replace(statement=f"{verified.statement} {crane}")
    return verified


def limitations(validation: Validation, passed: bool) -> list[dict[str, Any]]:
    """What was synthetic, what was not shown, what holds always, and what the model leaves out: headings with their
    lines."""
    sections = {
        "Synthetic data": [SYNTHETIC] if validation.campaign.synthetic else [],
        "Not shown by these data": list(_open(validation, Verdict.NOT_SHOWN)),
        "Not covered by the tests": list(_open(validation, Verdict.NOT_COVERED)),
        texts.UNDETECTABLE: texts.undetectable(validation),
        "Remarks of the campaign": [f"Remark: {text}" for text in validation.campaign.remarks],
        "Not judged: no meaning for this winch type": texts.without_meaning_says(validation),
        texts.HEADING: texts.unjudged_says(validation),
        "Of this certificate" if passed else "Of this validation": list(ALWAYS),
        "Left out of the model": list(LEFT_OUT),
        "What this method detects (simulated cranes with known defects)": _detects(validation.campaign.crane),
    }
    return [{"heading": heading, "lines": lines} for heading, lines in sections.items() if lines]


def _limits_of(crane: Crane) -> DetectionLimits:
    """Detection limits that hold for a crane: those of the trials, which are of the winch type with a reference plant;
    none for another type, whose judged lines are others."""
    return detection_limits() if crane.plant == reference_plant.OF else DetectionLimits("", "", 0, 0, ())


def _detects(crane: Crane) -> list[str]:
    if crane.plant == reference_plant.OF:
        return list(_limits_of(crane).sentences())
    return [
        f'The trials with known defects are of winch type "{reference_plant.OF}": the detection limits of winch type'
        f' "{crane.plant.value}" are not known. The page "Validate a twin" lists single defects that were tried.'
    ]


def _open(validation: Validation, verdict: Verdict) -> Iterator[str]:
    for line in validation.lines:
        undetectable = line.measure is not None and line.measure.undetectable  # they have a heading of their own
        if line.verdict is verdict and not undetectable:
            weight = "blocks the certificate" if line.failed else "does not block it"
            yield f"{line.key} ({weight}): {line.message}"


METHOD_FOLDERS = ("validate", "statistics", "logs", "formats", "report", "base")
METHOD_FILES = ("units.py",)
LIBRARIES = ("numpy", "pandas", "scipy")
"""Libraries that compute the numbers of a validation in addition to Stillhook."""
ROUNDING = 1e-9
OF_ORDINARY_SIZE = ("", "time", "length", "speed", "pressure", "force", "mass", "torque", "rotation")
"""Below ROUNDING [SI], a number of these quantities is what rounding leaves of zero, which no two machines do alike."""
DECIDING = ("verdict", "key", "text")
"""What people read of a line that decides the verdict."""


def content_of(validation: Validation) -> dict[str, Any]:
    """What a validation certifies, or fails to: independent of the folder of campaign or certificate.

    Errors: ValidateError where not all steps were taken.
    """
    if not validation.complete:
        raise ValidateError("certificate: only some of the steps 0 to 6 were taken. A certificate needs all of them.")
    campaign = validation.campaign
    envelope = envelope_of(validation.records, campaign.criteria.settings["window"])
    outcome, verdict = certified_outcome(validation, envelope)
    passed = outcome is Outcome.PASSED
    level = level_of(passed, campaign.synthetic, judged_whole=not texts.without_meaning(validation))
    return {
        "format": FORMAT,
        "title": campaign.title,
        "date": campaign.date.isoformat(),
        "synthetic": campaign.synthetic,
        "passed": passed,
        "outcome": outcome.value,
        "verdict": verdict,
        "decisive": [
            dict(zip(DECIDING, decisive_cells(validation, line), strict=True)) for line in decisive(validation)
        ],
        "risks": risks(validation.lines),
        "crane": crane_part(campaign.crane),
        "twin": {"level": level.level, "variant": level.variant, "statement": level.statement, **versions()},
        "campaign": campaign_part(campaign),
        "criteria": plain(campaign.criteria.to_dict()),
        "lines": [_line(validation, line) for line in validation.lines],
        "steps": [_step(validation, step) for step in validation.steps],
        "data": [_data(campaign, record) for record in validation.records],
        "load_cases": {"header": list(SEGMENT_HEAD), "rows": [list(segment_cells(s)) for s in segments(validation)]},
        "unjudged": plain(unjudged(validation)),
        "envelope": plain(envelope) if passed else None,
        "limitations": limitations(validation, passed),
        "detection_limits": _limits_of(campaign.crane).to_dict(),
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
    digest = hashlib.sha256()
    files = [
        p for folder in METHOD_FOLDERS for p in (PACKAGE / folder).rglob("*") if p.suffix in (".py", ".toml", ".typ")
    ]
    inside = [p for p in files if p.name != without]
    for path in sorted(inside) + [PACKAGE / name for name in METHOD_FILES]:
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def sha256_of(path: Path) -> str:
    """Hash of a file. Errors: ValidateError where it cannot be read."""
    digest = hashlib.sha256()
    try:
        with open(path, "rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    except OSError as problem:
        raise ValidateError(f"{path}: cannot be read ({problem.strerror or problem}). Restore the file.") from None
    return digest.hexdigest()


def seen_from(path: Path, folder: Path) -> str:
    """A path as seen from a folder, with forward slashes; the name alone where no way leads there (another drive)."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.name


def plain(x: Any) -> Any:
    """Data as JSON has them: numbers out of NumPy, lists, tables with keys of text."""
    if isinstance(x, Mapping):
        return {str(k): plain(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [plain(v) for v in x]
    return plain(x.tolist()) if hasattr(x, "tolist") else x


def _line(validation: Validation, line: CriterionResult) -> dict[str, Any]:
    measure = {"measure": _numbers(line.measure) if line.measure is not None else None}
    return {**plain(line.to_dict()), **measure, "cells": line_cells(validation, line)._asdict()}


def _step(validation: Validation, step: Step[Any]) -> dict[str, Any]:
    return {
        "step": int(step.number),
        "title": step.title,
        "verdict": step_verdict(validation, step),
        "measures": [_measure(m) for m in step.measures],
        "statements": list(step.statements),
        "tables": [
            {"title": t.title, "header": list(t.header), "rows": [list(r) for r in t.rows]} for t in step.tables
        ],
    }


def _numbers(measure: Measure) -> dict[str, Any]:
    """A measure without what is rounding in it."""
    data: dict[str, Any] = plain(measure.to_dict())
    if measure.quantity in OF_ORDINARY_SIZE:
        data |= {
            n: 0.0 for n in ("value", "low", "high", "structural") if data[n] is not None and abs(data[n]) < ROUNDING
        }
    return data


def _measure(exact: Measure) -> dict[str, Any]:
    numbers = _numbers(exact)
    measure = replace(exact, **{n: numbers[n] for n in ("value", "low", "high")})
    between = measure.low is not None and measure.high is not None
    interval = f"{fmt(measure.low, measure.quantity, 3)} to {fmt(measure.high, measure.quantity, 3)}" if between else ""
    meaning = MEASURES[measure.name].meaning if measure.name in MEASURES else measure.name
    text = {"meaning": meaning, "value": fmt(measure.value, measure.quantity, 3), "interval": interval}
    return {**numbers, "text": text}


def _data(campaign: Campaign, record: Record) -> dict[str, Any]:
    test = record.test
    return {
        "test": test.name,
        "kind": test.kind.value,
        "file": seen_from(test.log, campaign.file.parent),
        "samples": int(record.log.samples),
        "rate": float(record.log.rate),
        "duration": float(record.t[-1] - record.t[0]),
        "load": test.load,
        "water": test.water is not None,
        "signals": sorted(record.signals),
        "statements": list(record.statements),
    }


CERTIFICATE, NOT_PASSED, CRANE = "certificate", "not-passed", "crane.toml"
"""Names of the files: certificate.json and .pdf where it passed, not-passed.json and .pdf where not, crane.toml with
the certificate."""


@dataclass(frozen=True)
class Certificate:
    """What was certified, or the results of a validation that was not passed; data as
    `stillhook.validate.certificate.certificate` has it."""

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

    @property
    def pdf_name(self) -> str:
        """Name of its PDF."""
        return Path(self.name).with_suffix(".pdf").name

    @property
    def annex_name(self) -> str:
        """Name of the PDF of its annex."""
        return f"{Path(self.name).stem}-annex.pdf"

    def pdf(self) -> bytes:
        """The document.

        Letters that the fonts lack print as boxes; the JSON has them. Errors: ValidateError where it cannot be set.
        """
        return _set(document(self.data))

    def annex(self, figures: Mapping[str, bytes]) -> bytes:
        """The annex, of the contents without it. figures: PNG by stem, of
        `stillhook.validate.report.figures.pictures`. Errors: as of `pdf`."""
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
    """The certificate of a validation, without an annex. Errors: ValidateError where not all steps were taken."""
    data = json.loads(canonical(content_of(validation)))  # as a reader of the file will have it
    return Certificate(_numbered(data))


def with_its_annex(made: Certificate, figures: Mapping[str, bytes]) -> tuple[Certificate, bytes | None]:
    """The certificate with the hash of its annex, and the annex; unchanged and None where no PDF can be set (without
    the extra `report`)."""
    if not can_set():
        return made, None
    content = made.annex(figures)
    return made.with_annex(content), content


def load_certificate(path: str | Path) -> Certificate:
    """A certificate from its JSON file, complete and unchanged. Errors: ValidateError of one line."""
    return Certificate(read_certificate(Path(path)))


def certificate_files(validation: Validation, images: Mapping[str, bytes] | None = None) -> dict[str, bytes]:
    """Name and content of the files of a certificate: JSON, PDF and its annex (with the extra `report`), and where it
    passed the crane's file.

    drawn: the pictures of the validation (`stillhook.validate.report.figures.pictures`), where they already exist.
    A validation that was not passed gives a document that says so, and no crane. Errors: ValidateError where not all
    steps were taken.
    """
    from stillhook.validate.report.figures import pictures  # heavy

    figures = drawn(lambda: pictures(validation)) if images is None else images
    made, annexed = with_its_annex(certificate_of(validation), figures)
    files = {made.name: made.text().encode()}
    if annexed is not None:
        files |= {made.pdf_name: made.pdf(), made.annex_name: annexed}
    return files | ({CRANE: made.crane_toml().encode()} if made.passed else {})
