"""What a limit is varied by: every factor with its ends, the plan at each of them, and why one is not judged."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.uncertainty.factors import FACTORS, damping_range
from stillhook.errors import StillhookError
from stillhook.plan.assessments.sensitivity.roll import with_roll_damping
from stillhook.plan.definition.lift_plan import LiftPlan, check_sinks, check_tips, check_wire
from stillhook.plan.definition.rules import Alternative, Limited
from stillhook.plan.definition.weights import weighing
from stillhook.plan.limits import limited
from stillhook.plan.tiers.time_domain.lowering import Winch, machine_of, step_of, winch_of
from stillhook.plan.tiers.time_domain.placing import Column
from stillhook.spec.crane import Crane
from stillhook.spec.lift.assembly import Assembly, Part, Scaled
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.statistics.estimate import ENDS
from stillhook.units import show
from stillhook.variables import BY_NAME

TABLE: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    (files("stillhook.plan.assessments.sensitivity") / "factors.toml").read_text(encoding="utf-8")
)
"""Factors by name: title, and either a factor of the uncertainty table or ends and their reason."""
OF_MACHINE = ("friction", "delay")
"""Factors of a winch that follows the tip."""
OF_TABLE = ("Tp", "heading", "certificate")
"""Factors whose ends the plan's own table may hold."""
ASSUMED = "assumed"
"""Standard of a rule whose number no standard gives."""
LEAST_DRAG = "C_D_least"
"""Setting of the closed form: the least drag coefficient that it takes."""
Y = ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6")


class Cell(NamedTuple):
    """A phase under an alternative in one column, Tp [s] and direction of travel [rad], and the rule that governs;
    stops: whether the plan has a stop in the wave zone as a phase of its own."""

    plan: LiftPlan
    phase: Phase
    alternative: Alternative
    column: Column
    rule: str = ""
    stops: bool = False

    @property
    def winch(self) -> Winch:
        """How the winch is run."""
        return winch_of(self.phase, self.alternative)


class End(NamedTuple):
    """A factor at one end: its value [SI, or a share of what the plan has], that in words, and what is run; None where
    the plan's own table says it; reason why it is not judged."""

    value: float
    text: str
    cell: Cell | None = None
    reason: str = ""


@dataclass(frozen=True)
class Factor:
    """A factor with both ends; reason: why it is not judged at all."""

    name: str
    ends: tuple[End, ...] = ()
    reason: str = ""
    title: str = field(init=False)
    source: str = field(init=False)

    def __post_init__(self) -> None:
        row = TABLE[self.name]
        object.__setattr__(self, "title", row["title"])
        of = f"uncertainty table, {FACTORS[row['table']].reason}" if "table" in row else row["reason"]
        object.__setattr__(self, "source", of)


def spread(name: str, crane: Crane) -> tuple[float, float]:
    """Ends of a factor: the 95 % range of the uncertainty table where it has it, else those of this table."""
    row = TABLE[name]
    if "table" not in row:
        low, high = row["ends"]
        return float(low), float(high)
    if row["table"] == "wire_damping":
        return damping_range(crane.wire)
    low, high = FACTORS[row["table"]].default.at(np.array(ENDS))
    return float(low), float(high)


def alone(plan: LiftPlan, phase: Phase, alternative: Alternative, column: Column, rule: str = "") -> Cell:
    """One phase of a plan in one column, run as the plan runs it."""
    env = plan.environment.model_copy(update={"Tp": (column[0],), "headings": (column[1],)})
    one = replace(plan, phases=(phase,), environment=env)
    stops = any(each.kind is PhaseKind.SPLASH and each.held for each in plan.phases)
    return _as_run(Cell(one, phase, alternative, column, rule, stops), plan)


def _as_run(cell: Cell, plan: LiftPlan, change: Callable[[Crane], Crane] = lambda crane: crane) -> Cell:
    """A cell whose runs have the step and the settings of the controller of another plan, its crane changed: what is
    not known to the PLC does not change it."""
    crane, mode = plan.once(machine_of, cell.winch)
    cell.plan.memo[machine_of, cell.winch] = change(crane), mode
    cell.plan.memo[step_of,] = plan.once(step_of)
    return cell


def factors_of(base: Cell, tolerance: float) -> list[Factor]:
    """Every factor of a cell; tolerance of the heading [rad]."""
    return [_judged(base, name, make, tolerance) for name, make in _MAKERS.items()]


def _judged(base: Cell, name: str, make: Callable[[Cell, float], Cell | None], tolerance: float) -> Factor:
    plan, phase = base.plan, base.phase
    if name in OF_MACHINE and base.winch.controller is None:
        return Factor(name, reason="no controller follows the tip in this phase")
    if name == "speed" and phase.speed is None:
        return Factor(name, reason="the phase does not move")
    if name == "hold" and phase.kind is PhaseKind.SPLASH and not phase.held:
        return Factor(name, reason="its hold is a phase of its own") if base.stops else _stop(base)
    if name == "hold" and phase.speed is not None:
        return Factor(name, reason="its time is that of its way")
    if name == "C_D" and plan.payload.C_D == 0.0 and plan.payload.C_lin == 0.0:
        return Factor(name, reason="the payload has no drag")
    if name == "certificate" and base.winch.controller is None:
        return Factor(name, reason="no compensation is credited in this phase")
    if name == "rule" and (reason := _not_assumed(base)):
        return Factor(name, reason=reason)
    low, high = spread(name, plan.crane)
    if name == "delay" and plan.sensors.delay:
        high = plan.sensors.delay
    if name == "heading":
        low, high = low * tolerance, high * tolerance
    ends = []
    for value in (low,) if name == "certificate" else (low, high):
        text, reason, cell = _words(base, name, value), "", None
        try:
            cell = make(base, value)
        except StillhookError as problem:
            reason = str(problem).rstrip(".")
        ends.append(End(value, text, cell, reason))
    return Factor(name, tuple(ends), next((e.reason for e in ends if name == "roll" and e.reason), ""))


def _stop(base: Cell) -> Factor:
    """A passage with a stop at its worst depth, for as long as the rules take it."""
    time = base.plan.rules.settings["hold"]
    stops = _phase(base, speed=None, time=time, planned=None, hold=time)
    return Factor("hold", (End(time, f"{show(time, 'time')} at the worst depth", stops),))


def _words(base: Cell, name: str, value: float) -> str:
    if name == "delay":
        return show(value, "time")
    if name == "zeta":
        return f"{value:.3g} of critical"
    if name == "Tp":
        return show(base.column[0] + value, "time", 3)
    if name == "heading":
        return show((base.column[1] + value) % (2.0 * math.pi), "angle", 4)
    if name == "mass":
        return show(value * base.plan.payload.mass, "mass", 4)
    if name == "speed":
        return show(value * (base.phase.speed or 0.0), "speed", 3)
    if name == "hold":
        return show(value * (base.phase.time or 0.0), "time", 3)
    if name == "certificate":
        return f"{value:.0%}"
    if name == "rule":
        return f"{base.rule.replace('-', ' ')} {_limit_text(_governing(base), value)}"
    return f"{value:.3g} x"


def _with_plan(base: Cell, changed: LiftPlan, change: Callable[[Crane], Crane] = lambda crane: crane) -> Cell:
    """A cell of a changed plan; refused where the lift is impossible."""
    check_sinks(changed.payload, changed.rho)
    check_tips(changed, None)
    check_wire(changed)
    (phase,) = changed.phases
    return _as_run(base._replace(plan=changed, phase=phase), base.plan, change)


def _mass(base: Cell, f: float) -> Cell:
    return _with_plan(
        base,
        replace(
            base.plan, payload=weighing(base.plan.payload, f * base.plan.payload.mass, base.plan.payload.displaced)
        ),
    )


def _added_mass(base: Cell, f: float) -> Cell:
    return _with_plan(base, replace(base.plan, payload=of_added_mass(base.plan.payload, f)))


def of_added_mass(payload: Payload, f: float) -> Payload:
    """The payload with so many times its added mass at every submergence, and with it its slamming; all else stays."""
    if f == 1.0:
        return payload
    shape = payload.shape
    if shape is None:
        levels = tuple(level.model_copy(update={"A33": f * level.A33}) for level in payload.levels)
        return payload.model_copy(update={"levels": levels})
    if isinstance(shape, Assembly):
        scaled = Scaled(parts=shape.parts, factor=f * (shape.factor if isinstance(shape, Scaled) else 1.0))
    else:
        scaled = Scaled(parts=(Part(shape=shape, mass=f"{payload.mass!r} kg"),), factor=f)
    return payload.model_copy(update={"shape": scaled})


def _drag(base: Cell, f: float) -> Cell:
    load = base.plan.payload
    other = load.model_copy(update={"C_D": f * load.C_D, "C_lin": f * load.C_lin})
    settings = base.plan.rules.settings
    rules = replace(base.plan.rules, settings={**settings, LEAST_DRAG: f * settings[LEAST_DRAG]})
    return _with_plan(base, replace(base.plan, payload=other, rules=rules))


def _of_crane(base: Cell, change: Callable[[Crane], Crane]) -> Cell:
    return _with_plan(base, replace(base.plan, crane=change(base.plan.crane)), change)


def _stiffness(base: Cell, f: float) -> Cell:
    return _of_crane(base, lambda crane: _wire(crane, "E", f * crane.wire.E))


def _damping(base: Cell, zeta: float) -> Cell:
    return _of_crane(base, lambda crane: _wire(crane, "zeta", zeta))


def _wire(crane: Crane, name: str, value: float) -> Crane:
    return crane.model_copy(update={"wire": crane.wire.model_copy(update={name: value})})


def _friction(base: Cell, f: float) -> Cell:
    return _of_crane(base, lambda crane: _rubbing(crane, f))


def _rubbing(crane: Crane, f: float) -> Crane:
    system = crane.friction.system
    more = system.model_copy(update={name: f * getattr(system, name) for name in Y})
    return crane.model_copy(update={"friction": crane.friction.model_copy(update={"system": more})})


def _delay(base: Cell, t: float) -> Cell:
    return _with_plan(base, replace(base.plan, sensors=base.plan.sensors.model_copy(update={"delay": t})))


def _roll(base: Cell, f: float) -> Cell:
    return _with_plan(base, replace(base.plan, vessel=with_roll_damping(base.plan.vessel, f)))


def _phase(base: Cell, **update: Any) -> Cell:
    return _with_plan(base, replace(base.plan, phases=(base.phase.model_copy(update=update),)))


def _speed(base: Cell, f: float) -> Cell:
    """Another speed: its way takes another time, where the plan gives none that is longer."""
    speed, time = f * (base.phase.speed or 0.0), base.phase.time
    return _phase(base, speed=speed, time=None if time is None else time / f)


def _hold(base: Cell, f: float) -> Cell:
    time = f * (base.phase.time or 0.0)
    return _phase(base, time=time, **({"hold": time} if base.phase.held else {}))


def _column(base: Cell, Tp: float, beta: float) -> Cell:
    env = base.plan.environment.model_copy(update={"Tp": (Tp,), "headings": (beta,)})
    other = _with_plan(base, replace(base.plan, environment=env))
    return other._replace(column=(Tp, beta))


def _period(base: Cell, more: float) -> Cell:
    return _column(base, round(base.column[0] + more, 9), base.column[1])


def _heading(base: Cell, turn: float) -> Cell:
    return _column(base, base.column[0], (base.column[1] + turn) % (2.0 * math.pi))


def _governing(base: Cell) -> Limited:
    return next(each for each in limited(base.plan, base.phase, base.alternative) if each.rule.key == base.rule)


def _not_assumed(base: Cell) -> str:
    """Why the number of the rule that governs is no assumption; empty where it is one."""
    known = [each for each in limited(base.plan, base.phase, base.alternative) if each.rule.key == base.rule]
    if not known:
        return "no rule governs"
    if isinstance(known[0].rule.limit, str):
        return "its limit is a capacity"
    own = known[0].rule.standard == ASSUMED or base.rule in base.phase.limits
    return "" if own else f"it is of {known[0].rule.standard}"


def _limit_text(of: Limited, f: float) -> str:
    """So many times the limit of a rule, as a plan file writes it."""
    kind = BY_NAME[of.rule.quantity].kind
    return show(f * of.limit, kind, 6) if kind else f"{f * of.limit:.6g}"


def _rule(base: Cell, f: float) -> Cell:
    return _phase(base, limits={**base.phase.limits, base.rule: _limit_text(_governing(base), f)})


def _certificate(base: Cell, share: float) -> Cell | None:
    """Read from the plan's table."""
    return None


_MAKERS: Mapping[str, Callable[[Cell, float], Cell | None]] = {
    "mass": _mass,
    "C_A": _added_mass,
    "C_D": _drag,
    "EA": _stiffness,
    "zeta": _damping,
    "roll": _roll,
    "Tp": _period,
    "heading": _heading,
    "speed": _speed,
    "hold": _hold,
    "friction": _friction,
    "delay": _delay,
    "rule": _rule,
    "certificate": _certificate,
}
