"""A payload in a current: `payload`, and the current's part in its drag."""

from typing import NamedTuple

from stillhook.physics.load_path.payload import in_current
from stillhook.physics.scalar import scalar
from stillhook.winches.load_path.payload import LiftStats, Momentum, depth_ahead, fold_step, momentum, on_ground

__all__ = ["LiftStats", "Momentum", "depth_ahead", "fold_step", "in_current", "momentum", "on_ground"]

NAME = "current"


class Knot(NamedTuple):
    """A current from a depth h down [m]: speed U there [m/s], and slope of it to the next knot [1/s]."""

    h: float
    U: float
    slope: float


@scalar
def speed_at(h, knot):
    """Speed of the current at depth h [m], at or below a knot [m/s]."""
    return knot.U + knot.slope * (h - knot.h)
