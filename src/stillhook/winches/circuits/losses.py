"""Torque loss of motors as a crane file gives it: MJ4, or another model or a measured map by choice."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import Field, create_model, model_validator

from stillhook import units as u
from stillhook.physics.hydraulics.motor import TorqueLossFit
from stillhook.physics.hydraulics.motor_laws import BLIND, LAWS, map_record, record_of
from stillhook.physics.hydraulics.motor_losses import LossMotor
from stillhook.tables.table import Number, Spec, Text


class TorqueLoss(Spec):
    """Torque loss of one motor shaft, model MJ4 (Moslatt 2020 eq. 2.12)."""

    X_1: u.ViscousTorque = Field(ge=0, description="loss per shaft speed")
    X_2: u.TorqueLossTurbulent = Field(ge=0, description="turbulent loss per speed squared and displacement cubed")
    X_3: Number = Field(ge=0, description="loss per pressure and displacement")
    X_4: u.Torque = Field(ge=0, description="constant loss")
    X_5: u.TorqueLossPressure = Field(ge=0, description="loss per pressure squared")


MJ4, MAP = "mj4", "map"
X_NAMES = tuple(TorqueLoss.model_fields)
SCALE, EXPONENT = "scale", "C_n"
"""Scale of a model, and the exponent of MJ5, in which its loss is not linear."""
LossName = StrEnum(  # type: ignore[misc]
    "LossName", {name.upper().replace("-", "_"): name for name in (*(law for law in LAWS if law not in BLIND), MAP)}
)


class LossModel(Spec):
    """Torque loss of the motors by another model than MJ4, or by a measured map."""

    law: LossName = Field(description='model, as `stillhook identify motor` names it, "mj4" (that of loss) or "map"')
    C: tuple[Number, ...] | None = Field(
        default=None, max_length=30, description="parameters of the model in SI, in the order in which it is written"
    )
    n_low: u.Rotation | None = Field(
        default=None,
        gt=0,
        description="lowest speed of the fit, below which the loss at the notches, and a model that interpolates, are"
        " held; default 400 rev/min",
    )
    map: Text | None = Field(
        default=None, description="CSV file of the map, seen from this file, or map of the library"
    )
    D_m: tuple[u.Displacement, ...] | None = Field(default=None, min_length=1, description="levels of the map, rising")
    omega_m: tuple[u.Rotation, ...] | None = Field(default=None, min_length=1, description="levels of the map, rising")
    dp_m: tuple[u.Pressure, ...] | None = Field(default=None, min_length=1, description="levels of the map, rising")
    T_f: tuple[Annotated[u.Torque, Field(ge=0)], ...] | None = Field(
        default=None, max_length=20000, description="loss at every combination of levels, the pressure fastest"
    )
    scale: Number = Field(default=1.0, ge=0, description="loss of these motors over that of the model")

    @model_validator(mode="before")
    @classmethod
    def _varies_with_displacement(cls, data: Any) -> Any:
        law = data.get("law") if isinstance(data, Mapping) else None
        if isinstance(law, str) and law in BLIND:
            raise ValueError(
                f'law = "{law}": this model does not vary with displacement. Choose {", ".join(LossName)}.'
            )
        return data

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if self.law != MAP:
            self._needs_parameters()
        elif self.T_f is None or None in self.levels:
            raise ValueError('law = "map": it needs map, the name of a CSV file.')
        else:
            self._is_a_grid()
        return self

    def _needs_parameters(self) -> None:
        names = () if self.law == MJ4 else LAWS[self.law].record._fields
        if len(names) != len(self.C or ()):
            takes = f"{len(names)} numbers, {', '.join(names)}" if names else "none: its numbers are those of loss"
            raise ValueError(f'C: "{self.law}" takes {takes}; here are {len(self.C or ())}.')
        if names and not LAWS[self.law].interpolates and min(self.C or ()) < 0.0:
            raise ValueError(
                f'C: a parameter of "{self.law}" is negative: a loss never drives the shaft. Give 0 or more.'
            )
        if self.map is not None or self.T_f is not None:
            raise ValueError(f'law = "{self.law}" and a map: choose law = "map", or remove the map.')

    def _is_a_grid(self) -> None:
        for name, levels in zip(("D_m", "omega_m", "dp_m"), self.levels, strict=True):
            if any(b <= a for a, b in pairwise(levels)) or levels[0] < 0.0:
                raise ValueError(f"{name}: levels of a map rise, from 0 or above. Sort them.")
        if len(self.T_f or ()) != (count := math.prod(map(len, self.levels))):
            raise ValueError(
                f"T_f: {len(self.T_f or ())} losses for {count} combinations of levels. Give one for each."
            )

    @property
    def levels(self) -> tuple[Any, ...]:
        """Levels of a map: displacement, speed, pressure drop."""
        return self.D_m, self.omega_m, self.dp_m

    def fit(self, loss: TorqueLoss, D_max: float) -> Any:
        """The record by which the twin knows it."""
        if self.law == MAP:
            return map_record(*self.levels, self.T_f)(self.scale)
        if self.law == MJ4:
            return TorqueLossFit(*(self.scale * getattr(loss, name) for name in TorqueLossFit._fields))
        motor = LossMotor(D_max) if self.n_low is None else LossMotor(D_max, omega_low=self.n_low)
        return record_of(self.law)(LAWS[self.law].record(*(self.C or ())), motor, self.scale)


_FITTED_AS_WELL: dict[str, Any] = {
    law.replace("-", "_"): (LossModel | None, Field(default=None, description="a model that fits as well"))
    for law in LossName
    if law != MAP
}
LossAlternatives: Any = create_model(
    "LossAlternatives",
    __base__=Spec,
    __doc__="Models that fit the map of a motor as well as the one in force, a table for each.",
    **_FITTED_AS_WELL,
)


def loss_fit(motor: Any) -> Any:
    """The torque loss of a motor: the record of its model."""
    loss = motor.loss
    if motor.loss_model is not None:
        return motor.loss_model.fit(loss, motor.D_max)
    return TorqueLossFit(X_1=loss.X_1, X_2=loss.X_2, X_3=loss.X_3, X_4=loss.X_4, X_5=loss.X_5)


def alternatives_of(motor: Any) -> tuple[LossModel, ...]:
    """Models of a motor's loss that fit as well as the one in force."""
    models = () if motor.alternatives is None else (model for _, model in motor.alternatives)
    return tuple(model for model in models if model is not None)


def loss_names(law: str) -> tuple[str, ...]:
    """What tests of a crane determine of a loss: the parameters of its model, but for an exponent; of a map, and of a
    model that interpolates, its scale alone."""
    if law == MJ4:
        return X_NAMES
    if law == MAP or LAWS[law].interpolates:
        return (SCALE,)
    return tuple(name for name in LAWS[law].record._fields if name != EXPONENT)


def loss_values(motor: Any) -> dict[str, float]:
    """The values of `loss_names` [SI]."""
    fit, names = loss_fit(motor), loss_names(motor.law)
    if names == (SCALE,) or motor.law == MJ4:
        return {name: getattr(fit, name) for name in names}
    return {name: fit.scale * getattr(fit.law, name) for name in names}


def unit_loss(motor: Any, name: str) -> Any:
    """The record of a motor's loss with one of `loss_names`, or of MJ4's parameters, at 1 and the others at 0."""
    if name in X_NAMES:
        return TorqueLossFit(**{n: float(n == name) for n in X_NAMES})
    fit = loss_fit(motor)._replace(scale=1.0)
    return fit if name == SCALE else fit._replace(law=_law(fit.law, {name: 1.0}))


def _law(law: Any, values: Mapping[str, float]) -> Any:
    return law._replace(**{name: values.get(name, 0.0) for name in law._fields if name != EXPONENT})


def loss_fields(motor: Any, values: Mapping[str, float]) -> dict[str, Any]:
    """The fields of a motor that give its loss with these values of its `loss_names`; those not named are as before."""
    values = loss_values(motor) | dict(values)
    if motor.law == MJ4:
        return {"loss": TorqueLoss.model_construct(None, **values), "loss_model": None}
    new: dict[str, Any] = dict(values)
    if SCALE not in values:
        new = {"C": tuple(_law(loss_fit(motor).law, values)), "scale": 1.0}
    return {"loss": motor.loss, "loss_model": motor.loss_model.model_copy(update=new)}
