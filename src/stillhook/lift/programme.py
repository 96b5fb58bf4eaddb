"""The winch programme of a lowering: stages, each with a mode, a speed, and what ends it."""

from __future__ import annotations

from enum import StrEnum

from pydantic import Field

from stillhook import units as u
from stillhook.scenario import Record


class StageMode(StrEnum):
    """Winch modes of a lift."""

    MANUAL = "manual"
    AHC = "ahc"
    TENSION = "constant-tension"
    SPLASH = "splash"
    LANDING = "landing"


class Stage(Record):
    """One stage. Exactly one of `time`, `depth` (underside below still water, negative above), `wire`, `landed`, `tension` ends it."""

    name: str = ""
    mode: StageMode
    lower: u.Speed = Field(default=0.0, description="wire speed, lowering positive; negative hoists")
    hold: u.Force | None = Field(default=None, gt=0, description="tension that constant-tension, or landing after touch-down, holds")
    time: u.Time | None = Field(default=None, gt=0)
    depth: u.Length | None = None
    wire: u.Length | None = Field(default=None, ge=0)
    landed: bool = False
    tension: u.Force | None = Field(default=None, gt=0)
    timeout: u.Time = Field(default=3600.0, gt=0)
