"""A learned model as a file: JSON that holds numbers alone, what it was learned from, how it did on what was held out,
and a checksum."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook._version import __version__
from stillhook.base.atomic import atomic_file
from stillhook.base.gateway.guard import reader
from stillhook.base.kept.sealed import EXACT, digest_of, read_sealed, sealed
from stillhook.base.kept.sources import PACKAGE
from stillhook.errors import LiveError
from stillhook.kernels.build import results_hash
from stillhook.live.residual.fit import HALF, Fitted, HeldOut, LearningLog, choose, hold_out, interval, learn, ratio_of
from stillhook.live.residual.seen import Seen
from stillhook.live.residual.terms import CONDITIONS, TERMS, Scales
from stillhook.live.residual.trees import NONE, checked
from stillhook.spec.crane import Crane, content
from stillhook.statistics.estimate import Estimate

FORMAT, LEVEL = "stillhook residual model 1", 4
_LEARN = "Learn a model with stillhook live residual LOG... --out."


class Model(NamedTuple):
    """A fitted model and what a reader must know of it. crane: name; content: hashes of the crane file; ratio: what is
    left over on what adaptation leaves, on held-out campaigns and seas; linear: of that the linear part alone; logs:
    what it was learned from, digest -> name; confidence and half width of the interval [N m]."""

    fitted: Fitted
    crane: str
    content: Mapping[str, str]
    logs: Mapping[str, str]
    ratio: Estimate
    linear: Estimate
    confidence: float
    half: float
    digest: str = ""

    @property
    def pays(self) -> bool:
        """Whether it leaves at most HALF of what adaptation leaves, with its interval."""
        return self.ratio.high <= HALF

    @property
    def verdict(self) -> str:
        """One line."""
        of = f"{self.ratio.value:.2f} ({self.ratio.low:.2f} to {self.ratio.high:.2f}) of what adaptation leaves"
        if self.pays:
            return f"level 4 pays: on campaigns and seas that were held out it leaves {of}."
        return (
            f"level 4 does not pay: on campaigns and seas that were held out it leaves {of}; at most {HALF:g} is asked"
            " for. It stays off."
        )


FOLDERS = ("live/estimate", "live/residual")
"""Of the package: code that a model belongs to, besides the twin's."""


@cache
def code() -> str:
    """Hash of the code that a model belongs to: twin, estimator and what is learned."""
    names = [name for name in PACKAGE.inside(FOLDERS, (".py",)) if name.rpartition("/")[0] in FOLDERS]
    return PACKAGE.hash(names, before=results_hash())[:16]


def train(crane: Crane, logs: Sequence[LearningLog]) -> tuple[Model, list[HeldOut]]:
    """Test by held-out campaigns and seas, then a model of all logs. Errors: LiveError for too few campaigns."""
    scales = Scales.of(crane)
    held = hold_out(logs, scales)
    fitted = learn([log.samples for log in logs], scales, *choose(logs, scales))
    names = {log.digest: log.name for log in logs}
    ratios = ratio_of(held), ratio_of(held, "linear")
    return Model(fitted, crane.name, content(crane), names, *ratios, *interval(held)), held


def write_model(path: Path, model: Model) -> str:
    """Write a model; returns its digest."""
    f = model.fitted
    data: dict[str, Any] = {
        "format": FORMAT,
        "level": LEVEL,
        "version": __version__,
        "code": code(),
        "crane": model.crane,
        "content": dict(model.content),
        "logs": dict(model.logs),
        "scales": list(f.scales),
        "terms": {name: [float(b), float(u)] for name, b, u in zip(TERMS, f.coefficients, f.errors, strict=True)},
        "trees": f.trees.tolist(),
        "seen": {n: x.tolist() if isinstance(x, np.ndarray) else x for n, x in f.seen._asdict().items()},
        "interval": [model.confidence, model.half],
        "held_out": [[r.value, r.low, r.high, r.n] for r in (model.ratio, model.linear)],
    }
    with atomic_file(path) as part:
        part.write_text(sealed(data, EXACT), encoding="utf-8", newline="\n")
    return digest_of(data, EXACT)


@reader(LiveError)
def read_model(path: Path, crane: Crane) -> Model:
    """A model for a crane. Errors: LiveError of one line for what is not a model, was changed, or is of another crane
    or code."""
    data = read_sealed(path, FORMAT, "a residual model", _LEARN, LiveError, digits=EXACT)
    if data.get("code") != code():
        raise LiveError(f"{path}: learned with other code ({data.get('code')}; here {code()}). {_LEARN}")
    if data.get("content") != content(crane):
        raise LiveError(
            f'{path}: learned for "{data.get("crane")}" as its file was then, not for "{crane.name}". {_LEARN}'
        )
    try:
        return _model(data)
    except (KeyError, TypeError, ValueError, OverflowError) as problem:
        raise LiveError(f"{path}: not a complete model ({problem}). {_LEARN}") from None


def _model(data: Mapping[str, Any]) -> Model:
    k = len(CONDITIONS)
    pairs = np.array([data["terms"][name] for name in TERMS], dtype=np.float64).reshape(len(TERMS), 2)
    low, high, scale, marks = (np.asarray(data["seen"][n], np.float64).reshape(-1, k) for n in Seen._fields[:4])
    if not (len(low) == len(high) == len(scale) == 1 <= len(marks) and (scale > 0.0).all()):
        raise ValueError("seen: shapes")
    fitted = Fitted(
        Scales(*(float(x) for x in data["scales"])),
        pairs[:, 0],
        pairs[:, 1],
        checked(np.asarray(data["trees"], dtype=np.float64), k) if data["trees"] else NONE,
        Seen(low[0], high[0], scale[0], marks, float(data["seen"]["far"])),
    )
    ratio, linear = (Estimate(*(float(x) for x in row)) for row in data["held_out"])
    confidence, half = (float(x) for x in data["interval"])
    numbers = [*pairs.ravel(), *fitted.scales, *low[0], *high[0], *scale[0], *marks.ravel(), half]
    if not all(math.isfinite(x) for x in (*numbers, ratio.value, fitted.seen.far, confidence)):
        raise ValueError("numbers that are not finite")
    logs = {str(key): str(value) for key, value in data["logs"].items()}
    return Model(fitted, str(data["crane"]), data["content"], logs, ratio, linear, confidence, half, data["digest"])
