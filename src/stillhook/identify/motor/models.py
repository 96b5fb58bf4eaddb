"""The torque-loss models that can be fitted: what each is called, where it is from, what its parameters are, where it
holds.

The equations are those of `stillhook.physics.hydraulics.motor_losses`; this table adds nothing to them. A column of a
linear fit is the model itself with one parameter at 1 and the others at 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.physics.hydraulics import motor_losses as eq
from stillhook.physics.hydraulics.motor import TorqueLossFit
from stillhook.physics.hydraulics.motor_losses import LossMotor

LAMINAR, TURBULENT_AND_MORE = 1.0, 3.0
"""Bounds of MJ5's exponent: laminar flow is 1, turbulent flow is 2; a fit beyond 2 is reported and is not that
physics."""


class LossModel(StrEnum):
    """Models of paper A, oldest first."""

    WILSON = "wilson"
    SCHLOSSER = "schlosser"
    THOMA = "thoma"
    PACEY = "pacey"
    HUHTALA_14 = "huhtala-14"
    HUHTALA_28 = "huhtala-28"
    ORTWIG = "ortwig"
    JEONG = "jeong"
    MJ1 = "mj1"
    MJ2 = "mj2"
    MJ3 = "mj3"
    MJ4 = "mj4"
    MJ5 = "mj5"
    MJ6 = "mj6"


@dataclass(frozen=True)
class Parameter:
    """Name as in paper A, SI unit, and whether physics asks that it is not negative (a loss never drives the shaft)."""

    name: str
    unit: str
    positive: bool = True


@dataclass(frozen=True)
class LossCard:
    """What there is to know about a model next to its equation."""

    model: LossModel
    title: str
    author: str
    year: int
    equation: str
    function: Callable[..., Any]
    record: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    sees_displacement: bool = True
    bent: tuple[str, ...] = ()
    """Parameters that the loss is not linear in."""
    validity: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @property
    def straight(self) -> tuple[str, ...]:
        """Parameters that the loss is linear in."""
        return tuple(n for n in self.names if n not in self.bent)

    def torque(self, omega_m: Any, D_m: Any, dp_m: Any, values: Sequence[float], motor: LossMotor) -> Any:
        """Torque loss [N m] with the parameters in the order of `names`; SI, floats or arrays."""
        return self.function(omega_m, D_m, dp_m, self.record(*values), motor)

    def column(
        self, name: str, omega_m: Any, D_m: Any, dp_m: Any, motor: LossMotor, bent: Mapping[str, float]
    ) -> FloatArray:
        """The loss with this parameter at 1, the other linear ones at 0 and the bent ones as given [N m per unit]."""
        unit = [bent[n] if n in bent else float(n == name) for n in self.names]
        return np.broadcast_to(
            np.asarray(self.torque(omega_m, D_m, dp_m, unit, motor), dtype=np.float64), np.shape(omega_m)
        ).copy()


PUBLISHED = "published without a range; paper A fits 400-2500 rev/min, 50-350 bar"
FITTED = "paper A: 400-2500 rev/min, 50-350 bar; within 1 % of nominal torque down to half displacement"
STANDSTILL = "; not at standstill"

_NM, _PURE = "N m", "1"


def _p(units: Mapping[str, str], *, positive: bool = True) -> tuple[Parameter, ...]:
    return tuple(Parameter(name, unit, positive) for name, unit in units.items())


def _polynomials(suffix: str) -> dict[str, str]:
    """Names and units of the four polynomials of the two-line model."""
    powers = {"a": (_NM, 4), "b": ("m^3", 4), "c": ("m^3", 3), "p": ("Pa", 3)}
    return {
        f"{letter}_{i}{suffix}": unit + ("" if i == 0 else f" (s/rad)^{i}")
        for letter, (unit, n) in powers.items()
        for i in range(n)
    }


_JEONG = {"C_e": _NM, "C_f": "m^3", "C_g": "m^3", "C_i": "m^5", "C_k": "m^2", "C_m": "m^5/N"}
_BREAK = ("p_0", "p_1", "p_2")
_ORTWIG = {
    "C_e": _NM,
    "C_f": "m^3",
    "C_g": "N m s",
    "C_h": "m^3 s",
    "C_i": "N m s^2",
    "C_j": _NM,
    "C_k": "m^3",
    "C_l": "N m s",
}
_TWO_LINES = (
    "our reading of the two-line model, paper A prints no equation; a polynomial: good between data, not beyond"
)

_CARDS = (
    LossCard(
        LossModel.WILSON,
        "Wilson",
        "Wilson",
        1948,
        "A.1",
        eq.wilson,
        eq.Wilson,
        _p({"C_a": _PURE, "C_b": _PURE, "C_c": "Pa"}),
        sees_displacement=False,
        validity=PUBLISHED,
    ),
    LossCard(
        LossModel.SCHLOSSER,
        "Schlösser",
        "Schlösser",
        1961,
        "A.2",
        eq.schlosser,
        eq.Schlosser,
        _p({"C_a": _PURE, "C_b": _PURE, "C_d": _PURE}),
        sees_displacement=False,
        validity=PUBLISHED,
    ),
    LossCard(
        LossModel.THOMA,
        "Thoma",
        "Thoma",
        1969,
        "A.3",
        eq.thoma,
        eq.Thoma,
        _p({"C_a": _PURE, "C_b": _PURE, "C_e": _PURE}),
        validity=PUBLISHED,
    ),
    LossCard(
        LossModel.PACEY,
        "Pacey",
        "Pacey and others",
        1979,
        "A.4",
        eq.pacey,
        eq.Pacey,
        _p({"C_a": _PURE, "C_b": _PURE, "C_e": _NM}),
        validity=PUBLISHED + "; swivel angle of 25 deg at full displacement assumed",
    ),
    LossCard(
        LossModel.HUHTALA_14,
        "Huhtala, 14",
        "Huhtala and Vilenius",
        1997,
        "A section 3.5",
        eq.huhtala_14,
        eq.Huhtala14,
        _p(_polynomials(""), positive=False),
        sees_displacement=False,
        bent=_BREAK,
        validity=_TWO_LINES,
    ),
    LossCard(
        LossModel.HUHTALA_28,
        "Huhtala, 28",
        "Huhtala and Vilenius",
        1997,
        "A section 3.5",
        eq.huhtala_28,
        eq.Huhtala28,
        _p(_polynomials("") | _polynomials("D"), positive=False),
        bent=(*_BREAK, *(f"{n}D" for n in _BREAK)),
        validity=_TWO_LINES,
    ),
    LossCard(
        LossModel.ORTWIG,
        "Ortwig",
        "Ortwig",
        2002,
        "A.5",
        eq.ortwig,
        eq.Ortwig,
        _p(_ORTWIG, positive=False),
        validity=PUBLISHED + "; an interpolation: not beyond the data",
    ),
    LossCard(
        LossModel.JEONG,
        "Jeong",
        "Jeong and Kim",
        2007,
        "A.6",
        eq.jeong,
        eq.Jeong,
        _p(_JEONG),
        sees_displacement=False,
        validity=PUBLISHED + STANDSTILL,
    ),
    LossCard(
        LossModel.MJ1,
        "MJ1",
        "Moslått and others",
        2018,
        "A.7",
        eq.mj1,
        eq.MJ1,
        _p({"C_e": _NM, "C_f": "m^3", "C_g": "m^3", "C_m": "m^5/N", "C_i": "1/m^4", "C_k": "m^2"}),
        validity=FITTED + STANDSTILL,
    ),
    LossCard(
        LossModel.MJ2,
        "MJ2",
        "Moslått and others",
        2018,
        "A.8",
        eq.mj2,
        eq.MJ2,
        _p({"C_e": _NM, "C_f": "m^3", "C_g": "m^3", "C_i": "1/m^4", "C_m": "m^5/N"}),
        validity=FITTED,
    ),
    LossCard(
        LossModel.MJ3,
        "MJ3",
        "Moslått and others",
        2018,
        "A.9",
        eq.mj3,
        eq.MJ3,
        _p({"C_e": _NM, "C_f": "m^3", "C_g": "m^3", "C_i": "1/m^4"}),
        validity=FITTED,
    ),
    LossCard(
        LossModel.MJ4,
        "MJ4",
        "Moslått and others",
        2018,
        "A.10, 2.12",
        eq.mj4,
        TorqueLossFit,
        _p({"X_1": "N m s/rad", "X_2": "N m s^2/rad^2/(m^3/rad)^3", "X_3": _PURE, "X_4": _NM, "X_5": "m^5/N"}),
        validity=FITTED,
    ),
    LossCard(
        LossModel.MJ5,
        "MJ5",
        "Moslått and others",
        2018,
        "A.11",
        eq.mj5,
        eq.MJ5,
        _p({"C_e": _NM, "C_f": _PURE, "C_g": "m^3", "C_i": "m^(2-3C_n) s^(C_n-2)", "C_n": _PURE, "C_m": "m^5/N"}),
        bent=("C_n",),
        validity=FITTED,
    ),
    LossCard(
        LossModel.MJ6,
        "MJ6",
        "Moslått and others",
        2018,
        "A.12",
        eq.mj6,
        eq.MJ6,
        _p({"C_e": _NM, "C_f": _PURE, "C_g": "m^3", "C_m": "m^5/N", "C_i": "1/m^4", "C_k": "m^2"}),
        validity=FITTED + STANDSTILL,
    ),
)

CARDS: Mapping[LossModel, LossCard] = MappingProxyType({c.model: c for c in _CARDS})
