"""Tuning of capacitance, leakage and inertia: the twin fitted to a test of the winch's dynamics by its outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.spec.crane import Crane
from stillhook.validate.data_set.records.transients import Transient
from stillhook.validate.dynamics.fitting.model import Twin
from stillhook.validate.dynamics.fitting.output_error import Fit, fit
from stillhook.validate.dynamics.fitting.unknowns import NAMES
from stillhook.validate.dynamics.runs import SIGNALS, DynamicsSegment


@dataclass(frozen=True)
class Tuning:
    """Result of the fit: parameters in the order of `dynamics_unknowns.NAMES`; low, high: their bounds; start: where
    the fit began; before, after: the twin's outputs for each stretch, (n, SIGNALS), with the crane as it is and as
    tuned, as the sensors show them.
    """

    fit: Fit
    low: FloatArray
    high: FloatArray
    start: FloatArray
    before: tuple[FloatArray, ...]
    after: tuple[FloatArray, ...]


def tune(
    crane: Crane,
    time_segments: Sequence[DynamicsSegment],
    clusters: Sequence[NDArray[np.int64]],
    known: Mapping[str, tuple[float, float]],
    progress: Callable[[float], None],
) -> Tuning:
    """Fit the twin to stretches of a test by Levenberg-Marquardt, from the best of a grid of starts.

    clusters: for each sample the transient that it is of, -1 for none; known: logarithms of factors known from other
    tests, with their deviations. All runs of one step go side by side through the engine.
    """
    twin = Twin(crane, time_segments, clusters)
    start, model = twin.best_start(), twin.model(known)
    progress(0.3)
    result = fit(model, start)
    progress(0.9)
    return Tuning(result, model.low, model.high, start, twin.outputs(np.zeros(len(NAMES))), twin.outputs(result.theta))


def normalised_rms(time_segments: Sequence[DynamicsSegment], outputs: Sequence[FloatArray]) -> Mapping[str, float]:
    """Root mean square of each signal's deviation over the signal's own standard deviation [-], over all stretches."""
    out = {}
    for k, name in enumerate(SIGNALS):
        pairs = [
            (s.measured[name][s.counted], o[s.counted, k])
            for s, o in zip(time_segments, outputs, strict=True)
            if name in s.measured
        ]
        if not pairs:
            continue
        y, x = (np.concatenate(p) for p in zip(*pairs, strict=True))
        ok = np.isfinite(x) & np.isfinite(y)
        if ok.any() and np.std(y[ok]) > 0.0:
            out[name] = float(np.sqrt(np.mean((x[ok] - y[ok]) ** 2)) / np.std(y[ok]))
    return out


def clusters_of(time_segment: DynamicsSegment, transients: Sequence[Transient]) -> NDArray[np.int64]:
    """For each sample of a segment the number of its transient, -1 for none."""
    out = np.full(len(time_segment.t), -1)
    for i, x in enumerate(transients):
        if time_segment.holds(x):
            out[x.first - time_segment.first : x.last - time_segment.first] = i
    return out
