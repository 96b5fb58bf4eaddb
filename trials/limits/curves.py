"""Repeated plans, whose limits are compared with those of many more runs.

`python -m trials.limits.curves` (an hour of two cores) writes curves.json, which the page is made from; with names of
parts (made_up, searched, days, splash, extremes) these alone.

Trials: a made-up response whose limits are known, in given cells; made-up responses whose cells the search places;
operability, waiting and days gained of a made-up lift; the example's splash zone, of which 256 passages were run in
every sea; its deep phase, 768 runs of four minutes in every sea, of which five are compared with twenty.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.engine.simulate import simulate
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, run_numbers
from stillhook.plan.tiers.time_domain.curves import ColumnRuns, curve_of, limits_of_curve
from stillhook.plan.tiers.time_domain.lowering import SeaState, course_of, in_sea, lowering_of, machine_of, winch_of
from stillhook.plan.tiers.time_domain.measures import Measure, measures
from stillhook.spec.lift.phase import PhaseKind
from stillhook.statistics.extremes import MPM, P90, gumbel
from trials import store
from trials.limits import days, searched

STORE = Path(__file__).with_name("curves.json")
PLANS, SEEDS = 100, 256
HIGHEST = 6.0
ABOUT = {5: 1.75, 6: 2.0, 7: 1.95, 8: 2.1, 9: 2.6, 10: 2.75, 11: 3.1, 12: 3.5, 13: 3.9, 14: 4.0}
"""About the limit of the splash zone by period [s] -> [m]; passages are run at these parts of it."""
PARTS = (0.8, 0.9, 1.0, 1.1, 1.2)
SIZES = ((8, 2), (16, 2), (32, 2))
"""Runs of a cell and cells of a column, about the limit."""
Runs = Mapping[str, np.ndarray]


def made_up(seed: int = 5) -> dict[str, Any]:
    """Limits [m], growth and scatter of 30 columns, and where they are."""
    period = np.repeat(np.arange(5.0, 15.0), 3)
    angle = np.tile(np.radians([165.0, 180.0, 195.0]), 10)
    rng = np.random.default_rng(seed)
    ln_H = math.log(2.0) + 0.5 * np.log(period / 9.0) + 0.15 * np.sin(period / 1.7) + rng.normal(0.0, 0.02, len(period))
    scatter = 0.4 + 0.08 * np.cos(period / 2.0)
    return {
        "period": period,
        "angle": angle,
        "H": np.exp(ln_H),
        "growth": 1.6 + 0.2 * np.sin(period),
        "scatter": scatter,
    }


def made_up_runs(rng: np.random.Generator, truth: Mapping[str, Any], i: int, h: float, runs: int) -> Runs:
    """Runs of a column in a sea of height h [m]."""
    z = rng.gumbel(size=runs) + math.log(-math.log(P90))
    x = (h / truth["H"][i]) ** truth["growth"][i] * np.exp(truth["scatter"][i] / 1.2826 * z)
    return {"duration": np.ones(runs), "x": np.minimum(x, 1.11)}


def made_up_plan(rng: np.random.Generator, truth: Mapping[str, Any], runs: int, cells: int) -> list[ColumnRuns]:
    """One plan's runs of a number that scatters by a Gumbel law and ends where slings are slack, at 1.11 of its
    limit."""
    measure = Measure("x", q=P90, end=1.11)
    columns = []
    for i, H in enumerate(truth["H"]):
        centre = H * math.exp(rng.normal(0.0, 0.06))
        each = []
        for k in range(cells):
            h = centre * (1.1 if k else 0.95)  # one about the limit and one beyond, as the search ends
            each.append((h, made_up_runs(rng, truth, i, h, runs)))
        columns.append(
            ColumnRuns(truth["period"][i], truth["angle"][i], measure, centre, 0.0, tuple(sorted(each, key=_height)))
        )
    return columns


NEXT = 1.12
"""Distance of a further cell from the others."""
TYPICAL = 1.4826
"""Standard deviation over the median of absolute errors, of normal ones."""


def further(
    rng: np.random.Generator, truth: Mapping[str, Any], i: int, column: ColumnRuns, runs: int, *, below: bool
) -> ColumnRuns:
    """A column of the made-up response with one cell more above the others, or below."""
    heights = [h for h, _ in column.cells]
    h = min(heights) / NEXT if below else NEXT * max(heights)
    return replace(column, cells=(*column.cells, (h, made_up_runs(rng, truth, i, h, runs))))


def _height(cell: tuple[float, Runs]) -> float:
    return cell[0]


def passages() -> dict[tuple[float, float], list[tuple[float, Runs]]]:
    """(Tp, beta) -> heights with the passages of 256 seeds of the example's splash zone."""
    plan = load_plan("template-to-1500m")
    phase = next(p for p in plan.phases if p.kind is PhaseKind.SPLASH)
    winch = winch_of(phase, Alternative.NONE)
    course = course_of(plan, phase, winch)
    crane, mode = machine_of(plan, winch)
    calm = lowering_of(plan, phase, course, mode)
    found: dict[tuple[float, float], list[tuple[float, Runs]]] = {}
    for beta in plan.environment.headings:
        for Tp in plan.environment.Tp:
            for part in PARTS:
                h = round(ABOUT[round(Tp)] * part / 0.025) * 0.025
                one = in_sea(plan, phase, winch, course, calm, SeaState(round(h, 6), Tp, beta), 1)
                data = simulate(crane, [replace(one, seed=k) for k in range(1, SEEDS + 1)], on_failure="mark")
                found.setdefault((Tp, beta), []).append((h, run_numbers(data, [course.counts] * SEEDS)))
            print(f"splash zone, Tp {Tp:g} s, {math.degrees(beta):.0f} deg", flush=True)
    return found


def sling() -> tuple[Measure, float]:
    """Measure of the sling tension in the splash zone, and x at the limit."""
    plan = load_plan("template-to-1500m")
    phase = next(p for p in plan.phases if p.kind is PhaseKind.SPLASH)
    winch = winch_of(phase, Alternative.NONE)
    measure = measures(plan, phase, Alternative.NONE, winch, course_of(plan, phase, winch))["sling_ratio"]
    return measure, measure.to_x(0.1)


def reference(cells: Sequence[tuple[float, Runs]], measure: Measure, limit: float) -> tuple[float, float]:
    """Height at which a tenth of the passages is beyond, of all seeds: a logistic curve through the shares [m]; and the
    standard deviation of its ln, seeds taken as those of one height alone, for all heights have the same waves."""
    ln_H = np.log([h for h, _ in cells])
    n = np.array([len(measure.values(runs)) for _, runs in cells])
    beyond = np.array([(measure.values(runs) > limit).sum() for _, runs in cells])
    b = np.array([-6.0 * float(ln_H.mean()), 6.0])
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-(b[0] + b[1] * ln_H)))
        w = n * p * (1.0 - p)
        H = np.array([[w.sum(), (w * ln_H).sum()], [(w * ln_H).sum(), (w * ln_H**2).sum()]])
        b = b + np.linalg.solve(H, [(beyond - n * p).sum(), ((beyond - n * p) * ln_H).sum()])
    at = (math.log(0.1 / 0.9) - b[0]) / b[1]
    return float(np.exp(at)), 1.0 / (float(b[1]) * math.sqrt(SEEDS * 0.09))


def splash_plan(
    rng: np.random.Generator,
    pool: Mapping[tuple[float, float], Sequence[tuple[float, Runs]]],
    exact: Sequence[float],
    measure: Measure,
    runs: int,
    cells: int,
) -> list[ColumnRuns]:
    """One plan's runs, drawn from the pool, in the cells next to where the limit was guessed."""
    columns = []
    for ((Tp, beta), every), H in zip(pool.items(), exact, strict=True):
        guess = H * math.exp(rng.normal(0.0, 0.06))
        above = min(len([h for h, _ in every if h < guess]), len(every) - 1)
        near = sorted(every, key=_height)[max(above + 1 - cells, 0) : above + 1]  # about the limit and beyond
        drawn = []
        for h, of in near:
            i = rng.choice(len(of["duration"]), runs, replace=False)
            drawn.append((h, {name: x[i] for name, x in of.items()}))
        columns.append(ColumnRuns(Tp, beta, measure, float(np.mean([h for h, _ in drawn])), 0.0, tuple(drawn)))
    return columns


def further_passages(
    rng: np.random.Generator,
    pool: Mapping[tuple[float, float], Sequence[tuple[float, Runs]]],
    i: int,
    column: ColumnRuns,
    runs: int,
    *,
    below: bool,
) -> ColumnRuns:
    """A column of passages with the next higher cell of the pool, or the next lower one; the same where there is
    none."""
    heights = [h for h, _ in column.cells]
    cells = sorted(list(pool.values())[i], key=_height)
    lower, higher = ([cell for cell in cells if cell[0] < min(heights)], [c for c in cells if c[0] > max(heights)])
    above = lower[-1:] if below else higher[:1]
    drawn = tuple(
        (h, {name: x[rng.choice(len(of["duration"]), runs, replace=False)] for name, x in of.items()})
        for h, of in above
    )
    return replace(column, cells=(*column.cells, *drawn))


CELLS_MORE = 3
"""Cells that a column gets in addition while its limit is above them."""


def repeated(
    make: Callable[[int, int], list[ColumnRuns]],
    more: Callable[[int, ColumnRuns, int, bool], ColumnRuns],
    limit: float,
    exact: Sequence[float],
) -> list[dict[str, Any]]:
    """Errors and coverage of repeated plans of every size. A column whose limit is above its cells, or well below them,
    gets a further one, as in a plan: without those columns errors would look smaller than they are. typical: error that
    half of all limits stay within, as the standard deviation of normal ones; far: share that is off by 30 %."""
    rows, truth = [], np.array(exact)
    for runs, cells in SIZES:
        error, covered, half = [], [], []
        for _ in range(PLANS):
            columns = make(runs, cells)
            found = limits_of_curve(curve_of(columns), np.full(len(columns), limit), HIGHEST)
            for _ in range(CELLS_MORE):
                lowest = np.array([min(h for h, _ in column.cells) for column in columns])
                above, below = ~np.isfinite(found.Hs), found.Hs < lowest / NEXT
                if not (above | below).any():
                    break
                columns = [
                    more(i, column, runs, bool(below[i])) if above[i] or below[i] else column
                    for i, column in enumerate(columns)
                ]
                found = limits_of_curve(curve_of(columns), np.full(len(columns), limit), HIGHEST)
            error.append(np.log(found.Hs / truth))
            covered.append((found.low <= truth) & (truth <= found.high))
            half.append(np.where(np.isfinite(found.half), found.half, np.nan))
        known = np.isfinite(error)
        share = np.sum(covered, axis=0) / np.maximum(known.sum(axis=0), 1)
        rows.append(
            {
                "runs": runs * cells,
                "rms": float(np.sqrt(np.nanmean(np.square(error)))),
                "typical": float(TYPICAL * np.nanmedian(np.abs(error))),
                "far": float(np.mean(np.abs(np.array(error)[known]) > math.log(1.3))),
                "bias": float(np.nanmean(error)),
                "half": float(np.nanmean(half)),
                "coverage": float(np.sum(covered) / known.sum()),
                "least": float(share.min()),
                "open": float(1.0 - known.mean()),
            }
        )
    return rows


def own_quantiles(
    pool: Mapping[Any, Sequence[tuple[float, Runs]]], exact: Sequence[float], measure: Measure, limit: float
) -> list[dict[str, Any]]:
    """The same by order statistics of single cells and a straight line between two: what was done before."""
    rng, rows = np.random.default_rng(4), []
    for runs, _ in SIZES:
        error = []
        for _ in range(PLANS):
            for every, H in zip(pool.values(), exact, strict=True):
                a, b = sorted(sorted(every, key=lambda cell: abs(math.log(cell[0] / H)))[:2], key=_height)
                u = [
                    np.quantile(rng.choice(measure.values(of), runs, replace=False), P90, method="weibull") / limit
                    for _, of in (a, b)
                ]
                slope = (math.log(u[1]) - math.log(u[0])) / math.log(b[0] / a[0])
                error.append(math.log(a[0] / H) - math.log(u[0]) / max(slope, 0.5))
        rows.append({"runs": 2 * runs, "rms": float(np.sqrt(np.mean(np.square(error))))})
    return rows


NUMBERS = {
    "e_c_pp": "control error",
    "F_w_max": "wire tension",
    "DAF": "dynamic factor",
    "load_pp": "motion of the load",
    "F_sling_min": "least sling tension",
}
SEAS = (("ns", 2.0), ("strong-ssc", 2.0), ("ns", 3.5), ("none", 1.5))
TIMES = 7.5
"""Runs of four minutes in the phase's half hour."""


def deep_runs() -> dict[tuple[str, float, float], tuple[Runs, Runs]]:
    """(alternative, Hs, Tp) -> 768 runs of the deep phase, and the calm."""
    plan = load_plan("template-to-1500m")
    phase, beta = plan.phase("deep"), plan.environment.headings[0]
    cells, found = Cells(plan, Execution()), {}
    for name, Hs in SEAS:
        winch = winch_of(phase, Alternative(name))
        for Tp in (6.0, 9.0, 13.0):
            asks = [CellRequest(phase.name, winch, SeaState(h, Tp, beta), n) for h, n in ((0.0, 1), (Hs, 768))]
            cells.request(asks)
            found[name, Hs, Tp] = cells.runs[asks[1].cell], cells.runs[asks[0].cell]
            print(f"deep, {name}, Hs {Hs:g} m, Tp {Tp:g} s", flush=True)
    return found


def extremes(pool: Mapping[tuple[str, float, float], tuple[Runs, Runs]]) -> list[dict[str, Any]]:
    """Levels of a half hour by five runs with all their peaks, and by twenty with the largest of each, over that of 768
    runs: what waves add to the calm."""
    rng, rows = np.random.default_rng(1), []
    for level, q in (("P90", P90), ("MPM", MPM)):
        for x in NUMBERS:
            cells = []
            for (name, Hs, Tp), (runs, calm) in pool.items():
                if x == "e_c_pp" and name == "none":
                    continue
                falls = x == "F_sling_min"
                measure = Measure(
                    x,
                    q=q,
                    times=TIMES,
                    length=240.0,
                    end=float(calm["F_sling_min"][0]) if falls else math.inf,
                    falls=falls,
                )
                still, full = float(measure.values(calm)[0]), measure.values(runs)
                exact = float(np.quantile(full, q ** (1.0 / TIMES), method="weibull")) - still

                def of_runs(
                    i: np.ndarray, runs=runs, Tp=Tp, measure=measure, Hs=Hs, still=still, exact=exact
                ) -> tuple[float, float, float]:
                    part = {key: values[i] for key, values in runs.items()}
                    column = ColumnRuns(Tp, 0.0, measure, Hs, still, ((Hs, part),))
                    value, low, high = curve_of([column]).level(0, Hs)
                    return (value - still) / exact, (low - still) / exact, (high - still) / exact

                five = np.array([of_runs(rng.choice(len(full), 5, replace=False)) for _ in range(60)])
                twenty = np.array(
                    [
                        (gumbel(rng.choice(full, 20, replace=False)).quantile(q ** (1.0 / TIMES)) - still) / exact
                        for _ in range(60)
                    ]
                )
                every = of_runs(np.arange(len(full)))[0]
                of_gumbel = (gumbel(full).quantile(q ** (1.0 / TIMES)) - still) / exact
                cells.append(
                    [
                        every,
                        of_gumbel,
                        float(np.sqrt(np.mean((five[:, 0] - 1.0) ** 2))),
                        float(np.mean((five[:, 1] <= 1.0) & (five[:, 2] >= 1.0))),
                        float(np.sqrt(np.mean((twenty - 1.0) ** 2))),
                    ]
                )
            rows.append(
                {
                    "level": level,
                    "x": x,
                    **dict(
                        zip(
                            ("all", "gumbel", "rms_5", "cover_5", "rms_20"),
                            np.mean(cells, axis=0).tolist(),
                            strict=True,
                        )
                    ),
                }
            )
    return rows


PARTS_OF = ("made_up", "searched", "days", "splash", "extremes")


def main(
    parts: Sequence[str] = PARTS_OF,
    pool: Mapping[tuple[float, float], Sequence[tuple[float, Runs]]] | None = None,
    deep: Mapping[tuple[str, float, float], tuple[Runs, Runs]] | None = None,
) -> None:
    """The named trials; pools of runs where they are at hand. Results of others stay as they are."""
    truth, rng = made_up(), np.random.default_rng(2)
    found: dict[str, Any] = {"plans": PLANS, "seeds": SEEDS}
    if "made_up" in parts:
        found["made_up"] = repeated(
            lambda runs, cells: made_up_plan(rng, truth, runs, cells),
            lambda i, column, runs, below: further(rng, truth, i, column, runs, below=below),
            1.0,
            truth["H"],
        )
    if "searched" in parts:
        found["searched"] = searched.trials()
    if "days" in parts:
        found["days"] = days.trials()
    if "splash" in parts:
        measure, limit = sling()
        of = passages() if pool is None else pool
        references = [reference(cells, measure, limit) for cells in of.values()]
        exact = [H for H, _ in references]
        found["reference"] = float(np.sqrt(np.mean([sd**2 for _, sd in references])))
        found["splash"] = repeated(
            lambda runs, cells: splash_plan(rng, of, exact, measure, runs, cells),
            lambda i, column, runs, below: further_passages(rng, of, i, column, runs, below=below),
            limit,
            exact,
        )
        found["order_statistics"] = own_quantiles(of, exact, measure, limit)
    if "extremes" in parts:
        found["extremes"] = extremes(deep_runs() if deep is None else deep)
    store.write_parts(STORE, found)


if __name__ == "__main__":
    main(sys.argv[1:] or PARTS_OF)
