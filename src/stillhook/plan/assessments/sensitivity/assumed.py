"""The assumed numbers that govern: of what no source gives, the few that move a limit or the claim most, each with its
number, where it is set, what it moves and who has to supply it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stillhook.base.progress import Progress
from stillhook.plan.assessments import sensitivity
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.sensitivity.factors import ASSUMED
from stillhook.plan.assessments.sensitivity.ranking import Lowered, lowered
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.limits import limited
from stillhook.plan.result import CREDITS
from stillhook.report.document import Part, Table, Text
from stillhook.report.formatting import EMPTY, fixed
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.tables.table import SourceKind
from stillhook.units import show
from stillhook.variables import BY_NAME

NAME, TITLE, EXPECTED = "assumed", "Assumed numbers that govern", 0.5
MOST = 5
"""Numbers at the most."""
UNSUPPLIED = (SourceKind.ASSUMED,)
"""Kinds of a source that nobody supplied."""
BY_FORMULA = "by formulas of its shape"
"""Where added mass is set that no source gives."""
FIRST, SECOND = 2.0, 1.0
"""Weights of what is always named before a number that lowers a limit by all of it: a hold that is left out, and
signals that are taken as ideal."""


def assess(state: PlanState, progress: Progress) -> Mapping[str, Any] | None:
    """At most `MOST` rows, the most important first."""
    of = sensitivity.assess(state, progress)
    moves = [] if of is None else lowered(of)
    rows = sorted(_rows(state, moves), key=lambda row: -row["weight"])
    named = ("what", "value", "where", "moves", "phase", "Hs_from", "Hs_to", "supplier")
    return {"rows": [{key: row[key] for key in named} for row in rows[:MOST]], "n": len(rows)}


def _rows(state: PlanState, moves: Sequence[Lowered]) -> Iterator[dict[str, Any]]:
    plan = state.plan
    for phase in _not_held(plan):
        yield _hold_off(phase, moves)
    if any(phase.compensated for phase in plan.phases):
        if plan.sensors.delay == 0.0:
            yield _moved(
                "motion unit", "ideal: no delay", "plan, [sensors]", "maker of the unit", _of(moves, "delay"), SECOND
            )
        yield from _certificate(state)
    yield from _of_payload(plan, moves)
    yield from _of_crane(plan, moves)
    yield from _of_rules(plan, moves)
    vessel = f"vessel {plan.vessel.name}"
    yield from _if_moved("roll damping", "as in the motions table", vessel, "vessel owner", _of(moves, "roll"))
    if plan.T_C is None:
        text = f"sets the reference period: T_R is twice T_POP, {show(2.0 * plan.T_POP, 'time', 4)}"
        yield _row("contingency T_C", "not assessed", "plan, [operation] T_C", text, "contractor", 0.05)


def _of(moves: Sequence[Lowered], factor: str) -> Lowered | None:
    """Where a factor lowers a limit by the largest part."""
    of = [row for row in moves if row.factor == factor and row.base > 0.0]
    return max(of, key=lambda row: row.by / row.base, default=None)


def _row(
    what: str, value: str, where: str, moves: str, supplier: str, weight: float, at: Lowered | None = None
) -> dict[str, Any]:
    limits: dict[str, Any] = dict.fromkeys(("phase", "Hs_from", "Hs_to"))
    if at is not None:
        limits = {"phase": at.phase, "Hs_from": at.base, "Hs_to": at.Hs}
    named = {"what": what, "value": value, "where": where, "moves": moves, "supplier": supplier, "weight": weight}
    return named | limits


def _moved(what: str, value: str, where: str, supplier: str, at: Lowered | None, weight: float = 0.0) -> dict[str, Any]:
    """A row of what a limit falls to with another value."""
    if at is None:
        return _row(what, value, where, "no limit was shown to depend on it", supplier, weight)
    text = f"{at.phase}: Hs {fixed(at.base, 2)} to {fixed(at.Hs, 2)} m with {at.text}"
    return _row(what, value, where, text, supplier, weight + at.by / at.base, at)


def _if_moved(what: str, value: str, where: str, supplier: str, at: Lowered | None) -> Iterator[dict[str, Any]]:
    if at is not None:
        yield _moved(what, value, where, supplier, at)


def _not_held(plan: LiftPlan) -> list[Phase]:
    """Passages and landings whose hold is left out."""
    held = any(phase.kind is PhaseKind.SPLASH and phase.held for phase in plan.phases)
    stops = any(phase.kind is PhaseKind.STAND_OFF for phase in plan.phases)
    left_out = {PhaseKind.SPLASH: not held, PhaseKind.LANDING: not stops}
    return [phase for phase in plan.phases if phase.kind is not None and left_out.get(phase.kind, False)]


def _hold_off(phase: Phase, moves: Sequence[Lowered]) -> dict[str, Any]:
    """A hold that is left out, with the limit that it would have."""
    text = f"a stop in {phase.name} is not claimed and must not be made"
    at = _of([row for row in moves if row.phase == phase.name], "hold") if phase.kind is PhaseKind.SPLASH else None
    if at is not None:
        text = f"{text}: Hs {fixed(at.base, 2)} to {fixed(at.Hs, 2)} m with {at.text}"
    weight = FIRST if at is None else FIRST + at.by / at.base
    return _row("hold off", "0 s", f'plan, hold = "off" of {phase.name}', text, "contractor", weight, at)


def _certificate(state: PlanState) -> Iterator[dict[str, Any]]:
    """A certificate that is assumed, with the cells whose limit it raises over that of the flat cap."""
    plan, crane = state.plan, state.plan.crane
    if crane.certified is None or not crane.certified.synthetic or not plan.credits_synthetic:
        return
    answered, shown = state.answered, state.answered.shown()
    axes = answered.axes
    if not shown.twin:
        return
    i = axes.alternatives.index(shown)
    credited = answered.governs[CREDITS[1]].Hs[i]
    covered = int((answered.certified.covers[i].all(axis=(0, 3))).sum())
    text = f"the credit for compensation in all of {credited.size} cells, in {covered} of them at every height"
    yield _row(
        "certificate", f"{crane.certified.short}, SYNTHETIC", "plan, [synthetic_certificate]", text, "crane maker", 0.5
    )


def _of_payload(plan: LiftPlan, moves: Sequence[Lowered]) -> Iterator[dict[str, Any]]:
    load, rho, where = plan.payload, plan.rho, f"payload {plan.payload.name}"
    covered = load.covered(rho)
    rows = {
        "mass": ("mass of the payload", show(load.mass, "mass"), "mass"),
        "C_A": ("added mass", show(covered.A33, "mass"), "levels" if load.shape is None else BY_FORMULA),
        "C_D": ("drag coefficient", f"{load.C_D:g} on {covered.A_p:.4g} m^2", "C_D"),
    }
    for factor, (what, value, key) in rows.items():
        source = load.sources.get(key)
        if source is None or source.kind in UNSUPPLIED:
            yield from _if_moved(what, value, f"{where}, {key}", "owner of the payload", _of(moves, factor))


def _of_crane(plan: LiftPlan, moves: Sequence[Lowered]) -> Iterator[dict[str, Any]]:
    crane = plan.crane
    rows = {
        "EA": ("elastic modulus of the wire", show(crane.wire.E, "modulus", 4), "wire.E"),
        "zeta": ("damping ratio of the wire", f"{crane.wire.zeta:g}", "wire.zeta"),
        "friction": ("friction of the winch", crane.friction.library, "friction.system.Y_1"),
    }
    for factor, (what, value, key) in rows.items():
        source = crane.sources.get(key)
        if source is None or source.kind in UNSUPPLIED:
            yield from _if_moved(what, value, f"crane {crane.name}, {key}", "crane maker", _of(moves, factor))


def _of_rules(plan: LiftPlan, moves: Sequence[Lowered]) -> Iterator[dict[str, Any]]:
    """The tolerance that governs a phase, where no standard gives it."""
    at = _of(moves, "rule")
    if at is None:
        return
    phase = plan.phase(at.phase)
    alternative = plan.alternatives[-1]
    rule = next(
        each for each in limited(plan, phase, alternative) if at.text.startswith(each.rule.key.replace("-", " "))
    )
    kind, own = BY_NAME[rule.rule.quantity].kind, rule.rule.key in phase.limits
    value = show(rule.limit, kind) if kind else f"{rule.limit:g}"
    where = f"plan, limits of {phase.name}" if own else f"rules {plan.rules.name}, standard {ASSUMED}"
    what = f"limit of {rule.rule.key.replace('-', ' ')}"
    yield _moved(what, value, where, "owner of the seabed structure" if own else "project", at)


def parts(facts: Mapping[str, Any]) -> list[Part]:
    """The table of these numbers."""
    of = facts[NAME]
    if not of["rows"]:
        return [Text("No number that a limit rests on is assumed.")]
    rows = [[row["what"], row["value"], row["where"], row["moves"] or EMPTY, row["supplier"]] for row in of["rows"]]
    head = ("assumed", "value", "set in", "what it moves", "to be supplied by")
    of_all = "All" if len(rows) == of["n"] else f"The {len(rows)} of"
    text = f"{of_all} {of['n']} assumed inputs that move a limit or the claim{'' if of_all == 'All' else ' most'}."
    return [Text(text), Table(head, rows)]
