"""One piece of a random sea: waves with their phases, from which the motion of the crane tip and that of the water at
the load, over time and depth, follow together."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.choice import choice
from stillhook.base.kept.identity import remembered
from stillhook.errors import SeaError
from stillhook.sea.motion.irregular import COARSE, FINE, SHORTEST_REPEAT, IrregularTip, synthesis
from stillhook.sea.spectra.spectrum import Sea, WaveSpectrum
from stillhook.sea.vessel.rao import Rao, VerticalMotion, wavenumber
from stillhook.sea.vessel.ship_motion import tip_height

SHORTEST_WAVE = 2.0
"""Period down to which every sea is realised [s], or a quarter of its peak period where that is shorter: shorter waves
(6 m) move no vessel and pass along a load without lifting it; beyond four peak frequencies is 0.5 % of the variance
of a wind
sea."""
FINEST = 1e-3  # rad/s: the spectrum is averaged over each harmonic's band in steps no coarser than this
NEGLIGIBLE = 1e-12
"""Part of the variance of the acceleration in the highest harmonics that exact rotations make and that is left away."""
MOST_HARMONICS = 200_000
REMEMBERED = 3000
"""Harmonics up to which draws and transfer functions are remembered for other heights and seeds: some 2 MB each in a
short-crested sea."""
COARSEST = 0.1
"""Spacing in time [s], or that at which the fastest wave turns by `TURN` where this is shorter."""
TURN = 0.35  # rad: cubic Hermite is then right to (0.35)^4/384 = 4e-5 of the fastest wave
Z_0, D_S = 2.0, 0.2
"""Scale of the levels [m] and their spacing: cubics between levels are right to 1e-4 of a wave of 4 s and longer, 1e-3
of one of 2 s."""
FAINT = 1e-3
"""Part of the speed at the surface (standard deviations) at whose depth the water is taken to be at rest."""
DEEPEST = 80  # levels: 18,000 km, where nothing moves


class Amplitudes(StrEnum):
    """How amplitudes are drawn. FIXED: sqrt(2 S d_omega), phases alone are random, so that every seed has the variance
    of the spectrum. RAYLEIGH: amplitudes random as well, so that variances scatter between seeds as in records of that
    length (exactly Gaussian).
    """

    FIXED = "fixed"
    RAYLEIGH = "rayleigh"


class Resolution(StrEnum):
    """How closely the curve of a tip's motion follows its waves (`stillhook.sea.motion.irregular`): coarse for runs in
    great numbers."""

    FINE = "fine"
    COARSE = "coarse"

    @property
    def angle(self) -> float:
        """Angle between two nodes of the curve for the fastest wave [rad]."""
        return FINE if self is Resolution.FINE else COARSE


@dataclass(frozen=True, eq=False)
class Realisation:
    """Waves of a sea on an even grid of frequencies: everything repeats exactly after `repeat` [s].

    harmonic (n,) rising numbers k, omega_k = 2 pi k/repeat; beta (m,) directions of travel [rad]; a (m, n) complex
    amplitudes [m] at the vessel's reference point, elevation Re sum a exp(i (omega t - k (x cos beta + y sin beta))).
    variance (n,) of the sea at each [m^2], regardless of the draw. depth of the water [m], inf for deep.
    """

    repeat: float
    harmonic: NDArray[np.int64] = field(repr=False)
    beta: FloatArray = field(repr=False)
    a: ComplexArray = field(repr=False)
    variance: FloatArray = field(repr=False)
    depth: float = math.inf
    source: str = ""
    report: str = ""

    @property
    def omega(self) -> FloatArray:
        """Angular frequencies [rad/s] (n,), rising."""
        return np.asarray(2.0 * math.pi / self.repeat * self.harmonic, dtype=np.float64)

    @property
    def wave_number(self) -> FloatArray:
        """Wave numbers [1/m] (n,)."""
        return wavenumber(self.omega, self.depth)

    def elevation(self, x: float, y: float) -> ComplexArray:
        """Complex amplitudes of the surface at (x, y) [m] from the reference point, forward and to port, (n,)."""
        lag = np.outer(x * np.cos(self.beta) + y * np.sin(self.beta), self.wave_number)
        return np.asarray(np.sum(self.a * np.exp(-1j * lag), axis=0))

    def motion(self, rao: Rao) -> ComplexArray:
        """Complex amplitudes of surge, sway, heave [m], roll, pitch, yaw [rad], (6, n)."""
        return np.asarray(np.sum(rao.at(self.omega, self.beta) * self.a, axis=1))

    def spread(self, c: ComplexArray) -> ComplexArray:
        """Amplitudes of these harmonics among all of them, from the mean (0) on."""
        bins = np.zeros(int(self.harmonic[-1]) + 1, dtype=np.complex128)
        bins[self.harmonic] = c
        return bins


def realise(
    sea: Sea, repeat: float, seed: int = 0, *, amplitudes: Amplitudes | str = Amplitudes.FIXED, depth: float = math.inf
) -> Realisation:
    """One realisation of a sea, the same for the same seed (NumPy's PCG64).

    Parameters: repeat [s], the period after which it repeats: the length of the run; seed 0 or more; amplitudes, see
    `Amplitudes`; depth of the water [m]. Harmonics are 2 pi/repeat apart; each takes the variance of its band, averaged
    over the spectrum. In a short-crested sea every direction has its own waves at every harmonic, so the height of
    the sea at one place scatters with any amplitudes.
    Errors: SeaError for a repeat too short for the sea, an impossible seed or depth.
    """
    law = choice(Amplitudes, amplitudes, "amplitudes", SeaError)
    if not (isinstance(seed, int) and not isinstance(seed, bool) and seed >= 0):
        raise SeaError(f"seed {seed!r}: give a whole number of 0 or more.")
    if not (math.isfinite(repeat) and repeat >= SHORTEST_REPEAT):
        least = f"shorter than {SHORTEST_REPEAT:g} s"
        raise SeaError(f"duration {repeat:g} s of the waves is {least}. Give the length of the run.")
    if not depth > 0.0:
        raise SeaError(f"depth {depth:g} m is not more than 0 m. Leave it out for deep water.")
    d_omega = 2.0 * math.pi / repeat
    first, last = band(sea, repeat)
    harmonic = np.arange(first, last + 1)
    beta: list[float] = []
    a: list[ComplexArray] = []
    variance_of = np.zeros(len(harmonic))
    sides = [train.directions() for train in sea.trains]
    count = sum(len(theta) for theta, _ in sides)
    chance = iter(_cached(_random_amplitudes, len(harmonic))(seed, count, len(harmonic), law))
    for train, (theta, weights) in zip(sea.trains, sides, strict=True):
        variance = _variances(train.spectrum, first, last, d_omega)
        variance_of += variance
        for direction, weight in zip(theta, weights, strict=True):
            beta.append(float(direction))
            part = weight * variance
            a.append(np.sqrt(2.0 * part if law is Amplitudes.FIXED else part) * next(chance))
    report = (
        f"Seed {seed}, {law.value} amplitudes, {len(harmonic)} harmonics of {repeat:.6g} s up to a period of"
        f" {repeat / last:.3g} s, {variance_of.sum() / sea.moment(0):.2%} of the variance of the sea."
    )
    return Realisation(repeat, harmonic, np.array(beta), np.array(a), variance_of, depth, sea.describe(), report)


def regular(
    amplitude: float, period: float, beta: float, *, cycles: int = 1, phase: float = 0.0, depth: float = math.inf
) -> Realisation:
    """One regular wave of amplitude [m], period [s] and direction of travel [rad], with a crest at the reference point
    at t = 0 for phase 0 [rad]; it repeats (and is known) over `cycles` periods. Errors: SeaError for a wave that cannot
    be."""
    if not (0.0 < amplitude <= 50.0 and 0.1 <= period <= 3600.0 and cycles >= 1):
        raise SeaError(
            f"regular wave of {amplitude:g} m, {period:g} s, {cycles} cycles: give 0 to 50 m, 0.1 to 3600 s, 1 cycle or"
            " more."
        )
    a = np.array([[amplitude * np.exp(1j * phase)]])
    source = f"regular wave {amplitude:.6g} m {period:.6g} s"
    return Realisation(
        cycles * period, np.array([cycles]), np.array([beta]), a, np.array([amplitude**2 / 2.0]), depth, source
    )


def tip_motion(waves: Realisation, rao: VerticalMotion, x: float, y: float, *, fine: float = FINE) -> IrregularTip:
    """Vertical motion of the crane tip above (x, y) [m] from the RAO's reference point, forward and to port, by these
    waves (linear).

    Coherent with `wave_field.water` of the same waves. fine: see `IrregularTip`. Source: z = eta_3 + y eta_4 - x eta_5.
    """
    H = _cached(_vertical, len(waves.harmonic))(rao, waves.repeat, waves.harmonic.tobytes(), waves.beta.tobytes(), x, y)
    c = np.sum(H * waves.a, axis=0)
    report = f"{rao.name} at x {x:g} m, y {y:g} m. {waves.report}".strip()
    return IrregularTip(waves.spread(c), waves.repeat, source=waves.source, report=report, fine=fine)


@lru_cache(maxsize=16)
def _vertical(rao: VerticalMotion, repeat: float, harmonic: bytes, beta: bytes, x: float, y: float) -> ComplexArray:
    """`Rao.vertical` at the waves of a realisation, the same for every seed of a sea."""
    omega = 2.0 * math.pi / repeat * np.frombuffer(harmonic, dtype=np.int64)
    return rao.vertical(omega, np.frombuffer(beta), x, y)


def tip_motion_exact(waves: Realisation, rao: Rao, x: float, y: float, z: float) -> IrregularTip:
    """As `tip_motion`, with the rotations of the ship in full: height of the point (x, y, z) [m] from the reference
    point, z up.

    Heave, roll and pitch are those of the linear theory; the sine and cosine of the angles sink the mean with the
    height of the tip by about z (roll^2 + pitch^2)/2, and add motion at twice the wave frequency. The report says how
    far it is from the linear motion.
    """
    n = 8 * (int(waves.harmonic[-1]) + 1)  # room for three waves together and one more
    heave, roll, pitch = (synthesis(waves.spread(c), n) for c in waves.motion(rao)[2:5])
    height = tip_height(heave, roll, -pitch, x, y, z)
    c = np.fft.rfft(height)[: n // 2] * (2.0 / n)
    c[0] = c[0].real / 2.0
    beyond = np.cumsum((np.abs(c) ** 2 * np.arange(n // 2) ** 4.0)[::-1])[
        ::-1
    ]  # acceleration of each harmonic and all above it
    c = c[: int(np.searchsorted(-beyond, -NEGLIGIBLE * beyond[1]))]
    off = height - (heave + y * roll - x * pitch)
    report = (
        f"{rao.name} at x {x:g} m, y {y:g} m, z {z:g} m, exact rotations: mean {1e3 * off.mean():.3g} mm, "
        f"up to {1e3 * np.abs(off).max():.3g} mm off the linear motion. {waves.report}"
    )
    return IrregularTip(c, waves.repeat, source=waves.source, report=report)


def _cached(function: Any, n: int) -> Any:
    """The function that remembers what it gave, or, where its arrays of n harmonics are large, as it is."""
    return function if n <= REMEMBERED else function.__wrapped__


@remembered
def band(sea: Sea, repeat: float) -> tuple[int, int]:
    """First and last harmonic of `repeat` [s] that the sea is realised on. Errors: SeaError."""
    d_omega = 2.0 * math.pi / repeat
    lowest, highest = math.inf, 0.0
    for train in sea.trains:
        spectrum = train.spectrum
        if spectrum.moment(0) > 0.0:
            lowest = min(lowest, float(spectrum.grid()[0]))
            end = 2.0 * math.pi * max(1.0 / SHORTEST_WAVE, 4.0 / spectrum.peak_period)
            highest = max(highest, min(spectrum.omega_cut, end))
    if highest == 0.0:
        raise SeaError(f"{sea.describe()}: there are no waves to realise. Leave waves and vessel out for a calm.")
    first, last = max(1, math.floor(lowest / d_omega + 0.5)), math.ceil(highest / d_omega - 0.5)
    if last - first < 10:
        few = f"leaves {max(0, last - first + 1)} harmonics for the sea, too few to be random"
        raise SeaError(f"duration {repeat:g} s {few}. Give ten wave periods or more.")
    if last > MOST_HARMONICS:
        longest = MOST_HARMONICS * 2.0 * math.pi / highest / 3600.0
        raise SeaError(f"duration {repeat:g} s of the waves is longer than {longest:.0f} h, the most for this sea.")
    return first, last


@remembered
def _variances(spectrum: WaveSpectrum, first: int, last: int, d_omega: float) -> FloatArray:
    """Variance in the band of each harmonic from the first to the last, half a step to either side [m^2]."""
    harmonic = np.arange(first, last + 1)
    parts = max(1, math.ceil(d_omega / FINEST))
    offsets = (np.arange(parts) + 0.5) / parts - 0.5
    omega = d_omega * (harmonic[:, None] + offsets[None, :])
    return np.asarray(spectrum.density(omega.ravel()).reshape(omega.shape).mean(axis=1) * d_omega, dtype=np.float64)


@lru_cache(maxsize=32)
def _random_amplitudes(seed: int, directions: int, n: int, law: Amplitudes) -> ComplexArray:
    """What chance gives to every direction and harmonic, (directions, n): the same for seas of any height."""
    rng = np.random.default_rng(seed)
    if law is Amplitudes.FIXED:
        return np.asarray(np.exp(2j * math.pi * rng.random((directions, n))), dtype=np.complex128)
    parts = rng.standard_normal((directions, 2, n))
    return np.asarray(parts[:, 0] + 1j * parts[:, 1])


@dataclass(frozen=True, eq=False)
class WaveField:
    """Surface and vertical water motion at the load's place, sampled evenly from t = 0 on, coherent with the tip's
    motion.

    dt spacing [s] (0.1 s or less); n samples. eta (n,) surface elevation [m, up positive] and eta_dot (n,) its rate
    [m/s]; w, a (n, L) vertical water speed [m/s] and acceleration [m/s^2], up positive, on L levels below still water:
    z_j = -z_0 (exp(j ds) - 1) [m], j = 0 .. L - 1, so that level 0 is the still surface. Above it kinematics stay those
    of the surface (linear theory, no stretching); below the last level the water is at rest.
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
    """Number of levels down to where the water is at rest; the same for every seed of a sea."""
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
