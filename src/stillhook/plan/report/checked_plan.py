"""What a plan requests, before anything is run: phases, times, seas, and rules with their limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from stillhook.report.document import Document, Part, Table, Text
from stillhook.report.formatting import fixed, fmt, hours, variable

PHASES = ("phase", "kind", "winch", "underside\nfrom", "to", "speed", "duration", "tension\nat rest", "natural\nperiod")
LIMITS = ("rule", "quantity", "phases", "under", "limit", "of what")


def checked_plan(answer: dict[str, Any]) -> Document:
    """answer: of `stillhook.plan.check.checked`."""
    rules = answer["rules"]
    parts: list[Part] = [Table(PHASES, [_phase(row) for row in answer["phases"]]), Text(_times(answer))]
    parts.append(Text(_seas(answer)))
    if answer["weather"] is not None:
        parts.append(Text(_weather_of(answer["weather"])))
    if answer["resonance"]:
        where = ", ".join(f"{row['T']:.4g} s at {fmt(-row['z'], 'length')}" for row in answer["resonance"])
        parts.append(Text(f"the load on its wire is in resonance with peak periods of {where} depth"))
    parts.append(Table(LIMITS, _rules(answer), f"{rules['name']} version {rules['version']}"))
    parts += [Text(line) for line in (*rules["changes"], *answer["notes"])]
    subject = f"{answer['crane']} on {answer['vessel']}, {answer['payload']}, {fmt(answer['depth'], 'length')} deep"
    return Document(answer["name"], name=subject, front=parts)


def _phase(row: dict[str, Any]) -> list[str]:
    return [
        row["name"],
        row["kind"],
        row["mode"],
        *(fmt(row[key], "length") for key in ("start", "end")),
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
    steep = f"; {seas['steep']} of them steeper than wind raises waves (DNV-RP-C205)" if seas["steep"] else ""
    return (
        f"{count} seas: Hs {Hs[0]:g} to {Hs[1]:g} m, Tp {Tp[0]:g} to {Tp[1]:g} s, travelling {headings} deg from the"
        f" bow{steep}"
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


def _rules(answer: dict[str, Any]) -> list[list[str]]:
    """A row for each rule and limit, with the phases and alternatives in which it is so."""
    rows_by_limit: dict[tuple[str, str, str, str], dict[str, list[str]]] = {}
    for at in answer["limits"]:
        for rule in at["rules"]:
            limit = _limit(rule["quantity"], rule["limit"])
            row = rows_by_limit.setdefault((rule["rule"], rule["quantity"], limit, rule["basis"]), {})
            row.setdefault(at["phase"], []).append(at["alternative"])
    order = {row["key"]: i for i, row in enumerate(answer["rules"]["rows"])}
    phases, alternatives = [row["name"] for row in answer["phases"]], answer["alternatives"]
    rows = []
    for (key, quantity, limit, basis), where in sorted(rows_by_limit.items(), key=lambda item: order[item[0][0]]):
        for under in dict.fromkeys(tuple(names) for names in where.values()):
            of_phases = [phase for phase, names in where.items() if tuple(names) == under]
            rows.append(
                [key, quantity, _names_or_all(of_phases, phases), _names_or_all(under, alternatives), limit, basis]
            )
    return rows


def _limit(quantity: str, limit: Any) -> str:
    return limit if isinstance(limit, str) else variable(quantity, limit)


def _names_or_all(names: Sequence[str], everything: Sequence[str]) -> str:
    return "all" if len(names) == len(everything) > 1 else ", ".join(names)
