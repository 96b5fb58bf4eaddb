"""A hindcast with the spectra of its records: in which of them a lift can be done, and how long it waits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Progress, begin
from stillhook.errors import PlanError
from stillhook.plan.definition.capacities import LEADS
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas
from stillhook.plan.limits import Limits, limited, limits_in, utilisation
from stillhook.plan.table import Axes, chosen, gathered, governed, limit_table
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.frequency import demands, winches_of
from stillhook.plan.tiers.situations import looked_at, thinned
from stillhook.plan.weather.limit_table import SAME
from stillhook.response.forcing import Forcing, filtered_forcing
from stillhook.response.lift import Waves, forcing_of_waves
from stillhook.sea.spectra.directions import FULL, relative
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea
from stillhook.spec.lift.phase import Phase
from stillhook.units import show
from stillhook.weather.alpha import AlphaTable, alphas, reference_period
from stillhook.weather.limit_text import free_headings
from stillhook.weather.persistence import persistence, stamp
from stillhook.weather.series import usual_step


def utilisations(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    waves: Waves,
    progress: Progress | None = None,
    *,
    elsewhere: Mapping[Alternative, FloatArray] | None = None,
) -> FloatArray:
    """How much of its limits a lift uses in every record of a hindcast, the largest over phases and rules (alternative,
    n) [-]; NaN where the record is missing. Every phase is looked at at its ends and its middle.

    Parameters: waves, measured or hindcast spectra or states with a direction, where the bow points for all of them
    (`Waves.ship`), or one direction of travel from the bow (`Waves.beta`). elsewhere: limiting heights (n,) [m] of the
    phases that the method does not cover, record by record, as `LimitTable.at` reads them; without them the splash zone
    is left out.
    Errors: PlanError for one sea alone; as `stillhook.plan.tiers.frequency.frequency`.
    """
    of, (plan, _) = _records(waves), _without_swell(plan)
    every = looked_at(plan)
    phases = [(phase, thinned(parts)) for phase, parts in every]
    places = sorted({(s.x, s.y) for _, parts in phases for s in parts})
    forcing = {place: _forcing(plan, waves, *place) for place in places}
    begin(progress, "winch residuals")
    H = np.asarray(of.H_m0, dtype=np.float64)
    beta = math.nan if waves.beta is None else waves.beta
    seas = Seas(H, np.asarray(of.T_p, dtype=np.float64), np.full(len(H), beta))
    used = np.full((len(alternatives), len(H)), np.nan)
    for demand in demands(plan, alternatives, seas, phases, forcing, winches_of(plan, every, alternatives, progress)):
        i = alternatives.index(demand.alternative)
        for each in limited(plan, plan.phase(demand.phase), demand.alternative):
            if each.rule.quantity in demand.values:
                used[i] = np.fmax(used[i], utilisation(each, demand.values[each.rule.quantity], H))
    for i, alternative in enumerate(alternatives):
        if elsewhere is not None and alternative in elsewhere:
            limit = elsewhere[alternative]
            share = np.divide(H, limit, out=np.where(H > 0.0, np.inf, 0.0), where=limit > 0.0)
            used[i] = np.where(np.isnan(used[i]) | np.isnan(limit), np.nan, np.fmax(used[i], share))
    return used


def _forcing(plan: LiftPlan, waves: Waves, x: float, y: float) -> Forcing:
    return filtered_forcing(lambda vessel: forcing_of_waves(waves, vessel, x, y), plan.vessel, plan.unit)


FINE = 0.001
"""Step of heights at which alpha(H) H is tabled [m]: far below the resolution of a hindcast."""
HIGHEST = 40.0
"""Above every sea [m]."""


def spectral_persistence(
    plan: LiftPlan,
    waves: Waves,
    table: AlphaTable,
    alternatives: Sequence[Alternative] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Windows of T_R and waits of every alternative (of the plan, without any given), by name [SI].

    Errors: PlanError for one sea alone, and for an operation that is not weather restricted.
    """
    of, (plan, swell) = _records(waves), _without_swell(plan)
    T_R, restricted = reference_period(table, plan.T_POP, plan.T_C)
    if not restricted:
        times = f"T_POP {plan.T_POP / 3600.0:g} h, T_R {T_R / 3600.0:g} h"
        raise PlanError(f"operation: {times}: not weather restricted. Divide the operation.")
    chosen_ones = tuple(alternatives) or plan.alternatives
    raised = waves.with_waves(_raised(of, raised_heights(table, np.asarray(of.H_m0), plan.T_POP)))
    elsewhere, omitted = _in_the_surface(plan, raised, chosen_ones)
    used = utilisations(plan, chosen_ones, raised, progress, elsewhere=elsewhere)
    time, step = of.time, usual_step(of.time)
    valid = np.asarray(of.valid) & ~np.isnan(used).all(axis=0)
    rows, (reached, headed) = [], _reached(plan, waves)
    for alternative, share in zip(chosen_ones, used, strict=True):
        one = persistence((share <= 1.0) & reached, time, step, T_R - plan.lead, valid=valid)
        rows.append({"alternative": str(alternative)} | one.numbers() | {"months": [m.numbers() for m in one.months]})
    surface = [f"{omitted}: by the plan's table in closed form"] if omitted else []
    notes = [
        *swell,
        *surface,
        *headed,
        "limits as simulated for each alternative, not as credited; alpha is in them",
        f"below Hs {table.Hs[0]:g} m the table has no alpha (case by case): no record is taken for less than that",
        *of.notes,
    ]
    return {
        "plan": plan.name,
        "file": of.source,
        "waves": waves.describe(),
        "start": stamp(time[0]),
        "end": stamp(time[-1]),
        "step": step,
        "n_records": len(time),
        "n_valid": int(np.count_nonzero(valid)),
        "T_POP": plan.T_POP,
        "T_R": T_R,
        "window": T_R - plan.lead,
        "table": table.source,
        "alternatives": rows,
        "notes": notes,
    }


def _records(waves: Waves) -> SpectrumSeries | SeaStates:
    """Waves over time. Errors: PlanError for one sea alone."""
    if isinstance(waves.of, Sea):
        raise PlanError("hindcast: one sea is not a hindcast. Give a file of spectra or sea states over time.")
    return waves.of


def _without_swell(plan: LiftPlan) -> tuple[LiftPlan, list[str]]:
    """The plan without the swell of its table, and a note: records hold wind sea and swell as they were."""
    if plan.environment.swell is None:
        return plan, []
    environment = plan.environment.model_copy(update={"swell": None})
    return replace(plan, environment=environment), ["the plan's swell is left out: records hold their own"]


def _reached(plan: LiftPlan, waves: Waves) -> tuple[BoolArray, list[str]]:
    """Whether waves of each record are those judged, at each heading that may be kept (heading, n), and a note."""
    come_from = np.asarray(_records(waves).come_from, dtype=np.float64)
    if waves.beta is None or not np.isfinite(come_from).any():
        return np.ones((1, len(come_from)), dtype=np.bool_), []
    tolerance, side = plan.environment.heading_tolerance, waves.beta
    off = [np.abs((relative(come_from, float(ship)) - side + math.pi) % FULL - math.pi) for ship in free_headings()]
    within = f"within {show(tolerance, 'angle', 4)} of {show(side, 'angle', 4)} from the bow"
    return np.stack(off) <= tolerance + SAME, [
        f"vessel free to turn: one heading through each operation, waves {within}"
    ]


def raised_heights(table: AlphaTable, H: FloatArray, T_POP: float) -> FloatArray:
    """Heights (n,) [m] whose OP_WF forecasts of H (n,) are, at least the lowest of the table, `HIGHEST` above what it
    has factors for; NaN stays."""
    grid = np.arange(table.Hs[0], HIGHEST, FINE)
    op_wf = alphas(table, grid, T_POP) * grid
    grid, op_wf = grid[np.isfinite(op_wf)], op_wf[np.isfinite(op_wf)]
    raised = np.interp(H, op_wf, grid, right=HIGHEST) if len(grid) else np.full(len(H), HIGHEST)
    return np.where(np.isfinite(H), raised, np.nan)


def _raised(of: SpectrumSeries | SeaStates, H: FloatArray) -> SpectrumSeries | SeaStates:
    """The same waves, shapes and periods, of other heights. A record without waves stays so."""
    if isinstance(of, SeaStates):
        return replace(of, H_m0=np.where(of.H_m0 > 0.0, H, of.H_m0))
    factor = np.divide(H, of.H_m0, out=np.ones(len(H)), where=of.H_m0 > 0.0)
    return replace(of, S=of.S * factor[:, None] ** 2)


def _in_the_surface(
    plan: LiftPlan, waves: Waves, alternatives: Sequence[Alternative]
) -> tuple[dict[Alternative, FloatArray], str]:
    """Limiting heights (n,) of what the method does not cover, record by record, and what that is: phases in the
    surface, and of the others what a load chart limits and the method does not determine."""
    names = {phase.name for phase, _ in looked_at(plan)}
    phases = [phase for phase in plan.phases if phase.name not in names]
    charted = [] if plan.load_chart is None else [phase for phase in plan.phases if phase.name in names]
    if not phases and not charted:
        return {}, ""
    axes, seas = Axes.of(plan), plan.environment.table()
    limits = [limits_in(plan, closed_form(plan, phase, seas, a)) for phase in phases for a in alternatives]
    limits += [_by_chart(plan, phase, a, seas) for phase in charted for a in alternatives]
    table = governed(chosen(gathered(axes, limits)))
    of = _records(waves)
    T_p, come_from = np.asarray(of.T_p), np.asarray(of.come_from)
    beta = np.asarray(relative(come_from, waves.ship or 0.0)) if waves.beta is None else np.full(len(T_p), waves.beta)
    read = {a: limit_table(plan, axes, table.Hs[axes.alternatives.index(a)]).at(T_p, beta) for a in alternatives}
    covered = [*(phase.name for phase in phases), *(["static load and leads of the load chart"] if charted else [])]
    return read, ", ".join(covered)


OF_CHART = ("F_top_static", *LEADS)
"""What a load chart limits and the frequency-domain method does not determine."""


def _by_chart(plan: LiftPlan, phase: Phase, alternative: Alternative, seas: Seas) -> Limits:
    """Limits of a phase by the rules on `OF_CHART` alone."""
    limits = limits_in(plan, closed_form(plan, phase, seas, alternative))
    keys = {rule.key for rule in plan.rules.rules if rule.quantity in OF_CHART}
    return replace(limits, Hs={key: Hs for key, Hs in limits.Hs.items() if key in keys}, low={}, high={})
