"""How far identified friction can be trusted: profile likelihood, bootstrap, posterior samples, and what data cannot
separate.

Cranes drawn from the uncertainty of their friction, to run side by side in `simulate`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
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
    Y_NAMES,
    Loss,
    Points,
    Y,
    motor_columns,
    motor_loss_at,
    system_friction_at,
)
from stillhook.library.draws import crane_with as crane_with
from stillhook.library.draws import draw, with_friction, with_loss
from stillhook.library.parameter_sets import FrictionSet, LossSet
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate, t_factor

if TYPE_CHECKING:
    import xarray


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


def bootstrap(points: Points, loss: Loss, fit: FrictionFit, *, n: int = 400, seed: int = 0) -> FloatArray:
    """Shape (n, 6): parameters (Y_1 to Y_6, SI) fitted to n redrawn campaigns.

    Each is the fitted friction plus errors that go together in time as those of the campaign do, of a size drawn from
    what the degrees of freedom leave open; what has no weight in the fit is added to the answer; bounds act on every
    one as they did on the fit.
    """
    problem = fitted_problem(points, loss, fit)
    model = system_friction_at(problem.points, fit.y)
    rng = np.random.default_rng(seed)
    dof = min(fit.freedom.values(), default=fit.dof)
    sizes = np.sqrt(dof / rng.chisquare(dof, n))
    fitted = np.array(
        [problem.best(T=model + size * (problem.sigma @ rng.standard_normal(len(model))))[0] for size in sizes]
    )
    free = [Y_NAMES.index(name) for name in fit.names]
    fitted[:, free] = _bounded(fitted[:, free] + _without_weight(fit, n, dof, rng), fit)
    return fitted


def posterior(points: Points, loss: Loss, fit: FrictionFit, *, n: int = 4000, seed: int = 0) -> FloatArray:
    """Shape (n, 6): samples of the posterior with flat priors inside the bounds, by emcee (optional extra ``mcmc``).

    The size of the errors is integrated out (Student's density with the degrees of freedom of the fit); what has no
    weight in the fit is added to the samples, and bounds act on the sum.

    Errors: IdentifyError where emcee is not installed.
    """
    try:
        import emcee
    except ImportError:
        raise IdentifyError('Posterior samples need emcee. Install it with: pip install "stillhook[mcmc]".') from None
    problem = fitted_problem(points, loss, fit)
    start, size = np.array([getattr(fit.y, n) for n in fit.names]), np.sqrt(np.diag(fit.covariance))
    walkers, rng = 4 * len(fit.names), np.random.default_rng(seed)
    least, dof = problem.best()[1], float(min(fit.freedom.values(), default=fit.dof))
    blank = fit.y._asdict()

    stopped: list[bool] = []

    def log_probability(x: FloatArray) -> float:
        try:
            return density(x)
        except KeyboardInterrupt:  # emcee would print its own traceback
            stopped.append(True)
            return -math.inf

    def density(x: FloatArray) -> float:
        y = Y(**{**blank, **dict(zip(fit.names, x, strict=True))})
        if np.any(x < 0.0) or not Y_4_LEAST <= y.Y_4 <= Y_4_MOST:
            return -math.inf
        beyond = float(np.sum(problem.whitened(problem.T - system_friction_at(problem.points, y)) ** 2)) - least
        return -0.5 * (dof + len(x)) * math.log1p(max(beyond, 0.0) / dof)

    places = np.abs(start + 0.5 * size * rng.standard_normal((walkers, len(start))))
    at = fit.names.index("Y_4") if "Y_4" in fit.names else None
    if at is not None:
        places[:, at] = np.clip(places[:, at], 1.01 * Y_4_LEAST, 0.99 * Y_4_MOST)  # starting places only
    sampler = emcee.EnsembleSampler(walkers, len(start), log_probability)
    sampler.random_state = np.random.RandomState(seed).get_state()  # emcee's own kind of generator
    burn, draws = 400, max(1, -(-n // walkers))
    for _ in sampler.sample(places, iterations=burn + 10 * draws, skip_initial_state_check=True):
        if stopped:
            raise KeyboardInterrupt
    flat = sampler.get_chain(discard=burn, thin=10, flat=True)[:n]
    flat = _bounded(flat + _without_weight(fit, len(flat), dof, rng), fit)
    return np.array(
        [[dict(zip(fit.names, row, strict=True)).get(name, blank[name]) for name in Y_NAMES] for row in flat]
    )


def _bounded(x: FloatArray, fit: FrictionFit) -> FloatArray:
    """Free parameters (n, k) held within what they can be."""
    low = [Y_4_LEAST if name == "Y_4" else 0.0 for name in fit.names]
    return np.asarray(np.clip(x, low, [Y_4_MOST if name == "Y_4" else math.inf for name in fit.names]))


def _without_weight(fit: FrictionFit, n: int, dof: float, rng: np.random.Generator) -> FloatArray:
    """Shape (n, k): draws of the errors of the free parameters that have no weight in the fit."""
    values, axes = np.linalg.eigh(fit.covariance - fit.nominal_covariance)
    samples = rng.standard_normal((n, len(values))) * np.sqrt(np.maximum(values, 0.0)) @ axes.T
    return np.asarray(samples * np.sqrt(dof / rng.chisquare(dof, n))[:, None])


def quantile_intervals(samples: FloatArray, fit: FrictionFit) -> dict[str, Estimate]:
    """Intervals from samples of `bootstrap` or `posterior`."""
    return {
        n: Estimate.of_draws(getattr(fit.y, n), samples[:, i], len(samples))
        for i, n in enumerate(Y_NAMES)
        if n in fit.names
    }


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


MOST = 10_000
"""Draws at most: a crane takes a few milliseconds to build."""
BAND = 0.9
"""Share of the draws inside a printed band."""


def draw_cranes(
    crane: Crane, friction_set: FrictionSet | None = None, loss_set: LossSet | None = None, n: int = 64, seed: int = 0
) -> list[Crane]:
    """Cranes that differ in what the evidence of their friction leaves open; the rest of the crane is unchanged.

    Parameters
    ----------
    crane: the machine. friction_set: its system friction, see `stillhook.library.load_friction`; loss_set: its motors'
    loss, for every circuit with motors of that size. Parameters without a covariance keep the value of the set.
    n, seed: how many draws, and from which seed; the same seed gives the same cranes.

    The parameters are drawn from the normal distribution of the set's covariance; draws with a value that physics does
    not allow (a negative friction; Y_4 of 0) are drawn again, none is clipped. So the distribution is truncated, and
    its mean is next to the set's values where one of them is near zero.

    Use: ``simulate(draw_cranes(crane, load_friction("my.friction.toml")), case)``.
    Errors: IdentifyError of one line where a set has no evidence, or hardly any draw is allowed.
    """
    if friction_set is None and loss_set is None:
        raise IdentifyError("draw_cranes: no set. Give a friction set, a loss set, or both, with evidence.")
    if type(n) is not int or not 1 <= n <= MOST:
        raise IdentifyError(f"n = {n!r}: give a whole number of draws from 1 to {MOST}.")
    streams = np.random.SeedSequence(seed).spawn(2)
    out = [crane] * n
    names = [f"draw {i} of {n} (seed {seed})" for i in range(n)]
    if friction_set is not None:
        samples = draw(friction_set, n, np.random.default_rng(streams[0]))
        out = [with_friction(out[i], friction_set, samples, i, name) for i, name in enumerate(names)]
    if loss_set is not None:
        samples = draw(loss_set, n, np.random.default_rng(streams[1]))
        out = [with_loss(out[i], loss_set, samples, i, name) for i, name in enumerate(names)]
    return out


def quantiles(run: xarray.Dataset, names: Sequence[str] = ("e_c_pp", "p_max")) -> dict[str, dict[str, float]]:
    """Median and 90 % band of the summary numbers that the winch type has, over the draws [SI]: name -> low, median,
    high."""
    edge = 0.5 * (1.0 - BAND)
    out = {}
    for name in (name for name in names if name in run):
        values = run[name].values
        values = values[np.isfinite(values)]  # a diverged draw has no numbers, and manual mode no error
        ends = np.quantile(values, (edge, 0.5, 1.0 - edge)) if len(values) else np.full(3, np.nan)
        low, median, high = (float(x) for x in ends)
        out[name] = {"low": low, "median": median, "high": high}
    return out
