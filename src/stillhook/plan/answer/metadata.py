"""What a plan was asked and how it was answered, as plain data: for JSON, for the report, and for whoever repeats
it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np

from stillhook._version import __version__
from stillhook.control.registry import Mode
from stillhook.engine.validity import envelope_line, twin_line
from stillhook.kernels.build import results_hash
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import Alternative, Limited, Rule
from stillhook.plan.report.basis import payload_rows
from stillhook.spec.crane import Crane, content
from stillhook.spec.validity import CAP, UNSIGNED
from stillhook.units import show
from stillhook.weather.alpha import AlphaTable
from stillhook.weather.series import Weather

DESCRIPTIONS: Mapping[Alternative, str] = {
    Alternative.NONE: "winch on its brake in every phase: nothing is compensated",
    Alternative.CAP: f"a flat {CAP:.0%} of the tip's vertical motion taken away where the winch compensates",
    **{
        Alternative(mode.value): f"twin of the winch under {mode.law.title}; the crane's own settings"
        for mode in Mode
        if mode.compensates
    },
    Alternative.STRONG_SSC: (
        "twin of the winch under semi-secondary control with the gain that its margins allow and an aligned reference"
    ),
}
NOT_COVERED = (
    "vessel motions beyond first order: slow drift, dynamic positioning, green water",
    "horizontal motion and pendulum of the load, tugger lines, twist of wire and load",
    "current on wire and load, and the offset that it makes at depth",
    "bending of crane and boom, wind on load and crane, side lead and off lead",
    "strength of payload, rigging and crane beyond the limits that the rules name",
    "breaking strength of the wire, and its wear and heat where it bends for hours in compensation",
    "soil beyond a spring that yields, clashing of load and hull, stability and ballast with the load over the side",
    "temperature of oil, backlash of gears, failure of components during the lift",
)
"""What no tier of the model holds, for every plan."""


@dataclass(frozen=True, eq=False)
class RunInputs:
    """What an answer follows from beside the plan: tiers that were run, the table of forecast factors, the weather."""

    tiers: tuple[str, ...]
    alpha: AlphaTable = field(repr=False)
    weather: Weather | None = field(default=None, repr=False)


def facts_of(
    plan: LiftPlan, limited: Mapping[tuple[str, Alternative], Sequence[Limited]], inputs: RunInputs
) -> dict[str, Any]:
    """Everything that was asked; limited: rules with their limits of a phase and an alternative. The digest is that of
    everything that the answer follows from: plan, weather, table of forecast factors, tiers."""
    env = plan.environment
    return {
        "name": plan.name,
        "source": plan.source,
        "digest": answer_digest(plan, inputs),
        "notes": list(plan.notes),
        "version": __version__,
        "code": results_hash(),
        "date": datetime.now(UTC).date().isoformat(),
        "tiers": list(inputs.tiers),
        "settings": {
            "wave": env.wave,
            "gamma": env.gamma,
            "spread": env.spread,
            "heading_tolerance": env.heading_tolerance,
            "Hs": list(env.Hs),
            "Tp": list(env.Tp),
            "headings": list(env.headings),
        },
        "crane": _crane(plan.crane),
        "vessel": {"name": plan.vessel.name, "title": plan.vessel.source, "notes": list(plan.vessel.notes)},
        "payload": _payload(plan),
        "place": {"h_tip": plan.h_tip, "depth": plan.depth, "rho": plan.rho, "text": _place(plan)},
        "phases": [described(phase) for phase in plan.phases],
        "rules": {
            "name": plan.rules.name,
            "version": plan.rules.version,
            "digest": plan.rules.digest,
            "changes": list(plan.rules.changes),
            "rows": [_rule(rule) for rule in plan.rules.rules],
        },
        "limited": [
            _limited(phase, alternative, each) for (phase, alternative), rules in limited.items() for each in rules
        ],
        "alternatives": [{"name": a.value, "description": DESCRIPTIONS[a]} for a in plan.alternatives],
        "inputs": _inputs(plan, inputs),
        "not_covered": list(NOT_COVERED),
    }


def _crane(crane: Crane) -> dict[str, Any]:
    c, held = crane.certified, envelope_line(crane)
    certificate: dict[str, Any] | None = None
    if c is not None:
        certificate = {
            "number": c.short,
            "statement": held or twin_line(crane),
            "synthetic": c.synthetic,
            "unsigned": UNSIGNED,
        }
    return {
        "name": crane.name,
        "title": crane.title,
        "SWL": crane.SWL,
        "digest": _crane_digest(crane),
        "twin": twin_line(crane),
        "certificate": certificate,
    }


def _crane_digest(crane: Crane) -> str:
    return _digest("\n".join(f"{name} {text}" for name, text in sorted(content(crane).items())))


def _digest(text: str | bytes) -> str:
    return hashlib.sha256(text if isinstance(text, bytes) else text.encode()).hexdigest()


def _payload(plan: LiftPlan) -> dict[str, Any]:
    payload = plan.payload
    return {
        "name": payload.name,
        "title": payload.title,
        "mass": payload.mass,
        "height": payload.height,
        "digest": _payload_digest(plan),
        "rows": payload_rows(payload, plan.rho),
    }


def _payload_digest(plan: LiftPlan) -> str:
    return _digest(plan.payload.model_dump_json(exclude={"sources", "title", "name"}))


def _place(plan: LiftPlan) -> str:
    at = ", ".join(f"{name} = {show(value, 'length', 4)}" for name, value in (("x", plan.at.x), ("y", plan.at.y)))
    return (
        f"{plan.vessel.name}, crane tip at {at}, {show(plan.h_tip, 'length', 4)} above still water,"
        f" {show(plan.depth, 'length', 5)} deep"
    )


def described(phase: Phase) -> dict[str, Any]:
    """A phase as plain data."""
    return {
        "name": phase.name,
        "kind": phase.kind.value,
        "mode": phase.winch.value,
        "start": phase.start,
        "end": phase.end,
        "speed": phase.speed,
        "duration": phase.duration,
        "compensated": phase.compensated,
        "limits": dict(phase.limits),
    }


def _rule(rule: Rule) -> dict[str, Any]:
    fields = ("key", "title", "quantity", "limit", "standard", "edition", "clause", "note")
    named = {name: getattr(rule, name) for name in fields}
    named |= {"requirement": rule.requirement, "sense": rule.sense.value, "level": rule.level.value}
    return {**named, "phases": [kind.value for kind in rule.phases]}


def _limited(phase: str, alternative: Alternative, each: Limited) -> dict[str, Any]:
    return {
        "phase": phase,
        "alternative": alternative.value,
        "rule": each.rule.key,
        "limit": each.limit,
        "basis": each.basis,
    }


def answer_digest(plan: LiftPlan, inputs: RunInputs) -> str:
    """Hash of everything that an answer follows from."""
    return _digest("\n".join([*inputs.tiers, *(row["sha256"] for row in _inputs(plan, inputs))]))


def _inputs(plan: LiftPlan, inputs: RunInputs) -> list[dict[str, str]]:
    """Files and records that the answer follows from, with a hash of what counts in each."""
    rows = [("plan", plan.source or plan.name, plan.digest), ("crane", plan.crane.name, _crane_digest(plan.crane))]
    if plan.crane.certified is not None:
        rows.append(("certificate", plan.crane.certified.short, plan.crane.certified.digest))
    rows += [("vessel", plan.vessel.source or plan.vessel.name, plan.vessel.digest.hex())]
    rows += [("payload", plan.payload.name, _payload_digest(plan))]
    rows += [("rules", f"{plan.rules.name} {plan.rules.version}".strip(), plan.rules.digest)]
    rows += [
        (
            "forecast factors",
            f"{inputs.alpha.name} {inputs.alpha.texts.get('version', '')}".strip(),
            _alpha_digest(inputs.alpha),
        )
    ]
    if inputs.weather is not None:
        rows.append(("weather", inputs.weather.source, _weather_digest(inputs.weather)))
    return [{"item": item, "file": file, "sha256": digest} for item, file, digest in rows]


def _alpha_digest(table: AlphaTable) -> str:
    return _digest(repr((table.Hs, table.T_POP, table.alpha, table.T_POP_below, table.T_R_below)))


def _weather_digest(weather: Weather) -> str:
    """Of times and numbers as they were read, whatever the file looked like."""
    parts = [weather.time.astype("datetime64[ms]").tobytes(), repr(weather.step).encode()]
    for name in sorted(weather.columns):
        parts += [name.encode(), np.ascontiguousarray(weather.columns[name]).tobytes()]
    return _digest(b"\0".join(parts))
