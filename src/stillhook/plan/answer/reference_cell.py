"""One cell of the table in detail: tension against depth, and efficiency in one sea."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas
from stillhook.plan.result import CREDITS, labelled
from stillhook.plan.tiers.frequency import Part, forcing_at, of_load, quantiles, winches_of
from stillhook.plan.tiers.situations import looked_at, natural_period, resonance_depth
from stillhook.plan.tiers.winch_residual import Way, ways
from stillhook.response.frequency_domain import sigmas
from stillhook.response.suspended_load import SuspendedLoad, suspended_load
from stillhook.sea.vessel.boom import TipPoint
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import Phase

if TYPE_CHECKING:
    import xarray


PLACES = 20
"""Depths of a profile."""
HELD = 1800.0
"""Time for which largest values are reported at every depth [s]: as if the payload were held there for half an hour."""
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

    Over alternative and z [m], height of the payload's underside: `QUANTITIES`, each winch compensating at every depth
    (none: on its brake; one that may not be used: NaN), at the level of the rule about it; F_top_static [N] and
    T_0, natural period of the load on its wire [s], over z. attrs: Hs [m], Tp [s], beta [rad], z_resonance, where T_0
    is Tp (NaN: nowhere), held [s].
    Errors: as `stillhook.plan.tiers.frequency.frequency`.
    """
    tip, winch = plan.tip_of(_water_phase(plan)), _winch(plan, alternatives, progress)
    forcing = forcing_at(plan, Seas(np.full(1, Hs), np.full(1, Tp), np.full(1, beta)), tip.x, tip.y)
    z = np.linspace(-plan.payload.reach(plan.rho), -plan.depth, PLACES)
    hangs = _hanging(plan, tip, z)
    columns = {name: np.full((len(alternatives), len(z)), np.nan) for name in QUANTITIES}
    over = ("alternative", "z")
    for i, alternative in enumerate(alternatives):
        below = hangs if alternative is not Alternative.PHC else _hanging(plan.under(alternative), tip, z)
        for k, load in enumerate(below if winch[alternative].known else []):
            part = Part(load, HELD, 0.0, forcing, sigmas(forcing, load, winch[alternative].at(load.s_w)))
            values = of_load([part], quantiles(plan))
            for name in QUANTITIES:
                columns[name][i, k] = values[name][0]
    static = {"F_top_static": [h.F_top for h in hangs], "T_0": [natural_period(h) for h in hangs]}
    data: dict[str, tuple[tuple[str, ...], Any]] = {name: (over, values) for name, values in columns.items()}
    data |= {name: (over[1:], np.array(values)) for name, values in static.items()}
    attrs = {"Hs": Hs, "Tp": Tp, "beta": beta, "z_resonance": -resonance_depth(plan, Tp), "held": HELD}
    return labelled(data, {"alternative": [str(a) for a in alternatives], "z": z}, attrs)


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
    at, winch = plan.tip_of(_water_phase(plan)), _winch(plan, alternatives, progress)
    periods = np.array(plan.environment.Tp)
    n = len(periods)
    forcing = forcing_at(plan, Seas(np.full(n, Hs), periods, np.full(n, beta)), at.x, at.y)
    tip = forcing.deviation()
    columns = {name: np.full((len(alternatives), n), np.nan) for name in ("eta_wire", "eta_load")}
    for i, alternative in enumerate(alternatives):
        if winch[alternative].known:
            (load,) = _hanging(plan.under(alternative), at, np.array([z]))
            residual = sigmas(forcing, load, winch[alternative].at(load.s_w))
            columns["eta_wire"][i], columns["eta_load"][i] = 1.0 - residual.u / tip, 1.0 - residual.load / tip
    data = {name: (("alternative", "period"), values) for name, values in columns.items()}
    coords = {"alternative": [str(a) for a in alternatives], "period": periods}
    return labelled(data, coords, {"Hs": Hs, "beta": beta, "z": z})


def _hanging(plan: LiftPlan, tip: TipPoint, z: FloatArray) -> list[SuspendedLoad]:
    """What hangs below a crane tip, with the underside at heights z [m]."""
    return [suspended_load(plan.crane, plan.hanging(float(x), tip.z), float(x)) for x in z]


def _water_phase(plan: LiftPlan) -> Phase:
    """The phase whose crane tip counts under water: the longest that compensates, else the deepest one."""
    wet = [p for p in plan.phases if p.kind not in IN_AIR]
    follows = [p for p in wet if p.compensated]
    return max(follows or wet or list(plan.phases), key=lambda p: p.counted)


def _winch(plan: LiftPlan, alternatives: Sequence[Alternative], progress: Progress | None) -> Mapping[Alternative, Way]:
    """Residuals on the way of the plan's own compensated phases; of the deepest place where it has none."""
    winches = winches_of(plan, looked_at(plan), alternatives, progress)
    if winches:
        return winches
    at = _water_phase(plan)
    deep = suspended_load(plan.crane, plan.hanging(-plan.depth, plan.tip_of(at).z), -plan.depth)
    return ways(plan, alternatives, [replace(deep.duty, sensors=plan.sensors)], progress=progress)


class Reference(NamedTuple):
    """A cell: heading and period as rows of the table and as beta [rad] and Tp [s]; Hs [m], the credited limit of the
    alternative that leads, or the highest sea state analysed where it has none."""

    heading: int
    period: int
    beta: float
    Tp: float
    Hs: float


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
    return Reference(heading, period, axes.headings[heading], axes.periods[period], height)


EXPECTED = {"depth": 0.9, "efficiency": 1.2}
"""What each block took of the embedded plan [s]: for progress, in ratio to each other."""


def reference_blocks(plan: LiftPlan, of: Answered, progress: Progress | None = None) -> dict[str, xarray.Dataset]:
    """Blocks depth and efficiency of a result at the reference cell; none where no phase is compensated."""
    at, parts, alternatives = reference_of(plan, of), Parts(progress, EXPECTED), tuple(of.axes.alternatives)
    ends = [z for p in plan.phases if p.compensated for z in (p.z_start, p.z_end) if z is not None]
    if not any(phase.compensated for phase in plan.phases):
        return {}
    deepest = min(ends, default=0.0)
    return {
        "depth": depth_profile(plan, alternatives, at.Hs, at.Tp, at.beta, parts("depth")),
        "efficiency": efficiency(plan, alternatives, at.Hs, at.beta, deepest, parts("efficiency")),
    }
