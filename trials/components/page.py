"""Do the intervals of components identified from data of their own hold the truth? Tables from `trials/components`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook.statistics.estimate import Estimate
from trials.components.run import COMPONENTS, OTHER, OWN, TRIALS, kept
from trials.store import states_of

SCRIPT = "components"
LEAST = 0.90
"""Share of the intervals that must hold the truth."""
LAWS = {OWN: "the law of the fit", OTHER: "a law of another form"}
TITLES = {
    "motor": "leakage of a motor",
    "pump": "leakage of a pump",
    "servo": "displacement control",
    "lines": "restrictions of the lines",
}


def of_group(outcomes: Mapping[str, Any], component: str, law: str) -> list[dict[str, Any]]:
    return [outcomes[key] for key, t in TRIALS.items() if (t.component, t.law) == (component, law) and key in outcomes]


def share(hits: list[bool]) -> str:
    """So many of so many, with Wilson's interval."""
    e = Estimate.of_share(sum(hits), len(hits))
    return f"{100.0 * e.value:.0f} % of {len(hits)}"


def claims(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    for component, title in TITLES.items():
        for law, words in LAWS.items():
            hits = [hit for one in of_group(outcomes, component, law) for hit in one["inside"].values()]
            if hits:
                verdict = "held" if np.mean(hits) >= LEAST else "too few"
                yield (
                    f"{title}, {words}: intervals that hold the truth",
                    (f"at least {100 * LEAST:.0f} %", share(hits), verdict),
                )


def names_of(name: str) -> str:
    """Parameters of one kind under one name: those of both lines, and all settings of a pump."""
    return "C at each setting" if "@" in name else name.removesuffix("_a").removesuffix("_b")


def rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each parameter: number of intervals, those that hold, median half width and error."""
    for component in COMPONENTS:
        for law, words in LAWS.items():
            found: dict[str, list[tuple[bool, float, float]]] = {}
            for one in of_group(outcomes, component, law):
                for name, hit in one["inside"].items():
                    found.setdefault(names_of(name), []).append((hit, one["half"][name], one["error"][name]))
            for name, each in found.items():
                hits, half, error = zip(*each, strict=True)
                sizes = (f"{100.0 * np.nanmedian(x):.2g} %" for x in (half, error))
                yield TITLES[component], words, f"`{name}`", share(list(hits)), *sizes


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    outcomes = kept()
    return {
        "claims": dict(claims(outcomes)),
        "code": {"outcomes": outcomes, "states": states_of(outcomes), "all": len(TRIALS)},
        "parameters": rows(outcomes),
    }, None
