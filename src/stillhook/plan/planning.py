"""Plan a lift: limiting sea states, governing criteria, waiting on weather, and the gain of a better controller; and
what a drive is worth in a plan, its crane replaced by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.analysis.drives.sizing import Sized
from stillhook.base.progress import Parts, Progress, Relay
from stillhook.engine.store import one_manifest
from stillhook.errors import Cancelled, PlanError
from stillhook.formats.weather.alpha_table import read_alpha_table
from stillhook.plan.answer.dataset import Answered, dataset_of, rows_of, seeds_of, summary_of
from stillhook.plan.answer.metadata import facts_of, not_computed, result_facts
from stillhook.plan.answer.reference_cell import reference_blocks, reference_of
from stillhook.plan.answer.spread import with_intervals
from stillhook.plan.answer.sweep import answer_of, landing_sweep, where_it_governs
from stillhook.plan.assessments import ASSESSMENTS
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits
from stillhook.plan.result import CREDITS, Failures, PlanResult
from stillhook.plan.table import (
    Axes,
    Certified,
    by_credit,
    certified_in,
    check_cap,
    chosen,
    gathered,
    governing,
    lower_where_apart,
)
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.frequency import frequency
from stillhook.plan.tiers.time_domain.cells import Execution
from stillhook.plan.tiers.time_domain.tier import refine
from stillhook.plan.tiers.weight_cases import of_cases
from stillhook.plan.weather.records import occurrence, seas_of, weather_used
from stillhook.plan.weather.value import YEAR, forecast_limits, weather_block, weather_value
from stillhook.report.formatting import DAY, HOUR
from stillhook.units import quote
from stillhook.validate.certificate.credit import checked
from stillhook.weather.alpha import DEFAULT
from stillhook.weather.series import Weather

if TYPE_CHECKING:
    import xarray

FREQUENCY, TIME = "frequency domain", "time domain"
EXPECTED = {"preparation": 2.0, FREQUENCY: 5.0, TIME: 100.0, "weather": 17.0, "reference cell": 2.0, "sweep": 30.0}
"""Parts of a plan and what each took of the embedded plan, its residuals known [s]: for progress, in ratio to
each other."""
PARTS = {
    Tier.CLOSED_FORM: ("preparation", "weather"),
    Tier.FREQUENCY: ("preparation", FREQUENCY, "weather", "reference cell"),
    Tier.TIME: ("preparation", FREQUENCY, TIME, "weather", "reference cell", "sweep"),
}


def plan(
    lift: LiftPlan | str | Path,
    *,
    tier: Tier | str = Tier.TIME,
    weather: Weather | None = None,
    alpha: str | None = None,
    store: str | Path | None = None,
    client: Any = None,
    threads: int = 2,
    seed: int = 0,
    progress: Progress | None = None,
) -> PlanResult:
    """Limiting sea states of a lift under every alternative, what governs them, and what they are worth in weather.

    Parameters
    ----------
    lift : LiftPlan, str or Path
        A plan, the path of a plan file, or a name of the library.
    tier : {"closed-form", "frequency", "time"}
        The highest that is run; default "time".
    weather : Weather, optional
        In place of that of the plan.
    alpha : str, optional
        Table of forecast factors, by name or file; default that of the plan, else "dnv-os-h101".
    store : str or Path, optional
        Folder in which runs of the twin are kept, so that a stopped plan continues from there.
    client : dask.distributed.Client, optional
        Cluster in place of this machine's threads.
    threads : int, default 2
        Threads that share the runs.
    seed : int, default 0
        0 or more; each gives the runs of the twin other waves of the same seas, so that two plans show by how much
        limits scatter.
    progress : callable or Monitor, optional
        Called with the share done, 0 to 1; a `stillhook.Monitor` gets events and can cancel.

    Returns
    -------
    PlanResult
        Limits, governing criteria and weather.

    Raises
    ------
    StillhookError
        One line.
    Cancelled
        When the token of the monitor is set; its `partial` is the plan of the tier below, made when it is read.
    """
    lift_plan, last = lift if isinstance(lift, LiftPlan) else load_plan(lift), tier_of(tier)
    how: dict[str, Any] = {"weather": weather, "alpha": alpha, "threads": threads}
    try:
        with one_manifest(store):
            return _planned(lift_plan, last, store=store, client=client, seed=seed, progress=progress, **how)
    except Cancelled:
        lower = list(Tier)[: list(Tier).index(last)]
        raise Cancelled(partial(_planned, lift_plan, lower[-1], **how) if lower else None) from None


def _planned(
    lift_plan: LiftPlan,
    last: Tier,
    *,
    weather: Weather | None,
    alpha: str | None,
    threads: int,
    store: str | Path | None = None,
    client: Any = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> PlanResult:
    """`plan` of a plan and a tier."""
    if seed < 0 or (seed and last is not Tier.TIME):
        raise PlanError(
            f"Seed {seed} with tier {last}: waves are drawn in tier {Tier.TIME} alone. Enter 0 or more there."
        )
    execution = Execution(store, client, threads, seed)
    expected = {name: EXPECTED[name] for name in PARTS[last]} | {each.NAME: each.EXPECTED for each in ASSESSMENTS}
    parts = Parts(progress, expected)
    crane = checked(lift_plan.crane, recompute=True, progress=parts("preparation"))
    lift_plan = replace(lift_plan, crane=crane)
    table, records = read_alpha_table(alpha or lift_plan.forecast_factors or DEFAULT), weather
    if records is None and lift_plan.weather is not None:
        records = weather_used(lift_plan.weather)
    if records is not None:
        seas_of(lift_plan, records)  # refused now rather than after the runs
    axes, seas = Axes.of(lift_plan), lift_plan.environment.table()
    certified = certified_in(lift_plan, axes, seas)
    check_cap(lift_plan, axes, certified.claimed if lift_plan.credits_synthetic else certified.covers)
    demands, limits = of_cases(
        lift_plan, lambda case: [closed_form(case, phase, seas, a) for phase in case.phases for a in axes.alternatives]
    )
    if last is not Tier.CLOSED_FORM:
        share = parts(FREQUENCY)
        more = of_cases(lift_plan, lambda case: frequency(case, axes.alternatives, seas, share, threads=threads))
        demands, limits = [*demands, *more[0]], [*limits, *more[1]]
    twin = None
    if last is Tier.TIME:
        twin = refine(
            lift_plan,
            limits,
            occurrence=None if records is None else occurrence(lift_plan, records),
            execution=execution,
            progress=parts(TIME),
        )
        demands, limits = [*demands, *twin.demands], [*limits, *twin.limits]
    parts("weather")
    of = answered(lift_plan, axes, certified, demands, limits)
    forecast = forecast_limits(lift_plan, table, of.governs)
    blocks: dict[str, xarray.Dataset] = {}
    failures, value = Failures() if twin is None else twin.failures, None
    if records is not None and forecast.restricted:
        value = failures.attempt("weather", partial(weather_value, lift_plan, axes, forecast, records), None)
    if records is not None and value is not None:
        block = weather_block(lift_plan, value, axes, records, forecast)
        spread = partial(with_intervals, block, lift_plan, of, limits, forecast, value, threads=threads)
        blocks["weather"] = failures.attempt("intervals of the weather", spread, block)
    if last is not Tier.CLOSED_FORM:
        detail = partial(reference_blocks, lift_plan, of, parts("reference cell"))
        nothing: dict[str, xarray.Dataset] = {}
        blocks |= failures.attempt("reference cell", detail, nothing)
    if twin is not None:
        at = reference_of(lift_plan, of)
        columns = where_it_governs(lift_plan, of.governs[CREDITS[0]], (at.Tp, at.beta))
        sweep = partial(landing_sweep, lift_plan, columns, execution, demands, parts("sweep"))
        swept = failures.attempt("landing tolerance, payload and depth", sweep, None)
        blocks |= {**twin.blocks, **({} if swept is None else {"sweep": swept})}
    state = PlanState(lift_plan, of, demands, limits, forecast, records, twin, execution, last)
    assessed: dict[str, Any] = {}
    for each in ASSESSMENTS:
        assessed[each.NAME] = failures.attempt(each.TITLE, partial(each.assess, state, parts(each.NAME)), None)
    facts = facts_of(lift_plan, [t.value for t in list(Tier)[: list(Tier).index(last) + 1]], table, records)
    facts |= result_facts(lift_plan, of, forecast, value, twin, last)
    facts["not_computed"] = not_computed(lift_plan, last, blocks)
    facts |= {"sweep": answer_of(blocks["sweep"])} if "sweep" in blocks else {}
    facts |= {name: each for name, each in assessed.items() if each is not None}
    facts["summary"] = summary_of(of, of.shown(), blocks.get("weather"))
    facts["limits"] = rows_of(of, forecast, max(lift_plan.environment.Hs))
    parts.at(1.0)
    data = dataset_of(lift_plan, of, forecast).assign_attrs(digest=facts["digest"])
    facts["remarks"] = [*failures.remarks, *facts["remarks"]]
    return PlanResult(data, facts, blocks)


def tier_of(text: Tier | str) -> Tier:
    """The tier of this name. Errors: PlanError."""
    if text not in list(Tier):
        raise PlanError(f"Unknown tier {quote(str(text))}. Choose {', '.join(list(Tier)[:-1])} or {list(Tier)[-1]}.")
    return Tier(text)


def answered(
    lift_plan: LiftPlan, axes: Axes, certified: Certified, demands: Sequence[Demand], limits: Sequence[Limits]
) -> Answered:
    """The limits in one table, as modelled, as credited, and as they may be claimed."""
    limits_of_tiers = gathered(axes, limits)
    modelled = lower_where_apart(lift_plan, limits_of_tiers, chosen(limits_of_tiers))
    counting = by_credit(lift_plan, modelled, certified)
    governs = governing(lift_plan, counting)
    return Answered(axes, limits_of_tiers, counting, governs, seeds_of(axes, demands), certified)


REFERENCES = (Alternative.NONE, Alternative.CAP)
"""What the gain of a drive is counted over."""
MODELLED = "twin"
"""Credit under which a drive counts as modelled: no drive has a certificate."""


def plan_with_weather(name_or_path: str | Path) -> LiftPlan:
    """A plan from which days follow. Errors: PlanError for one without weather."""
    lift_plan = load_plan(name_or_path)
    if lift_plan.weather is None:
        raise PlanError(
            f"--plan {lift_plan.name}: it has no [weather], from which days follow. Add it, or leave --plan out."
        )
    return lift_plan


def days_gained(
    lift_plan: LiftPlan, drives: Sequence[Sized], *, full: bool = False, progress: Progress | None = None
) -> dict[str, Any]:
    """Days that each drive gains in a plan: workable days of a year, and days of waiting of one operation with the
    interval that the plan gives; as modelled, over no compensation and over the flat cap.

    lift_plan: of `plan_with_weather`; full: the twin in the loop, else the frequency domain.
    """
    tier = Tier.TIME if full else Tier.FREQUENCY
    rows: dict[str, Any] = {}
    for i, drive in enumerate(drives):
        own = Alternative(drive.mode.value)
        of_drive = replace(lift_plan, crane=drive.crane, alternatives=(*REFERENCES, own), digest="")

        def part(share: float, done: int = i) -> None:
            if progress is not None:
                progress((done + share) / len(drives))

        rows[drive.name] = gained(plan(of_drive, tier=tier, progress=Relay(part, progress, stage=drive.name)), own)
    basis = (
        "Workable days of a year over each reference, as modelled; without a certificate no drive is credited with more"
        " than a flat 80 % of compensation."
    )
    if not any("low" in of for row in rows.values() for of in row["gained_over"].values()):
        basis += " The plan gives no interval for them, so the drives cannot be distinguished by them."
    return {"plan": lift_plan.name, "tier": tier.value, "basis": basis, "drives": rows}


def gained(result: PlanResult, own: Alternative) -> dict[str, Any]:
    """What an alternative of a plan's result gains; None where the weather never allows the operation at all."""
    if "weather" not in result:
        return {"gained_over": {}, "wait": None, "operability": None}
    block = result["weather"].sel(credit=MODELLED, alternative=own.value)
    year = block.sel(month=0)
    over: dict[str, Any] = {}
    for reference in REFERENCES:
        at = year.sel(over=reference.value)
        waits = {"value": float(at["days_gained"])}
        waits |= {end: float(at[f"days_gained_{end}"]) for end in ("low", "high") if f"days_gained_{end}" in at}
        over[reference.value] = {"value": float(at["hours_gained"]) * HOUR / DAY, "each_operation": waits}
        ends = _ends(result, own, reference)
        over[reference.value] |= ends
    return {"gained_over": over, "wait": float(year["wait_mean"]) / DAY, "operability": float(year["operability"])}


def _ends(result: PlanResult, own: Alternative, reference: Alternative) -> dict[str, float]:
    """Ends of the interval of days a year: those of the drive's operability, the reference as it is."""
    block = result["weather"].sel(credit=MODELLED)
    if "operability_low" not in block:
        return {}
    year = float(block["hours_gained"].sel(month=0, over=reference.value, alternative=own.value)) * HOUR / DAY
    middle = float(block["operability"].sel(month=0, alternative=own.value))
    return {
        end: year + YEAR * HOUR / DAY * (float(block[f"operability_{end}"].sel(alternative=own.value)) - middle)
        for end in ("low", "high")
    }
