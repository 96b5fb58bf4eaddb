r"""Wave spectra in closed form that a height, a period and a shape describe: Pierson-Moskowitz, JONSWAP, and sums of
any spectra.

Every one is a sum of peaks of one family, with x = omega/omega_p, B = N/4, sigma = 0.07 up to the peak and 0.09 above:

.. math:: S = \frac{H_s^2}{16\,\omega_p} \frac{1}{I} x^{-N} e^{-B x^{-4}} \gamma^{b(x)}, \quad b = e^{-(x -
1)^2/(2\sigma^2)}

N is 5 for Pierson-Moskowitz and JONSWAP, 4 for Torsethaugen, 4 lambda + 1 for Ochi-Hubble. I makes H_m0 the height that
was requested: the exact integral, or what is printed for it ("printed").

Moments: over all frequencies where n < N - 1, so 0 to 3 for JONSWAP (gamma functions for the base, 80-point Gauss rules
for what gamma adds). The 4th moment of a tail omega^-5 grows with the logarithm of where it ends: it, and every other
one that does not converge, is taken up to `omega_cut`, 12 times the highest peak frequency, where `grid` ends too. The
tail above holds 6e-5 of m_0, 7e-4 of m_1, 0.9 % of m_2 and 10 % of m_3 of a Pierson-Moskowitz spectrum: no crane tip
and no load feels it.

Spectra of wind sea and swell together: Torsethaugen (simplified form) and Ochi-Hubble.
"""

from __future__ import annotations

import functools
import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from stillhook.base.arrays import FloatArray, fill
from stillhook.errors import SeaError
from stillhook.physics.scalar import G
from stillhook.sea.spectra.spectrum import WaveSpectrum
from stillhook.units import quote

CUT = 12.0
"""Where grids end, over the highest peak frequency: above it a JONSWAP spectrum has less than 1e-4 of its variance."""
LOW = 0.4
"""Where grids begin, over the peak frequency: below it there is less than 1e-18 of the variance for N from 4 on."""
STEP = 0.01
"""Spacing of grids about the peak, over the peak frequency; above twice the peak it grows with the frequency."""
SIGMA_BELOW, SIGMA_ABOVE = 0.07, 0.09
"""Widths of the peak that gamma raises. Source: Hasselmann et al. 1973, DNV-RP-C205; check against your edition."""
REACH = 9.0
"""Widths beyond which what gamma adds is below 1e-17 of the peak."""
HIGHEST, SHORTEST, LONGEST = 40.0, 1.0, 40.0
"""No sea is higher [m]; wind waves and swell have periods between these [s]. Other units are caught here."""
PRINTED_NORM = 0.287
"""JONSWAP's printed norm is 1 - 0.287 ln(gamma). Source: DNV-RP-C205; check against your edition."""
NORMS = ("exact", "printed")


@dataclass(frozen=True)
class Peak:
    """One peak: m_0 [m^2] by the exact norm, omega_p [rad/s], N exponent of the tail, gamma, scale 1 unless the norm is
    printed."""

    m_0: float
    omega_p: float
    N: float = 5.0
    gamma: float = 1.0
    scale: float = 1.0

    def density(self, omega: FloatArray) -> FloatArray:
        """S [m^2 s/rad], shape of omega [rad/s]."""
        x = np.maximum(np.abs(omega) / self.omega_p, 0.1)  # below 0.1 the density is 0 to the last digit
        shape = _shape(x, self.N) * self.gamma ** _enhancement(x)
        factor = self.scale * self.m_0 / (self.omega_p * _integral(0, self.N, self.gamma, math.inf))
        return np.where(omega > 0.0, factor * shape, 0.0)

    def moment(self, n: int, cut: float) -> float:
        """m_n [m^2 rad^n/s^n] over all omega if it converges, else up to cut [rad/s]."""
        end = math.inf if n < self.N - 1.0 else cut / self.omega_p
        complete = _integral(0, self.N, self.gamma, math.inf)
        return self.scale * self.m_0 * math.pow(self.omega_p, n) * _integral(n, self.N, self.gamma, end) / complete

    def grid(self, cut: float) -> FloatArray:
        """Points [rad/s] from LOW omega_p to cut."""
        low = np.arange(LOW, 2.0, STEP)
        high = np.geomspace(2.0, cut / self.omega_p, math.ceil(math.log(cut / self.omega_p / 2.0) / (STEP / 2.0)) + 1)
        return self.omega_p * np.concatenate((low, high))


def _shape(x: FloatArray, N: float) -> FloatArray:
    return np.asarray(x**-N * np.exp(-N / 4.0 * x**-4.0), dtype=np.float64)


def _enhancement(x: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-0.5 * ((x - 1.0) / np.where(x > 1.0, SIGMA_ABOVE, SIGMA_BELOW)) ** 2), dtype=np.float64)


@functools.lru_cache(maxsize=4096)
def _integral(n: int, N: float, gamma: float, end: float) -> float:
    """Integral of x^(n - N) exp(-N/4 x^-4) gamma^b over x from 0 to end, which is beyond what gamma raises."""
    B, p = N / 4.0, (N - n - 1.0) / 4.0
    base = 0.25 * math.pow(B, -p) * (math.gamma(p) if math.isinf(end) else _upper_gamma(p, B * end**-4.0))
    if gamma == 1.0:
        return base
    node, weight = _gauss()
    raised = 0.0
    for a, b in ((1.0 - REACH * SIGMA_BELOW, 1.0), (1.0, 1.0 + REACH * SIGMA_ABOVE)):
        x = (a + b) / 2.0 + (b - a) / 2.0 * node
        more = np.expm1(math.log(gamma) * _enhancement(x))
        raised += (b - a) / 2.0 * float(np.sum(weight * x**n * _shape(x, N) * more))
    return base + raised


@functools.cache
def _gauss() -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of the 80-point rule on -1 .. 1."""
    return np.polynomial.legendre.leggauss(80)


def _upper_gamma(p: float, z: float) -> float:
    """Upper incomplete gamma function of p > -1, z > 0."""
    from scipy.special import exp1, gammaincc  # heavy: only for moments that do not converge

    if p == 0.0:
        return float(exp1(z))
    if p < 0.0:
        return (_upper_gamma(p + 1.0, z) - math.pow(z, p) * math.exp(-z)) / p
    return float(gammaincc(p, z)) * math.gamma(p)


def printed_scale(N: float, gamma: float, factor: float) -> float:
    """Variance that a printed factor, in place of 1/I, leaves over what was requested."""
    return float(factor * _integral(0, N, gamma, math.inf))


class Peaks(WaveSpectrum):
    """A spectrum that is a sum of peaks."""

    @property
    @abstractmethod
    def peaks(self) -> tuple[Peak, ...]:
        """The peaks, at least one."""

    def density(self, omega: FloatArray) -> FloatArray:
        omega = np.asarray(omega, dtype=np.float64)
        return sum((peak.density(omega) for peak in self.peaks), np.zeros_like(omega))

    def moment(self, n: int) -> float:
        return math.fsum(peak.moment(n, self.omega_cut) for peak in self.peaks)

    def grid(self) -> FloatArray:
        return np.unique(np.concatenate([peak.grid(self.omega_cut) for peak in self.peaks]))

    @property
    def omega_cut(self) -> float:
        return CUT * max(peak.omega_p for peak in self.peaks)


@dataclass(frozen=True)
class Jonswap(Peaks):
    r"""JONSWAP spectrum; Pierson-Moskowitz where gamma is 1.

    H_s significant wave height [m]; T_p peak period [s]; gamma peak enhancement 1 to 10, by `gamma_of` if left out;
    norm "exact" (H_m0 is H_s) or "printed", which takes 1 - 0.287 ln(gamma) for the integral; name under which it was
    asked for, "jonswap" or "pm".
    Source: DNV-RP-C205; check against your edition. Errors: SeaError for values outside what a sea can be.
    """

    H_s: float
    T_p: float
    gamma: float
    norm: str
    name: str = field(compare=False)
    kind: ClassVar[str] = "jonswap"

    def __init__(
        self,
        H_s: float,
        T_p: float,
        gamma: float | None = None,
        norm: str = "exact",
        *,
        where: str = "jonswap",
        name: str = "jonswap",
    ) -> None:
        check_height_and_period(H_s, T_p, where)
        gamma = gamma_of(H_s, T_p) if gamma is None else gamma
        if not 1.0 <= gamma <= 10.0:
            do = "Leave it out for the rule of T_p/sqrt(H_s)."
            raise SeaError(f"{where}: gamma = {gamma:g} is not between 1 and 10. {do}")
        check_norm(norm, where)
        fill(self, H_s=H_s, T_p=T_p, gamma=float(gamma), norm=norm, name=name)

    @property
    def peaks(self) -> tuple[Peak, ...]:
        scale = (
            1.0
            if self.norm == "exact"
            else printed_scale(5.0, self.gamma, 5.0 * (1.0 - PRINTED_NORM * math.log(self.gamma)))
        )
        return (Peak(self.H_s**2 / 16.0, 2.0 * math.pi / self.T_p, 5.0, self.gamma, scale),)

    @property
    def peak_period(self) -> float:
        return self.T_p

    def describe(self) -> str:
        printed = " norm=printed" if self.norm == "printed" else ""
        if self.name == "pm":
            return f"pm Hs={self.H_s:.6g} m Tp={self.T_p:.6g} s"
        return f"jonswap Hs={self.H_s:.6g} m Tp={self.T_p:.6g} s gamma={self.gamma:.6g}{printed}"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "H_s": self.H_s, "T_p": self.T_p, "gamma": self.gamma, "norm": self.norm}


def pierson_moskowitz(H_s: float, T_p: float, *, where: str = "pm") -> Jonswap:
    """Pierson-Moskowitz spectrum (Bretschneider, ITTC) of H_s [m] and T_p [s]: T_m02/T_p 0.71037, T_m01/T_p 0.77177."""
    return Jonswap(H_s, T_p, 1.0, where=where, name="pm")


def gamma_of(H_s: float, T_p: float) -> float:
    """Peak enhancement by the steepness of the sea: 5 for T_p/sqrt(H_s) up to 3.6, exp(5.75 - 1.15 T_p/sqrt(H_s)) up to
    5, then 1.

    H_s [m], T_p [s]. Source: DNV-RP-C205; check against your edition.
    """
    ratio = T_p / math.sqrt(H_s) if H_s > 0.0 else math.inf
    if ratio <= 3.6:
        return 5.0
    return math.exp(5.75 - 1.15 * ratio) if ratio < 5.0 else 1.0


def peak_period_of(T_z: float, H_s: float, gamma: float | None = None) -> float:
    """Peak period [s] of the JONSWAP spectrum whose T_m02 is T_z [s]; gamma None: by the rule for H_s [m] and the
    period that comes out.

    With the rule there is one answer: T_z grows with T_p all the way.
    """
    if gamma is not None:
        return T_z / _zero_crossing_ratio(gamma)
    low, high = T_z, 1.5 * T_z  # T_m02/T_p is between 0.71 and 0.85
    for _ in range(60):
        middle = (low + high) / 2.0
        if middle * _zero_crossing_ratio(gamma_of(H_s, middle)) < T_z:
            low = middle
        else:
            high = middle
    return (low + high) / 2.0


def _zero_crossing_ratio(gamma: float) -> float:
    """T_m02/T_p of a JONSWAP spectrum."""
    return math.sqrt(_integral(0, 5.0, gamma, math.inf) / _integral(2, 5.0, gamma, math.inf))


@dataclass(frozen=True)
class Mixed(Peaks):
    """Spectra on top of one another, of waves from the same side."""

    terms: tuple[Peaks, ...]
    kind: ClassVar[str] = "mixed"

    def __post_init__(self) -> None:
        if not self.terms:
            raise SeaError("waves: no spectra to add. Give at least one.")

    @property
    def peaks(self) -> tuple[Peak, ...]:
        return tuple(peak for term in self.terms for peak in term.peaks)

    def notes(self) -> tuple[str, ...]:
        return tuple(note for term in self.terms for note in term.notes())

    def describe(self) -> str:
        return " + ".join(term.describe() for term in self.terms)

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "terms": [term.to_dict() for term in self.terms]}


def check_height_and_period(H_s: float, T_p: float, where: str) -> None:
    """Refuse what no sea is. Errors: SeaError."""
    if not 0.0 <= H_s <= HIGHEST:
        raise SeaError(f"{where}: Hs = {H_s:g} m is not between 0 m and {HIGHEST:g} m. Check its unit.")
    if not SHORTEST <= T_p <= LONGEST:
        raise SeaError(f"{where}: Tp = {T_p:g} s is not between {SHORTEST:g} s and {LONGEST:g} s. Check its unit.")


def check_norm(norm: str, where: str) -> None:
    """Refuse a norm that is neither exact nor printed. Errors: SeaError."""
    if norm not in NORMS:
        raise SeaError(f"{where}: norm = {quote(norm)} is not one of {', '.join(NORMS)}. Leave it out for exact.")


COEFFICIENTS: Mapping[str, float] = MappingProxyType(
    {
        "a_f": 6.6,  # s/m^(1/3): T_f = a_f H_s^(1/3)
        "a_e": 2.0,  # s/m^(1/2): steepest sea T_l = a_e sqrt(H_s)
        "a_u": 25.0,  # s: longest swell
        "a_10": 0.7,  # least share of the wind sea
        "a_1": 0.5,  # width of that share over T_f - T_l
        "a_20": 0.6,  # least share of the swell
        "a_2": 0.3,  # width of that share over a_u - T_f
        "b_1": 2.0,  # s: second peak of a wind sea at T_f + b_1
        "k_g": 35.0,  # gamma = k_g (2 pi H/(g T^2))^g_exp
        "g_exp": 0.857,
        "a_3": 6.0,  # gamma of a swell grows by 1 + a_3 (T_p - T_f)/(a_u - T_f)
        "G_0": 3.26,  # printed norm
        "A_1": 1.1,
        "A_exp": 1.19,
    }
)


@dataclass(frozen=True)
class Torsethaugen(Peaks):
    """Torsethaugen spectrum of H_s [m] and T_p [s]; norm "exact" or "printed".

    Errors: SeaError for values outside what a sea can be, or outside the fit: T_p below 2 sqrt(H_s) or from 25 s on.
    """

    H_s: float
    T_p: float
    norm: str
    kind: ClassVar[str] = "torsethaugen"

    def __init__(self, H_s: float, T_p: float, norm: str = "exact", *, where: str = "torsethaugen") -> None:
        check_height_and_period(H_s, T_p, where)
        check_norm(norm, where)
        c = COEFFICIENTS
        steepest = c["a_e"] * math.sqrt(H_s)
        if not steepest <= T_p < c["a_u"] or c["a_f"] * H_s ** (1.0 / 3.0) >= c["a_u"]:
            fit = f"{steepest:.4g} s (2 sqrt(Hs)) to {c['a_u']:g} s"
            sea = f"Tp = {T_p:g} s with Hs = {H_s:g} m"
            raise SeaError(f"{where}: {sea} is outside the fit, {fit}. Use jonswap or ochi-hubble.")
        fill(self, H_s=H_s, T_p=T_p, norm=norm)

    @property
    def peaks(self) -> tuple[Peak, ...]:
        first, second = self._parts()
        parts = (first, second) if second[0] > 0.0 else (first,)
        limited = ((H, T, max(gamma, 1.0)) for H, T, gamma in parts)
        return tuple(Peak(H**2 / 16.0, 2.0 * math.pi / T, 4.0, gamma, self._scale(gamma)) for H, T, gamma in limited)

    def notes(self) -> tuple[str, ...]:
        gamma = self._parts()[0][2]
        return (f"gamma of the primary peak is calculated as {gamma:.3g} and is taken as 1",) if gamma < 1.0 else ()

    def _parts(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Height [m], period [s] and gamma of the primary and of the secondary peak."""
        c, H_s, T_p = COEFFICIENTS, self.H_s, self.T_p
        T_f = c["a_f"] * H_s ** (1.0 / 3.0)
        if T_p <= T_f:
            T_l = c["a_e"] * math.sqrt(H_s)
            r = c["a_10"] + (1.0 - c["a_10"]) * math.exp(-(((T_f - T_p) / (c["a_1"] * (T_f - T_l))) ** 2))
            gamma = c["k_g"] * (2.0 * math.pi * r * H_s / (G * T_p**2)) ** c["g_exp"]
            T_2 = T_f + c["b_1"]
        else:
            over = (T_p - T_f) / (c["a_u"] - T_f)
            r = c["a_20"] + (1.0 - c["a_20"]) * math.exp(-((over / c["a_2"]) ** 2))
            gamma = 1.0
            if H_s > 0.0:
                gamma = c["k_g"] * (2.0 * math.pi * H_s / (G * T_f**2)) ** c["g_exp"] * (1.0 + c["a_3"] * over)
            T_2 = c["a_f"] * (H_s * math.sqrt(1.0 - r**2)) ** (1.0 / 3.0)
        return (r * H_s, T_p, gamma), (H_s * math.sqrt(1.0 - r**2), T_2, 1.0)

    def _scale(self, gamma: float) -> float:
        """Variance of a peak over what was requested."""
        if self.norm == "exact":
            return 1.0
        c = COEFFICIENTS
        return printed_scale(4.0, gamma, c["G_0"] * (1.0 + c["A_1"] * math.log(gamma) ** c["A_exp"]) / gamma)

    @property
    def peak_period(self) -> float:
        return self.T_p

    def describe(self) -> str:
        printed = " norm=printed" if self.norm == "printed" else ""
        return f"torsethaugen Hs={self.H_s:.6g} m Tp={self.T_p:.6g} s{printed}"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "H_s": self.H_s, "T_p": self.T_p, "norm": self.norm}


LEAST_LAMBDA, LARGEST_LAMBDA = 0.5, 20.0


@dataclass(frozen=True)
class Hump:
    """One of the two: H_s [m], T_p [s], lambda [1], above 0.5 and up to 20. Errors: SeaError."""

    H_s: float
    T_p: float
    shape: float
    where: str = field(default="ochi-hubble", compare=False, repr=False)

    def __post_init__(self) -> None:
        check_height_and_period(self.H_s, self.T_p, self.where)
        if not LEAST_LAMBDA < self.shape <= LARGEST_LAMBDA:
            problem = f"lambda = {self.shape:g} is not above {LEAST_LAMBDA:g} and up to {LARGEST_LAMBDA:g}"
            raise SeaError(f"{self.where}: {problem}. Wind sea has about 1, swell 3 to 10.")


@dataclass(frozen=True)
class OchiHubble(Peaks):
    """Ochi-Hubble spectrum of a longer and a shorter hump."""

    humps: tuple[Hump, Hump]
    kind: ClassVar[str] = "ochi-hubble"

    @property
    def peaks(self) -> tuple[Peak, ...]:
        return tuple(Peak(hump.H_s**2 / 16.0, 2.0 * math.pi / hump.T_p, 4.0 * hump.shape + 1.0) for hump in self.humps)

    def describe(self) -> str:
        return "ochi-hubble " + " ".join(
            f"Hs{i}={hump.H_s:.6g} m Tp{i}={hump.T_p:.6g} s lambda{i}={hump.shape:.6g}"
            for i, hump in enumerate(self.humps, start=1)
        )

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "humps": [{"H_s": h.H_s, "T_p": h.T_p, "lambda": h.shape} for h in self.humps]}
