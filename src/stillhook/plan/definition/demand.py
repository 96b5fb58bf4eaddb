"""What a phase of a lift asks in sea states: quantities that rules are held against, from one tier of the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.compensation import Alternative


class Tier(StrEnum):
    """Method of a number: closed form of a standard, frequency-domain method, twin in the time domain."""

    CLOSED_FORM = "closed-form"
    FREQUENCY = "frequency"
    TIME = "time"


@dataclass(frozen=True, eq=False)
class Seas:
    """Sea states of a table, in any order; every array (n,). Hs [m], 0 for a calm; Tp [s]; beta direction of travel
    from the bow [rad]."""

    Hs: FloatArray = field(repr=False)
    Tp: FloatArray = field(repr=False)
    beta: FloatArray = field(repr=False)

    def __len__(self) -> int:
        return len(self.Hs)

    def columns(self) -> list[tuple[float, float, NDArray[np.intp]]]:
        """Every (Tp, beta) that there is, with the rows of its seas by rising Hs."""
        return self._columns

    @cached_property
    def _columns(self) -> list[tuple[float, float, NDArray[np.intp]]]:
        pairs = sorted({(float(T), float(b)) for T, b in zip(self.Tp, self.beta, strict=True)})
        result = []
        for T, b in pairs:
            rows = np.flatnonzero((self.Tp == T) & (self.beta == b))
            result.append((T, b, rows[np.argsort(self.Hs[rows], kind="stable")]))
        return result


@dataclass(frozen=True, eq=False)
class Demand:
    """Quantities of one phase under one alternative in every sea state, from one tier.

    values: quantity (a name of `stillhook.variables`) -> (n,) in SI; NaN where the tier does not tell it. Largest
    values are those of the phase's duration at the quantile of the rule that asks for them. low, high: ends of the 95 %
    interval where there is one, same keys as values or fewer; seeds (n,) runs behind each row (0: none). notes: what a
    reader should know.
    """

    phase: str
    alternative: Alternative
    tier: Tier
    seas: Seas
    values: Mapping[str, FloatArray]
    low: Mapping[str, FloatArray] = field(default_factory=dict)
    high: Mapping[str, FloatArray] = field(default_factory=dict)
    seeds: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()
