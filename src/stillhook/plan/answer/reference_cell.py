"""One cell of the table in detail: tension against depth, efficiency, sensitivity, where the leading alternative has
its limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stillhook.base.progress import Parts, Progress
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.answer.depth_profile import depth_profile, efficiency
from stillhook.plan.answer.sensitivity import sensitivity
from stillhook.plan.definition.demand import Demand
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.limits.solve import Limits
from stillhook.plan.result.result import CREDITS

if TYPE_CHECKING:
    import xarray


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
