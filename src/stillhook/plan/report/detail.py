"""Detail behind a plan's first page: every cell, every phase by every tier, waiting, and the inputs that govern the
limits."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.detail import FACTORS, OVER
from stillhook.plan.report.figures.limits import CLOSED
from stillhook.plan.report.words import (
    CREDITED,
    TEXTS,
    TWIN,
    few,
    gain,
    governs,
    height,
    highest,
    leading,
    least,
    lines_of,
    named,
    names,
    of_wind_sea,
    phase_code,
    rule_code,
    sea_words,
    workable,
)
from stillhook.plan.result import Credit, PlanResult, merged, references
from stillhook.plan.weather.records import PER_RECORD
from stillhook.report.document import Bullets, Figure, Part, Section, Table, Text, facts
from stillhook.report.formatting import direction, fixed, fmt, hours, percent
from stillhook.units import number
from stillhook.weather.persistence import MONTHS

GOVERNING = ("governing_phase", "governing_rule")
PERIODS = 10
"""Columns of a table at most."""
PAGE = 205.0
"""Height of a full-page picture [mm]."""


def limit_cells(result: PlanResult, figures: Mapping[str, bytes]) -> list[Part]:
    """Curves, tables of cells, rosette."""
    cells = [stem for stem in figures if stem.startswith("limits-") and stem != "limits-over-period"]
    return [
        *picture(figures, "limits-over-period"),
        Text(TEXTS["reading"].format(highest=number(highest(result), 3))),
        *([Text(f"Limiting Hs{of_wind_sea(result)}.")] if of_wind_sea(result) else []),
        *(Figure(figures[stem], TEXTS["captions"]["-".join(stem.split("-")[:2])], PAGE) for stem in cells),
        *picture(figures, "rosette"),
        _governing(result),
    ]


def picture(figures: Mapping[str, bytes], stem: str, sea: str = "") -> list[Part]:
    """A figure where it was drawn, with its caption and the sea that it is of."""
    return [Figure(figures[stem], f"{TEXTS['captions'][stem]} {sea}".strip())] if stem in figures else []


def _governing(result: PlanResult) -> Part:
    """How often what governs, for every alternative."""
    labels = names(result.data)
    data = result.data.sel(credit=CREDITED)
    pairs_of = {
        name: Counter(zip(*(data[key].sel(alternative=name).values.ravel() for key in GOVERNING), strict=True))
        for name in labels
    }
    counted: Counter[tuple[str, str]] = sum(pairs_of.values(), Counter())
    rows = [
        [_pair(result, str(phase), str(rule)), *(str(pairs_of[name].get((phase, rule), "")) for name in labels)]
        for (phase, rule), _ in counted.most_common()
    ]
    header = ("governs, credited", *(named(x) for x in labels))
    return Table(header, rows, "What governs, in cells of the table")


def _pair(result: PlanResult, phase: str, rule: str) -> str:
    if not phase:
        return "nothing below the highest sea state analysed, or no result"
    return f"{phase_code(result, phase)} {rule_code(result, rule)}: {governs(phase, rule)}"


def by_phase(result: PlanResult) -> list[Part]:
    """Least limit of every phase by every tier for the leading alternative, and what is credited; every rule's least
    limit."""
    name, data = leading(result), result.data
    columns = few(data.sizes["period"], PERIODS)
    rows: list[list[str]] = []
    strong: list[int] = []
    for phase in names(data, "phase"):
        counts = data["counts"].sel(alternative=name, phase=phase).values
        label = f"{phase_code(result, phase)} {phase}"
        rows_of_tiers = [
            (tier, _of_phase(result, TWIN, [tier], name, phase), counts == tier) for tier in names(data, "tier")
        ]
        rows_of_tiers.append(
            (CREDITED, _of_phase(result, CREDITED, names(data, "tier"), name, phase), np.zeros(0, dtype=bool))
        )
        for by, Hs, at in rows_of_tiers:
            if np.isnan(Hs).all():
                continue
            if by == CREDITED:
                strong.append(len(rows))
            seeds = int(data["n_seeds"].sel(alternative=name, phase=phase).values[at].max()) if at.any() else 0
            worst = least(np.where(np.isnan(Hs), np.inf, Hs))
            rows.append([label, by, str(seeds or ""), *(height(float(worst[k]), highest(result)) for k in columns)])
    head = ("phase", "by", "seeds", *(f"{data['period'].values[k]:g} s" for k in columns))
    sentence = (
        f"Least limit over the rules [m] at the worst heading, with {named(name)}: as each tier finds it, and as"
        " credited (bold)."
    )
    return [Text(sentence), Table(head, rows, bold_rows=strong), *_by_rule(result, name)]


def _of_phase(result: PlanResult, credit: Credit, tiers: Sequence[str], name: str, phase: str) -> FloatArray:
    """Least limit over some tiers and the rules (heading, period) [m]; NaN where none is determined."""
    values = result.data["Hs_rule"].sel(credit=credit, tier=list(tiers), alternative=name, phase=phase).values
    Hs = np.asarray(values, dtype=float).reshape(-1, *values.shape[-2:])
    return np.asarray(np.where(np.isnan(Hs).all(axis=0), np.nan, np.where(np.isnan(Hs), np.inf, Hs).min(axis=0)))


def _by_rule(result: PlanResult, name: str) -> list[Part]:
    """Rules that limit anything, with their least limits by every tier and as credited; the others in a sentence."""
    data, tiers, top = result.data, names(result.data, "tier"), highest(result)
    Hs_rule = data["Hs_rule"].sel(alternative=name)
    rows, rest = [], []
    for phase in names(data, "phase"):
        for rule in names(data, "rule"):
            modelled, credited = (Hs_rule.sel(credit=c, phase=phase, rule=rule).values for c in (TWIN, CREDITED))
            code = f"{phase_code(result, phase)} {rule_code(result, rule)}"
            final = np.where(np.isnan(credited), np.inf, credited).min(axis=0)
            if np.isnan(modelled).all() and np.isnan(credited).all():
                continue
            if np.isposinf(final).all() and not np.isfinite(modelled).any():
                rest.append(code)
                continue
            cells = [_lowest(modelled[t], top) for t in range(len(tiers))]
            i, k = np.unravel_index(int(final.argmin()), final.shape)
            at = (
                f"{data['period'].values[k]:g} s, {direction(data['heading'].values[i])}"
                if np.isfinite(final.min())
                else ""
            )
            rows.append([code, governs(phase, rule), *cells, _lowest(credited, top), at])
    inside = f"Inside up to {number(top, 3)} m wherever they are assessed: {', '.join(rest)}."
    header = ("", "phase: rule", *tiers, "credited", "least at")
    title = "Least limit of every rule over all cells, by each tier and credited"
    limits = Table(header, rows, title, bold_columns=[header.index("credited")])
    return [*([limits] if rows else []), *([Text(inside)] if rest else [])]


def _lowest(Hs: FloatArray, top: float) -> str:
    """Least of limits as text; "-" where none is determined."""
    return "-" if np.isnan(Hs).all() else height(float(np.nanmin(Hs)), top)


def closed_form_comparison(result: PlanResult) -> list[Part]:
    """Where the closed form stands against what is credited, in the phases where another tier counts."""
    name, lines, tiers = leading(result), [], names(result.data, "tier")
    for phase in names(result.data, "phase") if CLOSED in tiers else []:
        closed, final = _of_phase(result, TWIN, [CLOSED], name, phase), _of_phase(result, CREDITED, tiers, name, phase)
        other = (result.data["counts"].sel(alternative=name, phase=phase) != CLOSED).values & ~np.isnan(closed)
        both = other & np.isfinite(closed) & np.isfinite(final) & (final > 0.0)
        if both.any():
            ratio = closed[both] / final[both]
            ends = sorted({f"{x:.2f}" for x in (ratio.min(), ratio.max())})
            lines.append(f"{phase}: closed form {' to '.join(ends)} of the limit that is credited")
        if below := int((other & (closed < final) & np.isposinf(final)).sum()):
            lines.append(
                f"{phase}: closed form limits {below} of {closed.size} cells in which the better tier does not"
            )
        if above := int((other & np.isposinf(closed) & np.isfinite(final)).sum()):
            lines.append(
                f"{phase}: closed form sees no limit in {above} of {closed.size} cells in which the better tier does"
            )
    return [Section("Comparison with the closed form", [Bullets(lines)])] if lines else []


def weather(result: PlanResult, figures: Mapping[str, bytes]) -> list[Part]:
    """Operability, waiting and what each alternative gains; empty where no weather was given."""
    if "weather" not in result:
        return [Text("The plan has no weather: waiting is not calculated. Add [weather] to the plan file.")]
    block = result["weather"]
    year, over = block.sel(month=0), references(block, result.facts["tiers"])
    rows = []
    for name in names(block):
        for label, credit in lines_of(result, name):
            cells = year.sel(credit=credit, alternative=name)
            gains = [_gains(cells, o) for o in over]
            vessel, censored = fmt(float(cells["vessel_days"]), digits=3), fixed(float(cells["n_censored"]), 0)
            rows.append([label, *workable(cells), vessel, *gains, censored])
    heads = {"none": "over none", "cap-80": "over cap", "best-classic": "over classic"}
    head = ("", "operability", "mean wait", "P50", "P90", "vessel days", *(heads.get(o, o) for o in over), "censored")
    title = f"Whole year; gained over {', '.join(OVER.get(o, o) for o in over)}: vessel days an operation, hours a year"
    return [
        *([Text(f"{TEXTS['synthetic']}.")] if block.attrs["synthetic"] else []),
        Text(TEXTS["persistence"]),
        facts(_series(result)),
        Table(head, merged(rows, result), title),
        *picture(figures, "waiting-by-month"),
        *picture(figures, "days-gained"),
        _by_month(result),
    ]


def _gains(cells: Any, over: str) -> str:
    """Days of waiting an operation, with their interval, and workable hours a year that are gained, of a row of the
    weather block."""
    return f"{gain(cells, over)} d, {_more(float(cells['hours_gained'].sel(over=over)), 0)} h"


def _more(x: float, digits: int) -> str:
    if math.isnan(x):
        return "-"
    rounded = round(x, digits)
    return f"{rounded:+.{digits}f}" if rounded else "0"


def _series(result: PlanResult) -> list[tuple[str, str]]:
    """What the waiting was counted on."""
    block, attrs = result["weather"], result["weather"].attrs
    cells = block.sel(credit=CREDITED, alternative=leading(result), month=0)
    n_hours, n_gaps = (fixed(float(cells[key]), 0) for key in ("n_hours", "n_gaps"))
    rows = [
        ("series", f"{attrs['source']}{' (SYNTHETIC)' if attrs['synthetic'] else ''}"),
        ("from, to", f"{attrs['first']} to {attrs['last']}"),
        ("hours, gaps", f"{n_hours} h, {n_gaps} gaps"),
        ("window", f"T_R = {hours(attrs['T_R'])}"),
    ]
    if "outside" in attrs:
        share = percent(float(attrs["outside"]))
        rows.append(("outside the table", f"{share} of the records: counted as not workable"))
    ship = float(attrs["ship"])
    fixed_at = f"fixed, bow at {direction(ship)} from north"
    free = f"free to turn: one heading through each operation, the best one; {PER_RECORD}"
    open_ = [("forecast factor", attrs["case_by_case"])] if attrs.get("case_by_case") else []
    heading = ("vessel's heading", free if math.isnan(ship) else fixed_at)
    return [*rows, ("limit", attrs["limit"]), *open_, heading]


def _by_month(result: PlanResult) -> Part:
    block, rows = result["weather"], []
    for month, label in enumerate(MONTHS, start=1):
        cells = block.sel(credit=CREDITED, alternative=leading(result), month=month)
        if math.isnan(float(cells["operability"])):
            continue
        counts = [fixed(float(cells[k]), 0) for k in ("n_windows", "n_windows_long_enough", "n_censored")]
        rows.append([label, *workable(cells), *counts])
    header = ("month", "operability", "mean wait", "P50", "P90", "windows", "long enough", "censored")
    return Table(header, rows, f"By month with {named(leading(result))}, credited")


def behind(result: PlanResult, figures: Mapping[str, bytes]) -> list[Part]:
    """Depth, efficiency, landing, sensitivity, convergence: those that were computed."""
    blocks = ("depth", "efficiency", "landing", "sensitivity", "convergence")
    parts: list[Part] = []
    for name in blocks:
        if name in result:
            parts += picture(figures, name, sea_words(result[name].attrs))
            parts += _sensitivity(result) if name == "sensitivity" else []
    missing = [name for name in blocks if name not in result]
    reasons = result.facts.get("not_computed", {})
    phrases = [f"{name} ({reasons[name]})" if name in reasons else name for name in missing]
    return [*parts, Text(f"Not computed in this run: {', '.join(phrases)}.")] if missing else parts


def _sensitivity(result: PlanResult) -> list[Part]:
    """Limits of the leading alternative with other inputs, and whether they are those of what governs."""
    block, top = result["sensitivity"], highest(result)
    cells = block.sel(alternative=leading(result))
    rows = []
    for i, factor in enumerate(names(block, "factor")):
        tried = [str(block[k].values[i]) for k in ("low_text", "high_text")]
        values = [height(float(cells[k].values[i]), top) for k in ("Hs_base", "Hs_low", "Hs_high")]
        rows.append([FACTORS.get(factor, factor), values[0], tried[0], values[1], tried[1], values[2]])
    head = (f"input ({named(leading(result))}, Hs [m])", "as planned", "first value", "limit", "second value", "limit")
    return [Text(_varied(result)), Table(head, rows)]


def _varied(result: PlanResult) -> str:
    """Which phase was varied, and which governs the leading alternative in that cell."""
    attrs, name = result["sensitivity"].attrs, leading(result)
    cells = result.data.sel(alternative=name).sel(
        period=float(attrs["Tp"]), heading=float(attrs["beta"]), method="nearest"
    )
    by = f", by {attrs['tier']}" if attrs.get("tier") else ""
    varied = f"Varied here: {governs(attrs['phase'], attrs['rule'])}{by}."
    phrases = []
    for credit, label in ((CREDITED, "credited"), (TWIN, "by the twin")):
        cell = cells.sel(credit=credit)
        phase, rule = str(cell["governing_phase"].item()), str(cell["governing_rule"].item())
        if phase and phase != attrs["phase"]:
            limit = height(float(cell["Hs_limit"]), highest(result))
            phrases.append(f"{label}, {governs(phase, rule)} governs this cell at {limit} m and was not varied")
    return f"{varied} {'; '.join(phrases).capitalize()}: this variation does not apply to it." if phrases else varied
