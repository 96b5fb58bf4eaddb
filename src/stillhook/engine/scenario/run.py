"""Scenarios side by side: what their blocks are made of, and what comes out."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.control.plc import Memory
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import Packed, pack
from stillhook.engine.runner import Block, Ending, Shape, nothing, ready_cases, run_blocks
from stillhook.engine.scenario.checks import check
from stillhook.engine.step_size import check_step
from stillhook.kernels.build import driver
from stillhook.kernels.lanes import flatten, offset, size
from stillhook.kernels.moving_window import SIGNALS
from stillhook.kernels.statistics import blank
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.winches.records import Geometry, Tick, Tip

KIND = "driver"


class Ready(NamedTuple):
    """A scenario that was checked and packed."""

    winch: Packed
    drive: CycleInputs


class Result(NamedTuple):
    """What came out of one run: statistics, the three peak-to-peak values over the moving window [m], end state, series
    (or None) with one row of Signals every `dt` [s], number of samples in the window, step [s], time reached [s]."""

    stats: Any
    span: tuple[float, float, float]
    full_window: bool
    ending: Ending
    t_end: float
    state: Any
    memory: Memory
    series: FloatArray | None
    signals: tuple[str, ...]
    dt: float
    step: float
    t_cycle: float
    warm_up: float

    def column(self, name: str) -> FloatArray:
        """The time series of a signal. Errors: KeyError for one that this winch type has not."""
        if self.series is None or name not in self.signals:
            raise KeyError(name)
        return np.asarray(self.series[:, self.signals.index(name)])


def run_cases(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    *,
    n_sub: int,
    lanes: int,
    every: int,
    threads: int = 2,
    progress: Progress | None = None,
    places: Sequence[int] | None = None,
    checked: bool = False,
) -> list[Result]:
    """Runs in blocks of `lanes` (1 or 16), the blocks shared by threads; a failed case is marked and spoils no other.

    crane that of all cases, or one for each; several are of one winch type and have one PLC cycle.
    n_sub steps per PLC cycle; a row of the series every `every` cycles (0: statistics alone). Cases of equal length,
    warm-up and drive share a block. places: their numbers in a longer list, for messages; checked:
    whether `check` has passed them.
    Errors: ScenarioError of the first case that cannot be run; SpecError where the step is too long.
    """

    def ready(each: Crane, case: Scenario) -> Ready:
        if not checked:
            check(each, case)
        winch, drive = pack(each, case), CycleInputs(each, case)
        check_step(winch, drive.t_cycle / n_sub)
        return Ready(winch, drive)

    cranes = [crane] * len(cases) if isinstance(crane, Crane) else crane
    results: list[Result] = run_blocks(
        ready_cases(cranes, cases, ready, places),
        lambda r: (r.drive.n_ticks, r.drive.first, r.drive.cols),
        lambda some: ScenarioBlock(some, lanes=lanes, n_sub=n_sub, every=every),
        kind=KIND,
        lanes=lanes,
        threads=threads,
        progress=progress,
    )
    return results


class ScenarioBlock(Block[Ready]):
    """Scenarios of equal length, warm-up and drive side by side."""

    def __init__(self, ready: Sequence[Ready], *, lanes: int, n_sub: int, every: int) -> None:
        winch = ready[0].winch
        d = driver(winch.name, lanes, KIND, winch.extra_controllers)
        super().__init__(ready, Shape(d, d, SIGNALS, size(d.Signals)), lanes=lanes, n_sub=n_sub, every=every)

    def record(self, r: Ready) -> list[float]:
        """One lane before the first cycle: the reference is where the wire is; state and memory await `at_rest`."""
        d, packed, tick = self.d, r.winch, Tick(*r.drive.first_row())
        tip, x = Tip(tick.s, tick.v), nothing(d.State)
        lane = d.Lane(
            x=x._replace(path=x.path._replace(s_w=packed.s_w)),
            u=nothing(d.Command),
            u_0=nothing(d.Command),
            geo=nothing(Geometry),
            m=packed.memory._replace(datum=packed.s_w - tick.s_m, mode=tick.mode),
            laws=d.laws.blank(packed.settings),
            st=blank(d.Stats, packed.plant),
            y=nothing(d.Signals),
            tip_0=tip,
            tip_1=tip,
            tip_2=tip,
            tick=tick,
            p=packed.params,
        )
        return flatten(lane)

    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count; statistics start anew where the warm-up is over."""
        drive = self.drive
        if k == drive.first:
            at = offset(self.d.Lane, "st", 1)
            fresh = np.array(flatten(blank(self.d.Stats, self.ready[0].winch.plant)))
            self.A[at : at + len(fresh)] = fresh[:, None]
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

    def result(self, i: int) -> Result:
        """What came out of one lane."""
        stats, t_cycle, (ending, t_end) = self.part("st", i), self.drive.t_cycle, self.ending(i)
        best = self.W.reshape(-1, SIGNALS, len(self.lanes))[2, :, i]
        span, full = _span(best, stats.common, self.n_win)
        return Result(
            stats=stats,
            span=span,
            full_window=full,
            ending=ending,
            t_end=t_end,
            state=self.part("x", i),
            memory=self.part("m", i),
            series=self.series(i),
            signals=self.d.Signals._fields,
            dt=self.every * t_cycle,
            step=t_cycle / self.n_sub,
            t_cycle=t_cycle,
            warm_up=self.drive.first * t_cycle,
        )


def _span(best: FloatArray, st: Any, n_win: int) -> tuple[tuple[float, float, float], bool]:
    """Largest peak-to-peak over the window; over the whole counted run where that is shorter than the window."""
    if st.cycles >= n_win:
        return (float(best[0]), float(best[1]), float(best[2])), True
    return (st.e_max - st.e_min, st.em_max - st.em_min, st.tip_max - st.tip_min), False
