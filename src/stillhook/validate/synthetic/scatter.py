"""Which truth a seed stands for: truth plant, sensors and clock, drawn within a believable scatter around the twin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.logs.synthetic import Calibration, Clock
from stillhook.validate.synthetic.reference.crane import ReferenceCrane

STATED_DELAY = 0.04
"""Delay of the motion unit that a campaign states [s]."""
APART = (0.1, 0.3)
"""By how much C_h, leakage and inertia lie off where a truth is drawn apart from its twin."""
EVEN = {
    "capacitance": 0.03,
    "leakage": 0.05,
    "inertia": 0.03,
    "motor_omega": 0.06,
    "motor_zeta": 0.08,
    "pump_omega": 0.05,
    "pump_zeta": 0.06,
    "pump_speed": 0.003,
    "cell_gain": 0.004,
    "precharge": 0.01,
    "gas_volume": 0.05,
    "piston_oil": 0.3,
    "p_low": 0.05,
    "boost": 0.03,
}
"""Half width of the even distribution around 1 of factors over the twin's numbers (assumed: see `ReferenceCrane`)."""
FRICTION = 0.05
"""The same of the mean friction (assumed: what oil and wear change on a crane whose friction was identified)."""
MOTOR = 0.004
"""Standard deviation of one motor's displacement, part of nominal, and of three times that the most (assumed: sorted
units of one type)."""
RANGES = {
    "motor_hysteresis": (0.004, 0.015),
    "pump_late": (2e-3, 8e-3),
    "slip": (0.006, 0.012),
    "line_split": (0.35, 0.6),
    "line_omega": (120.0, 260.0),
    "line_drop": (0.8e5, 2.0e5),
    "tau_cell": (0.05, 0.15),
    "wire_zeta": (0.3, 0.6),
    "bristle": (0.5, 1.5),
    "friction_difference": (0.05, 0.12),
    "uneven": (-0.04, 0.04),
    "stribeck": (1.0, 2.0),
    "friction_lag": (0.01, 0.05),
    "oil_swing": (1.0, 4.0),
    "oil_phase": (0.0, 2.0 * np.pi),
    "gas_T": (283.0, 303.0),
    "gas_tau": (60.0, 300.0),
    "piston_dry": (1e5, 3e5),
    "p_low_rise": (0.0, 2e5),
    "leak_stroke": (0.05, 0.15),
    "leak_speed": (0.05, 0.15),
    "leak_edges": (0.0, 0.1),
    "leak_across": (0.6, 0.72),
    "p_case": (0.0, 2e5),
    "cell_zero": (-2e3, 2e3),
    "wire_beta": (10.0, 30.0),
    "wire_strands": (0.005, 0.02),
    "wire_pressed": (0.0, 0.015),
}
"""Ranges of the other numbers. The leak rises about as fast with stroke and speed as in published tables (0.11 and
0.10): a crane whose file is right leaks at the file's point, four times the stroke of these tests, what the file says,
to some 15 %."""
BITS = (12.0, 13.0, 14.0)
"""Resolutions of a PLC's outputs."""
CLOCK = 1e-4
"""Half width of the drift of the log's clock (assumed: a quartz, 100 parts in a million)."""
DRIFT, PERIODS = 0.3e5, (900.0, 3600.0)
"""Amplitude of the slow zero drift of a pressure transmitter [Pa], and between what periods it lies [s] (assumed: 0.1 %
of its range, as deck and oil warm up)."""
TRANSMITTERS = ("p_a", "p_b", "p_hp")
GAINS = {"p_a": 0.003, "p_b": 0.003, "p_hp": 0.003, "alpha_p": 0.003, "alpha_pm": 0.003}
"""Half width of the calibration error of a sensor, part of the reading (assumed: class of a transmitter)."""


@dataclass(frozen=True)
class LogFaults:
    """What the logger gets wrong: swapped 1 where the pressure lines are; gap of so many seconds in the middle of the
    longest log; cell_unit value of the unit that the load cell is really logged in over the one that is stated; zero_a
    what the transmitter of line A shows without pressure [Pa]."""

    swapped: float = 0.0
    gap: float = 0.0
    cell_unit: float = 1.0
    zero_a: float = 0.0


@dataclass(frozen=True)
class Drift:
    """Slow swing of a sensor's zero over the whole campaign: size [SI], period [s], phase [rad]."""

    size: float
    period: float
    phase: float

    def at(self, t: FloatArray) -> FloatArray:
        """What the sensor shows too much at times t (n,) since the campaign began [s]."""
        return np.asarray(self.size * np.sin(2.0 * np.pi * t / self.period + self.phase))


@dataclass(frozen=True)
class Setting:
    """Origin of a campaign's logs: reference crane; delay of the motion unit [s] and the one that the
    campaign states; clock, calibration, drift of zeros and faults of the logger."""

    reference: ReferenceCrane
    delay: float
    clock: Clock
    calibration: Mapping[str, Calibration] = field(default_factory=dict)
    drift: Mapping[str, Drift] = field(default_factory=dict)
    faults: LogFaults = LogFaults()
    stated_delay: float = STATED_DELAY


def setting(seed: int, *, apart: bool = False, motors: int = 5, passive_motors: int = 16) -> Setting:
    """The reference crane of a seed: every seed is another crane that its twin matches well. apart: C_h, leakage and
    inertia deviate by 10 to 30 %. motors, passive_motors: how many of them there are, each with a displacement of its
    own; on one shaft only their sum counts.
    """
    rng = np.random.default_rng([seed, 0])
    numbers = {name: 1.0 + half * rng.uniform(-1.0, 1.0) for name, half in EVEN.items()}
    numbers |= {name: rng.uniform(lo, hi) for name, (lo, hi) in RANGES.items()}
    numbers |= {name: rng.uniform(-1.0, 1.0) for name in ("shape_load", "shape_viscous")}
    numbers["shape_stribeck"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)
    numbers |= {
        "motor_D": _mean_of(motors, rng),
        "passive": _mean_of(passive_motors, rng),
        "dac_bits": rng.choice(BITS),
    }
    reference = ReferenceCrane(**{name: float(x) for name, x in numbers.items()})
    calibration = {name: Calibration(1.0 + half * float(rng.uniform(-1.0, 1.0))) for name, half in GAINS.items()}
    clock = Clock(drift=CLOCK * float(rng.uniform(-1.0, 1.0)), jitter=1e-3 * float(rng.uniform(0.5, 2.0)))
    delay = STATED_DELAY + 5e-3 * float(rng.uniform(-1.0, 1.0))
    reference = replace(reference, friction=1.0 + FRICTION * float(rng.uniform(-1.0, 1.0)))
    drift = {
        name: Drift(DRIFT, float(rng.uniform(*PERIODS)), float(rng.uniform(0.0, 2.0 * np.pi))) for name in TRANSMITTERS
    }
    if apart:
        reference = replace(reference, **{n: _apart(rng) for n in ("capacitance", "leakage", "inertia")})
    return Setting(reference, delay, clock, calibration, drift)


def _mean_of(motors: int, rng: np.random.Generator) -> float:
    """Mean displacement of so many motors over nominal."""
    return 1.0 + MOTOR * float(np.clip(rng.standard_normal(motors), -3.0, 3.0).mean())


def _apart(rng: np.random.Generator) -> float:
    off = float(rng.uniform(*APART))
    return 1.0 + off if rng.random() < 0.5 else 1.0 - off
