"""Whether a correction has made what is left over smaller on this very crane, of late: else it is not used.

A box of conditions cannot tell a crane whose friction has another form from those that were learned from; what its own
sensors say can.
"""

from __future__ import annotations

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.live.residual.samples import BIN

WINDOW = 300.0
"""Time over which errors are forgotten [s]: that of the friction estimator."""
FEWEST = 60.0
"""Time with samples that were seen before anything counts as proven [s]."""
LESS = 0.8
"""Part of what adaptation leaves that the correction may leave at most to be used [-]. Assumed: half of the gain that
is asked for, so that chance alone does not reach it."""


class Proof:
    """Running sums of squares of what is left over without and with the correction."""

    def __init__(self) -> None:
        self._without = self._with = 0.0
        self._count = 0

    @property
    def ratio(self) -> float:
        """Root mean square with the correction on that without [-], NaN until FEWEST."""
        if self._count < round(FEWEST / BIN) or not self._without > 0.0:
            return float("nan")
        return float(np.sqrt(self._with / self._without))

    @property
    def holds(self) -> bool:
        """Whether the correction may be used."""
        return self.ratio <= LESS

    def add(self, left: float, correction: float) -> None:
        """One more sample that was seen [N m]."""
        fade = 1.0 - BIN / WINDOW
        self._without = fade * self._without + left**2
        self._with = fade * self._with + (left - correction) ** 2
        self._count += 1


def proven(left: FloatArray, correction: FloatArray, inside: BoolArray) -> BoolArray:
    """Samples (n,) at which the samples before them prove the correction."""
    proof, out = Proof(), np.zeros(len(left), dtype=np.bool_)
    for i, (a, c, seen) in enumerate(zip(left.tolist(), correction.tolist(), inside.tolist(), strict=True)):
        out[i] = proof.holds
        if seen:
            proof.add(a, c)
    return out
