"""What a sensor is: one module with its name, the quantity that it reads, its settings, and one `reading`.

`Sensor` is the contract, and `SensorWithMemory` that of one that remembers. A type checker checks a module against it:
`sensor: Sensor = my_sensor`; `stillhook.control.sensors.registry` does when it is loaded.

A reading is a `scalar` function: SI, floats and records in, floats and records out. It must not keep anything but its
`Memory`, read a clock or a file, draw random numbers, or branch with work on one side only: sixteen runs go side by
side.
"""

from typing import Any, Protocol

from stillhook.physics.scalar import scalar

BEFORE = ("s_tip", "v_tip", "a_tip", "s_w", "F")
"""Fields of `Sensed` of motion unit, encoder and load cell: their signals are read before the winch uses them."""
AFTER = ("alpha_m", "dp", "p_hp")
"""Those of transmitters in the circuits, which the winch type reads by itself."""
QUANTITIES = (*BEFORE, *AFTER)
"""Fields of `stillhook.control.interface.Sensed` that a sensor may read; the others are orders, or calculated."""


class Named(Protocol):
    """What every sensor says of itself."""

    @property
    def NAME(self) -> str:
        """Name of its table in a crane file, [sensors.NAME], in lower-case letters, digits and hyphens."""

    @property
    def TITLE(self) -> str:
        """One line that says what it is."""

    @property
    def QUANTITY(self) -> Any:
        """Field of Sensed that it reads, one of QUANTITIES, or a tuple of some, each read by itself."""

    @property
    def Settings(self) -> type[tuple[Any, ...]]:
        """NamedTuple whose fields are annotated with a Setting, given in the table [sensors.NAME]."""


class Sensor(Named, Protocol):
    """A sensor whose signal follows from the present value alone."""

    @scalar
    def reading(self, true: float, h: float, s: Any) -> Any:
        """The signal, from the true value and the settings s; h time since the last one, a PLC cycle [s]."""


class SensorWithMemory(Named, Protocol):
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


class Undeclared:
    """What a sensor may declare besides."""

    Memory: Any = None  # see `SensorWithMemory`
    begin: Any = None  # as well
