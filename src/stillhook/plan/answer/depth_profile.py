"""Tension, DAF and slack against depth, and how much of the tip's motion is taken at the wire and at the load, in one
sea."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.demand import Seas
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import IN_AIR, Phase
from stillhook.plan.tiers.depths import natural_period, resonance_depth
from stillhook.plan.tiers.frequency import Part, forcing_at, looked_at, of_load, quantiles, winches_of
from stillhook.plan.tiers.winch_residual import Way, ways
from stillhook.response.forcing import Forcing
from stillhook.response.standard_deviations import sigmas
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
