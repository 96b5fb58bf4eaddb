"""What a host program hangs from a winch: a load path (`stillhook.winches.load_path.load`) whose tension is given.

The host has wire, load and water; it gives the tension at the crane tip, and takes wire out and its speed. Its `Tip`
holds the tension in s [N] and its rate in v [N/s]; the motion of the crane tip is what the motion unit shows.
"""

from typing import Annotated, NamedTuple

from stillhook.base.variable import Row
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.load import at_its_end
from stillhook.winches.records import Motion

__all__ = ["SUPPLIED", "Point", "Powers", "State", "at_its_end"]


class State(NamedTuple):
    """Wire paid out s_w [m]; the load is the host's: s_load and v_load stay 0."""

    s_w: float
    s_load: float
    v_load: float


class Point(NamedTuple):
    """v_w wire speed, hoisting positive [m/s]; F_w tension at the top [N]; a_load is the host's: 0."""

    v_w: float
    F_w: float
    a_load: float


class Powers(NamedTuple):
    """Power through the wire [W]."""

    host: Annotated[float, Row("W", "power", "", "from the winch, through the wire to the host")]


SUPPLIED = ()


@scalar
def motion(tick):
    """Motion of the crane tip: that of the motion unit, the only one that is given."""
    return Motion(tick.s_m, tick.v_m, tick.a_m)


@scalar
def weight(tick, p):
    """Tension while all stands still [N]."""
    return tick.s


@scalar
def start(s_w, tick, p):
    """s_w of wire out [m]."""
    return State(s_w, 0.0, 0.0)


@scalar
def at(v_w, y, geo, tip, p):
    """The port at wire speed v_w [m/s]; tip.s tension [N]."""
    return Point(v_w, tip.s, 0.0)


@scalar
def rates(q, y, p):
    """Time derivatives of the state."""
    return State(-q.v_w, 0.0, 0.0)


@scalar
def powers(q, y, tip, p):
    """See `Powers`."""
    return Powers(q.F_w * q.v_w)


@scalar
def energy(q, y, p):
    """Energy of the load path [J]: the host's."""
    return 0.0
