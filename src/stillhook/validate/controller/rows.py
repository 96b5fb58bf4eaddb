"""Order of inputs and outputs in the rows of a log: of one PLC cycle, or the outputs of an earlier one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.validate.controller.law import MOST_CYCLES, Run, fine_shift

APART = 0.3  # of a cycle: tolerance of a joystick's lag to an integer number of cycles to show the order of the rows
LATE = 0.5  # of a cycle, beyond MOST_CYCLES: a larger lag is not due to the order of rows


@dataclass(frozen=True)
class Rows:
    """cycles: integer cycles by which logged commands are later than the inputs in their row; evidence: "fine",
    "joystick" or "waves"; waves, joystick: lag of logged commands behind simulated ones in compensation and in manual
    mode [s]; step: cycle of the log [s]; lead: time by which a cycle's worth of K_2 leads [s]."""

    cycles: int
    evidence: str
    waves: Estimate | None
    joystick: Estimate | None
    step: float
    correlation: float = 0.0

    @property
    def late(self) -> bool:
        """Whether the lag of the commands exceeds what the order of rows can cause."""
        return self.waves is not None and abs(self.waves.value) > (MOST_CYCLES + LATE) * self.step

    @property
    def aligned(self) -> float:
        """Cycles by which inputs and commands are aligned before gains are estimated: the complete lag where it is not
        due to the order of rows."""
        return self.waves.value / self.step if self.late and self.waves is not None else float(self.cycles)

    @property
    def description(self) -> str:
        """Order of the rows in words."""
        evidence = {
            "fine": f"by the fine structure common to both, correlation {self.correlation:.2f}",
            "joystick": "by the joystick in manual mode",
            "waves": "by the waves, where a cycle is as good as a change of K_2",
        }[self.evidence]
        if self.cycles == 0:
            return f"a row of the log contains inputs and outputs of one cycle ({evidence})"
        way = "later" if self.cycles > 0 else "earlier"
        n = abs(self.cycles)
        return (
            f"the commands in a row of the log are {n} cycle{'s' if n > 1 else ''} {way} than its inputs ({evidence});"
            " they"
            " are compared with this shift"
        )


def rows_of(runs: Sequence[Run], waves: Estimate | None, joystick: Estimate | None, crane: Crane) -> Rows:
    """The order of the rows, by the best evidence available."""
    step = runs[0].segment.record.step
    fine = fine_shift(list(runs))
    if fine is not None and abs(fine[0]) <= MOST_CYCLES:
        return Rows(fine[0], "fine", waves, joystick, step, fine[1])
    if joystick is not None and joystick.half < APART * step:
        k = round(joystick.value / step)
        if abs(joystick.value / step - k) < APART and abs(k) <= MOST_CYCLES:
            return Rows(k, "joystick", waves, joystick, step)
    k = round(waves.value / step) if waves is not None else 0
    return Rows(k if abs(k) <= MOST_CYCLES else 0, "waves", waves, joystick, step)
