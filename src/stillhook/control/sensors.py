"""The sensors there are between winch and PLC: modules of the user, each checked once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from stillhook.base import contract
from stillhook.base.contract import NAME, TEXT, Contract, Record, Rule, fault
from stillhook.base.extensions import extensions
from stillhook.base.variable import Row, Variable
from stillhook.control import interface, sensor_errors
from stillhook.control.interface import QUANTITIES, Setting
from stillhook.control.registry import CONTROLLERS, check_setting, source_of
from stillhook.units import parse, quote

CONTRACTS = {
    remembers: Contract("A sensor", needed, interface.SensorUndeclared, source_of)
    for remembers, needed in {False: interface.Sensor, True: interface.SensorWithMemory}.items()
}
"""The contract of a module without and with a Memory."""
SOME = contract.names_of(QUANTITIES, "", least=1)
VALUES = {
    "NAME": NAME,
    "TITLE": TEXT,
    "QUANTITY": Rule(lambda q: q in QUANTITIES or SOME.holds(q), f"one of {', '.join(QUANTITIES)}, or a tuple of some"),
}


@dataclass(frozen=True)
class Sensor:
    """A sensor as its module declares it; see `stillhook.control.interface`."""

    name: str
    title: str
    quantities: tuple[str, ...]
    reading: Callable[..., Any]
    begin: Callable[..., Any] | None
    record: Any  # class of its Settings
    memory: Any  # class of its Memory, None without
    settings: Mapping[str, Setting]
    file: Path

    @property
    def field(self) -> str:
        """Its name as a field: that of its table in a crane file."""
        return self.name.replace("-", "_")

    @property
    def settings_field(self) -> str:
        """Field of its settings in what controllers and sensors carry."""
        return f"sensor_{self.field}_settings"

    def memory_field(self, quantity: str) -> str:
        """Field there of what it remembers of a quantity."""
        return f"sensor_{self.field}_{quantity}_memory"


def check_module(module: ModuleType) -> None:
    """A module is a sensor. Errors: SpecError of one line with file and attribute."""
    CONTRACTS[hasattr(module, "Memory") or hasattr(module, "begin")].check(module)
    contract.check_values(module, VALUES)
    if module.NAME in ERROR_SENSORS:
        raise fault(module, f"NAME = {quote(module.NAME)} is that of a scenario's sensor", "Change NAME")
    if module.NAME in CONTROLLERS:
        raise fault(module, f"NAME = {quote(module.NAME)} is that of a controller", "Change NAME")
    contract.check_record(module, "Settings", Record(mark=Setting, nested=False))
    for name, setting in contract.marks_of(module.Settings, Setting).items():
        check_setting(module, f"Settings.{name}", setting)
        if setting.search is not None:
            raise fault(module, f"Settings.{name}: search = {setting.search!r}", "Leave it out: sensors are not tuned")
    if hasattr(module, "Memory"):
        contract.check_record(module, "Memory", Record(nested=False))
    _try(module)


_MEASURED = {
    "s_tip": ("m", "length", "up positive", "crane tip height as the PLC reads it"),
    "v_tip": ("m/s", "speed", "up positive", "crane tip speed as the PLC reads it"),
    "a_tip": ("m/s^2", "acceleration", "up positive", "crane tip acceleration as the PLC reads it"),
    "s_w": ("m", "length", "paid out positive", "wire paid out as the PLC reads it"),
    "F": ("N", "force", "", "wire tension as the PLC reads it"),
    "alpha_m": ("1", "", "", "displacement of the active motors as the PLC reads it"),
    "omega_m": ("rad/s", "rotation", "hoisting positive", "motor speed as the PLC reads it"),
    "p_a": ("Pa", "pressure", "gauge", "pressure of line A as the PLC reads it"),
    "p_b": ("Pa", "pressure", "gauge", "pressure of line B as the PLC reads it"),
    "dp": ("Pa", "pressure", "hoisting positive", "pressure of line A less B as the PLC reads it"),
    "p_hp": ("Pa", "pressure", "", "accumulator pressure as the PLC reads it"),
}


def measured(quantity: str) -> str:
    """Name of the signal that a sensor of a quantity gives, in a series."""
    return f"{quantity}_measured"


def sensor_rows() -> list[Variable]:
    """Rows of the signals of all sensors, those of scenarios included."""
    return [Row(*_MEASURED[quantity]).named(measured(quantity)) for quantity in QUANTITIES]


H = 0.01
"""PLC cycle at which a module is tried [s]."""


def _try(module: ModuleType) -> None:
    """One reading with the settings by default gives what the contract says. Errors: SpecError."""
    s = module.Settings(*[_value(setting) for setting in contract.marks_of(module.Settings, Setting).values()])
    if not hasattr(module, "Memory"):
        _check(module, "reading", _called(module, "reading", 1.0, H, s), contract.is_number, "a number")
        return

    def remembered(value: Any) -> bool:
        return isinstance(value, module.Memory) and all(map(contract.is_number, value))

    def both(value: Any) -> bool:
        return isinstance(value, tuple) and len(value) == 2 and contract.is_number(value[0]) and remembered(value[1])

    m = _called(module, "begin", 1.0, s)
    _check(module, "begin", m, remembered, "a Memory of numbers")
    _check(module, "reading", _called(module, "reading", 1.0, H, s, m), both, "a number and a Memory of numbers")


def _called(module: ModuleType, name: str, *arguments: Any) -> Any:
    """What a function of a module gives. Errors: SpecError for whatever it raises."""
    try:
        return getattr(module, name)(*arguments)
    except Exception as problem:
        wrong = f"{type(problem).__name__}: {' '.join(str(problem).split()).rstrip('.')}"
        raise fault(module, f"{name} at 1, with the settings by default: {wrong}", "Correct it") from problem


def _check(module: ModuleType, name: str, value: Any, holds: Callable[[Any], bool], allowed: str) -> None:
    if not holds(value):
        raise fault(module, f"{name} gave {quote(value)}", f"It must give {allowed}")


def _value(setting: Setting) -> float:
    """Its default [SI]."""
    default = setting.default
    return parse(default, setting.kind) if isinstance(default, str) else float(default)


def error_sensor(quantity: str) -> Sensor:
    """The sensor that a scenario gives a quantity, see `stillhook.control.sensor_errors`."""
    return ERROR_SENSORS[f"errors-{quantity.lower().replace('_', '-')}"]


def _error_sensor(quantity: str) -> Sensor:
    return Sensor(
        name=f"errors-{quantity.lower().replace('_', '-')}",
        title=f"errors of {quantity} in a scenario",
        quantities=(quantity,),
        reading=sensor_errors.reading,
        begin=sensor_errors.begin,
        record=sensor_errors.Settings,
        memory=sensor_errors.Memory,
        settings={},
        file=Path(sensor_errors.__file__),
    )


ERROR_SENSORS: Mapping[str, Sensor] = {sensor.name: sensor for sensor in map(_error_sensor, QUANTITIES)}
"""Sensors of scenarios by their names."""


def sensor_named(name: str) -> Sensor:
    """A sensor of a crane, or one of a scenario."""
    return SENSORS[name] if name in SENSORS else ERROR_SENSORS[name]


def sensor_of(module: ModuleType) -> Sensor:
    """A module as a sensor. Errors: as `check_module`."""
    check_module(module)
    quantity = module.QUANTITY
    return Sensor(
        name=module.NAME,
        title=module.TITLE,
        quantities=(quantity,) if isinstance(quantity, str) else quantity,
        reading=module.reading,
        begin=getattr(module, "begin", None),
        record=module.Settings,
        memory=getattr(module, "Memory", None),
        settings=contract.marks_of(module.Settings, Setting),
        file=contract.file_of(module),
    )


SENSORS: Mapping[str, Sensor] = contract.by_name(
    (sensor_of(module) for module in extensions() if hasattr(module, "reading")), "sensor"
)
"""Every sensor by its name."""


def twice(names: Iterable[str]) -> str:
    """The first two of these sensors that read one quantity, in words; "" where none do."""
    for one, other in itertools.combinations((SENSORS[name] for name in names), 2):
        for quantity in one.quantities:
            if quantity in other.quantities:
                return f"{one.name} and {other.name} both read {quantity}"
    return ""
