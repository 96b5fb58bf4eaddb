"""A lowering below a supervised winch: its elements, what each of them remembers, and what a run shows of them."""

from typing import NamedTuple

from stillhook.control.supervisor import STAGE_AHC, STAGE_LANDING, LiftSettings, Supervisor
from stillhook.physics.load_path.payload import Payload
from stillhook.physics.load_path.rope import Rope, Sling
from stillhook.physics.scalar import scalar
from stillhook.winches.elements.payload import Body, Field
from stillhook.winches.elements.wire import Hook, Wire
from stillhook.winches.elements.works import Works


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
    stage_number: float


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
