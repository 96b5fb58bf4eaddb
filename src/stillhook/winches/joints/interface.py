"""What joins hook and payload: one module with what a file gives, its equations, and what it shows of a run.

A joint module has

NAME, TITLE
    Name that lift files write (`[compensator]` with `type = "..."`), and one line that says what it is.
Unit
    The table of a lift file: a `JointUnit`, which packs itself for a run.
Link
    NamedTuple of floats, what the equations read of a unit besides the slings.
pull(x, v, z, A_up, R_up, A_down, R_down, h, sling, link)
    `physics.load_path.rope.Pull` over a step h [s] of the implicit midpoint rule: force [N] between hook and payload,
    never negative, and the speeds of both ends in its middle [m/s]. x stretch [m] and v its rate [m/s] at the start,
    upper less lower end; z height of the payload's underside above still water with nothing stretched [m]; A [kg] and
    R [kg m/s] of the bodies, which would move at R / A without it.
mean(x, v, z, rate, h, sling, link)
    The same force at the rate in the middle of the step [N], and the part of it that the sea does [N].
energy(x, sling, link)
    Energy stored at a stretch x, slings included [J]: what the audit finds missing of the work is a loss.
Signals, signals(x, rate, sling, link)
    Columns of a series, each annotated with a `base.variable.Row`, and a row of them.
Stats, blank(), fold(a, t, h, x, rate, sea, grounded, sling, link)
    Statistics of a stage, of nothing yet, and with one more step that ends at t [s]; grounded 1 once the load touched
    the seabed. SUMMED, LOWEST: fields that add up over stages, and of which the least counts; of all others the
    largest counts.
NUMBERS, numbers(stats)
    Rows of the numbers of a run and of a stage by name, and the numbers; NaN for what did not happen.
summary(unit, run)
    A run in one line, from its numbers.
LIMIT, notes(stats)
    Word in a run's status where a limit was passed, and a line for each limit that was; none: no limit.
EXTENSION
    Name among Signals of how much longer than its shortest it is [m].
STOPS
    Names among NUMBERS of times at an end of its way [s]; () where it has no ends.

All but `blank`, `numbers` and `notes` are `scalar` functions of floats and records.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import ArrayLike
from pydantic import Field, ValidationError

from stillhook.base.arrays import FloatArray
from stillhook.errors import ScenarioError
from stillhook.tables.table import Source, Spec, first_problem

NEVER = 1.0e300
"""Time of what did not happen [s], and its negative the largest of nothing."""


class LinearJoint(Protocol):
    """A joint about its place at rest, for the frequency-domain method: s extension of 0 to s_max [m], k stiffness
    [N/m], 0 where it is at an end of its way."""

    @property
    def s(self) -> float: ...

    @property
    def s_max(self) -> float: ...

    @property
    def k(self) -> float: ...

    @property
    def moves(self) -> bool: ...

    @property
    def lossy(self) -> bool: ...

    @property
    def room(self) -> float: ...

    def damping(self, sigma: ArrayLike) -> FloatArray: ...

    def share_at_end(self, sigma: ArrayLike) -> FloatArray: ...


class JointUnit(Spec):
    """A unit between hook and slings, as a file gives it. Errors: ScenarioError, one line."""

    type: str
    name: str = ""
    title: str = ""
    source: str = ""
    sources: Mapping[str, Source] = Field(default_factory=dict)

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as e:
            raise ScenarioError(first_problem(e, type(self), data, type(self).__name__).line) from None

    @property
    @abstractmethod
    def masses(self) -> tuple[float, float]:
        """Mass that hangs on the hook, and that which moves with the slings [kg]."""

    @property
    def mass(self) -> float:
        """Mass of the whole unit [kg]."""
        return sum(self.masses)

    @property
    @abstractmethod
    def shortest(self) -> float:
        """From the hook to the slings at its shortest [m]."""

    @property
    @abstractmethod
    def travel(self) -> float:
        """How much longer than its shortest it can be [m]."""

    @abstractmethod
    def extension(self, F: float, z: float, weight: float) -> float:
        """How much longer than its shortest it is at rest with F [N] on it [m]; z height of its upper part above still
        water at its shortest [m], weight that of a cubic metre of water [N/m^3]."""

    @abstractmethod
    def pack(self, stiffness: float, rho: float, height: float) -> Any:
        """The `Link` of its module over slings of a stiffness [N/m], in water of density rho [kg/m^3]; height of the
        slings' top above the payload's underside [m]. Errors: LiftError where it cannot be followed."""

    @abstractmethod
    def stretch(self, F: float, s: float, stiffness: float, link: Any) -> float:
        """Stretch x of its equations at rest [m], with F [N] on it and the extension s [m]."""

    def linear(self, s: float) -> LinearJoint | None:
        """It about the extension s [m] at rest; None where the frequency-domain method cannot take it."""
        return None


def happened(value: float) -> float:
    """A statistic as a number; NaN for what did not happen."""
    return value if abs(value) < NEVER else math.nan
