"""Summaries of tens of thousands of scenarios; see `stillhook.engine.batch`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from stillhook.base.progress import Progress
from stillhook.engine.arguments import STATISTICS_STEP, paired, steps_per_cycle
from stillhook.engine.batch import Row, check_each, run_batch
from stillhook.engine.inputs import shape
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.run import run_cases
from stillhook.engine.scenario.summary import summarise
from stillhook.engine.store import scenario_as_bytes
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.variables import COMMON_SUMMARY

COMMON = tuple(v.name for v in COMMON_SUMMARY if v.name not in ("status", "notes"))
"""Numbers of a run that every winch type has."""


def numbers_of(crane: Crane) -> tuple[str, ...]:
    """Numbers in the summary of a run of this crane."""
    return (*COMMON, *(row.name for row in crane.plant.type.numbers))


def summaries(
    crane: Crane | Sequence[Crane],
    case: Scenario | Sequence[Scenario],
    *,
    step: str | None = None,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> list[dict[str, Any]]:
    """The summary of every case, statistics alone; a case that loses its numbers is marked and spoils no other.

    Parameters
    ----------
    crane, case, step: as in `stillhook.simulate`. threads, store, client, progress: as in
    `stillhook.engine.batch.run_batch`.

    Errors: ScenarioError and SpecError of the first case that cannot be run; SimulationError where the cluster fails,
    or runs other code.
    """
    cranes, cases = paired(crane, case)
    n_sub = steps_per_cycle(cranes[0], step, STATISTICS_STEP)
    return run_batch(
        ScenarioProblem(), cranes, cases, n_sub=n_sub, threads=threads, store=store, client=client, progress=progress
    )


class ScenarioProblem:
    """Scenarios as a batch runs them."""

    kind = "driver"

    def check(self, cranes: Sequence[Crane], cases: Sequence[Scenario]) -> None:
        check_each(cranes, cases, check)

    def group(self, crane: Crane, case: Scenario) -> tuple[int, int, int]:
        return shape(crane, case)

    def seconds(self, crane: Crane, case: Scenario) -> float:
        return shape(crane, case)[0] * crane.control.t_cycle

    def sort(self, places: list[int], cases: Sequence[Scenario]) -> list[int]:
        return places

    def columns(self, crane: Crane, case: Scenario) -> tuple[str, ...]:
        return numbers_of(crane)

    def identity(self) -> Callable[[Scenario], bytes]:
        return scenario_as_bytes

    def run(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Scenario],
        *,
        n_sub: int,
        places: Sequence[int] | None,
        progress: Progress,
    ) -> list[Row]:
        results = run_cases(
            cranes, cases, n_sub=n_sub, lanes=VL, every=0, threads=1, progress=progress, places=places, checked=True
        )
        rows = [summarise(w, c, r) for w, c, r in zip(cranes, cases, results, strict=True)]
        names = self.columns(cranes[0], cases[0])
        return [Row(s["status"], [float(s[name]) for name in names], tuple(s["notes"])) for s in rows]
