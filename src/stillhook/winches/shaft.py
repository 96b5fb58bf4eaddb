"""The shaft of a winch: motors turn a drum through gears, with friction, a holding brake, an encoder and a load cell.

A winch type takes over what it does not do otherwise, `from stillhook.winches.shaft import geometry, wire_speed`. Its
State has omega_m motor speed, hoisting positive [rad/s], and z bristle of the friction, half a step ahead [rad]; its
Circuit g level of dry friction with that of the brake [N m], held how far the brake is closed [-], and T_moving what
friction has besides, against hoisting positive [N m]. Torques are at the motor shaft.
"""

from stillhook.control.interface import Sensed
from stillhook.physics.friction import bristle_update, dry_torque, system_friction_dry
from stillhook.physics.load_path.drum import K_wire
from stillhook.physics.scalar import copysign, quantise, scalar
from stillhook.winches.load_path.load import drum_geometry


@scalar
def geometry(s_w, p):
    """The drum during one PLC cycle, with s_w of wire out [m]."""
    return drum_geometry(s_w, p.hoist)


@scalar
def wire_speed(x, geo):
    """Wire speed that the winch gives, hoisting positive [m/s]."""
    return x.omega_m * geo.r_eff


@scalar
def dry_level(T_motors, omega_m, T_d, h):
    """Level of the dry friction without that of the brake, never negative [N m]: T_motors of all motors [N m], and of
    the transmission of each at drum torque T_d [N m]; omega_m [rad/s]; h Hoist."""
    return T_motors + h.n_motors * system_friction_dry(omega_m, T_d, h.friction)


@scalar
def moving_loss(T_motors, omega_m, h):
    """Viscous and turbulent losses, against hoisting positive [N m]: T_motors of all motors, never negative [N m], and
    of the transmission of each; omega_m [rad/s]; h Hoist."""
    return copysign(T_motors + h.n_motors * h.friction.Y_5 * abs(omega_m), omega_m)


@scalar
def friction(c, x, p):
    """Friction torque, with that of the brake, against hoisting positive [N m]."""
    return c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)


@scalar
def bristle_after(c, x, p, tau):
    """The bristle's deflection tau [s] later, at the present speed and friction level [rad]."""
    return bristle_update(x.omega_m, x.z, c.g, c.held, tau, p.hoist.bristle)


@scalar
def energy(x, geo):
    """Energy of all that turns [J]."""
    return 0.5 * x.omega_m * x.omega_m / geo.i_J


@scalar
def readings(omega_m, y, q, tick, geo, p):
    """What the PLC reads of a winch without pressures, whose motors have one displacement: motion unit, operator and
    mode of the tick; encoder and load cell with noise and steps; omega_m motor speed [rad/s]."""
    return Sensed(
        s_tip=tick.s_m,
        v_tip=tick.v_m,
        a_tip=tick.a_m,
        v_op=tick.v_op,
        s_op=tick.s_op,
        mode=tick.mode,
        f_pump=tick.f_known,
        s_w=quantise(y.s_w + tick.n_s, p.sensors.q_s),
        F=quantise(q.F_w + tick.n_F, p.sensors.q_F),
        alpha_m=1.0,
        K_wire=K_wire(geo.d, p.hoist.drum),
        dp=0.0,
        dp_load=0.0,
        p_hp=0.0,
        omega_m=omega_m,
        p_a=0.0,
        p_b=0.0,
    )


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads of a winch without pressures whose State has the motors' speed; see `readings`."""
    return readings(x.omega_m, y, q, tick, geo, p)
