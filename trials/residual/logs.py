"""Samples of the logs that are learned from and judged, made once and kept in a folder of this machine."""

from __future__ import annotations

import os
import tempfile
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np

import stillhook
from stillhook.library import load_crane
from stillhook.live.residual.fit import LearningLog
from stillhook.live.residual.logs import samples_of, sea_of
from stillhook.live.residual.samples import BIN, Samples
from trials.adaptation.crane import CRANE_FILE, FloatArray
from trials.independent_crane.sea_trial import CYCLE
from trials.residual.crane import Session, simulate

ROWS = 2
"""Cycles between the rows of a log: 20 ms."""


class SampledLog(NamedTuple):
    """A log as `stillhook.live.residual` learns from it, and the truth of each sample: what adaptation leaves over of
    the true torque of all friction [N m]."""

    session: Session
    log: LearningLog
    truth: FloatArray


def code() -> str:
    """The code that makes samples: crane, estimator, sampler."""
    source, here = Path(stillhook.__file__).parent / "live", Path(__file__).parent
    files = [
        *sorted((source / "estimate").glob("*.py")),
        source / "residual/samples.py",
        here / "crane.py",
        here / "logs.py",
    ]
    files += [here.parent / f"adaptation/{n}.py" for n in ("crane", "plant")]
    files += [here.parent / f"independent_crane/{n}.py" for n in ("crane", "plant", "plc", "sea_trial")]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


def sampled(session: Session) -> SampledLog:
    """The samples of a session; its campaign is the crane's of that number."""
    name = "-".join(str(int(x)) for x in session)
    file = Path(tempfile.gettempdir()) / f"stillhook-residual-{code()}" / f"{name}.npz"
    if file.is_file():
        with np.load(file) as kept:
            columns, truth, sea = kept["columns"], kept["truth"], kept["sea"]
    else:
        columns, truth, sea = _made(session)
        file.parent.mkdir(exist_ok=True)
        part = file.with_name(f"{os.getpid()}.npz")
        np.savez(part, columns=columns, truth=truth, sea=sea)
        part.replace(file)
    x = Samples(*columns)
    from stillhook.live.residual.fit import Sea

    campaign = f"{session.crane}-{session.campaign}"
    return SampledLog(session, LearningLog(name, campaign, Sea(*sea.tolist()), name, x), truth)


def _made(session: Session) -> tuple[FloatArray, FloatArray, FloatArray]:
    logged = simulate(session)
    rows = {name: x[::ROWS] for name, x in logged.rows.items()}
    x, _ = samples_of(load_crane(CRANE_FILE), rows)
    total, at = np.concatenate([[0.0], np.cumsum(logged.loss)]) * CYCLE, np.arange(len(logged.loss) + 1) * CYCLE
    loss = (np.interp(x.t + 0.5 * BIN, at, total) - np.interp(x.t - 0.5 * BIN, at, total)) / BIN
    return np.array(x), loss - x.modelled, np.array(sea_of("log", rows))
