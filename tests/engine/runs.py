"""Runs as the tests of the engine want them."""

from collections.abc import Sequence

from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario


def run_one(crane: Crane, case: Scenario, *, n_sub: int, every: int = 1) -> ScenarioRun:
    """One trajectory, with a time series of a row every `every` cycles (0: without)."""
    return run_cases(crane, [case], step=n_sub, lanes=1, every=every, keep=unchanged)[0]


def run_many(crane: Crane, cases: Sequence[Scenario], *, n_sub: int, threads: int = 2) -> list[ScenarioRun]:
    """Statistics of many runs on one crane, sixteen side by side."""
    return run_cases(crane, cases, step=n_sub, lanes=VL, threads=threads, keep=unchanged)
