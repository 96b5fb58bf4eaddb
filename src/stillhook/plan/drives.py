"""What a drive is worth in a plan: workable days that it gains in a year, the plan's crane replaced by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from stillhook.analysis.drives.sizing import Sized
from stillhook.base.progress import Progress
from stillhook.errors import PlanError
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.planning import plan as planned
from stillhook.plan.result import PlanResult
from stillhook.plan.weather.value import YEAR
from stillhook.report.formatting import DAY, HOUR

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

        rows[drive.name] = gained(planned(of_drive, tier=tier, progress=part), own)
    basis = (
        "Workable days of a year over each reference, as modelled; without a certificate no drive is credited with more"
        " than a flat 80 % of compensation."
    )
    if not any("low" in of for row in rows.values() for of in row["gained_over"].values()):
        basis += " The plan gives no interval for them, so they tell no two drives apart."
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
