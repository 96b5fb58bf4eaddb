"""From limits of all phases, tiers and rules to the labelled arrays of a result, and the facts that only the answer
gives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook._version import __version__
from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Tier
from stillhook.plan.result import CLAIMABLE, CREDITS, Credit, labelled
from stillhook.plan.table import BY_RULE, ENDS, TIERS, Axes, Certified, Chosen, Gathered, Governed, counting
from stillhook.plan.weather.value import Forecast
from stillhook.sea.spectra.spectrum import highest_sea

if TYPE_CHECKING:
    import xarray


CELL = ("credit", "alternative", "heading", "period")


@dataclass(frozen=True, eq=False)
class Answered:
    """Limits of a plan by tier; those that count, and those that govern, by credit; seeds (alternative, phase, heading,
    period); certified."""

    axes: Axes
    limits: Gathered = field(repr=False)
    counting: Mapping[Credit, Chosen] = field(repr=False)
    governs: Mapping[Credit, Governed] = field(repr=False)
    seeds: NDArray[np.int64] = field(repr=False)
    certified: Certified = field(repr=False)

    @property
    def modelled(self) -> Chosen:
        """Limits by the model of each alternative."""
        return self.counting[CREDITS[0]]

    @property
    def credited(self) -> Chosen:
        """Limits as they are credited."""
        return self.counting[CREDITS[1]]

    @property
    def claim(self) -> Credit:
        """The credit that may be claimed."""
        return CLAIMABLE if CLAIMABLE in self.counting else CREDITS[1]

    @property
    def claimed(self) -> Governed:
        """What governs the limits that may be claimed."""
        return self.governs[self.claim]

    @property
    def ran(self) -> bool:
        """Whether runs of the twin gave any limit."""
        return bool((~np.isnan(self.limits.Hs[TIERS.index(Tier.TIME)])).any())

    @property
    def compared(self) -> tuple[Alternative, ...]:
        """Alternatives that the answer compares: without runs of the twin none of its controllers, of which the other
        methods say too little, where there is any other."""
        others = tuple(a for a in self.axes.alternatives if not a.twin)
        return self.axes.alternatives if self.ran or not others else others

    @property
    def Hs(self) -> FloatArray:
        """Limits (credit, alternative, heading, period) [m]."""
        return np.stack([of.Hs for of in self.governs.values()])

    def shown(self) -> Alternative:
        """The alternative that leads: the twin with the largest mean credited limit, of equal ones that with the
        largest limit by its model. Without runs of the twin no controller leads, but the flat cap, or the last of the
        alternatives that `compared` has; the first of all where no twin was requested."""
        if not self.ran:
            return Alternative.CAP if Alternative.CAP in self.compared else self.compared[-1]
        Hs = np.nan_to_num(self.Hs, nan=0.0, posinf=1e3).mean(axis=(2, 3))
        twins = [i for i, a in enumerate(self.axes.alternatives) if a.twin]
        best = max(twins, key=lambda i: (round(Hs[1, i], 6), round(Hs[0, i], 6)), default=0)
        return self.axes.alternatives[best]


def dataset_of(plan: LiftPlan, of: Answered, forecast: Forecast) -> xarray.Dataset:
    """The Dataset that `stillhook.plan.result.PlanResult.data` describes."""
    axes, governs = of.axes, list(of.governs.values())
    cells: dict[str, NDArray[Any]] = {"Hs_limit": of.Hs, "alpha": forecast.alpha, "op_wf": forecast.op_wf}
    for end in ("low", "high"):
        cells[f"Hs_limit_{end}"] = np.stack([getattr(g, end) for g in governs])
    labels_of = {"phase": axes.phases, "rule": axes.rules, "tier": [t.value for t in TIERS], "end": ENDS}
    for name, labels in labels_of.items():
        places = [g.ends if name == "end" else getattr(g, name) for g in governs]
        cells[f"governing_{name}"] = np.array([*labels, ""])[np.stack(places)]
    by_phase = {"counts": counting(of.modelled), "n_seeds": of.seeds, "inside": of.certified.share}
    # what the model says; under a credit, the tier that counts alone is put in its place
    steepest = np.array([highest_sea(T) for T in axes.periods])
    by_tier = (_by_tier(each) for credit, each in of.counting.items() if credit != CREDITS[0])
    Hs_rule = np.stack([of.limits.Hs, *(np.where(np.isfinite(Hs), np.minimum(Hs, steepest), Hs) for Hs in by_tier)])
    data: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {name: (CELL, values) for name, values in cells.items()}
    data["Hs_steepest"] = ("period",), steepest
    data["Hs_rule"] = ("credit", "tier", "alternative", "phase", "rule", "heading", "period"), Hs_rule
    data |= {name: (("alternative", "phase", "heading", "period"), values) for name, values in by_phase.items()}
    env = plan.environment
    attrs = {
        "title": f"Stillhook plan: {plan.name}",
        "name": plan.name,
        "stillhook_version": __version__,
        "Hs_lowest": min(env.Hs),
        "Hs_highest": max(env.Hs),
        "heading_tolerance": env.heading_tolerance,
    }
    return labelled(data, _coords(of), attrs)


def _by_tier(of: Chosen) -> FloatArray:
    """Limits that count, each in its tier's place (tier, alternative, phase, rule, heading, period); NaN elsewhere."""
    rank = np.arange(len(TIERS)).reshape(-1, *([1] * of.Hs.ndim))
    return np.asarray(np.where(of.tier[None] == rank, of.Hs[None], np.nan))


def _coords(of: Answered) -> dict[str, Any]:
    axes = of.axes
    heading = {"units": "rad", "long_name": "direction in which the waves travel, counter-clockwise from the bow"}
    return {
        "credit": list(of.governs),
        "tier": [tier.value for tier in TIERS],
        "alternative": [a.value for a in axes.alternatives],
        "phase": list(axes.phases),
        "rule": list(axes.rules),
        "heading": ("heading", list(axes.headings), heading),
        "period": ("period", list(axes.periods), {"units": "s", "long_name": "peak period of the waves"}),
    }


def seeds_of(axes: Axes, demands: Iterable[Demand]) -> NDArray[np.int64]:
    """Runs behind every column (alternative, phase, heading, period): of its best known sea."""
    seeds = np.zeros((len(axes.alternatives), len(axes.phases), *axes.columns), dtype=np.int64)
    for demand in demands:
        if demand.seeds is not None and len(demand.seas):
            heading, period = axes.place(demand.seas.Tp, demand.seas.beta)
            cells = seeds[axes.alternatives.index(demand.alternative), axes.phases.index(demand.phase)]
            np.maximum.at(cells, (heading, period), demand.seeds)
    return seeds


def rows_of(of: Answered, forecast: Forecast, Hs_highest: float) -> list[dict[str, Any]]:
    """The table as rows for JSON, which has no inf: every cell with its verdict, which is limited, above (the highest
    sea state analysed), never or no result."""
    axes, rows, compared = of.axes, [], of.compared
    for c, (credit, g) in enumerate(of.governs.items()):
        for i in np.ndindex(g.Hs.shape):
            if axes.alternatives[i[0]] not in compared:
                continue
            Hs, governs = float(g.Hs[i]), g.phase[i] >= 0
            verdict = (
                "no result" if np.isnan(Hs) else "above" if Hs > Hs_highest else "never" if Hs == 0.0 else "limited"
            )
            where = {
                "alternative": axes.alternatives[i[0]].value,
                "beta": axes.headings[i[1]],
                "T_p": axes.periods[i[2]],
            }
            limit = {"Hs_limit": Hs, "Hs_limit_low": float(g.low[i]), "Hs_limit_high": float(g.high[i])}
            factors = {"alpha": forecast.alpha, "op_wf": forecast.op_wf}
            of_forecast = {name: float(table[(c, *i)]) for name, table in factors.items()}
            of_forecast["case_by_case"] = bool(forecast.case_by_case[(c, *i)])
            by = {"phase": axes.phases[g.phase[i]], "rule": axes.rules[g.rule[i]], "tier": TIERS[g.tier[i]].value}
            governing = {f"governing_{name}": text if governs else "" for name, text in by.items()}
            governing["governing_end"] = ENDS[g.ends[i]].value if g.ends[i] != BY_RULE else ""
            who = {"credit": credit, "alternative": axes.alternatives[i[0]].value, "verdict": verdict}
            rows.append(who | where | limit | of_forecast | governing)
    return rows


def summary_of(of: Answered, shown: Alternative, weather: xarray.Dataset | None) -> dict[str, Any]:
    """Of each alternative its limits by credit, what governs most cells, and its weather."""
    axes, out = of.axes, {}
    for alternative in of.compared:
        i, row = axes.alternatives.index(alternative), dict[str, Any]()
        for credit, governs in of.governs.items():
            row[credit] = _limits(governs.Hs[i]) | {"governs": _most(axes, governs.phase[i], governs.rule[i])}
            if weather is not None:
                year = weather.sel(credit=credit, alternative=alternative.value, month=0)
                row[credit]["weather"] = {str(name): _numbers(year[name]) for name in year.data_vars}
        out[alternative.value] = row
    return {"shown": shown.value, "alternatives": out}


def _limits(Hs: FloatArray) -> dict[str, float]:
    values = Hs[~np.isnan(Hs)]
    if not len(values):
        return dict.fromkeys(("least", "mean", "most"), float("nan"))
    return {"least": float(values.min()), "mean": float(values.mean()), "most": float(values.max())}


def _numbers(values: xarray.DataArray) -> Any:
    if values.ndim == 0:
        return float(values)
    return {str(name): float(x) for name, x in zip(values[values.dims[0]].values, values.values, strict=True)}


def _most(axes: Axes, phase: NDArray[np.int64], rule: NDArray[np.int64]) -> list[dict[str, Any]]:
    """Phases and rules by the number of cells that they govern, the most first."""
    pairs, counts = np.unique(np.stack([phase[phase >= 0], rule[phase >= 0]]), axis=1, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    return [
        {"phase": axes.phases[pairs[0, k]], "rule": axes.rules[pairs[1, k]], "cells": int(counts[k])} for k in order
    ]
