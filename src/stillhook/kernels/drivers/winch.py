"""A winch on a load path: records, and the scalar functions of an instant, a step and a PLC cycle of one trajectory.

`stillhook.kernels.build.driver` makes them for each winch type, load path, set of controllers and lane count, and the
loop of a run of them (`stillhook.kernels.drivers.loop`). Whatever the lane count, every trajectory goes through the
same scalar functions in the same order: the bits are the same.

Every function below is nested in the one that makes it, so that a kernel knows its winch, load path and lane count when
it is compiled; the records that depend on them are made first.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from stillhook.control.plc import Memory
from stillhook.kernels.control_laws import ControlLaws, shown
from stillhook.kernels.lanes import access
from stillhook.kernels.oscillation import Oscillation
from stillhook.kernels.statistics import SIGNALS, CommonStats, fold_common
from stillhook.physics.records import inflow, joined, record, replace
from stillhook.physics.scalar import fmax, scalar
from stillhook.winches.circuits.active import LinePowers, Ports, line_powers
from stillhook.winches.records import CommonSignals, Geometry, Tick, Tip

LINES = {"p_a", "p_b"}
"""Signals of a winch type whose dp is the difference of two lines."""


@dataclass(frozen=True)
class LaneParts:
    """Records of a lane besides those of every run, by name: statistics and signals, which follow those of the winch,
    and all else. windows: signals of which a run keeps moving windows."""

    stats: Mapping[str, Any] = field(default_factory=dict)
    signals: Mapping[str, Any] = field(default_factory=dict)
    others: Mapping[str, Any] = field(default_factory=dict)
    windows: int = SIGNALS


@dataclass(eq=False)
class Driver:
    """What runs a winch on a load path: records, the scalar functions that a run is made of, and its kernels.

    run(A, ..., D, cols, H, W, out, lost, every, k_0, n, first, last, n_win, n_sub, t_cycle) runs the lanes of A; see
    `stillhook.kernels.drivers.loop`, and of a lowering `stillhook.kernels.drivers.lift`.
    """

    plant: Any  # module of the winch type
    path: Any  # module of the load path
    laws: ControlLaws
    lanes: int
    made_of: tuple[str, tuple[str, ...], tuple[Any, ...]]  # winch type, further controllers, losses (see `Setup`)
    parts: LaneParts
    State: Any  # of winch and load path
    Command: Any
    Params: Any
    Signals: Any
    Powers: Any
    Counted: Any  # statistics but those of oscillations
    Stats: Any
    LawRecord: Any
    Lane: Any  # everything that one trajectory carries
    geometry: Any
    circuit: Any
    path_point: Any
    rates: Any
    step: Any
    sensing: Any
    control: Any
    signals: Any
    fold: Any
    run: Any = None
    at_rest: Any = None  # this and the next: see `stillhook.kernels.drivers.rest`
    prepare: Any = None
    read: Any = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of a series."""
        return tuple(name for each in (self.Signals, *self.parts.signals.values()) for name in each._fields)


def winch_driver(
    plant: Any,
    path: Any,
    laws: ControlLaws,
    lanes: int,
    made_of: tuple[Any, ...],
    parts: LaneParts,
    Params: Any,
    *,
    ports: bool = False,
) -> Driver:
    """A winch type on a load path under these controllers, as plain Python; parts: what its lanes hold besides; Params:
    the class of its parameters, with the losses of its motors; ports: its lines have restrictions, whose pressures are
    signals and whose power is a loss."""
    more = "".join(f", {name} {each.__module__}" for name, each in parts.others.items())
    more += "" if Params is plant.Params else f", {Params.__module__}"
    of = f"{__name__} {plant.__name__}, {path.__name__}, {laws.Record.__module__}{more}{', ports' if ports else ''}"
    Command, LawRecord = plant.Command, laws.Record
    circuit, winch_rates, geometry, wire_speed = plant.circuit, plant.rates, plant.geometry, plant.wire_speed
    sensing, actuate = laws.sensing(plant.sense, LINES <= set(plant.Signals._fields)), plant.actuate
    of_plant, winch_signals, winch_powers_record, winch_powers = outputs_of(plant, ports)
    limits, fold_extremes = plant.limits, plant.fold_extremes
    supplied = inflow(winch_powers_record, *(n for n in plant.SUPPLIED if n not in getattr(plant, "WITHIN", ())))
    point, path_rates, path_powers = path.at, path.rates, path.powers
    at_its_end, path_motion = path.at_its_end, path.motion
    plc_check, plc_cycle = laws.check, laws.cycle
    of_winch, join_signals = joined("Signals", CommonSignals, of_plant)
    Signals, keep_measured, show_measured = shown(laws.sensors, of_winch, laws.checks)
    Powers, join_powers = joined("Powers", winch_powers_record, path.Powers)
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
        **parts.stats,
        y=Signals,
        **parts.signals,
        tip_0=Tip,
        tip_1=Tip,
        tip_2=Tip,
        tick=Tick,
        p=Params,
        **parts.others,
    )
    axpy, with_winch = access(State, lanes).axpy, replace(State, "winch")
    add_limits, add_powers = access(plant.Limits, lanes).axpy, access(Powers, lanes).axpy
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
    def control(x, m, laws, tick, tip, geo, p):
        """One PLC cycle: plant commands, the PLC's memory, what the controllers remember, and the active drive's
        signals."""
        q = path_point(x, geo, tip, p)
        read, tick, laws = sensing(x.winch, x.path, q, m, tick, geo, laws, p)
        y, m, laws = plc_check(read, m, laws, p.plc)
        drive, after, laws = plc_cycle(y, m, laws, p.plc)
        u, after, drive = actuate(drive, y, x.winch, m, after, tick, geo, p)
        return u, after, laws, keep_measured(drive, read, laws)

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
        return show_measured(join_signals(common, winch_signals(c, x.winch, q, u, geo, p)), drive)

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

    return Driver(
        plant=plant,
        path=path,
        laws=laws,
        lanes=lanes,
        made_of=made_of,
        parts=parts,
        State=State,
        Command=Command,
        Params=Params,
        Signals=Signals,
        Powers=Powers,
        Counted=Counted,
        Stats=Stats,
        LawRecord=LawRecord,
        Lane=Lane,
        geometry=geometry,
        circuit=circuit,
        path_point=path_point,
        rates=rates,
        step=step,
        sensing=sensing,
        control=control,
        signals=signals,
        fold=fold,
    )


class Outputs(NamedTuple):
    """What a winch type shows of an instant: the record of its signals and what makes it, the same of its powers."""

    Signals: Any
    signals: Any
    Powers: Any
    powers: Any


def outputs_of(plant: Any, ports: bool) -> Outputs:
    """Signals and powers of a winch type, with those of the restrictions of its lines where it has some."""
    if not ports:
        return Outputs(plant.Signals, plant.signals, plant.Powers, plant.powers)
    of_winch, powers_of, lost = plant.signals, plant.powers, line_powers
    Signals, join_signals = joined("Signals", plant.Signals, Ports)
    Powers, join_powers = joined("Powers", plant.Powers, LinePowers)

    @scalar
    def signals(c, x, q, u, geo, p):
        """Signals of the winch, and the pressures at its ports."""
        return join_signals(of_winch(c, x, q, u, geo, p), c.ports)

    @scalar
    def powers(c, x, q, p):
        """Powers of the winch, and what its lines take."""
        return join_powers(powers_of(c, x, q, p), lost(c))

    return Outputs(Signals, signals, Powers, powers)


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
