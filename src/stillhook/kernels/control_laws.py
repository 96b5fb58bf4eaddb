"""The controllers as one function inside a kernel: fixed when it is compiled, chosen by the mode's code while it runs.

Every kernel holds the shipped controllers that have neither settings nor a memory of their own. A case that uses any
other one is run by a kernel that holds this one too.
"""

import functools
import hashlib
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from stillhook.control.interface import DISPLACEMENT, Demand
from stillhook.control.plc import command, observe
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.physics.records import define
from stillhook.physics.scalar import scalar


class ControlLaws(NamedTuple):
    """Record: class of what the controllers carry from cycle to cycle, `code` of the one in force, then settings and
    memory of each that has them; cycle(sensed, m, laws, plc) gives the actuators' commands, the PLC's memory and the
    new record."""

    Record: Any
    cycle: Callable[..., Any]
    blank: Callable[..., Any]


def extra_controllers(modes: Iterable[str]) -> tuple[str, ...]:
    """The controllers of these modes that not every kernel holds, by name."""
    return tuple(sorted({mode for mode in modes if not CONTROLLERS[mode].in_every_kernel}))


def label(names: tuple[str, ...]) -> str:
    """What the folder of a kernel with these controllers is called: their names, codes and sources; "" for none."""
    if not names:
        return ""
    digest = hashlib.sha256()
    for law in (CONTROLLERS[name] for name in names):
        digest.update(f"{law.name} {law.code}".encode() + b"\0" + law.file.read_bytes())
    return f"-{'-'.join(names)}-{digest.hexdigest()[:12]}"


@functools.cache
def control_laws(names: tuple[str, ...], drive: str = DISPLACEMENT) -> ControlLaws:
    """The controllers that every kernel of this kind of drive holds, and those named."""
    laws = [law for law in CONTROLLERS.values() if (law.in_every_kernel and drive in law.drives) or law.name in names]
    parts = [(f"{law.field}_{part}", cls) for law in laws for part, cls in _parts(law)]
    record: Any = NamedTuple("LawRecord", [("code", float), *parts])  # type: ignore[misc]
    record.__module__ = f"{__name__} {drive} {' '.join(names)}"  # its generated functions are distinguished by it
    names_used: dict[str, Any] = {"Record": record, "Demand": Demand, "observe": observe, "command": command}
    for law in laws:
        names_used[f"cycle_{law.field}"] = law.cycle
        names_used |= {f"{law.field}_{part}_class": cls for part, cls in _parts(law)}
    source = f"{_demand(laws)}\n\n{CYCLE}"
    define(source, names_used, f"<controllers of {drive}{''.join(f' {n}' for n in names)}>")
    names_used["demand"] = scalar(names_used["demand"])

    def blank(settings: dict[str, Any]) -> Any:
        """The record before the first cycle, with the settings of each controller that has some."""
        values: dict[str, Any] = {"code": -1.0}
        values |= {f"{law.field}_settings": settings[law.name] for law in laws if law.record is not None}
        values |= {f"{law.field}_memory": law.memory() for law in laws if law.memory is not None}
        return record(*[values[f] for f in ("code", *(name for name, _ in parts))])

    return ControlLaws(record, scalar(names_used["cycle"]), blank)


CYCLE = """\
def cycle(sensed, m, laws, plc):
    o = observe(sensed, m, plc)
    d, laws = demand(o.r, laws, plc)
    drive, m = command(o, d, m, plc)
    return drive, m, laws
"""


def _parts(law: ControlLaw) -> list[tuple[str, Any]]:
    """Records of its own that a controller has."""
    return [(part, cls) for part, cls in (("settings", law.record), ("memory", law.memory)) if cls is not None]


def _demand(laws: list[ControlLaw]) -> str:
    """Source of demand(r, laws, plc): the law in force, with its memory; the others' memories stay as at their
    start."""
    lines = ["def demand(r, laws, plc):", "    code = r.y.mode"]
    u_p = u_m = ""
    kept = ["code"]
    for i, law in enumerate(laws):
        on, arguments = f"code == {law.code!r}", "r, plc"
        if law.record is not None:
            arguments += f", laws.{law.field}_settings"
            kept.append(f"laws.{law.field}_settings")
        if law.memory is None:
            lines.append(f"    d_{i} = cycle_{law.field}({arguments})")
        else:
            start = f"{law.field}_memory_class({', '.join(repr(float(x)) for x in law.memory())})"
            lines.append(f"    m_{i} = laws.{law.field}_memory if laws.code == {law.code!r} else {start}")
            lines.append(f"    d_{i}, n_{i} = cycle_{law.field}({arguments}, m_{i})")
            kept.append(f"n_{i} if {on} else {start}")
        u_p = f"d_{i}.u_p if {on} else {u_p}" if u_p else f"d_{i}.u_p"
        u_m = f"d_{i}.u_m if {on} else {u_m}" if u_m else f"d_{i}.u_m"
    lines.append(f"    return Demand({u_p}, {u_m}), Record({', '.join(kept)})")
    return "\n".join(lines)
