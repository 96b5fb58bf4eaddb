r"""The wire as an exact elastic rod with hook and payload at its end: stretch, periods, transfers. Closed forms, no sea
and no winch.

A material point of the wire at distance x under the top has the vertical displacement q(x, t) from rest, up positive.
With exp(+i omega t):

.. math:: \mu \ddot q = E A (1 + i\omega\beta) q'', \qquad q(0) = u, \qquad p = \omega L \sqrt{\mu / EA(1 + i \omega
\beta)}, \quad
    K = EA(1 + i \omega\beta)/L

u is the motion of the wire's top end: the crane tip less the wire that the winch pays out. The short wire from drum to
tip may be included above it as a spring, through which u acts. The lower end carries the hook (mass m_h), and
under it, on slings, the payload. Tension is the dynamic part in addition to the weight, pulling positive.

Valid while nothing goes slack and wire and payload move a little about one depth. Source: wave equation of a bar, any
textbook; the frequency equation nu tan(nu) = m L/(M + A33) for a rigid end as in DNV-RP-N103 section 5 (check against
your edition).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import LiftError

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
    """Stretch under a load of weight W [N] and the wire's own weight, L (W + w L/2)/EA, and that of the spring above
    [m]."""
    return rod.L * (W + rod.w * rod.L / 2.0) / rod.EA + (W + rod.w * rod.L) / rod.k_top


def natural_periods(rod: Rod, end: End, n: int = 1) -> FloatArray:
    """The n longest natural periods of wire, hook and payload without damping, top end held [s], shape (n,), the
    longest first.

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

    def f(p: float) -> float:
        return float(_frequency_equation(np.array(p * per_angle), rod, end))

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

    Parameters: omega [rad/s], above 0; drag Sigma linear drag of the payload [N s/m]; compliance complex, that of the
    winch, wire paid out per tension [m/N], in series with `Rod.k_top`; all broadcast. A force up on
    the payload slackens the wire: top_F is negative at low frequencies.
    """
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
    by_top = load_u, hook_u, top_u, D * hook_u, D_p * load_u
    by_force = load_F, hook_F, top_F, D * hook_F - soft, D_p * load_F - 1.0
    yields = Y + (0.0 if math.isinf(rod.k_top) else 1.0 / (rod.k_top * (1.0 + 1j * w * rod.beta)))
    through = 1.0 / (1.0 + yields * top_u)  # motion that comes through the spring above
    pairs = ((through * u, F - yields * top_F * through * u) for u, F in zip(by_top, by_force, strict=True))
    return Transfers(*(each for pair in pairs for each in pair))
