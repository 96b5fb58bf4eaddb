"""Speed of the hook against the deck of another vessel at lift-off: by the transfer functions of both vessels in the
same waves, and by the table of EN 13852-1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.progress import Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.capacities import off_other_vessel
from stillhook.plan.tiers.closed_form import duration_of, tip_motion
from stillhook.plan.tiers.other_vessel import relative_speed, speed_against_deck
from stillhook.report.document import Part, Table, Text
from stillhook.report.formatting import direction, fmt
from stillhook.units import number

NAME, TITLE, EXPECTED = "other_vessel", "Lift-off from another vessel", 0.1
SHOWN = 4
"""Heights of the table that the section shows."""


def assess(state: PlanState, progress: Progress) -> dict[str, Any] | None:
    """For every phase and period, at the heading of the largest speed by transfer functions: that and the table's by
    Hs [SI]; None where the plan has no other vessel's transfer functions, or lifts nothing off it."""
    plan = state.plan
    phases = [phase for phase in plan.phases if off_other_vessel(plan, phase)]
    if plan.against is None or not phases:
        return None
    env, rows = plan.environment, []
    seas, shape = env.table(), (len(env.headings), len(env.Tp), len(env.heights))
    for phase in phases:
        T = duration_of(plan, phase)
        computed = speed_against_deck(plan, phase, seas, T).reshape(shape)
        table = relative_speed(env.H_m0(seas.Hs), tip_motion(plan, phase, seas).largest(T)[1]).reshape(shape)
        for i, Tp in enumerate(env.Tp):
            j = int(np.argmax(np.nan_to_num(computed[:, i, -1])))
            speeds = {"v_computed": computed[j, i].tolist(), "v_table": table[j, i].tolist()}
            rows.append({"phase": phase.name, "Tp": Tp, "beta": env.headings[j], "duration": T, **speeds})
    return {"text": plan.against.other.describe(), "Hs": list(env.heights), "rows": rows}


def parts(facts: Mapping[str, Any]) -> Sequence[Part]:
    """The section, from the facts of a result."""
    of = facts[NAME]
    n = len(of["Hs"])
    shown = np.unique(np.linspace(0, n - 1, min(SHOWN, n)).round().astype(int)).tolist()
    head = ("phase", "Tp [s]", "heading", *(f"Hs {number(of['Hs'][k])} m" for k in shown))
    rows = [
        [
            *(row["phase"], fmt(row["Tp"]), direction(row["beta"])),
            *(f"{row['v_computed'][k]:.2f} / {row['v_table'][k]:.2f}" for k in shown),
        ]
        for row in of["rows"]
    ]
    text = (
        f"{of['text']}. Most probable largest vertical speed of the crane tip against the deck [m/s], at the heading"
        " where the first is largest: by the transfer functions of both vessels in the same waves / by EN 13852-1,"
        " sqrt(V_D^2 + V_C^2). The larger counts in v_carrier and in the load as the payload is taken up."
        " Each vessel is alone in the waves: shielding and gap resonance are left out."
        " The winch does not follow the deck."
    )
    return [Text(text), Table(head, rows, "Speed of the hook against the deck")]
