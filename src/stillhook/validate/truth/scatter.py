"""Which truth a seed stands for: truth plant, sensors and clock, drawn within a believable scatter around the twin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.engine.truth import Truth
from stillhook.io.instruments import Calibration, Clock

STATED_DELAY = 0.04
"""Delay of the motion unit that a campaign states [s]."""
APART = (0.1, 0.3)
"""By how much C_h, leakage and inertia lie off where a truth is drawn apart from its twin."""
EVEN = {
    "capacitance": 0.03, "leakage": 0.05, "inertia": 0.03, "motor_omega": 0.06, "motor_zeta": 0.08, "motor_D": 0.003,
    "pump_omega": 0.05, "pump_zeta": 0.06, "pump_speed": 0.003, "passive": 0.005, "cell_gain": 0.004,
}  # fmt: skip
"""Half width of the even distribution around 1 of factors over the twin's numbers (assumed: see `Truth`)."""
FRICTION = 0.08
"""The same of the mean friction (assumed: oil, wear and sheaves of one crane against those of the crane that friction is from)."""
RANGES = {
    "motor_hysteresis": (0.004, 0.015), "pump_late": (2e-3, 8e-3), "slip": (0.006, 0.012), "line_split": (0.35, 0.6),
    "line_omega": (120.0, 260.0), "line_drop": (0.8e5, 2.0e5), "tau_cell": (0.05, 0.15), "wire_zeta": (0.3, 0.6), "bristle": (0.5, 1.5),
    "friction_difference": (0.05, 0.12), "uneven": (-0.04, 0.04), "stribeck": (1.0, 2.0), "friction_lag": (0.01, 0.05),
    "oil_swing": (0.5, 2.5), "oil_phase": (0.0, 2.0 * np.pi),
}  # fmt: skip
"""Ranges of the other numbers."""
GAINS = {"p_a": 0.003, "p_b": 0.003, "p_hp": 0.003, "alpha_p": 0.003, "alpha_pm": 0.003}
"""Half width of the calibration error of a sensor, part of the reading (assumed: class of a transmitter)."""


@dataclass(frozen=True)
class LogFaults:
    """What the logger gets wrong: swapped 1 where the pressure lines are; gap of so many seconds in the middle of the longest log;
    cell_unit value of the unit that the load cell is really logged in over the one that is stated."""

    swapped: float = 0.0
    gap: float = 0.0
    cell_unit: float = 1.0


@dataclass(frozen=True)
class Setting:
    """All that is behind a campaign's logs: truth of the crane; delay of the motion unit [s] and the one that the campaign states; clock,
    calibration and faults of the logger."""

    truth: Truth
    delay: float
    clock: Clock
    calibration: Mapping[str, Calibration] = field(default_factory=dict)
    faults: LogFaults = LogFaults()
    stated_delay: float = STATED_DELAY


def setting(seed: int, *, apart: bool = False) -> Setting:
    """The truth of a seed: every seed is another crane that its twin matches well. apart: C_h, leakage and inertia lie 10 to 30 % off."""
    rng = np.random.default_rng([seed, 0])
    drawn = {name: 1.0 + half * rng.uniform(-1.0, 1.0) for name, half in EVEN.items()}
    drawn |= {name: rng.uniform(lo, hi) for name, (lo, hi) in RANGES.items()}
    drawn |= {name: rng.uniform(-1.0, 1.0) for name in ("shape_load", "shape_viscous")}
    drawn["shape_stribeck"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)
    truth = Truth(**{name: float(x) for name, x in drawn.items()})
    calibration = {name: Calibration(1.0 + half * float(rng.uniform(-1.0, 1.0))) for name, half in GAINS.items()}
    clock = Clock(drift=2e-5 * float(rng.uniform(-1.0, 1.0)), jitter=1e-3 * float(rng.uniform(0.5, 2.0)))
    delay = STATED_DELAY + 5e-3 * float(rng.uniform(-1.0, 1.0))
    truth = replace(truth, friction=1.0 + FRICTION * float(rng.uniform(-1.0, 1.0)))
    if apart:
        truth = replace(truth, **{n: _apart(rng) for n in ("capacitance", "leakage", "inertia")})
    return Setting(truth, delay, clock, calibration)


def _apart(rng: np.random.Generator) -> float:
    off = float(rng.uniform(*APART))
    return 1.0 + off if rng.random() < 0.5 else 1.0 - off
