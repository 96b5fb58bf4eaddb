"""The torque-loss models that can be fitted: what each is called, where it is from, what its parameters are, where it
holds.

The equations are those of `stillhook.physics.hydraulics.motor_losses`; the table `models.toml` adds nothing to them. A
column of a linear fit is the model itself with one parameter at 1 and the others at 0.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.physics.hydraulics import motor_losses
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
class LossCard:
    """What there is to know about a model next to its equation."""

    model: LossModel
    title: str
    author: str
    year: int
    equation: str
    record: type[Any]
    """The parameters as the equation takes them, named as in paper A."""
    units: tuple[str, ...]
    """SI units of the parameters."""
    validity: str
    sees_displacement: bool = True
    positive: bool = True
    """Whether physics asks that no parameter is negative (a loss never drives the shaft)."""
    bent: tuple[str, ...] = ()
    """Parameters that the loss is not linear in."""

    @property
    def function(self) -> Callable[..., Any]:
        """The equation: f(omega_m, D_m, dp_m, record, motor) [N m]."""
        return getattr(motor_losses, self.model.name.lower())  # type: ignore[no-any-return]

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters in the order of the record."""
        return self.record._fields  # type: ignore[no-any-return]

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


def _cards() -> dict[LossModel, LossCard]:
    table = tomllib.loads(files(__package__).joinpath("models.toml").read_text(encoding="utf-8"))
    out = {}
    for model in LossModel:
        row = table[model]
        lists = {name: tuple(row.get(name, ())) for name in ("units", "bent")}
        out[model] = LossCard(model, **row | lists | {"record": getattr(motor_losses, row["record"])})
    return out


CARDS: Mapping[LossModel, LossCard] = MappingProxyType(_cards())
