"""What follows from commands, row by row: settings of pumps and motors, and the flow of the make-up pumps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.physics.hydraulics.swash import Servo, displacement, swash_acceleration, swash_rate

LONGEST_STEP = 0.01
"""Longest step of the integration [s]: a third of the control's time constant."""
SETTLING = 3.0
"""Time constants of the PLC's filter after which its unknown start has faded."""
SAME_TIME = 1e-6
"""Difference of two times that are the same but for their rounding [s]."""
LONGEST_HOLE = 1.0
"""Hole in the rows after which the setting is taken to be the command [s]."""


class Setting:
    """The crane file's displacement control of pumps or motors, from row to row."""

    def __init__(self, servo: Servo) -> None:
        self.servo = servo
        self._alpha = self._rate = 0.0
        self._t, self._u = np.nan, 0.0
        self._before = np.empty((2, 0))

    def follow(self, t: FloatArray, command: FloatArray) -> FloatArray:
        """Settings at times t [s] under the commands, both (n,); a command holds until the next one."""
        out = np.empty(len(t))
        servo = self.servo
        if servo.dead_time > 0.0 and len(t):
            rows = np.concatenate([self._before, [t, command]], axis=1)
            at = np.searchsorted(rows[0], t - servo.dead_time + SAME_TIME, side="right")
            command = rows[1][np.maximum(at - 1, 0)]
            self._before = rows[:, rows[0] >= t[-1] - 2.0 * servo.dead_time]
        for i, (now, u) in enumerate(zip(t.tolist(), np.nan_to_num(command).tolist(), strict=True)):
            span = now - self._t
            if not span <= LONGEST_HOLE:  # the first row, or after a hole
                self._alpha, self._rate = u, 0.0
            else:
                steps = max(1, int(np.ceil(span / LONGEST_STEP - 1e-9)))
                h = span / steps
                for _ in range(steps):  # half of the change of the rate before, half after: right to the second order
                    self._rate += 0.5 * h * swash_acceleration(self._alpha, self._rate, self._u, servo)
                    self._alpha = displacement(self._alpha + h * swash_rate(self._alpha, self._rate, servo), servo)
                    self._rate += 0.5 * h * swash_acceleration(self._alpha, self._rate, self._u, servo)
            self._t, self._u = now, u
            out[i] = self._alpha
        return out


class MakeUp:
    """Flow that the make-up pumps add to the accumulators, from row to row: by their logged setting, else by the PLC's
    law on the pressure of the standing piston (`stillhook.control.commands.make_up`). params: the twin's records."""

    def __init__(self, params: Any) -> None:
        self.law, self.tau = params.passive.settings, params.plc.tau_p
        self._p = self._t = self._start = np.nan

    def flow(self, x: Mapping[str, FloatArray], p_hp: FloatArray, r_eff: float) -> FloatArray:
        """Flow at rows x (n,) [m^3/s], NaN while the PLC's filter settles; p_hp of the standing piston [Pa]; r_eff wire
        per motor angle [m/rad]."""
        law = self.law
        if "alpha_pp" in x:
            return np.asarray(law.Q_p_max * x["alpha_pp"])
        mean = np.empty(len(x["time"]))
        for i, (now, p) in enumerate(zip(x["time"].tolist(), p_hp.tolist(), strict=True)):
            if p == p:
                span = now - self._t
                known = span <= LONGEST_HOLE
                self._p = self._p + (p - self._p) * span / (self.tau + span) if known else p
                self._t, self._start = now, self._start if known else now
            mean[i] = self._p if now - self._start > SETTLING * self.tau else np.nan
        u = law.K_acc * (law.p_set - mean)
        if "v_op" in x:
            u = u + law.D_m_max * x["alpha_pm"] * x["v_op"] / r_eff / law.Q_p_max
        return np.asarray(law.Q_p_max * np.clip(u, -1.0, 1.0))
