"""Logged signals that no line of the verdict depends on: the certificate lists them as not
checked."""

from __future__ import annotations

from collections.abc import Iterator

from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.validation import Validation

HEADING = "Logged, not judged"
MEANING = "No judged line of the verdict depends on these signals in these tests. Errors in them would not be detected."
BY_TEST = ("test ", "load case ")
"""Prefixes of a test's name where a measure applies to that test alone."""


def unjudged(validation: Validation) -> dict[str, tuple[str, ...]]:
    """Names of signals, each with the tests in which it was logged and no judged line with a value depends on it.

    A measure depends on the signals listed in `stillhook.validate.criteria.names`, in its test, or in all tests of its
    kinds.
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
    if not validation.complete:
        return []
    every = len(validation.records)
    return [f"{name} in {_tests(tests, every)}" for name, tests in unjudged(validation).items()]


def _tests(names: tuple[str, ...], every: int) -> str:
    """Tests in words."""
    if len(names) == every > 1:
        return "every test"
    return f"test{'s' if len(names) > 1 else ''} {', '.join(names)}"


def _judged(validation: Validation) -> set[tuple[str, str]]:
    """Tests and signals that a judged line with a value depends on."""
    counted = {line.key for line in validation.lines if line.judged}
    names = {c.measure for c in validation.campaign.criteria.criteria if c.key in counted}
    out = set()
    for m in (m for step in validation.steps for m in step.measures if m.name in names and m.value is not None):
        out |= {(r.test.name, signal) for r in _records(validation, m) for signal in MEASURES[m.name].signals}
    return out


def _records(validation: Validation, m: Measure) -> Iterator[Record]:
    """The tests that a measure covers."""
    names = {r.test.name for r in validation.records}
    test = [m.test.removeprefix(before) for before in BY_TEST if m.test.startswith(before)]
    kinds = MEASURES[m.name].kinds
    for r in validation.records:
        if test and test[0] in names:
            if r.test.name == test[0]:
                yield r
        elif not kinds or r.test.kind.value in kinds:
            yield r
