"""Paper C's simulation: the 150 t crane with 90 t on the outermost layer, the tip up to 90 m/min; classic (HS) against new (cubic SSC)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray
from blocks import percent, save, table, verdict
from scipy.signal import butter, hilbert, sosfiltfilt

from stillhook import Crane, Scenario, Sine, load_crane, simulate
from stillhook.analysis.steady import speed_limit
from stillhook.io.figures import four_panels
from stillhook.library import changed
from stillhook.sea.motion import Motion, Sum

PAGE = "paper-c-90t.md"
CRANE = load_crane("nov-150t")
V_PEAK = 1.5  # m/s: 90 m/min
BEAT = 78.0  # s: 6 periods of 13 s, 13 of 6 s
EVERY = "0.01 s"
RING_BAND = (0.6, 6.0)  # Hz: the circuit rings at about 1.5 Hz, the waves are at 0.08 and 0.17 Hz
BOOST = CRANE.active.boost.p
RING_LEFT = 10e5  # Pa
AFTER = 4.0  # s after a reversal

SWELL_AND_ROLL = ((2.0, 13.0), (0.5, 6.0))  # amplitude [m] and period [s]: paper E scenario 3


def wave(parts: tuple[tuple[float, float], ...], phase: float = 0.0) -> Motion:
    """Sines in these proportions, so large that the tip peaks at 90 m/min; each next one starts `phase` later."""
    t = np.arange(0.0, 20.0 * BEAT, 0.01)

    def motion(scale: float) -> Motion:
        return Sum([Sine.from_si(scale * A, T, i * phase) for i, (A, T) in enumerate(parts)])

    return motion(V_PEAK / float(np.max(np.abs(motion(1.0).sample(t)[1]))))


def run(crane: Crane, mode: str, tip: Motion, **more: str) -> xarray.Dataset:
    """Two whole beats after the warm-up."""
    asked: dict[str, Any] = {"load": "90 t", "s_w": "100 m", "warm_up": "30 s", "duration": "186 s", **more}
    return simulate(crane, Scenario(tip=tip, mode=mode, **asked), every=EVERY)


def ringing_time(one: xarray.Dataset) -> float:
    """Time after a reversal of the tip until the ringing of p_a - p_b is below 10 bar, mean envelope over all reversals [s]."""
    dt = float(one["time"][1] - one["time"][0])
    band = butter(3, RING_BAND, "band", fs=1.0 / dt, output="sos")
    envelope = np.abs(hilbert(sosfiltfilt(band, (one["p_a"] - one["p_b"]).values)))
    v, n = one["v_tip"].values, round(AFTER / dt)
    turns = np.nonzero(v[:-1] * v[1:] < 0.0)[0]
    turns = turns[(turns * dt > 30.0) & (turns < len(v) - n)]
    mean = np.mean([envelope[i : i + n] for i in turns], axis=0)
    return float(np.nonzero(mean > RING_LEFT)[0][-1] + 1) * dt


class Row(NamedTuple):
    """One variant: what is changed in the crane and in the scenario."""

    label: str
    changes: Mapping[str, Any] = {}
    tip: Motion | None = None
    new: str = "ssc-cubic"
    more: Mapping[str, str] = {}


BASE = wave(SWELL_AND_ROLL)
HEAVIER = {"inertia": {"J_m_eff": "3.58 kg m^2", "J_drum": "3.56e5 kg m^2"}}
TIGHT = {"active": {"motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}}}
ROWS = (
    Row("**as above**"),
    Row("wave: one sine, 12 s", tip=wave(((1.0, 12.0),))),
    Row("wave: one sine, 12 s, and motors that do not leak", TIGHT, tip=wave(((1.0, 12.0),))),
    Row("wave: one sine, 8 s", tip=wave(((1.0, 8.0),))),
    Row("wave: 14 s, 10 s and 7 s, 1 : 0.7 : 0.3", tip=wave(((1.0, 14.0), (0.7, 10.0), (0.3, 7.0)), phase=2.0)),
    Row("linear SSC instead of cubic", new="ssc"),
    Row("motors that do not leak", TIGHT),
    Row("HS at 0.80", {"control": {"alpha_hs": 0.80}}),
    Row("HS at 0.78", {"control": {"alpha_hs": 0.78}}),
    Row("lines of 100 L instead of 50 L", {"active": {"line": {"V": "100 L"}}}),
    Row("inertia 3.58 kg m² (paper F, another 150 t winch)", HEAVIER),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593", {"friction": {"library": "L4593"}}),
    Row("`K_p` 0.32 1/m instead of 0.16", {"control": {"K_p": "0.32 1/m"}}),
    Row("motors in open loop with feedback", {"active": {"motor": {"variant": "open-loop-feedback"}}}),
    Row("an inner layer: 1000 m of wire out", more={"s_w": "1000 m"}),
)


def ratio(new: xarray.Dataset, old: xarray.Dataset, name: str) -> str:
    return percent(float(new[name]) / float(old[name]) - 1.0, sign=True)


def variant(row: Row) -> tuple[object, ...]:
    crane = changed(CRANE, row.changes) if row.changes else CRANE
    old, new = (run(crane, mode, row.tip or BASE, **row.more) for mode in ("hs", row.new))
    pumps = [percent(float(one["alpha_p_max"])) for one in (old, new)]
    return (row.label, *pumps, ratio(new, old, "e_c_pp"), ratio(new, old, "e_c_max"), ratio(new, old, "p_max"))


def cm(one: xarray.Dataset, name: str) -> str:
    return f"{100.0 * float(one[name]):.1f} cm"


def bar(one: xarray.Dataset, name: str) -> str:
    return f"{float(one[name]) / 1e5:.0f} bar"


def claims(ns: xarray.Dataset, hs: xarray.Dataset, new: xarray.Dataset) -> dict[str, tuple[str, str, str]]:
    """claim -> theirs, ours, verdict; the index repeats them."""
    error, pressure = (1.0 - float(new[name]) / float(hs[name]) for name in ("e_c_pp", "p_max"))
    over_boost = (float(new["p_max"]) - BOOST) / (float(hs["p_max"]) - BOOST) - 1.0
    full, used = float(hs["alpha_p_max"]), float(new["alpha_p_max"])
    t_hs, t_new = ringing_time(hs), ringing_time(new)
    gain = speed_limit(CRANE, "ssc", 91e3) / speed_limit(CRANE, "ns", 91e3) - 1.0
    v_ns = 60.0 * float(ns["v_w_max"])
    return {
        "pumps at 90 m/min, classic (HS)": ("100 %", percent(full), verdict(full > 0.995, "not full")),
        "pumps at 90 m/min, new (cubic SSC)": ("90 %", percent(used), verdict(abs(used - 0.9) < 0.02, "not reproduced")),
        "control error, new against classic": (
            "about −30 %",
            f"{ratio(new, hs, 'e_c_pp')} peak-to-peak, {ratio(new, hs, 'e_c_max')} largest",
            verdict(abs(error - 0.3) < 0.05, "not reproduced"),
        ),
        "peak pressure, new against classic": (
            "about −20 %",
            f"{ratio(new, hs, 'p_max')}; {percent(over_boost, sign=True)} above boost",
            verdict(abs(pressure - 0.2) < 0.025, "less than printed"),
        ),
        "pressure oscillations after a reversal": (
            "dampened out earlier",
            f"below 10 bar after {t_new:.1f} s instead of {t_hs:.1f} s",
            verdict(t_new < t_hs, "not reproduced"),
        ),
        "speed of loads above 90 t": (
            "up to +30 %",
            f"{percent(gain, sign=True)} (steady, no leakage)",
            verdict(abs(gain - 0.3) < 0.01, "not reproduced"),
        ),
        "at 90 m/min NS is not enough": (
            "HS must be selected",
            f"NS saturates and reaches {v_ns:.0f} m/min",
            verdict(v_ns < 90.0, "not reproduced"),
        ),
    }


def compute() -> tuple[dict[str, str], dict[str, tuple[str, str, str]], dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    ns, hs, new = (run(CRANE, mode, BASE) for mode in ("ns", "hs", "ssc-cubic"))
    found = claims(ns, hs, new)
    values = (("NS", ns), ("HS (classic)", hs), ("cubic SSC (new)", new))
    numbers = [
        (
            name,
            cm(one, "e_c_pp"),
            cm(one, "e_c_max"),
            bar(one, "p_a_max"),
            bar(one, "p_b_max"),
            percent(float(one["alpha_p_max"])),
            f"{float(one['alpha_m_min']):.3f}",
            f"{60.0 * float(one['v_w_max']):.1f} m/min",
            f"{ringing_time(one):.2f} s",
        )
        for name, one in values
    ]
    head = ("", "error p-p", "largest", "highest `p_a`", "`p_b`", "pumps", "least `alpha_m`", "wire speed", "ringing < 10 bar after")
    blocks = {
        "claims": table(("claim", "theirs", "ours", "verdict"), [(name, *what) for name, what in found.items()]),
        "numbers": table(head, numbers),
        "sensitivity": table(
            ("variant", "pumps, classic", "pumps, new", "error peak-to-peak", "largest error", "peak pressure"), [variant(r) for r in ROWS]
        ),
    }
    return blocks, found, {"HS (classic)": hs, "cubic SSC (new)": new}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    picture = four_panels(runs, title="nov-150t, 90 t, outermost layer, tip up to 90 m/min", start=60.0, end=112.0)
    save(picture, "paper-c-90t.png")
