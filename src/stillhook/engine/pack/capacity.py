"""What a crane carries at its tip: SWL and hook, the wire below the tip counting as load. One judgement for scenarios,
lowerings and plans.

At rest, payload, hook and wire are within SWL and hook, or it is an overload. Peaks beyond them are a matter of the
dynamic factor that the crane's capacity was derived with. A load chart may state one and a crane file has none: a run
in which the tension goes beyond SWL and hook is therefore not "ok", and says which factor it takes. Plans take the
factor that chart or maker state, 1 without one.
"""

import math

from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.units import show

OVERLOAD, PEAK = "overload", "peak load"
"""Words in a run's status: SWL and hook are less than what hangs at rest, or than a peak alone."""
ROUNDING = 1e-9
"""Part of the capacity by which the tension of a load that hangs at rest may be off by rounding."""


def tip_capacity(crane: Crane) -> float:
    """Tension at the crane tip that the crane is rated for [N]."""
    return (crane.SWL + crane.hook_mass) * G


def wire_weight(crane: Crane, s_w: float) -> float:
    """Weight in air of the wire below the crane tip with s_w paid out [N]; in sea water an eighth of it is carried."""
    return crane.wire.mass_per_length * max(s_w, 0.0) * G


def overloads(crane: Crane, F_tip: float) -> bool:
    """Whether a tension at the crane tip [N], wire included, is beyond what the crane is rated for."""
    return F_tip > tip_capacity(crane) * (1.0 + ROUNDING)


def judged(crane: Crane, F_rest: float, F_most: float) -> list[str]:
    """`OVERLOAD`, `PEAK` or nothing: highest tension at the crane tip at rest and peaks included, wire included [N]."""
    if overloads(crane, F_rest):
        return [OVERLOAD]
    return [PEAK] if overloads(crane, F_most) else []


def capacity_notes(crane: Crane, F_rest: float, F_most: float, wire: float = 0.0) -> list[str]:
    """The same in a line with what to do; wire: part of both tensions that is wire in air, which a run left out [N]."""
    rated, of_wire = tip_capacity(crane), f", {show(wire, 'force', 3)} of it the wire in air" if wire > 0.0 else ""
    rest = f"at rest {show(F_rest, 'force', 4)} at the crane tip{of_wire}"
    carries = f'"{crane.name}" carries {show(rated, "force", 4)} (SWL and hook)'
    advice = "lower the load, pay out less wire or choose another crane"
    if overloads(crane, F_rest):
        return [f"{OVERLOAD}: {rest}, and {carries}: {advice}"]
    if overloads(crane, F_most):
        factor = math.ceil(F_most / rated * 100.0) / 100.0
        return [
            f"{PEAK}: {rest}, up to {show(F_most, 'force', 4)} in the run, and {carries}: within capacity only by a"
            f" load chart with a dynamic factor of {factor:.2f} or more"
        ]
    return []
