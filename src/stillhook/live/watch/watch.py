"""The watch of a running twin: rows of crane and twin in; criteria on sliding windows and causes out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stillhook.live.estimate.accuracy import Accuracies
from stillhook.live.estimate.clock import FLOOR, coarse_offset
from stillhook.live.estimate.half_waves import AT_STOP, MOVING
from stillhook.live.watch.causes.diagnosis import Diagnosis, diagnose, signs_of
from stillhook.live.watch.windows.batches import BATCH, WINDOWS
from stillhook.live.watch.windows.criteria import CriteriaWatch, Status, WindowResult
from stillhook.live.watch.windows.measures import names_of
from stillhook.live.watch.windows.rows import Piece, RowBuffer
from stillhook.physics.hydraulics.pump import pump_flow
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import NORMAL_95

REACH = 0.4
"""Largest offset of the encoder's clock that is looked for [s]."""
PLACING = 3
"""Batches from which the offset is found, and that then begin again."""
AGAIN = 0.01
"""Offset that is left over from which rows are put together again [s]."""
FIRST = 10
"""Batches in which it may be: less than the window by which causes are judged."""
LASTING = 3
"""Batches in a row in which the window of 30 s, which itself is three, must say the same before a cause is named."""
SATURATED = 0.02
"""Part of the time at the pumps' end from which a limit of the winch explains a deviation."""
STUCK = 3.0
"""A signal of the crane is frozen where that of the twin moves by so many times its own smallest steps."""
STALE_TIP, WRONG_MODE, AT_LIMIT = "tip motion stale", "mode of the log other than the twin's", "winch at a limit"


class Watched(NamedTuple):
    """What the watch has found at a moment. time of the winch [s]; results: a line a criterion and window; diagnosis
    over the longest window that is full; clock: offset of the encoder that was found and taken out, NaN where it is not
    known, and its half width [s]; limited: part of the last batches at the pumps' end."""

    time: float
    results: tuple[WindowResult, ...]
    diagnosis: Diagnosis
    clock: float
    clock_half: float
    limited: float

    @property
    def failed(self) -> tuple[WindowResult, ...]:
        """Lines whose criterion is not met."""
        return tuple(r for r in self.results if r.status is Status.NOT_OK)


class Watch:
    """Rows of crane and twin, `every` seconds apart. accuracies: limits of error of the crane's sensors.

    >>> import stillhook
    >>> watch = Watch(stillhook.load_crane("nov-250t"), every=0.1)
    >>> watch.add({"p_a": 1.0e7}, {"time": 0.1, "p_a": 1.0e7}) is None
    True
    """

    def __init__(self, crane: Crane, *, every: float = 0.1, accuracies: Accuracies | None = None) -> None:
        self.criteria = CriteriaWatch(crane, accuracies)
        self._crane, self._every, self._accuracies = crane, every, accuracies
        self._buffer = RowBuffer(names_of(crane), every)
        self._offset, self._tries = 0.0, 0
        self._placed = self._settled = False
        self._clocked = "clock" in self.criteria.measures.statistics
        self._flags: list[tuple[str, ...]] = []
        self._limited: list[float] = []
        self._recent: list[frozenset[str]] = []
        self.latest: Watched | None = None

    def add(self, measured: Mapping[str, float], simulated: Mapping[str, float]) -> Watched | None:
        """One more row of each side; what was found, where a batch of 10 s is complete, else None."""
        if not self._buffer.add(measured, simulated):
            return None
        piece = self._buffer.piece(self._offset)
        if not self._placed:
            self._place(piece)
        self.criteria.add(piece)
        self._note(piece)
        self._check_clock()
        self.latest = self._watched(simulated.get("time", self._buffer.rows * self._every))
        return self.latest

    def _place(self, piece: Piece) -> None:
        """Find the offset of the encoder by the flow balance, once there are rows enough, and begin again with it."""
        self._tries += 1
        balance, x = self.criteria.measures.balances.balance, piece.crane
        needed = ("alpha_p", "alpha_m", "p_a", "p_b")
        if balance is None or any(name not in x for name in needed):
            self._placed, self._clocked = True, False
            return
        omega = self.criteria.measures.balances.speed(x, piece.every)
        if omega is None or self._tries < PLACING:
            return
        A = balance.params.active
        q = A.motors.count * A.motors.D_max * x["alpha_m"] * omega
        found = coarse_offset(piece.t, pump_flow(x["alpha_p"], A.pumps), q, REACH)
        if found is not None:
            self._placed = True
            if abs(found) >= 0.5 * AGAIN:
                self._begin_anew(found)

    def _begin_anew(self, offset: float) -> None:
        self._offset = offset
        self.criteria = CriteriaWatch(self._crane, self._accuracies)

    def _check_clock(self) -> None:
        """Put the rows together again where the first minutes leave an offset: later on it is a sign."""
        if self._settled or not self._placed:
            return
        left = self.criteria.estimate("clock", "30 s") if self._clocked else None
        if left is not None and AGAIN < abs(left.value) < REACH and left.half < abs(left.value):
            self._begin_anew(self._offset + left.value)
        else:
            known = left is not None and abs(left.value) <= AGAIN and left.half <= AGAIN
            self._settled = known or not self._clocked or self.criteria.batches > FIRST

    def _note(self, piece: Piece) -> None:
        """What is seen directly in a batch."""
        x, w, new, flags = piece.crane, piece.twin, piece.new, []
        moves = "omega_m" in x and float(np.nanmax(np.abs(x["omega_m"][new]), initial=0.0)) > MOVING
        if "s_tip" in x and moves and np.ptp(np.nan_to_num(x["s_tip"][new])) == 0.0:
            flags.append(STALE_TIP)
        if "mode" in x and "mode" in w and np.nanmax(np.abs(x["mode"][new] - w["mode"][new]), initial=0.0) > 0.5:
            flags.append(WRONG_MODE)
        for name in sorted(set(x) & set(w) - {"mode", "s_tip", "v_tip", "brake", "v_op", "u_m", "alpha_m"}):
            m, s = x[name][new], w[name][new]
            if np.isfinite(m).all() and np.ptp(m) == 0.0 and np.ptp(np.nan_to_num(s)) > 0.0 and moves:
                flags.append(f"signal {name} does not change")
        self._flags = [*self._flags, tuple(flags)][-PLACING:]
        at_end = np.mean(np.abs(x["u_p"][new]) >= AT_STOP) if "u_p" in x else 0.0
        self._limited = [*self._limited, float(at_end)][-round(300.0 / BATCH) :]

    def _lasting(self, diagnosis: Diagnosis) -> Diagnosis:
        """The same; over 30 s only where the last batches have a candidate in common, since three groups of a wave each
        give a wrong interval now and then."""
        self._recent = [*self._recent, frozenset(diagnosis.candidates)][-LASTING:]
        common = frozenset.intersection(*self._recent) if len(self._recent) == LASTING else frozenset()
        if diagnosis.window == "30 s" and not common:
            return diagnosis._replace(candidates=(), told=False)
        return diagnosis

    def _watched(self, time: float) -> Watched:
        if self._settled or self.criteria.batches > FIRST:
            results = tuple(self.criteria.results())
        else:  # before the clock is known, wire and speed of the crane are those of another moment
            results = tuple(r.filling for r in self.criteria.results())
        failed = [r for r in results if r.status is Status.NOT_OK]
        conditions = list(dict.fromkeys(f for flags in self._flags for f in flags))
        diagnosis = diagnose((), conditions, "")
        for window in ("5 min", "30 s"):
            if self._settled and self.criteria.batches * BATCH >= WINDOWS[window]:
                diagnosis = diagnose(signs_of(self.criteria, window), conditions, window)
                if diagnosis.candidates:
                    break
        if not conditions:
            diagnosis = self._lasting(diagnosis)
        limited = float(np.mean(self._limited))
        if failed and not diagnosis.candidates and limited > SATURATED:
            diagnosis = diagnosis._replace(candidates=(AT_LIMIT,), told=False)
        clock, half = math.nan, math.nan
        if self._placed and self._clocked:
            for window in ("30 s", "5 min"):
                left = self.criteria.estimate("clock", window)
                if left is not None and math.isfinite(left.value):
                    clock, half = self._offset + left.value, math.hypot(left.half, NORMAL_95 * FLOOR)
        return Watched(time, results, diagnosis, clock, half, limited)
