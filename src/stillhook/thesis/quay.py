"""Paper E at the quay: 250 t crane, empty hook, 15 m of wire, a simulated tip. The three scenarios (figures E15 to E26,
2.24 to 2.31), and the control of the motors' displacement (E13, E14)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import xarray
from scipy.integrate import solve_ivp

from stillhook.analysis.steady.steady_state import reduction_lead
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import active_record, wire_speed_max
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.engine.simulate import simulate
from stillhook.library import changed, load_crane
from stillhook.physics.hydraulics.swash import displacement, pilot, swash_acceleration
from stillhook.sea.motion.motion import Motion, Sine, Still, Sum
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.thesis.gallery import Axis, Curve, Drawing, Panel, Printed, over_time

Runs = Mapping[str, xarray.Dataset]
CRANE = load_crane("nov-250t")
WARM = 40.0  # s
PERIOD = 12.0  # s: of the sines that paper E ran at the quay, 12 s and 6 s; those of scenarios 1 and 2 are not printed
V_PEAK = 0.5  # m/s: 30 m/min, scenario 1
S_W = 15.0  # m of wire paid out
ROLL, PITCH = (0.5, 6.0), (2.0, 13.0)  # amplitude [m], period [s] of scenario 3: section 5.1.2
BEAT = 78.0  # s: 13 periods of 6 s, 6 of 13 s
MODES = ("ns", "hs", "ssc")
COMPARED = ("hs", "ssc")
"""Controllers of scenario 3."""
DURATIONS = {1: 72.0, 2: 84.0, 3: BEAT}  # s: whole waves
WINDOWS = {1: (60.0, 86.0), 2: (60.0, 86.0), 3: (WARM, WARM + BEAT / 2.0)}  # s that the figures show
OPEN_LOOP: dict[str, Any] = {"active": {"motor": {"variant": "open-loop-feedback"}}}
D_ONE = 215.0  # cm^3/rev, one motor: 20 cm^3/rev is 9.3 % of it, and 1.9 % of all five
PATTERNS = ((12.0, 3.2), (6.0, 1.2))  # period [s], "amplitude" [m]
HALF = 0.5  # of the printed number: it is the way from trough to crest
DURATION = 72.0  # s: 6 waves of 12 s, 12 of 6 s
STEPS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.7, 0.8, 0.9, 1.0)
HOLD = 2.0  # s a step


def case(tip: Motion, mode: str, duration: float, more: Mapping[str, Any] | None = None) -> Scenario:
    """A run at the quay that lasts so long after the warm-up [s]."""
    times = {"warm_up": f"{WARM:g} s", "duration": f"{WARM + duration:g} s"}
    return Scenario(tip=tip, mode=mode, **({"load": "0 t", "s_w": f"{S_W:g} m"} | times | dict(more or {})))


def run(crane: Crane, scenario: Scenario) -> xarray.Dataset:
    return simulate(crane, scenario, every="0.02 s")


def sine(period: float, v_peak: float = V_PEAK) -> Sine:
    """A tip with this highest speed [m/s]."""
    return Sine.from_si(v_peak * period / (2.0 * math.pi), period)


def two_sines(scale: float = 1.0, phase: float = 0.0) -> Motion:
    """The tip of scenario 3; the short one starts `phase` [rad] later."""
    return Sum([Sine.from_si(scale * PITCH[0], PITCH[1]), Sine.from_si(scale * ROLL[0], ROLL[1], phase)])


def speed_of_ns(crane: Crane) -> float:
    """Speed that NS reaches without leakage on this layer, with the displacement at which its motors really stand
    [m/s]."""
    at_rest = run(crane, case(Still(), "ns", DURATIONS[2]))
    return wire_speed_max(crane, float(at_rest["alpha_m"][-1]), layer_diameter_at(crane, S_W))


@cache
def scenario_runs(number: int) -> Runs:
    """The runs of a scenario by controller."""
    tip = two_sines() if number == 3 else sine(PERIOD, V_PEAK if number == 1 else speed_of_ns(CRANE))
    return {mode.upper(): run(CRANE, case(tip, mode, DURATIONS[number])) for mode in MODES}


def reduction_left(one: xarray.Dataset) -> float:
    """Part of the motors' reduction, from full displacement to alpha_min, that stays unused [-]."""
    alpha_min = CRANE.active.motor.alpha_min
    return (float(one["alpha_m_min"]) - alpha_min) / (1.0 - alpha_min)


def _printed(number: int, runs: Runs) -> list[Printed]:
    ns, hs, ssc = runs.values()
    bar = [float(one["p_a_max"]) / 1e5 for one in (ns, hs, ssc)]
    cm = [100.0 * float(one["e_c_pp"]) for one in (ns, hs, ssc)]
    if number == 1:
        return [Printed("peak speed of the wire", "around 30 m/min", f"{60.0 * float(ssc['v_w_max']):.1f} m/min")]
    if number == 3:
        lower = f"{bar[2]:.0f} bar against {bar[1]:.0f} bar of HS, {cm[2]:.1f} cm against {cm[1]:.1f} cm"
        return [Printed("highest pressure and error of SSC", "lower than of HS", lower)]
    return [
        Printed("pumps of NS", "full capacity", f"{100.0 * float(ns['alpha_p_max']):.0f} %"),
        Printed("pump capacity that SSC has left", "10 %", f"{100.0 * (1.0 - float(ssc['alpha_p_max'])):.0f} %"),
        Printed("motor reduction that SSC has left", "more than 20 %", f"{100.0 * reduction_left(ssc):.0f} %"),
        Printed("highest A-side pressure, SSC below HS", "more than 120 bar", f"{bar[1] - bar[2]:.0f} bar"),
        Printed("control error of SSC", "within 10 cm", f"{cm[2]:.1f} cm peak-to-peak"),
        Printed("control error of HS", "more than 20 cm", f"{cm[1]:.1f} cm peak-to-peak"),
    ]


def scenario(number: str, *signals: str) -> Drawing:
    """Signals of a scenario over time, one line a controller; the tip's position is one for all."""
    n = int(number)
    runs = scenario_runs(n)
    shown = {m: one for m, one in runs.items() if n != 3 or m.lower() in COMPARED}
    if signals == ("s_tip",):
        shown = {"": shown["SSC"]}
    open_ = f"period {PERIOD:g} s taken (not printed)" if n != 3 else "0.5 m and 2 m read as amplitudes"
    return Drawing(
        f"Scenario {n} at the quay: nov-250t, empty hook, {S_W:g} m of wire",
        [over_time(shown, signals, *WINDOWS[n])],
        printed=_printed(n, runs),
        note=f"Ours: {open_}; motors in closed loop.",
    )


def pattern(amplitude: float, period: float) -> Scenario:
    """A sine at the quay under SSC."""
    return case(Sine.from_si(amplitude, period), "ssc", DURATION)


def stroke(crane: Crane, commands: Sequence[float], hold: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time [s], command and displacement [-] of motors that stand still, each command held for `hold` [s]: the twin's
    own control."""
    A = active_record(crane)
    held, state, n = 1.0, [1.0, 0.0], round(hold / 0.02)
    times, wanted, alpha = [], [], []
    for k, u in enumerate(commands):
        out, held = pilot(u, held, A.control)

        def rates(_: float, x: FloatArray, out: float = float(out)) -> list[float]:
            return [float(x[1]), float(swash_acceleration(x[0], x[1], out, A.motor_servo))]

        t = np.linspace(0.0, hold, n, endpoint=False)
        solved = solve_ivp(rates, (0.0, hold), state, t_eval=[*t, hold], rtol=1e-8, atol=1e-10)
        state = [float(solved.y[0, -1]), float(solved.y[1, -1])]
        times.append(k * hold + t)
        wanted.append(np.full(n, u))
        alpha.append(np.array([displacement(a, A.motor_servo) for a in solved.y[0, :-1]]))
    return np.concatenate(times), np.concatenate(wanted), np.concatenate(alpha)


def staircase_offsets() -> tuple[float, float]:
    """Least and largest part of the full displacement by which the motors stand above a command below full, after each
    step [-]."""
    _, wanted, alpha = stroke(changed(CRANE, OPEN_LOOP), STEPS, HOLD)
    last = round(HOLD / 0.02) - 1
    ends = range(last, len(alpha), last + 1)
    above = [float(alpha[i] - wanted[i]) for i in ends if wanted[i] < 0.95]
    return min(above), max(above)


def done_in_a_second() -> float:
    """Part of a change from full to the least displacement that the motors have made after 1 s [-]."""
    t, _, alpha = stroke(CRANE, (CRANE.active.motor.alpha_min,), HOLD)
    at = float(np.interp(1.0, t, alpha))
    return (1.0 - at) / (1.0 - CRANE.active.motor.alpha_min)


def _command(title: str, t: FloatArray, wanted: FloatArray, alpha: FloatArray) -> Panel:
    unit = D_ONE * 1e-6 / (2.0 * math.pi)
    curves = [Curve("command", t, unit * wanted, "--"), Curve("motor", t, unit * alpha)]
    return Panel(Axis("time", "time"), Axis("displacement", "displacement"), curves, title)


def motor_steps() -> Drawing:
    """Motors at standstill, the command in steps (E13)."""
    least, most = staircase_offsets()
    lead = reduction_lead(CRANE, 110.0 / 60.0, 6.0)
    return Drawing(
        "Motors of nov-250t at standstill, open loop with feedback: steps of the command",
        [_command("at standstill, steps of the command", *stroke(changed(CRANE, OPEN_LOOP), STEPS, HOLD))],
        printed=(
            Printed("offset of the displacement", "5 to 10 %", f"{100.0 * least:.1f} to {100.0 * most:.1f} %"),
            Printed("change within a second", "sufficient", f"{100.0 * done_in_a_second():.0f} % of it"),
            Printed("time to the highest speed at 110 m/min", "1.1 s", f"{lead:.2f} s at 6 s"),
        ),
        note="Ours: the heights and times of the steps are not printed.",
    )


def motor_patterns(runs: Mapping[tuple[float, float], xarray.Dataset] | None = None) -> Drawing:
    """Command and displacement of the motors under SSC in the two patterns, read as amplitudes and as heights (E14)."""
    crane = changed(CRANE, OPEN_LOOP)
    found = runs or {(T, k): run(crane, pattern(k * A, T)) for k in (1.0, HALF) for T, A in PATTERNS}
    panels, least = [], list[float]()
    for (T, share), one in sorted(found.items(), reverse=True, key=lambda pair: (pair[0][1], pair[0][0])):
        cut = one.sel(time=slice(WARM, WARM + 2.0 * T))
        reading, speed = "amplitude" if share == 1.0 else "height", 60.0 * float(one["v_tip_max"])
        title = f"{T:g} s, {dict(PATTERNS)[T]:g} m of {reading}: up to {speed:.0f} m/min"
        wanted, alpha = cut["u_m"].values, cut["alpha_m"].values
        panels.append(_command(title, cut["time"].values - WARM, wanted, alpha))
        least.append(D_ONE * float(one["alpha_m"].min() - one["u_m"].min()))
    ours = f"up to {max(least):.0f} cm³/rev of one motor"
    return Drawing(
        "nov-250t, motors in open loop with feedback, u_thr 0.6",
        panels,
        printed=[Printed("offset at the least displacement", "up to 20 cm³/rev", ours)],
    )
