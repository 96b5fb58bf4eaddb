"""Paper C's simulation: the 150 t crane with 90 t on the outermost layer, the tip up to 90 m/min; classic (HS) against
new (cubic SSC)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from batch import Numbers, side_by_side, sine
from blocks import Blocks, Table, percent, save
from scipy.signal import butter, hilbert, sosfiltfilt

from stillhook import Crane, load_crane
from stillhook.analysis.steady.steady_state import speed_limit
from stillhook.engine.pack.winch import gains
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.library import changed
from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion
from stillhook.thesis.offshore import TESTS, V_PEAK, base_wave, case, runs_90t, wave

SLOW_PAGE = True
CRANE = load_crane("nov-150t")
RING_BAND = (0.6, 6.0)  # Hz: the circuit rings at about 1.5 Hz, the waves are at 0.08 and 0.17 Hz
BOOST = CRANE.active.boost.p
RING_LEFT = 10e5  # Pa
AFTER = 4.0  # s after a reversal

IRREGULAR = ((1.0, 13.0), (0.8, 11.0), (0.7, 9.4), (0.5, 8.1), (0.3, 7.0))
K_2 = gains(CRANE).K_2


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


class Row(NamedTuple):
    """One variant: what is changed in the crane and in the scenario."""

    label: str
    changes: Mapping[str, Any] = {}
    tip: Motion | None = None
    new: str = "ssc-cubic"
    more: Mapping[str, str] = {}


def servo(omega_n: str) -> dict[str, Any]:
    return {"active": {"motor": {"servo": {"omega_n": omega_n}}}}


def layer(s_w: float) -> Row:
    """A row on an inner layer, with s_w of wire out [m]."""
    inwards = (layer_diameter_at(CRANE, 0.0) - layer_diameter_at(CRANE, s_w)) / (2.0 * CRANE.wire.d)
    return Row(f"layer {1 + round(inwards)} from outside: {s_w:g} m of wire out", more={"s_w": f"{s_w} m"})


def irregular(phase: float) -> Motion:
    """As figure 15 looks: a sea that reaches 90 m/min once in the run."""
    return wave(IRREGULAR, V_PEAK, phase, start=30.0, end=186.0)


BASE = base_wave()
HEAVIER = {"inertia": {"J_m_eff": "3.58 kg m^2", "J_drum": "3.56e5 kg m^2"}}
TIGHT = {"active": {"motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}}}
ROWS = (
    Row("**as above**"),
    *(Row(f"wave: one sine, {T:g} s", tip=sine(V_PEAK, T)) for T in (6.0, 8.0, 10.0, 12.0, 14.0)),
    Row("wave: one sine, 12 s, and motors that do not leak", TIGHT, tip=sine(V_PEAK, 12.0)),
    Row("wave: 14 s, 10 s and 7 s, 1 : 0.7 : 0.3", tip=wave(((1.0, 14.0), (0.7, 10.0), (0.3, 7.0)), V_PEAK, phase=2.0)),
    *(Row(f"wave: irregular, five sines from 7 to 13 s, phases {i}", tip=irregular(float(i))) for i in (1, 2, 3)),
    Row("HS at 0.80", {"control": {"alpha_hs": 0.80}}),
    Row("HS at 0.78", {"control": {"alpha_hs": 0.78}}),
    Row("HS at 0.73 (36 t, as paper C prints for 18 % of the SWL)", {"control": {"alpha_hs": 0.728}}),
    Row("NS at 0.85, and SSC's rule for the load with it", {"control": {"alpha_ns": 0.85}}),
    Row("smallest displacement of SSC 0.65", {"active": {"motor": {"alpha_min": 0.65}}}),
    Row("smallest displacement of SSC 0.75", {"active": {"motor": {"alpha_min": 0.75}}}),
    Row("linear SSC instead of cubic", new="ssc"),
    Row("`K_2` none", {"control": {"K_2": "0 s^2/m"}}),
    Row("`K_2` halved", {"control": {"K_2": f"{0.5 * K_2!r} s^2/m"}}),
    Row("`K_2` doubled", {"control": {"K_2": f"{2.0 * K_2!r} s^2/m"}}),
    Row("`K_p` 0.32 1/m instead of 0.16", {"control": {"K_p": "0.32 1/m"}}),
    Row("motors at 3 rad/s instead of 5", servo("3 rad/s")),
    Row("motors in open loop with feedback", {"active": {"motor": {"variant": "open-loop-feedback"}}}),
    Row("motors that do not leak", TIGHT),
    Row("lines of 100 L instead of 50 L", {"active": {"line": {"V": "100 L"}}}),
    Row("inertia 3.58 kg m² (paper F, another 150 t winch)", HEAVIER),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593", {"friction": {"library": "L4593"}}),
    layer(600.0),
    layer(1000.0),
    layer(1600.0),
)
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
    asked = [
        (
            row.label,
            changed(CRANE, row.changes) if row.changes else CRANE,
            [case("90 t", row.tip or BASE, m, row.more) for m in ("hs", row.new)],
        )
        for row in ROWS
    ]
    for i_hD in I_HD:
        crane = geared(i_hD)
        asked.append(
            (f"{i_hD:g}, HS {crane.control.alpha_hs:.2f}", crane, [case("90 t", BASE, m) for m in ("hs", "ssc-cubic")])
        )
    runs = side_by_side((crane, one) for _, crane, cases in asked for one in cases)
    pairs = [runs[2 * i : 2 * i + 2] for i in range(len(asked))]
    return [(compared(label, old, new), old, new) for (label, *_), (old, new) in zip(asked, pairs, strict=True)]


GROUPS = {
    "wave": "wave",
    "HS at": "HS",
    "smallest displacement": "alpha_min",
    "`K_2`": "K_2",
    "friction of": "friction",
}


def alternatives() -> list[causes.Alternative]:
    """Every row, and every gear, as settings that may be otherwise."""
    out = []
    for row in ROWS[1:-3]:  # the layer is printed
        group = next((g for begin, g in GROUPS.items() if row.label.startswith(begin)), "")
        if row.new == "ssc-cubic":
            out.append(causes.varied(row.label, row.changes, tip=row.tip, more=row.more, group=group))
        else:
            out.append(causes.varied(row.label, more={"mode": row.new}, only=("new",)))
    return [*out, *(geared_alternative(i_hD) for i_hD in I_HD if i_hD != CRANE.i_hD)]


def geared_alternative(i_hD: float) -> causes.Alternative:
    """Another gear, with HS set so that it needs full pumps at 90 m/min again."""
    crane = geared(i_hD)
    label = f"`i_hD` {i_hD:g}, HS {crane.control.alpha_hs:.2f}"
    return causes.Alternative(label, lambda runs: {name: (crane, one) for name, (_, one) in runs.items()}, "gear")


def less(name: str, label: str, printed: float, within: float) -> causes.Figure:
    """How far below classic the new controller is, in per cent; printed as about so much."""
    return causes.lower(
        "new",
        "hs",
        name,
        label,
        f"about {100.0 * printed:.0f}",
        percent=100.0 * (printed - within),
        most=100.0 * (printed + within),
    )


FIGURES = (
    causes.Figure("pumps, HS", lambda r: 100.0 * r["hs"]["alpha_p_max"], 99.5, unit="%", digits=0, printed="100"),
    causes.Figure(
        "pumps, new", lambda r: 100.0 * r["new"]["alpha_p_max"], 88.0, 92.0, unit="%", digits=0, printed="90"
    ),
    less("e_c_pp", "error, new below HS", 0.3, 0.05),
    less("p_max", "peak pressure, new below HS", 0.2, 0.025),
)


def attribution() -> causes.Attribution:
    """What brings the printed figures about; one beat of the wave."""
    runs = {
        name: (CRANE, case("90 t", BASE, mode, {"duration": "108 s"}))
        for name, mode in (("hs", "hs"), ("new", "ssc-cubic"))
    }
    return causes.attribute(runs, FIGURES, alternatives())


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


HEAD = ("pumps, classic", "pumps, new", "error peak-to-peak", "largest error", "peak pressure")


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
        "gears": Table(("`i_hD`", *HEAD), [cells for cells, *_ in rows[len(ROWS) :]]),
        "sensitivity": Table(("variant", *HEAD), [cells for cells, *_ in rows[: len(ROWS)]]),
    }
    return blocks, {"HS (classic)": hs, "cubic SSC (new)": new}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    start, end = TESTS["90 t"].window
    picture = four_panels(runs, title="nov-150t, 90 t, outermost layer, tip up to 90 m/min", start=start, end=end)
    save(picture, "paper-c-90t.png")
