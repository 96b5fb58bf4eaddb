"""The thesis's own way, next to ours: friction on a grid of speeds, its cost E (eq. 2.8), and the complex method.

Box's complex method mirrors the worst of a population of designs through the centre of the others. Three variants of
one loop: Box (1965); Krus, Jansson and Palmberg (1991), where a point that stays the worst is drawn towards the best
one, with some chance in it; and complex-RF, which adds a little randomness to every new point and lets old values fade,
so that a population does not settle too early. It makes no use of the model's shape, so that it and the least-squares
fit, which is certain and faster, check each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.steps import Window
from stillhook.identify.system_friction.fitting.fit import (
    Y_4_LEAST,
    Y_4_MOST,
    FrictionFit,
    Problem,
    Target,
    cost,
)
from stillhook.identify.system_friction.fitting.model import (
    Y_NAMES,
    Loss,
    Points,
    Y,
    motor_loss_at,
    system_friction_at,
)
from stillhook.units import parse, show

GRID = parse("25 rev/min", "rotation")
"""Speed grid of the thesis (eq. 2.8) [rad/s]."""
SAME_SPEED = 0.2
"""Stretches closer than this part of the grid's step are one node: a slope between them would be noise."""
POPULATION, REFLECTION = 36, 1.3
"""Of the thesis's complex method (section 2.3.3, paper D section 2.4)."""
N_R = 4
"""Krus: how soon a point that stays the worst is drawn to the best one instead of the centre."""
R_FAC, GAMMA = 0.1, 0.3
"""Complex-RF: size of the random step over the spread of the population, and forgetting, after Krus."""
MOST_RETRACTIONS = 30  # halvings of one step: the point is then at the centre to the ninth digit
MOST_EVALUATIONS = 60_000
TOLERANCE = 1e-7
"""Spread of the population over its bounds at which it counts as one point."""
UPPER = Y(Y_1=2e-4, Y_2=30.0, Y_3=50.0, Y_4=Y_4_MOST, Y_5=0.2, Y_6=2e-4)
"""Upper bounds of the first population: four times and more above every published parameter."""
AGREE = 1e-3
"""Relative difference of the two methods' costs that counts as agreement."""


@dataclass(frozen=True)
class Grid:
    """Both directions at the same speeds; arrays (n,), covariance (n, n), in SI.

    ``speed`` grid, positive; ``up``, ``down`` effort when hoisting and when lowering; ``cov_F`` covariance of the
    friction (up - down)/2 (eqs 2.1-2.5), ``u_F`` its standard uncertainties: neighbours on the grid share stretches, so
    they are not independent.
    """

    speed: FloatArray
    up: FloatArray
    down: FloatArray
    cov_F: FloatArray

    @property
    def u_F(self) -> FloatArray:
        return np.asarray(np.sqrt(np.diag(self.cov_F)), dtype=float)


def on_grid(windows: Sequence[Window], step: float = GRID) -> Grid:
    """Effort of both directions on the speeds step, 2 step, 3 step ... [rad/s] that both directions enclose; nothing is
    extrapolated.

    windows: of one test (one load, one displacement). Each direction is interpolated linearly between its stretches;
    stretches of the same speed are first averaged by their uncertainties, widened where they scatter by more.
    Uncertainty of a stretch's speed counts through the slope there. Not part of the uncertainty: what a straight line
    between two stretches misses of a curved friction.
    Errors: IdentifyError where a direction has fewer than two speeds or the directions do not overlap.
    """
    up, down = (_nodes([w for w in windows if w.direction == d], SAME_SPEED * step) for d in (1, -1))
    for name, nodes in (("hoisting", up), ("lowering", down)):
        if len(nodes.speed) < 2:
            scope = f"{name}: steady at {len(nodes.speed)} speeds"
            raise IdentifyError(f"{scope}, interpolation needs 2. Add steps, or see the rejected stretches.")
    lowest, highest = max(up.speed[0], down.speed[0]), min(up.speed[-1], down.speed[-1])
    first, last = int(np.ceil(lowest / step - 1e-9)), int(np.floor(highest / step + 1e-9))
    grid = np.asarray(step * np.arange(max(first, 1), last + 1), dtype=float)
    if len(grid) == 0:
        ends = (show(float(v), "rotation", 3) for v in (up.speed[0], up.speed[-1], down.speed[0], down.speed[-1], step))
        raise IdentifyError(
            "hoisting is steady from {} to {}, lowering from {} to {}: no multiple of {} in both.".format(*ends)
        )
    (e_up, c_up), (e_down, c_down) = _interpolated(up, grid), _interpolated(down, grid)
    return Grid(grid, e_up, e_down, 0.25 * (c_up + c_down))


@dataclass(frozen=True)
class _Nodes:
    """Speeds of one direction, rising, with effort and the standard uncertainties of both; shape (k,)."""

    speed: FloatArray
    effort: FloatArray
    u_speed: FloatArray
    u_effort: FloatArray


def _nodes(windows: Sequence[Window], close: float) -> _Nodes:
    """Stretches of one direction by speed; those within `close` of a group's first are one node."""
    rows: list[list[Window]] = []
    for w in sorted(windows, key=lambda w: abs(w.speed)):
        if rows and abs(w.speed) - abs(rows[-1][0].speed) <= close:
            rows[-1].append(w)
        else:
            rows.append([w])
    nodes = []
    for row in rows:
        u_speed, u_effort = [w.u_speed for w in row], [w.u_effort for w in row]
        speed, u_mean_speed = _average([abs(w.speed) for w in row], u_effort, u_speed)
        effort, u_mean_effort = _average([w.effort for w in row], u_effort, u_effort, scatter=True)
        nodes.append((speed, effort, u_mean_speed, u_mean_effort))
    return _Nodes(*np.ascontiguousarray(np.array(nodes).reshape(-1, 4).T))


def _average(
    x: Sequence[float], by: Sequence[float], u: Sequence[float], *, scatter: bool = False
) -> tuple[float, float]:
    """Mean weighted with 1/by^2 (equal weights where one of them is zero) and its standard uncertainty; with `scatter`
    widened by the Birge ratio where values differ by more than their uncertainties say."""
    values, spread, u_values = np.asarray(x), np.asarray(by), np.asarray(u)
    weight = 1.0 / spread**2 if np.all(spread > 0.0) else np.ones(len(values))
    weight = weight / weight.sum()
    mean = float(weight @ values)
    variance = float(weight**2 @ u_values**2)
    if scatter and len(values) > 1:
        variance = max(variance, float(weight @ (values - mean) ** 2) / (len(values) - 1))
    return mean, float(np.sqrt(variance))


def _interpolated(nodes: _Nodes, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Effort on the grid (g,) and its covariance (g, g), to first order in the uncertainties of effort and speed."""
    right = np.clip(np.searchsorted(nodes.speed, grid, side="left"), 1, len(nodes.speed) - 1)
    left = right - 1
    gap = nodes.speed[right] - nodes.speed[left]
    part = np.clip((grid - nodes.speed[left]) / gap, 0.0, 1.0)  # a grid speed on the last node may round past it
    rows = np.arange(len(grid))
    weights = np.zeros((len(grid), len(nodes.speed)))
    weights[rows, left] = 1.0 - part
    weights[rows, right] = part
    slope = (nodes.effort[right] - nodes.effort[left]) / gap
    of_effort, of_speed = weights * nodes.u_effort, weights * slope[:, None] * nodes.u_speed
    return weights @ nodes.effort, of_effort @ of_effort.T + of_speed @ of_speed.T


def grid_points(grid: Grid, points: Points, u_p: float) -> Points:
    """The thesis's points of one test: both directions interpolated to the same speed. points: its pairs; u_p: standard
    uncertainty of a pressure [Pa]."""
    n = len(grid.speed)
    order = np.argsort(points.omega)

    def at(values: FloatArray) -> FloatArray:
        return np.asarray(np.interp(grid.speed, points.omega[order], values[order])) if n else np.zeros(0)

    return Points(
        names=points.names,
        test=np.zeros(n, dtype=np.intp),
        omega_up=grid.speed,
        omega_down=grid.speed,
        dp_up=grid.up,
        dp_down=grid.down,
        D_m=at(points.D_m),
        T_d=at(points.T_d),
        count=np.full(n, points.count[0]),
        u_dp=np.hypot(grid.u_F, u_p),
        hold_out=np.full(n, points.hold_out[0]),
    )


class Variant(StrEnum):
    """Box (1965); Krus et al. (1991); complex-RF (Krus)."""

    BOX = "box"
    KRUS = "krus"
    COMPLEX_RF = "complex-rf"


@dataclass(frozen=True)
class Optimum:
    """Best design, its cost, number of evaluations of the cost, and whether the population converged (else the
    evaluations were exhausted)."""

    x: FloatArray
    cost: float
    evaluations: int
    converged: bool


def complex_method(
    cost: Callable[[FloatArray], float],
    lower: FloatArray,
    upper: FloatArray,
    *,
    population: int = POPULATION,
    variant: Variant = Variant.KRUS,
    seed: int = 0,
    most: int = MOST_EVALUATIONS,
) -> Optimum:
    """Least cost of a design x (n,) inside bounds, by at most so many evaluations; the population is drawn evenly
    inside the bounds from the seed."""
    rng = np.random.default_rng(seed)
    x = lower + rng.random((population, len(lower))) * (upper - lower)
    f = np.array([cost(design) for design in x])
    evaluations = population
    fading = GAMMA / 2.0 / population if variant is Variant.COMPLEX_RF else 0.0

    def spread() -> float:
        return float(np.max(np.ptp(x, axis=0) / (upper - lower)))

    while evaluations < most and spread() > TOLERANCE:
        worst, best = int(np.argmax(f)), x[int(np.argmin(f))]
        centre = np.delete(x, worst, axis=0).mean(axis=0)
        point = centre + REFLECTION * (centre - x[worst])
        if variant is Variant.COMPLEX_RF:
            point = point + R_FAC * np.ptp(x, axis=0) * (rng.random(len(point)) - 0.5)
        second = float(np.max(np.delete(f, worst)))
        for repeated in range(1, MOST_RETRACTIONS + 1):
            point = np.minimum(np.maximum(point, lower), upper)  # Box: a point beyond a bound is set on it
            value = cost(point)
            evaluations += 1
            if value < second or evaluations >= most:
                break
            if variant is Variant.BOX:
                point = 0.5 * (point + centre)
                continue
            # Krus: half way to a place between centre and best that nears the best with every try
            share = (N_R / (N_R + repeated - 1)) ** ((N_R + repeated - 1) / N_R)
            goal = share * centre + (1.0 - share) * best
            point = 0.5 * (point + goal) + (centre - best) * (1.0 - share) * (2.0 * rng.random() - 1.0)
        if fading:
            f = f + fading * (np.max(f) - np.min(f))
        x[worst], f[worst] = point, value
    least = x[int(np.argmin(f))]
    return Optimum(least.copy(), float(cost(least)), evaluations, spread() <= TOLERANCE)


@dataclass(frozen=True)
class Check:
    """Cost E of our fit, and parameters and E by least squares and by the complex method, all on the grid. ``on_grid``
    false: too few grid points, so the pairs themselves represent them."""

    cost_ours: float
    y_grid: Y
    cost_grid: float
    y_complex: Y
    optimum: Optimum
    on_grid: bool

    @property
    def agree(self) -> bool:
        return self.optimum.cost <= self.cost_grid * (1.0 + AGREE) + 1e-9


def thesis_check(
    grid: Points, points: Points, loss: Loss, fit: FrictionFit, variant: Variant = Variant.KRUS, seed: int = 0
) -> Check:
    """The parameters that are free in ``fit`` by the thesis's cost on its speed grid, in both ways."""
    enough = len(grid.fitted()) > len(fit.names) + 1
    fitted = grid.fitted() if enough else points.fitted()
    target = fitted.T_f - motor_loss_at(fitted, loss)
    y_grid, cost_grid = Problem(Target(fitted, target), np.ones(len(fitted)), fit.linear, fit.prescribed).best()
    names = [n for n in Y_NAMES if n in fit.names]
    blank = Y(**{**dict.fromkeys(Y_NAMES, 0.0), "Y_4": fit.y.Y_4, **fit.prescribed})

    def y_of(x: FloatArray) -> Y:
        return blank._replace(**dict(zip(names, map(float, x), strict=True)))

    def E(x: FloatArray) -> float:
        return float(np.sum((target - system_friction_at(fitted, y_of(x))) ** 2))

    lower = np.array([Y_4_LEAST if n == "Y_4" else 0.0 for n in names])
    upper = np.array([getattr(UPPER, n) for n in names])
    optimum = complex_method(E, lower, upper, variant=variant, seed=seed)
    return Check(cost(fitted, loss, fit.y), y_grid, cost_grid, y_of(optimum.x), optimum, enough)
