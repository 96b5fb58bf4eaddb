"""The give of a winch from its own twin: the same motion of the tip on a soft and on a stiff wire."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stillhook.crane import Crane
from stillhook.engine.run import Ending, Progress, Result
from stillhook.errors import LiftError
from stillhook.plants.state import Signals
from stillhook.response.duty import Duty, run_twin, soft
from stillhook.response.give import Give
from stillhook.scenario import Mode, Scenario
from stillhook.sea.motion import Sine, Sum

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PROBES = (0.3, 0.58, 1.17, 2.43, 4.3, 7.4)
"""Frequencies at which a small motion is laid over the wave [rad/s]; none is a whole multiple of the wave's."""
WAVE, SHARE = 8.0, 0.25
"""Period of the wave that keeps the winch moving [s]; speed of the probe over that of the wave."""
SPEEDS = (0.03, 0.06, 0.12, 0.24, 0.48, 0.96)
"""Speed amplitudes of the wave [m/s]."""
SETTLE, LENGTH, SPACING = 60.0, 300.0, 0.05
STRETCH, ZETA, HEAVY = 0.2, 0.1, 9.0
"""Of the stiff wire: stretch under the mean tension [m], damping ratio, and mass below it over that of resonance with the probe, so that
it stands while the wire works."""
SATURATED = 0.02
"""Share of the time at the pumps' stop from which a run says nothing about small changes."""


def identify_give(crane: Crane, duty: Duty, mode: Mode, *, threads: int = 2, progress: Progress | None = None) -> Give:
    """Y = (u_soft - u_stiff)/F_stiff at the frequency of the probe: the tension is the only difference between two such runs.

    Right to a fifth or so where the winch hardly moves, to a tenth elsewhere (another stiffness gives the same). Speeds at which
    the pumps saturate, or the twin is lost, take the values of the last sound one. Errors: LiftError where there is no sound one.
    """
    k = duty.F / STRETCH
    stiff = duty.on_spring(crane, k, ZETA)
    pairs = [(w, v) for w in PROBES for v in SPEEDS]
    on_soft = run_twin(soft(crane, duty), [_case(duty, crane, mode, w, v) for w, v in pairs], SPACING, threads=threads, progress=progress)
    heavy = [_case(duty, stiff, mode, w, v, HEAVY * k / w**2) for w, v in pairs]
    on_stiff = run_twin(stiff, heavy, SPACING, threads=threads, progress=progress)
    Y = np.full((len(PROBES), len(SPEEDS)), np.nan, dtype=complex)
    for n, ((w, _), a, b) in enumerate(zip(pairs, on_soft, on_stiff, strict=True)):
        if _sound(a) and _sound(b):
            (u_a, _), (u_b, F) = _probe(a, w), _probe(b, w)
            Y[divmod(n, len(SPEEDS))] = (u_a - u_b) / F
    for j in range(1, len(SPEEDS)):
        Y[:, j] = np.where(np.isnan(Y[:, j]), Y[:, j - 1], Y[:, j])
    if np.isnan(Y).any():
        raise LiftError(
            f"residual: {duty.about(crane, mode)}: the winch cannot follow {SPEEDS[0]:g} m/s of the tip. Use another mode or load."
        )
    return Give(np.array(PROBES), np.array(SPEEDS), Y)


def _case(duty: Duty, crane: Crane, mode: Mode, w: float, v: float, more: float = 0.0) -> Scenario:
    wave = Sine.from_si(v * WAVE / (2.0 * math.pi), WAVE)
    probe = Sine.from_si(SHARE * v / w, 2.0 * math.pi / w)
    return duty.scenario(crane, mode, Sum([wave, probe]), SETTLE, LENGTH, more)


def _sound(result: Result) -> bool:
    st = result.stats
    return result.ending is Ending.DONE and st.slack_cycles == 0.0 and st.saturation_cycles < SATURATED * st.cycles


def _probe(result: Result, w: float) -> tuple[complex, complex]:
    """Wire's top end [m] and tension [N] at the probe's frequency, beside a drift and the harmonics of the wave: least squares."""
    assert result.series is not None
    rows = result.series[round(SETTLE / result.dt) :]
    t = result.dt * np.arange(len(rows))
    orders = np.append(w, 2.0 * math.pi / WAVE * np.arange(1, 12))
    angles = np.outer(t, orders)
    columns = np.concatenate((np.ones((len(t), 1)), t[:, None] - t.mean(), np.cos(angles), -np.sin(angles)), axis=1)
    x = np.linalg.lstsq(columns, rows[:, [Signals._fields.index("e_c"), Signals._fields.index("F_w")]], rcond=None)[0]
    found = x[2] + 1j * x[2 + len(orders)]
    return complex(found[0]), complex(found[1])
