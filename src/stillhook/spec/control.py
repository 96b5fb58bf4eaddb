"""Settings of a crane's PLC: those that all controllers share, a table for each controller with additional ones, and
the prediction of the tip's motion in place of extrapolating it."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Any, Self

from pydantic import Field, create_model, model_validator

from stillhook import units as u
from stillhook.control.plant import PlantParameters
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.errors import SpecError
from stillhook.physics.tip_prediction import T_MOST
from stillhook.spec.guard import GuardTable
from stillhook.spec.settings import optional_tables, settings_table
from stillhook.tables.table import Fraction, Number, Spec


class Predictor(StrEnum):
    """What predicts the tip's motion."""

    MODES = "modes"


class PredictionTable(Spec):
    """Prediction of the tip's motion for motion units that are late; without this table it is extrapolated."""

    kind: Predictor = Field(default=Predictor.MODES, description="oscillators that a Kalman filter follows")
    t_least: u.Time = Field(default=0.05, ge=0, le=1, description="shortest lead that is predicted, not extrapolated")
    noise_v: u.Speed = Field(default=0.003, gt=0, description="standard deviation assumed of the speed's noise")
    noise_a: u.Acceleration = Field(default=0.02, gt=0, description="that of the acceleration's noise")
    noise_w: u.Speed = Field(
        default=0.14, gt=0, description="speed that random acceleration gives each oscillator in 1 s"
    )
    period_least: u.Time = Field(default=3.0, ge=1, description="shortest period of the oscillators")
    period_most: u.Time = Field(default=24.0, le=100, description="longest period of the oscillators")

    @model_validator(mode="after")
    def _periods_increase(self) -> Self:
        if self.period_most < 2.0 * self.period_least:
            raise ValueError(
                f'period_most = "{self.period_most:g} s" is below twice period_least = "{self.period_least:g} s".'
                " Give a longer one."
            )
        return self


def refuse_longer(lead: float) -> None:
    """Errors: ValueError where a lead [s] is longer than any that is predicted."""
    if lead > T_MOST:
        raise ValueError(
            f"a lead of {lead:g} s is beyond what [control.prediction] predicts, {T_MOST:g} s. Shorten t_lead and"
            " t_lead_ff, or remove the table."
        )


class DisplacementLimit(StrEnum):
    """What SSC's smallest displacement follows from."""

    LOAD = "load"
    TORQUE = "torque"


class Control(Spec):
    """Settings of the heave-compensation controller. K_1 and K_2 are derived from the winch unless given."""

    K_p: u.GainPerLength = Field(ge=0, description="position gain")
    K_1: u.TimePerLength | None = Field(default=None, gt=0, description="speed feedforward")
    K_2: u.TimeSquaredPerLength | None = Field(default=None, ge=0, description="acceleration feedforward")
    u_thr: Number = Field(ge=0, lt=1, description="feedforward at which SSC starts to reduce the motors")
    alpha_ns: Fraction = Field(description="motor displacement in normal-speed mode")
    alpha_hs: Fraction = Field(description="motor displacement in high-speed mode")
    alpha_swl: Fraction | None = Field(
        default=None, description="displacement that SSC keeps for the SWL (D_calc_min); default alpha_ns"
    )
    displacement_limit: DisplacementLimit | None = Field(
        default=None,
        description='rule of SSC\'s smallest displacement: in proportion to the load ("load", the default), or from'
        ' torque, permitted pressure and speed limits ("torque")',
    )
    p_most: u.Pressure | None = Field(
        default=None, gt=0, description="highest pressure that the rule by torque allows; default active.relief.p"
    )
    t_lead: u.Time | None = Field(
        default=None, ge=0, le=2, description="time by which the PLC extrapolates the tip's motion; default 0"
    )
    t_lead_ff: u.Time | None = Field(
        default=None, ge=0, le=2, description="that time for the feedforward alone; default t_lead"
    )
    t_cycle: u.Time = Field(ge=1e-4, le=1, description="cycle of the controller")
    compute_share: Number | None = Field(
        default=None, ge=0, le=1, description="time from reading to writing over the cycle; default 0"
    )
    tau_F: u.Time = Field(ge=0, description="low-pass of the load cell")
    t_bumpless: u.Time = Field(ge=0, description="time over which a mode change is blended")
    tau_acc: u.Time = Field(ge=0, description="slow mean of the accumulator pressure that the passive pumps follow")
    K_acc: u.GainPerPressure = Field(ge=0, description="passive pump command per gas pressure below p_0")
    B_v: u.ViscousTorque = Field(ge=0, description="viscous friction of the linear analysis, for all friction models")
    guard: GuardTable | None = Field(default=None, description="guard before the controller")
    prediction: PredictionTable | None = Field(default=None, description="prediction of the tip's motion")
    known: PlantParameters | None = Field(
        default=None, exclude=True, description="numbers of the crane that its PLC was set up for; none: its own"
    )

    @model_validator(mode="after")
    def _leads_are_predicted(self) -> Self:
        if self.prediction is not None:
            refuse_longer(max(self.t_lead or 0.0, self.feedforward_lead))
        return self

    @property
    def feedforward_lead(self) -> float:
        """Time by which the PLC extrapolates the tip's motion for the feedforward [s]."""
        lead = self.t_lead if self.t_lead_ff is None else self.t_lead_ff
        return lead or 0.0

    @property
    def computing(self) -> float:
        """Time from reading to writing within a cycle [s]."""
        return (self.compute_share or 0.0) * self.t_cycle


def own_table(control: Control, law: ControlLaw) -> Spec:
    """The table of a controller's own settings, the default one where the crane file gives none."""
    table: Spec | None = getattr(control, law.field, None)
    return CONTROLLER_TABLES[law.field]() if table is None else table


def own_settings(control: Control, law: ControlLaw) -> Any:
    """A controller's Settings record for a crane: what the crane file gives, defaults for the rest; None for a
    controller that has none."""
    if law.record is None:
        return None
    table = own_table(control, law)
    return law.record(**{name: float(getattr(table, name)) for name in law.settings})


CONTROLLER_TABLES = {law.field: settings_table("Control", law) for law in CONTROLLERS.values() if law.settings}
"""Tables of controllers with additional settings, by their name in a file: hyphens become underscores."""

for law in CONTROLLERS.values():
    if law.settings and law.field in Control.model_fields:
        raise SpecError(f'{law.file.name}: NAME = "{law.name}" is a setting of [control] already. Choose another name.')
if not TYPE_CHECKING and CONTROLLER_TABLES:
    Control = create_model("Control", __base__=Control, __doc__=Control.__doc__, **optional_tables(CONTROLLER_TABLES))
