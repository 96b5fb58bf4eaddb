"""Variables of a winch in another program: names, units, ranges, and the place in the C core behind each.

The value reference of a variable is its number in the list; names, units and meanings are those of
`stillhook.variables`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from stillhook.control.guard import Guard
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.control.sensors import Sensor
from stillhook.engine.pack.winch import drum_record
from stillhook.engine.saved import PARAMETERS, SETTING
from stillhook.kernels.lanes import offset, paths
from stillhook.physics.load_path.drum import wire_usable
from stillhook.sea.vessel.vessel_tip import VESSEL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import KINDS
from stillhook.variables import BY_NAME
from stillhook.winches.records import Tick

ANY = 1.0e300
"""Stands for no end of a range."""
LEAST_SHARE = 0.01
"""Least share of pumps: with none left nothing would hold the load."""
MOTION = ("s_tip", "v_tip", "a_tip")
COMMANDS = ("u_p", "u_m", "brake")
SHARES = ("f_pump", "f_known", "f_passive")
COLUMN = {"s_tip": "s_m", "v_tip": "v_m", "a_tip": "a_m"}
RANGES = {
    **dict.fromkeys(SHARES, (LEAST_SHARE, 1.0)),
    "u_p": (-1.0, 1.0),
    "u_m": (0.0, 1.0),
    "brake": (0.0, 1.0),
    "F_w": (0.0, ANY),
    "sensed_f_pump": (LEAST_SHARE, 1.0),
    "sensed_alpha_m": (0.001, 1.0),
    "sensed_K_wire": (0.001, ANY),
}
COMMON_LIMITS = {"saturation": "saturated", "slack": "slack", "wire": "wire"}
"""Limits of every winch with their words, as in the status of a run."""
CONDITIONS = ("valid_load", "valid_s_w", "valid_s_tip_pp", "valid_period", "valid_mode", "valid_pumps")
PAYLOAD, WIRE_OUT = 0, 6
"""Places in `Beginning` of the driver."""


@dataclass(frozen=True)
class Port:
    """A variable in another program.

    causality: "input"; "fixed", a parameter of the beginning; "tunable", one that may change; "output". kind: "real",
    "integer", "boolean" or "text". unit: SI, as in `stillhook.variables`. start, least, most [SI]: infinite where
    there is no end. place: constant of core.c for where the number is, and which.
    """

    name: str
    causality: str
    kind: str
    unit: str
    description: str
    start: float = 0.0
    least: float = -ANY
    most: float = ANY
    place: tuple[str, int] = ("SH_OF_SEEN", 0)


@dataclass(frozen=True)
class Limit:
    """A limit: its name, its word in a run's status, and its place among the numbers of a lane."""

    name: str
    word: str
    at: int


def port(name: str, causality: str, place: tuple[str, int], **more: Any) -> Port:
    """A port with the unit and the meaning of its variable."""
    row = BY_NAME.get(name)
    if row is None and name.startswith("sensed_"):
        own = BY_NAME[name.removeprefix("sensed_")]
        row = own._replace(meaning=f"as the PLC reads it: {own.meaning}")
    assert row is not None, name
    text = more.pop("description", row.meaning) + (f"; {row.sign}" if row.sign else "")
    kind = more.pop("kind", "real")
    return Port(name, causality, kind, "" if kind == "text" else row.unit, text, place=place, **more)


def modes_in_words(laws: list[ControlLaw]) -> str:
    return ", ".join(f"{law.code:.0f} {law.name}" for law in laws)


def inputs(names: tuple[str, ...], starts: dict[str, float], laws: list[ControlLaw]) -> Iterator[Port]:
    """The inputs in this order."""
    for i, name in enumerate(names):
        more: dict[str, Any] = {"start": starts.get(name, 0.0)}
        least, most = RANGES.get(name, (-ANY, ANY))
        if name.removeprefix("sensed_") == "mode":
            more |= {"kind": "integer", "description": f"mode: {modes_in_words(laws)}"}
            least, most = 0.0, max(law.code for law in laws)
        if name in VESSEL:
            text, unit = VESSEL[name]
            yield Port(name, "input", "real", unit, text, more["start"], place=("SH_OF_INPUT", i))
            continue
        yield port(name, "input", ("SH_OF_INPUT", i), least=least, most=most, **more)


def beginnings(crane: Crane, case: Scenario, *, load: bool) -> Iterator[Port]:
    """What is chosen before the start."""
    if load:
        displaced = case.water.rho * case.water.volume if case.water else 0.0
        least = displaced * 1.001 if displaced or crane.hook_mass > 0.0 else 1.0
        yield port("load", "fixed", ("SH_OF_BEGINNING", PAYLOAD), start=case.load, least=least, most=crane.SWL)
    wire = float(wire_usable(drum_record(crane)))
    yield port("s_w_start", "fixed", ("SH_OF_BEGINNING", WIRE_OUT), start=case.s_w, least=0.0, most=wire)


def settings(
    plc: type, at: int, record: Any, modules: Sequence[ControlLaw | Sensor], carried: type, law_at: int
) -> Iterator[Port]:
    """Settings of the PLC, and of controllers and sensors that have some of their own; at, law_at: places of the PLC's
    and of what controllers and sensors carry in a lane, whose numbers `record` holds."""
    places = paths(plc)
    for name, (where, (least, most)) in PARAMETERS.items():
        i, end = at + places.index(f".{where}"), ANY if most == SETTING[1] else most
        yield port(name, "tunable", ("SH_OF_LANE", i), start=float(record[i]), least=least, most=end)
    places = paths(carried)
    for module in modules:
        for name, setting in module.settings.items():
            i = law_at + places.index(f".{module.settings_field}.{name}")
            yield Port(
                f"{module.name}.{name}",
                "tunable",
                "real",
                KINDS[setting.kind].si if setting.kind else "1",
                f"{module.name}: {setting.meaning}",
                float(record[i]),
                setting.least,
                setting.most,
                ("SH_OF_LANE", i),
            )


def limits(crane: Crane, driver: Any) -> list[Limit]:
    """The limits of a winch, in the order of a run's status."""
    st = offset(driver.Lane, "st", 1)
    common = {f: i for i, f in enumerate(paths(dict(driver.Stats.__annotations__)["common"]))}
    own_at = st + offset(driver.Stats, "limits", 1)
    causes = crane.plant.type.causes
    fields = paths(driver.plant.Limits)
    found = {name: Limit(name, word, st + common[f".{name}_cycles"]) for name, word in COMMON_LIMITS.items()}
    own = [Limit(name, causes[name], own_at + fields.index(f".{name}")) for name in causes]
    return [found["saturation"], *own, found["slack"], found["wire"]]


def outputs(driver: Any, passed: list[Limit], taken: set[str], laws: list[ControlLaw]) -> Iterator[Port]:
    """Signals, limits with their times, the status in numbers and words, and validity."""
    y = offset(driver.Lane, "y", 1)
    for i, name in enumerate(driver.Signals._fields):
        if name not in taken and name not in GUARD_OUTPUTS:
            yield port(name, "output", ("SH_OF_SEEN", y + i))
    for i, limit in enumerate(passed):
        time = BY_NAME[f"{limit.name}_time"]
        yield Port(
            f"limit_{limit.name}",
            "output",
            "boolean",
            "1",
            f"now: {time.meaning.removeprefix('time ')}",
            place=("SH_OF_LIMIT", i),
        )
        yield port(time.name, "output", ("SH_OF_DURATION", i), description=f"{time.meaning}, since the start")
    yield port("limits_passed", "output", ("SH_OF_STATUS", 0), kind="integer")
    yield port("causes", "output", ("SH_OF_CAUSES", 0), kind="text")
    for i, name in enumerate(("valid", *CONDITIONS)):
        yield port(name, "output", ("SH_OF_VALID", i - 1), kind="boolean")
    yield port("outside", "output", ("SH_OF_OUTSIDE", 0), kind="text")
    yield from motion()


def motion() -> Iterator[Port]:
    """Whether what the host says of the tip is one motion."""
    yield port("one_motion", "output", ("SH_OF_ONE", 0), kind="boolean")
    yield port("contradiction", "output", ("SH_OF_APART", 0), kind="text")


def readings(causality: str, kind: str) -> Iterator[Port]:
    """What the PLC reads, to or from it."""
    for i, name in enumerate(Sensed._fields):
        yield port(f"sensed_{name}", causality, (kind, i))


def commands() -> Iterator[Port]:
    """What the PLC commands."""
    for i, name in enumerate(ActuatorCommands._fields):
        more = {"description": "control error against the measured tip motion"} if name == "e_c" else {}
        yield port(name, "output", ("SH_OF_SENSED", i), **more)


def guards(at: int) -> Iterator[Port]:
    """Quality of every input of the PLC and the operator's acknowledgement, to its guard; at: place of the guard in a
    lane."""
    places = paths(Guard)
    for name in Sensed._fields:
        i = at + places.index(f".quality.{name}")
        text = f"quality of what the PLC reads as {name}: true good, false bad"
        yield Port(f"q_{name}", "input", "boolean", "1", text, 1.0, 0.0, 1.0, ("SH_OF_LANE", i))
    text = "rising edge: the operator acknowledges a stop of the guard"
    yield Port("reset", "input", "boolean", "1", text, 0.0, 0.0, 1.0, ("SH_OF_LANE", at + places.index(".reset")))


GUARD_OUTPUTS = {
    "guard_alarm": (
        "alarm",
        f"sum of 2^i over inputs that are replaced: {', '.join(Sensed._fields)};"
        f" 2^{len(Sensed._fields)} memory, 2^{len(Sensed._fields) + 1} law",
    ),
    "guard_cause": ("cause", "alarm for which the winch was stopped, 0 while it is not"),
    "guard_state": (
        "state",
        "0 healthy, 1 an input is replaced or the joystick must be released, 2 stopped until reset",
    ),
}


def guard_outputs(at: int) -> Iterator[Port]:
    """What the guard says."""
    places = paths(Guard)
    for name, (field, text) in GUARD_OUTPUTS.items():
        yield Port(name, "output", "integer", "1", text, place=("SH_OF_SEEN", at + places.index(f".g.{field}")))


def columns(name: str, *, wire: bool) -> tuple[int, int]:
    """Columns of a `Tick` that an input fills, -1 for none."""
    if name in VESSEL:
        return -1, -1
    if name in COLUMN:
        seen = Tick._fields.index(COLUMN[name])
        return (seen, -1) if wire else (seen, MOTION.index(name))
    return (0 if name == "F_w" else Tick._fields.index(name)), -1


def identifier(name: str) -> str:
    """A crane's name as one of C."""
    text = re.sub(r"\W", "_", name)
    return f"c_{text}" if text[:1].isdigit() else text


def laws_of(crane: Crane, extra: tuple[str, ...]) -> list[ControlLaw]:
    """Controllers that a kernel of this crane holds."""
    kind = crane.plant.type.control
    return [law for law in CONTROLLERS.values() if (law.in_every_kernel and kind in law.drives) or law.name in extra]
