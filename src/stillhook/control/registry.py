"""The controllers there are: modules of `stillhook.control.controllers` and of the user, each checked once."""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import Any

from stillhook.base.extensions import extensions, modules_in
from stillhook.control import controllers
from stillhook.control.interface import DISPLACEMENT, SPEED, Reading, Sensed, Setting
from stillhook.errors import SpecError
from stillhook.physics.scalar import scalar_of
from stillhook.units import KINDS

ARGUMENTS = ("r", "plc", "s", "m")
"""Arguments of a controller's cycle, s only with Settings and m only with Memory."""
LAST = 100
"""Place in lists of a controller that names none."""


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
    drives: tuple[str, ...]  # kinds of drive that it commands
    file: Path
    shipped: bool

    @property
    def field(self) -> str:
        """Its name as a field: that of its table in a crane's control settings."""
        return self.name.replace("-", "_")

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

    def displacement(self, u_ff: float, F: float, K_wire: float, plc: Any, settings: Any = None) -> float:
        """Displacement of the motors that the law demands at a feedforward u_ff [-] with F on the load cell [N], on the
        layer of K_wire [-]."""
        y = Sensed(
            s_tip=0.0,
            v_tip=0.0,
            a_tip=0.0,
            v_op=0.0,
            s_op=0.0,
            mode=self.code,
            f_pump=1.0,
            s_w=0.0,
            F=F,
            alpha_m=1.0,
            K_wire=K_wire,
            dp=0.0,
            dp_load=0.0,
            p_hp=0.0,
        )
        return float(self.demand(Reading(y=y, e_c=0.0, F=F, u_ff=u_ff, u_fb=0.0), plc, settings).u_m)


def _law(module: ModuleType, shipped: bool) -> ControlLaw:
    """A module as a controller, without its code. Errors: SpecError that names the module and what it lacks."""
    file = Path(str(module.__file__))
    for attribute in ("NAME", "TITLE", "cycle"):
        if not hasattr(module, attribute):
            raise SpecError(f"{file.name}: {attribute} is missing. A controller module needs NAME, TITLE and cycle.")
    name = module.NAME
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise SpecError(f"{file.name}: NAME = {name!r}. Use lower-case letters, digits and hyphens, such as ssc-cubic.")
    record, memory = getattr(module, "Settings", None), getattr(module, "Memory", None)
    wanted = [a for a in ARGUMENTS if (a != "s" or record) and (a != "m" or memory)]
    law = scalar_of(module.cycle)
    if law is None:
        raise SpecError(f"{file.name}: cycle is not decorated with @scalar.")
    have = list(inspect.signature(law.source).parameters)
    if have != wanted:
        raise SpecError(f"{file.name}: cycle({', '.join(have)}) must be cycle({', '.join(wanted)}).")
    return ControlLaw(
        name=name,
        title=module.TITLE,
        label=getattr(module, "LABEL", name),
        code=-1.0,
        order=getattr(module, "ORDER", LAST),
        cycle=module.cycle,
        record=record,
        memory=memory,
        settings=dict(_settings(record, file.name)) if record else {},
        uses=tuple(getattr(module, "USES", ())),
        family=getattr(module, "FAMILY", "other"),
        usual=getattr(module, "USUAL", False),
        swl_share=getattr(module, "SWL_SHARE", 1.0),
        compensates=getattr(module, "COMPENSATES", True),
        drives=_drives(module, file.name),
        file=file,
        shipped=shipped,
    )


def _drives(module: ModuleType, file: str) -> tuple[str, ...]:
    """Kinds of drive that a controller commands. Errors: SpecError."""
    drives = tuple(getattr(module, "DRIVES", (DISPLACEMENT,)))
    for each in drives:
        if each not in (DISPLACEMENT, SPEED):
            raise SpecError(f"{file}: DRIVES: {each!r} is no kind of drive. Choose {DISPLACEMENT} or {SPEED}.")
    return drives


def _settings(record: Any, file: str) -> Iterator[tuple[str, Setting]]:
    for name, hint in typing.get_type_hints(record, include_extras=True).items():
        marks = [mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Setting)]
        if not marks:
            raise SpecError(f"{file}: Settings.{name}: annotate it as Annotated[float, Setting(...)].")
        if marks[0].kind and marks[0].kind not in KINDS:
            raise SpecError(f"{file}: Settings.{name}: unknown kind {marks[0].kind!r}. Choose {', '.join(KINDS)}.")
        yield name, marks[0]


def _all() -> dict[str, ControlLaw]:
    laws = [_law(module, True) for module in modules_in(controllers)]
    laws += [_law(module, False) for module in extensions() if hasattr(module, "cycle")]
    laws.sort(key=lambda law: (law.order, law.name))
    by_name: dict[str, ControlLaw] = {}
    for code, law in enumerate(laws):
        if law.name in by_name:
            raise SpecError(
                f'{law.file.name}: the controller "{law.name}" is that of {by_name[law.name].file.name}. Change NAME.'
            )
        by_name[law.name] = ControlLaw(**{**vars(law), "code": float(code)})
    return by_name


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
