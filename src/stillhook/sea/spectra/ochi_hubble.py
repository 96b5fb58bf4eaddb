r"""Ochi-Hubble's spectrum: two peaks of six parameters, each of any width.

.. math:: S = \frac14 \sum_j \frac{(\frac{4\lambda_j + 1}{4}\omega_{pj}^4)^{\lambda_j}}{\Gamma(\lambda_j)}
          \frac{H_{sj}^2}{\omega^{4\lambda_j + 1}} e^{-\frac{4\lambda_j + 1}{4} (\omega_{pj}/\omega)^4}

Source: Ochi and Hubble 1976, DNV-RP-C205; check against your edition. lambda 1 is Pierson-Moskowitz; swell has 3 to 10.
Moments n from 4 lambda on depend on the cut, so lambda is held above 0.5: T_m02 then does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

from stillhook.errors import SeaError
from stillhook.sea.spectra.parametric import Peak, Peaks, check_height_and_period

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
