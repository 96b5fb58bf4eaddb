"""What a controller is: one module with its name, its settings, what it remembers, and one `cycle`; and a sensor: one
module of the user with its name, the quantity that it reads, its settings, and one `reading`.

`Controller` is the contract of the least, and the three below it of a module with its own `Settings`, with a `Memory`,
and with both; `Sensor` and `SensorWithMemory` are those of sensors; `Undeclared` and `SensorUndeclared` are what a
module may say besides, and what holds where it does not. A type checker checks a module against them:
`law: Controller = my_law`. `stillhook.control.registry` and `stillhook.control.sensors` do when they are loaded.

Cycles and readings are `scalar` functions: SI, hoisting positive, floats and records in, floats and records out. They
must not keep anything but their `Memory`, read a clock or a file, draw random numbers, or branch with work on one side
only: sixteen runs go side by side. Limits, torque control and bumpless transfer follow behind a cycle.
"""

from typing import Any, NamedTuple, Protocol

from stillhook.physics.scalar import scalar

DISPLACEMENT, SPEED = "displacement", "speed"
"""What a controller commands of a drive: pumps and the displacement of motors, or the speed of the winch alone."""


class Setting(NamedTuple):
    """One setting of a controller as a crane file gives it."""

    kind: str  # kind of quantity, a key of `stillhook.units.KINDS`; "" for a plain number
    default: str | float  # with its unit, as in a crane file
    meaning: str
    search: tuple[float, float] | None = None  # ends of the search of `tune` [SI]; None: not tuned
    least: float = 0.0  # allowed range [SI]
    most: float = 1.0e6


class Sensed(NamedTuple):
    """What the PLC reads at the start of a cycle."""

    s_tip: float  # motion unit: position of the tip, up positive [m]
    v_tip: float  # its speed [m/s]
    a_tip: float  # its acceleration [m/s^2]
    v_op: float  # speed that the operator requests, hoisting positive [m/s]
    s_op: float  # its integral [m]
    mode: float  # code of the controller
    f_pump: float  # share of the active pumps known to run [-]
    s_w: float  # encoder: wire paid out [m]
    F: float  # load cell [N]
    alpha_m: float  # known displacement of the active motors [-]
    K_wire: float  # of the present layer [-]
    dp: float  # p_a - p_b measured [Pa]
    dp_load: float  # dp at which the active motors carry what the passive ones do not [Pa]
    p_hp: float  # accumulator pressure [Pa], 0 without a passive circuit
    omega_m: float  # motor speed, hoisting positive [rad/s]; of a cylinder winch that of the drum times the gear ratio
    p_a: float  # pressure of line A, hoisting [Pa]; 0 where the winch has no lines A and B
    p_b: float  # that of line B, lowering [Pa]; 0 where it has none


class Reading(NamedTuple):
    """What a controller senses in a cycle."""

    y: Sensed  # the tip's motion as it will be: position after t_lead, speed after t_lead_ff, acceleration after t_a
    e_c: float  # control error: wire that is missing against the measured tip [m]
    F: float  # load cell, low-pass filtered [N]
    u_ff: float  # feedforward of the tip's and the operator's speed [-]
    u_fb: float  # feedback -K_p e_c [-]
    t_a: float = 0.0  # time of y.a_tip [s]: 0, now, where it is read; t_lead_ff where it is predicted


class Demand(NamedTuple):
    """What a controller demands, before limits and bumpless transfer."""

    u_p: float  # pump command, hoisting positive [-]
    u_m: float  # displacement of the active motors [-]


class Named(Protocol):
    """What every controller and sensor says of itself."""

    @property
    def NAME(self) -> str:
        """Name that users write, in lower-case letters, digits and hyphens."""

    @property
    def TITLE(self) -> str:
        """One line that says what it is."""


class Controller(Named, Protocol):
    """A controller without settings or memory of its own."""

    @scalar
    def cycle(self, r: Reading, plc: Any) -> Any:
        """The law, from a Reading and the settings Plc that all controllers share to a Demand."""


class ControllerWithSettings(Named, Protocol):
    """A controller with settings of its own."""

    @property
    def Settings(self) -> type[tuple[Any, ...]]:
        """NamedTuple whose fields are annotated with a Setting, given in the table [control.NAME]."""

    @scalar
    def cycle(self, r: Reading, plc: Any, s: Any) -> Any:
        """The law, with its Settings s, to a Demand."""


class ControllerWithMemory(Named, Protocol):
    """A controller that remembers."""

    @property
    def Memory(self) -> type[tuple[Any, ...]]:
        """NamedTuple of floats with defaults, which it starts from whenever the controller comes into force."""

    @scalar
    def cycle(self, r: Reading, plc: Any, m: Any) -> Any:
        """The law, with its Memory m, to (Demand, Memory)."""


class ControllerWithBoth(Named, Protocol):
    """A controller with settings of its own that remembers."""

    @property
    def Settings(self) -> type[tuple[Any, ...]]:
        """As of `ControllerWithSettings`."""

    @property
    def Memory(self) -> type[tuple[Any, ...]]:
        """As of `ControllerWithMemory`."""

    @scalar
    def cycle(self, r: Reading, plc: Any, s: Any, m: Any) -> Any:
        """The law, with its Settings s and Memory m, to (Demand, Memory)."""


class Undeclared:
    """What a controller may declare, with what holds where it does not."""

    Settings: Any = None  # see `ControllerWithSettings`
    Memory: Any = None  # see `ControllerWithMemory`
    LABEL: str | None = None  # what pictures call it, default NAME
    ORDER: float = 100  # place in lists, behind that of manual mode, which is 0
    USES: tuple[
        str, ...
    ] = ()  # of USABLE, settings that the law reads besides those of the pumps; `tune` searches them
    FAMILY: str = "other"  # "classic" for motors at a fixed displacement
    USUAL: bool = False  # whether it is compared when a user names no controller
    SWL_SHARE: float = 1.0  # part of the SWL that it carries
    COMPENSATES: bool = True  # False where it leaves the tip's motion alone
    LEARNS: bool = False  # whether stability is that of what it remembers after some minutes in a sea
    BEGINS: float = (
        0.0  # time from where it comes into force until it acts as it goes on [s]: stability is that of then
    )
    YIELDS: bool = False  # gives wire on purpose, which its control error holds: `compare` shows the load's motion too
    DRIVES: tuple[str, ...] = (DISPLACEMENT,)  # kinds of drive that it commands


USABLE = ("u_thr", "alpha_min", "alpha_ns", "alpha_hs", "alpha_swl")
"""Settings of a crane file's [control] and [active.motor] that `Undeclared.USES` may name."""

BEFORE = ("s_tip", "v_tip", "a_tip", "s_w", "F")
"""Fields of `Sensed` of motion unit, encoder and load cell: their signals are read before the winch uses them."""
AFTER = ("alpha_m", "omega_m", "p_a", "p_b", "dp", "p_hp")
"""Those of transmitters in the circuits, which the winch type reads by itself. dp follows what is read of p_a and p_b,
and is read by its own sensor behind them."""
QUANTITIES = (*BEFORE, *AFTER)
"""Fields of `stillhook.control.interface.Sensed` that a sensor may read; the others are orders, or calculated."""


class NamedSensor(Named, Protocol):
    """What every sensor says of itself; NAME is that of its table in a crane file, [sensors.NAME]."""

    @property
    def QUANTITY(self) -> Any:
        """Field of Sensed that it reads, one of QUANTITIES, or a tuple of some, each read by itself."""

    @property
    def Settings(self) -> type[tuple[Any, ...]]:
        """NamedTuple whose fields are annotated with a Setting, given in the table [sensors.NAME]."""


class Sensor(NamedSensor, Protocol):
    """A sensor whose signal follows from the present value alone."""

    @scalar
    def reading(self, true: float, h: float, s: Any) -> Any:
        """The signal, from the true value and the settings s; h time since the last one, a PLC cycle [s]."""


class SensorWithMemory(NamedSensor, Protocol):
    """A sensor that remembers."""

    @property
    def Memory(self) -> type[tuple[Any, ...]]:
        """NamedTuple of floats."""

    @scalar
    def begin(self, true: float, s: Any) -> Any:
        """The Memory at rest at a true value, with which its first reading is made."""

    @scalar
    def reading(self, true: float, h: float, s: Any, m: Any) -> Any:
        """The signal, and the new Memory; h time since the last one, a PLC cycle [s]."""


class SensorUndeclared:
    """What a sensor may declare besides."""

    Memory: Any = None  # see `SensorWithMemory`
    begin: Any = None  # as well
