"""Paper E's quayside scenario 2: the 250 t crane, empty hook, a sine as fast as normal speed (NS) can follow; NS, HS
and SSC."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import causes
import xarray
from blocks import Blocks, save

from stillhook import Sine, Still
from stillhook.analysis import Alternative, Attribution
from stillhook.library import changed
from stillhook.report.plots.run import four_panels
from stillhook.thesis.quay import CRANE, DURATIONS, MODES, OPEN_LOOP, PERIOD, case, reduction_left, sine, speed_of_ns
from stillhook.thesis.quay import run as run_of

SLOW_PAGE = True
Runs = dict[str, xarray.Dataset]

HS_BY_RULE = 0.48  # 60 % of NS: "30 % of 60 % of the SWL" at the pressure at which NS holds 30 % of it

HS_TABLES = {"control": {"alpha_hs": HS_BY_RULE}, "active": {"motor": {"alpha_min": HS_BY_RULE}}}
ROWS = causes.variants(globals())


def of_mode(tip: Any, mode: str, more: Mapping[str, Any]) -> Any:
    return case(tip, mode, DURATIONS[2], more)


def run(row: causes.Variant) -> tuple[float, Runs]:
    """Peak speed of the tip [m/s] and the three runs."""
    crane = row.on(CRANE)
    hs = changed(crane, HS_TABLES) if "alpha_hs" in row.own else crane
    v = speed_of_ns(crane)
    tip = sine(row.own.get("period", PERIOD), v)
    return v, {m: run_of(hs if m == "hs" else crane, of_mode(tip, m, row.more)) for m in MODES}


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


def attribution() -> Attribution:
    """What brings the printed figures about."""
    return causes.attribute(
        at({m: (CRANE, of_mode(Still(), m, {})) for m in MODES}, PERIOD), causes.figures(globals()), ALTERNATIVES
    )


def cm(one: xarray.Dataset) -> str:
    return f"{100.0 * value(one, 'e_c_pp'):.1f} cm"


def variant(row: causes.Variant) -> dict[str, Any]:
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
