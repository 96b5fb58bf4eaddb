"""A certificate as a document, from its data.

A certificate in short, for a terminal: verdict, envelope, and lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.library import crane_from_toml, sheet
from stillhook.library.certificate import certified_of
from stillhook.report.document import (
    Bullets,
    Cell,
    Column,
    Document,
    Figure,
    Part,
    Section,
    Table,
    Text,
    Verdict,
    facts,
)
from stillhook.report.formatting import fmt, groups
from stillhook.spec.validity import SHORT, UNSIGNED
from stillhook.units import KINDS, number, show
from stillhook.validate.criteria import results
from stillhook.validate.criteria.criteria import INFORMATION
from stillhook.validate.criteria.results import SETTINGS, STEPS, Outcome, StepNumber
from stillhook.validate.report.document import JUDGED, caption, deciding, legend_says, step_passed
from stillhook.validate.report.texts import deciding_title

HEADING = {True: "Validation certificate", False: "Validation report"}
WORD = {o.value: o.value.upper() for o in Outcome}
SHOWN = results.Verdict.SHOWN.value
MARK = "SYNTHETIC: simulated logs, not measured on a crane"
NOT_PASSED = "NOT PASSED: this is no certificate"
LINE_HEAD = ("", "criterion", "found", "95 % interval", "limit", "verdict")
LOAD_CASES = (
    "Unbroken parts of the logs with one load in one mode. Wire out: least to most; tip: largest peak-to-peak over 30"
    " s, and mean period."
)
INSIDE = (
    "A run of the twin is inside when each of these is in its range; one outside is reported as such and is not"
    " covered. Between"
    " the tests the model interpolates."
)
NONE = (
    "The criteria are not shown to be met, so nothing is validated. This document reports the results and may not be"
    " used as a certificate."
)
HOLDS = (
    "It holds for the crane file of annex E and the code named above, as long as neither they nor the logs change: "
    "stillhook certificate check certificate.json recomputes and verifies it."
)
NO_HOLD = "When the twin or the tests have been corrected, validate again: stillhook validate campaign.toml."
PROCEDURE = (
    (
        "This document was set from its JSON file, whose digest is its number. The steps with their figures, the"
        " criteria, every number and the crane file are in its annex, whose hash is in the JSON file. The same logs,"
        " campaign, criteria, crane file and code give the same bytes of all files, on any day and in any folder."
    ),
    (
        "stillhook certificate show FILE prints a summary. stillhook certificate check FILE recomputes everything from"
        " the logs and reports what has changed; with --quick it compares the hashes alone."
    ),
    UNSIGNED,
)


ANNEX = (
    "Lines, steps with their figures, criteria, numbers and crane file behind the certificate of the same crane and"
    " date. The JSON file of the certificate holds the SHA-256 of this document; stillhook certificate check compares"
    " it. The number above is that of the contents without this annex."
)


def document(data: Mapping[str, Any]) -> Document:
    """The certificate: what a reader decides by. data of a certificate."""
    sections = [
        Section("Verdict, line by line", _lines(data)),
        Section("What this does not say", [Section(x["heading"], [Bullets(x["lines"])]) for x in data["limitations"]]),
        Section("Data", _data(data)),
        Section("Steps", [Table(("step", "", "verdict"), [_step_verdict(step) for step in data["steps"]])]),
        Section("How to check this document", [_checks(data), *map(Text, PROCEDURE)]),
    ]
    return Document(
        title=HEADING[data["passed"]],
        name=data["crane"]["name"],
        subtitle=data["crane"]["title"],
        purpose="digital twin of a heave-compensated crane winch",
        marks=_marks(data),
        watermark="SYNTHETIC" if data["synthetic"] else "",
        front=_front(data),
        sections=sections,
        signatures=("Reviewed by", "Place and date", "Signature"),
        number=groups(data["digest"], SHORT),
        date=data["date"],
        made_by=f"Stillhook {data['twin']['version']}",
    )


def annex(data: Mapping[str, Any], figures: Mapping[str, bytes]) -> Document:
    """The annex: what the verdict rests on, complete. data of a certificate without its annex; figures: PNG by stem, of
    `stillhook.validate.report.figures.pictures`."""
    sections = [
        Section("A: every line in full", _lines(data, full=True)),
        *(_step(step, data, figures) for step in data["steps"]),
        Section("B: notes from reading the logs", [Bullets(_reading_notes(data))]),
        Section("C: the criteria", _criteria(data)),
        Section("D: every number that was found", _measures(data)),
        Section("E: the crane file", [Text(_crane_note(data)), *_crane(data)]),
    ]
    title = f"Annex to the {HEADING[data['passed']].lower()}"
    return Document(
        title=title,
        name=data["crane"]["name"],
        subtitle=data["title"],
        purpose="digital twin of a heave-compensated crane winch",
        marks=_marks(data),
        watermark="SYNTHETIC" if data["synthetic"] else "",
        front=[Text(ANNEX)],
        sections=sections,
        number=groups(data["digest"], SHORT),
        date=data["date"],
        made_by=f"Stillhook {data['twin']['version']}",
    )


def _marks(data: Mapping[str, Any]) -> list[str]:
    marks = [] if data["passed"] else [NOT_PASSED]
    return [*marks, MARK] if data["synthetic"] else marks


def _step_verdict(step: Mapping[str, Any]) -> tuple[str, str, str]:
    return str(step["step"]), step["title"], step["verdict"]


def _front(data: Mapping[str, Any]) -> list[Part]:
    parts: list[Part] = [Verdict(WORD[data["outcome"]], data["passed"], [_verdict(data)])]
    parts += [*deciding_lines(data), facts(_facts(data))]
    if envelope := certified_of(data, "certificate").envelope:
        rows = list(envelope.says().items())
        parts.append(Section("Validated envelope", [Table((), rows, bold_columns=[1]), Text(INSIDE)]))
        parts.append(Section("Load cases compared", [_compared(data)]))
    else:
        unmet = [line["message"] for line in data["lines"] if line["failed"]]
        parts.append(Section("No validated envelope", [Text(NONE)]))
        parts.append(Section("What was not met", [Bullets(unmet)]))
    return [*parts, Text(HOLDS if data["passed"] else NO_HOLD)]


def deciding_lines(data: Mapping[str, Any]) -> list[Table]:
    """The lines that decide the verdict; none where no line counts."""
    failed = any(line["failed"] for line in data["lines"])
    rows = [(line["verdict"], line["key"], line["text"]) for line in data["decisive"]]
    return [deciding(deciding_title(failed), rows, failed)] if rows else []


def passed(line: Mapping[str, Any]) -> bool | None:
    """Whether a verdict line is shown, or blocks the certificate; None for any other."""
    return False if line["failed"] else True if line["verdict"] == SHOWN else None


def _verdict(data: Mapping[str, Any]) -> str:
    """The verdict in a sentence, without the word that stands above it."""
    text = str(data["verdict"]).removeprefix(f"{WORD[data['outcome']]}: ")
    return text[:1].upper() + text[1:]


def _facts(data: Mapping[str, Any]) -> list[list[str]]:
    twin, criteria, lengths = data["twin"], data["criteria"], [d["duration"] for d in data["data"]]
    kinds = [d["kind"] for d in data["data"]]
    tests = ", ".join(f"{kinds.count(k)} {k}" for k in dict.fromkeys(kinds))
    return [
        ["campaign", data["title"]],
        ["date", data["date"]],
        ["twin", twin["statement"]],
        ["computed by", f"Stillhook {twin['version']}, code {twin['code']}"],
        ["judged by", f"{criteria['name']} version {criteria['version']} (digest {criteria['digest'][:SHORT]})"],
        ["data", f"{len(lengths)} tests ({tests}), {sum(lengths):.0f} s in all"],
    ]


def _lines(data: Mapping[str, Any], *, full: bool = False) -> list[Part]:
    """Every line; full: each with what it rests on, otherwise only those that are judged and not shown."""
    weights, verdicts = ({line[name] for line in data["lines"]} for name in ("weight", "verdict"))
    parts: list[Part] = [Text(JUDGED), Bullets(legend_says(weights, verdicts)), Text(data["risks"])]
    for number_ in StepNumber:
        rows = [_line(line, full=full) for line in data["lines"] if line["step"] == number_]
        if rows:
            parts.append(Table(LINE_HEAD, rows, f"Step {int(number_)}: {STEPS[number_].meaning}"))
    return parts


def _line(line: Mapping[str, Any], *, full: bool) -> tuple[Cell, ...]:
    """A verdict line, see `LINE_HEAD`; in full below the criterion what it rests on, below the limit its source."""
    cells = line["cells"]
    noted = full or (line["judged"] and line["verdict"] != SHOWN)
    title = _noted(cells["title"], cells["data"] if noted else "")
    limit = _noted(cells["limit"], cells["source"] if full else "")
    return cells["key"], title, cells["value"], cells["interval"], limit, Verdict(cells["verdict"], passed(line))


def _noted(text: str, note: str) -> str:
    return f"{text}\n{note}" if note else text


def _data(data: Mapping[str, Any]) -> list[Part]:
    """The campaign, its logs with their hashes, and load cases."""
    hashes = [(log["test"], log["sha256"]) for log in data["campaign"]["logs"]]
    load_cases = Table(data["load_cases"]["header"], data["load_cases"]["rows"])
    return [
        facts(_campaign(data)),
        Table(("test", "kind", "log", "samples", "rate", "length"), _logs(data)),
        Table((), hashes, "SHA-256 of the logs", [Column.WORD, Column.CODE]),
        Section("Load cases", [Text(LOAD_CASES), load_cases]),
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


def _compared(data: Mapping[str, Any]) -> Table:
    """The load cases of the tests with heave compensation."""
    tests = {d["test"] for d in data["data"] if d["kind"] == "ahc"}
    return Table(data["load_cases"]["header"], [row for row in data["load_cases"]["rows"] if row[0] in tests])


def _reading_notes(data: Mapping[str, Any]) -> list[str]:
    """What reading the logs brought up and no step has said."""
    stated = {text for step in data["steps"] for text in step["statements"]}
    notes = [(d["test"], text) for d in data["data"] for text in d["statements"] if text not in stated]
    return [text if text.startswith("Test ") else f"Test {test}: {text}" for test, text in notes]


def _step(step: Mapping[str, Any], data: Mapping[str, Any], figures: Mapping[str, bytes]) -> Section:
    number_ = step["step"]
    failed = any(line["failed"] for line in data["lines"] if line["step"] == number_)
    parts: list[Part] = [
        Text(STEPS[StepNumber(number_)].question),
        Verdict(f"This step: {step['verdict']}.", step_passed(step["verdict"], failed)),
        *([Bullets(step["statements"])] if step["statements"] else []),
        *(Table(t["header"], t["rows"], t["title"]) for t in step["tables"]),
        *(Figure(png, caption(stem)) for stem, png in figures.items() if stem.startswith(f"step-{number_}-")),
    ]
    return Section(f"Step {number_}: {step['title']}", parts)


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


def _crane_note(data: Mapping[str, Any]) -> str:
    parts = ", ".join(f"{name} {hash_}" for name, hash_ in data["crane"]["content"].items())
    return (
        "The twin under test, every number with its kind and source; the JSON file holds it as a file to compute with."
        f" Hashes: {parts}."
    )


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
            ("annex", _annex(data)),
            ("code of the twin", twin["code"]),
            ("code of the method", twin["method"]),
            ("Stillhook, libraries", f"{twin['version']}; {libraries}"),
        ]
    )


def _annex(data: Mapping[str, Any]) -> str:
    """Name and hash of the annex."""
    made = data["annex"]
    return "none was set" if made is None else f"{made['file']}, SHA-256 {groups(made['sha256'])}"
