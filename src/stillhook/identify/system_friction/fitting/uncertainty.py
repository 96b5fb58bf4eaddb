"""How far identified friction can be trusted: profile likelihood, and what data cannot separate."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.system_friction.fitting.fit import (
    Y_4_LEAST,
    Y_4_MOST,
    FrictionFit,
    Problem,
    Target,
    jacobian,
    scaled_directions,
)
from stillhook.identify.system_friction.fitting.model import (
    X_NAMES,
    Loss,
    Points,
    motor_columns,
    motor_loss_at,
)
from stillhook.statistics.estimate import Estimate, t_factor

FINE, ENDS = 1e-4, 1e-3
"""How well ln Y_4 is found within a profile, and the end of an interval, over the last step towards it."""
SEARCH = 40  # doublings of an interval's end before it counts as open


def fitted_problem(points: Points, loss: Loss, fit: FrictionFit) -> Problem:
    """The least-squares problem that a fit has solved."""
    fitted_points = points.fitted()
    target = Target(fitted_points, fitted_points.T_f - motor_loss_at(fitted_points, loss))
    return Problem(target, fit.noise.root, fit.linear, fit.prescribed, fit.noise.shift)


def profile_intervals(points: Points, loss: Loss, fit: FrictionFit) -> dict[str, Estimate]:
    """Intervals by profile likelihood: how far one parameter can go while the others do their best to make up for it.

    They respect bounds and curvature, which standard errors do not: an open end is infinite, a lower end at zero is the
    physical bound. Parameters as `fit_system`; name of each free parameter to its value and interval [SI].
    """
    problem = fitted_problem(points, loss, fit)
    least = problem.best()[1]
    # what has no weight in the fit moves its answer all the same
    wider = np.diag(fit.covariance) / np.diag(fit.nominal_covariance)
    return {
        n: _profile(problem, n, fit, least + float(w) * t_factor(fit.freedom[n]) ** 2)
        for n, w in zip(fit.names, wider, strict=True)
    }


def _profile(problem: Problem, name: str, fit: FrictionFit, allowed: float) -> Estimate:
    value = getattr(fit.y, name)
    step = fit.sd(name)
    step = step if math.isfinite(step) and step > 0.0 else max(abs(value), 1e-12)
    least, most = (Y_4_LEAST, Y_4_MOST) if name == "Y_4" else (0.0, math.inf)

    def excess(at: float) -> float:
        return problem.best({name: at}, fine=FINE)[1] - allowed

    return Estimate(value, _end(excess, value, -step, least), _end(excess, value, step, most))


def _end(excess: Callable[[float], float], value: float, step: float, bound: float) -> float:
    """Where the profile crosses the threshold; the bound where it does not before."""
    from scipy.optimize import brentq

    inside, factor = value, 1.0
    for _ in range(SEARCH):
        at = value + factor * step
        beyond = at <= bound if step < 0.0 else at >= bound
        if beyond:
            if not math.isfinite(bound) or excess(bound) <= 0.0:
                return bound
            at = bound
        if excess(at) > 0.0:
            return float(brentq(excess, *sorted((inside, at)), xtol=ENDS * abs(at - inside), rtol=1e-9))
        inside, factor = at, 2.0 * factor
    return math.copysign(math.inf, step)


def correlation(fit: FrictionFit) -> FloatArray:
    """Shape (k, k): correlation of the free parameters."""
    sd = np.sqrt(np.diag(fit.covariance))
    return np.asarray(fit.covariance / np.outer(sd, sd))


def shift_by_motor(points: Points, fit: FrictionFit, names: tuple[str, ...], matrix: FloatArray) -> FloatArray:
    """Shape (k,): by how much the uncertainty of the motor's loss moves the free parameters (standard errors, SI).

    Parameters: names and covariance matrix of the motor's own parameters X_1 to X_5. A wrong motor loss is not scatter:
    it shifts the system friction at every point alike, so no number of points averages it out. To first order.
    """
    fitted_points = points.fitted()
    moved = _whitened(fit, motor_columns(fitted_points)[:, [X_NAMES.index(n) for n in names]])
    G = fit.covariance @ _whitened(fit, jacobian(fitted_points, fit.y, fit.names)).T @ moved
    return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", G, matrix, G), 0.0)))


def _whitened(fit: FrictionFit, A: FloatArray) -> FloatArray:
    from scipy.linalg import solve_triangular

    return np.asarray(solve_triangular(fit.noise.root, A, lower=True))


EQUAL = 0.02
"""Smallest singular value of the scaled sensitivities below which parameters are distinguished only by two per cent of
their effect."""
SHARE = 0.3  # of a blind direction: parameters that take part in it


def blind_directions(points: Points, fit: FrictionFit) -> tuple[tuple[str, ...], ...]:
    """Sets of free parameters whose effects the design of the campaign cannot distinguish, whatever the noise.

    The test is the smallest singular values of the sensitivities, each column scaled to unit size.
    """
    fitted_points = points.fitted()
    J = jacobian(fitted_points, fit.y, fit.names) / fit.noise.sigma[:, None]
    _, s, V = scaled_directions(J)
    blind = [row for value, row in zip(s, V, strict=True) if value < EQUAL]
    return tuple(tuple(n for n, v in zip(fit.names, row, strict=True) if abs(v) > SHARE) for row in blind)
