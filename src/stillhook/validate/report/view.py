"""A validation as plain data that documents are made of: words next to numbers in SI, without clock, folders of the
machine and hashes of files. A certificate adds those of its inputs (`stillhook.validate.certificate`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from stillhook.report.formatting import fmt
from stillhook.spec.crane import Crane
from stillhook.units import number
from stillhook.validate.criteria.criteria import DetectionLimits, detection_limits
from stillhook.validate.criteria.results import MEASURES, CriterionResult, Measure, Outcome, Step, Verdict
from stillhook.validate.data_set.record import Record, Segment
from stillhook.validate.report.coverage import envelope_of, unjudged, unjudged_says
from stillhook.validate.report.texts import (
    WORDS,
    decisive,
    decisive_text,
    line_cells,
    risks,
    sentence,
    step_verdict,
    without_meaning,
)
from stillhook.validate.validation import Validation
from stillhook.winches.types import active_passive

SEGMENT_HEAD = ("test", "from\n[s]", "for\n[s]", "load\n[t]", "wire out\n[m]", "tip p-p\n[m]", "period\n[s]", "mode")
UNDETECTABLE = "Not detectable with these data"
UNJUDGED = "Logged, not judged"
ROUNDING = 1e-9
OF_ORDINARY_SIZE = ("", "time", "length", "speed", "pressure", "force", "mass", "torque", "rotation")
"""Below ROUNDING [SI], a number of these quantities is what rounding leaves of zero, which no two machines do alike."""

TRIED = active_passive.NAME
"""Winch type of the trials with known defects."""


def view_of(validation: Validation) -> dict[str, Any]:
    """What a validation came to. A complete one in which no part of the logs with heave compensation could be compared,
    or of whose criteria none counts, certifies nothing, even where all of them are met."""
    campaign, outcome, verdict = validation.campaign, validation.outcome, sentence(validation)
    envelope = envelope_of(validation.records, campaign.criteria.settings["window"])
    if validation.complete and outcome is Outcome.NOT_JUDGED:
        none = f"no criterion of {campaign.criteria.label} counts on these data, so that nothing was shown."
        verdict = f"NOT ASSESSED: {none}"
    elif validation.complete and outcome is Outcome.PASSED and envelope is None:
        none = "no part of the logs with heave compensation could be compared, so the twin is not validated."
        outcome, verdict = Outcome.NOT_SHOWN, f"NOT SHOWN: {none}"
    passed = outcome is Outcome.PASSED
    return {
        "title": campaign.title,
        "date": campaign.date.isoformat(),
        "synthetic": campaign.synthetic,
        "crane": {"name": campaign.crane.name, "title": campaign.crane.title},
        "passed": passed,
        "outcome": outcome.value,
        "verdict": verdict,
        "decisive": [
            {"verdict": line_cells(validation, x).verdict, "key": x.key, "text": decisive_text(validation, x)}
            for x in decisive(validation)
        ],
        "risks": risks(validation.lines),
        "criteria": plain(campaign.criteria.to_dict()),
        "lines": [_line(validation, line) for line in validation.lines],
        "steps": [_step(validation, step) for step in validation.steps],
        "data": [_data(record) for record in validation.records],
        "load_cases": {"header": list(SEGMENT_HEAD), "rows": [_load_case(s) for s in segments(validation)]},
        "unjudged": plain(unjudged(validation)),
        "envelope": plain(envelope),
        "limitations": list(_limitations(validation, passed)),
    }


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
    m = replace(exact, **{n: numbers[n] for n in ("value", "low", "high")})
    value, low, high = (fmt(x, m.quantity, 3) for x in (m.value, m.low, m.high))
    interval = f"{low} to {high}" if m.low is not None and m.high is not None else ""
    meaning = MEASURES[m.name].meaning if m.name in MEASURES else m.name
    return {**numbers, "text": {"meaning": meaning, "value": value, "interval": interval}}


def _data(record: Record) -> dict[str, Any]:
    test = record.test
    return {
        "test": test.name,
        "kind": test.kind.value,
        "file": test.log.name,
        "samples": int(record.log.samples),
        "rate": float(record.log.rate),
        "duration": float(record.t[-1] - record.t[0]),
        "load": test.load,
        "water": test.water is not None,
        "signals": sorted(record.signals),
        "statements": list(record.statements),
    }


def segments(validation: Validation) -> list[Segment]:
    """The load cases of all tests."""
    return [s for record in validation.records for s in record.segments]


def _load_case(s: Segment) -> list[str]:
    """A load case as cells, see SEGMENT_HEAD."""
    low, high = (number(x, 4) for x in (s.s_w_min, s.s_w_max))
    moving = s.s_tip_pp > 0.0
    return [
        s.test,
        f"{s.start:.0f}",
        f"{s.duration:.0f}",
        number(s.load / 1e3, 3),
        low if low == high else f"{low}-{high}",
        f"{s.s_tip_pp:.2f}" if moving else "-",
        f"{s.period:.1f}" if moving and math.isfinite(s.period) else "-",
        s.mode.value,
    ]


def _limitations(validation: Validation, passed: bool) -> Iterator[dict[str, Any]]:
    """What was synthetic, what was not shown, what holds always, and what the model leaves out: headings with their
    lines."""
    words, campaign = WORDS["limitations"], validation.campaign
    wide = [line for line in validation.lines if line.measure is not None and line.measure.undetectable]
    no_meaning = [line for lines in without_meaning(validation).values() for line in lines]
    sections = {
        "Synthetic data": [words["synthetic"]] if campaign.synthetic else [],
        "Not shown by these data": list(_open(validation, Verdict.NOT_SHOWN)),
        "Not covered by the tests": list(_open(validation, Verdict.NOT_COVERED)),
        UNDETECTABLE: [f"{line.key}: {line.message}" for line in wide],
        "Remarks of the campaign": [f"Remark: {text}" for text in campaign.remarks],
        "Not judged: no meaning for this winch type": [f"{line.key}: {line.message}" for line in no_meaning],
        UNJUDGED: unjudged_says(validation),
        "Of this certificate" if passed else "Of this validation": words["always"],
        "Left out of the model": words["left_out"],
        "What this method detects (simulated cranes with known defects)": _detects(campaign.crane),
    }
    yield from ({"heading": heading, "lines": list(lines)} for heading, lines in sections.items() if lines)


def _open(validation: Validation, verdict: Verdict) -> Iterator[str]:
    for line in validation.lines:
        undetectable = line.measure is not None and line.measure.undetectable  # they have a heading of their own
        if line.verdict is verdict and not undetectable:
            weight = "blocks the certificate" if line.failed else "does not block it"
            yield f"{line.key} ({weight}): {line.message}"


def limits_of(crane: Crane) -> DetectionLimits:
    """Detection limits that hold for a crane: those of the trials with known defects; none for another winch type,
    whose judged lines are others."""
    return detection_limits() if crane.plant == TRIED else DetectionLimits("", "", 0, 0, ())


def _detects(crane: Crane) -> list[str]:
    if crane.plant == TRIED:
        return list(limits_of(crane).sentences())
    return [
        f'The trials with known defects are of winch type "{TRIED}": the detection limits of winch type'
        f' "{crane.plant.value}" are not known. The page "Validate a twin" lists single defects that were tried.'
    ]
