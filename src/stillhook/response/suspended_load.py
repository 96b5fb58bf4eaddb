"""A suspended load at one depth, linearised: the wire as an exact elastic rod, hook and payload at its end, drag,
water, and the static tensions."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.engine.pack.programme import hanging, static_stroke, wire_strength
from stillhook.errors import LiftError
from stillhook.physics.scalar import G
from stillhook.response.winch.duty import Duty
from stillhook.sea.vessel.rao import wavenumber
from stillhook.sea.vessel.realisation import decay
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.scenario import Sensors
from stillhook.units import show
from stillhook.winches.load_path.interface import LinearJoint

NODES = 64
"""Points of a mean over a Gaussian speed: right to 1e-3 down to a current of a tenth of its deviation."""
SCAN = 1.0 / 64.0
"""Steps of the wire's own angle p, in half turns, on which natural frequencies are looked for; two of them are further
apart unless slings and wire happen to ring together within a hundredth."""


@dataclass(frozen=True)
class Rod:
    """A hanging wire: L length [m]; EA axial stiffness times length [N]; mu mass per metre [kg/m], with the water that
    moves along where there is any; w weight per metre, in water less buoyancy [N/m]; beta material damping, stress per
    strain rate over EA [s]; k_top spring without mass above the wire, such as the wire from drum to crane tip, with the
    same damping
    [N/m]."""

    L: float
    EA: float
    mu: float
    w: float = 0.0
    beta: float = 0.0
    k_top: float = math.inf

    def __post_init__(self) -> None:
        for name, least in (("L", 0.0), ("EA", 0.0)):
            if not (math.isfinite(value := getattr(self, name)) and value > least):
                raise LiftError(f"Rod: {name} = {value!r} is not a number above 0. Enter it in SI.")
        for name in ("mu", "w", "beta"):
            if not (math.isfinite(value := getattr(self, name)) and value >= 0.0):
                raise LiftError(f"Rod: {name} = {value!r} is not a number of 0 or more. Enter it in SI.")
        if not self.k_top > 0.0:
            raise LiftError(
                f"Rod: k_top = {self.k_top!r} is not above 0. Enter the spring above the wire in N/m, or leave it out."
            )

    @property
    def K(self) -> float:
        """Static stiffness EA/L [N/m]."""
        return self.EA / self.L

    @property
    def mass(self) -> float:
        """Mass of the complete wire [kg]."""
        return self.mu * self.L


@dataclass(frozen=True)
class End:
    """Load at the wire's end: m payload [kg]; A33 its added mass [kg]; m_h hook [kg]; slings of stiffness k_s
    [N/m] between hook and payload (infinite: one body) with damping c_s [N s/m]."""

    m: float
    A33: float = 0.0
    m_h: float = 0.0
    k_s: float = math.inf
    c_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("m", "A33", "m_h", "c_s"):
            if not (math.isfinite(value := getattr(self, name)) and value >= 0.0):
                raise LiftError(f"End: {name} = {value!r} is not a number of 0 or more. Enter it in SI.")
        if not self.k_s > 0.0:
            raise LiftError(
                f"End: k_s = {self.k_s!r} is not above 0. Enter the slings' stiffness in N/m, or leave it out for one"
                " body."
            )
        if self.moving + self.m_h <= 0.0:
            raise LiftError("End: no mass at the end of the wire. Enter m or m_h above 0.")

    @property
    def moving(self) -> float:
        """Mass of the payload with the water that moves along [kg]."""
        return self.m + self.A33


def static_stretch(rod: Rod, W: float) -> float:
    """Stretch under a load and the wire's own weight, L (W + w L/2)/EA, and that of the spring above.

    Parameters
    ----------
    rod : Rod
        The wire [SI].
    W : float
        Weight of the load [N].

    Returns
    -------
    float
        Stretch [m].
    """
    return rod.L * (W + rod.w * rod.L / 2.0) / rod.EA + (W + rod.w * rod.L) / rod.k_top


def natural_periods(rod: Rod, end: End, n: int = 1) -> FloatArray:
    """The n longest natural periods of wire, hook and payload without damping, top end held.

    Parameters
    ----------
    rod : Rod
        The wire [SI].
    end : End
        Hook, slings and payload [SI].
    n : int, default 1
        How many.

    Returns
    -------
    array
        Periods [s], shape (n,), the longest first.

    Notes
    -----
    Exact for the rod: roots of K p cos p + D(omega) sin p = 0 with D the dynamic stiffness of the load below, located
    one by one along the wire's angle p and refined to 1e-12. A wire without mass has as many periods as there are
    masses below; the rest are 0.
    """
    if rod.mu == 0.0:
        return _periods_without_mass(rod, end, n)
    per_angle = math.sqrt(rod.EA / rod.mu) / rod.L
    roots: list[float] = []
    p = np.geomspace(1e-9, SCAN * math.pi, 513)  # a light wire: the masses below ring while it hardly bends
    while len(roots) < n:
        f = _frequency_equation(p * per_angle, rod, end)
        for i in np.flatnonzero(np.sign(f[:-1]) * np.sign(f[1:]) < 0.0):
            roots.append(_root(p[i], p[i + 1], per_angle, rod, end))
        p = p[-1] + SCAN * math.pi * np.arange(257)
    return 2.0 * math.pi / (np.array(roots[:n]) * per_angle)


def _frequency_equation(omega: FloatArray, rod: Rod, end: End) -> FloatArray:
    """K cos p + D sin(p)/p times the stiffness below the slings, so that it has no poles, and the spring above
    [N/m]."""
    p = omega * rod.L * math.sqrt(rod.mu / rod.EA)
    cos, sinc = np.cos(p), np.sinc(p / math.pi)
    hook, load = -(omega**2) * end.m_h, -(omega**2) * end.moving
    below = 1.0 + load / end.k_s
    D = hook * below + load
    yields = rod.K / rod.k_top
    return np.asarray((rod.K * below) * (cos - yields * p * p * sinc) + D * (sinc + yields * cos))


def _root(lo: float, hi: float, per_angle: float, rod: Rod, end: End) -> float:
    """Root between two angles of different sign, by halving."""

    L_over_c, k_s, m_h, moving, K = rod.L * math.sqrt(rod.mu / rod.EA), end.k_s, end.m_h, end.moving, rod.K
    yields = K / rod.k_top

    def f(angle: float) -> float:  # `_frequency_equation` of one number, which is much faster without arrays
        omega = angle * per_angle
        p = omega * L_over_c
        cos, sinc = math.cos(p), math.sin(p) / p
        load = -(omega**2) * moving
        below = 1.0 + load / k_s
        D = -(omega**2) * m_h * below + load
        return (K * below) * (cos - yields * p * p * sinc) + D * (sinc + yields * cos)

    sign = math.copysign(1.0, f(lo))
    while hi - lo > 1e-12 * hi:
        middle = 0.5 * (lo + hi)
        if middle in (lo, hi):
            break
        lo, hi = (middle, hi) if f(middle) * sign > 0.0 else (lo, middle)
    return 0.5 * (lo + hi)


def _periods_without_mass(rod: Rod, end: End, n: int) -> FloatArray:
    """Two masses on two springs."""
    periods, k = np.zeros(n), 1.0 / (1.0 / rod.K + 1.0 / rod.k_top)
    if math.isinf(end.k_s) or end.m_h == 0.0 or end.moving == 0.0:
        k_s = end.k_s if end.moving else math.inf
        periods[0] = 2.0 * math.pi * math.sqrt((end.moving + end.m_h) * (1.0 / k + 1.0 / k_s))
        return periods
    a, b, c = end.m_h * end.moving, -(end.m_h * end.k_s + end.moving * (k + end.k_s)), k * end.k_s
    both = 2.0 * math.pi / np.sqrt(np.sort(np.roots([a, b, c]).real))
    periods[: min(n, 2)] = both[:n]
    return periods


class Transfers(NamedTuple):
    """Complex transfers at omega [rad/s], each with its shape: of the top end's motion u [m], and of a force F on the
    payload [N].

    load_u [-], load_F [m/N]: payload's displacement; hook_u, hook_F: hook's; top_u [N/m], top_F [-]: tension at the
    wire's top; end_u, end_F: tension at the wire's lower end, above the hook; sling_u, sling_F: tension between hook
    and payload.
    """

    load_u: ComplexArray
    load_F: ComplexArray
    hook_u: ComplexArray
    hook_F: ComplexArray
    top_u: ComplexArray
    top_F: ComplexArray
    end_u: ComplexArray
    end_F: ComplexArray
    sling_u: ComplexArray
    sling_F: ComplexArray


def transfers(omega: ArrayLike, rod: Rod, end: End, drag: ArrayLike = 0.0, compliance: ArrayLike = 0.0) -> Transfers:
    r"""Motion and tension per motion of the wire's top end and per force on the payload.

    .. math:: q_L = \frac{K u + F_e\,\mathrm{sinc}\,p}{K\cos p + D\,\mathrm{sinc}\,p}, \quad
        T_0 = K\frac{(D\cos p - K p\sin p) u - F_e}{K\cos p + D\,\mathrm{sinc}\,p}, \quad
        D = -\omega^2 m_h + \frac{k_s D_p}{k_s + D_p}, \quad D_p = -\omega^2 (M + A_{33}) + i\omega\Sigma

    with F_e = F k_s/(k_s + D_p), written with sinc p = sin(p)/p so that a wire without mass is a spring.

    Parameters
    ----------
    omega : array
        Frequency, above 0 [rad/s]; drag and compliance broadcast with it.
    rod : Rod
        The wire [SI].
    end : End
        Hook, slings and payload [SI].
    drag : array, default 0.0
        Linear drag Sigma of the payload [N s/m].
    compliance : array, default 0.0
        That of the winch, complex, wire paid out per tension [m/N], in series with `Rod.k_top`.

    Returns
    -------
    Transfers
        Complex, each of the broadcast shape. A force up on the payload slackens the wire: top_F is negative at low
        frequencies.
    """
    pairs = _pairs(omega, rod, end, drag, compliance, PLACES)
    return Transfers(*(each for place in PLACES for each in pairs[place]))


PLACES = ("load", "hook", "top", "end", "sling")
"""Places of `Transfers`, in its order."""


def _pairs(
    omega: ArrayLike, rod: Rod, end: End, drag: ArrayLike, compliance: ArrayLike, places: Collection[str]
) -> dict[str, tuple[ComplexArray, ComplexArray]]:
    """Some of `transfers` by place: to the motion, and to a force on the payload."""
    w, Sigma, Y = (
        np.asarray(omega, dtype=np.float64),
        np.asarray(drag, dtype=np.float64),
        np.asarray(compliance, dtype=np.complex128),
    )
    EA = rod.EA * (1.0 + 1j * w * rod.beta)
    K = EA / rod.L
    p = w * rod.L * np.sqrt(rod.mu / EA)
    cos, sinc = np.cos(p), np.sinc(p / math.pi)
    D_p = -(w**2) * end.moving + 1j * w * Sigma
    soft = 1.0 if math.isinf(end.k_s) else 1.0 / (1.0 + D_p / (end.k_s + 1j * w * end.c_s))
    flex = 0.0 if math.isinf(end.k_s) else 1.0 / (end.k_s + 1j * w * end.c_s)
    D = -(w**2) * end.m_h + soft * D_p
    det = K * cos + D * sinc
    hook_u, hook_F = K / det, sinc * soft / det
    top_u, top_F = K * (D * cos - K * p * p * sinc) / det, -K * soft / det
    load_u, load_F = soft * hook_u, soft * (hook_F + flex)
    at: dict[str, tuple[ComplexArray, ComplexArray]] = {"load": (load_u, load_F), "top": (top_u, top_F)}
    if "hook" in places:
        at["hook"] = hook_u, hook_F
    if "end" in places:
        at["end"] = D * hook_u, D * hook_F - soft
    if "sling" in places:
        at["sling"] = D_p * load_u, D_p * load_F - 1.0
    yields = Y + (0.0 if math.isinf(rod.k_top) else 1.0 / (rod.k_top * (1.0 + 1j * w * rod.beta)))
    through = 1.0 / (1.0 + yields * top_u)  # motion that comes through the spring above
    back = yields * top_F * through
    return {place: (through * u, F - back * u) for place, (u, F) in at.items() if place in places}


@dataclass(frozen=True)
class SuspendedLoad:
    """Wire, hook, slings and payload at one depth, linearised about rest."""

    rod: Rod
    end: End
    s_w: float  # wire paid out [m]
    F_top: float  # static tension at the crane tip [N]
    F_sling: float  # static tension in the slings [N]
    B: float = 0.0  # drag of the payload, 1/2 rho C_D A_p [N s^2/m^2]
    C_lin: float = 0.0  # linear drag of the payload [N s/m]
    rho_V: float = 0.0  # mass of the displaced water [kg]
    z: float | None = None  # height of the middle of the payload above still water, where waves act [m]; None: in air
    depth: float = math.inf  # of the water [m]
    sensors: Sensors = field(default_factory=Sensors)  # of the winch
    V: float = 0.0  # mean speed of the payload through the water, either sign [m/s]; adds to the damping by drag
    link: LinearJoint | None = None  # passive heave compensator; the springs of `end` are its own
    U: float = 0.0  # current past the payload, level [m/s]

    @property
    def duty(self) -> Duty:
        """Duty of the winch."""
        return Duty(F=self.F_top, s_w=self.s_w, sensors=self.sensors)

    def decay(self, omega: FloatArray) -> FloatArray:
        """Vertical motion of the water at the payload per elevation above it [-], shape of omega; 0 in air."""
        if self.z is None:
            return np.zeros_like(omega)
        return _decay(omega.tobytes(), self.z, self.depth)


@functools.lru_cache(maxsize=256)
def _decay(frequencies: bytes, z: float, depth: float) -> FloatArray:
    """`SuspendedLoad.decay` at frequencies, float64 as bytes: the same ones are asked for with every winch."""
    result = np.asarray(decay(_wavenumber(frequencies, depth), np.array([z]), depth)[0])
    result.flags.writeable = False
    return result


@functools.lru_cache(maxsize=16)
def _wavenumber(frequencies: bytes, depth: float) -> FloatArray:
    return wavenumber(np.frombuffer(frequencies), depth)


def suspended_load(crane: Crane, lift: Lowering, z: float) -> SuspendedLoad:
    """The load with the payload's underside z [m] above still water (negative: below), from the same lift that is
    lowered in time.

    In air, or completely submerged: forces on a payload that pierces the surface are not linear. Near the bottom
    (`Payload.seabed`) added mass and drag grow, which is not included. Material damping is that of the crane's
    `wire.zeta` at this depth.
    Errors: LiftError for a payload in the surface, below the seabed, or wire that the drum does not have.
    """
    load, rho = lift.payload, lift.rho
    if -load.reach(rho) < z < 0.0:
        raise LiftError(
            f'payload "{load.name}": with its underside {show(-z, "length")} under water it pierces the surface,'
            " and the method is linear. Choose 0 m or more above,"
            f" {show(load.reach(rho), 'length')} or more below, or simulate the lowering in time."
        )
    if z < -lift.depth:
        raise LiftError(
            f"z {show(z, 'length')} is below the seabed at {show(lift.depth, 'length')}. Choose a depth above it."
        )
    still = hanging(crane, lift, z)
    EA, _ = wire_strength(crane)
    if still.s_w <= 0.0:
        raise LiftError(
            f"z {show(z, 'length')}: hook and rigging do not fit under the crane tip at {show(lift.h_tip, 'length')}."
        )
    wet = load.covered(rho) if z < 0.0 else None
    k_s, link = lift.rigging.stiffness, linear_joint(lift, z)
    upper, lower = (0.0, 0.0) if lift.compensator is None else lift.compensator.masses
    c_s = 2.0 * lift.rigging.zeta * math.sqrt(k_s * load.mass)
    gas = link is not None and link.moves
    end = End(
        m=load.mass + lower,
        A33=wet.A33 if wet else 0.0,
        m_h=crane.hook_mass + upper,
        k_s=link.k if link is not None and gas else k_s,
        c_s=0.0 if gas else c_s,
    )
    mu, L = crane.wire.mass_per_length, still.s_w
    F_sling = still.F_hook - (crane.hook_mass + upper) * G
    omega = math.sqrt(EA / (crane.wire.L_0 + L) / (end.moving + end.m_h + mu * L / 3.0))
    k_top = EA / crane.wire.L_0 if crane.wire.L_0 > 0.0 else math.inf
    rod = Rod(L=L, EA=EA, mu=mu, w=(still.F_tip - still.F_hook) / L, beta=2.0 * crane.wire.zeta / omega, k_top=k_top)
    under = {"B": load.drag(rho), "C_lin": load.C_lin, "rho_V": rho * wet.V, "z": z + load.height / 2.0} if wet else {}
    if wet and lift.current is not None:
        under["U"] = lift.current.past(z + load.height / 2.0)
    return SuspendedLoad(rod, end, L, still.F_tip, F_sling, depth=lift.depth, sensors=lift.sensors, link=link, **under)


def linear_joint(lift: Lowering, z: float) -> LinearJoint | None:
    """The unit between hook and slings about its place with the payload hanging still, its underside at z [m]; None
    where there is none. Errors: LiftError for a unit without a linear form."""
    unit = lift.compensator
    if unit is None:
        return None
    linear = unit.linear(static_stroke(lift, z))
    if linear is None:
        raise LiftError(
            f'compensator "{unit.name}" of type {unit.type}: it has no linear form, which the frequency-domain method'
            " needs. Simulate in time."
        )
    return linear


def drag_of_gaussian(B: float, sigma_v: ArrayLike, V: float = 0.0, U: float = 0.0) -> FloatArray:
    r"""Linear drag [N s/m] of a Gaussian speed of deviation sigma_v [m/s] about a mean speed V [m/s]; B [N s^2/m^2].

    .. math:: \Sigma = 2 B\,E|V + v| = 2 B \left(V\,\mathrm{erf}\frac{V}{\sqrt 2 \sigma_v}
        + \sqrt{2/\pi}\,\sigma_v\,e^{-V^2/2\sigma_v^2}\right)

    The slope with the least square error; at V = 0 it takes out the same power. In a current of U [m/s] across it is
    that of B v sqrt(v^2 + U^2).
    """
    sigma = np.asarray(sigma_v, dtype=np.float64)
    if U > 0.0:
        return np.asarray(B * _mean(lambda v: (2.0 * v**2 + U**2) / np.hypot(v, U), V, sigma))
    if V == 0.0:
        return np.asarray(math.sqrt(8.0 / math.pi) * B * sigma)
    share, bell = _normal(V, sigma)
    return np.asarray(2.0 * B * (V * (2.0 * share - 1.0) + 2.0 * sigma * bell))


def mean_drag(B: float, V: float, sigma_v: ArrayLike, U: float = 0.0) -> FloatArray:
    """Mean of B (V + v)|V + v| for a Gaussian v of deviation sigma_v [m/s] [N]; B [N s^2/m^2], V [m/s], U as in
    `drag_of_gaussian`."""
    sigma = np.asarray(sigma_v, dtype=np.float64)
    if U > 0.0:
        return np.asarray(B * _mean(lambda v: v * np.hypot(v, U), V, sigma))
    share, bell = _normal(V, sigma)
    return np.asarray(B * ((V**2 + sigma**2) * (2.0 * share - 1.0) + 2.0 * V * sigma * bell))


def _mean(f: Callable[[FloatArray], FloatArray], V: float, sigma: FloatArray) -> FloatArray:
    """Mean of f over a Gaussian speed."""
    x, weights = np.polynomial.hermite_e.hermegauss(NODES)
    return np.asarray(f(V + sigma[..., None] * x) @ weights / weights.sum())


def _normal(V: float, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Standard normal distribution and density at V/sigma; of what does not scatter, those far out."""
    from scipy.special import ndtr  # heavy: only where something moves on

    x = V / np.where(sigma > 0.0, sigma, 1e-12)
    return np.asarray(ndtr(x)), np.asarray(np.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi))


class Answer(NamedTuple):
    """Complex answer of one quantity: to the motion u of the wire's top end, and to the wave's elevation above the load
    [per m]."""

    u: ComplexArray
    wave: ComplexArray


QUANTITIES = ("load", "load_rate", "relative", "top", "top_rate", "sling", "sling_rate")
"""Displacement of the payload and its speed, its speed through the water; tension at the crane tip and in the slings
with their rates."""


def answers(
    omega: FloatArray,
    load: SuspendedLoad,
    drag: ArrayLike,
    compliance: ArrayLike = 0.0,
    quantities: Collection[str] = QUANTITIES,
) -> dict[str, Answer]:
    """Each of some of `QUANTITIES` at omega and linear drags [N s/m] that broadcast with it; compliance of the winch
    [m/N].

    The wave's force on the payload is that of the water's acceleration on displaced water and added mass, and of drag
    by its speed.
    """
    places = {place for q, place in _PLACE.items() if q in quantities}
    t = _pairs(omega, load.rod, load.end, drag, compliance, places)
    water, rate = load.decay(omega), 1j * omega
    inertia = -(omega**2) * (load.rho_V + load.end.A33)
    F = (inertia + rate * np.asarray(drag, dtype=np.float64)) * water
    result: dict[str, Answer] = {}
    for q in (q for q in QUANTITIES if q in quantities):
        motion = Answer(t[_PLACE[q]][0], t[_PLACE[q]][1] * F)
        if q == "relative":
            motion = Answer(rate * motion.u, rate * (motion.wave - water))
        elif q.endswith("_rate"):
            motion = Answer(rate * motion.u, rate * motion.wave)
        result[q] = motion
    return result


_PLACE = {q: "load" if q == "relative" else q.removesuffix("_rate") for q in QUANTITIES}
"""Which of `PLACES` a quantity is of."""
