"""The loop of every run, for one trajectory or sixteen side by side: cycle by cycle the PLC, statistics and a row of
the series, and the steps in between.

What hangs below a winch beyond its load path joins the loop by `Hooks`: nothing for a load on its wire and for a host's
tension, a supervisor, a long wire and a payload in water for a lowering (`stillhook.kernels.drivers.lift`).
"""

from dataclasses import dataclass
from typing import Any

from stillhook.control.plc import Memory
from stillhook.kernels.drivers.commands import commands_in_force
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import Array, access, offset, size
from stillhook.kernels.oscillation import Oscillation, Watched, fold_period, fold_watched
from stillhook.kernels.statistics import SIGNALS, window_add, window_turn
from stillhook.physics.records import define, record
from stillhook.physics.scalar import align_stack, fmax, scalar
from stillhook.winches.records import THIN, Geometry, Tick, Tip

NH = 12
"""Weights of a quintic at one place, see `tip_between`."""
MOST = 1.0e15
"""Magnitude beyond which no state of a winch is one [SI]: the largest of the ranges in `state_ranges.csv`."""

LOOK = 4
"""Cycles between two looks whether all states are numbers."""


def idle(n: int) -> Any:
    """A hook of n arguments that does nothing."""
    names: dict[str, Any] = {}
    define(f'def idle({", ".join(f"a_{i}" for i in range(n))}):\n    """Nothing."""\n', names, f"<idle of {n}>")
    return scalar(names["idle"])


IDLE = {n: idle(n) for n in (2, 4, 5, 7)}


@scalar
def all_energy(E, b):
    """All that winch and load path have [J]."""
    return E


@dataclass(frozen=True)
class Hooks:
    """What joins the loop of a run, functions that change the lanes A; `at` is what its kernel was called with besides.

    A lane is b where it is loaded, of number l; t time and tau time into the cycle [s], h step [s], k number of the
    cycle.
    """

    ordered: Any  # (b, t): `Ordered`, what the PLC works with
    take: Any  # (A, at, W, i, n_win, full, k): windows take a sample
    arrive: Any = IDLE[7]  # (A, at, W, k, n_win, t_cycle, watched): before the PLC's cycle
    keep: Any = IDLE[4]  # (A, l, b, o): who orders remembers
    watch: Any = IDLE[5]  # (A, l, b, o, y): the same in a cycle that is watched; y signals
    energy: Any = all_energy  # (E, b): energy that the audit counts, of that in winch and load path E [J]
    show: Any = IDLE[2]  # (A, at): signals besides those of the winch
    before: Any = IDLE[5]  # (A, at, t, tau, h): before the winch's step
    after: Any = IDLE[2]  # (A, at)
    skips: bool = False  # whether there may be cycles that are not watched


def ordered_of(d: Driver, **more: Any) -> Any:
    """The record of what the PLC of a driver works with: tip, drum, point of the load path, what comes from outside,
    memory, parameters; and more."""
    point = {"q": d.path.Point, "tick": Tick, "m": Memory, "p": d.Params}
    return record("Ordered", d.Lane.__module__, tip=Tip, geo=Geometry, **point, **more)


def cycles_of(d: Driver, hooks: Hooks) -> Any:
    """The loop of a run on all lanes of a driver, as plain Python."""
    LANES, plant, Lane = d.lanes, d.plant, d.Lane
    circuit, stored_energy, path_energy = plant.circuit, plant.stored_energy, d.path.energy
    control, signals, fold, step = d.control, d.signals, d.fold, d.step
    arrive, ordered, keep, seen, energy = hooks.arrive, hooks.ordered, hooks.keep, hooks.watch, hooks.energy
    show, take, before, after = hooks.show, hooks.take, hooks.before, hooks.after

    def store(cls: Any) -> Any:
        return access(cls, LANES).store

    load, (in_force, kept) = access(Lane, LANES).load, commands_in_force(d)
    put_x, put_u, put_geo, put_m = store(d.State), store(d.Command), store(Geometry), store(Memory)
    put_laws, put_st, put_y, put_tip = store(d.LawRecord), store(d.Counted), store(d.Signals), store(Tip)
    put_watched, put_oscillation = store(Watched), store(Oscillation)
    load_watched, load_oscillation = access(Watched, LANES).load, access(Oscillation, LANES).load
    X, U, U_0, GEO, M, LAWS, ST, Y, TIP_0, TIP_1, TIP_2, TICK = (
        offset(Lane, f, LANES)
        for f in ("x", "u", "u_0", "geo", "m", "laws", "st", "y", "tip_0", "tip_1", "tip_2", "tick")
    )
    Y_V, Y_V_TIP, Y_A_TIP, Y_V_OP, Y_F = (
        Y + offset(d.Signals, f, LANES) for f in ("v_w", "v_tip", "a_tip", "v_op", "F_w")
    )
    V_M = TICK + offset(Tick, "v_m", LANES)
    SWING = ST + offset(d.Stats, "oscillation", LANES)
    SWING_UP = SWING + offset(Oscillation, "watched", LANES) + offset(Watched, "up", LANES)
    Y_LOAD = Y + offset(d.Signals, "s_load", LANES)  # and its speed: in a lowering those of the payload
    NS, NX = len(d.columns), size(d.State)

    @scalar
    def beyond(A, row, cols, k):
        """How many numbers of the row that drives cycle k, and every `LOOK` cycles of states and load, are none, or are
        beyond what a winch can reach.

        The row is looked at by itself: of a tip without a place comes a slack wire, and sound states.
        """
        n = 0
        for l in range(cols * LANES):
            n += 0 if abs(row[l]) <= MOST else 1
        if k % LOOK == 0:
            for l in range(NX * LANES):
                n += 0 if abs(A[X + l]) <= MOST else 1
            for l in range(2 * LANES):
                n += 0 if abs(A[Y_LOAD + l]) <= MOST else 1
        return n

    @scalar
    def tip_between(start, end, l, H, k):
        """Tip of lane l at a fixed place between two cycles: the quintic through s, v, a of the rows at both ends.

        Row k of H holds the quintic's weights.
        """
        j = k * NH
        s_0, v_0, a_0 = start[l], start[l + LANES], start[l + 2 * LANES]
        s_1, v_1, a_1 = end[l], end[l + LANES], end[l + 2 * LANES]
        s = H[j] * s_0 + H[j + 1] * v_0 + H[j + 2] * a_0 + H[j + 3] * s_1 + H[j + 4] * v_1 + H[j + 5] * a_1
        v = H[j + 6] * s_0 + H[j + 7] * v_0 + H[j + 8] * a_0 + H[j + 9] * s_1 + H[j + 10] * v_1 + H[j + 11] * a_1
        return Tip(s, v)

    @scalar
    def take_tick(A, row, cols):
        """The drive's row into the lanes; a thin row moves the tip, and an ideal sensor sees the same."""
        for l in range(cols * LANES):
            A[TICK + l] = row[l]
        if cols == THIN:
            for l in range(THIN * LANES):
                A[TICK + THIN * LANES + l] = row[l]

    @scalar
    def command(A, l, b, o, u, m, law):
        """Lane l with what its PLC decided."""
        put_u(A, U_0 + l, b.u)
        put_u(A, U + l, u)
        put_geo(A, GEO + l, o.geo)
        put_m(A, M + l, m)
        put_laws(A, LAWS + l, kept(b, law))
        put_tip(A, TIP_0 + l, o.tip)

    @scalar
    def cycle(A, t, w):
        """PLC cycle, signals and statistics of every lane at t [s]; w weight of this cycle in integrals."""
        for l in range(LANES):
            b = load(A, l)
            o = ordered(b, t)
            u, m, law, drive = control(b.x, o.m, b.laws, o.tick, o.tip, o.geo, o.p)
            c = circuit(b.x.winch, o.q, u, o.geo, b.p)
            y = signals(c, b.x, o.q, u, m, drive, o.tick, o.geo, b.p)
            E = energy(stored_energy(c, b.x.winch, o.geo, b.p) + path_energy(o.q, b.x.path, b.p), b)
            put_st(A, ST + l, fold(b.st, y, c, b.x, o.q, u, o.tip, E, b.p, w))
            seen(A, l, b, o, y)
            keep(A, l, b, o)
            command(A, l, b, o, u, m, law)
            put_y(A, Y + l, y)

    if hooks.skips:

        @scalar
        def unwatched(A, t):
            """PLC cycle of every lane at t [s], no more."""
            for l in range(LANES):
                b = load(A, l)
                o = ordered(b, t)
                u, m, law, _ = control(b.x, o.m, b.laws, o.tick, o.tip, o.geo, o.p)
                keep(A, l, b, o)
                command(A, l, b, o, u, m, law)

    else:

        @scalar
        def unwatched(A, t):
            """Nothing: every cycle is watched."""

    @scalar
    def watch(A, dt):
        """Every lane looks for an oscillation in the signals of this cycle, dt after the last that it saw [s]."""
        for l in range(LANES):
            w = load_watched(A, SWING + l)
            demand = A[V_M + l] - A[Y_V_OP + l]
            w = fold_watched(w, dt, A[Y_V + l], A[Y_V_TIP + l], A[Y_A_TIP + l], demand, A[Y_F + l])
            put_watched(A, SWING + l, w)
        any_up = 0.0
        for l in range(LANES):
            any_up = fmax(any_up, A[SWING_UP + l])
        if any_up > 0.0:  # one question for all lanes: periods end seldom
            for l in range(LANES):
                if A[SWING_UP + l] > 0.0:
                    put_oscillation(A, SWING + l, fold_period(load_oscillation(A, SWING + l)))

    @scalar
    def cycles(A, at, D, cols, H, W, out, lost, every, k_0, n, first, last, n_win, sampled, n_sub, t_cycle):
        """Cycles k_0 .. k_0 + n of all lanes in A; cycle `last` is only observed.

        D holds n + 1 rows of cols numbers, each LANES wide (a whole Tick, or s, v, a alone), H the weights of its
        quintic. Statistics, windows of n_win samples and energies are taken every `sampled` cycles, windows from cycle
        `first` on; in between the PLC alone works. Every `every` cycles a row of the series goes to out (0: never).

        lost[0] is the cycle before which the lanes were left because a state, a load or what drives them was not a
        number, or beyond `MOST`; -1 where none was. What follows is run by another call.
        """
        lost[0] = -1.0
        h = t_cycle / n_sub
        for k in range(k_0, k_0 + n + 1 if k_0 + n == last else k_0 + n):
            row = D[(k - k_0) * cols * LANES :]
            watched = k % sampled == 0 or k == last
            take_tick(A, row, cols)
            arrive(A, at, W, k, n_win, t_cycle, watched)
            if watched:
                cycle(A, k * t_cycle, 0.5 if (k == first or k == last) else 1.0)
                show(A, at)
                watch(A, sampled * t_cycle)
                if k >= first:
                    j = (k - first) // sampled
                    take(A, at, W, j % n_win, n_win, 1.0 if j >= n_win - 1 else 0.0, k)
            else:
                unwatched(A, k * t_cycle)
            if every > 0 and k % every == 0:
                into = out[(k // every) * NS * LANES :]
                for l in range(NS * LANES):
                    into[l] = A[Y + l]
            if k == last:
                break
            ahead = row[cols * LANES :]
            for i in range(n_sub):
                for l in range(LANES):
                    put_tip(A, TIP_1 + l, tip_between(row, ahead, l, H, 2 * i))
                for l in range(LANES):
                    put_tip(A, TIP_2 + l, tip_between(row, ahead, l, H, 2 * i + 1))
                before(A, at, k * t_cycle + i * h, i * h, h)
                for l in range(LANES):
                    b = load(A, l)
                    put_x(A, X + l, step(b.x, in_force(b, i * h, h), b.geo, b.tip_0, b.tip_1, b.tip_2, b.p, h))
                after(A, at)
                for l in range(2 * LANES):
                    A[TIP_0 + l] = A[TIP_2 + l]
            if beyond(A, ahead, cols, k + 1) > 0:
                lost[0] = 1.0 * (k + 1)
                break

    return cycles


def run_of(d: Driver) -> Any:
    """The kernel of a winch with nothing below its load path, as plain Python."""
    LANES, plant_geometry, path_point = d.lanes, d.geometry, d.path_point
    Ordered = ordered_of(d)
    Y = offset(d.Lane, "y", LANES)
    Y_E, Y_EM, Y_TIP = (Y + offset(d.Signals, f, LANES) for f in ("e_c", "e_c_measured", "s_tip"))

    @scalar
    def ordered(b, t):
        """What comes from outside, as it is."""
        tip = Tip(b.tick.s, b.tick.v)
        geo = plant_geometry(b.x.path.s_w, b.p)
        return Ordered(tip, geo, path_point(b.x, geo, tip, b.p), b.tick, b.m, b.p)

    @scalar
    def take(A, at, W, i, n_win, full, k):
        """The moving windows of every lane take this cycle's sample as number i of their run."""
        w = SIGNALS * LANES
        for l in range(LANES):
            window_add(W, w, l, i, n_win, full, A[Y_E + l])
            window_add(W, w, LANES + l, i, n_win, full, A[Y_EM + l])
            window_add(W, w, 2 * LANES + l, i, n_win, full, A[Y_TIP + l])
        if i == n_win - 1:
            window_turn(W, w, n_win)

    cycles = cycles_of(d, Hooks(ordered=ordered, take=take))

    def run(
        A: Array,
        D: Array,
        cols: int,
        H: Array,
        W: Array,
        out: Array,
        lost: Array,
        every: int,
        k_0: int,
        n: int,
        first: int,
        last: int,
        n_win: int,
        n_sub: int,
        t_cycle: float,
    ):
        """See `cycles_of`; every cycle is watched."""
        align_stack()
        cycles(A, 0.0, D, cols, H, W, out, lost, every, k_0, n, first, last, n_win, 1, n_sub, t_cycle)

    return run
