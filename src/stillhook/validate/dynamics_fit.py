"""Tuning of capacitance, leakage and inertia: the twin fitted to a test of the winch's dynamics by its outputs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.crane import Crane, beside_wire
from stillhook.validate.dynamics_runs import SIGNALS, Stretch, repeated, steps_per_cycle
from stillhook.validate.dynamics_unknowns import C_H, C_LEAK, INERTIA, UNKNOWNS, bent
from stillhook.validate.output_error import FAR, Fit, Model, fit
from stillhook.validate.record import FloatArray
from stillhook.validate.transients import Transient

OFFSETS = {"p_a": 1e5, "p_b": 1e5}
"""Signals with a constant error of their sensor, and its unit in the fit [SI]."""
OFFSET_SPREAD = 2.0
"""Deviation of such an offset beforehand, in that unit: half a per cent of a transmitter's range."""
DELAYS = {"p_a": "p_delay", "p_b": "p_delay", "omega_m": "omega_delay"}
"""Signals whose sensors may be late, and the parameter that says by how much [s]: filters of transmitters, counting window of a pick-up."""
LATE = {"p_delay": 0.01, "omega_delay": 0.05}
"""Deviation of each of these beforehand [s]; four of them are the bound."""
NOISE = {"p_a": 0.3e5, "p_b": 0.3e5, "omega_m": 0.05, "alpha_p": 3e-4}
"""Least deviation by which a signal's residuals are weighed [SI]: the step of a 12-bit input card, and a little noise."""
MOST = math.log(2.5)
"""A factor on the crane is looked for within exp(MOST) and its inverse."""
LEAST_BESIDE = 0.8
"""The inertia beside the wire, whose own follows from its mass, may fall by this part."""
PERIODS = tuple(math.log(x) for x in (0.70, 0.77, 0.84, 0.92, 1.0, 1.09, 1.19, 1.3, 1.42))
"""Logarithms of sqrt(C_h J) that the search starts from: a twelfth of the period apart, so that the ringing of one falls in step."""
STIFFNESSES = tuple(math.log(x) for x in (0.7, 0.84, 1.0, 1.19, 1.42))
"""Logarithms of sqrt(J / C_h) that it starts from."""
LEAKS = tuple(math.log(x) for x in (0.5, 1.0, 2.0))


@dataclass(frozen=True)
class Tuning:
    """What was fitted. names of the parameters in the order of fit.theta; low, high: their bounds; start: where the fit began; before,
    after: the twin's outputs for each stretch, (n, SIGNALS), with the crane as it is and as tuned, sensors' offsets and delay included."""

    names: tuple[str, ...]
    fit: Fit
    low: FloatArray
    high: FloatArray
    start: FloatArray
    before: tuple[FloatArray, ...]
    after: tuple[FloatArray, ...]

    @property
    def logs(self) -> dict[str, float]:
        """Logarithms of the factors on the crane."""
        return {u.name: float(self.fit.theta[i]) for i, u in enumerate(UNKNOWNS)}

    def place(self, name: str) -> int:
        return self.names.index(name)


def tune(crane: Crane, stretches: Sequence[Stretch], clusters: Sequence[NDArray[np.int64]], progress: Callable[[float], None]) -> Tuning:
    """Fit the twin to stretches of a test by Levenberg-Marquardt, from the best of a grid of starts.

    clusters: for each sample the transient that it is of, -1 for none. All runs of one step go side by side through the engine.
    """
    twin = _Twin(crane, stretches, clusters)
    start, model = twin.best_start(), twin.model()
    progress(0.3)
    found = fit(model, start)
    progress(0.9)
    return Tuning(twin.names, found, model.low, model.high, start, twin.outputs(np.zeros(len(twin.names))), twin.outputs(found.theta))


class _Twin:
    """The twin as a function of the parameters: outputs on all stretches, less the measurements."""

    def __init__(self, crane: Crane, stretches: Sequence[Stretch], clusters: Sequence[NDArray[np.int64]]) -> None:
        self.crane, self.stretches = crane, tuple(stretches)
        self.least_J = max(-MOST, math.log(1.0 - LEAST_BESIDE / beside_wire(crane)))
        stiffest = dict.fromkeys((u.name for u in UNKNOWNS), MOST) | {C_H: -MOST, INERTIA: self.least_J}
        self.n_sub = max(steps_per_cycle(bent(crane, stiffest), s) for s in stretches)
        self.names = (*(u.name for u in UNKNOWNS), *OFFSETS, *LATE)
        shape = [(s, c, k, name) for s, c in zip(stretches, clusters, strict=True) for k, name in enumerate(SIGNALS)]
        self.signal = np.concatenate([np.full(len(s.t), k) for s, _, k, _ in shape])
        self.cluster = np.concatenate([c for _, c, _, _ in shape])
        self.measured = np.concatenate([self._compared(s, c, name) for s, c, _, name in shape])

    @staticmethod
    def _compared(stretch: Stretch, cluster: NDArray[np.int64], name: str) -> FloatArray:
        if name not in stretch.measured:
            return np.full(len(stretch.t), np.nan)
        return np.where(stretch.counted & (cluster >= 0), stretch.measured[name], np.nan)

    def model(self) -> Model:
        high = np.array([MOST] * len(UNKNOWNS) + [10.0 * OFFSET_SPREAD] * len(OFFSETS) + [4.0 * x for x in LATE.values()])
        spread = np.array([u.spread for u in UNKNOWNS] + [OFFSET_SPREAD] * len(OFFSETS) + [*LATE.values()])
        noise = np.array([NOISE[name] for name in SIGNALS])
        low = -high
        low[self.names.index(INERTIA)] = self.least_J
        return Model(self.evaluate, self.signal, self.cluster, noise, spread, low, high)

    def _logs(self, theta: FloatArray) -> dict[str, float]:
        return {u.name: float(theta[i]) for i, u in enumerate(UNKNOWNS)}

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outputs less measurements (n,) and their derivatives (n, p)."""
        logs = self._logs(theta)
        cranes = [bent(self.crane, logs)] + [bent(self.crane, logs | {u.name: logs[u.name] + u.step}) for u in UNKNOWNS]
        steps = np.array([u.step for u in UNKNOWNS])
        values, slopes = [], []
        for stretch, runs in zip(self.stretches, repeated(cranes, self.stretches, self.n_sub), strict=True):
            for k, name in enumerate(SIGNALS):
                rows = np.zeros((len(stretch.t), len(self.names)))
                rows[:, : len(UNKNOWNS)] = (runs[1:, :, k] - runs[0, :, k]).T / steps
                values.append(self._sensed(name, stretch.t, runs[0, :, k], rows, theta))
                slopes.append(rows)
        y, J = np.concatenate(values), np.concatenate(slopes)
        lost = np.isfinite(self.measured) & ~(np.isfinite(y) & np.isfinite(J).all(axis=1))
        far = FAR * np.array([NOISE[name] for name in SIGNALS])[self.signal]
        return np.where(lost, far, y - self.measured), np.where(lost[:, None], 0.0, J)

    def _sensed(self, name: str, t: FloatArray, y: FloatArray, rows: FloatArray, theta: FloatArray) -> FloatArray:
        """An output as its sensor shows it, with the derivatives in rows (n, p) brought along."""
        if name in DELAYS:
            i = self.names.index(DELAYS[name])
            rows[:, i] = -np.gradient(y, t)
            late = t - theta[i]
            for j in np.flatnonzero(rows.any(axis=0)):
                rows[:, j] = np.interp(late, t, rows[:, j])
            y = np.asarray(np.interp(late, t, y))
        if name in OFFSETS:
            i = self.names.index(name)
            rows[:, i] = OFFSETS[name]
            y = y + OFFSETS[name] * float(theta[i])
        return y

    def outputs(self, theta: FloatArray) -> tuple[FloatArray, ...]:
        """The twin's outputs at some parameters, (n, SIGNALS) for each stretch."""
        out = []
        for stretch, runs in zip(self.stretches, repeated([bent(self.crane, self._logs(theta))], self.stretches, self.n_sub), strict=True):
            columns = []
            for k, name in enumerate(SIGNALS):
                rows = np.zeros((len(stretch.t), len(self.names)))
                columns.append(self._sensed(name, stretch.t, runs[0, :, k], rows, theta))
            out.append(np.column_stack(columns))
        return tuple(out)

    def best_start(self) -> FloatArray:
        """The point of a grid over C_h, J and leakage whose outputs lie nearest: a swing that has fallen out of step by half a period
        would lead the steps astray."""
        grid = [(a - b, max(a + b, 0.9 * self.least_J), c) for a, b, c in itertools.product(PERIODS, STIFFNESSES, LEAKS)]
        cranes = [bent(self.crane, {C_H: x, INERTIA: y, C_LEAK: z}) for x, y, z in grid]
        cost = np.zeros(len(grid))
        for i, runs in enumerate(repeated(cranes, self.stretches, self.n_sub)):
            for k in range(len(SIGNALS)):
                cost += _misfit(runs[:, :, k], self._own(i, k))
        best = grid[int(np.argmin(cost))]
        theta = np.zeros(len(self.names))
        for name, x in zip((C_H, INERTIA, C_LEAK), best, strict=True):
            theta[self.names.index(name)] = x
        return theta

    def _own(self, stretch: int, k: int) -> FloatArray:
        """The measured signal k of one stretch, NaN where it is not compared."""
        at = sum(len(s.t) for s in self.stretches[:stretch]) * len(SIGNALS)
        n = len(self.stretches[stretch].t)
        return self.measured[at + k * n : at + (k + 1) * n]


def _misfit(runs: FloatArray, y: FloatArray) -> FloatArray:
    """Mean square of every run's deviation over the variance of the measured signal; 0 where it was not logged."""
    ok = np.isfinite(y)
    if not ok.any():
        return np.zeros(len(runs))
    d = np.where(np.isfinite(runs[:, ok]), runs[:, ok] - y[ok], 1e9)
    out: FloatArray = np.mean(d**2, axis=1) / max(float(np.var(y[ok])), 1e-30)
    return out


def normalised_rms(stretches: Sequence[Stretch], outputs: Sequence[FloatArray]) -> Mapping[str, float]:
    """Root mean square of each signal's deviation over the signal's own standard deviation [-], over all stretches."""
    out = {}
    for k, name in enumerate(SIGNALS):
        pairs = [(s.measured[name][s.counted], o[s.counted, k]) for s, o in zip(stretches, outputs, strict=True) if name in s.measured]
        if not pairs:
            continue
        y, x = (np.concatenate(p) for p in zip(*pairs, strict=True))
        ok = np.isfinite(x) & np.isfinite(y)
        if ok.any() and np.std(y[ok]) > 0.0:
            out[name] = float(np.sqrt(np.mean((x[ok] - y[ok]) ** 2)) / np.std(y[ok]))
    return out


def clusters_of(stretch: Stretch, transients: Sequence[Transient]) -> NDArray[np.int64]:
    """For each sample of a stretch the number of the transient that it is of, -1 for none."""
    out = np.full(len(stretch.t), -1)
    for i, x in enumerate(transients):
        if stretch.holds(x):
            out[x.first - stretch.first : x.last - stretch.first] = i
    return out
