"""A run that is stepped from outside: the same machine code, and the same bits, as `simulate`."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook import units
from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.control.registry import CONTROLLERS, code_of
from stillhook.engine.arguments import SERIES_STEP, checked_cases, steps_per_cycle
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.saved import CYCLES, PARAMETERS, Range, bytes_of, printable, ranges, seal, unseal, wrong
from stillhook.engine.scenario.run import Ready, ScenarioBlock, ScenarioType, first_lane
from stillhook.errors import SimulationError
from stillhook.kernels.build import Setup, results_hash
from stillhook.kernels.lanes import aligned, flatten, offset, paths
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.winches.records import Tick

FORMAT = 2
"""Version of the format of a saved session."""
NOT_YET = 2**62
"""Stands for a cycle that never comes: no windows are kept, and none is the last."""
COLUMNS: Mapping[str, tuple[int, ...]] = {
    "s_tip": (0, 3),
    "v_tip": (1, 4),
    "a_tip": (2, 5),
    **{name: (Tick._fields.index(name),) for name in ("v_op", "s_op", "mode", "f_pump")},
}
"""Inputs by name, with their columns in a row of the drive: the tip moves, and the motion unit sees it."""
WIRE_COLUMNS: Mapping[str, tuple[int, ...]] = {
    **COLUMNS,
    "s_tip": (3,),
    "v_tip": (4,),
    "a_tip": (5,),
    "F_w": (0,),
}
"""Inputs of a winch whose wire is the host's: the tip's place is that of the tension."""
TIP, WIRE = "tip", "wire"
MOTION = ("s_tip", "v_tip", "a_tip")


class WireBlock(ScenarioBlock):
    """Winches whose wire, load and water are the host's, which gives the tension; at rest under the scenario's load."""

    @staticmethod
    def setup(r: Ready) -> Setup:
        return Setup(path=("host",), sensors=r.winch.sensors)

    def record(self, r: Ready) -> list[float]:
        tick = Tick(*r.drive.first_row())._replace(s=r.winch.params.hoist.load.W, v=0.0, a=0.0)
        return flatten(first_lane(self.d, r.winch, tick))


class Kept(NamedTuple):
    """A state of one session in memory, which `Session.go_back` goes back to."""

    session: Session
    k: int
    held: dict[str, float]
    A: FloatArray
    row: FloatArray


class Session:
    """A winch that is stepped from outside, one PLC cycle after another and without an end.

    At a time the PLC calculates with the inputs that are in force, then the winch moves to the next PLC cycle. What is
    read is the cycle of the present time, calculated on a copy: reading changes nothing, and a setting shows at once.

    Parameters: crane; scenario; coupling: "tip", or "wire" where the host has wire, load and water: it gives the
    tension F_w at the tip, linear over a step, and takes s_w and v_w, and the tip's motion goes to the motion unit
    alone; step: integration step as in `simulate` (default 2 ms). Ramp, operator, modes, sensors and faults of the
    scenario happen as in `simulate`; its duration and warm-up mean nothing here.

    Errors: ScenarioError, SpecError as in `simulate`; SimulationError, one line, for an unknown name, a value that is
    no number, and a state that is no number any more.

    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc")
    >>> session = stillhook.Session(crane, case)
    >>> session.step(cycles=200)
    >>> kept = session.save()
    >>> session.set("mode", "ns")
    >>> session.step({"s_tip": 0.2, "v_tip": 0.1, "a_tip": 0.0})
    >>> session.restore(kept)
    >>> round(session.time, 6), abs(session.get("e_c")) < 0.02
    (2.0, True)
    """

    def __init__(self, crane: Crane, scenario: Scenario, *, coupling: str = TIP, step: str | None = None) -> None:
        if coupling not in (TIP, WIRE):
            raise SimulationError(f"Session: coupling = {units.quote(coupling)}: choose {TIP} or {WIRE}.")
        self._wire = coupling == WIRE
        self._columns = WIRE_COLUMNS if self._wire else COLUMNS
        cases, of = checked_cases(crane, scenario), ScenarioType()
        if len(cases) > 1:
            raise SimulationError("Session: one winch is stepped, not several scenarios. Use a Session for each.")
        n_sub = steps_per_cycle(crane, step, SERIES_STEP)
        of.check([crane], cases)
        prepared = of.ready([crane], cases, n_sub)
        winch = prepared[0].winch
        self._block = (WireBlock if self._wire else ScenarioBlock)(prepared, lanes=1, n_sub=n_sub, every=0)
        self._t_cycle = crane.control.t_cycle
        self._modes = {law for law in CONTROLLERS if law in crane.plant.type.modes}
        self._modes &= {law for law in CONTROLLERS if CONTROLLERS[law].in_every_kernel} | set(winch.extra_controllers)
        self._codes = [0.0, *(code_of(mode) for mode in self._modes)]
        d = self._block.d
        self._signals: tuple[str, ...] = d.Signals._fields
        self._y = offset(d.Lane, "y", 1)
        places, start = paths(d.Params), offset(d.Lane, "p", 1)
        self._parameters = {name: start + places.index(f".plc.{at}") for name, (at, _) in PARAMETERS.items()}
        self._A = self._block.A[:, 0]
        self._begin = self._A.copy()
        self._ranges = ranges(
            paths(d.Lane),
            wire=winch.params.hoist.drum.L_full,
            tension=self._wire,
            settings={i: PARAMETERS[name][1] for name, i in self._parameters.items()},
        )
        self._names = [*self._ranges.names, *(f".row.{name}" for name in Tick._fields)]
        text = json.dumps([crane_toml(crane), cases[0].to_dict(), coupling, n_sub, results_hash()], default=str)
        self._identity = hashlib.sha256(text.encode()).hexdigest()
        self._k = 0
        self._held: dict[str, float] = {}
        self._row = self._row_at(0)
        self._seen: FloatArray | None = None

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._k * self._t_cycle

    @property
    def cycle(self) -> float:
        """Time between two PLC cycles [s]."""
        return self._t_cycle

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of inputs, which `step` takes and `set` holds."""
        return tuple(self._columns)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of settings of the PLC that `set` changes."""
        return tuple(self._parameters)

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of signals that `get` reads; units and meaning: `stillhook.variables`."""
        return self._signals

    def step(self, inputs: Mapping[str, Any] | None = None, *, cycles: int = 1) -> None:
        """Move on by PLC cycles (default one).

        inputs: what holds at the end of the step, by name [SI]: the crane tip's s_tip, v_tip, a_tip together (up
        positive; in between a quintic through both ends), v_op, s_op (hoisting positive), mode, f_pump. What is not
        given is as `set` holds it, else as in the scenario. With inputs a step is one cycle.
        """
        if type(cycles) is not int or cycles < 1 or (inputs and cycles > 1):
            raise SimulationError(f"Session.step: cycles = {cycles!r}: give a whole number from 1, and 1 with inputs.")
        given = {name: self._value(name, value) for name, value in (inputs or {}).items()}
        _check_motion(given)
        for _ in range(cycles):
            ahead = self._row_at(self._k + 1, given)
            D = aligned(np.stack([self._row, ahead])[:, :, None])
            if self._wire:  # the tension's rate, at both ends
                D[:, 1] = (ahead[0] - self._row[0]) / self._t_cycle
            self._run(self._block.A, D, 1, NOT_YET)
            if not self._block.sound()[0]:
                raise SimulationError(
                    f"Session: a state is no number at {self.time:.6g} s. Restore a saved state, or use a shorter step."
                )
            self._k += 1
            self._row, self._seen = ahead, None

    def set(self, name: str, value: Any) -> None:
        """Hold an input, or change a setting of the PLC, from the present time on [SI]; `mode` is a controller's name.

        A motion that is set is held until it is set again: better give it to every `step`.
        """
        if name in self._parameters:
            self._A[self._parameters[name]] = self._number(name, value, PARAMETERS[name][1])
        else:
            self._held[name] = self._value(name, value)
            self._row[list(self._columns[name])] = self._held[name]
        self._seen = None

    def get(self, name: str) -> float:
        """A signal, input or setting at the present time [SI]."""
        if name in self._signals:
            return float(self._observed()[self._signals.index(name)])
        if name in self._parameters:
            return float(self._A[self._parameters[name]])
        if name in self._columns:
            return float(self._row[self._columns[name][0]])
        raise SimulationError(self._unknown(name, (*self._signals, *self._parameters, *self._columns)))

    def save(self, path: str | Path | None = None) -> bytes:
        """The state as bytes, and in a file where a path is given: it appears under its name when it is complete.

        The bytes say what they are of and which numbers they hold, and end with the SHA-256 of all before; their length
        does not grow with time.
        """
        head = {
            "identity": self._identity,
            "k": self._k,
            "held": {name: value.hex() for name, value in self._held.items()},
            "names": self._names,
        }
        data = seal("session", FORMAT, head, [self._A, self._row])
        if path is not None:
            with atomic_file(Path(path)) as part:
                part.write_bytes(data)
        return data

    def restore(self, state: bytes | str | Path) -> None:
        """Go back to what `save` gave, bytes or a file: later steps give the same bits.

        Errors: SimulationError, one line, where it is damaged, of another crane, scenario, step or version, or holds a
        number that no state of this winch has; all of it is checked before anything changes.
        """
        data, label = bytes_of(state)
        head, values = unseal("session", FORMAT, data, label)
        if head.get("identity") != self._identity:
            raise SimulationError(
                f"{label}: saved of another crane, scenario, step or version of Stillhook. Restore it into a session of"
                " the same ones."
            )
        if head.get("names") != self._names:
            raise SimulationError(f"{label}: damaged: its numbers have other names. Save it again.")
        if len(values) != len(self._names):
            raise SimulationError(f"{label}: damaged: {len(values)} numbers in place of {len(self._names)}.")
        k, held = head.get("k"), self._held_in(head.get("held"), label)
        if type(k) is not int or not 0 <= k <= CYCLES:
            raise SimulationError(f"{label}: k = {printable(k)}: give a whole number of cycles from 0 to {CYCLES:.0f}.")
        lane, row = np.split(values, [len(self._A)])
        self._check(lane, row, k, label)
        self._A[:], self._row[:] = lane, row
        self._k, self._held, self._seen = k, held, None

    def keep(self) -> Kept:
        """The state in memory, for `go_back`: quicker than `save`, and of this session alone."""
        return Kept(self, self._k, dict(self._held), self._A.copy(), self._row.copy())

    def go_back(self, kept: Kept) -> None:
        """Go back to what `keep` gave. Errors: SimulationError where it is of another session."""
        if kept.session is not self:
            raise SimulationError("Session.go_back: kept of another session. Use save and restore between sessions.")
        self._A[:], self._row = kept.A, kept.row.copy()
        self._k, self._held, self._seen = kept.k, dict(kept.held), None

    # What is behind it

    def _check(self, lane: FloatArray, row: FloatArray, k: int, label: str) -> None:
        """Errors: SimulationError for the first number that no state of this winch has."""
        first = self._ranges.names.index(f".tick.{Tick._fields[0]}")
        rows = slice(first, first + len(Tick._fields))
        problem = wrong(lane, self._A, self._begin, self._ranges, k, self._codes)
        problem = problem or wrong(row, self._row, self._begin[rows], self._ranges.at(rows), k, self._codes)
        if problem:
            raise SimulationError(f"{label}: no state of this winch: {problem}. Save it again.")

    def _held_in(self, saved: Any, label: str) -> dict[str, float]:
        """Inputs that are held, as a saved state has them. Errors: SimulationError."""
        try:
            held = {name: float.fromhex(x) for name, x in saved.items()}
            good = all(map(math.isfinite, held.values()))
        except (AttributeError, ValueError, TypeError, OverflowError):
            good = False
        if not good or not set(held) <= set(self._columns):
            allowed = ", ".join(self._columns)
            raise SimulationError(
                f"{label}: held = {printable(saved)}: finite numbers for names of {allowed} are held. Save it again."
            )
        for name, value in held.items():
            at, own = self._place(name), np.array([value])
            if problem := wrong(own, own, np.full(1, np.nan), self._ranges.at(slice(at, at + 1)), 0, self._codes):
                raise SimulationError(f"{label}: held: no input of this winch: {problem}. Save it again.")
        return held

    def _place(self, name: str) -> int:
        """Place of an input among the numbers of a state."""
        return self._ranges.names.index(f".tick.{Tick._fields[self._columns[name][0]]}")

    def _row_at(self, k: int, inputs: Mapping[str, float] | None = None) -> FloatArray:
        """The whole row of the drive at cycle k: of the scenario, then what is held, then what is given."""
        overlay, r = {**self._held, **(inputs or {})}, self._block.ready[0]
        row = self._of_scenario(r.drive, k, overlay)
        if self._wire:
            row[:3] = r.winch.params.hoist.load.W, 0.0, 0.0
        for name, value in overlay.items():
            row[list(self._columns[name])] = value
        if "v_op" in overlay and "s_op" not in overlay and k > 0:
            v, s = COLUMNS["v_op"][0], COLUMNS["s_op"][0]
            row[s] = self._row[s] + 0.5 * self._t_cycle * (self._row[v] + row[v])
        return row

    def _of_scenario(self, drive: CycleInputs, k: int, overlay: Mapping[str, Any]) -> FloatArray:
        """A row as the scenario has it."""
        sensors = drive.case.sensors
        noisy = any((sensors.noise_s_tip, sensors.noise_v_tip, sensors.noise_a_tip, sensors.noise_s_w, sensors.noise_F))
        if noisy and k > drive.n_ticks:
            raise SimulationError(
                f"Session: the scenario's noise is drawn for its duration of {drive.case.duration:g} s, which is over."
                " Give it a longer duration, or no noise."
            )
        return drive.full_row(k, still=set(MOTION) <= set(overlay))

    def _run(self, A: FloatArray, D: FloatArray, n: int, last: int) -> None:
        block = self._block
        flat = A.reshape(-1), D.reshape(-1), len(Tick._fields), block.H, block.W, block.out.reshape(-1)
        block.d.run(*flat, 0, self._k, n, NOT_YET, last, block.n_win, block.n_sub, self._t_cycle)

    def _observed(self) -> FloatArray:
        """Signals at the present time."""
        if self._seen is None:
            copy = aligned(self._block.A)
            self._run(copy, aligned(self._row[None, :, None]), 0, self._k)
            self._seen = copy[self._y : self._y + len(self._signals), 0]
        return self._seen

    def _value(self, name: str, value: Any) -> float:
        if name not in self._columns:
            raise SimulationError(self._unknown(name, (*self._columns, *self._parameters)))
        if name != "mode":
            i = self._place(name)
            return self._number(name, value, (self._ranges.least[i], self._ranges.most[i]))
        if value not in self._modes:
            allowed = ", ".join(sorted(self._modes))
            raise SimulationError(
                f"Session: mode = {units.quote(value)}: choose {allowed}, or name another in the scenario's modes."
            )
        return code_of(value)

    def _number(self, name: str, value: Any, allowed: Range) -> float:
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise SimulationError(f"Session: {name} = {units.quote(value)}: give one number in SI units.") from None
        if not math.isfinite(number):
            raise SimulationError(
                f"Session: {name} = {units.quote(value)}: not a number. Give a finite value in SI units."
            )
        if not allowed[0] <= number <= allowed[1]:
            raise SimulationError(
                f"Session: {name} = {units.quote(number)}: give a value from {allowed[0]:g} to {allowed[1]:g}."
            )
        return number

    def _unknown(self, name: Any, allowed: Sequence[str]) -> str:
        return f"Session: {units.quote(name)} is no name here. Choose one of {', '.join(dict.fromkeys(allowed))}."


def _check_motion(inputs: Mapping[str, Any]) -> None:
    """The tip's motion is given whole or not at all: a position without its speed would make the winch lag. Errors:
    SimulationError."""
    some = [name for name in MOTION if name in inputs]
    if some and len(some) < len(MOTION):
        missing = ", ".join(name for name in MOTION if name not in inputs)
        raise SimulationError(f"Session.step: {', '.join(some)} without {missing}. Give the tip's motion whole.")
