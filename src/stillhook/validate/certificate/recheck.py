"""Does a certificate still hold? Its signature judged, its inputs compared by their hashes, and everything computed
again with what is there now."""

from __future__ import annotations

import glob
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.base.gateway.named_files import named_path, plain_name
from stillhook.base.kept.sealed import SIGNATURE, digest_of
from stillhook.errors import StillhookError, ValidateError
from stillhook.library import crane_from_toml
from stillhook.library.write import items
from stillhook.report.document import Figure
from stillhook.report.kit import can_draw, can_set
from stillhook.spec.crane import Crane
from stillhook.trust.standing import Judgement
from stillhook.trust.trust_list import TrustList, users_trust
from stillhook.units import number, quote, show
from stillhook.validate.certificate.certificate import Certificate, certificate_of, with_its_annex
from stillhook.validate.certificate.content import crane_part, sha256_of, versions
from stillhook.validate.data_set.campaign import Campaign, load_campaign
from stillhook.validate.report.figures import pictures
from stillhook.validate.validation import validate

ROUNDED = 1e-3
"""Relative difference of an end of the envelope that other libraries or processors explain."""
MOST_SHOWN = 12
"""Differences of one kind that are listed one by one."""


@dataclass(frozen=True)
class Check:
    """What a check found. judgement: of the signature; changed: inputs that are other than they were; missing: inputs
    that are not there or unusable; lines: verdict lines and ends of the envelope that differ; computed: whether they
    were computed again; same_bytes: whether the JSON came out as it is; same_pdf: the same of the PDF files, None where
    there is none; largest: relative difference of two numbers, and where it is."""

    certificate: Certificate
    judgement: Judgement
    changed: tuple[str, ...]
    missing: tuple[str, ...]
    lines: tuple[str, ...] = ()
    computed: bool = False
    same_bytes: bool = False
    same_pdf: bool | None = None
    largest: float = math.nan
    where: str = ""

    @property
    def holds(self) -> bool:
        """Passed, signed by a trusted key, none of its inputs has changed, and what was computed again has the same
        verdict lines and envelope."""
        return self.certificate.passed and self.judgement.trusted and not self.against

    @property
    def against(self) -> tuple[str, ...]:
        """What was found against it, signature aside, a line each."""
        return (*self.changed, *self.missing, *self.lines)

    @property
    def verdict(self) -> str:
        """The answer in one sentence."""
        if not self.certificate.passed:
            return "NOT VALID: the validation was not passed."
        if self.missing:
            return "NOT VALID: inputs are missing or unusable, so it cannot be verified."
        if self.holds:
            basis = "recomputed" if self.computed else "by its hashes; not recomputed"
            return f"VALID: {self.judgement.sentence}; none of its inputs has changed ({basis})."
        if not self.against:
            basis = "and the recomputation gives the same" if self.computed else "by their hashes; not recomputed"
            return f"NOT VALID: {self.judgement.sentence}. None of its inputs has changed ({basis})."
        if self.lines:
            return "NOT VALID: the recomputation gives other results."
        again = " The verdict lines are the same: stillhook validate issues a new certificate." if self.computed else ""
        return f"NOT VALID: its inputs have changed.{again}"

    def to_dict(self) -> dict[str, Any]:
        """The answer as plain data for JSON."""
        return {
            "certificate": self.certificate.digest,
            "passed": self.certificate.passed,
            "holds": self.holds,
            "verdict": self.verdict,
            "changed": list(self.changed),
            "missing": list(self.missing),
            "lines": list(self.lines),
            "computed": self.computed,
            "same_bytes": self.same_bytes,
            "same_pdf": self.same_pdf,
            "largest_difference": self.largest,
            "where": self.where,
            "signature": self.judgement.to_dict(),
        }


def check(
    path: str | Path,
    certificate: Certificate,
    *,
    campaign: str | Path | None = None,
    quick: bool = False,
    numbers: bool = False,
    trust: TrustList | None = None,
    progress: Callable[[float], None] | None = None,
) -> Check:
    """Whether the certificate in this file still holds.

    Parameters: path and content of the file; campaign: its file, where it is not one of `_near`; quick: hashes alone;
    numbers: neither figures nor PDF are made again; trust: keys that are trusted, by default the user's.
    """
    data, judgement = certificate.data, certificate.judged(users_trust() if trust is None else trust)
    file = Path(campaign) if campaign is not None else _near(Path(path), data)
    code = (*_annex(data, Path(path)), *_code(data["twin"]))
    if not file.is_file():
        hint = "State it with --campaign." if campaign is None else "Check the path."
        return Check(certificate, judgement, code, (f"campaign {quote(str(file))}: no such file. {hint}",))
    changed, missing = (*_files(data, file), *code), tuple(_missing(data, file))
    try:
        todo = load_campaign(file)
        changed = (*_files(data, file), *_inputs(data, todo), *code)
        if quick or missing:
            return Check(certificate, judgement, changed, missing)
        validation = validate(todo, progress=progress)
    except StillhookError as problem:
        return Check(certificate, judgement, changed, missing or (str(problem),))
    comparable = can_draw() and can_set() and not numbers
    figures = pictures(validation) if comparable else {}
    again = certificate_of(validation)
    if campaign is not None:
        again = _named(again, data["campaign"]["file"])
    if comparable and data["annex"] is not None:
        again, _ = with_its_annex(again, figures)
    again = again.with_signature(data.get(SIGNATURE))
    largest, where = max(_differences(data, again.data), default=(0.0, ""))
    same_pdf = _same_pdf(Path(path), again, figures) if comparable else None
    return Check(
        certificate,
        judgement,
        changed,
        (),
        (*_lines(data, again.data), *_envelope(data, again.data)),
        True,
        again.text() == certificate.text(),
        same_pdf,
        largest,
        where,
    )


def _annex(data: Mapping[str, Any], path: Path) -> Iterator[str]:
    """Whether the annex next to the certificate is another one than it names; it may be kept elsewhere."""
    named = data["annex"]
    if named is None:
        return
    file = path.parent / Path(str(named.get("file", ""))).name
    if file.is_file() and sha256_of(file) != named.get("sha256"):
        yield f"annex {file.name}: changed since; the certificate holds the hash of another one."


def _same_pdf(path: Path, again: Certificate, figures: Mapping[str, Figure]) -> bool | None:
    """Whether the PDF files next to the certificate come out as they are; None where there are none."""
    main, annex = path.with_suffix(".pdf"), path.parent / again.annex_name
    same = [main.read_bytes() == again.pdf()] if main.is_file() else []
    same += [annex.read_bytes() == again.annex(figures)] if annex.is_file() else []
    return all(same) if same else None


def _near(path: Path, data: Mapping[str, Any]) -> Path:
    """The campaign file of a certificate in its folder, a folder above or a sibling folder: the one of that hash, else
    the first. Errors: ValidateError where it is named by more than a name, which could lead to any file."""
    folder, name = path.resolve().parent, str(data["campaign"]["file"])
    if not plain_name(name):
        raise ValidateError(
            f"{path.name}: campaign {quote(name)}: not the name of a file. State the file with --campaign."
        )
    around = sorted(folder.parent.glob(f"*/{glob.escape(name)}"))
    existing = [p for p in (folder / name, folder.parent / name, *around) if p.is_file()]
    wrong = lambda why: ValidateError(f"{path.name}: campaign {quote(name)}: {why}")
    existing = [named_path(p.parent, p.name, wrong) for p in existing]
    same = (p for p in existing if sha256_of(p) == data["campaign"]["sha256"])
    return next(same, existing[0] if existing else folder / name)


def _named(certificate: Certificate, file: str) -> Certificate:
    """The certificate as if its campaign file had the name that the one that is checked says."""
    data = {**certificate.data, "campaign": {**certificate.data["campaign"], "file": file}}
    return Certificate({**data, "digest": digest_of(data)})


def _log(campaign: Path, log: Mapping[str, Any]) -> Path:
    """A log that the certificate names. Errors: ValidateError where it is not in the folder of the campaign."""
    name = str(log["file"])
    return named_path(campaign.parent, name, lambda why: ValidateError(f"log {quote(name)} of the certificate: {why}"))


def _missing(data: Mapping[str, Any], campaign: Path) -> Iterator[str]:
    """Logs that the certificate names and that are not there."""
    for log in data["campaign"]["logs"]:
        if not _log(campaign, log).is_file():
            yield (
                f'log {quote(log["file"])} of test "{log["test"]}": no such file in the folder of {campaign.name}.'
                " Restore it."
            )


def _files(data: Mapping[str, Any], campaign: Path) -> Iterator[str]:
    """Campaign file and logs that are there, and are other than they were."""
    if sha256_of(campaign) != data["campaign"]["sha256"]:
        yield f"campaign {campaign.name}: changed since."
    for log in data["campaign"]["logs"]:
        path = _log(campaign, log)
        if path.is_file() and sha256_of(path) != log["sha256"]:
            yield f'log {log["file"]} of test "{log["test"]}": changed since.'


def _inputs(data: Mapping[str, Any], campaign: Campaign) -> Iterator[str]:
    """Tests, criteria and crane that are other than they were."""
    before, after = [log["test"] for log in data["campaign"]["logs"]], [t.name for t in campaign.tests]
    yield from (f'test "{test}": not in the campaign any more.' for test in before if test not in after)
    yield from (f'test "{test}": new in the campaign.' for test in after if test not in before)
    if campaign.criteria.digest != data["criteria"]["digest"]:
        stored = f"{data['criteria']['name']} version {data['criteria']['version']}"
        yield f"criteria: {campaign.criteria.label} now, and not what {stored} was then."
    yield from _crane(data["crane"], campaign.crane)


def _crane(stored: Mapping[str, Any], crane: Crane) -> Iterator[str]:
    if crane_part(crane)["content"] == stored["content"]:
        return
    fields = list(differing(crane_from_toml(stored["toml"], "crane of the certificate"), crane))
    more = f"; and {len(fields) - MOST_SHOWN} more" if len(fields) > MOST_SHOWN else ""
    yield f"crane {crane.name}: changed since: {'; '.join(fields[:MOST_SHOWN])}{more}."


def differing(old: Crane, new: Crane) -> Iterator[str]:
    """Every number of a crane that is another one in the second: "control.K_p 0.16 1/m -> 0.2 1/m"."""
    a, b = ({i.path: i for i in items(crane)} for crane in (old, new))
    for path in {**a, **b}:
        if path in ("name", "title"):
            continue
        x, y = (_item_text(side.get(path)) for side in (a, b))
        if (a[path].value if path in a else None) != (b[path].value if path in b else None):
            yield f"{path} {x} -> {y}"


def _item_text(item: Any) -> str:
    if item is None:
        return "none"
    values = item.value if isinstance(item.value, tuple) else (item.value,)
    return " + ".join(show(v, item.quantity, 6) if item.quantity else str(v) for v in values)


def _code(stored: Mapping[str, Any]) -> Iterator[str]:
    """Code and libraries that are other than they were."""
    now = versions()
    libraries = [
        f"{n} {stored['libraries'].get(n)} -> {v}"
        for n, v in now["libraries"].items()
        if stored["libraries"].get(n) != v
    ]
    if now["version"] != stored["version"]:
        libraries.insert(0, f"Stillhook {stored['version']} -> {now['version']}")
    with_them = f" ({', '.join(libraries)})" if libraries else ""
    if now["code"] != stored["code"]:
        yield f"code of the twin: {stored['code']} -> {now['code']}{with_them}."
    if now["method"] != stored["method"]:
        yield f"code of the method: {stored['method']} -> {now['method']}{with_them}."


def _lines(stored: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Verdict lines that are other than they were."""
    before, after = ({line["key"]: line for line in part["lines"]} for part in (stored, now))
    for key in {**before, **after}:
        x, y = (side[key]["verdict"] if key in side else "none" for side in (before, after))
        if x != y:
            yield f"{key}: {x} -> {y}: {after[key]['message'] if key in after else before[key]['message']}"


def _envelope(stored: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Ranges of the envelope that differ by more than `ROUNDED`; where nothing is passed any more, the lines say so."""
    before, after = (part["envelope"] or {} for part in (stored, now))
    if not after:
        return
    for name in sorted({*before, *after}):
        x, y = (side.get(name) for side in (before, after))
        if name == "modes" or x is None or y is None:
            same = x == y
        else:
            same = all(math.isclose(a, b, rel_tol=ROUNDED, abs_tol=1e-9) for a, b in zip(x, y, strict=True))
        if not same:
            yield f"envelope, {name}: {_ends(x)} -> {_ends(y)}"


def _ends(ends: Any) -> str:
    return (
        "none"
        if ends is None
        else " to ".join(number(x, 6) for x in ends)
        if isinstance(ends[0], float | int)
        else ", ".join(ends)
    )


def _differences(a: Any, b: Any, where: str = "") -> Iterator[tuple[float, str]]:
    """Relative difference of every pair of numbers at one place, with the place."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        for key in a:
            if key in b:
                yield from _differences(a[key], b[key], f"{where}.{key}".lstrip("."))
    elif isinstance(a, list) and isinstance(b, list):
        for i, (x, y) in enumerate(zip(a, b, strict=False)):
            yield from _differences(x, y, f"{where}[{i}]")
    elif isinstance(a, float | int) and isinstance(b, float | int) and a != b:
        yield abs(a - b) / max(abs(a), abs(b)), where
