"""Rows of the comparison: controllers with the gain that the margin allows them, and the leads that are tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from benchmarks.control import course
from stillhook.analysis.controllers import Controller
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.spec.scenario import Mode, Sensors

PLAN = "template-to-1500m"
STRONG = Alternative.STRONG_SSC
CLOSE, LATE = 0.020, 0.200
"""Delay of the motion unit, of the benchmark and of one over a network [s]."""
LEADS = (0.045, 0.030, 0.060)
"""Leads of strong SSC beyond the delay of the motion unit, of which it has the best in every sea; late, the first
alone [s]."""
AFTER: Mapping[Alternative, float] = {
    Alternative("ns"): 0.060,
    Alternative("hs"): 0.060,
    Alternative("ssc-optimal"): 0.045,
    Alternative("ff"): 0.030,
    Alternative("rope"): 0.045,
}
"""Lead beyond the delay, that with the least error over the benchmark's seas; of `ssc-optimal` and `rope`, which have
no such figure, that of strong SSC [s]."""
REFERENCES = (Alternative.NONE, Alternative.CAP)


class Row(NamedTuple):
    """A controller of the table: plans of which it has in every sea the best, and the alternative that it is there."""

    name: str
    plans: tuple[LiftPlan, ...]
    alternative: Alternative


def lift_plan(controllers: Mapping[Alternative, Controller], more: Sequence[Alternative], delay: float) -> LiftPlan:
    """The example with the benchmark's sensors, and these controllers beside no compensation and the cap."""
    sensors = Sensors.model_validate({**course.SENSORS, "delay": f"{delay!r} s"})
    alternatives = (*REFERENCES, *more, *controllers)
    return replace(
        load_plan(PLAN), sensors=sensors, alternatives=alternatives, controllers=controllers, digest="", notes=()
    )


def tuned(plan: LiftPlan, alternative: Alternative, lead: float, **control: Any) -> Controller:
    """A controller with the largest gain of the margin, and its lead [s]."""
    mode = Mode("ssc") if alternative is STRONG else Mode(alternative.value)
    K_p = course.largest_gain(plan.crane, mode)
    return Controller(
        f"{alternative.value}, {1e3 * lead:.0f} ms",
        mode,
        {"control": {"K_p": f"{K_p!r} 1/m", "t_lead": f"{lead!r} s", **control}},
    )


def rows() -> list[Row]:
    """All rows."""
    plain = load_plan(PLAN)
    published = Alternative("ssc")

    def strong(delay: float, lead: float, **control: Any) -> dict[Alternative, Controller]:
        return {STRONG: tuned(plain, STRONG, delay + lead, **control)}

    first, *others = LEADS
    own = {a: tuned(plain, a, CLOSE + after) for a, after in AFTER.items()}
    together = lift_plan(own | strong(CLOSE, first), [published], CLOSE)
    best = (together, *(lift_plan(strong(CLOSE, lead), [], CLOSE) for lead in others))
    late = lift_plan(strong(LATE, first), [], LATE)
    predicted = lift_plan(strong(LATE, first, prediction={"kind": "modes"}), [], LATE)
    classic, further = list(AFTER)[:2], list(AFTER)[2:]
    return [
        *(Row(a.value, (together,), a) for a in (*REFERENCES, *classic, published)),
        Row(STRONG.value, best, STRONG),
        *(Row(a.value, (together,), a) for a in further),
        Row("strong-ssc, 200 ms late", (late,), STRONG),
        Row("the same with prediction", (predicted,), STRONG),
    ]
