"""A mock of OrcaFlex, written from the public help of OrcFxAPI: what calls an external function, in which order, with
what.

Its model is a load on a linear wire below a crane tip that moves: the trapezoidal rule, solved by iteration, so that
the function is called several times at each time. Everything that it shows is in its own units.
"""

import sys
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import pack
from stillhook.physics.load_path.drum import wire_damping, wire_stiffness
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

PASSES = 6
"""Calls of the function at one time."""


class NoSuchResultError(Exception):
    """What OrcFxAPI raises."""


def api() -> types.ModuleType:
    """The module OrcFxAPI as far as an external function needs it."""
    module = types.ModuleType("OrcFxAPI")

    class ObjectExtra:
        RigidBodyPos = (0.0, 0.0, 0.0)

    class Period:
        def __init__(self, number: int) -> None:
            assert number == 32005, "the present value"

    module.ObjectExtra, module.Period = ObjectExtra, Period  # type: ignore[attr-defined]
    return module


class Tip:
    """The crane tip as it moves in the case: between PLC cycles on a quintic."""

    def __init__(self, crane: Crane, case: Scenario) -> None:
        drive = CycleInputs(crane, case)
        self.t = crane.control.t_cycle
        self.rows = np.array([drive.full_row(k)[:3] for k in range(drive.n_ticks + 1)])

    def __call__(self, time: float) -> tuple[float, float, float]:
        k = min(int(time / self.t + 1e-9), len(self.rows) - 2)
        h, x = self.t, time / self.t - k
        (s_0, v_0, a_0), (s_1, v_1, a_1) = self.rows[k], self.rows[k + 1]
        powers = np.vander([0.0, 1.0], 6, increasing=True)
        slopes = np.array([[n * y ** max(n - 1, 0) for n in range(6)] for y in (0.0, 1.0)])
        bends = np.array([[n * (n - 1) * y ** max(n - 2, 0) for n in range(6)] for y in (0.0, 1.0)])
        c = np.linalg.solve(np.vstack([powers, slopes, bends]), [s_0, s_1, v_0 * h, v_1 * h, a_0 * h * h, a_1 * h * h])
        p = np.polynomial.Polynomial(c)
        return float(p(x)), float(p.deriv()(x) / h), float(p.deriv(2)(x) / h**2)


@dataclass
class Load:
    """Load on the wire of a crane: F_w tension [N], s_w wire out, x and v height and speed of the load."""

    crane: Crane
    case: Scenario
    s_w: float = 0.0
    x: float = 0.0
    v: float = 0.0
    F_w: float = 0.0
    payout: float = 0.0

    def __post_init__(self) -> None:
        hoist = pack(self.crane, self.case).params.hoist
        self.wire, self.m, self.W, self.s_w_0 = hoist.wire, hoist.load.m, hoist.load.W, self.case.s_w
        self.s_w, self.F_w = self.s_w_0, self.W
        self.x = -self.W / wire_stiffness(self.s_w, self.wire)

    def ahead(self, h: float, tip: tuple[float, float, float], payout: float) -> "Load":
        """After a step of the trapezoidal rule, with the winch's rate at its end."""
        s_w = self.s_w + 0.5 * h * (self.payout + payout)
        k, c = wire_stiffness(s_w, self.wire), wire_damping(s_w, self.m, self.wire)
        q = 0.5 * h / self.m
        free = k * (tip[0] - (s_w - self.s_w_0) - self.x - 0.5 * h * self.v) + c * (tip[1] - payout)
        v = (self.v + q * (self.F_w - 2.0 * self.W + free)) / (1.0 + q * (0.5 * h * k + c))
        F_w = free - (0.5 * h * k + c) * v
        return Load(self.crane, self.case).at(s_w, self.x + 0.5 * h * (self.v + v), v, F_w, payout)

    def at(self, s_w: float, x: float, v: float, F_w: float, payout: float) -> "Load":
        self.s_w, self.x, self.v, self.F_w, self.payout = s_w, x, v, F_w, payout
        return self


@dataclass
class Thing:
    """An object of the model: its results, and its place in them."""

    Name: str
    results: Callable[[str, Any], float]
    factors: dict[str, float]
    tags: dict[str, str] = field(default_factory=dict)

    def TimeHistory(self, name: str, period: Any, extra: Any = None) -> list[float]:
        return [self.results(name, extra)]

    def UnitsConversionFactor(self, units: str) -> float:
        return self.factors[units]


@dataclass
class Info:
    """ExternalFunctionInfo."""

    Model: Any
    ModelObject: Any
    SimulationTime: float = 0.0
    NewTimeStep: bool = False
    Value: float = 0.0
    StateData: str | None = None
    DataName: str = "WholeSimulationPayoutRate"
    ObjectParameters: str = ""


class OrcaFlex:
    """A model with a winch, whose rate of pay-out an external function gives.

    Parameters: function: the class; crane and case; h: time step [s]; parameters: text of the winch; force, length:
    units of the model, how many there are in a kN and a m; datum: height of the tip at the start [m].
    """

    def __init__(
        self,
        function: type,
        crane: Crane,
        case: Scenario,
        h: float,
        *,
        parameters: str = "TipObject=Vessel",
        force: float = 1.0,
        length: float = 1.0,
        datum: float = 30.0,
        start: float = 0.0,
        passes: int = PASSES,
    ) -> None:
        sys.modules["OrcFxAPI"] = api()
        self.h, self.tip, self.load, self.passes = h, Tip(crane, case), Load(crane, case), passes
        self.start, self.n, self.units, self.datum = start, 0, (force, length), datum
        self.shown, self.shown_tip = self.load, self.tip(0.0)
        factors = {"FF": force, "LL": length}
        winch = Thing("Winch", self._winch, factors)
        model = {"Vessel": Thing("Vessel", self._vessel, factors)}
        self.info = Info(model, winch, SimulationTime=start, ObjectParameters=parameters)
        self.function = function()
        self.function.Initialise(self.info)
        self.rows: list[tuple[float, ...]] = []

    def _winch(self, name: str, extra: Any) -> float:
        if name != "Tension":
            raise NoSuchResultError(name)
        return self.shown.F_w / 1000.0 * self.units[0]

    def _vessel(self, name: str, extra: Any) -> float:
        names = {"Z": 0, "GZ-Velocity": 1, "GZ-Acceleration": 2}
        if name not in names:
            raise NoSuchResultError(name)
        x, y, _ = (each / self.units[1] for each in extra.RigidBodyPos)
        heeling = 1.0 + 0.01 * x + 0.02 * y  # at its place (0, 0, 0) it heaves, and it heels with that
        value = self.shown_tip[names[name]] * heeling + (self.datum if name == "Z" else 0.0)
        return value * self.units[1]

    def calculate(self, time: float, *, new: bool) -> float:
        """One call at a time; gives the rate [m/s]."""
        self.info.SimulationTime, self.info.NewTimeStep = self.start + time, new
        self.function.Calculate(self.info)
        return self.info.Value / self.units[1]

    def step(self) -> None:
        """One step of the host, with its iterations."""
        time = (self.n + 1) * self.h
        self.shown_tip = self.tip(time)
        payout = self.load.payout
        for i in range(self.passes):
            self.shown = self.load.ahead(self.h, self.shown_tip, payout)
            payout = self.calculate(time, new=i == 0)
        self.load = self.load.ahead(self.h, self.shown_tip, payout)
        self.n += 1

    def run(self, until: float) -> np.ndarray:
        """Steps to a time; rows of time, wire out, height of the load, tension and rate."""
        if self.n == 0:
            self.load.payout = self.calculate(0.0, new=True)
        while (self.n + 1) * self.h < until + 1e-9:
            self.step()
            self.rows.append((self.n * self.h, self.load.s_w, self.load.x, self.load.F_w, self.load.payout))
        return np.array(self.rows)
