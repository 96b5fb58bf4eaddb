"""The winch programme and its settings as the kernels read them, and the wire that must be out for the payload to hang
at a height."""

import math
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.kept.identity import remembered
from stillhook.control import supervisor as modes
from stillhook.control.registry import code_of
from stillhook.control.supervisor import LiftSettings
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import LiftError
from stillhook.physics.load_path.drum import LAST_TURNS, wire_usable
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase, WinchMode, phase_names
from stillhook.units import show

MODE_CODE = {
    WinchMode.MANUAL: modes.STAGE_MANUAL,
    WinchMode.AHC: modes.STAGE_AHC,
    WinchMode.TENSION: modes.STAGE_TENSION,
    WinchMode.SPLASH: modes.STAGE_SPLASH,
    WinchMode.LANDING: modes.STAGE_LANDING,
    WinchMode.STOP: modes.STAGE_STOP,
    WinchMode.BLACKOUT: modes.STAGE_BLACKOUT,
}
END_CODE = {
    "time": modes.UNTIL_TIME,
    "depth": modes.UNTIL_DEPTH,
    "wire": modes.UNTIL_WIRE,
    "landed": modes.UNTIL_LANDED,
    "end_tension": modes.UNTIL_TENSION,
}
COMPENSATED = (WinchMode.AHC, WinchMode.TENSION, WinchMode.LANDING)
"""Modes in which the controller compensates the tip's motion, and which a winch in another one enters as the tip
turns."""
HOOK_SHARE = 0.5
"""Part of the empty hook's weight below which the wire counts as slack, for the entry into compensation."""

PATIENCE = 3600.0
"""How much longer than it should take a phase may last [s]."""
TENSION_KEPT = 0.5
"""Tension that a landing keeps after touch-down, in addition to the hook's weight, as part of the payload's weight in
water (assumed)."""


class Hanging(NamedTuple):
    """The payload hanging still: s_w unstretched wire paid out [m]; F_hook tension above the hook, F_tip tension at the
    crane tip [N]; stretch of all wire from the drum to the hook [m]; wet wire below the surface [m]."""

    s_w: float
    F_hook: float
    F_tip: float
    stretch: float
    wet: float


class Programme(NamedTuple):
    """rows (n, fields of control.lift_modes.Stage); settings; names of the phases."""

    rows: FloatArray
    settings: LiftSettings
    names: tuple[str, ...]


def wire_strength(crane: Crane) -> tuple[float, float]:
    """EA = f E A [N] and the steel's cross-section f A [m^2]."""
    steel = crane.wire.fill * math.pi / 4.0 * crane.wire.d**2
    return crane.wire.E * steel, steel


def hanging(crane: Crane, lift: Lowering, z: float, slack: float | None = None) -> Hanging:
    r"""Statics with the payload's underside at z above still water (negative: below) and a free load [m]; slack: of the
    slings where it stands on a deck, a unit above them at its shortest [m].

    Weight of the payload less its buoyancy at that submergence, of the hook (its own buoyancy left out), and of the
    wire from tip to hook, which below the surface loses the buoyancy of its steel. The wire between drum and tip is
    on the boom: it stretches, and its weight does not act on the winch.

    .. math:: e = \frac{F_{tip} L_0}{E A} + \int_0^\ell \frac{F(s)}{E A} ds, \qquad s_w = \ell - e
    """
    F_hook = payload_weight(lift, z) + (crane.hook_mass + lift.link_mass) * G - link_buoyancy(lift, z)
    EA, steel = wire_strength(crane)
    top = z + hook_height(lift, z)
    if slack is not None:
        unit = lift.compensator
        above, length = (0.0, 0.0) if unit is None else (unit.masses[0], unit.shortest)
        F_hook = (crane.hook_mass + above) * G
        top = z + lift.payload.height + lift.rigging.height + length - slack
    length, wet = lift.h_tip - top, max(-top, 0.0)
    dry, q = length - wet, crane.wire.mass_per_length * G
    q_wet = q - lift.rho * steel * G
    F_surface = F_hook + q_wet * wet
    F_tip = F_surface + q * dry
    stretch = (F_tip * crane.wire.L_0 + 0.5 * (F_hook + F_surface) * wet + 0.5 * (F_surface + F_tip) * dry) / EA
    return Hanging(s_w=length - stretch, F_hook=F_hook, F_tip=F_tip, stretch=stretch, wet=wet)


def payload_weight(lift: Lowering, z: float) -> float:
    """Weight of the payload less its buoyancy with the underside at z above still water [N]."""
    return weight_in_water(lift.payload, lift.rho, z)


def landed_weight(lift: Lowering) -> float:
    """Weight of the payload less its buoyancy where it lands, on the seabed or on a deck in air [N]."""
    return payload_weight(lift, -math.inf if lift.deck is None else 0.0)


def weight_in_water(load: Payload, rho: float, z: float) -> float:
    """Weight of a payload less its buoyancy in water of density rho, underside at z above still water [N]."""
    return (load.mass - rho * _displaced(load, rho, min(max(-z, 0.0), load.reach(rho)))) * G


@remembered
def _displaced(load: Payload, rho: float, h: float) -> float:
    """Volume that a payload displaces at the submergence h [m^3]."""
    return float(load.at(np.array([h]), rho).V[0])


def tension_kept(crane: Crane, load: Payload, rho: float) -> float:
    """Tension that a landing keeps at the hook where its phase does not say [N]."""
    return TENSION_KEPT * weight_in_water(load, rho, -math.inf) + crane.hook_mass * G


def link_buoyancy(lift: Lowering, z: float) -> float:
    """Weight of the water that the unit between hook and slings displaces, the payload hanging still at z [N]."""
    unit = lift.compensator
    return 0.0 if unit is None else unit.buoyancy(z + lift.payload.height + lift.rigging.height, lift.rho)


def hook_height(lift: Lowering, z: float) -> float:
    """Height of the hook above the payload's underside, which hangs still at z above still water [m]: payload,
    slings, and a compensator with the stroke that the load draws out."""
    height = lift.payload.height + lift.rigging.height
    unit = lift.compensator
    return height if unit is None else height + unit.shortest + static_stroke(lift, z)


def static_stroke(lift: Lowering, z: float) -> float:
    """Stroke of the compensator with the payload hanging still at z above still water [m]."""
    unit = lift.compensator
    if unit is None:
        return 0.0
    height = lift.payload.height + lift.rigging.height
    return unit.extension(payload_weight(lift, z) + unit.masses[1] * G, z + height, lift.rho * G)


def pack_programme(crane: Crane, lift: Lowering) -> Programme:
    """Rows of phases and the settings of the winch modes.

    Errors: LiftError for a programme that is not possible with this crane or in this water: no phases, depths below the
    seabed or above the tip, more wire than the drum gives, tensions above the SWL, a controller that does not
    compensate.
    """
    if not lift.programme:
        raise LiftError(
            'programme: no phases. Give at least one, such as { mode = "ahc", speed = "12 m/min", depth = "50 m" }.'
        )
    if not lift.controller.compensates:
        raise LiftError(
            'controller = "manual": it does not compensate. Give the controller of the compensated phases, such as'
            ' "ssc".'
        )
    names, speeds = phase_names(lift.programme), [move.v for move in lift.moves]
    following = [*zip(lift.programme[1:], speeds[1:], strict=True), None]
    rows = [
        _row(crane, lift, (phase, v), f'phase "{name}"', after)
        for name, phase, v, after in zip(names, lift.programme, speeds, following, strict=True)
    ]
    return Programme(np.array(rows, dtype=np.float64), settings(crane, lift), names)


def settings(crane: Crane, lift: Lowering) -> LiftSettings:
    """Settings of the winch modes: the lift's own, and what the crane's PLC has already."""
    w, c = lift.winch, crane.control
    EA, steel = wire_strength(crane)
    q = crane.wire.mass_per_length * G
    return LiftSettings(
        t_cycle=c.t_cycle,
        a_max=w.ramp,
        v_max=w.v_max,
        v_enter=w.v_enter,
        omega_T=w.omega_T,
        v_soft=w.v_soft,
        F_soft=(lift.payload.mass + lift.payload.covered(lift.rho).A33 + crane.hook_mass) * G,
        omega_soft=w.omega_soft,
        omega_s=w.omega_s,
        tau_F=c.tau_F,
        tau_slow=w.tau_slow,
        tau_suspended=w.tau_suspended,
        t_fade=c.t_bumpless,
        F_landed=w.landed * max(landed_weight(lift), 0.0),
        F_least=HOOK_SHARE * crane.hook_mass * G if w.F_least is None else w.F_least,
        EA=EA,
        L_0=crane.wire.L_0,
        q_dry=q,
        q_wet=q - lift.rho * steel * G,
        h_tip=lift.h_tip,
        code=code_of(lift.controller),
    )


Driven = tuple[Phase, float]
"""A phase and its wire speed, lowering positive [m/s]."""


def speed_at_end(driven: Driven, after: Driven | None) -> float:
    """Joystick speed, lowering positive, with which a phase comes to its depth or wire [m/s]; after: the phase that
    follows.

    A winch that continues the same way without waiting passes at the slower of the two speeds. Otherwise it stops
    there: before a phase at rest, one that turns back, holds a tension or waits for the tip, and at the end of the
    programme.
    """
    phase, v = driven
    if after is None or after[0].mode is WinchMode.TENSION or v * after[1] <= 0.0:
        return 0.0
    waits = after[0].mode in COMPENSATED and phase.mode not in COMPENSATED
    return 0.0 if waits else math.copysign(min(abs(v), abs(after[1])), v)


def _row(crane: Crane, lift: Lowering, driven: Driven, where: str, after: Driven | None) -> modes.Stage:
    phase, v = driven
    for name in ("tension", "end_tension"):
        F = getattr(phase, name)
        if F is not None and F > crane.SWL * G:
            raise LiftError(
                f"{where}: {name} = {show(F, 'force')}: above the {show(crane.SWL * G, 'force')} of the SWL of"
                f' "{crane.name}". Give less.'
            )
    if (phase.mode is WinchMode.LANDING or phase.landed) and landed_weight(lift) <= 0.0:
        raise LiftError(f"{where}: the payload floats, and cannot land. Check its mass and volume.")
    end = phase.ends[0]
    value = {"time": phase.time, "wire": phase.wire, "end_tension": phase.end_tension, "landed": 0.0}.get(end)
    if end == "depth":
        value = _wire_for(crane, lift, phase, where)
    assert value is not None
    usable = float(wire_usable(drum_record(crane)))
    if end in ("wire", "depth") and not 0.0 <= value <= usable:
        raise LiftError(
            f'{where}: {end} requires {show(value, "length")} of wire out, and "{crane.name}" has 0 m to'
            f" {show(usable, 'length')} ({LAST_TURNS:.0f} turns kept). Lower less, or choose another crane."
        )
    return modes.Stage(
        mode=MODE_CODE[phase.mode],
        v=-v,
        F_set=phase.tension or 0.0,
        until=END_CODE[end],
        value=value,
        timeout=timeout(lift, phase),
        last=1.0 if after is None else 0.0,
        v_end=-speed_at_end(driven, after),
    )


def timeout(lift: Lowering, phase: Phase) -> float:
    """Time after which a phase leaves the programme stuck [s]: its own, or an hour longer than the whole way from tip
    to seabed takes."""
    if phase.timeout is not None:
        return phase.timeout
    way = (lift.depth + lift.h_tip) / abs(phase.speed) if phase.speed else 0.0
    return PATIENCE + (way if phase.time is None else phase.time)


def _wire_for(crane: Crane, lift: Lowering, phase: Phase, where: str) -> float:
    """Wire out with which the payload hangs at the phase's depth [m]."""
    depth = phase.depth
    assert depth is not None
    if depth > lift.depth:
        raise LiftError(
            f"{where}: depth = {show(depth, 'length')} is below the seabed at {show(lift.depth, 'length')}. "
            "End it above the bottom, or with landed = true."
        )
    room = lift.h_tip - hook_height(lift, -depth)
    if -depth > room:
        raise LiftError(
            f"{where}: depth = {show(depth, 'length')} lifts the underside {show(-depth, 'length')} above the water,"
            f" and between tip, rigging and payload there are {show(room, 'length')}. Lift less high."
        )
    return hanging(crane, lift, -depth).s_w
