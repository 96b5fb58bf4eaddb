"""Balances of torque, flow and gas over a batch, of the crane's signals and of the twin's alike.

Both sides go through the same sums, so that what sampling and the form of a law do to a coefficient is in both, and
what is compared is their ratio or difference.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import F_LAG
from stillhook.live.estimate.balance import WITH_PRESSURES, Balance
from stillhook.live.estimate.half_waves import AFTER, BEFORE, MOVING
from stillhook.live.estimate.parameters.balances import CLEAR_SIDE
from stillhook.live.watch.windows.batches import Statistic, normal, solved
from stillhook.live.watch.windows.rows import Signals
from stillhook.physics.hydraulics.pump import pump_flow
from stillhook.spec.crane import Crane

TORQUE, FLOW, GAS = 2, 4, 2
"""Columns of each regression."""
FORCE_UNIT, FLOW_UNIT = 1e3, 1e-2
"""Sizes that sums are in, so that squares stay near one: 1 kN m; 10 L/s."""


class Balances:
    """Sums of the balances of one crane; empty for winch types without pressures on both sides of their motors."""

    def __init__(self, crane: Crane) -> None:
        self.balance = Balance(crane) if crane.plant.type.name in WITH_PRESSURES else None
        self.statistics: Mapping[str, Statistic] = {} if self.balance is None else dict(self._statistics())

    def sums(self, crane: Signals, twin: Signals, new: slice, every: float) -> dict[str, FloatArray]:
        """Sums of both sides over the new rows, by balance; those that both have signals for."""
        out: dict[str, FloatArray] = {}
        crane, twin = ({name: x[name] for name in x if name in other} for x, other in ((crane, twin), (twin, crane)))
        for name, of in (("torque", self._torque), ("flow", self._flow), ("gas", self._gas)):
            sides = [self._guarded(of, x, new, every, lag) for x, lag in ((crane, F_LAG), (twin, 0.0))]
            known = [side for side in sides if side is not None]
            if len(known) == len(sides):
                out[name] = np.concatenate(known)
        return out

    def speed(self, x: Signals, every: float) -> FloatArray | None:
        """Motor speed [rad/s], from the best signal of the encoder that there is."""
        assert self.balance is not None
        if "omega_m" in x:
            return x["omega_m"]
        if "s_w" not in x:
            return None
        r_eff = self.balance.geometry(known_mean(x["s_w"])).r_eff
        return x["v_w"] / r_eff if "v_w" in x else np.asarray(-np.gradient(x["s_w"], every) / r_eff)

    def _guarded(
        self, of: Callable[..., FloatArray], x: Signals, new: slice, every: float, lag: float
    ) -> FloatArray | None:
        if self.balance is None or (omega := self.speed(x, every)) is None:
            return None
        try:
            return of(x, omega, new, every, lag)
        except KeyError:  # a signal that is not logged
            return None

    def _torque(self, x: Signals, omega: FloatArray, new: slice, every: float, lag: float) -> FloatArray:
        """Torque that nothing else explains, on the file's losses and a constant, where the winch slides."""
        assert self.balance is not None
        geo = self.balance.geometry(known_mean(x["s_w"][new]))
        s = self.balance.samples(x, omega, geo)
        torque = s.active + s.passive - s.wire - geo.J * np.gradient(omega, every)
        torque = torque - lag * geo.r_eff * np.gradient(x["F_w"], every)
        use = slides(omega, every)[new]
        columns = [y[new] / FORCE_UNIT for y in (s.system + s.motors, np.full(len(omega), FORCE_UNIT))]
        sums = normal(columns, torque[new] / FORCE_UNIT, use)
        load = float(np.nansum(np.where(use, s.wire[new], 0.0))) / FORCE_UNIT
        return np.concatenate([sums, [load, float(use.sum())]])

    def _flow(self, x: Signals, omega: FloatArray, new: slice, every: float, lag: float) -> FloatArray:
        """Flow of the pumps less compression, on that of the motors, its rate, the pressure drop and a constant, in the
        line under pressure."""
        assert self.balance is not None
        A = self.balance.params.active
        dp = x["p_a"] - x["p_b"]
        Q = pump_flow(x["alpha_p"], A.pumps) - np.sign(dp) / A.i_C_h * np.gradient(
            np.maximum(x["p_a"], x["p_b"]), every
        )
        q = A.motors.count * A.motors.D_max * x["alpha_m"] * omega
        columns = [q, np.gradient(q, every), dp * 1e-9, np.full(len(q), FLOW_UNIT)]
        return normal([y[new] / FLOW_UNIT for y in columns], Q[new] / FLOW_UNIT, np.abs(dp[new]) > CLEAR_SIDE)

    def _gas(self, x: Signals, omega: FloatArray, new: slice, every: float, lag: float) -> FloatArray:
        """Pressure of the gas side on the oil that the passive motors displaced and on its flow, about their means; its
        own sum, and those of the passive torque and of the wire's."""
        assert self.balance is not None
        P = self.balance.params.passive
        geo = self.balance.geometry(known_mean(x["s_w"][new]))
        D = P.motors.count * P.motors.D_max * x["alpha_pm"]
        q = -(D * omega)[new]
        if "alpha_pp" in x:
            q = q + pump_flow(x["alpha_pp"], P.pumps)[new]
        V, p = np.nancumsum(q) * every, x["p_hp"][new] * 1e-7
        columns = [V - V.mean(), (q - known_mean(q)) / FLOW_UNIT]
        sums = normal(columns, p - known_mean(p), np.ones(len(p)))
        torque = (D * (x["p_hp"] - P.settings.p_lp))[new] / FORCE_UNIT
        wire = (geo.r_eff * x["F_w"])[new] / FORCE_UNIT
        return np.concatenate([sums, [np.nansum(p), len(p), np.nansum(torque), np.nansum(wire)]])

    def _statistics(self) -> list[tuple[str, Statistic]]:
        """By measure of validation, or by name of a sign, with the balance whose sums it is of."""
        assert self.balance is not None
        t, f, g = TORQUE * TORQUE + TORQUE + 2, FLOW * FLOW + FLOW, GAS * GAS + GAS + 4

        def both(of: Callable[[FloatArray], FloatArray], n: int, apart: Callable[..., FloatArray]) -> Statistic:
            return Statistic(lambda s: apart(of(s[..., :n]), of(s[..., n:])))

        def coefficient(k: int, i: int) -> Callable[[FloatArray], FloatArray]:
            return lambda s: solved(s[..., : k * k].reshape(*s.shape[:-1], k, k), s[..., k * k : k * k + k])[..., i]

        def standing(s: FloatArray) -> FloatArray:
            return coefficient(TORQUE, 1)(s) * s[..., -1] / s[..., -2]

        def lag(s: FloatArray) -> FloatArray:
            b = solved(s[..., : FLOW * FLOW].reshape(*s.shape[:-1], FLOW, FLOW), s[..., FLOW * FLOW :])
            return b[..., 1] / b[..., 0]

        def stiffness(s: FloatArray) -> FloatArray:
            return coefficient(GAS, 0)(s) / (s[..., -4] / s[..., -3])

        more = lambda crane, twin: crane / twin - 1.0
        less = lambda crane, twin: crane - twin
        out = [
            ("torque/friction_error", both(coefficient(TORQUE, 0), t, more)),
            ("torque/passive_torque_error", both(standing, t, less)),
            ("flow/displacement_ratio_error", both(coefficient(FLOW, 0), f, more)),
            ("flow/leakage_error", both(coefficient(FLOW, 2), f, more)),
            ("flow/clock", both(lag, f, less)),
        ]
        if self.balance.has_passive:
            A = self.balance.params.active.pumps
            full = A.D_max * A.omega_p * 1e7 / FLOW_UNIT
            out += [
                ("gas/precharge_error", both(lambda s: s[..., -4] / s[..., -3], g, more)),
                ("gas/gas_volume_error", both(stiffness, g, lambda crane, twin: twin / crane - 1.0)),
                ("gas/piston_loss_difference", both(lambda s: coefficient(GAS, 1)(s) * full, g, less)),
                ("gas/passive_setting_error", both(lambda s: s[..., -2] / s[..., -1], g, more)),
            ]
        return out


def known_mean(x: FloatArray) -> float:
    """Mean of what is known; NaN where nothing is."""
    good = np.isfinite(x)
    return float(x[good].mean()) if good.any() else math.nan


def slides(omega: FloatArray, every: float) -> FloatArray:
    """Where the winch slides: fast enough, and not next to a reversal."""
    moving = np.abs(omega) > MOVING
    use = moving.copy()
    for k in range(1, round(AFTER / every) + 1):
        use[k:] &= omega[k:] * omega[:-k] > 0.0
    for k in range(1, round(BEFORE / every) + 1):
        use[:-k] &= omega[:-k] * omega[k:] > 0.0
    return np.asarray(use, dtype=np.float64)
