"""What neighbouring stretches of a test share: the drifting zero of the pressure transmitters, and oil that warms up.

Stretch j of a test reads dp_j = load + s_j F_j + z(t_j) + noise, s_j = +1 hoisting, -1 lowering, z(t) the zero of p_a -
p_b. Half the difference of a pair keeps (z(t_up) - z(t_down)) / 2; half the sum keeps the load and (z(t_up) +
z(t_down)) / 2: the load of a test does not change, so the sums show the drift. Differences and sums of all pairs are
one linear mixed model; its variances are estimated by restricted maximum likelihood (Patterson and Thompson, Biometrika
58, 1971), and given the sums the differences keep a mean error, which is taken off, and a covariance, with which the
friction is fitted.

Friction that varies with time alone (oil that warms up while the speeds of a staircase rise) cannot be distinguished
from friction that varies with speed. It is not corrected and has no weight in the fit, but it is in the variance of
everything that the fit finds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.system_friction.fitting.model import (
    Loss,
    Points,
    Y,
    motor_loss_at,
    system_friction,
    system_friction_at,
)

DP_FLOOR = 1.0
"""Least standard uncertainty of a friction pressure [Pa]: a hundred-thousandth of a bar, so that noise-free data keep
their numbers."""
PAIR, LOAD, WALK, BEND = "pair", "load", "walk", "bend"
LEVEL, PAIRWISE, WARM, COURSE, FORM = "level", "own", "warm", "course", "form"
"""Variances of the model: scatter of a pair's difference, and of its sum [Pa^2]; a random walk and a once integrated
random walk of the zero [Pa^2 over the length of a test]; over the mean friction: that of a complete test, its slope
over half a test as it is of one test alone, and as it is alike in all tests, its curvature, and what the form of the
law lacks at neighbouring
speeds."""
WITHOUT_WEIGHT = (LEVEL, PAIRWISE, WARM, COURSE, FORM)
"""Variances that the fit gives no weight to."""
NEIGHBOURS = 0.8
"""Difference of ln speed over which what the law lacks stays alike: a factor of two; break-away friction fades over
about as much."""
CURVED = 0.15
"""Variance of the curvature of the course that is alike in all tests over that of its slope: an exponential warm-up
over half a test."""
NOT_NONE = (PAIRWISE, WARM)
"""Variances that are not taken for none where friction does vary with test or time: their likelihood is multiplied by
their root, so that one that the campaign hardly shows comes out at about its own standard error (Chung and others,
Psychometrika 78,
2013)."""
GOES_WITH_TIME = 0.5
"""Share of the differences' variance that must be friction that varies with test or time for that."""
FAINT = 0.15
"""Power of the same root where it is not: oil that warms too little to be seen (friction falls by 0.1 to 1.5 % over a
test) moves the answer by more than scatter does, so that it is never certain that none of it is there. With 0 such
campaigns have 80 % of the curve in their bands; with 1 campaigns without any warming have all of it, in bands wider
than needed."""
THIRD = 0.25
"""Variance of the third Legendre polynomial of the course over that of the second, as in an exponential warm-up over
half a test."""
FEWEST_TESTS = 3
"""Tests below which the friction of a complete test contains nothing about their scatter."""
NOTHING = 1e-7
"""Variance over its first guess that counts as none."""
NEGLIGIBLE = 1e-4
"""Share of the mean variance below which one of its parts is left out."""
LEAST_FREEDOM = 5.0
"""Least degrees of freedom of an interval. A course that is alike in all tests is a single piece whose size, not its
sign, is known: its root mean square already is its size, so Student's factor for one piece would count it many
times."""


@dataclass(frozen=True)
class Noise:
    """What the fitted points do not know of the friction.

    ``shift`` mean error of the friction torque that the sums of pressure show, to be taken off [N m], shape (n,);
    ``root`` lower triangular root of the covariance of what is left, as the fit weighs it [N m], (n, n); ``sd`` roots
    of the variances by name; ``gain`` of the differences' mean error by the sums, (n, n); ``rows`` the model,
    ``values`` its variances in the order of ``rows.names``, ``joint`` its design (columns of unit size).
    """

    shift: FloatArray
    root: FloatArray
    sd: Mapping[str, float]
    gain: FloatArray
    rows: Rows
    values: FloatArray
    joint: FloatArray

    @property
    def zero_drift(self) -> float:
        """Standard deviation of the drift of the zero from one end of a test to the other [Pa]."""
        bend = _integrated(np.array([1.0, 2.0]), np.array([[1.0], [2.0]]))
        part = float(bend[0, 0] + bend[1, 1] - 2.0 * bend[0, 1])
        return float(np.sqrt(self.sd.get(WALK, 0.0) ** 2 + part * self.sd.get(BEND, 0.0) ** 2))

    @property
    def friction_drift(self) -> float:
        """Standard deviation of the friction that varies with test or time, over the mean friction."""
        return float(np.sqrt(sum(self.sd.get(m, 0.0) ** 2 for m in WITHOUT_WEIGHT)))

    @property
    def sigma(self) -> FloatArray:
        """Standard uncertainty of the friction torque at every point, what has no weight in the fit included [N m]."""
        n = len(self.rows.points)
        beyond = np.diag(self.beyond)[:n] * self.rows.points.D_m**2
        return np.asarray(np.sqrt(np.sum(self.root**2, axis=1) + beyond))

    @property
    def beyond(self) -> FloatArray:
        """Covariance of differences and sums that has no weight in the fit [Pa^2]."""
        return np.asarray(self.rows.of(self.values) - self.rows.of(self.values, weights=True))


class Rows:
    """Covariances of the differences (first n rows) and of the sums (next n rows) of pressure by the model's variances
    [Pa^2].

    Parameters: points fitted ones, shape (n,); friction what the models make of them, per motor shaft [N m], shape
    (n,). Points without times have no sums: their differences are independent.
    """

    def __init__(self, points: Points, friction: FloatArray) -> None:
        n = len(points)
        self.points = points
        self.timed = bool(n) and bool(np.all(np.isfinite(points.t_up) & np.isfinite(points.t_down)))
        pair_variance = points.u_dp**2 + DP_FLOOR**2
        g = friction / points.D_m
        same = points.test[:, None] == points.test[None, :]
        if not self.timed:
            self.pair_variance = np.diag(pair_variance)
            self.names: tuple[str, ...] = (PAIR,)
            self.parts = [np.eye(n)]
            self.fixed = np.zeros((n, 0))
            return
        zero = np.zeros((n, n))
        self.pair_variance = np.diag(np.concatenate([pair_variance, pair_variance]))
        self.names = (PAIR, LOAD, WALK, BEND, LEVEL, PAIRWISE, WARM, COURSE, FORM)
        t_up, t_down = _relative(points)
        twice = np.concatenate([t_up, t_down])
        mates = np.tile(same, (2, 2))
        half = 0.5 * np.block([[np.eye(n), -np.eye(n)], [np.eye(n), np.eye(n)]])
        walk = np.where(mates, np.minimum(twice[:, None], twice[None, :]), 0.0)
        bend = np.where(mates, _integrated(1.0 + twice[:, None], 1.0 + twice[None, :]), 0.0)
        parts = [np.block([[np.eye(n), zero], [zero, zero]]), np.block([[zero, zero], [zero, np.eye(n)]])]
        parts += [half @ k @ half.T for k in (walk, bend)]
        g2 = np.concatenate([g, -g])  # hoisting feels friction with one sign, lowering with the other
        x = 2.0 * twice - 1.0
        level = np.outer(np.concatenate([g, np.zeros(n)]), np.concatenate([g, np.zeros(n)])) * np.tile(same, (2, 2))
        first, second, third = _legendre(x)
        alike = half @ np.column_stack([g2 * first, g2 * second, np.sqrt(THIRD) * g2 * third])
        slope, curve = np.outer(alike[:, 0], alike[:, 0]), alike[:, 1:] @ alike[:, 1:].T
        parts += [level, slope * np.tile(same, (2, 2)), slope + CURVED * curve, curve]
        v = np.log(points.omega)
        form = np.outer(g, g) * np.exp(-0.5 * ((v[:, None] - v[None, :]) / NEIGHBOURS) ** 2)
        parts.append(np.block([[form, zero], [zero, zero]]))
        if len(np.unique(points.test)) < FEWEST_TESTS:
            parts = [p for m, p in zip(self.names, parts, strict=True) if m != LEVEL]
            self.names = tuple(m for m in self.names if m != LEVEL)
        self.parts = parts
        self.fixed = np.concatenate([np.zeros((n, len(np.unique(points.test)))), _loads(points)])

    def of(self, values: FloatArray, *, weights: bool = False) -> FloatArray:
        """The covariance with these variances; weights: without what the fit gives no weight to."""
        if weights:
            values = np.where([m in WITHOUT_WEIGHT for m in self.names], 0.0, values)
        out = self.pair_variance.copy()
        for value, part in zip(values, self.parts, strict=True):
            if value > 0.0:
                out += value * part
        return np.asarray(out)


def _relative(points: Points) -> tuple[FloatArray, FloatArray]:
    """Times of both stretches, from 0 to 1 over each test."""
    up, down = points.t_up.copy(), points.t_down.copy()
    for k in np.unique(points.test):
        of_test = points.test == k
        first = min(up[of_test].min(), down[of_test].min())
        length = max(up[of_test].max(), down[of_test].max()) - first
        up[of_test], down[of_test] = ((t[of_test] - first) / max(length, 1e-9) for t in (up, down))
    return up, down


def _integrated(s: FloatArray, t: FloatArray) -> FloatArray:
    """Covariance of an integrated random walk that began at rest at 0."""
    low, high = np.minimum(s, t), np.maximum(s, t)
    return np.asarray(low**2 * (3.0 * high - low) / 6.0)


def _legendre(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return x, 1.5 * x**2 - 0.5, 2.5 * x**3 - 1.5 * x


def _loads(points: Points) -> FloatArray:
    """Shape (n, tests): the pressure of each test's load up to a factor of the test; it changes with layer and
    displacement only."""
    out = np.zeros((len(points), len(np.unique(points.test))))
    for j, k in enumerate(np.unique(points.test)):
        of_test = points.test == k
        shape = points.T_d[of_test] / points.D_m[of_test]
        out[of_test, j] = shape / shape.mean() if shape.mean() > 0.0 else 1.0
    return out


def sums(points: Points, loss: Loss, y: Y) -> FloatArray:
    """Half the sum of both pressures, less half the difference of the two frictions that the models have there [Pa],
    shape (n,)."""
    up = loss(points.omega_up, points.D_m, points.dp_up) + system_friction(points.omega_up, points.T_d, y)
    down = loss(points.omega_down, points.D_m, points.dp_down) + system_friction(points.omega_down, points.T_d, y)
    return points.dp_L - 0.5 * (up - down) / points.D_m


def noise_of(
    points: Points,
    loss: Loss,
    y: Y,
    J: FloatArray,
    start: Mapping[str, float] | None = None,
) -> Noise:
    """Variances of the model from what a fit leaves over.

    Parameters: points fitted ones; loss of one motor shaft; y parameters of the fit; J change of the friction torque
    per change of its free parameters, shape (n, k); start standard deviations from which to begin (None: from the size
    of what is left).
    """
    friction = motor_loss_at(points, loss) + system_friction_at(points, y)
    rows = Rows(points, friction)
    residual = points.dp_F - friction / points.D_m
    data = np.concatenate([residual, sums(points, loss, y)]) if rows.timed else residual
    free = np.concatenate([J / points.D_m[:, None], np.zeros_like(J)]) if rows.timed else J / points.D_m[:, None]
    X = _scaled(np.concatenate([free, rows.fixed], axis=1))
    guess = _guess(rows, data, X)
    begin = guess if start is None else np.array([start[n] ** 2 for n in rows.names])
    values = _reml(rows, data, X, guess, begin)
    return _noise(rows, data, values, X)


def _scaled(X: FloatArray) -> FloatArray:
    size = np.linalg.norm(X, axis=0)
    return np.asarray(X[:, size > 0.0] / size[size > 0.0])


def _guess(rows: Rows, data: FloatArray, X: FloatArray) -> FloatArray:
    """Variances that each alone would explain a share of what is left."""
    n = len(rows.points)
    residual = data - X @ np.linalg.lstsq(X, data, rcond=None)[0]
    both = [float(np.mean(residual[:n] ** 2)), float(np.mean(residual[n:] ** 2)) if rows.timed else 0.0]
    out = []
    for name, part in zip(rows.names, rows.parts, strict=True):
        i = 1 if name in (LOAD, WALK, BEND) else 0
        share = float(np.mean(np.diag(part)[i * n : (i + 1) * n]))
        out.append(max(both[i], DP_FLOOR**2) / max(share, 1e-300) / 3.0)
    return np.array(out)


def _reml(rows: Rows, data: FloatArray, X: FloatArray, guess: FloatArray, begin: FloatArray) -> FloatArray:
    """Variances of the largest restricted likelihood."""
    from scipy.optimize import minimize

    n, fixed = len(rows.points), np.zeros(len(rows.names))

    def objective(log: FloatArray) -> tuple[float, FloatArray]:
        values = guess * np.exp(log)
        S = rows.of(values)
        P, deviance = _projector(S, X)
        Py = P @ data
        slope = np.array(
            [v * (float(np.sum(P * part)) - float(Py @ part @ Py)) for v, part in zip(values, rows.parts, strict=True)]
        )
        return deviance + float(data @ Py) - float(fixed @ log), slope - fixed

    low, high = float(np.log(NOTHING)), 12.0
    first = np.clip(np.log(np.maximum(begin, 0.1 * NOTHING * guess) / guess), low + 5.0, high)
    limits, stop = [(low, high)] * len(first), {"maxiter": 40, "ftol": 1e-6}
    optimum = minimize(objective, first, jac=True, method="L-BFGS-B", bounds=limits, options=stop)
    values = guess * np.exp(optimum.x)
    parts = values * np.array([float(np.mean(np.diag(part)[:n])) for part in rows.parts])
    slow = np.array([m in WITHOUT_WEIGHT for m in rows.names])
    if slow.any():
        shown = float(parts[slow].sum()) > GOES_WITH_TIME * float(
            parts.sum() + np.mean(np.diag(rows.pair_variance)[:n])
        )
        fixed = np.array([(1.0 if shown else FAINT) * float(m in NOT_NONE) for m in rows.names])
        optimum = minimize(
            objective, np.maximum(optimum.x, low + 5.0), jac=True, method="L-BFGS-B", bounds=limits, options=stop
        )
        values = guess * np.exp(optimum.x)
    shares = values * np.array([float(np.mean(np.diag(part))) for part in rows.parts])
    return np.asarray(np.where(shares < NEGLIGIBLE * float(np.mean(np.diag(rows.of(values)))), 0.0, values))


def _projector(S: FloatArray, X: FloatArray) -> tuple[FloatArray, float]:
    """P = S^-1 - S^-1 X (X' S^-1 X)^-1 X' S^-1, and log|S| + log|X' S^-1 X|."""
    from scipy.linalg.lapack import dpotri

    root = np.linalg.cholesky(S)
    inverse, _ = dpotri(root, lower=1)
    inverse = np.tril(inverse) + np.tril(inverse, -1).T
    A = inverse @ X
    inner = X.T @ A
    inner[np.diag_indices_from(inner)] *= 1.0 + 1e-12
    sign, size = np.linalg.slogdet(inner)
    P = inverse - A @ np.linalg.pinv(inner, hermitian=True) @ A.T
    return P, 2.0 * float(np.sum(np.log(np.diag(root)))) + (float(size) if sign > 0 else 0.0)


def _noise(rows: Rows, data: FloatArray, values: FloatArray, X: FloatArray) -> Noise:
    """Mean and covariance of the differences' error, given the sums."""
    n, S = len(rows.points), rows.of(values, weights=True)
    D, gain, C = rows.points.D_m, np.zeros((len(rows.points), len(rows.points))), S
    if rows.timed:
        P, _ = _projector(S[n:, n:], rows.fixed[n:])
        gain = S[:n, n:] @ P
        C = S[:n, :n] - gain @ S[n:, :n]
    shift = gain @ data[n:] if rows.timed else np.zeros(n)
    root = np.linalg.cholesky(0.5 * (C + C.T)) * D[:, None]
    return Noise(
        shift * D, root, {m: float(np.sqrt(v)) for m, v in zip(rows.names, values, strict=True)}, gain, rows, values, X
    )


def spread(noise: Noise, weights: FloatArray, within: FloatArray) -> FloatArray:
    """Covariance of what a fit finds, the part that it gave no weight to included.

    Parameters: weights of the points' friction torques in the k numbers found [SI / N m], shape (k, n); within their
    covariance as the fit's own weights have it, (k, k).
    """
    a = _of_pressures(noise, weights)
    return np.asarray(within + a @ noise.beyond @ a.T)


def freedom(noise: Noise, weights: FloatArray) -> FloatArray:
    """Degrees of freedom of the variance of each number that a fit finds, by Satterthwaite's rule, shape (k,).

    Parameters: weights as in `spread`. A variance that few independent pieces show is itself uncertain: with V the
    variance of an estimate, 2 V^2 over that of V (Giesbrecht and Burns, Biometrics 41, 1985).
    """
    rows, n = noise.rows, len(noise.rows.points)
    S = rows.of(noise.values)
    P, _ = _projector(S, noise.joint)
    active = [part for v, part in zip(noise.values, rows.parts, strict=True) if v > 0.0]
    most = float(max(n - noise.joint.shape[1] + rows.fixed.shape[1], 1))
    if not active:
        return np.full(len(weights), most)
    turned = [P @ part for part in active]
    information = 0.5 * np.array([[float(np.sum(a * b.T)) for b in turned] for a in turned])
    doubt = np.linalg.pinv(information, hermitian=True)
    out = []
    for a in _of_pressures(noise, weights):
        slope = np.array([float(a @ part @ a) for part in active])
        out.append(2.0 * float(a @ S @ a) ** 2 / max(float(slope @ doubt @ slope), 1e-300))
    return np.asarray(np.clip(np.array(out), LEAST_FREEDOM, most))


def _of_pressures(noise: Noise, weights: FloatArray) -> FloatArray:
    """Weights of the torques as weights of the differences, and of the sums that correct them, shape (k, n) or (k, 2
    n)."""
    differences: FloatArray = weights * noise.rows.points.D_m
    return np.asarray(
        np.concatenate([differences, -differences @ noise.gain], axis=1) if noise.rows.timed else differences
    )
