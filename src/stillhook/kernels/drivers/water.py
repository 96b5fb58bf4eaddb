"""The water at the payload of every lane, and the levels of submergence that its numbers are taken between."""

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
from stillhook.physics.scalar import fmax, scalar
from stillhook.winches.load_path.lift import Hanging, Lift
from stillhook.winches.load_path.payload import Body, cubic, level_of, place

HALF = (LEVELS - 1) // 2
"""First stride of the search for a level."""


@dataclass(frozen=True)
class WaterAt:
    """look_up(A, T): the levels about the submergence of every payload; take_water(A, B, N, T, lo, hi, H_w, levels):
    the water at the start of a cycle; take_current(A, B, N, T): the current there; force(b, z, v, water): `WaterForce`
    on the payload of a lane."""

    look_up: Any
    take_water: Any
    take_current: Any
    force: Any


def water_at_payload(d: Driver, joint: Any, body: Any) -> WaterAt:
    """See `WaterAt`; also at the body that a joint may have. As plain Python."""
    LANES = ONE_BY_ONE = d.lanes  # for the compiler: a loop over LANES runs side by side; not over the other
    Q, ROW = 0, 5 * LANES
    load, get_lift = access(d.Lane, LANES).load, access(Lift, LANES).load
    put_water, put_levels = access(Water, LANES).store, access(Heights, LANES).store
    BODY = offset(d.Lane, "hang", LANES) + offset(Hanging, "body", LANES)
    WATER, LEVEL, LO, HI, H_WET = (BODY + offset(Body, f, LANES) for f in ("water", "level", "lo", "hi", "h"))
    LIFT = offset(d.Lane, "lift", LANES)
    REACH = LIFT + offset(Lift, "load", LANES) + offset(Payload, "reach", LANES)
    COLUMNS = size(WettedLevel)

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
    def water_about(z, level, eta, eta_dot, field, lo, hi, l, H_w, last):
        """The water at heights z above still water, and the levels at which it was taken; level those before."""
        y = Heights(
            level_of(z.m_1, level.m_1, field),
            level_of(z.m_2, level.m_2, field),
            level_of(z.d_1, level.d_1, field),
            level_of(z.d_2, level.d_2, field),
        )
        _, a_1 = water_at(y.m_1, field.last, lo, hi, l, H_w, last)
        _, a_2 = water_at(y.m_2, field.last, lo, hi, l, H_w, last)
        w_1, b_1 = water_at(y.d_1, field.last, lo, hi, l, H_w, last)
        w_2, b_2 = water_at(y.d_2, field.last, lo, hi, l, H_w, last)
        return Water(eta=eta, eta_dot=eta_dot, a_1=a_1, a_2=a_2, w_1=w_1, w_2=w_2, b_1=b_1, b_2=b_2), y

    if hasattr(joint, "heights"):
        heights_of = joint.heights
        UNIT_WATER, UNIT_LEVEL = (offset(d.Lane, f, LANES) for f in ("unit_water", "unit_level"))

        @scalar
        def about_unit(A, l, b, hook, lo, hi, H_w, last):
            """The water at the body of what joins hook and payload."""
            x, w = hook[Q + l] - hook[ROW + Q + l], b.hang.body.water
            at = heights_of(x, b.lift.z_ref + hook[Q + l], b.link)
            made, y = water_about(at, b.unit_level, w.eta, w.eta_dot, b.lift.field, lo, hi, l, H_w, last)
            put_water(A, UNIT_WATER + l, made)
            put_levels(A, UNIT_LEVEL + l, y)

    else:

        @scalar
        def about_unit(A, l, b, hook, lo, hi, H_w, last):
            """Nothing: it has no body."""

    @scalar
    def take_water(A, B, N, T, lo, hi, H_w, levels):
        """The water at every load at the start of a cycle, from the samples before and after, over its part that is wet
        now."""
        hook = B[N * ROW :]
        for l in range(LANES):
            eta, eta_dot, eta_1, eta_dot_1 = lo[l], lo[LANES + l], hi[l], hi[LANES + l]
            surface = H_w[0] * eta + H_w[1] * eta_dot + H_w[2] * eta_1 + H_w[3] * eta_dot_1
            A[WATER + l] = surface
            A[WATER + LANES + l] = H_w[4] * eta + H_w[5] * eta_dot + H_w[6] * eta_1 + H_w[7] * eta_dot_1
            lift = get_lift(A, LIFT + l)
            A[H_WET + l] = submergence(lift.z_ref + hook[ROW + Q + l], surface, lift.load.reach)
        look_up(A, T)
        for l in range(LANES):
            b = load(A, l)
            g, field, last = b.hang.body, b.lift.field, levels - 1
            z = heights(b.lift.z_ref + hook[ROW + Q + l], wetted(g.h, g.lo, g.hi))
            made, y = water_about(z, g.level, g.water.eta, g.water.eta_dot, field, lo, hi, l, H_w, last)
            put_water(A, WATER + l, made)
            put_levels(A, LEVEL + l, y)
            about_unit(A, l, b, hook, lo, hi, H_w, last)

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

    return WaterAt(look_up, take_water, *current_past(d, body))


def current_past(d: Driver, body: Any) -> tuple[Any, Any]:
    """take_current and force of `WaterAt`, as plain Python."""

    @scalar
    def in_still_water(b, z, v, water):
        """Without a current."""
        g = b.hang.body
        return water_force(z, v, wetted(g.h, g.lo, g.hi), water, b.lift.load)

    if not hasattr(body, "in_current"):

        @scalar
        def no_current(A, B, N, T):
            """Nothing."""

        return no_current, in_still_water
    LANES = ONE_BY_ONE = d.lanes
    Knot, in_current, speed_at, COLUMNS = body.Knot, body.in_current, body.speed_at, size(WettedLevel)
    get_knot, load, CURRENT = access(Knot, LANES).load, access(d.Lane, LANES).load, offset(d.Lane, "current", LANES)

    @scalar
    def take_current(A, B, N, T):
        """The current at the middle of every payload, below the surface, from the knots that follow the levels in T."""
        q = B[(N + 1) * 5 * LANES :]
        for l in range(ONE_BY_ONE):
            b = load(A, l)
            h, j = fmax(-(b.lift.z_ref + q[l] + 0.5 * b.lift.load.H), 0.0), LEVELS * COLUMNS * LANES + l
            while T[j + COLUMNS * LANES] <= h:
                j += COLUMNS * LANES
            A[CURRENT + l] = speed_at(h, get_knot(T, j))

    @scalar
    def force(b, z, v, water):
        """With the current's part in the drag."""
        g = b.hang.body
        return in_current(in_still_water(b, z, v, water), v, wetted(g.h, g.lo, g.hi), water, b.current)

    return take_current, force
