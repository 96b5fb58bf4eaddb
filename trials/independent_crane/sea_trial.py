"""Tests at sea of the independent crane: what is done, the motion of the tip, the sensors, and a log with names and
units of its own.

What is a number of a sensor or of the log is assumed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trials.independent_crane.plant import Inputs, Log
from trials.independent_crane.plc import MANUAL, NS, SSC

FloatArray = NDArray[np.float64]
BAR = 1e5  # Pa
MINUTE = 60.0  # s
CYCLE = 0.01
"""Cycle of the PLC and of the log [s]."""
STATED_DELAY = 0.04
"""Delay of the motion unit that the campaign states [s]."""
MRU_S, MRU_V, MRU_A, MRU_DIGITS = 1e-3, 2e-3, 0.01, 3
"""Noise of the motion unit [m], [m/s], [m/s^2], and decimals of its position in m."""
WIRE_NOISE, WIRE_DIGITS, WIRE_SPEED_NOISE = 3e-4, 3, 3e-3  # m, decimals of a metre, m/s
FORCE_NOISE = 1500.0  # N
SPEED_NOISE, SPEED_PART = 0.1, 1e-3  # rad/s, part of the reading
PRESSURE_NOISE, SETTING_NOISE = 0.4 * BAR, 5e-4  # Pa, -
DRIFT, DRIFT_PERIODS, SHORTEST_DRIFT = 0.3 * BAR, 1.3, 200.0
"""Zero drift of a transmitter: amplitude [Pa], its period in lengths of the test, and the shortest period [s]."""
ADC = 4095
"""Steps of a transmitter of 12 bit."""
PRESSURE_RANGE, FORCE_RANGE = 400.0 * BAR, 4e6  # Pa, N
CLOCK = 5e-5
"""Part by which the log's clock runs fast."""


class Wave(NamedTuple):
    """Motion of the tip: largest height from trough to crest within WINDOW [m], peak period [s], and ramp at the start
    [s]."""

    height: float
    period: float
    ramp: float


class SeaTest(NamedTuple):
    """One test: name, kind as in a campaign file, load [kg], wire paid out [m], duration [s], mode; wave where the
    winch compensates."""

    name: str
    kind: str
    load: float
    s_w: float
    duration: float
    mode: float
    wave: Wave | None = None


TESTS = (
    SeaTest("A1", "ahc", 82e3, 487.0, 200.0, NS, Wave(1.6, 9.0, 10.0)),
    SeaTest("A2", "ahc", 94e3, 487.0, 1500.0, SSC, Wave(2.3, 10.0, 300.0)),
    SeaTest("A3", "ahc", 164e3, 2314.0, 200.0, SSC, Wave(2.1, 9.0, 10.0)),
    SeaTest("A4", "ahc", 162e3, 2281.0, 300.0, SSC, Wave(1.8, 10.0, 10.0)),
    SeaTest("V", "limits", 82e3, 500.0, 86.0, MANUAL),
    SeaTest("D", "dynamics", 0.0, 15.0, 88.0, MANUAL),
)
"""As paper F table 3 asks: heave compensation of four load cases, velocity limits, quick turns of the empty hook."""
COMPONENTS, LOWEST, HIGHEST = 60, 0.5, 2.2
"""Regular components of a sea, between these parts of the peak frequency."""
WINDOW, WINDOW_STEP = 30.0, 5.0
"""Length [s] of a window in which heights are measured, and how far it moves."""


def tip_motion(rng: np.random.Generator, n: int, wave: Wave) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position [m], speed [m/s] and acceleration [m/s^2] of the tip at n cycles: spectrum f^-5 exp(-1.25 (f T)^-4),
    random phases, with a ramp at the start."""
    t = np.arange(n) * CYCLE
    f = np.linspace(LOWEST / wave.period, HIGHEST / wave.period, COMPONENTS)
    A = np.sqrt((f * wave.period) ** -5 * np.exp(-1.25 * (f * wave.period) ** -4))
    phase = rng.uniform(0.0, 2.0 * np.pi, COMPONENTS)
    omega = 2.0 * np.pi * (f + rng.uniform(-0.5, 0.5, COMPONENTS) * (f[1] - f[0]))
    s, v, a = np.zeros((3, n))
    for w, size, start in zip(omega, A, phase, strict=True):
        s += size * np.cos(w * t + start)
        v -= size * w * np.sin(w * t + start)
        a -= size * w * w * np.cos(w * t + start)
    length, step = round(WINDOW / CYCLE), round(WINDOW_STEP / CYCLE)
    scale = wave.height / max(np.ptp(s[j : j + length]) for j in range(0, n - length, step))
    x = np.clip(t / wave.ramp, 0.0, 1.0)
    up, up_v = x * x * (3.0 - 2.0 * x), np.where(x < 1.0, 6.0 * x * (1.0 - x) / wave.ramp, 0.0)
    return scale * s * up, scale * (v * up + s * up_v), scale * (a * up + 2.0 * v * up_v)


def operator(test: SeaTest, full_speed: float) -> FloatArray:
    """The operator's speed at every cycle, hoisting positive [m/s]; full_speed of the winch with motors at full setting
    [m/s].

    Velocity limits: twice full hoisting and lowering at 2.3 times full_speed, more than the reduced motors reach.
    Dynamics: turns of 20 to 50 % of full_speed.
    """
    n = samples(test)
    if test.kind == "limits":
        once = [(3.0, 2.3), (12.0, 2.3), (3.0, 0.0), (3.0, 0.0), (3.0, -2.3), (12.0, -2.3), (3.0, 0.0), (3.0, 0.0)]
        legs = [(2.0, 0.0), *once, *once]
    elif test.kind == "dynamics":
        turns = [side * part for part in (0.2, 0.35, 0.5, 0.28) for side in (1.0, -1.0)]
        legs = [(3.0, 0.0), *(leg for v in turns for leg in ((0.3, v), (6.0, v), (0.3, 0.0), (4.0, 0.0)))]
    else:
        return np.zeros(n)
    times, speeds = np.cumsum([0.0, *(seconds for seconds, _ in legs)]), np.array([0.0, *(v for _, v in legs)])
    return np.asarray(np.interp(np.arange(n) * CYCLE, times, full_speed * speeds))


def samples(test: SeaTest) -> int:
    """Cycles of a test."""
    return round(test.duration / CYCLE) + 1


def inputs_of(test: SeaTest, full_speed: float, delay: float, rng: np.random.Generator) -> Inputs:
    """Tip, what the motion unit makes of it (late by delay [s], with noise), noise of wire counter and load cell, and
    the operator; full_speed of the winch with motors at full setting [m/s]."""
    n, late = samples(test), round(delay / CYCLE)
    tip = tip_motion(rng, n, test.wave) if test.wave else (np.zeros(n),) * 3
    s, v, a = (np.concatenate([np.repeat(x[:1], late), x[: n - late]]) for x in tip)
    noise = [size * rng.normal(size=n) for size in (MRU_S, MRU_V, MRU_A, WIRE_NOISE, FORCE_NOISE)]
    s_mru = np.round(s + noise[0], MRU_DIGITS)
    return Inputs(
        tip[0],
        tip[1],
        s_mru,
        v + noise[1],
        a + noise[2],
        noise[3],
        noise[4],
        operator(test, full_speed),
        np.full(n, test.mode),
    )


class Column(NamedTuple):
    """A column of the log: header, signal of `stillhook.variables`, unit, and number format."""

    header: str
    signal: str
    unit: str
    form: str


COLUMNS = (
    Column("Zeit", "time", "s", "%.4f"),
    Column("MRU_z", "s_tip", "cm", "%.1f"),
    Column("MRU_v", "v_tip", "m/min", "%.3f"),
    Column("MRU_a", "a_tip", "m/s^2", "%.4f"),
    Column("Seil", "s_w", "m", "%.3f"),
    Column("vSeil", "v_w", "m/min", "%.3f"),
    Column("nM", "omega_m", "rad/s", "%.4f"),
    Column("pA", "p_a", "MPa", "%.4f"),
    Column("pB", "p_b", "MPa", "%.4f"),
    Column("pHP", "p_hp", "MPa", "%.4f"),
    Column("Yp", "u_p", "1", "%.5f"),
    Column("Ym", "u_m", "1", "%.5f"),
    Column("aP", "alpha_p", "1", "%.4f"),
    Column("aM", "alpha_m", "1", "%.4f"),
    Column("aPM", "alpha_pm", "1", "%.4f"),
    Column("Zelle", "F_w", "kN", "%.1f"),
    Column("eAHC", "e_c_measured", "cm", "%.3f"),
    Column("Joy", "v_op", "m/s", "%.4f"),
    Column("Mod", "mode", "1", "%d"),
)


def digitised(x: FloatArray, full: float) -> FloatArray:
    """Readings of a transmitter with a range from 0 to full, in its steps."""
    return np.round(x / full * ADC) / ADC * full


def logged(log: Log, inputs: Inputs, test: SeaTest, zero_a: float, rng: np.random.Generator) -> FloatArray:
    """The log's columns in its own units: noise, drifting zeros, steps, a fast clock."""
    n = len(log.s_w)
    t = np.arange(n) * CYCLE
    phases = rng.uniform(0.0, 2.0 * np.pi, 3)
    period = max(test.duration * DRIFT_PERIODS, SHORTEST_DRIFT)

    def noise(size: float) -> FloatArray:
        return size * rng.normal(size=n)

    def pressure(p: FloatArray, phase: float, zero: float = 0.0) -> FloatArray:
        drift = DRIFT * np.sin(2.0 * np.pi * t / period + phase)
        return digitised(p + zero + drift + noise(PRESSURE_NOISE), PRESSURE_RANGE) / 1e6

    columns = [
        t * (1.0 + CLOCK),
        100.0 * inputs.s_mru,
        MINUTE * inputs.v_mru,
        inputs.a_mru,
        np.round(log.s_w, WIRE_DIGITS),
        MINUTE * (log.v_w + noise(WIRE_SPEED_NOISE)),
        log.omega * (1.0 + noise(SPEED_PART)) + noise(SPEED_NOISE),
        pressure(log.p_a, phases[0], zero_a),
        pressure(log.p_b, phases[1]),
        pressure(log.p_hp, phases[2]),
        log.u_p,
        log.u_m,
        log.alpha_p + noise(SETTING_NOISE),
        log.alpha_m + noise(SETTING_NOISE),
        log.alpha_pm + noise(SETTING_NOISE),
        digitised(log.F, FORCE_RANGE) / 1e3,
        100.0 * log.e,
        inputs.v_op,
        inputs.mode,
    ]
    return np.column_stack(columns)
