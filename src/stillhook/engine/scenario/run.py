"""Scenarios as a type of case: how they are checked, packed and grouped, run side by side from the first cycle to the
last, and labelled as a Dataset."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from stillhook.base.arrays import FloatArray
from stillhook.control.plc import memory_before
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
from stillhook.engine.inputs import WIRE_COLUMNS, CycleInputs, shape
from stillhook.engine.pack.guard import guard_in
from stillhook.engine.pack.winch import Packed, kernel_of, pack
from stillhook.engine.runner import Block, Run, each_case, nothing
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.summary import ScenarioRun, numbers_of
from stillhook.engine.store import Summary, bare
from stillhook.engine.tasks import CaseType
from stillhook.kernels.build import Setup
from stillhook.kernels.control_laws import controllers_of_winch
from stillhook.kernels.lanes import flatten, offset
from stillhook.kernels.oscillation import begun_again
from stillhook.kernels.statistics import SIGNALS, blank
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.spec.sensors import error_sensors
from stillhook.units import show
from stillhook.variables import WINDOW
from stillhook.winches.records import Tick, Tip

if TYPE_CHECKING:
    import xarray


class Ready(NamedTuple):
    """A scenario that was packed, and what drives it."""

    crane: Crane
    case: Scenario
    winch: Packed
    drive: CycleInputs

    @classmethod
    def of(cls, crane: Crane, case: Scenario) -> Self:
        """The scenario must have passed `stillhook.engine.scenario.checks.check`."""
        return cls(crane, case, pack(crane, case), CycleInputs(crane, case))


def first_lane(d: Any, packed: Packed, tick: Tick, guard: Mapping[str, Any]) -> Any:
    """A lane of the driver d before its first cycle: the reference is where the wire is; state and memory await
    `at_rest`. guard: that of a driver whose PLC has one, and its checks, see `stillhook.engine.pack.guard.guard_in`."""
    tip, lane, plc = Tip(tick.s, tick.v), nothing(d.Lane), packed.params.plc
    return lane._replace(
        x=lane.x._replace(path=lane.x.path._replace(s_w=packed.s_w)),
        m=memory_before(packed.memory, packed.memory.F, packed.s_w, tick.s_m, tick.mode, tick.v_op, plc),
        laws=d.laws.blank(packed.settings, **guard),
        st=blank(d.Stats, packed.plant),
        tip_0=tip,
        tip_1=tip,
        tip_2=tip,
        tick=tick,
        p=packed.params,
    )


class ScenarioBlock(Block[Ready]):
    """Scenarios of equal length, warm-up and drive side by side."""

    @functools.cached_property
    def before(self) -> list[Any]:
        """Statistics of the warm-up by case, None where there was none or it is not over."""
        return [None] * len(self.ready)

    def record(self, r: Ready) -> list[float]:
        """One lane before the first cycle."""
        return flatten(first_lane(self.d, r.winch, Tick(*r.drive.first_row()), guard_in(r.crane, r.winch.params)))

    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count; statistics start again where the warm-up is over."""
        drive = self.drive
        if k == drive.first:
            if k > 0:
                self.before = [self.part("st", i) for i in range(len(self.ready))]
            self._count_from_here()
        self.d.run(
            self.A.reshape(-1),
            D.reshape(-1),
            drive.cols,
            self.H,
            self.W,
            self.out.reshape(-1),
            self.lost,
            self.every,
            k,
            count,
            drive.first,
            drive.n_ticks,
            self.n_win,
            self.n_sub,
            drive.t_cycle,
        )

    def _count_from_here(self) -> None:
        """Statistics of every lane start again; what is known of an oscillation that continues is kept."""
        at = offset(self.d.Lane, "st", 1)
        fresh = blank(self.d.Stats, self.ready[0].winch.plant)
        for i in range(self.A.shape[1]):
            values = flatten(fresh._replace(oscillation=begun_again(self.part("st", i).oscillation)))
            self.A[at : at + len(values), i] = values

    def result(self, i: int) -> ScenarioRun:
        """The run of one lane."""
        stats, laws, t_cycle = self.part("st", i), self.part("laws", i), self.drive.t_cycle
        best = self.W.reshape(-1, SIGNALS, len(self.lanes))[2, :, i]
        span, full = _span(best, stats.common, self.n_win)
        return ScenarioRun(
            **self.common(i),
            stats=stats,
            span=span,
            full_window=full,
            t_cycle=t_cycle,
            warm_up=self.drive.first * t_cycle,
            before=self.before[i],
            laws=laws,
            checks=laws.checks.k if self.d.laws.checks else None,
        )


class WireBlock(ScenarioBlock):
    """Winches whose wire, load and water are the host's, which gives the tension; at rest under the scenario's load."""

    inputs = WIRE_COLUMNS

    @staticmethod
    def setup(r: Ready) -> Setup:
        return r.winch.setup._replace(path=("host",))

    def record(self, r: Ready) -> list[float]:
        tick = Tick(*r.drive.first_row())._replace(s=r.winch.params.hoist.load.W, v=0.0, a=0.0)
        return flatten(first_lane(self.d, r.winch, tick, guard_in(r.crane, r.winch.params)))


def _span(best: FloatArray, st: Any, n_win: int) -> tuple[tuple[float, float, float], bool]:
    """Largest peak-to-peak over the window; over the whole counted run where that is shorter than the window."""
    if st.cycles >= n_win:
        return (float(best[0]), float(best[1]), float(best[2])), True
    return (st.e_max - st.e_min, st.em_max - st.em_min, st.tip_max - st.tip_min), False


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

    def words(self, case: Scenario) -> str:
        """Its name, else controller, load and motion."""
        return case.name or f"{case.mode}, {show(case.load, 'mass', 4)}, {case.tip.describe().split(':')[0]}"

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
        return kernel_of(crane, error_sensors(case.sensors)), controllers_of_winch(crane.plant.type, modes)

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
