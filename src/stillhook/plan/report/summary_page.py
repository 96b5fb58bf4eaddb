"""The first page of a plan's report: in which weather the lift may be done, what limits it, and on which conditions."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.detail import OVER
from stillhook.plan.report.words import (
    CREDITED,
    TEXTS,
    TWIN,
    between,
    differs,
    few,
    gain,
    governs,
    height,
    highest,
    leading,
    least,
    limits,
    lines_of,
    named,
    names,
    of_wind_sea,
    over,
    reading,
    swinging,
    workable,
    worst_heading,
)
from stillhook.plan.result import Credit, PlanResult, merged, references
from stillhook.report.document import Part, Table, Text, Verdict, facts
from stillhook.report.formatting import HOUR, direction, fixed, fmt, hours, percent
from stillhook.spec.validity import UNSIGNED

if TYPE_CHECKING:
    pass

RUN = ("frequency", "time")
"""Tiers that ask the twin."""
CENSORED = 0.02
"""Share of starts without a window from which on waiting is reported as longer."""
NONE, LOWEST = "none", 1.0
"""The alternative without compensation, and the lowest height [m] of the usual tables of forecast factors."""
OUTSIDE = 0.005
"""Share of records outside the table from which on it is reported."""
NAMED = 3
"""Phases and rules that are named as governing at most."""
PERIODS, HEADINGS = 12, 4
"""Rows and columns of the first page's tables at most; the whole is in the section of limits."""


def verdict(result: PlanResult) -> Verdict:
    """The limits in a line, whether there is any workable sea, and what follows in sentences."""
    name = leading(result)
    credited = limits(result, CREDITED, name)
    workable = bool((np.nan_to_num(credited) > 0.0).any())
    word = f"OP_LIM Hs {between(credited, highest(result))}" if workable else "NO WORKABLE SEA STATE"
    certificate = result.facts["crane"]["certificate"] or {}
    unsigned = [TEXTS["assumed_certificate"]] if certificate.get("assumed") else [UNSIGNED] if certificate else []
    waiting = [_waiting(result, name)] if "weather" in result else []
    swings = swinging(result)
    sentences = [_credited(result, name), _twin(result, name), *swings, *unsigned, _operation(result, name), *waiting]
    return Verdict(word, workable, sentences)


def tables(result: PlanResult) -> list[Part]:
    """Limits of the leading alternative, all alternatives side by side, and the conditions."""
    return [_limits(result, leading(result)), _side_by_side(result), *_conditions(result)]


def _credited(result: PlanResult, name: str) -> str:
    Hs, data = limits(result, CREDITED, name), result.data
    seas = f"Tp {over(data['period'].values, 'time')}, waves at {over(data['heading'].values, 'angle')}"
    sentence = f"Credited limit with {named(name)}: Hs {between(Hs, highest(result))} for {seas}{of_wind_sea(result)}."
    return f"{sentence}{_ends(result, name)} {_mostly(result, name, CREDITED)}"


def _ends(result: PlanResult, name: str) -> str:
    """The low ends of the limits' 95 % intervals, and that the estimates count."""
    low = np.asarray(result.data["Hs_limit_low"].sel(credit=CREDITED, alternative=name).values, dtype=float)
    finite = np.isfinite(low)
    if not finite.any():
        return ""
    where = "" if finite.all() else f", in the {int(finite.sum())} of {finite.size} cells that have one"
    return f" The estimate counts; the low end of its 95 % interval is Hs {between(low, highest(result))}{where}."


def _mostly(result: PlanResult, name: str, credit: Credit) -> str:
    """What governs in the most cells."""
    cells = result.data.sel(credit=credit, alternative=name)
    pairs = zip(cells["governing_phase"].values.ravel(), cells["governing_rule"].values.ravel(), strict=True)
    counted = Counter((str(p), str(r)) for p, r in pairs if str(p))
    if not counted:
        return "Nothing governs below the highest sea state analysed."
    first = counted.most_common(NAMED)
    sentence = ", ".join(f"{governs(*pair)} ({n} of {cells['governing_phase'].size} cells)" for pair, n in first)
    return f"Governing: {sentence}{' and others' if len(counted) > NAMED else ''}."


def _twin(result: PlanResult, name: str) -> str:
    if not any(a.value == name and a.twin for a in result.alternatives):
        return "No twin is part of this limit."
    if not set(result.facts["tiers"]) & set(RUN):
        return "Not simulated: these limits follow the simplified method of DNV-RP-N103, credited with 80 %."
    if not differs(result, name):
        return f"Simulated limits: the same ({_nothing_taken(result, name)})."
    certified = result.facts["crane"]["certificate"]
    label = "SYNTHETIC certificate" if (certified or {}).get("assumed") else "certificate"
    reason = f"the crane's {label} does not cover it" if certified else "the crane has no certificate of validation"
    return (
        f"Simulated limit (not creditable): Hs {between(limits(result, TWIN, name), highest(result))}."
        f" {_mostly(result, name, TWIN)} The difference is not credited: {reason}."
    )


def _nothing_taken(result: PlanResult, name: str) -> str:
    """Reason why credit does not reduce the limits of a twin."""
    followed = {str(p["name"]) for p in result.facts["phases"] if p["compensated"]}
    if not followed:
        return "no phase is compensated: there is no compensation to credit"
    phases = {
        str(p) for p in result.data["governing_phase"].sel(credit=TWIN, alternative=name).values.ravel() if str(p)
    }
    if not phases & followed:
        return "the governing phases are not compensated: there is nothing to credit"
    share = result.data["inside"].sel(alternative=name, phase=sorted(phases & followed)).values
    return (
        "the crane's certificate covers the governing phases"
        if np.nanmin(share) == 1.0
        else "credit does not reduce the governing limits"
    )


def _operation(result: PlanResult, name: str) -> str:
    op, cells = result.facts["operation"], result.data.sel(credit=CREDITED, alternative=name)
    contingency = "T_C not assessed, so T_R is twice T_POP" if op["T_C"] is None else f"T_C {hours(op['T_C'])}"
    restricted = (
        "weather restricted"
        if op["weather_restricted"]
        else "not weather restricted: alpha does not apply, design for extreme conditions"
    )
    alpha, op_wf = cells["alpha"].values, cells["op_wf"].values
    factors = alpha[np.isfinite(alpha)]
    summed = "" if op.get("T_POP_given", True) else " (not specified: sum of the phases)"
    sentence = f"T_POP {hours(op['T_POP'])}{summed}, {contingency}: T_R {hours(op['T_R'])}, {restricted}."
    if factors.size:
        ends = "" if factors.min() == factors.max() else f" to {factors.max():.2f}"
        sentence += (
            f" alpha {factors.min():.2f}{ends}: forecast limit OP_WF Hs {between(op_wf[np.isfinite(alpha)], math.inf)}."
        )
    if op["weather_restricted"] and len(factors) < alpha.size:
        missing = f"{alpha.size - len(factors)} of {alpha.size}"
        lowest = op.get("alpha_table", {}).get("Hs_lowest", LOWEST)
        sentence += (
            f" In {missing} cells the table has no alpha (OP_LIM below {lowest:g} m: case by case): no forecast limit"
            " applies there."
        )
    return sentence


def _waiting(result: PlanResult, name: str) -> str:
    block = result["weather"]
    cells = block.sel(credit=CREDITED, alternative=name, month=0)
    mark = "SYNTHETIC weather, " if block.attrs["synthetic"] else ""
    against = [o for o in references(block, result.facts["tiers"]) if o != name]
    won = [(o, float(cells["days_gained"].sel(over=o))) for o in against]
    gains = [f"{gain(cells, o)} over {OVER.get(o, o)}" for o, x in won if math.isfinite(x)]
    operability, mean, median, high = workable(cells)
    waited = f"mean {mean}, P50 {median}, P90 {high}; operability {operability}"
    tail = f" Vessel days gained each operation, credited: {', '.join(gains)}." if gains else ""
    tail += _flattered(result)
    if (part := float(block.attrs.get("outside", 0.0))) >= OUTSIDE:
        tail += (
            f" {percent(part)} of the records are outside the table's periods and headings and count as not workable."
        )
    step = float(block.attrs.get("step", HOUR))
    part = float(cells["n_censored"]) * step / HOUR / max(1.0, float(cells["n_hours"]))
    if part > CENSORED:
        tail += f" {percent(part)} of the starts find no window before the series ends: true waiting is longer."
    return f"Waiting for a window of {hours(block.attrs['T_R'])} ({mark}whole year): {waited}.{tail}"


def _flattered(result: PlanResult) -> str:
    """That limits without compensation which are below the table of forecast factors are compared by its lowest
    factor; empty where none are."""
    lowest = result.facts["operation"].get("alpha_table", {}).get("Hs_lowest", LOWEST)
    if NONE not in names(result.data):
        return ""
    Hs = limits(result, CREDITED, NONE)
    below = int(((Hs > 0.0) & (Hs < lowest)).sum())
    reason = f"below {lowest:g} m there is no alpha, and that of {lowest:g} m is used"
    cells = f"{below} of {Hs.size} cells ({reason})"
    sentence = f" Without compensation the waiting is optimistic in {cells}: gains over it are at least these."
    return sentence if below else ""


def _limits(result: PlanResult, name: str) -> Table:
    """The table that the operation is run by: OP_LIM of every heading and period; at the worst heading what governs,
    its 95 % interval where the twin was run, and OP_WF; the twin's own answer where it is another."""
    data, top = result.data, highest(result)
    credited, twin = (limits(result, credit, name) for credit in (CREDITED, TWIN))
    rows = few(data.sizes["period"], PERIODS)
    at, at_twin = worst_heading(credited), worst_heading(twin)
    columns = {"Tp": [f"{data['period'].values[k]:g} s" for k in rows]}
    columns |= _by_heading(result, credited, rows)
    bold = range(1, len(columns))
    intervals = [_interval(result, name, at[k], k) for k in rows]
    columns |= {"95 %": intervals} if any(" to " in each for each in intervals) else {}
    columns["governs (worst heading)"] = [_governing_text(result, CREDITED, name, at[k], k) for k in rows]
    for title, key in (("alpha", "alpha"), ("OP_WF", "op_wf")):
        values = data[key].sel(credit=CREDITED, alternative=name).values
        open_ = OUTSIDE_ALPHA if key == "alpha" else fixed(math.nan, 2)
        columns[title] = [
            open_ if _case_by_case(result, float(credited[at[k], k])) else fixed(float(values[at[k], k]), 2)
            for k in rows
        ]
    if differs(result, name):
        columns["twin"] = [height(float(twin[at_twin[k], k]), top) for k in rows]
        columns["governs by the twin"] = [_governing_text(result, TWIN, name, at_twin[k], k) for k in rows]
    title = (
        f"OP_LIM with {named(name)}, credited: limiting Hs [m]{of_wind_sea(result)} by peak period and direction of the"
        " waves; OP_WF [m] at the worst heading"
    )
    return Table(tuple(columns), list(zip(*columns.values(), strict=True)), title, bold_columns=bold)


NO_INTERVAL = {"closed-form": "closed form", "frequency": "frequency domain", "time": "end of certificate"}
"""What stands where a limit has no interval: its method; of runs, the highest sea that the certificate covers."""
OUTSIDE_ALPHA = "case by case"
"""Stands for alpha where a limit is below the table of forecast factors."""


def _case_by_case(result: PlanResult, Hs: float) -> bool:
    """Whether a limit [m] is below the table of forecast factors."""
    op = result.facts["operation"]
    return bool(op["weather_restricted"]) and 0.0 < Hs < op.get("alpha_table", {}).get("Hs_lowest", LOWEST)


def _by_heading(result: PlanResult, Hs: FloatArray, rows: list[int]) -> dict[str, list[str]]:
    """A column for every heading; of many headings the best and the worst of each period, each with its heading."""
    beta, top = result.data["heading"].values, highest(result)
    if len(beta) <= HEADINGS:
        return {direction(beta[i]): [height(float(Hs[i, k]), top) for k in rows] for i in range(len(beta))}
    best = [int(i) for i in np.where(np.isnan(Hs), -1.0, Hs).argmax(axis=0)]
    return {
        title: [f"{height(float(Hs[at[k], k]), top)} ({direction(beta[at[k]])})" for k in rows]
        for title, at in (("best heading", best), ("worst heading", worst_heading(Hs)))
    }


def _interval(result: PlanResult, name: str, i: int, k: int) -> str:
    """The 95 % interval of a credited limit; where it has none, the method that gives the limit in its place."""
    cells = result.data.sel(credit=CREDITED, alternative=name).isel(heading=i, period=k)
    ends = [float(cells[key]) for key in ("Hs_limit_low", "Hs_limit_high")]
    if any(map(math.isnan, ends)):
        return NO_INTERVAL.get(str(cells["governing_tier"].item()), "-")
    low, high = (height(x, highest(result)) for x in ends)
    return f"{low} to {high}"


def _governing_text(result: PlanResult, credit: Credit, name: str, i: int, k: int) -> str:
    cells = result.data.sel(credit=credit, alternative=name).isel(heading=i, period=k)
    return governs(str(cells["governing_phase"].item()), str(cells["governing_rule"].item()))


def _side_by_side(result: PlanResult) -> Table:
    """All alternatives at the worst heading, credited; the twin's own answer where it is another."""
    data, top = result.data, highest(result)
    rows = few(data.sizes["period"], PERIODS)
    waiting = "weather" in result
    head = ["Tp [s]", *(f"{data['period'].values[k]:g}" for k in rows), *(("work", "wait") if waiting else ())]
    body = []
    for name in names(data):
        for label, credit in lines_of(result, name):
            Hs = least(limits(result, credit, name))
            body.append([label, *(height(float(Hs[k]), top) for k in rows)])
            if waiting:
                cells = result["weather"].sel(credit=credit, alternative=name, month=0)
                body[-1] += workable(cells)[:2]
    title = (
        f"All alternatives, worst heading: OP_LIM [m]{of_wind_sea(result)}, credited; a second line where the twin says"
        " otherwise"
    )
    tail = "; operability and mean waiting over the year" if waiting else ""
    return Table(head, merged(body, result), title + tail)


def _conditions(result: PlanResult) -> list[Part]:
    crane, payload, place = (result.facts[key] for key in ("crane", "payload", "place"))
    settings = result.facts["settings"]
    waves = {"jonswap": "JONSWAP", "pm": "Pierson-Moskowitz", "torsethaugen": "Torsethaugen"}[settings["wave"]]
    by_rule = ", gamma by Tp and Hs" if waves == "JONSWAP" else ""
    peak = f", gamma {settings['gamma']:g}" if settings["gamma"] else by_rule
    spread = f"spreading cos^{settings['spread']:g}" if settings["spread"] else "long-crested"
    mass = fmt(payload["mass"], "mass")
    rows = [
        ("lift", f"{payload['name']}, {mass} in air, to {place['depth']:g} m of water"),
        ("crane, vessel", f"{crane['name']}; {place['text']}"),
        ("seas", f"{waves}{peak}, {spread}"),
        *([("limits", of_wind_sea(result).removeprefix(", "))] if of_wind_sea(result) else []),
        ("reading", reading(result)),
        ("credit", crane["twin"]),
        *(("note", note) for note in result.facts["notes"]),
    ]
    return [
        Text("Conditions. Wind, current and what the last section names are not part of these limits."),
        facts(rows),
    ]
