"""Virtual sensors: numbers of the twin that the crane does not measure, each with a 95 % uncertainty from how far the
measured signals next to it deviate in the current window, and whether it is valid."""

from __future__ import annotations

import math
import tomllib
from collections import deque
from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import pack
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import pump_flow, pump_leakage
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import KINDS

WINDOW, BATCH, LEAST = 300.0, 10.0, 30.0
"""Window of the deviations, batches that it is made of, and the least of it that is enough [s]."""
COVERAGE = 2.5
"""Factor from root mean squares to 95 %: more than the 1.96 of a normal distribution, for deviations come in peaks (set
on seeds 0 to 3 of trials/adaptation/watch, judged on others)."""
_TABLE = tomllib.loads((files("stillhook.live.watch") / "virtual.toml").read_text(encoding="utf-8"))
MEANINGS: Mapping[str, tuple[str, str]] = {
    name: (KINDS[row["kind"]].si, row["meaning"]) for rows in _TABLE.values() for name, row in rows.items()
}
"""SI unit and meaning of every declared sensor."""
Row = Mapping[str, float]


class VirtualSensor(NamedTuple):
    """name; kind of its unit; value: signal of the twin or formula; error: formula that carries the deviations of the
    signals `beside` it; meaning; form: part of the value by which the crane file's own numbers may be off."""

    name: str
    kind: str
    value: str
    error: str
    beside: tuple[str, ...]
    meaning: str
    form: float = 0.0


class Reading(NamedTuple):
    """Of a virtual sensor at a moment: value; half of its 95 % interval, NaN where nothing next to it is measured;
    valid; reason why not."""

    name: str
    value: float
    half: float
    valid: bool
    reason: str


def sensors_of(crane: Crane) -> tuple[VirtualSensor, ...]:
    """Declared virtual sensors of a crane's winch type."""
    rows = {**_TABLE["common"], **_TABLE.get(crane.plant.type.name, {})}
    return tuple(VirtualSensor(name, **{**row, "beside": tuple(row["beside"])}) for name, row in rows.items())


class VirtualSensors:
    """Virtual sensors of a crane over a stream of rows, `every` seconds apart. sensors: others than those declared."""

    def __init__(
        self,
        crane: Crane,
        *,
        every: float = 0.1,
        sensors: tuple[VirtualSensor, ...] | None = None,
    ) -> None:
        self.sensors = sensors_of(crane) if sensors is None else sensors
        self._formulas = formulas_of(crane)
        self._beside = tuple(dict.fromkeys(name for s in self.sensors for name in s.beside))
        self._batch, self._rows = max(1, round(BATCH / every)), 0
        self._new = np.zeros((2, len(self._beside)))
        self._sums: deque[FloatArray] = deque(maxlen=round(WINDOW / BATCH))
        self._rms = dict.fromkeys(self._beside, math.nan)

    def add(self, measured: Row, simulated: Row) -> None:
        """One more row of each side."""
        off = np.array([measured.get(n, math.nan) - simulated.get(n, math.nan) for n in self._beside])
        known = np.isfinite(off)
        self._new += np.stack([np.where(known, off, 0.0) ** 2, known])
        self._rows += 1
        if self._rows % self._batch == 0:
            self._sums.append(self._new)
            self._new = np.zeros_like(self._new)
            if len(self._sums) * BATCH >= LEAST:
                squares, counts = np.sum(self._sums, axis=0)
                rms = np.sqrt(np.divide(squares, counts, out=np.full_like(squares, np.nan), where=counts > 0.0))
                self._rms = dict(zip(self._beside, rms.tolist(), strict=True))

    def read(self, simulated: Row, alarm: str = "") -> list[Reading]:
        """All sensors at a row of the twin. alarm: what is wrong, for as long as something is."""
        return [self._reading(s, simulated, alarm) for s in self.sensors]

    def _reading(self, s: VirtualSensor, row: Row, alarm: str) -> Reading:
        value = self._value(s.value, row)
        half = math.hypot(self._half(s, row), s.form * value)
        reason = alarm or ("" if half == half else "no related signal is measured, or not for long enough")
        return Reading(s.name, value, half, not reason and math.isfinite(value), reason)

    def _value(self, of: str, row: Row) -> float:
        formula = self._formulas.get(of)
        try:
            return float(formula(row)) if formula is not None else row[of]
        except KeyError:
            return math.nan

    def _half(self, s: VirtualSensor, row: Row) -> float:
        """By what each signal next to it is off: the deviation itself, not its slope, so that no law is linearised."""
        base, squares, known = self._value(s.error, row), 0.0, False
        for name in s.beside:
            off = self._rms[name]
            if off == off and name in row:
                squares += (self._value(s.error, {**row, name: row[name] + off}) - base) ** 2
                known = True
        return COVERAGE * math.sqrt(squares) if known else math.nan


def formulas_of(crane: Crane) -> dict[str, Callable[[Row], float]]:
    """Formulas of a crane, by name; those that its circuits have."""
    params = pack(crane, Scenario(load=f"{0.4 * crane.SWL!r} kg", s_w="0 m")).params
    out: dict[str, Callable[[Row], float]] = {}
    if hasattr(params, "active"):
        A = params.active
        D = A.motors.count * A.motors.D_max
        out["T_active"] = lambda x: D * x["alpha_m"] * (x["p_a"] - x["p_b"])
        out["Q_m"] = lambda x: D * x["alpha_m"] * x["omega_m"]
        out["Q_leak"] = lambda x: (
            (pump_leakage(x["alpha_p"], A.pumps.leak) + motor_leakage(x["omega_m"], A.motors))
            * abs(x["p_a"] - x["p_b"])
        )
        out["P_p"] = lambda x: pump_flow(x["alpha_p"], A.pumps) * (x["p_a"] - x["p_b"])
    if crane.passive is not None and hasattr(params, "passive"):
        P, gas = params.passive, crane.passive.accumulator.gas
        D_p = P.motors.count * P.motors.D_max
        out["Q_pm"] = lambda x: D_p * x["alpha_pm"] * x["omega_m"]
        out["T_gas"] = lambda x: gas.T_0 * (x["p_hp"] / gas.p_0) ** ((gas.n - 1.0) / gas.n)
        out["V_gas"] = lambda x: gas.V_0 * (gas.p_0 / x["p_hp"]) ** (1.0 / gas.n)
    return out
