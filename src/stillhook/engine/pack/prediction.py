"""Steady gains of the Kalman filter that predicts the tip's motion in a crane's PLC."""

import functools
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.physics.tip_prediction import MODES, OSCILLATORS, Settings
from stillhook.spec.crane import Crane

ZETA = 0.05
"""Damping ratio of the oscillators [-]: they forget in three of their periods, as a wave group lasts. From 0.02 to 0.1
it changes the error of the prediction by 3 %."""
LOOSE = 0.1
"""Random speed that moves the position of an oscillator, over that which moves its speed, over its frequency [-]. By
speed and acceleration alone a constant position of all of them together, which a start leaves, is hardly seen: it
would fade in 6,000 s, so it does in 23 s. The error of the prediction becomes 3 % larger."""


class Filter(NamedTuple):
    """The motion in discrete time: A moves the state, positions and speeds of the oscillators in turn, on by a cycle; H
    gives speed and acceleration of it; Q, R covariances of what drives it and of the noise; P that of the state before
    a correction; K gains of the correction. SI units."""

    A: FloatArray
    H: FloatArray
    Q: FloatArray
    R: FloatArray
    P: FloatArray
    K: FloatArray


@functools.cache
def steady_filter(t_cycle: float, periods: tuple[float, ...], noise_w: float, noise: tuple[float, float]) -> Filter:
    r"""The Kalman filter with steady gains.

    .. math:: P = A P A^T - A P H^T (H P H^T + R)^{-1} H P A^T + Q, \quad K = P H^T (H P H^T + R)^{-1}

    Parameters: t_cycle [s]; periods [s]; noise_w sd of the speed that random acceleration gives each oscillator in 1 s
    [m/s]; noise sd of speed and acceleration [m/s, m/s^2].
    """
    from scipy.linalg import expm, solve_discrete_are  # heavy

    n = 2 * len(periods)
    A, H, Q, R = np.zeros((n, n)), np.zeros((2, n)), np.zeros((n, n)), np.diag(np.square(noise))
    for i, omega in enumerate(2.0 * np.pi / np.array(periods)):
        at, rates = slice(2 * i, 2 * i + 2), np.array([[0.0, 1.0], [-(omega**2), -2.0 * ZETA * omega]])
        A[at, at], H[:, at] = expm(rates * t_cycle), [[0.0, 1.0], rates[1]]
        Q[at, at] = noise_w**2 * t_cycle * np.diag([(LOOSE / omega) ** 2, 1.0])
    P = solve_discrete_are(A.T, H.T, Q, R)
    return Filter(A, H, Q, R, P, P @ H.T @ np.linalg.inv(H @ P @ H.T + R))


def predicting(crane: Crane, t_cycle: float | None = None) -> dict[str, Any]:
    """Settings of the prediction of a crane, by the name under which controllers carry them; none without a table
    [control.prediction]. t_cycle of its PLC [s], default the crane's."""
    table = crane.control.prediction
    if table is None:
        return {}
    omega = 2.0 * np.pi / np.geomspace(table.period_most, table.period_least, len(MODES))
    periods, noise = tuple((2.0 * np.pi / omega).tolist()), (table.noise_v, table.noise_a)
    f = steady_filter(crane.control.t_cycle if t_cycle is None else t_cycle, periods, table.noise_w, noise)
    rows = np.column_stack([omega**2, 2.0 * ZETA * omega, f.K.reshape(len(MODES), 4)])
    inverse = 1.0 / np.sqrt(np.diag(f.H @ f.P @ f.H.T + f.R))
    own = [kind(*row) for kind, row in zip(OSCILLATORS.values(), rows.tolist(), strict=True)]
    return {"prediction": Settings(table.t_least, *inverse.tolist(), *own)}
