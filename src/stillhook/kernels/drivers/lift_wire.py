"""Wire, hook, rigging and payload of a lowering below any winch, for one trajectory or sixteen side by side.

What joins hook and payload is a module of its own (`stillhook.winches.joints`). In every step the wire, hook and
payload go first, by the implicit midpoint rule, with the wire's top end moved as tip and winch will move it; then the
winch by Runge-Kutta, with the wire's first node moving evenly. Every trajectory goes through the same operations in the
same order, whatever the lane count: the bits are the same.
"""

from dataclasses import dataclass
from typing import Any

from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import access, offset, size
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
from stillhook.physics.load_path.rope import Element, element, element_weight
from stillhook.physics.records import replace
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Geometry
from stillhook.winches.suspended_load import (
    SNAP,
    Hanging,
    Lift,
    LiftStats,
    Solve,
    Works,
    ahead,
    begin,
    cubic,
    fold_step,
    later,
    level_of,
    on_ground,
    place,
)

NODE = ("Q", "V", "W", "C", "D")
"""Numbers of one node of the wire: displacement q [m] against the unstretched wire, speed [m/s], weight [N], and two
columns of the elimination."""
HALF = (LEVELS - 1) // 2
"""First stride of the search for a level."""


@dataclass(frozen=True)
class LiftWire:
    """What moves wire, hook and payload on."""

    look_up: Any
    relay: Any
    take_water: Any
    wire_step: Any


def lift_wire(d: Driver, joint: Any) -> LiftWire:
    """Wire and payload below the winch of a driver, joined by slings or what a module puts above them; as plain
    Python."""
    LANES = ONE_BY_ONE = d.lanes  # the compiler is told that a loop over LANES runs side by side; not over the other
    Lane, wire_speed = d.Lane, d.plant.wire_speed
    pull_joint, mean, energy = joint.pull, joint.mean, joint.energy
    Q, V, W, C, D = (f * LANES for f in range(5))
    ROW = 5 * LANES

    def store(cls: Any) -> Any:
        return access(cls, LANES).store

    load = access(Lane, LANES).load
    with_relay, with_wire = replace(Works, "relay"), replace(Works, "top", "damping", "gravity")
    get_element, get_solve, get_lift, get_hang = (access(c, LANES).load for c in (Element, Solve, Lift, Hanging))
    get_x, get_geo = access(d.State, LANES).load, access(Geometry, LANES).load
    put_ls, put_solve, put_water, put_levels = store(LiftStats), store(Solve), store(Water), store(Heights)
    put_works, put_element = store(Works), store(Element)
    X, GEO, LS, HANG, SOLVE, SUMS, F_S, LIFT, LO, HI, H_WET = (
        offset(Lane, f, LANES) for f in ("x", "geo", "ls", "hang", "solve", "sums", "F_s", "lift", "lo", "hi", "h_wet")
    )
    ELEMENT, WATER, LEVEL, V_W_0, A_LOAD, SINCE, E_NOW, WORKS, GROUNDED = (
        HANG + offset(Hanging, f, LANES)
        for f in ("element", "water", "level", "v_w_0", "a_load", "since_taut", "E", "works", "grounded")
    )
    ELEMENT_C = ELEMENT + offset(Element, "c", LANES)
    REACH = LIFT + offset(Lift, "load", LANES) + offset(Payload, "reach", LANES)
    COLUMNS = size(WettedLevel)

    if joint.Link is None:

        @scalar
        def get_link(A, l):
            return 0.0

    else:
        load_link, LINK = access(joint.Link, LANES).load, offset(Lane, "link", LANES)

        @scalar
        def get_link(A, l):
            return load_link(A, LINK + l)

    if joint.Stats is None:

        @scalar
        def put_statistics(A, l, b, stats, t, h, x, rate, sea):
            """Statistics of one lane after a step."""
            put_ls(A, LS + l, stats)

    else:
        put_cs, CS, fold_joint = store(joint.Stats), offset(Lane, "cs", LANES), joint.fold

        @scalar
        def put_statistics(A, l, b, stats, t, h, x, rate, sea):
            """Statistics of one lane after a step."""
            put_ls(A, LS + l, stats)
            put_cs(A, CS + l, fold_joint(b.cs, t, h, x, rate, sea, b.hang.grounded, b.lift.sling, get_link(A, l)))

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
                    eta=b.hang.water.eta,
                    eta_dot=b.hang.water.eta_dot,
                    a_1=a_1,
                    a_2=a_2,
                    w_1=w_1,
                    w_2=w_2,
                    b_1=b_1,
                    b_2=b_2,
                ),
            )
            put_levels(A, LEVEL + l, y)

    @scalar
    def look_up(A, T):
        """The levels above and below every lane's submergence A[H_WET], from the table T; where the last ones still
        are, nothing is done.

        Their depth h is the first column, rising. Lanes are taken one by one, for few move on at once.
        """
        moved = 0
        for l in range(ONE_BY_ONE):
            moved += 0 if A[H_WET + l] >= A[LO + l] and (A[H_WET + l] < A[HI + l] or A[HI + l] >= A[REACH + l]) else 1
        if moved == 0:
            return
        for l in range(ONE_BY_ONE):
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
        """Elements of every wire as long as the wire out now asks for; energy of the whole lift, and what the new
        elements brought."""
        for l in range(LANES):
            A[SUMS + l] = 0.0
            A[SUMS + LANES + l] = 0.0
        for i in range(N):
            row = B[i * ROW :]
            for l in range(LANES):
                v_0, v_1 = row[V + l], row[ROW + V + l]
                stretch = row[Q + l] - row[ROW + Q + l]
                A[SUMS + l] += 5.0 * (v_0 * v_0 + v_1 * v_1) + 2.0 * v_0 * v_1
                A[SUMS + LANES + l] += stretch * stretch
        hook = B[N * ROW :]
        for l in range(LANES):
            b = load(A, l)
            old, new = b.hang.element, element(b.x.path.s_w, b.solve.force.m_a, b.lift.rope)
            moved, strained = 0.5 * b.sums.damping, 0.5 * b.sums.gravity
            brought = (new.m - old.m) * moved + (new.k - old.k) * strained
            v_h, v_p, x = hook[V + l], hook[ROW + V + l], hook[Q + l] - hook[ROW + Q + l]
            ends = (
                0.5 * b.lift.hook.m * v_h * v_h
                + 0.5 * b.lift.load.m * v_p * v_p
                + energy(x, b.lift.sling, get_link(A, l))
            )
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
    def wire_step(A, B, N, T, t, tau, h):
        """Wire, hook, slings and payload of every lane over one step that begins at t, tau into the cycle [s]: the
        implicit midpoint rule."""
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
            R = (
                e.m * (5.0 * v_h + row[V + l])
                + lift.hook.m * v_h
                - 0.5 * h * (row[ROW + W + l] + e.k * (q_h - row[Q + l]))
            )
            A_h = 0.5 * s.d + lift.hook.m - s.off * row[C + l]
            x, v = row[ROW + Q + l] - row[2 * ROW + Q + l], row[ROW + V + l] - row[2 * ROW + V + l]
            z = lift.z_ref + row[ROW + Q + l]
            ends = pull_joint(x, v, z, A_h, R - s.off * row[D + l], s.A_p, s.R_p, h, lift.sling, get_link(A, l))
            row[ROW + D + l] = ends.v_up
            row[2 * ROW + D + l] = ends.v_down
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
            rate = v_h - v_p
            z_h, v_h_0, link = lift.z_ref + hook[Q + l], hook[V + l] - hook[ROW + V + l], get_link(A, l)
            F_s, sea = mean(x_0, v_h_0, z_h, rate, h, lift.sling, link)
            x_1 = x_0 + h * rate
            lost = (F_s - sea) * rate * h - (energy(x_1, lift.sling, link) - energy(x_0, lift.sling, link))
            f, w = s.force, g.works
            put_works(
                A,
                WORKS + l,
                Works(
                    top=w.top,
                    damping=w.damping + lost,
                    gravity=w.gravity + h * lift.load.W * v_p,
                    buoyancy=w.buoyancy + h * f.buoyancy * v_p - sea * rate * h,
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
            stats = fold_step(b.ls, t, h, z_0, v_0, z, v, F_s, snapping, f, g.grounded, lift.load)
            put_statistics(A, l, b, stats, t, h, x_1, rate, sea)
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

    return LiftWire(look_up, relay, take_water, wire_step)
