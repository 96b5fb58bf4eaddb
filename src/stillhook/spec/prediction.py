"""Settings of the prediction of the tip's motion in a crane's PLC, in place of extrapolating it."""

from __future__ import annotations

from enum import StrEnum
from typing import Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.physics.tip_prediction import T_MOST
from stillhook.tables.table import Spec


class Predictor(StrEnum):
    """What predicts the tip's motion."""

    MODES = "modes"


class PredictionTable(Spec):
    """Prediction of the tip's motion for motion units that are late; without this table it is extrapolated."""

    kind: Predictor = Field(default=Predictor.MODES, description="oscillators that a Kalman filter follows")
    t_least: u.Time = Field(default=0.05, ge=0, le=1, description="shortest lead that is predicted, not extrapolated")
    noise_v: u.Speed = Field(default=0.003, gt=0, description="standard deviation assumed of the speed's noise")
    noise_a: u.Acceleration = Field(default=0.02, gt=0, description="that of the acceleration's noise")
    noise_w: u.Speed = Field(
        default=0.14, gt=0, description="speed that random acceleration gives each oscillator in 1 s"
    )
    period_least: u.Time = Field(default=3.0, ge=1, description="shortest period of the oscillators")
    period_most: u.Time = Field(default=24.0, le=100, description="longest period of the oscillators")

    @model_validator(mode="after")
    def _periods_increase(self) -> Self:
        if self.period_most < 2.0 * self.period_least:
            raise ValueError(
                f'period_most = "{self.period_most:g} s" is below twice period_least = "{self.period_least:g} s".'
                " Give a longer one."
            )
        return self


def refuse_longer(lead: float) -> None:
    """Errors: ValueError where a lead [s] is longer than any that is predicted."""
    if lead > T_MOST:
        raise ValueError(
            f"a lead of {lead:g} s is beyond what [control.prediction] predicts, {T_MOST:g} s. Shorten t_lead and"
            " t_lead_ff, or remove the table."
        )
