"""What the watch makes of faults of an independent crane. Tables from `trials/adaptation/watch`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks
from numpy.typing import NDArray

from stillhook.live.watch.causes.diagnosis import CAUSES, OTHER
from stillhook.statistics.estimate import Estimate
from trials.adaptation.watch.faults import FAULTS
from trials.adaptation.watch.run import COVERAGES, JUDGED, VIRTUAL, kept
from trials.store import states_of

SCRIPT = "watch"
RIGHT = 0.9
"""Share of the runs in which a cause that is named alone must be the true one."""
LEAST = 3
"""Runs from which a cause may be told apart."""
NOT_RUN, TOO_FEW = "not run yet", "too few"
WINDOWS = tuple(window for trial in COVERAGES.values() for window in trial.windows)
NOT_PRINTED = ("clock", "samples_doubtful", "piston_loss_difference")
"""Statistics that are judged apart, or that no criterion of a stream prints."""


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
    """A row a statistic: how many intervals hold the truth, by rows alone and as printed over each window."""
    found = intervals(outcomes)
    for key in dict.fromkeys(key for key, _ in found):
        rows = found.get((key, "5 min"), np.empty((0, 3)))
        error, half, more = rows.T
        size = f"{np.sqrt(np.mean(error**2)):.2g}" if len(rows) else "–"
        width = f"{np.median(half + more):.2g}" if len(rows) else "–"
        by_rows = share(int(np.sum(np.abs(error) <= half)), len(rows)) if len(rows) else "–"
        cells = [_held(found.get((key, window))) for window in WINDOWS]
        yield f"`{key}`", size, width, by_rows, *cells


def intervals(outcomes: Mapping[str, Any]) -> dict[tuple[str, str], NDArray[np.float64]]:
    """By statistic and window: error, half width by rows, and what is added where it is printed (n, 3)."""
    out: dict[tuple[str, str], list[list[float]]] = {}
    for group in COVERAGES:
        for one in of_group(outcomes, group):
            for window in COVERAGES[group].windows:
                for key, numbers in one.get(window, {}).items():
                    if key not in NOT_PRINTED:
                        out.setdefault((key, window), []).append(numbers)
    return {key: np.array(rows) for key, rows in out.items()}


def _held(rows: NDArray[np.float64] | None) -> str:
    if rows is None:
        return "–"
    return share(*_count(rows))


def virtual(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row a virtual sensor."""
    runs = of_group(outcomes, VIRTUAL)
    names = [name for name in runs[0] if name not in ("code", "date")] if runs else []
    for name in names:
        inside, bias, rms, half, size = np.array([one[name] for one in runs]).T
        parts = [f"{100.0 * float(x):.1f} %" for x in (*_typical(bias, size, rms), np.median(half / size))]
        yield f"`{name}`", str(len(runs)), f"{100.0 * inside.mean():.0f} %", f"{100.0 * inside.min():.0f} %", *parts


def _typical(bias: NDArray[np.float64], size: NDArray[np.float64], rms: NDArray[np.float64]) -> tuple[float, float]:
    return float(np.mean(bias / size)), float(np.sqrt(np.mean((rms / size) ** 2)))


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
    clock = np.abs(np.array([one["clock"] for one in runs if one["clock"] is not None]).reshape(-1, 2))
    held = int(np.sum(clock[:, 0] <= clock[:, 1]))
    yield (
        "clock of the encoder: interval holds the truth",
        ("90 to 98 of 100", share(held, len(clock)), verdict(held, len(clock))),
    )
    found = intervals(outcomes)
    for window in WINDOWS:
        rows = {key: found[key, window] for key, at in found if at == window}
        few = [key for key, x in rows.items() if verdict(*_count(x)) == TOO_FEW]
        text = f"{len(rows) - len(few)} of {len(rows)} statistics" + (f"; too few: {', '.join(few)}" if few else "")
        yield (
            f"intervals over {window}, as printed, hold the truth",
            ("at least 90 of 100", text if rows else NOT_RUN, NOT_RUN if not rows else "not met" if few else "met"),
        )
    for name, runs_of, inside, least, *_ in virtual(outcomes):
        ok = float(inside.split()[0]) >= 95.0
        yield (
            f"virtual sensor {name}: crane's own value within its 95 %",
            ("95 % of the time", f"{inside} in {runs_of} runs; {least} in the worst", "met" if ok else "not met"),
        )


def _count(rows: NDArray[np.float64]) -> tuple[int, int]:
    error, half, more = rows.T
    return int(np.sum(np.abs(error) <= half + more)), len(rows)


def verdict(hits: int, n: int) -> str:
    """Of a coverage that is to be at least 90 of 100."""
    if not n:
        return NOT_RUN
    return "held" if hits >= 0.9 * n else TOO_FEW


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
        "virtual": virtual(outcomes),
    }, None
