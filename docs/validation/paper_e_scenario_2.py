"""Paper E's quayside scenario 2: the 250 t crane, empty hook, a sine as fast as normal speed (NS) can follow; NS, HS
and SSC."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import causes
import xarray
from blocks import Blocks, save

from stillhook import Sine, Still
from stillhook.analysis import Alternative, Attribution, Figure
from stillhook.library import changed
from stillhook.report.plots.run import four_panels
from stillhook.thesis.quay import CRANE, DURATIONS, MODES, OPEN_LOOP, PERIOD, case, reduction_left, sine, speed_of_ns
from stillhook.thesis.quay import run as run_of

SLOW_PAGE = True
Runs = dict[str, xarray.Dataset]

OPEN_LOOP_10 = {"active": {"motor": {"variant": "open-loop-feedback", "offset": 0.1, "hysteresis": 0.06}}}
THREE_TIMES_THE_LEAK = {"active": {"motor": {"C_1": "0.10 L/min/bar", "C_2": "2.6e-5 L/min/bar/(rev/min)"}}}
HS_BY_RULE = 0.48  # 60 % of NS: "30 % of 60 % of the SWL" at the pressure at which NS holds 30 % of it

HS_TABLES = {"control": {"alpha_hs": HS_BY_RULE}, "active": {"motor": {"alpha_min": HS_BY_RULE}}}


class Row(NamedTuple):
    """One variant: what is changed in the crane, the period [s], HS setting if it is not the library's, sensors."""

    label: str
    changes: Mapping[str, Any] = {}
    period: float = PERIOD
    alpha_hs: float | None = None
    sensors: Mapping[str, str] = {}


ROWS = (
    Row("**as above** (12 s, closed loop, HS 0.60)"),
    Row("8 s", period=8.0),
    Row("6 s", period=6.0),
    Row("motors in open loop with feedback", OPEN_LOOP),
    Row("the same, 10 % offset and 6 % hysteresis", OPEN_LOOP_10),
    Row("motors in open loop without feedback", {"active": {"motor": {"variant": "open-loop"}}}),
    Row("HS 0.48", alpha_hs=HS_BY_RULE),
    Row("HS 0.48, 8 s", period=8.0, alpha_hs=HS_BY_RULE),
    Row("HS 0.48, 6 s", period=6.0, alpha_hs=HS_BY_RULE),
    Row("HS 0.48, 6 s, open loop with feedback", OPEN_LOOP, 6.0, HS_BY_RULE),
    Row("friction of L4593, the largest set", {"friction": {"library": "L4593"}}),
    Row("friction of L4593, 6 s", {"friction": {"library": "L4593"}}, 6.0),
    Row("lines of 160 L instead of 80 L", {"active": {"line": {"V": "160 L"}}}),
    Row("lines of 160 L, 6 s", {"active": {"line": {"V": "160 L"}}}, 6.0),
    Row("motors that leak three times as much", THREE_TIMES_THE_LEAK),
    Row("`K_1` as printed, 0.68 s/m", {"control": {"K_1": "0.68 s/m"}}),
    Row("motion signal 0.1 s late", sensors={"delay": "0.1 s"}),
)


def of_mode(tip: Any, mode: str, sensors: Mapping[str, str]) -> Any:
    return case(tip, mode, DURATIONS[2], {"sensors": dict(sensors)})


def run(row: Row) -> tuple[float, Runs]:
    """Peak speed of the tip [m/s] and the three runs."""
    crane = changed(CRANE, row.changes) if row.changes else CRANE
    hs = crane
    if row.alpha_hs is not None:
        hs = changed(crane, {"control": {"alpha_hs": row.alpha_hs}, "active": {"motor": {"alpha_min": row.alpha_hs}}})
    v = speed_of_ns(crane)
    one = lambda m: run_of(hs if m == "hs" else crane, of_mode(sine(row.period, v), m, row.sensors))
    return v, {m: one(m) for m in MODES}


def value(one: xarray.Dataset, name: str) -> float:
    return float(one[name])


def gap(runs: Runs) -> float:
    """By how much the highest pressure of SSC is below that of HS [bar]."""
    return (value(runs["hs"], "p_a_max") - value(runs["ssc"], "p_a_max")) / 1e5


def at(runs: causes.Runs, period: float) -> causes.Runs:
    """The runs with a tip as fast as the NS of their crane, of this period [s]."""
    tip = sine(period, speed_of_ns(runs["ns"][0]))
    return {m: (crane, own.model_copy(update={"tip": tip})) for m, (crane, own) in runs.items()}


def open_loop(runs: causes.Runs) -> causes.Runs:
    """Motors in open loop with feedback, and a tip as fast as NS then is."""
    tip = runs["ns"][1].tip
    assert isinstance(tip, Sine)
    return at({m: (changed(crane, OPEN_LOOP), own) for m, (crane, own) in runs.items()}, tip.period)


ALTERNATIVES = (
    causes.varied(f"HS {HS_BY_RULE:g}", HS_TABLES, only=("hs",)),
    Alternative("period 8 s", lambda runs: at(runs, 8.0), "period"),
    Alternative("period 6 s", lambda runs: at(runs, 6.0), "period"),
    Alternative("motors in open loop with feedback", open_loop),
)
FIGURES = (
    Figure(
        "`p_a`, SSC below HS",
        lambda r: (r["hs"]["p_a_max"] - r["ssc"]["p_a_max"]) / 1e5,
        120.0,
        unit="bar",
        digits=0,
        printed="more than 120",
    ),
    Figure("error of HS", lambda r: 100.0 * r["hs"]["e_c_pp"], 20.0, unit="cm", printed="more than 20"),
    Figure("error of SSC", lambda r: 100.0 * r["ssc"]["e_c_pp"], most=10.0, unit="cm", printed="within 10"),
)


def attribution() -> Attribution:
    """What brings the printed figures about."""
    return causes.attribute(at({m: (CRANE, of_mode(Still(), m, {})) for m in MODES}, PERIOD), FIGURES, ALTERNATIVES)


def cm(one: xarray.Dataset) -> str:
    return f"{100.0 * value(one, 'e_c_pp'):.1f} cm"


def variant(row: Row) -> dict[str, Any]:
    v, runs = run(row)
    ssc = runs["ssc"]
    return locals()


def claims(runs: Runs, nearest: Runs) -> dict[str, Any]:
    """Numbers of the claims; `nearest` are the runs with HS 0.48 and 6 s."""
    ns, hs, ssc = (runs[m] for m in MODES)
    times = value(hs, "e_c_pp") / value(ssc, "e_c_pp")
    full, left, reduction = value(ns, "alpha_p_max"), 1.0 - value(ssc, "alpha_p_max"), reduction_left(ssc)
    p_ns, p_ssc = value(ns, "p_a_max") / 1e5, value(ssc, "p_a_max") / 1e5
    return locals()


def compute() -> tuple[Blocks, dict[str, Runs]]:
    """Blocks of the page, its claims, and the runs of the pictures."""
    v, runs = run(ROWS[0])
    _, nearest = run(next(r for r in ROWS if r.label == "HS 0.48, 6 s"))
    found = claims(runs, nearest)
    numbers = [{"m": m, "one": one} for m, one in runs.items()]
    blocks = {
        "claims": found,
        "causes": causes.block(attribution()),
        "notes": causes.notes({m.upper(): one for m, one in runs.items()}),
        "peak": {"v": v, "A": sine(PERIOD, v).amplitude},
        "numbers": numbers,
        "sensitivity": [variant(r) for r in ROWS],
    }
    return blocks, {"base": runs, "nearest": nearest}


def draw(pictures: Mapping[str, Runs]) -> None:
    def named(runs: Runs) -> Runs:
        return {m.upper(): one for m, one in runs.items()}

    title = "nov-250t, empty hook, tip as fast as NS"
    base = four_panels(named(pictures["base"]), title=f"{title}, 12 s, HS at 0.60", start=60.0, end=86.0)
    save(base, "paper-e-scenario-2.png")
    nearest = four_panels(named(pictures["nearest"]), title=f"{title}, 6 s, HS at 0.48", start=60.0, end=73.0)
    save(nearest, "paper-e-scenario-2-hs-048.png")
