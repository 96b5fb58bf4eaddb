"""`stillhook plan --check`: what a plan asks, in tables, before anything is run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from stillhook.report.running_text import wrapped
from stillhook.report.terminal import human, print_json, print_table, unit_of

if TYPE_CHECKING:
    from stillhook.plan.definition.lift_plan import LiftPlan

PHASES = ("phase", "kind", "winch", "underside\nfrom", "to", "speed", "duration", "tension\nat rest", "natural\nperiod")
LIMITS = ("rule", "quantity", "phases", "under", "limit", "of what")


def print_check(plan: LiftPlan, json: bool) -> None:
    """Phases, times, seas and rules with their limits; with json the same as plain data in SI."""
    from stillhook.plan.check import checked

    answer = checked(plan)
    if json:
        print_json(answer)
        return
    wrapped(
        f"{answer['name']}: {answer['crane']} on {answer['vessel']}, {answer['payload']},"
        f" {_text(answer['depth'], 'length')} deep"
    )
    print_table(PHASES, [_phase(row) for row in answer["phases"]], left=3)
    print(_times(answer))
    print(_seas(answer))
    if answer["weather"] is not None:
        wrapped(_weather(answer["weather"]))
    if answer["resonance"]:
        where = ", ".join(f"{row['T']:.4g} s at {_text(-row['z'], 'length')}" for row in answer["resonance"])
        print(f"the load on its wire is in resonance with peak periods of {where} depth")
    rules = answer["rules"]
    print_table(LIMITS, _rules(answer), left=4, texts={5}, title=f"{rules['name']} version {rules['version']}")
    for line in (*rules["changes"], *answer["notes"]):
        wrapped(line)


def _text(value: float, kind: str) -> str:
    from stillhook.units import show

    return show(value, kind)


def _phase(row: dict[str, Any]) -> list[str]:
    speed = "-" if row["speed"] is None else _text(row["speed"], "speed")
    period = "-" if math.isnan(row["T_0"]) else f"{row['T_0']:.2f} s"
    ends = [_text(row[key], "length") for key in ("start", "end")]
    return [
        row["name"],
        row["kind"],
        row["mode"],
        *ends,
        speed,
        f"{row['duration'] / 60.0:.1f} min",
        _text(row["F_top_static"], "force"),
        period,
    ]


def _times(answer: dict[str, Any]) -> str:
    hours = {
        key: "not assessed" if answer[key] is None else f"{answer[key] / 3600.0:.3g} h"
        for key in ("T_phases", "T_POP", "T_C", "T_R")
    }
    restricted = "weather restricted" if answer["weather_restricted"] else "not weather restricted"
    return f"phases {hours['T_phases']}, T_POP {hours['T_POP']}, T_C {hours['T_C']}, T_R {hours['T_R']}: {restricted}"


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


def _weather(weather: dict[str, Any]) -> str:
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
            limit = f"{human(rule['quantity'], rule['limit'], 4)} {unit_of(rule['quantity'])}".rstrip()
            row = rows_by_limit.setdefault((rule["rule"], rule["quantity"], limit, rule["basis"]), {})
            row.setdefault(at["phase"], []).append(at["alternative"])
    order = {row["key"]: i for i, row in enumerate(answer["rules"]["rows"])}
    phases, alternatives = [row["name"] for row in answer["phases"]], answer["alternatives"]
    rows = []
    for (key, quantity, limit, basis), where in sorted(rows_by_limit.items(), key=lambda item: order[item[0][0]]):
        for under in dict.fromkeys(tuple(names) for names in where.values()):
            of_phases = [phase for phase, names in where.items() if tuple(names) == under]
            rows.append([key, quantity, _some(of_phases, phases), _some(under, alternatives), limit, basis])
    return rows


def _some(names: Sequence[str], everything: Sequence[str]) -> str:
    return "all" if len(names) == len(everything) > 1 else ", ".join(names)
