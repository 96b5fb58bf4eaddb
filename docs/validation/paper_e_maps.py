"""Paper E's maps of classic control and SSC over load and speed: control error, peak pressure, settling time, motor
displacement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import causes
import numpy as np
from blocks import Blocks, percent, save
from numpy.typing import NDArray

from stillhook import Scenario
from stillhook.analysis.maps.figures import change_figure
from stillhook.analysis.maps.operability import cells_of, map_of
from stillhook.analysis.maps.result import BEST_CLASSIC, Map, cause_of
from stillhook.analysis.maps.settling import settling_of
from stillhook.sea.motion.words import parse_motion
from stillhook.thesis.maps import AROUND_80, LOW, SWITCH, change, speeds, value_map
from stillhook.thesis.maps import cells as of
from stillhook.thesis.quay import CRANE

SLOW_PAGE = True
FEWER = "20 % to 100 % by 20 %"
"""Loads of the sensitivity tables."""
SMALL = 10.0
"""Change of pressure up to which a difference is called small here [%]."""
MISSED = "not reproduced"
Y = CRANE.friction.system


def friction(share: float) -> dict[str, Any]:
    return {"friction": {"system": {"Y_1": Y.Y_1 * share, "Y_6": Y.Y_6 * share}}}


MAP_ROWS, STEP_ROWS, DAMPED = (causes.variants(globals(), key) for key in ("variant", "step", "damped"))


def asked_of(row: causes.Variant) -> dict[str, Any]:
    """What a variant changes in the map."""
    return {k: parse_motion(x) if k == "motion" else x for k, x in row.own.items()}


def span(a: NDArray[np.float64]) -> str:
    """Smallest and largest change, and the median."""
    if not a.size:
        return "–"
    return (
        f"{percent(a.min(), sign=True)[:-2]} to {percent(a.max(), sign=True)} (median"
        f" {percent(float(np.median(a)), sign=True)})"
    )


def top_speeds(found: Map, label: str) -> list[float]:
    """Highest speed at which the controller can be used, for every load [m/min]; 0 where it cannot."""
    return [float(max(speeds(found)[row], default=0.0)) for row in of(found, label, found.applicable)]


def gain_of_speed(found: Map) -> float:
    """Largest gain of top speed by SSC over the best classic controller above 60 % of the SWL [-]."""
    heavy = [m > 0.6 * CRANE.SWL * 1.001 for m in found.axes.loads]
    pairs = zip(heavy, top_speeds(found, "ssc"), top_speeds(found, BEST_CLASSIC), strict=True)
    return max(new / old - 1.0 for is_heavy, new, old in pairs if is_heavy and old > 0.0)


def by_load(found: Map, label: str) -> str:
    """Highest speeds with the loads up to which they hold, where the controller can be used at all."""
    tops = [(m, v) for m, v in zip(found.axes.loads, top_speeds(found, label), strict=True) if v > 0.0]
    ends = [pair for pair, after in zip(tops, [*tops[1:], (0.0, 0.0)], strict=True) if pair[1] != after[1]]
    return ", ".join(f"{v:.0f} up to {m / 1e3:.0f} t" for m, v in ends)


def claims(waves: Map, steps: Map, damped: Map) -> dict[str, Any]:
    """Numbers of the claims; damped: steps with the wire's damping of paper C."""
    slow, fast = (change(waves, "e_c_pp", *ends) for ends in ((0.0, SWITCH), (SWITCH, 999.0)))
    p_slow, p_fast = (change(waves, "p_max", *ends) for ends in ((0.0, SWITCH), (SWITCH, 999.0)))
    ssc, classic = (of(waves, x, waves.applicable) for x in ("ssc", BEST_CLASSIC))
    low, around = change(steps, "settling_time", *LOW), change(steps, "settling_time", *AROUND_80)
    low_damped, around_damped = change(damped, "settling_time", *LOW), change(damped, "settling_time", *AROUND_80)
    at_80 = np.isclose(speeds(steps), 80.0)
    t = {
        x: np.where(of(steps, x, steps.applicable), of(steps, x, steps.values["settling_time"]), np.nan)[:, at_80]
        for x in ("hs", "ssc")
    }
    against_hs = (t["ssc"] / t["hs"] - 1.0)[np.isfinite(t["ssc"] / t["hs"])]
    new_settles, classic_settles = (of(steps, x, steps.applicable) for x in ("ssc", BEST_CLASSIC))
    more, fewer = int((new_settles & ~classic_settles).sum()), int((classic_settles & ~new_settles).sum())
    classic_alpha = of(steps, BEST_CLASSIC, steps.values["alpha_m_end"])[of(steps, BEST_CLASSIC, steps.applicable)]
    ssc_alpha = of(steps, "ssc", steps.values["alpha_m_end"])[of(steps, "ssc", steps.applicable)]
    settings = ", ".join(f"{x:.2f}" for x in sorted({round(float(a), 2) for a in classic_alpha}))
    v_ns, v_hs = max(top_speeds(waves, "ns")), max(top_speeds(waves, "hs"))
    gain = gain_of_speed(waves)
    return locals()


def map_row(row: causes.Variant, found: Map) -> dict[str, Any]:
    summary = found.summary()
    ends = ((0.0, SWITCH), (SWITCH, 999.0))
    changes = [change(found, name, *e) for name in ("e_c_pp", "p_max") for e in ends]
    return locals()


def step_row(row: causes.Variant, found: Map) -> dict[str, Any]:
    v = speeds(found)
    low = (v > LOW[0]) & (v < LOW[1])
    t = found.values["settling_time"]
    seconds = [
        float(np.nanmedian(np.where(of(found, x, found.applicable), of(found, x, t), np.nan)[:, low]))
        for x in ("ns", "hs", "ssc")
    ]
    changes = [change(found, "settling_time", *ends) for ends in (LOW, AROUND_80, (SWITCH, 999.0))]
    return locals()


def corner(found: Map) -> dict[str, Any]:
    """How far SSC is from being applicable at the highest speed."""
    light = [i for i, m in enumerate(found.axes.loads) if m <= 0.61 * CRANE.SWL]
    share = of(found, "ssc", found.values["saturation_time"])[light, -1] / 20.0
    error = of(found, "ssc", found.values["e_c_pp"])[light, -1]
    return locals()


CELLS = cells_of(CRANE, ("ns", "hs", "ssc"), loads=FEWER)


def medians(r: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Median change of SSC against the better classic mode, error and pressure, up to 80 m/min and above, and the share
    of the map that SSC covers [%]."""
    n = len(CELLS.cases) // len(CELLS.controllers)
    v = 60.0 * np.array([CELLS.axes.speeds[i % len(CELLS.axes.speeds)] for i in range(n)])
    found = [r[str(i)] for i in range(len(CELLS.cases))]
    applies = np.array(
        [not cause_of(CRANE, s, c.mode, c.load) for s, c in zip(found, CELLS.cases, strict=True)]
    ).reshape(3, n)
    e, p = (np.array([float(s[name]) for s in found]).reshape(3, n) for name in ("e_c_pp", "p_max"))
    classic = np.where(applies[:2], e[:2], np.inf).argmin(axis=0)
    both = applies[2] & applies[:2].any(axis=0)
    out = {"covered": 100.0 * float(applies[2].mean())}
    for name, x in (("error", e), ("pressure", p)):
        change = x[2] / x[classic, np.arange(n)] - 1.0
        for end, inside in (("slow", v < SWITCH), ("fast", v > SWITCH)):
            cells = change[both & inside]
            out[f"{name} {end}"] = 100.0 * float(np.median(cells)) if cells.size else math.nan
    return out


def of_period(T: float) -> causes.Alternative:
    """Sines of another period with the same speeds."""

    def change(runs: causes.Runs) -> causes.Runs:
        axes = cells_of(CRANE, ("ns", "hs", "ssc"), loads=FEWER, period=f"{T:g} s").cases
        return {
            name: (crane, case.model_copy(update={"tip": axes[int(name)].tip})) for name, (crane, case) in runs.items()
        }

    return causes.Alternative(f"sine of {T:g} s", change, "motion")


def attribution() -> causes.Attribution:
    """What the maps of error and pressure depend on, one change at a time."""
    runs = {str(i): pair for i, pair in enumerate(zip(CELLS.cranes, CELLS.cases, strict=True))}
    tried = [*(of_period(T) for T in (6.0, 8.0, 16.0)), *(r.alternative() for r in MAP_ROWS if r.changes)]
    return causes.attribute(runs, causes.figures(globals()), tried, pairs=False)


def settled(pairs: Sequence[causes.Pair]) -> list[dict[str, float]]:
    """Median change of the settling time by SSC on every crane, at low speed and around 80 m/min [%]."""
    out = []
    for crane, _ in pairs:
        found = settling_of(crane, loads="20 % to 100 % by 40 %")
        parts = {"low": change(found, "settling_time", *LOW), "around": change(found, "settling_time", *AROUND_80)}
        out.append({name: 100.0 * float(np.median(a)) if a.size else math.nan for name, a in parts.items()})
    return out


def settling_attribution() -> causes.Attribution:
    """What the settling times depend on, one change at a time; the tip rests, and load and speed are the map's."""
    run = {"crane": (CRANE, Scenario(load="150 t", s_w="149 m", mode="ssc", duration="60 s"))}
    tried = [r.alternative() for r in STEP_ROWS if r.changes]
    return causes.attribute(run, causes.figures(globals(), "settling_figure"), tried, pairs=False, evaluate=settled)


def compute() -> tuple[Blocks, dict[str, Map]]:
    """Blocks of the page, its claims, and the maps of the pictures."""
    waves, steps = map_of(CRANE), settling_of(CRANE)
    found = claims(waves, steps, settling_of(DAMPED[0].on(CRANE)))
    rows = [map_row(r, map_of(r.on(CRANE), loads=FEWER, **asked_of(r))) for r in (*MAP_ROWS, *DAMPED)]
    few = "20 % to 100 % by 40 %"
    tests = [step_row(r, settling_of(r.on(CRANE), loads=few, **r.own)) for r in (*STEP_ROWS, *DAMPED)]
    blocks = {
        "causes": causes.block(attribution()),
        "causes-settling": causes.block(settling_attribution(), "The same for the settling times."),
        "claims": found,
        "corner": corner(waves),
        "sensitivity": rows,
        "settling": tests,
    }
    return blocks, {"waves": waves, "steps": steps}


def draw(maps: Mapping[str, Map]) -> None:
    for name in ("e_c_pp", "p_max", "settling_time", "alpha_m_end"):
        of_map = maps["waves" if name in ("e_c_pp", "p_max") else "steps"]
        save(value_map(name, of_map).figure(), f"paper-e-maps-{name.replace('_', '-')}.png")
    changes = change_figure(maps["waves"])
    assert changes is not None
    save(changes, "paper-e-maps-change.png")
