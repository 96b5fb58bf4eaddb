"""Lowerings with any winch, for one trajectory or sixteen side by side: supervisor, PLC, wire and payload, cycle by
cycle.

`stillhook.kernels.build.driver` makes it of the winch's own driver and of the wire and payload below it
(`stillhook.kernels.drivers.lift_wire`), and compiles what runs.
"""

from dataclasses import dataclass
from typing import Any

from stillhook.control.plc import Memory, Plc
from stillhook.control.supervisor import STAGE_LANDING, Stage, Supervisor, Watch, supervise
from stillhook.kernels.drivers.lift_wire import lift_wire
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import Array, access, offset, size
from stillhook.kernels.statistics.cycles import window_add, window_turn
from stillhook.physics.load_path.payload import submergence, water_force, wetted
from stillhook.physics.records import record, replace
from stillhook.physics.scalar import align_stack, fmax, scalar
from stillhook.winches.records import Geometry, Tick, Tip
from stillhook.winches.suspended_load import (
    NEVER,
    Hanging,
    LiftSignals,
    LiftStats,
    Windowed,
    compensating,
    take_weights,
    waiting,
)

SIGNALS = 4
"""Windowed signals: control error while compensating, tip, payload and hook against the path that the joystick
commands."""
NP = 5 + SIGNALS
"""Numbers that are kept of an interval: largest tension of wire and sling, least of the sling with its sign turned,
largest speeds of tip and wire either way, and the windowed signals' largest peak-to-peak of a window that ends in
it."""
STAGE_SIZE = size(Stage)


@dataclass(eq=False)
class LiftDriver:
    """What runs a lowering: the driver of its winch; what joins hook and payload; Lane, everything that one trajectory
    carries; numbers of all statistics (NT) and of all that is kept of a stage (NG); columns of a series (NS), those in
    addition to the winch's by name; run, a kernel."""

    winch: Driver
    joint: Any
    Lane: Any
    NT: int
    NG: int
    NS: int
    columns: tuple[str, ...]
    run: Any


def lift_driver(winch: Driver, joint: Any) -> LiftDriver:
    """The driver of lowerings with the winch of a driver and what joins hook and payload, as plain Python."""
    LANES, plant = winch.lanes, winch.plant
    wire = lift_wire(winch, joint)
    Lane, look_up, relay, take_water, wire_step = wire.Lane, wire.look_up, wire.relay, wire.take_water, wire.wire_step
    circuit, geometry, sensing, stored_energy = plant.circuit, plant.geometry, winch.sensing, plant.stored_energy
    control, signals, fold, path_point = winch.control, winch.signals, winch.fold, winch.path_point
    step, in_force, tip_between = winch.step, winch.in_force, winch.tip_between
    take_tick, watch, path_energy = winch.take_tick, winch.watch, winch.path.energy
    Ordered = record(
        "Ordered",
        Lane.__module__,
        tip=Tip,
        geo=Geometry,
        q=winch.path.Point,
        tick=Tick,
        m=Memory,
        p=winch.Params,
        sup=Supervisor,
    )

    def store(cls: Any) -> Any:
        return access(cls, LANES).store

    load = access(Lane, LANES).load
    put_x, put_u, put_geo, put_m = store(winch.State), store(winch.Command), store(Geometry), store(Memory)
    put_laws, put_st, put_y, put_tip = store(winch.LawRecord), winch.put_st, store(winch.Signals), store(Tip)
    with_plc, with_tau, with_F = replace(winch.Params, "plc"), replace(Plc, "tau_F"), replace(Memory, "F")
    with_c, with_orders = replace(Geometry, "c"), replace(Tick, "v_op", "s_op", "mode")
    put_ly, put_sup, put_seen = store(LiftSignals), store(Supervisor), store(Windowed)
    Q, V, D, ROW = 0, LANES, 4 * LANES, 5 * LANES
    X, U, U_0, GEO, M, LAWS, ST, Y, TIP_0, TIP_1, TIP_2, LS, LY, STAGE_NOW, SEEN, HANG, H_WET = (
        offset(Lane, f, LANES)
        for f in (
            *("x", "u", "u_0", "geo", "m", "laws", "st", "y", "tip_0", "tip_1", "tip_2", "ls", "ly", "stage", "seen"),
            *("hang", "h_wet"),
        )
    )
    SUP, S_JOY, E_HELD, STAGE, K_STAGE, V_BEFORE, DATUM = (
        HANG + offset(Hanging, f, LANES) for f in ("sup", "s_joy", "e_held", "stage", "k_stage", "v_before", "datum")
    )
    SUP_STAGE, SUP_DONE = (SUP + offset(Supervisor, f, LANES) for f in ("stage", "done"))
    PATH = X + offset(winch.State, "path", LANES)
    X_S, X_V = (PATH + offset(winch.path.State, f, LANES) for f in ("s_load", "v_load"))
    S_LOAD, V_LOAD, F_W, V_TIP, V_W = (
        Y + offset(winch.Signals, f, LANES) for f in ("s_load", "v_load", "F_w", "v_tip", "v_w")
    )
    NY, NLY = size(winch.Signals), size(LiftSignals) + (0 if joint.Signals is None else size(joint.Signals))
    NS = NY + NLY
    NST = size(winch.Stats)
    NT = NST + size(LiftStats) + (0 if joint.Stats is None else size(joint.Stats))
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
                for f in range(NST):
                    into[f * LANES + l] = A[ST + f * LANES + l]
                    A[ST + f * LANES + l] = first[f]
                for f in range(NT - NST):
                    into[(NST + f) * LANES + l] = A[LS + f * LANES + l]
                    A[LS + f * LANES + l] = first[NST + f]
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
        e, rope = b.hang.element, b.lift.rope
        # from drum to tip the wire is damped as its elements are
        geo = with_c(geometry(b.x.path.s_w, b.p), e.c / e.k * rope.EA / rope.L_0)
        q = path_point(b.x, geo, tip, b.p)
        raw, _, _ = sensing(b.x.winch, b.x.path, q, b.m, b.tick, geo, b.laws, b.p)
        order, sup = supervise(
            Watch(t=t, s_w=raw.s_w, F=raw.F, s_tip=raw.s_tip, v_tip=raw.v_tip), b.hang.sup, b.stage, b.lift.settings
        )
        tick = with_orders(b.tick, order.v_op, order.s_op, order.mode)
        held = order.hold > 0.5
        m = with_F(b.m, order.F_hold if held else b.m.F)
        p = with_plc(b.p, with_tau(b.p.plc, 1.0e300 if held else b.p.plc.tau_F))
        return Ordered(tip, geo, q, tick, m, p, sup)

    @scalar
    def keep(A, b, l, o, u, m, law):
        """Lane l with what supervisor and PLC decided."""
        A[S_JOY + l] = b.hang.s_joy + o.sup.v_joy * b.lift.t_cycle
        put_sup(A, SUP + l, o.sup)
        put_u(A, U_0 + l, b.u)
        put_u(A, U + l, u)
        put_geo(A, GEO + l, o.geo)
        put_m(A, M + l, m)
        put_laws(A, LAWS + l, law)
        put_tip(A, TIP_0 + l, o.tip)

    @scalar
    def take_stage(A, S, n_stages):
        """Every lane's stage in force."""
        for l in range(LANES):
            row = S[min(max(int(A[SUP_STAGE + l]), 0), n_stages - 1) * STAGE_SIZE * LANES :]
            for f in range(STAGE_SIZE):
                A[STAGE_NOW + f * LANES + l] = row[f * LANES + l]

    @scalar
    def command(A, t):
        """Supervisor and PLC cycle of every lane at t [s], no more."""
        for l in range(LANES):
            b = load(A, l)
            o = ordered(b, t)
            u, m, law, _ = control(b.x, o.m, b.laws, o.tick, o.tip, o.geo, o.p)
            keep(A, b, l, o, u, m, law)

    @scalar
    def cycle(A, B, N, T, t, w):
        """Supervisor, PLC cycle, signals and statistics of every lane; t time [s], w weight of this cycle in
        integrals."""
        for l in range(LANES):
            b = load(A, l)
            o = ordered(b, t)
            u, m, law, drive = control(b.x, o.m, b.laws, o.tick, o.tip, o.geo, o.p)
            c = circuit(b.x.winch, o.q, u, o.geo, b.p)
            y = signals(c, b.x, o.q, u, m, drive, o.tick, o.geo, b.p)
            E = stored_energy(c, b.x.winch, o.geo, b.p) + path_energy(o.q, b.x.path, b.p)
            E = E - b.p.hoist.load.W * b.x.path.s_load
            put_st(A, ST + l, fold(b.st, y, c, b.x, o.q, u, o.tip, E, b.p, w))
            A[E_HELD + l] = y.e_c if compensating(o.sup, b.stage, b.lift.settings.code) > 0.5 else b.hang.e_held
            keep(A, b, l, o, u, m, law)
            put_y(A, Y + l, y)
        hook = B[N * ROW :]
        for l in range(LANES):
            b = load(A, l)
            s_load = hook[ROW + Q + l]
            A[H_WET + l] = submergence(b.lift.z_ref + s_load, b.hang.water.eta, b.lift.load.reach)
            sup, relative = b.hang.sup, s_load - b.hang.s_joy
            over = sup.stage + sup.done != b.hang.stage or (
                b.stage.mode == STAGE_LANDING and (sup.landed > 0.0 or b.hang.grounded > 0.0)
            )
            restarts = b.hang.datum >= NEVER or waiting(sup, b.stage, b.lift.settings.code) > 0.5
            datum = relative if restarts and not over else b.hang.datum
            stretch = hook[Q + l] - s_load
            put_seen(
                A,
                SEEN + l,
                Windowed(
                    b.hang.e_held,
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
            z, water = b.lift.z_ref + s_load, b.hang.water
            force = water_force(z, v_load, wetted(b.h_wet, b.lo, b.hi), water, b.lift.load)
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
                    stage_number=b.hang.stage,
                ),
            )
            A[S_LOAD + l] = s_load
            A[V_LOAD + l] = v_load

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

    def run(
        A: Array,
        B: Array,
        N: int,
        D_: Array,
        cols: int,
        H: Array,
        S: Array,
        n_stages: int,
        T: Array,
        E: Array,
        H_w: Array,
        levels: int,
        dt_w: float,
        i_0: int,
        W_: Array,
        G: Array,
        starts: Array,
        first: Array,
        out: Array,
        every: int,
        P: Array,
        n_peak: int,
        k_0: int,
        n: int,
        final: int,
        n_win: int,
        sampled: int,
        n_sub: int,
        t_cycle: float,
    ):
        """Cycles k_0 .. k_0 + n of all lanes; cycle `final` is only observed.

        A lanes, B rows of their wires with N elements each; D_ n + 1 rows of cols numbers of the drive, H weights of
        its quintic; S rows of n_stages stages; T levels of the payload; E samples of the water every dt_w [s] from
        number i_0 on, with `levels` levels (0: still water), H_w room for weights; W_ windows; G numbers kept of every
        stage and starts when each began [s], first those that statistics begin with; out a row of Signals and
        LiftSignals every `every` cycles (0: never); P a row of NP numbers every n_peak cycles. Statistics, windows of
        n_win samples and energies are taken every `sampled` cycles, of which every and n_peak are multiples; in between
        the PLC alone works.
        """
        align_stack()
        h = t_cycle / n_sub
        for k in range(k_0, k_0 + n + 1 if k_0 + n == final else k_0 + n):
            row = D_[(k - k_0) * cols * LANES :]
            take_tick(A, row, cols)
            if levels > 0:
                place_w = k * t_cycle / dt_w
                i_w = int(place_w + 1.0e-9)
                take_weights(H_w, place_w - i_w, dt_w)
                sample = E[(i_w - i_0) * (2 + 2 * levels) * LANES :]
                take_water(A, B, N, T, sample, sample[(2 + 2 * levels) * LANES :], H_w, levels)
            watched = k % sampled == 0 or k == final
            if watched:
                relay(A, B, N)
            new_stages(A, W_, G, starts, first, n_stages, k, n_win, t_cycle)
            take_stage(A, S, n_stages)
            if watched:
                cycle(A, B, N, T, k * t_cycle, 0.5 if (k == 0 or k == final) else 1.0)
                watch(A, sampled * t_cycle)
                windows(A, W_, P[(k // n_peak) * NP * LANES :], (k // sampled) % n_win, n_win)
            else:
                command(A, k * t_cycle)
            if every > 0 and k % every == 0:
                into = out[(k // every) * NS * LANES :]
                for l in range(NY * LANES):
                    into[l] = A[Y + l]
                more = into[NY * LANES :]
                for l in range(NLY * LANES):
                    more[l] = A[LY + l]
            if k == final:
                break
            next_row = row[cols * LANES :]
            for i in range(n_sub):
                for l in range(LANES):
                    put_tip(A, TIP_1 + l, tip_between(row, next_row, l, H, 2 * i))
                for l in range(LANES):
                    put_tip(A, TIP_2 + l, tip_between(row, next_row, l, H, 2 * i + 1))
                wire_step(A, B, N, T, k * t_cycle + i * h, i * h, h)
                for l in range(LANES):
                    A[X_V + l] = B[D + l]
                for l in range(LANES):
                    b = load(A, l)
                    put_x(A, X + l, step(b.x, in_force(b, i * h, h), b.geo, b.tip_0, b.tip_1, b.tip_2, b.p, h))
                for l in range(LANES):
                    A[X_S + l] = B[Q + l]
                    A[X_V + l] = 1.5 * B[D + l] - 0.5 * A[V_BEFORE + l]
                    A[V_BEFORE + l] = B[D + l]
                for l in range(2 * LANES):
                    A[TIP_0 + l] = A[TIP_2 + l]

    columns = (*LiftSignals._fields, *(() if joint.Signals is None else joint.Signals._fields))
    return LiftDriver(winch, joint, Lane, NT, NG, NS, columns, run)
