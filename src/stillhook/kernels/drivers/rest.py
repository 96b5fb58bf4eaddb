"""What sets the lanes of a driver to rest, and what their PLC reads now."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from stillhook.control.interface import Sensed
from stillhook.control.plc import Memory, memory_before
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import Array, access, offset
from stillhook.physics.load_path.drum import suspended_load
from stillhook.physics.records import replace
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.load import Hoist
from stillhook.winches.records import Tip


class Beginning(NamedTuple):
    """What a run begins with: payload and hook [kg]; displaced mass of water, added mass [kg] and drag [N s^2/m^2] of
    the payload, current across it [m/s]; s_w wire out [m]."""

    payload: float
    hook: float
    displaced: float
    added: float
    drag: float
    U: float
    s_w: float


@dataclass(frozen=True)
class Rest:
    """at_rest(A), prepare(A, S) and read(A, S) of a driver."""

    at_rest: Any
    prepare: Any
    read: Any


def rest_of(d: Driver) -> Rest:
    """How a driver's lanes come to rest, as plain Python."""
    LANES = d.lanes
    State, Lane, Command, Params = d.State, d.Lane, d.Command, d.Params
    geometry, control, path_point = d.geometry, d.control, d.path_point
    start, settle, sensing = d.plant.start, d.plant.settle, d.sensing
    path_start, path_weight = d.path.start, d.path.weight
    load, beginning = access(Lane, LANES).load, access(Beginning, LANES).load
    put_x, put_u, put_m = access(State, LANES).store, access(Command, LANES).store, access(Memory, LANES).store
    put_params, put_sensed = access(Params, LANES).store, access(Sensed, LANES).store
    with_hoist, with_load = replace(Params, "hoist"), replace(Hoist, "load", "s_w_0")
    with_path, with_wire_out = replace(State, "path"), replace(d.path.State, "s_w")
    with_start = replace(Lane, "x", "m", "p")
    X, U, M, P = (offset(Lane, f, LANES) for f in ("x", "u", "m", "p"))

    @scalar
    def rest(s_w, m, laws, tick, p):
        """State, memory and commands with the load hanging still on s_w of wire [m]. The controllers remember nothing
        yet: the pressures that the PLC read for these commands are those of a winch without its load."""
        tip, geo = Tip(tick.s, 0.0), geometry(s_w, p)
        x = State(start(s_w, tick, p), path_start(s_w, tick, p))
        u, m, _, _ = control(x, m, laws, tick, tip, geo, p)
        q = path_point(x, geo, tip, p)
        return State(settle(x.winch, q, u, tick, geo, p), x.path), m, u

    def at_rest(A: Array):
        """Every lane's state, memory and commands at rest, from its wire paid out, first Tick and parameters."""
        for l in range(LANES):
            b = load(A, l)
            x, m, u = rest(b.x.path.s_w, b.m, b.laws, b.tick, b.p)
            put_x(A, X + l, x)
            put_u(A, U + l, u)
            put_m(A, M + l, m)

    @scalar
    def prepared(b, o):
        """A lane before its rest as o says: the reference is where the wire is."""
        h = with_load(b.p.hoist, suspended_load(o.payload, o.hook, o.displaced, o.added, o.drag, o.U), o.s_w)
        p = with_hoist(b.p, h)
        m = memory_before(b.m, path_weight(b.tick, p), o.s_w, b.tick.s_m, b.tick.mode, b.tick.v_op, p.plc)
        return with_start(b, with_path(b.x, with_wire_out(b.x.path, o.s_w)), m, p)

    def prepare(A: Array, S: Array):
        """Every lane before `at_rest` with a `Beginning` of S; its first Tick and the records say the rest."""
        for l in range(LANES):
            b = prepared(load(A, l), beginning(S, l))
            put_x(A, X + l, b.x)
            put_m(A, M + l, b.m)
            put_params(A, P + l, b.p)

    def read(A: Array, S: Array):
        """What the PLC of every lane reads now, a `Sensed` for each in S."""
        for l in range(LANES):
            b = load(A, l)
            tip, geo = Tip(b.tick.s, b.tick.v), geometry(b.x.path.s_w, b.p)
            q = path_point(b.x, geo, tip, b.p)
            sensed, _, _ = sensing(b.x.winch, b.x.path, q, b.m, b.tick, geo, b.laws, b.p)
            put_sensed(S, l, sensed)

    return Rest(at_rest, prepare, read)
