"""A passive heave compensator above the slings: a gas spring with seals that rub, an orifice, and a stop at either end
of its stroke. Its equations are those of `stillhook.physics.load_path.compensator`."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.base.variable import Row
from stillhook.errors import LiftError
from stillhook.physics.hydraulics.accumulator import polytropic_ratio
from stillhook.physics.load_path.compensator import Compensator as Link
from stillhook.physics.load_path.compensator import (
    GasForce,
    compensator_energy,
    compensator_mean,
    gas_force,
    gas_law,
    place_of,
    pull_of_compensator,
    stroke,
)
from stillhook.physics.scalar import G, fmax, fmin, scalar
from stillhook.statistics.extremes import share_beyond
from stillhook.tables.table import Number
from stillhook.units import show
from stillhook.winches.load_path.interface import NEVER, JointUnit, happened

NAME = "gas-spring"
TITLE = "passive heave compensator: a gas spring between hook and slings"
HALVINGS = 60
"""Steps in which a stroke is sought: to the last digit of any."""
HANGING = "of a passive heave compensator while the load is suspended"
POINTS = 32
DEGREE = len(GasForce._fields) - 1
FIT_TOLERANCE = 1.0e-5
"""Largest relative error of the fitted force over the stroke. (Where the piston sweeps 77 % of the gas it is 5e-7.)"""


@dataclass(frozen=True)
class LinearCompensator:
    """s stroke at rest, of 0 to s_max [m]; k stiffness n p A^2/V [N/m], 0 where the rod stands at an end; C orifice
    [N s^2/m^2]; F_f friction of the seals [N], whole from the speed v_f on [m/s]."""

    s: float
    s_max: float
    k: float
    C: float = 0.0
    F_f: float = 0.0
    v_f: float = 0.01

    @property
    def moves(self) -> bool:
        """Whether the rod hangs between the ends of its stroke."""
        return self.k > 0.0

    @property
    def lossy(self) -> bool:
        """Whether its damping depends on how fast it moves."""
        return self.C > 0.0 or self.F_f > 0.0

    @property
    def room(self) -> float:
        """Way to the nearer end of the stroke [m]."""
        return min(self.s, self.s_max - self.s)

    def share_at_end(self, sigma: ArrayLike) -> FloatArray:
        """Share of the time in which a Gaussian stroke of deviation sigma [m] about that at rest would be beyond an end
        [-]."""
        return np.asarray(0.5 * (share_beyond(self.s, sigma) + share_beyond(self.s_max - self.s, sigma)))

    def damping(self, sigma: ArrayLike) -> FloatArray:
        r"""Linear damping of a Gaussian speed of the rod of deviation sigma [m/s] [N s/m].

        .. math:: c = \sqrt{8/\pi}\,C\,\sigma + \min\left(\sqrt{2/\pi}\,F_f/\sigma,\ F_f/v_f\right)

        It takes out the power that orifice and seals do. Source: Gaussian (equivalent) linearisation.
        """
        v = np.asarray(sigma, dtype=np.float64)
        seals = np.minimum(math.sqrt(2.0 / math.pi) * self.F_f / v, self.F_f / self.v_f)
        return np.asarray(math.sqrt(8.0 / math.pi) * self.C * v + seals)


class Compensator(JointUnit):
    """A gas spring between hook and slings. Gas of p_0 and V_0 acts on `area` and draws the rod in; the load draws it
    out, from 0 (fully in) to `stroke` (fully out). The other side of the piston is empty.

    p_0 and V_0 are those with the rod fully in. n is the gas's exponent: 1.0 where it moves so slowly that it stays as
    warm as the sea, 1.4 for nitrogen in waves, up to 1.67 where it is dense and cold. The orifice brakes by `orifice`
    times speed squared, seals by `friction`, whole from the speed v_friction on. The sea presses on `rod_area`, which
    is 0 for a unit that is balanced against it. Masses are those of what hangs from the hook (cylinder) and of what
    moves with the slings (rod). Errors: ScenarioError, one line.
    """

    type: Literal["gas-spring"] = "gas-spring"
    stroke: u.Length = Field(gt=0, description="way of the rod")
    area: u.Area = Field(gt=0, description="area of the piston that the gas acts on")
    p_0: u.Pressure = Field(gt=0, description="gas pressure with the rod fully in, absolute")
    V_0: u.Volume = Field(gt=0, description="gas volume with the rod fully in, vessels included")
    n: Number = Field(default=1.4, ge=1.0, le=1.67, description="exponent of the gas")
    orifice: u.ForcePerSpeedSquared = Field(default=0.0, ge=0, description="force per square of the rod's speed")
    friction: u.Force = Field(default=0.0, ge=0, description="friction of the seals")
    v_friction: u.Speed = Field(default=0.01, gt=0, description="speed from which on the seals rub with all of it")
    rod_area: u.Area = Field(default=0.0, ge=0, description="area of the rod that the sea presses in")
    length: u.Length = Field(ge=0, description="from the hook to the slings with the rod fully in")
    mass_cylinder: u.Mass = Field(ge=0, description="what hangs from the hook")
    mass_rod: u.Mass = Field(default=0.0, ge=0, description="what moves with the slings")

    @model_validator(mode="after")
    def _gas_is_left(self) -> Self:
        swept = self.area * self.stroke
        if swept >= self.V_0:
            raise ValueError(
                f"V_0 = {show(self.V_0, 'volume')}: the piston sweeps {show(swept, 'volume')} (area times stroke), and"
                " no gas would be left. Give the volume with the rod fully in, vessels included."
            )
        return self

    @property
    def masses(self) -> tuple[float, float]:
        """Cylinder and rod [kg]."""
        return self.mass_cylinder, self.mass_rod

    @property
    def shortest(self) -> float:
        """With the rod fully in [m]."""
        return self.length

    @property
    def travel(self) -> float:
        """The stroke [m]."""
        return self.stroke

    def pressure(self, s: float) -> float:
        """Gas pressure at a stroke s [m], absolute [Pa]."""
        return self.p_0 * float(polytropic_ratio(1.0 - self.area * s / self.V_0, self.n))

    def force(self, s: float) -> float:
        """Force of the gas at a stroke s [m] [N]."""
        return self.area * self.pressure(s)

    def stiffness(self, s: float) -> float:
        r"""Stiffness of the gas at a stroke s [m], :math:`n p A^2 / V` [N/m]."""
        return self.n * self.pressure(s) * self.area**2 / (self.V_0 - self.area * s)

    def extension(self, F: float, z: float, weight: float) -> float:
        """Stroke with F [N] on the rod [m]; z height of the cylinder's lower end above still water with the rod fully
        in [m], weight that of a cubic metre of water [N/m^3]. The further the rod is out, the less deep is the
        cylinder."""
        lo, hi = 0.0, self.stroke
        for _ in range(HALVINGS):
            s = 0.5 * (lo + hi)
            if self.force(s) + weight * self.rod_area * max(-(z + s), 0.0) < F:
                lo = s
            else:
                hi = s
        return 0.5 * (lo + hi)

    def pack(self, stiffness: float, rho: float, height: float) -> Link:
        """The unit as the equations read it. Errors: LiftError where it sweeps nearly all of its gas."""
        F_in = self.area * self.p_0
        return Link(
            x_max=self.stroke,
            i_half=2.0 / self.stroke,
            A=self.area,
            F_in=F_in,
            F_out=self.force(self.stroke),
            e=F_in / stiffness,
            C=self.orifice,
            F_f=self.friction,
            v_f=self.v_friction,
            A_rod=self.rod_area,
            rho_g=rho * G,
            z_c=height,
            gas=GasForce(*(F_in * c for c in _coefficients(self.area * self.stroke / self.V_0, self.n, self.V_0))),
        )

    def stretch(self, F: float, s: float, stiffness: float, link: Link) -> float:
        """Stretch of unit and slings at rest [m]: at its stops the slings carry the rest."""
        if s <= 0.0:
            return F / stiffness
        return link.e + s + (max(F - link.F_out, 0.0) / stiffness if s >= link.x_max else 0.0)

    def linear(self, s: float) -> LinearCompensator:
        """The unit about the stroke s at rest [m]."""
        moves = 1e-6 < s / self.stroke < 1.0 - 1e-6
        k = self.stiffness(s) if moves else 0.0
        return LinearCompensator(s, self.stroke, k, C=self.orifice, F_f=self.friction, v_f=self.v_friction)


Unit = Compensator


@functools.lru_cache(maxsize=256)
def _coefficients(swept: float, n: float, V_0: float) -> tuple[float, ...]:
    """Coefficients of force over F_in in the rod's place, by the share of the gas that the piston sweeps."""

    def ratio(xi: FloatArray) -> FloatArray:
        return np.asarray(polytropic_ratio(1.0 - 0.5 * swept * (1.0 + xi), n))

    xi = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    c = chebyshev.cheb2poly(chebyshev.chebfit(xi, ratio(xi), DEGREE))
    fine = np.linspace(-1.0, 1.0, 201)
    worst = float(np.max(np.abs(polynomial.polyval(fine, c) / ratio(fine) - 1.0)))
    if worst > FIT_TOLERANCE:
        raise LiftError(
            f"compensator.V_0 = {show(V_0, 'volume')}: the piston sweeps {100.0 * swept:.3g} % of it, too much for the"
            " gas law to be followed to the end. Give the volume with its vessels, or a shorter stroke."
        )
    return tuple(float(i) for i in c)


class Signals(NamedTuple):
    """Columns of a series."""

    s_c: Annotated[float, Row("m", "length", "fully in 0", "stroke of the rod of a passive heave compensator")]
    v_c: Annotated[float, Row("m/s", "speed", "coming out positive", "speed of the rod of a passive heave compensator")]
    p_c: Annotated[
        float,
        Row(
            "Pa",
            "pressure",
            "absolute",
            "gas pressure of a passive heave compensator; the force on its rod is F_sling",
        ),
    ]


NUMBERS = {
    "s_c_min": Row("m", "length", "", f"least stroke {HANGING}", symbol="min s_c"),
    "s_c_max": Row("m", "length", "", f"largest stroke {HANGING}", symbol="max s_c"),
    "v_c_max": Row("m/s", "speed", "", "highest speed of its rod between the ends of its stroke", symbol="max|v_c|"),
    "p_c_max": Row(
        "Pa", "pressure", "absolute", "highest gas pressure of a passive heave compensator", symbol="max p_c"
    ),
    "extended_time": Row("s", "time", "", f"time with the rod fully out {HANGING}"),
    "retracted_time": Row("s", "time", "", f"time with the rod fully in {HANGING}"),
    "t_extended": Row("s", "time", "", "time at which the rod of a passive heave compensator was first fully out"),
    "t_retracted": Row("s", "time", "", "time at which the rod of a passive heave compensator was first fully in"),
}
"""Numbers of a run and of each stage."""
EXTENSION = "s_c"
STOPS = ("extended_time", "retracted_time")
LIMIT = "compensator stroke"
"""Word in a run's status: the rod came to an end of its stroke."""
SUMMED, LOWEST = ("out", "inside"), ("s_c_min", "t_out", "t_in")


class Stats(NamedTuple):
    """Over one stage, from every step, the load hanging free: least and largest stroke [m]; fastest rod either way
    [m/s]; highest gas pressure [Pa]; time with the rod fully out and fully in [s], and when it first was [s]."""

    s_c_min: float
    s_c_max: float
    v_c: float
    p_c: float
    out: float
    inside: float
    t_out: float
    t_in: float


def blank() -> Stats:
    """Statistics of nothing yet."""
    return Stats(s_c_min=NEVER, s_c_max=-NEVER, v_c=0.0, p_c=0.0, out=0.0, inside=0.0, t_out=NEVER, t_in=NEVER)


def numbers(stats: Stats) -> dict[str, float]:
    """Numbers of a run or a stage; NaN for what did not happen."""
    return {
        "s_c_min": happened(stats.s_c_min),
        "s_c_max": happened(stats.s_c_max),
        "v_c_max": stats.v_c,
        "p_c_max": stats.p_c,
        "extended_time": stats.out,
        "retracted_time": stats.inside,
        "t_extended": happened(stats.t_out),
        "t_retracted": happened(stats.t_in),
    }


def notes(stats: Stats) -> list[str]:
    """Ends of its stroke that it came to, a line each."""
    ends = (("extended", stats.t_out, stats.out), ("retracted", stats.t_in, stats.inside))
    return [
        f"compensator fully {word} first after {show(t, 'time')}, for {lasts:.2f} s" for word, t, lasts in ends if lasts
    ]


def summary(unit: Compensator, run: Mapping[str, float]) -> str:
    """A run in one line."""
    low, high = (show(run[name], "length") for name in ("s_c_min", "s_c_max"))
    gas = show(run["p_c_max"], "pressure")
    return f"compensator {unit.name}: stroke {low} to {high} of {show(unit.stroke, 'length')}, gas up to {gas}"


@scalar
def pull(x, v, z, A_up, R_up, A_down, R_down, h, sling, link):
    """Force between hook and payload over a step, and their speeds in its middle."""
    return pull_of_compensator(x, A_up, R_up, A_down, R_down, h, gas_law(x, v, z + link.z_c, h, link), sling, link)


@scalar
def mean(x, v, z, rate, h, sling, link):
    """Its force over the step [N], and the part of it that the sea does [N]."""
    law = gas_law(x, v, z + link.z_c, h, link)
    return compensator_mean(x, rate, h, law, sling, link), law.sea


@scalar
def energy(x, sling, link):
    """Energy in unit and slings [J]."""
    return compensator_energy(x, sling, link)


@scalar
def slack_of_stop(sea, sling, link):
    """How far the slings still give before the rod leaves its inner stop, beyond what the gas alone asks [m]: sea and
    seals hold it too."""
    return (sea + link.F_f) / sling.k


@scalar
def signals(x, rate, sling, link):
    """A row of the series: x stretch [m] and its rate [m/s]."""
    s = stroke(x, link)
    moves = 1.0 if s > 0.0 and s < link.x_max else 0.0
    return Signals(s_c=s, v_c=moves * rate, p_c=gas_force(place_of(s, link), link.gas) / link.A)


@scalar
def fold(a, t, h, x, rate, sea, grounded, sling, link):
    """Statistics with one more step that ends at t [s]: x stretch at its end [m], rate in its middle [m/s], sea force
    of the sea on the rod [N]; once the load touched the seabed the rod may go in, and nothing is counted."""
    s = stroke(x, link)
    free = 1.0 if grounded == 0.0 else 0.0
    out = free if x - link.e >= link.x_max else 0.0
    inside = free if x - link.e <= slack_of_stop(sea, sling, link) else 0.0
    moves = free * (1.0 - out) * (1.0 - inside)
    return Stats(
        s_c_min=fmin(a.s_c_min, s) if free > 0.0 else a.s_c_min,
        s_c_max=fmax(a.s_c_max, s) if free > 0.0 else a.s_c_max,
        v_c=fmax(a.v_c, moves * abs(rate)),
        p_c=fmax(a.p_c, gas_force(place_of(s, link), link.gas) / link.A),
        out=a.out + h * out,
        inside=a.inside + h * inside,
        t_out=fmin(a.t_out, t if out > 0.0 else NEVER),
        t_in=fmin(a.t_in, t if inside > 0.0 else NEVER),
    )
