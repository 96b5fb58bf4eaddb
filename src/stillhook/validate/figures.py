"""The figures of all steps under one set of names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from stillhook.validate import ahc_figures, controller_figures, data_set_figures, dynamics_figures, limits_figures, parameters_figures
from stillhook.validate.lines import StepNumber
from stillhook.validate.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: Mapping[StepNumber, Callable[..., dict[str, Any]]] = {
    StepNumber.DATA: data_set_figures.figures,
    StepNumber.PARAMETERS: parameters_figures.figures,
    StepNumber.CONTROLLER: controller_figures.figures,
    StepNumber.LIMITS: limits_figures.figures,
    StepNumber.DYNAMICS: dynamics_figures.figures,
    StepNumber.AHC: ahc_figures.figures,
}
"""Each takes (step, campaign, records) and returns its figures by stem."""


def figures(validation: Validation) -> dict[str, Figure]:
    """Every figure of a validation by file stem, "step-5-..."."""
    found: dict[str, Figure] = {}
    for step in validation.steps:
        if step.number in FIGURES:
            drawn = FIGURES[step.number](step, validation.campaign, validation.records)
            found |= {f"step-{int(step.number)}-{stem}": figure for stem, figure in drawn.items()}
    return found
