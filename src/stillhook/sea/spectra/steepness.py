r"""How steep a sea is, and whether wind can raise one so steep.

.. math:: S_p = \frac{2\pi}{g}\frac{H_{m0}}{T_p^2}, \quad S_s = \frac{2\pi}{g}\frac{H_{m0}}{T_z^2}

Source: DNV-RP-C205 (limits of the average steepness of short-term sea states); check against your edition.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from stillhook.sea.spectra.spectrum import G

LIMITS: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {
        "T_p": ((8.0, 1.0 / 15.0), (15.0, 1.0 / 25.0)),
        "T_m02": ((6.0, 1.0 / 10.0), (12.0, 1.0 / 15.0)),
    }
)
"""Steepest sea by period: up to the first [s], from the second on, and straight between them."""


def steepness(H_m0: float, T: float) -> float:
    """2 pi H_m0/(g T^2) [1] of a height [m] and a period [s]; NaN without a period."""
    return 2.0 * math.pi * H_m0 / (G * T**2) if T > 0.0 else math.nan


def steepest(T: float, period: str) -> float:
    """Largest steepness of a sea [1] of a period [s]: "T_p" or "T_m02"."""
    (a, s_a), (b, s_b) = LIMITS[period]
    return float(np.interp(T, (a, b), (s_a, s_b)))


def doubts(H_m0: float, T_p: float, T_m02: float) -> tuple[str, ...]:
    """What speaks against a sea of this height [m] and these periods [s], a line each; nothing for a sound one."""
    lines = []
    for name, T in (("T_p", T_p), ("T_m02", T_m02)):
        s, most = steepness(H_m0, T), steepest(T, name)
        if s > most:
            lines.append(
                f"steeper than wind raises waves: 2 pi H_m0/(g {name}^2) = {s:.3g}, limit {most:.3g} (DNV-RP-C205)"
            )
    return tuple(lines)
