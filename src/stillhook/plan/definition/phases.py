"""Phases of a lift as a planner names them: what hangs where, how the winch is driven meanwhile, and for how long."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.spec.lift.programme import StageMode
from stillhook.spec.scenario import Record


class PhaseKind(StrEnum):
    """What happens in a phase."""

    LIFT_OFF = "lift-off"
    IN_AIR = "in-air"
    SPLASH = "splash-zone"
    LOWERING = "lowering"
    DEEP = "deep"
    LANDING = "landing"
    SEABED_LIFT_OFF = "seabed-lift-off"
    SET_DOWN = "set-down"


MODES: Mapping[PhaseKind, tuple[StageMode, ...]] = MappingProxyType(
    {
        PhaseKind.LIFT_OFF: (StageMode.MANUAL,),
        PhaseKind.IN_AIR: (StageMode.MANUAL,),
        PhaseKind.SPLASH: (StageMode.MANUAL, StageMode.SPLASH),
        PhaseKind.LOWERING: (StageMode.MANUAL, StageMode.AHC),
        PhaseKind.DEEP: (StageMode.AHC, StageMode.MANUAL),
        PhaseKind.LANDING: (StageMode.LANDING, StageMode.AHC, StageMode.MANUAL),
        PhaseKind.SEABED_LIFT_OFF: (StageMode.AHC, StageMode.MANUAL),
        PhaseKind.SET_DOWN: (StageMode.MANUAL,),
    }
)
"""Winch modes that a phase may have, the usual one first."""
IN_AIR = (PhaseKind.LIFT_OFF, PhaseKind.IN_AIR, PhaseKind.SET_DOWN)
"""Phases in which the payload is wholly above the water."""


class Phase(Record):
    """One phase. Heights are those of the payload's underside above still water (negative: below); speed is a size,
    `end` tells the way.

    mode None takes the first of `MODES`. duration is what the phase is planned to take, for T_POP and for largest
    values; in motion it is the way over the speed where it is not given. tip: place of the crane tip in this phase, as
    text ("x=-15 m, y=0 m, z=36 m"), None for that of the plan. limits: rule -> limit of this phase in place of the
    rule's own, as text, or "off".
    Errors: ScenarioError, one line, for a phase that cannot be.
    """

    name: str
    kind: PhaseKind
    mode: StageMode | None = None
    start: u.Length | None = None
    end: u.Length | None = None
    speed: u.Speed | None = Field(default=None, gt=0, le=5.0)
    duration: u.Time | None = Field(default=None, gt=0)
    tip: str | None = None
    limits: Mapping[str, str] = Field(default_factory=dict)

    @property
    def winch(self) -> StageMode:
        """Mode of the winch."""
        return MODES[self.kind][0] if self.mode is None else self.mode

    @property
    def compensated(self) -> bool:
        """Whether the winch follows the tip."""
        return self.winch in (StageMode.AHC, StageMode.LANDING)

    @field_validator("mode", mode="before")
    @classmethod
    def _mode_fits(cls, mode: object, info: ValidationInfo) -> object:
        kind = info.data.get("kind")
        if mode is not None and kind is not None and mode not in MODES[kind]:
            raise ValueError(
                f"{kind} has one of {', '.join(MODES[kind])}; controllers are set by alternatives, not by mode"
            )
        return mode
