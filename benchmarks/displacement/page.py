"""Trade-off of displacement: tables of docs/validation/displacement-tradeoff.md from the outcome beside this file, that
`python -m benchmarks.displacement` writes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks, Rows, percent, save
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from trials.store import read

from benchmarks.control import course
from benchmarks.displacement import OUTCOME
from benchmarks.displacement.points import (
    COSTS,
    DEFAULT,
    FF,
    OPTIMAL,
    PUBLISHED,
    SHOWN,
    STRONG,
    Point,
    optimal,
    usual,
    usual_and_best,
)
from benchmarks.displacement.scoring import HEAVY, HEAVY_LOADS

SCRIPT = "displacement_tradeoff"
LESS_PRESSURE, ETA_CALM = 0.20, 0.95
"""Less highest pressure than strong SSC, and efficiency in a calm sea, that were wished for [-]."""
COLOURS = {PUBLISHED: "0.45", STRONG: "tab:blue", OPTIMAL: "tab:orange", FF: "tab:green"}
SMALL: Mapping[str, Any] = {"textcoords": "offset points", "fontsize": "x-small"}
TICKS = (1.0, 2.0, 3.0, 5.0, 10.0)
"""Of the error [cm]."""
Curve = Mapping[str, Mapping[str, Any]]


class Quantity(NamedTuple):
    """What is traded for error: name, unit and factor of its axis, and whether less is better."""

    label: str
    factor: float
    less: bool = True


QUANTITIES = {
    "p_max": Quantity("highest pressure [bar]", 1e-5),
    "eta_calm": Quantity("efficiency at Hs 0.3 m [-]", 1.0, less=False),
    "travel_m": Quantity("travel of the motors [1/min]", 1.0),
    "travel_p": Quantity("travel of the pumps [1/min]", 1.0),
}
FAMILIES = {PUBLISHED: "SSC as published", STRONG: "strong SSC", OPTIMAL: "`ssc-optimal`", FF: "FF"}
NAMES = {
    STRONG: "strong SSC",
    "default": "`ssc-optimal`, defaults",
    "no pre-load": "the same, `k_load` 0",
    "tuned": "`ssc-optimal`, tuned",
    FF: "FF",
}


def of_family(curves: Curve, family: str) -> list[Mapping[str, Any]]:
    return [one for one in curves.values() if one["family"] == family]


def settings(given: Mapping[str, float]) -> str:
    """Settings of a point; of displacement by an optimum those that are not the defaults."""
    changed = {n: x for n, x in given.items() if DEFAULT.get(n) != x}
    return ", ".join(f"`{n}` {x:g}{' s' if n == 'w_s' else ''}" for n, x in changed.items()) or "defaults"


def pressure_ratio(one: Mapping[str, Any], reference: Mapping[str, Any]) -> float:
    """Highest pressure over that of another, mean of the held-out runs [-]."""
    return float(np.mean(np.divide(one["held_out"]["pressures"], reference["held_out"]["pressures"])))


def error_ratio(one: Mapping[str, Any], reference: Mapping[str, Any]) -> float:
    """The same of the error [-]."""
    return float(np.mean(np.divide(one["held_out"]["errors"], reference["held_out"]["errors"])))


def numbers(one: Mapping[str, Any], reference: Mapping[str, Any]) -> tuple[str, ...]:
    h = one["held_out"]
    return (
        f"{1e2 * h['e_c_pp']:.2f}",
        f"{error_ratio(one, reference):.2f}",
        f"{1e-5 * h['p_max']:.0f}",
        f"{pressure_ratio(one, reference):.2f}",
        f"{1e-3 * h['P_hpu_max']:.0f}",
        f"{h['eta_calm']:.3f}",
        f"{h['travel_m']:.2f}",
        f"{h['travel_p']:.1f}",
    )


def best(points: Sequence[Mapping[str, Any]], quantity: str, *, less: bool = True) -> Mapping[str, Any]:
    """The point that is best to three digits in the seas that settings are chosen in, the first of equals."""
    return min(points, key=lambda one: (1.0 if less else -1.0) * float(f"{one['chosen_in'][quantity]:.3g}"))


def shown(curves: Curve) -> dict[str, Mapping[str, Any]]:
    """Points of the table."""
    optima = of_family(curves, OPTIMAL)
    out = {"SSC as published": curves[usual(PUBLISHED, "ssc").key]}
    out |= {f"strong SSC, `u_thr` {u:g}": curves[Point(STRONG, "ssc", (("u_thr", u),)).key] for u in SHOWN}
    out |= {"`ssc-optimal`, defaults": curves[optimal().key], "the same, `k_load` 0": curves[optimal(k_load=0.0).key]}
    for text, quantity, less in (
        ("least error", "e_c_pp", True),
        ("least pressure", "p_max", True),
        ("least travel of pumps", "travel_p", True),
        ("highest efficiency in a calm sea", "eta_calm", False),
    ):
        one = best(optima, quantity, less=less)
        out[f"`ssc-optimal`, {text}: {settings(one['settings'])}"] = one
    return out | {f"FF, `u_thr` {u:g}": curves[Point(FF, FF, (("u_thr", u),)).key] for u in SHOWN}


def effects(curves: Curve, reference: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Displacement by an optimum with one setting changed."""
    yield "defaults", *numbers(curves[optimal().key], reference)
    changes = [{name: x} for name in ("w_Q", "u_most", "k_load") for x in COSTS[name] if x != DEFAULT[name]]
    for change in (*changes, {"w_Q": 0.3, "w_s": 0.3}, {"w_Q": 1.0, "w_s": 0.3}):
        one = curves[optimal(**change).key]
        yield settings(one["settings"]), *numbers(one, reference)


def cranes(found: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, ...]]:
    for crane, by in found.items():
        for label, name in NAMES.items():
            one = by[label]
            more = f": {settings(one['settings'])}" if label == "tuned" else ""
            saturated = percent(one["held_out"]["saturated"], digits=1)
            first = crane if label == STRONG else ""
            yield first, f"{name}{more}", f"{one['K_p']:.3f}", *numbers(one, by[STRONG]), saturated


def heavy(found: Mapping[str, Mapping[str, Sequence[float]]]) -> Iterator[tuple[str, ...]]:
    """Mean error and highest pressure in heavy seas by load."""
    runs = len(HEAVY.work) * len(HEAVY.seeds)
    for key, of in found.items():
        family, *given = key.split()
        values = {name: float(x) for name, x in (text.split("=") for text in given)}
        cells = []
        for i in range(len(HEAVY_LOADS)):
            part = slice(i * runs, (i + 1) * runs)
            cells += [f"{1e2 * np.mean(of['e_c_pp'][part]):.1f}", f"{1e-5 * max(of['p_max'][part]):.0f}"]
        yield f"{FAMILIES[family]}, {settings(values)}", *cells


def calm(found: Mapping[str, Mapping[str, Sequence[float]]], curves: Curve) -> Iterator[tuple[str, ...]]:
    """Mean efficiency by significant height: 0.3 m among the held-out seas of the curves, the others beside them."""
    at = usual_and_best(curves)
    for label, name in NAMES.items():
        by_height = {float(Hs): float(np.mean(eta)) for Hs, eta in found[label].items()}
        by_height[0.3] = at[label]["held_out"]["eta_calm"]
        yield name, *(f"{by_height[Hs]:.3f}" for Hs in sorted(by_height))


def ratios(plants: Mapping[str, Any], label: str, lead: float, score: str = "e_c_pp") -> tuple[Any, Any]:
    """Ratios to strong SSC on all drawn plants and seas: with the lead of the crane file's machine [s], and with its
    best lead on each plant. Those of strong SSC itself are 1 with this lead."""
    reference = {float(of): np.array(found[score]) for of, found in plants[STRONG].items()}
    mine = reference[lead] if label == STRONG else np.array(next(iter(plants[label].values()))[score])
    return (mine / reference[lead]).ravel(), (mine / np.min([*reference.values()], axis=0)).ravel()


def middle_and_most(q: Any) -> tuple[float, float]:
    """Median, and what 95 % are not above."""
    return float(np.median(q)), float(np.quantile(q, 0.95, method="higher"))


def drawn(found: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Errors on drawn plants over those of strong SSC."""
    lead = usual_and_best(found["curves"])[STRONG]["lead"]
    for label, name in NAMES.items():
        cells = []
        for q in ratios(found["plants"], label, lead):
            middle, most = middle_and_most(q)
            cells += [f"{middle:.2f}", f"{most:.2f}", f"{q.max():.2f}", percent(float(np.mean(q > 1.0)))]
        p, _ = ratios(found["plants"], label, lead, "p_max")
        yield name, *cells, f"{np.median(p):.2f}"


def compute() -> tuple[Blocks, Any]:
    found = read(OUTCOME)
    curves: Curve = found["curves"]
    motion = found["motion"]["pressures"]
    strong, ff = curves[usual(STRONG, "ssc").key], curves[usual(FF, FF).key]
    optima = of_family(curves, OPTIMAL)
    calmest, lowest = best(optima, "eta_calm", less=False), best(optima, "p_max")
    pressures = {name: one["held_out"]["pressures"] for name, one in (("strong", strong), ("ff", ff))}
    of_motion = {name: np.divide(p, motion) for name, p in pressures.items()}
    numbers_of_claims = {
        "optimal_pressure": pressure_ratio(lowest, strong) - 1.0,
        "default_pressure": pressure_ratio(curves[optimal().key], strong) - 1.0,
        "ff_pressure": pressure_ratio(ff, strong) - 1.0,
        "optimal_calm": calmest["held_out"]["eta_calm"],
        "strong_calm": strong["held_out"]["eta_calm"],
        "ff_calm": ff["held_out"]["eta_calm"],
        "ff_calmer": float(np.mean(found["calm"][FF]["0.2"])),
        "pre_load": error_ratio(curves[optimal().key], curves[optimal(k_load=0.0).key]) - 1.0,
        "of_motion": of_motion,
        "drawn": {
            label: middle_and_most(ratios(found["plants"], label, strong["lead"])[0])
            for label in ("default", "no pre-load")
        },
    }
    rows: Rows = [(label, *numbers(one, strong)) for label, one in shown(curves).items()]
    blocks = {
        "claims": numbers_of_claims,
        "points": rows,
        "effects": effects(curves, strong),
        "cranes": cranes({course.CRANE: usual_and_best(curves), **found["cranes"]}),
        "plants": drawn(found),
        "heavy": heavy(found["heavy"]),
        "calm": calm(found["calm"], curves),
    }
    return blocks, (curves, max(motion))


def front(points: Sequence[Mapping[str, Any]], quantity: str, *, less: bool) -> list[Mapping[str, Any]]:
    """Points that none beats in error and this quantity, in the seas that settings are chosen in, by rising error."""
    sign, out = 1.0 if less else -1.0, []
    for one in sorted(points, key=lambda p: p["chosen_in"]["e_c_pp"]):
        if not out or sign * one["chosen_in"][quantity] < sign * out[-1]["chosen_in"][quantity]:
            out.append(one)
    return out


def panel(axes: Axes, curves: Curve, name: str) -> None:
    """Error against a quantity in the held-out seas: thresholds joined, optima as dots, their front joined."""
    q = QUANTITIES[name]

    def held(points: Sequence[Mapping[str, Any]]) -> tuple[list[float], list[float]]:
        return [1e2 * p["held_out"]["e_c_pp"] for p in points], [q.factor * p["held_out"][name] for p in points]

    for family, label in ((PUBLISHED, "SSC as published"), (STRONG, "strong SSC"), (FF, "FF")):
        points = of_family(curves, family)
        axes.plot(*held(points), "o-", color=COLOURS[family], markersize=3.5, linewidth=1.0, label=label)
        axes.plot(*held([p for p in points if p["settings"]["u_thr"] == 0.6]), "o", color=COLOURS[family], markersize=7)
        for one in (points[0], points[-1]) if name.startswith("travel") else ():
            x, y = held([one])
            axes.annotate(f"{one['settings']['u_thr']:g}", (x[0], y[0]), xytext=(6, -3), **SMALL)
    optima = of_family(curves, OPTIMAL)
    axes.plot(*held(optima), ".", color=COLOURS[OPTIMAL], alpha=0.3, markersize=4)
    on_front = front(optima, name, less=q.less)
    axes.plot(*held(on_front), "s-", color=COLOURS[OPTIMAL], markersize=4, linewidth=1.0, label="ssc-optimal, front")
    axes.plot(*held([curves[optimal().key]]), "s", color=COLOURS[OPTIMAL], markersize=8, label="ssc-optimal, defaults")
    axes.set_xscale("log")
    axes.set_xlim(0.7, 13.0)
    axes.set_xticks(TICKS, [f"{x:g}" for x in TICKS])
    axes.minorticks_off()
    axes.set_xlabel("mean error, peak to peak [cm]")
    axes.set_ylabel(q.label)
    axes.grid(alpha=0.3)


def draw(found: tuple[Curve, float]) -> None:
    curves, floor = found
    figure = Figure(figsize=(10.0, 7.5), layout="constrained")
    for axes, name in zip(figure.subplots(2, 2).flat, QUANTITIES, strict=True):
        panel(axes, curves, name)
        if name == "p_max":
            axes.axhline(1e-5 * floor, color="black", linestyle=":", linewidth=1.0, label="motion alone")
            axes.legend(fontsize="small", frameon=False)
        if name == "eta_calm":
            axes.axhline(ETA_CALM, color="black", linestyle="--", linewidth=1.0)
    save(figure, "displacement-tradeoff.png")
