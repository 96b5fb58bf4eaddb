"""The section on weights and rigging of a plan's report, and its sheet for Excel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from stillhook.formats.table.workbook import Sheet
from stillhook.physics.scalar import G
from stillhook.plan.definition.rules import Alternative
from stillhook.report.document import Bullets, Part, Section, Table, Text, Verdict, facts
from stillhook.report.formatting import EMPTY, direction, fmt, percent
from stillhook.spec.lift.rigging import Carrier
from stillhook.units import number

TITLE = "Weights and rigging"
AT_LIMIT = 1.02
"""Part of a capacity that is used in a sea whose limit is read between two heights, where it may be all of it."""
CARRIERS = {
    Carrier.OWN_DECK.value: "the deck of the crane vessel",
    Carrier.VESSEL.value: "another vessel",
    Carrier.ONSHORE.value: "onshore",
}
SHEET = (
    *("item", "kind", "WLL [t]", "MBL [t]", "factor [1]", "dynamic [1]"),
    *("dynamic load [kN]", "utilisation [1]", "source"),
)


def parts(result: Mapping[str, Any]) -> Sequence[Part]:
    """The section, from the facts of a result."""
    of = result["rigging"]
    return [*_weight(of), *_hook_load(of), *_cases(of["cases"]), *_legs(of["legs"])]


def _weight(of: Mapping[str, Any]) -> list[Part]:
    w = of["weight"]
    if w is None:
        mass = fmt(of["SHL"], "mass")
        text = (
            f"The plan gives no [weight] and no mass of the rigging: {mass}, the payload's mass, is the static hook"
            " load, without contingency, rigging and a low case. Not for approval as it is."
        )
        return [Section("Weight build-up", [Text(text)])]
    rows = [
        ("net weight W", fmt(w["net"], "mass")),
        ("contingency factor c", fmt(w["contingency"])),
        ("design weight W c", fmt(w["design"], "mass")),
        ("rigging W_r, in air and submerged", f"{fmt(w['rigging'], 'mass')}, {fmt(w['rigging_submerged'], 'mass')}"),
        ("added weight and trapped water W_add", f"{fmt(w['added'], 'mass')}, {fmt(w['trapped'], 'mass')}"),
        ("static hook load SHL = W c + W_r + W_add", f"{fmt(w['SHL'], 'mass')}, {fmt(w['SHL'] * G, 'force')}"),
        ("high case, submerged", f"{fmt(w['submerged_high'], 'mass')}, {fmt(w['submerged_high'] * G, 'force')}"),
        (f"low case in air, {fmt(w['low_factor'])} W, no rigging", fmt(w["low_air"], "mass")),
        ("low case, submerged", f"{fmt(w['submerged_low'], 'mass')}, {fmt(w['submerged_low'] * G, 'force')}"),
        ("displaced volume, least and largest", ", ".join(f"{number(v)} m^3" for v in w["volumes"])),
        ("centre of gravity within", "not stated" if w["cog_box"] is None else _box(w["cog_box"])),
        (
            "source",
            w["source"] if w["stated"] else "[weight] is not given: no contingency, no low case but the net weight",
        ),
    ]
    return [Section("Weight build-up", [facts(rows)])]


def _box(box: Sequence[float]) -> str:
    return f"{' by '.join(fmt(side, 'length') for side in box)}, about its nominal place"


LOADS = (
    *("phase", "in", "static, low", "static, high", "DAF", "dynamic", "at the tip", "capacity", "used"),
    *("sea of the DAF", "by"),
)


def _hook_load(of: Mapping[str, Any]) -> list[Part]:
    rows = [
        [
            row["phase"],
            row["medium"],
            *(_kN(row[key]) for key in ("static_low", "static_high")),
            fmt(row["DAF"], digits=3),
            *(_kN(row[key]) for key in ("dynamic", "F_top", "capacity")),
            percent(row["utilisation"]),
            *_place(row["from"]),
        ]
        for row in of["hook_loads"]
    ]
    carrier = CARRIERS[of["carrier"]]
    by = "stated" if of["DAF_air_stated"] else f"by 0027/ND Rev 11 table 5-1 for a lift from {carrier}"
    text = (
        "In the seas of the claimable limit, of the alternative that leads and of the flat cap, by the highest tier."
        " DAF is the largest sling tension over SHL, in water too. Its design value in air is"
        f" {of['DAF_air']:.3f}, {by}: {fmt(of['SHL'] * G * of['DAF_air'], 'force')}."
        " Static is below the hook; tension at the tip has hook and wire in it."
    )
    bases = dict.fromkeys(row["capacity_basis"] for row in of["hook_loads"] if row["capacity_basis"])
    lines = [f"Capacity: {basis}." for basis in bases]
    if any(1.0 < (row["utilisation"] or 0.0) <= AT_LIMIT for row in of["hook_loads"]):
        lines.append(
            f"Up to {percent(AT_LIMIT)} used is all of the capacity, at the limit: that is read between two heights of"
            " runs."
        )
    capacities = Bullets(lines)
    return [Section("Hook load by phase", [Text(text), Table(LOADS, rows, "Loads [kN]"), capacities])]


def _kN(value: float | None) -> str:
    return EMPTY if value is None or math.isnan(value) else f"{value / 1e3:.0f}"


def _place(source: Mapping[str, Any] | None) -> tuple[str, str]:
    if source is None:
        return EMPTY, EMPTY
    sea = f"{source['Hs']:.2f} m, {source['Tp']:g} s, {direction(source['beta'])}"
    return sea, f"{source['tier']}, {Alternative(source['alternative']).label}"


def _cases(cases: Mapping[str, Any]) -> list[Part]:
    if not cases["two"]:
        return []
    lines = [
        "Every rule is judged for both cases by closed form and frequency-domain method, as far as these were run; of"
        " both limits the lower counts. The winch's error is that of the high case.",
    ]
    if "time" in cases["tiers"]:
        lines.append(
            "Runs of the twin are of the high case; slack slings and snap loads were run of the low case as well,"
            f" wherever it may govern below all other limits ({cases['runs_low']} runs). Weather by records, sweeps and"
            " single cells are of the high case."
        )
    low: dict[tuple[str, str, str], list[int]] = {}
    for row in cases["low_governs"]:
        counts = low.setdefault((row["rule"], row["phase"], row["tier"]), [0, 0])
        counts[0], counts[1] = counts[0] + row["n"], counts[1] + row["of"]
    table = [[rule.replace("-", " "), phase, tier, f"{n} of {of}"] for (rule, phase, tier), (n, of) in low.items()]
    head = ("rule", "phase", "tier", "limits of the low case")
    return [Section("Low and high weight case", [Bullets(lines), *([Table(head, table)] if table else [])])]


def _legs(legs: Mapping[str, Any] | None) -> list[Part]:
    if legs is None:
        text = "The plan gives no legs in [rigging]: slings, shackles and lift points are not assessed."
        return [Section("Slings and lift points", [Text(text)])]
    angles = sorted({fmt(angle, "angle", 3) for angle in legs["angles"]})
    base = ", evenly about the hook (assumed)" if legs["even"] else ""
    skew = (
        "stated"
        if legs["skew_stated"]
        else "determinate"
        if legs["skew"] == 1.0
        else "indeterminate, 0027/ND section 5.6"
    )
    box = (
        "not stated: no shift"
        if legs["cog_box"] is None
        else f"{_box(legs['cog_box'])}, {fmt(legs['cog_below'], 'length')} below the lift points (assumed)"
    )
    rows = [
        ("legs", f"{legs['n']}, {' and '.join(angles)} to the horizontal{base}"),
        ("skew load factor", f"{legs['skew']:g}, {skew}"),
        ("centre of gravity", box),
        ("tilt", fmt(legs["tilt"], "angle", 3)),
        ("dynamic hook load", f"{fmt(legs['DHL'], 'force')}, {legs['phase'] or 'SHL times the design DAF'}"),
        ("tension of a leg, centred", fmt(legs["T_even"], "force")),
        ("largest tension, worst corner and tilt", fmt(legs["T_max"], "force")),
        ("tension of every leg there", ", ".join(fmt(T, "force", 3) for T in legs["T"])),
        ("source", legs["source"]),
    ]
    section: list[Part] = [facts(rows)]
    if legs["slack"]:
        section.append(Verdict("A leg is slack with the centre of gravity in a corner of its box", passed=False))
    items = [
        [
            item["name"],
            item["kind"],
            _kN(item["load"]),
            _kN(item["WLL"]),
            _kN(item["MBL"]),
            fmt(item["factor"]),
            _used(item["utilisation"]),
        ]
        for item in legs["items"]
    ]
    if items:
        head = ("item", "kind", "dynamic load\n[kN]", "WLL [kN]", "MBL [kN]", "factor", "utilisation")
        section.append(Table(head, items))
        section.append(
            Text(
                f"Largest utilisation: {legs['worst']['name']}, {percent(legs['worst']['utilisation'])}."
                " A WLL is compared with the dynamic load over the dynamic factor that its certificate covers."
            )
        )
    else:
        section.append(Text("No items are given: strength of slings, shackles and lift points is not assessed."))
    return [Section("Slings and lift points", section)]


def _used(share: float) -> Verdict:
    return Verdict(percent(share), passed=share <= 1.0)


def rigging_sheet(result: Mapping[str, Any]) -> Sheet | None:
    """Items as a sheet that `[rigging] items` reads again; None without items. result: facts of a result."""
    legs = (result.get("rigging") or {}).get("legs")
    if legs is None or not legs["items"]:
        return None
    rows = [
        (
            *(item["name"], item["kind"], _tonnes(item["WLL"]), _tonnes(item["MBL"]), item["factor"], item["dynamic"]),
            *(round(item["load"] / 1e3, 1), round(item["utilisation"], 4), item["source"]),
        )
        for item in legs["items"]
    ]
    loads = f"dynamic hook load {fmt(legs['DHL'], 'force')}, largest tension of a leg {fmt(legs['T_max'], 'force')}"
    remark = f"{result['name']}: {legs['n']} legs, {loads}"
    return Sheet("rigging", SHEET, rows, (remark,))


def _tonnes(load: float | None) -> float | None:
    return None if load is None else round(load / G / 1e3, 4)
