"""Second loop of paper D section 3: the motor's loss model is opened and refined on crane data, then the system
friction again.

On the tests that it is fitted to the cost can only fall. Whether the refined model is a better one shows on tests that
were held out, so both are always reported: a cost that falls there as well has generalised, one that rises has been
overfitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.system_friction.fitting.fit import FrictionFit, cost, covariance, fit_system
from stillhook.identify.system_friction.fitting.model import (
    Loss,
    Points,
    Y,
    loss_of,
    motor_columns,
    system_friction_at,
)
from stillhook.units import show
from stillhook.winches.circuits.losses import loss_fields, loss_names, loss_values
from stillhook.winches.circuits.tables import Motor

NARROW = 0.5
"""Smallest displacement in the tests over the largest one above which the refined motor model has seen too few
displacements to be trusted elsewhere: passive motors run at a third of theirs while the active ones run at full."""
WORSE = 1.05  # cost on held-out tests after the loop over before, above which it has been overfitted
BETTER = 0.95
MATERIAL = 0.1
"""Change of the error per held-out point that is negligible [N m]: a thousandth of the friction."""


@dataclass(frozen=True)
class Costs:
    """Cost E per motor shaft (eq. 2.8) [N^2 m^2] over the fitted and the held-out points (NaN where there are none)."""

    fitted: float
    held_out: float


@dataclass(frozen=True)
class SecondLoop:
    """``motor`` with refined parameters; ``covariance`` of its `loss_names` (SI); ``system`` the friction fitted
    with them; ``first``, ``second`` costs before and after; ``verdict`` "generalised", "no better", "overfitted" or
    "untested"; ``statements``.
    """

    motor: Motor
    covariance: FloatArray
    system: FrictionFit
    first: Costs
    second: Costs
    verdict: str
    statements: tuple[str, ...]


def second_loop(points: Points, motor: Motor, fit: FrictionFit, *, rounds: int = 1) -> SecondLoop:
    """Refine the motor model with the system friction locked, then the system friction with the motor model locked.

    Parameters
    ----------
    points : Points
        Measured ones [SI].
    motor : Motor
        That of the first loop, its loss from the supplier's map by any model.
    fit : FrictionFit
        System friction found with it.
    rounds : int, default 1
        Rounds of the loop (the thesis: more than one brought nothing).

    Returns
    -------
    SecondLoop
        Both models refined, costs before and after, and a verdict.

    Raises
    ------
    IdentifyError
        For fewer points than parameters.

    Notes
    -----
    A loss is linear in what is refined of it, see `loss_names`, so each step is a non-negative least-squares problem
    with one answer. MJ5 keeps its exponent; a map and a model that interpolates keep their shape, and their scale is
    refined.
    """
    if rounds < 1:
        raise IdentifyError(f"second loop: rounds = {rounds}. Give 1 or more.")
    fitted_points = points.fitted()
    count = len(loss_names(motor.law))
    if len(fitted_points) < count + 2:
        raise IdentifyError(f"second loop: {len(fitted_points)} points for {count} motor parameters. Add tests.")
    refined, system, spread = motor, fit, np.zeros((count, count))
    for _ in range(rounds):
        refined, spread = _motor_fit(fitted_points, motor, system)
        system = fit_system(
            points, loss_of(refined), used=fit.linear, keep_Y_2="Y_2" in fit.names, prescribed=fit.prescribed
        )
    first, second = _costs(points, loss_of(motor), fit.y), _costs(points, loss_of(refined), system.y)
    verdict = _verdict(first, second, len(points.held_out()))
    statements = _statements(points, motor, refined, first, second, verdict)
    return SecondLoop(refined, spread, system, first, second, verdict, statements)


def _motor_fit(fitted_points: Points, motor: Motor, system: FrictionFit) -> tuple[Motor, FloatArray]:
    from scipy.optimize import nnls

    sigma = system.noise.sigma
    names = loss_names(motor.law)
    A = motor_columns(fitted_points, motor, names) / sigma[:, None]
    b = (fitted_points.T_f - system.noise.shift - system_friction_at(fitted_points, system.y)) / sigma
    size = np.linalg.norm(A, axis=0)
    x = nnls(A / size, b)[0] / size
    excess = max(float(np.sum((b - A @ x) ** 2)) / max(len(fitted_points) - len(x), 1), 1.0)
    refined = loss_fields(motor, dict(zip(names, map(float, x), strict=True)))
    return motor.model_copy(update=refined), covariance(A) * excess


def _costs(points: Points, loss: Loss, y: Y) -> Costs:
    unseen = points.held_out()
    return Costs(cost(points.fitted(), loss, y), cost(unseen, loss, y) if len(unseen) else math.nan)


def _verdict(first: Costs, second: Costs, count: int) -> str:
    """What the held-out points (count of them) say of the loop."""
    if math.isnan(first.held_out):
        return "untested"
    if abs(second.held_out - first.held_out) < count * MATERIAL**2:
        return "no better"
    ratio = second.held_out / max(first.held_out, 1e-30)
    return "overfitted" if ratio > WORSE else "generalised" if ratio < BETTER else "no better"


def _statements(points: Points, old: Motor, new: Motor, first: Costs, second: Costs, verdict: str) -> tuple[str, ...]:
    out = [f"cost on the fitted tests {_change(first.fitted, second.fitted)}"]
    if verdict == "untested":
        out.append(
            "no test was held out: it is not known whether the refined model holds elsewhere. Keep the supplier's, or"
            " hold tests out"
        )
    else:
        out.append(f"cost on the held-out tests {_change(first.held_out, second.held_out)}: {verdict}")
    now = loss_values(new)
    vanished_terms = [n for n, x in loss_values(old).items() if x > 0.0 and now[n] <= 0.0]
    if vanished_terms:
        out.append(
            f"{', '.join(vanished_terms)} went to zero: the crane's tests do not show it, or other terms take it over"
        )
    D = points.fitted().D_m
    if float(D.min()) > NARROW * float(D.max()):
        out.append(
            f"the fitted tests have {show(float(D.min()), 'displacement', 3)} to"
            f" {show(float(D.max()), 'displacement', 3)} only: below, the refined motor model is an extrapolation"
            " (passive motors run there)"
        )
    return tuple(out)


def _change(before: float, after: float) -> str:
    return f"{before:.4g} to {after:.4g} N^2 m^2 ({(after / max(before, 1e-30) - 1.0) * 100.0:+.0f} %)"
