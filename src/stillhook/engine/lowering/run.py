"""One lowering, or blocks of sixteen, from the first cycle to the last."""

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Progress
from stillhook.control.plc import Memory
from stillhook.control.supervisor import Stage
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.lowering.checks import check_course, check_lift, check_lift_step, check_sea, fastest_of_lift
from stillhook.engine.pack.lift import PackedLift, field_record, pack_lift, stand_in
from stillhook.engine.pack.winch import Packed
from stillhook.engine.runner import Block, Ending, each_case, nothing, run_blocks
from stillhook.engine.scenario.problem import first_lane
from stillhook.kernels.build import Setup
from stillhook.kernels.drivers.lift import NP, SIGNALS
from stillhook.kernels.lanes import access, aligned, flatten, offset, room_for, size
from stillhook.kernels.statistics.cycles import blank
from stillhook.physics.records import fields
from stillhook.sea.vessel.realisation import WaveField
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.winches.elements.lift import Course, Hanging
from stillhook.winches.elements.payload import LiftStats, Momentum, blank_lift_stats
from stillhook.winches.joints.registry import JOINTS, joint_of
from stillhook.winches.records import Tick

PEAKS = ("F_w_max", "F_sling_max", "F_sling_min", "v_tip_max", "v_w_max", "e_c_pp", "s_tip_pp", "load_pp", "hook_pp")
"""Largest and least numbers that are kept of every interval of a run; a peak-to-peak is that of a window which ends in
the interval."""
PEAK_INTERVAL, MOST_INTERVALS = 10.0, 360
"""Length of an interval [s], and how many there are at the most: of longer runs an interval is twice as long, or four
times."""


def peak_interval(duration: float) -> float:
    """Length of the intervals of a run [s]."""
    doubled = max(math.ceil(math.log2(max(duration, PEAK_INTERVAL) / (PEAK_INTERVAL * MOST_INTERVALS))), 0)
    return float(PEAK_INTERVAL * 2**doubled)


MAY_END = 0.6
"""Part of the duration from which on a run that may end with its programme is looked at more often."""

ROWS = 5
"""Numbers of one node of the wire: see `stillhook.kernels.drivers.lift`."""


PACKED = tuple(name for name in Lowering.model_fields if name not in ("name", "tip", "waves"))
"""Parts of a lowering that its records follow from, apart from the levels of its water and the height of the tip at the
start."""


class StageResult(NamedTuple):
    """Statistics of one stage; span largest peak-to-peak over the moving window of control error, tip, payload, hook
    [m], over the whole stage where that is shorter; link: of a unit between hook and slings, None where there is
    none."""

    stats: Any
    lift: LiftStats
    span: tuple[float, float, float, float]
    link: Any = None


class LiftResult(NamedTuple):
    """What came out of one lowering. stages: number of the stage and its statistics, in the order of time, the last
    that after the programme where it ended; series rows of Signals and LiftSignals every dt [s], or None; peaks rows of
    `PEAKS`, one for each interval of `peak_interval` of its duration; interval at which statistics were taken [s]."""

    case: Lowering
    packed: PackedLift
    stages: tuple[tuple[int, StageResult], ...]
    starts: tuple[float, ...]
    ending: Ending
    t_end: float
    state: Any
    memory: Memory
    hang: Hanging
    q: FloatArray
    v: FloatArray
    series: FloatArray | None
    peaks: FloatArray
    signals: tuple[str, ...]
    dt: float
    step: float
    interval: float


def waves_step(waves: WaveField | None) -> float:
    """What the water of lowerings must share to run side by side: spacing of its samples [s]; 0 for still water."""
    return 0.0 if waves is None else waves.dt


class Ready(NamedTuple):
    """A lowering that was checked and packed."""

    case: Lowering
    packed: PackedLift
    drive: CycleInputs

    @property
    def winch(self) -> Packed:
        """Records of its winch."""
        return self.packed.winch


def prepare(
    crane: Crane | Sequence[Crane], cases: Sequence[Lowering], n_sub: int, places: Sequence[int] | None = None
) -> list[Ready]:
    """Checked and packed lowerings; crane that of all, or one for each; places their numbers in a longer list, for
    messages.
    Errors: LiftError, ScenarioError, SpecError naming the case."""
    packed_lifts: dict[tuple[Any, ...], PackedLift] = {}

    def make(each: Crane, case: Lowering) -> Ready:
        check_sea(case)
        drive = CycleInputs(each, stand_in(each, case, 0.0))
        alike = id(each), field_record(case.waves), drive.s_tip_0, *(id(getattr(case, name)) for name in PACKED)
        packed = packed_lifts[alike] = (
            packed_lifts[alike] if alike in packed_lifts else _packed(each, case, drive, n_sub)
        )
        return Ready(case, packed, drive)

    return each_case([crane] * len(cases) if isinstance(crane, Crane) else crane, cases, make, places)


def longest_step(crane: Crane, case: Lowering) -> float:
    """Longest step that a lift can be run with [s]; its sea does not count. Errors: LiftError, SpecError, one line."""
    check_lift(crane, case)
    return 1.0 / fastest_of_lift(pack_lift(crane, case, CycleInputs(crane, stand_in(crane, case, 0.0)).s_tip_0))[1]


def _packed(crane: Crane, case: Lowering, drive: CycleInputs, n_sub: int) -> PackedLift:
    check_lift(crane, case)
    packed = pack_lift(crane, case, drive.s_tip_0)
    check_course(crane, case, packed)
    check_lift_step(packed, drive.t_cycle / n_sub)
    return packed


def run_lowerings(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Lowering],
    *,
    n_sub: int,
    lanes: int,
    every: int,
    threads: int = 2,
    progress: Progress | None = None,
    places: Sequence[int] | None = None,
    sampled: int = 1,
    short: bool = False,
) -> list[LiftResult]:
    """Lowerings in blocks of `lanes` (1 or 16), the blocks shared by threads; a failed case is marked and spoils no
    other.

    crane that of all cases, or one for each; several are of one winch type and have one PLC cycle. n_sub steps per PLC
    cycle; a row of the series every `every` cycles (0: statistics alone). places: numbers of the cases in a longer
    list, for messages. sampled: statistics, windows and energies are taken every so many cycles. short: a lowering ends
    with the piece in which its programme ends.
    """
    prepared = prepare(crane, cases, n_sub, places)
    return run_blocks(
        prepared,
        LiftBlock,
        n_sub=n_sub,
        lanes=lanes,
        every=every,
        threads=threads,
        progress=progress,
        sampled=sampled,
        short=short,
    )


ON_SLINGS = Setup(joint=joint_of(None))
"""What the kernel of a lowering without a unit between hook and slings runs besides its winch."""


def setup_of(lift: Lowering) -> Setup:
    """What the kernel of a lowering runs besides its winch."""
    return Setup(joint=joint_of(lift.compensator))


@functools.cache
def record_of(cls: type) -> Callable[[Sequence[float], int], Any]:
    """Makes a record of the numbers that begin at a place of a list."""
    return access(cls, 1).load


class LiftBlock(Block[Ready]):
    """Lowerings of equal length side by side; missing lanes repeat the first case."""

    @staticmethod
    def setup(r: Ready) -> Setup:
        return setup_of(r.case)._replace(sensors=r.winch.sensors)

    @staticmethod
    def alike(r: Ready) -> tuple[int, int, int, float]:
        return r.drive.n_ticks, r.drive.cols, r.case.wire.nodes, waves_step(r.case.waves)

    def __init__(
        self,
        ready: Sequence[Ready],
        *,
        lanes: int,
        n_sub: int,
        every: int,
        sampled: int = 1,
        short: bool = False,
    ) -> None:
        self.sampled, self.short = sampled, short
        if short:
            self.short_from = round(MAY_END * ready[0].drive.n_ticks)
        super().__init__(ready, lanes=lanes, n_sub=n_sub, every=every)
        d = self.d
        self.n = ready[0].case.wire.nodes
        self.dt_waves = waves_step(ready[0].case.waves)
        self.levels = max(0 if r.case.waves is None else r.case.waves.w.shape[1] for r in ready)
        self.n_stages = max(len(r.packed.programme.rows) for r in ready)
        self.S, self.T = self._stages(), aligned(np.stack([r.packed.table for r in self.lanes], axis=-1))
        self.n_stats = size(d.Stats) + sum(map(size, d.parts.stats.values()))
        self.G = np.full((self.n_stages + 1, self.n_stats + SIGNALS, lanes), np.nan)
        self.starts = np.full((self.n_stages + 1, lanes), np.nan)
        interval = peak_interval(self.drive.n_ticks * self.drive.t_cycle)
        self.n_peak = max(round(interval / (sampled * self.drive.t_cycle)), 1) * sampled
        self.P = np.full((self.drive.n_ticks // self.n_peak + 1, NP, lanes), -np.inf)
        self.first = np.array(flatten((blank(d.Stats, d.plant), blank_lift_stats(), *self.of_joint())))
        self.B = aligned(np.stack([self._rows(r) for r in self.lanes], axis=-1))

    def _stages(self) -> FloatArray:
        """Stages of every lane; a shorter programme goes no further than its last."""
        S = np.zeros((self.n_stages, len(Stage._fields), len(self.lanes)))
        for l, r in enumerate(self.lanes):
            rows = r.packed.programme.rows
            S[: len(rows), :, l] = rows
            S[len(rows) :, :, l] = rows[-1]
        return aligned(S)

    def records(self) -> list[list[float]]:
        """Every lane; those that begin alike are written once."""
        written: dict[tuple[Any, ...], list[float]] = {}
        out = []
        for r in self.lanes:
            alike = id(r.packed), r.drive.first_row().tobytes()
            written[alike] = written[alike] if alike in written else self.record(r)
            out.append(written[alike])
        return out

    def record(self, r: Ready) -> list[float]:
        """One lane before the first cycle; state and memory of the winch await `at_rest`."""
        d, packed = self.d, r.packed.winch
        tick = Tick(*r.drive.first_row())._replace(mode=packed.memory.mode)
        memory = packed.memory._replace(datum=packed.s_w - tick.s_m)
        still = nothing(Momentum)
        lane = first_lane(d, packed, tick)._replace(
            m=memory,
            ls=blank_lift_stats(),
            hang=r.packed.hang,
            lift=r.packed.lift,
            momentum=still._replace(force=still.force._replace(m_a=r.packed.m_a)),
            F_s=r.packed.F_sling,
            **({"link": r.packed.link, "cs": self.of_joint()[0]} if "link" in d.parts.others else {}),
        )
        return flatten(lane)

    def of_joint(self) -> tuple[Any, ...]:
        """Blank statistics of a unit between hook and slings, where there is one."""
        return tuple(JOINTS[joint_of(r.case.compensator)].blank() for r in self.ready[:1] if r.packed.link is not None)

    def _rows(self, r: Ready) -> FloatArray:
        """Nodes of one lane at rest."""
        rows = np.zeros((self.n + 2, ROWS))
        rows[:, 0] = r.packed.q
        rows[:-1, 2] = r.packed.weights
        return rows

    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count."""
        E, i_0 = self._water(k, count)
        self.d.run(
            self.A.reshape(-1),
            self.B.reshape(-1),
            self.n,
            self.S.reshape(-1),
            self.n_stages,
            self.T.reshape(-1),
            E.reshape(-1),
            np.zeros(8),
            self.levels,
            self.dt_waves,
            i_0,
            self.G.reshape(-1),
            self.starts.reshape(-1),
            self.first,
            self.P.reshape(-1),
            self.n_peak,
            D.reshape(-1),
            self.drive.cols,
            self.H,
            self.W,
            self.out.reshape(-1),
            self.every,
            k,
            count,
            self.drive.n_ticks,
            self.n_win,
            self.sampled,
            self.n_sub,
            self.drive.t_cycle,
        )

    def _water(self, k: int, count: int) -> tuple[FloatArray, int]:
        """Samples of the water that a piece needs, and the number of the first; waves grow with the tip's ramp."""
        dt, levels = self.dt_waves, self.levels
        if levels == 0:
            return np.zeros(1), 0
        t_cycle = self.drive.t_cycle
        lo = int(k * t_cycle / dt + 1e-9)
        hi = int((k + count) * t_cycle / dt + 1e-9) + 2
        E = room_for((hi - lo, 2 + 2 * levels, len(self.lanes)))
        done: dict[tuple[int, float], int] = {}
        for l, r in enumerate(self.lanes):
            waves = r.case.waves
            assert waves is not None
            key = id(waves), r.case.ramp
            if key in done:
                E[:, :, l] = E[:, :, done[key]]
                continue
            done[key] = l
            E[:, :, l] = ramped_samples(waves, lo, hi, r.case.ramp, levels)
        return E, lo

    def over(self) -> Iterable[int]:
        """Cases whose programme has ended, where it ends the run."""
        if not self.short:
            return ()
        stage = self.A[offset(self.d.Lane, "hang", 1) + offset(Hanging, "course", 1) + offset(Course, "stage", 1)]
        return [i for i, r in enumerate(self.ready) if stage[i] >= len(r.packed.programme.rows)]

    def sound(self) -> BoolArray:
        """Lanes whose numbers are finite, (lanes,)."""
        return np.asarray(super().sound() & np.isfinite(self.B[:, :2]).all(axis=(0, 1)))

    def reset(self, i: int) -> None:
        """Set a lane to rest again."""
        super().reset(i)
        self.B[:, :, i] = self._rows(self.lanes[i])

    def part(self, name: str, i: int) -> Any:
        """One record of lane i."""
        at, cls = offset(self.d.Lane, name, 1), dict(fields(self.d.Lane))[name]
        return record_of(cls)(self.A[at : at + size(cls), i].tolist(), 0)

    def result(self, l: int) -> LiftResult:
        """What came out of one lane."""
        t_cycle, (ending, t_end) = self.drive.t_cycle, self.ending(l)
        hang: Hanging = self.part("hang", l)
        last = int(hang.course.stage)
        self.G[last, : self.n_stats, l] = self._statistics(l)
        best = self.W.reshape(-1, SIGNALS, len(self.lanes))[2]
        self.G[last, self.n_stats :, l] = best[:, l]
        self.starts[last, l] = hang.course.k_stage * t_cycle
        ran = [s for s in range(self.n_stages + 1) if math.isfinite(self.G[s, 0, l])]
        return LiftResult(
            case=self.ready[l].case,
            packed=self.ready[l].packed,
            stages=tuple((s, self._stage(s, l)) for s in ran),
            starts=tuple(float(self.starts[s, l]) for s in ran),
            ending=ending,
            t_end=t_end,
            state=self.part("x", l),
            memory=self.part("m", l),
            hang=hang,
            q=self.B[:, 0, l].copy(),
            v=self.B[:, 1, l].copy(),
            series=self.series(l),
            peaks=self._peaks(l),
            signals=self.d.columns,
            dt=self.every * t_cycle,
            step=t_cycle / self.n_sub,
            interval=self.sampled * t_cycle,
        )

    def _peaks(self, l: int) -> FloatArray:
        """Rows of `PEAKS` of one lane, of whole intervals; the last cycle, which begins an interval of its own, is left
        out."""
        peaks = self.P[: self.ran // self.n_peak, :, l].copy()
        peaks[:, 2] *= -1.0
        return peaks

    def _stage(self, s: int, l: int) -> StageResult:
        row = self.G[s, :, l].tolist()
        e_c, tip, load, hook = row[self.n_stats :]
        parts, at = [], 0
        for cls in (self.d.Stats, *self.d.parts.stats.values()):
            parts.append(record_of(cls)(row, at))
            at += size(cls)
        return StageResult(parts[0], parts[1], (e_c, tip, load, hook), *parts[2:])

    def _statistics(self, l: int) -> list[float]:
        """Statistics of lane l in the stage that runs."""
        return flatten(tuple(self.part(name, l) for name in ("st", *self.d.parts.stats)))


def ramped_samples(waves: WaveField, lo: int, hi: int, ramp: float, levels: int) -> FloatArray:
    """Samples lo .. hi - 1 of the water, shape (hi - lo, 2 + 2 levels): eta, its rate, speeds and accelerations of all
    levels.

    Levels that the field does not have stand still. The samples grow from nothing over `ramp` [s] as
    `stillhook.sea.motion.motion.Ramped` does; after the last sample the last one stands.
    """
    i = np.minimum(np.arange(lo, hi), len(waves.eta) - 1)
    x = np.clip(i * waves.dt / ramp, 0.0, 1.0) if ramp > 0.0 else np.ones(len(i))
    r = (x**3 * (10.0 + x * (6.0 * x - 15.0)))[:, None]
    dr = (30.0 * x**2 * (1.0 - x) ** 2 / (ramp or 1.0))[:, None]
    more = ((0, 0), (0, levels - waves.w.shape[1]))
    eta, eta_dot, w, a = waves.eta[i, None], waves.eta_dot[i, None], np.pad(waves.w[i], more), np.pad(waves.a[i], more)
    return np.hstack([r * eta, r * eta_dot + dr * eta, r * w, r * a + dr * w])
