"""A lowering below a supervised winch: its elements, what each of them remembers, the work that passes through them,
and what a run shows of them."""

from typing import NamedTuple

from stillhook.control.supervisor import STAGE_AHC, STAGE_LANDING, LiftSettings, Supervisor
from stillhook.physics.load_path.payload import Payload, submergence
from stillhook.physics.load_path.rope import Rope, Sling
from stillhook.physics.records import replace
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.payload import NEVER, Body, Field
from stillhook.winches.load_path.wire import Hook, Wire


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


with_joint, with_wire = replace(Works, "damping", "buoyancy"), replace(Works, "top", "damping", "gravity")
with_relay = replace(Works, "relay")


@scalar
def of_body(w, p, v, dv, h, load):
    """A body's step h [s]: p `Momentum` with which it was solved, v its speed in the middle, dv what it gained [m/s].

    The water's force is that at the foreseen speed, its drag straightened from there.
    """
    f = p.force
    return Works(
        top=w.top,
        damping=w.damping,
        gravity=w.gravity + h * load.W * v,
        buoyancy=w.buoyancy + h * f.buoyancy * v,
        inertia=w.inertia + (h * f.inertia - f.m_a * dv) * v,
        drag=w.drag + h * (f.drag - f.damping * (v - p.v)) * v,
        slam=w.slam + h * f.slam * v,
        bottom=w.bottom + h * f.bottom * v,
        relay=w.relay,
    )


@scalar
def of_joint(w, F, sea, rate, stored, h):
    """A joint's step: force F [N] and the sea's part of it, rate at which its ends part [m/s], what it stored [J]."""
    return with_joint(w, w.damping + ((F - sea) * rate * h - stored), w.buoyancy - sea * rate * h)


@scalar
def of_wire(w, rows, v, sums, h):
    """A wire's step: v speed of its first node in the middle [m/s]."""
    top = rows.taut * (rows.T_0 - rows.G_0 * v)
    return with_wire(w, w.top + h * top * v, w.damping + h * sums.damping, w.gravity + h * sums.gravity)


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


class Course(NamedTuple):
    """How far a programme is."""

    sup: Supervisor
    s_joy: float  # path that the joystick commands [m]
    e_held: float  # control error while compensating, the last one while not [m]
    stage: float  # of which statistics are
    k_stage: float  # cycle in which it began
    datum: float  # payload relative to the joystick's path when compensation began [m]


class Hanging(NamedTuple):
    """Memory of a lift besides the rows of its wire and the winch."""

    course: Course
    wire: Wire
    body: Body
    works: Works
    E: float  # energy in wire, hook, load and joint [J]
    E_0: float  # that at the start [J]


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
    phase_number: float


class Windowed(NamedTuple):
    """What the moving windows take: e_c while compensating, tip, payload and hook against the joystick's path [m]. A
    window that is not yet full counts as well: what it spans, the first full one of the stage spans too."""

    e_c: float
    tip: float
    load: float
    hook: float


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
def relative(hang, stage, seen, code, s_tip, q, q_hook):
    """What the windows take, and the datum of payload and hook: place of the payload against the joystick's path as
    compensation begins. Both stand still once the stage is over or the payload has landed.

    Parameters: seen what they took before; q, q_hook displacements of payload and hook [m].
    """
    c = hang.course
    landed = stage.mode == STAGE_LANDING and (c.sup.landed > 0.0 or hang.body.grounded > 0.0)
    over, way = c.sup.stage + c.sup.done != c.stage or landed, q - c.s_joy
    restarts = c.datum >= NEVER or waiting(c.sup, stage, code) > 0.5
    datum = way if restarts and not over else c.datum
    load, hook = way - datum, way + (q_hook - q) - datum
    return Windowed(c.e_held, s_tip, seen.load if over else load, seen.hook if over else hook), datum


@scalar
def signals_of(z, v, q_hook, v_hook, F_sling, force, hang, load):
    """A row of the series: z height of the payload's underside above still water [m], v its speed [m/s], force of the
    water on it."""
    water = hang.body.water
    return LiftSignals(
        z_load=z,
        s_hook=q_hook,
        v_hook=v_hook,
        F_sling=F_sling,
        F_buoyancy=force.buoyancy,
        F_inertia=force.inertia,
        F_drag=force.drag,
        F_slam=force.slam,
        F_bottom=force.bottom,
        eta=water.eta,
        w_water=0.5 * (water.w_1 + water.w_2),
        h_load=submergence(z, water.eta, load.H),
        phase_number=hang.course.stage,
    )
