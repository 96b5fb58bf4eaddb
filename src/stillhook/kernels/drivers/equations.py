"""The equations of winch, load path and PLC at many instants, for what differentiates them."""

from dataclasses import dataclass
from typing import Any

from stillhook.control.plc import Memory
from stillhook.kernels.drivers.winch import Driver
from stillhook.kernels.lanes import Array, access, size
from stillhook.physics.records import record, replace
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Geometry, Tick, Tip

MOMENT, LONG = 1e-15, 1e9
"""Times over which the exact step of a bristle is a straight line, and has come to its end [s]."""


@dataclass(frozen=True)
class Equations:
    """rates_at(S, out, n): time derivatives of all states at n instants; cycles_at(S, out, n): what a PLC cycle gives,
    each of n by itself; numbers of a row of results of either."""

    rates_at: Any
    cycles_at: Any
    RATES: int
    AFTER: int


def equations_of(d: Driver) -> Equations:
    """The equations of a driver, as plain Python. A row of S holds what is varied, then what stands: state, commands,
    tip, drum, parameters; before a cycle state, memory, controllers, tick, tip, drum, parameters."""
    State, Command, Params, LawRecord, plant = d.State, d.Command, d.Params, d.LawRecord, d.plant
    circuit, path_point, rates, control = d.circuit, d.path_point, d.rates, d.control
    of = State.__module__
    Instant = record("Instant", of, x=State, u=Command, tip=Tip, geo=Geometry, p=Params)
    Before = record("Before", of, x=State, m=Memory, laws=LawRecord, tick=Tick, tip=Tip, geo=Geometry, p=Params)
    After = record("After", of, u=Command, m=Memory, laws=LawRecord)
    instant, before = access(Instant, 1).load, access(Before, 1).load
    put_rates, put_after = access(State, 1).store, access(After, 1).store
    INSTANT, RATES, BEFORE, AFTER = size(Instant), size(State), size(Before), size(After)

    if "z" not in plant.State._fields:

        @scalar
        def all_rates(b):
            """Time derivatives of all states."""
            return rates(b.x, b.u, b.geo, b.tip, b.p)

    else:
        with_winch, with_z, bristle_after = replace(State, "winch"), replace(plant.State, "z"), plant.bristle_after

        @scalar
        def z_rate(c, x, p):
            """Rate of the bristle's deflection out of its exact step, which relaxes towards v / rate: v - rate z."""
            free = with_z(x, 0.0)
            v = bristle_after(c, free, p, MOMENT) / MOMENT
            end = bristle_after(c, free, p, LONG)
            return v - (v / end) * x.z if abs(end) > 0.0 else 0.0

        @scalar
        def all_rates(b):
            """Time derivatives of all states, that of the bristle among them."""
            r = rates(b.x, b.u, b.geo, b.tip, b.p)
            c = circuit(b.x.winch, path_point(b.x, b.geo, b.tip, b.p), b.u, b.geo, b.p)
            return with_winch(r, with_z(r.winch, z_rate(c, b.x.winch, b.p)))

    def rates_at(S: Array, out: Array, n: int):
        """Time derivatives of all states at n instants."""
        for k in range(n):
            put_rates(out, k * RATES, all_rates(instant(S, k * INSTANT)))

    def cycles_at(S: Array, out: Array, n: int):
        """What a PLC cycle gives, each of n by itself."""
        for k in range(n):
            b = before(S, k * BEFORE)
            u, m, laws, _ = control(b.x, b.m, b.laws, b.tick, b.tip, b.geo, b.p)
            put_after(out, k * AFTER, After(u, m, laws))

    return Equations(rates_at, cycles_at, RATES, AFTER)
