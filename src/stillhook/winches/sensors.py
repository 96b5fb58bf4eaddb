"""What the PLC of either winch type reads at the start of a cycle, and commands that stand in for its own."""

from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands
from stillhook.physics.hydraulics.swash import displacement, known_displacement
from stillhook.physics.load_path.drum import K_wire
from stillhook.physics.scalar import scalar
from stillhook.physics.sensor import quantise


@scalar
def closed_circuit_readings(x, y, q, m, tick, geo, T_passive, p_hp, p):
    """Sensed: motion unit, operator and mode of the tick; encoder and load cell with noise and steps; the motors' known
    setting; pressures.

    x state of the winch, y and q state and point of the load path. T_passive torque of the passive motors now, without
    losses [N m]; p_hp accumulator pressure [Pa].
    """
    A = p.active
    alpha_m = known_displacement(displacement(x.alpha_m, A.motor_servo), m.u_m, A.control)
    s_w = quantise(y.s_w + tick.n_s, p.sensors.q_s)
    F = quantise(q.F_w + tick.n_F, p.sensors.q_F)
    ratio = K_wire(geo.d, p.hoist.drum)
    dp_load = (F * geo.r_eff - T_passive) / (A.motors.count * A.motors.D_max * alpha_m)
    return Sensed(
        s_tip=tick.s_m,
        v_tip=tick.v_m,
        a_tip=tick.a_m,
        v_op=tick.v_op,
        s_op=tick.s_op,
        mode=tick.mode,
        f_pump=tick.f_known,
        s_w=s_w,
        F=F,
        alpha_m=alpha_m,
        K_wire=ratio,
        dp=x.p_a - x.p_b,
        dp_load=dp_load,
        p_hp=p_hp,
    )


@scalar
def apply_override(drive, tick):
    """The commands that the active circuit takes: the PLC's, or those given for this cycle from outside, such as a
    measured record."""
    override = tick.override > 0.0
    u_p = tick.u_p if override else drive.u_p
    u_m = tick.u_m if override else drive.u_m
    u_raw = tick.u_p if override else drive.u_raw
    brake = 0.0 if override else drive.brake
    return ActuatorCommands(u_p=u_p, u_m=u_m, u_ff=drive.u_ff, u_raw=u_raw, e_c=drive.e_c, brake=brake)
