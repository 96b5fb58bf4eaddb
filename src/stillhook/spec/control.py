"""Settings of a crane's controllers: those that all share, and a table for each controller that has some of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, create_model

from stillhook import units as u
from stillhook.control.interface import Setting
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.tables.table import Fraction, Number, Spec


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
    t_lead: u.Time | None = Field(
        default=None, ge=0, le=2, description="time by which the PLC extrapolates the tip's motion; default 0"
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

    @property
    def computing(self) -> float:
        """Time from reading to writing within a cycle [s]."""
        return (self.compute_share or 0.0) * self.t_cycle


def _table(law: ControlLaw) -> type[Spec]:
    """The table `[control.NAME]` of a controller."""
    fields: dict[str, Any] = {
        name: _field(setting, f"{law.file.name}: Settings.{name}: default") for name, setting in law.settings.items()
    }
    return create_model(f"Control_{law.field}", __base__=Spec, __doc__=f"Settings of {law.title}.", **fields)


def _field(setting: Setting, where: str) -> tuple[Any, Any]:
    """Annotation and field of one setting; its default is read as a crane file's text is."""
    marked: Any = Annotated[float, u.Quantity(setting.kind)] if setting.kind else Number
    default = setting.default
    value = u.parse(default, setting.kind, where) if isinstance(default, str) else float(default)
    return marked, Field(default=value, ge=setting.least, le=setting.most, description=setting.meaning)


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


CONTROLLER_TABLES: dict[str, type[Spec]] = {law.field: _table(law) for law in CONTROLLERS.values() if law.settings}
"""Tables of controllers with settings of their own, by their name in a file: hyphens become underscores."""

if not TYPE_CHECKING and CONTROLLER_TABLES:
    optional = {
        name: (table | None, Field(default=None, description=table.__doc__))
        for name, table in CONTROLLER_TABLES.items()
    }
    Control = create_model("Control", __base__=Control, __doc__=Control.__doc__, **optional)
