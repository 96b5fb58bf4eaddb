"""How far a limit moves when what is hardly known is otherwise: added mass, drag, friction of the winch, delay of the
motion signal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.limits import Limits
from stillhook.plan.tiers.closed_form import Way as WaterWay
from stillhook.plan.tiers.closed_form import closed_form, on_way, way
from stillhook.plan.tiers.frequency import Looks, Situation, demands, forcings, looked_at, thinned, winches_of
from stillhook.plan.tiers.winch_residual import Way
from stillhook.response.suspended_load import natural_periods
from stillhook.spec.crane import Crane
from stillhook.units import show
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


ADDED_MASS, DRAG, FRICTION = (0.8, 1.2), (0.5, 1.5), (0.7, 1.3)
"""Factors that are tried: added mass by shape is known to a fifth, drag to a half, friction of a winch in service to a
third (assumed)."""
LATE = 0.2
"""Delay of the motion signal that is tried beside that of the plan [s]."""
Judge = Callable[[Sequence[Demand]], list[Limits]]
"""From demands to limiting heights, by the rules and capacities of a plan."""
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
    limits: Judge,
    progress: Progress | None = None,
    *,
    ask: Sequence[Alternative] | None = None,
) -> xarray.Dataset:
    """Limiting heights of one phase in one period and direction with one number after the other otherwise, by the
    frequency-domain method; by the closed form where the surface cuts the payload.

    Parameters: limits, from demands to limiting heights (rules and capacities of the plan as it is); ask: alternatives
    whose winch is identified again with other friction and with a late motion signal, some seconds each unless known
    (None: the last one of the twin). Of the others these two factors tell nothing: NaN; a winch on its brake and the
    flat cap do not change. The phase is looked at at its ends and its middle.
    Returns Hs_base, Hs_low and Hs_high [m] over factor and alternative, inf above the highest sea of the plan; coords
    low_text, high_text; attrs Tp [s], beta [rad], phase and rule, which governs the last alternative. Errors: as
    `stillhook.plan.tiers.frequency.frequency`.
    """
    every = looked_at(plan)
    if not any(p.name == phase for p, _ in every):
        return _closed(plan, alternatives, Tp, beta, phase, limits)
    at = [(p, thinned(parts)) for p, parts in every if p.name == phase]
    heights = np.array(plan.environment.Hs)
    seas = Seas(heights, np.full_like(heights, Tp), np.full_like(heights, beta))
    twins = [a for a in alternatives if a.twin]
    repeated = twins[-1:] if ask is None else [a for a in twins if a in ask]
    winches = winches_of(plan, every, alternatives)
    forcing = forcings(plan, seas, at)

    def Hs(
        of: LiftPlan, look: Looks, alternatives_run: Sequence[Alternative], winch: Mapping[Alternative, Way]
    ) -> list[tuple[float, str]]:
        return [_least(each) for each in limits(demands(of, alternatives_run, seas, look, forcing, winch))]

    base = Hs(plan, at, alternatives, winches)
    tried = _changes(plan, at)
    Hs_varied = np.full((len(tried), 2, len(alternatives)), np.nan)
    for i, pair in enumerate(tried):
        for j, each in enumerate(pair):
            alternatives_run = repeated if each.winch else alternatives
            if progress is not None:
                progress((2 * i + j) / (2 * len(tried)))
            winch = winches_of(each.plan, every, alternatives_run) if each.winch and alternatives_run else winches
            for a, (height, _) in zip(
                alternatives_run, Hs(each.plan, each.phases, alternatives_run, winch), strict=True
            ):
                Hs_varied[i, j, alternatives.index(a)] = height
            for k, a in enumerate(alternatives):
                if each.winch and not a.twin:
                    Hs_varied[i, j, k] = base[k][0]
    rows = np.broadcast_to([height for height, _ in base], (len(tried), len(alternatives)))
    return _labelled_limits(tried, alternatives, rows, Hs_varied, _attributes(Tp, beta, phase, base[-1][1], Tier.FREQUENCY))


def _attributes(Tp: float, beta: float, phase: str, rule: str, tier: Tier) -> dict[str, float | str]:
    return {"Tp": Tp, "beta": beta, "phase": phase, "rule": rule, "tier": tier.value}


def _closed(
    plan: LiftPlan, alternatives: Sequence[Alternative], Tp: float, beta: float, name: str, limits: Judge
) -> xarray.Dataset:
    """The same by the closed form: added mass with the slamming that follows from it, and drag; the winch does not
    follow the tip."""
    phase, heights = plan.phase(name), np.array(plan.environment.Hs)
    seas = Seas(heights, np.full_like(heights, Tp), np.full_like(heights, beta))

    def Hs(of: LiftPlan) -> list[tuple[float, str]]:
        return [_least(each) for each in limits([closed_form(of, phase, seas, a) for a in alternatives])]

    base, tried = Hs(plan), _changes(plan, [])
    Hs_varied = np.array([[[h for h, _ in base]] * 2] * len(tried), dtype=np.float64)
    for i, (ends, change) in enumerate(((ADDED_MASS, _heavier_way), (DRAG, _rougher_way))):
        for j, f in enumerate(ends):
            Hs_varied[i, j] = [h for h, _ in Hs(on_way(plan, phase, change(way(plan, phase), f)))]
    rows = np.broadcast_to([height for height, _ in base], (len(tried), len(alternatives)))
    return _labelled_limits(tried, alternatives, rows, Hs_varied, _attributes(Tp, beta, name, base[-1][1], Tier.CLOSED_FORM))


def _heavier_way(w: WaterWay, f: float) -> WaterWay:
    return replace(w, A33=f * w.A33, dA33=f * w.dA33)


def _rougher_way(w: WaterWay, f: float) -> WaterWay:
    return replace(w, B=f * w.B)


def _least(limits: Limits) -> tuple[float, str]:
    """Least height over the rules, and the rule; NaN where none tells."""
    lowest = {rule: float(Hs[0]) for rule, Hs in limits.Hs.items() if not np.isnan(Hs[0])}
    if not lowest:
        return float("nan"), ""
    rule = min(lowest, key=lambda key: lowest[key])
    return lowest[rule], rule


def _changes(plan: LiftPlan, at: Looks) -> list[tuple[Changed, Changed]]:
    """Every factor with its low and its high end."""

    def hangs(
        factor: str, ends: tuple[float, float], change: Callable[[Situation, float], Situation]
    ) -> tuple[Changed, Changed]:
        low, high = (
            Changed(factor, f"{f:g} of the payload's", plan, [(p, [change(s, f) for s in parts]) for p, parts in at])
            for f in ends
        )
        return low, high

    friction = [
        Changed("friction", f"{f:g} of the crane's", replace(plan, crane=_rubbing(plan, f)), at, winch=True)
        for f in FRICTION
    ]
    delay = plan.sensors.delay
    times = (0.0, delay) if delay > 0.0 else (0.0, LATE)
    late = [
        Changed(
            "delay",
            f"{show(t, 'time')}",
            replace(plan, sensors=plan.sensors.model_copy(update={"delay": t})),
            at,
            winch=True,
        )
        for t in times
    ]
    return [
        hangs("C_A", ADDED_MASS, _heavier),
        hangs("C_D", DRAG, _rougher),
        (friction[0], friction[1]),
        (late[0], late[1]),
    ]


def _heavier(s: Situation, f: float) -> Situation:
    end = replace(s.load.end, A33=f * s.load.end.A33)
    return replace(s, load=replace(s.load, end=end), T_0=float(natural_periods(s.load.rod, end, 1)[0]))


def _rougher(s: Situation, f: float) -> Situation:
    return replace(s, load=replace(s.load, B=f * s.load.B, C_lin=f * s.load.C_lin))


def _rubbing(plan: LiftPlan, f: float) -> Crane:
    """The crane with all of its system friction times a factor."""
    friction = plan.crane.friction
    system = friction.system.model_copy(update={name: f * getattr(friction.system, name) for name in Y})
    return plan.crane.model_copy(update={"friction": friction.model_copy(update={"system": system})})


def _labelled_limits(
    tried: Sequence[tuple[Changed, Changed]],
    alternatives: Sequence[Alternative],
    base: FloatArray,
    Hs_varied: FloatArray,
    attrs: Mapping[str, float | str],
) -> xarray.Dataset:
    import xarray  # heavy: only where results are labelled

    dims = ("factor", "alternative")
    columns = {"Hs_base": base, "Hs_low": Hs_varied[:, 0], "Hs_high": Hs_varied[:, 1]}
    coords = {
        "factor": [low.factor for low, _ in tried],
        "alternative": [str(a) for a in alternatives],
        "low_text": ("factor", [low.text for low, _ in tried]),
        "high_text": ("factor", [high.text for _, high in tried]),
    }
    return xarray.Dataset(
        {name: (dims, values, attributes(name)) for name, values in columns.items()}, coords, dict(attrs)
    )
