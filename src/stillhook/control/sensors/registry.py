"""The sensors there are: modules of the user, each checked once."""

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
from stillhook.control.interface import Setting
from stillhook.control.registry import check_setting, source_of
from stillhook.control.sensors import interface
from stillhook.control.sensors.interface import QUANTITIES

CONTRACTS = {
    remembers: Contract("A sensor", needed, interface.Undeclared, source_of)
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
    """A sensor as its module declares it; see `stillhook.control.sensors.interface`."""

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


def check_module(module: ModuleType) -> None:
    """A module is a sensor. Errors: SpecError of one line with file and attribute."""
    CONTRACTS[hasattr(module, "Memory") or hasattr(module, "begin")].check(module)
    contract.check_values(module, VALUES)
    contract.check_record(module, "Settings", Record(mark=Setting, nested=False))
    for name, setting in contract.marks_of(module.Settings, Setting).items():
        check_setting(module, f"Settings.{name}", setting)
        if setting.search is not None:
            raise fault(module, f"Settings.{name}: search = {setting.search!r}", "Leave it out: sensors are not tuned")
    if hasattr(module, "Memory"):
        contract.check_record(module, "Memory", Record(nested=False))


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
