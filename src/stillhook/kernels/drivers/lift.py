"""A lowering below any winch: what a supervisor, a long wire and a payload in water add to the loop of a run."""

from typing import Any, NamedTuple

from stillhook.control.supervisor import Stage
from stillhook.kernels.drivers.loop import Hooks, cycles_of
from stillhook.kernels.drivers.supervised import supervised
from stillhook.kernels.drivers.water import water_at_payload
from stillhook.kernels.drivers.winch import Driver, LaneParts
from stillhook.kernels.drivers.wire import below_winch
from stillhook.kernels.lanes import Array, access, offset
from stillhook.kernels.statistics import window_add, window_turn
from stillhook.physics.load_path.payload import Heights, Water, submergence
from stillhook.physics.scalar import align_stack, fmax, scalar
from stillhook.winches.load_path.lift import Course, Hanging, Lift, LiftSignals, Windowed, relative, signals_of
from stillhook.winches.load_path.payload import Body, take_weights
from stillhook.winches.load_path.wire import Wire

SIGNALS = 4
"""Windowed signals: control error while compensating, tip, payload and hook against the path that the joystick
commands."""
NP = 5 + SIGNALS
"""Numbers that are kept of an interval: largest tension of wire and sling, least of the sling with its sign turned,
largest speeds of tip and wire either way, and the windowed signals' largest peak-to-peak of a window that ends in
it."""


class LiftArrays(NamedTuple):
    """What the kernel of a lowering is given besides a run's: B rows of the wires with N elements each; S rows of
    n_stages stages; T levels of the payload; E samples of the water every dt_w [s] from number i_0 on, with `levels`
    levels (0: still water; E then has motion s, v, a of a deck in cycles from i_0 on, where there is one), H_w room for
    weights; G numbers kept of every stage and starts when each began [s], first those that statistics begin with; P a
    row of NP numbers every n_peak cycles."""

    B: Array
    N: int
    S: Array
    n_stages: int
    T: Array
    E: Array
    H_w: Array
    levels: int
    dt_w: float
    i_0: int
    G: Array
    starts: Array
    first: Array
    P: Array
    n_peak: int


def lane_parts(wire: Any, joint: Any, body: Any) -> LaneParts:
    """What a lane of a lowering holds besides, with these elements."""
    of_joint = {name: getattr(joint, name) for name in ("Link", "Signals", "Stats") if getattr(joint, name) is not None}
    deck = hasattr(body, "Deck")
    return LaneParts(
        stats={"ls": body.LiftStats}
        | ({"cs": of_joint["Stats"]} if "Stats" in of_joint else {})
        | ({"ds": body.Stats} if deck else {}),
        signals={"ly": LiftSignals}
        | ({"cy": of_joint["Signals"]} if "Signals" in of_joint else {})
        | ({"dy": body.Signals} if deck else {}),
        others={
            "hang": Hanging,
            "rows": wire.Rows,
            "momentum": body.Momentum,
            "sums": wire.Sums,
            "F_s": float,
            "lift": Lift,
            **({"link": of_joint["Link"]} if "Link" in of_joint else {}),
            **({"unit_water": Water, "unit_level": Heights} if hasattr(joint, "heights") else {}),
            **({"deck": body.Deck, "push": body.Push} if deck else {}),
            **({"current": float} if hasattr(body, "in_current") else {}),
            "stage": Stage,
            "seen": Windowed,
        },
        windows=SIGNALS,
    )


def deck_below(d: Driver, body: Any) -> tuple[Any, Any, Any]:
    """take_deck(A, E, i): the deck's motion at the start of the cycle from row i of E; followed(b): what the PLC's
    reference has of it [m]; put_deck(A, l, b): its signals. As plain Python."""
    LANES = d.lanes
    if not hasattr(body, "Deck"):

        @scalar
        def no_deck(A, E, i):
            """Nothing."""

        @scalar
        def nothing(b):
            """0: the reference is the tip."""
            return 0.0

        @scalar
        def none_shown(A, l, b):
            """Nothing."""

        return no_deck, nothing, none_shown
    DECK, DY, E_C = (
        offset(d.Lane, "deck", LANES),
        offset(d.Lane, "dy", LANES),
        offset(d.Lane, "y", LANES) + offset(d.Signals, "e_c", LANES),
    )
    put_dy, height, Shown = access(body.Signals, LANES).store, body.deck_height, body.Signals

    @scalar
    def take_deck(A, E, i):
        """Motion s, v, a of every lane's deck."""
        row = E[i * 3 * LANES :]
        for j in range(3 * LANES):
            A[DECK + j] = row[j]

    @scalar
    def followed(b):
        """The deck's motion, where the PLC follows it [m]."""
        return b.deck.followed * b.deck.s

    @scalar
    def put_deck(A, l, b):
        """Height and push of the deck; the control error against what the winch follows."""
        put_dy(A, DY + l, Shown(height(b.deck, 0.0), b.push.F))
        A[E_C + l] -= followed(b)

    return take_deck, followed, put_deck


def run_of(d: Driver, wire: Any, joint: Any, body: Any) -> Any:
    """The kernel of lowerings with the winch of a driver on a path of these elements, as plain Python."""
    LANES, Lane = d.lanes, d.Lane
    take_deck, followed, put_deck = deck_below(d, body)
    water, course = water_at_payload(d, joint, body), supervised(d, followed)
    below = below_winch(d, wire, joint, body, water)
    look_up, take_water, relay, move = water.look_up, water.take_water, below.relay, below.step
    take_current, force_at = water.take_current, water.force
    new_stages, take_stage = course.new_stages, course.take_stage
    load = access(Lane, LANES).load
    put_ly, put_seen = access(LiftSignals, LANES).store, access(Windowed, LANES).store
    Q, V, D, ROW = 0, LANES, 4 * LANES, 5 * LANES
    X, Y, LY, SEEN, HANG = (offset(Lane, f, LANES) for f in ("x", "y", "ly", "seen", "hang"))
    COURSE, WIRE, BODY = (HANG + offset(Hanging, f, LANES) for f in ("course", "wire", "body"))
    DATUM, H_WET = COURSE + offset(Course, "datum", LANES), BODY + offset(Body, "h", LANES)
    V_BEFORE, F_SLING = WIRE + offset(Wire, "v_before", LANES), LY + offset(LiftSignals, "F_sling", LANES)
    PATH = X + offset(d.State, "path", LANES)
    X_S, X_V = (PATH + offset(d.path.State, f, LANES) for f in ("s_load", "v_load"))
    S_LOAD, V_LOAD, F_W, V_TIP, V_W = (
        Y + offset(d.Signals, f, LANES) for f in ("s_load", "v_load", "F_w", "v_tip", "v_w")
    )

    if joint.Signals is None:

        @scalar
        def put_signals(A, l, b, hook, row):
            """The lift's signals of one lane; hook: its row in the wire, the payload's next to it."""
            put_ly(A, LY + l, row)

    else:
        put_cy, CY, joint_signals = access(joint.Signals, LANES).store, offset(Lane, "cy", LANES), joint.signals

        @scalar
        def put_signals(A, l, b, hook, row):
            """The lift's signals of one lane; hook: its row in the wire, the payload's next to it."""
            put_ly(A, LY + l, row)
            x, rate = hook[Q + l] - hook[ROW + Q + l], hook[V + l] - hook[ROW + V + l]
            put_cy(A, CY + l, joint_signals(x, rate, b.lift.sling, b.link))

    @scalar
    def energy(E, b):
        """Without the work against the weight on the wire, of which the audit has its own."""
        return E - b.p.hoist.load.W * b.x.path.s_load

    @scalar
    def show(A, at):
        """See `show_all`."""
        show_all(A, at.B, at.N, at.T)

    @scalar
    def show_all(A, B, N, T):
        """Signals of every lane besides those of the winch. (Arrays as parameters do not overlap for the compiler.)"""
        hook = B[N * ROW :]
        for l in range(LANES):
            b = load(A, l)
            g, q = b.hang.body, hook[ROW + Q + l]
            A[H_WET + l] = submergence(b.lift.z_ref + q, g.water.eta, b.lift.load.reach)
            off = followed(b)
            seen, datum = relative(
                b.hang, b.stage, b.seen, b.lift.settings.code, b.tick.s - off, q - off, hook[Q + l] - off
            )
            put_seen(A, SEEN + l, seen)
            A[DATUM + l] = datum
        look_up(A, T)
        for l in range(LANES):
            b = load(A, l)
            q, v = hook[ROW + Q + l], hook[ROW + V + l]
            z, force = b.lift.z_ref + q, force_at(b, b.lift.z_ref + q, v, b.hang.body.water)
            put_signals(A, l, b, hook, signals_of(z, v, hook[Q + l], hook[V + l], b.F_s, force, b.hang, b.lift.load))
            put_deck(A, l, b)
            A[S_LOAD + l] = q
            A[V_LOAD + l] = v

    @scalar
    def take(A, at, W, i, n_win, full, k):
        """See `take_all`."""
        take_all(A, at.P[(k // at.n_peak) * NP * LANES :], W, i, n_win)

    @scalar
    def take_all(A, P, W, i, n_win):
        """The moving windows of every lane take this cycle's sample as number i of their run, and one that is not full
        yet counts as well; largest values go to their interval."""
        w = SIGNALS * LANES
        for f in range(SIGNALS):
            for l in range(LANES):
                j = f * LANES + l
                P[5 * LANES + j] = fmax(P[5 * LANES + j], window_add(W, w, j, i, n_win, 1.0, A[SEEN + j]))
        for l in range(LANES):
            P[l] = fmax(P[l], A[F_W + l])
            P[LANES + l] = fmax(P[LANES + l], A[F_SLING + l])
            P[2 * LANES + l] = fmax(P[2 * LANES + l], -A[F_SLING + l])
            P[3 * LANES + l] = fmax(P[3 * LANES + l], abs(A[V_TIP + l]))
            P[4 * LANES + l] = fmax(P[4 * LANES + l], abs(A[V_W + l]))
        if i == n_win - 1:
            window_turn(W, w, n_win)

    @scalar
    def arrive(A, at, W, k, n_win, t_cycle, watched):
        """Water, elements of the wire and stage at the start of a cycle."""
        take_deck(A, at.E, k - at.i_0)
        take_current(A, at.B, at.N, at.T)
        if at.levels > 0:
            place = k * t_cycle / at.dt_w
            i = int(place + 1.0e-9)
            take_weights(at.H_w, place - i, at.dt_w)
            sample = at.E[(i - at.i_0) * (2 + 2 * at.levels) * LANES :]
            take_water(A, at.B, at.N, at.T, sample, sample[(2 + 2 * at.levels) * LANES :], at.H_w, at.levels)
        if watched:
            relay(A, at.B, at.N)
        new_stages(A, W, at.G, at.starts, at.first, at.n_stages, k, n_win, t_cycle)
        take_stage(A, at.S, at.n_stages)

    @scalar
    def before(A, at, t, tau, h):
        """Wire and payload move; the winch pulls at a first node that moves evenly."""
        move(A, at.B, at.N, at.T, t, tau, h)
        lead(A, at.B)

    @scalar
    def lead(A, B):
        """The first node's speed in the middle of the step."""
        for l in range(LANES):
            A[X_V + l] = B[D + l]

    @scalar
    def after(A, at):
        """See `follow`."""
        follow(A, at.B)

    @scalar
    def follow(A, B):
        """The first node's place and speed at the end of the step."""
        for l in range(LANES):
            A[X_S + l] = B[Q + l]
            A[X_V + l] = 1.5 * B[D + l] - 0.5 * A[V_BEFORE + l]
            A[V_BEFORE + l] = B[D + l]

    hooks = Hooks(
        arrive=arrive,
        ordered=course.ordered,
        keep=course.keep,
        watch=course.watch,
        energy=energy,
        show=show,
        take=take,
        before=before,
        after=after,
        skips=True,
    )
    cycles = cycles_of(d, hooks)

    def run(
        A: Array,
        B: Array,
        N: int,
        S: Array,
        n_stages: int,
        T: Array,
        E: Array,
        H_w: Array,
        levels: int,
        dt_w: float,
        i_0: int,
        G: Array,
        starts: Array,
        first: Array,
        P: Array,
        n_peak: int,
        D_: Array,
        cols: int,
        H: Array,
        W: Array,
        out: Array,
        lost: Array,
        every: int,
        k_0: int,
        n: int,
        last: int,
        n_win: int,
        sampled: int,
        n_sub: int,
        t_cycle: float,
    ):
        """See `LiftArrays` and `cycles_of`; every and n_peak are multiples of `sampled`."""
        align_stack()
        arrays = LiftArrays(B, N, S, n_stages, T, E, H_w, levels, dt_w, i_0, G, starts, first, P, n_peak)
        cycles(A, arrays, D_, cols, H, W, out, lost, every, k_0, n, 0, last, n_win, sampled, n_sub, t_cycle)

    return run
