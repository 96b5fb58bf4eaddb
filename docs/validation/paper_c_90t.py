"""Paper C's simulation: the 150 t crane with 90 t on the outermost layer, the tip up to 90 m/min; classic (HS) against
new (cubic SSC)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import causes
import numpy as np
import xarray
from batch import Numbers, side_by_side
from blocks import Blocks, percent, save
from scipy.signal import butter, hilbert, sosfiltfilt

from stillhook import Crane, load_crane
from stillhook.analysis.steady.steady_state import speed_limit
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.library import changed
from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion
from stillhook.thesis.offshore import TESTS, V_PEAK, base_wave, case, runs_90t, wave
from stillhook.thesis.quay import sine  # noqa: F401  # of the variants

SLOW_PAGE = True
CRANE = load_crane("nov-150t")
RING_BAND = (0.6, 6.0)  # Hz: the circuit rings at about 1.5 Hz, the waves are at 0.08 and 0.17 Hz
BOOST = CRANE.active.boost.p
RING_LEFT = 10e5  # Pa
AFTER = 4.0  # s after a reversal

IRREGULAR = ((1.0, 13.0), (0.8, 11.0), (0.7, 9.4), (0.5, 8.1), (0.3, 7.0))


def ringing_time(one: xarray.Dataset) -> float:
    """Time after a reversal of the tip until the ringing of p_a - p_b is below 10 bar, mean envelope over all reversals
    [s]; AFTER where it is not below within that time."""
    dt = float(one["time"][1] - one["time"][0])
    band = butter(3, RING_BAND, "band", fs=1.0 / dt, output="sos")
    envelope = np.abs(hilbert(sosfiltfilt(band, (one["p_a"] - one["p_b"]).values)))
    v, n = one["v_tip"].values, round(AFTER / dt)
    turns = np.nonzero(v[:-1] * v[1:] < 0.0)[0]
    turns = turns[(turns * dt > 30.0) & (turns < len(v) - n)]
    mean = np.mean([envelope[i : i + n] for i in turns], axis=0)
    return float(np.nonzero(mean > RING_LEFT)[0][-1] + 1) * dt


def layer(s_w: float) -> int:
    """Number of the layer from outside, with s_w of wire out [m]."""
    return 1 + round((layer_diameter_at(CRANE, 0.0) - layer_diameter_at(CRANE, s_w)) / (2.0 * CRANE.wire.d))


def irregular(phase: float) -> Motion:
    """As figure 15 looks: a sea that reaches 90 m/min once in the run."""
    return wave(IRREGULAR, V_PEAK, phase, start=30.0, end=186.0)


BASE = base_wave()
ROWS = causes.variants(globals())
I_HD = (430.0, 450.0, 465.0, 480.0, 500.0)


def geared(i_hD: float) -> Crane:
    """The crane with another gear, and NS and HS so that HS needs full pumps at 90 m/min again."""
    c, k = CRANE, CRANE.i_hD / i_hD
    on_drum = c.inertia.J_m_eff - c.inertia.J_gear - c.active.motor.count * c.active.motor.J - passive_inertia()
    J = c.inertia.J_m_eff - on_drum * (1.0 - k * k)
    settings = {"alpha_hs": c.control.alpha_hs * k, "alpha_ns": min(c.control.alpha_ns * k, 1.0)}
    return changed(
        c, {"gear_ratios": [i_hD], "i_hD": i_hD, "inertia": {"J_m_eff": f"{J:.4g} kg m^2"}, "control": settings}
    )


def passive_inertia() -> float:
    assert CRANE.passive is not None
    return CRANE.passive.motor.count * CRANE.passive.motor.J


def ratio(new: Mapping[str, Any], old: Mapping[str, Any], name: str) -> str:
    return percent(float(new[name]) / float(old[name]) - 1.0, sign=True)


def compared(label: str, old: Numbers, new: Numbers) -> tuple[object, ...]:
    pumps = [percent(one["alpha_p_max"]) for one in (old, new)]
    return (label, *pumps, ratio(new, old, "e_c_pp"), ratio(new, old, "e_c_max"), ratio(new, old, "p_max"))


def variants() -> list[tuple[tuple[object, ...], Numbers, Numbers]]:
    """Every row, and every gear after them: cells, classic, new."""
    asked = []
    for row in ROWS:
        more, modes = dict(row.more), ("hs", row.more.get("mode", "ssc-cubic"))
        more.pop("mode", None)
        asked.append((row.label, row.on(CRANE), [case("90 t", row.tip or BASE, m, more) for m in modes]))
    for i_hD in I_HD:
        crane = geared(i_hD)
        asked.append(
            (f"{i_hD:g}, HS {crane.control.alpha_hs:.2f}", crane, [case("90 t", BASE, m) for m in ("hs", "ssc-cubic")])
        )
    runs = side_by_side((crane, one) for _, crane, cases in asked for one in cases)
    pairs = [runs[2 * i : 2 * i + 2] for i in range(len(asked))]
    return [(compared(label, old, new), old, new) for (label, *_), (old, new) in zip(asked, pairs, strict=True)]


def geared_alternative(i_hD: float) -> causes.Alternative:
    """Another gear, with HS set so that it needs full pumps at 90 m/min again."""
    crane = geared(i_hD)
    label = f"`i_hD` {i_hD:g}, HS {crane.control.alpha_hs:.2f}"
    return causes.Alternative(label, lambda runs: {name: (crane, one) for name, (_, one) in runs.items()}, "gear")


def attribution() -> causes.Attribution:
    """What brings the printed figures about; one beat of the wave."""
    runs = {
        name: (CRANE, case("90 t", BASE, mode, {"duration": "108 s"}))
        for name, mode in (("hs", "hs"), ("new", "ssc-cubic"))
    }
    tried = [row.alternative() for row in ROWS[1:-3]]  # the layer is printed
    tried += [geared_alternative(i_hD) for i_hD in I_HD if i_hD != CRANE.i_hD]
    return causes.attribute(runs, causes.figures(globals()), tried)


def cm(one: xarray.Dataset, name: str) -> str:
    return f"{100.0 * float(one[name]):.1f} cm"


def bar(one: xarray.Dataset, name: str) -> str:
    return f"{float(one[name]) / 1e5:.0f} bar"


def after(t: float) -> str:
    """A ringing time in words."""
    return f"after {t:.1f} s" if t < AFTER else f"not within {AFTER:.0f} s"


def claims(
    ns: xarray.Dataset, hs: xarray.Dataset, new: xarray.Dataset, damped: Sequence[xarray.Dataset]
) -> dict[str, Any]:
    """Numbers of the claims; damped: classic and new with the wire's damping of paper
    C."""
    error, pressure = (1.0 - float(new[name]) / float(hs[name]) for name in ("e_c_pp", "p_max"))
    over_boost = (float(new["p_max"]) - BOOST) / (float(hs["p_max"]) - BOOST) - 1.0
    full, used = float(hs["alpha_p_max"]), float(new["alpha_p_max"])
    t_hs, t_new, d_hs, d_new = map(ringing_time, (hs, new, *damped))
    gain = speed_limit(CRANE, "ssc", 91e3) / speed_limit(CRANE, "ns", 91e3) - 1.0
    v_ns = 60.0 * float(ns["v_w_max"])
    return locals()


def inner_layers(rows: list[tuple[tuple[object, ...], Numbers, Numbers]]) -> dict[str, Any]:
    """How much more peak pressure falls with each layer further in."""
    inner, labels = ROWS[-3:], (ROWS[0].label, *(r.label for r in ROWS[-3:]))
    layers = [1.0 - new["p_max"] / old["p_max"] for cells, old, new in rows if cells[0] in labels]
    wires = ", ".join(("100", *(r.more["s_w"][:-4] for r in inner)))
    return {"layers": layers, "wires": wires}


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    ns, hs, new = runs_90t().values()
    damped = list(runs_90t(changed(CRANE, {"wire": causes.WIRE})).values())
    rows = variants()
    found = claims(ns, hs, new, damped[1:]) | inner_layers(rows)
    values = zip(("NS", "HS (classic)", "cubic SSC (new)"), (ns, hs, new), damped, strict=True)
    numbers = [{"name": name, "one": one, "other": other} for name, one, other in values]
    blocks = {
        "causes": causes.block(attribution()),
        "notes": causes.notes({"NS": ns, "HS": hs, "SSC": new}),
        "claims": found,
        "numbers": numbers,
        "gears": [cells for cells, *_ in rows[len(ROWS) :]],
        "sensitivity": [cells for cells, *_ in rows[: len(ROWS)]],
    }
    return blocks, {"HS (classic)": hs, "cubic SSC (new)": new}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    start, end = TESTS["90 t"].window
    picture = four_panels(runs, title="nov-150t, 90 t, outermost layer, tip up to 90 m/min", start=start, end=end)
    save(picture, "paper-c-90t.png")
