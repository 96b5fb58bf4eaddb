"""Cylinders: the compensator in the wire's path, and the passive compensator between hook and payload."""

from closed_circuits import accumulator, closed_circuit, hang
from symbols import (
    LINES,
    Accumulator,
    Brake,
    Cylinder,
    Drum,
    GasVessel,
    Payload,
    Plunger,
    PrimeMover,
    Relief,
    Restrictor,
    Sheave,
    Sheet,
    Tank,
)


def cylinder() -> Sheet:
    """A cylinder in the wire's path compensates; the winch stands on its brake."""
    s = Sheet(
        "Winch with cylinder compensator",
        "Closed circuit on a double-acting cylinder; a plunger on an accumulator carries the load; both push the"
        " travelling sheave in the wire's path. The winch behind stands on its brake while they compensate.",
    )
    y_a, y_b, x_c, x_p = 10.0, 1.0, 27.0, 29.6
    mid = 7.0
    rod_end = mid - 1.8 - 1.32
    s.add(Cylinder(port=-1.0), (x_c, mid), theta=-90)
    s.add(Plunger(port=-1.0), (x_p, mid), theta=-90)
    closed_circuit(s, y_a, y_b, 25.0, mid + 1.45, mid - 1.45)
    s.pipe("a", (25.0, mid + 1.45), (x_c - 0.55, mid + 1.45))
    s.pipe("b", (25.0, mid - 1.45), (x_c - 0.55, mid - 1.45))
    s.flow("Q_A", (25.4, mid + 1.75), "right", "above", "a")
    return s


def phc() -> Sheet:
    """A gas spring between hook and payload, below any winch."""
    return Sheet("Passive heave compensator", "Gas spring.")
