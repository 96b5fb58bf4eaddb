"""A run that is stepped from outside: the same machine code, and the same bits, as `simulate`."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook import units
from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.control.interface import Sensed
from stillhook.control.registry import CONTROLLERS, code_of
from stillhook.engine.arguments import SERIES_STEP, check_step, checked_cases, steps_per_cycle
from stillhook.engine.inputs import (
    COLUMNS,
    COMMAND_AT,
    COMMANDS,
    MEASURED,
    MOTION,
    OVERRIDE,
    TICK,
    WIRE_COLUMNS,
    RowsAhead,
    check_motion,
    lacking,
    number_within,
)
from stillhook.engine.pack.settings import RunSettings
from stillhook.engine.pack.winch import Packed
from stillhook.engine.saved import (
    CYCLES,
    PARAMETERS,
    bytes_of,
    numbers_in,
    printable,
    ranges,
    seal,
    states,
    unseal,
    wrong,
)
from stillhook.engine.scenario.run import ScenarioBlock, ScenarioType, WireBlock
from stillhook.engine.scenario.vessel import VesselInputs, VesselUnit
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.build import results_hash
from stillhook.kernels.c99.library import repeated
from stillhook.kernels.lanes import aligned, offset, paths, room_for
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.winches.records import Tick

FORMAT = 3
"""Version of the format of a saved session."""
NOT_YET = 2**62
"""Stands for a cycle that never comes: no windows are kept, and none is the last."""
TIP, WIRE = "tip", "wire"
NO_EFFECT = "Session.{where}: {name} while override is 0: the winch takes the PLC's commands. Give override = 1 first."
OF_HOST = ("s_load", "v_load")
"""States of the load, which a host with a wire of its own has."""


class Kept(NamedTuple):
    """A state of one session in memory, which `Session.go_back` goes back to."""

    session: Session
    k: int
    held: dict[str, float]
    changed: dict[str, float]
    A: FloatArray
    row: FloatArray
    unit: VesselUnit | None


class Session:
    """A winch that is stepped from outside, one PLC cycle after another and without an end.

    At a time the PLC calculates with the inputs that are in force, then the winch moves to the next PLC cycle. What is
    read is the cycle of the present time, calculated on a copy: reading changes nothing, and a setting shows at once.

    Parameters: crane; scenario; coupling: "tip", or "wire" where the host has wire, load and water: it gives the
    tension F_w at the tip, linear over a step, and takes s_w and v_w, and the tip's motion goes to the motion unit
    alone; step: integration step as in `simulate` (default 2 ms). Ramp, operator, modes, sensors and faults of the
    scenario happen as in `simulate`; its duration and warm-up mean nothing here.

    Errors: ScenarioError, SpecError as in `simulate`; SimulationError, one line, for an unknown name or a bad number.

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
        cases, scenarios = checked_cases(crane, scenario), ScenarioType()
        if len(cases) > 1:
            raise SimulationError("Session: one winch is stepped, not several scenarios. Use a Session for each.")
        n_sub = steps_per_cycle(crane, step, SERIES_STEP)
        scenarios.check([crane], cases)
        prepared = scenarios.ready([crane], cases, n_sub)
        self._crane, self._ready, winch = crane, prepared[0], prepared[0].winch
        self._block = (WireBlock if self._wire else ScenarioBlock)(prepared, lanes=1, n_sub=n_sub, every=0)
        self._ahead = RowsAhead(prepared[0].drive)
        self._t_cycle = crane.control.t_cycle
        without = lacking(crane)
        self._columns = {
            name: columns for name, columns in (WIRE_COLUMNS if self._wire else COLUMNS).items() if name not in without
        }
        self._modes = {law for law in CONTROLLERS if law in crane.plant.type.modes}
        self._modes &= {law for law in CONTROLLERS if CONTROLLERS[law].in_every_kernel} | set(winch.extra_controllers)
        self._codes = [0.0, *(code_of(mode) for mode in self._modes)]
        d = self._block.d
        places, start = paths(d.Params), offset(d.Lane, "p", 1)
        self._parameters = {name: start + places.index(f".plc.{at}") for name, (at, _) in PARAMETERS.items()}
        self._settings = RunSettings(crane, cases[0], winch, d.Lane)
        self._A = self._block.A[:, 0]
        self._begin = self._A.copy()
        self._ranges = ranges(
            paths(d.Lane),
            wire=winch.params.hoist.drum.L_full,
            tension=self._wire,
            settings={i: PARAMETERS[name][1] for name, i in self._parameters.items()},
        )
        self._states = states(self._ranges.names, without=OF_HOST if self._wire else ())
        self._names = [*self._ranges.names, *(f".row.{name}" for name in Tick._fields)]
        self._ends = {
            name: (float(self._ranges.least[i]), float(self._ranges.most[i]))
            for name in self._columns
            for i in (self._place(name),)
        }
        self._vessel = VesselInputs(cases[0].tip, self._t_cycle)
        self._ends |= {name: self._ends[of] for name, of in self._vessel.ends_as.items()}
        of = [crane_toml(crane), cases[0].to_dict(), coupling, n_sub, results_hash()]
        self._identity = hashlib.sha256(json.dumps(of, default=str).encode()).hexdigest()
        self._k, self._held, self._changed = 0, dict[str, float](), dict[str, float]()
        self._prepare_calls()
        self._row, self._next = np.zeros(TICK), np.zeros(TICK)
        self._fill(self._row, 0, {})

    def _prepare_calls(self) -> None:
        """Room for what is stepped and read, and the two calls of the kernel that do it."""
        block, d = self._block, self._block.d
        y = offset(d.Lane, "y", 1)
        self._signals = {name: y + i for i, name in enumerate(d.Signals._fields)}
        self._D, self._D_now, self._copy = room_for((2 * TICK,)), room_for((TICK,)), aligned(self._A)
        self._seen = False
        names = self._ranges.names
        self._E_start, self._E_end, self._counted = (
            names.index(f".st.common.{name}") for name in ("E_start", "E_end", "cycles")
        )
        quintic, windows, out = block.H, block.W, block.out.reshape(-1)
        behind = (NOT_YET, block.n_win, block.n_sub, self._t_cycle)  # last, ...
        step = (block.A.reshape(-1), self._D, TICK, quintic, windows, out, block.lost, 0, 0, 1, NOT_YET, *behind)
        look = (self._copy, self._D_now, TICK, quintic, windows, out, block.lost, 0, 0, 0, NOT_YET, *behind)
        self._step, self._look = repeated(d.run, step, (8,)), repeated(d.run, look, (8, 11))

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
    def vessel_inputs(self) -> tuple[str, ...]:
        """Names by which `step` takes the vessel's motion in place of that of a `VesselTip`."""
        return self._vessel.names

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of settings that `set` changes: of the PLC; factors on friction, leakage, displacement and gas charge
        of the crane; of the drive, by their path; of controllers and sensors, as "controller.setting"."""
        return (*self._parameters, *self._settings.known)

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of signals that `get` reads; units and meaning: `stillhook.variables`."""
        return tuple(self._signals)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of what winch, load path, last commands ("command. ..."), PLC ("plc. ...") and controllers carry from
        cycle to cycle, which `state` reads and `set_states` writes."""
        return tuple(self._states)

    def step(self, inputs: Mapping[str, Any] | None = None, *, cycles: int = 1) -> None:
        """Move on by PLC cycles (default one).

        inputs: what holds at the end of the step, by name [SI]: the crane tip's s_tip, v_tip, a_tip together (up
        positive; in between a quintic through both ends) or the vessel's by `vessel_inputs` (heave, roll and pitch at
        least); v_op, s_op (hoisting positive), mode, f_pump, and with override = 1 the commands u_p, u_m and brake that
        the winch takes in place of the PLC's. What is not given is as `set` holds it, else as in the scenario; a
        command stays as it is. With inputs a step is one cycle.
        """
        if type(cycles) is not int or cycles < 1 or (inputs and cycles > 1):
            raise SimulationError(f"Session.step: cycles = {cycles!r}: give a whole number from 1, and 1 with inputs.")
        values, unit = self._checked_inputs(inputs) if inputs else ({}, None)
        for _ in range(cycles):
            ahead, D = self._next, self._D
            self._fill(ahead, self._k + 1, values)
            D[:TICK] = self._row
            D[TICK:] = ahead
            if self._wire:  # the tension's rate, at both ends
                D[1] = D[TICK + 1] = (ahead[0] - self._row[0]) / self._t_cycle
            self._step(self._k)
            if not self._block.sound()[0]:
                cause = self._block.cause(self._D.reshape(2, TICK), 0)
                raise SimulationError(
                    f"Session: {cause} after {self.time:.6g} s. Restore a saved state or shorten the step."
                )
            self._k += 1
            self._row, self._next, self._seen, self._vessel.unit = ahead, self._row, False, unit

    def set(self, name: str, value: Any) -> None:
        """Hold an input, or change a setting, from the present time on [SI]; `mode` is a controller's name.

        A motion that is set is held until it is set again: better give it to every `step`. With override = 1 the winch
        keeps the commands of the present time until u_p, u_m or brake are set; with 0 it takes the PLC's again.
        """
        if not isinstance(name, str):
            raise SimulationError(self._unknown(name, (*self._columns, *self.parameters)))
        if name in self._parameters:
            self._A[self._parameters[name]] = self._number(name, value, PARAMETERS[name][1])
        elif name in self._settings.known:
            known = self._settings.known[name]
            self._change({**self._changed, name: self._number(name, value, (known.least, known.most))}, name)
        elif name in self._vessel.names:
            raise SimulationError(f"Session.set: {name} is not held: give the vessel's motion to every step.")
        else:
            number = self._value(name, value)
            if name in COMMANDS and self._row[OVERRIDE] == 0.0:
                raise SimulationError(NO_EFFECT.format(where="set", name=name))
            if name == "override":
                self._take_over(number > 0.0)
            self._held[name] = number
            self._row[list(self._columns[name])] = number
        self._seen = False

    def get(self, name: str) -> float:
        """A signal, setting or input at the present time [SI]."""
        if isinstance(name, str):
            if (at := self._signals.get(name)) is not None:
                return float(self._observed()[at])
            if (at := self._parameters.get(name)) is not None:
                return float(self._A[at])
            if (known := self._settings.known.get(name)) is not None:
                return self._changed.get(name, known.start)
            if (columns := self._columns.get(name)) is not None:
                return float(self._row[columns[0]])
            if name in self._vessel.names:
                return self._vessel.at(name, self._k)
        raise SimulationError(self._unknown(name, (*self._signals, *self.parameters, *self._columns)))

    def sensed(self) -> Sensed:
        """What the PLC reads at the present time, through the sensors of crane and scenario [SI]."""
        lane, at = self._A.tolist(), self._ranges.names.index(".tick.s")
        lane[at : at + TICK] = self._row.tolist()
        self._block.d.read(lane, read := [0.0] * len(Sensed._fields))
        return Sensed(*read)

    def state(self, name: str) -> float:
        """A state at the present time [SI]."""
        return float(self._A[self._state_at(name)])

    def set_states(self, values: Mapping[str, Any]) -> None:
        """Write states of the present time, by name [SI]: all of them, or none where one is refused.

        Every state is what it is: wire that is paid out without its load being lowered is slack. The energy that a
        state adds or takes away is not one that the winch or its load lost: the audit counts from it.
        """
        if not isinstance(values, Mapping):
            raise SimulationError(f"Session.set_states: {units.quote(values)}: give values by name, as a mapping.")
        checked = {}
        for name, value in values.items():
            i = self._state_at(name)
            checked[i] = self._number(name, value, (float(self._ranges.least[i]), float(self._ranges.most[i])))
        self._write(list(checked), np.array([*checked.values()]))

    def save(self, path: str | Path | None = None) -> bytes:
        """The state as bytes, and in a file where a path is given: it appears under its name when it is complete.

        The bytes say what they are of and which numbers they hold, and end with the SHA-256 of all before; their length
        does not grow with time.
        """
        of_unit, unit = self._vessel.saved()
        head = of_unit | {
            "identity": self._identity,
            "k": self._k,
            "held": {name: value.hex() for name, value in self._held.items()},
            "changed": {name: value.hex() for name, value in self._changed.items()},
            "names": self._names,
        }
        data = seal("session", FORMAT, head, [self._A, self._row, unit])
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
        if len(values) < len(self._names):
            raise SimulationError(f"{label}: damaged: {len(values)} numbers in place of {len(self._names)}.")
        k, held = head.get("k"), self._held_in(head.get("held"), label)
        if type(k) is not int or not 0 <= k <= CYCLES:
            raise SimulationError(f"{label}: k = {printable(k)}: give a whole number of cycles from 0 to {CYCLES:.0f}.")
        changed = self._changed_in(head.get("changed"), label)
        lane, row, numbers = np.split(values, [len(self._A), len(self._names)])
        unit = self._vessel.restored(head, numbers, k, label)
        self._check(lane, row, k, changed, label)
        self._A[:], self._row[:] = lane, row
        self._k, self._held, self._changed, self._seen, self._vessel.unit = k, held, changed, False, unit

    def keep(self) -> Kept:
        """The state in memory, for `go_back`: quicker than `save`, and of this session alone."""
        A, row, unit = self._A.copy(), self._row.copy(), self._vessel.unit
        return Kept(self, self._k, dict(self._held), dict(self._changed), A, row, unit)

    def go_back(self, kept: Kept) -> None:
        """Go back to what `keep` gave. Errors: SimulationError where it is of another session."""
        if kept.session is not self:
            raise SimulationError("Session.go_back: kept of another session. Use save and restore between sessions.")
        self._A[:], self._row[:], self._vessel.unit = kept.A, kept.row, kept.unit
        self._k, self._held, self._changed, self._seen = kept.k, dict(kept.held), dict(kept.changed), False

    def _checked_inputs(self, inputs: Mapping[str, Any]) -> tuple[dict[str, float], VesselUnit | None]:
        """Inputs of a step. Errors: SimulationError."""
        if not isinstance(inputs, Mapping):
            raise SimulationError(f"Session.step: inputs = {units.quote(inputs)}: give values by name, as a mapping.")
        values = {name: self._value(name, value) for name, value in inputs.items()}
        check_motion(values)
        return self._vessel.tip(values, self._k + 1)

    def _fill(self, row: FloatArray, k: int, inputs: Mapping[str, float]) -> None:
        """The whole row of the drive at cycle k: of the scenario, then what is held, then what is given."""
        held, before = self._held, self._row
        still = "s_tip" in inputs or (bool(held) and all(name in held for name in MOTION))
        scenario = self._ahead.at(k, still=still)
        row[:] = scenario
        if self._wire:
            row[0], row[1], row[2] = self._ready.winch.params.hoist.load.W, 0.0, 0.0
        for overlay in (held, inputs):
            for name, value in overlay.items():
                for column in self._columns.get(name) or MEASURED[name]:
                    row[column] = value
        if k > 0 and ("v_op" in inputs or "v_op" in held) and "s_op" not in inputs and "s_op" not in held:
            v, s = COLUMNS["v_op"][0], COLUMNS["s_op"][0]
            row[s] = before[s] + 0.5 * self._t_cycle * (before[v] + row[v])
        if row[OVERRIDE] == 0.0:
            for name in COMMANDS:
                if name in inputs:
                    raise SimulationError(NO_EFFECT.format(where="step", name=name))
        elif scenario[OVERRIDE] == 0.0:
            for name, at in COMMAND_AT.items():
                if name not in inputs and name not in held:
                    row[at] = before[at] if before[OVERRIDE] > 0.0 else self.get(name)

    def _take_over(self, on: bool) -> None:
        """The present commands of the PLC become those of an override that begins; one that ends holds none."""
        for name, at in COMMAND_AT.items():
            if not on:
                self._held.pop(name, None)
            elif self._row[OVERRIDE] == 0.0:
                self._row[at] = self.get(name)

    def _change(self, changed: dict[str, float], name: str) -> None:
        """Settings besides those of the PLC, of which this name is new. Errors: SimulationError."""
        try:
            packed = self._packed(changed)
        except StillhookError as problem:
            raise SimulationError(f"Session: {name} = {changed[name]:g}: {problem}") from None
        self._write(self._settings.places, self._settings.numbers(packed, changed))
        self._changed = changed

    def _packed(self, changed: Mapping[str, float]) -> Packed:
        """The winch with these settings. Errors: SpecError where they cannot be, or the step is too long for them."""
        packed = self._settings.packed(changed)
        check_step(packed, self._t_cycle / self._block.n_sub)
        return packed

    def _write(self, places: Any, numbers: FloatArray) -> None:
        """Numbers of the lane, without what they add to its energy in the audit's account."""
        before = self._observed()[self._E_end]
        self._A[places], self._seen = numbers, False
        jump = self._observed()[self._E_end] - before
        if self._A[self._counted] > 0.0 and math.isfinite(jump):
            self._A[self._E_start] += jump
            self._seen = False

    def _check(self, lane: FloatArray, row: FloatArray, k: int, changed: Mapping[str, float], label: str) -> None:
        """Errors: SimulationError for the first number that no state of this winch has."""
        first = self._ranges.names.index(f".tick.{Tick._fields[0]}")
        rows = slice(first, first + len(Tick._fields))
        own = self._A.copy()
        try:
            own[self._settings.places] = self._settings.numbers(self._packed(changed), changed)
        except StillhookError as error:
            raise SimulationError(f"{label}: no settings of this winch: {error} Save it again.") from None
        problem = wrong(lane, own, self._begin, self._ranges, k, self._codes)
        problem = problem or wrong(row, self._row, self._begin[rows], self._ranges.at(rows), k, self._codes)
        if problem:
            raise SimulationError(f"{label}: no state of this winch: {problem}. Save it again.")

    def _held_in(self, saved: Any, label: str) -> dict[str, float]:
        """Inputs that are held, as a saved state has them. Errors: SimulationError."""
        held = numbers_in("held", saved, self._columns, label)
        for name, value in held.items():
            at, own = self._place(name), np.array([value])
            if problem := wrong(own, own, np.full(1, np.nan), self._ranges.at(slice(at, at + 1)), 0, self._codes):
                raise SimulationError(f"{label}: held: no input of this winch: {problem}. Save it again.")
        return held

    def _changed_in(self, saved: Any, label: str) -> dict[str, float]:
        """Settings that were changed, as a saved state has them. Errors: SimulationError."""
        changed = numbers_in("changed", saved, self._settings.known, label)
        for name, value in changed.items():
            known = self._settings.known[name]
            if not known.least <= value <= known.most:
                raise SimulationError(
                    f"{label}: changed: {name} = {value:.9g}, allowed is {known.least:g} to {known.most:g}. Save it"
                    " again."
                )
        return changed

    def _place(self, name: str) -> int:
        """Place of an input among the numbers of a state."""
        return self._ranges.names.index(f".tick.{Tick._fields[self._columns[name][0]]}")

    def _observed(self) -> FloatArray:
        """The numbers of the lane at the present time, its cycle calculated."""
        if not self._seen:
            self._copy[:], self._D_now[:] = self._A, self._row
            self._look(self._k, self._k)
            self._seen = True
        return self._copy

    def _value(self, name: str, value: Any) -> float:
        """An input. Errors: SimulationError."""
        if not isinstance(name, str) or name not in self._ends:
            if reason := lacking(self._crane).get(name if isinstance(name, str) else ""):
                raise SimulationError(f"Session: {name}: {reason}. Leave it out.")
            raise SimulationError(self._unknown(name, (*self._columns, *self.vessel_inputs, *self.parameters)))
        if name != "mode":
            number = self._number(name, value, self._ends[name])
            if name == "override" and number not in (0.0, 1.0):
                raise SimulationError(f"Session: override = {units.quote(number)}: give 0 or 1.")
            return number
        if not isinstance(value, str) or value not in self._modes:
            allowed = ", ".join(sorted(self._modes))
            raise SimulationError(
                f"Session: mode = {units.quote(value)}: choose {allowed}, or name another in the scenario's modes."
            )
        return code_of(value)

    _number = staticmethod(number_within)

    def _state_at(self, name: str) -> int:
        """Place of a state. Errors: SimulationError."""
        if not isinstance(name, str) or name not in self._states:
            raise SimulationError(self._unknown(name, self._states))
        return self._states[name]

    def _unknown(self, name: Any, allowed: Iterable[str]) -> str:
        return f"Session: {units.quote(name)} is not a name here. Choose one of {', '.join(dict.fromkeys(allowed))}."
