"""Inputs and results of the search for steady stretches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stillhook import units as u
from stillhook.errors import IdentifyError, UnitError
from stillhook.tables.problem import first_problem

Rest = Annotated[float, Field(strict=True, ge=0, lt=1)]
Share = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=True)]


class WindowSettings(BaseModel):
    """Engineering limits of a steady stretch. Times are text with a unit; shares are plain numbers. Errors:
    IdentifyError.

    A trend is held against a stretch only where it is larger than its tolerance *and* larger than the noise explains;
    the defaults are therefore limits of what matters for friction, not of what a certain log's noise allows to be seen.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    least_length: u.Time = Field(
        default=2.0, gt=0, description="shortest stretch: two periods of a load that swings on its wire at 1 Hz"
    )
    least_samples: int = Field(
        default=3, ge=3, description="fewest bins: below three drift cannot be distinguished from noise"
    )
    guard: u.Time = Field(
        default=0.3, ge=0, description="left out before the end of a step, and next to holes: three PLC bins of 0.1 s"
    )
    smoothing: u.Time = Field(
        default=0.5, gt=0, description="half width over which speed is averaged to distinguish a step from a ramp"
    )
    bridge: u.Time = Field(
        default=1.5, ge=0, description="longest disturbance of speed inside one step: one period of 0.7 Hz"
    )
    largest_hole: u.Time = Field(
        default=0.5, gt=0, description="longest stretch of missing or doubtful bins inside a step"
    )
    spare: Rest = Field(
        default=1.0 / 3.0,
        description=(
            "part of a stretch without visible drift that is left out at its start: a decay hides in noise before it"
            " has ended, with the same sign in every step, and the means of hundreds of steps would show it"
        ),
    )
    speed_rate: Share = Field(
        default=0.03, description="change of speed per second, over speed, above which the winch is ramping"
    )
    speed_drift: Share = Field(
        default=0.01, description="drift of speed within a stretch, over its speed; friction changes by far less"
    )
    effort_drift: Share = Field(
        default=0.005, description="drift of effort, over its high value: 1 bar in 200; inf: speed alone decides"
    )
    held_drift: Share = Field(
        default=0.01, description="drift of a held signal (displacement), over its value: 2 cm^3/rev in 215"
    )
    command_step: Share = Field(
        default=0.005, description="change of command that begins a new step, over its largest value"
    )
    effort_jump: Share = Field(
        default=0.01, description="sudden step of effort at steady speed (wire layer), over the log's high effort"
    )
    oscillation: Share = Field(default=0.1, description="amplitude of one frequency, over speed or high effort")
    doubtful: Share = Field(default=0.1, description="largest share of missing or doubtful bins in a stretch")
    standstill: Share = Field(default=0.2, description="largest share of a stretch at rest: more is stick-slip")
    least_speed: str | None = Field(
        default=None, description="slowest speed that is used, such as 20 rev/min; none: what noise allows"
    )
    resolution: Mapping[str, float] = Field(
        default_factory=dict, description="step of a signal's converter [SI], where it is known"
    )

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as e:
            raise IdentifyError(first_problem(e, type(self), data, type(self).__name__).line) from None

    def for_effort_of_place(self) -> Self:
        """The same, but for an effort that changes along the way: it may drift and jump, so speed alone decides."""
        return self.model_copy(update={"effort_drift": float("inf"), "effort_jump": float("inf")})

    def slowest(self) -> float:
        """``least_speed`` in SI, a rotation or a travel; 0 where none is given. Errors: IdentifyError."""
        if self.least_speed is None:
            return 0.0
        for kind in ("rotation", "speed"):
            try:
                return u.parse(self.least_speed, kind)
            except UnitError:
                continue
        raise IdentifyError(
            f'WindowSettings: least_speed = {u.quote(self.least_speed)}: write a speed such as "20 rev/min" or "2'
            ' m/min".'
        )


@dataclass(frozen=True)
class Window:
    """A steady stretch that is used.

    ``start``, ``end`` [s] of the log; ``direction`` +1 hoisting (speed > 0), -1 lowering; ``speed``, ``effort`` means
    with their signs [SI]; ``u_speed``, ``u_effort`` standard uncertainties of the means: 1.96 of them hold 95 %,
    whatever the noise's correlation and however few samples there were; ``n`` bins; ``others`` means of the log's other
    signals.
    """

    start: float
    end: float
    direction: int
    speed: float
    u_speed: float
    effort: float
    u_effort: float
    n: int
    others: Mapping[str, float] = field(default_factory=dict)

    @property
    def middle(self) -> float:
        return 0.5 * (self.start + self.end)


@dataclass(frozen=True)
class Rejected:
    """A stretch that is not used, and why: ``code`` for programs, ``reason`` with its numbers for people."""

    start: float
    end: float
    direction: int
    speed: float
    effort: float
    reason: str
    code: str


@dataclass(frozen=True)
class Steady:
    """Result of ``steady_windows``.

    ``windows`` used, by time; ``rejected`` whole steps (or stretches as long as one) that gave no window; ``trimmed``
    beginnings of used steps that were left out; ``time`` seconds of the log by what became of them, adding up to its
    length.
    """

    windows: tuple[Window, ...]
    rejected: tuple[Rejected, ...]
    trimmed: tuple[Rejected, ...] = ()
    time: Mapping[str, float] = field(default_factory=dict)
