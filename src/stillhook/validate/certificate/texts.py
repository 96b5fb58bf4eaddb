"""Texts of a certificate: the level of the twin, and what was not shown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from stillhook.validate.criteria.criteria import detection_limits
from stillhook.validate.criteria.results import Outcome, Verdict
from stillhook.validate.report import envelope
from stillhook.validate.report.texts import sentence
from stillhook.validate.validation import Validation


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

SYNTHETIC = (
    "SYNTHETIC: these logs were simulated, not measured on a crane. Nothing here says anything about a real crane."
)

LEFT_OUT = (
    "The temperature of the oil: friction, leakage and stiffness are those at the working temperature of the tests.",
    "Backlash and flexibility of the gears; drum, gears and motors are one stiff body.",
    "Lines are one volume a side with an effective stiffness; pressure waves in them are not computed.",
    "Overload protection and other safety systems beyond the relief valves.",
    "Flexibility of the crane and its boom, swing of the load and horizontal motion.",
    "The wire is a spring with damping, without mass of its own between tip and load.",
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


def level_of(passed: bool, synthetic: bool) -> Level:
    """Level and variant that a validation gives the twin; one on simulated logs says so."""
    if not passed:
        return NOT_VERIFIED
    if synthetic:
        crane = (
            "SYNTHETIC: the logs are of a simulated crane, so this shows the method; the twin of a real crane stays at"
            " level 1."
        )
        return VERIFIED._replace(statement=f"{VERIFIED.statement} {crane}")
    return VERIFIED


def limitations(validation: Validation, passed: bool) -> list[dict[str, Any]]:
    """What was synthetic, what was not shown, what holds always, and what the model leaves out: headings with their
    lines."""
    sections = {
        "Synthetic data": [SYNTHETIC] if validation.campaign.synthetic else [],
        "Not shown by these data": list(_not_shown(validation)),
        envelope.HEADING: envelope.unjudged_says(validation),
        "Of this certificate" if passed else "Of this validation": list(ALWAYS),
        "Left out of the model": list(LEFT_OUT),
        "What this method detects (simulated cranes with known defects)": list(detection_limits().sentences()),
    }
    return [{"heading": heading, "lines": lines} for heading, lines in sections.items() if lines]


def _not_shown(validation: Validation) -> Iterator[str]:
    for line in validation.lines:
        if line.verdict is Verdict.NOT_SHOWN:
            weight = "in the way" if line.failed else "not in the way"
            yield f"{line.key} ({weight}): {line.message}"
    yield from (f"Remark: {text}" for text in validation.campaign.remarks)
