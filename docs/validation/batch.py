"""Many runs for a page's tables, sixteen side by side with statistics alone, and waves of a given peak speed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from stillhook import Crane, Scenario, Sine
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


def sine(v_peak: float, period: float) -> Sine:
    """A sine of this highest speed [m/s] and period [s]."""
    return Sine.from_si(v_peak * period / (2.0 * np.pi), period)
