"""The figures of all steps under one set of names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.report.pictures import pngs
from stillhook.validate.validation import STEPS, Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESOLUTION = 150
"""Of pictures [dots per inch]: as wide as a page of the certificate, most have 220 on paper."""


def pictures(validation: Validation) -> dict[str, bytes]:
    """Every figure as PNG, by file stem: the same bytes whatever the settings of matplotlib here."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        return pngs(figures(validation), RESOLUTION)


def figures(validation: Validation) -> dict[str, Figure]:
    """Every figure of a validation by file stem, "step-5-..."; none of a step that could not be taken."""
    return {
        f"step-{int(step.number)}-{name}": figure
        for step in validation.steps
        if step.estimates is not None
        for name, figure in STEPS[step.number].figures(step.estimates, validation.campaign, validation.records).items()
    }
