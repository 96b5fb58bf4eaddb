"""Machines, seas and sensors of the adaptation trial: a seed draws the crane, what its sensors get wrong, the clocks,
the sea and when friction steps.

Sensor errors are even within the limits that the issue states; what is not stated is that of
`trials.independent_crane.sea_trial` (assumed there).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook import Crane
from stillhook.engine.pack.winch import gains
from stillhook.library import load_crane
from trials.adaptation.plant import FILE_FORM, OTHER_FORM, Drift, Faults, Log, run
from trials.independent_crane import crane as base
from trials.independent_crane.plant import LEAK_ACROSS, Inputs, Winch
from trials.independent_crane.plc import NS, SSC
from trials.independent_crane.sea_trial import (
    BAR,
    CYCLE,
    FORCE_NOISE,
    FORCE_RANGE,
    PRESSURE_NOISE,
    PRESSURE_RANGE,
    SETTING_NOISE,
    SPEED_NOISE,
    STATED_DELAY,
    SeaTest,
    Wave,
    digitised,
    inputs_of,
    samples,
)

FloatArray = NDArray[np.float64]
CRANE_FILE = base.CRANE_FILE
CELL_GAIN, CELL_ZERO = 0.01, 15e3
"""Limits of error of the load cell: gain [-], zero [N]."""
SETTING = 0.005
"""Limits of error of a displacement reading, part of the full one [-]."""
DRIFT, SHORTEST_DRIFT, LONGEST_DRIFT = 0.5 * BAR, 600.0, 3600.0
"""Drift of a transmitter: amplitude [Pa] and period [s]."""
CLOCK = 0.2
"""Largest offset of the encoder's clock [s]."""
DISPLACEMENT, INERTIA = 0.003, 0.03
"""Half widths of the factors on displacement and inertia [-] (`trials.independent_crane.crane.SCATTER`)."""
WARMING, COLD, TAU = (2.0, 8.0), (-4.0, 2.0), 1200.0
"""Oil: rise [K], start over nominal [K], and time over which it warms [s] (assumed)."""
STEP, QUIET, AFTER = 0.3, 420.0, 420.0
"""Step of system friction [-], and time before and after it [s]."""
SETTLED = 20.0
"""Time until the sea has its full height [s]."""
STREAM = 3901


LEAKAGE = (0.7, 1.4)
"""Factor on the file's leakage before its step (assumed: new to worn)."""
FAULTS = {
    "leakage": (420.0, 1.5),
    "gas": (780.0, 1.0 / 9.0),
    "displacement": (1140.0, 0.02),
    "pump delay": (1500.0, 0.7),
}
"""Faults: moment [s], and size: factor on the leakage; part of the gas, one of nine vessels; what the reading of the
active motors jumps by, part of the full one; factor on the natural frequency of the pumps' control (assumed)."""
WITH_FAULTS = 1800.0
"""Length of a run with all faults [s]."""
OTHER_LEAKS = (base.Leak.CONSTANT, base.Leak.STROKE, base.Leak.PRESSURE)
"""Leakage of another form, by the seed."""


class Trial(NamedTuple):
    """One run. seed; form of friction and leakage; step of system friction [-], 0 without; seconds before and after it;
    faults: those of FAULTS, in WITH_FAULTS, instead of a step."""

    seed: int
    form: float = FILE_FORM
    step: float = STEP
    before: float = QUIET
    after: float = AFTER
    faults: bool = False


class Run(NamedTuple):
    """rows: signals as logged, SI; truth: signals without error, and true parameters over time: leak flow out of the
    line under pressure towards the other one [m^3/s], what the motors' reading lacks [-], charge of gas with which the
    file's law is as stiff [-], lag of the pumps behind their command over the file's [s]; t_step [s]; scale of system
    friction before and after; clock: what the encoder's clock is off [s]; conditions for the page."""

    rows: dict[str, FloatArray]
    truth: dict[str, FloatArray]
    t_step: float
    scale: tuple[float, float]
    clock: float
    conditions: dict[str, float]


def simulate(trial: Trial) -> Run:
    """The log of a trial."""
    rng = np.random.default_rng([STREAM, trial.seed, round(trial.form)])
    crane = load_crane(CRANE_FILE)
    test = SeaTest(
        "adaptation",
        "ahc",
        load=1e3 * rng.uniform(40.0, 160.0),
        s_w=rng.uniform(300.0, 2300.0),
        duration=WITH_FAULTS if trial.faults else trial.before + trial.after,
        mode=rng.choice([NS, SSC]),
        wave=Wave(rng.uniform(1.3, 2.4), rng.uniform(8.0, 12.0), SETTLED),
    )
    # a machine as the independent crane draws it, with errors within what the sensors of the estimator state
    defect = base.Defect(displacement=1.0 + DISPLACEMENT * rng.uniform(-1.0, 1.0), friction=1.0, delay=STATED_DELAY)
    if trial.faults:
        worn = np.random.default_rng([STREAM, trial.seed, 2]).uniform(*LEAKAGE)
        form = OTHER_LEAKS[trial.seed % len(OTHER_LEAKS)] if trial.form == OTHER_FORM else base.Leak.LIKE_FILE
        defect = defect._replace(leakage=worn, leak=form)
    drawn, days = base.draw_crane(trial.seed, defect)
    day = days[0]._replace(passive_displacement=1.0 + DISPLACEMENT * rng.uniform(-1.0, 1.0))
    winch = base.winch_of(crane, test, defect, drawn, day)
    winch = winch._replace(hoist=winch.hoist._replace(gain_cell=1.0 + CELL_GAIN * rng.uniform(-1.0, 1.0)))
    scale = rng.uniform(0.8, 1.2)
    at = trial.before + (rng.uniform(-10.0, 10.0) if trial.step else 0.0)
    step = 0.0 if trial.faults else trial.step
    times = {name: moment if trial.faults else math.inf for name, (moment, _) in FAULTS.items()}
    drift = Drift(
        before=scale,
        after=scale * (1.0 + step),
        at=round(at / CYCLE),
        motors=1.0,
        form=trial.form,
        start=rng.uniform(*COLD),
        warming=rng.uniform(*WARMING),
        tau=TAU,
    )
    faults = Faults(
        leak_at=times["leakage"] / CYCLE,
        leak=FAULTS["leakage"][1],
        gas_at=times["gas"] / CYCLE,
        gas=FAULTS["gas"][1],
        pumps_at=times["pump delay"] / CYCLE,
        pumps=FAULTS["pump delay"][1],
    )
    inputs = sea_inputs(test, 1.0 / gains(crane).K_1, rng)
    log = Log(*(np.zeros(samples(test)) for _ in Log._fields))
    settings = base.settings_of(crane, test, drawn)._replace(brake=0.0)
    run(inputs, test.s_w, CELL_ZERO * rng.uniform(-1.0, 1.0), winch, drift, faults, settings, log)
    clock = CLOCK * rng.uniform(-1.0, 1.0)
    conditions = {"load": test.load, "s_w": test.s_w, "mode": test.mode, "height": test.wave.height}  # type: ignore[union-attr]
    conditions |= {"period": test.wave.period, "scale": scale}  # type: ignore[union-attr]
    rows = logged(log, inputs, clock, rng)
    rows["alpha_m"] = rows["alpha_m"] + np.where(rows["time"] >= times["displacement"], FAULTS["displacement"][1], 0.0)
    return Run(
        rows,
        truth_of(log) | parameters_of(log, rows, crane, winch, faults),
        at,
        (scale, scale * (1.0 + step)),
        clock,
        conditions,
    )


PIECE = 1800.0
"""Length of the pieces that a long sea is made of [s]: a sum of 60 regular components repeats itself in hours."""


def sea_inputs(test: SeaTest, full_speed: float, rng: np.random.Generator) -> Inputs:
    """Inputs of a test, with a new sea every PIECE where it is longer; each piece begins and ends at rest."""
    if test.duration <= PIECE:
        return inputs_of(test, full_speed, STATED_DELAY, rng)
    n, parts, left = samples(test), [], samples(test)
    while left > 0:
        part = inputs_of(test._replace(duration=PIECE), full_speed, STATED_DELAY, rng)
        count = min(left, len(part.s_tip))
        fade = np.clip((len(part.s_tip) - np.arange(len(part.s_tip))) * CYCLE / SETTLED, 0.0, 1.0)
        fade, slope = fade * fade * (3.0 - 2.0 * fade), np.gradient(fade * fade * (3.0 - 2.0 * fade), CYCLE)
        part = part._replace(
            s_tip=part.s_tip * fade,
            v_tip=part.v_tip * fade + part.s_tip * slope,
            s_mru=part.s_mru * fade,
            v_mru=part.v_mru * fade + part.s_mru * slope,
            a_mru=part.a_mru * fade + 2.0 * part.v_mru * slope,
        )
        parts.append(Inputs(*(x[:count] for x in part)))
        left -= count
    joined = Inputs(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    assert len(joined.s_tip) == n
    return joined


def logged(log: Log, inputs: Inputs, clock: float, rng: np.random.Generator) -> dict[str, FloatArray]:
    """The rows that a PLC logs: noise, drift, steps; the encoder's values are those of `clock` seconds ago."""
    n = len(log.omega)
    t = np.arange(n) * CYCLE

    def noise(size: float) -> FloatArray:
        return size * rng.normal(size=n)

    def pressure(p: FloatArray) -> FloatArray:
        period, phase = rng.uniform(SHORTEST_DRIFT, LONGEST_DRIFT), rng.uniform(0.0, 2.0 * np.pi)
        drift = DRIFT * np.sin(2.0 * np.pi * t / period + phase)
        return digitised(p + drift + noise(PRESSURE_NOISE), PRESSURE_RANGE)

    def setting(alpha: FloatArray) -> FloatArray:
        return np.round(alpha + SETTING * rng.uniform(-1.0, 1.0) + noise(SETTING_NOISE), 4)

    def late(x: FloatArray) -> FloatArray:
        return np.interp(t - clock, t, x)

    return {
        "time": t,
        "s_tip": inputs.s_mru,
        "v_tip": inputs.v_mru,
        "a_tip": inputs.a_mru,
        "omega_m": late(log.omega) + noise(SPEED_NOISE),
        "s_w": np.round(late(log.s_w), 3),
        "p_a": pressure(log.p_a),
        "p_b": pressure(log.p_b),
        "p_hp": pressure(log.p_hp),
        "u_p": log.u_p,
        "u_m": log.u_m,
        "alpha_p": setting(log.alpha_p),
        "alpha_m": setting(log.alpha_m),
        "alpha_pm": setting(log.alpha_pm),
        "F_w": digitised(log.F + noise(FORCE_NOISE), FORCE_RANGE),
        "mode": inputs.mode,
    }


def truth_of(log: Log) -> dict[str, FloatArray]:
    """What no sensor sees, and true states."""
    names = ("p_a", "p_b", "p_hp", "alpha_p", "alpha_m", "alpha_pm", "s_w", "T_loss", "rise", "p_gas", "V_gas")
    return {"omega_m": log.omega, "F_w": log.F_true, **{name: getattr(log, name) for name in names}}


def parameters_of(
    log: Log, rows: dict[str, FloatArray], crane: Crane, winch: Winch, faults: Faults
) -> dict[str, FloatArray]:
    """True parameters at every cycle, as `Run` says."""
    a, cycle, dp, passive = winch.active, np.arange(len(log.omega)), log.p_a - log.p_b, crane.passive
    assert passive is not None
    C = (a.leak + a.leak_stroke * np.abs(log.alpha_p) + a.leak_speed * np.abs(log.omega)) / log.viscosity
    C = C * (1.0 + a.leak_pressure * np.abs(dp)) * np.where(cycle >= faults.leak_at, faults.leak, 1.0)
    head = LEAK_ACROSS * dp + (1.0 - LEAK_ACROSS) * np.sign(dp) * np.maximum(log.p_a, log.p_b)
    gas, adiabatic = passive.accumulator.gas, 1.0 + winch.passive.mR / winch.passive.c_v
    file_lag, lag = crane.active.pump.servo.lag, 2.0 * winch.pumps.zeta / winch.pumps.omega_n
    return {
        "leak": C * head,
        "displacement": a.motors.D / crane.active.motor.D_max * log.alpha_m - rows["alpha_m"],
        "gas": gas.n / adiabatic * log.p_gas * log.V_gas / (gas.p_0 * gas.V_0),
        "pump delay": CYCLE + lag / np.where(cycle >= faults.pumps_at, faults.pumps, 1.0) - file_lag,
    }
