"""A lowering below any winch: what a supervisor, a long wire and a payload in water add to the loop of a run."""

from typing import Any, NamedTuple

from stillhook.control.plc import Memory, Plc
from stillhook.control.supervisor import STAGE_LANDING, Stage, Supervisor, Watch, supervise
from stillhook.kernels.drivers.loop import Hooks, cycles_of, ordered_of
from stillhook.kernels.drivers.water import water_at_payload
from stillhook.kernels.drivers.winch import Driver, LaneParts
from stillhook.kernels.drivers.wire import below_winch
from stillhook.kernels.lanes import Array, access, offset, size
from stillhook.kernels.statistics.cycles import window_add, window_turn
from stillhook.physics.load_path.payload import submergence, water_force, wetted
from stillhook.physics.records import replace
from stillhook.physics.scalar import align_stack, fmax, scalar
from stillhook.winches.elements.lift import Course, Hanging, Lift, LiftSignals, Windowed, compensating, waiting
from stillhook.winches.elements.payload import NEVER, Body, LiftStats, Momentum, take_weights
from stillhook.winches.elements.wire import Rows, Sums, Wire
from stillhook.winches.records import Geometry, Tick, Tip

SIGNALS = 4
"""Windowed signals: control error while compensating, tip, payload and hook against the path that the joystick
commands."""
NP = 5 + SIGNALS
"""Numbers that are kept of an interval: largest tension of wire and sling, least of the sling with its sign turned,
largest speeds of tip and wire either way, and the windowed signals' largest peak-to-peak of a window that ends in
it."""
STAGE_SIZE = size(Stage)


class Given(NamedTuple):
    """What the kernel of a lowering is given besides a run's: B rows of the wires with N elements each; S rows of
    n_stages stages; T levels of the payload; E samples of the water every dt_w [s] from number i_0 on, with `levels`
    levels (0: still water), H_w room for weights; G numbers kept of every stage and starts when each began [s], first
    those that statistics begin with; P a row of NP numbers every n_peak cycles."""

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


def lane_parts(joint: Any) -> LaneParts:
    """What a lane of a lowering holds besides, with this joint between hook and payload."""
    own = {name: getattr(joint, name) for name in ("Link", "Signals", "Stats") if getattr(joint, name) is not None}
    return LaneParts(
        stats={"ls": LiftStats} | ({"cs": own["Stats"]} if "Stats" in own else {}),
        signals={"ly": LiftSignals} | ({"cy": own["Signals"]} if "Signals" in own else {}),
        others={
            "hang": Hanging,
            "rows": Rows,
            "momentum": Momentum,
            "sums": Sums,
            "F_s": float,
            "lift": Lift,
            **({"link": own["Link"]} if "Link" in own else {}),
            "stage": Stage,
            "seen": Windowed,
        },
        windows=SIGNALS,
    )


def run_of(d: Driver, joint: Any) -> Any:
    """The kernel of lowerings with the winch of a driver and what joins hook and payload, as plain Python."""
    LANES, Lane, geometry, sensing, path_point = d.lanes, d.Lane, d.geometry, d.sensing, d.path_point
    water = water_at_payload(d)
    below = below_winch(d, joint, water)
    look_up, take_water, relay, move = water.look_up, water.take_water, below.relay, below.step
    Ordered = ordered_of(d, sup=Supervisor)

    def store(cls: Any) -> Any:
        return access(cls, LANES).store

    load = access(Lane, LANES).load
    with_plc, with_tau, with_F = replace(d.Params, "plc"), replace(Plc, "tau_F"), replace(Memory, "F")
    with_c, with_orders = replace(Geometry, "c"), replace(Tick, "v_op", "s_op", "mode")
    put_ly, put_sup, put_seen = store(LiftSignals), store(Supervisor), store(Windowed)
    Q, V, D, ROW = 0, LANES, 4 * LANES, 5 * LANES
    X, ST, Y, LY, STAGE_NOW, SEEN, HANG = (
        offset(Lane, f, LANES) for f in ("x", "st", "y", "ly", "stage", "seen", "hang")
    )
    COURSE, WIRE, BODY = (HANG + offset(Hanging, f, LANES) for f in ("course", "wire", "body"))
    SUP, S_JOY, E_HELD, STAGE, K_STAGE, DATUM = (COURSE + offset(Course, f, LANES) for f in Course._fields)
    V_BEFORE, H_WET = WIRE + offset(Wire, "v_before", LANES), BODY + offset(Body, "h", LANES)
    SUP_STAGE, SUP_DONE = (SUP + offset(Supervisor, f, LANES) for f in ("stage", "done"))
    PATH = X + offset(d.State, "path", LANES)
    X_S, X_V = (PATH + offset(d.path.State, f, LANES) for f in ("s_load", "v_load"))
    S_LOAD, V_LOAD, F_W, V_TIP, V_W = (
        Y + offset(d.Signals, f, LANES) for f in ("s_load", "v_load", "F_w", "v_tip", "v_w")
    )
    NT = size(d.Stats) + sum(map(size, d.parts.stats.values()))
    NG = NT + SIGNALS
    F_SLING = LY + offset(LiftSignals, "F_sling", LANES)

    if joint.Signals is None:

        @scalar
        def put_signals(A, l, b, hook, row):
            """The lift's signals of one lane; hook: its row in the wire, the payload's next to it."""
            put_ly(A, LY + l, row)

    else:
        put_cy, CY, joint_signals = store(joint.Signals), offset(Lane, "cy", LANES), joint.signals

        @scalar
        def put_signals(A, l, b, hook, row):
            """The lift's signals of one lane; hook: its row in the wire, the payload's next to it."""
            put_ly(A, LY + l, row)
            x, rate = hook[Q + l] - hook[ROW + Q + l], hook[V + l] - hook[ROW + V + l]
            put_cy(A, CY + l, joint_signals(x, rate, b.lift.sling, b.link))

    @scalar
    def new_stages(A, W_, G, starts, first, n_stages, k, n_win, t_cycle):
        """Where another stage is in force: statistics of the last one go to G, and restart from the numbers in
        `first`."""
        w = SIGNALS * LANES
        for l in range(LANES):
            now = A[SUP_STAGE + l] + A[SUP_DONE + l]
            if now != A[STAGE + l]:
                s_0 = min(max(int(A[STAGE + l]), 0), n_stages)
                starts[s_0 * LANES + l] = A[K_STAGE + l] * t_cycle
                into = G[s_0 * NG * LANES :]
                for f in range(NT):
                    into[f * LANES + l] = A[ST + f * LANES + l]
                    A[ST + f * LANES + l] = first[f]
                for s in range(SIGNALS):
                    j = s * LANES + l
                    into[(NT + s) * LANES + l] = W_[2 * w + j]
                    W_[j] = 1.0e308
                    W_[w + j] = -1.0e308
                    W_[2 * w + j] = 0.0
                    for i in range(n_win + 1):
                        W_[(3 + i) * w + j] = 1.0e308
                        W_[(3 + n_win + 1 + i) * w + j] = -1.0e308
                A[STAGE + l] = now
                A[E_HELD + l] = 0.0
                A[DATUM + l] = NEVER
                A[K_STAGE + l] = k

    @scalar
    def ordered(b, t):
        """What the supervisor orders one lane at t [s]."""
        tip = Tip(b.tick.s, b.tick.v)
        e, rope = b.hang.wire.element, b.lift.rope
        # from drum to tip the wire is damped as its elements are
        geo = with_c(geometry(b.x.path.s_w, b.p), e.c / e.k * rope.EA / rope.L_0)
        q = path_point(b.x, geo, tip, b.p)
        raw, _, _ = sensing(b.x.winch, b.x.path, q, b.m, b.tick, geo, b.laws, b.p)
        seen = Watch(t=t, s_w=raw.s_w, F=raw.F, s_tip=raw.s_tip, v_tip=raw.v_tip)
        order, sup = supervise(seen, b.hang.course.sup, b.stage, b.lift.settings)
        tick = with_orders(b.tick, order.v_op, order.s_op, order.mode)
        held = order.hold > 0.5
        m = with_F(b.m, order.F_hold if held else b.m.F)
        p = with_plc(b.p, with_tau(b.p.plc, 1.0e300 if held else b.p.plc.tau_F))
        return Ordered(tip, geo, q, tick, m, p, sup)

    @scalar
    def keep(A, l, b, o):
        """Lane l with what the supervisor decided."""
        A[S_JOY + l] = b.hang.course.s_joy + o.sup.v_joy * b.lift.t_cycle
        put_sup(A, SUP + l, o.sup)

    @scalar
    def seen(A, l, b, o, y):
        """The control error while the winch compensates, the last one while it does not."""
        A[E_HELD + l] = y.e_c if compensating(o.sup, b.stage, b.lift.settings.code) > 0.5 else b.hang.course.e_held

    @scalar
    def energy(E, b):
        """Without the work against the weight on the wire, of which the audit has its own."""
        return E - b.p.hoist.load.W * b.x.path.s_load

    @scalar
    def take_stage(A, S, n_stages):
        """Every lane's stage in force."""
        for l in range(LANES):
            row = S[min(max(int(A[SUP_STAGE + l]), 0), n_stages - 1) * STAGE_SIZE * LANES :]
            for f in range(STAGE_SIZE):
                A[STAGE_NOW + f * LANES + l] = row[f * LANES + l]

    @scalar
    def show(A, at):
        """Signals of every lane besides those of the winch."""
        signals_of(A, at.B, at.N, at.T)

    @scalar
    def signals_of(A, B, N, T):
        """See `show`."""
        hook = B[N * ROW :]
        for l in range(LANES):
            b = load(A, l)
            s_load = hook[ROW + Q + l]
            A[H_WET + l] = submergence(b.lift.z_ref + s_load, b.hang.body.water.eta, b.lift.load.reach)
            sup, relative = b.hang.course.sup, s_load - b.hang.course.s_joy
            over = sup.stage + sup.done != b.hang.course.stage or (
                b.stage.mode == STAGE_LANDING and (sup.landed > 0.0 or b.hang.body.grounded > 0.0)
            )
            restarts = b.hang.course.datum >= NEVER or waiting(sup, b.stage, b.lift.settings.code) > 0.5
            datum = relative if restarts and not over else b.hang.course.datum
            stretch = hook[Q + l] - s_load
            put_seen(
                A,
                SEEN + l,
                Windowed(
                    b.hang.course.e_held,
                    b.tick.s,
                    b.seen.load if over else relative - datum,
                    b.seen.hook if over else relative + stretch - datum,
                ),
            )
            A[DATUM + l] = datum
        look_up(A, T)
        for l in range(LANES):
            b = load(A, l)
            s_load, v_load = hook[ROW + Q + l], hook[ROW + V + l]
            z, water = b.lift.z_ref + s_load, b.hang.body.water
            force = water_force(z, v_load, wetted(b.hang.body.h, b.hang.body.lo, b.hang.body.hi), water, b.lift.load)
            h = submergence(z, water.eta, b.lift.load.H)
            put_signals(
                A,
                l,
                b,
                hook,
                LiftSignals(
                    z_load=z,
                    s_hook=hook[Q + l],
                    v_hook=hook[V + l],
                    F_sling=b.F_s,
                    F_buoyancy=force.buoyancy,
                    F_inertia=force.inertia,
                    F_drag=force.drag,
                    F_slam=force.slam,
                    F_bottom=force.bottom,
                    eta=water.eta,
                    w_water=0.5 * (water.w_1 + water.w_2),
                    h_load=h,
                    stage_number=b.hang.course.stage,
                ),
            )
            A[S_LOAD + l] = s_load
            A[V_LOAD + l] = v_load

    @scalar
    def take(A, at, W, i, n_win, full, k):
        """See `windows`; a window that is not full yet counts as well."""
        windows(A, W, at.P[(k // at.n_peak) * NP * LANES :], i, n_win)

    @scalar
    def windows(A, W_, P, i, n_win):
        """The moving windows of every lane take this cycle's sample as number i of their run; largest values go to the
        interval P."""
        w = SIGNALS * LANES
        for f in range(SIGNALS):
            for l in range(LANES):
                j = f * LANES + l
                span = window_add(W_, w, j, i, n_win, 1.0, A[SEEN + j])
                P[5 * LANES + j] = fmax(P[5 * LANES + j], span)
        for l in range(LANES):
            P[l] = fmax(P[l], A[F_W + l])
            P[LANES + l] = fmax(P[LANES + l], A[F_SLING + l])
            P[2 * LANES + l] = fmax(P[2 * LANES + l], -A[F_SLING + l])
            P[3 * LANES + l] = fmax(P[3 * LANES + l], abs(A[V_TIP + l]))
            P[4 * LANES + l] = fmax(P[4 * LANES + l], abs(A[V_W + l]))
        if i == n_win - 1:
            window_turn(W_, w, n_win)

    @scalar
    def arrive(A, at, W, k, n_win, t_cycle, watched):
        """Water, elements of the wire and stage at the start of a cycle."""
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
        """The first node's speed in the middle of the step, for the winch."""
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
        ordered=ordered,
        keep=keep,
        watch=seen,
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
        every: int,
        k_0: int,
        n: int,
        last: int,
        n_win: int,
        sampled: int,
        n_sub: int,
        t_cycle: float,
    ):
        """See `Given` and `cycles_of`; every and n_peak are multiples of `sampled`."""
        align_stack()
        given = Given(B, N, S, n_stages, T, E, H_w, levels, dt_w, i_0, G, starts, first, P, n_peak)
        cycles(A, given, D_, cols, H, W, out, every, k_0, n, 0, last, n_win, sampled, n_sub, t_cycle)

    return run
