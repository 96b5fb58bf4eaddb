"""What can be said before a lowering: refusals (LiftError, SpecError), each in one line."""

import math

import numpy as np

from stillhook.control.supervisor import Stage as Row
from stillhook.engine.arguments import RK4_LIMIT, fastest_rates, step_advice
from stillhook.engine.pack.capacity import overloads, tip_capacity
from stillhook.engine.pack.lift import PackedLift
from stillhook.engine.pack.programme import hanging, hook_height, landed_weight
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import LiftError, SpecError
from stillhook.physics.load_path.drum import LAST_TURNS, wire_usable
from stillhook.physics.load_path.payload import WettedLevel
from stillhook.physics.scalar import G
from stillhook.sea.vessel.realisation import WaveField
from stillhook.spec.crane import Crane
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.lowering import Lowering, check_length
from stillhook.spec.lift.phase import Phase, WinchMode, called
from stillhook.units import quote, show

COUPLING = 0.1
"""Largest mass that the stiff wire feigns in one step, h^2 k / 4, over the winch's at the wire, J / r_eff^2; at 1 they
part ways."""
SOIL_LIMIT = 0.8
"""Largest step times rate of a payload on the seabed; stable up to 1 (damper) and 2 (spring)."""
DECK_LIMIT = 0.4
"""Largest step times frequency of a payload on a deck: a hit then takes eight steps or more."""
ON_DECK = 1.0e-3
"""How far from the deck a payload that starts on it may be given [m]."""
FIXED_MASS = 1.0e15
"""Mass of a load at rest [kg]: in the winch's own steps the first node moves evenly, at any pull."""
COARSEST = 0.5
"""Longest spacing of the water's samples [s]."""


def check_lift(crane: Crane, case: Lowering) -> None:
    """Refuse what no crane of this kind can do, or what is not a lowering, its sea aside. Errors: LiftError,
    SpecError of an unknown winch type, one line."""
    check_length(case.duration)
    if case.controller.compensates and (reason := crane.plant.type.mode_refusal(case.controller)):
        raise LiftError(f"controller: {reason}")
    load, unit = case.payload.mass + case.link_mass, "" if case.compensator is None else " with its compensator"
    if load > crane.SWL:
        raise LiftError(
            f'Payload{unit} {show(load, "mass")} exceeds the SWL {show(crane.SWL, "mass")} of "{crane.name}" '
            f"({100.0 * load / crane.SWL:.5g} %). Lower the mass or choose another crane."
        )
    _check_places(crane, case)
    if case.current is not None and (problem := case.current.short_of(case.depth)):
        raise LiftError(f"current.depth: {problem}")
    if case.deck is not None:
        _check_deck(case, case.deck)


def _check_deck(case: Lowering, deck: Deck) -> None:
    """Refuse a deck that the payload does not start on or above."""
    start, height = show(case.start_depth, "length"), show(deck.height, "length")
    for phase in case.programme:
        if phase.depth is not None and phase.depth > 0.0:
            raise LiftError(
                f"{called(phase)}: depth = {show(phase.depth, 'length')} is below the water, and a lift with a deck is"
                " in air. End it above the water, or run what follows without a deck."
            )
    if deck.slack is None:
        if -case.start_depth <= deck.height:
            raise LiftError(
                f"start_depth = {start}: the payload would hang in the deck, {height} above the water. Start above it,"
                " or give deck.slack where it starts on the deck."
            )
        return
    if abs(case.start_depth + deck.height) > ON_DECK:
        raise LiftError(
            f"start_depth = {start}: with deck.slack the payload starts on the deck, {height} above the water. Give"
            f" start_depth = {quote(show(-deck.height, 'length'))}."
        )
    if case.compensator is not None and case.compensator.mass > sum(case.compensator.masses):
        raise LiftError(
            "compensator: its body between hook and slings has no place at rest above a payload on a deck. Leave out"
            " compensator or slack."
        )
    moves = [abs(float(x[0])) for motion in (case.tip, deck.motion) for x in motion.sample(np.zeros(1))[:2]]
    if case.ramp == 0.0 and max(moves) > 0.0:
        raise LiftError('ramp = 0 s: a payload that starts on a deck starts at rest. Give a ramp, such as "10 s".')


def check_sea(case: Lowering) -> None:
    """Refuse a tip or waves that are not known for the whole run. Errors: LiftError."""
    if case.tip.duration is not None and case.duration > case.tip.duration + 1e-9:
        raise LiftError(
            f"duration {case.duration:g} s is longer than the motion of the tip, {case.tip.duration:g} s. Shorten the"
            " run."
        )
    if case.deck is not None:
        if case.current is not None:
            raise LiftError("current: with a deck the payload is in air. Leave current out.")
        if case.waves is not None:
            raise LiftError("waves: with a deck the payload is in air. Leave waves out, or write [sea] water = false.")
        known = case.deck.motion.duration
        if known is not None and case.duration > known + 1e-9:
            raise LiftError(
                f"duration {case.duration:g} s is longer than the motion of the deck, {known:g} s. Shorten the run."
            )
    if case.waves is not None:
        _check_waves(case.waves, case.duration)


def _check_places(crane: Crane, case: Lowering) -> None:
    """The load hangs between crane tip and seabed at the start, on wire that there is."""
    start, top = show(case.start_depth, "length"), case.h_tip - hook_height(case, case.z_0)
    if case.start_depth >= case.depth:
        raise LiftError(
            f"start_depth = {start}: the payload would lie on the seabed, {show(case.depth, 'length')} down. Start"
            " above it."
        )
    s_w, usable = hanging(crane, case, case.z_0).s_w, float(wire_usable(drum_record(crane)))
    if s_w < 0.0:
        raise LiftError(
            f"start_depth = {start}: the hook would be above the crane tip, which is {show(case.h_tip, 'length')} above"
            f" the water. Rigging and payload leave room up to {show(-top, 'length')}."
        )
    if s_w > usable:
        raise LiftError(
            f'start_depth = {start} takes {show(s_w, "length")} of wire, and "{crane.name}" can pay out'
            f" {show(usable, 'length')} "
            f"({LAST_TURNS:.0f} turns kept). Start higher or choose another crane."
        )


def check_course(crane: Crane, case: Lowering, packed: PackedLift) -> None:
    """Refuse phases that would be over before they begin, landings that would lift off again, and more static tension
    at the crane tip than the crane carries. Errors: LiftError naming the phase."""
    wire: float | None = packed.winch.s_w
    rows = zip(case.programme, case.moves, packed.programme.rows, packed.programme.names, strict=True)
    for phase, move, row, name in rows:
        where, target = f'phase "{name}"', float(row[Row._fields.index("value")])
        if phase.mode is WinchMode.LANDING:
            _check_tension(crane, case, phase, where)
        if (end := phase.ends[0]) in ("depth", "wire"):
            if wire is not None and (target - wire) * move.v <= 0.0:
                stated = show(getattr(phase, end), "length")
                raise LiftError(
                    f"{where}: speed = {show(move.v, 'speed')}"
                    f" {'pays wire out' if move.v > 0.0 else 'hoists'}, and {end} = {stated} is"
                    f" {show(target, 'length')} of wire out, with {show(wire, 'length')} out at its beginning. Turn the"
                    f" sign of speed, or change {end}."
                )
            wire = target
            _check_tip(crane, case, wire, where)
        elif move.v != 0.0 or phase.mode is WinchMode.TENSION:
            wire = None


def _check_tension(crane: Crane, case: Lowering, phase: Phase, where: str) -> None:
    """A load is landed only if the wire carries less than its weight."""
    hangs = landed_weight(case) + (crane.hook_mass + case.link_mass) * G
    if phase.tension is not None and phase.tension >= hangs:
        raise LiftError(
            f"{where}: tension = {show(phase.tension, 'force')} would lift the load again: payload and hook weigh"
            f" {show(hangs, 'force')}{' in water' if case.deck is None else ''}. Give less."
        )


def _check_tip(crane: Crane, case: Lowering, wire: float, where: str) -> None:
    """Static tension at the crane tip with so much wire out, the payload hanging free."""
    z = case.h_tip - wire - hook_height(case, -case.depth)
    F, most = hanging(crane, case, z).F_tip, tip_capacity(crane)
    if overloads(crane, F):
        raise LiftError(
            f'{where}: payload, hook and wire pull {show(F, "force")} at the crane tip, and "{crane.name}" carries'
            f" {show(most, 'force')} (SWL and hook). Lower less deep, a lighter payload, or choose another crane."
        )


def _check_waves(waves: WaveField, duration: float) -> None:
    if not 0.0 < waves.dt <= COARSEST:
        raise LiftError(
            f"waves: samples every {waves.dt:g} s, and 0 to {COARSEST:g} s are allowed. Sample the water more finely."
        )
    if duration > waves.duration + 1e-9:
        raise LiftError(f"duration {duration:g} s is longer than the waves, {waves.duration:g} s. Shorten the run.")
    shapes = {waves.w.shape, waves.a.shape}
    if (
        len(shapes) != 1
        or waves.w.ndim != 2
        or len(waves.w) != len(waves.eta)
        or waves.w.shape[1] < 2
        or waves.z_0 <= 0
        or waves.ds <= 0
    ):
        raise LiftError(
            "waves: eta, w and a do not belong together, or there are fewer than 2 levels of depth. Make them with"
            " wave_field."
        )


def fastest_of_lift(packed: PackedLift) -> tuple[str, float]:
    """What winch, coupling or seabed ask of the step: name of the fastest mode, and 1 over the longest step [1/s].

    The wire itself is stepped implicitly: however short and stiff, it requires no shorter step.
    """
    p = packed.winch.params
    hoist = p.hoist._replace(load=p.hoist.load._replace(m=FIXED_MASS))
    e, rope = packed.hang.wire.element, packed.lift.rope
    top = e.c / e.k * rope.EA / rope.L_0
    rates = {
        k: v / RK4_LIMIT for k, v in fastest_rates(packed.winch._replace(params=p._replace(hoist=hoist)), top).items()
    }
    geo = packed.winch.plant.geometry(packed.winch.s_w, p._replace(hoist=hoist))
    k_0 = packed.lift.rope.EA / (hoist.wire.L_0 * packed.lift.rope.EA / hoist.wire.EA)
    rates["wire against the winch's inertia"] = math.sqrt(0.25 * k_0 * geo.r_eff**2 * geo.i_J / COUPLING)
    load, covered = packed.lift.load, WettedLevel(*packed.table[-1].tolist())
    m = load.m + covered.A33
    rates["payload on the spring of the seabed"] = math.sqrt(load.k_soil / m) / SOIL_LIMIT
    rates["payload in the damper of the seabed"] = load.c_soil / m / SOIL_LIMIT
    if packed.deck is not None:
        rates["payload on the deck"] = math.sqrt(packed.deck.k / load.m) / DECK_LIMIT
    return max(rates.items(), key=lambda i: i[1])


def check_lift_step(packed: PackedLift, step: float) -> None:
    """Refuse a step that winch, coupling or seabed cannot follow. Errors: SpecError naming the fastest mode and the
    step to take."""
    name, rate = fastest_of_lift(packed)
    if rate * step <= 1.0:
        return
    raise SpecError(
        f"step {step * 1e3:.3g} ms is too long for this lift: {name} requires {1e3 / rate:.3g} ms."
        f" {step_advice(packed.lift.t_cycle, 1.0 / rate)}"
    )
