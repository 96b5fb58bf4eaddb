"""From the statistics of a lowering to the numbers that a person reads: for the whole run and for each stage."""

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from stillhook.base.identity import remembered
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.lowering.run import LiftResult, StageResult
from stillhook.engine.pack.capacity import capacity_notes, judged
from stillhook.engine.pack.lift import stand_in
from stillhook.engine.pack.programme import hanging
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.checks import (
    HeldLoad,
    alpha_wanted,
    friction_parts,
    layer_diameter_at,
    loss_notes,
    type_notes,
)
from stillhook.engine.scenario.oscillation import NUMBERS as OF_OSCILLATION
from stillhook.engine.scenario.oscillation import oscillation_notes
from stillhook.engine.scenario.problem import OK, limits_passed, winch_numbers
from stillhook.kernels.statistics.oscillation import joined
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import WinchMode
from stillhook.tables.plausible import implausible_values, marked
from stillhook.units import show
from stillhook.winches.elements.payload import NEVER, LiftStats
from stillhook.winches.joints.interface import happened
from stillhook.winches.joints.registry import JOINTS
from stillhook.winches.registry import WinchType

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
"""Numbers that the whole run and each stage have alike, in addition to those of the winch type."""
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


def numbers_of(winch: WinchType, *, joints: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Numbers that the whole run and each stage have alike; joints: types of units between hook and slings."""
    of_joints = dict.fromkeys(name for joint in joints for name in JOINTS[joint].NUMBERS)
    return (*NUMBERS, *of_joints, *(row.name for row in winch.numbers))


def stage_numbers_of(winch: WinchType, *, joints: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Numbers of a stage."""
    return ("t_begin", *numbers_of(winch, joints=joints))


def run_numbers_of(winch: WinchType, *, joints: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Numbers of the whole run."""
    return (*numbers_of(winch, joints=joints), *OF_RUN)


def merged(parts: Sequence[Any], summed: Iterable[str] = SUMMED, lowest: Iterable[str] = LOWEST) -> Any:
    """Statistics of stages one after another as those of all of them; of the winch, of the lift or of a unit in it."""
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


def total(result: LiftResult) -> StageResult:
    """Statistics of the whole run; its spans are the largest of its compensated stages, or of all where there are
    none."""
    parts = [s for _, s in result.stages]
    compensated = [p for p in parts if p.span[0] > 0.0] or parts
    span = tuple(max(p.span[i] for p in compensated) for i in range(4))
    stats, lift = merged([p.stats for p in parts]), merged([p.lift for p in parts])
    links, unit = [p.link for p in parts if p.link is not None], unit_of_joint(result.case)
    return StageResult(
        stats, lift, (span[0], span[1], span[2], span[3]), merged(links, unit.SUMMED, unit.LOWEST) if links else None
    )


def unaccounted(winch: WinchType, result: LiftResult, r: StageResult | None = None) -> float:
    """Energy that the audit does not find again, over the energy through the winch or that of the weight, the
    larger: what a sinking load gives goes over the wire through the winch, or into the water [-].

    In: pumps, boost, tip, and what the wire brings along from the drum. Out: friction, leakage, valves, damping,
    lifting, passive gas, and the work that goes into the water. Stored: shaft, oil, wire, hook, load, slings. r:
    `total` of it, where it is at hand.
    """
    stats = (total(result) if r is None else r).stats
    st, t, W = stats.common, result.interval, result.hang.works
    supplied, consumed = winch.energies(stats.power)
    of_winch = (supplied - consumed) * t - (st.E_end - st.E_start) - W.top
    water = W.buoyancy + W.inertia + W.drag + W.slam + W.bottom
    wire = W.top + W.relay + water - W.damping - W.gravity - (result.hang.E - result.hang.E_0)
    through = max(st.through * t, abs(W.gravity))
    return (of_winch + wire) / through if through > 0.0 else math.nan


def status(case: Lowering, result: LiftResult, r: StageResult, crane: Crane) -> str:
    """ "ok", or what went beyond its limit, joined by commas: those of `stillhook.engine.scenario.problem`, and "sling"
    (slings went slack while the load hung free), "touchdown" (the load touched the seabed in a stage that does not
    land), the limit of a unit between hook and slings ("compensator stroke"),
    "overload" and "peak load" (`stillhook.engine.pack.capacity`), "stuck" (a stage timed out), "unfinished".
    "audit" is not judged where the wire snaps taut within a cycle of the audit."""
    if result.ending is Ending.DIVERGED:
        return "diverged"
    beyond = limits_passed(crane.plant.type, r.stats)
    if r.lift.slack > 0.0:
        beyond.append("sling")
    if (unit := unit_of_joint(case)) is not None and unit.notes(r.link):
        beyond.append(unit.LIMIT)
    if unplanned_touches(case, result):
        beyond.append("touchdown")
    beyond += judged(crane, resting(crane, case, r), r.stats.common.F_max)
    if result.hang.course.sup.stuck > 0.0:
        beyond.append("stuck")
    elif result.hang.course.sup.done == 0.0:
        beyond.append("unfinished")
    missing = 0.0 if "slack" in beyond else abs(unaccounted(crane.plant.type, result, r))
    if (
        missing > AUDIT
        and missing * max(r.stats.common.through * result.interval, abs(result.hang.works.gravity)) > AUDIT_FLOOR
    ):
        beyond.append("audit")
    return ", ".join(beyond) or OK


def resting(crane: Crane, case: Lowering, r: StageResult) -> float:
    """Highest tension at the crane tip with payload, hook and wire at rest, between the places of the payload in the
    run [N]: it falls while the payload submerges and rises with the wire from then on."""
    ends = (z for z in (r.lift.z_max, r.lift.z_min) if abs(z) < NEVER)
    return max((hanging(crane, case, max(z, -case.depth)).F_tip for z in ends), default=0.0)


def unplanned_touches(case: Lowering, result: LiftResult) -> list[tuple[int, LiftStats]]:
    """Stages that do not land, or the time after the programme (numbered as one more stage), in which the load first
    touches the seabed."""
    lands = [s.landed or s.mode is WinchMode.LANDING for s in case.programme]
    return [(i, s.lift) for i, s in result.stages if s.lift.t_landed < NEVER and not (i < len(lands) and lands[i])]


def stage_numbers(winch: WinchType, result: LiftResult, r: StageResult) -> dict[str, float]:
    """Numbers of one stage, or of the whole run; NaN for what did not happen."""
    st, ls = r.stats.common, r.lift
    e_c_pp, s_tip_pp, load_pp, hook_pp = r.span
    touched = ls.t_landed < NEVER
    compensated = e_c_pp > 0.0
    return {
        "duration": max(st.cycles - 1.0, 0.0) * result.interval,
        "s_tip_pp": s_tip_pp,
        "e_c_pp": e_c_pp if compensated else math.nan,
        "eta_c": 1.0 - e_c_pp / s_tip_pp if compensated and s_tip_pp > 0.0 else math.nan,
        "load_pp": load_pp,
        "hook_pp": hook_pp,
        "eta_load": 1.0 - load_pp / s_tip_pp if compensated and s_tip_pp > 0.0 else math.nan,
        "F_sling_max": happened(ls.F_s_max),
        "F_sling_min": happened(ls.F_s_min),
        "DAF": happened(ls.F_s_max) / result.packed.lift.load.W,
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
        **({} if r.link is None else unit_of_joint(result.case).numbers(r.link)),
        **winch_numbers(winch, r.stats, result.interval),
    }


def unit_of_joint(case: Lowering) -> Any:
    """Module of the unit between hook and slings; None where slings alone join hook and payload."""
    return None if case.compensator is None else JOINTS[case.compensator.type]


def lift_summary(crane: Crane, case: Lowering, result: LiftResult) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Numbers of the whole run, and of each stage of the programme that was begun, the rest NaN; one more for the time
    after it."""
    names = [*result.packed.programme.names, "after"]
    r = total(result)
    winch = crane.plant.type
    run = stage_numbers(winch, result, r)
    blank = dict.fromkeys(
        stage_numbers_of(winch, joints=() if case.compensator is None else (case.compensator.type,)), math.nan
    )
    rows = [dict(blank) for _ in names]
    for (i, part), start in zip(result.stages, result.starts, strict=True):
        rows[min(i, len(rows) - 1)] = {"t_begin": start, **stage_numbers(winch, result, part)}
    W, done = result.hang.works, result.hang.course.sup.done > 0.0
    numbers: dict[str, Any] = {
        **run,
        "z_load_end": result.packed.lift.z_ref + float(result.q[-1]),
        "s_w_end": result.state.path.s_w,
        "programme_time": (result.starts[-1] if done and result.stages[-1][0] >= len(case.programme) else math.nan),
        "energy_through": r.stats.common.through * result.interval,
        "work_gravity": W.gravity,
        "work_damping": W.damping,
        "work_buoyancy": W.buoyancy,
        "work_inertia": W.inertia,
        "work_drag": W.drag,
        "work_slam": W.slam,
        "work_bottom": W.bottom,
        "energy_unaccounted": unaccounted(crane.plant.type, result, r),
    }
    if result.ending is Ending.DIVERGED:
        numbers = dict.fromkeys(numbers, math.nan)
    doubts = (*implausible_values(crane), *implausible_values(case, "lift"))
    notes_of_run = [*doubts, *notes(crane, case, result, r), *_loss_notes(crane, result, r)]
    return {"status": marked(status(case, result, r, crane), doubts), **numbers, "notes": notes_of_run}, rows


def _loss_notes(crane: Crane, result: LiftResult, r: StageResult) -> list[str]:
    """Motors that work outside the fit of their loss, with the weight that hangs on the winch at the start."""
    if result.ending is Ending.DIVERGED or not hasattr(r.stats.extremes, "alpha_m_min"):
        return []
    packed = result.packed.winch
    W, d = packed.params.hoist.load.W, layer_diameter_at(crane, packed.s_w)
    return loss_notes(friction_parts(crane, W, d, r.stats.common.v_w_max, r.stats.extremes.alpha_m_min))


def notes(crane: Crane, case: Lowering, result: LiftResult, r: StageResult) -> list[str]:
    """What a reader should know in addition to the numbers; r: `total` of the result."""
    if result.ending is Ending.DIVERGED:
        return [f"lost its numbers by {result.t_end:.2f} s"]
    notes_of_run = [
        *oscillation_notes(crane, r.stats.oscillation.largest),
        *capacity_notes(crane, resting(crane, case, r), r.stats.common.F_max),
        *type_notes(crane, held_load(crane, case, r.span[1])),
    ]
    names = [*result.packed.programme.names, "after"]
    for i, s in result.stages:
        if s.lift.slack > 0.0:
            snap = f", and snap at {show(s.lift.snap, 'force')}" if s.lift.snap > 0.0 else ""
            notes_of_run.append(
                f'phase "{names[i]}": slings slack for {s.lift.slack:.2f} s while the load hangs free{snap}'
            )
    for i, s in result.stages:
        if s.link is not None:
            notes_of_run.extend(f'phase "{names[i]}": {line}' for line in unit_of_joint(case).notes(s.link))
    for i, touch in unplanned_touches(case, result):
        notes_of_run.append(
            f'phase "{names[i]}" does not land, and the load touches the seabed in it after'
            f" {show(touch.t_landed, 'time')} at {show(touch.v_landed, 'speed')}: end the phase before it higher, or"
            ' land with mode = "landing" or landed = true'
        )
    i = min(int(result.hang.course.sup.stage), len(case.programme) - 1)
    name = names[i]
    if result.hang.course.sup.stuck > 0.0:
        notes_of_run.append(
            f'phase "{name}" did not end within its timeout of {result.packed.programme.rows[i][5]:g} s: the programme'
            " stands"
        )
    elif result.hang.course.sup.done == 0.0:
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
