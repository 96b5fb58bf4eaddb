"""Cranes with their controllers, inputs without a plan, and bits."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from tests.export.plc.structured_text import Machine

from stillhook.control.guard import GuardSettings, Least, Most, Step, guard_at_start
from stillhook.control.interface import Sensed
from stillhook.control.plc import memory_before
from stillhook.control.registry import CONTROLLERS
from stillhook.export.plc import structured_text
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.program import Block
from stillhook.export.plc.sequence import Reference, inputs, numbers
from stillhook.kernels.control_laws import control_laws, extra_controllers
from stillhook.kernels.lanes import flatten, unflatten
from stillhook.kernels.plc_alone import GUARDED, OUTSIDE, Outside, kernel
from stillhook.library import cranes, load_crane
from stillhook.physics.hydraulics.swash import known_displacement

CLOSED = "nov-250t"
BLOCK_LENGTH = 150
"""Cycles for which inputs that the operator sets stay as they are."""
SIGNALS = list(Sensed._fields)
N_SIGNALS = len(SIGNALS)
NAN, INF = float("nan"), float("inf")
BAD = [NAN, INF, -INF, 1e308, -1e308]
"""Values that no signal may have; others depend on the signal."""
BEFORE, LATER = 400, 400
"""Cycles of healthy compensation, and of a fault: longer than the time of a stop."""


@functools.cache
def block_of(crane: str, controller: str) -> Block:
    return controller_block(load_crane(crane), controller)


def machine_of(crane: str, controller: str, compare: Any = None) -> Machine:
    """The text that is read."""
    return Machine(structured_text(block_of(crane, controller)), compare)


@functools.cache
def sequence_of(crane: str, controller: str) -> list[tuple[Outside, Any]]:
    """Inputs and outputs of every cycle of the test sequence."""
    block = block_of(crane, controller)
    return list(inputs(block, Reference(block)))


@functools.cache
def cycles_of(crane: str, controller: str) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and outputs of every cycle of the test sequence, as numbers."""
    cycles = sequence_of(crane, controller)
    return np.array([numbers(o) for o, _ in cycles]), np.array([d for _, d in cycles])


@functools.cache
def pairs() -> tuple[tuple[str, str], ...]:
    """Every controller on a crane of every kind of drive that takes it, and every other kind of winch, whose texts
    differ from these by numbers alone, with its usual one."""
    winches = {(w := load_crane(name).plant.type).name: (name, w) for name in reversed(cranes())}
    drives = {w.control: name for name, w in winches.values()}
    every = [(name, law.name) for drive, name in drives.items() for law in CONTROLLERS.values() if drive in law.drives]
    return tuple(dict.fromkeys([*every, *((name, w.default_mode.value) for name, w in winches.values())]))


def random_inputs(block: Block, n: int, seed: int = 7) -> np.ndarray:
    """(n, inputs): modes, loads, layers, pumps and pressures in blocks, the tip's motion and the rest as noise."""
    rng = np.random.default_rng(seed)
    blocks = -(-n // BLOCK_LENGTH)

    def held(values: Any) -> np.ndarray:
        return np.repeat(rng.choice(values, blocks), BLOCK_LENGTH)[:n]

    F = held([0.02, 0.3, 0.7, 1.1]) / block.plc.motors.i_F_swl * (1.0 + 0.1 * rng.standard_normal(n))
    dp = held([-1e7, 0.0, 1.5e7, 3e7]) + 1e6 * rng.standard_normal(n)
    columns = {
        "s_tip": rng.standard_normal(n),
        "v_tip": held([0.1, 1.0, 3.0]) * rng.standard_normal(n),
        "a_tip": rng.standard_normal(n),
        "v_op": held([0.0, 0.0, 0.3, -0.5]),
        "s_op": rng.standard_normal(n),
        "mode": held([0.0, block.code, block.code]),
        "f_pump": held([1.0, 0.75, 0.5]),
        "s_w": 100.0 + rng.standard_normal(n),
        "F": F,
        "alpha_m": rng.uniform(0.2, 1.0, n),
        "K_wire": held([1.0, 1.1, 1.4]),
        "dp": dp,
        "dp_load": dp + held([0.0, 5e5, 8e6]),
        "p_hp": 2e7 + 1e6 * rng.standard_normal(n),
        "omega_m": 100.0 * rng.standard_normal(n),
        "p_a": 2e7 + 1e6 * rng.standard_normal(n),
        "p_b": 2e6 + 1e5 * rng.standard_normal(n),
    }
    return np.column_stack([columns[name] for name in Sensed._fields])


def wide(settings: GuardSettings) -> GuardSettings:
    """A guard that lets every number pass."""

    def same(cls: Any, x: float) -> Any:
        return cls._make([x] * len(cls._fields))

    return settings._replace(least=same(Least, -1e299), most=same(Most, 1e299), step=same(Step, 1e299))


def open_wide(machine: Any) -> None:
    """The same for a text that is read."""
    guard = machine.settings["settings"].guard
    for name, value in (("least", -1e299), ("most", 1e299), ("step_2", 1e299)):
        vars(getattr(guard, name)).update(dict.fromkeys(vars(getattr(guard, name)), value))


def unguarded(block: Block, rows: np.ndarray) -> np.ndarray:
    """Commands of the cycle that simulations use, which has no guard."""
    names = extra_controllers([block.controller])
    laws = control_laws(names, block.drive)
    own = {block.controller: block.own} if block.own is not None else {}
    m, record, out = None, laws.blank(own), []
    for row in rows.tolist():
        y = Sensed(*row)
        m = memory_before(block.memory, y.F, y.s_w, y.s_tip, y.mode, y.v_op, block.plc) if m is None else m
        y = y._replace(alpha_m=known_displacement(y.alpha_m, m.u_m, block.control))
        drive, m, record = laws.cycle(y, m, record, block.plc)
        out.append(drive)
    return np.array(out)


class GuardedPlc:
    """The exported controller, compiled, cycle after cycle."""

    def __init__(self, block: Block, guard: GuardSettings | None = None) -> None:
        own = {block.controller: block.own} if block.own is not None else {}
        self.kernel = kernel(extra_controllers([block.controller]), block.drive, True)
        laws = self.kernel.laws.blank(own, guard_at_start(guard or block.guard, block.code))
        self.lane = np.array(flatten(self.kernel.Lane(block.memory, laws, block.plc, block.control)))

    def run(self, rows: np.ndarray) -> np.ndarray:
        """Commands (n, numbers of `GuardedCommands`) of n cycles on rows (n, numbers of `Outside`)."""
        seen = np.ascontiguousarray(rows, dtype=np.float64).reshape(-1, OUTSIDE)
        out = np.empty((len(seen), GUARDED))
        self.kernel.run(self.lane, seen.reshape(-1), out.reshape(-1), len(seen))
        return out

    @property
    def memory(self) -> Any:
        """Everything that it carries: fields m and laws."""
        return unflatten(self.kernel.Lane, iter(self.lane.tolist()))


def all_good(rows: np.ndarray) -> np.ndarray:
    """Rows of `Outside` with good qualities and no reset."""
    n = len(rows)
    return np.column_stack([rows, np.ones((n, len(Sensed._fields))), np.zeros(n)])


def steady(block: Block, n: int = BEFORE + LATER) -> np.ndarray:
    """Rows of n cycles of compensation of a small motion, the operator lowering, brake open from the start."""
    t = np.arange(n) * block.t_cycle
    speed = 1.0 / block.plc.gains.K_1
    columns = dict.fromkeys(SIGNALS, np.zeros(n))
    columns |= {"s_tip": 0.1 * np.sin(t), "v_tip": 0.1 * np.cos(t), "a_tip": -0.1 * np.sin(t)}
    columns |= {name: np.ones(n) for name in ("f_pump", "alpha_m", "K_wire")}
    columns |= {"v_op": np.full(n, -0.2 * speed), "s_op": -0.2 * speed * t, "mode": np.full(n, block.code)}
    columns |= {"s_w": 100.0 + 0.1 * np.sin(t) + 0.2 * speed * t, "F": np.full(n, 0.5 / block.plc.motors.i_F_swl)}
    columns |= {name: np.full(n, 1e7) for name in ("dp", "dp_load")} | {"p_hp": np.full(n, 2e7)}
    return all_good(np.column_stack([columns[name] for name in SIGNALS]))


def faulty(block: Block, n: int, seed: int) -> np.ndarray:
    """Rows of a steady compensation, of pieces that begin with an acknowledgement at rest, with faults at random: any
    value on any signals for any time, noise without end, bad qualities, resets."""
    rng = np.random.default_rng(seed)
    rows = np.concatenate([steady(block, 1000)] * (-(-n // 1000)))[:n]
    values = np.array([*BAD, 0.0, -0.0, 5e-324, 1.0, -1.0, 1e6, 99.0, 0.5])
    for start in range(0, n, 1000):
        rows[start : start + 150, SIGNALS.index("mode")] = 0.0
        rows[start : start + 150, SIGNALS.index("v_op")] = 0.0
        rows[start + 100 : start + 110, -1] = 1.0
        for _ in range(rng.integers(0, 6)):
            k, length, i = start + rng.integers(0, 1000), rng.integers(1, 300), rng.integers(0, OUTSIDE)
            kind = rng.integers(0, 3)
            piece = rows[k : k + length, i]
            if i >= N_SIGNALS or kind == 0:
                piece[:] = rng.choice(values)
            elif kind == 1:
                piece[:] = rng.choice(values, len(piece))
            else:
                piece += 10.0 ** rng.uniform(-3, 8) * rng.standard_normal(len(piece))
    return rows


def bits(values: Any) -> np.ndarray:
    """Doubles as integers: 0.0 and -0.0 differ."""
    return np.ascontiguousarray(values, dtype=np.float64).view(np.int64)
