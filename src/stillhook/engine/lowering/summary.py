"""From the statistics of a lowering to the numbers that a person reads: for the whole run and for each phase."""

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.kept.identity import remembered
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.pack.capacity import capacity_notes, judged
from stillhook.engine.pack.lift import PackedLift, stand_in
from stillhook.engine.pack.programme import hanging
from stillhook.engine.runner import OK, Run
from stillhook.engine.scenario.checks import (
    HeldLoad,
    alpha_wanted,
    friction_parts,
    layer_diameter_at,
    loss_notes,
    type_notes,
)
from stillhook.engine.scenario.summary import (
    OF_ALARMS,
    OF_OSCILLATION,
    alarm_notes,
    alarm_numbers,
    limits_passed,
    oscillation_notes,
    winch_numbers,
)
from stillhook.engine.store import Summary
from stillhook.kernels.oscillation import joined
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.phase import WinchMode
from stillhook.tables.plausible import implausible_values, marked
from stillhook.units import show
from stillhook.winches.load_path import deck
from stillhook.winches.load_path.interface import happened
from stillhook.winches.load_path.lift import Hanging
from stillhook.winches.load_path.payload import NEVER, LiftStats
from stillhook.winches.load_path.registry import ELEMENTS, UNITS
from stillhook.winches.registry import WINCH_TYPES, WinchType

PEAKS = ("F_w_max", "F_sling_max", "F_sling_min", "v_tip_max", "v_w_max", "e_c_pp", "s_tip_pp", "load_pp", "hook_pp")
"""Largest and least numbers that are kept of every interval of a run; a peak-to-peak is that of a window which ends in
the interval."""
PEAK_INTERVAL, MOST_INTERVALS = 10.0, 360
"""Length of an interval [s], and how many there are at the most: of longer runs an interval is twice as long, or four
times."""
AUDIT = 0.01
"""Energy not recovered, over all that passed, from which a lowering is numerically wrong [-]; sound ones stay below
1e-3."""
AUDIT_FLOOR = 1.0e4
"""Energy below which nothing moves that an audit could judge [J]: a tonne by a metre."""
LOWEST = {"e_min", "em_min", "tip_min", "F_min", "F_s_min", "z_min", "v_min", "t_landed"}
SUMMED = {"cycles", "e_sum", "e2_sum", "tip_sum", "tip2_sum", "through", "slack", "slack_landed"}


NUMBERS = (
    "duration",
    "s_tip_pp",
    "e_c_pp",
    "eta_c",
    "load_pp",
    "hook_pp",
    "eta_load",
    "F_w_max",
    "F_w_min",
    "F_sling_max",
    "F_sling_min",
    "DAF",
    "snap",
    "sling_slack_time",
    "sling_slack_landed_time",
    "slack_time",
    "z_load_min",
    "z_load_max",
    "v_load_min",
    "v_load_max",
    "F_slam_max",
    "F_drag_max",
    "F_bottom_max",
    "t_landed",
    "v_landed",
    "v_hit_max",
    "u_p_max",
    "v_w_max",
    "v_tip_max",
    "saturation_time",
    "wire_time",
    *OF_OSCILLATION,
)
"""Numbers that the whole run and each phase have alike, in addition to those of the winch type."""
OF_RUN = (
    "z_load_end",
    "s_w_end",
    "programme_time",
    "energy_through",
    "work_gravity",
    "work_damping",
    "work_buoyancy",
    "work_inertia",
    "work_drag",
    "work_slam",
    "work_bottom",
    "energy_unaccounted",
)
"""Numbers of the whole run alone."""


def peak_interval(duration: float) -> float:
    """Length of the intervals of a run [s]."""
    doubled = max(math.ceil(math.log2(max(duration, PEAK_INTERVAL) / (PEAK_INTERVAL * MOST_INTERVALS))), 0)
    return float(PEAK_INTERVAL * 2**doubled)


def numbers_of(winch: WinchType, *, joints: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Numbers that the whole run and each phase have alike; joints: types of units between hook and slings."""
    of_joints = dict.fromkeys(name for joint in joints for name in ELEMENTS[joint].NUMBERS)
    return (*NUMBERS, *of_joints, *(row.name for row in winch.numbers))


def phase_numbers_of(winch: WinchType, *, joints: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Numbers of a phase."""
    return ("t_begin", *numbers_of(winch, joints=joints))


def run_numbers_of(winch: WinchType, *, joints: tuple[str, ...] = (), checks: bool = False) -> tuple[str, ...]:
    """Numbers of the whole run; checks: whether the PLC has them."""
    return (*numbers_of(winch, joints=joints), *OF_RUN, *(OF_ALARMS if checks else ()))


def joints_of(cases: Sequence[Lowering | InSea]) -> tuple[str, ...]:
    """Types of the units above the slings of these cases, and "deck" where there is one below; none where slings alone
    join hook and payload."""
    lifts = [lift_of(case) for case in cases]
    units = {lift.compensator.type for lift in lifts if lift.compensator is not None}
    return tuple(sorted(units | {deck.NAME for lift in lifts if lift.deck is not None}))


def lift_of(case: Lowering | InSea) -> Lowering:
    """The lift, without its sea where that is made when it is run."""
    return case.lift if isinstance(case, InSea) else case


def intervals_of(case: Lowering | InSea) -> int:
    """Intervals of which the largest values are kept."""
    duration = lift_of(case).duration
    return int(duration / peak_interval(duration) + 1e-6)


def phases_of(case: Lowering | InSea) -> int:
    """Rows of phases in the answer: those of the programme, and the time after it."""
    return len(lift_of(case).programme) + 1


def names_of(crane: Crane, case: Lowering | InSea, joints: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """Names of all numbers in one row: of the run, then of each phase and of each interval; joints: in place of the
    case's own."""
    own = joints_of([case]) if joints is None else joints
    return _names(crane.plant.type.name, phases_of(case), intervals_of(case), own, crane.control.guard is not None)


@functools.cache
def _names(plant: str, phases: int, intervals: int, joints: tuple[str, ...], checks: bool) -> tuple[str, ...]:
    winch = WINCH_TYPES[plant]
    of_phases = (f"{i} {name}" for i in range(phases) for name in phase_numbers_of(winch, joints=joints))
    of_intervals = (f"{i} peak {name}" for i in range(intervals) for name in PEAKS)
    return (*run_numbers_of(winch, joints=joints, checks=checks), *of_phases, *of_intervals)


class PhaseResult(NamedTuple):
    """Statistics of one phase; span largest peak-to-peak over the moving window of control error, tip, payload, hook
    [m], over the whole phase where that is shorter; link: of a unit between hook and slings, deck: of a deck, None
    where there is none."""

    stats: Any
    lift: LiftStats
    span: tuple[float, float, float, float]
    link: Any = None
    deck: Any = None


@dataclass(frozen=True, eq=False, kw_only=True)
class LoweringRun(Run):
    """What came back of a lowering. phases: number of the phase and its statistics, in the order of time, the last
    that after the programme where it ended; starts of these [s]; series: rows of Signals and LiftSignals; peaks: rows
    of `PEAKS`, one for each interval of `peak_interval`; interval at which statistics were taken [s]; checks: memory of
    those of the PLC, None where it has none."""

    packed: PackedLift
    phases: tuple[tuple[int, PhaseResult], ...]
    starts: tuple[float, ...]
    hang: Hanging
    q: FloatArray
    v: FloatArray
    peaks: FloatArray
    interval: float
    checks: Any = None

    @cached_property
    def total(self) -> PhaseResult:
        """Statistics of the whole run; its spans are the largest of its compensated phases, or of all where there are
        none."""
        parts = [s for _, s in self.phases]
        compensated = [p for p in parts if p.span[0] > 0.0] or parts
        e_c, tip, load, hook = (max(p.span[i] for p in compensated) for i in range(4))
        links, unit = [p.link for p in parts if p.link is not None], unit_of_joint(self.case)
        return PhaseResult(
            stats=merged([p.stats for p in parts]),
            lift=merged([p.lift for p in parts]),
            span=(e_c, tip, load, hook),
            link=merged(links, unit.SUMMED, unit.LOWEST) if links else None,
            deck=merged([p.deck for p in parts], deck.SUMMED, deck.LOWEST) if parts[0].deck is not None else None,
        )

    @cached_property
    def energy_unaccounted(self) -> float:
        """Energy that the audit does not find again, over the energy through the winch or that of the weight, the
        larger: what a sinking load gives goes over the wire through the winch, or into the water [-].

        In: pumps, boost, tip, and what the wire brings along from the drum. Out: friction, leakage, valves, damping,
        lifting, passive gas, and the work that goes into the water. Stored: shaft, oil, wire, hook, load, slings.
        """
        stats = self.total.stats
        st, t, W = stats.common, self.interval, self.hang.works
        supplied, consumed = self.crane.plant.type.energies(stats.power)
        of_winch = (supplied - consumed) * t - (st.E_end - st.E_start) - W.top
        water = W.buoyancy + W.inertia + W.drag + W.slam + W.bottom
        wire = W.top + W.relay + water - W.damping - W.gravity - (self.hang.E - self.hang.E_0)
        through = max(st.through * t, abs(W.gravity))
        return float((of_winch + wire) / through) if through > 0.0 else math.nan

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Of the whole run."""
        return lift_summary(self)[0]

    @property
    def row(self) -> Summary:
        """The whole run, each phase, and the peaks of every interval."""
        run, phases = lift_summary(self)
        winch, joints = self.crane.plant.type, joints_of([self.case])
        peaks = np.full((intervals_of(self.case), len(PEAKS)), math.nan)
        if not self.diverged:
            n = min(len(peaks), len(self.peaks))
            peaks[:n] = self.peaks[:n]
        numbers = itertools.chain(
            (run[name] for name in run_numbers_of(winch, joints=joints, checks=self.checks is not None)),
            (phase[name] for phase in phases for name in phase_numbers_of(winch, joints=joints)),
            peaks.ravel(),
        )
        return Summary(names_of(self.crane, self.case), run["status"], numbers, run["notes"])


def merged(parts: Sequence[Any], summed: Iterable[str] = SUMMED, lowest: Iterable[str] = LOWEST) -> Any:
    """Statistics of phases one after another as those of all of them; of the winch, of the lift or of a unit in it."""
    cls = type(parts[0])
    values: dict[str, Any] = {}
    for name in cls._fields:
        column = [getattr(p, name) for p in parts]
        if name in ("power", "limits"):
            values[name] = type(column[0])(*(sum(c) for c in zip(*column, strict=True)))
        elif name == "oscillation":
            values[name] = joined(column)
        elif isinstance(column[0], tuple):
            values[name] = merged(column)
        elif name == "E_start":
            values[name] = column[0]
        elif name == "E_end":
            values[name] = column[-1]
        elif name == "v_landed":
            values[name] = next((p.v_landed for p in parts if p.t_landed < NEVER), 0.0)
        elif name in summed or name.endswith("_cycles"):
            values[name] = sum(column)
        else:
            values[name] = min(column) if name in lowest or name.endswith("_min") else max(column)
    return cls(**values)


def status(run: LoweringRun) -> str:
    """ "ok", or what went beyond its limit, joined by commas: those of `stillhook.engine.scenario.summary`, and "sling"
    (slings went slack while the load hung free), "touchdown" (the load touched the seabed or a deck in a phase that
    does not land), "second hit" (a load that was lifted off a deck was hit by it again), the limit of a unit between
    hook and slings ("compensator stroke"), "overload" and "peak load" (`stillhook.engine.pack.capacity`), "stuck" (a
    phase timed out), "unfinished".
    "audit" is not judged where the wire snaps taut within a cycle of the audit."""
    if run.diverged:
        return "diverged"
    crane, case, r = run.crane, run.case, run.total
    beyond = limits_passed(crane.plant.type, r.stats)
    if r.lift.slack > 0.0:
        beyond.append("sling")
    if (unit := unit_of_joint(case)) is not None and unit.notes(r.link):
        beyond.append(unit.LIMIT)
    if unplanned_touches(run):
        beyond.append("touchdown")
    if second_hits(run):
        beyond.append("second hit")
    beyond += judged(crane, resting(run), r.stats.common.F_max)
    if run.hang.course.sup.stuck > 0.0:
        beyond.append("stuck")
    elif run.hang.course.sup.done == 0.0:
        beyond.append("unfinished")
    missing = 0.0 if "slack" in beyond else abs(run.energy_unaccounted)
    if (
        missing > AUDIT
        and missing * max(r.stats.common.through * run.interval, abs(run.hang.works.gravity)) > AUDIT_FLOOR
    ):
        beyond.append("audit")
    return ", ".join(beyond) or OK


def resting(run: LoweringRun) -> float:
    """Highest tension at the crane tip with payload, hook and wire at rest, between the places of the payload in the
    run [N]: it falls while the payload submerges and rises with the wire from then on."""
    case, lift = run.case, run.total.lift
    ends = (z for z in (lift.z_max, lift.z_min) if abs(z) < NEVER)
    return max((hanging(run.crane, case, max(z, -case.depth)).F_tip for z in ends), default=0.0)


def unplanned_touches(run: LoweringRun) -> list[tuple[int, LiftStats]]:
    """Phases that do not land, or the time after the programme (numbered as one more phase), in which the load first
    touches the seabed, or the deck that it did not start on."""
    lands = [s.landed or s.mode is WinchMode.LANDING for s in run.case.programme]
    touches = [] if run.case.on_deck else run.phases
    return [(i, s.lift) for i, s in touches if s.lift.t_landed < NEVER and not (i < len(lands) and lands[i])]


def second_hits(run: LoweringRun) -> list[tuple[int, dict[str, float]]]:
    """Phases, numbered as in `unplanned_touches`, in which a load that was lifted off a deck hits it again, and the
    deck's numbers of them."""
    return [(i, deck.numbers(s.deck)) for i, s in run.phases if run.case.on_deck and s.deck.hits > 0.0]


def phase_numbers(run: LoweringRun, r: PhaseResult) -> dict[str, float]:
    """Numbers of one phase, or of the whole run; NaN for what did not happen."""
    st, ls = r.stats.common, r.lift
    e_c_pp, s_tip_pp, load_pp, hook_pp = r.span
    touched = ls.t_landed < NEVER
    compensated = e_c_pp > 0.0
    return {
        "duration": max(st.cycles - 1.0, 0.0) * run.interval,
        "s_tip_pp": s_tip_pp,
        "e_c_pp": e_c_pp if compensated else math.nan,
        "eta_c": 1.0 - e_c_pp / s_tip_pp if compensated and s_tip_pp > 0.0 else math.nan,
        "load_pp": load_pp,
        "hook_pp": hook_pp,
        "eta_load": 1.0 - load_pp / s_tip_pp if compensated and s_tip_pp > 0.0 else math.nan,
        "F_sling_max": happened(ls.F_s_max),
        "F_sling_min": happened(ls.F_s_min),
        "DAF": happened(ls.F_s_max) / run.packed.lift.load.W,
        "snap": ls.snap,
        "sling_slack_time": ls.slack,
        "sling_slack_landed_time": ls.slack_landed,
        "z_load_min": happened(ls.z_min),
        "z_load_max": happened(ls.z_max),
        "v_load_min": happened(ls.v_min),
        "v_load_max": happened(ls.v_max),
        "F_slam_max": ls.slam,
        "F_drag_max": ls.drag,
        "F_bottom_max": ls.bottom,
        "t_landed": ls.t_landed if touched else math.nan,
        "v_landed": ls.v_landed if touched else math.nan,
        "v_hit_max": ls.v_hit if touched else math.nan,
        **({} if r.link is None else unit_of_joint(run.case).numbers(r.link)),
        **({} if r.deck is None else deck.numbers(r.deck)),
        **winch_numbers(run.crane.plant.type, r.stats, run.interval),
    }


def unit_of_joint(case: Lowering) -> Any:
    """Module of the unit between hook and slings; None where slings alone join hook and payload."""
    return None if case.compensator is None else UNITS[case.compensator.type]


def lift_summary(run: LoweringRun) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Numbers of the whole run, and of each phase of the programme that was begun, the rest NaN; one more for the time
    after it."""
    crane, case, r = run.crane, run.case, run.total
    blank = dict.fromkeys(phase_numbers_of(crane.plant.type, joints=joints_of([case])), math.nan)
    rows = [dict(blank) for _ in range(phases_of(case))]
    for (i, part), start in zip(run.phases, run.starts, strict=True):
        rows[min(i, len(rows) - 1)] = {"t_begin": start, **phase_numbers(run, part)}
    W, done = run.hang.works, run.hang.course.sup.done > 0.0
    numbers: dict[str, Any] = {
        **phase_numbers(run, r),
        "z_load_end": run.packed.lift.z_ref + float(run.q[-1]),
        "s_w_end": run.state.path.s_w,
        "programme_time": (run.starts[-1] if done and run.phases[-1][0] >= len(case.programme) else math.nan),
        "energy_through": r.stats.common.through * run.interval,
        "work_gravity": W.gravity,
        "work_damping": W.damping,
        "work_buoyancy": W.buoyancy,
        "work_inertia": W.inertia,
        "work_drag": W.drag,
        "work_slam": W.slam,
        "work_bottom": W.bottom,
        "energy_unaccounted": run.energy_unaccounted,
        **({} if run.checks is None else alarm_numbers(run.checks)),
    }
    if run.diverged:
        numbers = dict.fromkeys(numbers, math.nan)
    doubts = (*implausible_values(crane), *implausible_values(case, "lift"))
    notes_of_run = [*doubts, *notes(run), *_loss_notes(run), *alarm_notes(run.checks)]
    return {"status": marked(status(run), doubts), **numbers, "notes": notes_of_run}, rows


def _loss_notes(run: LoweringRun) -> list[str]:
    """Motors that work outside the fit of their loss, with the weight that hangs from the winch at the start."""
    crane, r = run.crane, run.total
    if run.diverged or not hasattr(r.stats.extremes, "alpha_m_min"):
        return []
    packed = run.packed.winch
    W, d = packed.params.hoist.load.W, layer_diameter_at(crane, packed.s_w)
    return loss_notes(friction_parts(crane, W, d, r.stats.common.v_w_max, r.stats.extremes.alpha_m_min))


def notes(run: LoweringRun) -> list[str]:
    """What a reader should know in addition to the numbers."""
    if run.diverged:
        return [run.loss_note]
    crane, case, r = run.crane, run.case, run.total
    notes_of_run = [
        *oscillation_notes(crane, r.stats.oscillation.largest),
        *capacity_notes(crane, resting(run), r.stats.common.F_max),
        *type_notes(crane, held_load(crane, case, r.span[1])),
    ]
    names = [*run.packed.programme.names, "after"]
    for i, s in run.phases:
        if s.lift.slack > 0.0:
            snap = f", and snap at {show(s.lift.snap, 'force')}" if s.lift.snap > 0.0 else ""
            notes_of_run.append(
                f'phase "{names[i]}": slings slack for {s.lift.slack:.2f} s while the load hangs free{snap}'
            )
    for i, s in run.phases:
        if s.link is not None:
            notes_of_run.extend(f'phase "{names[i]}": {line}' for line in unit_of_joint(case).notes(s.link))
    for i, hit in second_hits(run):
        notes_of_run.append(
            f'phase "{names[i]}": the deck hits the load again after {show(hit["t_second_hit"], "time")},'
            f" {int(hit['second_hits'])} times at up to {show(hit['v_second_hit_max'], 'speed')}: hoist faster,"
            " or begin at another moment of the deck's motion"
        )
    ground = "seabed" if case.deck is None else "deck"
    for i, touch in unplanned_touches(run):
        notes_of_run.append(
            f'phase "{names[i]}" does not land, and the load touches the {ground} in it after'
            f" {show(touch.t_landed, 'time')} at {show(touch.v_landed, 'speed')}: end the phase before it higher, or"
            ' land with mode = "landing" or landed = true'
        )
    i = min(int(run.hang.course.sup.stage), len(case.programme) - 1)
    name = names[i]
    if run.hang.course.sup.stuck > 0.0:
        notes_of_run.append(
            f'phase "{name}" did not end within its timeout of {run.packed.programme.rows[i][5]:g} s: the programme'
            " stopped there"
        )
    elif run.hang.course.sup.done == 0.0:
        notes_of_run.append(
            f'the run of {case.duration:g} s ends in phase "{name}": run longer for the whole programme'
        )
    return notes_of_run


def held_load(crane: Crane, case: Lowering, s_tip_pp: float) -> HeldLoad:
    """What the winch holds at the start of a lowering, payload, hook and wire; s_tip_pp motion that it compensates
    [m]."""
    still = _held_by(crane)(case)
    return still._replace(s_tip_pp=s_tip_pp) if still.compensates else still


@remembered
def _held_by(crane: Crane) -> Callable[[Lowering], HeldLoad]:
    """What a crane holds at the start of a lowering, in a calm: once for all seas of a lift."""
    return remembered(functools.partial(_held_still, crane))


def _held_still(crane: Crane, case: Lowering) -> HeldLoad:
    start, modes = hanging(crane, case, case.z_0), {s.mode for s in case.programme}
    plain, d = stand_in(crane, case, start.s_w), layer_diameter_at(crane, start.s_w)
    manual, compensates = WinchMode.MANUAL in modes, WinchMode.AHC in modes
    alpha = alpha_wanted(crane, plain, crane.drum.d_max / d, 0.0, None if compensates else MANUAL_MODE)
    return HeldLoad(
        W=start.F_tip,
        d=d,
        alpha=alpha,
        s_tip_pp=0.0,
        gas_held=False,
        manual=manual,
        compensates=compensates,
        modes=(plain.mode,) if compensates else (),
    )
