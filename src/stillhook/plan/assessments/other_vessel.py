"""Speed of the hook against a deck at lift-off and set-down, by the transfer functions of both vessels in the same
waves and by the table of EN 13852-1, what comes back to a payload that was lifted off, and what runs of the twin make
of both."""

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
from stillhook.plan.definition.rules import Alternative, Seas
from stillhook.plan.tiers.closed_form import closed_form, duration_of, tip_motion
from stillhook.plan.tiers.other_vessel import come_back, hook_on_deck, largest, relative_speed, risen
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Runs
from stillhook.plan.tiers.time_domain.lowering import SETTLEMENT, SeaState, winch_of
from stillhook.plan.tiers.time_domain.placing import snapped
from stillhook.report.document import Part, Table, Text
from stillhook.report.formatting import EMPTY, direction, fmt, percent
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase
from stillhook.spec.validity import CAP
from stillhook.statistics.extremes import zero_crossing_period
from stillhook.units import number

NAME, TITLE, EXPECTED = "other_vessel", "Lift-off from another vessel, set-down on a deck", 0.1
RUNS = 32
"""Runs of a sea in which closed form and runs are shown side by side."""
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
    by_runs = [] if state.twin is None else _by_runs(state, [p for p in phases if p.kind in APART], rows)
    facts = {"text": other or "Fixed platform", "Hs": list(plan.environment.heights), "rows": rows, "taken_up": taken}
    return facts | ({"by_runs": by_runs} if by_runs else {})


def _by_runs(state: PlanState, phases: Sequence[Phase], headings: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Closed form and runs of each phase under the alternative that is shown, in a sea of every period at the heading
    of the section's table: of the claimable limit, or the lowest of the table where that is lower."""
    plan, alternative = state.plan, state.answered.shown()
    axes, claimed = state.answered.axes, state.answered.claimed.Hs[state.answered.axes.alternatives.index(alternative)]
    least = np.fmin(np.nanmin(claimed, axis=0), max(plan.environment.Hs))
    heights = dict(zip(axes.periods, np.maximum(least, min(plan.environment.heights)), strict=True))
    cells, asks = Cells(plan, state.execution), []
    for row in headings:
        if row["phase"] in [phase.name for phase in phases]:
            winch = winch_of(plan.phase(row["phase"]), alternative)
            sea = SeaState(snapped(float(heights[row["Tp"]])), row["Tp"], row["beta"])
            asks.append(CellRequest(row["phase"], winch, sea, RUNS))
    cells.request(asks)
    return [_run_row(plan, alternative, each, cells.runs[each.cell]) for each in asks]


def _run_row(plan: LiftPlan, alternative: Alternative, of: CellRequest, runs: Runs) -> dict[str, Any]:
    """What the closed form says of one sea, and what its runs did: level of 90 % of them, and the most."""
    phase, seas = plan.phase(of.phase), Seas(*(np.array([x]) for x in of.spot))
    closed, off = closed_form(plan, phase, seas, alternative).values, phase.kind in OFF_DECK
    known = np.isfinite(runs["duration"])

    def levels(name: str) -> list[float] | None:
        x = np.nan_to_num(runs[name][known])
        return [float(np.quantile(x, 0.9)), float(x.max())] if len(x) else None

    clear = runs["z_clear"][known]
    return {
        "phase": phase.name,
        "alternative": alternative.value,
        "Hs": of.spot.Hs,
        "Tp": of.spot.Tp,
        "beta": of.spot.beta,
        "n": int(known.sum()),
        "n_failed": int((~known).sum()),
        "off": off,
        "closed": {name: float(closed[name][0]) for name in ("F_top_max", "DAF", "v_landed") if name in closed},
        "F_top_max": levels("F_w_max"),
        "DAF": levels("DAF"),
        "v_landed": levels("v_again" if off else "v_hit"),
        "second_hits": float(np.mean(runs["v_again"][known] > 0.0)) if off else None,
        "clearance": float(np.nanmin(clear)) if off and np.isfinite(clear).any() else None,
        "slack_time": levels("sling_slack_time"),
        "relief": float(np.mean(runs["relief_time"][known] > 0.0)) if "relief_time" in runs else None,
    }


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
    return result + _runs_shown(of.get("by_runs", []))


def _runs_shown(rows: Sequence[Mapping[str, Any]]) -> list[Part]:
    """Closed form and runs side by side."""
    if not rows:
        return []

    def cell(row: Mapping[str, Any], name: str, scale: float, digits: int) -> str:
        values = [row["closed"].get(name), *(row[name] or [])]
        return " / ".join(EMPTY if x is None else f"{x / scale:.{digits}f}" for x in values)

    table = [
        (
            *(row["phase"], fmt(row["Tp"]), direction(row["beta"]), f"{row['Hs']:.2f}", cell(row, "F_top_max", 1e3, 0)),
            *(cell(row, "DAF", 1.0, 2), cell(row, "v_landed", 1.0, 2)),
            EMPTY if row["slack_time"] is None else " / ".join(f"{x:.1f}" for x in row["slack_time"]),
            EMPTY if row["second_hits"] is None else percent(row["second_hits"]),
            EMPTY if row["clearance"] is None else f"{row['clearance']:.2f}",
            EMPTY if row["relief"] is None else percent(row["relief"]),
        )
        for row in rows
    ]
    head = ("phase", "Tp [s]", "heading", "Hs [m]", "hook load [kN]", "DAF", "hit [m/s]")
    text = (
        f"Closed form / level of 90 % of the runs / most of {rows[0]['n']} runs with"
        f" {Alternative(rows[0]['alternative']).label}, each lifted off or set down at an instant of its own, in the"
        " seas of the claimable limit, or the lowest of the table. The closed form takes the worst instant of half an"
        " hour and a winch that does not yield; in a run the winch slows down as it takes up the load, and a relief"
        " valve that opens limits the hook load. Slack: of slings once the payload hangs, level and most. Hit: impact"
        " at set-down, second hits at lift-off. Clearance: least height over the deck as it came closer again. The deck"
        f" settles by {fmt(SETTLEMENT, 'length')} under the payload and returns 0.3 of the speed of a hit (assumed)."
    )
    return [
        Text(text),
        Table((*head, "slack [s]", "second hits", "clearance [m]", "relief open"), table, "Runs at the decks"),
    ]
