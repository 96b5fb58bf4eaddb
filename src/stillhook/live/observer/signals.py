"""What a crane measures: which signals are taken, what each may be, and what a wrong unit looks like."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from stillhook.live.servers.served import about


class Range(NamedTuple):
    """Least and most that a sensor shows, and how far a spike of one or two samples is off to be dropped."""

    least: float
    most: float
    spike: float


_SETTING = Range(-1.1, 1.1, 0.5)
_PRESSURE = Range(-2.0e5, 6.0e7, 1.0e7)
SIGNALS: Mapping[str, Range] = {
    "s_w": Range(-10.0, 1.0e4, 5.0),
    "v_w": Range(-20.0, 20.0, 5.0),
    "omega_m": Range(-600.0, 600.0, 150.0),
    "p_a": _PRESSURE,
    "p_b": _PRESSURE,
    "p_hp": _PRESSURE,
    "u_p": _SETTING,
    "u_m": _SETTING,
    "alpha_p": _SETTING,
    "alpha_m": _SETTING,
    "alpha_pm": _SETTING,
    "F_w": Range(-1.0e5, 2.0e7, 1.0e6),
}
"""Signals that may be measured [SI]: wider than any crane of the library, narrower than a damaged sensor. Assumed."""
OF_INPUTS = ("s_tip", "v_tip", "a_tip", "mode")
"""Inputs of the twin that are measured as well: what the PLC says of tip and mode."""
HELD = ("mode",)
"""Signals that hold until they are sent again."""
UNITS: Mapping[str, Mapping[str, float]] = {
    "Pa": {"bar": 1.0e-5, "MPa": 1.0e-6, "kPa": 1.0e-3, "psi": 1.0 / 6894.757},
    "N": {"kN": 1.0e-3, "t": 1.0 / 9806.65, "kg": 1.0 / 9.80665},
    "rad/s": {"rev/min": 30.0 / math.pi, "rev/s": 0.5 / math.pi},
    "m/s": {"m/min": 60.0, "mm/s": 1.0e3},
    "1": {"%": 100.0},
}
"""Numbers that a sensor shows for one in SI, by the unit that it may be in."""
NEAR = 1.25
"""Factor by which a ratio may miss that of a unit [-]: a twin that fits its crane is within it, a fault rarely."""


def implausible(name: str, value: float) -> str:
    """Why a value of a signal is not taken; empty where it is."""
    of = SIGNALS[name]
    if of.least <= value <= of.most:
        return ""
    return f"{name} = {value:g}: give a value from {of.least:g} to {of.most:g} {about(name)[0]}"


def other_unit(name: str, measured: float, simulated: float) -> str:
    """Unit that a signal seems to be in, from root mean squares of both sides; empty where it seems to be right."""
    if not (measured > 0.0 and simulated > 0.0):
        return ""
    ratio = measured / simulated
    near = {unit: abs(math.log(ratio / of)) for unit, of in UNITS.get(about(name)[0], {}).items()}
    unit = min(near, key=near.__getitem__, default="")
    return unit if unit and near[unit] < math.log(NEAR) else ""
