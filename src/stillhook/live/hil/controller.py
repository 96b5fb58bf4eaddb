"""What calculates the commands of a PLC, one cycle a call: the library's controller, or the exported text compiled."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.guard import guard_at_start
from stillhook.control.interface import Sensed
from stillhook.export.plc.block import controller_block
from stillhook.kernels.control_laws import extra_controllers
from stillhook.kernels.lanes import flatten
from stillhook.kernels.plc_alone import GUARDED, OUTSIDE, GuardedCommands, kernel
from stillhook.spec.crane import Crane

SIGNALS = Sensed._fields
INPUTS = (*SIGNALS, *(f"q_{name}" for name in SIGNALS), "reset")
"""Inputs of a cycle in their order: fields of `Sensed` [SI], quality of each (1 good, 0 bad), reset (0 or 1)."""
OUTPUTS = tuple(GuardedCommands._fields)
"""Outputs of a cycle in their order: fields of `ActuatorCommands`, then alarm, cause and state of the guard."""


class Controller(Protocol):
    """A guarded controller that remembers, started again."""

    @property
    def t_cycle(self) -> float:
        """Time of a cycle [s]."""

    def cycle(self, inputs: FloatArray) -> FloatArray:
        """Commands of the next cycle, numbers of `OUTPUTS` [SI], from numbers of `INPUTS` [SI]; NaN and infinities are
        values that come."""


class LibraryController:
    """The library's controller, compiled: the block that `stillhook plc export` writes, to the bit.

    Parameters: crane; name of the controller; manual mode is part of it.

    Errors: PlcError where the crane's drive does not take the controller.
    """

    def __init__(self, crane: Crane, name: str) -> None:
        block = controller_block(crane, name)
        self.block = block
        self.t_cycle = block.t_cycle
        made = kernel(
            extra_controllers([block.controller]),
            block.drive,
            True,
            block.checks is not None,
            block.prediction is not None,
        )
        laws = made.laws.blank(block.own_settings, guard_at_start(block.guard, block.code), block.checks_at_start)
        self._run = made.run
        self._begin = np.array(flatten(made.Lane(block.memory, laws, block.plc, block.control)))
        self.start()

    def start(self) -> None:
        """Begin again, before the first cycle."""
        self._lane = self._begin.copy()

    def cycle(self, inputs: FloatArray) -> FloatArray:
        """As of `Controller`."""
        return self.cycles(np.asarray(inputs, dtype=np.float64).reshape(1, OUTSIDE)).reshape(-1)

    def cycles(self, inputs: FloatArray) -> FloatArray:
        """Commands (n, len(OUTPUTS)) of n cycles on inputs (n, len(INPUTS)), as many calls of `cycle` give."""
        rows = np.ascontiguousarray(inputs, dtype=np.float64).reshape(-1, OUTSIDE)
        commands = np.empty((len(rows), GUARDED))
        self._run(self._lane, rows.reshape(-1), commands.reshape(-1), len(rows))
        return commands
