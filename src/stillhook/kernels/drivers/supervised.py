"""The programme of a lowering in every lane: its stage in force, what the supervisor orders, and statistics of each
stage."""

from dataclasses import dataclass
from typing import Any

from stillhook.control.commands import IDLE_MOST
from stillhook.control.plc import Memory, Plc
from stillhook.control.supervisor import Stage, Supervisor, Watch, supervise
from stillhook.kernels.drivers.loop import ordered_of
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import access, offset, size
from stillhook.physics.records import replace
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.lift import Course, Hanging, compensating
from stillhook.winches.load_path.payload import NEVER
from stillhook.winches.records import Geometry, Tick, Tip

STAGE_SIZE = size(Stage)


@dataclass(frozen=True)
class Supervised:
    """new_stages and take_stage begin a cycle; the others are hooks, see `stillhook.kernels.drivers.loop.Hooks`."""

    new_stages: Any
    take_stage: Any
    ordered: Any
    keep: Any
    watch: Any


def supervised(d: Driver, followed: Any) -> Supervised:
    """See `Supervised`; followed(b): what the PLC's reference has besides the tip [m]. As plain Python."""
    LANES, SIGNALS, geometry, sensing, path_point = d.lanes, d.parts.windows, d.geometry, d.sensing, d.path_point
    Ordered = ordered_of(d, sup=Supervisor)
    with_plc, with_tau, with_F = replace(d.Params, "plc"), replace(Plc, "tau_F"), replace(Memory, "F", "u_p", "idle")
    with_c, with_orders = replace(Geometry, "c"), replace(Tick, "v_op", "s_op", "mode", "f_pump", "f_passive")
    put_sup = access(Supervisor, LANES).store
    ST, HANG, STAGE_NOW = (offset(d.Lane, f, LANES) for f in ("st", "hang", "stage"))
    COURSE = HANG + offset(Hanging, "course", LANES)
    SUP, S_JOY, E_HELD, STAGE, K_STAGE, DATUM = (COURSE + offset(Course, f, LANES) for f in Course._fields)
    SUP_STAGE, SUP_DONE = (SUP + offset(Supervisor, f, LANES) for f in ("stage", "done"))
    NT = size(d.Stats) + sum(map(size, d.parts.stats.values()))
    NG = NT + SIGNALS

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
    def take_stage(A, S, n_stages):
        """Every lane's stage in force."""
        for l in range(LANES):
            row = S[min(max(int(A[SUP_STAGE + l]), 0), n_stages - 1) * STAGE_SIZE * LANES :]
            for f in range(STAGE_SIZE):
                A[STAGE_NOW + f * LANES + l] = row[f * LANES + l]

    @scalar
    def ordered(b, t):
        """What the supervisor orders one lane at t [s]."""
        tip = Tip(b.tick.s, b.tick.v)
        e, rope = b.hang.wire.element, b.lift.rope
        # from drum to tip the wire is damped as its elements are
        geo = with_c(geometry(b.x.path.s_w, b.p), e.c / e.k * rope.EA / rope.L_0)
        q = path_point(b.x, geo, tip, b.p)
        raw, _, _ = sensing(b.x.winch, b.x.path, q, b.m, b.tick, geo, b.laws, b.p)
        read = Watch(t=t, s_w=raw.s_w, F=raw.F, s_tip=raw.s_tip, v_tip=raw.v_tip)
        order, sup = supervise(read, b.hang.course.sup, b.stage, b.lift.settings)
        left = order.power
        tick = with_orders(b.tick, order.v_op, order.s_op, order.mode, left * b.tick.f_pump, left * b.tick.f_passive)
        held, stopped = order.hold > 0.5, order.stop > 0.5
        m = with_F(
            b.m,
            order.F_hold if held else b.m.F,
            0.0 if stopped else b.m.u_p,
            IDLE_MOST if stopped else b.m.idle,
        )
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
        active = compensating(o.sup, b.stage, b.lift.settings.code) > 0.5
        A[E_HELD + l] = y.e_c - followed(b) if active else b.hang.course.e_held

    return Supervised(new_stages, take_stage, ordered, keep, seen)
