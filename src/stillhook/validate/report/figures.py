"""The figures of all steps under one set of names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from stillhook.report.pictures import pngs
from stillhook.validate.ahc import figures as ahc_figures
from stillhook.validate.controller import figures as controller_figures
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.data_set import figures as data_set_figures
from stillhook.validate.dynamics import figures as dynamics_figures
from stillhook.validate.parameters import figures as parameters_figures
from stillhook.validate.passive import figures as passive_figures
from stillhook.validate.speed_limits import figures as limits_figures
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
    StepNumber.PASSIVE: passive_figures.figures,
}
"""Each takes (step, campaign, records) and returns its figures by stem."""


RESOLUTION = 150
"""Of pictures [dots per inch]: as wide as a page of the certificate, most have 220 on paper."""


def pictures(validation: Validation) -> dict[str, bytes]:
    """Every figure as PNG, by file stem: the same bytes whatever the settings of matplotlib here."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return pngs(figures(validation), RESOLUTION)


def figures(validation: Validation) -> dict[str, Figure]:
    """Every figure of a validation by file stem, "step-5-..."."""
    result: dict[str, Figure] = {}
    for step in validation.steps:
        if step.number in FIGURES:
            figures_of_step = FIGURES[step.number](step, validation.campaign, validation.records)
            result |= {f"step-{int(step.number)}-{stem}": figure for stem, figure in figures_of_step.items()}
    return result
