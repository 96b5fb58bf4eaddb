"""What the calibration of the crane's sensors adds to an interval: errors that stay, so that no row shows them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import Accuracies, half_width
from stillhook.live.estimate.balance import Balance
from stillhook.live.watch.windows.balances import known_mean
from stillhook.live.watch.windows.batches import BATCH, WINDOWS
from stillhook.live.watch.windows.rows import Piece

LEVELS = ("F_w", "alpha_m", "alpha_pm", "p_hp", "p_a", "p_b", "s_w")
"""Signals whose means over a window the limits of error are compared with."""
Levels = Mapping[str, float]


class Calibration:
    """Half widths by measure. balance of the crane, None where its type has none; accuracies of its sensors."""

    def __init__(self, balance: Balance | None, accuracies: Accuracies | None = None) -> None:
        self._balance, self._accuracies = balance, accuracies or Accuracies()
        self._means: deque[FloatArray] = deque(maxlen=round(max(WINDOWS.values()) / BATCH))
        self._limits: Mapping[str, Callable[[Levels], tuple[float, ...]]] = {
            "load_cell_error": self._cell,
            "motor_offset_error": lambda x: (self._accuracies.alpha_m,),
            "boost_error": lambda x: (self._accuracies.p,),
            "precharge_error": lambda x: (self._accuracies.p / x["p_hp"],),
            "displacement_ratio_error": lambda x: (self._accuracies.alpha_m / x["alpha_m"],),
            "passive_setting_error": self._setting,
            "passive_torque_error": self._torque,
        }

    def add(self, piece: Piece) -> None:
        """One more batch."""
        x = piece.crane
        self._means.append(np.array([known_mean(x[n][piece.new]) if n in x else np.nan for n in LEVELS]))

    def half(self, measure: str, window: str) -> float:
        """What it adds to the interval of a measure over a window [unit of the measure]; 0 where calibration has no
        part in it; infinite where a level that it is a part of is zero."""
        if measure not in self._limits or not self._means:
            return 0.0
        means = np.stack(list(self._means)[-round(WINDOWS[window] / BATCH) :])
        levels = {n: known_mean(means[:, k]) for k, n in enumerate(LEVELS)}
        with np.errstate(divide="ignore"):
            limits = self._limits[measure]({n: np.float64(level) for n, level in levels.items()})
        return half_width([float(limit) for limit in limits if limit == limit], 0.0)

    def _cell(self, x: Levels) -> tuple[float, ...]:
        """Of the load cell, parts of its reading."""
        return self._accuracies.F_gain, self._accuracies.F_zero / x["F_w"]

    def _setting(self, x: Levels) -> tuple[float, ...]:
        """Of the passive torque over that of the load cell."""
        a = self._accuracies
        return (*self._cell(x), a.alpha_pm / x["alpha_pm"], a.p / x["p_hp"])

    def _torque(self, x: Levels) -> tuple[float, ...]:
        """Of the torque of both motor sets less that of the wire, over the latter."""
        if self._balance is None:
            return ()
        a, params = self._accuracies, self._balance.params
        wire = self._balance.geometry(x["s_w"]).r_eff * x["F_w"]
        D_m = params.active.motors.count * params.active.motors.D_max
        of_pressures = a.p * D_m * x["alpha_m"] / wire
        limits = (*self._cell(x), of_pressures, of_pressures, a.alpha_m * D_m * (x["p_a"] - x["p_b"]) / wire)
        if not self._balance.has_passive:
            return limits
        D_pm = params.passive.motors.count * params.passive.motors.D_max
        drop = x["p_hp"] - params.passive.settings.p_lp
        return (*limits, a.alpha_pm * D_pm * drop / wire, a.p * D_pm * x["alpha_pm"] / wire)
