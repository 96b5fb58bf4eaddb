"""What a run says of an oscillation that the motion of the tip does not explain: see
`stillhook.kernels.statistics.oscillation`."""

import math

from stillhook.kernels.statistics.oscillation import Largest
from stillhook.spec.crane import Crane
from stillhook.units import show

OSCILLATES = "oscillates"
"""Word for it in a run's status."""


def oscillation_numbers(found: Largest) -> dict[str, float]:
    """Its time [s], and period [s], wire speed [m/s] and tension [N] peak to peak where it is largest; NaN where there
    is none."""
    largest = (found.period, found.v_w, found.F_w) if found.time > 0.0 else (math.nan,) * 3
    return dict(zip(NUMBERS, (found.time, *largest), strict=True))


NUMBERS = ("oscillation_time", "oscillation_period", "oscillation_v_w", "oscillation_F_w")
"""Names of these numbers."""


def oscillation_notes(crane: Crane, found: Largest) -> list[str]:
    """The same in a sentence with what to do; none where there is none."""
    if found.time <= 0.0:
        return []
    return [
        f"wire speed oscillates for {show(found.time, 'time', 3)} with period {show(found.period, 'time', 3)},"
        f" {show(found.v_w, 'speed', 3)} and {show(found.F_w, 'force', 3)} peak to peak where it is largest, which the"
        " motion of the tip does not explain: the control loop is unstable or close to it, or friction sticks. Lower"
        f" K_p ({show(crane.control.K_p, 'gain_per_length')}; stillhook stability has its limit), or keep the wire from"
        " going this slowly"
    ]
