"""The wall clock jumps by hours, and nothing waits for it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
from tests.faults.bench import Bench
from tests.faults.commands import COMMANDS
from tests.faults.injector import compiled

from stillhook.live.observer.received import Received

HOURS = 7200.0
"""By which the clock is set forward and back [s]."""
TIMEOUT = 2.0


@pytest.mark.parametrize("jump", [HOURS, -HOURS])
def test_measured_values_are_beside_the_rows_again_at_once(jump: float):
    received, begin = Received(("p_a",), TIMEOUT), 1.0e9
    for k in range(10):
        received.take(begin + 0.1 * k, {"p_a": 1.0e7})
    after = begin + jump
    received.take(after, {"p_a": 2.0e7})
    value, age = received.passed(after + 0.5).tolist()
    assert (value, age) == (2.0e7, pytest.approx(0.5))
    value, age = received.newest(after + TIMEOUT + 1.0).tolist()
    assert math.isnan(value)


@pytest.mark.parametrize("jump", [HOURS, -HOURS])
def test_a_value_that_stays_away_after_a_jump_is_not_taken_for_new(jump: float):
    received, begin = Received(("p_a",), TIMEOUT), 1.0e9
    received.take(begin, {"p_a": 1.0e7})
    assert math.isnan(received.passed(begin + jump)[0])


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    library = compiled(tmp_path_factory.mktemp("shim"))
    if library is None:
        pytest.skip("the clock is libc's, on Linux with a C compiler")
    bench = Bench(tmp_path_factory.mktemp("clock"), library)
    with bench.injector:
        yield bench


@pytest.mark.slow
@pytest.mark.parametrize("clock", [HOURS, -HOURS])
def test_a_command_gives_the_same_files_at_another_time(bench: Bench, clock: float):
    arguments, new = bench.complete(COMMANDS["fmu"])
    bench.reset()
    assert bench.run(arguments, clock=clock).code == 0
    assert bench.tree() == new
