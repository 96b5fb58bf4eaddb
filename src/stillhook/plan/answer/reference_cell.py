"""One cell of the table in detail: tension against depth, efficiency, sensitivity, where the leading alternative has
its limit.

Tension, DAF and slack against depth, and how much of the tip's motion is taken at the wire and at the load, in one
sea.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.answer.sensitivity import sensitivity
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import IN_AIR, Phase
from stillhook.plan.definition.rules import Alternative, Demand, Seas
from stillhook.plan.limits import Limits
from stillhook.plan.result import CREDITS
from stillhook.plan.tiers.frequency import (
    Part,
    forcing_at,
    looked_at,
    natural_period,
    of_load,
    quantiles,
    resonance_depth,
    winches_of,
)
from stillhook.plan.tiers.winch_residual import Way, ways
from stillhook.response.forcing import Forcing
from stillhook.response.frequency_domain import sigmas
from stillhook.response.suspended_load import suspended_load
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


PLACES = 20
"""Depths of a profile."""
HELD = 1800.0
"""Time for which largest values are told at every depth [s]: as if the payload were held there for half an hour."""
QUANTITIES = ("F_top_max", "DAF", "sling_ratio", "slack_chance")


def depth_profile(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    Hs: float,
    Tp: float,
    beta: float,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """What a sea asks with the payload held for half an hour at each depth, from just covered to the seabed.

    Over alternative and z [m], height of the payload's underside: `TOLD`, each winch compensating at every depth (none:
    on its brake; one that may not be used: NaN), at the level of the rule that asks for it; F_top_static [N] and T_0,
    natural period of the load on its wire [s], over z. attrs: Hs [m], Tp [s], beta [rad], z_resonance, where T_0 is Tp
    (NaN: nowhere), held [s].
    Errors: as `stillhook.plan.tiers.frequency.frequency`.
    """
    at, winch = _water_phase(plan), _winch(plan, alternatives, progress)
    forcing, z = _forcing(plan, at, Hs, [Tp], beta), np.linspace(-plan.payload.reach(plan.rho), -plan.depth, PLACES)
    hangs = [suspended_load(plan.crane, plan.hanging(float(x), plan.tip_of(at).z), float(x)) for x in z]
    columns = {name: np.full((len(alternatives), len(z)), np.nan) for name in QUANTITIES}
    for i, alternative in enumerate(alternatives):
        for k, load in enumerate(hangs if winch[alternative].known else []):
            part = Part(load, HELD, 0.0, forcing, sigmas(forcing, load, winch[alternative].at(load.s_w)))
            values = of_load([part], quantiles(plan))
            for name in QUANTITIES:
                columns[name][i, k] = values[name][0]
    static = {"F_top_static": np.array([h.F_top for h in hangs]), "T_0": np.array([natural_period(h) for h in hangs])}
    attrs = {"Hs": Hs, "Tp": Tp, "beta": beta, "z_resonance": -resonance_depth(plan, Tp), "held": HELD}
    return _labelled(columns, static, alternatives, "z", z, attrs)


def efficiency(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    Hs: float,
    beta: float,
    z: float,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Part of the tip's motion that the winch takes, at the wire's upper end and at the load, over the plan's periods.

    eta_wire = 1 - sigma_u/sigma_tip and eta_load = 1 - sigma_load/sigma_tip over alternative and period [s], deviations
    over the whole sea, the payload's underside at z [m]. Negative where wire and load ring. attrs: Hs [m], beta [rad],
    z [m].
    """
    at, winch, periods = _water_phase(plan), _winch(plan, alternatives, progress), list(plan.environment.Tp)
    forcing, load = (
        _forcing(plan, at, Hs, periods, beta),
        suspended_load(plan.crane, plan.hanging(z, plan.tip_of(at).z), z),
    )
    tip = forcing.deviation()
    columns = {name: np.full((len(alternatives), len(periods)), np.nan) for name in ("eta_wire", "eta_load")}
    for i, alternative in enumerate(alternatives):
        if winch[alternative].known:
            left = sigmas(forcing, load, winch[alternative].at(load.s_w))
            columns["eta_wire"][i], columns["eta_load"][i] = 1.0 - left.u / tip, 1.0 - left.load / tip
    return _labelled(columns, {}, alternatives, "period", np.array(periods), {"Hs": Hs, "beta": beta, "z": z})


def _water_phase(plan: LiftPlan) -> Phase:
    """The phase whose crane tip counts under water: the longest that compensates, else the deepest one."""
    wet = [p for p in plan.phases if p.kind not in IN_AIR]
    follows = [p for p in wet if p.compensated]
    return max(follows or wet or list(plan.phases), key=lambda p: p.duration or 0.0)


def _winch(plan: LiftPlan, alternatives: Sequence[Alternative], progress: Progress | None) -> Mapping[Alternative, Way]:
    """Residuals on the way of the plan's own compensated phases; of the deepest place where it has none."""
    winches = winches_of(plan, looked_at(plan), alternatives, progress)
    if winches:
        return winches
    at = _water_phase(plan)
    deep = suspended_load(plan.crane, plan.hanging(-plan.depth, plan.tip_of(at).z), -plan.depth)
    return ways(plan.crane, alternatives, [replace(deep.duty, sensors=plan.sensors)], progress=progress)


def _forcing(plan: LiftPlan, at: Phase, Hs: float, periods: Sequence[float], beta: float) -> Forcing:
    """Seas of one height and direction at the crane tip of a phase."""
    n, tip = len(periods), plan.tip_of(at)
    seas = Seas(np.full(n, Hs), np.array(periods), np.full(n, beta))
    return forcing_at(plan, seas, tip.x, tip.y)


def _labelled(
    columns: Mapping[str, NDArray[np.float64]],
    alone: Mapping[str, FloatArray],
    alternatives: Sequence[Alternative],
    dim: str,
    axis: FloatArray,
    attrs: Mapping[str, float],
) -> xarray.Dataset:
    import xarray  # heavy: only where results are labelled

    data = {name: (("alternative", dim), values, attributes(name)) for name, values in columns.items()}
    single = {name: ((dim,), values, attributes(name)) for name, values in alone.items()}
    return xarray.Dataset(data | single, {"alternative": [str(a) for a in alternatives], dim: axis}, dict(attrs))


class Reference(NamedTuple):
    """A cell: heading and period as rows of the table and as beta [rad] and Tp [s]; Hs [m], the credited limit of the
    alternative that leads, or the highest sea state analysed where it has none; the compensated phase with its deepest
    place z [m], None without one.
    """

    heading: int
    period: int
    beta: float
    Tp: float
    Hs: float
    phase: str | None
    z: float


def reference_of(plan: LiftPlan, of: Answered) -> Reference:
    """The heading that the vessel would take (largest mean credited limit of the alternative that leads), and of its
    periods the one whose limit is in the middle of those that have one between calm and the highest sea."""
    axes, env = of.axes, plan.environment
    Hs = of.governs[CREDITS[1]].Hs[axes.alternatives.index(of.shown())]
    heading = int(np.nan_to_num(Hs, nan=0.0, posinf=max(env.Hs)).mean(axis=1).argmax())
    row = Hs[heading]
    between = np.flatnonzero(np.isfinite(row) & (row > 0.0))
    order = between[np.argsort(row[between], kind="stable")] if len(between) else np.arange(len(row))
    period = int(order[len(order) // 2])
    height = float(row[period]) if len(between) else max(env.Hs)
    deep = [p for p in plan.phases if p.compensated]
    deepest = min(deep, key=lambda p: _lowest(p.start, p.end), default=None)
    z = math.nan if deepest is None else _lowest(deepest.start, deepest.end)
    return Reference(
        heading=heading,
        period=period,
        beta=axes.headings[heading],
        Tp=axes.periods[period],
        Hs=height,
        phase=deepest.name if deepest else None,
        z=z,
    )


def _lowest(*ends: float | None) -> float:
    return min((z for z in ends if z is not None), default=0.0)


def reference_blocks(
    plan: LiftPlan,
    of: Answered,
    limits: Callable[[Sequence[Demand]], list[Limits]],
    progress: Progress | None = None,
    *,
    anew: bool = True,
) -> Mapping[str, xarray.Dataset]:
    """Blocks depth, efficiency and sensitivity of a result at the reference cell; none where no phase is compensated.
    anew: ask the twin what other friction and a late signal leave, some seconds."""
    at, parts, alternatives = reference_of(plan, of), Parts(progress), tuple(of.axes.alternatives)
    if at.phase is None:
        return {}
    datasets = {"depth": depth_profile(plan, alternatives, at.Hs, at.Tp, at.beta, parts(0.0, 0.3))}
    datasets["efficiency"] = efficiency(plan, alternatives, at.Hs, at.beta, at.z, parts(0.3, 0.5))
    where = sensitive_at(plan, of)
    if where is not None:
        ask = (of.shown(),) if anew else ()
        datasets["sensitivity"] = sensitivity(
            plan, alternatives, where.Tp, where.beta, where.phase, limits, parts(0.5, 1.0), ask=ask
        )
    return datasets


class Sensitive(NamedTuple):
    """A phase in a period Tp [s] and direction beta [rad]."""

    phase: str
    Tp: float
    beta: float


def sensitive_at(plan: LiftPlan, of: Answered) -> Sensitive | None:
    """The phase that governs most cells of the alternative that leads, as credited, where its limit is least; None
    where none governs."""
    axes, g, shown = of.axes, of.governs[CREDITS[1]], of.axes.alternatives.index(of.shown())
    governing_phase = g.phase[shown]
    if not (governing_phase >= 0).any():
        return None
    phase = int(np.bincount(governing_phase[governing_phase >= 0]).argmax())
    heading, period = np.unravel_index(
        int(np.where(governing_phase == phase, g.Hs[shown], np.inf).argmin()), governing_phase.shape
    )
    return Sensitive(axes.phases[phase], axes.periods[period], axes.headings[heading])
