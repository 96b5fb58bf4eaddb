"""A motion made larger or smaller: the same times, heights in proportion."""

from __future__ import annotations

import numpy as np

from stillhook.errors import MotionError
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion, Profile, Ramped, Sine, Still, Sum
from stillhook.sea.motion.recorded import Recorded

SPACING = 0.01
"""Of the samples among which the highest speed is looked for [s]: a sine of 6 s is then met within 1e-5 of its peak."""


def scaled(motion: Motion, factor: float) -> Motion:
    """The motion with height, velocity and acceleration times `factor` (0 or more). Errors: MotionError for a motion
    without a size."""
    match motion:
        case Sine():
            return Sine.from_si(
                motion.amplitude * factor, motion.period, motion.phase, where=f"{motion.describe()}, scaled"
            )
        case Sum():
            return Sum(scaled(term, factor) for term in motion.terms)
        case Profile():
            return Profile.from_si(motion.t, [v * factor for v in motion.v])
        case Ramped():
            return Ramped.from_si(scaled(motion.motion, factor), motion.t_ramp)
        case Recorded():
            return Recorded(
                motion.times,
                motion.heights * factor,
                source=motion.source,
                report=f"{motion.report} Scaled by {factor:.6g}.",
            )
        case IrregularTip():
            return motion.times(factor)
        case Still():
            raise MotionError(
                'A tip that is stationary has no size to be scaled. Give a motion such as "sine 2.8 m 12 s".'
            )
    raise MotionError(
        f"{type(motion).__name__}: no rule for making this motion larger. Give sines, a profile or a record."
    )


def speed_peak(motion: Motion, start: float, end: float) -> float:
    """Highest magnitude of the tip's speed between start and end [s], among samples every 10 ms [m/s]."""
    _, v, _ = motion.sample(np.linspace(start, end, max(2, round((end - start) / SPACING) + 1)))
    return float(np.max(np.abs(v)))


def scaled_to(motion: Motion, v_peak: float, start: float, end: float) -> Motion:
    """The motion so large that its highest speed between start and end [s] is v_peak [m/s]; times and proportions stay.

    Errors: MotionError for a motion that does not move there.
    """
    peak = speed_peak(motion, start, end)
    if peak <= 0.0:
        raise MotionError(
            f"{motion.describe()}: is stationary from {start:g} s to {end:g} s, so it cannot be brought to a speed."
        )
    return scaled(motion, v_peak / peak)
