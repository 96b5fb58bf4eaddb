"""What may be the cause of a failed criterion: signs of balances outside the band of a sound crane, and the causes
whose pattern they are.

A cause is a candidate where everything that it must move is moved, or not known, and nothing is moved that it leaves
alone. One candidate is named only where the trial with an independent crane shows that it can be distinguished
(docs/validation/watch.md).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any, NamedTuple

from stillhook.live.watch.windows.criteria import CriteriaWatch
from stillhook.statistics.estimate import Estimate
from stillhook.units import show

_TABLE = tomllib.loads((files("stillhook.live.watch.causes") / "causes.toml").read_text(encoding="utf-8"))
SIGNS: Mapping[str, Mapping[str, Any]] = _TABLE["signs"]
CAUSES: Sequence[Mapping[str, Any]] = tuple(_TABLE["cause"])
NOT_VARIED: Sequence[str] = tuple(_TABLE["not_judged"]["names"])
TOLD: Sequence[str] = tuple(
    tomllib.loads((files("stillhook.live.watch.causes") / "told.toml").read_text(encoding="utf-8"))["told"]
)
"""Causes that may be named alone."""
OTHER = "something else, or several things at once"


class Sign(NamedTuple):
    """One sign. value, low, high: its 95 % interval; state: "+" or "-" outside the band, "" inside, "?" where the
    interval holds both, or there is none; text as people read it."""

    name: str
    value: float
    low: float
    high: float
    state: str
    text: str


class Diagnosis(NamedTuple):
    """candidates: causes that alone explain the signs, none where nothing is wrong; `told`: whether there is one, and
    it can be distinguished; evidence: the signs that are out of their bands; unknown: signs without a verdict;
    window."""

    candidates: tuple[str, ...]
    told: bool
    evidence: tuple[Sign, ...]
    unknown: tuple[str, ...]
    window: str

    @property
    def text(self) -> str:
        """In one sentence; empty where there are no candidates."""
        if not self.candidates:
            return ""
        what = self.candidates[0] if self.told else f"one of: {'; '.join(self.candidates)}"
        return (
            f"Cause: {what}. Evidence: {'; '.join(s.text for s in self.evidence)}."
            if self.evidence
            else f"Cause: {what}."
        )


def signs_of(watch: CriteriaWatch, window: str) -> tuple[Sign, ...]:
    """All signs over a window; those without a signal have the state "?"."""
    out = []
    for name, of in SIGNS.items():
        found = watch.calibrated(of["measure"], window) if of["measure"] in watch.measures.statistics else None
        out.append(_sign(name, found or Estimate(math.nan)))
    return tuple(out)


def _sign(name: str, e: Estimate) -> Sign:
    of = SIGNS[name]
    low, high = of["low"], of["high"]
    if not (math.isfinite(e.low) and math.isfinite(e.high)):
        state = "?"
    elif e.low > high:
        state = "+"
    elif e.high < low:
        state = "-"
    elif e.low >= low and e.high <= high:
        state = ""
    else:
        state = "?"
    return Sign(name, e.value, e.low, e.high, state, f"{of['words']} {_words(e, of.get('kind', ''))}")


def _words(e: Estimate, kind: str) -> str:
    if not math.isfinite(e.value):
        return "-"
    half = 0.5 * (e.high - e.low)
    if kind == "time":
        return f"{1e3 * e.value:+.0f} ms +- {1e3 * half:.0f} ms"
    if kind:
        return f"{'+' if e.value > 0.0 else ''}{show(e.value, kind, 3)} +- {show(half, kind, 2)}"
    return f"{100.0 * e.value:+.1f} % +- {100.0 * half:.1f} %"


def diagnose(signs: Sequence[Sign], conditions: Sequence[str], window: str) -> Diagnosis:
    """The causes that explain the signs. conditions: what is seen directly, such as a stale tip, each a cause."""
    state = {s.name: s.state for s in signs}
    moved = {s.name: s.state for s in signs if s.state in ("+", "-")}
    evidence = tuple(s for s in signs if s.name in moved)
    unknown = tuple(s.name for s in signs if s.state == "?")
    if conditions:
        return Diagnosis(tuple(conditions), len(conditions) == 1, evidence, unknown, window)
    if not moved:
        return Diagnosis((), False, (), unknown, window)
    found = [c for c in CAUSES if _explains(c, state, moved)]
    names = tuple(c["name"] for c in found)
    told = len(found) == 1 and names[0] in TOLD
    return Diagnosis(names if told or len(found) > 1 else (*names, OTHER), told, evidence, unknown, window)


def _explains(cause: Mapping[str, Any], state: Mapping[str, str], moved: Mapping[str, str]) -> bool:
    for k, pattern in enumerate(cause["patterns"]):
        must = {sign[:-1]: sign[-1] for sign in pattern}
        held = all(state.get(name, "?") in (way, "?") for name, way in must.items())
        seen = any(moved.get(name) == way for name, way in must.items())
        against = cause.get("excludes", [[]] * len(cause["patterns"]))[k]
        excluded = any(moved.get(sign[:-1]) == sign[-1] for sign in against)
        alone = set(moved) <= set(must) | set(cause["may"])
        if held and seen and alone and not excluded:
            return True
    return False
