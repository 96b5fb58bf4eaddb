"""A payload in water above a seabed: what it remembers, its momentum over a step, and statistics of its stages.

Forces of water and seabed at an instant: `stillhook.physics.load_path.payload`.
"""

from typing import NamedTuple

from stillhook.physics.load_path.payload import Heights, Water, WaterForce, WettedLevel, submergence
from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, exp, fmax, fmin, scalar

SNAP = 1.0
"""Time after a sling has come taut in which its tension counts as a snap [s]."""
NEVER = 1.0e300


class Field(NamedTuple):
    """Levels of the water below the surface: z_w [m] and i_ds of `stillhook.sea.vessel.realisation.WaveField`; last
    number of the last level."""

    z_w: float
    i_ds: float
    last: float


class Body(NamedTuple):
    """What a payload remembers."""

    water: Water  # at it at the start of the cycle
    level: Heights  # at which that was taken, see `level_of`
    h: float  # submergence for which levels were last looked up [m]
    lo: WettedLevel  # the levels below and above it
    hi: WettedLevel
    a: float  # last acceleration [m/s^2]
    since_taut: float  # time since what is above it came taut [s]
    grounded: float  # 1 once it touched the seabed, until it is clear of it again


class Momentum(NamedTuple):
    """A [kg] and R [kg m/s] of a payload over a step, which would move at R / A without what is above it; force of the
    water at the foreseen speed v [m/s]."""

    A: float
    R: float
    force: WaterForce
    v: float


class LiftStats(NamedTuple):
    """Over one stage, from every step: extremes of sling tension [N], its largest within `SNAP` of coming taut, and
    time without [s]: slack while the load hangs free and slack_landed once it touched the seabed; heights of the
    underside [m] and speeds of the load [m/s]; largest slam, drag, seabed force [N]; first touch-down of a load that
    hung free: time [s] and speed of the load [m/s, downwards], and the highest speed of any touch."""

    F_s_min: float
    F_s_max: float
    snap: float
    slack: float
    slack_landed: float
    z_min: float
    z_max: float
    v_min: float
    v_max: float
    slam: float
    drag: float
    bottom: float
    t_landed: float
    v_landed: float
    v_hit: float


def blank_lift_stats() -> LiftStats:
    """Statistics of nothing yet."""
    return LiftStats(
        F_s_min=NEVER,
        F_s_max=-NEVER,
        snap=0.0,
        slack=0.0,
        slack_landed=0.0,
        z_min=NEVER,
        z_max=-NEVER,
        v_min=NEVER,
        v_max=-NEVER,
        slam=0.0,
        drag=0.0,
        bottom=0.0,
        t_landed=NEVER,
        v_landed=0.0,
        v_hit=0.0,
    )


@scalar
def level_of(z, before, field):
    """Level at height z below still water, as a real number: ln(1 - z / z_w) / ds; before that of a moment ago.

    The logarithm by Halley's method from the value before, cubic: the load moves little within a cycle.
    """
    x = 1.0 + fmax(-z, 0.0) / field.z_w
    y = before / field.i_ds
    for _ in range(3):
        E = exp(y)
        y = y + 2.0 * (x - E) / (x + E)
    return y * field.i_ds


@scalar
def cubic(a, b, c, d, f):
    """Curve through b (f = 0) and c (f = 1) with the slopes of its neighbours (Catmull and Rom)."""
    return b + 0.5 * f * (c - a + f * (2.0 * a - 5.0 * b + 4.0 * c - d + f * (3.0 * (b - c) + d - a)))


with_surface = replace(Water, "eta", "w_1", "w_2")


@scalar
def later(water, tau):
    """The water tau [s] into the cycle."""
    w = water
    return with_surface(w, w.eta + tau * w.eta_dot, w.w_1 + tau * w.b_1, w.w_2 + tau * w.b_2)


@scalar
def on_ground(grounded, z, load):
    """1 once the load touched the seabed, until it is so far above it that it feels the bottom no more; z height of its
    underside [m]."""
    return 1.0 if z < -load.depth or (grounded > 0.0 and z < load.gap_0 - load.depth) else 0.0


@scalar
def fold_step(a, t, h, z_0, v_0, z, v, F_s, snapping, force, grounded, load):
    """Statistics with one more step: t [s] at its end, z_0, v_0 and z, v of the load at its beginning and end, F_s
    sling tension, force WaterForce, grounded before it. A touch has the time and speed at which the load crosses the
    seabed within the step.
    """
    hits = z < -load.depth and z_0 >= -load.depth
    first = hits and grounded == 0.0 and a.t_landed >= NEVER
    part = (z_0 + load.depth) / (z_0 - z) if hits else 1.0
    v_touch = -(v_0 + part * (v - v_0))
    slack, landed = (h if F_s <= 0.0 else 0.0), on_ground(grounded, z, load)
    return LiftStats(
        F_s_min=fmin(a.F_s_min, F_s),
        F_s_max=fmax(a.F_s_max, F_s),
        snap=fmax(a.snap, F_s * snapping),
        slack=a.slack + (1.0 - landed) * slack,
        slack_landed=a.slack_landed + landed * slack,
        z_min=fmin(a.z_min, z),
        z_max=fmax(a.z_max, z),
        v_min=fmin(a.v_min, v),
        v_max=fmax(a.v_max, v),
        slam=fmax(a.slam, force.slam),
        drag=fmax(a.drag, abs(force.drag)),
        bottom=fmax(a.bottom, force.bottom),
        t_landed=t - (1.0 - part) * h if first else a.t_landed,
        v_landed=v_touch if first else a.v_landed,
        v_hit=fmax(a.v_hit, v_touch) if hits else a.v_hit,
    )


@scalar
def place(y, last):
    """Index of the interval that holds y, 0 .. last - 1, and the part of it [-]."""
    i = int(clip(y, 0.0, last - 1.0))
    return i, clip(y - i, 0.0, 1.0)


@scalar
def ahead(q, v, a, tau):
    """Place after tau [s] at speed v [m/s] and acceleration a [m/s^2]."""
    return q + tau * (v + 0.5 * tau * a)


@scalar
def depth_ahead(q, v, body, tau, z_ref, reach, half):
    """Submergence in the middle of a step that begins tau into the cycle, as foreseen [m]; half of the step [s]."""
    z = z_ref + ahead(q, v, body.a, half)
    return submergence(z, later(body.water, tau + half).eta, reach)


@scalar
def momentum(v, v_mid, f, h, load):
    """See `Momentum`: v speed now and v_mid as foreseen for mid-step, when the water acts with f.

    Drag is straightened about v_mid, so that no payload is too light for the step.
    """
    m = load.m + f.m_a
    R = m * v + 0.5 * h * (f.buoyancy + f.inertia + f.drag + f.damping * v_mid + f.slam + f.bottom - load.W)
    return Momentum(m + 0.5 * h * f.damping, R, f, v_mid)


@scalar
def take_weights(H_w, f, dt):
    """Weights of value and rate at both ends of dt [s], at the part f of it: of the value, then of its rate."""
    g = 1.0 - f
    H_w[0] = (1.0 + 2.0 * f) * g * g
    H_w[1] = f * g * g * dt
    H_w[2] = f * f * (3.0 - 2.0 * f)
    H_w[3] = -f * f * g * dt
    H_w[4] = -6.0 * f * g / dt
    H_w[5] = g * (1.0 - 3.0 * f)
    H_w[6] = 6.0 * f * g / dt
    H_w[7] = f * (3.0 * f - 2.0)
