"""Settings of the guard of a crane's PLC: how far signals may be apart, and what is done where one is in doubt."""

from __future__ import annotations

from enum import StrEnum
from typing import Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.tables.table import Number, Spec


class Reaction(StrEnum):
    """What the PLC does while a signal is bad or in doubt."""

    ALARM = "alarm"
    HOLD = "hold"
    FEEDBACK_OFF = "feedback-off"
    OPEN_LOOP = "open-loop"
    MANUAL = "manual"
    STOP = "stop"


COMMON = (Reaction.ALARM, Reaction.HOLD, Reaction.MANUAL, Reaction.STOP)
ALLOWED = {
    "on_encoder": (Reaction.ALARM, Reaction.FEEDBACK_OFF, Reaction.MANUAL, Reaction.STOP),
    "on_motion": COMMON,
    "on_load": COMMON,
    "on_swivel": (*COMMON, Reaction.OPEN_LOOP),
    "on_pressure": COMMON,
}
"""Reactions that each signal can have. An encoder's last value would keep the control error, and move the wire."""


def _reaction(default: Reaction, what: str) -> Reaction:
    reaction: Reaction = Field(default=default, description=f"reaction to {what}")
    return reaction


class GuardTable(Spec):
    """Checks of what the PLC reads against one another, and reactions; without this table there are none."""

    wire: u.Length = Field(default=0.3, gt=0, description="wire by which encoder and motor speed may be apart")
    position: u.Length = Field(
        default=0.3, gt=0, description="by which the tip's position and the integral of its speed may be apart"
    )
    speed: u.Speed = Field(
        default=0.3, gt=0, description="by which the tip's speed and the integral of its acceleration may be apart"
    )
    load: Number = Field(
        default=0.25, gt=0, description="by which load cell and motors may be apart, over the safe working load"
    )
    swivel: Number = Field(default=0.25, gt=0, le=1, description="by which a displacement and its command may be apart")
    t_memory: u.Time = Field(default=10.0, gt=0, description="time constant with which wire and motion are forgotten")
    t_load: u.Time = Field(default=3.0, gt=0, description="time constant of the comparison of loads")
    t_confirm: u.Time = Field(
        default=0.03, ge=0, lt=0.05, description="time for which a check must fail; below the 0.05 s of the guard"
    )
    t_clear: u.Time = Field(default=30.0, ge=0, description="time for which it must hold before a signal is used again")
    t_freeze: u.Time = Field(
        default=1.0, gt=0, description="time for which a signal may be unchanged while the wire runs"
    )
    on_encoder: Reaction = _reaction(Reaction.FEEDBACK_OFF, "a bad encoder")
    on_motion: Reaction = _reaction(Reaction.MANUAL, "a bad motion unit")
    on_load: Reaction = _reaction(Reaction.HOLD, "a bad load cell")
    on_swivel: Reaction = _reaction(Reaction.OPEN_LOOP, "a bad displacement of the motors")
    on_pressure: Reaction = _reaction(Reaction.HOLD, "a bad pressure")

    @model_validator(mode="after")
    def _reactions_fit(self) -> Self:
        for name, allowed in ALLOWED.items():
            if (reaction := getattr(self, name)) not in allowed:
                raise ValueError(f'{name} = "{reaction}" is not one of {", ".join(allowed)}. Choose one of them.')
        return self
