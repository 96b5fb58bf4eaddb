"""Logs of several cranes, each in several campaigns and seas, with the plant of `trials.adaptation`.

A seed draws each of the three, so that logs can share a crane (hull, motors, displacement of the motors, load cell), a
campaign (day: oil, wear, drift of the sensors, clock) or neither.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stillhook.engine.pack.winch import gains
from stillhook.library import load_crane
from trials.adaptation.crane import (
    CELL_GAIN,
    CELL_ZERO,
    CLOCK,
    COLD,
    CRANE_FILE,
    DISPLACEMENT,
    SETTING,
    SETTLED,
    TAU,
    WARMING,
    FloatArray,
    logged,
    sea_inputs,
    truth_of,
)
from trials.adaptation.plant import FILE_FORM, Drift, Log, run
from trials.independent_crane import crane as base
from trials.independent_crane.plc import NS, SSC
from trials.independent_crane.sea_trial import SETTING_NOISE, STATED_DELAY, SeaTest, Wave, samples

STREAM = 3907
DURATION = 300.0
"""Length of a log [s]: adaptation needs about one, the rest is learned from or judged."""
WEAR, WARMER = 1.2, 4.0
"""A later campaign: factor on the system friction [-], oil at the start warmer by [K]."""


class Session(NamedTuple):
    """One log. crane, campaign, sea: seeds; form of the friction law; later: the crane is worn and its oil warmer."""

    crane: int
    campaign: int
    sea: int
    form: float = FILE_FORM
    later: bool = False
    duration: float = DURATION


class Logged(NamedTuple):
    """rows as logged, SI; loss: true torque of all friction, hoisting positive [N m]; clock: what the encoder's is off
    [s]."""

    rows: dict[str, FloatArray]
    loss: FloatArray
    clock: float


def simulate(session: Session) -> Logged:
    """The log of a session."""
    of_crane = np.random.default_rng([STREAM, 1, session.crane])
    of_campaign = np.random.default_rng([STREAM, 2, session.crane, session.campaign])
    of_sea = np.random.default_rng([STREAM, 3, session.crane, session.campaign, session.sea])
    crane = load_crane(CRANE_FILE)
    load, s_w = 1e3 * of_sea.uniform(40.0, 160.0), of_sea.uniform(300.0, 2300.0)
    wave = Wave(of_sea.uniform(1.3, 2.4), of_sea.uniform(8.0, 12.0), SETTLED)
    test = SeaTest("residual", "ahc", load, s_w, session.duration, of_sea.choice([NS, SSC]), wave)
    defect = base.Defect(
        displacement=1.0 + DISPLACEMENT * of_crane.uniform(-1.0, 1.0), friction=1.0, delay=STATED_DELAY
    )
    drawn, days = base.draw_crane(1000 + session.crane, defect)
    passive = 1.0 + DISPLACEMENT * of_crane.uniform(-1.0, 1.0)
    day = days[session.campaign % len(days)]._replace(passive_displacement=passive)
    winch = base.winch_of(crane, test, defect, drawn, day)
    winch = winch._replace(hoist=winch.hoist._replace(gain_cell=1.0 + CELL_GAIN * of_crane.uniform(-1.0, 1.0)))
    scale = of_crane.uniform(0.8, 1.2) * (WEAR if session.later else 1.0)
    zeros = SETTING * of_crane.uniform(-1.0, 1.0, 3)
    start = of_campaign.uniform(*COLD) + (WARMER if session.later else 0.0)
    drift = Drift(scale, scale, 0, 1.0, session.form, start, of_campaign.uniform(*WARMING), TAU)
    clock = CLOCK * of_campaign.uniform(-1.0, 1.0)
    zero_cell = CELL_ZERO * of_campaign.uniform(-1.0, 1.0)
    inputs = sea_inputs(test, 1.0 / gains(crane).K_1, of_sea)
    log = Log(*(np.zeros(samples(test)) for _ in Log._fields))
    run(inputs, s_w, zero_cell, winch, drift, base.settings_of(crane, test, drawn)._replace(brake=0.0), log)
    rows = logged(log, inputs, clock, of_sea)
    for name, zero in zip(
        ("alpha_p", "alpha_m", "alpha_pm"), zeros, strict=True
    ):  # errors of the crane, not of the log
        rows[name] = np.round(getattr(log, name) + zero + SETTING_NOISE * of_sea.normal(size=samples(test)), 4)
    return Logged(rows, truth_of(log, crane)["T_loss"], clock)
