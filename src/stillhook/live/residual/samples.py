"""What adaptation leaves over of the shaft torque, in means over a fifth of a second, from the rows of a PLC.

Torque of the motors less that of wire and inertia is what friction takes. The crane file's law (LuGre, with the factor
on the system friction that `stillhook.live.estimate` follows) and the standing torque are taken off it.
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
from stillhook.live.estimate.balance import Balance, Geometry
from stillhook.live.estimate.half_waves import AT_RELIEF, MANUAL, TURNED
from stillhook.physics.friction import bristle_update, dry_torque, system_friction_dry
from stillhook.physics.hydraulics.motor import motors_dry, motors_moving
from stillhook.spec.crane import Crane

BIN = 0.2
"""Length of the means [s]: with the speeds at both ends of each, so that ringing of the circuit cancels."""
WIDEST = 0.05
"""Longest time between rows [s]: the bristle goes from rest to sliding in as much."""
SLOW = 60.0
"""Time over which the load is averaged [s]: some waves, so that it holds no torque of the moment."""
WARMS = 1200.0
"""Time over which oil warms [s] (assumed)."""
LONGEST_SINCE = 10.0
"""Time since a reversal beyond which it does not count [s]."""
KEPT = 1.0
"""Rows before the next mean that are kept, for a clock that is late [s]."""


class Samples(NamedTuple):
    """Columns (n,). t middle of the mean by the clock of the pressures [s]; left: torque that adaptation leaves over,
    hoisting positive [N m]; modelled: the losses that were taken off, with their sign [N m]; sign mean of the
    direction; omega [rad/s]; rate of it [rad/s^2]; F slow mean of the force in the wire [N]; alpha_m, alpha_pm
    settings; layer; since the last reversal [s]; warm: part of a warm-up since the rows began."""

    t: FloatArray
    left: FloatArray
    modelled: FloatArray
    sign: FloatArray
    omega: FloatArray
    rate: FloatArray
    F: FloatArray
    alpha_m: FloatArray
    alpha_pm: FloatArray
    layer: FloatArray
    since: FloatArray
    warm: FloatArray


NONE = Samples(*(np.zeros(0) for _ in Samples._fields))


def joined(parts: Sequence[Samples]) -> Samples:
    """Samples one after the other."""
    return Samples(*(np.concatenate(columns) for columns in zip(*parts, strict=True))) if parts else NONE


class Sampler:
    """Makes samples of the rows of one crane as they come; memory is bounded. `left_out` counts means that say nothing,
    by reason. gas_side as of `FrictionEstimator`."""

    def __init__(self, crane: Crane, *, gas_side: bool = False) -> None:
        self.balance = Balance(crane, gas_side)
        self.left_out: Counter[str] = Counter()
        self._rows: dict[str, FloatArray] = {}
        self._next = self._first = self._F = np.nan
        self._z = self._side = 0.0
        self._turned = -np.inf

    @property
    def reached(self) -> float:
        """Up to where rows are worked off [s]."""
        return self._next

    def take(self, rows: Mapping[str, ArrayLike], state: FrictionState | None) -> Samples:
        """More rows, as `FrictionEstimator.update` takes them, and what it knows; the samples that are complete now.

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
            raise LiveError(f"Rows up to {t[-1]:g} s: time must increase from row to row. Sort them, or begin anew.")
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
            out = self._samples(x, speed, edges, offset, estimate)
        begin = int(np.searchsorted(t, self._next - KEPT))
        self._rows = {name: v[begin:] for name, v in x.items()}
        return out

    def _samples(
        self, x: Mapping[str, FloatArray], speed: str, edges: FloatArray, offset: float, estimate: FrictionEstimate
    ) -> Samples:
        t, n = x["time"], len(edges) - 1
        part = slice(int(np.searchsorted(t, edges[0])), int(np.searchsorted(t, edges[-1])))
        when = t[part]
        place = np.minimum(((when - edges[0]) / BIN + 1e-9).astype(np.intp), n - 1)
        count = np.bincount(place, minlength=n)
        inside = {name: v[part] for name, v in x.items()}
        low, high = np.nanmin(inside["s_w"], initial=np.inf), np.nanmax(inside["s_w"], initial=-np.inf)
        good = self._good(inside, place, count, n)
        if not (good.any() and self._same_layer(float(low), float(high), n)):
            return NONE
        geo = self.balance.geometry(0.5 * float(low + high))
        per_speed = 1.0 if speed == "omega_m" else 1.0 / geo.r_eff
        omega = per_speed * np.interp(when + offset, t, x[speed])
        ends = per_speed * np.interp(edges + offset, t, x[speed])
        inside["F_w"] = np.interp(when + F_LAG, t, x["F_w"])
        weight = 1.0 / np.maximum(count, 1)

        def mean(y: FloatArray) -> FloatArray:
            return np.asarray(np.bincount(place, y, minlength=n) * weight)

        s = self.balance.samples(inside, omega, geo)
        rate, speed_mean, middle = np.diff(ends) / BIN, mean(omega), 0.5 * (edges[1:] + edges[:-1])
        modelled = mean(self._losses(inside, when, omega, geo, estimate.system.value))
        columns = Samples(
            t=middle,
            left=mean(s.active + s.passive - s.wire) - geo.J * rate - modelled - estimate.standing,
            modelled=modelled,
            sign=mean(np.sign(omega)),
            omega=speed_mean,
            rate=rate,
            F=self._slow(mean(inside["F_w"])),
            alpha_m=mean(inside["alpha_m"]),
            alpha_pm=mean(inside.get("alpha_pm", np.zeros(len(when)))),
            layer=np.full(n, float(geo.layer)),
            since=self._since(middle, speed_mean),
            warm=1.0 - np.exp(-(middle - self._first) / WARMS),
        )
        good &= np.isfinite(columns.left) & np.isfinite(columns.F)
        return Samples(*(column[good] for column in columns))

    def _good(self, inside: Mapping[str, FloatArray], place: np.ndarray, count: np.ndarray, n: int) -> BoolArray:
        """Means that say something (n,); the others are counted."""
        relief = AT_RELIEF * self.balance.params.active.relief.p
        unknown = ~np.all([np.isfinite(inside[name]) for name in self.balance.needed], axis=0)
        reasons = {
            "holes in the log": count < round(BIN / WIDEST),
            "signal unknown": np.bincount(place, unknown, minlength=n) > 0,
            "manual mode": np.bincount(place, inside["mode"] == MANUAL, minlength=n) > 0 if "mode" in inside else None,
            "brake closed": np.bincount(place, inside["brake"] > 0.0, minlength=n) > 0 if "brake" in inside else None,
            "relief valve open": np.bincount(
                place, np.maximum(inside["p_a"], inside["p_b"]) > relief, minlength=n
            ) > 0,
        }  # fmt: skip
        good = np.ones(n, dtype=np.bool_)
        for reason, bad in reasons.items():
            if bad is not None and (bad & good).any():
                self.left_out[reason] += int((bad & good).sum())
                good &= ~bad
        return good

    def _same_layer(self, low: float, high: float, n: int) -> bool:
        if self.balance.geometry(low).layer == self.balance.geometry(high).layer:
            return True
        self.left_out["wire changes its layer"] += n
        return False

    def _losses(
        self, x: Mapping[str, FloatArray], t: FloatArray, omega: FloatArray, geo: Geometry, factor: float
    ) -> FloatArray:
        """Losses by the crane file with a factor on the system friction (n,), with the sign of the motion [N m]."""
        P, h = self.balance.params, self.balance.params.hoist
        scale = factor * float(h.n_motors)
        T_d = np.maximum(x["F_w"] * geo.r_eff * self.balance.crane.i_hD, 0.0)
        level = scale * system_friction_dry(omega, T_d, h.friction)
        level = level + motors_dry(x["alpha_m"], x["p_a"] - x["p_b"], P.active.motors)
        moving = scale * h.friction.Y_5 * np.abs(omega) + motors_moving(omega, x["alpha_m"], P.active.motors)
        if self.balance.has_passive:
            level = level + motors_dry(x["alpha_pm"], x["p_hp"] - P.passive.settings.p_lp, P.passive.motors)
            moving = moving + motors_moving(omega, x["alpha_pm"], P.passive.motors)
        step = np.minimum(np.diff(t, prepend=t[0] - (t[1] - t[0] if len(t) > 1 else BIN)), BIN)
        dry, z = np.empty(len(t)), self._z
        for i, (w, g, h_i) in enumerate(zip(omega.tolist(), level.tolist(), step.tolist(), strict=True)):
            z = bristle_update(w, z, g, 0.0, h_i, h.bristle)
            dry[i] = dry_torque(w, z, g, 0.0, h.bristle)
        self._z = z if np.isfinite(z) else 0.0
        return np.asarray(dry + np.sign(omega) * moving)

    def _slow(self, F: FloatArray) -> FloatArray:
        """Force averaged over SLOW; the first value until then."""
        out = np.empty(len(F))
        for i, now in enumerate(F.tolist()):
            if np.isfinite(now):
                self._F = now if not np.isfinite(self._F) else self._F + (now - self._F) * BIN / SLOW
            out[i] = self._F
        return out

    def _since(self, t: FloatArray, omega: FloatArray) -> FloatArray:
        """Time since the last reversal, at most LONGEST_SINCE."""
        out = np.empty(len(t))
        for i, (now, w) in enumerate(zip(t.tolist(), omega.tolist(), strict=True)):
            side = 1.0 if w > TURNED else -1.0 if w < -TURNED else self._side
            if side != self._side:
                self._side, self._turned = side, now
            out[i] = min(now - self._turned, LONGEST_SINCE)
        return out
