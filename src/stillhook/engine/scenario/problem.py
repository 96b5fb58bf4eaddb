"""Scenarios as a problem of the engine (`stillhook.engine.batch`): blocks, run, summary and labelled Dataset."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.control.guard import Guard
from stillhook.control.plc import Memory, memory_before
from stillhook.engine.arguments import (
    SERIES_STEP,
    STATISTICS_STEP,
    Series,
    check_step,
    labelled,
    paired,
    steps_for,
    summary_columns,
)
from stillhook.engine.batch import Row, run_batch, scenario_as_bytes
from stillhook.engine.inputs import CycleInputs, shape, twin_line
from stillhook.engine.pack.capacity import capacity_notes, judged
from stillhook.engine.pack.winch import Packed, pack
from stillhook.engine.runner import Block, Ending, RunOptions, each_case, nothing, run_blocks
from stillhook.engine.scenario.checks import Foreseen, check, foresee
from stillhook.engine.scenario.oscillation import OSCILLATES, oscillation_notes, oscillation_numbers
from stillhook.engine.scenario.warm_up import WarmUp, Watch, warm_up_notes
from stillhook.kernels.build import Setup
from stillhook.kernels.lanes import flatten, offset
from stillhook.kernels.statistics.cycles import SIGNALS, blank
from stillhook.kernels.statistics.oscillation import begun_again
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.tables.plausible import implausible_values, marked
from stillhook.variables import COMMON_SUMMARY, WINDOW
from stillhook.winches.records import Tick, Tip
from stillhook.winches.registry import WinchType

if TYPE_CHECKING:
    import xarray


class Ready(NamedTuple):
    """A scenario that was checked and packed."""

    winch: Packed
    drive: CycleInputs


class Result(NamedTuple):
    """What came out of one run: statistics, the three peak-to-peak values over the moving window [m], end state, series
    (or None) with one row of Signals every `dt` [s], number of samples in the window, step [s], time reached [s], what
    happened before (None without a warm-up)."""

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
    before: WarmUp | None

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
    prepared = each_case(cranes, cases, ready, places)
    return run_blocks(
        prepared, ScenarioBlock, n_sub=n_sub, lanes=lanes, every=every, threads=threads, progress=progress
    )


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

    @staticmethod
    def alike(r: Ready) -> tuple[int, int, int]:
        return r.drive.n_ticks, r.drive.first, r.drive.cols

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
            signals=self.d.columns,
            dt=self.every * t_cycle,
            step=t_cycle / self.n_sub,
            t_cycle=t_cycle,
            warm_up=self.drive.first * t_cycle,
            before=self.before[i],
        )


def _span(best: FloatArray, st: Any, n_win: int) -> tuple[tuple[float, float, float], bool]:
    """Largest peak-to-peak over the window; over the whole counted run where that is shorter than the window."""
    if st.cycles >= n_win:
        return (float(best[0]), float(best[1]), float(best[2])), True
    return (st.e_max - st.e_min, st.em_max - st.em_min, st.tip_max - st.tip_min), False


def to_dataset(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    results: Sequence[Result],
    summaries: Sequence[Mapping[str, Any]],
    *,
    single: bool,
) -> xarray.Dataset:
    """Results with their series and summaries as one labelled Dataset; see `stillhook.simulate`.
    crane: that of all cases, or one for each."""
    series = Series([r.series for r in results if r.series is not None], results[0].dt, results[0].signals)
    return ScenarioProblem().labelled(crane, cases, summaries, step=results[0].step, single=single, series=series)


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


OK = "ok"
OFFSET = 0.05
"""Mean error from which a hook that never passes its place counts as standing off [m]; paper F accepts 5 cm of
error."""
LEAST_EFFICIENCY = 0.05
"""Efficiency below which a winch does not compensate [-]: a twentieth of the tip's motion is what friction alone takes
off."""
AUDIT = 0.05
"""Energy not found again, over that through the winch, from which a run is numerically wrong [-]; sound runs stay below
1e-3."""
AUDIT_FLOOR = 1.0e3
"""Energy below which nothing moves that an audit could judge [J]: a tonne by a tenth of a metre."""
POSITION = ("e_c_pp", "e_c_pp_measured", "eta_c", "e_c_max", "e_c_mean", "e_c_std")
"""What a run in manual mode has none of: nothing is held in place there."""


def limits_passed(winch: WinchType, stats: Any) -> list[str]:
    """Words for the limits that were passed in a run: of the pumps, of the winch type's own, of the wire, and whether
    it oscillates."""
    st = stats.common
    return [
        *(["saturated"] if st.saturation_cycles > 0.0 else []),
        *winch.limits_passed(stats),
        *(["slack"] if st.slack_cycles > 0.0 else []),
        *(["wire"] if st.wire_cycles > 0.0 else []),
        *([OSCILLATES] if stats.oscillation.largest.time > 0.0 else []),
    ]


def status(crane: Crane, case: Scenario, result: Result, foreseen: Foreseen) -> str:
    """ "ok", or the limits that the counted part of the run went beyond, joined by commas.

    "overload", "peak load": more at the crane tip than it carries, at rest or in a peak, the wire included
    (`stillhook.engine.pack.capacity`).
    "oscillates": the wire's speed swings by itself (`stillhook.kernels.statistics.oscillation`). "unstable": K_p is
    above the limit of the published loop of closed circuits; its absence says nothing. "audit": energy does not add up,
    so the numbers are wrong; judged only for runs as long as the window, and not where a wire snaps taut within a cycle
    of the audit. "uncompensated": the error is about as large as the motion of the tip, or larger; judged only for
    plain compensation, where nothing else moves the hook.
    """
    if result.ending is Ending.DIVERGED:
        return "diverged"
    winch, st = crane.plant.type, result.stats.common
    beyond = limits_passed(winch, result.stats)
    beyond += judged(crane, foreseen.F_rest, st.F_max + foreseen.wire)
    one_sided = st.e_min > 0.0 or st.e_max < 0.0
    if one_sided and abs(st.e_sum) > OFFSET * max(st.cycles - 1.0, 1.0):
        beyond.append("offset")
    if foreseen.unstable:
        beyond.append("unstable")
    plain = case.mode.compensates and not (case.modes or case.operator.profile or case.operator.steps)
    e_c_pp, _, s_tip_pp = result.span
    if result.full_window and "slack" not in beyond and _audit_fails(winch, result):
        beyond.append("audit")
    if plain and s_tip_pp > 0.0 and e_c_pp > max(OFFSET, (1.0 - LEAST_EFFICIENCY) * s_tip_pp):
        beyond.append("uncompensated")
    return ", ".join(beyond) or OK


def _audit_fails(winch: WinchType, result: Result) -> bool:
    missing = abs(energy_unaccounted(winch, result))
    return missing > AUDIT and missing * result.stats.common.through * result.t_cycle > AUDIT_FLOOR


def energy_unaccounted(winch: WinchType, result: Result) -> float:
    """Energy that the audit does not find again, over the energy through the winch [-].

    In: what drives the winch, and the tip. Out: what the winch type and the load path lose. Stored: shaft, load, wire,
    oil.
    """
    st = result.stats.common
    supplied, consumed = winch.energies(result.stats.power)
    through = st.through * result.t_cycle
    if through == 0.0:
        return math.nan
    return ((supplied - consumed) * result.t_cycle - (st.E_end - st.E_start)) / through


def summarise(crane: Crane, case: Scenario, result: Result) -> dict[str, Any]:
    """The summary of one run: keys and SI units of `stillhook.variables.SUMMARY`.

    A diverged run has NaN for every number, and one that is manual throughout for those of the position.
    """
    foreseen = foresee(crane, case)
    doubts = (*implausible_values(crane), *implausible_values(case))
    swing = result.stats.oscillation.largest
    heavy = capacity_notes(crane, foreseen.F_rest, result.stats.common.F_max + foreseen.wire, foreseen.wire)
    notes = [*doubts, *oscillation_notes(crane, swing), *heavy, *foreseen.notes, *_window_notes(result)]
    if result.ending is Ending.DIVERGED:
        notes.append(f"lost its numbers by {result.t_end:.2f} s")
    winch, st, t = crane.plant.type, result.stats.common, result.t_cycle
    notes += warm_up_notes(winch, result.before, t)
    e_c_pp, e_c_pp_measured, s_tip_pp = result.span
    weight = max(st.cycles - 1.0, 1.0)
    mean = st.e_sum / weight
    numbers = {
        "e_c_pp": e_c_pp,
        "e_c_pp_measured": e_c_pp_measured,
        "s_tip_pp": s_tip_pp,
        "eta_c": 1.0 - e_c_pp / s_tip_pp if s_tip_pp > 0.0 else math.nan,
        "e_c_max": max(abs(st.e_min), abs(st.e_max)),
        "e_c_mean": mean,
        "e_c_std": math.sqrt(max(st.e2_sum / weight - mean * mean, 0.0)),
        **winch_numbers(winch, result.stats, t),
        "energy_through": st.through * t,
        "energy_unaccounted": energy_unaccounted(winch, result),
        "counted_time": weight * t,
        "warm_up": result.warm_up,
    }
    if result.ending is Ending.DIVERGED:
        numbers = dict.fromkeys(numbers, math.nan)
    elif not any(m.compensates for m in (case.mode, *(m for _, m in case.modes))):
        numbers |= dict.fromkeys(POSITION, math.nan)
    return {
        "status": marked(status(crane, case, result, foreseen), doubts),
        **numbers,
        "validated": float(foreseen.validated),
        "notes": notes,
    }


def winch_numbers(winch: WinchType, stats: Any, t_cycle: float) -> dict[str, float]:
    """What the winch did: extremes of its signals, and time at each of its limits [s]."""
    st = stats.common
    return {
        "u_p_max": st.u_p_max,
        "v_w_max": st.v_w_max,
        "v_tip_max": st.v_tip_max,
        "F_w_max": st.F_max,
        "F_w_min": st.F_min,
        "saturation_time": st.saturation_cycles * t_cycle,
        "slack_time": st.slack_cycles * t_cycle,
        "wire_time": st.wire_cycles * t_cycle,
        **oscillation_numbers(stats.oscillation.largest),
        **winch.own_numbers(stats, t_cycle),
    }


def _window_notes(result: Result) -> list[str]:
    """The peak-to-peak values of a short run cover less than the window that they are defined on."""
    if result.full_window or result.ending is Ending.DIVERGED:
        return []
    counted = max(result.stats.common.cycles - 1.0, 0.0) * result.t_cycle
    return [
        f"the counted part of {counted:.4g} s is shorter than the window of {WINDOW:g} s: peak-to-peak values are of"
        " that part alone"
    ]


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
    n_sub = steps_for(cranes, cases, step, STATISTICS_STEP)
    return run_batch(
        ScenarioProblem(), cranes, cases, n_sub=n_sub, threads=threads, store=store, client=client, progress=progress
    )


class ScenarioProblem:
    """Scenarios as a batch runs them."""

    def setup(self, case: Scenario) -> Setup:
        return Setup()

    def check(self, cranes: Sequence[Crane], cases: Sequence[Scenario]) -> None:
        each_case(cranes, cases, check)

    def default_step(self, cranes: Sequence[Crane], cases: Sequence[Scenario], *, series: bool) -> float:
        return SERIES_STEP if series else STATISTICS_STEP

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
        attrs = {
            "title": f"Stillhook run of {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}",
            "crane": crane_toml(crane) if isinstance(crane, Crane) else json.dumps([crane_toml(c) for c in crane]),
            "twin": twin_line(crane if isinstance(crane, Crane) else crane[0]),
            "scenarios": json.dumps([c.to_dict() for c in (cases[:1] if _one_for_all(crane, cases) else cases)]),
        }
        coords = {} if single else {"case": _labels(crane, cases)}
        columns = summary_columns(rows, single=single)
        data = labelled(columns, coords, attrs, step=step, single=single, series=series)
        return data.assign_attrs(window_full=int(all(c.duration - c.warm_up >= WINDOW for c in cases)))
