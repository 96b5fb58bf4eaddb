"""Figures of a campaign as the thesis draws them: friction pressure and torque, system friction, model against
measurement, errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.system_friction.fitting.fit import predicted, predicted_sd
from stillhook.identify.system_friction.fitting.model import Points, mj4, motor_loss_at, system_friction
from stillhook.identify.system_friction.identify import JUDGED_FROM, Friction, nominal_share
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.statistics.estimate import NORMAL_95, t_factor
from stillhook.units import in_display, parse, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE = (9.0, 5.0)
MARK = "SYNTHETIC: simulated, measured on no crane"
MARKERS = "osD^v<>pP*Xh"
SPEED = "motor speed [rev/min]"


def figures(result: Friction) -> Mapping[str, Figure]:
    """All figures of a result by file stem, in the order in which a report shows them."""
    out = {
        "friction-torque": friction_torque(result),
        "system-friction": system_friction_figure(result),
        "error": error_figure(result),
    }
    if result.second is not None:
        out["second-loop-motor"] = motor_old_and_new(result)
        out["second-loop-system"] = derived_system_friction(result)
    if result.campaign.synthetic:
        for figure in out.values():
            figure.text(0.995, 0.005, MARK, ha="right", va="bottom", fontsize="x-small", color="#a00000")
    return out


def friction_torque(result: Friction) -> Figure:
    """Friction torque per motor shaft over speed, by test, with 95 % bars and the model (figures 2.6, 2.7, 2.12; paper
    D figure 7)."""
    figure, ax = _axes(
        "Friction torque per motor shaft, measured (points) and modelled (lines) (as figures 2.7, 2.12)", "T_f [N m]"
    )
    for style, points in _tests(result):
        speed, modelled = _rpm(points.omega), predicted(points, result.loss, result.fit.y)
        bars = NORMAL_95 * points.D_m * np.hypot(points.u_dp, result.fit.tau)
        ax.errorbar(speed, points.T_f, yerr=bars, ls="none", capsize=2, **style)
        ax.plot(speed, modelled, lw=1.0, color=style["color"], ls=_line(points))
    return _finished(figure, ax)


def system_friction_figure(result: Friction) -> Figure:
    """System friction per motor shaft: measured less motor loss, and the fitted curve with its 95 % band (figure
    2.13)."""
    figure, ax = _axes(
        "System friction per motor shaft: measured less motor loss, fit with 95 % band (as figure 2.13)", "T_fs [N m]"
    )
    omega = np.linspace(0.0, float(result.points.omega.max()), 200)
    loads: set[float] = set()
    for style, points in _tests(result):
        T_d = float(points.T_d.mean())
        ax.plot(_rpm(points.omega), points.T_f - motor_loss_at(points, result.loss), ls="none", **style)
        if round(T_d, -3) not in loads:
            loads.add(round(T_d, -3))
            _band(ax, omega, T_d, result, style["color"])
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    return _finished(figure, ax)


def _band(ax: Axes, omega: FloatArray, T_d: float, result: Friction, colour: str) -> None:
    at = Points.planned(omega, T_d, 1.0)
    T = system_friction(omega, at.T_d, result.fit.y)
    half = t_factor(result.fit.dof) * predicted_sd(at, result.fit)
    ax.plot(_rpm(omega), T, color=colour, lw=1.2)
    ax.fill_between(_rpm(omega), np.maximum(T - half, 0.0), T + half, color=colour, alpha=0.15, lw=0)


def error_figure(result: Friction) -> Figure:
    """Model error in % of the nominal torque over speed, by test (paper D figure 17)."""
    figure, ax = _axes(
        "Model less measured, in % of the nominal torque D_m dp_m (as paper D figure 17)", "error [% of nominal torque]"
    )
    for style, points in _tests(result):
        error = nominal_share(points, result.loss, result.fit.y)
        ax.plot(_rpm(points.omega), error, lw=0.8, ls=_line(points), **style)
    ax.axhspan(-1.0, 1.0, color=GREY, alpha=0.15, lw=0)
    ax.axvline(in_display(JUDGED_FROM, "rotation"), color=GREY, lw=0.8, ls=":")
    return _finished(figure, ax)


def motor_old_and_new(result: Friction) -> Figure:
    """Motor loss before and after the second loop, over speed at three displacements and 200 bar (paper D figure
    10)."""
    assert result.second is not None
    figure, ax = _axes(
        "Motor loss at 200 bar before (solid) and after (dashed) the second loop (as paper D figure 10)", "T_fm [N m]"
    )
    omega = np.linspace(0.0, parse("2000 rev/min", "rotation"), 100)
    for colour, share in zip(COLOURS, (1.0, 0.7, 0.4), strict=False):
        D = np.full_like(omega, share * result.campaign.motor.D_max)
        for loss, ls in ((result.campaign.motor.loss, "-"), (result.second.loss, "--")):
            label = show(float(D[0]), "displacement", 3) if ls == "-" else None
            ax.plot(_rpm(omega), mj4(loss)(omega, D, np.full_like(omega, 2e7)), color=colour, ls=ls, label=label)
    ax.set_ylim(bottom=0.0)
    return _finished(figure, ax)


def derived_system_friction(result: Friction) -> Figure:
    """Measured friction less the motor loss of each loop, one colour a displacement: with a right motor model the
    points of one load fall on one curve, whatever the displacement (paper D figures 11, 12, 14)."""
    from matplotlib.figure import Figure as Canvas

    assert result.second is not None
    figure = Canvas(figsize=(10.0, 5.0), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    losses = {"first loop": result.loss, "second loop": mj4(result.second.loss)}
    for ax, (label, loss) in zip(axes, losses.items(), strict=True):
        for style, points in _tests(result):
            derived = points.count * (points.T_f - motor_loss_at(points, loss))
            ax.plot(_rpm(points.omega), derived, lw=0.8, **style)
        ax.set_title(label, fontsize="medium")
        ax.set_xlabel(SPEED)
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("system friction of the complete winch [N m]")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="x-small", frameon=False)
    figure.suptitle("System friction derived with the motor model of each loop (as paper D figures 11, 12, 14)")
    return figure


def _axes(title: str, y: str, x: str = SPEED) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure as Canvas

    figure = Canvas(figsize=SIZE, layout="constrained")
    ax = figure.subplots()
    figure.suptitle(title, fontsize="medium")
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.grid(alpha=0.3)
    return figure, ax


def _finished(figure: Figure, ax: Axes) -> Figure:
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize="x-small", frameon=False)
    return figure


def _tests(result: Friction) -> Iterator[tuple[dict[str, Any], Points]]:
    """Style with label and points by speed of every test; held-out ones are hollow."""
    for i, k in enumerate(np.unique(result.points.test)):
        points = result.points.where(result.points.test == k)
        points = points.where(np.argsort(points.omega))  # type: ignore[arg-type]
        test, D_m = result.campaign.tests[k], show(float(points.D_m.mean()), "displacement", 3)
        note = ", held out" if test.hold_out else ""
        style = {
            "color": COLOURS[i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
            "ms": 4,
            "mfc": "none" if points.hold_out.any() else None,
            "label": f"{points.names[k]}: {show(test.load, 'mass', 3)}, {D_m}{note}",
        }
        yield style, points


def _line(points: Points) -> str:
    """Style of a test's line: dashed where no fit has seen it."""
    return "--" if points.hold_out.any() else "-"


def _rpm(omega: FloatArray) -> FloatArray:
    return omega * 60.0 / math.tau
