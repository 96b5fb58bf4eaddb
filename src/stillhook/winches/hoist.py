"""What both winch types move: drum, wire and load, seen from the motor shaft."""

from typing import NamedTuple

from stillhook.physics.friction import Bristle, SystemFriction
from stillhook.physics.load_path.drum import Drum, Inertia, layer_diameter, layers_filled, shaft_inertia
from stillhook.physics.load_path.load import Load, drag_force, load_acceleration
from stillhook.physics.load_path.wire import Wire, wire_damping, wire_stiffness, wire_tension
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Geometry


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


class HoistState(NamedTuple):
    """v_w [m/s]; k [N/m]; stretch [m]; stretch_rate [m/s]; F_w tension [N]; a_load upward acceleration [m/s^2]."""

    v_w: float
    k: float
    stretch: float
    stretch_rate: float
    F_w: float
    a_load: float


@scalar
def drum_geometry(s_w, h):
    """Layer, diameter, r_eff, inertia and damping of the wire with s_w paid out [m]; taken once per PLC cycle."""
    L_left = h.drum.L_full - s_w
    layers = layers_filled(L_left, h.drum)
    d = layer_diameter(layers, h.drum)
    i_J = 1.0 / shaft_inertia(L_left, layers, h.drum, h.inertia)
    return Geometry(layers, d, 0.5 * d * h.i_i, i_J, wire_damping(s_w, h.load.m, h.wire))


@scalar
def hoist_state(omega_m, s_w, s_load, v_load, geo, tip, h):
    """Wire and load at an instant: tip s, v up positive; s_load height of the load above its unstretched start [m].

    The wire's stretch is what the tip rose, less the wire paid out and less the load's own rise.
    """
    v_w = omega_m * geo.r_eff
    k = wire_stiffness(s_w, h.wire)
    stretch = tip.s - (s_w - h.s_w_0) - s_load
    stretch_rate = tip.v + v_w - v_load
    F_w = wire_tension(stretch, stretch_rate, k, geo.c)
    return HoistState(v_w, k, stretch, stretch_rate, F_w, load_acceleration(F_w, v_load, h.load))


@scalar
def wire_loss(q, v_w, wire):
    """Power that stays in the wire [W]: damping, plus the strain that wire carries along as it leaves the drum."""
    taut = 1.0 if q.F_w > 0.0 else 0.0
    elastic = taut * q.k * q.stretch
    strain = 0.5 * q.k * q.stretch * q.stretch * q.k / wire.EA * v_w
    return (q.F_w - elastic) * q.stretch_rate - taut * strain


@scalar
def drag_loss(v_load, load):
    """Power lost to the water around the load, never negative [W]."""
    return -drag_force(v_load, load) * v_load


@scalar
def hoist_energy(omega_m, v_load, s_load, q, geo, load):
    """Energy stored in shaft, load and wire [J]."""
    stretch = q.stretch if q.F_w > 0.0 else 0.0
    return (
        0.5 * omega_m * omega_m / geo.i_J
        + 0.5 * load.m * v_load * v_load
        + load.W * s_load
        + 0.5 * q.k * stretch * stretch
    )
