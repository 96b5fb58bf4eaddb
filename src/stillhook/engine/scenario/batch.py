"""Scenarios as a problem of the engine; see `stillhook.engine.batch`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from stillhook.base.progress import Progress
from stillhook.engine.arguments import SERIES_STEP, STATISTICS_STEP, paired, steps_per_cycle
from stillhook.engine.batch import Row, check_each, run_batch
from stillhook.engine.columns import Series
from stillhook.engine.inputs import shape
from stillhook.engine.runner import RunOptions
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.dataset import labelled
from stillhook.engine.scenario.run import Result, run_cases
from stillhook.engine.scenario.summary import summarise
from stillhook.engine.store import scenario_as_bytes
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.variables import COMMON_SUMMARY

if TYPE_CHECKING:
    import xarray

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
    series_step, statistics_step = SERIES_STEP, STATISTICS_STEP

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

    def results(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Scenario],
        **options: Unpack[RunOptions],
    ) -> list[Result]:
        return run_cases(cranes, cases, checked=True, **options)

    def row(self, crane: Crane, case: Scenario, result: Result) -> Row:
        s = summarise(crane, case, result)
        return Row(s["status"], [float(s[name]) for name in self.columns(crane, case)], tuple(s["notes"]))

    def labelled(
        self,
        crane: Crane | Sequence[Crane],
        cases: Sequence[Scenario],
        rows: Sequence[Mapping[str, Any]],
        *,
        step: float,
        single: bool,
        series: Series | None,
    ) -> xarray.Dataset:
        return labelled(crane, cases, rows, step=step, single=single, series=series)
