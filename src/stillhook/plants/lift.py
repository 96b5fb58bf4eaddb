"""What hangs below the crane tip: a long wire, hook, slings and a payload between air, water and seabed, under a supervised winch."""

from typing import NamedTuple

from stillhook.control.lift_modes import STAGE_AHC, STAGE_LANDING, LiftSettings, Supervisor
from stillhook.physics.payload import Payload, Water
from stillhook.physics.rope import Element, Rope, Sling
from stillhook.physics.scalar import clip, exp, fmax, fmin, scalar

SNAP = 1.0
"""Time after a sling has come taut in which its tension counts as a snap [s]."""
NEVER = 1.0e300


class Hook(NamedTuple):
    """m mass [kg]; W weight; its own buoyancy is left out [N]."""

    m: float
    W: float


class Field(NamedTuple):
    """Levels of the water below the surface: z_w [m] and i_ds of `stillhook.sea.kinematics.WaveField`; last number of the last level."""

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
    """Work since the start [J]: top from the winch into the wire; damping of wire and sling, gravity that was worked against; of the water
    and the seabed on the load, positive where it speeds the load up: buoyancy, inertia (added mass included), drag, slam, bottom;
    relay energy that wire brings along as it leaves the drum."""

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
    """What a lift remembers beside wire rows and winch: supervisor; element of the wire in this cycle; water at the load at the start
    of the cycle; level at which it was taken, see `level_of`; omega_0 motor speed one step ago [rad/s]; a_load last acceleration of the
    load [m/s^2]; since_taut time since the slings came taut [s]; s_joy path that the joystick asked for [m]; e_held control error while
    compensating, the last one while not [m]; stage and k_stage that statistics are of, and the cycle it began; E energy in wire, hook,
    load and slings, E_0 that at the start [J]; v_before speed of the first node in the middle of the last step but one [m/s];
    datum payload beside the joystick's path when compensation began [m]."""

    sup: Supervisor
    element: Element
    water: Water
    level: float
    omega_0: float
    a_load: float
    since_taut: float
    s_joy: float
    e_held: float
    stage: float
    k_stage: float
    E: float
    E_0: float
    works: Works
    v_before: float
    datum: float


class LiftStats(NamedTuple):
    """Over one stage, from every step: extremes of sling tension [N], its largest within `SNAP` of coming taut, and time without [s];
    heights of the underside [m] and speeds of the load [m/s]; largest slam, drag, seabed force [N]; first touch-down: time [s] and speed
    of the load [m/s, downwards], and the highest speed of any touch."""

    F_s_min: float
    F_s_max: float
    snap: float
    slack: float
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
    """Columns of a series beside `Signals`; names and units as in `stillhook.variables`."""

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


def blank_lift_stats() -> LiftStats:
    """Statistics of nothing yet."""
    return LiftStats(NEVER, -NEVER, 0.0, 0.0, NEVER, -NEVER, NEVER, -NEVER, 0.0, 0.0, 0.0, NEVER, 0.0, 0.0)


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


@scalar
def later(water, tau):
    """The water tau [s] into the cycle."""
    return Water(water.eta + tau * water.eta_dot, water.eta_dot, water.w + tau * water.a, water.a)


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
def fold_step(a, t, h, z, v, F_s, snapping, force, bottom_before, load):
    """Statistics with one more step: t [s] at its end, z and v of the load, F_s sling tension, force WaterForce."""
    hits = z < -load.depth and not bottom_before
    first = hits and a.t_landed >= NEVER
    return LiftStats(
        F_s_min=fmin(a.F_s_min, F_s),
        F_s_max=fmax(a.F_s_max, F_s),
        snap=fmax(a.snap, F_s * snapping),
        slack=a.slack + (h if F_s <= 0.0 else 0.0),
        z_min=fmin(a.z_min, z),
        z_max=fmax(a.z_max, z),
        v_min=fmin(a.v_min, v),
        v_max=fmax(a.v_max, v),
        slam=fmax(a.slam, force.slam),
        drag=fmax(a.drag, abs(force.drag)),
        bottom=fmax(a.bottom, force.bottom),
        t_landed=t if first else a.t_landed,
        v_landed=-v if first else a.v_landed,
        v_hit=fmax(a.v_hit, -v) if hits else a.v_hit,
    )


@scalar
def place(y, last):
    """Index of the interval in which y lies, 0 .. last - 1, and the part of it [-]."""
    i = int(clip(y, 0.0, last - 1.0))
    return i, clip(y - i, 0.0, 1.0)
