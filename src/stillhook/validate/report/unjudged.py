"""Signals that were logged and that no line of the verdict rests on: a reader of the certificate knows what nobody
looked at."""

from __future__ import annotations

from collections.abc import Iterator

from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.validation import Validation

HEADING = "Logged, not judged"
MEANING = (
    "No line of the verdict that counts rests on these signals in these tests. They may be wrong without any trace"
    " here."
)
BY_TEST = ("test ", "load case ")
"""What stands before the name of a test where a measure is of that test alone."""


def unjudged(validation: Validation) -> dict[str, tuple[str, ...]]:
    """Names of signals, each with the tests in which it was logged and no judged line with a value rests on it.

    A measure rests on the signals that `stillhook.validate.criteria.names` names, in the test that it is of, or in all
    tests of its kinds.
    """
    judged = _judged(validation)
    out: dict[str, list[str]] = {}
    for record in validation.records:
        for name in sorted(set(record.signals) - record.derived):
            if (record.test.name, name) not in judged:
                out.setdefault(name, []).append(record.test.name)
    return {name: tuple(tests) for name, tests in out.items()}


def unjudged_says(validation: Validation) -> list[str]:
    """The same in lines, "p_hp in test dynamics"; nothing where only some steps were taken."""
    if not validation.whole:
        return []
    every = len(validation.records)
    return [f"{name} in {_tests(tests, every)}" for name, tests in unjudged(validation).items()]


def _tests(names: tuple[str, ...], every: int) -> str:
    """Tests in words."""
    if len(names) == every > 1:
        return "every test"
    return f"test{'s' if len(names) > 1 else ''} {', '.join(names)}"


def _judged(validation: Validation) -> set[tuple[str, str]]:
    """Tests and signals that a judged line with a value rests on."""
    counted = {line.key for line in validation.lines if line.judged}
    names = {c.measure for c in validation.campaign.criteria.criteria if c.key in counted}
    out = set()
    for m in (m for step in validation.steps for m in step.measures if m.name in names and m.value is not None):
        out |= {(r.test.name, signal) for r in _records(validation, m) for signal in MEASURES[m.name].signals}
    return out


def _records(validation: Validation, m: Measure) -> Iterator[Record]:
    """The tests that a measure is of."""
    names = {r.test.name for r in validation.records}
    own = [m.test.removeprefix(before) for before in BY_TEST if m.test.startswith(before)]
    kinds = MEASURES[m.name].kinds
    for r in validation.records:
        if own and own[0] in names:
            if r.test.name == own[0]:
                yield r
        elif not kinds or r.test.kind.value in kinds:
            yield r
