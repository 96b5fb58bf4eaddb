"""The leak of a circuit's pumps and motors in the form that the crane file states, as the kernels read it."""

from __future__ import annotations

import bisect
import functools
import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from stillhook.library.catalogue import leak_table
from stillhook.physics.hydraulics.pump import LEAK_KNOTS, PumpLeak, pump_leakage
from stillhook.units import number, show
from stillhook.winches.circuits.tables import ActiveCircuit, Leak, LeakForm, LeakPoint, PassiveCircuit, PumpSet

DEFAULT = Leak(form=LeakForm.STROKE_SPEED, at=LeakPoint())
"""Form of a crane file that states none, as section 2.5.2.4 has it."""
STATED = 0.01
"""Largest part by which a stated total may differ from what pumps and motors leak together [-]: the published one has
one digit."""

Circuit = ActiveCircuit | PassiveCircuit


class LeakLaw(NamedTuple):
    """Leak conductances of a circuit: of its pumps at the table's settings, and of one motor, C_1 [m^3/s/Pa] + C_2
    [m^3/rad/Pa] |n_m|."""

    pumps: PumpLeak
    C_1: float
    C_2: float


@functools.lru_cache(maxsize=256)
def pump_leak(pump: PumpSet) -> PumpLeak:
    """The leak table, of the library or of the crane file, at this pump speed, scaled with the installed size (Moslatt
    2020 section 2.5.2.4).

    Speeds between the two measured ones are interpolated linearly; beyond them the line continues.
    """
    worn = 1.0 if pump.leak_scale is None else pump.leak_scale
    if pump.table is not None:
        scale = pump.D_total / pump.table.D_ref * worn
        return PumpLeak(*(scale * _at_speed(pump.omega_p, pump.table.omega, C) for C in pump.table.rows))
    table = leak_table(pump.leak)
    (w_1, w_2), scale = table.omega, pump.D_total / table.D_ref * worn
    f = (pump.omega_p - w_1) / (w_2 - w_1)
    rows = sorted(zip(table.D, table.C[0], table.C[1], strict=True))
    parts = [round(D / table.D_ref, 3) for D, _, _ in rows]
    assert all(abs(a - b) < 1e-3 for a, b in zip(parts, LEAK_KNOTS, strict=True)), f"{pump.leak}: displacements {parts}"
    return PumpLeak(*(scale * (C_1 + f * (C_2 - C_1)) for _, C_1, C_2 in rows))


def _at_speed(omega: float, speeds: Sequence[float], C: Sequence[float]) -> float:
    """Leak at a pump speed: linear between the measured ones, beyond them as between the last two, never below 0."""
    if len(speeds) == 1:
        return C[0]
    i = min(max(bisect.bisect(speeds, omega), 1), len(speeds) - 1)
    f = (omega - speeds[i - 1]) / (speeds[i] - speeds[i - 1])
    return max(C[i - 1] + f * (C[i] - C[i - 1]), 0.0)


def form_of(circuit: Circuit) -> Leak:
    """The circuit's form of leak and the point where its number holds; the default of a file that states none."""
    return DEFAULT if circuit.leak is None else circuit.leak


def leak_law(circuit: Circuit) -> LeakLaw:
    """Pumps' table and motors' C_1 + C_2 |n_m| in the circuit's form: what does not vary with setting or speed keeps
    its value at `leak.at`.

    Source: Moslatt 2020 tables 2.5 and 2.6, eq. 2.18; the constant one paper E eq. 11. No kernel needs to know of the
    form.
    """
    leak, pumps, motor = form_of(circuit), pump_leak(circuit.pump), circuit.motor
    C_1, C_2 = motor.C_1, motor.C_2
    if leak.form in (LeakForm.CONSTANT, LeakForm.SPEED):
        pumps = PumpLeak(*[float(pump_leakage(leak.at.alpha_p, pumps))] * len(LEAK_KNOTS))
    if leak.form in (LeakForm.CONSTANT, LeakForm.STROKE):
        C_1, C_2 = C_1 + C_2 * leak.at.n_m, 0.0
    return LeakLaw(pumps, C_1, C_2)


def leak_at(circuit: Circuit, alpha_p: float, n_m: float) -> float:
    """Leak of all pumps and motors of a circuit [m^3/s/Pa] at a setting of the pumps [-] and a motor speed [rad/s]."""
    law = leak_law(circuit)
    return float(pump_leakage(alpha_p, law.pumps)) + circuit.motor.count * (law.C_1 + law.C_2 * abs(n_m))


def stated_leak(circuit: Circuit) -> float:
    """The same at the point that the crane file states; the form has no part in it."""
    at = form_of(circuit).at
    return leak_at(circuit, at.alpha_p, at.n_m)


class Point(Protocol):
    """Pressure [Pa], setting of the pumps [-], speed of the motors [rad/s]."""

    @property
    def p(self) -> float | None: ...
    @property
    def alpha_p(self) -> float: ...
    @property
    def n_m(self) -> float: ...


def point_text(at: Point) -> str:
    """A point in words."""
    pressure = "" if at.p is None else f"{show(at.p, 'pressure', 3)}, "
    return f"{pressure}alpha_p {number(at.alpha_p, 3)}, {show(at.n_m, 'rotation', 4)}"


def leak_misfit(active: ActiveCircuit) -> str | None:
    """Why the stated total of a circuit is not what its pumps and motors leak together; None where it is."""
    at, total = form_of(active).at, stated_leak(active)
    motors = leak_at(active, 0.0, at.n_m) - float(pump_leakage(0.0, leak_law(active).pumps))
    if math.isclose(total, active.C_leak, rel_tol=STATED):
        return None
    scale, pumps = 1.0 if active.pump.leak_scale is None else active.pump.leak_scale, total - motors
    way = f'Set C_leak = "{show(total, "leakage")}"'
    if active.C_leak > motors and pumps > 0.0:
        way += f", or pump.leak_scale = {number(scale * (active.C_leak - motors) / pumps, 4)}"
    stated, leaked = show(active.C_leak, "leakage"), show(total, "leakage")
    return f"C_leak {stated} is not what pumps and motors leak at {point_text(at)}: {leaked}. {way}."
