"""A plan's result in short, for a terminal: limits of every heading, credit, waiting, forecast limit, remarks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from stillhook.plan.report.figures.style import CREDITED, TWIN, height, names
from stillhook.plan.result.distinguishable import columns, merged, references
from stillhook.plan.result.result import PlanResult
from stillhook.report.document import Document, Part, Table, Text
from stillhook.report.formatting import days, fixed, hours, percent

YEAR = 365.25 * 24.0
"""[h]."""


def brief(result: PlanResult) -> Document:
    """The answer, without its basis."""
    facts = result.facts
    parts: list[Part] = [_heading(result, float(heading)) for heading in result.data["heading"].values]
    parts += [Text(f"{', '.join(labels)}: {note}") for note, labels in _by_credit_note(facts["alternatives"]).items()]
    if certificate := facts["crane"]["certificate"]:
        parts.append(Text(certificate["unsigned"]))
    if "weather" in result:
        parts.append(_weather(result))
    rules = facts["rules"]
    parts += [Text(_operation(facts["operation"])), Text(facts["crane"]["twin"]), *map(Text, facts["remarks"])]
    source = "recalled from their standards: check against your edition"
    parts.append(Text(f"rules: {rules['name']} {rules['version']}, {source}"))
    subject = f"{facts['crane']['name']}, {facts['payload']['name']}, {facts['place']['text']}"
    return Document(facts["name"], name=subject, front=parts)


def _by_credit_note(alternatives: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Credit notes, with the alternatives that each applies to."""
    out: dict[str, list[str]] = {}
    for each in alternatives:
        out.setdefault(each["credit_note"], []).append(each["name"])
    return out


def _operation(op: dict[str, Any]) -> str:
    """Planned time and forecast limit in one line."""
    times = ", ".join(f"{key} {hours(op[key])}" for key in ("T_POP", "T_R"))
    restricted = "weather restricted" if op["weather_restricted"] else "not weather restricted"
    cell = f"{op['alternative']} at Tp {op['Tp']:g} s, {math.degrees(op['beta']):.4g} deg"
    if math.isnan(op["alpha"]):
        return f"{times}: {restricted}; no forecast factor for {cell}"
    forecast = f"OP_LIM {op['OP_LIM']:.2f} m, alpha {op['alpha']:.3f}, OP_WF {op['op_wf']:.2f} m"
    return f"{times}: {restricted}; {cell}: {forecast}"


def _heading(result: PlanResult, beta: float) -> Table:
    """One table for a heading: limits of every alternative over the periods, what is credited, the closed form, and
    what governs."""
    data, shown, top = result.data.sel(heading=beta), str(result.facts["shown"]), float(result.data.attrs["Hs_highest"])
    groups = columns(result)
    closed = data["Hs_rule"].sel(credit=TWIN, tier="closed-form", alternative=shown).min(dim=("phase", "rule"))
    rows = []
    for period in data["period"].values:
        at = data.sel(period=period)
        simulated = [float(at["Hs_limit"].sel(credit=TWIN, alternative=group[0])) for group in groups]
        credited = float(at["Hs_limit"].sel(credit=CREDITED, alternative=shown))
        limits = [height(Hs, top) for Hs in (*simulated, credited, float(closed.sel(period=period)))]
        governing = at.sel(credit=TWIN, alternative=shown)
        governs = [str(governing[f"governing_{quantity}"].item()) for quantity in ("phase", "rule", "tier")]
        rows.append([f"{float(period):g} s", *limits, *governs])
    labels = [",\n".join(group) for group in groups]
    header = ["Tp", *labels, f"credited:\n{shown}", "closed\nform", f"{shown} is\ngoverned in", "by", "tier"]
    return Table(header, rows, f"limiting Hs [m], waves travelling {math.degrees(beta):.4g} deg from the bow")


def _weather(result: PlanResult) -> Table:
    """How often each alternative can work, how long it waits, and what it gains an operation, as modelled; as credited
    where that differs, alike ones in one row."""
    block, over = result["weather"], references(result["weather"], result.facts["tiers"])
    synthetic = "SYNTHETIC weather, " if block.attrs["synthetic"] else ""
    years = f"{block.attrs['first'][:10]} to {block.attrs['last'][:10]}"
    title = f"{synthetic}{block.attrs['source']}, {years}, window {hours(block.attrs['T_R'])}"
    modelled, credited = (
        {name: _weather_row(block.sel(credit=credit, alternative=name, month=0), over) for name in names(block)}
        for credit in (TWIN, CREDITED)
    )
    rows = merged(([name, *cells] for name, cells in modelled.items()), result, between=",\n")
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, cells in credited.items():
        if cells != modelled[name]:
            alike.setdefault(tuple(cells), []).append(name)
    rows_by_credit = [["twin", *row] for row in rows]
    rows_by_credit += [["credited", ",\n".join(labels), *cells] for cells, labels in alike.items()]
    header = ["limit", "winch", "workable", "hours\na year", "wait\nmean", "wait\nP50", "wait\nP90", "vessel\ndays"]
    header += [f"days gained\nover {name.replace('-', ' ')}" for name in over]
    return Table(header, rows_by_credit, title)


def _weather_row(year: Any, over: Sequence[str]) -> list[str]:
    """Workable share and hours of a year, waits, vessel days, and days gained over each of these alternatives."""
    worked = float(year["operability"])
    waits = [days(float(year[key])) for key in ("wait_mean", "wait_p50", "wait_p90")]
    gains = [fixed(float(year["days_gained"].sel(over=name)), 1) for name in over]
    return [percent(worked), fixed(worked * YEAR, 0), *waits, fixed(float(year["vessel_days"]), 1), *gains]
