"""What the watch makes of faults of an independent crane. Tables from `trials/adaptation/watch`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook.live.watch.causes.diagnosis import CAUSES, OTHER
from stillhook.statistics.estimate import Estimate
from trials.adaptation.watch.faults import FAULTS
from trials.adaptation.watch.run import COVERAGE, HIDDEN, JUDGED, WINDOWS, kept
from trials.store import states_of

SCRIPT = "watch"
RIGHT = 0.9
"""Share of the runs in which a cause that is named alone must be the true one."""
LEAST = 3
"""Runs from which a cause may be told apart."""
NOT_RUN = "not run yet"


def of_group(outcomes: Mapping[str, Any], group: str) -> list[dict[str, Any]]:
    """Outcomes of a group, in the order of their seeds."""
    return [one for key, one in outcomes.items() if key.partition("/")[0] == group]


def share(hits: int, n: int) -> str:
    """So many of so many, with Wilson's interval."""
    if not n:
        return NOT_RUN
    e = Estimate.of_share(hits, n)
    return f"{hits} of {n} ({100.0 * e.low:.0f} to {100.0 * e.high:.0f} %)"


def alone(outcomes: Mapping[str, Any]) -> dict[str, Counter[str]]:
    """By cause: of which faults it was the one candidate, and how often."""
    out: dict[str, Counter[str]] = {c["name"]: Counter() for c in CAUSES}
    for name in FAULTS:
        for one in of_group(outcomes, name):
            found = [c for c in one["candidates"] if c != OTHER]
            if len(found) == 1 and found[0] in out:
                out[found[0]][name] += 1
    return out


def told(outcomes: Mapping[str, Any]) -> list[str]:
    """Causes that may be named alone: as the one candidate they were the true cause, often enough."""
    out = []
    for cause, by_fault in alone(outcomes).items():
        n = sum(by_fault.values())
        right = sum(count for name, count in by_fault.items() if FAULTS[name].cause == cause)
        if right >= LEAST and right >= RIGHT * n:
            out.append(cause)
    return out


def faults(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row a fault: how often its cause was the one candidate, one of several, none at all, or another was."""
    for name, fault in FAULTS.items():
        runs = of_group(outcomes, name)
        candidates = [[c for c in one["candidates"] if c != OTHER] for one in runs]
        single = sum(c == [fault.cause] for c in candidates)
        several = sum(len(c) > 1 and fault.cause in c for c in candidates)
        nothing = sum(not one["candidates"] for one in runs)
        other = len(runs) - single - several - nothing
        failed = Counter(key for one in runs for key in one["failed"])
        lines = ", ".join(f"{key} {count}" for key, count in failed.most_common(4)) or "–"
        cells = (str(x) if fault.cause else "–" for x in (single, several))
        yield fault.text, fault.cause or "none", str(len(runs)), *cells, str(nothing), str(other), lines


def confused(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row a cause that was the one candidate: of which faults."""
    good = told(outcomes)
    for cause, by_fault in alone(outcomes).items():
        if by_fault:
            of = ", ".join(f"{FAULTS[name].text} {count}" for name, count in by_fault.most_common())
            yield cause, of, "named alone" if cause in good else "one of"


def coverage(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row a statistic: how many intervals hold the mean of the other repeats."""
    hits: dict[str, dict[str, list[bool]]] = {window: {} for window in WINDOWS}
    for one in of_group(outcomes, COVERAGE):
        for window in WINDOWS:
            for key, rows in one[window].items():
                x = np.array(rows)
                for i in range(len(x)):
                    mean = float(np.delete(x[:, 0], i).mean())
                    half = max(x[i, 2] - x[i, 0], x[i, 0] - x[i, 1]) * np.sqrt(1.0 + 1.0 / (len(x) - 1))
                    hits[window].setdefault(key, []).append(bool(abs(x[i, 0] - mean) <= half))
    for key in dict.fromkeys(k for window in WINDOWS for k in hits[window]):
        cells = [hits[window].get(key, []) for window in WINDOWS]
        yield f"`{key}`", *(share(sum(c), len(c)) if c else "–" for c in cells)


def hidden(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row a signal that was left out."""
    runs = of_group(outcomes, HIDDEN)
    names = [name for name in runs[0] if name not in ("code", "date")] if runs else []
    for name in names:
        inside, half = (np.array([one[name][k] for one in runs]) for k in (0, 1))
        yield (
            f"`{name}`",
            str(len(runs)),
            f"{100.0 * inside.mean():.0f} %",
            f"{100.0 * inside.min():.0f} %",
            (f"{100.0 * float(np.median(half)):.1f} %"),
        )


def claims(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Claim, and theirs, ours and verdict."""
    sound: Sequence[str] = [name for name, fault in FAULTS.items() if not fault.cause]
    runs = [one for name in sound for one in of_group(outcomes, name)]
    named, failed = (sum(bool(one[key]) for one in runs) for key in ("ever_named", "ever_failed"))
    yield (
        "no cause is named without a fault",
        ("at no time", f"in {share(named, len(runs))} runs at some time", _met(named, runs)),
    )
    yield (
        "no criterion fails without a fault",
        ("at no time", f"in {share(failed, len(runs))} runs at some time", _met(failed, runs)),
    )
    faulty = [(fault.cause, one) for name, fault in FAULTS.items() if fault.cause for one in of_group(outcomes, name)]
    among = sum(cause in one["candidates"] for cause, one in faulty)
    wrong = sum(bool(one["candidates"]) and cause not in one["candidates"] for cause, one in faulty)
    yield "the cause of a fault is among those listed", ("–", share(among, len(faulty)), "for information")
    yield "what is listed leaves the cause out", ("never", share(wrong, len(faulty)), _met(wrong, faulty))
    clock = np.array([abs(one["clock_error"]) for one in runs if one["clock_error"] is not None])
    largest = f"largest error {1e3 * clock.max():.1f} ms in {len(clock)} runs" if len(clock) else NOT_RUN
    yield (
        "clock of the encoder",
        ("within 8 ms, as stated", largest, "met" if len(clock) and clock.max() < 8e-3 else "not met"),
    )


def _met(count: int, runs: Sequence[Any]) -> str:
    return NOT_RUN if not runs else "met" if not count else "not met"


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    outcomes = kept()
    return {
        "claims": dict(claims(outcomes)),
        "code": {"outcomes": outcomes, "states": states_of(outcomes), "first": JUDGED},
        "faults": faults(outcomes),
        "confused": confused(outcomes),
        "coverage": coverage(outcomes),
        "hidden": hidden(outcomes),
    }, None
