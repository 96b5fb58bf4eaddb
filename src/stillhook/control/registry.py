"""The controllers there are: modules of `stillhook.control.controllers` and of the user, each checked once."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import Any

from stillhook.base import contract
from stillhook.base.contract import FLAG, NAME, TEXT, Contract, Record, Rule, fault
from stillhook.base.extensions import extensions, modules_in
from stillhook.control import controllers, interface
from stillhook.control.interface import DISPLACEMENT, SPEED, USABLE, Reading, Sensed, Setting, Undeclared
from stillhook.physics.scalar import Scalar, scalar_of
from stillhook.units import KINDS, parse


def source_of(function: Any) -> Callable[..., Any] | None:
    """The source of a scalar function; None for any other."""
    law: Scalar | None = scalar_of(function)
    return None if law is None else law.source


CONTRACTS = {
    (settings, memory): Contract("A controller", needed, Undeclared, source_of)
    for (settings, memory), needed in {
        (False, False): interface.Controller,
        (True, False): interface.ControllerWithSettings,
        (False, True): interface.ControllerWithMemory,
        (True, True): interface.ControllerWithBoth,
    }.items()
}
"""The contract of a module with and without Settings and Memory of its own."""
RESERVED = ("none", "cap-80", "phc", "strong-ssc", "best-classic", "manual")
"""Names of other ways to account for a winch, and of the mode that is always first."""
VALUES = {
    "NAME": Rule(lambda v: NAME.holds(v) and v not in RESERVED, f"{NAME.allowed}, and not {', '.join(RESERVED)}"),
    "TITLE": TEXT,
    "LABEL": TEXT,
    "ORDER": Rule(lambda value: contract.is_number(value) and value > 0, "a number above 0, the place of manual mode"),
    "USES": contract.names_of(USABLE, "settings of [control] and [active.motor]"),
    "FAMILY": contract.one_of("classic", "other"),
    "USUAL": FLAG,
    "SWL_SHARE": Rule(lambda value: contract.is_number(value) and 0 < value <= 1, "a number above 0, at most 1"),
    "COMPENSATES": FLAG,
    "LEARNS": FLAG,
    "BEGINS": Rule(lambda value: contract.is_number(value) and 0 <= value <= 60, "a time from 0 to 60 s"),
    "YIELDS": FLAG,
    "DRIVES": contract.names_of((DISPLACEMENT, SPEED), "kinds of drive", least=1),
}
"""What a module may declare, and what each must be."""


@dataclass(frozen=True)
class ControlLaw:
    """A controller as its module declares it; see `stillhook.control.interface`."""

    name: str
    title: str
    label: str
    code: float  # what the PLC calls it
    order: int
    cycle: Callable[..., Any]
    record: Any  # class of its Settings, None without
    memory: Any  # class of its Memory, None without
    settings: Mapping[str, Setting]
    uses: tuple[str, ...]
    family: str
    usual: bool
    swl_share: float
    compensates: bool
    learns: bool
    begins: float  # [s]
    yields: bool
    drives: tuple[str, ...]  # kinds of drive that it commands
    file: Path
    shipped: bool

    @property
    def field(self) -> str:
        """Its name as a field: that of its table in a crane's control settings."""
        return self.name.replace("-", "_")

    @property
    def settings_field(self) -> str:
        """Field of its settings in what controllers and sensors carry."""
        return f"{self.field}_settings"

    @property
    def in_every_kernel(self) -> bool:
        """Whether every kernel holds it: shipped, and nothing but the shared settings to it. Others are compiled where
        a case uses them."""
        return self.shipped and self.record is None and self.memory is None

    def demand(self, reading: Reading, plc: Any, settings: Any) -> Any:
        """The `Demand` of one cycle from the memory it starts with."""
        arguments = [reading, plc]
        if self.record is not None:
            arguments.append(settings)
        if self.memory is None:
            return self.cycle(*arguments)
        return self.cycle(*arguments, self.memory())[0]

    def displacement(
        self, u_ff: float, F: float, K_wire: float, plc: Any, settings: Any = None, alpha_m: float = 1.0
    ) -> float:
        """Displacement of the motors that the law demands at a feedforward u_ff [-] with F on the load cell [N], on the
        layer of K_wire [-], while the measured one is alpha_m [-]."""
        still = Sensed._make([0.0] * len(Sensed._fields))
        y = still._replace(mode=self.code, f_pump=1.0, F=F, alpha_m=alpha_m, K_wire=K_wire)
        return float(self.demand(Reading(y=y, e_c=0.0, F=F, u_ff=u_ff, u_fb=0.0), plc, settings).u_m)


def _law(module: ModuleType, shipped: bool) -> ControlLaw:
    """A module as a controller, without its code. Errors: SpecError of one line with file and attribute."""
    if not shipped:
        check_module(module)
    declared = {name: getattr(module, name, value) for name, value in vars(Undeclared).items() if name.isupper()}
    return ControlLaw(
        name=module.NAME,
        title=module.TITLE,
        label=declared["LABEL"] or module.NAME,
        code=-1.0,
        order=declared["ORDER"],
        cycle=module.cycle,
        record=getattr(module, "Settings", None),
        memory=getattr(module, "Memory", None),
        settings=contract.marks_of(module.Settings, Setting) if hasattr(module, "Settings") else {},
        uses=declared["USES"],
        family=declared["FAMILY"],
        usual=declared["USUAL"],
        swl_share=declared["SWL_SHARE"],
        compensates=declared["COMPENSATES"],
        learns=declared["LEARNS"],
        begins=declared["BEGINS"],
        yields=declared["YIELDS"],
        drives=declared["DRIVES"],
        file=contract.file_of(module),
        shipped=shipped,
    )


def contract_of(module: ModuleType) -> Contract:
    """The contract of a module with the Settings and Memory that it has."""
    return CONTRACTS[hasattr(module, "Settings"), hasattr(module, "Memory")]


def check_module(module: ModuleType) -> None:
    """A module is a controller. Errors: SpecError of one line with file and attribute."""
    contract_of(module).check(module)
    contract.check_values(module, VALUES)
    drives, uses = getattr(module, "DRIVES", Undeclared.DRIVES), getattr(module, "USES", Undeclared.USES)
    if uses and SPEED in drives:
        do = f'A controller that uses them has DRIVES = ("{DISPLACEMENT}",)'
        raise fault(module, "USES names settings of motors, which a speed drive has not", do)
    if hasattr(module, "Settings"):
        contract.check_record(module, "Settings", Record(mark=Setting, nested=False))
        for name, setting in contract.marks_of(module.Settings, Setting).items():
            check_setting(module, f"Settings.{name}", setting)
    if hasattr(module, "Memory"):
        contract.check_record(module, "Memory", Record(nested=False, starts=True))


def check_setting(module: ModuleType, place: str, setting: Setting) -> None:
    """Kind, ranges, default and meaning of a setting. Errors: SpecError."""
    if setting.kind not in ("", *KINDS):
        raise fault(module, f"{place}: unknown kind {setting.kind!r}", f'Choose "" or {", ".join(KINDS)}')
    ends = (setting.least, setting.most)
    if not contract.is_range(ends):
        raise fault(module, f"{place}: least {ends[0]!r}, most {ends[1]!r}", "Give two numbers in SI that rise")
    where = f"{contract.file_of(module).name}: {place}: default"
    text = isinstance(setting.default, str) and setting.kind != ""
    default = parse(setting.default, setting.kind, where) if text else setting.default
    if isinstance(default, str) or not contract.is_number(default) or not ends[0] <= default <= ends[1]:
        raise fault(
            module,
            f"{place}: default = {setting.default!r}",
            f"It must be a number from {ends[0]:g} to {ends[1]:g} in SI",
        )
    search = setting.search
    if search is not None and not (contract.is_range(search) and ends[0] <= search[0] and search[1] <= ends[1]):
        do = f"It must be a pair of numbers that rises, from {ends[0]:g} to {ends[1]:g} in SI"
        raise fault(module, f"{place}: search = {search!r}", do)
    if not contract.is_text(setting.meaning):
        raise fault(module, f"{place}: meaning = {setting.meaning!r}", f"It must be {TEXT.allowed}")


def _all() -> dict[str, ControlLaw]:
    laws = [_law(module, True) for module in modules_in(controllers)]
    laws += [_law(module, False) for module in extensions() if hasattr(module, "cycle")]
    named = contract.by_name(laws, "controller").values()
    ordered = sorted(named, key=lambda law: (law.order, law.name))
    return {law.name: dataclasses.replace(law, code=float(code)) for code, law in enumerate(ordered)}


CONTROLLERS: Mapping[str, ControlLaw] = _all()
"""Every controller by its name, in the order of lists."""


class Mode(StrEnum):
    """Name of a controller; there is one for each module.

    >>> import stillhook
    >>> stillhook.Mode("ssc").compensates, stillhook.Mode.MANUAL.compensates
    (True, False)
    """

    vars().update({name.upper().replace("-", "_"): name for name in CONTROLLERS})

    @property
    def law(self) -> ControlLaw:
        """The controller itself."""
        return CONTROLLERS[self.value]

    @property
    def compensates(self) -> bool:
        """Whether it compensates the tip's motion."""
        return self.law.compensates


def code_of(mode: str) -> float:
    """What the PLC calls a controller."""
    return CONTROLLERS[mode].code


def mode_of_code(code: float) -> Mode:
    """The controller that the PLC calls so."""
    return list(Mode)[round(code)]


def modes_of(drive: str) -> tuple[Mode, ...]:
    """The controllers of a kind of drive."""
    return tuple(mode for mode in Mode if drive in mode.law.drives)


def usual_of(drive: str) -> tuple[Mode, ...]:
    """Those that are compared where a user names none."""
    return tuple(mode for mode in modes_of(drive) if mode.law.usual)


MANUAL_MODE = Mode("manual")
"""The mode in which the operator moves the winch."""
DEFAULT_MODE = Mode("ssc")
"""The controller of a closed circuit where a user names none; `default_of` has that of any drive."""
USUAL = usual_of(DISPLACEMENT)
"""Controllers that are compared on closed circuits where a user names none."""


def default_of(drive: str) -> Mode:
    """The controller of a kind of drive where a user names none."""
    return DEFAULT_MODE if drive in DEFAULT_MODE.law.drives else usual_of(drive)[-1]


CLASSIC = tuple(mode for mode in USUAL if mode.law.family == "classic")
"""The classic controllers, with fixed motors, that others are compared with."""
