"""From the statistics of a run to the numbers that a person reads, named and in SI as in `stillhook.variables`."""

import math
from typing import Any

from stillhook.engine.run import Ending, Result

LIMITS = (
    ("saturated", "saturation_cycles"),
    ("relief", "relief_cycles"),
    ("overspeed", "overspeed_cycles"),
    ("accumulator", "stroke_cycles"),
    ("cavitation", "cavitation_cycles"),
    ("slack", "slack_cycles"),
)
OK = "ok"
OFFSET = 0.05
"""Mean error from which a hook that never passes its place counts as standing off [m]; paper F accepts 5 cm of error."""


def status(result: Result) -> str:
    """ "ok", or the limits that the counted part of the run went beyond, joined by commas."""
    if result.ending is Ending.DIVERGED:
        return "diverged"
    st = result.stats
    beyond = [name for name, field in LIMITS if getattr(st, field) > 0.0]
    one_sided = st.e_min > 0.0 or st.e_max < 0.0
    if one_sided and abs(st.e_sum) > OFFSET * max(st.cycles - 1.0, 1.0):
        beyond.append("offset")
    return ", ".join(beyond) or OK


def energy_unaccounted(result: Result) -> float:
    """Energy that the audit does not find again, over the energy through the pumps [-].

    In: pumps, boost, tip. Out: friction, leakage, valves, wire, drag, passive circuit's gas. Stored: shaft, load, wire, oil.
    """
    st, w = result.stats, result.stats.power
    given = w.pump + w.boost + w.passive_pump + w.tip
    taken = w.friction + w.leakage + w.relief + w.flushing + w.wire + w.drag + w.passive
    through = st.pump_abs * result.t_cycle
    if through == 0.0:
        return math.nan
    return ((given - taken) * result.t_cycle - (st.E_end - st.E_start)) / through


def summarise(result: Result, notes: tuple[str, ...] = ()) -> dict[str, Any]:
    """The summary of one run: keys and SI units of `stillhook.variables.SUMMARY`. A diverged run has NaN for every number."""
    st, t = result.stats, result.t_cycle
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
        "p_a_max": st.p_a_max,
        "p_b_max": st.p_b_max,
        "p_max": max(st.p_a_max, st.p_b_max),
        "p_min": st.p_min,
        "alpha_p_max": st.alpha_p_max,
        "alpha_m_min": st.alpha_m_min,
        "u_p_max": st.u_p_max,
        "omega_m_max": st.omega_max,
        "v_w_max": st.v_w_max,
        "v_tip_max": st.v_tip_max,
        "F_w_max": st.F_max,
        "F_w_min": st.F_min,
        "saturation_time": st.saturation_cycles * t,
        "relief_time": st.relief_cycles * t,
        "overspeed_time": st.overspeed_cycles * t,
        "stroke_time": st.stroke_cycles * t,
        "slack_time": st.slack_cycles * t,
        "cavitation_time": st.cavitation_cycles * t,
        "energy_pumps": st.pump_abs * t,
        "energy_unaccounted": energy_unaccounted(result),
        "counted_time": weight * t,
        "warm_up": result.warm_up,
    }
    if result.ending is Ending.DIVERGED:
        numbers = dict.fromkeys(numbers, math.nan)
    return {"status": status(result), **numbers, "notes": list(notes)}
