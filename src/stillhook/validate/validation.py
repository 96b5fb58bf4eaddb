"""A complete validation: logs read, all steps taken, every criterion judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.base.progress import Meter, Progress
from stillhook.errors import ValidateError
from stillhook.units import quote
from stillhook.validate.ahc.check import check_ahc
from stillhook.validate.controller.check import check_controller
from stillhook.validate.criteria.judge import judge, outcome_of
from stillhook.validate.criteria.results import CriterionResult, Outcome, Step, StepNumber, lacks, step_lacks
from stillhook.validate.data_set.campaign import Campaign, load_campaign
from stillhook.validate.data_set.check import check_data
from stillhook.validate.data_set.read import read_records
from stillhook.validate.data_set.record import Record
from stillhook.validate.dynamics.check import check_dynamics
from stillhook.validate.parameters.check import check_parameters
from stillhook.validate.passive.check import check_passive
from stillhook.validate.speed_limits import check_limits

READING = 8.0
"""Part of the work, for progress, that reading the logs takes: time on the example campaign."""


@dataclass(frozen=True)
class StepType:
    """The template of a step. check: takes (campaign, records, progress) and returns its Step; weight: its part of the
    work, for progress, as of `READING`. Its title, question and measures are in `measures.toml`, its limits in the
    criteria."""

    check: Callable[[Campaign, tuple[Record, ...], Progress], Step[Any]]
    weight: float

    def take(
        self, number: StepNumber, campaign: Campaign, records: tuple[Record, ...], progress: Progress
    ) -> Step[Any]:
        """The step; without measures where none has a meaning for the winch type."""
        if reason := step_lacks(campaign.crane, number):
            return Step(number, (), (f"Step {int(number)} is not judged: {reason}.",))
        return self.check(campaign, records, progress)


STEPS: Mapping[StepNumber, StepType] = {
    StepNumber.DATA: StepType(check_data, 0.02),
    StepNumber.PARAMETERS: StepType(check_parameters, 5.0),
    StepNumber.CONTROLLER: StepType(check_controller, 5.0),
    StepNumber.LIMITS: StepType(check_limits, 1.4),
    StepNumber.DYNAMICS: StepType(check_dynamics, 21.0),
    StepNumber.AHC: StepType(check_ahc, 12.0),
    StepNumber.PASSIVE: StepType(check_passive, 0.4),
}
"""Every step, in their order."""


@dataclass(frozen=True)
class Validation:
    """Result of a validation: the records, the steps taken, and a line for each of their criteria.

    complete: all steps were taken; only then a certificate can be issued.
    """

    campaign: Campaign
    records: tuple[Record, ...]
    steps: tuple[Step[Any], ...]
    lines: tuple[CriterionResult, ...]

    @property
    def complete(self) -> bool:
        return {s.number for s in self.steps} == set(StepNumber)

    @property
    def outcome(self) -> Outcome:
        """Outcome of all lines together."""
        return outcome_of(self.lines)

    @property
    def passed(self) -> bool:
        """Whether something was shown and no line blocks."""
        return self.outcome is Outcome.PASSED

    def step(self, number: StepNumber) -> Step[Any]:
        """A step that was taken. Errors: KeyError."""
        return next(s for s in self.steps if s.number == number)


def validate(
    campaign: str | Path | Campaign, *, steps: Iterable[int] | None = None, progress: Progress | None = None
) -> Validation:
    """Take a campaign of crane tests through the verification steps and judge it by its criteria.

    Parameters
    ----------
    campaign : str, Path or Campaign
        Campaign file (see `load_campaign`) or a campaign.
    steps : iterable of int, optional
        Steps 0 to 6 (0: the data set); default all.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Validation
        Results of the steps, and the verdict.

    Raises
    ------
    StillhookError
        One line, for a campaign or log that cannot be read or is inconsistent.

    Notes
    -----
    Source: Moslatt 2020 paper F, section "Verification of the Digital Twin" and table 2.
    """
    if not isinstance(campaign, str | Path | Campaign):
        raise ValidateError(
            f"campaign = {quote(campaign)}: it must be the path of a campaign file, or a campaign from load_campaign."
        )
    todo = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    numbers = _numbers(steps)
    meter = Meter(READING + sum(STEPS[n].weight for n in numbers), progress)
    meter.tell()
    records = read_records(todo, meter.part(READING))
    taken: list[Step[Any]] = []
    for number in numbers:
        reached = meter.part(STEPS[number].weight)
        taken.append(STEPS[number].take(number, todo, records, reached))
        reached(1.0)
    measures = tuple(m for step in taken for m in step.measures)
    return Validation(todo, records, tuple(taken), judge(todo.criteria, measures, numbers, lacks(todo.crane)))


def _numbers(steps: object) -> tuple[StepNumber, ...]:
    """The requested steps in order. Errors: ValidateError for an unknown step, or an empty list."""
    choices = [int(n) for n in StepNumber]
    requested = (
        choices if steps is None else list(steps) if isinstance(steps, Iterable) and not isinstance(steps, str) else []
    )
    if not requested or any(n not in choices for n in requested):
        raise ValidateError(
            f"steps = {quote(steps)}: it must be a list of some of {', '.join(map(str, choices))}, such as [0, 2]."
        )
    return tuple(sorted({StepNumber(n) for n in requested}))
