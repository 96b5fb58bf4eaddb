"""From the statistics of a run to the numbers that a person reads, named and in SI as in `stillhook.variables`."""

import math
from typing import Any

from stillhook.engine.runner import Ending
from stillhook.engine.scenario.checks import Foreseen, foresee
from stillhook.engine.scenario.run import Result
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.tables.plausible import implausible_values, marked
from stillhook.variables import WINDOW
from stillhook.winches.registry import WinchType

OK = "ok"
OFFSET = 0.05
"""Mean error from which a hook that never passes its place counts as standing off [m]; paper F accepts 5 cm of
error."""
LEAST_EFFICIENCY = 0.05
"""Efficiency below which a winch does not compensate [-]: a twentieth of the tip's motion is what friction alone takes
off."""
AUDIT = 0.05
"""Energy not found again, over that through the pumps, from which a run is numerically wrong [-]; sound runs stay below
1e-3."""
AUDIT_FLOOR = 1.0e3
"""Energy below which nothing moves that the audit could be asked of [J]: a tonne by a tenth of a metre."""
POSITION = ("e_c_pp", "e_c_pp_measured", "eta_c", "e_c_max", "e_c_mean", "e_c_std")
"""What a run in manual mode has none of: nothing is held in place there."""


def limits_passed(winch: WinchType, stats: Any) -> list[str]:
    """Words for the limits that were passed in a run: of the pumps, of the winch type's own, of the wire."""
    st = stats.common
    return [
        *(["saturated"] if st.saturation_cycles > 0.0 else []),
        *winch.limits_passed(stats),
        *(["slack"] if st.slack_cycles > 0.0 else []),
        *(["wire"] if st.wire_cycles > 0.0 else []),
    ]


def status(winch: WinchType, case: Scenario, result: Result, foreseen: Foreseen) -> str:
    """ "ok", or the limits that the counted part of the run went beyond, joined by commas.

    "unstable": K_p is above the gain of marginal stability, however the run went. "audit": the energy does not add up,
    so the numbers are wrong; asked only of runs as long as the window, and not where a wire snaps taut within a cycle
    of the audit. "uncompensated": the error is about as large as the motion of the tip, or larger; asked only of plain
    compensation, where nothing else moves the hook.
    """
    if result.ending is Ending.DIVERGED:
        return "diverged"
    st = result.stats.common
    beyond = limits_passed(winch, result.stats)
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
    """Energy that the audit does not find again, over the energy through the drive [-].

    In: what drives the winch, and the tip. Out: what the winch type and the load path lose. Stored: shaft, load, wire,
    oil.
    """
    st = result.stats.common
    supplied, taken = winch.energies(result.stats.power)
    through = st.through * result.t_cycle
    if through == 0.0:
        return math.nan
    return ((supplied - taken) * result.t_cycle - (st.E_end - st.E_start)) / through


def summarise(crane: Crane, case: Scenario, result: Result) -> dict[str, Any]:
    """The summary of one run: keys and SI units of `stillhook.variables.SUMMARY`.

    A diverged run has NaN for every number, and one that is manual throughout for those of the position.
    """
    foreseen = foresee(crane, case)
    doubts = (*implausible_values(crane), *implausible_values(case))
    notes = [*doubts, *foreseen.notes, *_window_notes(result)]
    if result.ending is Ending.DIVERGED:
        notes.append(f"lost its numbers by {result.t_end:.2f} s")
    winch, st, t = crane.plant.type, result.stats.common, result.t_cycle
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
        "energy_pumps": st.through * t,
        "energy_unaccounted": energy_unaccounted(winch, result),
        "counted_time": weight * t,
        "warm_up": result.warm_up,
    }
    if result.ending is Ending.DIVERGED:
        numbers = dict.fromkeys(numbers, math.nan)
    elif not any(m.compensates for m in (case.mode, *(m for _, m in case.modes))):
        numbers |= dict.fromkeys(POSITION, math.nan)
    return {
        "status": marked(status(winch, case, result, foreseen), doubts),
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
