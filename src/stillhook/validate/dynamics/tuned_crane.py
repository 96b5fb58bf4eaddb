"""The crane as tuned by step 4, for its user to adopt and validate again."""

from __future__ import annotations

from typing import Any

from stillhook.library.crane_file.load import changed
from stillhook.library.leakage import form_of, pump_leak
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.crane import Crane, inertia_ratio_without_wire
from stillhook.units import KINDS, in_display, number, show
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.dynamics.check import DynamicsStep
from stillhook.validate.dynamics.estimates import TunedValue
from stillhook.validate.dynamics.fitting.unknowns import C_H, C_LEAK, INERTIA
from stillhook.validate.parameters.circuit.leakage import LeakChoice
from stillhook.winches.circuits.tables import LeakForm, MotorSet

DIGITS = 4


def tuned_crane(step: Step, campaign: Campaign) -> Crane | None:
    """The campaign's crane with the capacitance, leakage and inertia of step 4, each with its source; None where none
    of them is proposed. A value whose law does not fit is left unchanged.

    The capacitance goes into the volume of the lines, the leakage into motors and pumps of the active circuit alike,
    the inertia into all parts but the wire, whose own follows from its mass. Where the logs refute the form of the
    leakage, the form that they speak for goes in, as the flow balance has it, where they tell the number at the crane
    file's point, and nothing of the crane file's form.
    """
    if not isinstance(step, DynamicsStep):
        return None
    refuted = step.leak is not None and step.leak.refuted
    values = {f.name: f for f in step.tuned if f.offered and not (refuted and f.name == C_LEAK)}
    leak = step.leak if step.leak is not None and step.leak.offered else None
    if not values and leak is None:
        return None
    crane = campaign.crane
    changes: dict[str, Any] = {}
    if C_H in values:
        changes = _over(
            changes, {"active": {"line": {"V": _leaf(crane.active.line.V, "volume", values[C_H], campaign)}}}
        )
    if C_LEAK in values:
        changes = _over(changes, _leakage(crane, values[C_LEAK], campaign))
    if leak is not None:
        changes = _over(changes, _leakage_in_form(crane, leak, campaign))
    if INERTIA in values:
        changes = _over(changes, _inertia(crane, values[INERTIA], campaign))
    return changed(crane, changes)


def _source(tuned: TunedValue, campaign: Campaign) -> str:
    name = {C_H: "capacitance of the lines", C_LEAK: "leakage", INERTIA: "inertia"}[tuned.name]
    return (
        f"{name} fitted to the winch dynamics of {campaign.title}, {campaign.date}: {tuned.factor.value:.4g} times that"
        f" of {campaign.crane.name} (95 %: {tuned.factor.low:.4g} to {tuned.factor.high:.4g})"
    )


def _leaf(
    value: float, kind: str | None, tuned: TunedValue, campaign: Campaign, factor: float | None = None
) -> dict[str, Any]:
    new = value * (tuned.factor.value if factor is None else factor)
    text: Any = (
        float(f"{new:.{DIGITS}g}") if kind is None else f"{number(in_display(new, kind), DIGITS)} {KINDS[kind].display}"
    )
    return {"value": text, "kind": "fitted", "source": _source(tuned, campaign)}


def _leakage(crane: Crane, value: TunedValue, campaign: Campaign) -> dict[str, Any]:
    a = crane.active
    scale = 1.0 if a.pump.leak_scale is None else a.pump.leak_scale
    return {
        "active": {
            "motor": {
                "C_1": _leaf(a.motor.C_1, "leakage", value, campaign),
                "C_2": _leaf(a.motor.C_2, "leakage_per_speed", value, campaign),
            },
            "pump": {"leak_scale": _leaf(scale, None, value, campaign)},
            "C_leak": _leaf(a.C_leak, "leakage", value, campaign),
        }
    }


def _leakage_in_form(crane: Crane, leak: LeakChoice, campaign: Campaign) -> dict[str, Any]:
    """The chosen form with what it gives to pumps and motors; a part of which the data tell the sum alone keeps its
    share of it."""
    a, at, form = crane.active, form_of(crane.active).at, leak.chosen.form
    b = {"head": 0.0, "stroke": 0.0, "speed": 0.0} | leak.chosen.coefficients
    pumps = float(pump_leakage(at.alpha_p, pump_leak(a.pump)))
    motors = a.motor.count * (
        a.motor.C_1 + (0.0 if form in (LeakForm.SPEED, LeakForm.STROKE_SPEED) else a.motor.C_2 * at.n_m)
    )
    scale = 1.0 if a.pump.leak_scale is None else a.pump.leak_scale
    if form in (LeakForm.STROKE, LeakForm.STROKE_SPEED):
        of_pumps, of_motors = b["stroke"], b["head"] / motors if motors > 0.0 else 0.0
    else:
        of_pumps = of_motors = b["head"] / (pumps + motors)
    with_speed = (
        b["speed"] / a.motor.count if form in (LeakForm.SPEED, LeakForm.STROKE_SPEED) else of_motors * a.motor.C_2
    )
    text = (
        f"form of the leakage by the flow balance of {campaign.title}, {campaign.date}: {form} where {crane.name} has"
        f" {leak.file_form}; {show(leak.reference.value, 'leakage', 3)} +- {show(leak.reference.half, 'leakage', 2)} at"
        " active.leak.at"
    )

    def leaf(value: float, kind: str | None) -> dict[str, Any]:
        number_: Any = (
            float(f"{value:.{DIGITS}g}")
            if kind is None
            else f"{number(in_display(value, kind), DIGITS)} {KINDS[kind].display}"
        )
        return {"value": number_, "kind": "fitted", "source": text}

    return {
        "active": {
            "motor": {"C_1": leaf(of_motors * a.motor.C_1, "leakage"), "C_2": leaf(with_speed, "leakage_per_speed")},
            "pump": {"leak_scale": leaf(scale * of_pumps, None)},
            "leak": {"form": {"value": form.value, "kind": "fitted", "source": text}},
            "C_leak": leaf(leak.reference.value, "leakage"),
        }
    }


def _inertia(crane: Crane, value: TunedValue, campaign: Campaign) -> dict[str, Any]:
    part, ratio = crane.inertia, 1.0 + inertia_ratio_without_wire(crane) * (value.factor.value - 1.0)

    def motor(m: MotorSet) -> dict[str, Any]:
        return {"motor": {"J": _leaf(m.J, "inertia", value, campaign, ratio)}}

    out: dict[str, Any] = {
        "inertia": {
            "J_m_eff": _leaf(part.J_m_eff, "inertia", value, campaign),
            "J_gear": _leaf(part.J_gear, "inertia", value, campaign, ratio),
            "J_drum": _leaf(part.J_drum, "inertia", value, campaign, ratio),
        },
    }
    return out | {name: motor(circuit.motor) for name, circuit in crane.circuits.items()}


def _over(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """Nested tables, one merged over the other."""
    both = {k: _over(under[k], over[k]) for k in under.keys() & over.keys()}
    return under | over | both
