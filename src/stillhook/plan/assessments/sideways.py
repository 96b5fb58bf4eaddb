"""What moves a load sideways: where the current carries it, how the wind holds it, its natural periods as a pendulum
against the waves, and what of it uses up the load chart's off-lead and side-lead."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.capacities import (
    CAPACITIES,
    LEADS,
    at_rest,
    in_current,
    places,
    still_leads,
    wind_lead,
    wire_line,
)
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.limits import limited, limits_in, utilisation
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.sideways import chain_at
from stillhook.report.document import Part, Table, Text
from stillhook.report.formatting import EMPTY, fmt, percent
from stillhook.response.sideways import raised
from stillhook.spec.lift.joining import IN_AIR, UNDER_WATER
from stillhook.spec.lift.phase import Phase

NAME, TITLE, EXPECTED = "sideways", "Current, wind and swing of the load", 0.5
BAND = 0.6, 1.3
"""Periods of a sea about its peak period, parts of it, in which its waves have nearly all of their energy."""
FREQUENCIES = 400
PEAK = 1.0 / math.sqrt(2.0)
"""Damping, part of critical, from which on a mode has no peak."""
LINEAR = math.radians(10.0)
"""Lead up to which the pendulum is linear: the sine is then right to 0.5 %."""


def assess(state: PlanState, progress: Progress) -> dict[str, Any] | None:
    """Offsets, leads and periods by phase [SI], of the low weight case where there is one; None where the plan has
    neither current nor wind."""
    plan, env = state.plan, state.plan.environment
    if env.current is None and env.wind is None:
        return None
    light = plan.low or plan
    both = [(phase, z) for phase in plan.phases for z in places(phase)]
    wet = [(phase, z) for phase, z in both if phase.kind in UNDER_WATER]
    dry = [(phase, z) for phase, z in both if phase.kind in IN_AIR]
    result: dict[str, Any] = {"Tp": [min(env.Tp), max(env.Tp)], "low_case": plan.low is not None}
    if env.current is not None:
        rows = [_in_current(plan, light, *each) for each in wet]
        result["current"] = {"text": env.current.describe(), "clearance": env.current.clearance, "rows": rows}
    if env.wind is not None:
        result["wind"] = {"text": env.wind.describe(), "rows": [_in_wind(light, *each) for each in dry]}
    result["pendulum"] = [_pendulum(light, *each) for each in (*dry, *(wet if env.current is not None else ()))]
    leads = [row for phase in plan.phases for row in _leads(light, phase)]
    return result | {"leads": leads, "not_judged": [n for n in plan.notes if "NOT JUDGED" in n and "lead" in n]}


def _in_current(plan: LiftPlan, light: LiftPlan, phase: Phase, z: float) -> dict[str, Any]:
    """The wire at rest in the current with the underside at z [m]."""
    current, shape = light.environment.current, in_current(light, phase, z)
    assert current is not None
    line, F = wire_line(light, phase, z), in_current(plan, phase, z).tension
    capacity = CAPACITIES["SWL_tip"].find(plan, phase, Alternative.NONE)
    U, v = float(np.linalg.norm(current.velocity(line.z_load))), phase.speed or 0.0
    return {
        "phase": phase.name,
        "z": z,
        "speed": U,
        "offset": shape.offset.tolist(),
        "way": float(np.hypot(*shape.xy.T).max()),
        "extra": shape.extra,
        "raised": raised(line, current.velocity),
        "lead_tip": float(np.hypot(*shape.lead())),
        "lead_hook": float(np.hypot(*shape.lead(0))),
        "F_tip": F,
        "more": F / at_rest(plan, phase, z).F_tip - 1.0,
        "used": None if capacity is None else F / capacity.value,
        "F_vertical": plan.payload.drag(plan.rho) * v * (math.hypot(U, v) - v),
    }


def _in_wind(plan: LiftPlan, phase: Phase, z: float) -> dict[str, Any]:
    """The load in the wind with its underside at z [m]."""
    wind, middle = plan.environment.wind, z + 0.5 * plan.payload.height
    assert wind is not None
    force = float(np.hypot(*wind.force(middle)))
    mean, gust = (float(np.hypot(*wind_lead(plan, phase, z, gust=gust))) for gust in (False, True))
    row = {"phase": phase.name, "z": z, "speed": wind.at(middle), "gust": wind.at(middle, wind.gust)}
    return row | {"F": force, "lead_mean": mean, "lead_gust": gust}


def _pendulum(plan: LiftPlan, phase: Phase, z: float) -> dict[str, Any]:
    """The first two natural periods [s], which of them waves excite, and the largest motion of the payload per motion
    of the tip in the periods of the waves."""
    chain, Tp = chain_at(plan, phase, z), plan.environment.Tp
    low, high = BAND[0] * min(Tp), BAND[1] * max(Tp)
    T = np.geomspace(low, high, FREQUENCIES)
    load = np.abs(chain.swing(2.0 * math.pi / T).load)
    periods, damping = chain.periods[:2].tolist(), chain.damping[:2].tolist()
    resonant = [low <= each <= high and zeta < PEAK for each, zeta in zip(periods, damping, strict=True)]
    row = {"phase": phase.name, "z": z, "periods": periods, "damping": damping, "in_waves": resonant}
    return row | {"load_per_tip": float(load.max()), "T": float(T[int(np.argmax(load))])}


def _leads(plan: LiftPlan, phase: Phase) -> Iterator[dict[str, Any]]:
    """Off-lead and side-lead of a phase against the load chart; none where it is not judged."""
    rules = [each for each in limited(plan, phase, Alternative.NONE) if each.rule.quantity in LEADS]
    if not rules:
        return
    seas = plan.environment.table()
    demand = closed_form(plan, phase, seas)
    limits = limits_in(plan, demand)
    for each in rules:
        q = each.rule.quantity
        if q not in demand.values:
            continue
        rest, worst = still_leads(plan, phase).get(q, math.nan), demand.values[q]
        used = float(utilisation(each, np.array([rest]), 0.0)[0])
        row = {"phase": phase.name, "rule": each.rule.key, "limit": each.limit, "at_rest": rest, "used_at_rest": used}
        yield row | {
            "largest": [_largest(worst, seas.Hs == Hs) for Hs in (min(seas.Hs), max(seas.Hs))],
            "Hs": [float(min(seas.Hs)), float(max(seas.Hs))],
            "Hs_limit": float(np.nanmin(limits.Hs[each.rule.key])),
            "linear": bool(np.nanmax(worst) <= LINEAR),
        }


def _largest(values: FloatArray, rows: Any) -> float:
    return float(np.nanmax(values[rows]))


def parts(facts: Mapping[str, Any]) -> Sequence[Part]:
    """The section, from the facts of a result."""
    of = facts[NAME]
    low = [Text(LOW)] if of["low_case"] else []
    current = [] if "current" not in of else [*_wire(of["current"]), *_clearance(of["current"])]
    wind = [] if "wind" not in of else _wind(of["wind"])
    return [*low, *current, *wind, *_periods(of), *_of_chart(of)]


def _wire(current: Mapping[str, Any]) -> list[Part]:
    head = (
        *("phase", "underside [m]", "current at the payload [m/s]", "offset forward, to port [m]"),
        *("more wire [m]", "higher on the same wire [m]", "angle at tip, at hook [deg]", "tension at tip [kN]"),
        "of SWL",
    )
    rows = [
        [
            *(row["phase"], f"{row['z']:.0f}", f"{row['speed']:.2f}"),
            ", ".join(f"{x + 0.0:.1f}" for x in row["offset"]),
            *(f"{row['extra']:.2f}", EMPTY if row["raised"] is None else f"{row['raised']:.2f}"),
            ", ".join(f"{math.degrees(row[name]):.1f}" for name in ("lead_tip", "lead_hook")),
            f"{row['F_tip'] / 1e3:.0f} ({100.0 * row['more']:+.1f} %)",
            EMPTY if row["used"] is None else percent(row["used"]),
        ]
        for row in current["rows"]
    ]
    more = max((row["F_vertical"] for row in current["rows"]), default=0.0) / 1e3
    return [
        Text(f"{_begin(current['text'])}. {CURRENT.format(more=more)}"),
        Table(head, rows, "The wire at rest in the current"),
    ]


def _wind(wind: Mapping[str, Any]) -> list[Part]:
    head = ("phase", "underside [m]", "wind, gust [m/s]", "force [kN]", "lead in the mean, in gusts [deg]")
    rows = [
        [
            *(row["phase"], f"{row['z']:.0f}", f"{row['speed']:.1f}, {row['gust']:.1f}", f"{row['F'] / 1e3:.1f}"),
            ", ".join(f"{math.degrees(row[name]):.2f}" for name in ("lead_mean", "lead_gust")),
        ]
        for row in wind["rows"]
    ]
    return [Text(f"{_begin(wind['text'])}. {WIND}"), Table(head, rows, "The load in the wind")]


def _periods(of: Mapping[str, Any]) -> list[Part]:
    head = ("phase", "underside [m]", "natural periods [s]", "damping", "in the waves", "payload per tip", "at [s]")
    rows = [
        [
            *(row["phase"], f"{row['z']:.0f}", ", ".join(f"{T:.1f}" for T in row["periods"])),
            ", ".join(f"{x:.2g}" for x in row["damping"]),
            ", ".join(f"RESONANCE {T:.1f} s" for T in _excited(row)) or "no",
            *(f"{row['load_per_tip']:.2f}", f"{row['T']:.1f}"),
        ]
        for row in of["pendulum"]
    ]
    low, high = (fmt(x, "time") for x in of["Tp"])
    text = Text(PENDULUM.format(low=low, high=high))
    return [text, Table(head, rows, "Load, hook and wire as a pendulum")] if rows else []


def _excited(row: Mapping[str, Any]) -> list[float]:
    """Natural periods that are in the waves [s]."""
    return [T for T, yes in zip(row["periods"], row["in_waves"], strict=True) if yes]


def _clearance(current: Mapping[str, Any]) -> list[Part]:
    room, way = current["clearance"], max((row["way"] for row in current["rows"]), default=0.0)
    if room is None:
        return [Text("Clearance NOT JUDGED: [environment.current] has none.")]
    verdict = "within it" if way <= room else "NOT OK: it is exceeded"
    return [Text(f"Clearance {fmt(room, 'length')}, largest offset of wire and hook {way:.1f} m: {verdict}.")]


def _of_chart(of: Mapping[str, Any]) -> list[Part]:
    head = (
        "phase",
        "rule",
        "allowed [deg]",
        "at rest [deg]",
        "of it",
        "lowest Hs [deg]",
        "highest Hs [deg]",
        "Hs limit",
    )
    rows = [
        [
            *(row["phase"], row["rule"], f"{math.degrees(row['limit']):.1f}", f"{math.degrees(row['at_rest']):.2f}"),
            percent(row["used_at_rest"]),
            *(f"{math.degrees(x):.1f}{'' if row['linear'] or x <= LINEAR else ' *'}" for x in row["largest"]),
            "above the table" if math.isinf(row["Hs_limit"]) else fmt(row["Hs_limit"], "length", 3),
        ]
        for row in of["leads"]
    ]
    table: list[Part] = [Table(head, rows, "Lead of the wire against the load chart"), Text(CHART)] if rows else []
    return [*table, *(Text(f"{_begin(note)}.") for note in of["not_judged"])]


def _begin(text: str) -> str:
    return text[:1].upper() + text[1:]


LOW = "Angles and offsets are those of the low weight case, tensions of the high one."
CURRENT = (
    "Drag of the velocity across the wire and on the side of the payload; bending, stretch and vortex shedding are left"
    " out. Runs, failure cases and the frequency-domain method have the current in the vertical drag of the payload:"
    " damping, and at most {more:.1f} kN more at the planned speeds. The closed form has it in its forces, not in its"
    " damping. No tier has the drag of the current along the wire."
)
WIND = (
    "Steady mean and the largest swing of an undamped pendulum in a gust of any length that begins and ends at once;"
    " the wind on wire, hook and boom is left out."
)
PENDULUM = (
    "Peak periods of the table are {low} to {high}; a period counts as in the waves from 0.6 of the lowest to 1.3 of"
    " the highest, unless its mode is damped by 0.7 of critical or more. Payload per tip is the largest sideways motion"
    " of the payload over that of the tip in that range."
)
CHART = (
    "At rest: heel, trim, and wind or current. In the lowest and highest Hs of the table [deg]: worst heading and"
    " period, at the level of the rule, the inertia force of waves on the payload included, their drag not. * more than"
    " 10 deg: beyond linear theory, which shows that it is too much, not how much."
)
