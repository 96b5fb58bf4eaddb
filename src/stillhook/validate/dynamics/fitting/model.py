"""The twin as a function of the tuned and the free nuisance parameters: outputs as the sensors show them, and their
derivatives."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.spec.crane import Crane, inertia_ratio_without_wire
from stillhook.validate.dynamics.fitting.output_error import FAR, Model
from stillhook.validate.dynamics.fitting.unknowns import (
    C_H,
    C_LEAK,
    COMMAND_DELAY,
    DELAYS,
    DROP,
    EXTRAS,
    INERTANCE,
    INERTIA,
    MOST,
    NAMES,
    OFFSETS,
    PLACE,
    UNKNOWNS,
    VARIES,
    VISCOUS,
    bent,
    centre,
    viscous_friction,
)
from stillhook.validate.dynamics.runs import SIGNALS, DynamicsSegment, delayed, repeated, steps_per_cycle

NOISE = {"p_a": 0.3e5, "p_b": 0.3e5, "omega_m": 0.05, "alpha_p": 3e-4}
"""Least deviation by which a signal's residuals are weighed [SI]: the step of a 12-bit input card, and a little
noise."""
LEAST_OTHER_INERTIA = 0.8
"""The inertia other than the wire's (which follows from its mass) may decrease by this part."""
PERIODS = tuple(math.log(x) for x in (0.70, 0.77, 0.84, 0.92, 1.0, 1.09, 1.19, 1.3, 1.42))
"""Logarithms of sqrt(C_h J) that the search starts from: a twelfth of the period apart, so that the ringing of one
falls in step."""
STIFFNESSES = tuple(math.log(x) for x in (0.7, 0.84, 1.0, 1.19, 1.42))
"""Logarithms of sqrt(J / C_h) that it starts from."""
LEAKS = tuple(math.log(x) for x in (0.5, 1.0, 2.0))
DELAY_STEP = 1e-3
"""By how much the commands are moved in a finite difference [s]."""
P_A, P_B, OMEGA, ALPHA_P = (SIGNALS.index(name) for name in ("p_a", "p_b", "omega_m", "alpha_p"))
SPLIT = 0.5
"""Part of a line's capacitance that lies at the pumps: not known, and of little weight (it counts squared, in one of
two lines)."""
BOTH_LINES = 1.0 + SPLIT**2
"""Oil that swings with the shaft, over that of one line: all of the lower line, whose pressure is held at the pumps; of
the higher line the flow into its pump end, whose energy counts."""
HELD_BY, HELD_OVER = 3e5, 1e5
"""A line is held at the pumps up to this pressure above its flushing valve's, and the change is this wide [Pa]."""
SIDES = ((P_A, -1.0), (P_B, 1.0))
"""Pressure transmitters, and the sign by which the pressure at the motors differs from the line's mean as oil goes to
the motors in A."""


class Twin:
    """A crane on stretches of tests. clusters: for each sample the turn that it is of, -1 for none."""

    def __init__(
        self, crane: Crane, time_segments: Sequence[DynamicsSegment], clusters: Sequence[NDArray[np.int64]]
    ) -> None:
        self.crane, self.time_segments = crane, tuple(time_segments)
        self.least_J = max(-MOST, math.log(1.0 - LEAST_OTHER_INERTIA / inertia_ratio_without_wire(crane)))
        stiffest = {u.name: u.most for u in UNKNOWNS} | {C_H: -MOST, INERTIA: self.least_J}
        self.n_sub = max(steps_per_cycle(bent(crane, stiffest), s) for s in time_segments)
        shape = [
            (s, c, k, name) for s, c in zip(time_segments, clusters, strict=True) for k, name in enumerate(SIGNALS)
        ]
        self.signal = np.concatenate([np.full(len(s.t), k) for s, _, k, _ in shape])
        self.cluster = np.concatenate([c for _, c, _, _ in shape])
        self.measured = np.concatenate([_compared(s, c, name) for s, c, _, name in shape])
        pump, D = crane.active.pump, crane.active.motor.D_total
        D_m = D * float(np.mean([np.mean(s.u_m) for s in time_segments]))
        self.Q_full = pump.D_total * pump.omega_p
        self.D_m = D_m
        self.inertance = crane.inertia.J_m_eff / D_m**2
        """Inertance of a line whose oil moves as J_m_eff does [Pa s^2/m^3]."""
        self.held = crane.active.boost.p + crane.active.flushing.dp_open + HELD_BY

    def model(self, known: Mapping[str, tuple[float, float]]) -> Model:
        """What `stillhook.validate.dynamics.fitting.output_error.fit` fits; known: logarithms of factors and their
        deviations that other tests tell."""
        spread = np.array([u.spread for u in UNKNOWNS] + [e.spread for e in EXTRAS])
        low = np.array([-u.most for u in UNKNOWNS] + [e.low for e in EXTRAS])
        high = np.array([u.most for u in UNKNOWNS] + [e.high for e in EXTRAS])
        low[PLACE[INERTIA]] = self.least_J
        noise = np.array([NOISE[name] for name in SIGNALS])
        varies = np.array([VARIES.get(name, 0.0) for name in NAMES])
        centres = np.array([centre(self.crane, name) for name in NAMES])
        for name, (x, deviation) in known.items():
            centres[PLACE[name]], spread[PLACE[name]] = x, deviation
        return Model(
            evaluate=self.evaluate,
            signal=self.signal,
            cluster=self.cluster,
            noise=noise,
            centre=centres,
            spread=spread,
            varies=varies,
            low=low,
            high=high,
        )

    def bent(self, theta: FloatArray) -> Crane:
        """The crane at some parameters: the oil in the lines swings with the shaft, and is slowed as viscous friction
        slows it."""
        logs = {u.name: float(theta[i]) for i, u in enumerate(UNKNOWNS)}
        logs[INERTIA] = math.log(math.exp(logs[INERTIA]) + BOTH_LINES * float(theta[PLACE[INERTANCE]]))
        file_friction = viscous_friction(self.crane)
        logs[VISCOUS] = math.log(
            math.exp(logs[VISCOUS]) + self._line_friction * float(theta[PLACE[DROP]]) / file_friction
        )
        return bent(self.crane, logs)

    @property
    def _line_friction(self) -> float:
        """Viscous friction at the shaft that stands for the drop of both lines, per drop at full flow [N m
        s/rad/Pa]."""
        return BOTH_LINES * self.D_m**2 / self.Q_full

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outputs less measurements (n,) and their derivatives (n, p); FAR from the measurements where a run loses its
        numbers."""
        late = float(theta[PLACE[COMMAND_DELAY]])
        moved = [theta + u.step * np.eye(len(theta))[i] for i, u in enumerate(UNKNOWNS)]
        cranes = [self.bent(x) for x in (theta, *moved, theta)]
        delays = [late] * (len(UNKNOWNS) + 1) + [late + DELAY_STEP]
        steps = np.array([u.step for u in UNKNOWNS] + [DELAY_STEP])
        values, slopes = [], []
        for s, runs in zip(self.time_segments, repeated(cranes, self._late(delays), self.n_sub), strict=True):
            rows = np.zeros((len(NAMES), *runs.shape[1:]))
            rows[: len(steps)] = (runs[1:] - runs[0]) / steps[:, None, None]
            values.append(self._sensed(s.t, runs[0], rows, theta).T.ravel())
            slopes.append(rows.transpose(2, 1, 0).reshape(-1, len(NAMES)))
        y, J = np.concatenate(values), np.concatenate(slopes)
        lost = np.isfinite(self.measured) & ~(np.isfinite(y) & np.isfinite(J).all(axis=1))
        far = FAR * np.array([NOISE[name] for name in SIGNALS])[self.signal]
        return np.where(lost, far, y - self.measured), np.where(lost[:, None], 0.0, J)

    def _late(self, delays: Sequence[float]) -> list[list[DynamicsSegment]]:
        """Each stretch with its commands moved by each of the delays [s]."""
        out = []
        for s in self.time_segments:
            made = {x: delayed(s, x) for x in dict.fromkeys(delays)}
            out.append([made[x] for x in delays])
        return out

    def _sensed(self, t: FloatArray, runs: FloatArray, rows: FloatArray, theta: FloatArray) -> FloatArray:
        """Outputs (n, SIGNALS) as their sensors show them: the oil of the lines in the pressures at the motors, then
        what is late, then offsets. rows (p, n, SIGNALS), the derivatives, are brought along."""
        y = runs.copy()
        inertance, drop = float(theta[PLACE[INERTANCE]]), float(theta[PLACE[DROP]])
        viscous = viscous_friction(self.crane) * math.exp(float(theta[PLACE[VISCOUS]]))
        rows[PLACE[DROP]] = rows[PLACE[VISCOUS]] * self._line_friction / viscous
        rows[PLACE[INERTANCE]] = rows[PLACE[INERTIA]] * BOTH_LINES * math.exp(-float(theta[PLACE[INERTIA]]))
        flows, flow_rows = self._through(runs, rows)
        for k, sign in SIDES:
            held = 1.0 / (1.0 + np.exp((runs[:, k] - self.held) / HELD_OVER))
            motors, pumps = held + (1.0 - held) * SPLIT**2, (1.0 - held) * SPLIT * (1.0 - SPLIT)
            Q, Q_rows = (motors * x[OMEGA] + pumps * x[ALPHA_P] for x in (flows, flow_rows))
            rate, rates = (
                motors * np.gradient(x[OMEGA], t, axis=-1) + pumps * np.gradient(x[ALPHA_P], t, axis=-1)
                for x in (flows, flow_rows)
            )
            rows[:, :, k] += sign * (drop / self.Q_full * Q_rows + inertance * self.inertance * rates)
            rows[PLACE[DROP], :, k] += sign * Q / self.Q_full
            rows[PLACE[INERTANCE], :, k] += sign * self.inertance * rate
            y[:, k] += sign * (drop / self.Q_full * Q + inertance * self.inertance * rate)
        for k, name in enumerate(SIGNALS):
            if name in DELAYS:
                self._lag(t, y, rows, k, PLACE[DELAYS[name]], float(theta[PLACE[DELAYS[name]]]))
            if name in OFFSETS:
                rows[PLACE[OFFSETS[name]], :, k] = 1.0
                y[:, k] += theta[PLACE[OFFSETS[name]]]
        return y

    def _through(self, runs: FloatArray, rows: FloatArray) -> tuple[dict[int, FloatArray], dict[int, FloatArray]]:
        """Flows of motors and pumps (n,) [m^3/s] by the places of their signals, and their derivatives (p, n)."""
        factors = {OMEGA: self.D_m, ALPHA_P: self.Q_full}
        return {k: x * runs[:, k] for k, x in factors.items()}, {k: x * rows[:, :, k] for k, x in factors.items()}

    @staticmethod
    def _lag(t: FloatArray, y: FloatArray, rows: FloatArray, k: int, i: int, by: float) -> None:
        """Signal k as a sensor shows it that is late [s]; i: place of the parameter."""
        rows[i, :, k] = -np.gradient(y[:, k], t)
        late = t - by
        for row in rows[:, :, k]:
            row[:] = np.interp(late, t, row)
        y[:, k] = np.interp(late, t, y[:, k])

    def outputs(self, theta: FloatArray) -> tuple[FloatArray, ...]:
        """Outputs at some parameters as the sensors show them, (n, SIGNALS) for each stretch."""
        runs = repeated([self.bent(theta)], self._late([float(theta[PLACE[COMMAND_DELAY]])]), self.n_sub)
        return tuple(
            self._sensed(s.t, r[0], np.zeros((len(NAMES), *r.shape[1:])), theta)
            for s, r in zip(self.time_segments, runs, strict=True)
        )

    def best_start(self) -> FloatArray:
        """The point of a grid over C_h, J and leakage whose outputs lie nearest: an oscillation out of phase by half a
        period would mislead the steps."""
        grid = [
            (a - b, max(a + b, 0.9 * self.least_J), c) for a, b, c in itertools.product(PERIODS, STIFFNESSES, LEAKS)
        ]
        cranes = [bent(self.crane, {C_H: x, INERTIA: y, C_LEAK: z}) for x, y, z in grid]
        cost = np.zeros(len(grid))
        at = 0
        for s, runs in zip(
            self.time_segments,
            repeated(cranes, [[s] * len(cranes) for s in self.time_segments], self.n_sub),
            strict=True,
        ):
            for k in range(len(SIGNALS)):
                cost += _misfit(runs[:, :, k], self.measured[at : at + len(s.t)])
                at += len(s.t)
        theta = np.zeros(len(NAMES))
        for e in EXTRAS:
            theta[PLACE[e.name]] = max(0.0, e.low + 0.05 * e.spread) if e.low >= 0.0 else 0.0
        for name, x in zip((C_H, INERTIA, C_LEAK), grid[int(np.argmin(cost))], strict=True):
            theta[PLACE[name]] = x
        return theta


def _compared(time_segment: DynamicsSegment, cluster: NDArray[np.int64], name: str) -> FloatArray:
    """The measured samples of a signal that count, NaN elsewhere."""
    if name not in time_segment.measured:
        return np.full(len(time_segment.t), np.nan)
    return np.where(time_segment.counted & (cluster >= 0), time_segment.measured[name], np.nan)


def _misfit(runs: FloatArray, y: FloatArray) -> FloatArray:
    """Mean square of every run's deviation over the variance of the measured signal; 0 where it was not logged."""
    ok = np.isfinite(y)
    if not ok.any():
        return np.zeros(len(runs))
    d = np.where(np.isfinite(runs[:, ok]), runs[:, ok] - y[ok], 1e9)
    out: FloatArray = np.mean(d**2, axis=1) / max(float(np.var(y[ok])), 1e-30)
    return out
