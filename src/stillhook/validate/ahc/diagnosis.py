"""Possible causes of the deviation of the control error: the twin with one parameter changed at a time, and a
regression on the effects."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import gains
from stillhook.spec.crane import Crane
from stillhook.statistics.time_lag import dot
from stillhook.units import show
from stillhook.validate.ahc.replay import SETTLE, Replay, run_twin
from stillhook.validate.dynamics.fitting.model import C_H, C_LEAK, INERTIA, bent, scaled, with_change
from stillhook.winches.circuits.tables import ServoVariant

LONGEST = 270.0
"""Part of a segment that is run again for every cause [s]: some 30 waves."""
SMOOTH = 0.15
"""Width of the Gaussian filter for deviations and effects [s]: passes 1 Hz to two thirds, and no sensor
noise."""
MUCH = 0.5
"""Share of the deviation's energy from which a cause is reported."""
ALIKE = 0.1
"""Causes whose shares differ by less than this are reported together."""
SMALL = 2e-3
"""Deviation of the control error that needs no cause [m rms]: twice the resolution of a PLC's error in millimetres."""
SMALL_DP = 2e5
"""Deviation of the pressure drop that needs no cause [Pa rms]: 2 bar, 0.5 % of a transmitter's 400 bar."""


class Cause(NamedTuple):
    """bend(crane, x): a crane of `with_gains` with the parameter changed by the part x of itself; x: simulated change;
    most: largest plausible change."""

    name: str
    words: str
    bend: Callable[[Crane, float], Crane]
    x: float
    most: float


class CauseEstimate(NamedTuple):
    """amount: change of the parameter that explains most of the deviation, relative; share: part of the deviation's
    energy that it explains, control error and pressure drop over the active motors together, each over
    its SMALL; share_e: the same of e_c alone.
    """

    cause: Cause
    amount: float
    share: float
    share_e: float


class Deviation(NamedTuple):
    """Smooth deviation of the twin from the crane: e_c [m rms], pressure drop over the active motors [Pa rms], NaN
    where not logged."""

    e_c: float
    dp_m: float


def _bent(*names: str) -> Callable[[Crane, float], Crane]:
    return lambda crane, x: bent(crane, dict.fromkeys(names, math.log1p(x)))


def _scaled(path: str) -> Callable[[Crane, float], Crane]:
    return lambda crane, x: scaled(crane, 1.0 + x, path)


def _motor_offset(crane: Crane, x: float) -> Crane:
    update = {"variant": ServoVariant.OPEN_LOOP, "offset": x, "hysteresis": 0.0}
    changed: Crane = with_change(crane, "active.motor", lambda motor: motor.model_copy(update=update))
    return changed


CAUSES = (
    Cause("leakage", "leakage of the active pumps and motors", _bent(C_LEAK), 0.1, 3.0),
    Cause("friction", "friction of the winch", _bent("dry", "breakaway", "viscous", "pressure_loss"), 0.1, 3.0),
    Cause("K_1", "K_1 of the crane's controller", _scaled("control.K_1"), 0.01, 0.3),
    Cause("K_2", "K_2 of the crane's controller", _scaled("control.K_2"), 0.1, 3.0),
    Cause("K_p", "K_p of the crane's controller", _scaled("control.K_p"), 0.1, 3.0),
    Cause("speed", "wire speed per pump command (layer, gear ratio, pump flow)", _bent("pump_flow"), 0.01, 0.3),
    Cause("motor_offset", "displacement of the active motors over their command", _motor_offset, 0.05, 0.3),
    Cause("C_h", "capacitance of the active lines", _bent(C_H), 0.1, 3.0),
    Cause("J_m_eff", "inertia at the motor shaft", _bent(INERTIA), 0.1, 1.0),
    Cause("pump_servo", "natural frequency of the pumps' displacement control", _bent("pump_omega_n"), 0.1, 1.0),
    Cause(
        "motor_servo",
        "natural frequency of the motors' displacement control",
        _scaled("active.motor.servo.omega_n"),
        0.2,
        3.0,
    ),
)


def explain(
    crane: Crane, replays: Sequence[Replay], measured: Sequence[FloatArray]
) -> tuple[tuple[CauseEstimate, ...], Deviation]:
    """Share of the deviation explained by each cause, the largest first, and the deviation itself; no cause where it is
    small.

    Parameters: the twin; its replays; the crane's control error over the samples that count, one array a replay [m].
    """
    crane = with_gains(crane)
    cranes = [crane, *(c.bend(crane, c.x) for c in CAUSES)]
    e, dp = [], []
    for r, e_measured in zip(replays, measured, strict=True):
        short = r.shortened(SETTLE + LONGEST)
        runs = run_twin(cranes, [short] * len(cranes), ("e_c_measured", "p_a", "p_b"), quick=True)
        n = len(runs[0]["p_a"])
        e.append(_effects(e_measured[:n], [x["e_c_measured"] for x in runs], r.record.step))
        dp.append(
            _effects((r.measured("p_a") - r.measured("p_b"))[:n], [x["p_a"] - x["p_b"] for x in runs], r.record.step)
        )
    E, P = np.hstack(e) / SMALL, np.hstack(dp) / SMALL_DP
    both, deviation = np.hstack([E, P]), Deviation(_rms(E[0]) * SMALL, _rms(P[0]) * SMALL_DP)
    if not (deviation.e_c > SMALL or deviation.dp_m > SMALL_DP):
        return (), deviation
    causes = []
    for k, cause in enumerate(CAUSES, start=1):
        amount = _amount(both[0], both[k], cause)
        causes.append(CauseEstimate(cause, amount, _share(both[0], amount * both[k]), _share(E[0], amount * E[k])))
    return tuple(sorted(causes, key=lambda x: -x.share)), deviation


def with_gains(crane: Crane) -> Crane:
    """The crane with explicit gains of its PLC, so that they remain constant when the winch is changed."""
    known = gains(crane)
    return crane.model_copy(update={"control": crane.control.model_copy(update={"K_1": known.K_1, "K_2": known.K_2})})


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else math.nan


def _effects(measured: FloatArray, runs: Sequence[FloatArray], step: float) -> FloatArray:
    """Row 0: measured less simulated; then the effect of every cause for a change of all of it. Smooth, every tenth of
    a second."""
    from scipy.ndimage import gaussian_filter1d  # heavy: only where data are at hand

    rows = np.stack([measured - runs[0], *((x - runs[0]) / c.x for c, x in zip(CAUSES, runs[1:], strict=True))])
    known = np.isfinite(rows[0])
    rows[0, ~known] = 0.0
    smooth = gaussian_filter1d(rows, SMOOTH / step, axis=1)
    every = max(1, round(0.1 / step))
    out: FloatArray = smooth[:, ::every][:, known[::every]]
    return out


def _amount(deviation: FloatArray, effect: FloatArray, cause: Cause) -> float:
    size = dot(effect, effect)
    best = dot(deviation, effect) / size if size > 0.0 else 0.0
    return best if abs(best) <= cause.most else 0.0


def _share(deviation: FloatArray, effect: FloatArray) -> float:
    """Share of the deviation's energy removed by subtracting the effect."""
    size = dot(deviation, deviation)
    return 1.0 - float(np.sum((deviation - effect) ** 2)) / size if size > 0.0 else math.nan


def statements(causes: Sequence[CauseEstimate], deviation: Deviation) -> tuple[str, ...]:
    """Statements on causes: none where no cause explains much of the deviation."""
    if not causes or causes[0].share < MUCH:
        return ()
    best = causes[0]
    others = [x for x in causes[1:] if x.share > best.share - ALIKE]
    of = f"control error ({1e3 * deviation.e_c:.2g} mm rms)"
    if math.isfinite(deviation.dp_m):
        of += f" and pressure drop ({show(deviation.dp_m, 'pressure', 2)} rms)"
    text = f"{_cause_text(best)} would explain {100.0 * best.share:.0f} % of the twin's deviation in {of}"
    if others:
        text += "; about as much: " + ", ".join(f"{_cause_text(x)} ({100.0 * x.share:.0f} %)" for x in others)
    return (
        f"{text[0].upper()}{text[1:]}. This is an indication, not a verdict: steps 1, 2 and 4 measure these directly.",
    )


def _cause_text(x: CauseEstimate) -> str:
    if x.cause.name == "motor_offset":
        return f"{x.cause.words} by {100.0 * x.amount:.2g} % of the full one"
    return f"{x.cause.words} {100.0 * abs(x.amount):.2g} % {'higher' if x.amount > 0.0 else 'lower'} than in the twin"
