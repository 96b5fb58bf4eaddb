"""The texts of a certificate's pages, from its data: what `template/certificate.typ` sets."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stillhook.library import crane_from_toml, sheet
from stillhook.library.certificate import certified_of
from stillhook.spec.validity import SHORT, UNSIGNED
from stillhook.units import KINDS, number, show
from stillhook.validate.criteria.names import SETTINGS
from stillhook.validate.criteria.results import TITLES, Outcome, StepNumber
from stillhook.validate.report.document import JUDGED, caption
from stillhook.validate.report.texts import LONGEST_NUMBER, MEANING, SHOWS, deciding_title

HEADING = {True: "Validation certificate", False: "Validation report"}
WORD = {o.value: o.value.upper() for o in Outcome}
MARK = "SYNTHETIC: simulated logs, not measured on a crane"
INSIDE = (
    "A run of the twin is inside when each of these lies in its range; one outside is reported as such and is not"
    " covered. Between"
    " the tests the model interpolates."
)
NONE = (
    "The criteria are not shown to be met, so nothing is validated. This document reports the results and may not be"
    " used as a certificate."
)
HOLDS = (
    "It holds for the crane file of appendix D and the code named above, as long as neither they nor the logs change: "
    "stillhook certificate check certificate.json recomputes and verifies it."
)
NO_HOLD = "When the twin or the tests have been corrected, validate again: stillhook validate campaign.toml."
PROCEDURE = (
    (
        "This document was set from its JSON file, whose digest is its number. The same logs, campaign, criteria, crane"
        " file and code give the same bytes of both files, on any day and in any folder."
    ),
    (
        "stillhook certificate show FILE prints a summary. stillhook certificate check FILE recomputes everything from"
        " the logs and reports what has changed; with --quick it compares the hashes alone."
    ),
    UNSIGNED,
)


def sheet_of(data: Mapping[str, Any], figures: Sequence[str]) -> dict[str, Any]:
    """Every text of the document by its place in the template. data of a certificate; figures: stems of their files,
    "step-5-..."."""
    date, passed = datetime.date.fromisoformat(data["date"]), data["passed"]
    first = {
        "heading": HEADING[passed],
        "word": WORD[data["outcome"]],
        "passed": passed,
        "synthetic": data["synthetic"],
        "mark": MARK,
        "year": date.year,
        "month": date.month,
        "day": date.day,
        "date": data["date"],
        "number": in_fours(data["digest"][:SHORT]),
        "made_by": f"Stillhook {data['twin']['version']}",
        "crane_name": data["crane"]["name"],
        "crane_title": data["crane"]["title"],
        "verdict": _verdict(data),
        "facts": _facts(data),
        "envelope": _envelope(data),
        "envelope_note": INSIDE if passed else NONE,
        "unmet": [line["message"] for line in data["lines"] if line["failed"]],
        "decisive": data["decisive"],
        "risks": data["risks"],
        "decisive_title": deciding_title(any(line["failed"] for line in data["lines"])),
        "holds": HOLDS if passed else NO_HOLD,
    }
    middle = {
        "judged": JUDGED,
        "lines": list(_lines(data)),
        "meanings": _meanings(data),
        "limitations": data["limitations"],
        "campaign": _campaign(data),
        "logs": _logs(data),
        "hashes": _hashes(data),
        "load_cases": _joined_header(data["load_cases"]),
        "compared": _compared(data),
        "reading_notes": _reading_notes(data),
        "steps": [_step(step, data, figures) for step in data["steps"]],
    }
    behind = {
        "checks": _checks(data),
        "procedure": list(PROCEDURE),
        "criteria_facts": _criteria_facts(data),
        "criteria": _criteria(data),
        "settings": _settings(data),
        "measures": _measures(data),
        "crane_note": _crane_note(data),
        "crane": _crane(data),
    }
    return dict(_set({**first, **middle, **behind}))


def _set(x: Any) -> Any:
    """Texts as they are printed: plus or minus in one sign."""
    if isinstance(x, dict):
        return {k: _set(v) for k, v in x.items()}
    if isinstance(x, list):
        return [_set(v) for v in x]
    return x.replace("+-", "±") if isinstance(x, str) else x


def _verdict(data: Mapping[str, Any]) -> str:
    """The verdict in a sentence, without the word that stands above it."""
    text = str(data["verdict"]).removeprefix(f"{WORD[data['outcome']]}: ")
    return text[:1].upper() + text[1:]


def in_fours(text: str) -> str:
    """A hash as people read it aloud: in groups of four."""
    return " ".join(text[i : i + 4] for i in range(0, len(text), 4))


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


def _envelope(data: Mapping[str, Any]) -> list[list[str]]:
    envelope = certified_of(data, "certificate").envelope
    return [[name, text] for name, text in envelope.says().items()] if envelope is not None else []


def _lines(data: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for number_ in StepNumber:
        lines = [line for line in data["lines"] if line["step"] == number_]
        if lines:
            rows = [{**line["cells"], "behind": line["cells"]["data"], "failed": line["failed"]} for line in lines]
            yield {"title": f"Step {int(number_)}: {TITLES[number_]}", "rows": rows}


def _meanings(data: Mapping[str, Any]) -> list[list[str]]:
    used = {line["verdict"] for line in data["lines"]}
    return [[v.value, text] for v, text in MEANING.items() if v.value in used]


def _campaign(data: Mapping[str, Any]) -> list[list[str]]:
    campaign = data["campaign"]
    rows = [
        ["campaign file", campaign["file"].rpartition("/")[2]],
        ["SHA-256", in_fours(campaign["sha256"])],
        ["delay of the tip signal, stated", show(campaign["delay"], "time")],
    ]
    return rows + [["remark", text] for text in campaign["remarks"]]


def _logs(data: Mapping[str, Any]) -> list[list[str]]:
    return [
        [d["test"], d["kind"], d["file"], str(d["samples"]), f"{number(d['rate'], 4)} /s", f"{d['duration']:.1f} s"]
        for d in data["data"]
    ]


def _hashes(data: Mapping[str, Any]) -> list[list[str]]:
    return [[log["test"], log["sha256"]] for log in data["campaign"]["logs"]]


def _joined_header(table: Mapping[str, Any]) -> dict[str, Any]:
    return {"header": [h.replace("-\n", "").replace("\n", " ") for h in table["header"]], "rows": table["rows"]}


def _compared(data: Mapping[str, Any]) -> dict[str, Any]:
    """The load cases of the tests with heave compensation."""
    table = _joined_header(data["load_cases"])
    tests = {d["test"] for d in data["data"] if d["kind"] == "ahc"}
    return {**table, "rows": [row for row in table["rows"] if row[0] in tests]}


def _reading_notes(data: Mapping[str, Any]) -> list[str]:
    """What reading the logs brought up and no step has said."""
    stated = {text for step in data["steps"] for text in step["statements"]}
    notes = [(d["test"], text) for d in data["data"] for text in d["statements"] if text not in stated]
    return [text if text.startswith("Test ") else f"Test {test}: {text}" for test, text in notes]


def _step(step: Mapping[str, Any], data: Mapping[str, Any], figures: Sequence[str]) -> dict[str, Any]:
    names = [name for name in figures if name.startswith(f"step-{step['step']}-")]
    return {
        "number": step["step"],
        "title": step["title"],
        "shows": SHOWS[StepNumber(step["step"])],
        "verdict": f"This step: {step['verdict']}.",
        "statements": step["statements"],
        "failed": any(line["failed"] for line in data["lines"] if line["step"] == step["step"]),
        "tables": [_joined_header(t) | {"title": t["title"], "columns": _columns(t)} for t in step["tables"]],
        "figures": [{"file": f"{name}.png", "caption": caption(name)} for name in names],
    }


def _columns(table: Mapping[str, Any]) -> list[str]:
    """Which columns hold words, and take what room there is."""
    longest = [max([0, *(len(row[i]) for row in table["rows"])]) for i in range(len(table["header"]))]
    return ["words" if n > LONGEST_NUMBER else "number" for n in longest]


def _measures(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    taken = [step for step in data["steps"] if step["measures"]]
    return [{"number": s["step"], "title": s["title"], "rows": [_measure(m) for m in s["measures"]]} for s in taken]


def _measure(m: Mapping[str, Any]) -> list[str]:
    return [
        m["text"]["meaning"],
        m["test"],
        m["text"]["value"],
        m["text"]["interval"],
        "; ".join(t for t in (m["data"], m["note"]) if t),
    ]


def _criteria_facts(data: Mapping[str, Any]) -> list[list[str]]:
    c = data["criteria"]
    changed = [["changed", text] for text in c["changes"]]
    return [
        ["set", f"{c['name']} version {c['version']}"],
        ["source", c["source"]],
        ["digest", in_fours(c["digest"])],
        *changed,
    ]


def _criteria(data: Mapping[str, Any]) -> list[list[str]]:
    rows = []
    for c in data["criteria"]["criteria"]:
        limit = f"{c['kind']} {'±' if c['kind'] == 'within' else ''}{c['written']}"
        counts = (c["ask"] if c["needed"] else f"{c['ask']}, if there are data") if c["judged"] else "for information"
        rows.append([c["key"], c["title"], limit, counts, "; ".join(t for t in (c["source"], c["reason"]) if t)])
    return rows


def _settings(data: Mapping[str, Any]) -> list[list[str]]:
    rows = []
    for name, value in data["criteria"]["settings"].items():
        known = SETTINGS[name]
        rows.append([known.meaning, show(value, known.quantity) if known.quantity in KINDS else number(value)])
    return rows


def _crane_note(data: Mapping[str, Any]) -> str:
    parts = ", ".join(f"{name} {hash_}" for name, hash_ in data["crane"]["content"].items())
    return (
        "The twin under test, every number with its kind and source; the JSON file holds it as a file to compute with."
        f" Hashes: {parts}."
    )


def _crane(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    crane = crane_from_toml(data["crane"]["toml"], "crane of the certificate")
    out = []
    for section in sheet(crane):
        rows = [[r.field.removeprefix(f"{section.title}."), r.value, r.meaning, r.kind, r.source] for r in section.rows]
        out.append({"title": section.title, "rows": rows})
    return out


def _checks(data: Mapping[str, Any]) -> list[list[str]]:
    twin = data["twin"]
    libraries = ", ".join(f"{name} {v}" for name, v in twin["libraries"].items())
    return [
        ["number", in_fours(data["digest"])],
        ["code of the twin", twin["code"]],
        ["code of the method", twin["method"]],
        ["Stillhook, libraries", f"{twin['version']}; {libraries}"],
    ]
