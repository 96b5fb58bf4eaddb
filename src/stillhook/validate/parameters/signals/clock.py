"""Time scale and calibration of speeds: lengths against integrals of speeds, for wire and tip; jumps from hidden
gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.statistics.estimate import Estimate
from stillhook.statistics.jackknife_regression import one_number, pooled
from stillhook.units import show
from stillhook.validate.parameters.segments import LogPart, by_test
from stillhook.validate.parameters.slopes import Slope, integral, later, slope, smoothed

DOUBT = {"v_w": 0.003, "v_tip": 0.0005, "a_tip": 0.003}
"""Calibration uncertainty of a rate [-]: a motion unit computes position and speed from the same samples, a
wire speed comes from a pick-up or a tachometer of its own, an acceleration is filtered."""
LEAST_MOTION = 0.1
"""Smallest scatter of the moves in a window from which a calibration can be determined [m]: noise of some millimetres
then biases nothing."""
LEAST_MOTION_V = 0.05
"""The same for a speed against an acceleration [m/s]."""
ASIDE = 0.3
"""Time over which a jump is detected [s]: longer than irregular sampling of a log, shorter than any wave."""


@dataclass(frozen=True)
class Ratio:
    """A length (or speed) against the integral of its rate. name: that of the rate; error: the change of the length
    over that integral, less 1, over all tests; tests: the same by test; lag: of the length behind the integral [s]."""

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


PAIRS: Mapping[str, tuple[str, str, float, float]] = {
    "v_w": ("s_w", "wire", -1.0, LEAST_MOTION),
    "v_tip": ("s_tip", "tip", 1.0, LEAST_MOTION),
    "a_tip": ("v_tip", "tip", 1.0, LEAST_MOTION_V),
}
"""Rate to what it is the rate of, of whom, its sign, and the least motion."""


def ratios(parts: Sequence[LogPart]) -> dict[str, Ratio]:
    """Every length against its rate, where both were logged and moved."""
    out = {}
    for rate, (length, _, sign, least) in PAIRS.items():
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
    """error: rate error of the time stamps, positive if fast [-], None where the log cannot distinguish it from a
    calibration; calibration: by name of the rate, its gain error once the clock is corrected [-]; note: explanation in
    words."""

    error: Estimate | None
    calibration: Mapping[str, Estimate]
    note: str


def clock_of(rate_ratios: Mapping[str, Ratio]) -> Clock:
    """Clock or calibration: an error common to all ratios is the clock, an error of one alone is its calibration.

    Stamps that run too fast by e make every integral too large by it, and every ratio 1 / (1 + e).
    """
    fast = {
        name: Estimate.around(1.0 / (1.0 + r.error.value) - 1.0, r.error.half, r.error.n)
        for name, r in rate_ratios.items()
    }
    if len(fast) < 2:
        note = (
            "one speed alone cannot distinguish clock drift from its own calibration: log v_w and v_tip together with"
            " s_w and"
            " s_tip"
        )
        return Clock(None, fast, note)
    group = _largest_group(fast)
    if len(group) < 2:
        note = (
            f"{' and '.join(fast)} each deviate from the derivative of their length by different amounts:"
            " calibrations, not the"
            " clock"
        )
        return Clock(None, fast, note)
    error = one_number([_doubted(name, fast[name]) for name in group])
    rest = {
        name: Estimate.around(e.value - error.value, float(np.hypot(e.half, error.half))) for name, e in fast.items()
    }
    return Clock(error, rest, f"{' and '.join(group)} agree on it")


def _largest_group(fast: Mapping[str, Estimate]) -> list[str]:
    """The largest group of ratios that may be one number; of equal ones, the one nearer to zero."""
    groups, doubted = [], {name: _doubted(name, e) for name, e in fast.items()}
    for centre in doubted.values():
        near = [name for name, e in doubted.items() if abs(e.value - centre.value) <= np.hypot(e.half, centre.half)]
        groups.append((len(near), -abs(centre.value), near))
    return max(groups)[2]


def _doubted(name: str, e: Estimate) -> Estimate:
    """A ratio with the doubt of its calibration in its interval."""
    return Estimate.around(e.value, float(np.hypot(e.half, DOUBT[name])), e.n)


def largest_jump(parts: Sequence[LogPart], rate_ratios: Mapping[str, Ratio]) -> Jump | None:
    """The largest step of wire out or tip position against the integral of its speed; None where there is no such
    pair."""
    jumps = [
        _jump(part, rate, rate_ratios[rate])
        for rate in ("v_w", "v_tip")
        if rate in rate_ratios
        for part in parts
        if part.has(rate, PAIRS[rate][0])
    ]
    return max(jumps, key=lambda j: j.size, default=None)


def _jump(part: LogPart, rate: str, ratio: Ratio) -> Jump:
    length, _, sign, _ = PAIRS[rate]
    moved = later(integral(part[rate], part.step), part.step, ratio.lag)
    rest = smoothed(sign * part[length] - (1.0 + ratio.error.value) * moved, part.step)
    n = max(1, round(ASIDE / part.step))
    steps = np.abs(rest[n:] - rest[:-n])
    if not np.isfinite(steps).any():
        return Jump(0.0, part.test, part.segment.start, length)
    i = int(np.nanargmax(steps))
    return Jump(float(steps[i]), part.test, part.segment.start + (i + 0.5 * n) * part.step, length)


def jump_says(jump: Jump) -> str:
    """A jump in words."""
    return (
        f"{jump.name} jumps by {show(jump.size, 'length', 2)} at {jump.at:.1f} s of {jump.test}, which its speed does"
        " not explain"
    )
