"""A hindcast with the spectra of its records: which of them a lift can be done in, record by record, by the
frequency-domain method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.errors import PlanError
from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.demand import Seas
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.limits.applicable_rules import limited
from stillhook.plan.limits.solve import utilisation
from stillhook.plan.tiers.frequency import Looks, demands, looked_at, thinned, winches_of
from stillhook.response.lift import Waves, forcing_of_waves
from stillhook.sea.spectra.spectrum import Sea
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


def spectral_weather(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    waves: Waves,
    progress: Progress | None = None,
    *,
    elsewhere: Mapping[Alternative, FloatArray] | None = None,
) -> xarray.Dataset:
    """How much of its limits a lift uses in every record of a hindcast, and whether it can be done.

    Parameters: waves, measured or hindcast spectra or states with a direction, where the bow points for all of them
    (`Waves.ship`), or one direction of travel from the bow (`Waves.beta`). elsewhere: limiting heights (n,) [m] of the
    phases that the method does not cover, record by record, as a limit table reads them
    (`stillhook.plan.table.table.LimitTable.at`); without them the splash zone is left out. Returns over alternative and
    time: utilisation [-], the largest over phases and rules, NaN where the record is missing; workable_record, 1 where
    it is 1 at most, else 0 (missing ones: 0); over alternative, phase and time: utilisation_phase. Every phase is
    looked at at its ends and its middle. attrs: left_out, phases not told.
    Errors: PlanError for one sea alone; as `stillhook.plan.tiers.frequency.frequency`.
    """
    if isinstance(waves.of, Sea):
        raise PlanError("hindcast: one sea is no hindcast. Give a file of spectra or sea states over time.")
    every = looked_at(plan)
    phases = [(phase, thinned(parts)) for phase, parts in every]
    places = sorted({(s.x, s.y) for _, parts in phases for s in parts})
    forcing = {place: forcing_of_waves(waves, plan.vessel, *place) for place in places}
    H = np.asarray(waves.of.H_m0, dtype=np.float64)
    seas = Seas(
        H, np.asarray(waves.of.T_p, dtype=np.float64), np.full(len(H), math.nan if waves.beta is None else waves.beta)
    )
    winch = winches_of(plan, every, alternatives, progress)
    used = np.full((len(alternatives), len(phases), len(H)), np.nan)
    for k, look in enumerate(phases):
        for demand in demands(plan, alternatives, seas, [look], forcing, winch):
            rules = limited(plan, look[0], demand.alternative)
            values = [
                utilisation(each, demand.values[each.rule.quantity])
                for each in rules
                if each.rule.quantity in demand.values
            ]
            used[alternatives.index(demand.alternative), k] = _largest(values, len(H))
    return _labelled(plan, alternatives, waves, phases, used, _with(used.swapaxes(0, 1), alternatives, H, elsewhere))


def _largest(rows: Sequence[FloatArray], n: int) -> FloatArray:
    """Largest of several, those that are not told aside; NaN where none is."""
    return np.asarray(np.fmax.reduce([np.full(n, np.nan), *rows]))


def _with(
    by_phase: FloatArray,
    alternatives: Sequence[Alternative],
    H: FloatArray,
    elsewhere: Mapping[Alternative, FloatArray] | None,
) -> FloatArray:
    """Largest utilisation over phases (phase, alternative, n) and what is told elsewhere, (alternative, n)."""
    utilisation = np.array(np.fmax.reduce(by_phase), dtype=np.float64)
    for i, alternative in enumerate(alternatives):
        if elsewhere is not None and alternative in elsewhere:
            limit = elsewhere[alternative]
            share = np.divide(H, limit, out=np.where(H > 0.0, np.inf, 0.0), where=limit > 0.0)
            utilisation[i] = np.where(
                np.isnan(utilisation[i]) | np.isnan(limit), np.nan, np.fmax(utilisation[i], share)
            )
    return utilisation


def _labelled(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    waves: Waves,
    phases: Looks,
    used: FloatArray,
    utilisation: FloatArray,
) -> xarray.Dataset:
    import xarray  # heavy: only where results are labelled

    assert not isinstance(waves.of, Sea)
    phase_names = [phase.name for phase, _ in phases]
    with np.errstate(invalid="ignore"):
        workable = (utilisation <= 1.0).astype(np.int8)
    columns = {
        "utilisation": (("alternative", "time"), utilisation, attributes("utilisation")),
        "workable_record": (("alternative", "time"), workable, attributes("workable_record")),
        "utilisation_phase": (("alternative", "phase", "time"), used, attributes("utilisation")),
    }
    coords = {
        "alternative": [str(a) for a in alternatives],
        "phase": phase_names,
        "time": waves.of.time.astype("datetime64[ns]"),
    }
    left = ", ".join(phase.name for phase in plan.phases if phase.name not in phase_names)
    return xarray.Dataset(columns, coords, {"waves": waves.describe(), "left_out": left})
