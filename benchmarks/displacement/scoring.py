"""Seas that settings are chosen in and seas that they are shown in, the gain that the margin leaves, and scores."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks.control import course
from benchmarks.displacement.points import LEADS, OPTIMAL, STRONG, Point, optimal
from stillhook import Crane, Scenario
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.runner import Run
from stillhook.engine.simulate import run_cases
from stillhook.spec.scenario import Mode

SHARE = 0.4
"""Load over the SWL [-]: 100 t on the crane of 250 t."""
WARM_UP, DURATION, THREADS = 80.0, 200.0, 2


class Seas(NamedTuple):
    """Significant height [m] and peak period [s] of working seas and of calm ones, each with every seed."""

    work: tuple[tuple[float, float], ...]
    calm: tuple[tuple[float, float], ...]
    seeds: tuple[int, ...]


CHOSEN_IN = Seas(((1.0, 8.0), (2.0, 9.0), (3.5, 11.0)), ((0.3, 6.0),), (1,))
HELD_OUT = Seas(((0.5, 7.0), (1.5, 7.0), (2.5, 10.0), (2.5, 14.0), (3.0, 9.0)), ((0.3, 5.0), (0.3, 8.0)), (2, 3))
HEAVY = Seas(((4.5, 10.0), (5.5, 12.0)), (), (2, 3))
HEAVY_LOADS = ("40 t", "100 t", "180 t")
CALM_HEIGHTS, CALM_PERIODS = (0.1, 0.2, 0.5), (5.0, 8.0)
"""Of calm seas beside those that are held out, whose periods these are, [m] and [s]."""
PLANT_SEAS = Seas(((1.5, 7.0), (2.5, 10.0)), (), (2,))

Scores = Mapping[str, float]


def load_of(crane: Crane) -> str:
    return f"{SHARE * crane.SWL / 1e3:g} t"


def cases(crane: Crane, seas: Seas, load: str | None = None) -> list[Scenario]:
    """Working seas, then calm ones, seed by seed within a sea; load SHARE of the SWL unless another is given."""
    times = {"warm_up": f"{WARM_UP:g} s", "duration": f"{DURATION:g} s"}
    return [
        Scenario(
            load=load or load_of(crane),
            s_w=course.WIRE,
            tip=course.jonswap(*sea, DURATION, seed),
            mode=DEFAULT_MODE,
            sensors=course.SENSORS,
            **times,
        )
        for sea in (*seas.work, *seas.calm)
        for seed in seas.seeds
    ]


def largest_gain(crane: Crane, mode: Mode) -> float:
    """K_p that leaves 6 dB at both displacements, at this crane's load [1/m]: rounded down."""
    case = cases(crane, CHOSEN_IN)[0]
    return course.largest_gain(crane, mode, [case.load], [case.s_w])


def scores_of(run: Run) -> dict[str, float]:
    """The benchmark's scores, efficiency, highest power and time with pumps at their limit of a run."""
    row = run.row
    return {
        **course.scores_of(run),
        "eta_c": row["eta_c"],
        "P_hpu_max": row["P_hpu_max"],
        "saturated": row["saturation_time"] / row["counted_time"],
    }


def run(pairs: Sequence[tuple[Crane, Scenario]]) -> list[dict[str, float]]:
    """Scores of every pair."""
    cranes, scenarios = zip(*pairs, strict=True)
    return run_cases(list(cranes), list(scenarios), every=course.EVERY, keep=scores_of, threads=THREADS)


def summary(found: Sequence[Scores], seas: Seas) -> dict[str, Any]:
    """Means over working seas, the highest pressure, power and speed, the error of every sea, and the mean efficiency
    in calm ones."""
    n = len(seas.work) * len(seas.seeds)
    work, calm = found[:n], found[n:]
    out: dict[str, Any] = {s: mean(r[s] for r in work) for s in ("e_c_pp", "load_pp", "P_hpu_mean", "saturated")}
    out |= {s: mean(r[s] for r in work) for s in ("travel_p", "travel_m")}
    out |= {s: max(r[s] for r in work) for s in ("p_max", "P_hpu_max", "omega_m_max")}
    out |= {"eta_calm": mean(r["eta_c"] for r in calm)} if calm else {}
    return out | {"errors": [r["e_c_pp"] for r in work], "pressures": [r["p_max"] for r in work]}


def mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def gains(crane: Crane, points: Sequence[Point]) -> list[float]:
    """K_p of every point [1/m]. Of displacement by an optimum that of its defaults: with a held displacement, which is
    what the margin is of, its loop is the same with all settings."""
    judged_by = [optimal() if p.mode == OPTIMAL else p for p in points]
    found = {p: _gain(crane, p) for p in dict.fromkeys(judged_by)}
    return [found[p] for p in judged_by]


def _gain(crane: Crane, point: Point) -> float:
    return crane.control.K_p if point.fixed else largest_gain(point.on(crane, 0.0, crane.control.K_p), point.law)


class Judged(NamedTuple):
    """A point on a crane: gain [1/m], lead that is best in the seas that settings are chosen in [s], scores in those
    and in the held-out ones, of strong SSC with the best lead of each sea."""

    K_p: float
    lead: float
    chosen_in: Mapping[str, Any]
    held_out: Mapping[str, Any]


Tried = Mapping[str, Any]


def judged(crane: Crane, points: Sequence[Point], leads: Sequence[float] = LEADS) -> list[Judged]:
    """All points on a crane, side by side."""
    K_p = gains(crane, points)
    best = chosen(crane, points, K_p, leads)
    tried = [leads if p.family == STRONG else (lead,) for p, (lead, _) in zip(points, best, strict=True)]
    found = iter(_run(crane, points, K_p, tried, HELD_OUT))
    out = []
    for gain, (lead, scores), of in zip(K_p, best, tried, strict=True):
        rows = zip(*(next(found) for _ in of), strict=True)  # leads by sea
        out.append(Judged(gain, lead, scores, summary([min(row, key=lambda r: r["e_c_pp"]) for row in rows], HELD_OUT)))
    return out


def chosen(
    crane: Crane, points: Sequence[Point], K_p: Sequence[float], leads: Sequence[float] = LEADS
) -> list[tuple[float, Tried]]:
    """Of every point the lead with the least mean error [s], and its scores, in the seas that settings are chosen
    in."""
    tried = [(crane.control.t_lead or 0.0,) if p.fixed else leads for p in points]
    found = iter(_run(crane, points, K_p, tried, CHOSEN_IN))
    by_lead = [[(lead, summary(next(found), CHOSEN_IN)) for lead in of] for of in tried]
    return [min(of, key=lambda one: one[1]["e_c_pp"]) for of in by_lead]


def _run(
    crane: Crane, points: Sequence[Point], K_p: Sequence[float], leads: Sequence[Sequence[float]], seas: Seas
) -> list[list[dict[str, float]]]:
    """Scores by sea of every point with each of its leads."""
    scenarios = cases(crane, seas)
    machines = [
        (point.on(crane, lead, gain), [case.with_mode(point.law) for case in scenarios])
        for point, gain, of in zip(points, K_p, leads, strict=True)
        for lead in of
    ]
    found = iter(run([(machine, case) for machine, by_sea in machines for case in by_sea]))
    return [[next(found) for _ in scenarios] for _ in machines]
