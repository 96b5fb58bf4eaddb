"""The deck of another vessel, or of a platform, that a payload in air is lifted from or set down on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, field_validator

from stillhook import units as u
from stillhook.physics.load_path.deck import damping_ratio
from stillhook.sea.motion.motion import CYCLE, Motion, Sample, Still
from stillhook.sea.motion.words import parse_motion
from stillhook.sea.vessel.motion_unit import RATE, noise
from stillhook.spec.scenario import Number, Record
from stillhook.units import show

MOST_SLACK = 20.0
"""Longest slack of the wire as a payload starts on a deck [m]."""
STREAM = 1
"""What keeps the noise of a deck apart from others of the same seed."""


class Deck(Record):
    """A deck that moves up and down under a payload in air, and pushes it through a spring and a damper.

    `motion` is about `height` and grows over the ramp of the lift, as that of the tip. With `slack` the payload starts
    on the deck, the wire that much longer than taut; without it hangs above. `followed`: the PLC's motion reference is
    the tip less the deck, of which a second motion unit gives the motion, late by `delay`, with white noise. Raises
    ScenarioError, one line.
    """

    height: u.Length = Field(gt=0, description="of the deck at rest above still water")
    motion: Motion = Field(default_factory=Still, description="of the deck about that height")
    settlement: u.Length = Field(
        default=5e-3, gt=0, le=0.5, description="of deck and dunnage under the payload's weight (assumed)"
    )
    restitution: Number = Field(
        default=0.3, ge=0.05, le=1, description="speed after over speed before a hit (assumed: timber dunnage)"
    )
    slack: u.Length | None = Field(
        default=None,
        ge=0,
        le=MOST_SLACK,
        description="of the wire as the payload starts on the deck; default: it hangs",
    )
    followed: Annotated[bool, Field(strict=True)] = False
    delay: u.Time = Field(default=0.0, ge=0, le=2, description="of the deck's motion unit")
    noise_s: u.Length = Field(default=0.0, ge=0, description="standard deviation of its position signal")
    noise_v: u.Speed = Field(default=0.0, ge=0, description="standard deviation of its speed signal")

    @field_validator("motion", mode="before")
    @classmethod
    def _from_text(cls, value: object) -> object:
        return parse_motion(value, "motion") if isinstance(value, str) else value

    def spring(self, weight: float, mass: float) -> tuple[float, float]:
        """k [N/m] and c [N s/m] under a payload of a weight [N] and mass [kg]."""
        k = weight / self.settlement
        return k, 2.0 * damping_ratio(self.restitution) * math.sqrt(k * mass)

    def describe(self) -> str:
        """The deck in words."""
        reference = ", followed by the winch" if self.followed else ""
        return f"deck {show(self.height, 'length')} above still water, {self.motion.describe()}{reference}"


@dataclass(frozen=True)
class TipOverDeck(Motion):
    """The crane tip, of which the PLC measures its height over a deck."""

    tip: Motion
    deck: Motion
    delay: float
    noise_s: float
    noise_v: float
    seed: int
    kind: ClassVar[str] = "tip over deck"

    @property
    def duration(self) -> float | None:
        return min((d for m in (self.tip, self.deck) if (d := m.duration) is not None), default=None)

    @property
    def separate(self) -> bool:
        return True

    def sample(self, t: ArrayLike) -> Sample:
        return self.tip.sample(t)

    def measured(self, t: ArrayLike, h: float = CYCLE) -> Sample:
        time = np.asarray(t, dtype=np.float64)
        tip, deck = self.tip.measured(time, h), self.deck.sample(np.maximum(time - self.delay, 0.0))
        s, v, a = (x - y for x, y in zip(tip, deck, strict=True))
        if self.noise_s or self.noise_v:
            n = noise((self.seed, STREAM), 2, np.floor(np.maximum(time, 0.0) * RATE + 1e-6).astype(np.intp))
            s, v = s - self.noise_s * n[0], v - self.noise_v * n[1]
        return s, v, a

    def describe(self) -> str:
        return f"{self.tip.describe()}, measured over the deck: {self.deck.describe()}"

    def to_dict(self) -> dict[str, Any]:
        raise NotImplementedError  # made for a run from tip and deck, which are stored


def reference_of(tip: Motion, deck: Deck | None, seed: int) -> Motion:
    """The tip's motion, as the PLC measures it with a deck below or without one; seed of noise."""
    if deck is None or not deck.followed:
        return tip
    return TipOverDeck(tip, deck.motion, deck.delay, deck.noise_s, deck.noise_v, seed)
