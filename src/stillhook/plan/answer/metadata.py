"""Request and answer of a plan as plain data: for JSON, for the report, and for whoever repeats it.

Only in the answer: what is credited and why, the forecast limit of the leading cell, how weather was read,
what stays open.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np

from stillhook._version import __version__
from stillhook.control.registry import Mode
from stillhook.engine.inputs import envelope_line, twin_line
from stillhook.engine.lowering.summary import held_load
from stillhook.engine.scenario.checks import type_notes
from stillhook.kernels.build import results_hash
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.answer.reference_cell import reference_of
from stillhook.plan.answer.swinging import swinging_remarks
from stillhook.plan.definition.capacities import places, static_tension
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import PhaseKind, described
from stillhook.plan.definition.rules import Alternative, Rule, Tier
from stillhook.plan.limits import by_height, limited
from stillhook.plan.report.basis import payload_rows
from stillhook.plan.report.words import TEXTS
from stillhook.plan.result import grouped
from stillhook.plan.table import TIERS, LimitTable, untold
from stillhook.plan.tiers import closed_form
from stillhook.plan.tiers.time_domain.tier import TwinTier
from stillhook.plan.weather.value import Forecast, WeatherValue
from stillhook.spec.crane import Crane, content
from stillhook.spec.validity import CAP, UNSIGNED
from stillhook.units import show
from stillhook.weather.alpha import AlphaTable
from stillhook.weather.series import Weather

DESCRIPTIONS: Mapping[Alternative, str] = {
    Alternative.NONE: "winch on its brake in every phase: nothing is compensated",
    Alternative.PHC: "winch on its brake in every phase, a passive heave compensator between hook and slings",
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


@dataclass(frozen=True, eq=False)
class RunInputs:
    """Inputs of an answer in addition to the plan: tiers that were run, the table of forecast factors, the weather."""

    tiers: tuple[str, ...]
    alpha: AlphaTable = field(repr=False)
    weather: Weather | None = field(default=None, repr=False)


def facts_of(plan: LiftPlan, inputs: RunInputs) -> dict[str, Any]:
    """The complete request. The digest covers all inputs of the answer: plan, weather, table of forecast factors,
    tiers."""
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
            **({} if env.swell is None else {"swell": env.swell.facts()}),
        },
        "crane": _crane(plan.crane, plan.credits_synthetic),
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
            {
                "phase": phase.name,
                "alternative": alternative.value,
                "rule": each.rule.key,
                "limit": each.limit,
                "basis": each.basis,
                **by_height(each),
            }
            for phase in plan.phases
            for alternative in plan.alternatives
            for each in limited(plan, phase, alternative)
        ],
        "alternatives": [{"name": a.value, "description": DESCRIPTIONS[a]} for a in plan.alternatives],
        "inputs": _inputs(plan, inputs),
        "not_covered": list(TEXTS["not_covered"]),
    }


def _crane(crane: Crane, assumed: bool) -> dict[str, Any]:
    c, held = crane.certified, envelope_line(crane)
    certificate: dict[str, Any] | None = None
    if c is not None:
        certificate = {
            "number": c.short,
            "statement": held or twin_line(crane),
            "synthetic": c.synthetic,
            "assumed": assumed,
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


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


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


def _rule(rule: Rule) -> dict[str, Any]:
    fields = ("key", "title", "quantity", "limit", "standard", "edition", "clause", "note")
    named = {name: getattr(rule, name) for name in fields}
    named |= {"requirement": rule.requirement, "sense": rule.sense.value, "level": rule.level.value}
    return {**named, "phases": [kind.value for kind in rule.phases]}


def answer_digest(plan: LiftPlan, inputs: RunInputs) -> str:
    """Hash of everything that an answer follows from."""
    return _digest("\n".join([*inputs.tiers, *(row["sha256"] for row in _inputs(plan, inputs))]))


def _inputs(plan: LiftPlan, inputs: RunInputs) -> list[dict[str, str]]:
    """Files and records that the answer follows from, with a hash of what counts in each."""
    rows = [("plan", plan.source or plan.name, plan.digest), ("crane", plan.crane.name, _crane_digest(plan.crane))]
    if plan.crane.certified is not None:
        rows.append(("certificate", plan.crane.certified.short, plan.crane.certified.digest))
    alpha = inputs.alpha
    factors = _digest(repr((alpha.Hs, alpha.T_POP, alpha.alpha, alpha.T_POP_below, alpha.T_R_below)))
    rows += [
        ("vessel", plan.vessel.source or plan.vessel.name, plan.vessel.digest.hex()),
        ("payload", plan.payload.name, _payload_digest(plan)),
        ("rules", f"{plan.rules.name} {plan.rules.version}".strip(), plan.rules.digest),
        ("forecast factors", f"{alpha.name} {alpha.texts.get('version', '')}".strip(), factors),
    ]
    if plan.load_chart is not None:
        rows.append(("load chart", plan.load_chart.chart.name, plan.load_chart.chart.digest))
    if inputs.weather is not None:
        rows.append(("weather", inputs.weather.source, _weather_digest(inputs.weather)))
    return [{"item": item, "file": file, "sha256": digest} for item, file, digest in rows]


def _weather_digest(weather: Weather) -> str:
    """Of times and numbers as they were read, whatever the file looked like."""
    parts = [weather.time.astype("datetime64[ms]").tobytes(), repr(weather.step).encode()]
    for name in sorted(weather.columns):
        parts += [name.encode(), np.ascontiguousarray(weather.columns[name]).tobytes()]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


CENSORED = 0.05
"""Share of starts without a window above which waits are reported as too short."""


def result_facts(
    plan: LiftPlan, of: Answered, forecast: Forecast, value: WeatherValue | None, twin: TwinTier | None
) -> dict[str, Any]:
    """Facts that the result adds to the input: shown, alternatives with credit notes, operation, phases with their
    tiers, runs, remarks."""
    return {
        "shown": of.shown().value,
        "alternatives": [
            {"name": a.value, "description": DESCRIPTIONS[a], "credit_note": credit_note(plan, of, a)}
            for a in of.axes.alternatives
        ],
        "operation": operation(plan, of, forecast),
        "phases": phases(plan, of, twin),
        "runs": {} if twin is None else dict(twin.runs),
        "remarks": [*remarks(plan, of, forecast, value), *(without_runs(plan) if twin is None else twin.notes)],
    }


def without_runs(plan: LiftPlan) -> list[str]:
    """Remark on limits without runs of the twin."""
    manual = [p.name for p in plan.phases if p.kind is PhaseKind.LOWERING and not p.compensated]
    if not manual:
        return []
    method = f"frequency-domain method, {', '.join(manual)}"
    return [
        f"{method}: drag on a sinking load is larger when it moves down than up; the"
        " method averages the two: slings lose up to a third more of their tension than calculated"
        " (docs/explanation/lift-plan-frequency.md)"
    ]


def phases(plan: LiftPlan, of: Answered, twin: TwinTier | None) -> list[dict[str, Any]]:
    """Phases as analysed, with the tiers that give results for each, and the reason why the twin was run or not."""
    known = ~np.asarray(np.isnan(of.limits.Hs).all(axis=(1, 3, 4, 5)))
    out = []
    for k, phase in enumerate(plan.phases):
        tiers = [tier.value for i, tier in enumerate(TIERS) if known[i, k]]
        reason = "not simulated" if twin is None else twin.reasons.get(phase.name, "")
        out.append({**described(phase), "tiers": tiers, "reason": reason})
    return out


def credit_note(plan: LiftPlan, of: Answered, alternative: Alternative) -> str:
    """Note on the credit of an alternative."""
    if not alternative.twin:
        return "no twin: credited as calculated"
    i = of.axes.alternatives.index(alternative)
    if not of.certified.needs[i].any():
        return "no phase is compensated: there is no compensation to credit"
    share = float(np.nanmean(of.certified.share[i]))
    if share == 1.0:
        label = "SYNTHETIC certificate" if plan.credits_synthetic else "certificate"
        return f"the {label} covers every sea of the compensated phases: credited as simulated"
    where = "" if share == 0.0 else f" in {1.0 - share:.0%} of the analysed seas and phases"
    reason = "; ".join(of.certified.reasons[alternative])
    if not where and f"{CAP:.0%}" in reason:
        return reason
    rest = ", elsewhere as simulated, by a SYNTHETIC certificate" if where and plan.credits_synthetic else ""
    return f"credited with no more than {CAP:.0%} of compensation{where}{rest}: {reason}"


def operation(plan: LiftPlan, of: Answered, forecast: Forecast) -> dict[str, Any]:
    """Times of the operation, the table of forecast factors, and the credited limit with its factor in the reference
    cell."""
    at, i, table = reference_of(plan, of), of.axes.alternatives.index(of.shown()), forecast.table
    cell = (1, i, at.heading, at.period)
    texts = {key: table.texts.get(key, "") for key in ("version", "standard", "edition", "clause", "note")}
    return {
        "T_POP": plan.T_POP,
        "T_POP_given": plan.T_POP_given,
        "T_C": plan.T_C,
        "T_R": forecast.T_R,
        "weather_restricted": forecast.restricted,
        "alternative": of.shown().value,
        "Tp": at.Tp,
        "beta": at.beta,
        "OP_LIM": float(min(of.Hs[cell], max(plan.environment.Hs))),
        "alpha": float(forecast.alpha[cell]),
        "op_wf": float(forecast.op_wf[cell]),
        **({} if plan.environment.swell is None else {"swell_wf": forecast.swell}),
        "alpha_table": {"name": table.name, **texts, "Hs_lowest": float(table.Hs[0])},
    }


def not_computed(plan: LiftPlan, tier: Tier, blocks: Collection[str]) -> dict[str, str]:
    """Reasons for missing blocks of a report, by their name."""
    still = not any(phase.compensated for phase in plan.phases)
    reason = (
        "only the closed form was requested" if tier is Tier.CLOSED_FORM else "no phase is compensated" if still else ""
    )
    ran = "" if tier is Tier.TIME else "no runs in the time domain were requested: --tier time"
    lands = any(phase.kind is PhaseKind.LANDING for phase in plan.phases)
    reasons = {
        "depth": reason,
        "efficiency": reason,
        "sensitivity": reason or "no rule governs any cell",
        "landing": ran or ("no limit was found at the middle period" if lands else "the plan has no landing"),
        "sweep": ran or "no landing is compensated",
        "convergence": ran or "no limit was found by runs at the middle period",
    }
    return {name: text for name, text in reasons.items() if name not in blocks}


def remarks(plan: LiftPlan, of: Answered, forecast: Forecast, value: WeatherValue | None) -> list[str]:
    """Remarks on the result."""
    lines = [*swinging_remarks(plan, of.modelled), *_swell_remark(plan), *plan.notes, *winch_remarks(plan)]
    untold_phases = untold(of.modelled)
    for phases, alternatives in grouped((phases, a.value) for a, phases in untold_phases.items()).items():
        lines.append(
            f"NOT ASSESSED in some cells, because no tier that was run covers it: {', '.join(phases)}"
            f" ({', '.join(alternatives)})"
        )
    if np.isposinf(of.Hs).any():
        highest = max(plan.environment.Hs)
        lines.append(
            f"Limits are capped at Hs {highest:g} m, the highest sea state analysed; higher ones are marked as such"
        )
    if forecast.reason:
        lowest = f"{forecast.table.Hs[0]:g} m"
        used = f"to compare such limits in the weather, the factor of {lowest} is used, which is optimistic for them"
        lines.append(f"forecast factor: {forecast.reason} Here, {used}: gains over them are at least those reported")
    if not forecast.restricted:
        lines.append(
            "not weather restricted: waiting is not calculated; plan for extremes of the season, or divide the"
            " operation"
        )
    if plan.weather is None:
        lines.append("no weather specified: waiting is not calculated ([weather] in the plan file)")
    env, axes = plan.environment, of.axes
    table = LimitTable(of.Hs[0, 0], np.array(axes.headings), np.array(axes.periods), env.heading_tolerance, max(env.Hs))
    lines.append(f"Lookup: {table.described()}")
    if value is not None:
        lines += [*value.notes, *_short(value, of.compared)]
    return [*lines, *closed_form.remarks(plan, env.table())]


def _swell_remark(plan: LiftPlan) -> list[str]:
    """That every limit is one of the wind sea beside a swell."""
    swell = plan.environment.swell
    return [] if swell is None else [f"every limiting Hs is that of the wind sea, beside a {swell.describe()}"]


def winch_remarks(plan: LiftPlan) -> list[str]:
    """Remarks on the winch type in the heaviest phase with compensation, and the heaviest without."""
    notes = []
    for compensated in (False, True):
        phases = [phase for phase in plan.phases if phase.compensated is compensated]
        if phases:
            phase = max(phases, key=lambda p: static_tension(plan, p))
            at = held_load(plan.crane, plan.hanging(places(phase)[0], plan.tip_of(phase).z), 0.0)
            at = at._replace(W=static_tension(plan, phase), manual=not compensated, compensates=compensated)
            notes += [f"winch, {phase.name}: {note}" for note in type_notes(plan.crane, at)]
    return notes


def _short(value: WeatherValue, compared: Sequence[Alternative]) -> list[str]:
    """Alternatives whose reported waits are too short: many starts had no window before the series ended."""
    censored = {
        f"{a.value} ({credit})": float(np.isnan(w).mean()) for (credit, a), w in value.waits.items() if a in compared
    }
    some = "reported waits are too short: {:.0%} of the starts had no window"
    never = "never has a window in these years"
    lines = grouped(
        (never if share == 1.0 else some.format(share), name) for name, share in censored.items() if share > CENSORED
    )
    return [f"{', '.join(names)}: {text}" for text, names in lines.items()]
