"""What a sample is described by: eight terms of physics, in which the first part of the model is linear, and seven
conditions, on which the second part and the veto depend.

None holds a pressure difference, and the force only as a mean over a minute: with the torque of the moment among them,
a model would learn the balance that it is judged by.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.residual.samples import Samples
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane

TERMS = (
    "friction at any speed",
    "breaking away, as it fades in the crane file",
    "viscous",
    "with the root of the speed",
    "viscous, with warming oil",
    "with the load",
    "with the displacement of the active motors",
    "with acceleration",
)
CONDITIONS = ("speed", "acceleration", "load", "alpha_m", "alpha_pm", "layer", "warm")
SPEED = RATE = 100.0
"""Speed [rad/s] and its rate [rad/s^2] that terms and conditions are in parts of."""


class Scales(NamedTuple):
    """Of one crane: force of the SWL [N]; speed over which breaking away fades [rad/s]; layers of the drum."""

    F: float
    fading: float
    layers: float

    @classmethod
    def of(cls, crane: Crane) -> Scales:
        """Those of a crane."""
        return cls((crane.SWL + crane.hook_mass) * G, crane.friction.system.Y_4, float(crane.drum.layers))


def terms(x: Samples, scales: Scales) -> FloatArray:
    """The terms (n, 8), hoisting positive."""
    sign, speed = side(x), np.abs(x.omega)
    columns = (
        sign,
        sign * np.exp(-speed / scales.fading),
        x.omega / SPEED,
        sign * np.sqrt(speed / SPEED),
        x.omega / SPEED * x.warm,
        sign * x.F / scales.F,
        sign * x.alpha_m,
        x.rate / RATE,
    )
    return np.column_stack(columns)


def side(x: Samples) -> FloatArray:
    """Direction of the motion (n,), 1 hoisting: a torque times it is a loss where friction opposes motion [-]."""
    return np.where(x.omega < 0.0, -1.0, 1.0)


def conditions(x: Samples, scales: Scales) -> FloatArray:
    """The conditions (n, 7): the same hoisting and lowering."""
    columns = (
        np.abs(x.omega) / SPEED,
        side(x) * x.rate / RATE,
        x.F / scales.F,
        x.alpha_m,
        x.alpha_pm,
        x.layer / scales.layers,
        x.warm,
    )
    return np.column_stack(columns)
