"""What the tests of a validation cover: the envelope that is validated, and logged signals that no judged line depends
on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.sea.motion.recorded import wave_periods
from stillhook.validate.ahc.replay import SETTLE, usable
from stillhook.validate.criteria.results import MEASURES, OF_SIGNAL, Measure
from stillhook.validate.data_set.check import RESTS, tip_ranges
from stillhook.validate.data_set.record import Record, Segment, filled
from stillhook.validate.validation import Validation
from stillhook.variables import WINDOW

WAVES = (0.05, 0.95)
"""Shares of all waves that bound the periods of the envelope: one exceptional wave in twenty at either end is not a
tested range."""
BY_TEST = ("test ", "load case ")
"""Prefixes of a test's name where a measure applies to that test alone."""


def envelope_of(records: Sequence[Record], window: float) -> dict[str, Any] | None:
    """Ranges [SI] of load, wire out, 30 s peak-to-peak of the tip and period of its waves, and modes, over the
    segments used by step 5.

    window: that of the criteria [s], which sets the least length for step 5. Windows without tip motion do not count,
    as in step 0. None where the tip moves in no segment.
    """
    used = [
        (record, _counted(record, segment)) for record, segment in usable(records, window)[0] if segment.s_tip_pp > 0.0
    ]
    periods = [p for r, segment in used for p in wave_periods(filled(r.part(segment, "s_tip")), r.step)]
    spans = np.concatenate([np.zeros(0), *(tip_ranges(*part, WINDOW) for part in used)])
    spans = spans[spans >= RESTS]
    if not periods or not len(spans):
        return None
    segments = [segment for _, segment in used]
    return {
        "load": _ends([s.load for s in segments]),
        "s_w": [float(min(s.s_w_min for s in segments)), float(max(s.s_w_max for s in segments))],
        "s_tip_pp": _ends(spans),
        "period": [float(x) for x in np.quantile(periods, WAVES)],
        "modes": sorted({s.mode.value for s in segments}),
    }


def _counted(record: Record, segment: Segment) -> Segment:
    """The part of a segment that counts in step 5."""
    skipped = round(SETTLE / record.step)
    start, duration = segment.start + skipped * record.step, segment.duration - skipped * record.step
    return replace(segment, first=segment.first + skipped, start=start, duration=duration)


def _ends(values: Any) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]


def unjudged(validation: Validation) -> dict[str, tuple[str, ...]]:
    """Names of signals, each with the tests in which it was logged and no judged line with a value depends on it.

    A measure depends on the signals listed in `stillhook.validate.criteria.results`, in its test, or in all tests
    of its kinds.
    """
    counted = {line.key for line in validation.lines if line.judged}
    names = {c.measure for c in validation.campaign.criteria.criteria if c.key in counted}
    judged = {
        (r.test.name, signal)
        for step in validation.steps
        for m in step.measures
        if m.name in names and m.value is not None
        for r in _records(validation, m)
        for signal in _signals(m)
    }
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
    return "every test" if len(names) == every > 1 else f"test{'s' if len(names) > 1 else ''} {', '.join(names)}"


def _signals(m: Measure) -> Sequence[str]:
    """Signals that a measure depends on: those declared, or the one that it is of."""
    return (m.test.removeprefix(OF_SIGNAL),) if m.test.startswith(OF_SIGNAL) else MEASURES[m.name].signals


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
