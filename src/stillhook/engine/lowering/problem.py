"""Lowerings as a problem of the engine (`stillhook.engine.batch`), and their labelled Dataset."""

from __future__ import annotations

import collections
import functools
import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, Unpack

import numpy as np

from stillhook.engine.arguments import Series, labelled, summary_columns
from stillhook.engine.batch import Row, bare
from stillhook.engine.lowering.checks import check_lift, check_sea
from stillhook.engine.lowering.run import (
    PEAKS,
    LiftResult,
    longest_step,
    peak_interval,
    run_lowerings,
    setup_of,
    waves_step,
)
from stillhook.engine.lowering.summary import lift_summary, run_numbers_of, stage_numbers_of
from stillhook.engine.runner import Ending, RunOptions, each_case
from stillhook.kernels.build import Setup
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.phase import phase_names
from stillhook.spec.lift.stored import lowerings_text
from stillhook.variables import attributes
from stillhook.winches.joints.registry import joint_of
from stillhook.winches.registry import WINCH_TYPES

if TYPE_CHECKING:
    import xarray


def _cranes(crane: Crane | Sequence[Crane]) -> dict[str, Any]:
    """What a Dataset says of its cranes: the one, or each once and the number of that of every case."""
    if isinstance(crane, Crane):
        return {"crane": crane_toml(crane)}
    each = {id(c): c for c in crane}
    number = {key: i for i, key in enumerate(each)}
    return {
        "crane": json.dumps([crane_toml(c) for c in each.values()]),
        "crane_of_case": [number[id(c)] for c in crane],
    }


Case = Lowering | InSea
T = TypeVar("T")

LIFT_STEP = 5e-3
"""Default step [s]: the wire is stepped implicitly, and the winch at 5 ms is right to 0.1 mm of wire
(docs/validation/step-size.md)."""
SHORTEST_STEP = 1e-3
"""Shortest step that is taken unasked [s]: where a winch asks for less, one of its numbers is rather wrong."""


def lift_step(longest: float) -> float:
    """The default step of lifts that ask for `longest` at the most [s]."""
    return min(LIFT_STEP, max(longest, SHORTEST_STEP))


def _each_lift(cranes: Sequence[Crane], cases: Sequence[Case], look: Callable[[Crane, Lowering], T]) -> list[T]:
    """What `look` says of every lift; those that many seas share are looked at once. Errors: as `each_case`."""
    seen: dict[tuple[int, int], T] = {}

    def once(crane: Crane, case: Case) -> None:
        lift = _lift(case)
        if (key := (id(crane), id(lift))) not in seen:
            seen[key] = look(crane, lift)

    each_case(cranes, cases, once)
    return list(seen.values())


class LoweringProblem:
    """Lowerings as a batch runs them: alone, or in a sea that is made when it is run. sampled: statistics are taken
    every so many PLC cycles; short: runs end with their programme."""

    def __init__(self, sampled: int = 1, *, short: bool = False) -> None:
        self.sampled, self.short = sampled, short

    def setup(self, case: Case) -> Setup:
        return setup_of(_lift(case))

    def check(self, cranes: Sequence[Crane], cases: Sequence[Case]) -> None:
        def check(crane: Crane, lift: Lowering) -> None:
            check_sea(lift)
            check_lift(crane, lift)

        _each_lift(cranes, cases, check)

    def default_step(self, cranes: Sequence[Crane], cases: Sequence[Case], *, series: bool) -> float:
        """A shorter one where a stiff winch asks for it."""
        return lift_step(min(_each_lift(cranes, cases, longest_step)))

    def group(self, crane: Crane, case: Case) -> tuple[float, int, float, int, str]:
        lift = _lift(case)
        water = case.spacing if isinstance(case, InSea) else waves_step(lift.waves)
        return lift.duration, lift.wire.nodes, water, _stages(case), joint_of(lift.compensator)

    def seconds(self, crane: Crane, case: Case) -> float:
        return _lift(case).duration

    def sort(self, places: list[int], cases: Sequence[Case]) -> list[int]:
        """Cases with the same motion next to each other, in the order of first use."""
        motions = {i: c.motion if isinstance(c := cases[i], InSea) else b"" for i in places}
        first = {motion: k for k, motion in reversed(list(enumerate(motions.values())))}
        return sorted(places, key=lambda i: first[motions[i]])

    def columns(self, crane: Crane, case: Case) -> tuple[str, ...]:
        """Names of all numbers in one row: of the run, then of each stage."""
        winch = crane.plant.type
        return _columns(winch.name, _stages(case), _intervals(case), _joints([case]))

    def identity(self) -> Callable[[Case], bytes]:
        return _Texts(b"%d%s " % (self.sampled, b" short" * self.short))

    def results(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Case],
        **options: Unpack[RunOptions],
    ) -> list[LiftResult]:
        """Lifts are packed once for all that share them; waves are checked here, where they are made."""
        return run_lowerings(cranes, _lowerings(cases), sampled=self.sampled, short=self.short, **options)

    def row(self, crane: Crane, case: Case, result: LiftResult) -> Row:
        run, stages = lift_summary(crane, _lift(case), result)
        winch = crane.plant.type
        joints = _joints([case])
        numbers = [run[name] for name in run_numbers_of(winch, joints=joints)]
        numbers += [stage[name] for stage in stages for name in stage_numbers_of(winch, joints=joints)]
        peaks = np.full((_intervals(case), len(PEAKS)), math.nan)
        if result.ending is not Ending.DIVERGED:
            n = min(len(peaks), len(result.peaks))
            peaks[:n] = result.peaks[:n]
        numbers += peaks.ravel().tolist()
        return Row(run["status"], [float(x) for x in numbers], tuple(run["notes"]))

    def labelled(
        self,
        crane: Crane | Sequence[Crane],
        cases: Sequence[Case],
        rows: Sequence[Mapping[str, Any]],
        *,
        step: float,
        single: bool,
        series: Series | None,
    ) -> xarray.Dataset:
        winch = (crane if isinstance(crane, Crane) else crane[0]).plant.type
        lifts = [_lift(c) for c in cases]
        n_stages = max(_stages(c) for c in cases)
        joints = _joints(cases)
        if joints:  # numbers of a unit that some cases do not have
            rows = [collections.defaultdict(lambda: math.nan, row) for row in rows]
        of_run = ("status", *run_numbers_of(winch, joints=joints), "notes")
        columns = summary_columns([{name: row[name] for name in of_run} for row in rows], single=single)
        of_stages = stage_numbers_of(winch, joints=joints)
        intervals = max(_intervals(c) for c in cases)
        stages = np.full((len(cases), n_stages, len(of_stages)), math.nan)
        peaks = np.full((len(cases), intervals, len(PEAKS)), math.nan)
        for i, (row, each) in enumerate(zip(rows, cases, strict=True)):
            here = _columns(winch.name, _stages(each), _intervals(each), joints)
            numbers = np.fromiter(map(row.__getitem__, here), dtype=np.float64, count=len(here))
            begin, end = len(of_run) - 2, len(here) - _intervals(each) * len(PEAKS)
            stages[i, : _stages(each)] = numbers[begin:end].reshape(-1, len(of_stages))
            peaks[i, : _intervals(each)] = numbers[end:].reshape(-1, len(PEAKS))
        for dim, prefix, table, of in (("stage", "stage", stages, of_stages), ("interval", "peak", peaks, PEAKS)):
            for k, name in enumerate(of):
                values = np.ascontiguousarray(table[:, :, k])
                columns[f"{prefix}_{name}"] = (
                    ((dim,), values[0], attributes(name)) if single else (("case", dim), values, attributes(name))
                )
        names = {phase_names(lift.programme) for lift in lifts}
        coords: dict[str, Any] = {} if single else {"case": [lift.name or str(i) for i, lift in enumerate(lifts)]}
        coords["stage"] = [*names.pop(), "after"] if len(names) == 1 else [str(i) for i in range(n_stages)]
        lengths = np.array([peak_interval(lift.duration) for lift in lifts])
        columns["peak_interval"] = (
            ((), lengths[0], attributes("peak_interval"))
            if single
            else (("case",), lengths, attributes("peak_interval"))
        )
        title = f"Stillhook lowering from {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}"
        attrs = {"title": title, **_cranes(crane), "sampled": self.sampled, "short": int(self.short)}
        if text := lowerings_text(cases):
            attrs["lowerings"] = text
        return labelled(columns, coords, attrs, step=step, single=single, series=series)


def _lift(case: Case) -> Lowering:
    return case.lift if isinstance(case, InSea) else case


@functools.cache
def _columns(plant: str, stages: int, intervals: int, joints: tuple[str, ...]) -> tuple[str, ...]:
    winch = WINCH_TYPES[plant]
    names = stage_numbers_of(winch, joints=joints)
    of_stages = (f"{i} {name}" for i in range(stages) for name in names)
    of_intervals = (f"{i} peak {name}" for i in range(intervals) for name in PEAKS)
    return (*run_numbers_of(winch, joints=joints), *of_stages, *of_intervals)


def _joints(cases: Sequence[Case]) -> tuple[str, ...]:
    """Types of the units above the slings of these cases; none where slings alone join hook and payload."""
    return tuple(sorted({unit.type for case in cases if (unit := _lift(case).compensator) is not None}))


def _intervals(case: Case) -> int:
    """Intervals of which the largest values are kept."""
    duration = _lift(case).duration
    return int(duration / peak_interval(duration) + 1e-6)


def _stages(case: Case) -> int:
    """Rows of stages in the answer: those of the programme, and the time after it."""
    return len(_lift(case).programme) + 1


def _lowerings(cases: Sequence[Case]) -> list[Lowering]:
    """Lowerings of a block; tip and water of those that are moved alike are made once."""
    moved: dict[bytes, Lowering] = {}
    out: list[Lowering] = []
    for case in cases:
        if isinstance(case, Lowering):
            out.append(case)
            continue
        motion = case.motion
        first = moved.setdefault(motion, case.lowering()) if motion not in moved else moved[motion]
        out.append(case.lift.model_copy(update={"tip": first.tip, "waves": first.waves}))
    return out


class _Texts:
    """A case as bytes: everything but names and sources, which change no number; lifts that cases share are written
    once.

    Names of stages stay in, because notes quote them.
    """

    def __init__(self, begin: bytes) -> None:
        self.lifts: dict[int, bytes] = {}
        self.begin = begin

    def __call__(self, case: Case) -> bytes:
        lift = _lift(case)
        if id(lift) not in self.lifts:
            self.lifts[id(lift)] = self.begin + _print(lift)
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
