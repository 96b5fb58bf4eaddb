"""What a plan asks, before anything is run: phases with what hangs in them, rules with their limits, seas, times; as
plain data and as text."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stillhook.plan.definition.capacities import calm, static_tension
from stillhook.plan.definition.lift_plan import LiftPlan, WeatherUse, described
from stillhook.plan.limits import ROUNDING, as_row, limited, utilisation
from stillhook.plan.report.basis import LIMITS, limits_of_rules
from stillhook.plan.result import grouped, picked
from stillhook.plan.tiers.situations import resonance_depth, situations
from stillhook.plan.weather.records import weather_used
from stillhook.report.document import Document, Part, Table, Text
from stillhook.report.formatting import fixed, fmt, hours, variable
from stillhook.sea.spectra.spectrum import steepest, steepness
from stillhook.spec.lift.phase import Phase
from stillhook.weather.alpha import load_alpha_table, reference_period


def checked(plan: LiftPlan) -> dict[str, Any]:
    """Plain data in SI: name, digest, what and where; phases; times T_POP, T_C, T_R and weather_restricted; rules with
    their limits in each phase and under each alternative; seas analysed, and how many are steeper than wind
    raises waves; depths of resonance; rules that still water is beyond; notes.
    """
    T_R, restricted = reference_period(load_alpha_table(), plan.T_POP, plan.T_C)
    env = plan.environment
    steep = sum(steepness(Hs, Tp) > steepest(Tp, "T_p") for Hs in env.Hs for Tp in env.Tp)
    clauses = ("key", "title", "quantity", "standard", "edition", "clause")
    seas = {name: list(getattr(env, name)) for name in ("Hs", "Tp", "headings")} | {"steep": steep * len(env.headings)}
    return picked(plan, "name", "digest", "depth", "T_POP", "T_C") | {
        "crane": plan.crane.name,
        "vessel": plan.vessel.name,
        "payload": plan.payload.name,
        "tip": {"x": plan.at.x, "y": plan.at.y, "h_tip": plan.h_tip},
        "phases": [_phase(plan, phase) for phase in plan.phases],
        "T_phases": sum(phase.counted for phase in plan.phases),
        "T_R": T_R,
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


def possible(answer: dict[str, Any]) -> bool:
    """Whether still water keeps all rules under some alternative; answer: of `checked`."""
    return bool(set(answer["alternatives"]) - {name for row in answer["beyond"] for name in row["alternatives"]})


def _beyond(answer: dict[str, Any]) -> list[str]:
    """Rules that still water is beyond, a sentence for each."""
    rows_of = grouped(((row["rule"], tuple(row["alternatives"])), row) for row in answer["beyond"])
    lines = []
    for (rule, under), rows in rows_of.items():
        row = max(rows, key=lambda row: row["value"])
        who = "any alternative" if len(under) == len(answer["alternatives"]) else ", ".join(under)
        value, limit = (variable(row["quantity"], row[key]) for key in ("value", "limit"))
        lines.append(
            f'NOT POSSIBLE in any sea with {who}, by "{rule}":'
            f" {', '.join(each['phase'] for each in rows)}; {row['phase']}: {value} at rest, limit {limit}"
            f" ({row['basis']})"
        )
    return lines


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


def checked_plan(answer: dict[str, Any]) -> Document:
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
    if answer["resonance"]:
        where = ", ".join(f"{row['T']:.4g} s at {fmt(-row['z'], 'length')}" for row in answer["resonance"])
        parts.append(Text(f"the load on its wire is in resonance with peak periods of {where} depth"))
    facts = {"rules": rules, "phases": answer["phases"], "limited": _limited(answer)}
    facts["alternatives"] = [{"name": name} for name in answer["alternatives"]]
    parts.append(Table(LIMITS, limits_of_rules(facts), f"{rules['name']} version {rules['version']}"))
    parts += [Text(line) for line in (*rules["changes"], *answer["notes"])]
    subject = f"{answer['crane']} on {answer['vessel']}, {answer['payload']}, {fmt(answer['depth'], 'length')} deep"
    return Document(answer["name"], name=subject, front=parts)


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


def _times(answer: dict[str, Any]) -> str:
    keys = ("T_phases", "T_POP", "T_C", "T_R")
    times = {key: "not assessed" if answer[key] is None else hours(answer[key]) for key in keys}
    restricted = "weather restricted" if answer["weather_restricted"] else "not weather restricted"
    return f"phases {times['T_phases']}, T_POP {times['T_POP']}, T_C {times['T_C']}, T_R {times['T_R']}: {restricted}"


def _seas(answer: dict[str, Any]) -> str:
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


def _limited(answer: dict[str, Any]) -> list[dict[str, Any]]:
    """Limits of each phase and alternative, a row each."""
    return [
        {"phase": at["phase"], "alternative": at["alternative"], **row}
        for at in answer["limits"]
        for row in at["rules"]
    ]
