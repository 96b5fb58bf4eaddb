"""What a plan asks, before anything is run: phases with what hangs in them, rules with their limits, seas, times; as
plain data and as text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.formats.weather.alpha_table import read_alpha_table
from stillhook.plan.definition.capacities import calm, static_tension
from stillhook.plan.definition.lift_plan import LiftPlan, WeatherUse, described
from stillhook.plan.file import load_plan
from stillhook.plan.limits import ROUNDING, as_row, limited, utilisation
from stillhook.plan.report.basis import LIMITS, limits_of_rules
from stillhook.plan.report.words import listed
from stillhook.plan.result import grouped, picked
from stillhook.plan.tiers.situations import resonance_depth, situations
from stillhook.plan.weather.records import weather_used
from stillhook.report.document import Document, Part, Table, Text, Verdict
from stillhook.report.formatting import counted, fixed, fmt, hours, variable
from stillhook.report.html import fragment
from stillhook.report.terminal import Answer
from stillhook.sea.spectra.spectrum import steepest, steepness
from stillhook.spec.lift.phase import Phase
from stillhook.weather.alpha import DEFAULT, reference_period


class Severity(StrEnum):
    """How much a remark weighs."""

    ERROR = "error"  # no sea of the plan is workable under any alternative
    WARNING = "warning"  # it takes seas or alternatives away, or limits are low because of it
    NOTE = "note"  # to be known


class CheckRemark(NamedTuple):
    """What the check of a plan has to say."""

    code: str  # such as "beyond-at-rest", the same for the same cause
    severity: Severity
    place: str  # phases, rule or part of the plan that it is about
    text: str  # a sentence, with units


@dataclass(frozen=True)
class PlanCheck:
    """What a plan requests, before anything is run.

    facts: plain data in SI: name, digest, what and where; phases; times T_POP, T_C, T_R and weather_restricted; rules
    with their limits in each phase and under each alternative; seas analysed, and how many are steeper than wind
    raises waves; depths of resonance; rules that still water is beyond; notes; remarks.
    """

    facts: Mapping[str, Any] = field(repr=False)

    @property
    def possible(self) -> bool:
        """Whether still water keeps all rules under some alternative."""
        return possible(self.facts)

    @property
    def remarks(self) -> tuple[CheckRemark, ...]:
        """Errors first, then warnings and notes."""
        return tuple(CheckRemark(**each | {"severity": Severity(each["severity"])}) for each in self.facts["remarks"])

    def document(self) -> Document:
        """What `stillhook plan --check` prints."""
        return checked_plan(self.facts)

    def _repr_html_(self) -> str:
        """Verdict, phases and remarks, for a notebook."""
        answer = Verdict("possible" if self.possible else "not possible in any sea", self.possible)
        remarks = [[each.severity.value, each.place, each.text] for each in self.remarks]
        phases = Table(PHASES, [_phase_row(row) for row in self.facts["phases"]])
        parts: list[Part] = [answer, phases, Text(_times(self.facts)), Table(("severity", "place", "remark"), remarks)]
        return fragment(Document(str(self.facts["name"]), front=parts))


def check(lift: LiftPlan | str | Path) -> PlanCheck:
    """What a lift plan requests, and what there is to remark on it; nothing is run.

    Parameters
    ----------
    lift : LiftPlan, str or Path
        A plan, the path of a plan file, or a name of the library.

    Returns
    -------
    PlanCheck
        `possible`, `remarks` (code, severity, place, text) and `facts` in SI.

    Raises
    ------
    StillhookError
        One line, for a plan that cannot be read.
    """
    return PlanCheck(checked(lift if isinstance(lift, LiftPlan) else load_plan(lift)))


def checked(plan: LiftPlan) -> dict[str, Any]:
    """Facts of a `PlanCheck`."""
    facts = _facts(plan)
    return facts | {"remarks": [each._asdict() for each in _remarks(facts)]}


def _facts(plan: LiftPlan) -> dict[str, Any]:
    factors = read_alpha_table(plan.forecast_factors or DEFAULT)
    T_R, restricted = reference_period(factors, plan.T_POP, plan.T_C)
    env = plan.environment
    steep = sum(steepness(Hs, Tp) > steepest(Tp, "T_p") for Hs in env.Hs for Tp in env.Tp)
    clauses = ("key", "title", "quantity", "standard", "edition", "clause")
    seas = {name: list(getattr(env, name)) for name in ("Hs", "Tp", "headings")} | {"steep": steep * len(env.headings)}
    return picked(plan, "name", "digest", "depth", "T_POP", "T_C", "lead", "parts") | {
        "crane": plan.crane.name,
        "vessel": plan.vessel.name,
        "payload": plan.payload.name,
        "tip": {"x": plan.at.x, "y": plan.at.y, "h_tip": plan.h_tip},
        "phases": [_phase(plan, phase) for phase in plan.phases],
        "T_phases": sum(phase.counted for phase in plan.phases),
        "T_R": T_R,
        "alpha_table": factors.source,
        "weather_restricted": restricted,
        "rules": picked(plan.rules, "name", "version")
        | {"changes": list(plan.rules.changes), "rows": [picked(rule, *clauses) for rule in plan.rules.rules]},
        "limits": [
            {
                "phase": phase.name,
                "alternative": alternative.value,
                "rules": [
                    {"rule": row.rule.key, "quantity": row.rule.quantity, **as_row(row)}
                    for row in limited(plan, phase, alternative)
                ],
            }
            for phase in plan.phases
            for alternative in plan.alternatives
        ],
        "seas": seas if env.swell is None else seas | {"swell": env.swell.describe()},
        "resonance": [{"T": T, "z": -depth} for T in env.Tp if not math.isnan(depth := resonance_depth(plan, T))],
        "weather": None if plan.weather is None else _weather(plan.weather),
        "alternatives": [a.value for a in plan.alternatives],
        "beyond": beyond_at_rest(plan),
        "notes": list(plan.notes),
    }


def beyond_at_rest(plan: LiftPlan) -> list[dict[str, Any]]:
    """Rules that no sea of the plan keeps, because still water is beyond their limit in the lowest one: phase,
    alternatives, rule, quantity, value and limit [SI], and what the limit is of."""
    lowest = np.array([min(plan.environment.Hs)])
    rows: dict[tuple[Any, ...], list[str]] = {}
    for phase in plan.phases:
        still = calm(plan, phase)
        for alternative in plan.alternatives:
            for each in limited(plan.under(alternative), phase, alternative):
                value = still.get(each.rule.quantity, math.nan)
                if float(utilisation(each, np.array([value]), lowest)[0]) > 1.0 + ROUNDING:
                    limit = float(each.at(lowest)[0])
                    key = (phase.name, each.rule.key, each.rule.quantity, value, limit, each.basis)
                    rows.setdefault(key, []).append(alternative.value)
    names = ("phase", "rule", "quantity", "value", "limit", "basis")
    return [{**dict(zip(names, key, strict=True)), "alternatives": under} for key, under in rows.items()]


def possible(answer: Mapping[str, Any]) -> bool:
    """Whether still water keeps all rules under some alternative; answer: of `checked`."""
    return bool(set(answer["alternatives"]) - {name for row in answer["beyond"] for name in row["alternatives"]})


def _remarks(answer: Mapping[str, Any]) -> list[CheckRemark]:
    """What there is to say, errors first; answer: of `checked`, without remarks."""
    remarks = list(remarks_at_rest(answer))
    seas, rules, weather = answer["seas"], answer["rules"], answer["weather"]
    if seas["steep"]:
        text = f"{seas['steep']} seas are above the steepness limit of wind seas (DNV-RP-C205)"
        remarks.append(CheckRemark("steep-seas", Severity.WARNING, "seas", text))
    if answer["resonance"]:
        where = ", ".join(f"{row['T']:.4g} s at {fmt(-row['z'], 'length')}" for row in answer["resonance"])
        text = f"the load on its wire is in resonance with peak periods of {where} depth"
        remarks.append(CheckRemark("resonance", Severity.WARNING, "phases", text))
    notes = (("rule-changed", "rules", rules["changes"]), ("note", "plan", answer["notes"]))
    of_weather = (("weather-note", "weather", [] if weather is None else weather["notes"]),)
    for code, place, lines in (*notes, *of_weather):
        remarks += [CheckRemark(code, Severity.NOTE, place, line) for line in lines]
    return remarks


def remarks_at_rest(answer: Mapping[str, Any]) -> Iterator[CheckRemark]:
    """Rules that still water is beyond, a remark for each."""
    rows_of = grouped(((row["rule"], tuple(row["alternatives"])), row) for row in answer["beyond"])
    severity = Severity.WARNING if possible(answer) else Severity.ERROR
    for (rule, under), rows in rows_of.items():
        row = max(rows, key=lambda row: row["value"])
        who = "any alternative" if len(under) == len(answer["alternatives"]) else ", ".join(under)
        value, limit = (variable(row["quantity"], row[key]) for key in ("value", "limit"))
        phases = listed(each["phase"] for each in rows)
        text = (
            f'NOT POSSIBLE in any sea with {who}, by "{rule}":'
            f" {phases}; {row['phase']}: {value} at rest, limit {limit} ({row['basis']})"
        )
        yield CheckRemark("beyond-at-rest", severity, f'{phases}: rule "{rule}"', text)


def _beyond(answer: Mapping[str, Any]) -> list[str]:
    """Rules that still water is beyond, a sentence for each."""
    return _texts(answer, "beyond-at-rest")


def _texts(answer: Mapping[str, Any], *codes: str) -> list[str]:
    """Sentences of the remarks with these codes."""
    return [each["text"] for each in answer["remarks"] if each["code"] in codes]


def _weather(use: WeatherUse) -> dict[str, Any]:
    """How many records, from when to when, what they know; errors of the file come before any run."""
    weather = weather_used(use)
    first, last = (str(np.datetime_as_string(weather.time[i], unit="m")) for i in (0, -1))
    return {
        "file": use.file,
        "n": len(weather),
        "step": weather.step,
        "first": first,
        "last": last,
        "columns": sorted(weather.columns),
        "ship": use.ship,
        "notes": list(weather.notes),
    }


def _phase(plan: LiftPlan, phase: Phase) -> dict[str, Any]:
    at, facts = plan.tip_of(phase), described(phase)
    del facts["limits"]
    return facts | {
        "tip": {"x": at.x, "y": at.y, "z": at.z},
        "F_top_static": static_tension(plan, phase),
        "T_0": max((s.T_0 for s in situations(plan, phase)), default=math.nan),
        **({} if plan.load_chart is None else {"radius": plan.load_chart.radius_of(at)}),
    }


PHASES = ("phase", "kind", "winch", "depth\nfrom", "to", "speed", "duration", "tension\nat rest", "natural\nperiod")


def checked_plan(answer: Mapping[str, Any]) -> Document:
    """answer: of `checked`."""
    rules = answer["rules"]
    parts: list[Part] = [
        *map(Text, _beyond(answer)),
        Table(PHASES, [_phase_row(row) for row in answer["phases"]]),
        Text(_times(answer)),
    ]
    parts.append(Text(_seas(answer)))
    if answer["weather"] is not None:
        parts.append(Text(_weather_of(answer["weather"])))
    parts += map(Text, _texts(answer, "resonance"))
    facts = {"rules": rules, "phases": answer["phases"], "limited": _limited(answer)}
    facts["alternatives"] = [{"name": name} for name in answer["alternatives"]]
    parts.append(Table(LIMITS, limits_of_rules(facts), f"{rules['name']} version {rules['version']}"))
    parts += map(Text, _texts(answer, "rule-changed", "note"))
    subject = f"{answer['crane']} on {answer['vessel']}, {answer['payload']}, {fmt(answer['depth'], 'length')} deep"
    return Document(answer["name"], name=subject, front=parts)


def brief(answer: Mapping[str, Any], step: str) -> Answer:
    """What the plan requests in a dozen lines; step: what to do next. answer: of `checked`."""
    phases, rules = answer["phases"], answer["rules"]
    heaviest = max(phases, key=lambda row: row["F_top_static"])
    outcome = _beyond(answer) or ["PASSED: still water keeps all rules under every alternative."]
    lines = [
        *outcome,
        f"{len(phases)} phases: {'; '.join(row['name'] for row in phases)}.",
        f"Times: {_times(answer)}.",
        f"Seas: {_seas(answer)}.",
        f"Rules: {rules['name']} version {rules['version']}, {len(rules['rows'])} rules; alternatives:"
        f" {', '.join(answer['alternatives'])}.",
        f"Largest tension at rest: {fmt(heaviest['F_top_static'], 'force')} in {heaviest['name']}.",
    ]
    resonance, notes = answer["resonance"], [*rules["changes"], *answer["notes"]]
    if resonance:
        lines.append(
            f"Resonance of the load on its wire: Tp {resonance[0]['T']:.4g} s at {fmt(-resonance[0]['z'], 'length')}."
        )
    more = f"every phase and limit, weather, {counted(len(notes), 'note')}"
    return Answer(f"{answer['name']}: {answer['crane']} on {answer['vessel']}", lines, step, more)


def _phase_row(row: dict[str, Any]) -> list[str]:
    return [
        row["name"],
        row["kind"],
        row["mode"],
        *(fmt(row[key], "length") for key in ("start_depth", "depth")),
        fmt(row["speed"], "speed"),
        f"{row['duration'] / 60.0:.1f} min",
        fmt(row["F_top_static"], "force"),
        "-" if math.isnan(row["T_0"]) else f"{fixed(row['T_0'], 2)} s",
    ]


def _times(answer: Mapping[str, Any]) -> str:
    keys = ("T_phases", "lead", "T_POP", "T_C", "T_R")
    times = {key: "not assessed" if answer[key] is None else hours(answer[key]) for key in keys}
    restricted = "weather restricted" if answer["weather_restricted"] else "not weather restricted"
    lead = f" with a lead time of {times['lead']}" if answer["lead"] else ""
    times_from_issue = f"T_POP {times['T_POP']}{lead}, T_C {times['T_C']}, T_R {times['T_R']}"
    return f"phases {times['T_phases']}, {times_from_issue}: {restricted}"


def _seas(answer: Mapping[str, Any]) -> str:
    seas = answer["seas"]
    Hs, Tp = ([min(seas[key]), max(seas[key])] for key in ("Hs", "Tp"))
    headings = ", ".join(f"{math.degrees(beta):.4g}" for beta in seas["headings"])
    count = len(seas["Hs"]) * len(seas["Tp"]) * len(seas["headings"])
    steep = f"; {seas['steep']} of them above the steepness limit of DNV-RP-C205" if seas["steep"] else ""
    return (
        f"{count} seas: Hs {Hs[0]:g} to {Hs[1]:g} m, Tp {Tp[0]:g} to {Tp[1]:g} s, travelling {headings} deg from the"
        f" bow{steep}{f', each with a {swell}' if (swell := seas.get('swell')) else ''}"
    )


def _weather_of(weather: dict[str, Any]) -> str:
    ship = (
        "the ship is free to turn and keeps one heading through the operation"
        if weather["ship"] is None
        else f"the ship heads {math.degrees(weather['ship']):.4g} deg from north"
    )
    notes = "".join(f"; {note}" for note in weather["notes"])
    span = f"{weather['n']} records every {weather['step'] / 3600.0:g} h from {weather['first']} to {weather['last']}"
    return f"weather {weather['file']}: {span}, with {', '.join(weather['columns'])}; {ship}{notes}"


def _limited(answer: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Limits of each phase and alternative, a row each."""
    return [
        {"phase": at["phase"], "alternative": at["alternative"], **row}
        for at in answer["limits"]
        for row in at["rules"]
    ]
