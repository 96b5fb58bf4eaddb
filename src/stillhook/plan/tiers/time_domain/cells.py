"""Cells of the twin's tier: runs of a phase in one sea under one way of running the winch, requested together and
stored by their inputs."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.base.progress import Progress
from stillhook.engine.lowering.case import Case
from stillhook.engine.lowering.summary import PEAK_INTERVAL as INTERVAL
from stillhook.engine.runner import Ending
from stillhook.engine.simulate import End, simulate, stored_places
from stillhook.errors import LiftError
from stillhook.kernels.lanes import VL
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Seas
from stillhook.plan.result import grouped
from stillhook.plan.tiers.closed_form import slings_held
from stillhook.plan.tiers.frequency import forcing_at
from stillhook.plan.tiers.situations import situations
from stillhook.plan.tiers.time_domain.lowering import (
    Course,
    SeaState,
    Winch,
    course_of,
    in_sea,
    lowering_of,
    machine_of,
    sampling_of,
    step_of,
)
from stillhook.plan.tiers.winch_residual import BRAKE
from stillhook.response.frequency_domain import sigmas
from stillhook.sea.vessel.boom import TipPoint
from stillhook.spec.crane import Crane
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.variables import WINDOW
from stillhook.winches.load_path.registry import UNITS

if TYPE_CHECKING:
    import xarray


Runs = Mapping[str, FloatArray]
"""Name of `OF_STAGE`, or v_landed -> that number of every run (n,)."""

OF_STAGE = (
    "duration",
    "s_tip_pp",
    "e_c_pp",
    "load_pp",
    "F_w_max",
    "DAF",
    "F_sling_min",
    "sling_slack_time",
    "snap",
    "v_tip_max",
    "v_w_max",
    "p_a_max",
    "saturation_time",
    "oscillation_time",
    "relief_time",
    "power_time",
    "stroke_time",
)
"""Numbers that are kept of the phase that counts, where the winch type has them; in addition of the whole run
`v_landed`, the speed of the first touch, which may come before its phase is over, `v_hit`, that of the fastest, and off
a deck `v_again`, that of the fastest second hit, 0 without one, and `z_clear`, the least height over it, NaN where deck
and payload never came closer again."""

ROD_AT_END = "rod_end_time"
"""Time with the rod of a passive heave compensator at either end of its stroke in the phase that counts [s]."""
ENDS = tuple(dict.fromkeys(f"phase_{name}" for unit in UNITS.values() for name in unit.STOPS))

STATIONARY = (PhaseKind.IN_AIR, PhaseKind.LOWERING, PhaseKind.DEEP)
"""Phases of which every interval is like the others: all of their peaks count, not the largest of a run alone. Of a
payload that is held the runs' own largest values count: waves that slam are rare, and most peaks do not show them
(docs/explanation/limits-by-runs.md)."""
PEAKS = "peaks "
"""Begins the name of the largest values of all intervals of a run (n, k)."""
OF_INTERVAL = ("F_w_max", "DAF", "F_sling_min", "v_tip_max", "v_w_max", "e_c_pp", "s_tip_pp", "load_pp")


def run_numbers(
    data: xarray.Dataset, counts: Sequence[int], intervals: Sequence[int] | None = None
) -> dict[str, FloatArray]:
    """Numbers of every run of a Dataset of lowerings over "case"; counts: number of the phase that counts in each;
    intervals: how many intervals of it count, 0 for none."""
    each = np.arange(len(counts)), np.array(counts)
    numbers = {name: data[f"phase_{name}"].values[each] for name in OF_STAGE if f"phase_{name}" in data}
    if ends := [name for name in ENDS if name in data]:
        numbers[ROD_AT_END] = np.sum([data[name].values[each] for name in ends], axis=0)
    if intervals is not None and max(intervals, default=0) > 0:
        numbers |= _peaks(data, each, max(intervals))
    nothing = np.full(len(counts), np.nan)
    again, clear = (data[name].values if name in data else nothing for name in ("v_second_hit_max", "z_clear_min"))
    numbers |= {"v_hit": data["v_hit_max"].values, "v_again": np.nan_to_num(again), "z_clear": clear}
    return numbers | {"v_landed": data["v_landed"].values}


def _peaks(data: xarray.Dataset, each: tuple[IntArray, IntArray], k: int) -> dict[str, FloatArray]:
    """Largest values of k intervals that begin in the phase that counts (n, k); of windows, those that are whole."""
    dt = data["peak_interval"].values
    begin = np.nan_to_num(np.ceil(data["phase_t_begin"].values[each] / dt - 1e-6)).astype(int)
    late = round(WINDOW / float(dt.min()))
    result = {}
    for name in OF_INTERVAL:
        source = "F_sling_max" if name == "DAF" else name
        skip = late if name.endswith("_pp") else 0
        table = data[f"peak_{source}"].values
        columns = np.minimum(begin[:, None] + skip + np.arange(k - skip), table.shape[1] - 1)
        values = np.take_along_axis(table, columns, axis=1)
        if name == "DAF":
            values = values * (data["phase_DAF"].values[each] / data["phase_F_sling_max"].values[each])[:, None]
        result[PEAKS + name] = values
    return result


SEEDS = 1000
"""Seeds of one sea: more runs than a cell has."""


def seed_of(spot: SeaState, k: int, seed: int = 0) -> int:
    """Seed of run number k of a sea: the same waves for every alternative, and others in every other sea, so that the
    runs of neighbours add to each other. A swell alone is one sea in all columns. seed: other waves everywhere."""
    sea = tuple(round(float(x), 6) for x in spot) if spot.Hs > 0.0 else ()
    which = (*sea, seed) if seed else sea
    return SEEDS * (1 + zlib.crc32(repr(which).encode()) % SEEDS**2) + k if which else k


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
    """How runs are made: folder of the store, client of a dask.distributed cluster, threads; seed of the waves."""

    store: Any = None
    client: Any = None
    threads: int = 2
    seed: int = 0


_Cell = tuple[str, Winch, SeaState]
"""What a cell is kept by."""
_Still = tuple[Winch, Course, TipPoint]
"""What the runs of a calm are kept by."""


@dataclass(eq=False)
class Cells:
    """All runs of a plan so far. waves: sea whose random numbers all others take, None for those of each. runs: (phase,
    winch, sea) -> numbers of `stillhook.plan.tiers.time_domain.cells.Runs` of every seed (n,); requests so far; n_runs,
    and seconds of them, that were requested (from the store or not)."""

    plan: LiftPlan
    execution: Execution
    waves: SeaState | None = None
    runs: dict[tuple[str, Winch, SeaState], dict[str, FloatArray]] = field(default_factory=dict)
    requests: int = 0
    n_runs: int = 0
    n_failed: int = 0
    seconds: float = 0.0
    _heights: dict[tuple[str, Winch, float, float], set[float]] = field(default_factory=dict)
    _still: dict[_Still, dict[str, FloatArray]] = field(default_factory=dict)

    def course(self, phase: Phase, winch: Winch, spot: SeaState) -> Course:
        """What is run of a phase in the seas of a column: about its worst height where it is a long way."""
        worst = self.plan.once(worst_places, phase)
        return winch.hangs(self.plan).once(course_of, phase, winch, *worst.get((spot.Tp, spot.beta), (None, None)))

    def request(self, wanted: Sequence[CellRequest], progress: Progress | None = None) -> None:
        """Run what is wanted and not there yet, all of it together."""
        request_together([(self, wanted)], progress)

    def _missing(
        self, wanted: Sequence[CellRequest]
    ) -> tuple[list[CellRequest], dict[_Cell, _Still], dict[_Still, _Cell]]:
        """What has to be run of what is wanted, the calms among it, and of those that are alike the one that is run."""
        self.requests += 1
        missing = {request.cell: request for request in wanted if request.seeds > len(self._durations(request))}
        calms = {
            request.cell: (request.winch, self._course_of(request), self.plan.tip_of(self.plan.phase(request.phase)))
            for request in missing.values()
            if request.spot.Hs <= 0.0
        }
        first = {still: cell for cell, still in reversed(calms.items()) if still not in self._still}
        missing = {
            cell: request for cell, request in missing.items() if cell not in calms or first.get(calms[cell]) == cell
        }
        return list(self._filled(missing).values()), calms, first

    def _keep(
        self, wanted: Sequence[CellRequest], calms: Mapping[_Cell, _Still], first: Mapping[_Still, _Cell]
    ) -> None:
        """Calms for all cells that share them, and the heights that were run."""
        self._still |= {still: self.runs[cell] for still, cell in first.items()}
        self.runs |= {cell: self._still[still] for cell, still in calms.items()}
        for phase, winch, sea_state in (request.cell for request in wanted):
            self._heights.setdefault((phase, winch, sea_state.Tp, sea_state.beta), set()).add(sea_state.Hs)

    def _filled(
        self, missing: Mapping[tuple[str, Winch, SeaState], CellRequest]
    ) -> dict[tuple[str, Winch, SeaState], CellRequest]:
        """The same cells with more seeds where blocks of runs side by side had empty places: they cost nothing."""
        in_waves = [(self._course_of(request), cell) for cell, request in missing.items() if request.spot.Hs > 0.0]
        groups = grouped(
            ((course.duration, len(course.programme), course.z_top > -REACH), cell) for course, cell in in_waves
        )
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

    def _put(self, made: Sequence[tuple[CellRequest, int]], data: xarray.Dataset) -> None:
        """Numbers of new runs, cell by cell with how many they are, to those that are there."""
        each = [request for request, n in made for _ in range(n)]
        counts = [self._course_of(request).counts for request in each]
        numbers = run_numbers(data, counts, [self._intervals(request) for request in each])
        self.n_failed += int(np.sum(~np.isfinite(numbers["duration"])))
        start = 0
        for request, n in made:
            rows, k, late = slice(start, start + n), self._intervals(request), round(WINDOW / INTERVAL)
            new = {
                name: values[rows, : k - late if name.endswith("_pp") else k]
                if name.startswith(PEAKS)
                else values[rows]
                for name, values in numbers.items()
                if k > late or not name.startswith(PEAKS)
            }
            old = self.runs.get(request.cell)
            self.runs[request.cell] = (
                new if old is None else {name: np.concatenate((old[name], values)) for name, values in new.items()}
            )
            start += n

    def simulated(
        self, cranes: Sequence[Crane], cases: Sequence[Case], progress: Progress | None = None
    ) -> xarray.Dataset:
        """Runs as the plan makes them. Errors: LiftError where one is refused: it is the plan that cannot be."""
        data = simulate(
            cranes,
            cases,
            **self.options,
            on_failure="mark",
            store=self.execution.store,
            client=self.execution.client,
            threads=self.execution.threads,
            progress=progress,
        )
        refused = data["status"].values == Ending.REFUSED
        if refused.any():
            raise LiftError(str(data["notes"].values[refused][0]).removeprefix("refused: "))
        return data

    @property
    def options(self) -> dict[str, Any]:
        """How a run is made: step, sampling, and where it ends."""
        step, sampling = self.plan.once(step_of), sampling_of(self.plan)
        return {"step": f"{step!r} s", "sampling": f"{sampling!r} s", "end": End.PROGRAMME}

    def stored(self, request: CellRequest) -> tuple[list[int], Runs]:
        """Runs of a cell that the store holds, by their numbers from 1 up to `request.seeds`, and what they gave;
        nothing is run."""
        crane, cases = self.cases(request, range(1, request.seeds + 1))
        places = stored_places(crane, cases, store=self.execution.store, **self.options)
        if not places:
            return [], {}
        data = self.simulated([crane] * len(places), [cases[i] for i in places])
        return [i + 1 for i in places], run_numbers(data, [self._course_of(request).counts] * len(places))

    def _intervals(self, request: CellRequest) -> int:
        """Whole intervals of a run that count, whenever the part that counts begins; 0 where its peaks do not."""
        if self.plan.phase(request.phase).kind not in STATIONARY or self.plan.environment.calm(request.spot.Hs):
            return 0
        return max(int(self._course_of(request).counted / INTERVAL + 1e-6) - 1, 0)

    def _course_of(self, request: CellRequest) -> Course:
        return self.course(self.plan.phase(request.phase), request.winch, request.spot)

    def _durations(self, request: CellRequest) -> FloatArray:
        runs = self.runs.get(request.cell)
        return np.zeros(0) if runs is None else runs["duration"]

    def _cases(self, request: CellRequest) -> tuple[Crane, list[Case]]:
        """Runs of a cell that are still missing."""
        first = len(self._durations(request)) + 1
        self.n_runs += request.seeds - first + 1
        self.seconds += self._course_of(request).duration * (request.seeds - first + 1)
        return self.cases(request, range(first, request.seeds + 1))

    def cases(self, request: CellRequest, numbers: Sequence[int]) -> tuple[Crane, list[Case]]:
        """Crane and runs of a cell, by their numbers from 1; the one of a calm."""
        phase, course = self.plan.phase(request.phase), self._course_of(request)
        crane, mode = self.plan.once(machine_of, request.winch)
        calm = request.winch.hangs(self.plan).once(lowering_of, phase, course, mode)
        if self.plan.environment.calm(request.spot.Hs):
            return crane, [calm]
        seeds = [seed_of(self.waves or request.spot, k, self.execution.seed) for k in numbers]
        one = in_sea(self.plan, phase, request.winch, course, calm, request.spot, seeds[0])
        return crane, [replace(one, seed=seed) for seed in seeds]


def request_together(pairs: Sequence[tuple[Cells, Sequence[CellRequest]]], progress: Progress | None = None) -> None:
    """Run what is wanted of several plans and not there yet, all of it together, as the first of them makes its
    runs."""
    missing = [cells._missing(wanted) for cells, wanted in pairs]
    made = [[(each, *cells._cases(each)) for each in new] for (cells, _), (new, *_) in zip(pairs, missing, strict=True)]
    runs = [(crane, case) for part in made for _, crane, cases in part for case in cases]
    data = pairs[0][0].simulated([crane for crane, _ in runs], [case for _, case in runs], progress) if runs else None
    start = 0
    for (cells, wanted), (_, calms, first), part in zip(pairs, missing, made, strict=True):
        sizes = [(each, len(cases)) for each, _, cases in part]
        n = sum(size for _, size in sizes)
        if data is not None and n:
            cells._put(sizes, data.isel(case=slice(start, start + n)))
        cells._keep(wanted, calms, first)
        start += n


def worst_places(plan: LiftPlan, phase: Phase) -> dict[tuple[float, float], tuple[float, float]]:
    """(Tp, beta) -> height of a phase's way about which it is run [m], and time there [s]; empty where all of it is."""
    if phase.kind is PhaseKind.LOWERING:
        return worst_heights(plan, phase)
    return worst_submergences(plan, phase) if phase.held else {}


def worst_submergences(plan: LiftPlan, phase: Phase) -> dict[tuple[float, float], tuple[float, float]]:
    """(Tp, beta) -> height in the wave zone at which a held payload leaves its slings the least tension [m], and the
    time that it is held [s].

    By the simplified method, in the lowest sea of the column in which it finds them slack: about the limit. In higher
    seas slamming takes over, in lower ones drag and inertia of a payload that is covered.
    """
    seas = plan.environment.table()
    z, slings = slings_held(plan, phase, seas)
    worst: dict[tuple[float, float], tuple[float, float]] = {}
    for Tp, beta, rows in seas.columns:
        least = slings[:, rows].min(axis=0)
        row = int(np.argmax(least <= 0.0)) if (least <= 0.0).any() else len(least) - 1
        worst[float(Tp), float(beta)] = float(z[np.argmin(slings[:, rows][:, row])]), phase.duration or 0.0
    return worst


def worst_heights(plan: LiftPlan, phase: Phase) -> dict[tuple[float, float], tuple[float, float]]:
    """(Tp, beta) -> height of a phase's way at which the sling tension varies most with the winch on its brake [m], by
    the frequency-domain method in seas of middle height, and the time that the payload is where it swings hardly less
    [s]."""
    columns = plan.environment.table().columns
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


def merged(wanted: Sequence[CellRequest]) -> list[CellRequest]:
    """Each cell once, with the most seeds that any line wants."""
    most: dict[Any, CellRequest] = {}
    for ask in wanted:
        if ask.cell not in most or most[ask.cell].seeds < ask.seeds:
            most[ask.cell] = ask
    return list(most.values())
