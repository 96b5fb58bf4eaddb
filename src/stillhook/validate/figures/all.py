"""The figures of all steps under one set of names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from stillhook.report.kit import pngs
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.figures import laws, over_time
from stillhook.validate.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESOLUTION = 150
"""Of pictures [dots per inch]: as wide as a page of the certificate, most have 220 on paper."""

FIGURES: Mapping[StepNumber, tuple[Callable[..., dict[str, Any]], ...]] = {
    StepNumber.PARAMETERS: (laws.balances,),
    StepNumber.CONTROLLER: (over_time.commands, laws.motor_law),
    StepNumber.LIMITS: (over_time.at_limits,),
    StepNumber.DYNAMICS: (over_time.turns,),
    StepNumber.AHC: (over_time.compensation, laws.errors),
    StepNumber.PASSIVE: (laws.gas_curve,),
}
"""What is drawn of the estimates of a step and the campaign; of step 0 its records."""


def pictures(validation: Validation) -> dict[str, bytes]:
    """Every figure as PNG, by file stem: the same bytes whatever the settings of matplotlib here."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return pngs(figures(validation), RESOLUTION)


def figures(validation: Validation) -> dict[str, Figure]:
    """Every figure of a validation by file stem, "step-5-..."; none of a step that could not be taken."""
    out: dict[str, Figure] = {}
    for step in validation.steps:
        if step.estimates is None:
            continue
        drawn = [draw(step.estimates, validation.campaign) for draw in FIGURES.get(step.number, ())]
        drawn += [over_time.tests(validation.records, validation.campaign)] if step.number is StepNumber.DATA else []
        out |= {f"step-{int(step.number)}-{name}": figure for each in drawn for name, figure in each.items()}
    return out
