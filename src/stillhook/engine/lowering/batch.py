"""Thousands of lowerings, numbers alone, in bounded memory: shared by threads or a cluster, kept in a store as they
finish."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook import units
from stillhook.base.progress import Progress
from stillhook.engine.arguments import steps_per_cycle
from stillhook.engine.batch import Row, check_each, run_batch
from stillhook.engine.lowering.checks import check_lift, check_sea
from stillhook.engine.lowering.lower import LIFT_STEP, Summarised, summarised
from stillhook.engine.lowering.run import KIND, run_lowerings, waves_step
from stillhook.engine.lowering.summary import lift_summary, run_numbers_of, stage_numbers_of
from stillhook.engine.store import bare
from stillhook.errors import LiftError, SpecError
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.lift.in_sea import InSea
from stillhook.spec.lift.lowering import Lowering
from stillhook.winches.registry import WinchType

if TYPE_CHECKING:
    import xarray

Case = Lowering | InSea


def lower_many(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Case],
    *,
    store: str | Path | None = None,
    client: Any = None,
    threads: int = 2,
    step: str | None = None,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """The numbers of many lowerings, the same to the last bit as those of `lower`; a case that loses its numbers is
    marked.

    Parameters
    ----------
    crane: that of all cases, or one for each; several are of one winch type and have one PLC cycle.
    cases: lowerings, or `InSea`, whose tip and water are made as they are run; cases that are moved alike are best run
    together, whatever their order here.
    store: folder in which results are kept as they finish, under what they follow from, so that a run that was killed
    goes on where it stood. client: a dask.distributed Client; its workers then share the work, and threads is not used.
    threads, step: as in `lower`. progress: called with the share done, 0..1.

    Returns
    -------
    Dataset over "case" with status, notes and numbers of each run, and those of its stages in "stage_..." over the
    dimension "stage".

    Errors: LiftError, ScenarioError, SpecError of the first case that cannot be run; SimulationError where store or
    cluster fail.
    """
    cases, cranes = _cases(cases), _cranes(crane, cases)
    n_sub = steps_per_cycle(cranes[0], step, LIFT_STEP)
    rows = run_batch(
        LoweringProblem(), cranes, cases, n_sub=n_sub, threads=threads, store=store, client=client, progress=progress
    )
    numbers = [_parted(cranes[0].plant.type, row, _stages(case)) for row, case in zip(rows, cases, strict=True)]
    h = cranes[0].control.t_cycle / n_sub
    return summarised(
        crane if isinstance(crane, Crane) else cranes, [_lift(c) for c in cases], numbers, step=h, single=False
    )


def _cases(cases: Sequence[Case]) -> list[Case]:
    lifts = list(cases) if isinstance(cases, Iterable) else [cases]
    if not lifts:
        raise LiftError("lower_many: the list of lowerings is empty. Give at least one.")
    for i, each in enumerate(lifts):
        if not isinstance(each, Lowering | InSea):
            raise LiftError(
                f"lowering {i} = {units.quote(each)}: not a Lowering. Give lowerings, or lowerings in a sea (InSea)."
            )
    return lifts


def _cranes(crane: Crane | Sequence[Crane], cases: Sequence[Case]) -> list[Crane]:
    cranes = (
        [crane] * len(cases) if isinstance(crane, Crane) else list(crane) if isinstance(crane, Iterable) else [crane]
    )
    if len(cranes) != len(cases):
        raise LiftError(
            f"lower_many: {len(cranes)} cranes and {len(cases)} lowerings. Give one crane, or one for each lowering."
        )
    first = cranes[0]
    for i, each in enumerate(cranes):
        if not isinstance(each, Crane):
            raise SpecError(f"crane = {units.quote(each)}: not a Crane. Read one with load_crane, by name or path.")
        if each.plant is not first.plant or each.control.t_cycle != first.control.t_cycle:
            raise SpecError(
                f'lower_many: crane {i} "{each.name}" has another winch type or PLC cycle than "{first.name}". Run them'
                " apart."
            )
    return cranes


class LoweringProblem:
    """Lowerings as a batch runs them: alone, or in a sea that is made when it is run."""

    kind = KIND

    def check(self, cranes: Sequence[Crane], cases: Sequence[Case]) -> None:
        """Lifts that many seas share are looked at once."""
        seen: set[tuple[int, int]] = set()

        def check(crane: Crane, case: Case) -> None:
            lift = _lift(case)
            check_sea(lift)
            if (id(crane), id(lift)) not in seen:
                check_lift(crane, lift)
                seen.add((id(crane), id(lift)))

        check_each(cranes, cases, check)

    def group(self, crane: Crane, case: Case) -> tuple[float, int, float, int]:
        lift = _lift(case)
        water = case.spacing if isinstance(case, InSea) else waves_step(lift.waves)
        return lift.duration, lift.wire.nodes, water, _stages(case)

    def seconds(self, crane: Crane, case: Case) -> float:
        return _lift(case).duration

    def sort(self, places: list[int], cases: Sequence[Case]) -> list[int]:
        """What is moved alike lies together, in the order of first use."""
        motions = {i: c.motion if isinstance(c := cases[i], InSea) else b"" for i in places}
        first = {motion: k for k, motion in reversed(list(enumerate(motions.values())))}
        return sorted(places, key=lambda i: first[motions[i]])

    def columns(self, crane: Crane, case: Case) -> tuple[str, ...]:
        """Names of all numbers in one row: of the run, then of each stage."""
        winch = crane.plant.type
        of_stages = (f"{i} {name}" for i in range(_stages(case)) for name in stage_numbers_of(winch))
        return (*run_numbers_of(winch), *of_stages)

    def identity(self) -> Callable[[Case], bytes]:
        return _Texts()

    def run(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Case],
        *,
        n_sub: int,
        places: Sequence[int] | None,
        progress: Progress,
    ) -> list[Row]:
        lifts = _made(cases)
        results = run_lowerings(
            cranes, lifts, n_sub=n_sub, lanes=VL, every=0, threads=1, progress=progress, places=places
        )
        rows = []
        for crane, lift, result in zip(cranes, lifts, results, strict=True):
            run, stages = lift_summary(crane, lift, result)
            winch = crane.plant.type
            numbers = [run[name] for name in run_numbers_of(winch)]
            numbers += [stage[name] for stage in stages for name in stage_numbers_of(winch)]
            rows.append(Row(run["status"], [float(x) for x in numbers], tuple(run["notes"])))
        return rows


def _lift(case: Case) -> Lowering:
    return case.lift if isinstance(case, InSea) else case


def _stages(case: Case) -> int:
    """Rows of stages in the answer: those of the programme, and the time after it."""
    return len(_lift(case).programme) + 1


def _parted(winch: WinchType, row: Mapping[str, Any], stages: int) -> Summarised:
    """A row of the columns with status and notes, as numbers of the run and of each stage."""
    run = {"status": row["status"], **{name: row[name] for name in run_numbers_of(winch)}, "notes": row["notes"]}
    return run, [{name: row[f"{i} {name}"] for name in stage_numbers_of(winch)} for i in range(stages)]


def _made(cases: Sequence[Case]) -> list[Lowering]:
    """Lowerings of a block; tip and water of those that are moved alike are made once."""
    made: dict[bytes, Lowering] = {}
    out: list[Lowering] = []
    for case in cases:
        if isinstance(case, Lowering):
            out.append(case)
            continue
        motion = case.motion
        first = made.setdefault(motion, case.made()) if motion not in made else made[motion]
        out.append(case.lift.model_copy(update={"tip": first.tip, "waves": first.waves}))
    return out


class _Texts:
    """A case as bytes: everything but names and sources, which change no number; lifts that cases share are written
    once.

    Names of stages stay in, because notes tell them.
    """

    def __init__(self) -> None:
        self.lifts: dict[int, bytes] = {}

    def __call__(self, case: Case) -> bytes:
        lift = _lift(case)
        if id(lift) not in self.lifts:
            self.lifts[id(lift)] = _print(lift)
        return self.lifts[id(lift)] + (case.motion if isinstance(case, InSea) else b"")


def _print(lift: Lowering) -> bytes:
    plain = lift.model_dump(
        mode="json",
        exclude={"name": True, "tip": True, "waves": True, "payload": {"name", "title", "source", "sources"}},
    )
    content = json.dumps({**plain, "tip": bare(lift.tip.to_dict())}, sort_keys=True).encode()
    if (w := lift.waves) is not None:
        water = (np.array([w.dt, w.z_0, w.ds]), w.eta, w.eta_dot, w.w, w.a)
        content += hashlib.sha256(b"".join(a.tobytes() for a in water)).digest()
    return content
