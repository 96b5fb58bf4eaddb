"""Parameters of a torque-loss model from a map, with what the map can and cannot determine about them.

The torque-loss models that can be fitted: what each is called, where it is from, what its parameters are, where it
holds.

The equations are those of `stillhook.physics.hydraulics.motor_losses`; the table `models.toml` adds nothing to them. A
column of a linear fit is the model itself with one parameter at 1 and the others at 0.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from itertools import product
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.motor.map import LossMap, blocks
from stillhook.physics.hydraulics.motor_laws import BLIND, LAWS
from stillhook.physics.hydraulics.motor_losses import LossMotor

LAMINAR, TURBULENT_AND_MORE = 1.0, 3.0
"""Bounds of MJ5's exponent: laminar flow is 1, turbulent flow is 2; a fit beyond 2 is reported and is not that
physics."""


class LossModel(StrEnum):
    """Models of paper A, oldest first."""

    WILSON = "wilson"
    SCHLOSSER = "schlosser"
    THOMA = "thoma"
    PACEY = "pacey"
    HUHTALA_14 = "huhtala-14"
    HUHTALA_28 = "huhtala-28"
    ORTWIG = "ortwig"
    JEONG = "jeong"
    MJ1 = "mj1"
    MJ2 = "mj2"
    MJ3 = "mj3"
    MJ4 = "mj4"
    MJ5 = "mj5"
    MJ6 = "mj6"


@dataclass(frozen=True)
class LossCard:
    """What there is to know about a model next to its equation."""

    model: LossModel
    record: type[Any]
    """The parameters as the equation takes them, named as in paper A."""
    positive: bool
    """Whether physics asks that no parameter is negative (a loss never drives the shaft)."""
    sees_displacement: bool
    title: str
    author: str
    year: int
    equation: str
    units: tuple[str, ...]
    """SI units of the parameters."""
    validity: str
    bent: tuple[str, ...] = ()
    """Parameters that the loss is not linear in."""

    @property
    def function(self) -> Callable[..., Any]:
        """The equation: f(omega_m, D_m, dp_m, record, motor) [N m]."""
        return LAWS[self.model].function

    @property
    def names(self) -> tuple[str, ...]:
        return self.record._fields  # type: ignore[no-any-return]

    @property
    def straight(self) -> tuple[str, ...]:
        """Parameters that the loss is linear in."""
        return tuple(n for n in self.names if n not in self.bent)

    def torque(self, omega_m: Any, D_m: Any, dp_m: Any, values: Sequence[float], motor: LossMotor) -> Any:
        """Torque loss [N m] with the parameters in the order of `names`; SI, floats or arrays."""
        return self.function(omega_m, D_m, dp_m, self.record(*values), motor)

    def column(
        self, name: str, omega_m: Any, D_m: Any, dp_m: Any, motor: LossMotor, bent: Mapping[str, float]
    ) -> FloatArray:
        """The loss with this parameter at 1, the other linear ones at 0 and the bent ones as given [N m per unit]."""
        unit = [bent[n] if n in bent else float(n == name) for n in self.names]
        return np.broadcast_to(
            np.asarray(self.torque(omega_m, D_m, dp_m, unit, motor), dtype=np.float64), np.shape(omega_m)
        ).copy()


def _cards() -> dict[LossModel, LossCard]:
    table = tomllib.loads(files(__package__).joinpath("models.toml").read_text(encoding="utf-8"))
    out = {}
    for model in LossModel:
        row = table[model]
        lists = {name: tuple(row.get(name, ())) for name in ("units", "bent")}
        law = LAWS[model]
        out[model] = LossCard(model, law.record, not law.interpolates, model not in BLIND, **row | lists)
    return out


CARDS: Mapping[LossModel, LossCard] = MappingProxyType(_cards())


EQUAL = 1.0e-7
"""Columns (each of length 1) whose smallest singular value is below this part of the largest carry the same
information: rounding of a map in percent leaves 1e-4 and more."""
NOTHING = 1.0e-10
"""Part of all torque losses below which a term does not count: rounding of the solver, where the answer is 0."""
SHARE = 0.05
"""Part of a direction that the map does not see from which a parameter counts as belonging to it."""
EXPONENT_STEP = 1.0e-7
"""Accuracy of MJ5's exponent."""
BREAKS = (0.3, 0.7)
"""Breaks tried first at each of these, in all combinations, as part of the largest pressure."""
RIDGE = 1.0e-12
"""Keeps the search for the break solvable where a line has no cells."""
MOST_STEPS, MOST_STARTS = 40, 2
BREAK_RANGE = (0.0, 1.5)
"""Bounds of the break at each of the speeds and displacements that define it: beyond the largest pressure there is one
line."""
MOST_BLOCKS = 8
"""Blocks of displacements of the jackknife."""
FEWEST_BLOCKS = 4


@dataclass(frozen=True)
class LossFit:
    """A fitted model. Arrays follow `names`; SI; NaN where nothing can be said."""

    model: LossModel
    names: tuple[str, ...]
    values: FloatArray
    errors: FloatArray
    """Standard errors if the errors of the cells were independent; NaN at a bound and where the map cannot
    determine."""
    covariance: FloatArray
    correlation: FloatArray
    at_bound: tuple[str, ...]
    confounded: tuple[tuple[str, ...], ...]
    """Groups of parameters that the map cannot distinguish; the later ones of a group are held at 0."""
    rms: float
    """Root mean square of the residuals [N m]."""
    rms_share: float
    """The same over the mean nominal torque of the map [-]."""
    normalised: float
    """Sum of squared residuals over the sum of squared torque losses [-]: how we read paper A's "normalized
    summation"."""
    dof: int
    aicc: float
    motor: LossMotor

    @property
    def card(self) -> LossCard:
        return CARDS[self.model]

    def torque(self, omega_m: Any, D_m: Any, dp_m: Any) -> Any:
        """Torque loss of the fitted model [N m]; SI, floats or arrays."""
        return self.card.torque(omega_m, D_m, dp_m, self.values.tolist(), self.motor)

    def terms(self, omega_m: FloatArray, D_m: FloatArray, dp_m: FloatArray) -> dict[str, FloatArray]:
        """What each linear parameter contributes [N m] (paper A eqs 13-18)."""
        bent = {n: self[n] for n in self.card.bent}
        return {n: self[n] * self.card.column(n, omega_m, D_m, dp_m, self.motor, bent) for n in self.card.straight}

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])


def fit_loss(m: LossMap, model: LossModel | str, *, near: LossFit | None = None) -> LossFit:
    """Parameters of a model by least squares of the torque loss [N m], all cells alike; near: a fit of nearly the same
    map.

    Linear models: linear least squares, with parameters not negative where physics requires it. MJ5: the exponent by a
    bounded search with such a fit inside; the two-line model: its break by nonlinear least squares with a linear fit
    inside.
    Errors: IdentifyError where the map has too few cells for the model.
    """
    card = CARDS[LossModel(model)]
    if len(m) <= len(card.names):
        raise IdentifyError(
            f"{m.source}: {len(m)} cells for the {len(card.names)} parameters of {card.title}. Give more cells, or a"
            " model with fewer."
        )
    bent = {} if not card.bent else _exponent(m, card) if card.model is LossModel.MJ5 else _breaks(m, card, near)
    return _result(m, card, bent, *_linear(m, card, bent))


def _columns(m: LossMap, card: LossCard, bent: Mapping[str, float]) -> FloatArray:
    return np.column_stack([card.column(n, m.omega_m, m.D_m, m.dp_m, m.motor, bent) for n in card.straight])


def _linear(
    m: LossMap, card: LossCard, bent: Mapping[str, float]
) -> tuple[FloatArray, BoolArray, tuple[tuple[str, ...], ...]]:
    """Linear parameters, which of them are free (not at a bound, not held), and groups that cannot be distinguished."""
    from scipy.optimize import nnls

    A, names = _columns(m, card, bent), card.straight
    size = np.linalg.norm(A, axis=0)
    visible = size > 0.0
    A = A / np.where(visible, size, 1.0)
    used, groups = _independent(A, names, visible)
    x, free = np.zeros(len(names)), used
    if card.positive:
        x[used] = nnls(A[:, used], m.T_f)[0]
        free = used & (x > NOTHING * np.linalg.norm(m.T_f))
    else:
        x[used] = np.linalg.lstsq(A[:, used], m.T_f, rcond=None)[0]
    return x / np.where(visible, size, 1.0), free, groups


def _independent(
    A: FloatArray, names: Sequence[str], visible: BoolArray
) -> tuple[BoolArray, tuple[tuple[str, ...], ...]]:
    """Which columns to use so that none is a sum of the others, and the groups of names that are."""
    used = visible.copy()
    groups: list[tuple[str, ...]] = [(n,) for n, s in zip(names, visible, strict=True) if not s]
    while used.any():
        _, s, V = np.linalg.svd(A[:, used], full_matrices=False)
        if s[-1] > EQUAL * s[0]:
            break
        at = np.flatnonzero(used)
        weight = np.abs(V[-1])
        group = at[weight > SHARE * weight.max()]
        groups.append(tuple(names[i] for i in group))
        used[group[-1]] = False
    return used, tuple(groups)


def _exponent(m: LossMap, card: LossCard) -> dict[str, float]:
    """MJ5's C_n within its bounds: the loss is linear in all the others."""
    from scipy.optimize import minimize_scalar

    def cost(C_n: float) -> float:
        bent = {"C_n": C_n}
        r = m.T_f - _columns(m, card, bent) @ _linear(m, card, bent)[0]
        return float(r @ r)

    optimum = minimize_scalar(
        cost, bounds=(LAMINAR, TURBULENT_AND_MORE), method="bounded", options={"xatol": EXPONENT_STEP}
    )
    ends = min((LAMINAR, TURBULENT_AND_MORE), key=cost)
    return {"C_n": ends if cost(ends) <= float(optimum.fun) else float(optimum.x)}


def _breaks(m: LossMap, card: LossCard, near: LossFit | None) -> dict[str, float]:
    """Break pressure of the two-line model: a polynomial in speed (and linear in displacement), the loss is linear in
    the rest.

    Searched are the breaks at three speeds (and at two displacements), as part of the largest pressure. A fit nearby
    lends its break: the model's error on cells left out is then a little too good.
    """
    if near is not None:
        return {n: near[n] for n in card.bent}
    from scipy.optimize import least_squares

    n, alpha = np.linspace(m.omega_m.min(), m.omega_m.max(), 3), np.array([m.D_m.min(), m.D_m.max()]) / m.D_max
    powers, top = n[:, None] ** np.arange(3), float(m.dp_m.max())
    at_knots = np.vstack([np.hstack([powers, a * powers]) for a in alpha]) if len(card.bent) == 6 else powers
    size = np.linalg.norm(at_knots, axis=0)

    def coefficients(z: FloatArray) -> dict[str, float]:
        scaled, *_ = np.linalg.lstsq(at_knots / size, z * top, rcond=None)
        return dict(zip(card.bent, map(float, scaled / size), strict=True))

    def residual(z: FloatArray) -> FloatArray:
        A = _columns(m, card, coefficients(z))
        length = np.linalg.norm(A, axis=0)
        A = A / np.where(length > 0.0, length, 1.0)
        normal = A.T @ A + RIDGE * np.eye(A.shape[1])  # a small system is fast, and accurate enough to search with
        return np.asarray(m.T_f - A @ np.linalg.solve(normal, A.T @ m.T_f))

    starts = [np.array(z) for z in product(BREAKS, repeat=len(card.bent))]
    starts = sorted(starts, key=lambda z: float(residual(z) @ residual(z)))[:MOST_STARTS]
    steps = {"bounds": BREAK_RANGE, "diff_step": 1e-4, "ftol": 1e-6, "max_nfev": MOST_STEPS}
    best = min((least_squares(residual, z, **steps) for z in starts), key=lambda f: float(f.cost))
    return coefficients(best.x)


def _result(
    m: LossMap,
    card: LossCard,
    bent: Mapping[str, float],
    x: FloatArray,
    free: BoolArray,
    groups: tuple[tuple[str, ...], ...],
) -> LossFit:
    values = np.array([bent[n] if n in bent else x[card.straight.index(n)] for n in card.names])
    residuals = m.T_f - card.torque(m.omega_m, m.D_m, m.dp_m, values.tolist(), m.motor)
    inside = {n: n != "C_n" or LAMINAR < v < TURBULENT_AND_MORE for n, v in bent.items()}  # a break has no bounds
    loose = np.array([inside[n] if n in bent else bool(free[card.straight.index(n)]) for n in card.names])
    dropped = {n for g in groups for n in (g[-1:] if len(g) > 1 else g)}
    at_bound = tuple(n for n, ok in zip(card.names, loose, strict=True) if not ok and n not in dropped)
    dof = len(m) - int(loose.sum())
    SSR, count = float(residuals @ residuals), int(loose.sum()) + 1  # the variance is a parameter too
    covariance = _covariance(m, card, values, loose, SSR / max(dof, 1))
    confounded = [n in {k for g in groups for k in g} for n in card.names]
    covariance[confounded, :] = covariance[:, confounded] = np.nan
    errors = np.sqrt(np.diag(covariance))
    scale = np.where(errors > 0.0, errors, np.nan)
    N, rms = len(m), math.sqrt(SSR / len(m))
    likelihood = N * math.log(max(SSR, np.finfo(float).tiny) / N)
    return LossFit(
        card.model,
        card.names,
        values,
        errors,
        covariance,
        covariance / np.outer(scale, scale),
        at_bound,
        groups,
        rms,
        rms / float(m.T_N.mean()),
        SSR / float(m.T_f @ m.T_f),
        dof,
        likelihood + 2 * count + 2 * count * (count + 1) / max(N - count - 1, 1),
        m.motor,
    )


def _covariance(m: LossMap, card: LossCard, values: FloatArray, loose: BoolArray, variance: float) -> FloatArray:
    """Covariance of the free parameters from the slopes of the model there; NaN for the others."""
    out = np.full((len(values), len(values)), np.nan)
    J = np.column_stack([np.zeros((len(m), 0)), *(_slope(m, card, values, i) for i in np.flatnonzero(loose))])
    size = np.linalg.norm(J, axis=0)
    size[size == 0.0] = 1.0
    inverse = np.linalg.pinv((J / size).T @ (J / size), hermitian=True)
    out[np.ix_(loose, loose)] = variance * inverse / np.outer(size, size)
    return out


def _slope(m: LossMap, card: LossCard, values: FloatArray, i: Any) -> FloatArray:
    """Change of the loss per change of one parameter: exact where it is linear, a central difference where it is
    not."""
    name = card.names[i]
    bent = {n: float(values[card.names.index(n)]) for n in card.bent}
    if name not in bent:
        return card.column(name, m.omega_m, m.D_m, m.dp_m, m.motor, bent)
    step = 1e-5 * max(abs(bent[name]), 1e-3)
    up, down = values.copy(), values.copy()
    up[i], down[i] = values[i] + step, values[i] - step
    ends = [card.torque(m.omega_m, m.D_m, m.dp_m, parameters.tolist(), m.motor) for parameters in (up, down)]
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))


def spread_of_levels(m: LossMap, fit: LossFit) -> FloatArray | None:
    """Covariance of the parameters by leaving out blocks of displacements in turn (jackknife), or None with fewer than
    four.

    A model that is not quite right deviates alike in neighbouring cells, so their number overstates the information
    in them: this spread is wider than `LossFit.covariance` then, and the one to draw from.
    """
    label = blocks(m.D_m, MOST_BLOCKS)
    count = int(label.max()) + 1
    if count < FEWEST_BLOCKS or len(m) * (count - 1) // count <= len(fit.names):
        return None
    values = np.array([fit_loss(m.at(label != i), fit.model, near=fit).values for i in range(count)])
    off = values - values.mean(axis=0)
    return np.asarray((count - 1) / count * off.T @ off)


def indeterminate(fit: LossFit) -> tuple[str, ...]:
    """What the map does not say about this model, one plain line each."""
    lines = [
        f"{' and '.join(g)} cannot be distinguished on this map" if len(g) > 1 else f"{g[0]} has no effect on this map"
        for g in fit.confounded
    ]
    for name in fit.at_bound:
        lines.append(
            f"{name} is at its bound ({fit[name]:g}): no error can be claimed, the map has no sign of this term"
        )
    for name, value, error in zip(fit.names, fit.values, fit.errors, strict=True):
        if np.isfinite(error) and error > abs(value):
            lines.append(f"{name} is smaller than its own standard error: the map does not determine it")
    if "C_n" in fit.names and fit["C_n"] > 2.0:
        lines.append(
            f"C_n = {fit['C_n']:.2f} is beyond 2, turbulent flow: the term represents something else than flow into the"
            " chambers"
        )
    return tuple(lines)
