"""Water at the load: surface and vertical water motion over time and depth, made of the same waves that move the crane
tip.

Water under irregular and regular waves at one place, over time and depth, for a load that passes through.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.sea.motion.irregular import synthesis
from stillhook.sea.vessel.realisation import Realisation


@dataclass(frozen=True, eq=False)
class WaveField:
    """Surface and vertical water motion at the load's place, sampled evenly from t = 0 on, coherent with the tip's
    motion.

    dt spacing [s] (0.1 s or less); n samples. eta (n,) surface elevation [m, up positive] and eta_dot (n,) its rate
    [m/s]; w, a (n, L) vertical water speed [m/s] and acceleration [m/s^2], up positive, on L levels below still water:
    z_j = -z_0 (exp(j ds) - 1) [m], j = 0 .. L - 1, so that level 0 is the still surface. Above it kinematics stay those
    of the surface (linear theory, no stretching); below the last level the water stands.
    """

    dt: float
    eta: FloatArray = field(repr=False)
    eta_dot: FloatArray = field(repr=False)
    w: FloatArray = field(repr=False)
    a: FloatArray = field(repr=False)
    z_0: float
    ds: float
    source: str = ""

    @property
    def duration(self) -> float:
        """Last time at which the water is known [s]."""
        return self.dt * (len(self.eta) - 1)


COARSEST = 0.1
"""Spacing in time [s], or that at which the fastest wave turns by `TURN` where this is shorter."""
TURN = 0.35  # rad: cubic Hermite is then right to (0.35)^4/384 = 4e-5 of the fastest wave
Z_0, D_S = 2.0, 0.2
"""Scale of the levels [m] and their spacing: cubics between levels are right to 1e-4 of a wave of 4 s and longer, 1e-3
of one of 2 s."""
FAINT = 1e-3
"""Part of the speed at the surface (standard deviations) at whose depth the water is taken to stand."""
DEEPEST = 80  # levels: 18,000 km, where nothing moves


def wave_field(waves: Realisation, x: float, y: float) -> WaveField:
    r"""Water at (x, y) [m] from the vessel's reference point, forward and to port, over one repeat of the waves.

    .. math:: w = \dot\eta \frac{\sinh k(z + d)}{\sinh k d} \;\to\; \dot\eta e^{kz} \text{ on deep water}, \qquad a =
    \dot w

    Linear theory, with the waves undisturbed by the ship. Coherent with `realisation.tip_motion` of the same waves: a
    load hangs at the tip's (x, y). The lowest level is stationary: there the water has less than 0.1 % of the speed at
    the surface, or it is the bed.
    """
    n = samples(waves.repeat, int(waves.harmonic[-1]))
    surface = waves.elevation(x, y)
    z = -Z_0 * np.expm1(D_S * np.arange(_levels(waves)))
    speed = 1j * waves.omega * surface * decay(waves.wave_number, z, waves.depth)
    speed[-1] = 0.0
    parts = {"eta": surface, "eta_dot": 1j * waves.omega * surface, "w": speed, "a": 1j * waves.omega * speed}
    series = {name: _series(waves, c, n) for name, c in parts.items()}
    return WaveField(dt=waves.repeat / n, **series, z_0=Z_0, ds=D_S, source=waves.source)


def samples(repeat: float, last: int) -> int:
    """Samples of the water over one repeat [s] of waves up to the harmonic `last`."""
    n = math.ceil(repeat / min(COARSEST, TURN / float(2.0 * math.pi / repeat * last)))
    return max(n, 2 * last + 2)


def decay(k: FloatArray, z: FloatArray, depth: float) -> FloatArray:
    """Vertical motion at heights z (L,) [m, 0 at still water and negative below] over that at the surface, (L, n) for
    wave numbers k (n,).

    Above the surface that of the surface, below the bed (depth [m], inf for deep water) none.
    """
    z = np.minimum(z, 0.0)[:, None]
    if not math.isfinite(depth):
        return np.asarray(np.exp(k * z))
    above_bed = np.maximum(z + depth, 0.0)
    return np.asarray(np.exp(k * (above_bed - depth)) * np.expm1(-2.0 * k * above_bed) / np.expm1(-2.0 * k * depth))


def _levels(waves: Realisation) -> int:
    """Number of levels down to where the water stands; the same for every seed of a sea, so that runs on several fit
    side by side."""
    speed = np.sqrt(waves.variance) * waves.omega
    z = -Z_0 * np.expm1(D_S * np.arange(DEEPEST))
    rms = np.sqrt(np.sum((speed * decay(waves.wave_number, z, waves.depth)) ** 2, axis=1))
    return max(2, int(np.argmax(rms <= FAINT * rms[0])) + 1)


def _series(waves: Realisation, c: ComplexArray, n: int) -> FloatArray:
    """Samples 0 .. n over one repeat, the last one the first again: (n + 1,) or, for amplitudes of levels (L, .), (n +
    1, L)."""
    spectrum = np.zeros((*c.shape[:-1], int(waves.harmonic[-1]) + 1), dtype=np.complex128)
    spectrum[..., waves.harmonic] = c
    x = synthesis(spectrum, n)
    out = np.empty((n + 1, *x.shape[:-1]))
    out[:n], out[n] = x.T, x.T[0]
    return out
