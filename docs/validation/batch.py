"""Many runs for a page's tables, sixteen side by side with statistics alone; and derivatives of a winch's rates."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from stillhook import Crane, Scenario
from stillhook.engine.simulate import run_cases

Numbers = Mapping[str, Any]


def side_by_side(runs: Iterable[tuple[Crane, Scenario]]) -> list[Numbers]:
    """The summary of every run, in order, SI; runs of one length share blocks of sixteen. A run that diverges stops the
    page."""
    asked = list(runs)
    found = run_cases([crane for crane, _ in asked], [case for _, case in asked])
    failed = [i for i, one in enumerate(found) if one["status"] == "diverged"]
    assert not failed, f"{len(failed)} of {len(found)} runs lost their numbers, the first: {asked[failed[0]]}"
    return found


def jacobian(
    winch: Any,
    x: Any,
    q: Any,
    u: Any,
    geo: Any,
    p: Any,
    steps: Mapping[str, float],
    change: Callable[[Any], Any] = lambda circuit: circuit,
) -> np.ndarray:
    """Derivatives of a winch type's rates by the states of these names, from differences of these steps about x;
    change: of what the circuit gives."""

    def rate(name: str, h: float) -> np.ndarray:
        at = x._replace(**{name: getattr(x, name) + h})
        r = winch.rates(change(winch.circuit(at, q, u, geo, p)), at, q, u, geo, p)
        return np.array([getattr(r, n) for n in steps])

    return np.column_stack([(rate(n, h) - rate(n, -h)) / (2.0 * h) for n, h in steps.items()])
