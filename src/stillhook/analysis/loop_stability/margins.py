"""How far the position loop is from swinging: gain, phase and delay margins and sensitivity peak, for a loop in
continuous time and for the loop as a PLC closes it, sampled exactly, with any delay; the gains between which it dies
out, and the largest that keeps the margins.

A loop that oscillates without any feedback (a loaded winch, slow, where friction falls with speed) has a gain limit of
0. One that is stable when cut has one limit, from above; one that oscillates when cut may be stable between two gains
(conditionally), or at none.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from stillhook.analysis.loop_stability.loops import ContinuousLoop, Loop, SampledLoop
from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import StillhookError

POINTS = 1500
"""Points of the coarse grid of frequencies, from LOWEST of the slowest mode to HIGHEST of the fastest one or the
Nyquist frequency."""
LOWEST, HIGHEST = 1e-3, 30.0
LOWEST_REMEMBERED = 1e-2
"""In place of LOWEST with an integral part: two integrators, sure to 1e-9 1/s, have no sure phase further down."""
AROUND = np.sort(np.concatenate([s * np.geomspace(1e-3, 8.0, 12) for s in (-1.0, 1.0)]))
"""Extra points about each mode, in half widths of its resonance: the least damped one is then resolved completely."""
ROUNDING = 1e-10
"""Accuracy of eigenvalues of these loops, over the largest one."""
MOST_HELD = 60
"""Cycles of delay up to which stability is judged by eigenvalues: each cycle adds one."""
GROWS = 1e-6
"""Real part above which a mode of the cut loop grows [1/s]: integrators come out of the eigenvalues below 1e-9, and
what grows more slowly than e-fold in twelve days does not count as an oscillation."""
NEIGHBOURS = 1.5
"""Most that the response grows between two points of the grid: they are closer than the width of any resonance."""
DELAYS = 20
"""Most delays between none and the given one that `strongest_up_to` looks at."""
CYCLE_END = 1e-6
"""How near the Nyquist frequency the grid's end is taken to be it [-]."""
GAIN_MARGIN = 2.0
PHASE_MARGIN = math.radians(45.0)
SENSITIVITY_PEAK = 2.0
KEPT = (GAIN_MARGIN, PHASE_MARGIN, SENSITIVITY_PEAK)
"""Margins that a largest gain keeps by default: 6 dB [-] and 45 degrees [rad], and M_s = 2 [-], the upper end of the
usual 1.2 to 2.0.
Source: Astrom and Murray, Feedback Systems, section 10.3 (gain margin 2 to 5, phase margin 30 to 60 degrees, M_s 1.2 to
2)."""


class Margins(NamedTuple):
    """Of the position loop with its K_p [1/m]: gain_margin K_p of marginal stability over K_p [-] and its frequency
    omega_c [rad/s]; phase_margin [rad] at the gain crossover omega_gc [rad/s] where it is least, negative where the
    loop is unstable; delay_margin extra delay that brings the loop to its limit [s]; sensitivity_peak M_s = max |1/(1 +
    L)| [-] at omega_s [rad/s]; stable.
    """

    gain_margin: float
    omega_c: float
    phase_margin: float
    omega_gc: float
    delay_margin: float
    sensitivity_peak: float
    omega_s: float
    stable: bool


def margins(loop: Loop, K_p: float) -> Margins:
    """Margins of a loop at the gain K_p [1/m], of all its crossovers the nearest to the limit.

    Errors: StillhookError for a gain that is not above 0.
    """
    if not K_p > 0.0:
        raise StillhookError(f"K_p = {K_p:g} 1/m: a loop without feedback has no margins. Give a gain above 0.")
    omega = _down_to_crossover(loop, frequency_grid(loop), K_p)
    L = K_p * loop.response(omega)
    K_ms, omega_c = gain_and_frequency(loop, omega, L / K_p)
    stable = is_stable(loop, K_p, K_ms)
    if not stable and grows_alone(loop) is not None:
        K_ms, omega_c = gain_limit_of(loop)
    gain_crossovers = _roots(loop, omega, np.abs(L) - 1.0, lambda l: K_p * abs(l) - 1.0)
    phase_margin, omega_gc, delay_margin = _phase(loop, gain_crossovers, stable)
    M_s, omega_s = _peak(loop, K_p, omega, L)
    return Margins(
        gain_margin=K_ms / K_p,
        omega_c=omega_c,
        phase_margin=phase_margin,
        omega_gc=omega_gc,
        delay_margin=delay_margin,
        sensitivity_peak=M_s,
        omega_s=omega_s,
        stable=stable,
    )


def gain_limit_of(loop: Loop) -> tuple[float, float]:
    """Least gain at which the loop oscillates [1/m], and the frequency of it [rad/s]: where the response first passes
    -1 as the gain grows.

    Both are infinite for a loop that never does; the gain is 0 for one that oscillates without any.
    """
    alone = grows_alone(loop)
    if alone is not None:
        return 0.0, alone
    return gain_and_frequency(loop, *grid_response(loop))


def is_stable(loop: Loop, K_p: float, K_ms: float | None = None) -> bool:
    """Whether the closed loop dies out, or at least stays (a winch that sticks keeps what it has), by its poles; a
    continuous loop with delay, and one with more than `MOST_HELD` cycles of it, by its gain limit K_ms."""
    if isinstance(loop, SampledLoop) and loop.n <= MOST_HELD:
        return bool(np.max(np.abs(loop.closed_poles(K_p))) < 1.0 + ROUNDING)
    if isinstance(loop, ContinuousLoop) and loop.delay == 0.0:
        poles = loop.closed_poles(K_p)
        return bool(np.max(poles.real) < ROUNDING * np.max(np.abs(poles)))
    return K_p < (gain_limit_of(loop)[0] if K_ms is None else K_ms)


Wanted = tuple[float, float, float]
"""Gain margin [-], phase margin [rad] and sensitivity peak [-] that a gain keeps."""


@functools.lru_cache(maxsize=8192)
def strongest_up_to(loop: SampledLoop, kept: Wanted = KEPT) -> float:
    """Largest gain that keeps the margins with the loop's delay and with every shorter one, cycle by cycle [1/m].

    The loop meets its limit on the resonance of the oil, which a delay turns away from -1: with a delay of a fraction
    of its period the limit is higher. A gain that counts on a delay fails where the delay is shorter.
    """
    cycles = np.unique(np.linspace(0, loop.n, min(loop.n, DELAYS) + 1).astype(int))
    loops = [replace(loop, n=int(n)) for n in cycles]
    if np.any(loop.Gamma_1):
        loops.append(replace(loop, n=0, Gamma_0=loop.Gamma_0 + loop.Gamma_1, Gamma_1=np.zeros_like(loop.Gamma_1)))
    return min(strongest(each, kept) for each in loops)


def strongest(loop: Loop, kept: Wanted = KEPT) -> float:
    """Largest gain of any loop that keeps the three margins [1/m].

    As the gain grows from 0, each frequency breaks a margin at a different gain; the least of those is the answer. It
    is 0 for a loop that oscillates without feedback.
    """
    if grows_alone(loop) is not None:
        return 0.0
    gain_margin, phase_margin, sensitivity = kept
    omega, L = grid_response(loop)
    K_gain = gain_and_frequency(loop, omega, L)[0] / gain_margin
    K_phase = _least(loop, omega, L, lambda l: _phase_breaks(l, phase_margin))
    K_edge = min(_on_ray(loop, omega, L, phase_margin), _on_ray(loop, omega, L, -phase_margin))
    K_peak = _least(loop, omega, L, lambda l: _sensitivity_breaks(l, sensitivity))
    return float(min(K_gain, K_phase, K_edge, K_peak))


@functools.lru_cache(maxsize=8192)
def strongest_estimate(loop: SampledLoop, kept: Wanted) -> float:
    """`strongest_up_to` on the grid alone [1/m]: an estimate that shows which of many loops are worth the search."""
    gain_margin, phase_margin, sensitivity = kept
    omega, L = grid_response(loop)
    ahead = np.exp(1j * omega * loop.t_cycle)
    least = math.inf
    for _ in range(min(loop.n, DELAYS) + 1):
        against = np.nonzero((np.signbit(L.imag[:-1]) != np.signbit(L.imag[1:])) & (L.real[:-1] < 0.0))[0]
        reach = max((-float(L.real[i]) for i in against), default=0.0)
        least = min(
            least,
            1.0 / (reach * gain_margin) if reach > 0.0 else math.inf,
            float(np.min(_phase_breaks(L, phase_margin))),
            float(np.min(_sensitivity_breaks(L, sensitivity))),
        )
        L = L * ahead
    return least


def _on_ray(loop: Loop, omega: FloatArray, L: ComplexArray, beyond: float) -> float:
    """Least gain at which the response crosses the unit circle at the angle `beyond` past -180 degrees."""
    size, _ = _farthest(loop, omega, L, complex(-np.exp(-1j * beyond)))
    return 1.0 / size if size else math.inf


def frequency_grid(loop: Loop) -> FloatArray:
    """Frequencies at which crossovers are sought [rad/s]."""
    modes = loop.modes()
    swinging = modes[np.abs(modes) > 1e-6]
    late = [math.pi / loop.delay] if isinstance(loop, ContinuousLoop) and loop.delay > 0.0 else []
    size = np.concatenate([np.abs(swinging), late])
    top = min(HIGHEST * float(size.max()), loop.nyquist * (1.0 - 1e-9))
    lowest = LOWEST_REMEMBERED if isinstance(loop, SampledLoop) and loop.remembered is not None else LOWEST
    coarse = np.geomspace(lowest * float(size.min()), top, POINTS)
    near = [abs(p.imag) + abs(p.real) * AROUND for p in swinging if abs(p.imag) > abs(p.real)]
    omega = np.unique(np.concatenate([coarse, *near]))
    return np.asarray(omega[(omega >= coarse[0]) & (omega <= top)], dtype=np.float64)


@functools.lru_cache(maxsize=512)
def grid_response(loop: Loop) -> tuple[FloatArray, ComplexArray]:
    """The grid of a loop and its response there; kept, for limits and margins both need it."""
    omega = frequency_grid(loop)
    return omega, loop.response(omega)


def _down_to_crossover(loop: Loop, omega: FloatArray, K_p: float) -> FloatArray:
    """The grid, and below it what an integrator with little gain needs to reach its crossover."""
    size = K_p * abs(at_frequency(loop, float(omega[0])))
    if not 0.0 < size < 1.0:
        return omega
    return np.concatenate([np.geomspace(0.5 * size * omega[0], omega[0], POINTS // 10, endpoint=False), omega])


def grows_alone(loop: Loop) -> float | None:
    """Frequency of the mode of the cut loop that grows fastest [rad/s], None where none grows."""
    modes = loop.modes()
    fastest = modes[int(np.argmax(modes.real))]
    return float(abs(fastest.imag)) if fastest.real > GROWS else None


def _roots(loop: Loop, omega: FloatArray, values: FloatArray, f: Callable[[complex], float]) -> list[float]:
    """Frequencies at which f(L) passes zero; values f on the grid."""
    at = np.nonzero(np.signbit(values[:-1]) != np.signbit(values[1:]))[0]

    def g(w: float) -> float:
        return float(f(at_frequency(loop, w)))

    return [root_between(g, omega[i], omega[i + 1]) for i in at if math.isfinite(values[i] + values[i + 1])]


def root_between(f: Callable[[float], float], low: float, high: float) -> float:
    """Frequency at which f passes zero between two of the grid; where it is 0 at one of them but for rounding, which
    may have another sign there than on the grid (at the Nyquist frequency), that one."""
    ends = f(low), f(high)
    if math.copysign(1.0, ends[0]) == math.copysign(1.0, ends[1]):
        return float(low if abs(ends[0]) < abs(ends[1]) else high)
    return float(scipy.optimize.brentq(f, low, high, xtol=1e-13, rtol=1e-14))


def gain_and_frequency(loop: Loop, omega: FloatArray, L: ComplexArray) -> tuple[float, float]:
    """Gain and frequency at which the response first reaches -1."""
    size, w = _farthest(loop, omega, L, -1.0)
    at_nyquist = -float(L.real[-1]) if omega[-1] > loop.nyquist * (1.0 - CYCLE_END) else 0.0
    if at_nyquist > size:  # the command changes its sign every cycle
        size, w = at_nyquist, float(omega[-1])
    return (1.0 / size, w) if size else (math.inf, math.inf)


def _farthest(loop: Loop, omega: FloatArray, L: ComplexArray, turn: complex) -> tuple[float, float]:
    """Where the response, turned, passes the positive real axis farthest out: distance and frequency; 0 where it never
    does.

    A delay makes thousands of crossings, nearly all of them small: they are taken from the largest on.
    """
    turned = L * turn
    brackets = np.nonzero(
        (np.signbit(turned.imag[:-1]) != np.signbit(turned.imag[1:]))
        & (np.maximum(turned.real[:-1], turned.real[1:]) > 0.0)
    )[0]
    reach = np.maximum(np.abs(L[brackets]), np.abs(L[brackets + 1]))
    best, at = 0.0, math.inf
    for k in np.argsort(-reach):
        if NEIGHBOURS * reach[k] < best:
            break
        i = brackets[k]

        def across(w: float) -> float:
            return float((at_frequency(loop, w) * turn).imag)

        w = root_between(across, omega[i], omega[i + 1])
        size = (at_frequency(loop, w) * turn).real
        if size > best:
            best, at = size, w
    return best, at


def at_frequency(loop: Loop, omega: float) -> complex:
    return complex(loop.response(np.array([omega]))[0])


def _phase(loop: Loop, crossovers: list[float], stable: bool) -> tuple[float, float, float]:
    """Phase margin, its crossover, delay margin."""
    if not crossovers:
        return math.inf, math.nan, math.inf
    w = np.array(crossovers)
    beyond = np.angle(-loop.response(w))  # phase beyond -180 degrees, within half a turn
    i = int(np.argmin(np.abs(beyond)))
    if not stable:
        return -abs(float(beyond[i])), float(w[i]), -abs(float(beyond[i])) / float(w[i])
    return abs(float(beyond[i])), float(w[i]), float(np.min(np.mod(beyond, 2.0 * math.pi) / w))


def _peak(loop: Loop, K_p: float, omega: FloatArray, L: ComplexArray) -> tuple[float, float]:
    """Largest |1/(1 + L)| and its frequency."""
    i = int(np.argmin(np.abs(1.0 + L)))
    w = _nearest_least(omega, i, lambda w: abs(1.0 + K_p * at_frequency(loop, w)))
    return 1.0 / abs(1.0 + K_p * at_frequency(loop, w)), w


def _least(loop: Loop, omega: FloatArray, L: ComplexArray, f: Callable[[ComplexArray], FloatArray]) -> float:
    """Least value of f(L) over frequency."""
    values = np.asarray(f(L))
    i = int(np.argmin(values))
    if not math.isfinite(float(values[i])):
        return math.inf
    high = 10.0 * float(values[i])  # in place of infinite
    w = _nearest_least(omega, i, lambda w: min(float(f(loop.response(np.array([w])))[0]), high))
    return min(float(values[i]), float(f(loop.response(np.array([w])))[0]))


def _nearest_least(omega: FloatArray, i: int, f: Callable[[float], float]) -> float:
    """The least of f between the neighbours of the grid's least."""
    bounds = (omega[max(i - 1, 0)], omega[min(i + 1, len(omega) - 1)])
    minimum = scipy.optimize.minimize_scalar(
        f, bounds=bounds, method="bounded", options={"xatol": 1e-12 * float(omega[i])}
    )
    return float(minimum.x) if minimum.fun <= f(float(omega[i])) else float(omega[i])


def _phase_breaks(L: ComplexArray, phase_margin: float) -> FloatArray:
    """Gain that puts each frequency on the unit circle where that breaks the phase margin, else infinite."""
    size = np.abs(L)
    inside = (np.abs(np.angle(-L)) < phase_margin) & (size > 0.0)
    return np.where(inside, 1.0 / np.where(inside, size, 1.0), np.inf)


def _sensitivity_breaks(L: ComplexArray, M_s: float) -> FloatArray:
    """Least gain with |1 + K L| = 1/M_s at each frequency, infinite where there is none."""
    size, real = np.abs(L) ** 2, L.real
    inside = real**2 - size * (1.0 - M_s**-2)
    hit = (real < 0.0) & (inside >= 0.0) & (size > 0.0)
    return np.where(hit, (-real - np.sqrt(np.maximum(inside, 0.0))) / np.where(hit, size, 1.0), np.inf)


class StableGains(NamedTuple):
    """The loop dies out for low < K_p < high [1/m]; omega_c its frequency at `high` [rad/s]. high is 0 where no gain
    stabilises it, low above 0 where it oscillates without feedback and a gain ends that."""

    low: float
    high: float
    omega_c: float

    @property
    def any(self) -> bool:
        """Whether any gain stabilises the loop."""
        return self.high > 0.0

    @property
    def alone(self) -> bool:
        """Whether the loop oscillates without feedback."""
        return self.low > 0.0 or not self.any

    def holds(self, K_p: float) -> bool:
        """Whether the loop dies out at a gain [1/m]."""
        return self.low < K_p < self.high


def stable_gains(loop: SampledLoop) -> StableGains:
    """The lowest range of gains at which a loop dies out, by crossings of the negative real axis (Nyquist) and the
    closed loop's poles between them.

    Source: Astrom and Murray, Feedback Systems, section 9.3 (conditional stability).
    """
    alone = grows_alone(loop)
    omega, L = grid_response(loop)
    if alone is None and loop.remembered is None:
        return StableGains(0.0, *gain_and_frequency(loop, omega, L))
    at = _crossings(loop, omega, L)
    edges = [0.0, *(K for K, _ in at), math.inf]
    frequency = dict(at) | {math.inf: math.inf}
    for low, high in pairwise(edges):
        if is_stable(loop, _between(low, high)):
            return StableGains(low, high, frequency[high])
    return StableGains(0.0, 0.0, math.nan if alone is None else alone)


def _crossings(loop: SampledLoop, omega: np.ndarray, L: np.ndarray) -> list[tuple[float, float]]:
    """Gains at which the response passes -1, rising, with their frequencies; the Nyquist frequency among them."""
    brackets = np.nonzero(
        (np.signbit(L.imag[:-1]) != np.signbit(L.imag[1:])) & (np.minimum(L.real[:-1], L.real[1:]) < 0)
    )
    result = []
    for i in brackets[0]:
        w = root_between(lambda w: at_frequency(loop, w).imag, omega[i], omega[i + 1])
        result.append((at_frequency(loop, w).real, w))
    result.append((float(L.real[-1]), float(omega[-1])))
    return sorted((-1.0 / x, w) for x, w in result if x < 0.0)


def _between(low: float, high: float) -> float:
    """A gain in a range [1/m]."""
    if math.isinf(high):
        return 2.0 * low if low > 0.0 else 1.0
    return 0.5 * high if low == 0.0 else math.sqrt(low * high)
