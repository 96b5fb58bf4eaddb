"""Wire, hook, what joins it to the payload, and the payload of every lane: elements of the wire in a cycle, and a step.

In every step they go first, by the implicit midpoint rule, with the wire's top end moved as tip and winch will move it;
then the winch by Runge-Kutta, with the wire's first node moving evenly. Every trajectory goes through the same
operations in the same order, whatever the lane count: the bits are the same.
"""

from dataclasses import dataclass
from typing import Any

from stillhook.kernels.drivers.water import WaterAt
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import access, offset
from stillhook.physics.load_path.rope import Element, element, element_weight
from stillhook.physics.records import replace
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.lift import Hanging, Lift, Works, of_body, of_joint, of_wire, with_relay
from stillhook.winches.load_path.payload import SNAP, Body, ahead, later
from stillhook.winches.load_path.wire import Wire
from stillhook.winches.records import Geometry


@dataclass(frozen=True)
class BelowWinch:
    """relay(A, B, N): elements of every wire in a cycle; step(A, B, N, T, t, tau, h): all that is below the winch."""

    relay: Any
    step: Any


def below_winch(d: Driver, wire: Any, joint: Any, body: Any, water: WaterAt) -> BelowWinch:
    """See `BelowWinch`: elements wire and body, and what joins them; as plain Python."""
    LANES = d.lanes
    Lane, wire_speed, look_up, force_at = d.Lane, d.plant.wire_speed, water.look_up, water.force
    pull_joint, mean, energy = joint.pull, joint.mean, joint.energy
    rows_of, first_row, inner_row, hook_row = wire.rows_of, wire.first_row, wire.inner_row, wire.hook_row
    depth_ahead, momentum, fold_step, on_ground = body.depth_ahead, body.momentum, body.fold_step, body.on_ground
    # a node of the wire: displacement q [m] against the unstretched wire, speed [m/s], weight [N], two columns of the
    # elimination
    Q, V, W, C, D = (f * LANES for f in range(5))
    ROW = 5 * LANES

    def store(cls: Any) -> Any:
        return access(cls, LANES).store

    load = access(Lane, LANES).load
    get_element, get_rows, get_lift, get_body = (access(c, LANES).load for c in (Element, wire.Rows, Lift, Body))
    get_momentum, get_sums, get_works = (access(c, LANES).load for c in (body.Momentum, wire.Sums, Works))
    get_x, get_geo = access(d.State, LANES).load, access(Geometry, LANES).load
    put_ls, put_rows, put_momentum = store(body.LiftStats), store(wire.Rows), store(body.Momentum)
    put_works, put_element = store(Works), store(Element)
    X, GEO, LS, HANG, ROWS, MOMENTUM, SUMS, F_S, LIFT = (
        offset(Lane, f, LANES) for f in ("x", "geo", "ls", "hang", "rows", "momentum", "sums", "F_s", "lift")
    )
    BODY, WIRE, WORKS, E_NOW = (HANG + offset(Hanging, f, LANES) for f in ("body", "wire", "works", "E"))
    ELEMENT, V_W_0 = (WIRE + offset(Wire, f, LANES) for f in ("element", "v_w_0"))
    H_WET, A_LOAD, SINCE, GROUNDED = (BODY + offset(Body, f, LANES) for f in ("h", "a", "since_taut", "grounded"))
    ELEMENT_C = ELEMENT + offset(Element, "c", LANES)

    if joint.Link is None:

        @scalar
        def get_link(A, l):
            return 0.0

    else:
        load_link, LINK = access(joint.Link, LANES).load, offset(Lane, "link", LANES)

        @scalar
        def get_link(A, l):
            return load_link(A, LINK + l)

    if hasattr(joint, "moved"):
        foresee, moved, work, put_link = joint.foresee, joint.moved, joint.work, store(joint.Link)

        @scalar
        def foreseen(A, l, b, hook, tau, h):
            """The body of what joins hook and payload, with the water in the middle of the step."""
            x, z = hook[Q + l] - hook[ROW + Q + l], b.lift.z_ref + hook[Q + l]
            put_link(A, LINK + l, foresee(x, z, later(b.unit_water, tau + 0.5 * h), h, b.lift.sling, b.link))

        @scalar
        def joined(A, l, w, x, v, z, v_up, v_down, h, sling):
            """Force on the payload over the step, the sea's part of it, and works."""
            before = get_link(A, l)
            link = moved(x, z, v_up, v_down, h, sling, before)
            put_link(A, LINK + l, link)
            F, sea = mean(x, v, z, v_up - v_down, h, sling, link)
            return F, sea, work(w, x, v_up, v_down, h, sling, before, link)

    else:

        @scalar
        def foreseen(A, l, b, hook, tau, h):
            """Nothing: it has no body."""

        @scalar
        def joined(A, l, w, x, v, z, v_up, v_down, h, sling):
            """Force over the step, the sea's part of it, and works."""
            link, rate = get_link(A, l), v_up - v_down
            F, sea = mean(x, v, z, rate, h, sling, link)
            stored = energy(x + h * rate, sling, link) - energy(x, sling, link)
            return F, sea, of_joint(w, F, sea, rate, stored, h)

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
            put_cs(A, CS + l, fold_joint(b.cs, t, h, x, rate, sea, b.hang.body.grounded, b.lift.sling, get_link(A, l)))

    if hasattr(body, "Deck"):
        deck_push, pressing, fold_deck, on_deck = body.deck_push, body.pressing, body.fold_deck, body.on_deck
        put_push, put_ds, PUSH, DS = (
            store(body.Push),
            store(body.Stats),
            offset(Lane, "push", LANES),
            offset(Lane, "ds", LANES),
        )
        with_bottom = replace(Works, "bottom")

        @scalar
        def held(A, l, b, p, z, v_mid, tau, h):
            """The payload's momentum with the push of the deck."""
            push = deck_push(z, v_mid, b.deck, tau, h, b.push.left)
            put_push(A, PUSH + l, push)
            return pressing(p, push, h)

        @scalar
        def grounded_of(A, l, b, stats, t, tau, h, z_0, v_0, z):
            """Statistics of the lift with those of the deck, and 1 while the payload stands on it."""
            was, works = b.hang.body.grounded, get_works(A, WORKS + l)
            ds, stats, push = fold_deck(b.ds, b.ls, stats, t, h, z_0, v_0, b.hang.body.a, z, b.deck, tau, b.push, was)
            put_ds(A, DS + l, ds)
            put_push(A, PUSH + l, push)
            put_works(A, WORKS + l, with_bottom(works, works.bottom + push.F * (z - z_0)))
            return stats, on_deck(was, z, b.deck, tau + h)

    else:

        @scalar
        def held(A, l, b, p, z, v_mid, tau, h):
            """The payload's momentum as it is."""
            return p

        @scalar
        def grounded_of(A, l, b, stats, t, tau, h, z_0, v_0, z):
            """Statistics as they are, and 1 while the payload is on the seabed."""
            return stats, on_ground(b.hang.body.grounded, z, b.lift.load)

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
            old, new = b.hang.wire.element, element(b.x.path.s_w, b.momentum.force.m_a, b.lift.rope)
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
    def step(A, B, N, T, t, tau, h):
        """Wire, hook, joint and payload of every lane over one step that begins at t, tau into the cycle [s]: the
        implicit midpoint rule."""
        hook = B[N * ROW :]
        for l in range(LANES):
            g, lift, q, v = get_body(A, BODY + l), get_lift(A, LIFT + l), hook[ROW + Q + l], hook[ROW + V + l]
            A[H_WET + l] = depth_ahead(q, v, g, tau, lift.z_ref, lift.load.reach, 0.5 * h)
        look_up(A, T)
        for l in range(LANES):
            b = load(A, l)
            g, q, v = b.hang.body, hook[ROW + Q + l], hook[ROW + V + l]
            z, v_mid = b.lift.z_ref + ahead(q, v, g.a, 0.5 * h), v + 0.5 * h * g.a
            force = force_at(b, z, v_mid, later(g.water, tau + 0.5 * h))
            v_w = wire_speed(b.x.winch, b.geo)
            put_rows(A, ROWS + l, rows_of(b.hang.wire, b.x.path, v_w, B[Q + l], b.tip_1, b.geo.c, b.p.hoist, h))
            p = momentum(v, v_mid, force, h, b.lift.load)
            put_momentum(A, MOMENTUM + l, held(A, l, b, p, b.lift.z_ref + q, v_mid, tau, h))
            foreseen(A, l, b, hook, tau, h)
            A[SUMS + l] = 0.0
            A[SUMS + LANES + l] = 0.0
        for l in range(LANES):
            e, r = get_element(A, ELEMENT + l), get_rows(A, ROWS + l)
            c, w = first_row(e, r, B[Q + l], B[ROW + Q + l], B[V + l], B[ROW + V + l], B[W + l], h)
            B[C + l] = c
            B[D + l] = w
        for i in range(1, N):
            row = B[(i - 1) * ROW :]
            for l in range(LANES):
                e, r = get_element(A, ELEMENT + l), get_rows(A, ROWS + l)
                c, w = inner_row(
                    e,
                    r,
                    row[C + l],
                    row[D + l],
                    row[Q + l],
                    row[ROW + Q + l],
                    row[2 * ROW + Q + l],
                    row[V + l],
                    row[ROW + V + l],
                    row[2 * ROW + V + l],
                    row[ROW + W + l],
                    h,
                )
                row[ROW + C + l] = c
                row[ROW + D + l] = w
        row = B[(N - 1) * ROW :]
        for l in range(LANES):
            e, r, lift = get_element(A, ELEMENT + l), get_rows(A, ROWS + l), get_lift(A, LIFT + l)
            q_h, v_h = row[ROW + Q + l], row[ROW + V + l]
            A_h, R_h = hook_row(
                e, r, lift.hook, row[C + l], row[D + l], row[Q + l], q_h, row[V + l], v_h, row[ROW + W + l], h
            )
            x, v, p = q_h - row[2 * ROW + Q + l], v_h - row[2 * ROW + V + l], get_momentum(A, MOMENTUM + l)
            ends = pull_joint(x, v, lift.z_ref + q_h, A_h, R_h, p.A, p.R, h, lift.sling, get_link(A, l))
            row[ROW + D + l] = ends.v_up
            row[2 * ROW + D + l] = ends.v_down
        finish(A, B, N, t + h, tau, h)

    @scalar
    def finish(A, B, N, t, tau, h):
        """Speeds at mid-step from the bottom up, positions and speeds at the end t of a step that began tau into the
        cycle [s], works and statistics."""
        hook = B[N * ROW :]
        for l in range(LANES):
            b = load(A, l)
            p, g, lift = b.momentum, b.hang.body, b.lift
            v_h, v_p = hook[D + l], hook[ROW + D + l]
            x_0 = hook[Q + l] - hook[ROW + Q + l]
            dv = 2.0 * (v_p - hook[ROW + V + l])
            rate = v_h - v_p
            z_h, v_h_0 = lift.z_ref + hook[Q + l], hook[V + l] - hook[ROW + V + l]
            works = of_body(b.hang.works, p, v_p, dv, h, lift.load)
            F_s, sea, works = joined(A, l, works, x_0, v_h_0, z_h, v_h, v_p, h, lift.sling)
            x_1 = x_0 + h * rate
            put_works(A, WORKS + l, works)
            z_0, v_0 = lift.z_ref + hook[ROW + Q + l], hook[ROW + V + l]
            hook[ROW + Q + l] += h * v_p
            hook[ROW + V + l] += dv
            hook[V + l] = 2.0 * v_h - hook[V + l]
            hook[Q + l] += h * v_h
            A[SUMS + LANES + l] = hook[W + l] * v_h
            since = g.since_taut + h if F_s > 0.0 else 0.0
            snapping = 1.0 if F_s > 0.0 and since < SNAP and b.ls.slack + b.ls.slack_landed > 0.0 else 0.0
            z, v = lift.z_ref + hook[ROW + Q + l], hook[ROW + V + l]
            stats = fold_step(b.ls, t, h, z_0, v_0, z, v, F_s, snapping, p.force, g.grounded, lift.load)
            stats, grounded = grounded_of(A, l, b, stats, t, tau, h, z_0, v_0, z)
            put_statistics(A, l, b, stats, t, h, x_1, rate, sea)
            A[GROUNDED + l] = grounded
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
            w = of_wire(get_works(A, WORKS + l), get_rows(A, ROWS + l), B[D + l], get_sums(A, SUMS + l), h)
            put_works(A, WORKS + l, w)
            A[V_W_0 + l] = wire_speed(get_x(A, X + l).winch, get_geo(A, GEO + l))

    return BelowWinch(relay, step)
