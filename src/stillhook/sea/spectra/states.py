"""Sea states over time as a height, periods and a direction each, where no spectra were kept: weather tables and
hindcasts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class SeaStates:
    """n sea states, one after the other; every array (n,), NaN where unknown.

    time UTC, ascending; valid, where the height is known; H_m0 [m]; T_p, T_m02 [s]; come_from, where waves come from,
    clockwise from north [rad]; source, the file; notes, what the reader had to say.
    """

    time: NDArray[np.datetime64] = field(repr=False)
    valid: NDArray[np.bool_] = field(repr=False)
    H_m0: FloatArray = field(repr=False)
    T_p: FloatArray = field(repr=False)
    T_m02: FloatArray = field(repr=False)
    come_from: FloatArray = field(repr=False)
    source: str = "sea states"
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.time)

    @property
    def n_valid(self) -> int:
        """Records that can be used."""
        return int(np.count_nonzero(self.valid))
