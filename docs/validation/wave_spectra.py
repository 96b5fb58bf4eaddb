"""Wave spectra: periods against published ratios and fits, moments against integration of another kind, and where
moments end."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from blocks import Blocks, Rows
from scipy.integrate import quad

from stillhook.sea.spectra.parametric import Jonswap, Peaks, Torsethaugen
from stillhook.sea.spectra.text import parse_wave

GAMMAS = (1.0, 2.0, 3.3, 5.0, 7.0)
T_P = 10.0  # s
ZERO_CROSSING = (0.6673, 0.05037, -0.006230, 0.0003341)
MEAN = (0.7303, 0.04936, -0.006556, 0.0003610)
"""T_m02/T_p and T_m01/T_p as cubics in gamma. DNV-RP-C205."""
SEAS = (
    "pm Hs=3 m Tp=10 s",
    "jonswap Hs=3 m Tp=10 s gamma=3.3",
    "torsethaugen Hs=3 m Tp=7 s",
    "torsethaugen Hs=3 m Tp=14 s",
    "ochi-hubble Hs1=2 m Tp1=14 s lambda1=3 Hs2=2.236 m Tp2=7 s lambda2=1.2",
)
FAR = 1e5  # rad/s: beyond, what is left follows from the power of the tail
STEEP = tuple((H, T) for H in (1.0, 3.0, 6.0, 10.0) for T in (7.0, 9.0, 11.0, 14.0, 18.0))


def integral(wave: Peaks, n: int, upper: float) -> float:
    """m_n by adaptive Gauss-Kronrod integration over the logarithm of frequency, up to upper [rad/s]."""
    peak = math.log(2.0 * math.pi / wave.peak_period)
    edges = [peak - 2.0, *(peak + d for d in (-0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 2.0)), math.log(upper)]
    under = lambda u: math.exp(u * (n + 1)) * float(wave.density(np.array([math.exp(u)]))[0])
    return float(sum(quad(under, a, b, epsabs=0.0, epsrel=1e-10, limit=200)[0] for a, b in pairwise(edges)))


def moment_error(wave: Peaks, n: int, N: float) -> float:
    """Part by which m_n differs from the integral; N power of the tail."""
    if n >= N - 1.0:
        return wave.moment(n) / integral(wave, n, wave.omega_cut) - 1.0
    tail = float(wave.density(np.array([FAR]))[0]) * FAR ** (n + 1) / (N - 1.0 - n)
    return wave.moment(n) / (integral(wave, n, FAR) + tail) - 1.0


def cubic(coefficients: tuple[float, ...], gamma: float) -> float:
    return sum(c * gamma**i for i, c in enumerate(coefficients))


def compute() -> tuple[Blocks, None]:
    waves = [Jonswap(3.0, T_P, gamma) for gamma in GAMMAS]
    of_z = [wave.T_m02 / T_P / cubic(ZERO_CROSSING, wave.gamma) - 1.0 for wave in waves]
    of_m = [wave.T_m01 / T_P / cubic(MEAN, wave.gamma) - 1.0 for wave in waves]
    printed = [Jonswap(3.0, T_P, gamma, "printed").H_m0 / 3.0 - 1.0 for gamma in GAMMAS]
    two_peaks = [Torsethaugen(H, T, "printed").H_m0 / H - 1.0 for H, T in STEEP]
    worst = max(abs(moment_error(wave, n, 5.0)) for wave in waves for n in range(-1, 5))
    plain = waves[0]
    largest = lambda x: f"within {100.0 * max(abs(v) for v in x):.2f} %"

    rows = [{"p": p, "wave": wave} for wave, p in zip(waves, printed, strict=True)]
    return {"claims": locals(), "periods": rows, "cuts": cuts(tuple(parse_wave(text) for text in SEAS))}, None


def cuts(seas: tuple[Peaks, ...]) -> Rows:
    """What is left of a moment above the cut, by sea."""
    rows = []
    for sea in seas:
        grid, weight = sea.grid(), sea.weights()
        left = [1.0 - float(np.sum(weight * grid**n * sea.density(grid))) / sea.moment(n) for n in range(4)]
        shown = [f"{100.0 * part:.2g} %" if abs(part) > 2e-5 else "below 0.002 %" for part in left]
        if "torsethaugen" in sea.describe():
            shown[3] = "does not end"
        rows.append((f"`{sea.describe()}`", *shown))
    return rows
