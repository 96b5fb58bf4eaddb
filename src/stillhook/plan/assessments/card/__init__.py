"""What the decision page and the limits card are made of: limits that may be claimed by part of the lift and period,
and the speed of the crane tip where it protects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.base.progress import Progress
from stillhook.plan.assessments.card.claim import cells_of, credit_of, of_phases, parts_of
from stillhook.plan.assessments.card.tip_speed import in_phases, per_metre
from stillhook.plan.assessments.interface import PlanState
from stillhook.report.document import Part, Table, Text
from stillhook.report.formatting import direction, fixed, percent

NAME, TITLE, EXPECTED = "card", "Speed of the crane tip", 2.0
PER_METRE = "Standard deviation of the speed of the crane tip per metre of Hs [m/s]"


def assess(state: PlanState, progress: Progress) -> Mapping[str, Any]:
    """Claimable limits of the whole lift and of each part, and speeds of the tip."""
    plan, alternative = state.plan, state.answered.shown()
    claim, parts = state.answered.claim, parts_of(plan)
    chosen = state.answered.counting[claim]

    def cells(of: list[Any]) -> list[dict[str, Any]]:
        return cells_of(plan, of_phases(plan, chosen, of), state.forecast, alternative)

    limits = {part: cells(phases) for part, phases in parts.items()}
    progress(0.5)
    return {
        "alternative": alternative.value,
        "credit": credit_of(plan, state.answered, alternative),
        "cells": cells(list(plan.phases)),
        "parts": [
            {"name": part, "phases": [phase.name for phase in parts[part]], "cells": limits[part]} for part in parts
        ],
        "tip_speed_per_metre": per_metre(plan),
        "tip_speed": in_phases(plan, limits),
    }


def parts(facts: Mapping[str, Any]) -> list[Part]:
    """Speeds of the tip per metre of Hs, and its share in the relative velocity by part of the lift."""
    own = facts[NAME]
    rows, periods = own["tip_speed_per_metre"], sorted({row["T_p"] for row in own["tip_speed_per_metre"]})
    headings = list(dict.fromkeys(row["beta"] for row in rows))
    speed = {(row["beta"], row["T_p"]): fixed(row["sigma_v"], 3) for row in rows}
    head = ("waves at", *(f"{T:g} s" for T in periods))
    table = Table(head, [[direction(b), *(speed[b, T] for T in periods)] for b in headings], PER_METRE)
    shares = [
        [part, *(percent(row["share"]) for row in of if row["T_p"] in periods)] for part, of in own["tip_speed"].items()
    ]
    text = (
        "Where the tip makes less than half of the variance of the relative velocity between load and water, a limit of"
        " its speed does not protect: Hs and Tp govern there, and the limits card has no speed."
    )
    title = "Share of the crane tip in the variance of the relative velocity, at the limit, the least over headings"
    return [table, Text(text), *([Table(("part of the lift", *head[1:]), shares, title)] if shares else [])]
