"""Which limits hold in a phase under an alternative, and what they are there."""

from __future__ import annotations

from stillhook.plan.definition.capacities import CAPACITIES, CapacityValue
from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import Limited, Rule
from stillhook.plan.definition.rules_file import rules_of

FOLLOWS = ("s_tip_pp", "e_c_pp", "stroke_share")
"""Quantities that are judged only while the winch follows the tip."""
OF_TWIN = ("saturation_share", "relief_share", "power_share", "p_a_max", "stroke_share", "s_tip_pp")
"""Quantities of the hydraulics, which a flat cap does not have."""
NUMBERS = {
    "relief_share": "relief_time",
    "power_share": "power_time",
    "stroke_share": "stroke_time",
    "p_a_max": "p_a_max",
}
"""Quantities that only some winch types have, and the number of their runs."""
OF_WINCH = (*OF_TWIN, "v_w_demand", "e_c_pp")
"""Quantities of a winch that turns: one on its brake has none."""


def limited(plan: LiftPlan, phase: Phase, alternative: Alternative) -> tuple[Limited, ...]:
    """The rules of a phase with their limits in SI, in the order of the rule set.

    Left out are: rules that the phase turns off; in compensated phases those of the winch for none (it stands on its
    brake), and those of the hydraulics for the flat cap (it has none); outside of compensation those of compensation;
    quantities and capacities that the winch type does not have, such as an accumulator's on a pure active winch.
    Errors: PlanError, UnitError as `stillhook.plan.definition.rules_file.rules_of`.
    """
    own = {row.name for row in plan.crane.plant.type.numbers}
    held = [
        (rule, _limit(plan, phase, alternative, rule))
        for rule in rules_of(plan.rules, phase)
        if (rule.quantity not in NUMBERS or NUMBERS[rule.quantity] in own) and _holds(rule, phase, alternative)
    ]
    return tuple(Limited(rule, capacity.value, capacity.basis) for rule, capacity in held if capacity is not None)


def _holds(rule: Rule, phase: Phase, alternative: Alternative) -> bool:
    if not phase.compensated:
        return rule.quantity not in FOLLOWS
    if alternative is Alternative.NONE:
        return rule.quantity not in OF_WINCH
    return alternative.twin or rule.quantity not in OF_TWIN


def _limit(plan: LiftPlan, phase: Phase, alternative: Alternative, rule: Rule) -> CapacityValue | None:
    if not isinstance(rule.limit, str):
        return CapacityValue(rule.limit, rule.requirement)
    capacity = CAPACITIES[rule.limit].find(plan, phase, alternative)
    if capacity is None or rule.factor == 1.0:
        return capacity
    return CapacityValue(rule.factor * capacity.value, f"{rule.factor:g} x {capacity.basis}")
