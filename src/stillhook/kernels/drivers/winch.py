"""The driver of any winch on any load path, for one trajectory or sixteen side by side.

`stillhook.kernels.build.driver` makes one for each winch type, load path, set of controllers and lane count, and
compiles what runs. Whatever the lane count, every trajectory goes through the same scalar functions in the same order:
the bits are the same.

Every function below is nested in the one that makes it, so that a kernel knows its winch, load path and lane count when
it is compiled; the records that depend on them are made first.
"""

from dataclasses import dataclass
from typing import Any

from stillhook.control.plc import Memory
from stillhook.kernels.control_laws import ControlLaws
from stillhook.kernels.lanes import Array, access, joined, offset, size
from stillhook.kernels.statistics.cycles import SIGNALS, CommonStats, fold_common, window_add, window_turn
from stillhook.kernels.statistics.oscillation import Oscillation, Watched, fold_period, fold_watched
from stillhook.physics.records import inflow, record, replace
from stillhook.physics.scalar import align_stack, clip, fmax, scalar
from stillhook.winches.records import THIN, CommonSignals, Geometry, Tick, Tip

NH = 12
"""Weights of a quintic at one place, see `tip_between`."""


@dataclass(eq=False)
class Driver:
    """What runs a winch on a load path: records, kernels and the scalar functions that they are made of.

    run(A, D, cols, H, W, out, every, k_0, n, first, last, n_win, n_sub, t_cycle) runs the lanes of A; the others are
    those of the functions below by the same names.
    """

    plant: Any  # module of the winch type
    path: Any  # module of the load path
    laws: ControlLaws
    lanes: int
    made_of: tuple[str, tuple[str, ...]]  # winch type, controllers in addition to those of every kernel
    State: Any  # of winch and load path
    Command: Any
    Params: Any
    Signals: Any
    Powers: Any
    Stats: Any
    LawRecord: Any
    Lane: Any  # everything that one trajectory carries
    geometry: Any
    circuit: Any
    path_point: Any
    rates: Any
    step: Any
    in_force: Any
    tip_between: Any
    take_tick: Any
    sensing: Any
    control: Any
    signals: Any
    fold: Any
    watch: Any
    put_st: Any  # stores all statistics but those of oscillations
    run: Any
    at_rest: Any = None  # this and the next: see `stillhook.kernels.drivers.rest`
    prepare: Any = None
    read: Any = None


def winch_driver(plant: Any, path: Any, laws: ControlLaws, lanes: int, made_of: tuple[str, tuple[str, ...]]) -> Driver:
    """The driver of a winch type on a load path under these controllers, as plain Python."""
    LANES = lanes
    of = f"{__name__} {plant.__name__}, {path.__name__}, {laws.Record.__module__}"
    Command, Params, LawRecord = plant.Command, plant.Params, laws.Record
    circuit, winch_rates, geometry, wire_speed = plant.circuit, plant.rates, plant.geometry, plant.wire_speed
    sensing, actuate = laws.sensing(plant.sense), plant.actuate
    own_signals, winch_powers, stored_energy = plant.signals, plant.powers, plant.stored_energy
    limits, fold_extremes = plant.limits, plant.fold_extremes
    supplied = inflow(plant.Powers, *(n for n in plant.SUPPLIED if n not in getattr(plant, "WITHIN", ())))
    point, path_rates, path_powers = path.at, path.rates, path.powers
    path_energy, at_its_end, path_motion = path.energy, path.at_its_end, path.motion
    plc_check, plc_cycle = laws.check, laws.cycle
    Signals, join_signals = joined("Signals", CommonSignals, plant.Signals)
    Powers, join_powers = joined("Powers", plant.Powers, path.Powers)
    State = record("State", of, winch=plant.State, path=path.State)
    # what is counted: statistics of every winch, extremes of its own, cycles beyond each limit, powers summed up
    counted = {"common": CommonStats, "extremes": plant.Extremes, "limits": plant.Limits, "power": Powers}
    Counted = record("Counted", of, **counted)
    Stats = record("Stats", of, **counted, oscillation=Oscillation)
    Lane = record(
        "Lane",
        of,
        x=State,
        u=Command,
        u_0=Command,  # commands of the cycle before, in force until those of this one are calculated
        geo=Geometry,
        m=Memory,
        laws=LawRecord,
        st=Stats,
        y=Signals,
        tip_0=Tip,
        tip_1=Tip,
        tip_2=Tip,
        tick=Tick,
        p=Params,
    )

    def store(cls: Any) -> Any:
        return access(cls, LANES).store

    load = access(Lane, LANES).load
    axpy, with_winch = access(State, LANES).axpy, replace(State, "winch")
    add_limits, add_powers = access(plant.Limits, LANES).axpy, access(Powers, LANES).axpy
    mix = access(Command, LANES).mix
    put_x, put_u, put_geo, put_m = store(State), store(Command), store(Geometry), store(Memory)
    put_laws, put_st, put_y, put_tip = store(LawRecord), store(Counted), store(Signals), store(Tip)
    put_watched, put_oscillation = store(Watched), store(Oscillation)
    load_watched, load_oscillation = access(Watched, LANES).load, access(Oscillation, LANES).load
    X, U, U_0, GEO, M, LAWS, ST, Y, TIP_0, TIP_1, TIP_2, TICK, _ = (offset(Lane, f, LANES) for f in Lane._fields)
    Y_E, Y_EM, Y_TIP = (Y + offset(Signals, f, LANES) for f in ("e_c", "e_c_measured", "s_tip"))
    Y_V, Y_V_TIP, Y_A_TIP, Y_V_OP, Y_F = (
        Y + offset(Signals, f, LANES) for f in ("v_w", "v_tip", "a_tip", "v_op", "F_w")
    )
    V_M = TICK + offset(Tick, "v_m", LANES)
    SWING = ST + offset(Stats, "oscillation", LANES)
    SWING_UP = SWING + offset(Oscillation, "watched", LANES) + offset(Watched, "up", LANES)
    NS = size(Signals)
    with_friction = bristle_step(plant)

    @scalar
    def path_point(x, geo, tip, p):
        """The load path at an instant."""
        return point(wire_speed(x.winch, geo), x.path, geo, tip, p)

    @scalar
    def rates(x, u, geo, tip, p):
        """Time derivatives of winch and load path, which meet at wire speed and tension."""
        q = path_point(x, geo, tip, p)
        c = circuit(x.winch, q, u, geo, p)
        return State(winch_rates(c, x.winch, q, u, geo, p), path_rates(q, x.path, p))

    @scalar
    def step(x, u, geo, tip_0, tip_1, tip_2, p, h):
        """One step: the bristle exactly, everything else by the classic fourth-order Runge-Kutta method with the
        bristle held.

        The bristle is taken at the middle of the steps (a Strang splitting, second order): its update over h is centred
        on x.
        """
        q = path_point(x, geo, tip_0, p)
        c = circuit(x.winch, q, u, geo, p)
        x = with_winch(x, with_friction(c, x.winch, p, h))
        k_1 = State(winch_rates(c, x.winch, q, u, geo, p), path_rates(q, x.path, p))
        k_2 = rates(axpy(x, 0.5 * h, k_1), u, geo, tip_1, p)
        k_3 = rates(axpy(x, 0.5 * h, k_2), u, geo, tip_1, p)
        k_4 = rates(axpy(x, h, k_3), u, geo, tip_2, p)
        return axpy(axpy(axpy(axpy(x, h / 6, k_1), h / 3, k_2), h / 3, k_3), h / 6, k_4)

    @scalar
    def in_force(b, tau, h):
        """Commands in force over a step of h that begins tau into the cycle [s]: those of the cycle before until the
        PLC has calculated."""
        return mix(b.u, b.u_0, clip((b.p.plc.t_compute - tau) / h, 0.0, 1.0))

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
    def control(x, m, laws, tick, tip, geo, p):
        """One PLC cycle: plant commands, the PLC's memory, what the controllers remember, and the active drive's
        signals."""
        q = path_point(x, geo, tip, p)
        read, tick, laws = sensing(x.winch, x.path, q, m, tick, geo, laws, p)
        read, m, laws = plc_check(read, m, laws, p.plc)
        drive, after, laws = plc_cycle(read, m, laws, p.plc)
        u, after, drive = actuate(drive, read, x.winch, m, after, tick, geo, p)
        return u, after, laws, drive

    @scalar
    def signals(c, x, q, u, m, drive, tick, geo, p):
        """One row of the time series."""
        y, tip = x.path, path_motion(tick)
        common = CommonSignals(
            s_tip=tip.s,
            v_tip=tip.v,
            a_tip=tip.a,
            s_w=y.s_w,
            v_w=q.v_w,
            e_c=m.datum + tip.s - tick.s_op - y.s_w,
            e_c_measured=drive.e_c,
            u_p=drive.u_p,
            u_m=drive.u_m,
            u_ff=drive.u_ff,
            u_raw=drive.u_raw,
            F_w=q.F_w,
            s_load=y.s_load,
            v_load=y.v_load,
            layer=geo.layers,
            mode=tick.mode,
            v_op=tick.v_op,
            brake=u.brake,
        )
        return join_signals(common, own_signals(c, x.winch, q, u, geo, p))

    @scalar
    def through(power, q):
        """Power through the winch [W]: what comes in from its supply and over the wire, each joule once."""
        return supplied(power) + fmax(-q.F_w * q.v_w, 0.0)

    @scalar
    def fold(a, y, c, x, q, u, tip, E, p, w):
        """Statistics with one more cycle: y signals, E stored energy [J], w weight of the cycle in integrals."""
        power = join_powers(winch_powers(c, x.winch, q, p), path_powers(q, x.path, tip, p))
        return Counted(
            fold_common(a.common, y, through(power, q), E, at_its_end(x.path, p), w),
            fold_extremes(a.extremes, y),
            add_limits(a.limits, 1.0, limits(c, x.winch, q, u, p)),
            add_powers(a.power, w, power),
        )

    @scalar
    def cycle(A, w):
        """PLC cycle, signals and statistics of every lane; w weight of this cycle in integrals."""
        for l in range(LANES):
            b = load(A, l)
            tip = Tip(b.tick.s, b.tick.v)
            geo = geometry(b.x.path.s_w, b.p)
            u, m, law, drive = control(b.x, b.m, b.laws, b.tick, tip, geo, b.p)
            q = path_point(b.x, geo, tip, b.p)
            c = circuit(b.x.winch, q, u, geo, b.p)
            y = signals(c, b.x, q, u, m, drive, b.tick, geo, b.p)
            E = stored_energy(c, b.x.winch, geo, b.p) + path_energy(q, b.x.path, b.p)
            put_u(A, U_0 + l, b.u)
            put_u(A, U + l, u)
            put_geo(A, GEO + l, geo)
            put_m(A, M + l, m)
            put_laws(A, LAWS + l, law)
            put_y(A, Y + l, y)
            put_st(A, ST + l, fold(b.st, y, c, b.x, q, u, tip, E, b.p, w))
            put_tip(A, TIP_0 + l, tip)

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
    def windows(A, W, i, n_win, full):
        """The moving windows of every lane take this cycle's sample as number i of their run."""
        w = SIGNALS * LANES
        for l in range(LANES):
            window_add(W, w, l, i, n_win, full, A[Y_E + l])
            window_add(W, w, LANES + l, i, n_win, full, A[Y_EM + l])
            window_add(W, w, 2 * LANES + l, i, n_win, full, A[Y_TIP + l])
        if i == n_win - 1:
            window_turn(W, w, n_win)

    def run(
        A: Array,
        D: Array,
        cols: int,
        H: Array,
        W: Array,
        out: Array,
        every: int,
        k_0: int,
        n: int,
        first: int,
        last: int,
        n_win: int,
        n_sub: int,
        t_cycle: float,
    ):
        """Cycles k_0 .. k_0 + n of all lanes in A; cycle `last` is only observed.

        D holds n + 1 rows of cols numbers, each LANES wide (a whole Tick, or s, v, a alone). Windows count from cycle
        `first` on. Every `every` cycles a row of Signals goes to out (0: never).
        """
        align_stack()
        h = t_cycle / n_sub
        for t in range(n + 1 if k_0 + n == last else n):
            k = k_0 + t
            row = D[t * cols * LANES :]
            take_tick(A, row, cols)
            cycle(A, 0.5 if (k == first or k == last) else 1.0)
            watch(A, t_cycle)
            if k >= first:
                windows(A, W, (k - first) % n_win, n_win, 1.0 if k - first >= n_win - 1 else 0.0)
            if every > 0 and k % every == 0:
                into = out[(k // every) * NS * LANES :]
                for l in range(NS * LANES):
                    into[l] = A[Y + l]
            if t == n:
                break
            ahead = row[cols * LANES :]
            for i in range(n_sub):
                for l in range(LANES):
                    put_tip(A, TIP_1 + l, tip_between(row, ahead, l, H, 2 * i))
                for l in range(LANES):
                    put_tip(A, TIP_2 + l, tip_between(row, ahead, l, H, 2 * i + 1))
                for l in range(LANES):
                    b = load(A, l)
                    put_x(A, X + l, step(b.x, in_force(b, i * h, h), b.geo, b.tip_0, b.tip_1, b.tip_2, b.p, h))
                for l in range(2 * LANES):
                    A[TIP_0 + l] = A[TIP_2 + l]

    return Driver(
        plant=plant,
        path=path,
        laws=laws,
        lanes=lanes,
        made_of=made_of,
        State=State,
        Command=Command,
        Params=Params,
        Signals=Signals,
        Powers=Powers,
        Stats=Stats,
        LawRecord=LawRecord,
        Lane=Lane,
        geometry=geometry,
        circuit=circuit,
        path_point=path_point,
        rates=rates,
        step=step,
        in_force=in_force,
        tip_between=tip_between,
        take_tick=take_tick,
        sensing=sensing,
        control=control,
        signals=signals,
        fold=fold,
        watch=watch,
        put_st=put_st,
        run=run,
    )


def bristle_step(plant: Any) -> Any:
    """A function (circuit, state, parameters, h) that gives the winch's state with its bristle h [s] later; without a
    bristle the state as it is."""
    if "z" not in plant.State._fields:

        @scalar
        def unchanged(c, x, p, h):
            return x

        return unchanged
    with_z, bristle_after = replace(plant.State, "z"), plant.bristle_after

    @scalar
    def moved(c, x, p, h):
        return with_z(x, bristle_after(c, x, p, h))

    return moved
