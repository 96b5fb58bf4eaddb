"""Limits of error of the sensors behind an estimate, and the 95 % interval that several of them make together."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from stillhook.errors import IdentifyError
from stillhook.statistics.estimate import CONFIDENCE, NORMAL_95

F_LAG = 0.05
"""Lag that a load cell is taken to have [s]. Assumed: filter of an amplifier."""
GRID = 2001
"""Points on which distributions are folded: an interval is right to a thousandth of its half width."""
TAIL = 5.0
"""Standard deviations of the random part that the grid holds [-]."""


@dataclass(frozen=True, kw_only=True)
class Accuracies:
    """Limits of error, each of either sign: the true value is anywhere within, as is common for a class of accuracy
    (GUM 4.3.7). Replace what a data sheet says otherwise."""

    F_gain: float = 0.01
    """Load cell, part of the reading [-]. Source: issue 39; usual for load pins on cranes."""
    F_zero: float = 15e3
    """Load cell, zero [N]. Source: issue 39; 0.6 % of 250 t."""
    F_lag: float = 0.05
    """Load cell's lag, about `F_LAG` [s]. Assumed: filter of an amplifier."""
    alpha_m: float = 0.005
    """Displacement reading of the active motors, part of the full one [-]. Source: issue 39."""
    alpha_pm: float = 0.005
    """The same of the passive motors [-]. Source: issue 39."""
    D_m: float = 0.003
    """Full displacement of the active motors together [-]. Assumed: sorted units of one type, as in
    `stillhook.validate.parameters.hoisting`."""
    D_pm: float = 0.003
    """The same of the passive motors [-]."""
    D_p: float = 0.005
    """The same of the active pumps, with the speed of their drives [-]. Assumed."""
    C_h: float = 0.05
    """Capacitance of a line [-]. Assumed: volume of the pipes and bulk modulus of the oil."""
    make_up: float = 0.2
    """Flow of the make-up pumps, part of it [-]. Assumed: by the PLC's law where their setting is not logged."""
    p: float = 0.5e5
    """Each pressure transmitter [Pa]. Source: issue 39 (drift of 0.5 bar); 0.13 % of 400 bar."""
    R_piston: float = 0.3
    """Resistance of the accumulator's piston, part of the crane file's [-], where p_hp is read on the gas side.
    Assumed."""
    inertia: float = 0.03
    """Inertia at the motor shaft [-]. Assumed: known from drawings."""
    clock: float = 0.2
    """Encoder's clock against that of the pressures where the log does not tell it [s]. Source: issue 39."""
    pump_lag: float = 0.01
    """Lateness of the pumps behind their command, where their reading is missing [s]. Assumed: a cycle of 10 ms, and a
    tenth of the control's lag of 58 ms."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, int | float) and math.isfinite(value) and value >= 0.0):
                raise IdentifyError(
                    f"Accuracies.{field.name} = {value!r}: a limit of error is a number from 0 on, in SI."
                )


def half_width(limits: Iterable[float], u: float, t: float = NORMAL_95) -> float:
    """Half of the 95 % interval of a sum of errors: even ones within these limits, and a random one of standard
    uncertainty u whose 95 % factor is t. All in one unit."""
    bounds = [abs(a) for a in limits if abs(a) > 0.0]
    sd = u * t / NORMAL_95
    if not math.isfinite(sum(bounds) + sd):
        return math.inf
    reach = sum(bounds) + TAIL * sd
    if reach == 0.0:
        return 0.0
    x = np.linspace(-reach, reach, GRID)
    step = float(x[1] - x[0])
    sd = math.hypot(sd, 0.5 * step)  # never narrower than the grid
    density = np.exp(-0.5 * (x / sd) ** 2)
    for a in bounds:
        total = np.concatenate([[0.0], np.cumsum(density)])
        edges = np.concatenate([x - 0.5 * step, [x[-1] + 0.5 * step]])
        density = np.interp(x + a, edges, total) - np.interp(x - a, edges, total)
        density = density if a > 0.5 * step else np.diff(total)
    density /= density.sum()
    inside = np.cumsum(density[GRID // 2 :]) - 0.5 * density[GRID // 2]
    return float(np.interp(0.5 * CONFIDENCE, inside, x[GRID // 2 :]))
