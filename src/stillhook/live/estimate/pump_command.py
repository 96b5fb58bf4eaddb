"""Setting of the pumps as it follows their command, where it is not read."""

from __future__ import annotations

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.physics.hydraulics.swash import Servo, displacement, swash_acceleration, swash_rate

LONGEST_STEP = 0.01
"""Longest step of the integration [s]: a third of the control's time constant."""
LONGEST_HOLE = 1.0
"""Hole in the rows after which the setting is taken to be the command [s]."""


class PumpCommand:
    """The crane file's displacement control of the pumps, from row to row."""

    def __init__(self, servo: Servo) -> None:
        self.servo = servo
        self._alpha = self._rate = 0.0
        self._t, self._u = np.nan, 0.0

    def follow(self, t: FloatArray, u_p: FloatArray) -> FloatArray:
        """Settings at times t [s] under the commands u_p, both (n,); a command holds until the next one."""
        out = np.empty(len(t))
        servo = self.servo
        for i, (now, u) in enumerate(zip(t.tolist(), np.nan_to_num(u_p).tolist(), strict=True)):
            span = now - self._t
            if not span <= LONGEST_HOLE:  # the first row, or after a hole
                self._alpha, self._rate = u, 0.0
            else:
                steps = max(1, int(np.ceil(span / LONGEST_STEP - 1e-9)))
                h = span / steps
                for _ in range(steps):
                    self._rate += h * swash_acceleration(self._alpha, self._rate, self._u, servo)
                    self._alpha = displacement(self._alpha + h * swash_rate(self._alpha, self._rate, servo), servo)
            self._t, self._u = now, u
            out[i] = self._alpha
        return out
