"""What came back of a scenario, and the numbers, status and notes that a person reads of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stillhook.engine.pack.capacity import capacity_notes, judged
from stillhook.engine.runner import OK, Run
from stillhook.engine.scenario.checks import Foreseen, foresee
from stillhook.engine.store import Summary
from stillhook.kernels.oscillation import Largest
from stillhook.spec.crane import Crane
from stillhook.tables.plausible import implausible_values, marked
from stillhook.units import show
from stillhook.variables import BY_NAME, COMMON_SUMMARY, WINDOW
from stillhook.winches.registry import WinchType

OSCILLATES = "oscillates"
"""Word for an oscillation in a run's status."""
OF_OSCILLATION = ("oscillation_time", "oscillation_period", "oscillation_v_w", "oscillation_F_w")
"""Numbers of an oscillation that the motion of the tip does not explain: see
`stillhook.kernels.oscillation`."""
OF_ALARMS = ("alarms", "alarm_first")
"""Numbers of a run whose PLC checks what it reads, [control.guard] of the crane file."""
OF_EVERY_WINCH = {"saturation": "saturated", "slack": "slack", "wire": "wire"}
"""Limits that every winch has, and their words in a status."""
REACHED: Mapping[str, tuple[tuple[str, str], ...]] = {
    "cavitation": (("void_max", "vapour up to"), ("p_min", "pressure down to")),
    "relief": (("p_max", "pressure up to"), ("p_r_max", "pressure up to")),
    "overspeed": (("omega_m_max", "motor speed up to"),),
    "rail": (("p_r_min", "pressure down to"),),
    "rod_speed": (("v_rod_max", "rod speed up to"),),
    "power": (("P_hpu_max", "power up to"),),
}
"""How far a limit was passed: the first of these numbers that a winch type has, and that is not 0."""
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
COMMON = tuple(v.name for v in COMMON_SUMMARY if v.name not in ("status", "notes"))
"""Numbers of a run that every winch type has."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ScenarioRun(Run):
    """What came back of a scenario: statistics, the three peak-to-peak values over the moving window [m] and whether
    the run was as long as that, PLC cycle and warm-up [s], statistics of the warm-up (None without one), what the
    controllers carry at the end, memory of the checks (None without)."""

    stats: Any
    span: tuple[float, float, float]
    full_window: bool
    t_cycle: float
    warm_up: float
    before: Any
    laws: Any
    checks: Any = None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Keys and SI units of `stillhook.variables.SUMMARY`; a run that is manual throughout has NaN for the numbers
        of the position."""
        crane, case = self.crane, self.case
        foreseen = foresee(crane, case)
        doubts = (*implausible_values(crane), *implausible_values(case))
        swing = self.stats.oscillation.largest
        heavy = capacity_notes(crane, foreseen.F_rest, self.stats.common.F_max + foreseen.wire, foreseen.wire)
        notes = [*doubts, *oscillation_notes(crane, swing), *heavy, *foreseen.notes, *_window_notes(self)]
        notes += alarm_notes(self.checks)
        winch, st, t = crane.plant.type, self.stats.common, self.t_cycle
        notes += warm_up_notes(winch, self.before, t)
        if self.diverged:
            notes.append(self.loss_note)
        e_c_pp, e_c_pp_measured, s_tip_pp = self.span
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
            **winch_numbers(winch, self.stats, t),
            "energy_through": st.through * t,
            "energy_unaccounted": self.energy_unaccounted,
            "counted_time": weight * t,
            "warm_up": self.warm_up,
            **(alarm_numbers(self.checks) if crane.control.guard is not None else {}),
        }
        if self.diverged:
            numbers = dict.fromkeys(numbers, math.nan)
        elif not any(m.compensates for m in (case.mode, *(m for _, m in case.modes))):
            numbers |= dict.fromkeys(POSITION, math.nan)
        return {
            "status": marked(status(self, foreseen), doubts),
            **numbers,
            "validated": float(foreseen.validated),
            "notes": notes,
        }

    @property
    def energy_unaccounted(self) -> float:
        """Energy that the audit does not find again, over the energy through the winch [-].

        In: what drives the winch, and the tip. Out: what the winch type and the load path lose. Stored: shaft, load,
        wire, oil.
        """
        st = self.stats.common
        supplied, consumed = self.crane.plant.type.energies(self.stats.power)
        through = st.through * self.t_cycle
        if through == 0.0:
            return math.nan
        return float(((supplied - consumed) * self.t_cycle - (st.E_end - st.E_start)) / through)

    @property
    def row(self) -> Summary:
        s, names = self.summary, numbers_of(self.crane)
        return Summary(names, s["status"], (s[name] for name in names), s["notes"])


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


def status(run: ScenarioRun, foreseen: Foreseen) -> str:
    """ "ok", or the limits that the counted part of the run went beyond, joined by commas.

    "overload", "peak load": more at the crane tip than it carries, at rest or in a peak, the wire included
    (`stillhook.engine.pack.capacity`).
    "oscillates": the wire's speed swings by itself (`stillhook.kernels.oscillation`). "unstable": K_p is
    above the limit of the published loop of closed circuits; its absence says nothing. "audit": energy does not add up,
    so the numbers are wrong; judged only for runs as long as the window, and not where a wire snaps taut within a cycle
    of the audit. "uncompensated": the error is about as large as the motion of the tip, or larger; judged only for
    plain compensation, where nothing else moves the hook.
    """
    if run.diverged:
        return "diverged"
    crane, case, st = run.crane, run.case, run.stats.common
    beyond = limits_passed(crane.plant.type, run.stats)
    beyond += judged(crane, foreseen.F_rest, st.F_max + foreseen.wire)
    one_sided = st.e_min > 0.0 or st.e_max < 0.0
    if one_sided and abs(st.e_sum) > OFFSET * max(st.cycles - 1.0, 1.0):
        beyond.append("offset")
    if foreseen.unstable:
        beyond.append("unstable")
    plain = case.mode.compensates and not (case.modes or case.operator.profile or case.operator.steps)
    e_c_pp, _, s_tip_pp = run.span
    if run.full_window and "slack" not in beyond and _audit_fails(run):
        beyond.append("audit")
    if plain and s_tip_pp > 0.0 and e_c_pp > max(OFFSET, (1.0 - LEAST_EFFICIENCY) * s_tip_pp):
        beyond.append("uncompensated")
    return ", ".join(beyond) or OK


def _audit_fails(run: ScenarioRun) -> bool:
    missing = abs(run.energy_unaccounted)
    return missing > AUDIT and missing * run.stats.common.through * run.t_cycle > AUDIT_FLOOR


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
        **winch.run_numbers(stats, t_cycle),
    }


def oscillation_numbers(largest_of: Largest) -> dict[str, float]:
    """Its time [s], and period [s], wire speed [m/s] and tension [N] peak to peak where it is largest; NaN
    without one."""
    largest = (largest_of.period, largest_of.v_w, largest_of.F_w) if largest_of.time > 0.0 else (math.nan,) * 3
    return dict(zip(OF_OSCILLATION, (largest_of.time, *largest), strict=True))


def oscillation_notes(crane: Crane, largest: Largest) -> list[str]:
    """The same in a sentence with what to do; none where there is none."""
    if largest.time <= 0.0:
        return []
    return [
        f"wire speed oscillates for {show(largest.time, 'time', 3)} with period {show(largest.period, 'time', 3)},"
        f" {show(largest.v_w, 'speed', 3)} and {show(largest.F_w, 'force', 3)} peak to peak where it is largest, which"
        " the motion of the tip does not explain: the control loop is unstable or close to it, or friction sticks."
        f" Lower K_p ({show(crane.control.K_p, 'gain_per_length')}; stillhook stability has its limit), or keep the"
        " wire from going this slowly"
    ]


def _window_notes(result: ScenarioRun) -> list[str]:
    """The peak-to-peak values of a short run cover less than the window that they are defined on."""
    if result.full_window or result.diverged:
        return []
    counted = max(result.stats.common.cycles - 1.0, 0.0) * result.t_cycle
    return [
        f"the counted part of {counted:.4g} s is shorter than the window of {WINDOW:g} s: peak-to-peak values are of"
        " that part alone"
    ]


def warm_up_notes(winch: WinchType, before: Any, t_cycle: float) -> list[str]:
    """One line on the limits that were passed during the warm-up, which is part of no number: for how long, and how
    far."""
    if before is None:
        return []
    cycles = {name: getattr(before.common, f"{name}_cycles") for name in OF_EVERY_WINCH} | before.limits._asdict()
    numbers, words = winch.run_numbers(before, t_cycle), OF_EVERY_WINCH | dict(winch.causes)
    passed = []
    for name, n in cycles.items():
        if n > 0.0:
            far = [(text, of) for of, text in REACHED.get(name, ()) if numbers.get(of, 0.0) != 0.0][:1]
            reached = "".join(f", {text} {show(numbers[of], BY_NAME[of].kind, 3)}" for text, of in far)
            passed.append(f"{words[name]} for {n * t_cycle:.3g} s{reached}")
    return [f"during the warm-up, which is not counted: {'; '.join(passed)}"] if passed else []


def alarm_numbers(checks: Any) -> dict[str, float]:
    """Alarms of the PLC over a run with its warm-up, and time of the first [s], NaN without one."""
    first = checks.t_first if checks.alarms > 0.0 else math.nan
    return dict(zip(OF_ALARMS, (checks.alarms, first), strict=True))


def alarm_notes(checks: Any) -> list[str]:
    """Alarms of the PLC in words, none where there were none."""
    if checks is None or checks.alarms == 0.0:
        return []
    first = show(checks.t_first, "time", 4)
    return [f"alarms of the PLC on what it reads: {checks.alarms:.0f}, the first at {first}"]


def numbers_of(crane: Crane) -> tuple[str, ...]:
    """Numbers in the summary of a run of this crane."""
    alarms = OF_ALARMS if crane.control.guard is not None else ()
    return (*COMMON, *(row.name for row in crane.plant.type.numbers), *alarms)
