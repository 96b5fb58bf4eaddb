"""Scenarios as a type of case: how they are checked, packed and grouped, and the labelled Dataset of their runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from stillhook.engine.arguments import (
    SERIES_STEP,
    STATISTICS_STEP,
    check_step,
    labelled,
    steps_of_cases,
    substeps,
    summary_columns,
)
from stillhook.engine.certificate import twin_line
from stillhook.engine.inputs import shape
from stillhook.engine.runner import Run, each_case
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.engine.scenario.summary import numbers_of
from stillhook.engine.store import Summary, bare
from stillhook.engine.tasks import CaseType
from stillhook.kernels.build import Setup
from stillhook.kernels.control_laws import extra_controllers
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.spec.settings import sensor_settings
from stillhook.variables import WINDOW

if TYPE_CHECKING:
    import xarray


def _one_for_all(crane: Crane | Sequence[Crane], cases: Sequence[Scenario]) -> bool:
    """Whether several cranes ran one and the same scenario, which is then stored once."""
    return not isinstance(crane, Crane) and all(c is cases[0] for c in cases)


def _labels(crane: Crane | Sequence[Crane], cases: Sequence[Scenario]) -> list[str]:
    """Names along "case": those of the cases, or of the cranes where several ran one case; numbers where they do not
    differ."""
    if isinstance(crane, Crane) or not _one_for_all(crane, cases):
        return [c.name or str(i) for i, c in enumerate(cases)]
    names = [c.name for c in crane]
    return names if len(set(names)) == len(names) else [str(i) for i in range(len(names))]


class ScenarioType(CaseType):
    """Scenarios: a load on the wire."""

    def check(self, cranes: Sequence[Crane], cases: Sequence[Scenario]) -> None:
        each_case(cranes, cases, check)

    def default_steps(self, cranes: Sequence[Crane], cases: Sequence[Scenario], *, series: bool) -> int:
        """On a winch type whose fast modes leave it little room the longest step that every crane can follow."""
        longest = SERIES_STEP if series else STATISTICS_STEP
        if cranes[0].plant.type.steady_operation:
            return substeps(cranes[0].control.t_cycle, longest)
        once = {id(each): (each, case) for each, case in zip(cranes, cases, strict=True)}.values()
        return steps_of_cases([each for each, _ in once], [case for _, case in once], longest)

    def ready(
        self, cranes: Sequence[Crane], cases: Sequence[Scenario], n_sub: int, places: Sequence[int] | None = None
    ) -> list[Ready]:
        def make(crane: Crane, case: Scenario) -> Ready:
            ready = Ready.of(crane, case)
            check_step(ready.winch, ready.drive.t_cycle / n_sub)
            return ready

        return each_case(cranes, cases, make, places)

    def block(self, ready: Sequence[Ready], *, lanes: int, n_sub: int, every: int) -> ScenarioBlock:
        return ScenarioBlock(ready, lanes=lanes, n_sub=n_sub, every=every)

    def kernel(self, crane: Crane, case: Scenario) -> tuple[Setup, tuple[str, ...]]:
        modes = (case.mode, *(mode for _, mode in case.modes))
        return Setup(sensors=tuple(sensor_settings(crane.sensors))), extra_controllers(modes)

    def group(self, crane: Crane, case: Scenario) -> tuple[int, int, int]:
        return shape(crane, case)

    def seconds(self, crane: Crane, case: Scenario) -> float:
        return shape(crane, case)[0] * crane.control.t_cycle

    def names(self, crane: Crane, case: Scenario) -> tuple[str, ...]:
        return numbers_of(crane)

    def as_bytes(self, cases: Sequence[Scenario]) -> list[bytes]:
        return [json.dumps(bare(case.to_dict()), sort_keys=True).encode() for case in cases]

    def dataset(
        self,
        crane: Crane | Sequence[Crane],
        cases: Sequence[Scenario],
        summaries: Sequence[Summary],
        *,
        step: float,
        single: bool,
        runs: Sequence[Run],
    ) -> xarray.Dataset:
        attrs = {
            "title": f"Stillhook run of {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}",
            "crane": crane_toml(crane) if isinstance(crane, Crane) else json.dumps([crane_toml(c) for c in crane]),
            "twin": twin_line(crane if isinstance(crane, Crane) else crane[0]),
            "scenarios": json.dumps([c.to_dict() for c in (cases[:1] if _one_for_all(crane, cases) else cases)]),
        }
        coords = {} if single else {"case": _labels(crane, cases)}
        columns = summary_columns(summaries, single=single)
        data = labelled(columns, coords, attrs, step=step, single=single, runs=runs)
        return data.assign_attrs(window_full=int(all(c.duration - c.warm_up >= WINDOW for c in cases)))
