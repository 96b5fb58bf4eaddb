"""Restrictions of the lines between pumps and motors, R_1 Q + R_2 Q |Q|, from a log with the pressures at both ends.

Source: Moslatt 2020 section 2.5.2.2: one volume a line "with a set of restrictions corresponding to the overall
steady-state losses of the transmission line".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.component.result import DEFAULT, TABLE, Component, ComponentSettings, Parameter, base_crane
from stillhook.logs.log import Log
from stillhook.report.formatting import percent_fixed
from stillhook.report.kit import axis, legend, panels
from stillhook.report.plots.colours import COLOURS
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.left_out import Linear, held_out, linear_fit, stretches
from stillhook.units import in_display, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINES = {"A": ("p_a_pump", "p_a_motor", 1.0), "B": ("p_b_pump", "p_b_motor", -1.0)}
"""Pressures at the ports of pumps and motors, and the sign of the flow from pumps to motors while hoisting."""
FLOW = "Q_line"
"""Signal of a flow meter in the line, hoisting positive; its quantity is "flow"."""
FEWEST, LEAST_SPREAD = 100, 0.02
"""Samples that a line needs, and least flow over the largest one that counts as another flow [-]."""
BAD_FIT = 0.6
"""Residual over the deviation of the drop beyond which the law is not that of the line."""
KINDS = ("flow_resistance", "flow_resistance_squared", "pressure")


def line_restrictions(log: Log, settings: ComponentSettings = DEFAULT) -> Component:
    r"""R_1 and R_2 of each line: :math:`p_{pump} - p_{motor} = R_1 Q + R_2 Q|Q| + p_0 + I\,\dot Q`.

    p_0, the difference of the transmitters' zeros, and I, the inertance of the oil, are fitted as well.
    Errors: IdentifyError where a line has not both pressures, no flow is known, or the flow does not change.
    """
    there = [line for line, (pump, motor, _) in LINES.items() if {pump, motor} <= set(log.signals)]
    if not there:
        names = " or ".join(f"{pump} and {motor}" for pump, motor, _ in LINES.values())
        raise IdentifyError(
            f"{log.source}: no line has the pressures at both ends among {', '.join(log.signals)}. Map {names}."
        )
    times = log.t if log.at is None else log.at
    Q, of = _flow(log, settings)
    rate = np.gradient(Q, times)
    rows, drops, places = [], [], []
    for line in there:
        pump, motor, sign = LINES[line]
        y = sign * (log.signals[pump] - log.signals[motor])
        good = np.isfinite(y) & np.isfinite(Q) & np.isfinite(rate)
        if good.sum() < FEWEST or np.ptp(Q[good]) < LEAST_SPREAD * np.max(np.abs(Q[good])) or not Q[good].any():
            raise IdentifyError(
                f"{log.source}: line {line} has {int(good.sum())} samples at one flow; {FEWEST} with a flow that"
                " changes are needed. Log a hoist and a pay-out at several speeds."
            )
        rows.append(np.column_stack([Q, Q * np.abs(Q), np.ones(len(Q)), rate])[good])
        drops.append(y[good])
        places.append(good)
    each = {line: _fit(X, y) for line, X, y in zip(there, rows, drops, strict=True)}
    parameters, notes = list[Parameter](), [f"flow: {of}"]
    for line, (fit, kept) in each.items():
        for k, name in enumerate(("R_1", "R_2")):
            words = f"{'laminar' if k == 0 else 'turbulent'} restriction of line {line}"
            e = (
                fit.estimate(kept.index(k))
                if k in kept
                else Estimate(0.0, 0.0, _most(fit, kept, rows[there.index(line)], k))
            )
            parameters.append(
                Parameter(f"{name}_{line.lower()}", words, KINDS[k], e, "" if e.low > 0.0 else "may be 0")
            )
        zero = fit.estimate(kept.index(2))
        parameters.append(Parameter(f"p_0_{line.lower()}", f"difference of the zeros of line {line}", "pressure", zero))
    both = {name: float(np.mean([_value(each[line], k) for line in there])) for k, name in enumerate(("R_1", "R_2"))}
    left = {
        line: float(np.std(fit.residual) / np.std(y)) for (line, (fit, _)), y in zip(each.items(), drops, strict=True)
    }
    notes += [f"line {line}: the law leaves {percent_fixed(x, 0)} of the drop's deviation" for line, x in left.items()]
    largest = float(max(np.max(np.abs(X[:, 0])) for X in rows))
    drop = both["R_1"] * largest + both["R_2"] * largest**2
    notes.append(f"{show(drop, 'pressure', 3)} in each line at the largest flow of the log, {show(largest, 'flow', 4)}")
    if len(there) == 1:
        notes.append(f"line {there[0]} alone was measured: the twin takes it for both")
    apart: dict[str, float] = {}
    for line, X, y in zip(there, rows, drops, strict=True):
        outside = held_out(X[:, each[line][1]], y, stretches(len(y)))
        if outside is not None:
            apart[f"stretches of line {line}"] = float(np.sqrt(np.mean(outside**2)) / np.std(y))
    return Component(
        component="lines",
        source=log.source,
        rows=int(sum(len(y) for y in drops)),
        parameters=tuple(parameters),
        held_out=apart,
        notes=tuple(notes),
        twin=(
            "the twin takes one pair for both lines, half of it on either side of the oil of a line",
            "leaks, relief, boost and flushing valves and the PLC's transmitters stay in the middle of the line; steady"
            " maps and margins take the part at the motors' ports",
        ),
        changes={"active.lines.R_1": (both["R_1"], KINDS[0]), "active.lines.R_2": (both["R_2"], KINDS[1])},
        figures=lambda: {
            "lines": _figure(log.source, dict(zip(there, zip(rows, drops, strict=True), strict=True)), each)
        },
        settings=settings,
        usable=all(x < BAD_FIT for x in left.values()),
    )


Kept = tuple[Linear, list[int]]


def _fit(X: FloatArray, y: FloatArray) -> Kept:
    """Least squares with restrictions that are not negative: one that would be is left out; and the columns kept."""
    kept = [0, 1, 2, 3]
    time = {"time": stretches(len(y)), "flow": stretches(len(y), weight=np.abs(X[:, 0]) + 1e-12)}
    while True:
        fit = linear_fit(X[:, kept], y, time)
        worst = [k for i, k in enumerate(kept) if k < 2 and fit.theta[i] < 0.0]
        if not worst:
            return fit, kept
        kept.remove(worst[0] if len(worst) == 1 else 1)


def _value(of: Kept, k: int) -> float:
    fit, kept = of
    return float(fit.theta[kept.index(k)]) if k in kept else 0.0


def _most(fit: Linear, kept: list[int], X: FloatArray, k: int) -> float:
    """Upper end of a restriction that was left out at 0: from a fit with it."""
    y = X[:, kept] @ fit.theta + fit.residual
    full = linear_fit(X, y, {"time": stretches(len(y))})
    return max(full.estimate(k).high, 0.0)


def _flow(log: Log, settings: ComponentSettings) -> tuple[FloatArray, str]:
    """Flow from the pumps to the motors in line A [m^3/s], and where it is from."""
    if FLOW in log.signals:
        return log.signals[FLOW], f"measured ({FLOW})"
    crane = base_crane(settings, f"{log.source}: no {FLOW}, and displacements belong to a crane")
    assert crane is not None
    has = set(log.signals)
    if {"alpha_m", "omega_m"} <= has:
        return _of_motors(log, crane), "displacement times speed of the motors"
    if "omega_m" in has:
        return crane.active.motor.D_total * log.signals["omega_m"], "full displacement of the motors times their speed"
    if "alpha_p" in has:
        pump = crane.active.pump
        return pump.D_total * pump.omega_p * log.signals[
            "alpha_p"
        ], "displacement of the pumps, their leak not taken off"
    raise IdentifyError(
        f"{log.source}: no flow: none of {FLOW}, omega_m with alpha_m, alpha_p among {', '.join(log.signals)}. Map one;"
        f' {FLOW} takes quantity = "flow". ([{TABLE}] base names the crane of the displacements.)'
    )


def _of_motors(log: Log, crane: Crane) -> FloatArray:
    return np.asarray(crane.active.motor.D_total * log.signals["alpha_m"] * log.signals["omega_m"])


def _figure(source: str, data: dict[str, tuple[FloatArray, FloatArray]], fits: dict[str, Kept]) -> Figure:
    """Pressure drop of each line over its flow, without zeros and inertance, and the law."""
    figure, axes = panels(1, len(data), (5.5 * len(data) + 1.0, 4.6), f"{source}: pressure drop of the lines")
    for ax, (line, (X, y)) in zip(axes[0], data.items(), strict=True):
        fit, kept = fits[line]
        theta = np.zeros(X.shape[1])
        theta[kept] = fit.theta
        thin = max(1, len(y) // 3000)
        Q = in_display(1.0, "flow") * X[::thin, 0]
        drop = in_display(1.0, "pressure") * (y - X[:, 2:] @ theta[2:])[::thin]
        ax.plot(Q, drop, ".", color=COLOURS[0], ms=2.0, label=f"line {line}, measured")
        q = np.linspace(X[:, 0].min(), X[:, 0].max(), 200)
        law = theta[0] * q + theta[1] * q * np.abs(q)
        ax.plot(in_display(1.0, "flow") * q, in_display(1.0, "pressure") * law, "-", color=COLOURS[1], label="law")
        axis(ax, "flow [L/min]", "pump's less motor's pressure [bar]")
        legend(ax)
    return figure
