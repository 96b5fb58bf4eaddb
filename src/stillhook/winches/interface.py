"""What a winch type is: one module with its tables, records, equations and what it says before a run.

`Winch` is the contract: what every module has; `Undeclared` is what a module may declare besides, and what holds where
it does not. What is below the winch it names as its PATH, see `stillhook.winches.load_path.interface`. A type checker
checks a module against them: `winch: Winch = my_winch`; `stillhook.winches.registry` does when it is loaded.

Functions with `@scalar` are compiled: SI, hoisting positive, floats and records in, floats and records out. They must
not keep anything between calls, read a clock or a file, draw random numbers, or branch with work on one side only:
sixteen runs go side by side. Functions with a `crane` are plain Python before a run; they must not change the crane.

Letters: x state of the winch, q point and y state of the load path, u commands, c circuit, geo drum during a PLC cycle,
p parameters, m memory of the PLC, m_0 before its cycle, r what it read, tick what comes from outside in a cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

from stillhook.base.contract import Needed, Record
from stillhook.base.variable import Row, Variable
from stillhook.control.interface import DISPLACEMENT, Sensed
from stillhook.control.plant import Hydraulics
from stillhook.control.plc import ActuatorCommands, Memory, Plc
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.interface import LoadPath
from stillhook.winches.load_path.load import Hoist
from stillhook.winches.records import Geometry, Sensors, Tick


class Parts(NamedTuple):
    """What a run gives every winch type to pack: records of drum, wire and load, PLC and sensors, and functions that
    pack closed circuits and accumulators."""

    hoist: Any
    plc: Any
    sensors: Any
    active: Callable[[Any], Any]  # crane -> ActiveCircuit
    passive: Callable[[Any, bool], Any]  # crane, whether the gas is held -> PassiveCircuit
    gas: Callable[[Any], Any]  # table of an accumulator -> Gas
    accumulator: Callable[[Any, Any, bool, str], Any]  # its table, that of its line, gas held, place -> Accumulator


class Stiffness(NamedTuple):
    """What bounds the step of a winch without its load path."""

    rates: Mapping[str, float]  # fast modes by name [1/s]
    viscous: float  # slope of its moving losses by motor speed [N m s/rad]
    dry: float  # upper bound of its dry friction without the transmission's [N m]
    n_max: float  # highest motor speed [rad/s]


class OtherMotors(NamedTuple):
    """A set of motors next to the active ones that holds a weight."""

    name: str
    motor: Any  # MotorSet
    alpha: float  # displacement that it takes [-]; above 1 they cannot
    dp: float  # pressure over them at rest [Pa]
    R: float = 0.0  # what their flow takes of it, as the friction of an accumulator's piston [Pa s/m^3]


class PartSpeed(NamedTuple):
    """A part that moves with the wire at full command."""

    part: str
    speed: float  # at full command
    highest: float  # that it is made for
    quantity: str  # "speed" [m/s] or "rotation" [rad/s]


class Stroke(NamedTuple):
    """How much motion what carries a load can take."""

    length: float  # [m]
    basis: str


class Carried(NamedTuple):
    """What other motors than the active ones hold of a load at rest."""

    T: float  # torque at the motor shaft, without losses [N m]
    alpha: float  # their displacement [-]
    n_max: float  # their highest speed at this displacement [rad/s]


class Cause(NamedTuple):
    """What passing a limit is called: the word in a run's status, and the row of the time beyond it."""

    status: str
    meaning: str
    symbol: str = ""
    source: str = ""

    def named(self, limit: str) -> Variable:
        """The row of the time for which the limit of this name is passed."""
        return Variable(f"{limit}_time", self.symbol or f"{limit}_time", "s", "time", "", self.meaning, self.source)


class Winch(Protocol):
    """A winch type, as its module declares it."""

    @property
    def NAME(self) -> str:
        """Name that crane files write as plant, in lower-case letters, digits and hyphens."""

    @property
    def TITLE(self) -> str:
        """One line that says what it is."""

    @property
    def TABLES(self) -> Mapping[str, type] | tuple[str, ...]:
        """Tables of the crane file that it needs: models of its own by name, or names of known ones."""

    @property
    def PATH(self) -> LoadPath:
        """Load path below it, `stillhook.winches.load_path.load` for wire and load."""

    @property
    def SUPPLIED(self) -> tuple[str, ...]:
        """Fields of Powers that go in; the others go out. The energy audit of every run rests on it."""

    @property
    def Params(self) -> type[tuple[Any, ...]]:
        """NamedTuple of the parameters of a run, with hoist, plc and sensors."""

    @property
    def State(self) -> type[tuple[Any, ...]]:
        """NamedTuple of floats, the winch without its load path; a bristle z is advanced by bristle_after."""

    @property
    def Command(self) -> type[tuple[Any, ...]]:
        """NamedTuple of floats that are held between PLC cycles, with brake."""

    @property
    def Circuit(self) -> type[tuple[Any, ...]]:
        """NamedTuple of what its diagram shows at an instant."""

    @property
    def Signals(self) -> type[tuple[Any, ...]]:
        """NamedTuple of its own signals, each annotated with a Row."""

    @property
    def Extremes(self) -> type[tuple[Any, ...]]:
        """NamedTuple of extremes of its signals over a run, each annotated with a Row."""

    @property
    def BLANK(self) -> tuple[float, ...]:
        """Extremes of nothing yet."""

    @property
    def Limits(self) -> type[tuple[Any, ...]]:
        """NamedTuple of limits, 1 where passed at an instant, else 0, each annotated with a Cause."""

    @property
    def Powers(self) -> type[tuple[Any, ...]]:
        """NamedTuple of powers [W], those of SUPPLIED going in and the others out."""

    @scalar
    def geometry(self, s_w: float, p: Any) -> Geometry:
        """The drum during a PLC cycle, with s_w of wire out [m]."""

    @scalar
    def wire_speed(self, x: Any, geo: Geometry) -> float:
        """Speed of the wire at the port to the load path, hoisting positive [m/s]."""

    @scalar
    def circuit(self, x: Any, q: Any, u: Any, geo: Geometry, p: Any) -> Any:
        """The Circuit, the winch at an instant; q.F_w is the tension [N]."""

    @scalar
    def rates(self, c: Any, x: Any, q: Any, u: Any, geo: Geometry, p: Any) -> Any:
        """Time derivatives of the State; that of a bristle z is 0."""

    @scalar
    def start(self, s_w: float, tick: Tick, p: Any) -> Any:
        """The State at rest before the PLC's first cycle."""

    @scalar
    def settle(self, x: Any, q: Any, u: Any, tick: Tick, geo: Geometry, p: Any) -> Any:
        """The State at rest under the PLC's first commands."""

    @scalar
    def sense(self, x: Any, y: Any, q: Any, m: Memory, tick: Tick, geo: Geometry, p: Any) -> Sensed:
        """What the PLC reads."""

    @scalar
    def actuate(
        self, drive: ActuatorCommands, r: Sensed, x: Any, m_0: Memory, m: Memory, tick: Tick, geo: Geometry, p: Any
    ) -> tuple[Any, Memory, ActuatorCommands]:
        """Command of the plant, the PLC's memory and the signals of the drive."""

    @scalar
    def signals(self, c: Any, x: Any, q: Any, u: Any, geo: Geometry, p: Any) -> Any:
        """Its Signals."""

    @scalar
    def limits(self, c: Any, x: Any, q: Any, u: Any, p: Any) -> Any:
        """Its Limits."""

    @scalar
    def powers(self, c: Any, x: Any, q: Any, p: Any) -> Any:
        """Its Powers [W]."""

    @scalar
    def stored_energy(self, c: Any, x: Any, geo: Geometry, p: Any) -> float:
        """Energy stored in it [J]."""

    @scalar
    def fold_extremes(self, a: Any, y: Any) -> Any:
        """Extremes a with one more cycle of signals y, its own and those of every winch."""

    def pack(self, crane: Any, case: Any, parts: Parts) -> Any:
        """Params of a run, from the Parts that every winch has."""

    def motors(self, crane: Any) -> tuple[Any, ...]:
        """Sets of motors on the shaft, each with count and inertia J of one [kg m^2]."""

    def full_speed(self, crane: Any, alpha_m: float) -> float:
        """Motor speed at full command [rad/s] with the motors at displacement alpha_m [-]."""

    def stiffness(self, p: Any) -> Stiffness:
        """Stiffness, from which the longest step follows."""


class Undeclared(Protocol):
    """What a winch type may declare, with what holds where it does not."""

    SHOWN: Mapping[str, str] | None = None
    """Its own numbers in a table of runs, with the head of each column; None: all of them."""
    CONTROL: str = DISPLACEMENT
    """What controllers command: "displacement", a closed circuit whose motors' displacement they set, or "speed", a
    drive that takes the speed command u_p alone."""
    TUNED: Mapping[str, tuple[float, float]] = {}
    """Settings of its drive that `tune` may search, by their path in a crane file, with the ends of the search [SI]."""
    SERVOS: Mapping[str, tuple[str, str]] = {}
    """Fields of Command that a displacement control follows, with the path of its table in a crane file and that of its
    `Servo` in Params: commands reach it after its dead time."""
    WITHIN: tuple[str, ...] = ()
    """Powers that go in at one place of the winch and out at another, equal: not from outside."""
    PER_MOTOR: tuple[str, ...] = ()
    """Tables whose numbers are those of one motor, next to the one with `count`: a larger drive has more of them."""

    @staticmethod
    @scalar
    def bristle_after(c: Any, x: Any, p: Any, tau: float) -> float:
        """Where the State has a bristle z: its value tau [s] later, exactly."""

    @staticmethod
    def lag(crane: Any) -> float:
        """Time by which the drive lags its command [s]; K_2 = K_1 lag."""
        return 0.0

    @staticmethod
    def full_wire_speed(crane: Any) -> float | None:
        """Wire speed at full command [m/s] of a winch that has the same on every layer; its PLC reads K_wire = 1. None:
        motor speed at full command, by gear and diameter."""
        return None

    @staticmethod
    def least_displacement(crane: Any) -> float:
        """Smallest displacement of the motors [-]; 1: fixed."""
        return 1.0

    @staticmethod
    def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Size of each pump that a power unit drives, active and passive."""
        return (), ()

    @staticmethod
    def pump_flows(crane: Any) -> tuple[float, float]:
        """Flow of active and of passive pumps at full stroke [m^3/s]."""
        return 0.0, 0.0

    @staticmethod
    def hydraulics(crane: Any) -> Hydraulics:
        """What controllers may know of its hydraulics; of closed circuits where it has some."""
        a, p = (crane.circuits.get(name) for name in ("active", "passive"))
        return Hydraulics(
            D_m=a.motor.D_total if a else 0.0,
            Q_p=a.pump.D_total * a.pump.omega_p if a else 0.0,
            D_pm=p.motor.D_total if p else 0.0,
            Q_pp=p.pump.D_total * p.pump.omega_p if p else 0.0,
            i_C_h=1.0 / capacitance(a.line.V, a.line.bulk_modulus) if a else 0.0,
            G_leak=a.C_leak if a else 0.0,
            omega_np=a.pump.servo.omega_n if a else 0.0,
            zeta_p=a.pump.servo.zeta if a else 0.0,
        )

    @staticmethod
    def pump_speed(crane: Any) -> float | None:
        """Speed at which the power units turn the pumps [rad/s]; None: none are turned."""
        return float(crane.active.pump.omega_p) if crane.circuits else None

    @staticmethod
    def charge(crane: Any) -> float:
        """Accumulator pressure at rest [Pa]."""
        return 0.0

    @staticmethod
    def prepared(crane: Any, W: float, d: float) -> Any:
        """The crane as it is prepared for a weight W [N] on diameter d [m], such as with gas banks filled."""
        return crane

    @staticmethod
    def other_motors(crane: Any, W: float, d: float) -> list[OtherMotors]:
        """Sets next to the active ones that hold a weight W [N] on diameter d [m]."""
        return []

    @staticmethod
    def refusal(crane: Any, case: Any) -> str:
        """Reason why it cannot run a case; "" where it can. Where no accumulator has a charge, none can be held."""
        no_gas = case.gas_held and crane.plant.type.charge(crane) == 0.0
        return f'gas_held: "{crane.name}" has no accumulator. Leave it out.' if no_gas else ""

    @staticmethod
    def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
        """What to say of it before it runs, in lines."""
        return []

    @staticmethod
    def sized(crane: Any, reference: Any, v_top: float) -> dict[str, float]:
        """Where its size is not a number of motors: size of its tables for the load of another crane and a wire speed
        at full command [m/s], over their size now, by path of the table."""

    @staticmethod
    def part_speeds(crane: Any) -> list[PartSpeed]:
        """Speeds of what moves with the wire and is no motor on the shaft."""
        return []

    @staticmethod
    def stroke(crane: Any, F: float) -> Stroke | None:
        """Tip motion that takes the stroke of what carries the tension F [N]; None where nothing has one."""
        return None

    @staticmethod
    def speed_limit(p: Any, geo: Geometry, F_w: float, lowering: bool) -> tuple[float, str]:
        """Highest steady motor speed with tension F_w [N] at the top, hoisting or lowering [rad/s], and the word of the
        limit that stops it; of types without `steady`, for the envelope and the speeds of a plan."""

    @staticmethod
    def steady(p: Any, geo: Geometry, F_w: float, omega_m: float, v_op: float, alpha_m: float) -> tuple[Any, Any]:
        """State and Command of a steady speed. Without it the type has no operating point, and margins are those of the
        linearised engine."""

    @staticmethod
    def carried(p: Any, geo: Geometry, F_w: float) -> Carried:
        """What other motors than the active ones hold of a load."""
        return Carried(0.0, 0.0, math.inf)

    @staticmethod
    def mean_pressure(x: Any, p: Any) -> float:
        """Mean accumulator pressure that the PLC has seen in a steady state [Pa]."""
        return 0.0


RECORDS: Mapping[str, Record] = {
    "Params": Record(
        needs={
            "hoist": Needed(Hoist, "drum, wire and load, as parts.hoist packs them"),
            "plc": Needed(Plc, "settings of the PLC, as parts.plc packs them"),
            "sensors": Needed(Sensors, "steps of encoder and load cell, as parts.sensors packs them"),
        }
    ),
    "State": Record(),
    "Command": Record(needs={"brake": Needed(float, "how far the holding brake is closed, 0 open, 1 closed [-]")}),
    "Circuit": Record(),
    "Signals": Record(mark=Row, nested=False),
    "Extremes": Record(mark=Row, nested=False),
    "Limits": Record(mark=Cause, nested=False),
    "Powers": Record(nested=False),
}
"""What each record of a winch type must be."""
