"""Runs as the tests of the engine want them."""

from collections.abc import Sequence

from stillhook.engine.scenario.problem import Result, run_cases
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario


def run_one(crane: Crane, case: Scenario, *, n_sub: int, every: int = 1) -> Result:
    """One trajectory, with a time series of a row every `every` cycles (0: without)."""
    return run_cases(crane, [case], n_sub=n_sub, lanes=1, every=every)[0]


def run_many(crane: Crane, cases: Sequence[Scenario], *, n_sub: int, threads: int = 2) -> list[Result]:
    """Statistics of many runs on one crane, sixteen side by side."""
    return run_cases(crane, cases, n_sub=n_sub, lanes=VL, every=0, threads=threads)
