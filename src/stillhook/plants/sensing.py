"""What the PLC of either winch type reads at the start of a cycle."""

from stillhook.control.plc import Sensed
from stillhook.physics.drum import K_wire
from stillhook.physics.scalar import scalar
from stillhook.physics.sensor import quantise
from stillhook.physics.swash import displacement, known_displacement
from stillhook.plants.hoist import hoist_state


@scalar
def sense(x, m, tick, tip, geo, p):
    """Sensed: motion unit, operator and mode of the tick; encoder and load cell with noise and steps; the motors' known setting."""
    A = p.active
    q = hoist_state(x.omega_m, x.s_w, x.s_load, x.v_load, geo, tip, p.hoist)
    alpha_m = known_displacement(displacement(x.alpha_m, A.motor_servo), m.u_m, A.control)
    s_w = quantise(x.s_w + tick.n_s, p.sensors.q_s)
    F = quantise(q.F_w + tick.n_F, p.sensors.q_F)
    ratio = K_wire(geo.d, p.hoist.drum)
    return Sensed(tick.s_m, tick.v_m, tick.a_m, tick.v_op, tick.s_op, tick.mode, tick.f_known, s_w, F, alpha_m, ratio)
