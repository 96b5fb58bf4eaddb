"""What happened before the counted part of a run: limits that were passed, when, and how far.

Statistics start again where the warm-up is over. What a run went beyond before is part of none of its numbers; it is
reported in a note.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.kernels.lanes import offset, paths
from stillhook.units import show
from stillhook.variables import BY_NAME
from stillhook.winches.registry import WinchType

LOOK, FAR = 20, 200
"""PLC cycles between two looks at the limits, times being known to within a fifth of a second at 10 ms; and as far as
nothing is passed."""
OF_EVERY_WINCH = {"saturation": "saturated", "slack": "slack", "wire": "wire"}
"""Limits that every winch has, and their words in a status."""
REACHED: Mapping[str, tuple[tuple[str, str], ...]] = {
    "cavitation": (("void_max", "vapour up to"), ("p_min", "pressure down to")),
    "relief": (("p_max", "pressure up to"), ("p_r_max", "pressure up to")),
    "overspeed": (("omega_m_max", "motor speed up to"),),
    "rail": (("p_r_min", "pressure down to"),),
    "rod_speed": (("v_rod_max", "rod speed up to"),),
    "power": (("P_hpu_max", "power up to"),),
}
"""How far a limit was passed: the first of these numbers that a winch type has, and that is not 0."""


class Excursion(NamedTuple):
    """A limit that was passed: first and last time seen, and time beyond it [s]."""

    first: float
    last: float
    time: float


class WarmUp(NamedTuple):
    """Excursions of the warm-up by limit, and the statistics of that part."""

    excursions: Mapping[str, Excursion]
    stats: Any


class Watch:
    """Limits of all lanes of a block during its warm-up; driver: of one trajectory's layout, A the block's array."""

    def __init__(self, driver: Any, A: FloatArray, t_cycle: float) -> None:
        st = offset(driver.Lane, "st", 1)
        common = st + offset(driver.Stats, "common", 1)
        named = paths(dict(driver.Stats.__annotations__)["common"])
        own = st + offset(driver.Stats, "limits", 1)
        self.places = {n: common + named.index(f".{n}_cycles") for n in OF_EVERY_WINCH}
        self.places |= {n.lstrip("."): own + i for i, n in enumerate(paths(driver.plant.Limits))}
        self.A, self.at, self.t_cycle = A, list(self.places.values()), t_cycle
        self.seen, self.passes = np.zeros((len(self.at), A.shape[1])), False
        self.first, self.last = np.full_like(self.seen, np.inf), np.full_like(self.seen, -np.inf)

    def run(self, piece: Callable[[int, int], None], k: int, count: int) -> None:
        """Cycles k .. k + count - 1 by piece(first, count), which gives the same bits in any pieces: far, and where a
        limit was passed on the way again from its beginning in steps of `LOOK`, which go on while one is."""
        for i in range(0, count, FAR):
            n = min(FAR, count - i)
            if not self.passes:
                begun = self.A.copy()
                piece(i, n)
                if not (self.A[self.at] > self.seen).any():
                    continue
                self.A[...] = begun
            passed = self.seen
            for j in range(i, i + n, LOOK):
                piece(j, short := min(LOOK, i + n - j))
                self.look(k + j, short)
            self.passes = passed is not self.seen

    def look(self, k: int, count: int) -> None:
        """Take what cycles k .. k + count - 1 added."""
        now = self.A[self.at]
        beyond = now > self.seen
        if not beyond.any():
            return
        self.first = np.where(beyond, np.minimum(self.first, k * self.t_cycle), self.first)
        self.last = np.where(beyond, (k + count) * self.t_cycle, self.last)
        self.seen = now

    def of(self, lane: int) -> dict[str, Excursion]:
        """Excursions of one lane."""
        return {
            name: Excursion(
                float(self.first[i, lane]), float(self.last[i, lane]), float(self.seen[i, lane] * self.t_cycle)
            )
            for i, name in enumerate(self.places)
            if self.seen[i, lane] > 0.0
        }


def warm_up_notes(winch: WinchType, before: WarmUp | None, t_cycle: float) -> list[str]:
    """One line on the limits that were passed during the warm-up; none where there is nothing to say."""
    if before is None or not before.excursions:
        return []
    numbers = winch.run_numbers(before.stats, t_cycle)
    words = OF_EVERY_WINCH | dict(winch.causes)
    told = []
    for name, e in before.excursions.items():
        far = [
            f", {text} {show(numbers[n], BY_NAME[n].kind, 3)}"
            for n, text in REACHED.get(name, ())
            if numbers.get(n, 0.0) != 0.0
        ]
        told.append(f"{words[name]} for {e.time:.3g} s between {e.first:.4g} s and {e.last:.4g} s{''.join(far[:1])}")
    return [f"during the warm-up, which is not counted: {'; '.join(told)}"]
