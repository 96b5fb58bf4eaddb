"""Do the 95 % intervals of identified friction hold the truth where transmitters drift and oil warms up? Tables from
`trials/friction/campaigns.py`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from blocks import Blocks

from trials.friction.campaigns import SEEDS, Scenario, Trial, kept
from trials.store import states_of

SCRIPT = "friction_coverage"

LEAST, MOST = 0.90, 0.98
"""Share of intervals that must hold the truth."""
BLOCK = 0.5
"""A campaign with this share of its parameters' intervals off, or more, has failed as a block."""
OURS = [s for s in Scenario if s is not Scenario.OTHER_LAW]


def found_of(scenario: Scenario, outcomes: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [outcomes[key] for seed in SEEDS if (key := Trial(scenario, seed).key) in outcomes]


def share(hits: list[Any]) -> str:
    return f"{100.0 * float(np.mean(hits)):.0f} % of {len(hits)}" if hits else "not run yet"


def parameters(found: list[dict[str, Any]]) -> list[bool]:
    return [hit for one in found for hit in one.get("inside", {}).values()]


def band(found: list[dict[str, Any]]) -> list[int]:
    return [hit for one in found for hit in one["band"]]


def blocks_failed(found: list[dict[str, Any]]) -> str:
    judged = [one["inside"] for one in found if one.get("inside")]
    return f"{sum(np.mean(list(one.values())) <= BLOCK for one in judged)} of {len(judged)}" if judged else "–"


def rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for scenario in Scenario:
        found = found_of(scenario, outcomes)
        half, error = ([one[name] for one in found] for name in ("half_width", "error"))
        sizes = (f"{np.median(half):.2g}", f"{np.median(error):.2g}") if found else ("", "")
        own = share(parameters(found)) if scenario in OURS else "–"
        yield scenario.value, str(len(found)), own, share(band(found)), blocks_failed(found), *sizes


def by_name(outcomes: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for scenario in OURS:
        found = [one["inside"] for one in found_of(scenario, outcomes)]
        yield {**locals()}


def verdict(hits: list[Any]) -> str:
    if not hits:
        return "not run yet"
    part = float(np.mean(hits))
    return "within" if LEAST <= part <= MOST else "too few" if part < LEAST else "too many: wider than needed"


def compute() -> tuple[Blocks, None]:
    outcomes = kept()
    limits = f"{100 * LEAST:.0f} to {100 * MOST:.0f} %"
    claims = {}
    for scenario in Scenario:
        found, name = found_of(scenario, outcomes), scenario.value
        judged = {"intervals of parameters": parameters(found)} if scenario in OURS else {}
        for what, hits in (judged | {"band of the friction curve": band(found)}).items():
            claims[f"{name}: {what}"] = (limits, share(hits), verdict(hits))
    states = states_of(outcomes)
    return {
        "claims": claims,
        "code": {"outcomes": outcomes, "states": states},
        "coverage": rows(outcomes),
        "parameters": by_name(outcomes),
    }, None
