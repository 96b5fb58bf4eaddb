"""Lowerings as a type of case: how they are checked, packed and grouped, and the labelled Dataset of their runs."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from stillhook.base.variable import coded
from stillhook.engine.arguments import labelled, substeps, summary_columns
from stillhook.engine.inputs import is_ideal
from stillhook.engine.lowering.checks import check_course, check_lift, check_lift_step, check_sea
from stillhook.engine.lowering.run import LiftBlock, Ready, longest_step, setup_of, waves_step
from stillhook.engine.lowering.summary import (
    PEAKS,
    intervals_of,
    joints_of,
    lift_of,
    names_of,
    peak_interval,
    phase_numbers_of,
    phases_of,
    run_numbers_of,
)
from stillhook.engine.pack.winch import kernel_of
from stillhook.engine.runner import Run, each_case
from stillhook.engine.store import Summary, bare
from stillhook.engine.tasks import CaseType
from stillhook.kernels.build import Setup
from stillhook.kernels.control_laws import controllers_of_winch
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.lift.deck import reference_of
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.phase import phase_names
from stillhook.spec.lift.stored import lowerings_text
from stillhook.spec.sensors import error_sensors
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


Case = Lowering | InSea
T = TypeVar("T")

LIFT_STEP = 5e-3
"""Default step [s]: the wire is stepped implicitly, and the winch at 5 ms is right to 0.1 mm of wire
(docs/validation/step-size.md)."""
SHORTEST_STEP = 1e-3
"""Shortest step that is taken unasked [s]: where a winch needs less, one of its numbers is rather wrong."""


def lift_step(longest: float) -> float:
    """The default step of lifts that need `longest` at the most [s]."""
    return min(LIFT_STEP, max(longest, SHORTEST_STEP))


def _each_lift(cranes: Sequence[Crane], cases: Sequence[Case], look: Callable[[Crane, Lowering], T]) -> list[T]:
    """What `look` says of every lift; those that many seas share are looked at once. Errors: as `each_case`."""
    seen: dict[tuple[int, int], T] = {}

    def once(crane: Crane, case: Case) -> None:
        lift = lift_of(case)
        if (key := (id(crane), id(lift))) not in seen:
            seen[key] = look(crane, lift)

    each_case(cranes, cases, once)
    return list(seen.values())


class LoweringType(CaseType):
    """Lowerings: a payload by a programme, alone or in a sea that is made when it is run. sampled: statistics are taken
    every so many PLC cycles; short: runs end with their programme."""

    def __init__(self, sampled: int = 1, *, short: bool = False) -> None:
        self.sampled, self.short = sampled, short

    def words(self, case: Case) -> str:
        """The lift, and its sea."""
        return f"{case.lift.name}, {case.sea.describe()}" if isinstance(case, InSea) else case.name

    def check(self, cranes: Sequence[Crane], cases: Sequence[Case]) -> None:
        def check(crane: Crane, lift: Lowering) -> None:
            check_sea(lift)
            check_lift(crane, lift)

        _each_lift(cranes, cases, check)

    def default_steps(self, cranes: Sequence[Crane], cases: Sequence[Case], *, series: bool) -> int:
        """A shorter one where a stiff winch needs it."""
        return substeps(cranes[0].control.t_cycle, lift_step(min(_each_lift(cranes, cases, longest_step))))

    def ready(
        self, cranes: Sequence[Crane], cases: Sequence[Case], n_sub: int, places: Sequence[int] | None = None
    ) -> list[Ready]:
        """Lifts are packed once for all that share them; waves are checked here, where they are made."""
        checked: set[int] = set()

        def make(crane: Crane, case: Lowering) -> Ready:
            ready = Ready.of(crane, case)
            if id(ready.packed) not in checked:
                check_course(crane, case, ready.packed)
                check_lift_step(ready.packed, ready.drive.t_cycle / n_sub)
                checked.add(id(ready.packed))
            return ready

        return each_case(cranes, _lowerings(cases), make, places)

    def block(self, ready: Sequence[Ready], *, lanes: int, n_sub: int, every: int) -> LiftBlock:
        return LiftBlock(ready, lanes=lanes, n_sub=n_sub, every=every, sampled=self.sampled, short=self.short)

    def kernel(self, crane: Crane, case: Case) -> tuple[Setup, tuple[str, ...]]:
        lift = lift_of(case)
        setup = kernel_of(crane, error_sensors(lift.sensors))._replace(path=setup_of(lift).path)
        return setup, controllers_of_winch(crane.plant.type, (lift.controller,))

    def group(self, crane: Crane, case: Case) -> Hashable:
        lift = lift_of(case)
        water = case.spacing if isinstance(case, InSea) else waves_step(lift.waves)
        ideal = is_ideal(lift.sensors) and not reference_of(lift.tip, lift.deck, 0).separate
        return lift.duration, lift.wire.nodes, water, phases_of(case), ideal

    def seconds(self, crane: Crane, case: Case) -> float:
        return lift_of(case).duration

    def sort(self, places: list[int], cases: Sequence[Case]) -> list[int]:
        """Cases with the same motion next to each other, in the order of first use."""
        motions = {i: c.motion if isinstance(c := cases[i], InSea) else b"" for i in places}
        first = {motion: k for k, motion in reversed(list(enumerate(motions.values())))}
        return sorted(places, key=lambda i: first[motions[i]])

    def names(self, crane: Crane, case: Case) -> tuple[str, ...]:
        return names_of(crane, case)

    def as_bytes(self, cases: Sequence[Case]) -> list[bytes]:
        """Lifts that cases share are written once. Names of phases stay in, because notes quote them."""
        begin = b"%d%s " % (self.sampled, b" short" * self.short)
        lifts = {id(lift): lift for lift in map(lift_of, cases)}
        texts = {key: begin + _print(lift) for key, lift in lifts.items()}
        return [texts[id(lift_of(c))] + (c.motion if isinstance(c, InSea) else b"") for c in cases]

    def dataset(
        self,
        crane: Crane | Sequence[Crane],
        cases: Sequence[Case],
        summaries: Sequence[Summary],
        *,
        step: float,
        single: bool,
        runs: Sequence[Run],
    ) -> xarray.Dataset:
        first = crane if isinstance(crane, Crane) else crane[0]
        winch, joints = first.plant.type, joints_of(cases)
        lifts = [lift_of(c) for c in cases]
        of_run = run_numbers_of(winch, joints=joints, checks=first.control.guard is not None)
        of_phases = phase_numbers_of(winch, joints=joints)
        rows: list[dict[str, Any]] = []
        phases = np.full((len(cases), max(map(phases_of, cases)), len(of_phases)), math.nan)
        peaks = np.full((len(cases), max(map(intervals_of, cases)), len(PEAKS)), math.nan)
        for i, (summary, case) in enumerate(zip(summaries, cases, strict=True)):
            numbers, n = summary.some(names_of(first, case, joints)), len(of_run)
            end = n + phases_of(case) * len(of_phases)
            run = dict(zip(of_run, numbers[:n].tolist(), strict=True))
            rows.append({"status": summary.status, **run, "notes": summary.notes})
            phases[i, : phases_of(case)] = numbers[n:end].reshape(-1, len(of_phases))
            peaks[i, : intervals_of(case)] = numbers[end:].reshape(-1, len(PEAKS))
        columns = summary_columns(rows, single=single)

        def add(name: str, values: Any, *dims: str, prefix: str = "") -> None:
            over, numbers = (dims, values[0]) if single else (("case", *dims), values)
            columns[prefix + name] = over, numbers, attributes(name)

        for dim, prefix, table, of in (("phase", "phase", phases, of_phases), ("interval", "peak", peaks, PEAKS)):
            for k, name in enumerate(of):
                add(name, np.ascontiguousarray(table[:, :, k]), dim, prefix=f"{prefix}_")
        add("peak_interval", np.array([peak_interval(lift.duration) for lift in lifts]))
        names = {phase_names(lift.programme) for lift in lifts}
        coords: dict[str, Any] = {} if single else {"case": [lift.name or str(i) for i, lift in enumerate(lifts)]}
        coords["phase"] = [*names.pop(), "after"] if len(names) == 1 else [str(i) for i in range(phases.shape[1])]
        title = f"Stillhook lowering from {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}"
        attrs = {"title": title, **_cranes(crane), "sampled": self.sampled, "short": int(self.short)}
        if text := lowerings_text(cases):
            attrs["lowerings"] = text
        data = labelled(columns, coords, attrs, step=step, single=single, runs=runs)
        if "phase_number" in data:
            data["phase_number"].attrs |= coded(enumerate(coords["phase"]))
        return data


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
        out.append(case.moved_as(first))
    return out


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
