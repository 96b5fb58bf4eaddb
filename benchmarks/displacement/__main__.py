"""Compute the trade-off and keep it in outcome.json: `python -m benchmarks.displacement [PART ...]`.

Parts: curves, cranes, plants, heavy, calm, motion; all unless named, and those that are not named stay as they are.
Some ten minutes on two idle cores.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

from trials.store import read, write

from benchmarks.control import course
from benchmarks.displacement import OUTCOME
from benchmarks.displacement.motion import highest_pressure
from benchmarks.displacement.points import (
    COSTS,
    FF,
    LEADS,
    OPTIMAL,
    SHOWN,
    STRONG,
    Point,
    all_points,
    optimal,
    point_of,
    usual,
    usual_and_best,
)
from benchmarks.displacement.scoring import (
    CALM_HEIGHTS,
    CALM_PERIODS,
    HEAVY,
    HEAVY_LOADS,
    HELD_OUT,
    PLANT_SEAS,
    Judged,
    Seas,
    cases,
    chosen,
    gains,
    judged,
    run,
)
from stillhook import Crane, Scenario, load_crane

OTHERS = ("nov-150t", "nov-165t", "deep-250t", "nov-100t-pure-active")
PLANTS = 60


def rounded(x: Any) -> Any:
    """With five digits: more are rounding."""
    if isinstance(x, dict):
        return {k: rounded(v) for k, v in x.items()}
    return [rounded(v) for v in x] if isinstance(x, list) else float(f"{x:.5g}")


def stored(point: Point, j: Judged) -> dict[str, Any]:
    """A judged point as JSON."""
    return {"family": point.family, "settings": dict(point.settings), **rounded(j._asdict())}


def curves_part() -> dict[str, Any]:
    """All points on the benchmark's crane."""
    crane, points = load_crane(course.CRANE), all_points()
    return {p.key: stored(p, j) for p, j in zip(points, judged(crane, points), strict=True)}


def cranes_part() -> dict[str, Any]:
    """Strong SSC, FF and displacement by an optimum, as it comes and tuned, on other cranes. What is tuned has the lead
    of the defaults."""
    return {name: _on_crane(load_crane(name)) for name in OTHERS}


def _on_crane(crane: Crane) -> dict[str, Any]:
    points = {STRONG: usual(STRONG, "ssc"), FF: usual(FF, FF), "default": optimal()}
    found = dict(zip(points, judged(crane, list(points.values())), strict=True))
    lead = found["default"].lead
    tried = [
        optimal(w_Q=w, u_most=u, k_load=k) for w, u, k in product(*(COSTS[n] for n in ("w_Q", "u_most", "k_load")))
    ]
    scores = chosen(crane, tried, gains(crane, tried), (lead,))
    best = min(range(len(tried)), key=lambda i: scores[i][1]["e_c_pp"])
    more = {"no pre-load": optimal(k_load=0.0), "tuned": tried[best]}
    found |= zip(more, judged(crane, list(more.values()), (lead,)), strict=True)
    return {label: stored(point, found[label]) for label, point in (points | more).items()}


def plants_part() -> dict[str, Any]:
    """Error on drawn plants, by sea: of strong SSC with every lead, of the others that of the crane file;
    displacement by an optimum has the lead of its defaults with all settings."""
    crane = load_crane(course.CRANE)
    tuned = usual_and_best(read(OUTCOME)["curves"])
    shown = [(label, point_of(one)) for label, one in tuned.items()]
    leads = {label: (tuned["default" if one["family"] == OPTIMAL else label]["lead"],) for label, one in tuned.items()}
    keys = [(label, point, lead) for label, point in shown for lead in (leads | {STRONG: LEADS})[label]]
    seas = cases(crane, PLANT_SEAS)
    pairs = [
        pair
        for label, point, lead in keys
        for case in seas
        for pair in course.plants(point.on(crane, lead, tuned[label]["K_p"]), case.with_mode(point.law), PLANTS)
    ]
    found = iter(run(pairs))
    out: dict[str, Any] = {}
    for label, _, lead in keys:
        by_sea = [[next(found) for _ in range(PLANTS)] for _ in seas]
        of = {s: [[rounded(row[s]) for row in rows] for rows in by_sea] for s in ("e_c_pp", "p_max")}
        out.setdefault(label, {})[f"{lead:g}"] = of
    return out


def heavy_part() -> dict[str, Any]:
    """Errors and highest pressures, by load and run, where the displacement moves: heavier seas than settings are
    chosen in."""
    crane, curves = load_crane(course.CRANE), read(OUTCOME)["curves"]
    points = [Point(STRONG, "ssc", (("u_thr", u),)) for u in SHOWN] + [Point(FF, FF, (("u_thr", u),)) for u in SHOWN]
    points += [optimal(), optimal(k_load=0.0), optimal(k_rate=0.0, k_load=0.0)]
    points += [point_of(usual_and_best(curves)["tuned"])]
    found = _with_kept_leads(crane, points, [case for load in HEAVY_LOADS for case in cases(crane, HEAVY, load)])
    return {key: {s: [rounded(r[s]) for r in rows] for s in ("e_c_pp", "p_max")} for key, rows in found.items()}


def calm_part() -> dict[str, Any]:
    """Efficiency of the runs in calm seas, by significant height."""
    crane = load_crane(course.CRANE)
    points = {label: point_of(one) for label, one in usual_and_best(read(OUTCOME)["curves"]).items()}
    out: dict[str, Any] = {label: {} for label in points}
    for Hs in CALM_HEIGHTS:
        seas = cases(crane, Seas((), tuple((Hs, Tp) for Tp in CALM_PERIODS), HELD_OUT.seeds))
        found = _with_kept_leads(crane, list(points.values()), seas)
        for label, point in points.items():
            out[label][f"{Hs:g}"] = [rounded(r["eta_c"]) for r in found[point.key]]
    return out


def _with_kept_leads(
    crane: Crane, points: Sequence[Point], scenarios: Sequence[Scenario]
) -> dict[str, list[dict[str, float]]]:
    """Scores by run of each point: of strong SSC with the best lead of each run, of the others with the lead that was
    chosen for their curve, or where they are on none for displacement by an optimum."""
    curves = read(OUTCOME)["curves"]
    like = {point: curves.get(point.key, curves[optimal().key]) for point in points}
    keys = [(p, lead) for p in points for lead in (LEADS if p.family == STRONG else (like[p]["lead"],))]
    machines = {(p, lead): p.on(crane, lead, like[p]["K_p"]) for p, lead in keys}
    found = iter(run([(machines[key], case.with_mode(key[0].law)) for key in keys for case in scenarios]))
    best: dict[str, list[dict[str, float]]] = {}
    for point, _ in keys:
        rows = [next(found) for _ in scenarios]
        before = best.get(point.key, rows)
        best[point.key] = [min(pair, key=lambda r: r["e_c_pp"]) for pair in zip(before, rows, strict=True)]
    return best


def motion_part() -> dict[str, Any]:
    """What the motion of every held-out run in working seas takes at least."""
    crane = load_crane(course.CRANE)
    return {"pressures": [rounded(highest_pressure(crane, case)) for case in cases(crane, HELD_OUT._replace(calm=()))]}


PARTS: dict[str, Callable[[], dict[str, Any]]] = {
    "curves": curves_part,
    "cranes": cranes_part,
    "plants": plants_part,
    "heavy": heavy_part,
    "calm": calm_part,
    "motion": motion_part,
}


def main(wanted: Sequence[str]) -> None:
    if unknown := [name for name in wanted if name not in PARTS]:
        sys.exit(f"no part {unknown[0]}. There are: {', '.join(PARTS)}")
    for name in wanted or PARTS:
        write(OUTCOME, PARTS, read(OUTCOME) | {name: PARTS[name]()})
        print(f"{OUTCOME.name}: {name}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
