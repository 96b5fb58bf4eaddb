"""What a plan's limits rest on: operation and phases, rules and their limits, credit, seas, how each tier answers; and
the inputs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.plan.report.limits_summary import WAVES
from stillhook.plan.report.words import (
    TEXTS,
    described,
    in_air,
    listed,
    named,
    names,
    over,
    phase_code,
    reading,
    rule_code,
    sentence,
    signature_facts,
    valued,
)
from stillhook.plan.result import PlanResult, grouped
from stillhook.report.document import Bullets, Column, Part, Section, Table, Text, facts
from stillhook.report.formatting import argument, direction, fmt, groups, hours, percent
from stillhook.spec.validity import SHORT
from stillhook.trust.standing import MEANING
from stillhook.units import number


def operation(result: PlanResult) -> list[Part]:
    """Phases, planned times, forecast factor."""
    answer = result.facts
    rows = []
    for p in answer["phases"]:
        ends = [fmt(p[key]) for key in ("start_depth", "depth")]
        time = "-" if p["duration"] is None else number(p["duration"] / 60.0, 3)
        counts = result.data["counts"].sel(phase=p["name"]).values
        tiers = ", ".join(t for t in names(result.data, "tier") if (counts == t).any()) or "no result"
        speed = fmt(p["speed"], "speed", 3)
        rows.append([phase_code(result, p["name"]), p["name"], p["kind"], *ends, speed, time, p["mode"], tiers])
    head = ("", "phase", "kind", "from [m]", "to [m]", "speed", "time [min]", "winch", "answered by")
    text = "Depths are those of the payload's underside below still water (negative: above)."
    stops = [(_stop(p), p["name"]) for p in answer["phases"] if _stop(p)]
    text += "".join(f" {listed(phases)}: {stop}." for stop, phases in grouped(stops).items())
    parts: list[Part] = [Text(text)]
    parts.append(Table(head, rows))
    reasons = grouped((sentence(p.get("reason", "")), p["name"]) for p in answer["phases"])
    n_phases = len(answer["phases"])
    if lines := [
        f"{'all phases' if len(phases) == n_phases else listed(phases)}: {reason}"
        for reason, phases in reasons.items()
        if reason
    ]:
        parts.append(Section("How each phase was answered", [Bullets(lines)]))
    op = answer["operation"]
    planned: list[Part] = [facts(_operation(op))]
    planned += [Text(TEXTS["alpha"])] if op["weather_restricted"] else []
    return [*parts, Section("Planned time and forecast", planned)]


def _stop(phase: Mapping[str, Any]) -> str:
    """What a phase is that is a stop within another; empty for others."""
    return str(TEXTS["stops"].get("held" if phase.get("held") else phase["kind"], ""))


def _operation(op: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [
        ("T_POP, planned", _planned(op)),
        ("T_C, contingency", "not assessed: T_R = 2 T_POP" if op["T_C"] is None else hours(op["T_C"])),
        ("T_R, reference", hours(op["T_R"])),
        ("weather restricted", "yes" if op["weather_restricted"] else "no"),
    ]
    if alpha := op.get("alpha_table"):
        text = f"{alpha['name']} version {alpha['version']} ({_source(alpha)}; check against your edition)"
        words = {"forecast level": "level", "monitoring": "monitoring", "seen in": "source", "note": "note"}
        rows += [("alpha by", text), *((title, alpha[key]) for title, key in words.items() if alpha.get(key))]
    return rows


def _planned(op: Mapping[str, Any]) -> str:
    """T_POP from the issue of the forecast, with what of it is lead time."""
    parts = op.get("parts", 1)
    halted = f"; longest of {parts} parts between safe conditions" if parts > 1 else ""
    return f"{hours(op['T_POP'])} from the issue of the forecast, {hours(op.get('lead', 0.0))} of it lead time{halted}"


def _source(of: Mapping[str, Any]) -> str:
    """Standard, edition and clause in a line."""
    return ", ".join(of[key] for key in ("standard", "edition", "clause") if of[key])


def rules(result: PlanResult) -> list[Part]:
    """Every rule with where it is from, and the limits as they stand for the leading alternative."""
    answer = result.facts["rules"]
    rows = []
    for r in answer["rows"]:
        requirement = r.get("requirement") or f"{r['sense'].replace('-', ' ')} {valued(r['limit'], r['quantity'])}"
        note = f" {r['note']}" if r["note"] else ""
        rows.append(
            [
                rule_code(result, r["key"]),
                f"{r['title']} ({r['quantity']})",
                requirement,
                TEXTS["levels"].get(r["level"], r["level"]),
                f"{_source(r)}.{note}",
            ]
        )
    head = ("", "rule (quantity)", "limit", "largest value", "source")
    version = f"{answer['name']} version {answer['version']}, digest {groups(answer['digest'], SHORT)}"
    parts: list[Part] = [Text(TEXTS["check"]), facts([("rule set", version), ("editions", editions(answer))])]
    parts += [Bullets([f"changed: {line}" for line in answer["changes"]])] if answer["changes"] else []
    parts.append(Table(head, rows))
    stand: list[list[str]] = []
    last = ""
    for rule, _, *row in limits_of_rules(result.facts):  # a rule and its limits: named once
        stand.append([*((rule_code(result, rule), rule.replace("-", " ")) if rule != last else ("", "")), *row])
        last = rule
    if stand:
        parts.append(Table(("", LIMITS[0], *LIMITS[2:]), stand, "Limits of the rules"))
    return parts


def editions(of: Mapping[str, Any]) -> str:
    """Who entered the editions of a rule set, in words."""
    return f"entered by {of['entered_by']}" if of.get("entered_by") else "not entered"


LIMITS = ("rule", "quantity", "phases", "under", "limit", "of what")


def limits_of_rules(facts: Mapping[str, Any]) -> list[list[str]]:
    """A row for each rule and limit, with the phases and alternatives in which it is so; facts: rules, limited, phases
    and alternatives of a plan."""
    quantity = {row["key"]: row["quantity"] for row in facts["rules"]["rows"]}
    rows_by_limit = grouped(
        ((r["rule"], valued(r["limit"], quantity[r["rule"]]), r["basis"] or ""), (r["phase"], r["alternative"]))
        for r in facts["limited"]
        if r["rule"] in quantity
    )
    order = list(quantity)
    phases, alternatives = ([row["name"] for row in facts[key]] for key in ("phases", "alternatives"))
    rows = []
    for (rule, limit, basis), pairs in sorted(rows_by_limit.items(), key=lambda item: order.index(item[0][0])):
        of_phases = grouped((tuple(under), phase) for phase, under in grouped(pairs).items())
        for under, at in of_phases.items():
            names_ = _all([named(alternative) for alternative in under], alternatives)
            rows.append([rule, quantity[rule], _all(at, phases), names_, limit, basis])
    return rows


def _all(some: Sequence[str], everything: Sequence[str]) -> str:
    return "all" if len(some) == len(everything) > 1 else listed(some)


def credit(result: PlanResult) -> list[Part]:
    """What each alternative is, and how much of it is credited."""
    answer = result.facts
    crane, twins = answer["crane"], [a.value for a in result.alternatives if a.twin]
    followed = [p["name"] for p in answer["phases"] if p["compensated"]]
    rows = []
    for a in answer["alternatives"]:
        inside = result.data["inside"].sel(alternative=a["name"], phase=followed).values
        share = percent(float(np.nanmean(inside))) if np.isfinite(inside).any() and a["name"] in twins else "-"
        note = sentence(a.get("credit_note") or "")
        rows.append([named(a["name"]), described(a["name"], a.get("settings", "")), note, share])
    certificate = crane["certificate"]
    number = "none" if not certificate else f"No. {groups(certificate['number'], SHORT)}: {certificate['statement']}"
    head = ("alternative", "description", "credited", "covered")
    has = any(row[2] for row in rows)
    body = rows if has else [[r[0], r[1], r[3]] for r in rows]
    parts: list[Part] = []
    state = (certificate or {}).get("condition")
    condition = [("condition", state["text"])] if state else []
    signature = [("signature", signature_facts(certificate)["statement"])] if certificate else []
    parts.append(facts([("crane's twin", crane["twin"]), ("certificate", number), *signature, *condition]))
    parts += [Text(MEANING)] if certificate else []
    parts.append(Table(head if has else (head[0], head[1], head[3]), body))
    parts.append(Text(TEXTS["covered"]))
    return parts


def seas(result: PlanResult) -> list[Part]:
    """Seas analysed."""
    s, data = result.facts["settings"], result.data
    tolerance = direction(data.attrs["heading_tolerance"])
    gamma = f"gamma {s['gamma']:g}" if s["gamma"] else "gamma by Tp/sqrt(Hs) where it has one"
    rows = [
        ("spectrum", f"{WAVES[s['wave']]}, {gamma}"),
        ("spreading", f"cos^{s['spread']:g}" if s["spread"] else "none: long-crested"),
        *_swell(s.get("swell"), result.facts["operation"]),
        ("Hs", f"{len(s['Hs'])} heights, {over(s['Hs'], 'length')}"),
        ("Tp", ", ".join(f"{T:g}" for T in data["period"].values) + " s"),
        ("headings", ", ".join(direction(b) for b in data["heading"].values) + f"; tolerance {tolerance}"),
    ]
    return [facts(rows), Text(f"Reading the table between its cells: {reading(result)}.")]


def _swell(swell: Mapping[str, Any] | None, op: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The second system with the wind sea of the table, and which swells of weather it represents."""
    if swell is None:
        return []
    like = (
        f"in weather swells up to {fmt(op['swell_wf'], 'length')} (alpha in it), Tp within"
        f" {fmt(swell['Tp_tolerance'], 'time')}, heading within {direction(swell['heading_tolerance'])}"
    )
    return [("second system", f"{swell['text']}, in every cell: all limits are those of the wind sea; {like}")]


def models(result: PlanResult) -> list[Part]:
    """How each tier answers, and the vessel and payload that all of them share."""
    answer = result.facts
    used = [t for t in names(result.data, "tier") if t in answer["tiers"]]
    parts: list[Part] = [facts([(t, TEXTS["tiers"][t]) for t in used])]
    parts += [Text(TEXTS["counts"])]
    payload, vessel, crane = (answer[key] for key in ("payload", "vessel", "crane"))
    rows = [
        ("crane", f"{crane['name']}: {crane['title']}; SWL {fmt(crane['SWL'], 'mass')}"),
        ("vessel", f"{vessel['name']}: {vessel['title']}"),
        *(("", note) for note in vessel["notes"]),
        ("place", answer["place"]["text"]),
        ("payload", f"{payload['name']}: {', '.join(filter(None, (payload.get('title'), in_air(payload))))}"),
    ]
    numbers = [[item, _plain(value), *more] for item, value, *more in payload["rows"]]
    shared: list[Part] = [facts(rows), Table(("payload", "value", "kind", "source"), numbers)]
    return [*parts, Section("Crane, vessel, payload", shared)]


def _plain(value: str) -> str:
    """A value that people can read; descriptions of objects are left to the payload's file."""
    return "" if value == "as given" or "kind=" in value else value


def inputs(result: PlanResult) -> list[Part]:
    """Versions, hashes, seeds: what another person needs to repeat it."""
    answer = result.facts
    version = f"Stillhook {answer['version']}, code {answer['code']}, on {answer['date']}"
    rows = [
        ("computed by", version),
        ("plan", f"{answer['name']} ({answer['source'] or '-'}), digest {groups(answer['digest'], SHORT)}"),
        *_runs(answer["runs"]),
    ]
    hashes = [[i["item"], _file(i["file"]), i["sha256"]] for i in answer["inputs"]]
    title = "Inputs (SHA-256 of what counts in each)"
    parts: list[Part] = [facts(rows), Table((), hashes, title, [Column.WORD, Column.WORD, Column.CODE])]
    if remarks := [*answer["remarks"], *answer["notes"]]:
        parts.append(Section("Remarks of this run", [Bullets(list(dict.fromkeys(map(sentence, remarks))))]))
    again = [line.format(command=_command(answer)) for line in TEXTS["again"]]
    return [*parts, Section("To check or to repeat it", [Bullets(again)])]


def _command(answer: Mapping[str, Any]) -> str:
    """The command that gives these numbers again."""
    tier = f" --tier {answer['tiers'][-1]}" if answer["tiers"] else ""
    name = answer["operation"].get("alpha_table", {}).get("name")
    alpha = f" --forecast-factors {argument(name)}" if name else ""
    seed = f" --seed {answer['runs']['seed']}" if answer["runs"].get("seed") else ""
    return f"stillhook plan {argument(_file(answer['source'] or 'PLAN.toml'))}{tier}{alpha}{seed} --out FOLDER"


def _file(name: str) -> str:
    """A file without its folder on this machine; a library's sentence by its start."""
    plain = name.replace("\\", "/")
    absolute = plain.startswith("/") or plain[1:3] == ":/"
    return plain.rpartition("/")[2] if absolute else re.split(r",(?![^(]*\))", plain)[0]


RUNS = {
    "n": "runs in the time domain (alike in several alternatives: once)",
    "n_failed": "failed runs",
    "n_cells": "cells of phase, winch and sea",
    "seeds_per_cell": "seeds a cell, least and most",
    "seed": "seed of the waves (--seed)",
    "simulated": "simulated time",
}
"""Numbers of the runs in words; others, such as the time that a machine took, do not belong to the answer."""


def _runs(runs: Mapping[str, Any]) -> Iterable[tuple[str, str]]:
    for key, words in RUNS.items():
        value = runs.get(key)
        if isinstance(value, list):
            yield words, " to ".join(map(str, value))
        elif value is not None:
            yield words, hours(value) if key == "simulated" else number(float(value), 6)


def not_covered(result: PlanResult) -> list[Part]:
    """What no number of this document says anything about."""
    codes = (TEXTS["not_covered"].get(code, code) for code in result.facts["not_covered"])
    lines = dict.fromkeys([*codes, *TEXTS["unsafe"]])
    return [Bullets([f"{line[:1].upper()}{line[1:].rstrip('.')}." for line in lines])]
