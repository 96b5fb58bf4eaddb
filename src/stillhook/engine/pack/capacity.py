"""What a crane carries at its tip: SWL and hook, the wire below the tip counting as load. One judgement for scenarios,
lowerings and plans."""

from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.units import show

OVERLOAD = "overload"
"""Word for it in a run's status."""
ROUNDING = 1e-9
"""Part of the capacity by which the tension of a load that hangs at rest may be off by rounding."""


def tip_capacity(crane: Crane) -> float:
    """Tension at the crane tip that the crane is rated for [N]."""
    return (crane.SWL + crane.hook_mass) * G


def wire_weight(crane: Crane, s_w: float) -> float:
    """Weight in air of the wire below the crane tip with s_w paid out [N]; in sea water an eighth of it is carried."""
    return crane.wire.mass_per_length * max(s_w, 0.0) * G


def overloads(crane: Crane, F_tip: float) -> bool:
    """Whether a tension at the crane tip [N], wire and peaks included, is beyond what the crane is rated for."""
    return F_tip > tip_capacity(crane) * (1.0 + ROUNDING)


def overload_notes(crane: Crane, F_w: float, wire: float) -> list[str]:
    """How far a run without weight of its wire goes beyond it, in a line: F_w highest tension, wire weight of the wire
    [N]."""
    if not overloads(crane, F_w + wire):
        return []
    return [
        f"{show(F_w + wire, 'force', 4)} at the crane tip at the most, {show(wire, 'force', 3)} of it the wire in air,"
        f' and "{crane.name}" carries {show(tip_capacity(crane), "force", 4)} (SWL and hook): lower the load, pay out'
        " less wire or choose another crane"
    ]
