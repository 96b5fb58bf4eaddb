"""System friction from crane tests by bounded least squares that cannot miss the best answer.

With Y_4 given the model is linear in the other five parameters, none of which may be negative: that is one convex
problem with one answer (non-negative least squares). What is left is a search along Y_4 alone, made on a grid and then
refined. The thesis used a complex method on all six at once (`stillhook.identify.system_friction.thesis`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.system_friction.fitting.drift import DP_FLOOR, Noise, freedom, noise_of, spread
from stillhook.identify.system_friction.fitting.model import (
    Y_FADING,
    Y_LINEAR,
    Y_NAMES,
    Loss,
    Points,
    Y,
    motor_loss_at,
    system_columns,
    system_friction_at,
    system_slope,
)
from stillhook.units import parse

Y_4_LEAST, Y_4_MOST = parse("5 rev/min", "rotation"), parse("1500 rev/min", "rotation")
"""Bounds of the search: a winch does not run steadily below 5 rev/min of its motors, and an exponential that fades over
more than 1500 rev/min is a straight line over the speeds that it can reach, which Y_5 describes already."""
Y_4_GRID = np.geomspace(Y_4_LEAST, Y_4_MOST, 61)
EVIDENCE = 2.0
"""Improvement of AICc that a constant term Y_2 must bring to be kept (Burnham and Anderson's "substantial support" ends
there)."""
FADING = [Y_LINEAR.index(n) for n in Y_FADING]
ROUNDS = 2
"""Rounds of estimating variances and parameters in turn: a third changes the scatter by less than a thousandth."""


@dataclass(frozen=True)
class FrictionFit:
    """Identified system friction.

    ``y`` parameters in SI (a dropped one is 0); ``names`` those that were free; ``covariance`` of them in SI, in that
    order, taken as if bounds were not there (so never too small), ``nominal_covariance`` the part of it that the
    weights of the fit know; ``at_bound`` free ones that ended on zero, or Y_4 on an end of its range; ``dropped`` those
    left out (Y_4 too where nothing fades); ``prescribed`` those that keep a value; ``evidence`` by name, how much AICc
    improves with it (negative: worse); ``residual`` measured less modelled friction per shaft at the fitted points,
    what the sums of pressure show of the drifting zero taken off [N m]; ``tau`` scatter of dp_F beyond what the
    stretches themselves showed [Pa]; ``chi2`` whitened; ``dof`` degrees of freedom of the predicted friction,
    ``freedom`` by parameter (fewer than points less parameters where errors are correlated); ``noise`` how the points'
    errors are correlated.
    """

    y: Y
    names: tuple[str, ...]
    covariance: FloatArray
    nominal_covariance: FloatArray
    at_bound: tuple[str, ...]
    dropped: tuple[str, ...]
    prescribed: Mapping[str, float]
    evidence: Mapping[str, float]
    residual: FloatArray
    tau: float
    chi2: float
    dof: float
    freedom: Mapping[str, float]
    noise: Noise

    @property
    def linear(self) -> tuple[str, ...]:
        """Those free ones that the friction is linear in."""
        return tuple(n for n in Y_LINEAR if n in self.names)

    def sd(self, name: str) -> float:
        """Standard error of a free parameter in SI, NaN for one that was left out."""
        if name not in self.names:
            return math.nan
        i = self.names.index(name)
        return math.sqrt(self.covariance[i, i])


class Target:
    """Points and the friction per shaft that the system must explain there, ``T`` [N m]; the model's columns on the
    grid of Y_4 are kept, because they take most of a fit's time and do not depend on weights."""

    def __init__(self, points: Points, T: FloatArray) -> None:
        self.points, self.T = points, T
        self._steady = system_columns(points, Y_4_LEAST)
        self._columns: dict[float, FloatArray] = {}

    def columns(self, Y_4: float) -> FloatArray:
        """Shape (n, 5), as `system_columns`."""
        if Y_4 in self._columns:
            return self._columns[Y_4]
        all_columns = self._steady.copy()
        all_columns[:, FADING] = system_columns(self.points, Y_4, Y_FADING)
        if len(self._columns) < len(Y_4_GRID):
            self._columns[Y_4] = all_columns
        return all_columns


class Problem:
    """Generalised least squares in the five linear parameters, for any Y_4.

    ``sigma`` standard uncertainties of the target [N m], shape (n,), or the lower triangular root of its covariance,
    (n, n); ``used`` linear parameters that are free; ``prescribed`` parameters that keep a value [SI]; ``shift`` error
    of the target that is known and taken off [N m], shape (n,).
    """

    def __init__(
        self,
        target: Target,
        sigma: FloatArray,
        used: tuple[str, ...] = Y_LINEAR,
        prescribed: Mapping[str, float] | None = None,
        shift: FloatArray | None = None,
    ) -> None:
        self.target, self.sigma, self.used, self.prescribed = target, sigma, used, dict(prescribed or {})
        self.points, self.T = target.points, target.T if shift is None else target.T - shift
        self._b = self.whitened(self.T)
        self._reduced: dict[float, tuple[FloatArray, FloatArray, FloatArray, float]] = {}

    def whitened(self, A: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Rows (n,) or (n, k) as independent ones of unit variance; transposed: such rows as weights of the target."""
        if self.sigma.ndim == 1:
            return np.asarray(A / (self.sigma if A.ndim == 1 else self.sigma[:, None]))
        from scipy.linalg import solve_triangular

        trans = "T" if transposed else "N"
        return np.asarray(solve_triangular(self.sigma, A, lower=True, trans=trans, check_finite=False))

    def _at(self, Y_4: float) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """Of the whitened columns Q R: R, its columns' sizes, the whitened target along Q, and the square of what is
        outside Q."""
        if Y_4 in self._reduced:
            return self._reduced[Y_4]
        Q, R = np.linalg.qr(self.whitened(self.target.columns(Y_4)))
        size = np.linalg.norm(R, axis=0)
        size[size == 0.0] = 1.0
        q = Q.T @ self._b
        out = R, size, q, float(np.sum((self._b - Q @ q) ** 2))
        if len(self._reduced) < len(Y_4_GRID):
            self._reduced[Y_4] = out
        return out

    def _least(self, Y_4: float, free: list[int], fixed: Mapping[str, float]) -> tuple[FloatArray, float]:
        from scipy.optimize import nnls

        R, size, q, unexplained = self._at(Y_4)
        for name, value in fixed.items():
            q = q - value * R[:, Y_LINEAR.index(name)]
        if not free:
            return np.zeros(0), float(q @ q) + unexplained
        values, norm = nnls((R / size)[:, free], q)
        return values / size[free], float(norm) ** 2 + unexplained

    def best(self, fixed: Mapping[str, float] | None = None, *, fine: float = 1e-7) -> tuple[Y, float]:
        """Best parameters over all Y_4, and their chi^2; ``fixed`` ones (Y_4 too) keep these values [SI]; ``fine`` how
        well ln Y_4 is to be found."""
        fixed = {**self.prescribed, **(fixed or {})}
        Y_4 = fixed.pop("Y_4", None)
        free = [Y_LINEAR.index(n) for n in self.used if n not in fixed]
        at = self._best_Y_4(free, fixed, fine) if Y_4 is None else Y_4
        solution, chi2 = self._least(at, free, fixed)
        linear = dict.fromkeys(Y_LINEAR, 0.0) | {Y_LINEAR[i]: float(v) for i, v in zip(free, solution, strict=True)}
        return Y(**(linear | fixed), Y_4=at), chi2

    def _best_Y_4(self, free: list[int], fixed: Mapping[str, float], fine: float) -> float:
        from scipy.optimize import minimize_scalar

        rough = [self._least(v, free, fixed)[1] for v in Y_4_GRID]
        i = int(np.argmin(rough))
        ends = np.log(Y_4_GRID[max(i - 1, 0)]), np.log(Y_4_GRID[min(i + 1, len(Y_4_GRID) - 1)])
        chi2 = lambda v: self._least(math.exp(v), free, fixed)[1]
        optimum = minimize_scalar(chi2, bounds=ends, method="bounded", options={"xatol": fine})
        return math.exp(optimum.x) if optimum.fun < rough[i] else float(Y_4_GRID[i])


def fit_system(
    points: Points,
    loss: Loss,
    *,
    keep_Y_2: bool | None = None,
    used: tuple[str, ...] = Y_LINEAR,
    prescribed: Mapping[str, float] | None = None,
) -> FrictionFit:
    """System friction that explains the points together with the motor loss.

    Parameters: points measured ones (held-out ones are left out here); loss of one motor shaft; keep_Y_2 keep the
    constant term (None: only where AICc improves by more than ``EVIDENCE``, as eq. 2.13 drops it for want of need);
    used linear parameters that may be free at all; given parameters that keep these values [SI] because the data do not
    determine them.
    Errors: IdentifyError for fewer points than parameters.
    """
    fitted, prescribed = points.fitted(), dict(prescribed or {})
    used = tuple(n for n in used if n not in prescribed)
    needed = len(_free(tuple(n for n in used if n != "Y_2" or keep_Y_2 is not False), prescribed)) + 1
    if len(fitted) < needed:
        raise IdentifyError(
            f"{len(fitted)} measured points for {needed - 1} parameters: at least {needed} are needed. Add steps or"
            " tests."
        )
    target = Target(fitted, fitted.T_f - motor_loss_at(fitted, loss))
    if "Y_2" not in used or keep_Y_2 is True:
        return _fit(target, loss, used, prescribed)
    full = _fit(target, loss, used, prescribed)
    without = tuple(n for n in used if n != "Y_2")
    lean = _fit(target, loss, without, prescribed, fixed_noise=full.noise)
    gain = _aicc(lean) - _aicc(full)
    if keep_Y_2 is None and gain > EVIDENCE:
        return replace(full, evidence={"Y_2": gain})
    return replace(_fit(target, loss, without, prescribed, start=full.noise), evidence={"Y_2": gain})


def _aicc(fit: FrictionFit) -> float:
    """Akaike's criterion for small samples with the scatter held; only differences count."""
    k, n = len(fit.names), len(fit.residual)
    return fit.chi2 + 2 * k + 2 * k * (k + 1) / max(n - k - 1, 1)


def _fit(
    target: Target,
    loss: Loss,
    used: tuple[str, ...],
    prescribed: Mapping[str, float],
    *,
    fixed_noise: Noise | None = None,
    start: Noise | None = None,
) -> FrictionFit:
    """One fit; with known noise no variance is estimated, else from start, where there is one."""
    points, noise = target.points, fixed_noise if fixed_noise is not None else start

    def solved(problem: Problem) -> tuple[Y, float, tuple[str, ...], FloatArray]:
        """Best parameters, chi^2, which of them are free, and the Jacobian."""
        y, chi2 = problem.best()
        names = tuple(n for n in _free(used, prescribed) if n != "Y_4" or y.Y_1 > 0.0 or y.Y_3 > 0.0)
        return y, chi2, names, jacobian(points, y, names)

    for _ in range(ROUNDS if noise is None else int(fixed_noise is None)):
        if noise is None:
            problem = Problem(target, sigma_of(points, float(np.sqrt(np.mean(points.u_dp**2)))), used, prescribed)
        else:
            problem = Problem(target, noise.root, used, prescribed, noise.shift)
        y, _, _, J = solved(problem)
        noise = noise_of(points, loss, y, J, noise.sd if noise is not None else None)
    assert noise is not None
    problem = Problem(target, noise.root, used, prescribed, noise.shift)
    y, chi2, names, J = solved(problem)
    white = problem.whitened(J)
    nominal_covariance = covariance(white)
    weights = nominal_covariance @ problem.whitened(white, transposed=True).T
    dof = freedom(noise, np.vstack([weights, J.mean(axis=0) @ weights]))
    beyond = float(np.mean((noise.sigma / points.D_m) ** 2 - points.u_dp**2 - DP_FLOOR**2))
    return FrictionFit(
        y=y,
        names=names,
        covariance=spread(noise, weights, nominal_covariance),
        nominal_covariance=nominal_covariance,
        at_bound=_at_bound(y, names),
        dropped=tuple(n for n in Y_NAMES if n not in names and n not in prescribed),
        prescribed=dict(prescribed),
        evidence={},
        residual=problem.T - system_friction_at(points, y),
        tau=math.sqrt(max(beyond, 0.0)),
        chi2=chi2,
        dof=float(dof[-1]),
        freedom=dict(zip(names, map(float, dof), strict=False)),
        noise=noise,
    )


def _free(used: tuple[str, ...], prescribed: Mapping[str, float]) -> tuple[str, ...]:
    """Free parameters in the order Y_1 to Y_6; Y_4 is free where something fades with it."""
    fading = ("Y_1" in used or "Y_3" in used) and "Y_4" not in prescribed
    return tuple(n for n in Y_NAMES if n in used or (n == "Y_4" and fading))


def sigma_of(points: Points, tau: float) -> FloatArray:
    """Standard uncertainty of the friction torque with the common scatter tau [Pa] in it [N m]."""
    return np.asarray(points.D_m * np.sqrt(points.u_dp**2 + tau**2 + DP_FLOOR**2))


def jacobian(points: Points, y: Y, names: tuple[str, ...]) -> FloatArray:
    """Shape (n, k): change of the friction per shaft at the points per change of each parameter (SI)."""
    linear = system_columns(points, y.Y_4)
    return np.column_stack([system_slope(points, y) if n == "Y_4" else linear[:, Y_LINEAR.index(n)] for n in names])


def scaled_directions(J: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sizes of the columns of J, and singular values and right singular vectors (rows) of J with its columns scaled to
    unit size."""
    size = np.linalg.norm(J, axis=0)
    size[size == 0.0] = 1.0  # a parameter without any effect: its direction is blind
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    return size, s, V


def covariance(J: FloatArray) -> FloatArray:
    """Inverse of J'J by its singular values; a direction that the data do not see gets a very large variance, not an
    error."""
    size, s, V = scaled_directions(J)
    half = (V / np.maximum(s, BLIND)[:, None]) / size
    return np.asarray(half.T @ half)


BLIND = 1e-9
"""Singular value of the scaled sensitivities that counts as nothing."""


def _at_bound(y: Y, names: tuple[str, ...]) -> tuple[str, ...]:
    zero = [n for n in names if n != "Y_4" and getattr(y, n) <= 0.0]
    end = "Y_4" in names and not Y_4_LEAST * 1.001 < y.Y_4 < Y_4_MOST * 0.999
    return tuple(zero + (["Y_4"] if end else []))


def predicted(points: Points, loss: Loss, y: Y) -> FloatArray:
    """Friction per shaft that motor loss and system friction together predict at the points [N m]."""
    return motor_loss_at(points, loss) + system_friction_at(points, y)


def predicted_sd(points: Points, fit: FrictionFit) -> FloatArray:
    """Standard error of the predicted system friction per shaft at the points, from the covariance [N m]."""
    J = jacobian(points, fit.y, fit.names)
    return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", J, fit.covariance, J), 0.0)))


def cost(points: Points, loss: Loss, y: Y) -> float:
    """The thesis's cost E: squared error summed over the points, per motor shaft (eq. 2.8) [N^2 m^2]."""
    return float(np.sum((points.T_f - predicted(points, loss, y)) ** 2))
