"""Logs as they are learned from: through the friction estimator as on a stream, with the sea that they were in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import sha256_of
from stillhook.errors import LiveError
from stillhook.live.estimate import FrictionEstimator
from stillhook.live.residual.fit import HeldOut, LearningLog, Sea, judged
from stillhook.live.residual.model import Model
from stillhook.live.residual.samples import Sampler, Samples, joined
from stillhook.logs.log import read_log
from stillhook.logs.types import Signal
from stillhook.sea.motion.recorded import wave_periods, window_spans
from stillhook.spec.crane import Crane
from stillhook.variables import WINDOW

EVERY = 1.0
"""Rows that are taken together [s], as the estimator does."""
FEWEST = 500
"""Samples of a log that is learned from or tested: a minute proves a model, and as much is judged."""
ROWS = "0.02 s"
"""Spacing of the rows that a log is read with."""
GRID = 0.1
"""Spacing of the tip's motion from which its sea is read [s]."""


def samples_of(crane: Crane, rows: Mapping[str, FloatArray]) -> tuple[Samples, dict[str, int]]:
    """Samples of rows by name [SI] with "time" [s], each with what the estimator knew then; and how many say nothing,
    by reason."""
    estimator, sampler = FrictionEstimator(crane), Sampler(crane)
    t = rows["time"]
    edges = np.unique([0, *np.searchsorted(t, np.arange(t[0] + EVERY, t[-1], EVERY)).tolist(), len(t)])
    parts = []
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        block = {name: x[a:b] for name, x in rows.items()}
        parts.append(sampler.take(block, estimator.update(block)))
    return joined(parts), dict(sampler.left_out)


def sea_of(name: str, rows: Mapping[str, FloatArray]) -> Sea:
    """Height and period of the tip's motion. Errors: LiveError where it is not known."""
    if "s_tip" in rows:
        t, good = rows["time"], np.isfinite(rows["s_tip"])
        grid = np.arange(t[0], t[-1], GRID)
        s = np.interp(grid, t[good], rows["s_tip"][good]) if good.any() else grid
        periods = wave_periods(s, GRID)
        if len(periods) and len(s) > WINDOW / GRID + 1:
            return Sea(float(window_spans(s, round(WINDOW / GRID) + 1).max()), float(periods.mean()))
    raise LiveError(f"{name}: s_tip is missing or shows no waves: without its sea a log cannot be held out. Map s_tip.")


def learning_log(path: Path, crane: Crane, mapping: Mapping[str, Signal] | None = None) -> LearningLog:
    """A log file; its campaign is the folder that it is in. Errors: LiveError where it says too little."""
    read = read_log(path, None if mapping is None else dict(mapping), every=ROWS)
    rows = {"time": read.t if read.at is None else read.at, **read.signals}
    sea = sea_of(str(path), rows)
    x, left_out = samples_of(crane, rows)
    if len(x.t) < FEWEST:
        most = max(left_out, key=left_out.__getitem__) if left_out else "too short"
        raise LiveError(f"{path}: {len(x.t)} of at least {FEWEST} usable samples (mostly: {most}). Leave this log out.")
    digest = sha256_of(path, LiveError)
    return LearningLog(path.name, path.resolve().parent.name, sea, digest, x)


def test_model(model: Model, logs: Sequence[LearningLog]) -> list[HeldOut]:
    """Logs under a model. Errors: LiveError for one that it learned from."""
    if known := [log.name for log in logs if log.digest in model.logs]:
        raise LiveError(f"{known[0]}: the model was learned from this log. Test it by logs that it has not seen.")
    return [judged(model.fitted, log) for log in logs]


test_model.__test__ = False  # type: ignore[attr-defined]  # no test of pytest
