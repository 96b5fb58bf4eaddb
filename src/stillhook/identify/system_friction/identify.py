"""`friction`: a campaign of crane tests in, system friction with its uncertainty out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stillhook.base.choice import choice
from stillhook.base.progress import Progress
from stillhook.errors import IdentifyError
from stillhook.identify.system_friction.campaign.file import Campaign, load_campaign
from stillhook.identify.system_friction.campaign.measure import Measured, measure
from stillhook.identify.system_friction.diagnosis import Design, Statement, design, judge
from stillhook.identify.system_friction.fitting.fit import (
    Y_4_LEAST,
    Y_4_MOST,
    FrictionFit,
    Problem,
    Target,
    cost,
    fit_system,
    predicted,
)
from stillhook.identify.system_friction.fitting.model import (
    Y_NAMES,
    Loss,
    Points,
    Y,
    joined,
    mj4,
    motor_loss_at,
    system_friction_at,
)
from stillhook.identify.system_friction.fitting.uncertainty import profile_intervals
from stillhook.identify.system_friction.next_tests import Proposal, log_statements, motor_statement, propose, unlike
from stillhook.identify.system_friction.second_loop import SecondLoop, second_loop
from stillhook.physics.scalar import G
from stillhook.spec.crane import SystemFriction
from stillhook.statistics.complex_method import Optimum, Variant, complex_method
from stillhook.statistics.estimate import Estimate
from stillhook.units import parse

JUDGED_FROM = parse("250 rev/min", "rotation")
"""Speed from which the thesis claims 1 % of the nominal torque (paper D, conclusions) [rad/s]."""
UPPER = Y(Y_1=2e-4, Y_2=30.0, Y_3=50.0, Y_4=Y_4_MOST, Y_5=0.2, Y_6=2e-4)
"""Upper bounds of the complex method's first population: four times and more above every published parameter."""
AGREE = 1e-3
"""Relative difference of the two methods' costs that counts as agreement."""


@dataclass(frozen=True)
class Check:
    """The thesis's own way: cost E on the 25 rev/min grid (eq. 2.8, per motor shaft), by least squares and by the
    complex method. ``on_grid`` false: too few grid points, so the pairs themselves represent them."""

    cost_ours: float
    y_grid: Y
    cost_grid: float
    y_complex: Y
    optimum: Optimum
    on_grid: bool

    @property
    def agree(self) -> bool:
        """Both methods reached the same cost."""
        return self.optimum.cost <= self.cost_grid * (1.0 + AGREE) + 1e-9


@dataclass(frozen=True)
class HeldOut:
    """Errors over held-out pairs from 250 rev/min on, in % of nominal torque, by test: root mean square and largest."""

    test: str
    rms: float
    worst: float
    count: int


@dataclass(frozen=True)
class Mapped:
    """The supplier's map itself as motor loss next to the fitted MJ4 (paper D figure 13): its interpolation, the system
    friction fitted with it, root mean square residuals of both per motor shaft [N m], and the share of points that are
    outside the map.
    """

    source: str
    loss: Loss
    fit: FrictionFit
    rms_model: float
    rms_map: float
    outside: float


@dataclass(frozen=True)
class Friction:
    """Everything that a campaign gave. ``measured`` by test; ``points`` all pairs; ``grid`` the thesis's grid points;
    ``fit`` the system friction; ``intervals`` 95 %, by profile likelihood; ``check`` the thesis's way next to ours;
    ``held_out``; ``second`` loop, ``mapped`` where requested; ``proposals`` what to test next; ``statements`` what the
    data cannot determine; ``like`` where filled-in parameters come from.
    """

    campaign: Campaign
    loss: Loss
    measured: tuple[Measured, ...]
    points: Points
    grid: Points
    design: Design
    fit: FrictionFit
    intervals: Mapping[str, Estimate]
    check: Check
    held_out: tuple[HeldOut, ...]
    second: SecondLoop | None
    mapped: Mapped | None
    proposals: tuple[Proposal, ...]
    statements: tuple[Statement, ...]
    like: str | None

    @property
    def usable(self) -> bool:
        """Nothing severe speaks against using the set."""
        return not any(s.severe for s in self.statements)

    @property
    def system(self) -> SystemFriction:
        """The parameters as a crane has them."""
        return self.fit.y.system


def friction(
    source: Campaign | str | Path,
    *,
    keep_Y_2: bool | None = None,
    like: str | None = None,
    loops: int | None = None,
    loss_map: str | Path | None = None,
    variant: Variant | str | None = None,
    proposals: int = 3,
    seed: int | None = None,
    progress: Progress | None = None,
) -> Friction:
    """Identify system friction from a campaign of crane tests.

    Parameters
    ----------
    source : Campaign, str or Path
        Campaign, or path of its file (see `load_campaign`). What is None below is that of its table [fit], and of its
        default.
    keep_Y_2 : bool, optional
        Keep the constant term; without it only where the data ask for it.
    like : str, optional
        Set of a similar winch (library name or file) for parameters that these tests cannot determine.
    loops : int, optional
        Rounds of paper D's second loop (0: none).
    loss_map : str or Path, optional
        Supplier's map of the motor, to be compared with its fitted model (see `read_map`).
    variant : Variant or str, optional
        Of the complex method that checks the fit.
    proposals : int, default 3
        How many further tests to propose.
    seed : int, optional
        Of everything random.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Friction
        The fit, its uncertainty and the evidence.

    Raises
    ------
    LogError, IdentifyError, SpecError, UnitError
        One line.
    """
    campaign = source if isinstance(source, Campaign) else load_campaign(source)
    fit_of = campaign.fit
    variant = fit_of.variant if variant is None else choice(Variant, variant, "variant")
    keep_Y_2 = fit_of.keep_Y_2 if keep_Y_2 is None else keep_Y_2
    like = fit_of.like if like is None else like
    loops = fit_of.loops if loops is None else loops
    loss_map = fit_of.map if loss_map is None else loss_map
    seed = fit_of.seed if seed is None else seed
    measured = _measured(campaign, progress)
    campaign = replace(campaign, tests=tuple(m.test for m in measured))  # with the wire's weight, as the logs show it
    points, grid = joined([m.points for m in measured]), joined([m.grid_points for m in measured])
    if not len(points.fitted()):
        raise IdentifyError(
            f"{campaign.source}: every test is held out. Leave hold_out = false for those that are to be fitted."
        )
    loss = mj4(campaign.motor.loss)
    swl = (campaign.crane.SWL + campaign.crane.hook_mass) * G * _effective_radius(campaign, points)
    plan = design(points, swl, _like(like))
    keep = plan.keep_Y_2 if keep_Y_2 is None else keep_Y_2
    fit = fit_system(points, loss, keep_Y_2=keep, used=plan.used, prescribed=plan.prescribed)
    intervals = profile_intervals(points, loss, fit)
    held_out = held_out_errors(points, loss, fit.y)
    statements = (
        *plan.statements,
        *judge(points, fit, intervals),
        *_beyond_claim(held_out),
        *motor_statement(campaign, points, fit),
        *unlike(points, fit.y),
        *log_statements(measured),
    )
    second = second_loop(points, campaign.motor.loss, fit, rounds=loops) if loops else None
    mapped = with_map(points, loss_map, campaign.motor.D_max, fit) if loss_map is not None else None
    return Friction(
        campaign=campaign,
        loss=loss,
        measured=measured,
        points=points,
        grid=grid,
        design=plan,
        fit=fit,
        intervals=intervals,
        check=thesis_check(grid, points, loss, fit, variant, seed),
        held_out=held_out,
        second=second,
        mapped=mapped,
        proposals=propose(campaign, points, loss, fit, n=proposals) if proposals else (),
        statements=statements,
        like=like,
    )


def thesis_check(
    grid: Points, points: Points, loss: Loss, fit: FrictionFit, variant: Variant = Variant.KRUS, seed: int = 0
) -> Check:
    """The same parameters by the thesis's cost on its speed grid, by least squares and by the complex method.

    The parameters that are free, and the ones given, are those of ``fit``.
    """
    enough = len(grid.fitted()) > len(fit.names) + 1
    fitted = grid.fitted() if enough else points.fitted()
    target = fitted.T_f - motor_loss_at(fitted, loss)
    problem = Problem(Target(fitted, target), np.ones(len(fitted)), fit.linear, fit.prescribed)
    y_grid, cost_grid = problem.best()
    names = [n for n in Y_NAMES if n in fit.names]
    blank = Y(**{**dict.fromkeys(Y_NAMES, 0.0), "Y_4": fit.y.Y_4, **fit.prescribed})

    def y_of(x: np.ndarray) -> Y:
        return blank._replace(**dict(zip(names, map(float, x), strict=True)))

    def E(x: np.ndarray) -> float:
        return float(np.sum((target - system_friction_at(fitted, y_of(x))) ** 2))

    lower = np.array([Y_4_LEAST if n == "Y_4" else 0.0 for n in names])
    upper = np.array([getattr(UPPER, n) for n in names])
    optimum = complex_method(E, lower, upper, variant=variant, seed=seed)
    return Check(cost(fitted, loss, fit.y), y_grid, cost_grid, y_of(optimum.x), optimum, enough)


def with_map(points: Points, path: str | Path, D_max: float, fit: FrictionFit) -> Mapped:
    """The same points with the supplier's map as motor loss. Errors: LogError, UnitError of one line for a map that
    cannot be read."""
    from stillhook.identify.motor.map import mapped_loss, read_map

    supplier = read_map(path, D_max=f"{D_max!r} m^3/rad")
    table = mapped_loss(supplier)
    loss: Loss = lambda omega, D_m, dp: table(omega, D_m, dp)[0]
    refit = fit_system(points, loss, used=fit.linear, keep_Y_2="Y_2" in fit.names, prescribed=fit.prescribed)
    inside = table(points.omega_up, points.D_m, points.dp_up)[1]
    inside &= table(points.omega_down, points.D_m, points.dp_down)[1]
    rms_model, rms_map = (float(np.sqrt(np.mean(f.residual**2))) for f in (fit, refit))
    return Mapped(supplier.source, loss, refit, rms_model, rms_map, float(np.mean(~inside)))


def held_out_errors(points: Points, loss: Loss, y: Y) -> tuple[HeldOut, ...]:
    """How well the friction of tests that no fit has seen is predicted."""
    unseen = points.held_out()
    unseen = unseen.where(unseen.omega >= JUDGED_FROM)
    error = nominal_share(unseen, loss, y)
    errors = {unseen.names[k]: error[unseen.test == k] for k in np.unique(unseen.test)}
    return tuple(
        HeldOut(name, float(np.sqrt(np.mean(e**2))), float(np.max(np.abs(e))), len(e)) for name, e in errors.items()
    )


def _measured(campaign: Campaign, progress: Progress | None) -> tuple[Measured, ...]:
    out, n = [], len(campaign.tests)
    for i, test in enumerate(campaign.tests):
        done = None if progress is None else (lambda share, i=i: progress((i + share) / n))
        out.append(measure(campaign, test, progress=done))
    if progress is not None:
        progress(1.0)
    return tuple(out)


def _effective_radius(campaign: Campaign, points: Points) -> float:
    """Mean radius of the wire on the drum during the tests [m]."""
    weight = np.array([campaign.weight(t) for t in campaign.tests])[points.test]
    hanging = weight > 0.0
    return float(np.mean(points.T_d[hanging] / weight[hanging])) if hanging.any() else 0.5 * campaign.crane.drum.d_max


def _like(name: str | None) -> Mapping[str, float] | None:
    if name is None:
        return None
    from stillhook.library.parameter_sets import load_friction

    return Y.of(load_friction(name).system)._asdict()


CLAIM = 1.0
"""The thesis's claim [% of nominal torque] (paper D, conclusions)."""


def _beyond_claim(held_out: tuple[HeldOut, ...]) -> tuple[Statement, ...]:
    worst = max(held_out, key=lambda h: h.worst, default=None)
    if worst is None or worst.worst <= CLAIM:
        return ()
    text = (
        f'Held-out test "{worst.test}" is predicted within {worst.worst:.1f} % of nominal torque only; the thesis'
        f" claims {CLAIM:g} %."
    )
    return (Statement("held out", text),)


def nominal_share(points: Points, loss: Loss, y: Y) -> np.ndarray:
    """Model error in % of the nominal torque at every point (paper D figure 17)."""
    return 100.0 * (predicted(points, loss, y) - points.T_f) / np.where(points.T_N > 0.0, points.T_N, math.nan)
