"""Draws of the parameters of a set from its evidence: normal, truncated to what physics allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import IdentifyError
from stillhook.library.evidence import Evidence
from stillhook.library.sets import FrictionSet, LossSet

FloatArray = NDArray[np.float64]

LEAST_ALLOWED = 0.02
"""Least share of draws that must be physically allowed [-]: below it the normal distribution of the evidence says nothing about the set."""
TRIAL = 10_000
"""Draws by which that share is found, and the least number that is drawn at once."""


@dataclass(frozen=True)
class Draws:
    """names of the parameters; values shape (n, names) [SI]; allowed share of all draws that were physically allowed [-]."""

    names: tuple[str, ...]
    values: FloatArray
    allowed: float


def draw(item: FrictionSet | LossSet, n: int, rng: np.random.Generator) -> Draws:
    """Draws of the parameters of a set from its evidence, truncated to what physics allows by drawing again. Errors: IdentifyError."""
    evidence = item.evidence
    if evidence is None:
        raise IdentifyError(
            f'set "{item.name}": it has no [evidence], so nothing says how uncertain it is. '
            "Identify it from tests, or give its covariance."
        )
    spec = item.system if isinstance(item, FrictionSet) else item.motor.loss
    mean = np.array([getattr(spec, name) for name in evidence.names])
    least = np.array([np.nextafter(0.0, 1.0) if name == "Y_4" else 0.0 for name in evidence.names])
    kept: list[FloatArray] = []
    have, tried = 0, 0
    while have < n:
        values = mean + _normal(evidence, max(TRIAL, n), rng)
        good = values[np.all(values >= least, axis=1)]
        tried, have = tried + len(values), have + len(good)
        kept.append(good)
        if have < LEAST_ALLOWED * tried:
            raise IdentifyError(
                f'set "{item.name}": only {have / tried:.2%} of the draws have no negative parameter ({_worst(evidence, mean)}). '
                "Its data leave these open: hold one of them, or test more."
            )
    return Draws(evidence.names, np.concatenate(kept)[:n], have / tried)


def _normal(evidence: Evidence, n: int, rng: np.random.Generator) -> FloatArray:
    """Normal deviates with the covariance of the evidence, shape (n, names); scaled to correlations first, for the numbers' sake."""
    C = evidence.matrix
    s = np.sqrt(np.diag(C))
    unit = np.where(s > 0.0, s, 1.0)
    values, vectors = np.linalg.eigh(C / np.outer(unit, unit))
    root = vectors * np.sqrt(np.maximum(values, 0.0))  # eigenvalues below zero are rounding: the evidence has been checked
    out: FloatArray = rng.standard_normal((n, len(s))) @ root.T * s
    return out


def _worst(evidence: Evidence, mean: FloatArray) -> str:
    """The parameters whose deviation is as large as their value, in words."""
    pairs = [(n, m, evidence.deviation(n)) for n, m in zip(evidence.names, mean, strict=True)]
    return ", ".join(f"{n} {m:.3g} ± {s:.3g}" for n, m, s in pairs if s >= m) or "all of them together"
