"""Clock, calibration and delay of the logged signals, and which tip motion the PLC uses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.physics.load_path.drum import wire_damping, wire_stiffness
from stillhook.statistics.blocks import Fit, fit, one_number, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.time_lag import dot
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.record import filled
from stillhook.validate.parameters.segments import (
    ByTest,
    LogPart,
    Slope,
    bridged,
    by_test,
    fits,
    integral,
    later,
    slope,
    smoothed,
    stacked,
)

DOUBT = {"v_w": 0.003, "v_tip": 0.0005, "a_tip": 0.003}
"""Calibration uncertainty of a rate [-]: a motion unit computes position and speed from the same samples, a
wire speed comes from a separate pick-up or tachometer, an acceleration is filtered."""
LEAST_MOTION = 0.1
"""Smallest scatter of the moves in a window from which a calibration can be determined [m]: noise of some millimetres
then biases nothing."""
LEAST_MOTION_V = 0.05
"""The same for a speed against an acceleration [m/s]."""
ASIDE = 0.3
"""Time over which a jump is detected [s]: longer than irregular sampling of a log, shorter than any wave."""


@dataclass(frozen=True)
class Ratio:
    """A length (or speed) against the integral of its rate `name`. error: change of the length over that integral, less
    1; lag: of the length behind it [s]."""

    name: str
    error: Estimate
    tests: Mapping[str, Estimate]
    lag: float


@dataclass(frozen=True)
class Jump:
    """The largest step of a length that its speed does not explain: size [m], test, moment [s from the start of the
    record]."""

    size: float
    test: str
    at: float
    name: str


PAIRS: Mapping[str, tuple[str, float, float]] = {
    "v_w": ("s_w", -1.0, LEAST_MOTION),
    "v_tip": ("s_tip", 1.0, LEAST_MOTION),
    "a_tip": ("v_tip", 1.0, LEAST_MOTION_V),
}
"""Rate to what it is the rate of, its sign, and the least motion."""


def ratios(parts: Sequence[LogPart]) -> dict[str, Ratio]:
    """Every length against its rate, where both were logged and moved."""
    out = {}
    for rate, (length, sign, least) in PAIRS.items():
        slopes: dict[str, Slope] = {}
        for test, same in by_test([p for p in parts if p.has(rate, length)]).items():
            s = slope(same, [(integral(p[rate], p.step), sign * p[length]) for p in same])
            if s is not None and np.nanstd(s.x) >= least:
                slopes[test] = s
        if slopes:
            tests = {test: Estimate.around(s.value - 1.0, s.half, s.fit.blocks) for test, s in slopes.items()}
            lag = float(np.median([s.lag for s in slopes.values()]))
            out[rate] = Ratio(rate, pooled(list(tests.values())), tests, lag)
    return out


@dataclass(frozen=True)
class Clock:
    """error: rate error of the time stamps, positive if fast [-], None where not distinguished from a calibration;
    calibration: gain error of each rate once the clock is corrected [-]; note: why."""

    error: Estimate | None
    calibration: Mapping[str, Estimate]
    note: Note


def clock_of(rate_ratios: Mapping[str, Ratio]) -> Clock:
    """Clock or calibration: an error common to all ratios is the clock, an error of one alone is its calibration.

    Stamps that run too fast by e make every integral too large by it, and every ratio 1 / (1 + e).
    """
    fast = {
        name: Estimate.around(1.0 / (1.0 + r.error.value) - 1.0, r.error.half, r.error.n)
        for name, r in rate_ratios.items()
    }
    if len(fast) < 2:
        return Clock(None, fast, Note("one-speed"))
    doubted = {name: Estimate.around(e.value, float(np.hypot(e.half, DOUBT[name])), e.n) for name, e in fast.items()}
    group = _largest_group(doubted)
    if len(group) < 2:
        return Clock(None, fast, Note("calibrations", rates=list(fast)))
    error = one_number([doubted[name] for name in group])
    rest = {
        name: Estimate.around(e.value - error.value, float(np.hypot(e.half, error.half))) for name, e in fast.items()
    }
    return Clock(error, rest, Note("clock-by", rates=group))


def _largest_group(ratios: Mapping[str, Estimate]) -> list[str]:
    """The largest group of ratios that may be one number; of equal ones, the one nearer to zero."""
    groups = []
    for centre in ratios.values():
        near = [name for name, e in ratios.items() if abs(e.value - centre.value) <= np.hypot(e.half, centre.half)]
        groups.append((len(near), -abs(centre.value), near))
    return max(groups)[2]


def largest_jump(parts: Sequence[LogPart], rate_ratios: Mapping[str, Ratio]) -> Jump | None:
    """The largest step of wire out or tip position against the integral of its speed; None without such a pair."""
    jumps = [
        _jump(part, rate, rate_ratios[rate])
        for rate in ("v_w", "v_tip")
        if rate in rate_ratios
        for part in parts
        if part.has(rate, PAIRS[rate][0])
    ]
    return max(jumps, key=lambda j: j.size, default=None)


def _jump(part: LogPart, rate: str, ratio: Ratio) -> Jump:
    length, sign, _ = PAIRS[rate]
    moved = later(integral(part[rate], part.step), part.step, ratio.lag)
    rest = smoothed(sign * part[length] - (1.0 + ratio.error.value) * moved, part.step)
    n = max(1, round(ASIDE / part.step))
    steps = np.abs(rest[n:] - rest[:-n])
    if not np.isfinite(steps).any():
        return Jump(0.0, part.test, part.segment.start, length)
    i = int(np.nanargmax(steps))
    return Jump(float(steps[i]), part.test, part.segment.start + (i + 0.5 * n) * part.step, length)


EVERY = 0.1
"""Spacing of the samples [s]."""
LOW = (0.04, 0.06)
"""Lower flank of the band [Hz]: below, load cells drift."""
HIGH = 0.25
"""Upper end of the band [Hz]: above, there is no sea."""
BELOW_RESONANCE = 0.6
"""Upper end of the band over the eigenfrequency of load and wire: nearer to it the unknown damping of the wire
dominates."""
FLANK = 1.3
EDGE = 15.0
"""Left out at both ends because of the filter [s]."""
LEAST_PP = 0.3
"""Least tip motion in a window from which the force can be evaluated [m]."""
TURN = 0.02
"""Wire speed over which the friction of sheaves reverses [m/s]."""
GAIN = 0.3
"""Uncertainty of the twin's wire and load [-]: added mass, mass of the wire, elasticity."""
SHAPE = 0.1
"""Relative uncertainty of a delay from the simple wire model and a filter of the load cell [-]."""
ROUNDS = 6
MOST = 1.0
"""Largest delay considered [s]."""
WIDEST = 0.06
"""Half width of an interval from which a delay is not reported [s]: 150 ms must be distinguished from zero with
margin."""

Spectrum = NDArray[np.complex128]


@dataclass(frozen=True)
class Sea:
    """A part in the band of the sea: measured force (n,) [N], spectra of the forces that tip and wire make, relative
    change of either by that of the wire's stiffness, direction of the wire (n,), w [rad/s], blocks, samples that
    count."""

    force: FloatArray
    tip: Spectrum
    wire: Spectrum
    by_stiffness: Spectrum
    way: FloatArray
    w: FloatArray
    block: IntArray
    inside: NDArray[np.bool_]

    def columns(self, delay: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """With the tip ahead by a time: force of the hook's motion, of the tip's speed (per s), and the first one's
        rate (n,)."""
        ahead = self.tip * np.exp(1j * self.w * delay)
        hook = ahead - self.wire
        spectra = (hook, 1j * self.w * ahead, 1j * self.w * hook)
        on_hook, of_speed, of_rate = (np.fft.irfft(x, len(self.way)) for x in spectra)
        return on_hook, of_speed, of_rate


def tip_delays(parts: Sequence[LogPart]) -> ByTest | None:
    """Delay of the logged tip behind the true one [s], of every test with heave compensation and a logged load cell."""
    tests = by_test(in_band(parts))
    delays = {test: d for test, same in tests.items() if (d := _delay([sea_of(p) for p in same])) is not None}
    return ByTest.of(delays)


def in_band(parts: Sequence[LogPart]) -> list[LogPart]:
    """The parts whose force may show the motion of tip and wire."""
    usable = [p for p in parts if compensates(p, LEAST_PP) and p.knows("F_w", "s_tip", "s_w")]
    return [p for p in usable if p.segment.duration > 4.0 * EDGE]


def compensates(part: LogPart, least_pp: float) -> bool:
    return part.segment.mode.compensates and part.segment.s_tip_pp >= least_pp


def sea_of(part: LogPart, stiffness: float = 1.0) -> Sea:
    """A part in the band of the sea; stiffness: of the wire over the twin's [-]."""
    from scipy.signal import detrend  # heavy: only where logs are checked

    n = max(1, round(EVERY / part.step))
    F, tip, wire = (smoothed(bridged(part[name], part.step), part.step, EVERY)[::n] for name in ("F_w", "s_tip", "s_w"))
    speed = -np.gradient(smoothed(bridged(part["s_w"], part.step), part.step, 5.0 * EVERY), part.step)[::n]
    t = part.t[::n]
    inside = (t > EDGE) & (t < t[-1] - EDGE) & np.isfinite(F) & np.isfinite(tip) & np.isfinite(wire)
    f = np.asarray(np.fft.rfftfreq(len(t), n * part.step), dtype=np.float64)
    response, by_stiffness, top = _response(part, f, stiffness)
    band = np.interp(f, (*LOW, top, FLANK * top), (0.0, 1.0, 1.0, 0.0), left=0.0, right=0.0)
    level = (detrend(filled(x)) for x in (F, tip, wire, np.tanh(speed / TURN)))
    F_band, s_tip, s_w, way_band = (np.fft.rfft(x) * band for x in level)
    force, way = (np.fft.irfft(x, len(t)) for x in (F_band, way_band))
    return Sea(force, s_tip * response, s_w * response, by_stiffness, way, 2.0 * math.pi * f, part.blocks(t), inside)


def _response(part: LogPart, f: FloatArray, stiffness: float) -> tuple[Spectrum, Spectrum, float]:
    """Force in the wire over the motion of its upper end [N/m], of spring, damper and mass; its relative change by that
    of the stiffness [-]; and the band's upper end [Hz]."""
    hoist, w = part.params.hoist, 2.0 * math.pi * f
    s_w = float(np.nanmean(part["s_w"]))
    twin_k, m = float(wire_stiffness(s_w, hoist.wire)), float(hoist.load.m)
    k = stiffness * twin_k
    pull = k + 1j * w * float(wire_damping(s_w, m, hoist.wire))
    top = min(HIGH, BELOW_RESONANCE * math.sqrt(twin_k / m) / (2.0 * math.pi))
    left = pull - m * w**2
    return -m * w**2 * pull / left, k / pull - k / left, max(top, 1.1 * LOW[1])


def _delay(seas: Sequence[Sea]) -> Estimate | None:
    """The better determined of two fits: with the gain of the force free, and with the twin's, its uncertainty
    included."""
    free, fixed = _fitted(seas, fixed_gain=False), _fitted(seas, fixed_gain=True)
    if free is None or fixed is None:
        return None
    (delay, fitted), (fixed_delay, fixed_fit) = free, fixed
    loose = Estimate.around(delay, fitted.ratio(1, 0)[1], fitted.blocks)
    half = math.hypot(fixed_fit.half(0), GAIN * abs(_leans(seas)))
    tight = Estimate.around(fixed_delay, half, fixed_fit.blocks)
    best = loose if fitted.b[0] > 0.0 and loose.half <= tight.half else tight
    return Estimate.around(best.value, math.hypot(best.half, SHAPE * best.value), best.n)


def _fitted(seas: Sequence[Sea], *, fixed_gain: bool) -> tuple[float, Fit] | None:
    """The delay at which the tip's speed explains no remaining force, with the fit there: gain (unless fixed) and gain
    times rest of the delay, next to friction of sheaves and a lag of the force."""
    delay, fitted = 0.0, None
    for _ in range(ROUNDS):
        hook, speed, rate, force, way, block = _columns(seas, delay)
        fitted = fit((speed, way), force - hook, block) if fixed_gain else fit((hook, speed, way, rate), force, block)
        if fitted is None:
            return None
        if not fixed_gain and fitted.b[0] <= 0.0:
            return delay, fitted
        delay = float(np.clip(delay + (fitted.b[0] if fixed_gain else fitted.b[1] / fitted.b[0]), -MOST, MOST))
    assert fitted is not None
    return delay, fitted


def _columns(seas: Sequence[Sea], delay: float) -> tuple[NDArray[Any], ...]:
    """`Sea.columns`, measured force, direction of the wire and block, of the samples that count."""
    return stacked([x[s.inside] for x in (*s.columns(delay), s.force, s.way, s.block)] for s in seas)


def _leans(seas: Sequence[Sea]) -> float:
    """Delay [s] that an error of the gain of the twin's force resembles, over that error."""
    hook, speed, *_ = _columns(seas, 0.0)
    return dot(hook, speed) / dot(speed, speed)


LEAST_TIP_PP = 0.2
"""Least tip motion in a window from which a lag can be determined [m]."""


@dataclass(frozen=True)
class Reference:
    """One test. lag: of the PLC's tip behind the logged one [s]; spread: standard deviation of the reference without it
    [m]."""

    test: str
    lag: Estimate
    spread: float


def references(parts: Sequence[LogPart]) -> tuple[Reference, ...]:
    """The PLC's reference e_c + s_w - s_tip (+ the wire requested by the operator) in every compensating test with its
    error: where the PLC works with the tip of a time ago, it moves by that time against the tip's speed. What a crane
    extrapolates by t_lead is taken out."""
    out = []
    usable = [p for p in parts if compensates(p, LEAST_TIP_PP) and p.has("e_c_measured", "s_w", "s_tip")]
    for f in fits(usable, _rows):
        half = f.fit.half(0) or math.nan  # a tip made from the reference fits without a residual: no interval
        out.append(Reference(f.test, Estimate.around(-float(f.fit.b[0]), half, f.fit.blocks), f.fit.sd))
    return tuple(out)


def _rows(part: LogPart) -> tuple[NDArray[Any], ...]:
    step, n = part.step, max(1, round(EVERY / part.step))
    requested = integral(part["v_op"], step) if part.has("v_op") else 0.0
    s_tip = bridged(part["s_tip"], step)
    v = smoothed(part["v_tip"] if part.has("v_tip") else np.gradient(smoothed(s_tip, step), step), step)
    lead = part.crane.control.t_lead or 0.0
    ahead = lead * (v + 0.5 * lead * np.gradient(v, step)) if lead else 0.0
    rest = smoothed(part["e_c_measured"] + part["s_w"] - s_tip + requested, step) - ahead
    use = np.isfinite(rest) & np.isfinite(v)
    centred = [np.where(use, x, np.nan) for x in (v, rest)]
    return (*((x - np.nanmean(x) if use.any() else x)[::n] for x in centred), part.blocks(part.t)[::n])
