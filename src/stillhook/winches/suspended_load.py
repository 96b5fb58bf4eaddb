"""What hangs below the crane tip: a long wire, hook, slings and a payload between air, water and seabed, under a
supervised winch."""

from typing import NamedTuple

from stillhook.control.supervisor import STAGE_AHC, STAGE_LANDING, LiftSettings, Supervisor
from stillhook.physics.load_path.drum import wire_stiffness
from stillhook.physics.load_path.payload import Heights, Payload, Water, WaterForce
from stillhook.physics.load_path.rope import Element, Rope, Sling
from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, exp, fmax, fmin, scalar

SNAP = 1.0
"""Time after a sling has come taut in which its tension counts as a snap [s]."""
NEVER = 1.0e300


class Hook(NamedTuple):
    """m mass [kg]; W weight; its own buoyancy is left out [N]."""

    m: float
    W: float


class Field(NamedTuple):
    """Levels of the water below the surface: z_w [m] and i_ds of `stillhook.sea.vessel.realisation.WaveField`; last
    number of the last level."""

    z_w: float
    i_ds: float
    last: float


class Lift(NamedTuple):
    """z_ref height of the payload's underside at displacement 0, above still water [m]; t_cycle [s]."""

    rope: Rope
    sling: Sling
    hook: Hook
    load: Payload
    settings: LiftSettings
    field: Field
    z_ref: float
    t_cycle: float


class Works(NamedTuple):
    """Work since the start [J]: top from the winch into the wire; damping of wire and sling, gravity that was worked
    against; of the water and the seabed on the load, positive where it speeds the load up: buoyancy, inertia (added
    mass included), drag, slam, bottom; relay energy that wire brings along as it leaves the drum."""

    top: float
    damping: float
    gravity: float
    buoyancy: float
    inertia: float
    drag: float
    slam: float
    bottom: float
    relay: float


class Hanging(NamedTuple):
    """Memory of a lift besides wire rows and winch."""

    sup: Supervisor
    element: Element  # of the wire in this cycle
    water: Water  # at the load at the start of the cycle
    level: Heights  # at which it was taken, see `level_of`
    v_w_0: float  # wire speed one step ago [m/s]
    a_load: float  # last acceleration of the load [m/s^2]
    since_taut: float  # time since the slings came taut [s]
    s_joy: float  # path that the joystick commands [m]
    e_held: float  # control error while compensating, the last one while not [m]
    stage: float  # of which statistics are
    k_stage: float  # cycle in which it began
    E: float  # energy in wire, hook, load and slings [J]
    E_0: float  # that at the start [J]
    works: Works
    v_before: float  # speed of the first node in the middle of the last step but one [m/s]
    datum: float  # payload relative to the joystick's path when compensation began [m]
    grounded: float  # 1 once the load touched the seabed, until it is clear of it again


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


class LiftSignals(NamedTuple):
    """Columns of a series in addition to `Signals`; names and units as in `stillhook.variables`."""

    z_load: float
    s_hook: float
    v_hook: float
    F_sling: float
    F_buoyancy: float
    F_inertia: float
    F_drag: float
    F_slam: float
    F_bottom: float
    eta: float
    w_water: float
    h_load: float
    stage_number: float


class Solve(NamedTuple):
    """What the rows of a wire share in a step: d, off interior diagonal and off-diagonal [kg]; first row: d_0 diagonal
    [kg], T_0 the winch's pull on a node at rest [N] and G_0 its fall per speed of the node [N s/m], taut 1 where the
    wire pulls at the winch, else 0; payload: A_p [kg], R_p [kg m/s], force of the water at the foreseen speed v_mid
    [m/s]."""

    d: float
    off: float
    d_0: float
    T_0: float
    G_0: float
    taut: float
    A_p: float
    R_p: float
    force: WaterForce
    v_mid: float


class Windowed(NamedTuple):
    """What the moving windows take: e_c while compensating, tip, payload and hook against the joystick's path [m]. A
    window that is not yet full counts as well: what it spans, the first full one of the stage spans too."""

    e_c: float
    tip: float
    load: float
    hook: float


class Sums(NamedTuple):
    """Over the wire in one step: damping of the elements and gravity, as power [W]."""

    damping: float
    gravity: float


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
def compensating(sup, stage, code):
    """1 where this stage holds the load in place against the tip: AHC, or landing before touch-down."""
    active = sup.entered > 0.0 and (stage.mode == STAGE_AHC or (stage.mode == STAGE_LANDING and sup.landed == 0.0))
    return 1.0 if active and sup.mode == code else 0.0


@scalar
def waiting(sup, stage, code):
    """1 in a stage that compensates, before its compensation has begun."""
    wants = (stage.mode == STAGE_AHC or stage.mode == STAGE_LANDING) and sup.landed == 0.0
    return 1.0 - compensating(sup, stage, code) if wants else 0.0


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
def begin(b, v_w, q, v, v_mid, f, h):
    """What the rows of one lane's wire share in this step: v_w wire speed that the winch gives [m/s]; q displacement of
    its first node [m]; v speed of its payload now and v_mid as foreseen for mid-step, when the water acts with f.

    Drag is straightened about v_mid, so that no payload is too light for the step.
    """
    e, y = b.hang.element, b.x.path
    G = 0.5 * h * (e.c + 0.5 * h * e.k)
    k_0, c_0 = wire_stiffness(y.s_w, b.p.hoist.wire), b.geo.c
    half = 0.5 * (v_w - b.hang.v_w_0)
    s_w = y.s_w - 0.5 * h * (v_w + 0.5 * half)
    top = b.tip_1.s - (s_w - b.p.hoist.s_w_0)
    v_top = b.tip_1.v + v_w + half
    G_0 = 0.5 * h * k_0 + c_0
    T_0 = k_0 * (top - q) + c_0 * v_top
    taut = 1.0 if T_0 - G_0 * y.v_load > 0.0 else 0.0
    m = b.lift.load.m + f.m_a
    R_p = m * v + 0.5 * h * (f.buoyancy + f.inertia + f.drag + f.damping * v_mid + f.slam + f.bottom - b.lift.load.W)
    return Solve(
        d=10.0 * e.m + 2.0 * G,
        off=e.m - G,
        d_0=5.0 * e.m + G + taut * 0.5 * h * G_0,
        T_0=T_0,
        G_0=G_0,
        taut=taut,
        A_p=m + 0.5 * h * f.damping,
        R_p=R_p,
        force=f,
        v_mid=v_mid,
    )


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
