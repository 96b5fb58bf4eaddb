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
from stillhook.validate.dynamics.runs import SIGNALS, Stretch


@dataclass(frozen=True)
class Tuning:
    """What was fitted: parameters in the order of `dynamics_unknowns.NAMES`; low, high: their bounds; start: where the
    fit began; before, after: the twin's outputs for each stretch, (n, SIGNALS), with the crane as it is and as tuned,
    as the sensors show them.
    """

    fit: Fit
    low: FloatArray
    high: FloatArray
    start: FloatArray
    before: tuple[FloatArray, ...]
    after: tuple[FloatArray, ...]


def tune(
    crane: Crane,
    stretches: Sequence[Stretch],
    clusters: Sequence[NDArray[np.int64]],
    known: Mapping[str, tuple[float, float]],
    progress: Callable[[float], None],
) -> Tuning:
    """Fit the twin to stretches of a test by Levenberg-Marquardt, from the best of a grid of starts.

    clusters: for each sample the transient that it is of, -1 for none; known: what other tests tell of a factor's
    logarithm, with its deviation. All runs of one step go side by side through the engine.
    """
    twin = Twin(crane, stretches, clusters)
    start, model = twin.best_start(), twin.model(known)
    progress(0.3)
    found = fit(model, start)
    progress(0.9)
    return Tuning(found, model.low, model.high, start, twin.outputs(np.zeros(len(NAMES))), twin.outputs(found.theta))


def normalised_rms(stretches: Sequence[Stretch], outputs: Sequence[FloatArray]) -> Mapping[str, float]:
    """Root mean square of each signal's deviation over the signal's own standard deviation [-], over all stretches."""
    out = {}
    for k, name in enumerate(SIGNALS):
        pairs = [
            (s.measured[name][s.counted], o[s.counted, k])
            for s, o in zip(stretches, outputs, strict=True)
            if name in s.measured
        ]
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
