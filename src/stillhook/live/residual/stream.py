"""The model on the stream of rows: a correction of the shaft torque, zero wherever it may not be trusted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stillhook.live.estimate import FrictionState
from stillhook.live.residual.model import LEVEL, Model
from stillhook.live.residual.proof import LESS, Proof
from stillhook.live.residual.samples import Sampler
from stillhook.spec.crane import Crane


@dataclass(frozen=True)
class Correction:
    """What the model adds to the losses of the adapted twin. t: middle of the mean that it is of [s]; torque: what it
    says, hoisting positive, NaN where there is no sample [N m]; half: of its interval [N m]; applied: what may be used
    in the twin, 0 with any of the reasons [N m]; left: what adaptation left over, as measured [N m]; level of the twin
    that uses it."""

    t: float
    torque: float
    half: float
    applied: float
    left: float
    reasons: tuple[str, ...]
    level: int = LEVEL


class ResidualModel:
    """A model on the rows of one crane. `update` takes rows as `FrictionEstimator.update` does, with what that has;
    `predict` is the last correction. `vetoes` counts samples without a correction, by reason; memory is bounded."""

    def __init__(self, crane: Crane, model: Model, *, gas_side: bool = False) -> None:
        self.model = model
        self.vetoes: Counter[str] = Counter()
        self._sampler = Sampler(crane, gas_side=gas_side)
        self._proof = Proof()
        self._last = Correction(np.nan, np.nan, np.inf, 0.0, np.nan, ("no rows yet",))

    def predict(self) -> Correction:
        """The correction of the last complete sample."""
        return self._last

    def update(self, rows: Mapping[str, ArrayLike], state: FrictionState | None) -> Correction:
        """Take rows. Errors: LiveError where signals are missing or time does not increase."""
        before = self._sampler.left_out.total()
        x = self._sampler.take(rows, state)
        if (lost := self._sampler.left_out.total() - before) and not len(x.t):
            reasons = (state.reasons if state is not None else ()) or tuple(self._sampler.left_out)[-1:]
            self.vetoes.update(dict.fromkeys(reasons, lost))
            self._last = Correction(self._sampler.reached, np.nan, np.inf, 0.0, np.nan, reasons)
        if not len(x.t):
            return self._last
        torque, outside = self.model.fitted.torque(x), self.model.fitted.outside(x)
        standing = self._standing(state)
        for i in range(len(x.t)):
            reasons = (*standing, *(reason for reason, of in outside.items() if of[i]), *self._unproven())
            self.vetoes.update(reasons)
            value, left = float(torque[i]), float(x.left[i])
            self._last = Correction(float(x.t[i]), value, self.model.half, 0.0 if reasons else value, left, reasons)
            if not any(of[i] for of in outside.values()):
                self._proof.add(left, value)
        return self._last

    def _standing(self, state: FrictionState | None) -> tuple[str, ...]:
        """Why no correction may be used now, under any conditions."""
        own = () if self.model.pays else ("the model does not pay on what was held out",)
        return (*own, *(state.bounds if state is not None else ()))

    def _unproven(self) -> tuple[str, ...]:
        if self._proof.holds:
            return ()
        ratio = self._proof.ratio
        return (
            "not proven on this crane yet"
            if np.isnan(ratio)
            else f"not proven on this crane: it leaves more than {LESS:g}",
        )
