"""Motions as text that a file keeps, and made larger or smaller."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from stillhook.base.gateway.parse import from_json
from stillhook.errors import MotionError, UnreadableError
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion, Profile, Ramped, Sine, Still, Sum
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.heave_filter import FilteredTip
from stillhook.sea.vessel.vessel_tip import VesselTip
from stillhook.units import quote

SPACING = 0.01
"""Of the samples among which the highest speed is looked for [s]: a sine of 6 s is then met within 1e-5 of its peak."""


def motion_to_json(motion: Motion) -> str:
    """The motion as one line of JSON, for an attribute of a stored run; exact, floats and all."""
    return json.dumps(motion.to_dict(), allow_nan=False)


def motion_from_json(text: str) -> Motion:
    """The motion that `motion_to_json` stored."""
    try:
        data = from_json(text)
    except UnreadableError:
        raise MotionError(f"stored motion: {quote(text)} is not JSON. Simulate again to store it again.") from None
    return motion_from_dict(data)


def motion_from_dict(data: Mapping[str, Any]) -> Motion:
    """The motion whose `to_dict` gave this; the numbers are SI."""
    if not isinstance(data, Mapping):
        raise MotionError(f"stored motion: {quote(data)} is not a table of type and numbers. Simulate again.")
    try:
        match data.get("type"):
            case "still":
                return Still()
            case "sine":
                return Sine.from_si(data["amplitude"], data["period"], data["phase"], where="stored motion")
            case "sum":
                return Sum(motion_from_dict(term) for term in data["terms"])
            case "profile":
                return Profile.from_si(data["t"], data["v"])
            case "ramped":
                return Ramped.from_si(motion_from_dict(data["motion"]), data["t_ramp"])
            case "recorded":
                return Recorded.from_dict(dict(data))
            case "irregular":
                return IrregularTip.from_dict(dict(data))
            case "filtered":
                return FilteredTip.from_dict(dict(data), motion_from_dict)
            case "vessel":
                return VesselTip.from_dict(dict(data), motion_from_dict)
    except (KeyError, TypeError, ValueError, OverflowError) as problem:
        wrong = f"type {quote(data.get('type'))} lacks or misstates {quote(str(problem))}"
        raise MotionError(f"stored motion: {wrong}. Simulate again.") from problem
    types = ", ".join(
        cls.kind for cls in (Still, Sine, Sum, Profile, Ramped, Recorded, IrregularTip, FilteredTip, VesselTip)
    )
    raise MotionError(f"stored motion: type {quote(data.get('type'))} is not one of {types}.")


def scaled(motion: Motion, factor: float) -> Motion:
    """The motion with height, velocity and acceleration times `factor` (0 or more). Errors: MotionError."""
    match motion:
        case Sine():
            size = motion.amplitude * factor
            return Sine.from_si(size, motion.period, motion.phase, where=f"{motion.describe()}, scaled")
        case Sum():
            return Sum(scaled(term, factor) for term in motion.terms)
        case Profile():
            return Profile.from_si(motion.t, [v * factor for v in motion.v])
        case Ramped():
            return Ramped.from_si(scaled(motion.motion, factor), motion.t_ramp)
        case Recorded():
            report = f"{motion.report} Scaled by {factor:.6g}."
            return Recorded(motion.times, motion.heights * factor, source=motion.source, report=report)
        case IrregularTip():
            return motion.times(factor)
        case Still():
            raise MotionError('A stationary tip has no size to be scaled. Give a motion such as "sine 2.8 m 12 s".')
    raise MotionError(f"{type(motion).__name__}: has no size to be scaled. Give sines, a profile or a record.")


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
        problem = f"is stationary from {start:g} s to {end:g} s"
        raise MotionError(f"{motion.describe()}: {problem}, so it cannot be brought to a speed.")
    return scaled(motion, v_peak / peak)
