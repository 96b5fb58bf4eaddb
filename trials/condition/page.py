"""What following a crane over years makes of years whose truth is known. Tables from `trials/condition`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook.live.condition.drift import FALSE_A_YEAR
from stillhook.statistics.estimate import Estimate
from trials.condition.run import CRANES, FIRST, LOOKS, OUTCOMES, trials
from trials.condition.years import LIMITS
from trials.store import read, states_of

SCRIPT = "condition"
LEAST, MOST = 0.90, 0.98
"""Share of intervals that must hold the truth."""
ITEMS = {"today": "today's value", "trend": "trend"}
GROUPS = {"wear": "cranes that wear", "still": "cranes that do not"}
NONE_SEEN = 3.0
"""Events of which none is seen with a chance of 5 %."""


def looks(outcomes: Mapping[str, Any], group: str, name: str, years: float) -> list[dict[str, Any]]:
    """What was read of a number after so many years, of each crane of a group."""
    key = f"{name}-{years:g}"
    return [o["looks"][key] for k, o in outcomes.items() if k.startswith(group) and key in o["looks"]]


def held(rows: list[dict[str, Any]], item: str) -> Estimate:
    """Share of intervals that hold the truth."""
    return Estimate.of_share(sum(r[item]["holds"] for r in rows), len(rows))


def share_text(x: Estimate) -> str:
    """A share in words, with Wilson's interval."""
    return f"{round(x.value * x.n)} of {x.n:g} ({100.0 * x.low:.0f} to {100.0 * x.high:.0f} %)"


def claims(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Claim, and theirs, ours and verdict."""
    asked = f"{100.0 * LEAST:.0f} to {100.0 * MOST:.0f} of 100"
    for item, words in ITEMS.items():
        for name in LIMITS:
            for group, of in GROUPS.items():
                rows = [r for years in LOOKS for r in looks(outcomes, group, name, years)]
                x = held(rows, item)
                verdict = "held" if LEAST <= x.value <= MOST else "too few" if x.value < LEAST else "wider than needed"
                yield f"{name}, {of}: interval of {words} holds the truth", (asked, share_text(x), verdict)
    count, years = false_withdrawals(outcomes)
    most = (count + NONE_SEEN if count == 0 else count + 2.0 * count**0.5 + 2.0) / years
    ours = f"{count} in {years:.0f} crane-years (at most {most:.3f} a year)"
    verdict = "met" if count / years <= FALSE_A_YEAR else "not met"
    yield "false withdrawals", (f"at most {FALSE_A_YEAR:g} a year", ours, verdict)
    for name in LIMITS:
        passed = [d for d in drifts(outcomes, name) if d["limit"] is not None]
        if passed:
            shown = [d["shown"] - d["limit"] for d in passed if d["shown"] is not None]
            before = sum(x <= 0.0 for x in shown)
            ours = f"{before} of {len(passed)} at or before; {len(passed) - len(shown)} not in the years followed"
            verdict = "met" if before == len(passed) else "not always"
            yield f"{name}: drift shown by the time that the limit is passed", ("all", ours, verdict)


def drifts(outcomes: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """When a number left margin and limit, and when drift was shown."""
    return [o["drift"][name] for o in outcomes.values()]


def false_withdrawals(outcomes: Mapping[str, Any]) -> tuple[int, float]:
    """Cranes that lost their validity while no number was beyond the margin, and the crane-years in which they could
    have."""
    count, years = 0, 0.0
    for o in outcomes.values():
        rows = list(o["drift"].values())
        last = rows[0]["last"]
        away = min((r["margin"] for r in rows if r["margin"] is not None), default=last)
        shown = min((r["shown"] for r in rows if r["shown"] is not None), default=None)
        count += shown is not None and shown < away
        years += max(min(away, last if shown is None else shown) - (last - o["years"]), 0.0)
    return count, years


def intervals(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each number, time and group."""
    for name in LIMITS:
        for years in LOOKS:
            for group, of in GROUPS.items():
                rows = looks(outcomes, group, name, years)
                if not rows:
                    continue
                cells = []
                for item in ITEMS:
                    half = float(np.median([r[item]["half"] for r in rows]))
                    rms = float(np.sqrt(np.mean([r[item]["error"] ** 2 for r in rows])))
                    cells += [f"{100.0 * rms:.2g} %", f"{100.0 * half:.2g} %", share_text(held(rows, item))]
                shown = sum(r["trend"]["shown"] for r in rows)
                yield name, f"{years:g}", of, *cells, f"{shown} of {len(rows)}"


def found(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """When drift was shown, by number."""
    for name in LIMITS:
        rows = drifts(outcomes, name)
        beyond = [d for d in rows if d["margin"] is not None]
        early = sum(d["shown"] is not None and (d["margin"] is None or d["shown"] < d["margin"]) for d in rows)
        after = [d["shown"] - d["margin"] for d in beyond if d["shown"] is not None and d["shown"] >= d["margin"]]
        late = [d["shown"] - d["limit"] for d in rows if d["limit"] is not None and d["shown"] is not None]
        times = [f"{np.median(x):+.2f}" if x else "–" for x in (after, late)]
        yield name, str(len(beyond)), str(len(after)), *(t.replace("-", "−") for t in times), str(early)


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    outcomes = read(OUTCOMES)
    return {
        "claims": dict(claims(outcomes)),
        "code": {"n": len(outcomes), "of": len(trials()), "states": states_of(outcomes), "first": FIRST, **CRANES},
        "intervals": intervals(outcomes),
        "found": found(outcomes),
    }, None
