"""Cells of the twin's tier: runs of a phase in one sea under one way of running the winch, asked together and kept by
what they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.lowering.problem import Case
from stillhook.engine.simulate import simulate
from stillhook.kernels.lanes import VL
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase, PhaseKind
from stillhook.plan.definition.rules import Seas
from stillhook.plan.tiers.frequency import forcing_at, situations
from stillhook.plan.tiers.time_domain.lowering import (
    Course,
    SeaState,
    Winch,
    course_of,
    in_sea,
    lowering_of,
    machine_of,
)
from stillhook.plan.tiers.time_domain.quantities import run_numbers
from stillhook.plan.tiers.winch_residual import BRAKE
from stillhook.response.frequency_domain import sigmas
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.scenario import Mode

REACH = 150.0
"""Depth down to which waves may be felt, for guessing which runs share a block [m]."""
ABOUT_WORST = 0.9
"""Part of the swing of the sling tension at the worst height from which a height counts as one like it."""


class CellRequest(NamedTuple):
    """A cell that is wanted, with so many seeds (1, 2, ...); a calm with one run."""

    phase: str
    winch: Winch
    spot: SeaState
    seeds: int

    @property
    def cell(self) -> tuple[str, Winch, SeaState]:
        """What it is kept by."""
        return self.phase, self.winch, self.spot


@dataclass(frozen=True)
class Execution:
    """How runs are shared out: folder of the store, client of a cluster, threads."""

    store: Any = None
    client: Any = None
    threads: int = 2


@dataclass(eq=False)
class Cells:
    """All runs of a plan so far. runs: (phase, winch, sea) -> numbers of
    `stillhook.plan.tiers.time_domain.quantities.Runs` of every seed (n,); n_runs, and seconds of them, that were asked
    for (from the store or not)."""

    plan: LiftPlan
    execution: Execution
    runs: dict[tuple[str, Winch, SeaState], dict[str, FloatArray]] = field(default_factory=dict)
    n_runs: int = 0
    n_failed: int = 0
    seconds: float = 0.0
    _machines: dict[Winch, tuple[Crane, Mode]] = field(default_factory=dict)
    _courses: dict[tuple[str, Winch, float, float], Course] = field(default_factory=dict)
    _calm: dict[tuple[Winch, str, Course], Lowering] = field(default_factory=dict)
    _heights: dict[tuple[str, Winch, float, float], set[float]] = field(default_factory=dict)
    _still: dict[tuple[Winch, Course], dict[str, FloatArray]] = field(default_factory=dict)
    _worst: dict[str, dict[tuple[float, float], tuple[float, float]]] = field(default_factory=dict)

    def course(self, phase: Phase, winch: Winch, spot: SeaState) -> Course:
        """What is run of a phase in the seas of a column: about its worst height where it is a long way."""
        key = (phase.name, winch, spot.Tp, spot.beta)
        if key not in self._courses:
            z, about = self._worst_of(phase).get((spot.Tp, spot.beta), (None, None))
            self._courses[key] = course_of(self.plan, phase, winch, z, about)
        return self._courses[key]

    def request(self, wanted: Sequence[CellRequest], progress: Progress | None = None) -> None:
        """Run what is wanted and not there yet, all of it together."""
        missing = {request.cell: request for request in wanted if request.seeds > len(self._durations(request))}
        calms = {
            request.cell: (request.winch, self._course_of(request))
            for request in missing.values()
            if request.spot.Hs <= 0.0
        }
        first = {still: cell for cell, still in reversed(calms.items()) if still not in self._still}
        missing = {
            cell: request for cell, request in missing.items() if cell not in calms or first.get(calms[cell]) == cell
        }
        self._run(self._filled(missing), progress)
        self._still |= {still: self.runs[cell] for still, cell in first.items()}
        self.runs |= {cell: self._still[still] for cell, still in calms.items()}
        for phase, winch, spot in (request.cell for request in wanted):
            self._heights.setdefault((phase, winch, spot.Tp, spot.beta), set()).add(spot.Hs)

    def _filled(
        self, missing: Mapping[tuple[str, Winch, SeaState], CellRequest]
    ) -> dict[tuple[str, Winch, SeaState], CellRequest]:
        """The same cells with some seeds more, where blocks of runs side by side would else have empty places: they
        cost nothing."""
        groups: dict[tuple[float, int, bool], list[tuple[str, Winch, SeaState]]] = {}
        for cell, request in missing.items():
            if request.spot.Hs > 0.0:
                course = self._course_of(request)
                groups.setdefault((course.duration, len(course.programme), course.z_top > -REACH), []).append(cell)
        full = dict(missing)
        for group in groups.values():
            runs = sum(missing[cell].seeds - len(self._durations(missing[cell])) for cell in group)
            for k in range(-runs % VL):
                cell = group[k % len(group)]
                full[cell] = full[cell]._replace(seeds=full[cell].seeds + 1)
        return full

    def heights(self, phase: str, winch: Winch, Tp: float, beta: float) -> FloatArray:
        """Heights that were run in a column, ascending [m]."""
        return np.array(sorted(self._heights.get((phase, winch, Tp, beta), ())))

    def _run(self, missing: Mapping[tuple[str, Winch, SeaState], CellRequest], progress: Progress | None) -> None:
        """Run cells that are not there yet."""
        if not missing:
            return
        cases: list[Case] = []
        cranes: list[Crane] = []
        sizes: list[int] = []
        for request in missing.values():
            crane, made = self._cases(request)
            cases += made
            cranes += [crane] * len(made)
            sizes.append(len(made))
        data = simulate(
            cranes,
            cases,
            on_failure="mark",
            store=self.execution.store,
            client=self.execution.client,
            threads=self.execution.threads,
            progress=progress,
        )
        counts = [
            self._course_of(request).counts
            for request, size in zip(missing.values(), sizes, strict=True)
            for _ in range(size)
        ]
        numbers = run_numbers(data, counts)
        self.n_failed += int(np.sum(~np.isfinite(numbers["duration"])))
        start = 0
        for request, size in zip(missing.values(), sizes, strict=True):
            new = {name: values[start : start + size] for name, values in numbers.items()}
            old = self.runs.get(request.cell)
            self.runs[request.cell] = (
                new if old is None else {name: np.concatenate((old[name], values)) for name, values in new.items()}
            )
            start += size

    def _course_of(self, request: CellRequest) -> Course:
        return self.course(self.plan.phase(request.phase), request.winch, request.spot)

    def _durations(self, request: CellRequest) -> FloatArray:
        runs = self.runs.get(request.cell)
        return np.zeros(0) if runs is None else runs["duration"]

    def _cases(self, request: CellRequest) -> tuple[Crane, list[Case]]:
        """Runs of a cell that are still missing."""
        phase, course = self.plan.phase(request.phase), self._course_of(request)
        if request.winch not in self._machines:
            self._machines[request.winch] = machine_of(self.plan, request.winch)
        crane, mode = self._machines[request.winch]
        calm = self._calm.setdefault((request.winch, phase.name, course), lowering_of(self.plan, phase, course, mode))
        first = len(self._durations(request)) + 1
        self.n_runs += request.seeds - first + 1
        self.seconds += course.duration * (request.seeds - first + 1)
        if request.spot.Hs <= 0.0:
            return crane, [calm]
        one = in_sea(self.plan, phase, request.winch, course, calm, request.spot, first)
        return crane, [replace(one, seed=seed) for seed in range(first, request.seeds + 1)]

    def _worst_of(self, phase: Phase) -> dict[tuple[float, float], tuple[float, float]]:
        """(Tp, beta) -> height at which the load swings most on its wire, the winch on its brake [m], and time spent
        about there [s]."""
        if phase.kind is not PhaseKind.LOWERING:
            return {}
        if phase.name not in self._worst:
            self._worst[phase.name] = worst_heights(self.plan, phase)
        return self._worst[phase.name]


def worst_heights(plan: LiftPlan, phase: Phase) -> dict[tuple[float, float], tuple[float, float]]:
    """(Tp, beta) -> height of a phase's way at which the sling tension swings most with the winch on its brake [m], by
    the frequency-domain method in seas of middle height, and the time that the payload is where it swings hardly less
    [s]."""
    columns = plan.environment.table().columns()
    Tp, beta = (np.array([column[i] for column in columns]) for i in (0, 1))
    seas = Seas(np.full(len(Tp), float(np.median(plan.environment.Hs))), Tp, beta)
    parts, at = situations(plan, phase), plan.tip_of(phase)
    forcing = forcing_at(plan, seas, at.x, at.y)
    swing = np.array([sigmas(forcing, p.load, BRAKE).sling for p in parts])
    time = np.array([p.time for p in parts])
    worst = np.argmax(swing, axis=0)
    about = (time[:, None] * (swing >= ABOUT_WORST * swing.max(axis=0))).sum(axis=0)
    return {
        (float(T), float(b)): (parts[int(i)].z, float(t)) for T, b, i, t in zip(Tp, beta, worst, about, strict=True)
    }
