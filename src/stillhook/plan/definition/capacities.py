"""What crane and winch can give in a phase: capacities that rules name, and what a phase asks in still water."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.kept import ROOM, kept
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import CLASSIC, MANUAL_MODE
from stillhook.engine.pack.capacity import tip_capacity
from stillhook.engine.pack.programme import Hanging, hanging, payload_weight, wire_strength
from stillhook.engine.pack.winch import wire_speed_max
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.errors import PlanError
from stillhook.physics.scalar import G
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.load_chart import ChartPoint, ChartType
from stillhook.plan.definition.rules import QUANTITIES, Alternative
from stillhook.response.sideways import Line, WireShape, gust_factor, pendulum, wire_shape
from stillhook.sea.steady_flow import T_MEAN
from stillhook.spec.lift.joining import IN_AIR, UNDER_WATER
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase, PhaseKind, called
from stillhook.spec.lift.rigging import Carrier, DAF_in_air
from stillhook.spec.lift.simplified import taken_up
from stillhook.units import show


class CapacityValue(NamedTuple):
    """A capacity [SI] and what it is of, in words; by_Hs: of one that depends on the sea, as
    `stillhook.plan.definition.rules.Limited.by_Hs`."""

    value: float
    basis: str
    by_Hs: tuple[tuple[float, float], ...] = ()

    def times(self, factor: float) -> CapacityValue:
        """The capacity times a factor."""
        by_Hs = tuple((Hs, factor * value) for Hs, value in self.by_Hs)
        return CapacityValue(factor * self.value, f"{factor:g} x {self.basis}", by_Hs)


class Capacity(NamedTuple):
    """kind of `stillhook.units.KINDS`; meaning in words; find: its value for a phase under an alternative, None where
    there is none."""

    kind: str
    meaning: str
    find: Callable[[LiftPlan, Phase, Alternative], CapacityValue | None]


def places(phase: Phase) -> tuple[float, ...]:
    """Heights of the underside for the statics of a phase [m]: start, end, and the surface where it goes through it."""
    ends = [z for z in (phase.z_start, phase.z_end) if z is not None] or [0.0]
    crossing = [0.0] if min(ends) < 0.0 < max(ends) else []
    return tuple(dict.fromkeys([*ends, *crossing]))


def at_rest(plan: LiftPlan, phase: Phase, z: float) -> Hanging:
    """What hangs still with the underside at z [m], below the crane tip of the phase."""
    return hanging(plan.crane, plan.hanging(z, plan.tip_of(phase).z), z)


def static_tension(plan: LiftPlan, phase: Phase) -> float:
    """Largest tension at the crane tip at rest on a phase's way [N]; off the seabed with skirt friction and suction."""
    off = plan.payload.lift_off if phase.kind is PhaseKind.SEABED_LIFT_OFF else None
    F = max(at_rest(plan, phase, z).F_tip for z in places(phase))
    return F if off is None else F + (off.friction + off.suction)


def off_other_vessel(plan: LiftPlan, phase: Phase) -> bool:
    """Whether a phase lifts the payload off the deck of another vessel."""
    plain = phase.kind is PhaseKind.LIFT_OFF and plan.gear.carrier is Carrier.VESSEL
    return plain or phase.kind is PhaseKind.LIFT_OFF_BARGE


def at_deck(plan: LiftPlan, phase: Phase) -> bool:
    """Whether a phase begins or ends on a deck that moves otherwise than the crane vessel."""
    return phase.kind in APART or off_other_vessel(plan, phase)


def jerk(plan: LiftPlan, phase: Phase, v: float) -> float:
    """Tension on top of rest as the payload is lifted off with the hook at v against what carries it [N]; 0 in other
    phases."""
    lifts = phase.kind in (*OFF_DECK, PhaseKind.SEABED_LIFT_OFF)
    return max(float(taken_up(0.0, v, K, m)) for K, m in springs(plan, phase)) if lifts else 0.0


def springs(plan: LiftPlan, phase: Phase) -> list[tuple[float, float]]:
    """What takes up the load over a phase's way: stiffness [N/m], and mass [kg] that hangs on it.

    Wire and slings as a spring (`stillhook.spec.lift.simplified.taken_up`); added mass on the seabed.
    """
    crane, load = plan.crane, plan.payload
    A33 = load.covered(plan.rho).A33 if phase.kind is PhaseKind.SEABED_LIFT_OFF else 0.0
    EA, _ = wire_strength(crane)
    lengths = [at_rest(plan, phase, z).s_w for z in places(phase)]
    return [(1.0 / ((crane.wire.L_0 + L) / EA + 1.0 / plan.rigging.stiffness), load.mass + A33) for L in lengths]


def calm(plan: LiftPlan, phase: Phase) -> Mapping[str, float]:
    """What a phase asks in still water: quantity -> value in SI; the same under every alternative. Pressures are left
    out; lifting off takes up the load at the hoisting speed."""
    F, v = static_tension(plan, phase), phase.speed or 0.0
    F_jerk = jerk(plan, phase, v)
    F_sling = max(payload_weight(plan.hanging(z), z) for z in places(phase))
    return {q.name: q.still for q in QUANTITIES.values() if q.still is not None} | {
        "F_top_static": F,
        "F_top_max": F + F_jerk,
        "DAF": (F_sling + F_jerk) / (plan.of_high.payload.mass * G),
        "v_w_demand": v,
        "v_landed": 0.0 if phase.kind in OFF_DECK else v,
        "deck_tilt": plan.gear.tilt,
        **still_leads(plan, phase),
    }


DEPTHS = 5
"""Heights of a phase's way at which its wire is looked at."""


def along(phase: Phase) -> tuple[float, ...]:
    """Heights of the underside along a phase's way, rising [m]."""
    z = places(phase)
    return tuple(np.unique(np.linspace(min(z), max(z), DEPTHS)).tolist())


LEADS = ("off_lead", "side_lead")
"""Quantities that are the lead of the wire."""


def wire_line(plan: LiftPlan, phase: Phase, z: float) -> Line:
    """The wire of a plan with a current, the underside of the payload at z [m]."""
    current, still, wire = plan.environment.current, at_rest(plan, phase, z), plan.crane.wire
    assert current is not None
    assert current.area is not None
    h_tip, w = plan.tip_of(phase).z or plan.h_tip, wire.mass_per_length * G
    _, steel = wire_strength(plan.crane)
    return Line(
        z=h_tip - still.s_w - still.stretch,
        h_tip=h_tip,
        F_hook=still.F_hook,
        w=w - plan.rho * steel * G,
        w_air=w,
        B=0.5 * plan.rho * current.C_D_wire * wire.d,
        B_load=0.5 * plan.rho * current.C_D * current.area,
        z_load=z + 0.5 * plan.payload.height,
    )


@remembered
def in_current(plan: LiftPlan, phase: Phase, z: float) -> WireShape:
    """The wire at rest in the plan's current. Errors: PlanError where it is carried away too far."""
    assert plan.environment.current is not None
    shape = wire_shape(wire_line(plan, phase, z), plan.environment.current.velocity)
    if shape is None:
        raise PlanError(
            f"{called(phase)}: environment.current holds the wire more than 60 deg off the vertical with the underside"
            f" {show(-z, 'length')} down. Check speed, area and C_D."
        )
    return shape


def flow_notes(plan: LiftPlan) -> tuple[str, ...]:
    """Current and wind of a plan in words. Errors: PlanError for a current that is not known down to the seabed, or too
    strong for a wire."""
    current, wind = plan.environment.current, plan.environment.wind
    if current is not None:
        if problem := current.short_of(plan.depth):
            raise PlanError(f"environment.current.depth: {problem}")
        for case in (plan, plan.low or plan):
            for phase in plan.phases:
                for z in along(phase) if phase.kind in UNDER_WATER else ():
                    in_current(case, phase, z)
    return tuple(flow.describe() for flow in (current, wind) if flow is not None)


def wind_lead(plan: LiftPlan, phase: Phase, z: float, *, gust: bool = True) -> FloatArray:
    """Angle of the wire (2,) [rad] in the plan's wind, towards the load, underside at z [m]: at rest in the mean, or
    the largest of the swing in a gust."""
    wind, still = plan.environment.wind, at_rest(plan, phase, z)
    assert wind is not None
    middle = z + 0.5 * plan.payload.height
    force = wind.force(middle)
    factor = 1.0
    if gust:
        below = plan.rigging.height + 0.5 * plan.payload.height
        wire = (plan.tip_of(phase).z or plan.h_tip) - middle - below
        T_n = float(pendulum(wire, plan.crane.hook_mass, below, plan.payload.mass).periods[0])
        factor = gust_factor(lambda T: wind.at(middle, T) ** 2, T_n, wind.gust, T_MEAN)
    return np.asarray(np.arctan(factor * force / still.F_tip))


def flow_lead(plan: LiftPlan, phase: Phase, z: float) -> FloatArray:
    """Angle of the wire at the tip by wind in air and by the current under water (2,) [rad], towards the load."""
    if phase.kind in IN_AIR and plan.environment.wind is not None:
        return wind_lead(plan, phase, z)
    if phase.kind in UNDER_WATER and plan.environment.current is not None:
        return in_current(plan, phase, z).lead()
    return np.zeros(2)


def in_boom(forward: Any, port: Any, psi: float) -> dict[str, Any]:
    """off_lead and side_lead of what goes forward and to port, with the boom at psi [rad]: along it, and across."""
    c, s = math.cos(psi), math.sin(psi)
    return {"off_lead": forward * c + port * s, "side_lead": port * c - forward * s}


@remembered
def still_leads(plan: LiftPlan, phase: Phase) -> dict[str, float]:
    """off_lead and side_lead of a phase in still water [rad]: heel and trim, and on top the worst of wind or current on
    its way; empty where the direction of the boom is not known."""
    tip = plan.tip_of(phase)
    still = {} if plan.load_chart is None else plan.load_chart.static_leads(tip)
    psi = None if plan.load_chart is None else plan.load_chart.direction_of(tip)
    if psi is None or (plan.environment.wind is None and plan.environment.current is None):
        return still
    flows = [in_boom(x, y, psi) for x, y in (flow_lead(plan, phase, z) for z in along(phase))]
    return {name: still[name] + max(abs(float(flow[name])) for flow in flows) for name in LEADS}


def _swl_tip(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue:
    crane = plan.crane
    hook = f"hook {show(crane.hook_mass, 'mass')} of {crane.name}, at the crane tip"
    if plan.load_chart is not None:
        return _of_chart(plan, phase, "SWL", "mass", lambda p: (p.SWL + crane.hook_mass) * G, f"; and {hook}")
    return CapacityValue(tip_capacity(crane), f"SWL {show(crane.SWL, 'mass')} and {hook}")


def _swl(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue:
    if plan.load_chart is not None:
        return _of_chart(plan, phase, "SWL", "mass", lambda p: p.SWL * G)
    return CapacityValue(plan.crane.SWL * G, f"SWL {show(plan.crane.SWL, 'mass')} of {plan.crane.name}")


def _swl_dynamic(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue:
    """SWL and hook times the dynamic factor that chart or maker state, 1 where nobody does."""
    static, stated, chart = _swl_tip(plan, phase, alternative), plan.statement, plan.load_chart
    if chart is None or not chart.states_factor:
        if stated is not None:
            more = static.times(stated.dynamic_factor)
            return more._replace(basis=f"{more.basis}; factor by {stated.statement}")
        dynamic = chart is not None and chart.type is ChartType.DYNAMIC
        why = "the chart is dynamic" if dynamic else "no dynamic factor is stated"
        return static._replace(basis=f"{static.basis}; {why}")
    points = chart.at(plan.tip_of(phase))
    factors = [p.DAF or 1.0 for p in points]
    values = [factor * (p.SWL + plan.crane.hook_mass) * G for factor, p in zip(factors, points, strict=True)]
    least, most = min(factors), max(factors)
    words = f"{least:.3g}" if math.isclose(least, most) else f"{least:.3g} to {most:.3g}"
    by_Hs = tuple(zip((p.Hs for p in points), values, strict=True)) if static.by_Hs else ()
    return CapacityValue(values[0], f"DAF {words} of the load chart x {static.basis}", by_Hs)


def _DAF_air(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue:
    """Design DAF of rigging and lift points in air: stated, else by carrier and static hook load."""
    gear = plan.gear
    if gear.DAF_air is not None:
        return CapacityValue(gear.DAF_air, f"design DAF in air of the rigging, {gear.source}")
    m = plan.of_high.payload.mass
    where = {Carrier.OWN_DECK: "own deck", Carrier.VESSEL: "another vessel", Carrier.ONSHORE: "onshore"}[gear.carrier]
    basis = f"0027/ND Rev 11 table 5-1, {where}, static hook load {show(m, 'mass')}"
    return CapacityValue(DAF_in_air(m, gear.carrier), basis)


def _lead(name: str) -> Callable[[LiftPlan, Phase, Alternative], CapacityValue | None]:
    """Limit of side-lead or off-lead; None without a load chart that has one."""

    def find(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue | None:
        if plan.load_chart is None or getattr(plan.load_chart.at(plan.tip_of(phase))[0], name) is None:
            return None
        return _of_chart(plan, phase, name.replace("_", "-"), "angle", lambda p: float(getattr(p, name)))

    return find


def _of_chart(
    plan: LiftPlan, phase: Phase, name: str, kind: str, value: Callable[[ChartPoint], float], more: str = ""
) -> CapacityValue:
    """A number of the load chart at the radius of a phase, by height where the chart has heights."""
    assert plan.load_chart is not None
    tip = plan.tip_of(phase)
    points, radius = plan.load_chart.at(tip), show(plan.load_chart.radius_of(tip), "length")
    values, where = [value(p) for p in points], f"{plan.load_chart.chart.name}, radius {radius}{more}"
    shown = [show(getattr(p, name.replace("-", "_")), kind) for p in points]
    if not (points and math.isfinite(points[-1].Hs)):
        return CapacityValue(values[0], f"{name} {shown[0]} of {where}")
    highest = {text: show(p.Hs, "length") for text, p in zip(shown, points, strict=True)}
    steps = ", ".join(f"{text} up to Hs {Hs}" for text, Hs in highest.items())
    by_Hs = tuple(zip((p.Hs for p in points), values, strict=True))
    return CapacityValue(values[0], f"{name} {steps}, none above, of {where}", by_Hs)


def _weight(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue:
    m = plan.of_high.payload.mass
    return CapacityValue(m * G, f"weight of {plan.payload.name} in air, {show(m, 'mass')}")


def _p_relief(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue | None:
    if "active" not in plan.crane.circuits:
        return None
    p = plan.crane.active.relief.p
    return CapacityValue(p, f"relief valves of the active circuit, {show(p, 'pressure')}")


def _speed(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue | None:
    if phase.speed is None:
        return None
    return CapacityValue(phase.speed, f"planned wire speed of {phase.name}, {show(phase.speed, 'speed')}")


def _stroke(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue | None:
    """Motion of the tip that takes the stroke of what carries the phase's tension, such as an accumulator."""
    F = static_tension(plan, phase)
    stroke = plan.crane.plant.type.stroke(plan.crane, F)
    if stroke is None:
        return None
    return CapacityValue(stroke.length, f"{stroke.basis}, with {show(F, 'force')} at the tip")


def _v_top(plan: LiftPlan, phase: Phase, alternative: Alternative) -> CapacityValue | None:
    """Highest steady wire speed under the alternative's controller, the least over the phase's way and both ways."""
    if not phase.compensated:
        return _slowest(plan, phase, "manual")
    if alternative.stands:
        return None
    if alternative is Alternative.CAP:
        modes = [mode for mode in CLASSIC if mode in plan.crane.plant.type.modes]
        if not modes:
            return _slowest(plan, phase, str(plan.crane.plant.type.default_mode))
        best = max((_slowest(plan, phase, str(mode)) for mode in modes), key=lambda f: f.value)
        return CapacityValue(best.value, f"{best.basis} (the faster classic mode)")
    return _slowest(plan, phase, str(alternative))


def _slowest(plan: LiftPlan, phase: Phase, name: str) -> CapacityValue:
    still = [at_rest(plan, phase, z) for z in places(phase)]
    return min((_top(plan, s.F_tip, s.s_w, name) for s in still), key=lambda top: top.value)


ROOMS = (ROOM, "plan/definition")
"""Folders whose code makes the speeds that are kept."""


@remembered
def _top(plan: LiftPlan, F: float, s_w: float, name: str) -> CapacityValue:
    """`_top_speed`, kept on disk: it takes a tenth of a second."""
    question = ("v_top", F, s_w, name)
    of = plan.machine(Alternative(name))[0] if name in plan.controllers else plan.crane
    return CapacityValue(*kept(of, question, lambda: _top_speed(plan, F, s_w, name)[:2], ROOMS))


def _top_speed(plan: LiftPlan, F: float, s_w: float, name: str) -> CapacityValue:
    """Highest steady wire speed with a tension F [N] at the tip and s_w of wire out [m], hoisting or lowering, and what
    stops it; 0 where the mode may not be used. Of a winch type without steady operating points: that at full
    command."""
    crane, mode = (plan.crane, MANUAL_MODE) if name == MANUAL_MODE else plan.machine(Alternative(name))
    load = F / G - crane.hook_mass  # the wire hangs as payload does
    where = f"{name} at {show(F, 'force')} at the tip and {show(s_w, 'length')} of wire out"
    if load > crane.SWL:
        return CapacityValue(0.0, f"{where}: more than the SWL")
    if hasattr(crane.plant.type.module, "speed_limit"):
        from stillhook.analysis.steady.limits import Direction, top_of_drive  # heavy

        of_drive = [top_of_drive(crane, load, s_w, direction) for direction in Direction]
        v, _, binds = min(of_drive, key=lambda top: top.v_w)
        return CapacityValue(v, f"{where}: {show(v, 'speed')}, stopped by {binds}")
    if not crane.plant.type.steady_operation:
        v = wire_speed_max(crane, 1.0, layer_diameter_at(crane, s_w))
        return CapacityValue(v, f"{where}: {show(v, 'speed')}, the speed at full command")
    from stillhook.analysis.steady.limits import Direction, Station  # heavy: only where no speed is kept

    tops = [Station(crane, load, s_w, direction).top_of_mode(mode) for direction in Direction]
    slow = next((top for top in tops if math.isnan(top.v_w)), None) or min(tops, key=lambda top: top.v_w)
    if math.isnan(slow.v_w):
        return CapacityValue(0.0, f"{where}: {name} may not be used, for {slow.binds}")
    return CapacityValue(slow.v_w, f"{where}: {show(slow.v_w, 'speed')}, stopped by {slow.binds}")


CAPACITIES: Mapping[str, Capacity] = {
    "SWL_tip": Capacity("force", "weight of SWL and hook, at the crane tip", _swl_tip),
    "SWL": Capacity("force", "weight of the SWL", _swl),
    "SWL_dynamic": Capacity(
        "force",
        "SWL_tip times the dynamic factor that the load chart or a statement of the maker gives; SWL_tip without one",
        _swl_dynamic,
    ),
    "DAF_air": Capacity(
        "", "design DAF of rigging and lift points in air: stated, or 0027/ND table 5-1 by carrier and weight", _DAF_air
    ),
    "payload_weight": Capacity("force", "weight of the payload in air", _weight),
    "v_top": Capacity(
        "speed", "highest steady wire speed at the phase's load and layer under the alternative's controller", _v_top
    ),
    "v_plan": Capacity("speed", "planned wire speed of the phase", _speed),
    "p_relief": Capacity("pressure", "setting of the active circuit's relief valves", _p_relief),
    "s_stroke": Capacity(
        "length", "tip motion that takes the accumulator's whole stroke at the phase's tension", _stroke
    ),
    "side_lead_chart": Capacity("angle", "side-lead that the load chart allows", _lead("side_lead")),
    "off_lead_chart": Capacity("angle", "off-lead that the load chart allows", _lead("off_lead")),
}
"""Names that the limit of a rule may have, with or without a factor: "1.3 x SWL_tip"."""
