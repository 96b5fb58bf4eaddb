"""`friction`: a campaign of crane tests in, system friction with its uncertainty out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stillhook.base.progress import Progress
from stillhook.errors import IdentifyError
from stillhook.identify.motor.map import mapped_loss, read_map
from stillhook.identify.system_friction.campaign import Campaign, FitSettings, load_campaign
from stillhook.identify.system_friction.diagnosis import (
    Design,
    Statement,
    design,
    judge,
    log_statement,
    motor_statement,
    unlike,
)
from stillhook.identify.system_friction.fitting.fit import FrictionFit, fit_system, predicted
from stillhook.identify.system_friction.fitting.model import Loss, Points, Y, joined, loss_of
from stillhook.identify.system_friction.fitting.second_loop import SecondLoop, second_loop
from stillhook.identify.system_friction.fitting.uncertainty import Proposal, profile_intervals, propose
from stillhook.identify.system_friction.measure import Measured, measure
from stillhook.identify.system_friction.thesis import Check, thesis_check
from stillhook.library.parameter_sets import load_friction
from stillhook.physics.scalar import G
from stillhook.statistics.estimate import Estimate
from stillhook.units import parse

JUDGED_FROM = parse("250 rev/min", "rotation")
"""Speed from which the thesis claims `CLAIM` (paper D, conclusions) [rad/s]."""
CLAIM = 1.0  # % of nominal torque


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
    data cannot determine.
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

    @property
    def usable(self) -> bool:
        """Whether no severe finding excludes the set from use."""
        return not any(s.severe for s in self.statements)


def friction(
    source: Campaign | str | Path,
    *,
    fit: FitSettings | None = None,
    proposals: int | None = None,
    progress: Progress | None = None,
) -> Friction:
    """Identify system friction from a campaign of crane tests.

    Parameters
    ----------
    source : Campaign, str or Path
        Campaign, or path of its file (see `load_campaign`).
    fit : FitSettings, optional
        In place of the campaign's table [fit].
    proposals : int, optional
        How many further tests to propose, in place of the campaign's number.
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
    settings = campaign.fit if fit is None else fit
    proposals = settings.proposals if proposals is None else proposals
    campaign = replace(campaign, tests=tuple(t for t in campaign.tests if not t.ahc))
    if not campaign.tests:
        raise IdentifyError(
            f"{campaign.source}: every test has ahc = true. Give a staircase for the fit, or a set to verify"
            " (verify.friction)."
        )
    measured = _measured(campaign, progress)
    # with the wire's weight, as the logs show it
    campaign = replace(campaign, tests=tuple(m.test for m in measured), fit=settings)
    points, grid = joined([m.points for m in measured]), joined([m.grid_points for m in measured])
    if not len(points.fitted()):
        raise IdentifyError(
            f"{campaign.source}: every test is held out. Leave hold_out = false for those that are to be fitted."
        )
    loss = loss_of(campaign.motor)
    like = None if settings.like is None else Y.of(load_friction(settings.like).system)._asdict()
    swl = (campaign.crane.SWL + campaign.crane.hook_mass) * G * _effective_radius(campaign, points)
    plan = design(points, swl, like)
    keep = plan.keep_Y_2 if settings.keep_Y_2 is None else settings.keep_Y_2
    optimum = fit_system(points, loss, keep_Y_2=keep, used=plan.used, prescribed=plan.prescribed)
    intervals = profile_intervals(points, loss, optimum)
    held_out = held_out_errors(points, loss, optimum.y)
    statements = (
        *plan.statements,
        *judge(points, optimum, intervals),
        *_beyond_claim(held_out),
        *motor_statement(campaign.losses, points, optimum),
        *unlike(points, optimum.y),
        *(replace(n, text=f'test "{m.test.name}": {n.text}.') for m in measured for n in m.notes),
        *(s for m in measured for s in log_statement(m.test.name, m.log)),
    )
    return Friction(
        campaign=campaign,
        loss=loss,
        measured=measured,
        points=points,
        grid=grid,
        design=plan,
        fit=optimum,
        intervals=intervals,
        check=thesis_check(grid, points, loss, optimum, settings.variant, settings.seed),
        held_out=held_out,
        second=second_loop(points, campaign.motor, optimum, rounds=settings.loops) if settings.loops else None,
        mapped=None if settings.map is None else with_map(points, settings.map, campaign.motor.D_max, optimum),
        proposals=propose(campaign, points, loss, optimum, n=proposals) if proposals else (),
        statements=statements,
    )


def with_map(points: Points, path: str, D_max: float, fit: FrictionFit) -> Mapped:
    """The same points with the supplier's map as motor loss. Errors: LogError, UnitError of one line for a map that
    cannot be read."""
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
