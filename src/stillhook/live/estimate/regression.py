"""Measured loss on the modelled one over the half waves of a window, and what its interval is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import Accuracies, half_width
from stillhook.live.estimate.clock import Clock
from stillhook.live.estimate.half_waves import SENSITIVITIES, HalfWave
from stillhook.live.estimate.parameters.sums import scatter_of
from stillhook.statistics.estimate import NORMAL_95, Estimate, t_factor

FEWEST = 8
"""Half waves from which an estimate is stated: three columns are fitted, and scatter is to be seen."""
NUISANCE = 2
"""Columns besides the scale: a standing torque, and its drift."""


@dataclass(frozen=True)
class FrictionEstimate:
    """What a window says of friction.

    loss: all losses at the motor shaft over the crane file's. system: factor on the crane file's system friction that
    explains them if the motors' loss is as in the file. limits: largest error of `loss` from each source [-];
    structural: half of the difference between weak and strong half waves [-]; random: standard uncertainty of `loss`
    from the scatter [-]. standing: constant torque that neither explains [N m]. clock: offset of the encoder. start,
    end of the window [s].
    """

    loss: Estimate
    system: Estimate
    limits: Mapping[str, float]
    structural: float
    random: float
    standing: float
    clock: Clock
    start: float
    end: float
    half_waves: int


class Line(NamedTuple):
    """A fit of torque = scale model + standing + drift: scale; residuals (n,); u of the scale from the scatter; t: its
    95 % factor; standing [N m]; gain (n,): scale as a linear form of the torques."""

    scale: float
    residual: FloatArray
    u: float
    t: float
    standing: float
    gain: FloatArray


class Columns(NamedTuple):
    """Half waves as arrays (n,), effects (n, sources)."""

    t: FloatArray
    torque: FloatArray
    system: FloatArray
    motors: FloatArray
    effects: FloatArray
    speed: FloatArray
    weight: FloatArray


def columns_of(waves: Sequence[HalfWave]) -> Columns:
    """Half waves side by side."""
    return Columns(
        np.array([w.t for w in waves]),
        np.array([w.torque for w in waves]),
        np.array([w.system for w in waves]),
        np.array([w.motors for w in waves]),
        np.stack([w.effects for w in waves]),
        np.array([w.speed for w in waves]),
        np.array([w.seconds for w in waves]),
    )


def line(t: FloatArray, model: FloatArray, torque: FloatArray, weight: FloatArray) -> Line | None:
    """Weighted least squares of the torque on the model, a constant and a drift, all (n,); None where hoisting and
    lowering are not both there. The uncertainty of the scale is that of its scores."""
    n = len(t)
    if n < NUISANCE + 2 or not (model.min() < 0.0 < model.max()):
        return None
    span = max(float(np.ptp(t)), 1.0)
    X = np.column_stack([model, np.ones(n), (t - t.mean()) / span])
    normal = X.T @ (weight[:, None] * X)
    scale = np.sqrt(np.diag(normal))
    inverse = np.linalg.pinv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    hat = inverse @ (weight[:, None] * X).T
    b = hat @ torque
    residual = torque - X @ b
    freedom = n - NUISANCE - 1
    u = scatter_of(hat[0] * residual, NUISANCE + 1)
    return Line(float(b[0]), residual, u, t_factor(freedom), float(b[1]), hat[0])


def structural_of(x: Columns, model: FloatArray, torque: FloatArray) -> float:
    """Half of the difference between the scales of weak and strong half waves [-], 0 where there are too few of
    either."""
    strong = x.speed > np.median(x.speed)
    both = [model[part] for part in (strong, ~strong)]
    if len(x.t) < FEWEST or any(m.size == 0 or not m.min() < 0.0 < m.max() for m in both):
        return 0.0
    X = np.column_stack([np.where(strong, model, 0.0), np.where(strong, 0.0, model), np.ones(len(x.t))])
    w = np.sqrt(x.weight)
    b = np.linalg.lstsq(w[:, None] * X, w * torque, rcond=None)[0]
    return 0.5 * abs(float(b[0] - b[1]))


def limits_of(gain: FloatArray, effects: FloatArray, accuracies: Accuracies) -> dict[str, float]:
    """Largest error of the scale from each sensor [-]; the clock's is per second."""
    a = accuracies
    sizes = {
        "F_gain": a.F_gain,
        "F_zero": a.F_zero,
        "F_lag": a.F_lag,
        "alpha_m": a.alpha_m,
        "alpha_pm": a.alpha_pm,
        "D_m": a.D_m,
        "D_pm": a.D_pm,
        "p_a": a.p,
        "p_b": a.p,
        "p_hp": a.p,
        "R_piston": a.R_piston,
        "inertia": a.inertia,
        "clock": 1.0,
    }
    of_each = gain @ effects
    return {name: abs(float(e)) * sizes[name] for name, e in zip(SENSITIVITIES, of_each, strict=True)}


def estimate(
    waves: Sequence[HalfWave], clock: Clock, accuracies: Accuracies, extra_clock: float
) -> FrictionEstimate | None:
    """Scale of the losses over a window, with its 95 % interval. clock: what is still lacking of the offset that the
    half waves were put together with, and its uncertainty; extra_clock: limit of error of the clock besides [s]."""
    if len(waves) < FEWEST:
        return None
    x = columns_of(waves)
    lacking = clock.offset if clock.found else 0.0
    torque = x.torque + lacking * x.effects[:, -1]
    both = x.system + x.motors
    loss, system = line(x.t, both, torque, x.weight), line(x.t, x.system, torque - x.motors, x.weight)
    if loss is None or system is None:
        return None
    limits = limits_of(loss.gain, x.effects, accuracies)
    values = []
    for fit, model, y in ((loss, both, torque), (system, x.system, torque - x.motors)):
        errors = limits_of(fit.gain, x.effects, accuracies)
        per_second = errors.pop("clock")
        structural = structural_of(x, model, y)
        u_clock = clock.u * clock.t / NORMAL_95 if clock.found else 0.0
        u = float(np.hypot(fit.u * fit.t / NORMAL_95, per_second * u_clock))
        half = half_width([*errors.values(), per_second * extra_clock, structural], u)
        values.append(Estimate.around(fit.scale, half, len(waves), structural))
    limits["clock"] *= extra_clock if not clock.found else clock.t * clock.u + extra_clock
    return FrictionEstimate(
        loss=values[0],
        system=values[1],
        limits=limits,
        structural=values[0].structural,
        random=loss.u,
        standing=loss.standing,
        clock=clock,
        start=waves[0].t,
        end=waves[-1].t,
        half_waves=len(waves),
    )
