"""The crane as it is in friction tests: all motors and pumps, active and passive, in one closed circuit."""

from __future__ import annotations

from typing import Any

from stillhook.errors import SpecError
from stillhook.library import changed
from stillhook.library.leakage import form_of
from stillhook.spec.crane import Crane, SourceKind
from stillhook.winches.types import pure_active


def closed_circuit(crane: Crane) -> Crane:
    """The crane as it is for friction tests: all motors and pumps, active and passive, in one closed circuit.

    Source: Moslatt 2020 paper D figure 5 and table 2 (11 motors on the 150 t crane). A pure active crane is returned as
    it is. The line volume grows with the number of motors (assumed), the leak with motors and pumps. Errors: SpecError
    where the motors differ.
    """
    p = crane.circuits.get("passive")
    if p is None:
        return crane
    a = crane.active
    if any(getattr(a.motor, name) != getattr(p.motor, name) for name in ("D_max", "loss", "C_1", "C_2")):
        raise SpecError(
            f'"{crane.name}": active motors {a.motor.type} and passive motors {p.motor.type} differ: they make no one'
            " circuit."
        )
    count = a.motor.count + p.motor.count
    leak_of_motor = a.motor.C_1 + a.motor.C_2 * form_of(a).at.n_m
    pump_leak = max(a.C_leak - a.motor.count * leak_of_motor, 0.0) * (a.pump.D_total + p.pump.D_total) / a.pump.D_total
    tests = "friction tests: active and passive circuit as one closed circuit (Moslatt 2020 paper D figure 5)"
    V = f"{a.line.V * count / a.motor.count!r} m^3"
    return changed(
        crane,
        {
            "name": f"{crane.name}-closed-circuit",
            "title": f"{crane.title}, all motors in one closed circuit for friction tests",
            "plant": _leaf(pure_active.NAME, SourceKind.DERIVED, tests),
            "active": {
                "motor": {"count": _leaf(count, SourceKind.DERIVED, tests)},
                "pump": {"D": _leaf([f"{D!r} m^3/rad" for D in (*a.pump.D, *p.pump.D)], SourceKind.DERIVED, tests)},
                "line": {"V": _leaf(V, SourceKind.ASSUMED, f"{tests}; grows with the motors")},
                "C_leak": _leaf(
                    f"{count * leak_of_motor + pump_leak!r} m^3/s/Pa", SourceKind.DERIVED, f"{tests}; pumps and motors"
                ),
            },
        },
    )


def down_to(crane: Crane, D_m: float) -> Crane:
    """The crane with active motors that reach a displacement of one motor [m^3/rad], as tests may below its PLC's."""
    motor = crane.active.motor
    if D_m / motor.D_max >= motor.alpha_min:
        return crane
    least = _leaf(D_m / motor.D_max, SourceKind.ASSUMED, "smallest displacement of the friction tests")
    return changed(crane, {"active": {"motor": {"alpha_min": least}}})


def _leaf(value: Any, kind: SourceKind, source: str) -> dict[str, Any]:
    return {"value": value, "kind": kind.value, "source": source}
