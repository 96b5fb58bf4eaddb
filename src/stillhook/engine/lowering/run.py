"""Lowerings that were packed, side by side from the first cycle to the last."""

import functools
import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.kept.identity import Keyed
from stillhook.control.supervisor import Stage
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.lowering.checks import check_lift, check_sea, fastest_of_lift
from stillhook.engine.lowering.summary import LoweringRun, PhaseResult, peak_interval
from stillhook.engine.pack.guard import guard_in
from stillhook.engine.pack.lift import PackedLift, field_record, pack_lift, stand_in
from stillhook.engine.pack.programme import pack_programme
from stillhook.engine.pack.winch import Packed
from stillhook.engine.runner import Block, nothing, record_of
from stillhook.engine.scenario.run import first_lane
from stillhook.kernels.build import Setup
from stillhook.kernels.drivers.lift import NP, SIGNALS
from stillhook.kernels.drivers.loop import MOST
from stillhook.kernels.lanes import aligned, flatten, offset, room_for, size
from stillhook.kernels.statistics import blank
from stillhook.sea.motion.motion import Ramped
from stillhook.sea.vessel.realisation import WaveField
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase
from stillhook.winches.load_path import deck
from stillhook.winches.load_path.lift import Course, Hanging
from stillhook.winches.load_path.payload import Field, Momentum, blank_lift_stats
from stillhook.winches.load_path.registry import joint_of, path_of
from stillhook.winches.records import Tick

MAY_END = 0.6
"""Part of the duration from which on a run that may end with its programme is looked at more often."""

ROWS = 5
"""Numbers of one node of the wire: see `stillhook.kernels.drivers.lift`."""


PACKED = tuple(name for name in Lowering.model_fields if name not in ("name", "tip", "waves", "programme"))
"""Parts of a lowering that its records follow from, apart from the levels of its water, the height of the tip at the
start, and the programme."""


def waves_step(waves: WaveField | None) -> float:
    """What the water of lowerings must share to run side by side: spacing of its samples [s]; 0 for still water."""
    return 0.0 if waves is None else waves.dt


class Ready(NamedTuple):
    """A lowering that was checked and packed, and what drives it."""

    crane: Crane
    case: Lowering
    packed: PackedLift
    drive: CycleInputs

    @property
    def winch(self) -> Packed:
        """Records of its winch."""
        return self.packed.winch

    @classmethod
    def of(cls, crane: Crane, case: Lowering) -> Self:
        """Errors: LiftError, ScenarioError, SpecError, one line."""
        check_sea(case)
        drive = CycleInputs(crane, stand_in(crane, case, 0.0))
        return cls(crane, case, packed_lift(crane, case, drive.s_tip_0), drive)


def packed_lift(crane: Crane, case: Lowering, s_tip_0: float) -> PackedLift:
    """A lowering checked and packed, once for all that share what its records follow from; s_tip_0 height of the tip at
    the start [m]. Errors: LiftError, SpecError, one line."""
    field, machine = field_record(case.waves), (crane, case.model_copy(update={"waves": None}))
    alike = id(crane), field, s_tip_0, *map(id, case.programme[:1]), *(id(getattr(case, name)) for name in PACKED)
    return _packed(Keyed(machine, (*alike, id(case.programme))), Keyed(machine, alike), field, s_tip_0)


@functools.lru_cache(maxsize=256)
def _packed(keyed: Keyed, at_rest: Keyed, field: Field, s_tip_0: float) -> PackedLift:
    """Programmes that begin alike share everything else."""
    crane, case = keyed.machine
    programme, packed = _at_rest(at_rest, field, s_tip_0)
    return packed if programme is case.programme else packed._replace(programme=pack_programme(crane, case))


@functools.lru_cache(maxsize=256)
def _at_rest(keyed: Keyed, field: Field, s_tip_0: float) -> tuple[tuple[Phase, ...], PackedLift]:
    crane, case = keyed.machine
    check_lift(crane, case)
    return case.programme, pack_lift(crane, case, s_tip_0, field)


def longest_step(crane: Crane, case: Lowering) -> float:
    """Longest step that a lift can be run with [s]; its sea does not count. Errors: LiftError, SpecError, one line."""
    s_tip_0 = CycleInputs(crane, stand_in(crane, case, 0.0)).s_tip_0
    return 1.0 / fastest_of_lift(packed_lift(crane, case, s_tip_0))[1]


def setup_of(lift: Lowering) -> Setup:
    """What the kernel of a lowering runs besides its winch."""
    return Setup(path_of(lift.compensator, lift.body))


class LiftBlock(Block[Ready]):
    """Lowerings of equal length side by side; missing lanes repeat the first case."""

    @staticmethod
    def setup(r: Ready) -> Setup:
        return r.winch.setup._replace(path=setup_of(r.case).path)

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
        self.n_phases = max(len(r.packed.programme.rows) for r in ready)
        self.S, self.T = self._phases(), aligned(np.stack([r.packed.rows for r in self.lanes], axis=-1))
        self.n_stats = size(d.Stats) + sum(map(size, d.parts.stats.values()))
        self.G = np.full((self.n_phases + 1, self.n_stats + SIGNALS, lanes), np.nan)
        self.starts = np.full((self.n_phases + 1, lanes), np.nan)
        interval = peak_interval(self.drive.n_ticks * self.drive.t_cycle)
        self.n_peak = max(round(interval / (sampled * self.drive.t_cycle)), 1) * sampled
        self.P = np.full((self.drive.n_ticks // self.n_peak + 1, NP, lanes), -np.inf)
        self.first = np.array(flatten((blank(d.Stats, d.plant), blank_lift_stats(), *self.of_joint(), *self.of_deck())))
        self.B = aligned(np.stack([self._rows(r) for r in self.lanes], axis=-1))

    def _phases(self) -> FloatArray:
        """Phases of every lane; a shorter programme goes no further than its last."""
        S = np.zeros((self.n_phases, len(Stage._fields), len(self.lanes)))
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
            alike = id(r.packed.hang), r.drive.first_row().tobytes()
            written[alike] = written[alike] if alike in written else self.record(r)
            out.append(written[alike])
        return out

    def record(self, r: Ready) -> list[float]:
        """One lane before the first cycle; state and memory of the winch await `at_rest`."""
        d, packed = self.d, r.packed.winch
        tick = Tick(*r.drive.first_row())._replace(mode=packed.memory.mode)
        memory = packed.memory._replace(datum=packed.s_w - tick.s_m)
        still = nothing(Momentum)
        lane = first_lane(d, packed, tick, guard_in(r.crane, packed.params))._replace(
            m=memory,
            ls=blank_lift_stats(),
            hang=r.packed.hang,
            lift=r.packed.lift,
            momentum=still._replace(force=still.force._replace(m_a=r.packed.m_a)),
            F_s=r.packed.F_sling,
            **({"link": r.packed.link, "cs": self.of_joint()[0]} if "link" in d.parts.others else {}),
            **({"deck": r.packed.deck, "ds": deck.blank()} if r.packed.deck is not None else {}),
        )
        return flatten(lane)

    def of_joint(self) -> tuple[Any, ...]:
        """Blank statistics of a unit between hook and slings, where there is one."""
        return tuple(joint_of(r.case.compensator).blank() for r in self.ready[:1] if r.packed.link is not None)

    def of_deck(self) -> tuple[Any, ...]:
        """Blank statistics of a deck, where there is one."""
        return tuple(deck.blank() for r in self.ready[:1] if r.packed.deck is not None)

    def _rows(self, r: Ready) -> FloatArray:
        """Nodes of one lane at rest."""
        rows = np.zeros((self.n + 2, ROWS))
        rows[:, 0] = r.packed.q
        rows[:-1, 2] = r.packed.weights
        return rows

    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count."""
        self.E, i_0 = self._water(k, count)
        self.d.run(
            self.A.reshape(-1),
            self.B.reshape(-1),
            self.n,
            self.S.reshape(-1),
            self.n_phases,
            self.T.reshape(-1),
            self.E.reshape(-1),
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
            self.lost,
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
        if self.ready[0].packed.deck is not None:
            return self._decks(k, count), k
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

    def _decks(self, k: int, count: int) -> FloatArray:
        """Motion s, v, a of every lane's deck in cycles k .. k + count, (count + 1, 3, lanes); it grows with the tip's
        ramp."""
        E = room_for((count + 1, 3, len(self.lanes)))
        t = np.arange(k, k + count + 1) * self.drive.t_cycle
        done: dict[tuple[int, float], int] = {}
        for l, r in enumerate(self.lanes):
            assert r.case.deck is not None
            motion, ramp = r.case.deck.motion, r.case.ramp
            if (first := done.setdefault((id(motion), ramp), l)) != l:
                E[:, :, l] = E[:, :, first]
            else:
                E[:, :, l] = np.column_stack((Ramped.from_si(motion, ramp) if ramp > 0.0 else motion).sample(t))
        return E

    def over(self) -> Iterable[int]:
        """Cases whose programme has ended, where it ends the run."""
        if not self.short:
            return ()
        phase = self.A[offset(self.d.Lane, "hang", 1) + offset(Hanging, "course", 1) + offset(Course, "stage", 1)]
        return [i for i, r in enumerate(self.ready) if phase[i] >= len(r.packed.programme.rows)]

    def sound(self) -> BoolArray:
        """Lanes whose states are numbers that a winch can reach, (lanes,)."""
        return np.asarray(super().sound() & (np.abs(self.B[:, :2]) <= MOST).all(axis=(0, 1)))

    def side_by_side(self) -> tuple[FloatArray, ...]:
        """All that lanes carry from cycle to cycle, and their programmes and payloads; the lane last."""
        return *super().side_by_side(), self.B, self.S, self.T

    def cause(self, rows: FloatArray, i: int) -> str:
        """Water or deck where one of their numbers is none; else as of any winch."""
        if self.E.ndim > 1 and not (np.abs(self.E[..., i]) <= MOST).all():
            return f"motion of its {'water' if self.levels else 'deck'} is not a number"
        return super().cause(rows, i)

    def reset(self, i: int) -> None:
        """Set a lane to rest again."""
        super().reset(i)
        self.B[:, :, i] = self._rows(self.lanes[i])

    def result(self, l: int) -> LoweringRun:
        """The run of one lane."""
        hang: Hanging = self.part("hang", l)
        last = int(hang.course.stage)
        self.G[last, : self.n_stats, l] = self._statistics(l)
        best = self.W.reshape(-1, SIGNALS, len(self.lanes))[2]
        self.G[last, self.n_stats :, l] = best[:, l]
        self.starts[last, l] = hang.course.k_stage * self.drive.t_cycle
        ran = [s for s in range(self.n_phases + 1) if math.isfinite(self.G[s, 0, l])]
        return LoweringRun(
            **self.common(l),
            packed=self.ready[l].packed,
            phases=tuple((s, self._phase(s, l)) for s in ran),
            starts=tuple(float(self.starts[s, l]) for s in ran),
            hang=hang,
            q=self.B[:, 0, l].copy(),
            v=self.B[:, 1, l].copy(),
            peaks=self._peaks(l),
            interval=self.sampled * self.drive.t_cycle,
            checks=self.part("laws", l).checks.k if self.d.laws.checks else None,
        )

    def _peaks(self, l: int) -> FloatArray:
        """Rows of `PEAKS` of one lane, of whole intervals; the last cycle, which begins an interval of its own, is left
        out."""
        peaks = self.P[: self.ran // self.n_peak, :, l].copy()
        peaks[:, 2] *= -1.0
        return peaks

    def _phase(self, s: int, l: int) -> PhaseResult:
        row = self.G[s, :, l].tolist()
        e_c, tip, load, hook = row[self.n_stats :]
        parts, at = {}, 0
        for name, cls in {"st": self.d.Stats, **self.d.parts.stats}.items():
            parts[name] = record_of(cls)(row, at)
            at += size(cls)
        span = (e_c, tip, load, hook)
        return PhaseResult(parts["st"], parts["ls"], span, parts.get("cs"), parts.get("ds"))

    def _statistics(self, l: int) -> list[float]:
        """Statistics of lane l in the phase that runs."""
        return flatten(tuple(self.part(name, l) for name in ("st", *self.d.parts.stats)))


def ramped_samples(waves: WaveField, lo: int, hi: int, ramp: float, levels: int) -> FloatArray:
    """Samples lo .. hi - 1 of the water, shape (hi - lo, 2 + 2 levels): eta, its rate, speeds and accelerations of all
    levels.

    Levels that the field does not have are at rest. The samples grow from nothing over `ramp` [s] as
    `stillhook.sea.motion.motion.Ramped` does; after the last sample the last one is kept.
    """
    i = np.minimum(np.arange(lo, hi), len(waves.eta) - 1)
    x = np.clip(i * waves.dt / ramp, 0.0, 1.0) if ramp > 0.0 else np.ones(len(i))
    r = (x**3 * (10.0 + x * (6.0 * x - 15.0)))[:, None]
    dr = (30.0 * x**2 * (1.0 - x) ** 2 / (ramp or 1.0))[:, None]
    more = ((0, 0), (0, levels - waves.w.shape[1]))
    eta, eta_dot, w, a = waves.eta[i, None], waves.eta_dot[i, None], np.pad(waves.w[i], more), np.pad(waves.a[i], more)
    return np.hstack([r * eta, r * eta_dot + dr * eta, r * w, r * a + dr * w])
