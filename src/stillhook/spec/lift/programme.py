"""The winch programme of a lowering: stages, each with a mode, a speed, and what ends it; and how the winch modes are
set."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.spec.scenario import Number, Record


class StageMode(StrEnum):
    """Winch modes of a lift; docs/explanation/winch-modes.md tells what each does, waits for and ends with."""

    MANUAL = "manual"
    AHC = "ahc"
    TENSION = "constant-tension"
    SPLASH = "splash"
    LANDING = "landing"


ENDS = ("time", "depth", "wire", "landed", "tension")
"""What may end a stage: exactly one of these fields."""


class Stage(Record):
    """One stage. Exactly one of `time`, `depth` (underside below still water, negative above), `wire`, `landed`,
    `tension` ends it.

    `time` counts from the stage's entry, in landing mode from touch-down. `depth` becomes wire out by the static
    stretch of the wire, as a planner would reckon it. `wire` and `tension` count in the direction in which the stage
    moves them. `hold` and `tension` are those at the hook, as the load indicator gives them: without the weight of the
    wire that hangs. Raises ScenarioError, one line, for a stage that could not do what it says.
    """

    name: str = ""
    mode: StageMode
    lower: u.Speed = Field(default=0.0, ge=-10.0, le=10.0, description="wire speed, lowering positive; negative hoists")
    hold: u.Force | None = Field(
        default=None, gt=0, description="tension that constant-tension, or landing after touch-down, holds"
    )
    time: u.Time | None = Field(default=None, gt=0)
    depth: u.Length | None = None
    wire: u.Length | None = Field(default=None, ge=0)
    landed: bool = False
    tension: u.Force | None = Field(default=None, gt=0)
    timeout: u.Time | None = Field(
        default=None, gt=0, description="after which the programme is stuck; an hour longer than it should take"
    )

    @property
    def end(self) -> str:
        """Which field ends the stage."""
        return next(name for name in ENDS if getattr(self, name) not in (None, False))

    @property
    def holds(self) -> bool:
        """Whether the mode holds a tension."""
        return self.mode in (StageMode.TENSION, StageMode.LANDING)

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        ends = [name for name in ENDS if getattr(self, name) not in (None, False)]
        if len(ends) != 1:
            raise ValueError(
                f"{self._called()}: {' and '.join(ends) or 'nothing'} ends it. Give one of {', '.join(ENDS)}, "
                'such as depth = "20 m" or landed = true.'
            )
        return self

    @model_validator(mode="after")
    def _tension_fits(self) -> Self:
        if self.holds and self.hold is None:
            raise ValueError(
                f'{self._called()}: hold is missing, the tension that {self.mode} keeps. Give it, such as "300 kN".'
            )
        if not self.holds and self.hold is not None:
            raise ValueError(
                f"{self._called()}: hold belongs to constant-tension and landing, and this is {self.mode}. Leave it"
                " out."
            )
        return self

    @model_validator(mode="after")
    def _moves(self) -> Self:
        """The stage's speed can bring about what ends it."""
        if self.mode is StageMode.TENSION and self.lower != 0.0:
            raise ValueError(
                f"{self._called()}: lower is given, and constant-tension moves the wire by itself. Leave lower out."
            )
        if self.mode is StageMode.LANDING and self.lower <= 0.0:
            raise ValueError(
                f'{self._called()}: a load is landed by lowering it. Give lower above 0, such as "6 m/min".'
            )
        if self.landed and (self.lower <= 0.0 or self.mode is StageMode.TENSION):
            raise ValueError(
                f"{self._called()}: landed = true needs a stage that lowers. Give lower above 0, in another mode."
            )
        stands = self.lower == 0.0 and not self.holds
        if stands and self.end != "time":
            raise ValueError(f"{self._called()}: lower is 0, so {self.end} never comes. Give lower, or end it by time.")
        if self.time is not None and self.timeout is not None and self.timeout < self.time:
            raise ValueError(
                f"{self._called()}: timeout {self.timeout:g} s comes before its time {self.time:g} s. Give a longer"
                " one, or none."
            )
        return self

    def _called(self) -> str:
        return f"stage {u.quote(self.name)} ({self.mode})" if self.name else f"a stage in mode {self.mode}"


class WinchSettings(Record):
    """How the winch modes are set. None of it is published; every default is assumed, for the reason beside it."""

    ramp: u.Acceleration = Field(default=0.1, gt=0, description="ramp of the joystick: half a metre per second in 5 s")
    v_max: u.Speed = Field(
        default=0.5, gt=0, description="highest speed that tension control adds; under half of what a 250 t winch does"
    )
    v_enter: u.Speed = Field(
        default=0.1, gt=0, description="tip speed below which compensation starts: near crest or trough, without a bump"
    )
    omega_T: u.Frequency = Field(
        default=0.5,
        gt=0,
        le=2.0,
        description="bandwidth of tension control on a load that stands; a quarter of K_p v_max at marginal stability",
    )
    v_soft: u.Speed = Field(
        default=2.0,
        ge=0,
        le=5.0,
        description="speed of splash mode per deviation of the tension by (m + A33) g; calm up to 3 m/s",
    )
    omega_soft: u.Frequency = Field(
        default=5.0,
        gt=0,
        description="splash mode takes no load for lighter than what the wire swings at this: the winch lags beyond",
    )
    omega_s: u.Frequency = Field(
        default=0.1,
        ge=0,
        le=1.0,
        description="return of splash and manual mode to the joystick's path, in a minute: below all waves",
    )
    tau_slow: u.Time = Field(
        default=20.0, gt=0, description="time constant of the mean tension: longer than any wave period"
    )
    tau_suspended: u.Time = Field(
        default=200.0, gt=0, description="mean tension that a landing is seen against: a slow one takes minutes"
    )
    landed: Number = Field(
        default=0.5,
        gt=0,
        lt=1,
        description="touch-down is a fall of the tension by this part of the payload's weight in water",
    )
    F_least: u.Force | None = Field(
        default=None, ge=0, description="tension that compensation needs; default half of the empty hook's weight"
    )


def stage_names(programme: Sequence[Stage]) -> tuple[str, ...]:
    """A name for each stage, no two alike: its own, or its number and mode."""
    names = [s.name or f"{i} {s.mode}" for i, s in enumerate(programme, 1)]
    return tuple(f"{n} ({i})" if names.count(n) > 1 else n for i, n in enumerate(names, 1))
