"""Hoisting against lowering: stretches paired by speed, or both directions brought onto one grid of speeds (Moslatt
2020 eqs 2.1-2.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.steps import Rejected, Window

LARGEST_DIFFERENCE = 0.35
"""Largest difference of speed within a pair, over its mean: leakage makes lowering up to 30 % faster than hoisting at
low speed."""
NEIGHBOUR = 120.0
"""Time apart that counts as much as the largest difference of speed [s]: neighbours in a staircase share load, layer
and oil."""
SAME_SPEED = 0.2
"""Stretches closer than this part of the grid's step are one node: a slope between them would be noise."""
NOT_A_PAIR = 1e6
"""Cost of a pair that is not allowed, far above every allowed one (at most about 1 for the speed and some tens for the
time)."""

Text = Callable[[float], str]


@dataclass(frozen=True)
class Pair:
    """A hoisting and a lowering stretch of about the same speed."""

    up: Window
    down: Window

    @property
    def speed(self) -> float:
        """Mean magnitude of both speeds [SI]."""
        return 0.5 * (abs(self.up.speed) + abs(self.down.speed))

    @property
    def friction(self) -> float:
        """Half the difference of effort (eq. 2.4) [SI of effort]."""
        return 0.5 * (self.up.effort - self.down.effort)

    @property
    def load(self) -> float:
        """Half the sum of effort (eqs 2.2, 2.3) [SI of effort]."""
        return 0.5 * (self.up.effort + self.down.effort)

    @property
    def u_friction(self) -> float:
        """Standard uncertainty of ``friction`` and of ``load``, the two stretches being independent [SI of effort]."""
        return 0.5 * float(np.hypot(self.up.u_effort, self.down.u_effort))


@dataclass(frozen=True)
class Pairs:
    """``pairs`` by speed; ``unpaired`` stretches that have no partner, with reasons."""

    pairs: tuple[Pair, ...]
    unpaired: tuple[Rejected, ...]


def pair_windows(
    windows: Sequence[Window],
    *,
    largest_difference: float = LARGEST_DIFFERENCE,
    neighbour: float = NEIGHBOUR,
    text: Text = lambda v: f"{v:.4g} (SI)",
) -> Pairs:
    """Pair each hoisting stretch with a lowering one of about the same speed, each used once.

    As many pairs as the limit on the speed allows; among those the least sum of (difference of speed over the largest
    allowed) and (time apart over ``neighbour`` [s]). ``text`` writes a speed with its unit in the reasons.
    """
    from scipy.optimize import linear_sum_assignment

    ups = [w for w in windows if w.direction > 0]
    downs = [w for w in windows if w.direction < 0]
    v_up, v_down = (np.array([abs(w.speed) for w in ws]) for ws in (ups, downs))
    apart = np.abs(v_up[:, None] - v_down[None, :]) / np.maximum(
        0.5 * (v_up[:, None] + v_down[None, :]), np.finfo(float).tiny
    )
    between = np.abs(np.array([w.middle for w in ups])[:, None] - np.array([w.middle for w in downs])[None, :])
    allowed = apart <= largest_difference
    cost = np.where(allowed, apart / largest_difference + between / neighbour, NOT_A_PAIR)
    rows, columns = linear_sum_assignment(cost) if cost.size else ([], [])
    matched = [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if allowed[i, j]]
    pairs = sorted((Pair(ups[i], downs[j]) for i, j in matched), key=lambda p: p.speed)
    unmatched = [(w, v_down) for i, w in enumerate(ups) if i not in {i for i, _ in matched}]
    unmatched += [(w, v_up) for j, w in enumerate(downs) if j not in {j for _, j in matched}]
    unpaired = [_alone(w, others, largest_difference, text) for w, others in unmatched]
    return Pairs(tuple(pairs), tuple(sorted(unpaired, key=lambda r: r.start)))


def _alone(w: Window, others: FloatArray, largest_difference: float, text: Text) -> Rejected:
    """Why a stretch has no partner."""
    direction = "lowering" if w.direction > 0 else "hoisting"
    v = abs(w.speed)
    if len(others) == 0:
        reason = f"no {direction} stretch at all"
    else:
        nearest = float(others[np.argmin(np.abs(others - v))])
        if abs(nearest - v) > largest_difference * 0.5 * (nearest + v):
            reason = (
                f"no {direction} within {100 * largest_difference:.0f} % of {text(v)}; the nearest is {text(nearest)}"
            )
        else:
            reason = f"every {direction} stretch near {text(v)} has a closer partner"
    return Rejected(w.start, w.end, w.direction, w.speed, w.effort, reason, "unpaired")


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


def on_grid(windows: Sequence[Window], step: float, *, text: Text = lambda v: f"{v:.4g} (SI)") -> Grid:
    """Effort of both directions on the speeds step, 2 step, 3 step ... that both directions enclose; nothing is
    extrapolated.

    Parameters: windows of one test (one load, one displacement); step of the grid in SI (the thesis takes 25 rev/min).
    Each direction is interpolated linearly between its stretches; stretches of the same speed are first averaged by
    their uncertainties, widened where they scatter by more. Uncertainty of a stretch's speed counts through the slope
    there. Not part of the uncertainty: what a straight line between two stretches misses of a curved friction.
    Errors: IdentifyError where a direction has fewer than two speeds or the directions do not overlap.
    """
    if not (np.isfinite(step) and step > 0.0):
        raise IdentifyError(f"on_grid: step = {step}: not a speed above zero.")
    up, down = (_nodes([w for w in windows if w.direction == d], SAME_SPEED * step) for d in (1, -1))
    for name, nodes in (("hoisting", up), ("lowering", down)):
        if len(nodes.speed) < 2:
            scope = f"{name}: steady at {len(nodes.speed)} speeds"
            raise IdentifyError(f"{scope}, interpolation needs 2. Add steps, or see the rejected stretches.")
    lowest, highest = max(up.speed[0], down.speed[0]), min(up.speed[-1], down.speed[-1])
    first, last = int(np.ceil(lowest / step - 1e-9)), int(np.floor(highest / step + 1e-9))
    grid = np.asarray(step * np.arange(max(first, 1), last + 1), dtype=float)
    if len(grid) == 0:
        raise IdentifyError(
            f"hoisting is steady from {text(up.speed[0])} to {text(up.speed[-1])}, lowering from {text(down.speed[0])}"
            f" to {text(down.speed[-1])}: no multiple of {text(step)} in both. Take a smaller step."
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
    """Mean weighted with 1/by^2 (equal weights where one of them is zero) and its standard uncertainty.

    With `scatter` the uncertainty is widened by the Birge ratio where values differ by more than their uncertainties
    say.
    """
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
