"""The crane as step 4 tunes it, for its user to adopt and validate again."""

from __future__ import annotations

from typing import Any

from stillhook.crane import Crane, MotorSet, beside_wire
from stillhook.library.load import changed
from stillhook.units import KINDS, in_display, number
from stillhook.validate.campaign import Campaign
from stillhook.validate.dynamics import DynamicsStep
from stillhook.validate.dynamics_found import Found
from stillhook.validate.dynamics_unknowns import C_H, C_LEAK, INERTIA
from stillhook.validate.lines import Step

DIGITS = 4


def tuned_crane(step: Step, campaign: Campaign) -> Crane | None:
    """The campaign's crane with the capacitance, leakage and inertia of step 4, each with its source; None where it tells none of them.

    The capacitance goes into the volume of the lines, the leakage into motors and pumps of the active circuit alike, the inertia into all
    parts but the wire, whose own follows from its mass.
    """
    found = {f.name: f for f in step.tuned if f.known} if isinstance(step, DynamicsStep) else {}
    if not found:
        return None
    crane = campaign.crane
    changes: dict[str, Any] = {}
    if C_H in found:
        changes = _over(changes, {"active": {"line": {"V": _leaf(crane.active.line.V, "volume", found[C_H], campaign)}}})
    if C_LEAK in found:
        changes = _over(changes, _leakage(crane, found[C_LEAK], campaign))
    if INERTIA in found:
        changes = _over(changes, _inertia(crane, found[INERTIA], campaign))
    return changed(crane, changes)


def _source(found: Found, campaign: Campaign) -> str:
    what = {C_H: "capacitance of the lines", C_LEAK: "leakage", INERTIA: "inertia"}[found.name]
    return (
        f"{what} fitted to the winch dynamics of {campaign.title}, {campaign.date}: {found.factor:.4g} times that of {campaign.crane.name} "
        f"(95 %: {found.low:.4g} to {found.high:.4g})"
    )


def _leaf(value: float, kind: str | None, found: Found, campaign: Campaign, factor: float | None = None) -> dict[str, Any]:
    new = value * (found.factor if factor is None else factor)
    text: Any = float(f"{new:.{DIGITS}g}") if kind is None else f"{number(in_display(new, kind), DIGITS)} {KINDS[kind].display}"
    return {"value": text, "kind": "fitted", "source": _source(found, campaign)}


def _leakage(crane: Crane, found: Found, campaign: Campaign) -> dict[str, Any]:
    a = crane.active
    scale = 1.0 if a.pump.leak_scale is None else a.pump.leak_scale
    return {
        "active": {
            "motor": {
                "C_1": _leaf(a.motor.C_1, "leakage", found, campaign),
                "C_2": _leaf(a.motor.C_2, "leakage_per_speed", found, campaign),
            },
            "pump": {"leak_scale": _leaf(scale, None, found, campaign)},
            "C_leak": _leaf(a.C_leak, "leakage", found, campaign),
        }
    }


def _inertia(crane: Crane, found: Found, campaign: Campaign) -> dict[str, Any]:
    part, beside = crane.inertia, 1.0 + beside_wire(crane) * (found.factor - 1.0)

    def motor(m: MotorSet) -> dict[str, Any]:
        return {"motor": {"J": _leaf(m.J, "inertia", found, campaign, beside)}}

    out: dict[str, Any] = {
        "inertia": {
            "J_m_eff": _leaf(part.J_m_eff, "inertia", found, campaign),
            "J_gear": _leaf(part.J_gear, "inertia", found, campaign, beside),
            "J_drum": _leaf(part.J_drum, "inertia", found, campaign, beside),
        },
        "active": motor(crane.active.motor),
    }
    return out | ({"passive": motor(crane.passive.motor)} if crane.passive is not None else {})


def _over(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """Nested tables, one laid over the other."""
    both = {k: _over(under[k], over[k]) for k in under.keys() & over.keys()}
    return under | over | both
