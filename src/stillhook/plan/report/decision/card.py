"""The limits card: one sheet for bridge, crane and ROV, as plain data and as parts of a document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stillhook.plan.report.decision.bands import NO_FACTOR, forecast, label, limit
from stillhook.plan.report.decision.data import claim_of, head
from stillhook.plan.report.decision.page import action_words, clipped, status, trip_assessed
from stillhook.plan.report.decision.status import status_of
from stillhook.plan.report.words import TEXTS, listed, valued, write
from stillhook.plan.result import PlanResult
from stillhook.report.document import Bullets, Part, Section, Table, Text
from stillhook.report.formatting import fixed, fmt, hours

WINDOW = 900.0
"""Time over which the motion unit at the tip takes its standard deviation [s]."""
STOPS = (
    ("dynamic-load", "hook load, high"),
    ("slack-sling", "sling load, low, share of that at rest"),
    ("off-lead", "off-lead"),
    ("side-lead", "side-lead"),
    ("control-error", "wire error, peak to peak in 30 s"),
    ("load-motion", "load motion, peak to peak in 30 s"),
    ("accumulator-stroke", "tip motion that meets the ends of the accumulator, peak to peak in 30 s"),
    ("peak-pressure", "pressure of the active circuit"),
    ("landing-speed", "speed at touch-down"),
)
"""Rules with a stop value that can be read on board, and what to call it there."""
HOLD_POINTS: Mapping[str, str] = {
    "lift-off": "before lift-off",
    "splash-zone": "before the wave zone",
    "landing": "before landing",
    "seabed-lift-off": "before lift-off from the seabed",
    "set-down": "before set-down",
}
"""Kinds of phases before which the lift is held until all is confirmed."""


def card(result: PlanResult) -> dict[str, Any]:
    """The card as data: the file card.json."""
    claim, own, plan = claim_of(result), result.facts.get("card"), result.facts
    parts = [
        part | {"bands": [band | _speed(own, part["name"], band) for band in part["bands"]]} for part in claim["parts"]
    ]
    return {
        "document": head(result),
        "status": status_of(result, claim["bands"]),
        "alternative": claim["alternative"],
        "start": {"T_R": plan["operation"]["T_R"], "bands": claim["bands"]},
        "parts": parts,
        "window": WINDOW,
        "stops": list(_stops(plan, claim["alternative"])),
        "ahc_lost": plan.get("failures"),
        "hold_points": list(_hold_points(plan["phases"])),
    }


def _speed(own: Mapping[str, Any] | None, part: str, band: Mapping[str, Any]) -> dict[str, Any]:
    """sigma_v of the tip [m/s] that stops a band, None where it does not protect: the lower of the periods in it."""
    rows = [] if own is None else own["tip_speed"].get(part, [])
    low, high = (band[key] for key in ("T_p_from", "T_p_to"))
    inside = [row for row in rows if (low is None or row["T_p"] >= low) and high is not None and row["T_p"] <= high]
    protects = bool(inside) and not band["no_go"] and all(row["protects"] for row in inside)
    return {"sigma_v": min(row["sigma_v"] for row in inside) if protects else None}


def _stops(plan: Mapping[str, Any], alternative: str | None) -> Iterator[dict[str, Any]]:
    """Stop values by the rules of the alternative: the strictest of all phases, and where it holds."""
    quantity = {row["key"]: (row["quantity"], row["sense"]) for row in plan["rules"]["rows"]}
    for rule, name in STOPS:
        rows = [r for r in plan["limited"] if r["rule"] == rule and r["alternative"] == alternative]
        if not rows or rule not in quantity:
            continue
        of, sense = quantity[rule]
        lowest = min(rows, key=lambda r: r["limit"]) if sense == "at-most" else max(rows, key=lambda r: r["limit"])
        phases = [r["phase"] for r in rows if r["limit"] == lowest["limit"]]
        yield {"rule": rule, "name": name, "quantity": of, "sense": sense, "limit": lowest["limit"]} | {
            "basis": lowest["basis"],
            "phases": phases,
            "all_phases": len(phases) == len(plan["phases"]),
            "by_Hs": lowest.get("by_Hs", []),
        }


def _hold_points(phases: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, str]]:
    """The first phase of each kind that begins with a hold point; a landing begins with its stand-off."""
    known: set[str] = set()
    for phase in phases:
        kind = "landing" if phase["kind"] == "stand-off" else phase["kind"]
        if kind in HOLD_POINTS and kind not in known:
            known.add(kind)
            yield {"point": HOLD_POINTS[kind], "phase": phase["name"]}


def card_parts(of: Mapping[str, Any]) -> list[Part]:
    """The sheet; of: `card`."""
    known = of["ahc_lost"] is not None and trip_assessed(of["ahc_lost"])
    lost: list[Part] = [_actions(of["ahc_lost"])] if known else [Text(TEXTS["card"]["no_failures"])]
    return [
        status(of["status"]),
        *_limits(of),
        Section(
            "Stop, and go to the safe state, at",
            [_stop_table(of["stops"], [name for part in of["parts"] for name in part["phases"]])],
        ),
        Section("If AHC trips, by depth", lost),
        Section("Hold points: continue only when all is confirmed", [Bullets(_confirmations(of))]),
    ]


def _limits(of: Mapping[str, Any]) -> list[Part]:
    """Forecast and measured heights of the whole lift and of each part, by Tp band; NO GO bands."""
    start = of["start"]["bands"]
    if not start:
        return [Text(TEXTS["card"]["no_claim"])]
    columns = {"Tp": [label(band) for band in start], "start:\nforecast": [forecast(band) for band in start]}
    for part in of["parts"]:
        columns[f"{part['name']}:\nforecast"] = [forecast(band) for band in part["bands"]]
        columns[f"{part['name']}:\nmeasured"] = [_measured(band) for band in part["bands"]]
        if any(band["sigma_v"] is not None for band in part["bands"]):
            columns[f"{part['name']}: tip\nspeed [m/s]"] = [fixed(band["sigma_v"], 3) for band in part["bands"]]
    phases = "; ".join(f"{part['name']}: {listed(part['phases'])}" for part in of["parts"])
    window = hours(of["start"]["T_R"])
    reading = write(TEXTS["card"]["reading"], T_R=window, minutes=of["window"] / 60.0, phases=clipped(phases, LONGEST))
    table = Table(tuple(columns), list(zip(*columns.values(), strict=True)), "Significant wave height Hs [m], at most")
    return [table, Text(reading)]


LONGEST = 260
"""Letters of the list of phases at most."""


def _measured(band: Mapping[str, Any]) -> str:
    """OP_LIM of a band, "NO GO" where there is none."""
    return "NO GO" if band["no_go"] and band["no_go"] != NO_FACTOR else limit(band)


def _where(stop: Mapping[str, Any], phases: Sequence[str]) -> str:
    """Phases of a stop value, or those that are left out where they are fewer."""
    if stop["all_phases"]:
        return "all"
    others = [name for name in phases if name not in stop["phases"]]
    if 0 < len(others) < len(stop["phases"]):
        return write(TEXTS["card"]["but"], phases=[listed(others)])
    return listed(stop["phases"])


def _stop_table(stops: Sequence[Mapping[str, Any]], phases: Sequence[str]) -> Table:
    rows = []
    for each in stops:
        sign = "above" if each["sense"] == "at-most" else "below"
        limits = [f"{valued(x['limit'], each['quantity'])} to Hs {fmt(x['Hs'], 'length')}" for x in each["by_Hs"]]
        limit = f"{sign} {', '.join(limits) or valued(each['limit'], each['quantity'])}"
        basis = (each["basis"] or "").rpartition(", of ")[2] if limits else each["basis"] or ""
        rows.append([each["name"], limit, clipped(_where(each, phases), PHASES), clipped(basis, BASIS)])
    return Table(("reading", "stop", "in", "by"), rows)


def _actions(lost: Mapping[str, Any]) -> Table:
    """What to do by depth where AHC is lost, from the top; the rows that take longest where there are too many."""
    rows = list(lost["actions"])
    while len(rows) > ACTIONS:
        rows.remove(min(rows, key=lambda row: float(row["time"] or 0.0)))
    body = []
    for row in rows:
        words = action_words(row)
        known = row["action"] != "not-assessed"
        time = "-" if not known else "at once" if not row["time"] else fmt(row["time"], "time", 2)
        body.append([words["phase"], words["depth"], words["action"], time])
    return Table(("phase", "depth of the underside", "action", "safe after"), body)


ACTIONS = 14
"""Bands of depth on the card at most."""
PHASES, BASIS = 60, 90
"""Letters of phases and of the basis of a stop value at most."""


def _confirmations(of: Mapping[str, Any]) -> list[str]:
    """A line for each hold point: what must be confirmed, by which column."""
    texts = TEXTS["hold_points"]
    values = {"T_R": hours(of["start"]["T_R"])}
    return [
        f"{each['point'][:1].upper()}{each['point'][1:]} ({clipped(each['phase'], PHASES)}): "
        f"{write(texts[each['point']], **values)}"
        for each in of["hold_points"]
    ]
