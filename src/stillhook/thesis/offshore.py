"""SSC against the classic controller: 90 t on the 150 t crane (C15 to C18), and offshore with 100 t and 200 t on the
250 t crane (2.32 to 2.37)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray

from stillhook.engine.simulate import simulate
from stillhook.library import changed, load_crane
from stillhook.sea.motion.motion import Motion, Sine, Sum
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.thesis.gallery import Drawing, Printed, over_time

SWELL_AND_ROLL = ((2.0, 13.0), (0.5, 6.0))
"""Amplitude [m] and period [s] of the only combined wave that the thesis prints: paper E scenario 3."""
LOOKED_AT = 1560.0  # s: 20 beats of swell and roll
V_PEAK = 1.5  # m/s: 90 m/min
D_M = 1075.0  # cm^3/rev, total of the 250 t crane
REDUCTION = 100.0  # cm^3/rev: "a total peak reduction ... of approximately 100"
HEIGHT = 1.0  # m: "peak-to-peak crane tip was now just about 1 m"
PERIOD = 10.0  # s
U_THR = 0.3


def wave(
    parts: Sequence[tuple[float, float]],
    v_peak: float,
    phase: float = 0.0,
    *,
    start: float = 0.0,
    end: float = LOOKED_AT,
) -> Motion:
    """Sines in these proportions, so large that the tip's highest speed from start to end [s] is v_peak [m/s]; each
    next one starts `phase` [rad] later."""
    t = np.arange(start, end, 0.01)

    def motion(scale: float) -> Motion:
        return Sum([Sine.from_si(scale * A, T, i * phase) for i, (A, T) in enumerate(parts)])

    return motion(v_peak / float(np.max(np.abs(motion(1.0).sample(t)[1]))))


class Comparison(NamedTuple):
    """A comparison: load, wire out, warm-up, duration, spacing of what is stored; crane; window that is shown [s]."""

    crane: str
    load: str
    s_w: str
    warm_up: str
    duration: str
    every: str
    window: tuple[float, float]


TESTS = {
    "90 t": Comparison("nov-150t", "90 t", "100 m", "30 s", "186 s", "0.01 s", (60.0, 112.0)),
    "100 t": Comparison("nov-250t", "100 t", "100 m", "40 s", "118 s", "0.02 s", (66.0, 106.0)),
    "200 t": Comparison("nov-250t", "200 t", "100 m", "40 s", "100 s", "0.02 s", (60.0, 90.0)),
}


def case(test: str, tip: Motion, mode: str, more: Mapping[str, Any] | None = None) -> Scenario:
    """A run of a test."""
    of = TESTS[test]
    asked: dict[str, Any] = {"load": of.load, "s_w": of.s_w, "warm_up": of.warm_up, "duration": of.duration}
    return Scenario(tip=tip, mode=mode, **(asked | dict(more or {})))


def with_threshold(crane: Crane, u_thr: float) -> Crane:
    return changed(crane, {"control": {"u_thr": u_thr}})


def two_sines(v_peak: float) -> Motion:
    """The tip of the test with 100 t that is drawn: swell and roll."""
    return wave(SWELL_AND_ROLL, v_peak, phase=2.0, start=40.0, end=118.0)


@cache
def base_wave() -> Motion:
    """The tip of the test with 90 t: up to 90 m/min."""
    return wave(SWELL_AND_ROLL, V_PEAK)


def runs_90t(crane: Crane | None = None) -> Mapping[str, xarray.Dataset]:
    """NS, HS and cubic SSC with 90 t."""
    modes = {"NS": "ns", "HS (classic)": "hs", "cubic SSC (new)": "ssc-cubic"}
    winch = crane or load_crane("nov-150t")
    return {label: simulate(winch, case("90 t", base_wave(), m), every="0.01 s") for label, m in modes.items()}


def runs_100t(v_peak: float) -> Mapping[str, xarray.Dataset]:
    """NS, SSC with both thresholds, with 100 t and a tip of this highest speed [m/s]."""
    crane, tip = load_crane("nov-250t"), two_sines(v_peak)
    of = {"NS": (crane, "ns"), "SSC 0.6": (crane, "ssc"), f"SSC {U_THR}": (with_threshold(crane, U_THR), "ssc")}
    return {label: simulate(c, case("100 t", tip, mode), every="0.02 s") for label, (c, mode) in of.items()}


@cache
def runs_200t() -> Mapping[str, xarray.Dataset]:
    """NS and SSC with 200 t in a calm sea."""
    crane, tip = load_crane("nov-250t"), Sine.from_si(0.5 * HEIGHT, PERIOD)
    return {m.upper(): simulate(crane, case("200 t", tip, m), every="0.02 s") for m in ("ns", "ssc")}


@cache
def _speed_of_100t() -> float:
    """Highest speed of the tip with which SSC at 0.3 takes 100 cm^3/rev off the motors [m/s]."""
    crane, speeds = with_threshold(load_crane("nov-250t"), U_THR), np.array([35.0, 40.0, 45.0, 50.0]) / 60.0
    cases = [case("100 t", two_sines(v), "ssc") for v in speeds]
    taken = [D_M * (1.0 - float(x)) for x in simulate(crane, cases, series=False)["alpha_m_min"]]
    return float(np.interp(REDUCTION, taken, speeds))


@cache
def _runs(test: str) -> Mapping[str, xarray.Dataset]:
    if test == "90 t":
        return {k: run for k, run in runs_90t().items() if k != "NS"}
    return runs_100t(_speed_of_100t()) if test == "100 t" else runs_200t()


def _printed(test: str, runs: Mapping[str, xarray.Dataset]) -> list[Printed]:
    old, *_, new = runs.values()
    least = float(new["alpha_m_min"])
    pumps = " and ".join(f"{100.0 * float(one['alpha_p_max']):.0f} %" for one in (old, new))
    e, p, p_a = (f"{100.0 * (float(new[x]) / float(old[x]) - 1.0):+.0f} %" for x in ("e_c_pp", "p_max", "p_a_max"))
    rows = {
        "90 t": (
            ("pumps, classic and new", "100 % and 90 %", pumps),
            ("control error, new against classic", "about -30 %", e),
            ("peak pressure, new against classic", "about -20 %", p),
        ),
        "100 t": (
            ("reduction of the displacement", "about 100 cm³/rev", f"{D_M * (1.0 - least):.0f} cm³/rev"),
            ("pressure, SSC against NS", "lower", p_a),
        ),
        "200 t": (
            ("displacement of SSC", "full", f"{least:.3f} at least"),
            ("pressure, SSC against NS", "slightly lower", p_a),
        ),
    }
    return [Printed(*row) for row in rows[test]]


def compared(load: str, *signals: str) -> Drawing:
    """Signals of a test over time, a panel for each, one line a controller."""
    test = f"{load} t"
    runs, of = _runs(test), TESTS[test]
    tip = {"crane tip": next(iter(runs.values()))}
    panels = [over_time(tip if name in ("s_tip", "v_tip") else runs, (name,), *of.window) for name in signals]
    note = {
        "90 t": "Ours: swell of 13 s and roll of 6 s, up to 90 m/min; the wave of figure C15 is not printed.",
        "100 t": "Ours: swell and roll so large that SSC with 0.3 takes 100 cm³/rev off; the motion is not printed.",
        "200 t": "Ours: 1 m peak-to-peak with 10 s; the period is not printed.",
    }[test]
    return Drawing(f"{of.crane}, {test}, {of.s_w} of wire", panels, printed=_printed(test, runs), note=note)
