"""What a signal of a winch can be at all: beyond, its unit or its sensor is wrong."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from stillhook.logs.types import Signal

REV_PER_MIN = 2.0 * math.pi / 60.0  # rad/s
CM3_PER_REV = 1e-6 / (2.0 * math.pi)  # m^3/rad
BAR = 1e5  # Pa

BY_KIND: Mapping[str, float] = MappingProxyType(
    {
        "pressure": 1000.0 * BAR,  # hydraulics of winches stay below 450 bar, test benches below 1000
        "rotation": 10000.0 * REV_PER_MIN,  # no axial piston motor of a winch turns at half of that
        "displacement": 20000.0 * CM3_PER_REV,  # all motors of the largest winch: 21 x 215 cm^3/rev
        "speed": 20.0,  # m/s; the fastest wire runs at 5
        "length": 12000.0,  # m; deeper than the sea
        "force": 1e8,  # N; 10 000 t
        "torque": 1e9,  # N m; drum of the largest winch: 1e7
        "temperature": 473.15,  # K; 200 degC
    }
)
"""Largest magnitude by kind [SI]."""

LEAST: Mapping[str, float] = MappingProxyType(
    {
        "p_a": 2.0 * BAR,  # the boost alone is 15 to 25 bar
        "p_hp": 2.0 * BAR,
        "D_m": 1.0 * CM3_PER_REV,  # a tenth of the smallest motor of a winch
    }
)
"""What the largest sample of a complete log must reach [SI]: below, the unit is another."""

FRACTIONS = ("u_p", "u_m", "u_ff", "u_raw", "alpha_p", "alpha_m", "alpha_pp", "alpha_pm", "f_pump")
LARGEST_FRACTION = 1.5  # commands and displacements over their maximum; percent read as plain numbers is caught here
SET_VALUES = (
    "u_p",
    "u_m",
    "u_ff",
    "u_raw",
    "D_m",
    "alpha_p",
    "alpha_m",
    "alpha_pp",
    "alpha_pm",
    "f_pump",
    "layer",
    "mode",
    "v_op",
    "e_c",
    "e_c_measured",
)
"""Signals that the control sets or computes: they may be constant to the last digit by design, as the error does while
the winch does not compensate."""
TIP = ("s_tip", "v_tip", "a_tip")
"""Signals of the crane's tip."""
NOT_THE_WINCH = (*TIP, "v_op", "mode", "layer", "e_c", "e_c_measured", "s_load", "v_load")
"""Signals that may change while the winch rests."""
REQUIRED = ("p_a", "p_b", "dp_m", "omega_m", "speed", "effort")
"""Signals without which a log states nothing of friction: one that never changes is refused."""


def limit_of(signal: Signal) -> float:
    """Largest magnitude that a sample of the signal can have [SI], infinite where nothing is known."""
    if signal.name in FRACTIONS:
        return LARGEST_FRACTION
    return BY_KIND.get(signal.quantity, math.inf)
