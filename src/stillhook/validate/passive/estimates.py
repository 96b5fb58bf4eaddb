"""Estimates of the passive circuit from the logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from stillhook.base.progress import Meter
from stillhook.validate.parameters.segments import LogPart
from stillhook.validate.passive.gas import Curve, Displacement, Level, Stroke, curve, displacement, levels, stroke
from stillhook.validate.passive.orders import MakeUp, Setting, make_up, setting
from stillhook.validate.passive.torque import Share, shares


@dataclass(frozen=True)
class PassiveEstimates:
    """Results of every check of step 6; empty or None where the log has no data for it."""

    parts: tuple[LogPart, ...]
    level: Level | None
    gas: Curve | None
    stroke: Stroke | None
    displacement: Displacement | None
    shares: tuple[Share, ...]
    setting: Setting | None
    make_up: MakeUp | None


def passive_estimates(parts: Sequence[LogPart], progress: Callable[[float], None]) -> PassiveEstimates:
    """Take every check on the parts."""
    meter = Meter(4.0, progress)
    parts = tuple(parts)
    level, gas = levels(parts), curve(parts)
    meter.part(1.0)(1.0)
    piston, moved = stroke(parts, gas), displacement(parts)
    meter.part(1.0)(1.0)
    motors = shares(parts)
    meter.part(1.0)(1.0)
    return PassiveEstimates(parts, level, gas, piston, moved, motors, setting(parts), make_up(parts))
