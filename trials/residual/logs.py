"""Samples of the logs that are learned from and judged, made once and kept in a folder of this machine."""

from __future__ import annotations

import os
import tempfile
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np

import stillhook
from stillhook.library import load_crane
from stillhook.live.residual.fit import LearningLog, Sea
from stillhook.live.residual.logs import samples_of, sea_of
from stillhook.live.residual.samples import BIN, Samples
from trials.adaptation.crane import CRANE_FILE, FloatArray
from trials.independent_crane.sea_trial import CYCLE
from trials.residual.crane import Session, simulate

ROWS = 2
"""Cycles between the rows of a log: 20 ms."""


class SampledLog(NamedTuple):
    """A log as `stillhook.live.residual` learns from it; truth: what adaptation leaves over of the true torque of all
    friction at each sample [N m]."""

    session: Session
    log: LearningLog
    truth: FloatArray


@cache
def code() -> str:
    """The code that makes samples: crane, estimator, sampler."""
    source, here = Path(stillhook.__file__).parent / "live", Path(__file__).parent
    files = [*sorted((source / "estimate").glob("*.py")), source / "residual/samples.py"]
    files += [here / f"{n}.py" for n in ("crane", "logs")]
    files += [here.parent / f"adaptation/{n}.py" for n in ("crane", "plant")]
    files += [here.parent / f"independent_crane/{n}.py" for n in ("crane", "plant", "plc", "sea_trial")]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


def sampled(session: Session) -> SampledLog:
    """The samples of a session; its campaign is the crane's of that number."""
    name = "-".join(str(int(x)) for x in session)
    file = Path(tempfile.gettempdir()) / f"stillhook-residual-{code()}" / f"{name}.npz"
    if not file.is_file():
        file.parent.mkdir(exist_ok=True)
        part = file.with_name(f"{os.getpid()}.npz")
        np.savez(part, **_made(session))
        part.replace(file)
    with np.load(file) as kept:
        x, sea, truth = Samples(*kept["columns"]), Sea(*kept["sea"].tolist()), kept["truth"]
    log = LearningLog(name, f"{session.crane}-{session.campaign}", sea, name, x)
    return SampledLog(session, log, truth)


def _made(session: Session) -> dict[str, FloatArray]:
    logged = simulate(session)
    rows = {name: x[::ROWS] for name, x in logged.rows.items()}
    x, _ = samples_of(load_crane(CRANE_FILE), rows)
    lines = 0.5 * (logged.loss[1:] + logged.loss[:-1])
    total, at = np.concatenate([[0.0], np.cumsum(lines)]) * CYCLE, np.arange(len(logged.loss)) * CYCLE
    loss = (np.interp(x.t + 0.5 * BIN, at, total) - np.interp(x.t - 0.5 * BIN, at, total)) / BIN
    return {"columns": np.array(x), "truth": loss - x.modelled, "sea": np.array(sea_of("log", rows))}
