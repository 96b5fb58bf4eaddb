"""Tables of a crane file for modules with settings: controllers, and the sensors that a crane has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Protocol, Self

from pydantic import Field, create_model, model_validator

from stillhook import units as u
from stillhook.base.extensions import VARIABLE
from stillhook.control.interface import Setting
from stillhook.control.sensors import SENSORS, Sensor, twice
from stillhook.tables.table import Number, Spec


class WithSettings(Protocol):
    """A module with settings, as its registry has it."""

    @property
    def field(self) -> str: ...

    @property
    def title(self) -> str: ...

    @property
    def settings(self) -> Mapping[str, Setting]: ...

    @property
    def file(self) -> Any: ...


def settings_table(kind: str, module: WithSettings) -> type[Spec]:
    """The table of a module's settings; kind: of the module, for the name of the model."""
    fields: dict[str, Any] = {
        name: _field(setting, f"{module.file.name}: Settings.{name}: default")
        for name, setting in module.settings.items()
    }
    name = f"{kind}_{module.field}"
    table = create_model(name, __base__=Spec, __doc__=f"Settings of {module.title}.", __module__=__name__, **fields)
    globals()[name] = table  # found by its name where a crane comes from another process
    return table


def _field(setting: Setting, where: str) -> tuple[Any, Any]:
    """Annotation and field of one setting; its default is read as a crane file's text is."""
    marked: Any = Annotated[float, u.Quantity(setting.kind)] if setting.kind else Number
    default = setting.default
    value = u.parse(default, setting.kind, where) if isinstance(default, str) else float(default)
    return marked, Field(default=value, ge=setting.least, le=setting.most, description=setting.meaning)


def optional_tables(tables: Mapping[str, type[Spec]]) -> dict[str, Any]:
    """Fields of a model for tables that a file may leave out."""
    return {name: (table | None, Field(default=None, description=table.__doc__)) for name, table in tables.items()}


class SensorTables(Spec):
    """Sensors between the winch and its PLC, a table for each; what has none is read as the scenario says."""

    @model_validator(mode="before")
    @classmethod
    def _are_known(cls, data: Any) -> Any:
        fields = [sensor.field for sensor in SENSORS.values()]
        if isinstance(data, Mapping) and (unknown := [name for name in data if name not in fields]):
            choose = f"Choose {', '.join(fields)}, or name" if fields else "Name"
            raise ValueError(
                f"{unknown[0]} is not a sensor that is loaded. {choose} the file of its module in {VARIABLE}."
            )
        return data

    @model_validator(mode="after")
    def _read_each_quantity_once(self) -> Self:
        if problem := twice(sensor.name for sensor in fitted(self)):
            raise ValueError(f"{problem}. Remove one of the two tables.")
        return self


SENSOR_TABLES: dict[str, type[Spec]] = {sensor.field: settings_table("Sensor", sensor) for sensor in SENSORS.values()}
"""Tables of sensors by their name in a file: hyphens become underscores."""
if not TYPE_CHECKING:
    SensorTables = create_model(
        "Sensors", __base__=SensorTables, __doc__=SensorTables.__doc__, **optional_tables(SENSOR_TABLES)
    )


def fitted(tables: Spec | None) -> list[Sensor]:
    """The sensors that have a table in [sensors] of a crane file."""
    return [sensor for sensor in SENSORS.values() if tables is not None and getattr(tables, sensor.field) is not None]


def left_out(tables: Spec | None) -> list[str]:
    """What a method says whose PLC reads true values, for a crane with sensors; nothing for any other."""
    names = ", ".join(sensor.name for sensor in fitted(tables))
    return [f"without {names}: this method's PLC reads true values"] if names else []


def sensor_settings(tables: Spec | None) -> dict[str, Any]:
    """Settings record of every sensor that has a table, by its name."""
    return {
        sensor.name: sensor.record(
            **{name: float(getattr(getattr(tables, sensor.field), name)) for name in sensor.settings}
        )
        for sensor in fitted(tables)
    }
