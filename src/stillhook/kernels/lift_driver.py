"""The driver of a lowering with any winch plant, for one trajectory or sixteen side by side.

`stillhook.kernels.build` executes this file once per plant and lane count with `base`, the plant's own driver, set; it
is never imported by name.
In every step the wire, hook and payload go first, by the implicit midpoint rule, with the wire's top end moved as tip
and winch will move it; then the winch by Runge-Kutta, with the wire's first node moving evenly. Every trajectory goes
through the same operations in the same order, whatever the lane count: the bits are the same.
"""

from typing import NamedTuple

from numba import njit

from stillhook.control.plc import Memory, Plc
from stillhook.control.supervisor import STAGE_LANDING, Stage, Supervisor, Watch, supervise
from stillhook.kernels.lanes import access, offset, size
from stillhook.kernels.statistics import window_add, window_turn
from stillhook.physics.load_path.payload import (
    LEVELS,
    Heights,
    Payload,
    Water,
    WettedLevel,
    heights,
    submergence,
    water_force,
    wetted,
)
from stillhook.physics.load_path.rope import Element, element, element_weight, pull_of_sling, sling_energy, sling_mean
from stillhook.physics.records import fields, replace
from stillhook.physics.scalar import STRICT, align_stack, scalar
from stillhook.winches.records import Geometry, Tick, Tip
from stillhook.winches.suspended_load import (
    NEVER,
    SNAP,
    Hanging,
    Lift,
    LiftSignals,
    LiftStats,
    Solve,
    Sums,
    Windowed,
    Works,
    ahead,
    begin,
    compensating,
    cubic,
    fold_step,
    later,
    level_of,
    on_ground,
    place,
    take_weights,
    waiting,
)

base = base  # type: ignore[name-defined]  # noqa: F821
LANES, Command = base.LANES, base.Command
plant = base.plant
circuit, geometry, sense, control = plant.circuit, plant.geometry, plant.sense, base.control
signals, stored_energy, fold, path_point = base.signals, plant.stored_energy, base.fold, base.path_point
path_energy, wire_speed = base.path_energy, plant.wire_speed
Signals, Stats = base.Signals, base.Stats
step, in_force, tip_between, take_tick = base.step, base.in_force, base.tip_between, base.take_tick
put_x, put_u, put_geo, put_m, put_laws, put_st, put_y, put_tip = (
    base.put_x,
    base.put_u,
    base.put_geo,
    base.put_m,
    base.put_laws,
    base.put_st,
    base.put_y,
    base.put_tip,
)
X, U, U_0, GEO, M, LAWS, ST, Y, TIP_0, TIP_1, TIP_2 = (
    base.X,
    base.U,
    base.U_0,
    base.GEO,
    base.M,
    base.LAWS,
    base.ST,
    base.Y,
    base.TIP_0,
    base.TIP_1,
    base.TIP_2,
)

Lane = NamedTuple(
    "Lane",
    [
        *fields(base.Lane),
        ("ls", LiftStats),
        ("ly", LiftSignals),
        ("hang", Hanging),
        ("solve", Solve),
        ("sums", Sums),
        ("F_s", float),
        ("lift", Lift),
        ("stage", Stage),
        ("lo", WettedLevel),
        ("hi", WettedLevel),
        ("h_wet", float),
        ("seen", Windowed),
    ],
)
"""Everything that one trajectory carries, relative the rows of its wire; begins as the lane of
`stillhook.kernels.driver` does."""

Q, V, W, C, D = (f * LANES for f in range(5))
ROW = 5 * LANES
"""Rows of the wire: displacement q [m] against the unstretched wire, speed [m/s], weight [N], and two columns of the
elimination."""


def store(cls: type):  # type: ignore[no-untyped-def]
    return access(cls, LANES).store


load = access(Lane, LANES).load
with_plc, with_tau, with_F = replace(base.Params, "plc"), replace(Plc, "tau_F"), replace(Memory, "F")
with_c, with_orders = replace(Geometry, "c"), replace(Tick, "v_op", "s_op", "mode")
with_relay, with_wire = replace(Works, "relay"), replace(Works, "top", "damping", "gravity")
put_ls, put_ly, put_solve, put_water, put_levels, put_works = (
    store(LiftStats),
    store(LiftSignals),
    store(Solve),
    store(Water),
    store(Heights),
    store(Works),
)
LS, LY, HANG, SOLVE, SUMS, F_S, LIFT, STAGE_NOW, LO, HI, H_WET, SEEN = (
    offset(Lane, f, LANES)
    for f in ("ls", "ly", "hang", "solve", "sums", "F_s", "lift", "stage", "lo", "hi", "h_wet", "seen")
)
(
    SUP,
    ELEMENT,
    WATER,
    LEVEL,
    V_W_0,
    A_LOAD,
    SINCE,
    S_JOY,
    E_HELD,
    STAGE,
    K_STAGE,
    E_NOW,
    WORKS,
    V_BEFORE,
    DATUM,
    GROUNDED,
) = (
    HANG + offset(Hanging, f, LANES)
    for f in (
        "sup",
        "element",
        "water",
        "level",
        "v_w_0",
        "a_load",
        "since_taut",
        "s_joy",
        "e_held",
        "stage",
        "k_stage",
        "E",
        "works",
        "v_before",
        "datum",
        "grounded",
    )
)
get_element, get_solve, get_lift, get_hang = (access(c, LANES).load for c in (Element, Solve, Lift, Hanging))
get_x, get_geo = access(base.State, LANES).load, access(Geometry, LANES).load
put_sup, put_element, put_seen = store(Supervisor), store(Element), store(Windowed)
ELEMENT_C = ELEMENT + offset(Element, "c", LANES)
SUP_STAGE, SUP_DONE = (SUP + offset(Supervisor, f, LANES) for f in ("stage", "done"))
PATH = X + offset(base.State, "path", LANES)
X_S, X_V = (PATH + offset(base.path.State, f, LANES) for f in ("s_load", "v_load"))
S_LOAD, V_LOAD = (Y + offset(Signals, f, LANES) for f in ("s_load", "v_load"))
NY, NLY = size(Signals), size(LiftSignals)
NS = NY + NLY
SIGNALS = 4
"""Windowed signals: control error while compensating, tip, payload and hook against the path that the joystick asked
for."""
NST, NT = size(Stats), size(Stats) + size(LiftStats)
NG = NT + SIGNALS
"""Numbers that are kept of a stage."""
STAGE_SIZE = size(Stage)
REACH = LIFT + offset(Lift, "load", LANES) + offset(Payload, "reach", LANES)
COLUMNS = size(WettedLevel)
HALF = (LEVELS - 1) // 2
"""First stride of the search for a level."""


@scalar
def new_stages(A, W_, G, starts, first, n_stages, k, n_win, t_cycle):
    """Where another stage is in force: statistics of the last one go to G, and start anew from the numbers in
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
def water_between(lo, hi, l, j, H_w, last):
    """Speed and acceleration of level j between two samples of the water; H_w weights over time, last number of the
    last level."""
    i = (2 + min(max(j, 0), last)) * LANES + l
    a = i + (last + 1) * LANES
    w = H_w[0] * lo[i] + H_w[1] * lo[a] + H_w[2] * hi[i] + H_w[3] * hi[a]
    return w, H_w[4] * lo[i] + H_w[5] * lo[a] + H_w[6] * hi[i] + H_w[7] * hi[a]


@scalar
def water_at(y, last_moving, lo, hi, l, H_w, last):
    """Speed and acceleration of the water at level y, between two samples: cubic in time and over the levels of
    depth."""
    j, f = place(y, last_moving)
    w_0, a_0 = water_between(lo, hi, l, j - 1, H_w, last)
    w_1, a_1 = water_between(lo, hi, l, j, H_w, last)
    w_2, a_2 = water_between(lo, hi, l, j + 1, H_w, last)
    w_3, a_3 = water_between(lo, hi, l, j + 2, H_w, last)
    moves = 1.0 if y <= last_moving else 0.0
    return moves * cubic(w_0, w_1, w_2, w_3, f), moves * cubic(a_0, a_1, a_2, a_3, f)


@scalar
def take_water(A, B, N, T, lo, hi, H_w, levels):
    """The water at every load at the start of a cycle, from the samples before and after, over its part that is wet
    now."""
    pay = B[(N + 1) * ROW :]
    for l in range(LANES):
        eta, eta_dot, eta_1, eta_dot_1 = lo[l], lo[LANES + l], hi[l], hi[LANES + l]
        surface = H_w[0] * eta + H_w[1] * eta_dot + H_w[2] * eta_1 + H_w[3] * eta_dot_1
        A[WATER + l] = surface
        A[WATER + LANES + l] = H_w[4] * eta + H_w[5] * eta_dot + H_w[6] * eta_1 + H_w[7] * eta_dot_1
        lift = get_lift(A, LIFT + l)
        A[H_WET + l] = submergence(lift.z_ref + pay[Q + l], surface, lift.load.reach)
    look_up(A, T)
    for l in range(LANES):
        b = load(A, l)
        field, last = b.lift.field, levels - 1
        z = heights(b.lift.z_ref + pay[Q + l], wetted(b.h_wet, b.lo, b.hi))
        y = Heights(
            level_of(z.m_1, b.hang.level.m_1, field),
            level_of(z.m_2, b.hang.level.m_2, field),
            level_of(z.d_1, b.hang.level.d_1, field),
            level_of(z.d_2, b.hang.level.d_2, field),
        )
        _, a_1 = water_at(y.m_1, field.last, lo, hi, l, H_w, last)
        _, a_2 = water_at(y.m_2, field.last, lo, hi, l, H_w, last)
        w_1, b_1 = water_at(y.d_1, field.last, lo, hi, l, H_w, last)
        w_2, b_2 = water_at(y.d_2, field.last, lo, hi, l, H_w, last)
        put_water(
            A,
            WATER + l,
            Water(
                eta=b.hang.water.eta, eta_dot=b.hang.water.eta_dot, a_1=a_1, a_2=a_2, w_1=w_1, w_2=w_2, b_1=b_1, b_2=b_2
            ),
        )
        put_levels(A, LEVEL + l, y)


@scalar
def look_up(A, T):
    """The levels above and below every lane's submergence A[H_WET], from the table T; where the last ones still are,
    nothing is done.

    Their depth h is the first column, rising.
    """
    for l in range(LANES):
        h, j, stride = A[H_WET + l], 0, HALF
        if h >= A[LO + l] and (h < A[HI + l] or A[HI + l] >= A[REACH + l]):
            continue
        while stride > 0:
            j += stride if T[(j + stride) * COLUMNS * LANES + l] <= h else 0
            stride //= 2
        row = T[j * COLUMNS * LANES :]
        for c in range(COLUMNS):
            A[LO + c * LANES + l] = row[c * LANES + l]
            A[HI + c * LANES + l] = row[(COLUMNS + c) * LANES + l]


@scalar
def relay(A, B, N):
    """Elements of every wire as long as the wire out now asks for; energy of the whole lift, and what the new elements
    brought."""
    for l in range(LANES):
        A[SUMS + l] = 0.0
        A[SUMS + LANES + l] = 0.0
    for i in range(N):
        row = B[i * ROW :]
        for l in range(LANES):
            v_0, v_1 = row[V + l], row[ROW + V + l]
            e = row[Q + l] - row[ROW + Q + l]
            A[SUMS + l] += 5.0 * (v_0 * v_0 + v_1 * v_1) + 2.0 * v_0 * v_1
            A[SUMS + LANES + l] += e * e
    hook = B[N * ROW :]
    for l in range(LANES):
        b = load(A, l)
        old, new = b.hang.element, element(b.x.path.s_w, b.solve.force.m_a, b.lift.rope)
        moved, strained = 0.5 * b.sums.damping, 0.5 * b.sums.gravity
        brought = (new.m - old.m) * moved + (new.k - old.k) * strained
        v_h, v_p, x = hook[V + l], hook[ROW + V + l], hook[Q + l] - hook[ROW + Q + l]
        ends = 0.5 * b.lift.hook.m * v_h * v_h + 0.5 * b.lift.load.m * v_p * v_p + sling_energy(x, b.lift.sling)
        put_works(A, WORKS + l, with_relay(b.hang.works, b.hang.works.relay + brought))
        put_element(A, ELEMENT + l, new)
        A[E_NOW + l] = new.m * moved + new.k * strained + ends
    for i in range(N + 1):
        row = B[i * ROW :]
        for l in range(LANES):
            e, lift = get_element(A, ELEMENT + l), get_lift(A, LIFT + l)
            up = element_weight(i - 1.0, e.l, lift.rope) if i > 0 else 0.0
            down = element_weight(i * 1.0, e.l, lift.rope) if i < N else lift.hook.W * 2.0
            row[W + l] = 0.5 * (up + down)


@scalar
def cycle(A, B, N, S, T, n_stages, t, w):
    """Supervisor, PLC cycle, signals and statistics of every lane; t time [s], w weight of this cycle in integrals."""
    for l in range(LANES):
        row = S[min(max(int(A[SUP_STAGE + l]), 0), n_stages - 1) * STAGE_SIZE * LANES :]
        for f in range(STAGE_SIZE):
            A[STAGE_NOW + f * LANES + l] = row[f * LANES + l]
    for l in range(LANES):
        b = load(A, l)
        tip = Tip(b.tick.s, b.tick.v)
        e, rope = b.hang.element, b.lift.rope
        # from drum to tip the wire is damped as its elements are
        geo = with_c(geometry(b.x.path.s_w, b.p), e.c / e.k * rope.EA / rope.L_0)
        q = path_point(b.x, geo, tip, b.p)
        raw = sense(b.x.winch, b.x.path, q, b.m, b.tick, geo, b.p)
        order, sup = supervise(
            Watch(t=t, s_w=raw.s_w, F=raw.F, s_tip=raw.s_tip, v_tip=raw.v_tip), b.hang.sup, b.stage, b.lift.settings
        )
        tick = with_orders(b.tick, order.v_op, order.s_op, order.mode)
        held = order.hold > 0.5
        m = with_F(b.m, order.F_hold if held else b.m.F)
        p = with_plc(b.p, with_tau(b.p.plc, 1.0e300 if held else b.p.plc.tau_F))
        u, m, law, drive = control(b.x, m, b.laws, tick, tip, geo, p)
        c = circuit(b.x.winch, q, u, geo, b.p)
        y = signals(c, b.x, q, u, m, drive, tick, geo, b.p)
        E = stored_energy(c, b.x.winch, geo, b.p) + path_energy(q, b.x.path, b.p)
        E = E - b.p.hoist.load.W * b.x.path.s_load
        put_st(A, ST + l, fold(b.st, y, c, b.x, q, u, tip, E, b.p, w))
        A[E_HELD + l] = y.e_c if compensating(sup, b.stage, b.lift.settings.code) > 0.5 else b.hang.e_held
        A[S_JOY + l] = b.hang.s_joy + sup.v_joy * b.lift.t_cycle
        put_sup(A, SUP + l, sup)
        put_u(A, U_0 + l, b.u)
        put_u(A, U + l, u)
        put_geo(A, GEO + l, geo)
        put_m(A, M + l, m)
        put_laws(A, LAWS + l, law)
        put_y(A, Y + l, y)
        put_tip(A, TIP_0 + l, tip)
    hook = B[N * ROW :]
    for l in range(LANES):
        b = load(A, l)
        q = hook[ROW + Q + l]
        A[H_WET + l] = submergence(b.lift.z_ref + q, b.hang.water.eta, b.lift.load.reach)
        sup, relative = b.hang.sup, q - b.hang.s_joy
        over = sup.stage + sup.done != b.hang.stage or (
            b.stage.mode == STAGE_LANDING and (sup.landed > 0.0 or b.hang.grounded > 0.0)
        )
        anew = b.hang.datum >= NEVER or waiting(sup, b.stage, b.lift.settings.code) > 0.5
        datum = relative if anew and not over else b.hang.datum
        stretch = hook[Q + l] - q
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
        q, v = hook[ROW + Q + l], hook[ROW + V + l]
        z, water = b.lift.z_ref + q, b.hang.water
        force = water_force(z, v, wetted(b.h_wet, b.lo, b.hi), water, b.lift.load)
        h = submergence(z, water.eta, b.lift.load.H)
        put_ly(
            A,
            LY + l,
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
        A[S_LOAD + l] = q
        A[V_LOAD + l] = v


@scalar
def windows(A, W_, i, n_win):
    """The moving windows of every lane take this cycle's sample as number i of their run."""
    w = SIGNALS * LANES
    for f in range(SIGNALS):
        for l in range(LANES):
            window_add(W_, w, f * LANES + l, i, n_win, 1.0, A[SEEN + f * LANES + l])
    if i == n_win - 1:
        window_turn(W_, w, n_win)


@scalar
def wire_step(A, B, N, T, t, tau, h):
    """Wire, hook, slings and payload of every lane over one step that begins at t, tau into the cycle [s]: the implicit
    midpoint rule."""
    hook = B[N * ROW :]
    for l in range(LANES):
        g, lift = get_hang(A, HANG + l), get_lift(A, LIFT + l)
        z = lift.z_ref + ahead(hook[ROW + Q + l], hook[ROW + V + l], g.a_load, 0.5 * h)
        A[H_WET + l] = submergence(z, later(g.water, tau + 0.5 * h).eta, lift.load.reach)
    look_up(A, T)
    for l in range(LANES):
        b = load(A, l)
        q, v = hook[ROW + Q + l], hook[ROW + V + l]
        z, v_mid = b.lift.z_ref + ahead(q, v, b.hang.a_load, 0.5 * h), v + 0.5 * h * b.hang.a_load
        force = water_force(z, v_mid, wetted(b.h_wet, b.lo, b.hi), later(b.hang.water, tau + 0.5 * h), b.lift.load)
        put_solve(A, SOLVE + l, begin(b, wire_speed(b.x.winch, b.geo), B[Q + l], v, v_mid, force, h))
        A[SUMS + l] = 0.0
        A[SUMS + LANES + l] = 0.0
    for l in range(LANES):
        e, s = get_element(A, ELEMENT + l), get_solve(A, SOLVE + l)
        pull = 0.5 * h * (s.taut * s.T_0 - B[W + l] - e.k * (B[Q + l] - B[ROW + Q + l]))
        r = e.m * (5.0 * B[V + l] + B[ROW + V + l]) + pull
        B[C + l] = s.off / s.d_0
        B[D + l] = r / s.d_0
    for i in range(1, N):
        row = B[(i - 1) * ROW :]
        for l in range(LANES):
            e, s = get_element(A, ELEMENT + l), get_solve(A, SOLVE + l)
            v = 10.0 * row[ROW + V + l] + row[V + l] + row[2 * ROW + V + l]
            q = 2.0 * row[ROW + Q + l] - row[Q + l] - row[2 * ROW + Q + l]
            r = e.m * v - 0.5 * h * (row[ROW + W + l] + e.k * q)
            pivot = 1.0 / (s.d - s.off * row[C + l])
            row[ROW + C + l] = s.off * pivot
            row[ROW + D + l] = (r - s.off * row[D + l]) * pivot
    row = B[(N - 1) * ROW :]
    for l in range(LANES):
        e, s, lift = get_element(A, ELEMENT + l), get_solve(A, SOLVE + l), get_lift(A, LIFT + l)
        q_h, v_h = row[ROW + Q + l], row[ROW + V + l]
        q_p = row[2 * ROW + Q + l]
        R = e.m * (5.0 * v_h + row[V + l]) + lift.hook.m * v_h - 0.5 * h * (row[ROW + W + l] + e.k * (q_h - row[Q + l]))
        A_h = 0.5 * s.d + lift.hook.m - s.off * row[C + l]
        pull = pull_of_sling(q_h - q_p, A_h, R - s.off * row[D + l], s.A_p, s.R_p, h, lift.sling)
        row[ROW + D + l] = pull.v_up
        row[2 * ROW + D + l] = pull.v_down
    finish(A, B, N, t + h, h)


@scalar
def finish(A, B, N, t, h):
    """Speeds at mid-step from the bottom up, positions and speeds at the end t [s], works and statistics."""
    hook = B[N * ROW :]
    for l in range(LANES):
        b = load(A, l)
        s, g, lift = b.solve, b.hang, b.lift
        v_h, v_p = hook[D + l], hook[ROW + D + l]
        x_0 = hook[Q + l] - hook[ROW + Q + l]
        dv = 2.0 * (v_p - hook[ROW + V + l])
        F_s = sling_mean(x_0, v_h - v_p, h, lift.sling)
        x_1 = x_0 + h * (v_h - v_p)
        lost = F_s * (v_h - v_p) * h - (sling_energy(x_1, lift.sling) - sling_energy(x_0, lift.sling))
        f, w = s.force, g.works
        put_works(
            A,
            WORKS + l,
            Works(
                top=w.top,
                damping=w.damping + lost,
                gravity=w.gravity + h * lift.load.W * v_p,
                buoyancy=w.buoyancy + h * f.buoyancy * v_p,
                inertia=w.inertia + (h * f.inertia - f.m_a * dv) * v_p,
                drag=w.drag + h * (f.drag - f.damping * (v_p - s.v_mid)) * v_p,
                slam=w.slam + h * f.slam * v_p,
                bottom=w.bottom + h * f.bottom * v_p,
                relay=w.relay,
            ),
        )
        z_0, v_0 = lift.z_ref + hook[ROW + Q + l], hook[ROW + V + l]
        hook[ROW + Q + l] += h * v_p
        hook[ROW + V + l] += dv
        hook[V + l] = 2.0 * v_h - hook[V + l]
        hook[Q + l] += h * v_h
        A[SUMS + LANES + l] = hook[W + l] * v_h
        since = g.since_taut + h if F_s > 0.0 else 0.0
        snapping = 1.0 if F_s > 0.0 and since < SNAP and b.ls.slack + b.ls.slack_landed > 0.0 else 0.0
        z, v = lift.z_ref + hook[ROW + Q + l], hook[ROW + V + l]
        put_ls(A, LS + l, fold_step(b.ls, t, h, z_0, v_0, z, v, F_s, snapping, f, g.grounded, lift.load))
        A[GROUNDED + l] = on_ground(g.grounded, z, lift.load)
        A[A_LOAD + l] = dv / h
        A[SINCE + l] = since
        A[F_S + l] = F_s
    for i in range(N - 1, -1, -1):
        row = B[i * ROW :]
        for l in range(LANES):
            below = row[ROW + D + l]
            v = row[D + l] - row[C + l] * below
            row[D + l] = v
            row[Q + l] += h * v
            row[V + l] = 2.0 * v - row[V + l]
            A[SUMS + l] += A[ELEMENT_C + l] * (v - below) * (v - below)
            A[SUMS + LANES + l] += row[W + l] * v
    for l in range(LANES):
        s, g, v = get_solve(A, SOLVE + l), get_hang(A, HANG + l), B[D + l]
        w = g.works
        top = s.taut * (s.T_0 - s.G_0 * v)
        damping, gravity = w.damping + h * A[SUMS + l], w.gravity + h * A[SUMS + LANES + l]
        put_works(A, WORKS + l, with_wire(w, w.top + h * top * v, damping, gravity))
        A[V_W_0 + l] = wire_speed(get_x(A, X + l).winch, get_geo(A, GEO + l))


def run(
    A,
    B,
    N,
    D_,
    cols,
    H,
    S,
    n_stages,
    T,
    E,
    H_w,
    levels,
    dt_w,
    i_0,
    W_,
    G,
    starts,
    first,
    out,
    every,
    k_0,
    n,
    final,
    n_win,
    n_sub,
    t_cycle,
):
    """Cycles k_0 .. k_0 + n of all lanes; cycle `final` is only observed.

    A lanes, B rows of their wires with N elements each; D_ n + 1 rows of cols numbers of the drive, H weights of its
    quintic; S rows of n_stages stages; T levels of the payload; E samples of the water every dt_w [s] from number i_0
    on, with `levels` levels (0: still water), H_w room for weights; W_ windows; G numbers kept of every stage and
    starts when each began [s], first those that statistics begin with; out a row of Signals and LiftSignals every
    `every` cycles (0: never).
    """
    align_stack()
    h = t_cycle / n_sub
    for k in range(k_0, k_0 + n + 1 if k_0 + n == final else k_0 + n):
        row = D_[(k - k_0) * cols * LANES :]
        take_tick(A, row, cols)
        if levels > 0:
            place_w = k * t_cycle / dt_w
            i = int(place_w + 1.0e-9)
            take_weights(H_w, place_w - i, dt_w)
            sample = E[(i - i_0) * (2 + 2 * levels) * LANES :]
            take_water(A, B, N, T, sample, sample[(2 + 2 * levels) * LANES :], H_w, levels)
        relay(A, B, N)
        new_stages(A, W_, G, starts, first, n_stages, k, n_win, t_cycle)
        cycle(A, B, N, S, T, n_stages, k * t_cycle, 0.5 if (k == 0 or k == final) else 1.0)
        windows(A, W_, k % n_win, n_win)
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


run = njit(cache=True, nogil=True, **STRICT)(run)
