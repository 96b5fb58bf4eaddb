"""What of the crane a measure rests on: declared with the measure, compared with the circuits of the crane and the
signals of its winch type."""

from __future__ import annotations

from stillhook.spec.crane import Crane
from stillhook.validate.criteria.results import MEASURES, StepNumber

WORDS = {"active": "closed circuit", "passive": "passive circuit", "omega_m": "motors on its drum (signal omega_m)"}
"""What a measure needs in words; what is not a circuit is a signal."""


def has(crane: Crane) -> frozenset[str]:
    """Circuits of the crane, and own signals of its winch type."""
    return frozenset(crane.circuits) | {row.name for row in crane.plant.type.rows}


def lacks(crane: Crane) -> dict[str, str]:
    """Measures that have no meaning for the crane, each with the reason."""
    there, out = has(crane), {}
    for name, measure in MEASURES.items():
        missing = [WORDS.get(need, f"signal {need}") for need in measure.needs if need not in there]
        if missing:
            out[name] = f'winch type "{crane.plant.value}" has no {" and no ".join(missing)}'
    return out


def step_lacks(crane: Crane, step: StepNumber) -> str:
    """Reason why no measure of a step has a meaning for the crane; "" where one does."""
    reasons = lacks(crane)
    of_step = [name for name, measure in MEASURES.items() if measure.step is step]
    return reasons[of_step[0]] if all(name in reasons for name in of_step) else ""


def usual_criteria(crane: Crane) -> str:
    """Criteria where a campaign names none: those of paper F for its closed circuit, and for every other drive those of
    them that have a meaning, with its own signals in place of the circuit's."""
    return "paper-f" if "active" in crane.circuits else "any-drive"
