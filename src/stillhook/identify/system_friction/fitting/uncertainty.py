"""How far identified friction can be trusted: profile likelihood, what data cannot separate, and what to test next: the
staircases that shrink the uncertainty of predicted friction most.

Each candidate (load, displacement) adds the information of its staircase of speeds to that of the campaign; the gain is
judged where the crane works: mean variance of the predicted friction over loads, displacements and speeds
(I-optimality). The best is taken, then the next best with it, and so on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import IdentifyError
from stillhook.identify.system_friction.campaign import Campaign
from stillhook.identify.system_friction.fitting.fit import (
    Y_4_LEAST,
    Y_4_MOST,
    FrictionFit,
    Problem,
    Target,
    jacobian,
    scaled_directions,
    sigma_of,
)
from stillhook.identify.system_friction.fitting.model import (
    Y_NAMES,
    Loss,
    Points,
    Y,
    joined,
    motor_columns,
    motor_loss_at,
    system_friction,
)
from stillhook.physics.load_path.drum import layer_diameter
from stillhook.physics.scalar import G
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.units import parse
from stillhook.winches.circuits.tables import Motor

FINE, ENDS = 1e-4, 1e-3
"""How well ln Y_4 is found within a profile, and the end of an interval, over the last step towards it."""
SEARCH = 40  # doublings of an interval's end before it counts as open
EQUAL = 0.02
"""Smallest singular value of the scaled sensitivities below which parameters are distinguished only by two per cent of
their effect."""
SHARE = 0.3  # of a blind direction: parameters that take part in it
STAIRCASE = tuple(parse(f"{n} rev/min", "rotation") for n in (30, 60, 90, 130, 180, 250, 350, 500, 650, 800, 1000))
"""Speeds of a proposed staircase [rad/s]: dense where break-away friction fades."""
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
DISPLACEMENTS = (1.0, 0.8, 0.65, 0.5)
LEAST_SD = 5.0e3
"""Scatter assumed for a new pair where the campaign shows less [Pa]: 0.05 bar, what a good sensor repeats."""
ANYTHING = 1e3
"""Uncertainty of a friction torque that means that nothing is known [N m]: ten times the friction of any motor here."""
UNKNOWN = 1e-12
"""Share of the prior information that represents knowing nothing about a parameter (keeps the matrix invertible)."""


def profile_intervals(points: Points, loss: Loss, fit: FrictionFit) -> dict[str, Estimate]:
    """Intervals by profile likelihood: how far one parameter can go while the others compensate as far as they can.

    They respect bounds and curvature, which standard errors do not: an open end is infinite, a lower end at zero is the
    physical bound. Parameters as `fit_system`; name of each free parameter to its value and interval [SI].
    """
    fitted_points = points.fitted()
    target = Target(fitted_points, fitted_points.T_f - motor_loss_at(fitted_points, loss))
    problem = Problem(target, fit.noise.root, fit.linear, fit.prescribed, fit.noise.shift)
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


def shift_by_motor(points: Points, fit: FrictionFit, of: Motor, names: Sequence[str], matrix: FloatArray) -> FloatArray:
    """Shape (k,): by how much the uncertainty of the motor's loss moves the free parameters (standard errors, SI).

    Parameters: names and covariance matrix of the parameters of the motor's loss. A wrong motor loss is not scatter:
    it shifts the system friction at every point alike, so no number of points averages it out. To first order.
    """
    fitted_points = points.fitted()
    moved = _whitened(fit, motor_columns(fitted_points, of, names))
    G = fit.covariance @ _whitened(fit, jacobian(fitted_points, fit.y, fit.names)).T @ moved
    return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", G, matrix, G), 0.0)))


def _whitened(fit: FrictionFit, A: FloatArray) -> FloatArray:
    from scipy.linalg import solve_triangular

    return np.asarray(solve_triangular(fit.noise.root, A, lower=True))


def blind_directions(points: Points, fit: FrictionFit) -> tuple[tuple[str, ...], ...]:
    """Sets of free parameters whose effects the design of the campaign cannot distinguish, at any noise.

    The test is the smallest singular values of the sensitivities, each column scaled to unit size.
    """
    fitted_points = points.fitted()
    J = jacobian(fitted_points, fit.y, fit.names) / fit.noise.sigma[:, None]
    _, s, V = scaled_directions(J)
    blind = [row for value, row in zip(s, V, strict=True) if value < EQUAL]
    return tuple(tuple(n for n, v in zip(fit.names, row, strict=True) if abs(v) > SHARE) for row in blind)


@dataclass(frozen=True)
class Proposal:
    """One staircase to run: load on the hook [kg], displacement of one motor [m^3/rad]; ``sd_before``, ``sd_after``
    root mean square standard error of the predicted system friction over the working range, in N m per motor shaft;
    None where nothing is known."""

    load: float
    D_m: float
    sd_before: float | None
    sd_after: float | None


def propose(campaign: Campaign, points: Points, loss: Loss, fit: FrictionFit, *, n: int = 3) -> tuple[Proposal, ...]:
    """The n staircases worth most, in the order in which to run them, no two alike.

    Loads from the empty hook to SWL and displacements down to half of the full one are candidates, as far as the active
    circuit's relief pressure allows. Errors: IdentifyError where no candidate can be run.
    """
    names = tuple(n for n in Y_NAMES if n != "Y_2" or n in fit.names)  # what is not known yet is what tests are for
    sigma = max(float(np.sqrt(fit.tau**2 + np.median(points.u_dp) ** 2)), LEAST_SD)
    d = _diameter(campaign, points)
    range_ = joined(
        [_staircase(campaign, loss, fit, s * campaign.crane.SWL, campaign.motor.D_max, d, sigma) for s in SHARES]
    )
    goal = jacobian(range_, _evaluation_point(fit), names)
    information = _information(points.fitted(), fit, names, fit.tau)
    a = campaign.crane.active
    designs = [(s * campaign.crane.SWL, part * campaign.motor.D_max) for s in SHARES for part in DISPLACEMENTS]
    stairs = [(*design, _staircase(campaign, loss, fit, *design, d, sigma)) for design in designs]
    candidates = [c for c in stairs if float(c[-1].dp_up.max()) < a.relief.p - a.boost.p]
    if not candidates:
        raise IdentifyError(
            "No staircase can be proposed: even the empty hook is beyond the relief pressure at every displacement."
        )
    worth = [_information(c, fit, names, 0.0) for *_, c in candidates]
    out: list[Proposal] = []
    chosen: set[int] = set()
    for _ in range(min(n, len(candidates))):
        before = _rms(goal, information)
        after = [math.inf if k in chosen else _rms(goal, information + w) for k, w in enumerate(worth)]
        best = int(np.argmin(after))
        chosen.add(best)
        load, D_m, _ = candidates[best]
        out.append(Proposal(load, D_m, *(sd if sd < ANYTHING else None for sd in (before, after[best]))))
        information = information + worth[best]
    return tuple(out)


def _evaluation_point(fit: FrictionFit) -> Y:
    """The fitted parameters, with a little break-away friction where none was found, so that Y_4 has an effect."""
    y = fit.y
    return y._replace(Y_3=max(y.Y_3, 0.1)) if y.Y_1 <= 0.0 and y.Y_3 <= 0.0 else y


def _information(points: Points, fit: FrictionFit, names: tuple[str, ...], tau: float) -> FloatArray:
    J = jacobian(points, _evaluation_point(fit), names) / sigma_of(points, tau)[:, None]
    return np.asarray(J.T @ J)


def _rms(goal: FloatArray, information: FloatArray) -> float:
    """Root mean square of the predicted standard errors."""
    size = np.sqrt(np.diag(information))
    size[size == 0.0] = 1.0  # nothing is known of it: UNKNOWN alone applies
    scaled = information / np.outer(size, size) + UNKNOWN * np.eye(len(size))
    half = np.linalg.solve(scaled, (goal / size).T)
    return math.sqrt(float(np.mean(np.sum((goal / size).T * half, axis=0))))


def _diameter(campaign: Campaign, points: Points) -> float:
    """Layer of the campaign's tests: new ones are proposed on the same."""
    for test in campaign.tests:
        d = campaign.diameter(test)
        if d is not None:
            return d
    weights = [campaign.weight(t) for t in campaign.tests]
    if len(points):
        return float(2.0 * np.mean(points.T_d) / np.mean([weights[i] for i in points.test]))
    return float(layer_diameter(float(campaign.crane.drum.layers), drum_record(campaign.crane)))


def _staircase(
    campaign: Campaign, loss: Loss, fit: FrictionFit, load: float, D_m: float, d: float, sigma: float
) -> Points:
    omega, T_d = np.array(STAIRCASE), (load + campaign.crane.hook_mass) * G * 0.5 * d
    dp_L = T_d / campaign.crane.i_hD / (campaign.count * D_m)
    D, torque, at = (np.full(len(omega), x) for x in (D_m, T_d, dp_L))
    dp_F = (loss(omega, D, at) + system_friction(omega, torque, fit.y)) / D
    dp = np.stack([at + dp_F, at - dp_F])
    return Points.planned(omega, T_d, D_m, dp=dp, count=float(campaign.count), u_dp=sigma)
