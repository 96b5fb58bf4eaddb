"""Where an estimate may be used: inside the envelope of the crane's certificate. Outside it is shown, not applied."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import mode_of_code
from stillhook.engine.certificate import NO_CERTIFICATE, objections
from stillhook.live.estimate.half_waves import HalfWave
from stillhook.physics.scalar import G
from stillhook.sea.motion.recorded import wave_periods, window_spans
from stillhook.spec.crane import Crane
from stillhook.spec.validity import Conditions
from stillhook.variables import WINDOW

EVERY = 0.1
"""Spacing of the tip's motion that is kept [s]."""
PLAUSIBLE = (0.3, 3.0)
"""Factors on the system friction that a winch can have [-] (paper D: cranes of one type within a factor of two;
assumed). Beyond them a sensor or the crane file is wrong."""


class Seen:
    """Tip motion and modes of the last window."""

    def __init__(self, window: float) -> None:
        self._tip: deque[tuple[float, float]] = deque(maxlen=round(window / EVERY))
        self._modes: deque[tuple[float, float]] = deque(maxlen=64)
        self._window = window

    def add(self, rows: Mapping[str, FloatArray]) -> None:
        """More rows."""
        t = rows["time"]
        if "s_tip" in rows:
            last = self._tip[-1][0] if self._tip else -np.inf
            for now, s in zip(t.tolist(), rows["s_tip"].tolist(), strict=True):
                if now >= last + EVERY - 1e-9 and np.isfinite(s):
                    self._tip.append((now, s))
                    last = now
        if "mode" in rows:
            known = np.isfinite(rows["mode"])
            when, mode = t[known], rows["mode"][known]
            last_code = self._modes[-1][1] if self._modes else np.nan
            for i in np.flatnonzero(np.diff(mode, prepend=last_code) != 0.0):
                self._modes.append((float(when[i]), float(mode[i])))

    def tip(self) -> tuple[float, float]:
        """Largest peak-to-peak over 30 s [m] and mean period [s] of the tip; NaN where it is not known."""
        if len(self._tip) < 2.0 * WINDOW / EVERY:
            return np.nan, np.nan
        s = np.array([x for _, x in self._tip])
        periods = wave_periods(s, EVERY)
        span = float(window_spans(s, round(WINDOW / EVERY) + 1).max())
        return span, float(periods.mean()) if len(periods) else np.nan

    def modes(self, since: float) -> tuple[str, ...]:
        """Modes since a moment [s], by name."""
        known = [(t, code) for t, code in self._modes]
        before = [code for t, code in known if t <= since][-1:]
        codes = dict.fromkeys([*before, *(code for t, code in known if t > since)])
        return tuple(mode_of_code(code).value for code in codes)


class Bounds:
    """The certificate of one crane. load: payload [kg], None for what the load cell shows."""

    def __init__(self, crane: Crane, load: float | None) -> None:
        self.crane, self.load = crane, load
        self._objections = objections(crane)

    def judge(
        self, name: str, value: float, plausible: tuple[float, float], seen: Seen, waves: Sequence[HalfWave]
    ) -> tuple[float | None, tuple[str, ...]]:
        """The value of a parameter that may be applied after these half waves, and why none may."""
        low, high = plausible
        reasons = self.reasons(seen, waves)
        if self.crane.certified is not None and not self._objections and not low <= value <= high:
            reasons = (*reasons, f"{name} {value:.3g} is not {low:g} to {high:g}: a sensor or the crane file is wrong")
        return (None, reasons) if reasons else (value, ())

    def reasons(self, seen: Seen, waves: Sequence[HalfWave]) -> tuple[str, ...]:
        """Why nothing may be applied under the conditions of these half waves."""
        certified = self.crane.certified
        if certified is None:
            return (NO_CERTIFICATE,)
        if self._objections:
            return (f"certificate does not hold: {', '.join(self._objections)}",)
        reasons = []
        if certified.synthetic:
            reasons.append(f"certificate {certified.short} is SYNTHETIC: validated on simulated logs, not on a crane")
        if outside := certified.outside(self.conditions(seen, waves)):
            reasons.append(f"outside the validated envelope: {', '.join(outside)}")
        span, period = seen.tip()
        if not (np.isfinite(span) and np.isfinite(period)):
            reasons.append("tip motion not known (s_tip not logged, or less than a minute of it)")
        if not seen.modes(waves[0].t):
            reasons.append("mode not known (mode not logged)")
        return tuple(reasons)

    def conditions(self, seen: Seen, waves: Sequence[HalfWave]) -> Conditions:
        """What the half waves of a window were done under."""
        load = self.load
        if load is None:
            load = float(np.mean([w.F for w in waves])) / G - self.crane.hook_mass
        span, period = seen.tip()
        return Conditions(
            load=load,
            s_w_min=min(w.s_w for w in waves),
            s_w_max=max(w.s_w for w in waves),
            s_tip_pp=span,
            period=period,
            modes=seen.modes(waves[0].t),
        )
