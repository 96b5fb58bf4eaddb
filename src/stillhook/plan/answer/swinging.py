"""Where an alternative has no limit at all because the winch oscillates by itself: a remark that says what that rests
on."""

from __future__ import annotations

import numpy as np

from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.limits import limited
from stillhook.plan.report.words import SWINGS, named
from stillhook.plan.table import Chosen
from stillhook.report.formatting import percent
from stillhook.spec.crane import Crane
from stillhook.units import show

QUANTITY, ASSUMED = "oscillation_share", "assumed"


def swinging_remarks(plan: LiftPlan, modelled: Chosen) -> list[str]:
    """A line for every alternative and phase with limits of 0 by a rule on oscillation: what oscillates, how fast the
    wire goes there, on which assumptions that rests, and what to do."""
    rules = {rule.key for rule in plan.rules.rules if rule.quantity == QUANTITY}
    at = [i for i, key in enumerate(modelled.axes.rules) if key in rules]
    lines = []
    for i, alternative in enumerate(modelled.axes.alternatives):
        for k, phase in enumerate(plan.phases):
            zero = (modelled.Hs[i, k, at] == 0.0).any(axis=0)
            if zero.any():
                lines.append(_line(plan, alternative, phase, f"{int(np.sum(zero))} of {zero.size} cells"))
    return lines


def _line(plan: LiftPlan, alternative: Alternative, phase: Phase, cells: str) -> str:
    allowed = next(r for r in limited(plan, phase, alternative) if r.rule.quantity == QUANTITY)
    assumed = " (assumed)" if allowed.rule.standard == ASSUMED else ""
    speed = "standing still" if not phase.speed else f"at {show(phase.speed, 'speed')}"
    return (
        f"{SWINGS}, {named(alternative)} in {cells}: in {phase.name}, {speed}, winch and load oscillate on the wire by"
        f" themselves for more than {percent(allowed.limit)} of the time{assumed}, calm included. That rests on the"
        f" wire's {_damping(plan.crane)}: measure it, move the wire faster or slower, or choose another controller or"
        " K_p (stillhook stability)"
    )


def _damping(crane: Crane) -> str:
    """The damping ratio of the wire, its interval, and whether somebody measured it."""
    wire, source = crane.wire, crane.sources.get("wire.zeta")
    between = [] if None in (wire.zeta_low, wire.zeta_high) else [f"{wire.zeta_low:g} to {wire.zeta_high:g}"]
    known = ", ".join([*between, *([] if source is None else [source.kind.value])])
    return f"damping of {wire.zeta:g}{f' ({known})' if known else ''}"
