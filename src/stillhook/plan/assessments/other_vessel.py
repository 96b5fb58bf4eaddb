"""Speed of the hook against a deck at lift-off and set-down, by the transfer functions of both vessels in the same
waves and by the table of EN 13852-1, and what comes back to a payload that was lifted off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.physics.scalar import G
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.capacities import at_deck, off_other_vessel, springs
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.tiers.closed_form import duration_of, tip_motion
from stillhook.plan.tiers.other_vessel import come_back, hook_on_deck, largest, relative_speed, risen
from stillhook.report.document import Part, Table, Text
from stillhook.report.formatting import direction, fmt
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase
from stillhook.spec.validity import CAP
from stillhook.statistics.extremes import zero_crossing_period
from stillhook.units import number

NAME, TITLE, EXPECTED = "other_vessel", "Lift-off from another vessel, set-down on a deck", 0.1
SHOWN = 4
"""Heights of the table that the section shows."""


def assess(state: PlanState, progress: Progress) -> dict[str, Any] | None:
    """For every phase and period, at the heading of the largest speed by transfer functions: that and the table's by
    Hs [SI]; None where the plan has no deck that moves otherwise than the vessel, or its motions are not known."""
    plan = state.plan
    phases = [phase for phase in plan.phases if at_deck(plan, phase) and (plan.against or not _moves(plan, phase))]
    if not phases:
        return None
    other = None if plan.against is None else plan.against.other.describe()
    rows = [row for phase in phases for row in _rows(plan, phase)]
    taken = [_taken_up(plan, phase) for phase in phases if phase.kind in OFF_DECK]
    return {"text": other or "Fixed platform", "Hs": list(plan.environment.heights), "rows": rows, "taken_up": taken}


def _moves(plan: LiftPlan, phase: Phase) -> bool:
    return phase.on_other_vessel or off_other_vessel(plan, phase)


def _rows(plan: LiftPlan, phase: Phase) -> list[dict[str, Any]]:
    """A row for every period of a phase; v_credited with what the flat cap leaves, of a phase that is compensated;
    z_back how far the deck comes back in the first period, z_clear what the payload is above it after that."""
    env, T, seas = plan.environment, duration_of(plan, phase), plan.environment.table()
    shape = (len(env.headings), len(env.Tp), len(env.heights))
    sigmas = hook_on_deck(plan, phase, seas)
    z, v = largest(sigmas, T)
    values: dict[str, FloatArray] = {"v_computed": v}
    if _moves(plan, phase):
        values["v_table"] = relative_speed(env.H_m0(seas.Hs), tip_motion(plan, phase, seas).largest(T)[1])
    if phase.compensated:
        values["v_credited"] = largest(hook_on_deck(plan, phase, seas, 1.0 - CAP), T)[1]
    if phase.kind in APART and phase.kind in OFF_DECK:
        omega = np.divide(sigmas[1], sigmas[0], out=np.ones_like(z), where=sigmas[0] > 0.0)
        values["z_back"] = come_back(z, omega, phase.speed or 0.0)
        values["z_clear"] = risen(phase, zero_crossing_period(sigmas[0], sigmas[1])) - 2.0 * z
    each = {name: x.reshape(shape) for name, x in values.items()}
    rows = []
    for i, Tp in enumerate(env.Tp):
        j = int(np.argmax(np.nan_to_num(each["v_computed"][:, i, -1])))
        of = {name: x[j, i].tolist() for name, x in each.items()}
        rows.append({"phase": phase.name, "Tp": Tp, "beta": env.headings[j], "duration": T, **of})
    return rows


def _taken_up(plan: LiftPlan, phase: Phase) -> dict[str, Any]:
    """What the wire stretches until the payload hangs [m], and how long that takes at the hoisting speed [s]; tension
    per speed of the hook against the deck [N s/m]."""
    K, m = max(springs(plan, phase))
    stretch, V = m * G / K, phase.speed or 0.0
    return {"phase": phase.name, "V": V, "stretch": stretch, "ramp": stretch / V if V else None, "rate": (K * m) ** 0.5}


def parts(facts: Mapping[str, Any]) -> Sequence[Part]:
    """The section, from the facts of a result."""
    of = facts[NAME]
    n = len(of["Hs"])
    shown = np.unique(np.linspace(0, n - 1, min(SHOWN, n)).round().astype(int)).tolist()
    head = ("phase", "Tp [s]", "heading", *(f"Hs {number(of['Hs'][k])} m" for k in shown))

    def rows(*names: str) -> list[list[str]]:
        return [
            [
                *(row["phase"], fmt(row["Tp"]), direction(row["beta"])),
                *(" / ".join(f"{row[name][k]:.2f}" for name in names if name in row) for k in shown),
            ]
            for row in of["rows"]
            if names[0] in row
        ]

    text = (
        f"{of['text']}. Most probable largest vertical speed of the crane tip against the deck [m/s], at the heading"
        " where the first is largest: by the transfer functions of both vessels in the same waves / by EN 13852-1,"
        " sqrt(V_D^2 + V_C^2). The larger counts in v_carrier and in the load as the payload is taken up."
        " Each vessel is alone in the waves: shielding and gap resonance are left out."
        f" Of a phase that is compensated the last number is the first with {CAP:.0%} of compensation"
        " (of the tip's motion, or of the relative motion where the winch follows the deck); it counts with"
        " compensation alone, and what a lost compensation means is the first. Else the winch does not follow the deck."
        " On a fixed platform the tip moves alone, and no table applies."
    )
    result: list[Part] = [
        Text(text),
        Table(head, rows("v_computed", "v_table", "v_credited"), "Speed of the hook against the deck"),
    ]
    if taken := of.get("taken_up"):
        lines = [
            f"{row['phase']}: the wire stretches {fmt(row['stretch'])} m until the payload hangs"
            + ("" if row["ramp"] is None else f", {fmt(row['ramp'])} s at {fmt(row['V'])} m/s")
            + f"; each m/s of the hook against the deck adds {fmt(row['rate'] / 1e3)} kN."
            for row in taken
        ]
        slack = " Where the deck comes back by more than the stretch, the slings fall slack again before it hangs."
        result.append(Text(" ".join(lines) + slack))
    if back := rows("z_back", "z_clear"):
        note = (
            "Lifted off at the worst instant, without compensation: how far the deck comes back in the first period,"
            " the second hit [m] / what the payload is above the deck after it, at the largest motion (negative: hit"
            " again) [m]."
        )
        result += [Text(note), Table(head, back, "Second hit and clearance after lift-off")]
    return result
