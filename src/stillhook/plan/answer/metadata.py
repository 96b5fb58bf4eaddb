"""Request and answer of a plan as plain data: for JSON, for the report, and for whoever repeats it.

Only in the answer: what is credited and why, the forecast limit of the leading cell, how weather was read,
what stays open.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from stillhook._version import __version__
from stillhook.engine.certificate import envelope_line, objections, twin_line
from stillhook.engine.lowering.summary import held_load
from stillhook.engine.scenario.checks import type_notes
from stillhook.kernels.build import results_hash
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.answer.reference_cell import reference_of
from stillhook.plan.definition.capacities import places, static_tension
from stillhook.plan.definition.lift_plan import LiftPlan, described
from stillhook.plan.definition.rules import Alternative, Rule, Tier
from stillhook.plan.limits import as_row, limited
from stillhook.plan.result import Cause, Remark, cause, grouped, picked
from stillhook.plan.table import TIERS, Chosen, apart_remarks, unreported
from stillhook.plan.tiers import closed_form
from stillhook.plan.tiers.time_domain.tier import TwinTier
from stillhook.plan.weather.value import Forecast, WeatherValue
from stillhook.report.payload_sheet import payload_rows
from stillhook.spec.crane import Crane, identity
from stillhook.spec.lift.phase import PhaseKind
from stillhook.spec.validity import CAP, Condition
from stillhook.units import show
from stillhook.weather.alpha import TEXTS, AlphaTable
from stillhook.weather.series import Weather

NOT_COVERED = (*("second-order", "horizontal", "current", "structure", "strength", "wire-life", "ground", "machinery"),)
"""What no tier of the model holds, for every plan, by code."""
CENSORED = 0.05
"""Share of starts without a window above which waits are reported as too short."""


def facts_of(plan: LiftPlan, tiers: Sequence[str], alpha: AlphaTable, weather: Weather | None) -> dict[str, Any]:
    """The complete request; its digest covers plan, weather, table of forecast factors and tiers."""
    env, rules = plan.environment, plan.rules
    axes = {name: list(getattr(env, name)) for name in ("Hs", "Tp", "headings")}
    settings = picked(env, "wave", "gamma", "spread", "heading_tolerance") | axes
    return picked(plan, "name", "source") | {
        "digest": answer_digest(plan, tiers, alpha, weather),
        "notes": list(plan.notes),
        "document": dict(plan.document),
        "version": __version__,
        "code": results_hash(),
        "date": datetime.now(UTC).date().isoformat(),
        "tiers": list(tiers),
        "settings": settings if env.swell is None else settings | {"swell": env.swell.facts()},
        "crane": _crane(plan.crane, plan.credits_synthetic),
        "vessel": {"name": plan.vessel.name, "title": plan.vessel.source, "notes": list(plan.vessel.notes)},
        "payload": _payload(plan),
        "place": picked(plan, "h_tip", "depth", "rho") | {"text": _place(plan)},
        "phases": [described(phase) for phase in plan.phases],
        "rules": picked(rules, "name", "version", "digest", "entered_by")
        | {"changes": list(rules.changes), "rows": [_rule(rule) for rule in rules.rules]},
        "limited": [
            {"phase": phase.name, "alternative": alternative.value, **as_row(each)}
            for phase in plan.phases
            for alternative in plan.alternatives
            for each in limited(plan, phase, alternative)
        ],
        "alternatives": [
            {"name": a.value} | ({"settings": plan.controllers[a].name} if a in plan.controllers else {})
            for a in plan.alternatives
        ],
        "inputs": _inputs(plan, alpha, weather),
        "not_covered": list(NOT_COVERED),
    }


def _crane(crane: Crane, assumed: bool) -> dict[str, Any]:
    c, held = crane.certified, envelope_line(crane)
    certificate: dict[str, Any] | None = None
    if c is not None:
        certificate = {
            "number": c.short,
            "statement": held or twin_line(crane),
            "synthetic": not c.real,
            "assumed": assumed,
            "signature": c.judgement.to_dict(),
            "objections": list(objections(crane)),
            "condition": None if c.condition is None else _condition(c.condition),
        }
    more = {"digest": identity(crane)[1], "twin": twin_line(crane), "certificate": certificate}
    return picked(crane, "name", "title", "SWL") | more


def _condition(c: Condition) -> dict[str, Any]:
    return {**c.model_dump(), "text": c.statement, "signature": c.judgement.to_dict()}


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _payload(plan: LiftPlan) -> dict[str, Any]:
    payload = plan.payload if plan.weight is None else plan.weight.payload
    more = {"digest": _payload_digest(plan), "rows": payload_rows(payload, plan.rho)}
    of = {} if plan.weight is None else {"mass": plan.payload.mass, "net": plan.weight.net}
    return picked(payload, "name", "title", "mass", "height") | of | more


def _payload_digest(plan: LiftPlan) -> str:
    return _digest(plan.payload.model_dump_json(exclude={"sources", "title", "name"}))


def _place(plan: LiftPlan) -> str:
    at = ", ".join(f"{name} = {show(value, 'length', 4)}" for name, value in (("x", plan.at.x), ("y", plan.at.y)))
    return (
        f"{plan.vessel.name}, crane tip at {at}, {show(plan.h_tip, 'length', 4)} above still water,"
        f" {show(plan.depth, 'length', 5)} deep"
    )


def _rule(rule: Rule) -> dict[str, Any]:
    named = picked(rule, "key", "title", "quantity", "limit", "standard", "edition", "clause", "note", "requirement")
    kinds = [kind.value for kind in rule.phases]
    return named | {"sense": rule.sense.value, "level": rule.level.value, "phases": kinds}


def answer_digest(plan: LiftPlan, tiers: Sequence[str], alpha: AlphaTable, weather: Weather | None) -> str:
    """Hash of everything that an answer follows from."""
    return _digest("\n".join([*tiers, *(row["sha256"] for row in _inputs(plan, alpha, weather))]))


def _inputs(plan: LiftPlan, alpha: AlphaTable, weather: Weather | None) -> list[dict[str, str]]:
    """Files and records that the answer follows from, with a hash of what counts in each."""
    rows = [("plan", plan.source or plan.name, plan.digest), ("crane", *identity(plan.crane))]
    if plan.crane.certified is not None:
        certified = plan.crane.certified
        standing = _digest("\n".join((certified.judgement.sentence, *objections(plan.crane))))
        rows.append(("certificate", certified.short, certified.digest))
        rows.append(("its standing", certified.judgement.standing.value, standing))
    factors = _digest(repr((alpha.Hs, alpha.T_POP, alpha.alpha, alpha.T_POP_below, alpha.T_R_below)))
    rows += [
        ("vessel", plan.vessel.source or plan.vessel.name, plan.vessel.digest.hex()),
        ("payload", plan.payload.name, _payload_digest(plan)),
        ("rules", f"{plan.rules.name} {plan.rules.version}".strip(), plan.rules.digest),
        ("forecast factors", f"{alpha.name} {alpha.texts.get('version', '')}".strip(), factors),
    ]
    if plan.against is not None:
        rao = plan.against.other.rao
        rows.append(("other vessel", rao.source or rao.name, rao.digest.hex()))
    if plan.load_chart is not None:
        rows.append(("load chart", plan.load_chart.chart.name, plan.load_chart.chart.digest))
    if weather is not None:
        rows.append(("weather", weather.source, _weather_digest(weather)))
    return [{"item": item, "file": file, "sha256": digest} for item, file, digest in rows]


def _weather_digest(weather: Weather) -> str:
    """Of times and numbers as they were read, in any form of the file."""
    parts = [weather.time.astype("datetime64[ms]").tobytes(), repr(weather.step).encode()]
    for name in sorted(weather.columns):
        parts += [name.encode(), np.ascontiguousarray(weather.columns[name]).tobytes()]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


def result_facts(
    plan: LiftPlan, of: Answered, forecast: Forecast, value: WeatherValue | None, twin: TwinTier | None, tier: Tier
) -> dict[str, Any]:
    """Facts that the result adds to the input: shown, alternatives with credit notes, operation, phases with their
    tiers, runs, remarks. tier: the highest that was run."""
    return {
        "shown": of.shown().value,
        "alternatives": [{"name": a.value, "credit_note": credit_note(plan, of, a)} for a in of.axes.alternatives],
        "operation": operation(plan, of, forecast),
        "phases": phases(plan, of, twin),
        "runs": {} if twin is None else dict(twin.runs),
        "remarks": [*remarks(plan, of, forecast, value, tier), *(without_runs(plan) if twin is None else twin.notes)],
    }


def without_runs(plan: LiftPlan) -> list[Remark]:
    """Remark on limits without runs of the twin."""
    manual = [p.name for p in plan.phases if p.kind is PhaseKind.LOWERING and not p.compensated]
    return [cause("mean-drag", phases=manual)] if manual else []


def phases(plan: LiftPlan, of: Answered, twin: TwinTier | None) -> list[dict[str, Any]]:
    """Phases as analysed, with the tiers that give results for each, and the reason why the twin was run or not."""
    known = ~np.asarray(np.isnan(of.limits.Hs).all(axis=(1, 3, 4, 5)))
    out = []
    for k, phase in enumerate(plan.phases):
        tiers = [tier.value for i, tier in enumerate(TIERS) if known[i, k]]
        reason = cause("not-simulated") if twin is None else twin.reasons.get(phase.name, "")
        out.append({**described(phase), "tiers": tiers, "reason": reason})
    return out


def credit_note(plan: LiftPlan, of: Answered, alternative: Alternative) -> Cause:
    """Why so much of an alternative is credited."""
    if not alternative.twin:
        return cause("credited-as-calculated")
    i = of.axes.alternatives.index(alternative)
    if not of.certified.needs[i].any():
        return cause("nothing-to-credit")
    share, label = float(np.nanmean(of.certified.share[i])), "certificate"
    certificate = f"SYNTHETIC {label}" if plan.credits_synthetic else label
    if share == 1.0:
        return cause("certificate-covers", certificate=certificate)
    reasons = list(of.certified.reasons[alternative])
    if share == 0.0:
        return cause("credited-as-cap" if plan.crane.certified is None else "cap-in-all", cap=CAP, reasons=reasons)
    return cause("cap-in-part", cap=CAP, share=1.0 - share, certificate=certificate, reasons=reasons)


def operation(plan: LiftPlan, of: Answered, forecast: Forecast) -> dict[str, Any]:
    """Times of the operation, the table of forecast factors, and the credited limit with its factor in the reference
    cell."""
    at, i, table = reference_of(plan, of), of.axes.alternatives.index(of.shown()), forecast.table
    cell = (1, i, at.heading, at.period)
    texts = {key: table.texts.get(key, "") for key in TEXTS if key != "title"}
    return picked(plan, "T_POP", "T_POP_given", "T_C", "lead", "parts") | {
        "T_R": forecast.T_R,
        "window": forecast.window,
        "weather_restricted": forecast.restricted,
        "alternative": of.shown().value,
        "Tp": at.Tp,
        "beta": at.beta,
        "OP_LIM": float(min(of.Hs[cell], max(plan.environment.Hs))),
        "alpha": float(forecast.alpha[cell]),
        "op_wf": float(forecast.op_wf[cell]),
        **({} if plan.environment.swell is None else {"swell_wf": forecast.swell}),
        "alpha_table": {"name": table.name, **texts, "Hs_lowest": float(table.Hs[0]), "numbers": table.numbers},
    }


def not_computed(plan: LiftPlan, tier: Tier, blocks: Collection[str]) -> dict[str, Cause]:
    """Causes of missing blocks of a report, by their name."""
    still = not any(phase.compensated for phase in plan.phases)
    lands = any(phase.kind is PhaseKind.LANDING for phase in plan.phases)
    method = "closed-form-only" if tier is Tier.CLOSED_FORM else "nothing-follows" if still else ""
    runs = "" if tier is Tier.TIME else "no-runs"
    codes = {
        "depth": method,
        "efficiency": method,
        "landing": runs or ("no-limit" if lands else "no-landing"),
        "sweep": runs or "no-compensated-landing",
        "convergence": runs or "no-limit",
    }
    return {name: cause(code) for name, code in codes.items() if name not in blocks and code}


def remarks(
    plan: LiftPlan, of: Answered, forecast: Forecast, value: WeatherValue | None, tier: Tier = Tier.TIME
) -> list[Remark]:
    """Remarks on the result; tier: the highest that was run (runs of the twin alone compare its controllers)."""
    env, twins = plan.environment, [a.value for a in of.axes.alternatives if a.twin]
    lines: list[Remark] = []
    if not any(phase.compensated for phase in plan.phases) and Alternative.PHC not in of.axes.alternatives:
        lines.append(cause("nothing-compensated"))
    elif twins and tier is not Tier.TIME:
        lines.append(cause(f"not-compared-{tier}", twins=twins))
    lines += [*oscillations(plan, of.modelled), *apart_remarks(plan, of.limits, of.modelled)]
    if env.swell is not None:
        lines.append(cause("swell", swell=env.swell.describe()))
    lines += [*plan.notes, *winch_remarks(plan)]
    for phases, alternatives in grouped((phases, a.value) for a, phases in unreported(of.modelled).items()).items():
        lines.append(cause("not-assessed", phases=list(phases), alternatives=alternatives))
    if np.isposinf(of.Hs).any():
        lines.append(cause("capped", Hs=max(env.Hs)))
    if forecast.reason:
        lines.append(cause("no-alpha", reason=forecast.reason, Hs=float(forecast.table.Hs[0])))
    lines += [] if forecast.restricted else [cause("not-restricted")]
    lines += [] if plan.weather is not None else [cause("no-weather")]
    if value is not None:
        lines += [*value.notes, *_short(value, of.compared)]
    return [*lines, *closed_form.remarks(plan, env.table())]


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


def _short(value: WeatherValue, compared: Sequence[Alternative]) -> list[Cause]:
    """Alternatives whose reported waits are too short: many starts had no window before the series ended."""
    censored = {
        f"{a.value} ({credit})": float(np.isnan(w).mean()) for (credit, a), w in value.waits.items() if a in compared
    }
    alike = grouped((share, name) for name, share in censored.items() if share > CENSORED)
    return [
        cause("no-window" if share == 1.0 else "short-waits", alternatives=names, share=share)
        for share, names in alike.items()
    ]


OSCILLATION, UNKNOWN = "oscillation_share", "source not stated"


def oscillations(plan: LiftPlan, modelled: Chosen) -> list[Cause]:
    """Where an alternative has no limit at all because the winch oscillates by itself, phase by phase: how fast the
    wire goes there, how much is allowed, and what is known of the wire's damping, on which that rests."""
    rules = {rule.key for rule in plan.rules.rules if rule.quantity == OSCILLATION}
    at = [i for i, key in enumerate(modelled.axes.rules) if key in rules]
    wire, source = plan.crane.wire, plan.crane.sources.get("wire.zeta")
    between = [] if None in (wire.zeta_low, wire.zeta_high) else [f"{wire.zeta_low:g} to {wire.zeta_high:g}"]
    known = [*between, UNKNOWN if source is None else source.kind.value]
    result = []
    for i, alternative in enumerate(modelled.axes.alternatives):
        for k, phase in enumerate(plan.phases):
            zero = (modelled.Hs[i, k, at] == 0.0).any(axis=0)
            if zero.any():
                rule = next(r for r in limited(plan, phase, alternative) if r.rule.quantity == OSCILLATION)
                allowed = {"limit": rule.limit, "basis": rule.rule.standard}
                where = {"phase": phase.name, "speed": phase.speed or 0.0, "n": int(zero.sum()), "of": zero.size}
                what = {"alternative": alternative.label, "zeta": wire.zeta, "known": known}
                result.append(cause("oscillates", **what, **where, **allowed))
    return result
