"""A whole `stillhook live run` whose processes are killed: nothing acknowledged is lost, and the twin goes on from its
state to the bit."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest
from trials.endurance import kills

for extra in ("duckdb", "pymodbus"):
    pytest.importorskip(extra, reason="the extra live is not installed")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="processes are looked up in /proc")]

SEED = 39
SHORT = 1.0
"""Longest life of a twin once it is ready [s]."""


@pytest.mark.long
@pytest.mark.parametrize(
    "victims",
    [
        pytest.param(["kernel", "servers", "all"], id="3"),
        pytest.param(random.Random(SEED).choices(kills.VICTIMS, k=50), id="50", marks=pytest.mark.thorough),
    ],
)
def test_a_twin_whose_processes_are_killed_loses_nothing_that_was_acknowledged(victims: list[str], tmp_path: Path):
    found = kills.campaign(tmp_path / "twin", victims, SEED, SHORT if len(victims) == 3 else kills.LONGEST_LIFE)
    assert sum(found["killed"].values()) >= len(victims)
    assert set(victims) <= set(found["killed"])
    assert found["rows"] >= kills.LEAST_ROWS
    assert found["states"] > len(victims)
