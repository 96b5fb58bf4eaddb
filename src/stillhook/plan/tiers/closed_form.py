"""The first tier: demand of the phases by the closed forms of a standard, next to every simulation.

Largest motions of the tip are the most probable ones of half an hour, or of the phase where it is longer; the method
has no other level. What the winch leaves of them is all (no compensation, or a winch that does not follow), or what
the flat cap leaves: a twin has no closed form, and is credited as the cap.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.engine.pack.programme import hanging, payload_weight, wire_strength
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import (
    LEADS,
    along,
    at_deck,
    in_boom,
    jerk,
    off_other_vessel,
    places,
    static_tension,
    still_leads,
)
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.load_chart import CraneChart
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.result import Cause, cause
from stillhook.plan.tiers.frequency import forcing_at, quantiles
from stillhook.plan.tiers.other_vessel import deviations, hook_in_air, with_deck
from stillhook.plan.tiers.sideways import Answer, answers, in_air
from stillhook.response.forcing import OMEGA
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import wavenumber
from stillhook.sea.vessel.relative import sideways
from stillhook.spec.lift import simplified as sm
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import OFF_DECK, Phase, PhaseKind, WinchMode
from stillhook.spec.validity import CAP
from stillhook.statistics.extremes import largest_of_parts, most_probable_maximum, zero_crossing_period

Values = dict[str, FloatArray]

ON_THE_WAY = 41
"""Heights of a phase's way that are looked at."""
IN_THE_SURFACE = 161
"""Heights that are examined in addition where the surface cuts the payload: slamming acts over some tenths of a
metre."""
CALM = 1e-3
"""Height of the sea whose period a calm is given [m]."""
SLOPE = 1e-3
"""Depth over which slopes of a payload's numbers are taken, either way [m]."""


@dataclass(frozen=True, eq=False)
class Tip:
    """Of n seas, each (n,): zero-crossing period T_w of the waves [s]; deviations of the tip's height [m], speed and
    acceleration."""

    T_w: FloatArray = field(repr=False)
    z: FloatArray = field(repr=False)
    v: FloatArray = field(repr=False)
    a: FloatArray = field(repr=False)

    @property
    def T_z(self) -> FloatArray:
        """Zero-crossing period of the tip's height [s]; NaN where it is at rest."""
        return zero_crossing_period(self.z, self.v)

    @property
    def omega(self) -> FloatArray:
        """Frequency of the tip's motion [rad/s]; 1 where it is at rest."""
        return np.divide(self.v, self.z, out=np.ones_like(self.z), where=self.z > 0.0)

    def largest(self, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Most probable largest height [m], speed [m/s] and acceleration [m/s^2] over a time [s]."""
        T_v = zero_crossing_period(self.v, self.a)
        z, v = most_probable_maximum(self.z, self.T_z, duration), most_probable_maximum(self.v, T_v, duration)
        return z, v, most_probable_maximum(self.a, T_v, duration)


@dataclass(frozen=True, eq=False)
class Way:
    """Heights z of the underside along a phase's way (k, 1) [m], and what is there: F_top tension at the crane tip and
    W sling tension, at rest [N]; K stiffness of wire and slings [N/m]; above, mass of hook and a third of the wire
    [kg]; rho_V of displaced water, A33 [kg]; dA33 its slope over depth [kg/m]; A_w water-plane area [m^2]; B drag [N
    s^2/m^2]; U current [m/s]; d depth of the submerged part's centre [m].
    """

    z: FloatArray
    F_top: FloatArray
    W: FloatArray
    K: FloatArray
    above: FloatArray
    rho_V: FloatArray
    A33: FloatArray
    dA33: FloatArray
    A_w: FloatArray
    B: FloatArray
    U: FloatArray
    d: FloatArray


@dataclass(frozen=True, eq=False)
class Motions:
    """What moves payload and water in n seas: amplitudes eta [m], v [m/s], a [m/s^2] of the wire's upper end as the
    winch leaves it, omega its frequency [rad/s]; V speed of the way [m/s]; zeta amplitude [m] and T_w period [s] of the
    waves."""

    eta: FloatArray
    v: FloatArray
    a: FloatArray
    omega: FloatArray
    V: float
    zeta: FloatArray
    T_w: FloatArray


def closed_form(plan: LiftPlan, phase: Phase, seas: Seas, alternative: Alternative = Alternative.NONE) -> Demand:
    """What a phase asks in every sea by the simplified method (`stillhook.spec.lift.simplified`).

    In air: payload and hook on the wire as a spring, and the jerk of taking up the load. Through the surface: forces of
    the simplified method at stated submergences. Deeper: a payload on a spring with drag, resonance on the way
    included, and the waves down there. On the seabed: taking up the load with what the winch leaves of the tip's speed.
    Quantities that it does not know are left out.
    """
    residual = 1.0 if alternative.stands or not phase.compensated else 1.0 - CAP
    values = _values(plan.under(alternative), phase, seas, residual)
    return Demand(phase.name, alternative, Tier.CLOSED_FORM, seas, values)


@remembered
def _values(plan: LiftPlan, phase: Phase, seas: Seas, left: float) -> Values:
    """Quantities of a phase with what the winch leaves of the tip's motion, from 1 (all)."""
    tip, T, V = tip_motion(plan, phase, seas), duration_of(plan, phase), phase.speed or 0.0
    eta, v, _ = tip.largest(T)
    moved = _motions(plan, phase, seas, left)
    values: Values = {
        "F_top_static": np.full(len(seas), static_tension(plan, phase)),
        "v_tip_max": v,
        "s_tip_pp": 2.0 * eta,
    }
    values["v_w_demand"] = V + (v if phase.compensated else np.zeros(len(seas)))
    if phase.compensated:
        of, share = _left(plan, phase, seas, left)
        values["e_c_pp"] = 2.0 * share * of.largest(T)[0]
    values |= _OF_KIND.get(phase.kind, _under_water)(plan, phase, moved)
    level = quantiles(plan)
    values |= leads(plan, phase, seas, T, {name: level(name) for name in LEADS})
    if at_deck(plan, phase):
        values = with_deck(plan, phase, seas, T, values, left)
    return {name: np.where(np.isnan(tip.z), np.nan, x) for name, x in values.items()}


def duration_of(plan: LiftPlan, phase: Phase) -> float:
    """Time of which the tip's largest motions are [s]."""
    return max(phase.duration or 0.0, plan.rules.settings["duration_least"])


def _motions(plan: LiftPlan, phase: Phase, seas: Seas, left: float) -> Motions:
    """What moves payload and water, with what the winch leaves of the tip's motion, from 1 (all)."""
    tip, share = _left(plan, phase, seas, left)
    if phase.follows_deck:
        tip, share = Tip(tip.T_w, *hook_in_air(plan, phase, seas, left)), 1.0
    eta, v, a = tip.largest(duration_of(plan, phase))
    zeta = plan.rules.settings["zeta_a"] * plan.environment.H_m0(seas.Hs)
    return Motions(share * eta, share * v, share * a, tip.omega, phase.speed or 0.0, zeta, tip.T_w)


def _left(plan: LiftPlan, phase: Phase, seas: Seas, left: float) -> tuple[Tip, float]:
    """A motion and the part of it that the winch leaves, from 1 (all): the tip's, or where a heave filter loses some
    of it, the wire's end's, and all of it."""
    tip, at = tip_motion(plan, phase, seas), plan.tip_of(phase)
    forcing = forcing_at(plan.of_high, seas, at.x, at.y)
    if forcing.lost is None or left == 1.0:
        return tip, left
    remains = forcing.remaining(left)
    return Tip(tip.T_w, *(remains.deviation(order) for order in range(3))), 1.0


def valid(plan: LiftPlan, seas: Seas) -> NDArray[np.bool_]:
    """Whether the method holds in each sea (n,), T_z from 8.9 sqrt(Hs/g) to 13 s by default, and in a calm."""
    T_w, settings = wave_periods(plan, seas), plan.rules.settings
    H_m0 = plan.environment.H_m0(seas.Hs)
    inside = (sm.shortest_period(H_m0, settings["T_z_factor"]) <= T_w) & (settings["T_z_most"] >= T_w)
    return np.asarray((H_m0 == 0.0) | inside)


def remarks(plan: LiftPlan, seas: Seas) -> list[Cause]:
    """What a reader of the closed form should know, each with the phases that it is of."""
    out, alternatives = int(np.count_nonzero(~valid(plan, seas))), plan.alternatives
    least, most = (plan.rules.settings[name] for name in ("T_z_factor", "T_z_most"))
    moves = "" if plan.against is None else "-moves"
    deep = (PhaseKind.LOWERING, PhaseKind.DEEP, PhaseKind.STAND_OFF, PhaseKind.LANDING)
    surface = {"least": least, "most": most, "n": out, "of": len(seas)}
    twin, phc = any(a.twin for a in alternatives), Alternative.PHC in alternatives
    rows: list[tuple[str, dict[str, Any], Callable[[Phase], bool]]] = [
        ("range", surface, lambda p: out > 0 and p.kind is PhaseKind.SPLASH),
        ("twin", {"cap": CAP}, lambda p: twin and p.compensated),
        ("phc", {}, lambda p: phc),
        ("splash-mode", {}, lambda p: p.mode is WinchMode.SPLASH),
        ("deck", {}, lambda p: p.kind is PhaseKind.LIFT_OFF and not off_other_vessel(plan, p)),
        (f"other-vessel{moves}", {}, lambda p: p.on_other_vessel or off_other_vessel(plan, p)),
        ("platform", {}, lambda p: p.kind is PhaseKind.SET_DOWN_PLATFORM and not p.on_other_vessel),
        ("relative", {"cap": CAP}, lambda p: p.follows_deck),
        ("harmonic", {}, lambda p: p.kind in deep),
    ]
    result = [(code, values, [p.name for p in plan.phases if of(p)]) for code, values, of in rows]
    return [cause(f"closed-form-{code}", phases=phases, **values) for code, values, phases in result if phases]


def tip_motion(plan: LiftPlan, phase: Phase, seas: Seas) -> Tip:
    """What the seas do at the crane tip of a phase."""
    at = plan.tip_of(phase)
    return _tip(plan.of_high, seas, at.x, at.y)


@remembered
def _tip(plan: LiftPlan, seas: Seas, x: float, y: float) -> Tip:
    forcing = forcing_at(plan, seas, x, y)
    return Tip(wave_periods(plan, seas), *(forcing.deviation(order) for order in range(3)))


def wave_periods(plan: LiftPlan, seas: Seas) -> FloatArray:
    """Zero-crossing period of the waves T_m02 [s], (n,), of wind sea and swell together from the moments of their sum;
    that of a small sea for a calm."""
    pairs = zip(np.maximum(seas.Hs, CALM).tolist(), seas.Tp.tolist(), strict=True)
    return np.array([_wave_period(plan.of_high, H, T) for H, T in pairs])


@remembered
def _wave_period(plan: LiftPlan, Hs: float, Tp: float) -> float:
    if plan.environment.swell is None:
        return plan.environment.spectrum(Hs, Tp).T_m02
    sea = plan.environment.sea(Hs, Tp, 0.0)
    return 2.0 * math.pi * math.sqrt(sea.moment(0) / sea.moment(2))


@remembered
def way(plan: LiftPlan, phase: Phase) -> Way:
    """Heights of a phase's way, and what is there."""
    lift = plan.hanging(0.0, plan.tip_of(phase).z)
    load, rho, crane, current = plan.payload, plan.rho, plan.crane, plan.environment.current
    z = _heights(phase, load.reach(rho))
    still = [hanging(crane, lift, float(each)) for each in z]
    F_top, L = np.array([s.F_tip for s in still]), np.array([s.s_w for s in still])
    h = np.maximum(-z, 0.0)
    at, deeper, higher = (load.at(np.maximum(h + side, 0.0), rho) for side in (0.0, SLOPE, -SLOPE))
    wet = (z <= 0.0) & (h <= load.reach(rho))

    def slope(name: str) -> FloatArray:
        middle = getattr(at, name)
        return np.where(wet, np.maximum(getattr(deeper, name) - middle, middle - getattr(higher, name)) / SLOPE, 0.0)

    EA, _ = wire_strength(crane)
    columns = {
        "z": z,
        "F_top": F_top,
        "W": np.array([payload_weight(lift, float(each)) for each in z]),
        "K": 1.0 / ((crane.wire.L_0 + L) / EA + 1.0 / plan.rigging.stiffness),
        "above": crane.hook_mass + crane.wire.mass_per_length * L / 3.0,
        "rho_V": rho * at.V,
        "A33": at.A33,
        "dA33": slope("A33"),
        "A_w": slope("V"),
        "B": 0.5 * rho * max(load.C_D, plan.rules.settings["C_D_least"]) * at.A_p,
        "U": np.array([0.0 if current is None else current.past(each + 0.5 * load.height) for each in z.tolist()]),
        "d": np.where(h < load.height, 0.5 * h, h - 0.5 * load.height),
    }
    return Way(**{name: np.asarray(column, dtype=np.float64)[:, None] for name, column in columns.items()})


def _heights(phase: Phase, reach: float) -> FloatArray:
    """Heights on the way, from the highest down."""
    ends = [z for z in (phase.z_start, phase.z_end) if z is not None] or [0.0]
    low, high = min(ends), max(ends)
    z = np.linspace(high, low, ON_THE_WAY if high > low else 1)
    surface = np.linspace(0.0, -reach, IN_THE_SURFACE)
    both = np.concatenate((z, surface[(surface >= low) & (surface <= high)])) if phase.kind is PhaseKind.SPLASH else z
    return np.unique(both)[::-1]


def _in_air(plan: LiftPlan, phase: Phase, m: Motions) -> Values:
    w = way(plan, phase)
    s = sm.swing(m.eta, m.omega, w.K, plan.payload.mass, w.above)
    F = jerk(plan, phase, m.V)
    off = phase.kind in OFF_DECK  # its slings come taut: that they were slack is no fault
    values = _tensions(plan, w, s.top + F, s.sling + F, slack=not off) | {"load_pp": 2.0 * s.load.max(axis=0)}
    return values | ({"v_lift_off": np.zeros_like(m.v)} if off else {})


def _wave_zone(plan: LiftPlan, phase: Phase, m: Motions) -> Values:
    w = way(plan, phase)
    F, v_r = _hydrodynamic(plan, w, m)
    return _tensions(plan, w, F + w.above * m.a, F) | _snap(plan, w, F, v_r)


def _hydrodynamic(plan: LiftPlan, w: Way, m: Motions) -> tuple[FloatArray, FloatArray]:
    """Characteristic force on a payload in the wave zone [N], and the water's speed against it [m/s], (k, n) each."""
    v_w, a_w = (f(m.zeta, m.T_w, w.d) for f in (sm.water_speed, sm.water_acceleration))
    v_r = sm.relative_speed(m.V, m.v, v_w)
    F_M = sm.mass_force(plan.payload.mass, w.A33, w.rho_V, m.a, a_w)
    F_rho = sm.buoyancy_force(plan.rho, w.A_w, m.zeta, m.eta)
    return sm.hydrodynamic(sm.drag(w.B, v_r, w.U), sm.slamming(w.dA33, v_r), F_M, F_rho), v_r


def slings_held(plan: LiftPlan, phase: Phase, seas: Seas) -> tuple[FloatArray, FloatArray]:
    """Heights of a phase's way in the wave zone (k,) [m], and the least sling tension of a payload that is held there
    for its duration, (k, n) [N]; negative where the slings fall slack."""
    w, m = way(plan, phase), _motions(plan, phase, seas, 1.0)
    return w.z[:, 0], w.W - _hydrodynamic(plan, w, m)[0]


def _under_water(plan: LiftPlan, phase: Phase, m: Motions) -> Values:
    w = way(plan, phase)
    s = sm.swing(m.eta, m.omega, w.K, plan.payload.mass + w.A33, w.above, w.B, plan.payload.C_lin)
    v_w, a_w = (f(m.zeta, m.T_w, w.d) for f in (sm.water_speed, sm.water_acceleration))
    F_w = np.hypot(sm.drag(w.B, v_w, w.U), (w.rho_V + w.A33) * a_w)
    sling = np.hypot(s.sling, F_w)
    values = _tensions(plan, w, np.hypot(s.top, F_w), sling) | _snap(plan, w, sling, sm.relative_speed(m.V, m.v, v_w))
    values["load_pp"] = 2.0 * s.load.max(axis=0)
    if phase.kind is PhaseKind.LANDING:
        values["v_landed"] = m.V + m.omega * s.load[-1]
    return values


def _off_the_seabed(plan: LiftPlan, phase: Phase, m: Motions) -> Values:
    w = way(plan, phase)
    resistance = plan.payload.lift_off.friction + plan.payload.lift_off.suction
    F = jerk(plan, phase, 1.0) * (m.V + m.v)[None, :]  # proportional to the speed
    return _tensions(plan, w, F + resistance, F + resistance, slack=False) | {"v_lift_off": m.v}


_OF_KIND: Mapping[PhaseKind | None, Callable[[LiftPlan, Phase, Motions], Values]] = {
    **dict.fromkeys(IN_AIR, _in_air),
    PhaseKind.SPLASH: _wave_zone,
    PhaseKind.SEABED_LIFT_OFF: _off_the_seabed,
}


def _tensions(plan: LiftPlan, w: Way, top: FloatArray, sling: FloatArray, *, slack: bool = True) -> Values:
    """Tensions of a way from the amplitudes of what comes on top of rest, (k, n) [N]. The least static tension is that
    of the whole way; the DAF is over the weight of the high case, which rigging is designed for."""
    weight = plan.of_high.payload.mass * G
    values = {"F_top_max": (w.F_top + top).max(axis=0), "DAF": (w.W + sling).max(axis=0) / weight}
    return values | ({"sling_ratio": 1.0 - sling.max(axis=0) / w.W.min()} if slack else {})


def _snap(plan: LiftPlan, w: Way, sling: FloatArray, v_r: FloatArray) -> Values:
    """Snap load where slings come slack: the payload sinks as fast as when covered, and is caught by the wire."""
    v_ff = sm.free_fall_speed(w.W.min(), float(w.B.max())) if w.B.max() > 0.0 else np.zeros(())
    F = sm.snap_tension(w.W, sm.snap_speed(v_ff, v_r), w.K, plan.payload.mass + w.A33)
    return {"snap_load": np.where(sling > w.W, F, 0.0).max(axis=0)}


LENGTHS = 5
"""Lengths of the pendulum that are looked at where the load moves up or down."""


def leads(
    plan: LiftPlan, phase: Phase, seas: Seas, duration: float, quantile: Mapping[str, float]
) -> dict[str, FloatArray]:
    r"""Largest off-lead and side-lead (n,) [rad], the wire's angle in the plane of the boom and across it, of a phase
    in seas over a duration [s], each with its probability of staying below; empty where they are not determined.

    The load is a pendulum of one degree of freedom under a tip that moves sideways, the crane heels with the vessel:

    .. math:: \theta = \frac{\omega^2}{\omega_0^2 - \omega^2 + 2 i \zeta \omega_0 \omega} \frac{X}{L}, \quad
              \omega_0 = \sqrt{g/L}, \quad \text{lead} = (\theta_x + \eta_5)\,\hat x + (\theta_y - \eta_4)\,\hat y

    the largest over the lengths L on the way. Static heel and trim are added, each as a magnitude. Valid for small
    angles, a load in air whose tug lines are slack, a tip whose height counts from the vessel's reference point at the
    waterline. With a wind, what the load swings in its gusts is added. Under water, with a current, the wire is at rest
    in it and swings as a chain of masses under tip and waves (`stillhook.plan.tiers.sideways`). Not determined in the
    wave zone, nor where only the radius of the tip is known.
    """
    used, tip = plan.load_chart, plan.tip_of(phase)
    if used is None or not used.judges_leads(phase, plan.environment.current):
        return {}
    still = still_leads(plan, phase)
    largest = {name: np.full(len(seas), still[name]) for name in LEADS}
    for answer in _answers(plan, phase, tip, OMEGA):
        transfer = partial(_transfer, plan, used, tip, answer=answer)
        for name, (sigma, rate) in deviations(plan.environment, seas, transfer).items():
            T = zero_crossing_period(sigma, rate)
            cycles = duration / np.where(np.isnan(T), np.inf, T)
            value = still[name] + largest_of_parts(0.0, sigma[None], cycles[None], quantile[name])
            largest[name] = np.maximum(largest[name], value)
    return largest


def _answers(plan: LiftPlan, phase: Phase, tip: TipPoint, omega: FloatArray) -> Sequence[Answer]:
    """What the wire's angle answers with at omega (k,), along a phase's way."""
    if phase.kind not in IN_AIR:
        return answers(plan, phase, along(phase), omega)
    assert plan.load_chart is not None
    return [in_air(float(L), plan.load_chart.swing_damping, omega) for L in _lengths(plan, phase, tip)]


def _lengths(plan: LiftPlan, phase: Phase, tip: TipPoint) -> FloatArray:
    """Lengths from the tip to the middle of the payload along a phase's way [m]."""
    assert tip.z is not None
    hangs = [tip.z - z - 0.5 * plan.payload.height for z in places(phase)]
    return np.unique(np.linspace(min(hangs), max(hangs), LENGTHS))


def _transfer(
    plan: LiftPlan, used: CraneChart, tip: TipPoint, omega: FloatArray, beta: FloatArray, answer: Answer
) -> dict[str, ComplexArray]:
    """Leads per metre of wave (j, k) at headings (j,) and frequencies (k,) [rad/m]."""
    assert tip.z is not None
    psi = used.direction_of(tip)
    assert psi is not None
    motions = plan.vessel.at(omega, beta)
    X, Y = sideways(motions, tip.x, tip.y, tip.z)
    forward, port = answer.tip * X + motions[4], answer.tip * Y - motions[3]
    if answer.wave is not None:
        along = tip.x * np.cos(beta) + tip.y * np.sin(beta)
        wave = answer.wave * np.exp(-1j * np.outer(along, wavenumber(omega, plan.depth)))
        forward, port = forward + np.cos(beta)[:, None] * wave, port + np.sin(beta)[:, None] * wave
    return in_boom(forward, port, psi)
