"""The report of a validation: as a document, in short for a terminal, and as data in SI; and the parts that it has in
common with the certificate, made of the plain data of `stillhook.validate.report.view`."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.logs.campaign import MARK
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
from stillhook.spec.sub_models import levels_text
from stillhook.spec.validity import SHORT, Envelope
from stillhook.trust.standing import Judgement
from stillhook.validate.criteria import results
from stillhook.validate.criteria.results import STEPS, Outcome, StepNumber
from stillhook.validate.report.view import (
    UNDETECTABLE,
    UNJUDGED,
    WORDS,
    decisive,
    risks,
    segments,
    sentence,
    title,
    unjudged,
    view_of,
)
from stillhook.validate.validation import Validation

if TYPE_CHECKING:
    import pandas

SHOWN = results.Verdict.SHOWN.value
LINE_HEAD = ("", "criterion", "found", "95 % interval", "limit", "verdict")
TERSE_HEAD = ("", "found", "95 %", "limit", "kind", "verdict")
TERSE_COLUMNS = (Column.TEXT, Column.NUMBER, Column.NUMBER, Column.NUMBER, Column.TEXT, Column.TEXT)
COUNTED = {"shown": "shown", "not shown": "not\nshown", "not covered": "not\ncovered", "refuted": "refuted"}
"""Verdicts that the table of the steps counts, and its heads."""

View = Mapping[str, Any]


def report(validation: Validation, figures: Mapping[str, Figure]) -> Document:
    """The report. figures: by stem, see `stillhook.validate.report.figures.figures`."""
    view, words = view_of(validation), WORDS["report"]
    limitations = [Section(x["heading"], [Bullets(x["lines"])]) for x in view["limitations"]]
    return Document(
        title=f"Validation of {title(validation.campaign)}: {view['crane']['name']}",
        marks=[words["synthetic"]] if view["synthetic"] else [],
        front=[*verdict(view, complete=validation.complete), facts(about(view))],
        sections=[
            Section("Load cases", [Text(words["load_cases"]), *_load_cases(view), *_covered(validation, view)]),
            Section("Steps", [_step_table(view)]),
            Section("Verdict, line by line", line_tables(view, full=True)),
            *(step_section(step, view, figures) for step in view["steps"]),
            Section("What this does not say", limitations),
            Section("How the verdict is reached", [Text(words["method"])]),
        ],
        date=view["date"],
    )


def verdict(view: View, *, complete: bool = True) -> list[Part]:
    """The sentence, the lines that decide it, and the risks."""
    passed = False if not view["passed"] else True if complete else None
    return [Verdict(view["verdict"], passed), *deciding(view), Text(view["risks"])]


def deciding(view: View) -> list[Part]:
    """The lines that decide a verdict, with the value against its limit; none where no line counts."""
    failed = any(line["failed"] for line in view["lines"])
    rows = [
        (Verdict(x["verdict"], False if failed else True if x["verdict"] == SHOWN else None), x["key"], x["text"])
        for x in view["decisive"]
    ]
    heading = "Blocking, highest utilisation of the limit first" if failed else "Closest to their limits"
    return [facts(rows, heading)] if rows else []


def about(view: View) -> list[list[str]]:
    """Campaign, date, criteria and data."""
    criteria, lengths, kinds = view["criteria"], *zip(*((d["duration"], d["kind"]) for d in view["data"]), strict=True)
    tests = ", ".join(f"{kinds.count(k)} {k}" for k in dict.fromkeys(kinds))
    return [
        ["crane", f"{view['crane']['name']}: {view['crane']['title']}"],
        ["campaign", view["title"]],
        ["date", view["date"]],
        ["judged by", f"{criteria['name']} version {criteria['version']} (digest {criteria['digest'][:SHORT]})"],
        ["data", f"{len(lengths)} tests ({tests}), {sum(lengths):.0f} s in all"],
        *(["changed", text] for text in criteria["changes"]),
    ]


def _covered(validation: Validation, view: View) -> list[Part]:
    """What the tests cover: the ranges stated in a certificate."""
    if view["envelope"] is None or not validation.complete:
        return []
    envelope = Envelope.model_construct(None, **{name: tuple(ends) for name, ends in view["envelope"].items()})
    return [Text(WORDS["report"]["covered"]), facts(list(envelope.says().items()))]


def _step_table(view: View) -> Table:
    """Results of the criteria of every step."""
    counts = {step: Counter(x["verdict"] for x in view["lines"] if x["step"] == step) for step in StepNumber}
    rows = [
        (str(s["step"]), s["title"], *(str(counts[s["step"]][v] or "") for v in COUNTED), s["verdict"])
        for s in view["steps"]
    ]
    return Table(("step", "", *COUNTED.values(), "verdict"), rows)


def line_tables(view: View, *, full: bool = False) -> list[Part]:
    """Every line by step; full: each with what it rests on, otherwise only those that are judged and not shown."""
    parts: list[Part] = [Text(WORDS["report"]["judged"]), Bullets(legend(view)), Text(view["risks"])]
    for number in StepNumber:
        rows = [_line(line, full=full) for line in view["lines"] if line["step"] == number]
        if rows:
            parts.append(Table(LINE_HEAD, rows, f"Step {int(number)}: {STEPS[number].meaning}"))
    return parts


def legend(view: View) -> list[str]:
    """A sentence for each kind of line, and for each verdict, among the lines."""
    return [
        f"{word}: {text}."
        for table, name in (("weights", "weight"), ("verdicts", "verdict"))
        for word, text in WORDS[table].items()
        if any(line[name] == word for line in view["lines"])
    ]


def line_verdict(line: View) -> Verdict:
    """The verdict of a line as a cell: passed where it is shown, failed where it blocks the certificate."""
    return Verdict(line["cells"]["verdict"], False if line["failed"] else True if line["verdict"] == SHOWN else None)


def _line(line: View, *, full: bool) -> tuple[Cell, ...]:
    """A verdict line, see `LINE_HEAD`; in full below the criterion what it rests on, below the limit its source."""
    cells = line["cells"]
    noted = full or (line["judged"] and line["verdict"] != SHOWN)
    title_ = "\n".join(filter(None, (cells["title"], cells["data"] if noted else "")))
    limit = "\n".join(filter(None, (cells["limit"], cells["source"] if full else "")))
    return cells["key"], title_, cells["value"], cells["interval"], limit, line_verdict(line)


def step_section(step: View, view: View, figures: Mapping[str, Figure]) -> Section:
    """A step: its question, verdict, statements, tables and figures."""
    number, outcome = step["step"], step["verdict"]
    failed = any(line["failed"] for line in view["lines"] if line["step"] == number)
    parts: list[Part] = [
        Text(STEPS[StepNumber(number)].question),
        Verdict(f"Step {number} alone: {outcome}.", False if failed else True if outcome == Outcome.PASSED else None),
        *([Bullets(step["statements"])] if step["statements"] else []),
        *(Table(t["header"], t["rows"], t["title"]) for t in step["tables"]),
        *(figure for stem, figure in figures.items() if stem.startswith(f"step-{number}-")),
    ]
    return Section(f"Step {number}: {step['title']}", parts)


def _load_cases(view: View) -> list[Part]:
    notes = reading_notes(view)
    return [Table(**view["load_cases"]), *([Bullets(notes)] if notes else [])]


def reading_notes(view: View) -> list[str]:
    """What reading the logs brought up, each with its test, and no step has said."""
    stated = {text for step in view["steps"] for text in step["statements"]}
    notes = [(f'Test "{d["test"]}"', text) for d in view["data"] for text in d["statements"] if text not in stated]
    return [text if text.startswith(test) else f"{test}: {text}" for test, text in notes]


def summary(validation: Validation, *, tables: bool = False, everything: bool = False) -> Document:
    """everything: also what agrees, in full; tables: those of the steps."""
    view = view_of(validation)
    sections = [
        Section("load cases", _load_cases(view)),
        Section("steps", _steps(view, tables=tables, everything=everything)),
        Section("lines", terse_lines(view, everything=everything)),
    ]
    reasons: dict[str, list[str]] = {}
    for line in view["lines"]:
        if line["verdict"] == results.Verdict.NOT_JUDGED:
            reasons.setdefault(line["measure"]["note"], []).append(line["key"])
    if reasons:
        sections.append(Section("not judged", [Bullets([f"{', '.join(k)}: {why}." for why, k in reasons.items()])]))
    for x in view["limitations"]:
        if x["heading"] == UNDETECTABLE:
            sections.append(Section(x["heading"].lower(), [Bullets(x["lines"])]))
        if x["heading"] == UNJUDGED:
            text = f"{'; '.join(x['lines'])}. {WORDS['certificate']['unjudged']}"
            sections.append(Section(x["heading"], [Text(text)]))
    heading = f"{title(validation.campaign)}: {view['crane']['name']}"
    return Document(heading, sections, verdict(view, complete=validation.complete))


def _steps(view: View, *, tables: bool, everything: bool) -> list[Part]:
    """Result of each step; its statements where lines of it block, or everything is requested."""
    parts: list[Part] = [_step_table(view)]
    for step in view["steps"]:
        if everything or any(line["failed"] for line in view["lines"] if line["step"] == step["step"]):
            of_step = [Table(t["header"], t["rows"], t["title"]) for t in step["tables"]] if tables else []
            heading = f"step {step['step']}, {step['title']}: {step['verdict']}"
            parts.append(Section(heading, [Bullets(step["statements"]), *of_step]))
    return parts


def terse_lines(view: View, *, everything: bool = False) -> list[Part]:
    """Every line in a table without the text of its criterion; in full only those that are not shown, or all."""
    lines = view["lines"]
    parts: list[Part] = [Table(TERSE_HEAD, [_terse(line) for line in lines], columns=TERSE_COLUMNS)]
    full = [line for line in lines if everything or (line["judged"] and line["verdict"] != SHOWN)]
    if full:
        rows = [(line_verdict(line), line["key"], f"{line['message']} [{line['source']}]") for line in full]
        parts.append(facts(rows, "in full"))
    return [*parts, Bullets(legend(view))]


def _terse(line: View) -> tuple[Cell, ...]:
    cells = line["cells"]
    unit = cells["value"].partition(" ")[2]
    bare = cells["interval"].removesuffix(f" {unit}") if unit else cells["interval"]
    shown = Verdict("-") if line["verdict"] == results.Verdict.INFO else line_verdict(line)
    return cells["key"], cells["value"], bare, line["limit"], line["weight"], shown


def certificate_summary(data: View, number: str, envelope: Envelope | None, judgement: Judgement) -> Document:
    """A certificate in short, for a terminal, from its data; number: its digest; judgement: of its signature."""
    mark = f"{MARK} " if data["synthetic"] and MARK not in data["title"] else ""
    twin, ranges = data["twin"], envelope.says().items() if envelope is not None else ()
    rows = [
        ["certificate", number],
        *about(data),
        ["twin", twin["statement"]],
        ["its sub-models", levels_text(twin.get("sub_models", {}))],
        ["computed by", f"Stillhook {twin['version']}, code {twin['code']}, method {twin['method']}"],
        *([f"validated: {name}", text] for name, text in ranges),
    ]
    (answer, *why), (how, step) = verdict(data), judgement.lines
    front = [answer, Text(how), *why, facts(rows), Text(step)]
    return Document(f"{mark}{data['title']}", [Section("lines", terse_lines(data))], front)


def to_dict(validation: Validation) -> dict[str, Any]:
    """All results in SI as plain data for JSON; names as in the nomenclature."""
    campaign = validation.campaign
    return {
        "title": campaign.title,
        "date": campaign.date.isoformat(),
        "synthetic": campaign.synthetic,
        "crane": campaign.crane.name,
        "criteria": campaign.criteria.to_dict(),
        "passed": validation.passed,
        "outcome": validation.outcome.value,
        "complete": validation.complete,
        "verdict": sentence(validation),
        "decisive": [line.key for line in decisive(validation)],
        "risks": risks(validation.lines),
        "lines": [line.to_dict() for line in validation.lines],
        "segments": [dataclasses.asdict(s) | {"mode": s.mode.value} for s in segments(validation)],
        "unjudged": {name: list(tests) for name, tests in unjudged(validation).items()} if validation.complete else {},
        "steps": [step.to_dict() for step in validation.steps],
        "tests": [
            {"name": r.test.name, "log": r.test.log.name, "statements": list(r.statements)} for r in validation.records
        ],
    }


def segments_table(validation: Validation) -> pandas.DataFrame:
    """Every load case in display units, units in the headings."""
    import pandas as pd

    names = {"start": "s", "duration": "s", "load": "t", "s_w_min": "m", "s_w_max": "m", "s_tip_pp": "m", "period": "s"}
    rows: Sequence[Any] = segments(validation)
    columns: dict[str, list[Any]] = {"test": [s.test for s in rows]}
    for name, unit in names.items():
        columns[f"{name} [{unit}]"] = [getattr(s, name) / (1e3 if unit == "t" else 1.0) for s in rows]
    return pd.DataFrame(columns | {"mode": [s.mode.value for s in rows]})


def deviations_table(validation: Validation) -> pandas.DataFrame | None:
    """Every window of step 5; None where there is none. Source: Moslatt 2020 paper F, figures 11 to 13."""
    import pandas as pd

    result = (s.estimates for s in validation.steps if s.number is StepNumber.AHC)
    parts = [c.windows for estimates in result if estimates is not None for c in estimates.comparisons]
    if not parts:
        return None
    columns = {
        "end of window [s]": "ends",
        "s_tip_pp [m]": "s_tip_pp",
        "e_c_pp_measured [m]": "measured",
        "e_c_pp_simulated [m]": "simulated",
        "deviation [m]": "x",
        "eta_c_measured": "eta_measured",
        "eta_c_simulated": "eta_simulated",
    }
    joined = {head: np.concatenate([getattr(w, name) for w in parts]) for head, name in columns.items()}
    return pd.DataFrame({"test": [w.test for w in parts for _ in w.ends]} | joined).round(6)
