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
from stillhook.engine.saved import CYCLES, SETTING, SETTINGS, Range, bytes_of, printable, ranges, seal, unseal, wrong
from stillhook.engine.scenario.run import Ready, ScenarioBlock, ScenarioType, first_lane
from stillhook.errors import SimulationError
from stillhook.kernels.build import Setup, results_hash
from stillhook.kernels.lanes import VL, aligned, flatten, offset, paths
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
PARAMETERS: Mapping[str, str] = {
    **{name: f".plc.gains.{name}" for name in ("K_1", "K_2", "K_p")},
    **{name: f".plc.motors.{name}" for name in ("u_thr", "alpha_ns", "alpha_hs", "alpha_swl")},
    **{name: f".plc.{name}" for name in ("t_lead", "t_bumpless", "tau_F")},
}
"""Settings of the PLC that may change while it runs, by name, with their place in the records of every winch type."""


class WireBlock(ScenarioBlock):
    """Winches whose wire, load and water are the host's, which gives the tension; at rest under the scenario's load."""

    @staticmethod
    def setup(r: Ready) -> Setup:
        return Setup(host=True, sensors=r.winch.sensors)

    def record(self, r: Ready) -> list[float]:
        tick = Tick(*r.drive.first_row())._replace(s=r.winch.params.hoist.load.W, v=0.0, a=0.0)
        return flatten(first_lane(self.d, r.winch, tick))


class Kept(NamedTuple):
    """A state of one session in memory, which `Session.go_back` goes back to."""

    session: Session
    k: int
    held: dict[str, FloatArray]
    blocks: tuple[FloatArray, ...]
    row: tuple[FloatArray, ...]


class Session:
    """A winch that is stepped from outside, one PLC cycle after another and without an end; or several side by side.

    At a time the PLC calculates with the inputs that are in force, then the winch moves to the next PLC cycle. What is
    read is the cycle of the present time, calculated on a copy: reading changes nothing, and a setting shows at once.

    Parameters: crane; scenario, or a list of them for as many winches side by side (a value is then an array of one
    number each); coupling: "tip", or "wire" where the host has wire, load and water: it gives the tension F_w at the
    tip, linear over a step, and takes s_w and v_w, and the tip's motion goes to the motion unit alone; step:
    integration step as in `simulate` (default 2 ms). Ramp, operator, modes, sensors and faults of
    the scenario happen as in `simulate`; its duration and warm-up mean nothing here.

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

    def __init__(
        self,
        crane: Crane,
        scenario: Scenario | Sequence[Scenario],
        *,
        coupling: str = TIP,
        step: str | None = None,
    ) -> None:
        if coupling not in (TIP, WIRE):
            raise SimulationError(f"Session: coupling = {units.quote(coupling)}: choose {TIP} or {WIRE}.")
        self._wire = coupling == WIRE
        self._columns = WIRE_COLUMNS if self._wire else COLUMNS
        self._single = isinstance(scenario, Scenario)
        cases = checked_cases(crane, scenario)
        n_sub = steps_per_cycle(crane, step, SERIES_STEP)

        cranes, of = [crane] * len(cases), ScenarioType()
        of.check(cranes, cases)
        prepared = of.ready(cranes, cases, n_sub)
        extra = {r.winch.extra_controllers for r in prepared}
        if len(extra) > 1:
            raise SimulationError(
                "Session: scenarios side by side need controllers that one kernel holds. Use several."
            )
        lanes = 1 if len(prepared) == 1 else VL
        block = WireBlock if self._wire else ScenarioBlock
        self._blocks = [
            block(prepared[i : i + lanes], lanes=lanes, n_sub=n_sub, every=0) for i in range(0, len(prepared), lanes)
        ]
        self._n, self._lanes, self._t_cycle = len(prepared), lanes, crane.control.t_cycle
        self._modes = {law for law in CONTROLLERS if law in crane.plant.type.modes}
        self._modes &= {law for law in CONTROLLERS if CONTROLLERS[law].in_every_kernel} | set(*extra)
        d = self._blocks[0].d
        self._signals: tuple[str, ...] = d.Signals._fields
        self._y = offset(d.Lane, "y", 1)
        places = paths(d.Params)
        start = offset(d.Lane, "p", 1)
        self._parameters = {name: start + places.index(at) for name, at in PARAMETERS.items() if at in places}
        self._begins = [block.A.copy() for block in self._blocks]
        self._ranges = ranges(
            paths(d.Lane),
            wire=max(r.winch.params.hoist.drum.L_full for r in prepared),
            tension=self._wire,
            settings={i: _setting_range(name) for name, i in self._parameters.items()},
        )
        text = json.dumps(
            [crane_toml(crane), [c.to_dict() for c in cases], coupling, n_sub, results_hash()], default=str
        )
        self._identity = hashlib.sha256(text.encode()).hexdigest()
        self._k = 0
        self._held: dict[str, FloatArray] = {}
        self._row = self._rows(0)
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
        _whole_motion(given)
        for _ in range(cycles):
            ahead = self._rows(self._k + 1, given)
            for i, block in enumerate(self._blocks):
                D = aligned(np.stack([self._row[i], ahead[i]]))
                if self._wire:  # the tension's rate, at both ends
                    D[:, 1] = (ahead[i][0] - self._row[i][0]) / self._t_cycle
                self._run(block, block.A, D, 1, NOT_YET)
                if not block.sound()[: self._of(i)].all():
                    raise SimulationError(
                        f"Session: a state is no number at {self.time:.6g} s. Restore a saved state, or use a shorter"
                        " step."
                    )
            self._k += 1
            self._row, self._seen = ahead, None

    def set(self, name: str, value: Any) -> None:
        """Hold an input, or change a setting of the PLC, from the present time on [SI]; `mode` is a controller's name.

        A motion that is set is held until it is set again: better give it to every `step`.
        """
        if name in self._parameters:
            numbers = self._within(name, self._numbers(name, value), _setting_range(name))
            for i, block in enumerate(self._blocks):
                block.A[self._parameters[name], : self._of(i)] = self._part(numbers, i)
        else:
            self._held[name] = self._value(name, value)
            for column in self._columns[name]:
                for i, row in enumerate(self._row):
                    row[column, : self._of(i)] = self._part(self._held[name], i)
        self._seen = None

    def release(self, name: str) -> None:
        """Give an input back to the scenario, from the next step on."""
        if name not in self._columns:
            raise SimulationError(self._unknown(name, tuple(self._columns)))
        self._held.pop(name, None)

    def get(self, name: str) -> Any:
        """A signal, input or setting at the present time [SI]: a number, or an array with one for each scenario."""
        if name in self._signals:
            values = self._observed()[self._signals.index(name)]
        elif name in self._parameters:
            rows = [block.A[self._parameters[name], : self._of(i)] for i, block in enumerate(self._blocks)]
            values = np.concatenate(rows)
        elif name in self._columns:
            values = np.concatenate([row[self._columns[name][0], : self._of(i)] for i, row in enumerate(self._row)])
        else:
            raise SimulationError(self._unknown(name, (*self._signals, *self._parameters, *self._columns)))
        return float(values[0]) if self._single else np.array(values)

    def save(self, path: str | Path | None = None) -> bytes:
        """The state as bytes, and in a file where a path is given: it appears under its name when it is complete.

        The bytes say what they are of and which numbers they hold, and end with the SHA-256 of all before; their length
        does not grow with time.
        """
        head = {
            "identity": self._identity,
            "k": self._k,
            "held": {name: [float(x).hex() for x in values] for name, values in self._held.items()},
            "names": [*self._ranges.names, *(f".row.{name}" for name in Tick._fields)],
        }
        data = seal("session", FORMAT, head, self._numbers_in_use())
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
        if head.get("names") != [*self._ranges.names, *(f".row.{name}" for name in Tick._fields)]:
            raise SimulationError(f"{label}: damaged: its numbers have other names. Save it again.")
        targets = self._numbers_in_use()
        if len(values) != sum(a.size for a in targets):
            raise SimulationError(
                f"{label}: damaged: {len(values)} numbers in place of {sum(a.size for a in targets)}."
            )
        k, held = head.get("k"), self._held_in(head.get("held"), label)
        if type(k) is not int or not 0 <= k <= CYCLES:
            raise SimulationError(f"{label}: k = {printable(k)}: give a whole number of cycles from 0 to {CYCLES:.0f}.")
        result, at = [], 0
        for target in targets:
            result.append(values[at : at + target.size].reshape(target.shape))
            at += target.size
        self._check(result, k, label)
        for target, numbers in zip(targets, result, strict=True):
            target[...] = numbers
        self._k, self._held, self._seen = k, held, None

    def keep(self) -> Kept:
        """The state in memory, for `go_back`: quicker than `save`, and of this session alone."""
        copies = (tuple(np.array(a) for a in arrays) for arrays in ([b.A for b in self._blocks], self._row))
        return Kept(self, self._k, dict(self._held), *copies)

    def go_back(self, kept: Kept) -> None:
        """Go back to what `keep` gave. Errors: SimulationError where it is of another session."""
        if kept.session is not self:
            raise SimulationError("Session.go_back: kept of another session. Use save and restore between sessions.")
        for block, numbers in zip(self._blocks, kept.blocks, strict=True):
            block.A[...] = numbers
        self._row = [row.copy() for row in kept.row]
        self._k, self._held, self._seen = kept.k, dict(kept.held), None

    # What is behind it

    def _numbers_in_use(self) -> list[FloatArray]:
        """What is carried from cycle to cycle, without the lanes that only fill a block."""
        carried = [block.A[:, : self._of(i)] for i, block in enumerate(self._blocks)]
        return carried + [row[:, : self._of(i)] for i, row in enumerate(self._row)]

    def _check(self, found: Sequence[FloatArray], k: int, label: str) -> None:
        """Errors: SimulationError for the first number that no state of this winch has."""
        n, codes = len(self._blocks), [0.0, *(code_of(mode) for mode in self._modes)]
        inputs = self._ranges.at(self._ranges.names.index(f".tick.{Tick._fields[0]}"), len(Tick._fields))
        for i, block in enumerate(self._blocks):
            used = slice(self._of(i))
            first = self._ranges.names.index(inputs.names[0])
            blank = self._begins[i][:, used]
            problem = wrong(found[i], block.A[:, used], blank, self._ranges, k, codes)
            rows = slice(first, first + len(Tick._fields))
            problem = problem or wrong(found[n + i], self._row[i][:, used], blank[rows], inputs, k, codes)
            if problem:
                raise SimulationError(f"{label}: no state of this winch: {problem}. Save it again.")

    def _held_in(self, given: Any, label: str) -> dict[str, FloatArray]:
        """Inputs that are held, as a saved state has them. Errors: SimulationError."""
        try:
            held = {name: np.array([float.fromhex(x) for x in values]) for name, values in given.items()}
            good = all(len(x) == self._n and np.isfinite(x).all() for x in held.values())
        except (AttributeError, ValueError, TypeError, OverflowError):
            good = False
        if not good or not set(held) <= set(self._columns):
            allowed = ", ".join(self._columns)
            raise SimulationError(
                f"{label}: held = {printable(given)}: finite numbers for names of {allowed} are held. Save it again."
            )
        codes = [0.0, *(code_of(mode) for mode in self._modes)]
        for name, values in held.items():
            i = self._ranges.names.index(f".tick.{Tick._fields[self._columns[name][0]]}")
            row = values[None]
            if problem := wrong(row, row, np.full_like(row, np.nan), self._ranges.at(i, 1), 0, codes):
                raise SimulationError(f"{label}: held: no input of this winch: {problem}. Save it again.")
        return held

    def _of(self, block: int) -> int:
        """Lanes of a block that are in use."""
        return min(self._lanes, self._n - block * self._lanes)

    def _part(self, values: FloatArray, block: int) -> FloatArray:
        first = block * self._lanes
        return values[first : first + self._of(block)]

    def _rows(self, k: int, given: Mapping[str, FloatArray] | None = None) -> list[FloatArray]:
        """Whole rows of the drive at cycle k, one array (columns, lanes) a block: of the scenario, then what is held,
        then what is given."""
        rows = []
        overlay = {**self._held, **(given or {})}
        for i, block in enumerate(self._blocks):
            row = np.empty((len(Tick._fields), self._lanes))
            for l, r in enumerate(block.lanes):
                row[:, l] = self._of_scenario(r.drive, k, overlay)
                if self._wire:
                    row[:3, l] = r.winch.params.hoist.load.W, 0.0, 0.0
            for name, values in overlay.items():
                for column in self._columns[name]:
                    row[column, : self._of(i)] = self._part(values, i)
            if "v_op" in overlay and "s_op" not in overlay and k > 0:
                v, s = COLUMNS["v_op"][0], COLUMNS["s_op"][0]
                row[s] = self._row[i][s] + 0.5 * self._t_cycle * (self._row[i][v] + row[v])
            rows.append(row)
        return rows

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

    def _run(self, block: ScenarioBlock, A: FloatArray, D: FloatArray, n: int, last: int) -> None:
        drive = block.drive
        flat = A.reshape(-1), D.reshape(-1), len(Tick._fields), block.H, block.W, block.out.reshape(-1)
        block.d.run(*flat, 0, self._k, n, NOT_YET, last, block.n_win, block.n_sub, drive.t_cycle)

    def _observed(self) -> FloatArray:
        """Signals at the present time, (signals, scenarios)."""
        if self._seen is None:
            columns = []
            for i, block in enumerate(self._blocks):
                copy = aligned(block.A)
                self._run(block, copy, aligned(self._row[i][None]), 0, self._k)
                columns.append(copy[self._y : self._y + len(self._signals), : self._of(i)])
            self._seen = np.concatenate(columns, axis=1)
        return self._seen

    def _value(self, name: str, value: Any) -> FloatArray:
        if name not in self._columns:
            raise SimulationError(self._unknown(name, (*self._columns, *self._parameters)))
        if name != "mode":
            i = self._ranges.names.index(f".tick.{Tick._fields[self._columns[name][0]]}")
            return self._within(name, self._numbers(name, value), (self._ranges.least[i], self._ranges.most[i]))
        names = [value] * self._n if isinstance(value, str) else list(value)
        for each in names:
            if each not in self._modes:
                allowed = ", ".join(sorted(self._modes))
                raise SimulationError(
                    f"Session: mode = {units.quote(each)}: choose {allowed}, or name another in the scenario's modes."
                )
        return self._numbers(name, [code_of(each) for each in names])

    def _numbers(self, name: str, value: Any) -> FloatArray:
        try:
            numbers = np.asarray(value, dtype=np.float64)
            numbers = np.array(np.broadcast_to(numbers, (self._n,)))
        except (TypeError, ValueError):
            count = "one number" if self._single else f"one number, or {self._n}"
            raise SimulationError(f"Session: {name} = {units.quote(value)}: give {count} in SI units.") from None
        if not all(math.isfinite(x) for x in numbers):
            raise SimulationError(
                f"Session: {name} = {units.quote(value)}: not a number. Give a finite value in SI units."
            )
        return numbers

    def _within(self, name: str, numbers: FloatArray, allowed: Range) -> FloatArray:
        if not ((numbers >= allowed[0]) & (numbers <= allowed[1])).all():
            value = float(numbers[0]) if self._single else [float(x) for x in numbers]
            raise SimulationError(
                f"Session: {name} = {units.quote(value)}: give a value from {allowed[0]:g} to {allowed[1]:g}."
            )
        return numbers

    def _unknown(self, name: Any, allowed: Sequence[str]) -> str:
        return f"Session: {units.quote(name)} is no name here. Choose one of {', '.join(dict.fromkeys(allowed))}."


def _setting_range(name: str) -> Range:
    return SETTINGS.get(name, SETTING)


def _whole_motion(given: Mapping[str, Any]) -> None:
    """The tip's motion is given whole or not at all: a position without its speed would make the winch lag. Errors:
    SimulationError."""
    some = [name for name in MOTION if name in given]
    if some and len(some) < len(MOTION):
        missing = ", ".join(name for name in MOTION if name not in given)
        raise SimulationError(f"Session.step: {', '.join(some)} without {missing}. Give the tip's motion whole.")
