"""What is below a winch. `LoadPath` is the contract of one element alone, which a winch names as its PATH and moves
with its own state; `Joint` is that of a unit between hook and payload in a lowering: one module with what a file gives,
its equations, and what it shows of a run. A type checker checks a module against them: `joint: Joint = my_joint`;
`stillhook.winches.load_path.registry` does when it is loaded.

Functions with `@scalar` are compiled: SI, floats and records in, floats and records out. They must not keep anything
between calls, or branch with work on one side only: sixteen runs go side by side.

Letters of a load path: q its point and y its state, geo drum during a PLC cycle, p parameters, tick what comes from
outside in a cycle, tip motion of the crane tip.
Letters of a unit: x stretch of all that joins hook and payload, upper less lower end [m], v its rate at the start of a
step and rate that in its middle [m/s], h the step [s]; A [kg] and R [kg m/s] of the two bodies, which would move at
R / A without it; sling `physics.load_path.rope.Sling`, link the module's own record.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import ArrayLike
from pydantic import Field, ValidationError

from stillhook.base.arrays import FloatArray
from stillhook.base.contract import Needed, Record
from stillhook.base.variable import Row
from stillhook.errors import ScenarioError
from stillhook.physics.load_path.payload import Heights, Water
from stillhook.physics.load_path.rope import Pull, Sling
from stillhook.physics.scalar import scalar
from stillhook.tables.table import Source, Spec, refused_by
from stillhook.winches.load_path.lift import Works
from stillhook.winches.records import Geometry, Motion, Tick, Tip

NEVER = 1.0e300
"""Time of what did not happen [s], and its negative the largest of nothing."""


class LoadPath(Protocol):
    """What is below a winch, a module: it takes the speed of the wire at the top and gives the tension there."""

    @property
    def State(self) -> type[tuple[Any, ...]]:
        """Its state: s_w wire paid out [m], s_load height of the load [m], v_load its speed [m/s], and more."""

    @property
    def Point(self) -> type[tuple[Any, ...]]:
        """The path at an instant: v_w wire speed [m/s], F_w tension at the top [N], a_load of the load, and more."""

    @property
    def Powers(self) -> type[tuple[Any, ...]]:
        """Its powers [W], each annotated with a Row; they must not include what passes between winch and path."""

    @property
    def SUPPLIED(self) -> tuple[str, ...]:
        """Powers that go in; the others go out."""

    @scalar
    def motion(self, tick: Tick) -> Motion:
        """True motion of the crane tip."""

    @scalar
    def weight(self, tick: Tick, p: Any) -> float:
        """Tension while all stands still [N]."""

    @scalar
    def start(self, s_w: float, tick: Tick, p: Any) -> Any:
        """State at rest with s_w of wire out [m]."""

    @scalar
    def at(self, v_w: float, y: Any, geo: Geometry, tip: Tip, p: Any) -> Any:
        """The Point at wire speed v_w [m/s]."""

    @scalar
    def rates(self, q: Any, y: Any, p: Any) -> Any:
        """Time derivatives of the state."""

    @scalar
    def powers(self, q: Any, y: Any, tip: Tip, p: Any) -> Any:
        """Its Powers [W]."""

    @scalar
    def energy(self, q: Any, y: Any, p: Any) -> float:
        """Energy stored in it [J]."""

    @scalar
    def at_its_end(self, y: Any, p: Any) -> float:
        """1 where the last turns of wire leave the drum, or the hook is at the tip, else 0."""


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
            raise refused_by(e, type(self), data, type(self).__name__, ScenarioError) from None

    @property
    @abstractmethod
    def masses(self) -> tuple[float, float]:
        """Mass that hangs from the hook, and that which moves with the slings [kg]."""

    @property
    def mass(self) -> float:
        """Mass of the whole unit, with that of a body of its own [kg]."""
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

    def buoyancy(self, z: float, rho: float) -> float:
        """Weight of the water that it displaces at rest [N]; z height of the slings' top above still water [m], rho
        density of water [kg/m^3]."""
        return 0.0

    @abstractmethod
    def pack(self, stiffness: float, rho: float, height: float) -> Any:
        """The `Link` of its module over slings of a stiffness [N/m], in water of density rho [kg/m^3]; height of the
        slings' top above the payload's underside [m]. Errors: LiftError where it cannot be followed."""

    @abstractmethod
    def stretch(self, F: float, s: float, stiffness: float, link: Any) -> float:
        """Stretch x of its equations at rest [m], with F [N] on it and the extension s [m]."""

    def at_rest(self, F: float, s: float, z: float, stiffness: float, link: Any) -> tuple[float, Any]:
        """Stretch at rest as `stretch` gives it, and the Link with which a run begins; z height of the slings' top
        above still water [m]."""
        return self.stretch(F, s, stiffness, link), link

    def linear(self, s: float) -> LinearJoint | None:
        """It about the extension s [m] at rest; None where the frequency-domain method cannot take it."""
        return None


def happened(value: float) -> float:
    """A statistic as a number; NaN for what did not happen."""
    return value if abs(value) < NEVER else math.nan


class Joint(Protocol):
    """A module of a unit between hook and slings."""

    @property
    def NAME(self) -> str:
        """Name that lift files write: `[compensator]` with `type = "..."`."""

    @property
    def TITLE(self) -> str:
        """One line that says what it is."""

    @property
    def Unit(self) -> type[JointUnit]:
        """The table of a lift file, a `JointUnit`, which packs itself for a run."""

    @property
    def Link(self) -> type[tuple[Any, ...]]:
        """Record that its equations read of a unit, besides the slings."""

    @property
    def Signals(self) -> type[tuple[Any, ...]]:
        """Columns of a series, each annotated with a Row."""

    @property
    def Stats(self) -> type[tuple[Any, ...]]:
        """Statistics of a stage, from every step."""

    @property
    def SUMMED(self) -> tuple[str, ...]:
        """Fields of Stats that add up over stages; of LOWEST the least counts, of all others the largest."""

    @property
    def LOWEST(self) -> tuple[str, ...]:
        """Fields of Stats of which the least counts over stages."""

    @property
    def NUMBERS(self) -> Mapping[str, Row]:
        """Rows of the numbers of a run and of a stage, by name."""

    @property
    def EXTENSION(self) -> str:
        """Name among Signals of how much longer than its shortest it is [m]."""

    @property
    def STOPS(self) -> tuple[str, ...]:
        """Names among NUMBERS of times at an end of its way [s]; () where it has no ends."""

    @property
    def LIMIT(self) -> str:
        """Word in a run's status where `notes` says that a limit was passed."""

    @scalar
    def pull(
        self,
        x: float,
        v: float,
        z: float,
        A_up: float,
        R_up: float,
        A_down: float,
        R_down: float,
        h: float,
        sling: Sling,
        link: Any,
    ) -> Pull:
        """Force over a step of the implicit midpoint rule, never negative, and the speeds of both ends in its middle.

        z height of the payload's underside above still water with nothing stretched [m].
        """

    @scalar
    def mean(self, x: float, v: float, z: float, rate: float, h: float, sling: Sling, link: Any) -> tuple[float, float]:
        """The same force at the rate in the middle of the step [N], and the part of it that the sea does [N]."""

    @scalar
    def energy(self, x: float, sling: Sling, link: Any) -> float:
        """Energy stored at a stretch, slings included [J]: what the audit finds missing of the work is a loss."""

    @scalar
    def signals(self, x: float, rate: float, sling: Sling, link: Any) -> Any:
        """A row of Signals."""

    @scalar
    def fold(
        self, a: Any, t: float, h: float, x: float, rate: float, sea: float, grounded: float, sling: Sling, link: Any
    ) -> Any:
        """Stats with one more step that ends at t [s], x there; sea its part of the force [N]; grounded 1 once the load
        touched the seabed."""

    def blank(self) -> Any:
        """Stats of nothing yet."""

    def numbers(self, stats: Any) -> dict[str, float]:
        """The numbers of NUMBERS, NaN for what did not happen."""

    def notes(self, stats: Any) -> list[str]:
        """A line for each limit that was passed."""

    def summary(self, unit: Any, run: Mapping[str, float]) -> str:
        """A run in one line, from its numbers."""


class Undeclared(Protocol):
    """What a unit with a body of its own has besides, all four. Its Link carries what the body remembers, and `pull`,
    `mean` and `energy` read it there."""

    @staticmethod
    @scalar
    def heights(x: float, z: float, link: Any) -> Heights:
        """`Heights` at which its body feels the water's motion."""

    @staticmethod
    @scalar
    def foresee(x: float, z: float, water: Water, h: float, sling: Sling, link: Any) -> Any:
        """The Link before a step, with what the water does to the body in the middle of it."""

    @staticmethod
    @scalar
    def moved(x: float, z: float, v_up: float, v_down: float, h: float, sling: Sling, link: Any) -> Any:
        """The Link after a step whose ends moved at v_up and v_down in its middle [m/s]; x at its start."""

    @staticmethod
    @scalar
    def work(w: Works, x: float, v_up: float, v_down: float, h: float, sling: Sling, before: Any, link: Any) -> Works:
        """`Works` with those of this step, of body and slings; before the Link before the step, link that after it."""


BODY = ("heights", "foresee", "moved", "work")


OF_A_PATH: Mapping[str, Record] = {
    "State": Record(
        needs={
            "s_w": Needed(float, "wire paid out [m]"),
            "s_load": Needed(float, "height of the load above its unstretched start [m]"),
            "v_load": Needed(float, "upward speed of the load [m/s]"),
        }
    ),
    "Point": Record(
        needs={
            "v_w": Needed(float, "wire speed, hoisting positive [m/s]"),
            "F_w": Needed(float, "tension at the top [N]"),
            "a_load": Needed(float, "upward acceleration of the load [m/s^2]"),
        }
    ),
    "Powers": Record(mark=Row, nested=False),
}
"""What each record of a load path must be."""
