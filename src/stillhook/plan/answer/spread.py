"""What the intervals of limits make of operability, waiting and the days that an alternative gains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Tier
from stillhook.plan.limits import Limits
from stillhook.plan.result import Credit
from stillhook.plan.table import TIERS, Axes, Governed, by_credit, chosen, governing, lower_where_apart
from stillhook.plan.weather.value import DAY, OVER, Forecast, WeatherValue, forecast_limits
from stillhook.statistics.estimate import t_factor
from stillhook.weather.persistence import Window, waits

if TYPE_CHECKING:
    import xarray

DRAWS = 24
"""Draws of all limits of which the weather is evaluated: the standard deviation of a number is right to some 15 %."""
TIME = TIERS.index(Tier.TIME)


def with_intervals(
    block: xarray.Dataset,
    plan: LiftPlan,
    of: Answered,
    tier_limits: Sequence[Limits],
    forecast: Forecast,
    value: WeatherValue,
    *,
    threads: int = 2,
) -> xarray.Dataset:
    """The weather of a result with the 95 % intervals of operability, mean waiting and days gained over the year, as
    <name>_low and <name>_high: those that errors of the limits make. How the weather itself differs from year to year
    is not in them.

    found: limits of all tiers with their draws; forecast, value: what the block was made
    of. Limits without draws, of other tiers than the twin, are taken as exact. Each end is as far off the number as
    draws on its side scatter about their median, for waiting has a long tail, and by as much more as the median is off
    the number: the least of limits with errors is too low on the mean, and the number is off by as much as draws are.
    """
    axes = of.axes
    drawn = limit_draws(axes, tier_limits, of.limits.Hs.shape[1:])
    if drawn is None:
        return block

    def numbers(governs: Mapping[Credit, Governed]) -> dict[str, FloatArray]:
        return _numbers(value, axes, forecast_limits(plan, forecast.table, governs), window)

    window = Window.of(value.workability.weather.time, value.workability.weather.step, value.window)
    with ThreadPoolExecutor(threads) as pool:
        rows = list(pool.map(numbers, governs_of_draws(plan, of, drawn)))
    for name in rows[0]:
        dims = ("credit", "alternative", *(("over",) if name == "days_gained" else ()))
        middle = block[name].sel(month=0).transpose(*dims).values
        low, high = ends_of(middle, np.array([row[name] for row in rows]))
        most = 1.0 if name == "operability" else np.inf
        least = -np.inf if name == "days_gained" else 0.0
        block[f"{name}_low"], block[f"{name}_high"] = (
            (dims, np.clip(low, least, most)),
            (dims, np.clip(high, least, most)),
        )
    return block


def ends_of(value: FloatArray, draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ends of the 95 % intervals of values of which there are draws (m, ...)."""
    median = np.median(draws, axis=0)
    apart, bias, half = draws - median, np.abs(median - value), t_factor(len(draws) // 2)
    below, above = (
        np.sqrt(np.sum(np.maximum(sign * apart, 0.0) ** 2, axis=0) / (0.5 * len(draws))) for sign in (-1.0, 1.0)
    )
    return value - bias - half * below, value + bias + half * above


def limit_draws(axes: Axes, tier_limits: Sequence[Limits], shape: tuple[int, ...]) -> FloatArray | None:
    """Draws of the twin's limits (m, alternative, phase, rule, heading, period) [m], inf where a draw stays inside up
    to the highest sea, NaN where there are none; None where no limit has any."""
    of_twin = [each for each in tier_limits if each.tier is Tier.TIME and each.draws]
    if not of_twin:
        return None
    drawn = np.full((DRAWS, *shape), np.nan)
    for each in of_twin:
        heading, period = axes.place(each.Tp, each.beta)
        at = axes.alternatives.index(each.alternative), axes.phases.index(each.phase)
        for rule, draws in each.draws.items():
            known = np.where(np.isnan(each.Hs[rule]) | (each.Hs[rule] == 0.0), np.nan, draws[:DRAWS])
            for i, (b, T) in enumerate(zip(heading, period, strict=True)):
                drawn[(slice(None), *at, axes.rules.index(rule), b, T)] = known[:, i]
    return drawn


def governs_of_draws(plan: LiftPlan, of: Answered, draws: FloatArray) -> Iterator[Mapping[Credit, Governed]]:
    """The limits that govern, by credit, of every draw (m, ...) of the twin's limits."""
    for draw in draws:
        Hs = of.limits.Hs.copy()
        Hs[TIME] = np.where(np.isnan(draw), Hs[TIME], draw)
        drawn = replace(of.limits, Hs=Hs)
        modelled = lower_where_apart(plan, drawn, chosen(drawn))
        yield governing(plan, by_credit(plan, modelled, of.certified))


def _numbers(value: WeatherValue, axes: Axes, forecast: Forecast, window: Window) -> dict[str, FloatArray]:
    """Operability, mean waiting [s] (credit, alternative) and days gained (credit, alternative, over) by other limits
    of the same plan."""
    judge, shape = value.workability, (len(forecast.credits), len(axes.alternatives))
    operability, wait = np.full(shape, np.nan), np.full(shape, np.nan)
    waited: dict[bytes, tuple[float, FloatArray]] = {}
    compared: dict[tuple[int, int], FloatArray] = {}
    valid, time = np.isfinite(judge.seas.Hs), judge.weather.time

    def of(limits: FloatArray) -> tuple[float, FloatArray]:
        op_wf = np.nan_to_num(limits, nan=0.0)
        key = op_wf.tobytes()
        if key not in waited:
            some, can_start = judge.starts(op_wf, window)
            waited[key] = float(some[valid].mean()), waits(can_start, time)
        return waited[key]

    for c, a in np.ndindex(shape):
        operability[c, a], waits_of = of(forecast.op_wf[c, a])
        wait[c, a] = _mean(waits_of)
        compared[c, a] = of(forecast.compared[c, a])[1]
    days = np.full((*shape, len(OVER)), np.nan)
    for o, name in enumerate(OVER):
        for c, credit in enumerate(forecast.credits):
            other = value.reference(name, credit)
            if other is not None:
                k = axes.alternatives.index(other)
                for a in range(shape[1]):
                    days[c, a, o] = _mean(compared[c, k] - compared[c, a]) / DAY
    return {"operability": operability, "wait_mean": wait, "days_gained": days}


def _mean(x: FloatArray) -> float:
    known = x[np.isfinite(x)]
    return float(known.mean()) if len(known) else float("nan")
