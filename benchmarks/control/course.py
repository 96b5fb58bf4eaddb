"""What every entry runs: crane, seas, drawn plants, sensors, the gain that the margin allows, and what is scored.

One crane and load; in deep water another (`deep`). Each entry has in each sea the lead and the gain, of its grid,
with the least error on the crane as its file describes it. The gain K_p is at most the one that leaves 6 dB at motor
displacements 0.6 and 1, of the linearised plant with the law and what it has learned in the loop. The drawn plants
have those settings, and a PLC that knows the crane file's numbers. The reference, strong SSC, has instead the best
lead on every single plant and in every sea: no SSC can be tuned better, so no entry gains by the choice of leads.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook import Crane, Recorded, Scenario, read_tip_motion
from stillhook.analysis.loop_stability.governing import Governing, governing
from stillhook.analysis.uncertainty.draws import Drawing, Uncertainty, draws
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.runner import Run
from stillhook.sea.motion.recorded import window_spans
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.spec.scenario import Mode

CRANE, LOAD, WIRE = "nov-250t", "100 t", "487 m"
SHIP = ("0 m", "8 m", "25 m")
"""Crane tip of a measured ship motion from its motion sensor."""
TIP_SHARE = 0.7
"""Significant height of the tip's motion over that of the sea [-]."""
GAMMA = 3.3
"""Peak enhancement of the JONSWAP spectrum [-]."""
MARGIN, DISPLACEMENTS = 2.0, (0.6, 1.0)
"""Gain margin that K_p leaves [-] (6 dB), and motor displacements at which it does [-]."""
SENSORS: Mapping[str, Any] = {
    "delay": "20 ms",
    "seed": 5,
    "s_tip": {"noise": "2 mm"},
    "v_tip": {"noise": "3 mm/s"},
    "p_a": {"noise": "0.4 bar", "drift": "0.5 bar", "offset": "0.5 bar"},
    "p_b": {"noise": "0.4 bar", "offset": "-0.5 bar"},
    "p_hp": {"noise": "0.4 bar", "offset": "0.5 bar"},
}
"""Motion unit 20 ms late with noise; pressures with noise, drift in an hour, and offsets against one another."""
SEED = 3
"""Of the draws."""
EVERY, WINDOW = 10, 30.0
"""PLC cycles between samples of the series that travel and the load's motion are taken from; window of a range [s]."""
SCORES = {
    "e_c_pp": "error at the wire",
    "load_pp": "motion of the load",
    "p_max": "highest pressure",
    "P_hpu_mean": "mean power of the pumps",
    "omega_m_max": "motor speed",
    "travel_p": "travel of the pumps' swash plates",
    "travel_m": "travel of the motors' swash plates",
}
"""What is scored, SI: peak to peak in 30 s of control error and load's height, highest pressure and motor speed, mean
power, and full strokes that swash plates go in a minute: their wear."""


class Course(NamedTuple):
    """How much of it is run."""

    irregular: tuple[tuple[float, float], ...]  # significant height [m] and peak period [s]
    regular: tuple[tuple[float, float], ...]  # amplitude [m] and period [s]
    drawn: tuple[tuple[float, float], ...]  # seas of the drawn plants
    plants: int
    warm_up: float  # [s]
    duration: float  # of all, [s]
    leads: tuple[float, ...]  # [s]
    gains: tuple[float, ...]  # over the largest K_p [-]
    delays: tuple[float, ...]  # of late motion units, in the seas of the drawn plants [s]
    wires: tuple[float, ...]  # paid out in deep water [m]


HEAVY, PLANT_SEAS = (3.5, 11.0), ((1.0, 8.0), (2.0, 9.0), (3.5, 11.0))
FULL = Course(
    irregular=((0.5, 7.0), (1.0, 6.0), *PLANT_SEAS[:1], (1.5, 8.0), PLANT_SEAS[1], (2.5, 10.0), (2.5, 14.0), HEAVY),
    regular=((0.3, 6.0), (0.7, 10.0), (1.2, 14.0)),
    drawn=PLANT_SEAS,
    plants=200,
    warm_up=80.0,
    duration=200.0,
    leads=(0.02, 0.035, 0.05, 0.065, 0.08, 0.1, 0.12),
    gains=(0.7, 1.0),
    delays=(0.02, 0.1, 0.2, 0.3),
    wires=(500.0, 2000.0),
)
QUICK = FULL._replace(
    irregular=PLANT_SEAS[1:2],
    regular=FULL.regular[1:2],
    drawn=PLANT_SEAS[1:2],
    plants=4,
    warm_up=40.0,
    duration=80.0,
    leads=(0.035, 0.05),
    gains=(1.0,),
    delays=(0.2,),
    wires=(2000.0,),
)


def jonswap(Hs: float, Tp: float, duration: float, seed: int = 1) -> Recorded:
    """Motion of the tip in a sea of significant height Hs [m] and peak period Tp [s]: a sum of waves to 0.35 Hz of the
    JONSWAP spectrum, whose period is longer than the run, the highest Hs of the tip TIP_SHARE of the sea's."""
    period = 2.0 * duration
    f = np.arange(1, int(0.35 * period)) / period
    S = Jonswap(Hs, Tp, GAMMA).density(2.0 * np.pi * f)
    amplitude = np.sqrt(2.0 * S / S.sum()) * TIP_SHARE * Hs / 4.0
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, f.size)
    t = np.arange(0.0, duration + 1.0, 0.25)
    return Recorded(t, (amplitude * np.cos(2.0 * np.pi * np.outer(t, f) + phase)).sum(axis=1))


def _case(tip: Any, course: Course, delay: float | None = None) -> Scenario:
    """delay: of the motion unit [s], None for that of the benchmark."""
    times = {"warm_up": f"{course.warm_up:g} s", "duration": f"{course.duration:g} s"}
    sensors = SENSORS if delay is None else {**SENSORS, "delay": f"{1e3 * delay:g} ms"}
    return Scenario(load=LOAD, s_w=WIRE, tip=tip, mode=DEFAULT_MODE, sensors=sensors, **times)


def name_of(Hs: float, Tp: float) -> str:
    return f"Hs {Hs:g} m, Tp {Tp:g} s"


def seas(course: Course, ship: Path | None = None) -> dict[str, Scenario]:
    """Scenario of every sea by its name; with the file of a measured ship motion that as well."""
    found = {name_of(*sea): _case(jonswap(*sea, course.duration), course) for sea in course.irregular}
    found |= {f"sine {a:g} m, {T:g} s": _case(f"sine {a:g} m {T:g} s", course) for a, T in course.regular}
    if ship is not None and ship.is_file():
        found["measured ship"] = _case(read_tip_motion(str(ship), tip=SHIP), course)
    return found


def late_seas(course: Course, delay: float) -> dict[str, Scenario]:
    """Scenario of every sea of the drawn plants by its name, with a motion unit that is late by delay [s]."""
    return {name_of(*sea): _case(jonswap(*sea, course.duration), course, delay) for sea in course.drawn}


def places(
    crane: Crane, mode: Mode, alpha_m: float, loads: Sequence[float] = (), wires: Sequence[float] = ()
) -> Governing:
    """Loops of the linearised plant with the motors at alpha_m [-], at loads [kg] and wires [m] or those of the
    benchmark, with what a controller that learns remembers after a sea; the gain that leaves MARGIN."""
    case = _case("still", QUICK)
    kept = (MARGIN, 0.0, math.inf)
    return governing(crane, mode, kept, loads=loads or [case.load], wires=wires or [case.s_w], alpha_m=alpha_m)


def largest_gain(crane: Crane, mode: Mode, loads: Sequence[float] = (), wires: Sequence[float] = ()) -> float:
    """K_p that leaves the gain margin at both displacements, at every place that decides [1/m]: rounded down."""
    return math.floor(1e3 * min(places(crane, mode, alpha, loads, wires).K_p for alpha in DISPLACEMENTS)) / 1e3


def plants(crane: Crane, case: Scenario, n: int) -> list[tuple[Crane, Scenario]]:
    """n machines drawn from the table of `stillhook uncertainty`, under a PLC set up for this crane."""
    table = draws(Uncertainty.default().on((crane, case)), n, seed=SEED)
    return list(Drawing(crane, case, table.columns).pairs(table.values))


def scores_of(run: Run) -> dict[str, float]:
    """The scores of a run with a series of all its time."""
    counted = run.series[round(run.row["warm_up"] / run.dt) :]  # type: ignore[index]
    minutes = run.row["counted_time"] / 60.0

    def series(signal: str) -> FloatArray:
        return counted[:, run.signals.index(signal)]

    def travel(signal: str) -> float:
        return float(np.abs(np.diff(series(signal))).sum() / minutes)

    return {
        "e_c_pp": run.row["e_c_pp"],
        "load_pp": float(window_spans(series("s_load"), round(WINDOW / run.dt) + 1).max()),
        "p_max": run.row["p_max"],
        "P_hpu_mean": float(series("P_hpu").mean()),
        "omega_m_max": run.row["omega_m_max"],
        "travel_p": travel("alpha_p"),
        "travel_m": travel("alpha_m"),
    }
