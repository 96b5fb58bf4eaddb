"""Figures of what a report is made of: one of a plan, of a validation, of an identification, by the name that its file
has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from stillhook.errors import StillhookError
from stillhook.identify.motor.figures import figures as motor_figures
from stillhook.identify.system_friction.report import figures as friction_figures
from stillhook.plan.report.figures import figures as plan_figures
from stillhook.units import quote
from stillhook.validate.report.figures import figures as validation_figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.identify.motor.identify import MotorLoss
    from stillhook.identify.system_friction.identify import Friction
    from stillhook.plan.result import PlanResult
    from stillhook.validate.validation import Validation


def plan(result: PlanResult, name: str | None = None) -> Figure:
    """A figure of a lift plan.

    Parameters
    ----------
    result : PlanResult
        From `stillhook.plan.plan` or `load_plan_result`.
    name : str, optional
        "limits-over-period" (default), "limits-credited", "limits-twin", "waiting-by-month", "depth", "efficiency",
        "landing" or "convergence", where the plan has it.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, for a figure that the plan does not have.
    """
    return _chosen("plan", plan_figures(result), name)


def validation(result: Validation, name: str | None = None) -> Figure:
    """A figure of a validation.

    Parameters
    ----------
    result : Validation
        From `stillhook.validate.validate`.
    name : str, optional
        Such as "step-0-tests"; a wrong name lists them. Default the first.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, for a figure that the validation does not have.
    """
    return _chosen("validation", validation_figures(result), name)


def friction(result: Friction, name: str | None = None) -> Figure:
    """A figure of identified system friction.

    Parameters
    ----------
    result : Friction
        From `stillhook.identify.friction`.
    name : str, optional
        "friction-pressure" (default), "friction-torque", "system-friction", "model-against-measured" or "error", and
        where there are such "second-loop-motor", "second-loop-system" and "model-and-map".

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, for a figure that the result does not have.
    """
    return _chosen("friction", friction_figures(result), name)


def motor(result: MotorLoss, name: str | None = None) -> Figure:
    """A figure of an identified motor loss.

    Parameters
    ----------
    result : MotorLoss
        From `stillhook.identify.identify_motor`.
    name : str, optional
        "ranking" (default), "terms", "terms-over-speed" and others; a wrong name lists them.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, for a figure that the result does not have.
    """
    return _chosen("motor", motor_figures(result), name)


def _chosen(what: str, figures: Mapping[str, Figure], name: str | None) -> Figure:
    """The figure of this name, else the first. Errors: StillhookError."""
    if not figures:
        raise StillhookError(f"plot.{what}: the result has no figures: no step of it could be taken.")
    if name is not None and name not in figures:
        raise StillhookError(f"plot.{what}: name = {quote(name)}: choose one of {', '.join(figures)}.")
    return figures[next(iter(figures)) if name is None else name]
