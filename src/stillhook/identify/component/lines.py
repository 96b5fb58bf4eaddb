"""Restrictions of the lines between pumps and motors, R_1 Q + R_2 Q |Q|, from a log with the pressures at both ends.

Source: Moslatt 2020 section 2.5.2.2: one volume a line "with a set of restrictions corresponding to the overall
steady-state losses of the transmission line".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.component.result import DEFAULT, TABLE, Component, ComponentSettings, Parameter, base_crane
from stillhook.logs.log import Log
from stillhook.report.formatting import percent_fixed
from stillhook.report.kit import axis, display, legend, panels, with_unit
from stillhook.report.plots.colours import COLOURS
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.left_out import Linear, linear_fit, rms_held_out, stretches
from stillhook.units import show

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
RESTRICTIONS = (("R_1", "laminar", "flow_resistance"), ("R_2", "turbulent", "flow_resistance_squared"))


class LineFit(NamedTuple):
    """A line: X (n, 4) with Q, Q|Q|, 1 and the rate of Q; drop y (n,) [Pa]; its fit, with the columns of X that were
    kept, and the coefficients of all, 0 where left out."""

    X: FloatArray
    y: FloatArray
    fit: Linear
    kept: list[int]
    theta: FloatArray

    def restriction(self, k: int) -> Estimate:
        """R_1 or R_2 with its interval; one that was left out at 0 has the upper end of a fit with it."""
        if k in self.kept:
            return self.fit.estimate(self.kept.index(k))
        y = self.X[:, self.kept] @ self.fit.theta + self.fit.residual
        full = linear_fit(self.X, y, {"time": stretches(len(y))})
        return Estimate(0.0, 0.0, max(full.estimate(k).high, 0.0))


def line_restrictions(log: Log, settings: ComponentSettings = DEFAULT) -> Component:
    r"""R_1 and R_2 of each line: :math:`p_{pump} - p_{motor} = R_1 Q + R_2 Q|Q| + p_0 + I\,\dot Q`.

    p_0, the difference of the transmitters' zeros, and I, the inertance of the oil, are fitted as well.
    Errors: IdentifyError where a line has not both pressures, no flow is known, or the flow does not change.
    """
    both = {line: ports for line, ports in LINES.items() if set(ports[:2]) <= set(log.signals)}
    if not both:
        names = " or ".join(f"{pump} and {motor}" for pump, motor, _ in LINES.values())
        raise IdentifyError(
            f"{log.source}: no line has the pressures at both ends among {', '.join(log.signals)}. Map {names}."
        )
    Q, of = _flow(log, settings)
    X = np.column_stack([Q, Q * np.abs(Q), np.ones(len(Q)), np.gradient(Q, log.t if log.at is None else log.at)])
    lines: dict[str, LineFit] = {}
    for line, (pump, motor, sign) in both.items():
        y = sign * (log.signals[pump] - log.signals[motor])
        good = np.isfinite(y) & np.isfinite(X).all(axis=1)
        if good.sum() < FEWEST or np.ptp(Q[good]) < LEAST_SPREAD * np.max(np.abs(Q[good])) or not Q[good].any():
            raise IdentifyError(
                f"{log.source}: line {line} has {int(good.sum())} samples at one flow; {FEWEST} with a flow that"
                " changes are needed. Log a hoist and a pay-out at several speeds."
            )
        lines[line] = _fit(X[good], y[good])
    parameters, apart = list[Parameter](), dict[str, float]()
    for line, f in lines.items():
        for k, (name, words, kind) in enumerate(RESTRICTIONS):
            e, text = f.restriction(k), f"{words} restriction of line {line}"
            parameters.append(Parameter(f"{name}_{line.lower()}", text, kind, e, "" if e.low > 0.0 else "may be 0"))
        zero = f.fit.estimate(f.kept.index(2))
        parameters.append(Parameter(f"p_0_{line.lower()}", f"difference of the zeros of line {line}", "pressure", zero))
        time = {f"stretches of line {line}": stretches(len(f.y))}
        apart |= rms_held_out(f.X[:, f.kept], f.y, time, float(np.std(f.y)))
    R = [float(np.mean([f.theta[k] for f in lines.values()])) for k in range(2)]
    left = {line: float(np.std(f.fit.residual) / np.std(f.y)) for line, f in lines.items()}
    largest = float(max(np.max(np.abs(f.X[:, 0])) for f in lines.values()))
    drop = show(R[0] * largest + R[1] * largest**2, "pressure", 3)
    return Component(
        component="lines",
        source=log.source,
        rows=sum(len(f.y) for f in lines.values()),
        parameters=tuple(parameters),
        held_out=apart,
        notes=(
            f"flow: {of}",
            *(f"line {line}: the law leaves {percent_fixed(x, 0)} of the drop's deviation" for line, x in left.items()),
            f"{drop} in each line at the largest flow of the log, {show(largest, 'flow', 4)}",
            *(f"line {line} alone was measured: the twin takes it for both" for line in lines if len(lines) == 1),
        ),
        twin=(
            "the twin takes one pair for both lines, half of it on either side of the oil of a line",
            "leaks, relief, boost and flushing valves and the PLC's transmitters stay in the middle of the line; steady"
            " maps and margins take the part at the motors' ports",
        ),
        changes={f"active.lines.{name}": (x, kind) for (name, _, kind), x in zip(RESTRICTIONS, R, strict=True)},
        figures=lambda: {"lines": _figure(log.source, lines)},
        settings=settings,
        usable=all(x < BAD_FIT for x in left.values()),
    )


def _fit(X: FloatArray, y: FloatArray) -> LineFit:
    """Least squares with restrictions that are not negative: one that would be is left out."""
    kept, theta = [0, 1, 2, 3], np.zeros(X.shape[1])
    time = {"time": stretches(len(y)), "flow": stretches(len(y), weight=np.abs(X[:, 0]) + 1e-12)}
    while True:
        fit = linear_fit(X[:, kept], y, time)
        worst = [k for i, k in enumerate(kept) if k < 2 and fit.theta[i] < 0.0]
        if not worst:
            theta[kept] = fit.theta
            return LineFit(X, y, fit, kept, theta)
        kept.remove(worst[0] if len(worst) == 1 else 1)


def _flow(log: Log, settings: ComponentSettings) -> tuple[FloatArray, str]:
    """Flow from the pumps to the motors in line A [m^3/s], and where it is from."""
    if FLOW in log.signals:
        return log.signals[FLOW], f"measured ({FLOW})"
    crane = base_crane(settings, f"{log.source}: no {FLOW}, and displacements belong to a crane")
    assert crane is not None
    pump, D, signals = crane.active.pump, crane.active.motor.D_total, log.signals
    if {"alpha_m", "omega_m"} <= set(signals):
        return D * signals["alpha_m"] * signals["omega_m"], "displacement times speed of the motors"
    if "omega_m" in signals:
        return D * signals["omega_m"], "full displacement of the motors times their speed"
    if "alpha_p" in signals:
        words = "displacement of the pumps, their leak not taken off"
        return pump.D_total * pump.omega_p * signals["alpha_p"], words
    raise IdentifyError(
        f"{log.source}: no flow: none of {FLOW}, omega_m with alpha_m, alpha_p among {', '.join(signals)}. Map one;"
        f' {FLOW} takes quantity = "flow". ([{TABLE}] base names the crane of the displacements.)'
    )


def _figure(source: str, lines: Mapping[str, LineFit]) -> Figure:
    """Pressure drop of each line over its flow, without zeros and inertance, and the law."""
    figure, axes = panels(1, len(lines), (5.5 * len(lines) + 1.0, 4.6), f"{source}: pressure drop of the lines")
    for ax, (line, f) in zip(axes[0], lines.items(), strict=True):
        thin = max(1, len(f.y) // 3000)
        Q, drop = f.X[::thin, 0], (f.y - f.X[:, 2:] @ f.theta[2:])[::thin]
        q = np.linspace(f.X[:, 0].min(), f.X[:, 0].max(), 200)
        law = f.theta[0] * q + f.theta[1] * q * np.abs(q)
        for x, y, style, colour, label in ((Q, drop, ".", 0, f"line {line}, measured"), (q, law, "-", 1, "law")):
            ax.plot(display(x, "flow"), display(y, "pressure"), style, color=COLOURS[colour], ms=2.0, label=label)
        axis(ax, with_unit("flow", "flow"), with_unit("pump's less motor's pressure", "pressure"))
        legend(ax)
    return figure
