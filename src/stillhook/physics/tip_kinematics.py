"""Height of a crane tip from what a motion unit and the boom's encoders give: the equations that a crane's PLC
calculates with, and those of the motion unit's heave filter.

Axes and signs as in `stillhook.sea.vessel.ship_motion`: x forward, y to port, z up; heave up, roll port up, pitch bow
up. Called from Python the functions take arrays as well.
"""

from typing import NamedTuple

from stillhook.physics.scalar import cos, scalar, sin


class Jet(NamedTuple):
    """A quantity with its first and second derivative in time [unit, unit/s, unit/s^2]."""

    x: float
    v: float
    a: float


class Attitude(NamedTuple):
    """What a motion unit gives: heave [m], roll and pitch [rad]."""

    heave: Jet
    roll: Jet
    pitch: Jet


class BoomPose(NamedTuple):
    """Angles of a boom [rad], as in `stillhook.sea.vessel.boom.Boom`: slew from the bow to port, main boom above the
    horizontal, knuckle boom below the line of the main boom."""

    slew: Jet
    main: Jet
    knuckle: Jet


class BoomLengths(NamedTuple):
    """Heel pin from the motion unit: x forward, y to port, z up [m]; r_0 heel pin ahead of the axis of slewing, L_1
    main and L_2 knuckle boom [m]; z_0 height of the tip above the motion unit that counts as 0 [m]; exact 1 for
    rotations in full, 0 for small angles."""

    x: float
    y: float
    z: float
    r_0: float
    L_1: float
    L_2: float
    z_0: float
    exact: float


class FilterMemory(NamedTuple):
    """Heave that the filter takes away [m], and its rate [m/s]."""

    e: float
    v: float


@scalar
def plus(p, q):
    """Sum of two jets."""
    return Jet(p.x + q.x, p.v + q.v, p.a + q.a)


@scalar
def times(p, q):
    """Product of two jets."""
    return Jet(p.x * q.x, p.v * q.x + p.x * q.v, p.a * q.x + 2.0 * p.v * q.v + p.x * q.a)


@scalar
def scaled(k, p):
    """A jet times a constant."""
    return Jet(k * p.x, k * p.v, k * p.a)


@scalar
def between(p, q, h, x):
    """The quintic through jets h apart [s], at part x of the way: p itself at 0."""
    v_0 = p.v * h
    a_0 = p.a * h * h
    v_1 = q.v * h
    a_1 = q.a * h * h
    d = q.x - p.x
    c_3 = 10.0 * d - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1
    c_4 = -15.0 * d + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1
    c_5 = 6.0 * d - 3.0 * v_0 - 3.0 * v_1 - 0.5 * a_0 + 0.5 * a_1
    return Jet(
        p.x + x * (v_0 + x * (0.5 * a_0 + x * (c_3 + x * (c_4 + x * c_5)))),
        p.v + x * (a_0 + x * (3.0 * c_3 + x * (4.0 * c_4 + x * 5.0 * c_5))) / h,
        p.a + x * (6.0 * c_3 + x * (12.0 * c_4 + x * 20.0 * c_5)) / (h * h),
    )


@scalar
def sine(p):
    """Sine of a jet of an angle [rad]."""
    s = sin(p.x)
    c = cos(p.x)
    return Jet(s, c * p.v, c * p.a - s * p.v * p.v)


@scalar
def cosine(p):
    """Cosine of a jet of an angle [rad]."""
    s = sin(p.x)
    c = cos(p.x)
    return Jet(c, -s * p.v, -s * p.a - c * p.v * p.v)


@scalar
def lever(pose, boom):
    r"""Crane tip from the motion unit, in axes of the ship: x, y, z as jets [m].

    .. math:: r = r_0 + L_1\cos\theta_1 + L_2\cos(\theta_1-\theta_2), \quad x = x_p + r\cos\psi, \quad
              y = y_p + r\sin\psi, \quad z = z_p + L_1\sin\theta_1 + L_2\sin(\theta_1-\theta_2)
    """
    down = plus(pose.main, scaled(-1.0, pose.knuckle))
    r = plus(scaled(boom.L_1, cosine(pose.main)), scaled(boom.L_2, cosine(down)))
    radius = Jet(r.x + boom.r_0, r.v, r.a)
    rise = plus(scaled(boom.L_1, sine(pose.main)), scaled(boom.L_2, sine(down)))
    ahead = times(radius, cosine(pose.slew))
    across = times(radius, sine(pose.slew))
    return (
        Jet(boom.x + ahead.x, ahead.v, ahead.a),
        Jet(boom.y + across.x, across.v, across.a),
        Jet(boom.z + rise.x, rise.v, rise.a),
    )


@scalar
def rise(attitude, x, y, z, exact):
    r"""Height that a point of the ship at (x, y, z) from the motion unit (jets [m]) has above where the motion unit is
    on a level ship, as a jet [m].

    .. math:: h = \eta + x\sin\theta + \cos\theta\,(y\sin\varphi + z\cos\varphi)

    with exact 1; with 0 its form for small angles, :math:`h = \eta + x\theta + y\varphi + z`.
    """
    roll = attitude.roll
    pitch = attitude.pitch
    turned = times(cosine(pitch), plus(times(y, sine(roll)), times(z, cosine(roll))))
    full = plus(times(x, sine(pitch)), turned)
    small = plus(plus(times(x, pitch), times(y, roll)), z)
    of = Jet(full.x if exact > 0.5 else small.x, full.v if exact > 0.5 else small.v, full.a if exact > 0.5 else small.a)
    return plus(attitude.heave, of)


@scalar
def tip_motion(attitude, pose, boom):
    """Height of the crane tip above boom.z_0, speed and acceleration, up positive, as a jet [m]: that of ship and boom
    together."""
    x, y, z = lever(pose, boom)
    h = rise(attitude, x, y, z, boom.exact)
    return Jet(h.x - boom.z_0, h.v, h.a)


@scalar
def taken(u, v, e, e_v, omega, zeta):
    r"""Second derivative of the heave that the filter takes away [m/s^2], from heave u [m] and its rate v [m/s].

    .. math:: H(s) = \frac{s^2}{s^2 + 2\zeta\omega s + \omega^2}, \qquad
              \ddot e + 2\zeta\omega\dot e + \omega^2 e = 2\zeta\omega\dot u + \omega^2 u
    """
    return 2.0 * zeta * omega * (v - e_v) + omega * omega * (u - e)


@scalar
def filter_step(m, p, q, h, omega, zeta):
    """The filter's memory h [s] later (RK4); heave p at the beginning and q at the end (jets), a cubic in between.

    omega corner of the high-pass [rad/s], zeta its damping [-].
    """
    u = 0.5 * (p.x + q.x) + 0.125 * h * (p.v - q.v)
    v = 1.5 * ((q.x - p.x) / h) - 0.25 * (p.v + q.v)
    a_1 = taken(p.x, p.v, m.e, m.v, omega, zeta)
    v_2 = m.v + 0.5 * h * a_1
    a_2 = taken(u, v, m.e + 0.5 * h * m.v, v_2, omega, zeta)
    v_3 = m.v + 0.5 * h * a_2
    a_3 = taken(u, v, m.e + 0.5 * h * v_2, v_3, omega, zeta)
    v_4 = m.v + h * a_3
    a_4 = taken(q.x, q.v, m.e + h * v_3, v_4, omega, zeta)
    return FilterMemory(
        m.e + h * (m.v + 2.0 * v_2 + 2.0 * v_3 + v_4) / 6.0, m.v + h * (a_1 + 2.0 * a_2 + 2.0 * a_3 + a_4) / 6.0
    )


@scalar
def filtered(heave, m, omega, zeta):
    """Heave as the filter gives it, a jet [m]."""
    return Jet(heave.x - m.e, heave.v - m.v, heave.a - taken(heave.x, heave.v, m.e, m.v, omega, zeta))
