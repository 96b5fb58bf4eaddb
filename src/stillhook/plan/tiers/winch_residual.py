"""What the winch leaves of the tip's motion under each alternative: nothing less, a flat share, or what the twin says
at a duty."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.errors import StillhookError
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.response.lift import share_of_time, table_at
from stillhook.response.winch.duty import Duty
from stillhook.response.winch.identify import Winch, identify_many, mixed
from stillhook.response.winch.linear_form import Residual
from stillhook.spec.validity import CAP

BRAKE = Residual.constant(1.0, "winch on its brake")
FLAT = Residual.constant(1.0 - CAP, f"{CAP:.0%} of the tip's motion taken, flat")


@dataclass(frozen=True, eq=False)
class Way:
    """Residuals of one alternative at lengths of wire s_w (k,) [m], ascending, along the way down; between them they
    are mixed. why: for what reason there are none."""

    s_w: tuple[float, ...]
    tables: tuple[Residual, ...] = field(repr=False)
    reason: str = ""

    @property
    def known(self) -> bool:
        """Whether there are any."""
        return bool(self.tables)

    def at(self, s_w: float) -> Residual:
        """The residual with s_w of wire out [m]; beyond the ends the nearest holds."""
        i, share = self._place(s_w)
        return self.tables[i] if share == 0.0 else mixed(self.tables[i], self.tables[i + 1], share)

    def shares(self, s_w: float, sigma_v: FloatArray, T: FloatArray) -> Mapping[str, FloatArray]:
        """Shares of the time with pumps at their stop and, where there are some, relief valves open, under irregular
        motions of deviation sigma_v [m/s] and period T [s] (n,) with s_w of wire out [m], as
        `stillhook.response.lift.saturation_share`."""

        def of(table: Residual) -> dict[str, FloatArray]:
            each = {"saturation_share": table.saturated, "relief_share": table.relieved}
            return {
                name: share_of_time(table, values, sigma_v, T) for name, values in each.items() if values is not None
            }

        return self._mixed(s_w, of)

    def pressure(self, s_w: float, v: FloatArray, T: FloatArray) -> FloatArray | None:
        """Highest pressure of the hoisting side [Pa] under sines of speed amplitude v [m/s] and period T [s], (n,);
        None where the winch has none."""

        def of(table: Residual) -> dict[str, FloatArray]:
            return {} if table.p_a is None else {"p_a": table_at(table.omega, table.v, table.p_a, v, T)}

        return self._mixed(s_w, of).get("p_a")

    def _mixed(self, s_w: float, of: Callable[[Residual], dict[str, FloatArray]]) -> dict[str, FloatArray]:
        """Numbers of the tables about a length of wire, mixed as the tables are."""
        i, share = self._place(s_w)
        low = of(self.tables[i])
        if share == 0.0:
            return low
        high = of(self.tables[i + 1])
        return {name: (1.0 - share) * low[name] + share * high[name] for name in low if name in high}

    def _place(self, s_w: float) -> tuple[int, float]:
        """Lower neighbour and share of the upper one."""
        i = int(np.clip(np.searchsorted(self.s_w, s_w, side="right") - 1, 0, max(len(self.s_w) - 2, 0)))
        if len(self.s_w) == 1:
            return 0, 0.0
        return i, float(np.clip((s_w - self.s_w[i]) / (self.s_w[i + 1] - self.s_w[i]), 0.0, 1.0))


def ways(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    duties: Sequence[Duty],
    *,
    threads: int = 2,
    progress: Progress | None = None,
) -> Mapping[Alternative, Way]:
    """Residuals of every alternative along a way of duties with more and more wire out, the twin run at both ends of
    it.

    Between the ends residuals are mixed: on a load of 150 t on 600 to 1,500 m of wire that is right to 0.4 cm of the
    wire's end and 1 cm of the load, rms over seas; other random phases move them by 0.4 and 1.5 cm
    (docs/explanation/lift-plan-frequency.md).
    """
    ends = sorted({duty.s_w: duty for duty in duties}.items())
    chosen = [ends[0][1]] if len(ends) == 1 else [ends[0][1], ends[-1][1]]
    twins = [alternative for alternative in alternatives if alternative.twin]
    winches = [Winch(crane, duty, mode) for duty in chosen for crane, mode in map(plan.machine, twins)]
    made = identify_many(winches, threads=threads, progress=progress)
    result = {a: Way((0.0,), (BRAKE,)) for a in Alternative if a.stands} | {Alternative.CAP: Way((0.0,), (FLAT,))}
    for i, alternative in enumerate(twins):
        identified = made[i :: len(twins)]
        reason = next((str(problem) for problem in identified if isinstance(problem, StillhookError)), "")
        tables = tuple(table for table in identified if isinstance(table, Residual))
        result[alternative] = Way((), (), reason) if reason else Way(tuple(duty.s_w for duty in chosen), tables)
    return result
