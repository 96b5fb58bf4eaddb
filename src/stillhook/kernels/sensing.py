"""What the PLC reads: through the sensors of the crane where it has some, as one function inside a kernel.

Sensors are fixed when a kernel is compiled. Their settings and memories are fields of the record that the controllers
carry from cycle to cycle, see `stillhook.kernels.control_laws`. A kernel without sensors holds nothing of them.
"""

import hashlib
from collections.abc import Callable
from typing import Any

from stillhook.control.interface import Sensed
from stillhook.control.sensors.interface import AFTER, BEFORE
from stillhook.control.sensors.registry import SENSORS, Sensor
from stillhook.physics.records import define, replace
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Tick

PLACES = {"s_tip": "s_m", "v_tip": "v_m", "a_tip": "a_m", "s_w": "n_s", "F": "n_F"}
"""Where a `Tick` has what becomes a signal: the motion as it comes, or noise that is added to the true value."""
TRUE = {"s_w": "y.s_w", "F": "q.F_w"}
"""What encoder and load cell measure, of the load path."""


def label(names: tuple[str, ...]) -> str:
    """What the folder of a kernel with these sensors is called: their names and sources; "" for none."""
    if not names:
        return ""
    digest = hashlib.sha256(b"\0".join(SENSORS[name].file.read_bytes() for name in names))
    return f"-{'-'.join(names)}-{digest.hexdigest()[:12]}"


def parts_of(names: tuple[str, ...]) -> dict[str, Any]:
    """Settings, and a memory for each quantity, of these sensors, by their field in the record of the controllers."""
    parts: dict[str, Any] = {}
    for sensor in (SENSORS[name] for name in names):
        parts[sensor.settings_field] = sensor.record
        if sensor.memory is not None:
            parts |= {sensor.memory_field(quantity): sensor.memory for quantity in sensor.quantities}
    return parts


def blank_parts(names: tuple[str, ...], settings: dict[str, Any]) -> dict[str, Any]:
    """The parts of these sensors before their first reading, with the settings of each by its name; memories are made
    with the first reading."""
    made = {SENSORS[name].settings_field: settings[name] for name in names}
    return {part: made.get(part) or cls(*(0.0,) * len(cls._fields)) for part, cls in parts_of(names).items()}


def sensing(sense: Callable[..., Any], names: tuple[str, ...], LawRecord: Any) -> Callable[..., Any]:
    """A scalar function (x, y, q, m, tick, geo, laws, p) -> (sensed, tick, laws) around the `sense` of a winch type:
    what the PLC reads, the tick with the signals of motion unit, encoder and load cell, and the record with the
    memories of the sensors. A memory begins at the value that is read when no controller was in force yet."""
    if not names:

        @scalar
        def ideal(x, y, q, m, tick, geo, laws, p):
            return sense(x, y, q, m, tick, geo, p), tick, laws

        return ideal
    used: dict[str, Any] = {"sense": sense}
    pairs = [(SENSORS[name], quantity) for name in names for quantity in SENSORS[name].quantities]
    memories = [
        (sensor.memory_field(quantity), f"n_{i}") for i, (sensor, quantity) in enumerate(pairs) if sensor.memory
    ]
    lines = ["def sensing(x, y, q, m, tick, geo, laws, p):", "    h, begun = p.plc.t_cycle, laws.code >= 0.0"]
    for kind, record, of in ((BEFORE, "tick", Tick), (AFTER, "sensed", Sensed)):
        new = {}
        for i, (sensor, quantity) in enumerate(pairs):
            if quantity not in kind:
                continue
            place = PLACES.get(quantity, quantity)
            true = TRUE.get(quantity, f"{record}.{place}")
            lines += _reading(i, sensor, quantity, true, used)
            new[place] = f"tick.{place} + (r_{i} - {true})" if quantity in TRUE else f"r_{i}"
        if new:
            used[f"with_{record}"] = replace(of, *new)
            lines.append(f"    {record} = with_{record}({record}, {', '.join(new.values())})")
        if record == "tick":
            lines.append("    sensed = sense(x, y, q, m, tick, geo, p)")
    if memories:
        used["with_laws"] = replace(LawRecord, *(field for field, _ in memories))
        lines.append(f"    laws = with_laws(laws, {', '.join(value for _, value in memories)})")
    lines.append("    return sensed, tick, laws\n")
    define("\n".join(lines), used, f"<sensing of {sense.__module__} {LawRecord.__module__}>")
    made: Callable[..., Any] = scalar(used["sensing"])
    return made


def _reading(i: int, sensor: Sensor, quantity: str, true: str, used: dict[str, Any]) -> list[str]:
    """Lines that make the signal r_i, and the memory n_i where the sensor remembers."""
    used[f"reading_{i}"], settings = sensor.reading, f"laws.{sensor.settings_field}"
    if sensor.begin is None:
        return [f"    r_{i} = reading_{i}({true}, h, {settings})"]
    used[f"begin_{i}"] = sensor.begin
    return [
        f"    m_{i} = laws.{sensor.memory_field(quantity)} if begun else begin_{i}({true}, {settings})",
        f"    r_{i}, n_{i} = reading_{i}({true}, h, {settings}, m_{i})",
    ]
