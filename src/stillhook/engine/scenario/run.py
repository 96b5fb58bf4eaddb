"""Scenarios that were packed, side by side from the first cycle to the last."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

from stillhook.base.arrays import FloatArray
from stillhook.control.guard import Guard
from stillhook.control.plc import memory_before
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import Packed, pack
from stillhook.engine.runner import Block, nothing
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.scenario.warm_up import WarmUp, Watch
from stillhook.kernels.lanes import flatten, offset
from stillhook.kernels.oscillation import begun_again
from stillhook.kernels.statistics import SIGNALS, blank
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.winches.records import Tick, Tip


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


def first_lane(d: Any, packed: Packed, tick: Tick, guard: Guard | None = None) -> Any:
    """A lane of the driver d before its first cycle: the reference is where the wire is; state and memory await
    `at_rest`. guard: that of a driver whose PLC has one."""
    tip, lane, plc = Tip(tick.s, tick.v), nothing(d.Lane), packed.params.plc
    return lane._replace(
        x=lane.x._replace(path=lane.x.path._replace(s_w=packed.s_w)),
        m=memory_before(packed.memory, packed.memory.F, packed.s_w, tick.s_m, tick.mode, tick.v_op, plc),
        laws=d.laws.blank(packed.settings, guard),
        st=blank(d.Stats, packed.plant),
        tip_0=tip,
        tip_1=tip,
        tip_2=tip,
        tick=tick,
        p=packed.params,
    )


class ScenarioBlock(Block[Ready]):
    """Scenarios of equal length, warm-up and drive side by side."""

    def record(self, r: Ready) -> list[float]:
        """One lane before the first cycle."""
        return flatten(first_lane(self.d, r.winch, Tick(*r.drive.first_row())))

    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count; statistics start again where the warm-up is over."""
        drive = self.drive
        if k == 0:
            self.watch = Watch(self.d, self.A, drive.t_cycle)
            self.before: list[WarmUp | None] = [None] * len(self.ready)
        if k < drive.first:
            self.watch.run(lambda i, n: self._run(D[i : i + n + 1], k + i, n), k, count)
            return
        if k == drive.first:
            if k > 0:
                self.before = [WarmUp(self.watch.of(i), self.part("st", i)) for i in range(len(self.ready))]
            self._count_from_here()
        self._run(D, k, count)

    def _run(self, D: FloatArray, k: int, count: int) -> None:
        drive = self.drive
        self.d.run(
            self.A.reshape(-1),
            D.reshape(-1),
            drive.cols,
            self.H,
            self.W,
            self.out.reshape(-1),
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
        """Statistics of every lane start again; what is known of an oscillation that goes on is kept."""
        at = offset(self.d.Lane, "st", 1)
        fresh = blank(self.d.Stats, self.ready[0].winch.plant)
        for i in range(self.A.shape[1]):
            values = flatten(fresh._replace(oscillation=begun_again(self.part("st", i).oscillation)))
            self.A[at : at + len(values), i] = values

    def result(self, i: int) -> ScenarioRun:
        """The run of one lane."""
        stats, t_cycle = self.part("st", i), self.drive.t_cycle
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
        )


def _span(best: FloatArray, st: Any, n_win: int) -> tuple[tuple[float, float, float], bool]:
    """Largest peak-to-peak over the window; over the whole counted run where that is shorter than the window."""
    if st.cycles >= n_win:
        return (float(best[0]), float(best[1]), float(best[2])), True
    return (st.e_max - st.e_min, st.em_max - st.em_min, st.tip_max - st.tip_min), False
