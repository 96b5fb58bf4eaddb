"""Operability, waiting and days gained of repeated plans of made-up lifts whose limits are known, in the weather of the
example."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stillhook.plan.answer.dataset import Answered
from stillhook.plan.answer.spread import with_intervals
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits
from stillhook.plan.result import CREDITS
from stillhook.plan.table import Axes, Certified, chosen, gathered, governed
from stillhook.plan.weather.records import weather_used
from stillhook.plan.weather.value import YEAR, forecast_limits, weather_block, weather_value
from stillhook.weather.alpha import AlphaTable, load_alpha_table
from stillhook.weather.series import HOUR, Weather
from trials.limits.searched import Plan, Response, Waves, columns, searched_plan

Array = np.ndarray
YEARS = 3.0
"""Years of the example's weather, for time's sake."""
SPLASH, LANDING = "splash zone", "landing"
SLING, ERROR, MOTION = "slack-sling", "control-error", "load-motion"
ALTERNATIVES = (Alternative.NONE, Alternative.NS, Alternative.SSC)
RULES = {(LANDING, Alternative.NONE): (MOTION,), **{(LANDING, a): (ERROR, MOTION) for a in ALTERNATIVES[1:]}}
NAMES = {"operability": "operability", "wait_mean": "mean waiting", "days_gained": "days gained"}


def _power(H: Array, growth: float) -> Callable[[Array], Array]:
    return lambda Hs: (Hs / H[:, None]) ** growth


def made_up_lift(waves: float, seed: int) -> Mapping[tuple[str, Alternative | None], Response]:
    """Responses of a splash zone, which is one run under all alternatives, and of a landing under each; waves: as in
    `Response`. Every lift has limits of its own: records of weather are whole decimetres, and a limit just below one
    of them is not like others."""
    period, angle = columns()
    rng = np.random.default_rng(seed)

    def limit(H: float, of_period: float) -> Array:
        swing = 0.08 * np.sin(period / 1.5 + rng.uniform(0.0, 6.28)) + 0.05 * rng.normal() * (angle - math.pi)
        H = H * math.exp(rng.uniform(-0.15, 0.15))
        return np.asarray(H * (period / 9.0) ** of_period * np.exp(swing + rng.normal(0.0, 0.02, 30)))

    splash = limit(3.0, 0.6)
    none, ns, ssc = limit(1.4, -0.3), limit(1.8, -0.6), limit(2.6, 0.1)
    motion = limit(1.9, -0.4), limit(2.5, -0.2)
    sd = np.full(30, 0.25)

    def landing(levels: Sequence[Callable[[Array], Array]], guess: Array) -> Response:
        return Response(period, angle, tuple(levels), sd, guess, waves=waves)

    return {
        (SPLASH, None): Response(period, angle, (_power(splash, 1.6),), np.full(30, 0.4), splash, 1.11, waves),
        (LANDING, Alternative.NONE): landing([_power(none, 1.1)], none),
        (LANDING, Alternative.NS): landing([_power(ns, 1.3), _power(motion[0], 1.1)], ns),
        (LANDING, Alternative.SSC): landing([_power(ssc, 0.9), _power(motion[1], 1.0)], ssc),
    }


@dataclass(frozen=True, eq=False)
class Scene:
    """What is the same in all plans."""

    plan: LiftPlan
    axes: Axes
    weather: Weather
    table: AlphaTable

    @classmethod
    def of_example(cls) -> Scene:
        """The embedded example with three alternatives, in some years of its weather."""
        plan = replace(load_plan("template-to-1500m"), alternatives=ALTERNATIVES)
        assert plan.weather is not None
        weather = weather_used(plan.weather)
        rows = slice(0, round(YEARS * YEAR * HOUR / weather.step))
        columns = {name: x[rows] for name, x in weather.columns.items()}
        return cls(plan, Axes.of(plan), replace(weather, time=weather.time[rows], columns=columns), load_alpha_table())

    def numbers(self, limits: Sequence[Limits]) -> dict[str, Array]:
        """Operability, mean waiting and days gained with their intervals (3, ...), as the tool prints them."""
        axes = self.axes
        of_tiers = gathered(axes, limits)
        modelled = chosen(of_tiers)
        heights = np.unique(self.plan.environment.Hs)
        all_of = np.ones((len(axes.alternatives), len(axes.phases), *axes.columns, len(heights)), dtype=bool)
        certified = Certified(all_of, {}, np.zeros(all_of.shape[:2], dtype=bool))
        seeds = np.zeros((len(axes.alternatives), len(axes.phases), *axes.columns), dtype=np.int64)
        governs = dict.fromkeys(CREDITS, governed(modelled))
        of = Answered(axes, of_tiers, modelled, modelled, governs, seeds, certified)
        forecast = forecast_limits(self.plan, self.table, governs)
        value = weather_value(self.plan, axes, forecast, self.weather)
        block = weather_block(self.plan, value, axes, self.weather, forecast)
        block = with_intervals(block, self.plan, of, limits, forecast, value, threads=1)
        found = {}
        for name in NAMES:
            ends = [f"{name}_{end}" for end in ("low", "high") if f"{name}_{end}" in block]
            rows = [block[name].sel(month=0), *(block[end] for end in ends)]
            found[name] = np.array([row.sel(credit=CREDITS[0]).values for row in rows])
        return found


def as_limits(response: Response, phase: str, alternative: Alternative, plan: Plan | None) -> Limits:
    """Limits of a phase under an alternative by a plan's runs, or the true ones."""
    names = RULES.get((phase, alternative), (SLING,))
    parts: dict[str, dict[str, Array]] = {"Hs": {}, "low": {}, "high": {}, "draws": {}}
    for k, rule in enumerate(names):
        if plan is None:
            parts["Hs"][rule] = response.limits[k]
            continue
        for part, of in parts.items():
            of[rule] = getattr(plan.rules[k], part)
    return Limits(phase, alternative, Tier.TIME, response.period, response.angle, **parts)


def one_plan(scene: Scene, lift: Mapping[Any, Response], seed: int | None) -> dict[str, Array]:
    """Numbers of one plan; seed None: by the true limits."""
    rng = np.random.default_rng(seed)
    waves = Waves(0 if seed is None else 1000 + seed)
    plans = {key: None if seed is None else searched_plan(rng, of, waves=waves) for key, of in lift.items()}
    limits = []
    for a in ALTERNATIVES:
        for phase in (SPLASH, LANDING):
            key = (phase, None) if phase == SPLASH else (phase, a)
            limits.append(as_limits(lift[key], phase, a, plans[key]))
    return scene.numbers(limits)


Numbers = Mapping[str, Array]


def coverage(plans: Sequence[tuple[Numbers, Numbers]]) -> list[dict[str, Any]]:
    """How often intervals hold the truth, of pairs of true and printed numbers, with the binomial standard error."""
    rows, names = [], [a.value for a in ALTERNATIVES]
    for name in NAMES:
        truth, value, low, high = (
            np.array([of[name][k] for of in (pair[side] for pair in plans)])
            for side, k in ((0, 0), (1, 0), (1, 1), (1, 2))
        )
        places = [(i,) for i in range(len(names))] if name != "days_gained" else [(1, 0), (2, 0), (2, 2)]
        for place in places:
            at = (slice(None), *place)
            n, hits = len(plans), int(np.sum((low[at] <= truth[at]) & (truth[at] <= high[at])))
            p = hits / n
            rows.append(
                {
                    "number": name,
                    "alternative": names[place[0]],
                    "over": "" if len(place) == 1 else ("none", "", "best-classic")[place[1]],
                    "coverage": p,
                    "error": math.sqrt(max(p * (1.0 - p), 0.5 / n) / n),
                    "n": n,
                    "too_high": float(np.mean(low[at] > truth[at])),
                    "bias": float(np.mean(value[at] - truth[at])),
                    "rms": float(np.sqrt(np.mean((value[at] - truth[at]) ** 2))),
                    "half": float(np.mean(0.5 * (high[at] - low[at]))),
                    "truth": float(np.mean(truth[at])),
                }
            )
    return rows


PLANS, SHARED = 100, 0.8
"""Plans, each of a lift of its own; part of the scatter that runs of all alternatives in the same waves share."""


def plan_of(seed: int) -> tuple[Numbers, Numbers]:
    """True and printed numbers of one lift."""
    scene, lift = Scene.of_example(), made_up_lift(SHARED, seed)
    return one_plan(scene, lift, None), one_plan(scene, lift, seed)


def trials() -> list[dict[str, Any]]:
    """Repeated plans, as many at a time as there are cores."""
    with ProcessPoolExecutor() as pool:
        return coverage(list(pool.map(plan_of, range(PLANS))))
