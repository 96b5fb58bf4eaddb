"""What validation makes of an independent crane, healthy and with known defects. Tables from
`trials/independent_crane`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks

from trials.independent_crane.crane import CASES, Case, Must
from trials.independent_crane.run import kept
from trials.store import states_of

SCRIPT = "independent_crane"

BEFORE: Mapping[str, str] = {
    "healthy-0": "passed",
    "precharge": "passed",
    "gas-volume": "passed",
    "dead-2": "refused by `2a` alone",
    "dead-3": "refused by `2a` alone",
    "zero-a": "passed",
    "leak-constant": "refused (+34 %, +37 %)",
    "leak-stroke": "read −58 % (−60 to −57), true −40 %",
}
"""What version 0.7.0 made of the same campaigns; others were not run with it."""
FORM = "the form of the leakage does not fit"
FORM_IN_LOG = re.compile(rf"{FORM}: it (.*? in the log(?: \(not (?:told|distinguished) from [^)]*\))?)")
WORDS: Mapping[str, str] = {
    "precharge": "precharge",
    "gas-volume": "gas volume",
    "motor-count": "motors",
    "dead-1": "motors work",
    "dead-2": "motors work",
    "dead-3": "motors work",
    "zero-a": "reads",
    "leak-constant": FORM,
    "leak-stroke": FORM,
    "leak-pressure": FORM,
    "gear": "gear ratio",
}
"""Word by which the note of a line is known that names the cause."""
CLAIMS: Mapping[Must, str] = {
    Must.PASS: "healthy cranes pass",
    Must.TURN_DOWN: "defects turned down by a line made for them",
    Must.NOT_REFUTE: "leakage of another form, within a quarter of the twin's or not shown to be beyond: not refuted",
    Must.NAME_FORM: "leakage that varies with stroke: its form among those named",
}


def named_forms(one: Mapping[str, Any]) -> str:
    """What the lines say of the form of the leakage in the log; empty where they do not refute the crane file's."""
    messages = [message for _, message in (*one["failed"].values(), *one["lines"].values())]
    return next((hit[1] for message in messages if (hit := FORM_IN_LOG.search(message))), "")


def as_required(case: Case, one: Mapping[str, Any]) -> bool:
    """Whether a campaign gives what it must."""
    if case.must is Must.PASS:
        return bool(one["outcome"] == "passed")
    if case.must is Must.TURN_DOWN:
        return any(key in one["failed"] for key in case.lines)
    if case.must is Must.NOT_REFUTE:
        return one["outcome"] in ("passed", "not shown")
    return "stroke" in named_forms(one)


def failed_lines(one: Mapping[str, Any]) -> str:
    """Keys of the lines that stand in the way, with the verdict where it is not "refuted"."""
    keys = [
        f"`{key}`" + ("" if verdict == "refuted" else f" ({verdict})") for key, (verdict, _) in one["failed"].items()
    ]
    return ", ".join(keys) or "none"


def naming(case: Case, one: Mapping[str, Any]) -> str:
    """Figure of the first line that the case is about, with the note that names the cause."""
    both = {**one["lines"], **one["failed"]}
    message = next((both[key][1] for key in case.lines if key in both), "")
    figure, *notes = message.split("; ")
    word = WORDS.get(case.name)
    cause = next((note for note in notes if word is not None and word in note), "")
    if cause.count("(") > cause.count(")"):
        cause = cause[: cause.rindex(" (")]  # a bracket with a semicolon in it
    return "; ".join(part for part in (figure.split(", limit")[0], cause) if part).replace("|", "/")


def rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each case."""
    for case in CASES:
        before = BEFORE.get(case.name, "not run")
        one = outcomes.get(case.name)
        if one is None:
            yield f"`{case.name}`", case.text, case.must.value, "not run yet", "", "", before
            continue
        result = one["outcome"] if as_required(case, one) else f"**{one['outcome']}**"
        yield f"`{case.name}`", case.text, case.must.value, result, failed_lines(one), naming(case, one), before


def claim(cases: Sequence[Case], outcomes: Mapping[str, Any]) -> tuple[str, str, str]:
    """Theirs, ours and verdict of the cases that must give the same."""
    run = [case for case in cases if case.name in outcomes]
    good = sum(as_required(case, outcomes[case.name]) for case in run)
    if good < len(run):
        verdict = "not all"
    elif len(run) < len(cases):
        verdict = f"{len(cases) - len(run)} not run yet"
    else:
        verdict = "as required"
    return f"{len(cases)} of {len(cases)}", f"{good} of {len(run)}", verdict


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    outcomes = kept()
    median = {
        n: float(np.median([one["seconds"][n] for one in outcomes.values()])) for n in ("simulation", "validation")
    }
    claims = {text: claim([case for case in CASES if case.must is must], outcomes) for must, text in CLAIMS.items()}
    return {
        "claims": claims,
        "code": {"outcomes": outcomes, "states": states_of(outcomes), "median": median},
        "cases": rows(outcomes),
    }, None
