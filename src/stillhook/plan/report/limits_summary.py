"""The limits of a plan in sentences and tables, as credited and as simulated: in which weather the lift may be done,
what limits it, and on which conditions."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.report.figures import STEEP
from stillhook.plan.report.words import (
    CREDITED,
    OVER,
    SYNTHETIC_LINE,
    TEXTS,
    TWIN,
    between,
    differs,
    few,
    gain,
    governing_of,
    governs,
    height,
    highest,
    in_air,
    leading,
    limits,
    lines_of,
    named,
    names,
    of_wind_sea,
    over,
    reading,
    sentence,
    signature_facts,
    untrusted,
    workable,
    worst_heading,
    write,
)
from stillhook.plan.result import Credit, PlanResult, merged, references
from stillhook.report.document import Grey, Part, Table, Text, Verdict, facts
from stillhook.report.formatting import HOUR, direction, fixed, hours
from stillhook.trust.standing import MEANING

RUN = ("frequency", "time")
"""Tiers that simulate."""
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
WAVES = {"jonswap": "JONSWAP", "pm": "Pierson-Moskowitz", "torsethaugen": "Torsethaugen"}


def verdict(result: PlanResult) -> Verdict:
    """The limits in a line, whether there is any workable sea, and what follows in sentences."""
    name = leading(result)
    credited = limits(result, result.claim, name)
    any_sea = bool((np.nan_to_num(credited) > 0.0).any())
    word = f"OP_LIM Hs {between(credited, highest(result))}" if any_sea else "NO WORKABLE SEA STATE"
    certificate = result.facts["crane"]["certificate"] or {}
    basis = [TEXTS["assumed_certificate"]] if certificate.get("assumed") else [MEANING] if certificate else []
    if untrusted(certificate):
        basis = [write(TEXTS["untrusted_certificate"], how=signature_facts(certificate)["statement"])]
    swings = [f"{sentence(each)}." for each in result.caused("oscillates")]
    sentences = [_credited(result, name), _twin(result, name), *swings, *basis, operation(result), *waiting(result)]
    return Verdict(word, any_sea, sentences)


def tables(result: PlanResult) -> list[Part]:
    """Limits of the leading alternative, all alternatives side by side, and the conditions."""
    return [limits_table(result), side_by_side(result), *_conditions(result)]


def alike(result: PlanResult) -> Text:
    """What stands in the place of a figure whose cells are all alike."""
    name = leading(result)
    claim = result.claim
    values = {"range": between(limits(result, claim, name), highest(result)), "governing": _mostly(result, name, claim)}
    return Text(_write("alike", name=named(name), credit=claim, **values))


def _write(key: str, **values: Any) -> str:
    """A sentence of the first page."""
    return write(TEXTS["front"][key], **values)


def _credited(result: PlanResult, name: str) -> str:
    """The credited limit, the low end of its interval where it has one, and what governs."""
    data, top = result.data, highest(result)
    text = _range(result, name)
    low = np.asarray(data["Hs_limit_low"].sel(credit=result.claim, alternative=name).values, dtype=float)
    finite = np.isfinite(low)
    if finite.any():
        where = "" if finite.all() else f", in the {int(finite.sum())} of {finite.size} cells that have one"
        text += _write("low_end", range=between(low, top), where=where)
    return f"{text} {_mostly(result, name, result.claim)}"


def _range(result: PlanResult, name: str) -> str:
    """The credited limit over the seas of the table."""
    data, Hs = result.data, between(limits(result, result.claim, name), highest(result))
    seas = f"Tp {over(data['period'].values, 'time')}, waves at {over(data['heading'].values, 'angle')}"
    return _write(result.claim, name=named(name), range=Hs, seas=seas, beside=of_wind_sea(result))


def _mostly(result: PlanResult, name: str, credit: Credit) -> str:
    """What governs in the most cells."""
    cells = result.data.sel(credit=credit, alternative=name)
    counted = Counter(of for of in governing_of(cells) if of[0] or of[-1] == STEEP)
    if not counted:
        return "Nothing governs below the highest sea state analysed."
    first = counted.most_common(NAMED)
    text = ", ".join(f"{governs(*of)} ({n} of {cells['governing_phase'].size} cells)" for of, n in first)
    return f"Governing: {text}{' and others' if len(counted) > NAMED else ''}."


def _twin(result: PlanResult, name: str, *, brief: bool = False) -> str:
    """The limit by the twin, and why it is not credited where it is another; brief: without what governs it."""
    if not any(a.value == name and a.twin for a in result.alternatives):
        return _write("no_twin")
    if not set(result.facts["tiers"]) & set(RUN):
        return _write("simplified")
    if not differs(result, name):
        return _write("same", reason=_write(_nothing_taken(result, name)))
    certified = result.facts["crane"]["certificate"]
    label = SYNTHETIC_LINE if (certified or {}).get("assumed") else "certificate"
    reason = f"the crane's {label} does not cover it" if certified else "the crane has no certificate of validation"
    reason = reason if result.claim == CREDITED else "the crane's certificate is SYNTHETIC"
    if untrusted(certified or {}):
        reason = f"the crane's certificate is {signature_facts(certified)['statement']}"
    own, governing = between(limits(result, TWIN, name), highest(result)), f" {_mostly(result, name, TWIN)}"
    return _write("simulated", range=own, governing="" if brief else governing, reason=reason)


def _nothing_taken(result: PlanResult, name: str) -> str:
    """Key of the reason why credit does not reduce the limits of a twin."""
    followed = {str(p["name"]) for p in result.facts["phases"] if p["compensated"]}
    if not followed:
        return "nothing_to_credit"
    phases = set(map(str, result.data["governing_phase"].sel(credit=TWIN, alternative=name).values.ravel()))
    if not phases & followed:
        return "not_governing"
    share = result.data["inside"].sel(alternative=name, phase=sorted(phases & followed)).values
    return "covered" if np.nanmin(share) == 1.0 else "not_reduced"


def operation(result: PlanResult) -> str:
    """Times of the operation, and the forecast limit."""
    op, cells = result.facts["operation"], result.data.sel(credit=result.claim, alternative=leading(result))
    contingency = "T_C not assessed, so T_R is twice T_POP" if op["T_C"] is None else f"T_C {hours(op['T_C'])}"
    extreme = "not weather restricted: alpha does not apply, design for extreme conditions"
    restricted = "weather restricted" if op["weather_restricted"] else extreme
    summed = "" if op.get("T_POP_given", True) else " (not specified: sum of the phases)"
    times = {"T_POP": hours(op["T_POP"]), "T_R": hours(op["T_R"])}
    text = _write("times", summed=summed, contingency=contingency, restricted=restricted, **times)
    alpha, op_wf = cells["alpha"].values, cells["op_wf"].values
    factors = alpha[np.isfinite(alpha)]
    if factors.size:
        ends = dict.fromkeys(f"{x:.2f}" for x in (factors.min(), factors.max()))
        text += _write("alpha", alpha=" to ".join(ends), range=between(op_wf[np.isfinite(alpha)], math.inf))
    if op["weather_restricted"] and len(factors) < alpha.size:
        text += _write("no_alpha", n=alpha.size - len(factors), of=alpha.size, lowest=_lowest(result))
    return text


def _lowest(result: PlanResult) -> float:
    """Lowest height of the table of forecast factors [m]."""
    return float(result.facts["operation"].get("alpha_table", {}).get("Hs_lowest", LOWEST))


def waiting(result: PlanResult, *, brief: bool = False) -> list[str]:
    """Waiting, operability and gains with the leading alternative by what may be claimed, and by what is credited where
    that is more; nothing without weather. brief: without what the numbers leave out, both in a sentence."""
    if "weather" not in result:
        return []
    name, claim = leading(result), result.claim
    if not differs(result, name, CREDITED):
        return [_waiting(result, name, claim, brief=brief)]
    if brief:
        year = result["weather"].sel(alternative=name, month=0)
        ends = {credit: workable(year.sel(credit=credit))[2:] for credit in (claim, CREDITED)}
        return [_write("waiting_both", claim=ends[claim], real=ends[CREDITED], **_window(result))]
    credited = _write("if_real", waiting=_waiting(result, name, CREDITED, brief=True))
    return [_waiting(result, name, claim, brief=False), credited]


def _window(result: PlanResult) -> dict[str, str]:
    """The window that is waited for, and a mark of SYNTHETIC weather."""
    attrs = result["weather"].attrs
    mark = "SYNTHETIC weather, " if attrs["synthetic"] else ""
    return {"window": hours(attrs.get("window", attrs["T_R"])), "mark": mark}


def _waiting(result: PlanResult, name: str, credit: Credit, *, brief: bool) -> str:
    """Waiting and operability of the whole year under a credit, what is gained, and what the numbers leave out; brief:
    without the last."""
    block = result["weather"]
    cells = block.sel(credit=credit, alternative=name, month=0)
    operability, mean, median, high = workable(cells)
    waits = {"mean": mean, "median": median, "high": high, "operability": operability}
    text = _write("waiting", **_window(result), **waits)
    against = [o for o in references(block, result.facts["tiers"]) if o != name]
    won = [o for o in against if math.isfinite(float(cells["days_gained"].sel(over=o)))]
    text += (
        _write("gains", credit=credit, gains=[f"{gain(cells, o)} over {OVER.get(o, o)}" for o in won]) if won else ""
    )
    if brief:
        return text
    if NONE in names(result.data):
        Hs, lowest = limits(result, credit, NONE), _lowest(result)
        below = int(((Hs > 0.0) & (Hs < lowest)).sum())
        text += _write("no_factor", n=below, of=Hs.size, lowest=lowest) if below else ""
    outside, step = float(block.attrs.get("outside", 0.0)), float(block.attrs.get("step", HOUR))
    text += _write("outside", share=outside) if outside >= OUTSIDE else ""
    censored = float(cells["n_censored"]) * step / HOUR / max(1.0, float(cells["n_hours"]))
    return text + (_write("censored", share=censored) if censored > CENSORED else "")


def limits_table(result: PlanResult, *, simulated: bool = True) -> Table:
    """The table that the operation is run by: OP_LIM of every heading and period; at the worst heading what governs,
    its 95 % interval where the twin was run, and OP_WF; simulated: also the twin's own answer where it is another."""
    data, top, name = result.data, highest(result), leading(result)
    credited, twin = (limits(result, credit, name) for credit in (result.claim, TWIN))
    rows = few(data.sizes["period"], PERIODS)
    at, at_twin = worst_heading(credited), worst_heading(twin)
    columns: dict[str, list[str]] = {"Tp": [f"{data['period'].values[k]:g} s" for k in rows]}
    columns |= _by_heading(result, credited, rows)
    bold = range(1, len(columns))
    intervals = [_interval(result, name, at[k], k) for k in rows]
    columns |= {"95 %": intervals} if any(" to " in each for each in intervals) else {}
    columns["governs (worst heading)"] = [_governing_text(result, result.claim, name, at[k], k) for k in rows]
    for title, key in (("alpha", "alpha"), ("OP_WF", "op_wf")):
        values = data[key].sel(credit=result.claim, alternative=name).values
        open_ = OUTSIDE_ALPHA if key == "alpha" else fixed(math.nan, 2)
        columns[title] = [
            open_ if _case_by_case(result, float(credited[at[k], k])) else fixed(float(values[at[k], k]), 2)
            for k in rows
        ]
    if simulated and differs(result, name):
        columns["twin"] = [height(float(twin[at_twin[k], k]), top) for k in rows]
        columns["governs by the twin"] = [_governing_text(result, TWIN, name, at_twin[k], k) for k in rows]
    of = f"{named(name)}, {result.claim}: limiting Hs [m]{of_wind_sea(result)}"
    title = f"OP_LIM with {of}; OP_WF [m] at the worst heading"
    return Table(tuple(columns), list(zip(*columns.values(), strict=True)), title, bold_columns=bold)


NO_INTERVAL = {"closed-form": "closed form", "frequency": "frequency domain"}
"""What stands where a limit has no interval: its method."""
OUTSIDE_ALPHA = "case by case"
"""Stands for alpha where a limit is below the table of forecast factors."""


def _case_by_case(result: PlanResult, Hs: float) -> bool:
    """Whether a limit [m] is below the table of forecast factors."""
    return bool(result.facts["operation"]["weather_restricted"]) and 0.0 < Hs < _lowest(result)


def _by_heading(result: PlanResult, Hs: FloatArray, rows: list[int]) -> dict[str, list[str]]:
    """A column for every heading; of many headings the best and the worst of each period, each with its heading."""
    beta, top = result.data["heading"].values, highest(result)
    if len(beta) <= HEADINGS:
        steep = steepest_of(result, result.claim, leading(result))
        return {direction(beta[i]): [cell(float(Hs[i, k]), top, steep[i, k]) for k in rows] for i in range(len(beta))}
    best = [int(i) for i in np.where(np.isnan(Hs), -1.0, Hs).argmax(axis=0)]
    return {
        title: [f"{height(float(Hs[at[k], k]), top)} ({direction(beta[at[k]])})" for k in rows]
        for title, at in (("best heading", best), ("worst heading", worst_heading(Hs)))
    }


def steepest_of(result: PlanResult, credit: Credit, name: str) -> BoolArray:
    """Which limits (heading, period) are cut at the steepest sea of their period."""
    cells = result.data.sel(credit=credit, alternative=name)
    return np.array([end == STEEP for _, _, end in governing_of(cells)]).reshape(cells["Hs_limit"].shape)


def cell(Hs: float, top: float, steep: bool) -> str:
    """A limit in a table, grey where it is cut at the steepest sea."""
    return Grey(height(Hs, top)) if steep else height(Hs, top)


def _interval(result: PlanResult, name: str, i: int, k: int) -> str:
    """The 95 % interval of a credited limit; where it has none, the method that gives the limit in its place."""
    cells = result.data.sel(credit=result.claim, alternative=name).isel(heading=i, period=k)
    ends = [float(cells[key]) for key in ("Hs_limit_low", "Hs_limit_high")]
    if any(map(math.isnan, ends)):
        return NO_INTERVAL.get(str(cells["governing_tier"].item()), "-")
    low, high = (height(x, highest(result)) for x in ends)
    return f"{low} to {high}"


def _governing_text(result: PlanResult, credit: Credit, name: str, i: int, k: int) -> str:
    cells = result.data.sel(credit=credit, alternative=name).isel(heading=i, period=k)
    return governs(*governing_of(cells)[0])


def side_by_side(result: PlanResult) -> Table:
    """All alternatives at the worst heading, credited; the twin's own answer where it is another."""
    data, top = result.data, highest(result)
    rows = few(data.sizes["period"], PERIODS)
    waiting = "weather" in result
    head = ["Tp [s]", *(f"{data['period'].values[k]:g}" for k in rows), *(("work", "wait") if waiting else ())]
    body = []
    for name in names(data):
        for label, credit in lines_of(result, name):
            Hs = limits(result, credit, name)
            at, steep = worst_heading(Hs), steepest_of(result, credit, name)
            body.append([label, *(cell(float(Hs[at[k], k]), top, steep[at[k], k]) for k in rows)])
            if waiting:
                cells = result["weather"].sel(credit=credit, alternative=name, month=0)
                body[-1] += workable(cells)[:2]
    other = "the twin says" if result.claim == CREDITED else f"a {SYNTHETIC_LINE} or the twin say"
    title = (
        f"All alternatives, worst heading: OP_LIM [m]{of_wind_sea(result)}, {result.claim}; a second line where {other}"
        " otherwise"
    )
    tail = "; operability and mean waiting over the year" if waiting else ""
    return Table(head, merged(body, result), title + tail)


def _conditions(result: PlanResult) -> list[Part]:
    rows = basis_rows(result)
    rows.insert(-1 - len(result.facts["notes"]), ("reading", reading(result)))
    return [Text(_write("conditions")), facts(rows)]


def basis_rows(result: PlanResult) -> list[tuple[str, str]]:
    """Lift, machine, seas, credit and notes of the plan, a line each."""
    crane, payload, place = (result.facts[key] for key in ("crane", "payload", "place"))
    settings = result.facts["settings"]
    waves = WAVES[settings["wave"]]
    by_rule = ", gamma by Tp and Hs" if settings["wave"] == "jonswap" else ""
    peak = f", gamma {settings['gamma']:g}" if settings["gamma"] else by_rule
    spread = f"spreading cos^{settings['spread']:g}" if settings["spread"] else "long-crested"
    return [
        ("lift", f"{payload['name']}, {in_air(payload)}, to {place['depth']:g} m of water"),
        ("crane, vessel", f"{crane['name']}; {place['text']}"),
        ("seas", f"{waves}{peak}, {spread}"),
        *([("limits", of_wind_sea(result).removeprefix(", "))] if of_wind_sea(result) else []),
        ("credit", crane["twin"]),
        *(("note", note) for note in result.facts["notes"]),
    ]
