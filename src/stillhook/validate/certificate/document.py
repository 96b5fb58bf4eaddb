"""A certificate and its annex as documents, from its data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stillhook.base.kept.sealed import SIGNATURE
from stillhook.library import crane_from_toml, sheet
from stillhook.library.certificate import certified_of
from stillhook.report.document import Bullets, Column, Document, Figure, Part, Section, Table, Text, Verdict, facts
from stillhook.report.formatting import fmt, groups
from stillhook.spec.sub_models import levels_text
from stillhook.spec.validity import SHORT
from stillhook.trust.signature import signature_of
from stillhook.trust.standing import MEANING
from stillhook.units import KINDS, number, show
from stillhook.validate.certificate.utilisation import utilisation
from stillhook.validate.criteria.criteria import INFORMATION
from stillhook.validate.criteria.results import SETTINGS, Outcome
from stillhook.validate.report.document import View, about, deciding, line_tables, step_section
from stillhook.validate.report.view import WORDS as ALL_WORDS

HEADING = {True: "Validation certificate", False: "Validation report"}
WORD = {o.value: o.value.upper() for o in Outcome}
WORDS = ALL_WORDS["certificate"]


def document(data: View) -> Document:
    """The certificate: what a reader decides by. data of a certificate."""
    steps = [(str(step["step"]), step["title"], step["verdict"]) for step in data["steps"]]
    sections = [
        Section("Verdict, line by line", line_tables(data)),
        Section("What this does not say", [Section(x["heading"], [Bullets(x["lines"])]) for x in data["limitations"]]),
        Section("Data", _data(data, MOST)),
        Section("Steps", [Table(("step", "", "verdict"), steps)]),
        Section("How to check this document", [_checks(data), *map(Text, (*WORDS["procedure"], MEANING))]),
    ]
    signatures = ("Reviewed by", "Place and date", "Signature")
    return _document(data, HEADING[data["passed"]], data["crane"]["title"], _front(data), sections, signatures)


def annex(data: View, figures: Mapping[str, Figure]) -> Document:
    """The annex: what the verdict rests on, complete. data: of a certificate without its annex; figures: by stem."""
    parts = ", ".join(f"{name} {hash_}" for name, hash_ in data["crane"]["content"].items())
    sections = [
        Section("A: every line in full", line_tables(data, full=True)),
        *(step_section(step, data, figures) for step in data["steps"]),
        Section("B: the criteria", _criteria(data)),
        Section("C: every number that was found", _measures(data)),
        Section("D: the crane file", [Text(f"{WORDS['crane']} Hashes: {parts}."), *_crane(data)]),
        *([Section("E: the data", _data(data))] if _long(data) else []),
    ]
    heading = f"Annex to the {HEADING[data['passed']].lower()}"
    return _document(data, heading, data["title"], [Text(WORDS["annex"])], sections)


def _document(
    data: View,
    heading: str,
    subtitle: str,
    front: Sequence[Part],
    sections: Sequence[Section],
    signatures: Sequence[str] = (),
) -> Document:
    marks = [] if data["passed"] else [WORDS["not_passed"]]
    return Document(
        title=heading,
        name=data["crane"]["name"],
        subtitle=subtitle,
        purpose="digital twin of a heave-compensated crane winch",
        marks=[*marks, WORDS["mark"]] if data["synthetic"] else marks,
        watermark="SYNTHETIC" if data["synthetic"] else "",
        front=front,
        sections=sections,
        signatures=signatures,
        number=groups(data["digest"], SHORT),
        date=data["date"],
        made_by=f"Stillhook {data['twin']['version']}",
    )


def _front(data: View) -> list[Part]:
    sentence = str(data["verdict"]).removeprefix(f"{WORD[data['outcome']]}: ")  # the word stands above it
    sentence, twin = sentence[:1].upper() + sentence[1:], data["twin"]
    about_twin = [
        ["twin", twin["statement"]],
        ["its sub-models", levels_text(twin.get("sub_models", {}))],
        ["computed by", f"Stillhook {twin['version']}, code {twin['code']}"],
        ["signed by", _signer(data)],
    ]
    parts: list[Part] = [Verdict(WORD[data["outcome"]], data["passed"], [sentence])]
    parts += [*deciding(data), facts([*about(data)[1:], *about_twin])]
    if envelope := certified_of(data, "certificate").envelope:
        rows = list(envelope.says().items())
        parts.append(Section("Validated envelope", [Table((), rows, bold_columns=[1]), Text(WORDS["inside"])]))
        parts.append(Section("Load cases compared", _compared(data)))
    else:
        unmet = [line["message"] for line in data["lines"] if line["failed"]]
        parts.append(Section("No validated envelope", [Text(WORDS["none"])]))
        parts.append(Section("What was not met", [Bullets(unmet)]))
    return [*parts, Text(WORDS["holds" if data["passed"] else "no_hold"]), *utilisation(data)]


MOST, FIRST = 20, 8
"""Rows of a table of the data in the certificate, and of the one on its first page, at most; the annex has all."""


def _long(data: View) -> bool:
    """Whether the certificate has not all rows of the data."""
    return max(len(data["load_cases"]["rows"]), len(data["campaign"]["logs"])) > MOST


def _data(data: View, most: int | None = None) -> list[Part]:
    """The campaign, its logs with their hashes, and load cases; most: rows of each table at most."""
    hashes = [(log["test"], log["sha256"]) for log in data["campaign"]["logs"]]
    load_cases = Table(data["load_cases"]["header"], data["load_cases"]["rows"][:most])
    logs, cases = len(hashes), len(data["load_cases"]["rows"])
    parts = [f"{most} of {n} {what}" for n, what in ((logs, "logs"), (cases, "load cases")) if most and n > most]
    return [
        facts(_campaign(data)),
        *([Text(f"The first {' and '.join(parts)}; annex E has all of them.")] if parts else []),
        Table(("test", "kind", "log", "samples", "rate", "length"), _logs(data)[:most]),
        Table((), hashes[:most], "SHA-256 of the logs", [Column.WORD, Column.CODE]),
        Section("Load cases", [Text(ALL_WORDS["report"]["load_cases"]), load_cases]),
    ]


def _campaign(data: Mapping[str, Any]) -> list[list[str]]:
    campaign = data["campaign"]
    rows = [
        ["campaign file", campaign["file"].rpartition("/")[2]],
        ["SHA-256", groups(campaign["sha256"])],
        ["delay of the tip signal, stated", show(campaign["delay"], "time")],
    ]
    return rows + [["remark", text] for text in campaign["remarks"]]


def _logs(data: Mapping[str, Any]) -> list[list[str]]:
    return [
        [d["test"], d["kind"], d["file"], str(d["samples"]), f"{number(d['rate'], 4)} /s", f"{d['duration']:.1f} s"]
        for d in data["data"]
    ]


def _compared(data: Mapping[str, Any]) -> list[Part]:
    """The load cases of the tests with heave compensation, the first of many."""
    tests = {d["test"] for d in data["data"] if d["kind"] == "ahc"}
    rows = [row for row in data["load_cases"]["rows"] if row[0] in tests]
    where = "annex E" if _long(data) else "the section of the data"
    more = [Text(f"{FIRST} of {len(rows)} load cases; {where} has all of them.")] if len(rows) > FIRST else []
    return [Table(data["load_cases"]["header"], rows[:FIRST]), *more]


def _measures(data: Mapping[str, Any]) -> list[Table]:
    header = ("number", "of", "found", "95 % interval", "rests on")
    return [
        Table(header, [_measure(m) for m in step["measures"]], f"Step {step['step']}: {step['title']}")
        for step in data["steps"]
        if step["measures"]
    ]


def _measure(m: Mapping[str, Any]) -> list[str]:
    return [
        m["text"]["meaning"],
        m["test"],
        m["text"]["value"],
        m["text"]["interval"],
        "; ".join(t for t in (m["data"], m["note"]) if t),
    ]


def _criteria(data: Mapping[str, Any]) -> list[Table]:
    """The set of criteria, each of them, and their settings."""
    criteria = data["criteria"]
    about = [
        ("set", f"{criteria['name']} version {criteria['version']}"),
        ("source", criteria["source"]),
        ("digest", groups(criteria["digest"])),
        *(("changed", text) for text in criteria["changes"]),
    ]
    rows = [_criterion(c) for c in criteria["criteria"]]
    settings = [(SETTINGS[name].meaning, _setting(name, value)) for name, value in criteria["settings"].items()]
    tables = [facts(about), Table(("", "criterion", "limit", "kind", "source and reason"), rows)]
    return [*tables, facts(settings, "Settings")] if settings else tables


def _criterion(c: Mapping[str, Any]) -> tuple[str, ...]:
    limit = f"{c['kind']} {'±' if c['kind'] == 'within' else ''}{c['written']}"
    weight = c["ask"] if c["judged"] else INFORMATION
    counts = weight if c["needed"] or not c["judged"] else f"{weight}, if there are data"
    return c["key"], c["title"], limit, counts, "; ".join(t for t in (c["source"], c["reason"]) if t)


def _setting(name: str, value: float) -> str:
    quantity = SETTINGS[name].quantity
    return fmt(value, quantity if quantity in KINDS else "")


def _crane(data: Mapping[str, Any]) -> list[Table]:
    crane = crane_from_toml(data["crane"]["toml"], "crane of the certificate")
    header = ("field", "value", "meaning", "kind", "source")
    return [
        Table(
            header,
            [(r.field.removeprefix(f"{section.title}."), r.value, r.meaning, r.kind, r.source) for r in section.rows],
            section.title,
        )
        for section in sheet(crane)
    ]


def _checks(data: Mapping[str, Any]) -> Table:
    twin = data["twin"]
    libraries = ", ".join(f"{name} {v}" for name, v in twin["libraries"].items())
    return facts(
        [
            ("number", groups(data["digest"])),
            ("signed by", _signer(data)),
            ("annex", _annex(data)),
            ("code of the twin", twin["code"]),
            ("code of the method", twin["method"]),
            ("Stillhook, libraries", f"{twin['version']}; {libraries}"),
        ]
    )


def _signer(data: Mapping[str, Any]) -> str:
    """Who signed, and by which key; whether that key is trusted is for each reader to say."""
    signature = signature_of(data.get(SIGNATURE))
    return "no one (unsigned)" if signature is None else f"{signature.name}, key id {groups(signature.key.id)}"


def _annex(data: Mapping[str, Any]) -> str:
    """Name and hash of the annex."""
    made = data["annex"]
    return "none was set" if made is None else f"{made['file']}, SHA-256 {groups(made['sha256'])}"
