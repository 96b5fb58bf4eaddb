"""What hangs from a winch: wire and load below the drum, a load path that meets the winch at one port.

The winch gives the speed of the wire, the load path the tension at the top. Another load path has the same names:
`State`, `Point`, `Powers` and `SUPPLIED`, `motion`, `weight`, `start`, `at`, `rates`, `powers`, `energy`,
`at_its_end`. Its `Tip` is what comes to it from outside: here the motion of the crane tip.

Drum, wire and load as the records of a winch hold them, and the drum as the motor shaft sees it.
"""

from typing import Annotated, NamedTuple

from stillhook.base.variable import Row
from stillhook.physics.friction import Bristle, SystemFriction
from stillhook.physics.load_path.drum import (
    Drum,
    Inertia,
    Load,
    Wire,
    drag_force,
    layer_diameter,
    layers_filled,
    load_acceleration,
    shaft_inertia,
    wire_at_end,
    wire_damping,
    wire_stiffness,
    wire_tension,
)
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Geometry, Motion


class State(NamedTuple):
    """What a load path must have: wire paid out, and the load."""

    s_w: float  # wire paid out [m]
    s_load: float  # height of the load above its unstretched start [m]
    v_load: float  # upward speed of the load [m/s]


class Point(NamedTuple):
    """The load path at an instant; every load path has v_w, F_w and a_load."""

    v_w: float  # wire speed, hoisting positive [m/s]
    F_w: float  # tension at the top [N]
    a_load: float  # upward acceleration of the load [m/s^2]
    k: float  # stiffness of the wire out [N/m]
    stretch: float  # [m]
    stretch_rate: float  # [m/s]


class Powers(NamedTuple):
    """Powers of the load path [W]: from the tip, through the wire; lost in the wire, to the water."""

    tip: Annotated[float, Row("W", "power", "", "from the tip, through the wire")]
    wire: Annotated[float, Row("W", "power", "", "lost in the wire")]
    drag: Annotated[float, Row("W", "power", "", "lost to the water around the load")]


SUPPLIED = ("tip",)
"""Powers that go in; the others go out."""


@scalar
def motion(tick):
    """True motion of the crane tip."""
    return Motion(tick.s, tick.v, tick.a)


@scalar
def weight(tick, p):
    """Tension while all stands still [N]."""
    return p.hoist.load.W


@scalar
def start(s_w, tick, p):
    """The load hanging still with s_w of wire out [m]."""
    h = p.hoist
    return State(s_w, tick.s - h.load.W / wire_stiffness(s_w, h.wire), 0.0)


@scalar
def at(v_w, y, geo, tip, p):
    """The load path at wire speed v_w [m/s, hoisting positive]: y its state, tip s, v up positive.

    The wire's stretch is what the tip rose, less the wire paid out and less the load's own rise.
    """
    h = p.hoist
    k = wire_stiffness(y.s_w, h.wire)
    stretch = tip.s - (y.s_w - h.s_w_0) - y.s_load
    stretch_rate = tip.v + v_w - y.v_load
    F_w = wire_tension(stretch, stretch_rate, k, geo.c)
    return Point(
        v_w=v_w,
        F_w=F_w,
        a_load=load_acceleration(F_w, y.v_load, h.load),
        k=k,
        stretch=stretch,
        stretch_rate=stretch_rate,
    )


@scalar
def rates(q, y, p):
    """Time derivatives of the state."""
    return State(s_w=-q.v_w, s_load=y.v_load, v_load=q.a_load)


@scalar
def wire_loss(q, wire):
    """Power that stays in the wire [W]: damping, plus the strain that wire carries along as it leaves the drum."""
    taut = 1.0 if q.F_w > 0.0 else 0.0
    elastic = taut * q.k * q.stretch
    strain = 0.5 * q.k * q.stretch * q.stretch * q.k / wire.EA * q.v_w
    return (q.F_w - elastic) * q.stretch_rate - taut * strain


@scalar
def drag_loss(v_load, load):
    """Power lost to the water around the load, never negative [W]."""
    return -drag_force(v_load, load) * v_load


@scalar
def powers(q, y, tip, p):
    """See `Powers`."""
    return Powers(tip=q.F_w * tip.v, wire=wire_loss(q, p.hoist.wire), drag=drag_loss(y.v_load, p.hoist.load))


@scalar
def energy(q, y, p):
    """Energy of wire and load [J]."""
    load = p.hoist.load
    stretch = q.stretch if q.F_w > 0.0 else 0.0
    return 0.5 * load.m * y.v_load * y.v_load + load.W * y.s_load + 0.5 * q.k * stretch * stretch


@scalar
def at_its_end(y, p):
    """1 where the last turns of wire leave the drum, or the hook is at the tip, else 0."""
    return wire_at_end(y.s_w, p.hoist.drum)


class Hoist(NamedTuple):
    """i_i inverse of the gear ratio motor to drum; s_w_0 wire paid out at the start [m]; n_motors all motors, active
    and passive; T_brake torque that the holding brake carries at the motor shaft [N m]."""

    drum: Drum
    inertia: Inertia
    wire: Wire
    load: Load
    friction: SystemFriction
    bristle: Bristle
    i_i: float
    s_w_0: float
    n_motors: float
    T_brake: float


@scalar
def drum_geometry(s_w, h):
    """Layer, diameter, r_eff, inertia and damping of the wire with s_w paid out [m]; taken once per PLC cycle."""
    L_left = h.drum.L_full - s_w
    layers = layers_filled(L_left, h.drum)
    d = layer_diameter(layers, h.drum)
    i_J = 1.0 / shaft_inertia(L_left, layers, h.drum, h.inertia)
    return Geometry(layers=layers, d=d, r_eff=0.5 * d * h.i_i, i_J=i_J, c=wire_damping(s_w, h.load.m, h.wire))


def shaft_inertia_without_wire(h: Hoist) -> float:
    """Inertia at the motor shaft with an empty drum, the least that there is [kg m^2]."""
    return h.inertia.J_motor + h.inertia.J_gear + h.inertia.J_drum * h.inertia.i_i2
