"""Spectra of wind sea and swell together: Torsethaugen (simplified form) and Ochi-Hubble."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar

from stillhook.base.arrays import fill
from stillhook.errors import SeaError
from stillhook.physics.scalar import G
from stillhook.sea.spectra.parametric import Peak, Peaks, check_height_and_period, check_norm, printed_scale

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
            raise SeaError(
                f"{where}: Tp = {T_p:g} s with Hs = {H_s:g} m is outside the fit, {steepest:.4g} s (2 sqrt(Hs)) to"
                f" {c['a_u']:g} s. Use jonswap or ochi-hubble."
            )
        fill(self, H_s=H_s, T_p=T_p, norm=norm)

    @property
    def peaks(self) -> tuple[Peak, ...]:
        first, second = self._parts()
        parts = (first, second) if second[0] > 0.0 else (first,)
        limited = ((H, T, max(gamma, 1.0)) for H, T, gamma in parts)
        return tuple(Peak(H**2 / 16.0, 2.0 * math.pi / T, 4.0, gamma, self._scale(gamma)) for H, T, gamma in limited)

    def notes(self) -> tuple[str, ...]:
        gamma = self._parts()[0][2]
        return (f"gamma of the primary peak comes out at {gamma:.3g} and is taken as 1",) if gamma < 1.0 else ()

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
            gamma = (
                c["k_g"] * (2.0 * math.pi * H_s / (G * T_f**2)) ** c["g_exp"] * (1.0 + c["a_3"] * over)
                if H_s > 0.0
                else 1.0
            )
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
            raise SeaError(
                f"{self.where}: lambda = {self.shape:g} is not above {LEAST_LAMBDA:g} and up to {LARGEST_LAMBDA:g}. "
                "Wind sea has about 1, swell 3 to 10."
            )


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
