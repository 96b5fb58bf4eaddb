"""What the winch leaves of the tip's motion under each alternative: nothing less, a flat share, or what the twin says at a duty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.controllers import Controller, controller
from stillhook.certified import CAP
from stillhook.crane import Crane
from stillhook.engine.run import Progress
from stillhook.plan.alternatives import Alternative
from stillhook.response.duty import Duty
from stillhook.response.identify_residual import identify_residual
from stillhook.response.of_lift import saturation_share
from stillhook.response.residual import Residual
from stillhook.response.residual_grid import mixed
from stillhook.scenario import Sensors

FloatArray = NDArray[np.float64]

BRAKE = Residual.constant(1.0, "winch on its brake")
FLAT = Residual.constant(1.0 - CAP, f"{CAP:.0%} of the tip's motion taken, flat")


def controlled(crane: Crane, alternative: Alternative, sensors: Sensors) -> tuple[Crane, Controller]:
    """The crane as an alternative's controller sets it, and that controller. Strong SSC knows the delay of the motion signal."""
    from stillhook.analysis.strong import strong_ssc

    found = strong_ssc(crane, delay=sensors.delay) if alternative is Alternative.STRONG_SSC else controller(alternative.value)
    return found.on(crane), found


@dataclass(frozen=True, eq=False)
class Way:
    """Residuals of one alternative at lengths of wire s_w (k,) [m], ascending, along the way down; between them they are mixed."""

    s_w: tuple[float, ...]
    tables: tuple[Residual, ...] = field(repr=False)

    def at(self, s_w: float) -> Residual:
        """The residual with s_w of wire out [m]; beyond the ends the nearest holds."""
        i, share = self._place(s_w)
        return self.tables[i] if share == 0.0 else mixed(self.tables[i], self.tables[i + 1], share)

    def saturation(self, s_w: float, sigma_v: FloatArray, T: FloatArray) -> FloatArray:
        """`stillhook.response.of_lift.saturation_share` with s_w of wire out."""
        i, share = self._place(s_w)
        each = [saturation_share(self.tables[k], sigma_v, T) for k in ((i,) if share == 0.0 else (i, i + 1))]
        return each[0] if share == 0.0 else (1.0 - share) * each[0] + share * each[1]

    def _place(self, s_w: float) -> tuple[int, float]:
        """Lower neighbour and share of the upper one."""
        i = int(np.clip(np.searchsorted(self.s_w, s_w, side="right") - 1, 0, max(len(self.s_w) - 2, 0)))
        if len(self.s_w) == 1:
            return 0, 0.0
        return i, float(np.clip((s_w - self.s_w[i]) / (self.s_w[i + 1] - self.s_w[i]), 0.0, 1.0))


def ways(
    crane: Crane, alternatives: Sequence[Alternative], duties: Sequence[Duty], *, threads: int = 2, progress: Progress | None = None
) -> Mapping[Alternative, Way]:
    """Residuals of every alternative along a way of duties with more and more wire out, the twin asked at the ends of it."""
    found = {}
    ends = sorted({duty.s_w: duty for duty in duties}.items())
    chosen = [ends[0][1]] if len(ends) == 1 else [ends[0][1], ends[-1][1]]
    for alternative in alternatives:
        if alternative is Alternative.NONE:
            found[alternative] = Way((0.0,), (BRAKE,))
        elif alternative is Alternative.CAP:
            found[alternative] = Way((0.0,), (FLAT,))
        else:
            machine, law = controlled(crane, alternative, duties[0].sensors)
            tables = tuple(identify_residual(machine, duty, law.mode, threads=threads, progress=progress) for duty in chosen)
            found[alternative] = Way(tuple(duty.s_w for duty in chosen), tables)
    return found
