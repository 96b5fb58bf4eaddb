"""One cell of the table in detail: tension against depth and efficiency in one sea, and how far a limit moves when
what is hardly known differs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.answer.sweep import LATE
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.limits import Limits, limits_in
from stillhook.plan.result import CREDITS, labelled
from stillhook.plan.tiers.closed_form import closed_form, on_way, way
from stillhook.plan.tiers.frequency import Part, demands, forcing_at, forcings, of_load, quantiles, winches_of
from stillhook.plan.tiers.situations import Looks, Situation, looked_at, natural_period, resonance_depth, thinned
from stillhook.plan.tiers.winch_residual import Way, ways
from stillhook.response.frequency_domain import sigmas
from stillhook.response.suspended_load import SuspendedLoad, natural_periods, suspended_load
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import Phase
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


ADDED_MASS, DRAG, FRICTION = (0.8, 1.2), (0.5, 1.5), (0.7, 1.3)
"""Factors that are tried: added mass by shape is known to a fifth, drag to a half, friction of a winch in service to a
third (assumed)."""
Y = ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6")


@dataclass(frozen=True, eq=False)
class Changed:
    """One number of a plan otherwise: what and how in words; the plan, its phase's places, and whether the winch has to
    be identified again."""

    factor: str
    text: str
    plan: LiftPlan
    phases: Looks
    winch: bool = False


def sensitivity(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    Tp: float,
    beta: float,
    phase: str,
    progress: Progress | None = None,
    *,
    ask: Sequence[Alternative] | None = None,
) -> xarray.Dataset:
    """Limiting heights of one phase in one period and direction with one number after the other otherwise, by the
    frequency-domain method; by the closed form where the surface cuts the payload: there the winch does not follow the
    tip, and added mass comes with the slamming that follows from it. Rules and capacities are those of the plan as it
    is; the phase is looked at at its ends and its middle.

    ask: alternatives whose winch is identified again with other friction and with a late motion signal, some seconds
    each unless known (None: the last one of the twin). For the others these two factors give nothing: NaN; a winch on
    its brake and the flat cap do not change.
    Returns Hs_base, Hs_low and Hs_high [m] over factor and alternative, inf above the highest sea of the plan; coords
    low_text, high_text; attrs Tp [s], beta [rad], phase and rule, which governs the last alternative. Errors: as
    `stillhook.plan.tiers.frequency.frequency`.
    """
    every = looked_at(plan)
    at = [(p, thinned(parts)) for p, parts in every if p.name == phase]
    heights = np.array(plan.environment.heights)
    seas = Seas(heights, np.full_like(heights, Tp), np.full_like(heights, beta))
    twins = [a for a in alternatives if a.twin]
    repeated = twins[-1:] if ask is None else [a for a in twins if a in ask]
    winches = winches_of(plan, every, alternatives) if at else {}
    forcing = forcings(plan, seas, at)

    def least(
        of: LiftPlan, places: Looks, run: Sequence[Alternative], winch: Mapping[Alternative, Way]
    ) -> list[tuple[float, str]]:
        closed = [] if at else [closed_form(of, plan.phase(phase), seas, a) for a in run]
        asked = demands(of, run, seas, places, forcing, winch) if at else closed
        return [_least(limits_in(plan, each)) for each in asked]

    base = least(plan, at, alternatives, winches)
    tried = _changes(plan, plan.phase(phase), at)
    Hs_base = np.broadcast_to([Hs for Hs, _ in base], (len(tried), len(alternatives)))
    Hs_varied = np.full((2, len(tried), len(alternatives)), np.nan)
    for i, pair in enumerate(tried):
        for j, each in enumerate(pair):
            if progress is not None:
                progress((2 * i + j) / (2 * len(tried)))
            if each.winch:
                alike = [not (at and a.twin) for a in alternatives]
                Hs_varied[j, i, alike] = Hs_base[i, alike]
            run = alternatives if not each.winch else repeated if at else ()
            winch = winches_of(each.plan, every, run) if each.winch and run else winches
            for a, (Hs, _) in zip(run, least(each.plan, each.phases, run, winch), strict=True):
                Hs_varied[j, i, alternatives.index(a)] = Hs
    dims = ("factor", "alternative")
    coords = {
        "factor": [low.factor for low, _ in tried],
        "alternative": [str(a) for a in alternatives],
        "low_text": ("factor", [low.text for low, _ in tried]),
        "high_text": ("factor", [high.text for _, high in tried]),
    }
    tier = Tier.FREQUENCY if at else Tier.CLOSED_FORM
    attrs = {"Tp": Tp, "beta": beta, "phase": phase, "rule": base[-1][1], "tier": tier.value}
    columns = {"Hs_base": Hs_base, "Hs_low": Hs_varied[0], "Hs_high": Hs_varied[1]}
    return labelled({name: (dims, values) for name, values in columns.items()}, coords, attrs)


def _least(limits: Limits) -> tuple[float, str]:
    """Least height over the rules [m], and the rule; NaN where none is determined."""
    lowest = {rule: float(Hs[0]) for rule, Hs in limits.Hs.items() if not np.isnan(Hs[0])}
    rule = min(lowest, key=lambda key: lowest[key], default="")
    return lowest.get(rule, math.nan), rule


def _changes(plan: LiftPlan, phase: Phase, at: Looks) -> list[tuple[Changed, ...]]:
    """Every factor with its low and its high end; at: places of the phase, none for the closed form."""

    def of_water(factor: str, f: float) -> Changed:
        text = f"{f:g} of the payload's"
        if not at:
            w = way(plan, phase)
            other = replace(w, A33=f * w.A33, dA33=f * w.dA33) if factor == "C_A" else replace(w, B=f * w.B)
            return Changed(factor, text, on_way(plan, phase, other), at)
        change = _heavier if factor == "C_A" else _rougher
        return Changed(factor, text, plan, [(p, [change(s, f) for s in parts]) for p, parts in at])

    def of_friction(f: float) -> Changed:
        friction = plan.crane.friction
        system = friction.system.model_copy(update={name: f * getattr(friction.system, name) for name in Y})
        crane = plan.crane.model_copy(update={"friction": friction.model_copy(update={"system": system})})
        return Changed("friction", f"{f:g} of the crane's", replace(plan, crane=crane), at, winch=True)

    def of_delay(t: float) -> Changed:
        late = replace(plan, sensors=plan.sensors.model_copy(update={"delay": t}))
        return Changed("delay", show(t, "time"), late, at, winch=True)

    return [
        tuple(of_water("C_A", f) for f in ADDED_MASS),
        tuple(of_water("C_D", f) for f in DRAG),
        tuple(of_friction(f) for f in FRICTION),
        tuple(of_delay(t) for t in (0.0, plan.sensors.delay or LATE)),
    ]


def _heavier(s: Situation, f: float) -> Situation:
    end = replace(s.load.end, A33=f * s.load.end.A33)
    return replace(s, load=replace(s.load, end=end), T_0=float(natural_periods(s.load.rod, end, 1)[0]))


def _rougher(s: Situation, f: float) -> Situation:
    return replace(s, load=replace(s.load, B=f * s.load.B, C_lin=f * s.load.C_lin))


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
    return ways(plan.crane, alternatives, [replace(deep.duty, sensors=plan.sensors)], progress=progress)


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


EXPECTED = {"depth": 0.9, "efficiency": 1.2, "sensitivity": 1.5}
"""What each block took of the embedded plan [s]: for progress, in ratio to each other."""


def reference_blocks(
    plan: LiftPlan,
    of: Answered,
    progress: Progress | None = None,
    *,
    residuals: bool = True,
) -> dict[str, xarray.Dataset]:
    """Blocks depth, efficiency and sensitivity of a result at the reference cell; none where no phase is compensated.
    residuals: identify the winch again with other friction and with a late signal, some seconds."""
    at, parts, alternatives = reference_of(plan, of), Parts(progress, EXPECTED), tuple(of.axes.alternatives)
    ends = [z for p in plan.phases if p.compensated for z in (p.z_start, p.z_end) if z is not None]
    if not any(phase.compensated for phase in plan.phases):
        return {}
    datasets = {"depth": depth_profile(plan, alternatives, at.Hs, at.Tp, at.beta, parts("depth"))}
    deepest = min(ends, default=0.0)
    datasets["efficiency"] = efficiency(plan, alternatives, at.Hs, at.beta, deepest, parts("efficiency"))
    where = sensitive_at(of)
    if where is not None:
        ask = (of.shown(),) if residuals else ()

        datasets["sensitivity"] = sensitivity(plan, alternatives, *where, parts("sensitivity"), ask=ask)
    return datasets


def sensitive_at(of: Answered) -> tuple[float, float, str] | None:
    """Period [s], direction [rad] and name of the phase that governs most cells of the alternative that leads, as
    credited, where its limit is least; None where none governs."""
    axes, g, shown = of.axes, of.governs[CREDITS[1]], of.axes.alternatives.index(of.shown())
    governing_phase = g.phase[shown]
    if not (governing_phase >= 0).any():
        return None
    phase = int(np.bincount(governing_phase[governing_phase >= 0]).argmax())
    heading, period = np.unravel_index(
        int(np.where(governing_phase == phase, g.Hs[shown], np.inf).argmin()), governing_phase.shape
    )
    return axes.periods[period], axes.headings[heading], axes.phases[phase]
