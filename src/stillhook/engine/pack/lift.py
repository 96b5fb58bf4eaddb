"""A crane and a lowering as records and rows that the compiled kernels read, everything hanging at rest.

What a winch carries in addition to hook and payload: the wire between crane tip and hook.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.plc import MANUAL
from stillhook.control.registry import code_of
from stillhook.control.supervisor import Watch, supervisor_at_rest
from stillhook.engine.pack.payload import COLUMNS, pack_payload, wetted_at
from stillhook.engine.pack.programme import (
    Programme,
    hanging,
    link_buoyancy,
    pack_programme,
    static_stroke,
    wire_strength,
)
from stillhook.engine.pack.winch import Packed, pack
from stillhook.errors import LiftError
from stillhook.physics.load_path.deck import Deck
from stillhook.physics.load_path.drum import Load, Wire
from stillhook.physics.load_path.payload import LEVELS, Heights, Payload, Water, WettedLevel, heights, submergence
from stillhook.physics.load_path.rope import Element, Rope, Sling, element, element_weight
from stillhook.physics.scalar import G
from stillhook.sea.steady_flow import Current
from stillhook.sea.vessel.realisation import WaveField
from stillhook.spec.crane import Crane
from stillhook.spec.lift import deck as spec
from stillhook.spec.lift.deck import reference_of
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import WinchMode
from stillhook.spec.scenario import RHO_SEA, Operator, Scenario
from stillhook.winches.load_path.current import Knot
from stillhook.winches.load_path.lift import Course, Hanging, Lift, Works
from stillhook.winches.load_path.payload import NEVER, Body, Field, level_of
from stillhook.winches.load_path.registry import joint_of
from stillhook.winches.load_path.wire import Hook
from stillhook.winches.load_path.wire import Wire as LongWire

FIXED = 1.0e12
"""Factor on stiffness and length that keeps the plant's wire, the part from drum to crane tip, as it is however much
wire is out."""
STILL_WATER = Field(z_w=1.0, i_ds=1.0, last=1.0)


class PackedLift(NamedTuple):
    """Plant and its records with the wire from drum to tip as wire; lift; memory before the first cycle; displacements
    (n + 2,) [m] and weights (n + 1,) [N] of the wire's nodes, the last displacement that of the payload; table of the
    payload and its added mass at the start [kg]; programme; F_sling tension of the slings at the start [N]; link:
    compensator above them, deck: below the payload, current: `Knot`s of its profile in the columns of the table, None
    where there is none."""

    winch: Packed
    lift: Lift
    hang: Hanging
    q: FloatArray
    weights: FloatArray
    table: FloatArray
    m_a: float
    programme: Programme
    F_sling: float
    link: Any
    deck: Deck | None = None
    current: FloatArray | None = None

    @property
    def rows(self) -> FloatArray:
        """Table of the payload, and below it that of the current."""
        return self.table if self.current is None else np.vstack([self.table, self.current])


def current_rows(current: Current) -> FloatArray:
    """Knots of a current's profile, as many rows as a payload has levels, the ones beyond the last at no depth.
    Errors: LiftError for a profile of more."""
    h, n = np.array(current.depth), len(current.depth)
    if n >= LEVELS:
        raise LiftError(f"current.depth: {n} depths, and a run takes at most {LEVELS - 1}. Leave some out.")
    U = np.broadcast_to(current.speed, n)
    rows = np.zeros((LEVELS, len(COLUMNS)))
    rows[:, 0] = NEVER
    rows[:n, : len(Knot._fields)] = np.column_stack((h, U, np.append(np.diff(U) / np.diff(h), 0.0)))
    return rows


def stand_in(crane: Crane, case: Lowering, s_w: float) -> Scenario:
    """The run of the same winch that `pack` and `Drive` know: tip, sensors, PLC, times; the load is not read from
    it."""
    return Scenario.model_construct(
        name=case.name,
        load=case.payload.mass + case.link_mass,
        s_w=s_w,
        tip=reference_of(case.tip, case.deck, case.sensors.seed),
        mode=case.controller,
        duration=case.duration,
        ramp=case.ramp,
        warm_up=0.0,
        operator=Operator(),
        sensors=case.sensors,
        friction=case.friction,
    )


def rope_record(crane: Crane, case: Lowering, M: float) -> Rope:
    """The wire below the tip; M mass of hook and payload [kg]."""
    EA, steel = wire_strength(crane)
    mu = crane.wire.mass_per_length
    return Rope(
        EA=EA,
        mu=mu,
        w_air=mu * G,
        w_water=(mu - case.rho * steel) * G,
        zeta=crane.wire.zeta,
        h_tip=case.h_tip,
        L_0=crane.wire.L_0,
        M=M,
        n=float(case.wire.nodes),
    )


def deck_record(deck: spec.Deck, load: Payload) -> Deck:
    """A deck under a payload, before it moves."""
    k, c = deck.spring(load.W, load.m)
    return Deck(s=0.0, v=0.0, a=0.0, z=deck.height, k=k, c=c, followed=float(deck.followed))


def field_record(waves: WaveField | None) -> Field:
    return STILL_WATER if waves is None else Field(waves.z_0, 1.0 / waves.ds, waves.w.shape[1] - 1.0)


def at_rest(s_tip: float, k_0: float, weights: FloatArray, F_hook: float, e: Element, stretch: float) -> FloatArray:
    """Displacements [m] of nodes and payload under their own weights, from the crane tip down; k_0 stiffness from drum
    to tip [N/m], F_hook pull at the hook [N], stretch of what joins it to the payload [m]."""
    below = F_hook + np.cumsum(weights[::-1])[::-1]
    nodes = s_tip - below[0] / k_0 - np.concatenate([[0.0], np.cumsum(below[1:]) / e.k])
    return np.append(nodes, nodes[-1] - stretch)


def pack_lift(crane: Crane, case: Lowering, s_tip: float, field: Field) -> PackedLift:
    """Records of one lowering; s_tip height of the tip at the start [m], field levels of its water. Errors: LiftError
    of a programme that cannot be."""
    programme = pack_programme(crane, case)
    z_0, slack = case.z_0, None
    if case.deck is not None and case.deck.slack is not None:
        z_0, slack = case.z_0 - case.deck.settlement, case.deck.slack
    s_w = hanging(crane, case, z_0, slack).s_w
    load, table = pack_payload(case.payload, case.rho, case.depth)
    if case.deck is not None:  # in air at any height
        table = np.where(np.arange(table.shape[1]) == 0, table, 0.0)
    wet = wetted_at(submergence(case.z_0, 0.0, load.reach), table)
    m_s, r = load.m, case.rigging
    sling = Sling(k=r.stiffness, c=2.0 * r.zeta * math.sqrt(r.stiffness * m_s))
    hook, link, own = Hook(crane.hook_mass, crane.hook_mass * G), None, 0.0
    unit = case.compensator
    if unit is not None:
        link, (upper, lower) = unit.pack(sling.k, case.rho, case.payload.height + r.height), unit.masses
        hook = Hook(hook.m + upper, hook.W + upper * G)
        load = load._replace(m=load.m + lower, W=load.W + lower * G)
        own = unit.mass - sum(unit.masses)
    rope = rope_record(crane, case, hook.m + load.m + own)
    e, n = element(s_w, wet.A33, rope), case.wire.nodes
    parts = np.array([element_weight(float(i), e.l, rope) for i in range(n)])
    weights = 0.5 * (np.append(parts, 0.0) + np.append(0.0, parts))
    weights[-1] += hook.W
    F_sling = load.W - load.rho * load.g * wet.V if slack is None else 0.0
    F_hook = F_sling + (own * G - link_buoyancy(case, case.z_0))
    F_top = F_hook + float(weights.sum())

    k_0 = rope.EA / crane.wire.L_0
    settings = programme.settings
    lift = Lift(
        rope=rope,
        sling=sling,
        hook=hook,
        load=load,
        settings=settings,
        field=field,
        z_ref=0.0,
        t_cycle=settings.t_cycle,
    )
    stretch = F_sling / sling.k if slack is None else -slack
    if unit is not None and slack is None:
        s, z = static_stroke(case, case.z_0), case.z_0 + case.payload.height + r.height
        stretch, link = unit.at_rest(F_sling, s, z, sling.k, link)
    q = at_rest(s_tip, k_0, weights, F_hook, e, stretch)
    lift = lift._replace(z_ref=z_0 + s_tip - float(q[-1]))
    sup = supervisor_at_rest(Watch(t=0.0, s_w=s_w, F=F_top, s_tip=0.0, v_tip=0.0), settings)
    z = case.z_0 + s_tip
    at = heights(z, wetted_at(submergence(z, 0.0, load.reach), table))
    levels = Heights(*(level_of(z, math.log(1.0 + max(-z, 0.0) / field.z_w) * field.i_ds, field) for z in at))
    still, untouched = Water(*[0.0] * len(Water._fields)), WettedLevel(*[0.0] * len(WettedLevel._fields))
    E = 0.5 * e.k * float(np.sum(np.diff(q[:-1]) ** 2))
    if link is not None:
        E += joint_of(unit).energy(stretch, sling, link)
    elif slack is None:
        E += 0.5 * sling.k * (q[-2] - q[-1]) ** 2
    works = Works(*[0.0] * len(Works._fields))
    hang = Hanging(
        course=Course(sup, s_joy=0.0, e_held=0.0, stage=0.0, k_stage=0.0, datum=float(q[-1])),
        wire=LongWire(e, v_w_0=0.0, v_before=0.0),
        body=Body(still, levels, 0.0, untouched, untouched, a=0.0, since_taut=0.0, grounded=float(case.on_deck)),
        works=works,
        E=E,
        E_0=E,
    )
    return PackedLift(
        winch=_winch(crane, case, s_w, F_top),
        lift=lift,
        hang=hang,
        q=q,
        weights=weights,
        table=table,
        m_a=wet.A33,
        programme=programme,
        F_sling=sling.k * float(q[-2] - q[-1]) if link is None and slack is None else F_sling,
        link=link,
        deck=None if case.deck is None else deck_record(case.deck, load),
        current=None if case.current is None or case.body != "current" else current_rows(case.current),
    )


def _winch(crane: Crane, case: Lowering, s_w: float, F_top: float) -> Packed:
    """The winch with the wire from drum to tip alone, on which the first node of the long wire hangs: a load without
    mass that is moved."""
    packed = pack(crane, stand_in(crane, case, s_w))
    h = packed.params.hoist
    EA = wire_strength(crane)[0]
    wire = Wire(EA=FIXED * EA, L_0=FIXED * crane.wire.L_0, mu=0.0, zeta=0.0)
    hoist = h._replace(wire=wire, load=Load(W=F_top, m=0.0, i_m=0.0, b=0.0, U=0.0))
    first = case.programme[0]
    mode = MANUAL if first.mode in (WinchMode.MANUAL, WinchMode.SPLASH) else code_of(case.controller)
    on = 1.0 if crane.brake is not None and first.mode is WinchMode.MANUAL and not first.speed else 0.0
    memory = packed.memory._replace(F=F_top, mode=mode, brake=on)
    return packed._replace(params=packed.params._replace(hoist=hoist), memory=memory)


RHO_STEEL = 7850.0
"""Density of a wire's steel [kg/m^3] (EN 10025 and the rope makers' tables). A rope's grease and core are lighter, so
that it displaces somewhat more water than its mass in steel: for a rope of 14 % grease the weight in water is 2 % less
than here."""


def wire_carried(crane: Crane, s_w: float, h_tip: float) -> float:
    """Mass whose weight is that of the wire out in still water: all of it in air, less the water that its steel
    displaces below [kg].

    .. math:: \\mu \\left( \\min(s_w, h_{tip}) + \\left(1 - \\frac{\\rho}{\\rho_{steel}}\\right) \\max(s_w - h_{tip}, 0)
    \\right)

    Parameters: s_w wire from crane tip to hook [m], h_tip height of the tip above the water line [m]. The wire between
    drum and tip is on the boom, and its weight does not act on the winch, as in
    `stillhook.engine.pack.programme.hanging`. Sea water of 1,025 kg/m^3.
    """
    out = max(s_w, 0.0)
    air = min(out, max(h_tip, 0.0))
    return crane.wire.mass_per_length * (air + (out - air) * (1.0 - RHO_SEA / RHO_STEEL))
