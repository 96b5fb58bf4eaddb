"""Numbers of a winch that may change while it runs: factors on laws of its crane file, settings of its drive, and what
controllers and sensors have of their own. The PLC's shared settings are in `stillhook.engine.saved`.

A factor scales what it scales in the table of uncertain factors. The whole crane is packed again, and of what changes
the places below are taken: records of the physics. What the PLC has of its winch stays as it was set up, so that
gains and set points do not follow a winch that wears. State, drum and wire stay as they are. Of a setting of the drive
everything is taken that follows from it.
"""

from __future__ import annotations

import fnmatch
import operator
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.interface import Setting
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.control.sensors import SENSORS, Sensor
from stillhook.engine.pack.winch import Packed, pack
from stillhook.kernels.lanes import flatten, offset, paths
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

SCALED: Mapping[str, tuple[str, ...]] = {
    "friction": tuple(f"friction.system.Y_{i}" for i in (1, 2, 3, 5, 6)),
    "rod_friction": ("cylinder.friction.F_c", "cylinder.friction.mu", "cylinder.friction.b"),
    "leakage": (
        *("active.motor.C_1", "active.motor.C_2", "active.pump.leak_scale", "secondary.unit.C_1", "secondary.unit.C_2"),
        *("secondary.pump.C_leak", "open.motor.C_1", "open.motor.C_2", "open.pump.C_leak", "cylinder.pump.C_leak"),
        *("passive.motor.C_1", "passive.motor.C_2", "passive.pump.leak_scale"),
    ),
    "gas_pressure": (
        "passive.accumulator.gas.p_0",
        "secondary.accumulator.gas.p_0",
        "cylinder.passive.accumulator.gas.p_0",
    ),
    "displacement": ("active.motor.D_max", "secondary.unit.D_max", "open.motor.D_max"),
}
"""Numbers of a crane file that follow a factor, by its name in the table of uncertain factors; displacement, which is
not in it: of the motors that the controller commands."""
ASSUMED: Mapping[str, float] = {"active.pump.leak_scale": 1.0, "passive.pump.leak_scale": 1.0}
"""Value of a number that a crane file may leave out."""


GAS = "gas_factor"
"""The factor of the charge of accumulators, wherever a winch type takes it from; see `pack`."""


class Factor(NamedTuple):
    """What a factor changes: names of `SCALED`; places of the packed parameters, as patterns; and its ends [-]."""

    scaled: tuple[str, ...]
    places: tuple[str, ...]
    least: float
    most: float


FACTORS: Mapping[str, Factor] = {
    "friction_factor": Factor(
        ("friction", "rod_friction"), (".hoist.friction.Y_?", ".cylinder.friction.*"), least=0.0, most=20.0
    ),
    "leakage_factor": Factor(("leakage",), ("*.leak.C_*", "*.motors.C_?", "*.C_leak"), least=0.0, most=100.0),
    "displacement_factor": Factor(
        ("displacement",), ("*.motors.D_max", ".rail.settings.D_m_max", ".A.D_m", ".A.n_full"), least=0.5, most=1.5
    ),
    GAS: Factor(("gas_pressure",), ("*.accumulator.gas.c_?",), least=0.1, most=2.0),
}
"""Factors by the names that a session gives them. D_m and n_full of an open circuit go together: their product, the
flow that a command requires, is what the PLC was set up with."""


class Known(NamedTuple):
    """A setting: value that a run begins with, and the ends of its range [SI]."""

    start: float
    least: float
    most: float


def with_value(record: Any, path: str, value: Any) -> Any:
    """A copy of a record with one field, by its dotted path, changed; nothing is checked."""
    name, _, inner = path.partition(".")
    return record.model_copy(update={name: with_value(getattr(record, name), inner, value) if inner else value})


def present(crane: Crane, name: str) -> tuple[str, ...]:
    """The numbers of a crane that a factor of `SCALED` moves: those of tables that it has. System friction is that of a
    shaft with motors, which a compensator's rod has not."""
    if name == "friction" and not crane.motors:
        return ()
    return tuple(path for path in SCALED[name] if crane.table(path.partition(".")[0]) is not None)


class RunSettings:
    """Settings of one winch that may change while it runs.

    Parameters: crane and scenario as `pack` takes them; packed: what it gave; lane: class of everything that one
    trajectory carries.
    """

    def __init__(self, crane: Crane, case: Scenario, packed: Packed, lane: Any) -> None:
        self._crane, self._case = crane, case
        kinds = lane.__annotations__
        self._params, laws = offset(lane, "p", 1), offset(lane, "laws", 1)
        self._paths = {
            name: found
            for name, factor in FACTORS.items()
            if (found := tuple(path for each in factor.scaled for path in present(crane, each)))
        }
        self._packed = packed
        self._drive = {path: _of_drive(crane, path, ends) for path, ends in crane.plant.type.tuned.items()}
        patterns = [pattern for name in self._paths for pattern in FACTORS[name].places]
        moved = {i for i, each in enumerate(paths(kinds["p"])) if any(fnmatch.fnmatchcase(each, p) for p in patterns)}
        before = flatten(packed.params)
        for path, known in self._drive.items():
            after = flatten(self.packed({path: known.most if known.most != known.start else known.least}).params)
            moved |= {i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b}
        self._taken = np.array(sorted(moved), dtype=np.intp)
        carried = {place: laws + i for i, place in enumerate(paths(kinds["laws"]))}
        self._own: dict[str, int] = {}
        self.known = {name: Known(1.0, FACTORS[name].least, FACTORS[name].most) for name in self._paths}
        self.known |= self._drive
        for place, name, setting, start in _own_settings(packed):
            self._own[name] = carried[place]
            self.known[name] = Known(start, setting.least, setting.most)
        self.places = np.concatenate([self._params + self._taken, np.array([*self._own.values()], dtype=np.intp)])

    def packed(self, values: Mapping[str, float]) -> Packed:
        """The winch with these settings; those that are not named are as in the crane file.

        Errors: SpecError of one line where a law cannot be packed with them.
        """
        crane = self._crane
        for name, scaled in self._paths.items():
            factor = values.get(name, 1.0)
            if factor != 1.0 and name != GAS:
                for path in scaled:
                    value = operator.attrgetter(path)(crane)
                    crane = with_value(crane, path, factor * (ASSUMED[path] if value is None else value))
        for path, known in self._drive.items():
            if values.get(path, known.start) != known.start:
                crane = with_value(crane, path, values[path])
        gas = values.get(GAS, 1.0)
        if crane is self._crane and gas == 1.0:
            return self._packed
        return pack(crane, self._case, gas_factor=gas)

    def numbers(self, packed: Packed, values: Mapping[str, float]) -> FloatArray:
        """What a lane has at `places` with these settings, of which `packed` was made."""
        own = [values.get(name, self.known[name].start) for name in self._own]
        return np.concatenate([self._numbers(packed), np.array(own, dtype=np.float64)])

    def _numbers(self, packed: Packed) -> FloatArray:
        return np.array(flatten(packed.params), dtype=np.float64)[self._taken]


def _of_drive(crane: Crane, path: str, ends: tuple[float, float]) -> Known:
    """A setting of a winch type's drive, within the ends between which it may be tuned."""
    start = float(operator.attrgetter(path)(crane))
    return Known(start, min(ends[0], start), max(ends[1], start))


def _own_settings(packed: Packed) -> Iterator[tuple[str, str, Setting, float]]:
    """Place in what controllers and sensors carry, name, declaration and value of every setting of their own."""
    modules: list[ControlLaw | Sensor] = [*CONTROLLERS.values(), *SENSORS.values()]
    for module in modules:
        record = packed.settings.get(module.name)
        if record is None:
            continue
        for name, setting in module.settings.items():
            place = f".{module.settings_field}.{name}"
            yield place, f"{module.name}.{name}", setting, float(getattr(record, name))
