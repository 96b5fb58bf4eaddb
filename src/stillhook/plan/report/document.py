"""A plan's report as a document: the first page and the sections after it.

The report of a plan: PDF and self-contained page, from a result in memory or on disk.

A plan's result in short, for a terminal: limits of every heading, credit, waiting, forecast limit, remarks.

What a plan requests, before anything is run: phases, times, seas, and rules with their limits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.errors import PlanError
from stillhook.plan.definition.failures import FAILED
from stillhook.plan.report import basis, detail
from stillhook.plan.report.figures.limits import pictures
from stillhook.plan.report.summary_page import tables, verdict
from stillhook.plan.report.sweep import tolerance_sweep
from stillhook.plan.report.words import CREDITED, TEXTS, TWIN, gain, height, names, of_wind_sea, workable
from stillhook.plan.result import (
    PlanResult,
    columns,
    for_print,
    grouped,
    merged,
    missing_facts,
    odd_fact,
    odd_numbers,
    of_two,
    references,
)
from stillhook.report.document import Document, Part, Section, Table, Text
from stillhook.report.formatting import fixed, groups, hours
from stillhook.report.html import html
from stillhook.report.pdf import Unset, pdf
from stillhook.report.pictures import can_set, drawn
from stillhook.spec.validity import SHORT
from stillhook.units import quote

MISSING = ("NOT ASSESSED", FAILED)
"""Begin remarks that must be seen first."""


def document(result: PlanResult, figures: Mapping[str, bytes]) -> Document:
    """The report. figures: PNG by stem, of `stillhook.plan.report.figures.limits.pictures`."""
    facts = result.facts
    sections = {  # the answer's basis, then detail, then inputs, then what is not covered
        "Operation and phases": basis.operation(result),
        "Rules": basis.rules(result),
        "Credit for compensation": basis.credit(result),
        "Sea states analysed": basis.seas(result),
        "How the limits were calculated": basis.models(result),
        "Limits, cell by cell": detail.limit_cells(result, figures),
        "Limits, phase by phase": [*detail.by_phase(result), *detail.closed_form_comparison(result)],
        "Weather and waiting": detail.weather(result, figures),
        "Behind the limits": detail.behind(result, figures),
        "Landing tolerance, payload and depth": tolerance_sweep(result, figures),
        "Inputs, versions, seeds": basis.inputs(result),
        "What is not covered": basis.not_covered(result),
    }
    return Document(
        title=TEXTS["heading"],
        name=result.name,
        subtitle=_subtitle(result),
        purpose=TEXTS["purpose"],
        marks=marks(result),
        front=[verdict(result), *tables(result)],
        sections=[Section(f"{i}. {title}", parts) for i, (title, parts) in enumerate(sections.items(), 1)],
        signatures=("Prepared by", "Checked by", "Marine warranty surveyor, place and date"),
        number=groups(facts["digest"], SHORT),
        date=facts["date"],
        made_by=f"Stillhook {facts['version']}",
    )


def _subtitle(result: PlanResult) -> str:
    payload = result.facts["payload"]
    return f"{payload.get('title') or payload['name']}, {result.facts['place']['depth']:g} m of water"


def marks(result: PlanResult) -> list[str]:
    """What must be seen on every page: synthetic inputs, a twin that is not validated, cells without a result."""
    lines = []
    if "weather" in result and result["weather"].attrs["synthetic"]:
        lines.append(TEXTS["synthetic"])
    certificate = result.facts["crane"]["certificate"]
    if certificate and certificate.get("synthetic"):
        lines.append(TEXTS["assumed_certificate" if certificate.get("assumed") else "synthetic_certificate"])
    if not certificate and any(a.twin for a in result.alternatives):
        lines.append(TEXTS["unvalidated"].rstrip("."))
    return lines + [line.rstrip(".") for line in result.facts["remarks"] if line.startswith(MISSING)]


PDF, PAGE = "report.pdf", "report.html"
REPORT_FILES = (PDF, PAGE)
FIGURE = "figure-"
"""Prefix of the names of figures that are written as separate files."""


def write_report(result: PlanResult, folder: Path, *, figures: bool = False) -> tuple[str, ...]:
    """Write the report into a folder that is moved into place later; gives the names of its files.

    figures: also every figure as a separate picture. The same result gives the same bytes. Without the extra `report`
    the page alone, without figures. Errors: PlanError where it cannot be set.
    """
    check(result)
    result = for_print(result)
    images = drawn(lambda: pictures(result))
    report = document(result, images)
    try:
        content = {PDF: pdf(report)} if can_set() else {}
    except Unset as problem:
        raise PlanError(f"report of {result.name}: {problem}") from None
    content[PAGE] = html(report).encode()
    if figures:
        content |= {f"{FIGURE}{stem}.png": data for stem, data in images.items()}
    for name, data in content.items():
        (folder / name).write_bytes(data)
    return tuple(content)


def check(result: PlanResult) -> None:
    """Refuse results that no report can be made of. Errors: PlanError."""
    if missing := missing_facts(result.facts):
        problem = f"its facts lack {missing}"
    else:
        problem = odd_fact(result.facts) or odd_numbers(result.data) or of_two(result.data, result.facts)
    if problem:
        raise PlanError(f"report of {quote(result.facts.get('name'))}: {problem}. Run the plan again.")


def save_report(result: PlanResult, folder: str | Path, *, figures: bool = False) -> tuple[str, ...]:
    """The same in a folder of one's own: all files of it or none. Errors: StillhookError where the folder cannot be
    written to."""
    target = Path(folder)
    check_folder(target, REPORT_FILES)
    with atomic_folder(target) as part:
        return write_report(result, part, figures=figures)


YEAR = 365.25 * 24.0
"""[h]."""


def brief(result: PlanResult) -> Document:
    """The answer, without its basis."""
    result = for_print(result)
    facts = result.facts
    parts: list[Part] = [_heading(result, float(heading)) for heading in result.data["heading"].values]
    notes = grouped((each["credit_note"], each["name"]) for each in facts["alternatives"])
    parts += [Text(f"{', '.join(labels)}: {note}") for note, labels in notes.items()]
    if certificate := facts["crane"]["certificate"]:
        parts.append(Text(TEXTS["assumed_certificate"] if certificate.get("assumed") else certificate["unsigned"]))
    if "weather" in result:
        parts.append(_weather(result))
    rules = facts["rules"]
    parts += [Text(_operation(facts["operation"])), Text(facts["crane"]["twin"]), *map(Text, facts["remarks"])]
    source = "recalled from their standards: check against your edition"
    parts.append(Text(f"rules: {rules['name']} {rules['version']}, {source}"))
    subject = f"{facts['crane']['name']}, {facts['payload']['name']}, {facts['place']['text']}"
    return Document(facts["name"], name=subject, front=parts)


def _operation(op: dict[str, Any]) -> str:
    """Planned time and forecast limit in one line."""
    times = ", ".join(f"{key} {hours(op[key])}" for key in ("T_POP", "T_R"))
    restricted = "weather restricted" if op["weather_restricted"] else "not weather restricted"
    cell = f"{op['alternative']} at Tp {op['Tp']:g} s, {math.degrees(op['beta']):.4g} deg"
    if math.isnan(op["alpha"]):
        open_ = f"OP_LIM {op['OP_LIM']:.2f} m, alpha case by case" if _below_table(op) else "no forecast factor"
        return f"{times}: {restricted}; {cell}: {open_}"
    forecast = f"OP_LIM {op['OP_LIM']:.2f} m, alpha {op['alpha']:.3f}, OP_WF {op['op_wf']:.2f} m"
    return f"{times}: {restricted}; {cell}: {forecast}"


def _below_table(op: dict[str, Any]) -> bool:
    """Whether the limit is one that the table of forecast factors leaves open."""
    lowest = op.get("alpha_table", {}).get("Hs_lowest", 0.0)
    return bool(op["weather_restricted"]) and 0.0 < op["OP_LIM"] < lowest


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
    title = f"limiting Hs [m], waves travelling {math.degrees(beta):.4g} deg from the bow{of_wind_sea(result)}"
    return Table(header, rows, title)


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
    alike = grouped((tuple(cells), name) for name, cells in credited.items() if cells != modelled[name])
    rows_by_credit = [["twin", *row] for row in rows]
    rows_by_credit += [["credited", ",\n".join(labels), *cells] for cells, labels in alike.items()]
    header = ["limit", "winch", "workable", "hours\na year", "wait\nmean", "wait\nP50", "wait\nP90", "vessel\ndays"]
    header += [f"days gained\nover {name.replace('-', ' ')}" for name in over]
    return Table(header, rows_by_credit, title)


def _weather_row(year: Any, over: Sequence[str]) -> list[str]:
    """Workable share and hours of a year, waits, vessel days, and days gained over each of these alternatives."""
    operability, *waits = workable(year)
    worked, vessel = fixed(float(year["operability"]) * YEAR, 0), fixed(float(year["vessel_days"]), 1)
    gains = [gain(year, name) for name in over]
    return [operability, worked, *waits, vessel, *gains]
