"""Cranes with their controllers, inputs without a plan, and bits."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from stillhook.control.interface import Sensed
from stillhook.control.registry import CONTROLLERS
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.program import Block
from stillhook.library import cranes, load_crane

CLOSED = "nov-250t"
BLOCK_LENGTH = 150
"""Cycles for which inputs that the operator sets stay as they are."""


@functools.cache
def block_of(crane: str, controller: str) -> Block:
    return controller_block(load_crane(crane), controller)


@functools.cache
def one_crane_of_each_drive() -> dict[tuple[str, str], str]:
    """Kind of winch and of drive -> the first crane of the library that has it."""
    found: dict[tuple[str, str], str] = {}
    for name in cranes():
        winch = load_crane(name).plant.type
        found.setdefault((winch.name, winch.control), name)
    return found


def pairs() -> list[tuple[str, str]]:
    """Every controller on a crane of every kind of winch that takes it."""
    return [
        (crane, law.name)
        for (_, drive), crane in one_crane_of_each_drive().items()
        for law in CONTROLLERS.values()
        if drive in law.drives
    ]


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
    }
    return np.column_stack([columns[name] for name in Sensed._fields])


def bits(values: Any) -> np.ndarray:
    """Doubles as integers: 0.0 and -0.0 differ."""
    return np.ascontiguousarray(values, dtype=np.float64).view(np.int64)
