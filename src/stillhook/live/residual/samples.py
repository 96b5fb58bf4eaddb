"""What adaptation leaves over of the shaft torque, in means over a fifth of a second, from the rows of a PLC.

Torque of the motors less that of wire and inertia is what friction takes. The crane file's losses, with the factor on
the system friction that `stillhook.live.estimate` follows, and the standing torque are taken off it. Only a winch that
slides is looked at, as the estimator does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import LiveError
from stillhook.live.estimate import FrictionEstimate, FrictionState
from stillhook.live.estimate.accuracy import F_LAG
from stillhook.live.estimate.balance import Balance
from stillhook.live.estimate.half_waves import AT_RELIEF, MANUAL, MOVING
from stillhook.spec.crane import Crane

BIN = 0.2
"""Length of the means [s]: with the speeds at both ends of each, so that ringing of the circuit cancels."""
PER_BIN, STEP = 20, BIN / 20
"""Steps of a mean, and their length [s]: rows are interpolated to them, so that all means are of the same time."""
WIDEST = 0.05
"""Longest time between rows [s]: four of them make a mean."""
SLOW = 60.0
"""Time over which the load is averaged [s]: some waves, so that it holds no torque of the moment."""
WARMS = 1200.0
"""Time over which oil warms [s] (assumed)."""
TOO_SLOW = f"below {MOVING:g} rad/s: the bristle decides, and its deflection is not measured"
KEPT = 1.0
"""Rows before the next mean that are kept, for a clock that is late [s]."""


class Samples(NamedTuple):
    """Columns (n,). t middle of the mean by the clock of the pressures [s]; left: torque that adaptation leaves over,
    hoisting positive [N m]; modelled: the losses that were taken off, with their sign [N m]; omega motor speed [rad/s];
    rate of it [rad/s^2]; F slow mean of the force in the wire [N]; alpha_m, alpha_pm settings; layer; warm: part of a
    warm-up since the rows began."""

    t: FloatArray
    left: FloatArray
    modelled: FloatArray
    omega: FloatArray
    rate: FloatArray
    F: FloatArray
    alpha_m: FloatArray
    alpha_pm: FloatArray
    layer: FloatArray
    warm: FloatArray


NONE = Samples(*(np.zeros(0) for _ in Samples._fields))


def joined(parts: Sequence[Samples]) -> Samples:
    """Samples one after the other."""
    return Samples(*(np.concatenate(columns) for columns in zip(*parts, strict=True))) if parts else NONE


class Sampler:
    """Makes samples of the rows of one crane as they come; memory is bounded. `left_out` counts means that say nothing,
    by reason. gas_side as of
    `FrictionEstimator`."""

    def __init__(self, crane: Crane, *, gas_side: bool = False) -> None:
        self.balance = Balance(crane, gas_side)
        self.left_out: Counter[str] = Counter()
        self._rows: dict[str, FloatArray] = {}
        self._next = self._first = self._F = np.nan

    @property
    def reached(self) -> float:
        """Up to where rows are worked off [s]."""
        return self._next

    def take(self, rows: Mapping[str, ArrayLike], state: FrictionState | None) -> Samples:
        """More rows, as `FrictionEstimator.update` takes them, and what it has; the samples that are complete now.

        Errors: LiveError where signals are missing, or time does not increase.
        """
        block = {n: np.atleast_1d(np.asarray(x, dtype=np.float64)) for n, x in rows.items()}
        speed = "omega_m" if "omega_m" in block else "v_w"
        kept = ["time", speed, *self.balance.needed, *(n for n in ("mode", "brake") if n in block)]
        if missing := [n.replace("v_w", "omega_m or v_w") for n in kept if n not in block]:
            raise LiveError(f"Rows without {', '.join(missing)}: the torque balance needs them. Log or map them.")
        block = {n: block[n] for n in kept}
        if set(self._rows) == set(block):
            block = {n: np.concatenate([self._rows[n], x]) for n, x in block.items()}
        t = block["time"]
        if not (np.isfinite(t).all() and (np.diff(t) > 0.0).all()):
            raise LiveError(f"Rows up to {t[-1]:g} s: time must increase from row to row. Sort them, or begin again.")
        self._rows = block
        if not np.isfinite(self._next) and len(t):
            self._next = self._first = float(t[0])
        return self._complete(speed, None if state is None else state.estimate)

    def _complete(self, speed: str, estimate: FrictionEstimate | None) -> Samples:
        """The means that rows are there for."""
        x = self._rows
        t = x["time"]
        known = estimate is not None and estimate.clock.found
        offset = estimate.clock.offset if estimate is not None and known else 0.0
        n = int((t[-1] - max(offset, F_LAG, 0.0) - self._next) / BIN + 1e-9) if len(t) else 0
        if n <= 0:
            return NONE
        edges: FloatArray = self._next + BIN * np.arange(n + 1, dtype=np.float64)
        self._next = float(edges[-1])
        out = NONE
        if estimate is None or not known:
            self.left_out["no estimate of friction" if estimate is None else "clock of the encoder not found"] += n
        else:
            out = self._samples(speed, edges, offset, estimate)
        begin = int(np.searchsorted(t, self._next - KEPT))
        self._rows = {name: v[begin:] for name, v in x.items()}
        return out

    def _samples(self, speed: str, edges: FloatArray, offset: float, estimate: FrictionEstimate) -> Samples:
        rows, t, n = self._rows, self._rows["time"], len(edges) - 1
        good = self._good(edges)
        part = rows["s_w"][(t >= edges[0]) & (t < edges[-1])]
        low, high = float(np.nanmin(part, initial=np.inf)), float(np.nanmax(part, initial=-np.inf))
        if not (good.any() and self._same_layer(low, high, n)):
            return NONE
        geo = self.balance.geometry(0.5 * (low + high))
        per_speed = 1.0 if speed == "omega_m" else 1.0 / geo.r_eff
        at = edges[0] + STEP * (np.arange(n * PER_BIN) + 0.5)  # in the middle of steps: means are then those of lines
        x = {name: np.interp(at, t, rows[name]) for name in self.balance.needed}
        x["F_w"] = np.interp(at + F_LAG, t, rows["F_w"])
        omega = per_speed * np.interp(at + offset, t, rows[speed])
        rate = per_speed * np.diff(np.interp(edges + offset, t, rows[speed])) / BIN
        s = self.balance.samples(x, omega, geo)

        def mean(y: FloatArray) -> FloatArray:
            return np.asarray(y.reshape(n, PER_BIN).mean(axis=1))

        modelled, middle = mean(estimate.system.value * s.system + s.motors), 0.5 * (edges[1:] + edges[:-1])
        columns = Samples(
            t=middle,
            left=mean(s.active + s.passive - s.wire) - geo.J * rate - modelled - estimate.standing,
            modelled=modelled,
            omega=mean(omega),
            rate=rate,
            F=self._slow(mean(x["F_w"])),
            alpha_m=mean(x["alpha_m"]),
            alpha_pm=mean(x["alpha_pm"]) if "alpha_pm" in x else np.zeros(n),
            layer=np.full(n, float(geo.layer)),
            warm=1.0 - np.exp(-(middle - self._first) / WARMS),
        )
        steps = omega.reshape(n, PER_BIN)
        slides = (steps.min(axis=1) >= MOVING) | (steps.max(axis=1) <= -MOVING)
        self.left_out[TOO_SLOW] += int((good & ~slides).sum())
        good &= slides & np.isfinite(columns.left) & np.isfinite(columns.F)
        return Samples(*(column[good] for column in columns))

    def _good(self, edges: FloatArray) -> BoolArray:
        """Means that say something (n,); the others are counted."""
        x, t, n = self._rows, self._rows["time"], len(edges) - 1
        place = np.searchsorted(edges, t, side="right") - 1
        inside = (place >= 0) & (place < n)

        def some(bad: BoolArray) -> BoolArray:
            return np.asarray(np.bincount(place[inside & bad], minlength=n) > 0)

        relief = AT_RELIEF * self.balance.params.active.relief.p
        reasons = {
            "holes in the log": some(np.diff(t, prepend=t[0]) > WIDEST) | ~some(inside),
            "signal unknown": some(~np.all([np.isfinite(x[name]) for name in self.balance.needed], axis=0)),
            "manual mode": some(x["mode"] == MANUAL) if "mode" in x else np.zeros(n, dtype=np.bool_),
            "brake closed": some(x["brake"] > 0.0) if "brake" in x else np.zeros(n, dtype=np.bool_),
            "relief valve open": some(np.maximum(x["p_a"], x["p_b"]) > relief),
        }
        good = np.ones(n, dtype=np.bool_)
        for reason, bad in reasons.items():
            if (bad & good).any():
                self.left_out[reason] += int((bad & good).sum())
                good &= ~bad
        return good

    def _same_layer(self, low: float, high: float, n: int) -> bool:
        if self.balance.geometry(low).layer == self.balance.geometry(high).layer:
            return True
        self.left_out["wire changes its layer"] += n
        return False

    def _slow(self, F: FloatArray) -> FloatArray:
        """Force averaged over SLOW; the first value until then."""
        out = np.empty(len(F))
        for i, now in enumerate(F.tolist()):
            if np.isfinite(now):
                self._F = now if not np.isfinite(self._F) else self._F + (now - self._F) * BIN / SLOW
            out[i] = self._F
        return out
