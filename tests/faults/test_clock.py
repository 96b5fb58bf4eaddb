"""The wall clock jumps by hours or stands still, and nothing waits for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from tests.faults.bench import Bench
from tests.faults.commands import COMMANDS
from tests.faults.injector import compiled

from stillhook.live.observer.process import JUMP, SLEW, WallClock
from stillhook.live.observer.received import Received

HOURS = 7200.0
"""By which the clock is set forward and back [s]."""
TIMEOUT = 2.0
LOOK = 0.2
"""Time between two looks at the clock [s]."""


@pytest.mark.parametrize("jump", [HOURS, -HOURS])
def test_measured_values_are_beside_the_rows_again_at_once(jump: float):
    received, begin = Received(("p_a",), TIMEOUT), 1.0e9
    for k in range(10):
        received.take(begin + 0.1 * k, 0.1 * k, {"p_a": 1.0e7})
    after = begin + jump
    received.take(after, 1.0, {"p_a": 2.0e7})
    value, age = received.passed(after + 0.5).tolist()
    assert (value, age) == (2.0e7, pytest.approx(0.5))
    value, age = received.newest(1.0 + TIMEOUT + 1.0).tolist()
    assert math.isnan(value)


@pytest.mark.parametrize("jump", [HOURS, -HOURS])
def test_a_value_that_stays_away_after_a_jump_is_not_taken_for_new(jump: float):
    received, begin = Received(("p_a",), TIMEOUT), 1.0e9
    received.take(begin, 0.0, {"p_a": 1.0e7})
    assert math.isnan(received.passed(begin + jump)[0])


def test_a_value_that_stays_away_while_the_clock_stands_still_is_stale():
    received = Received(("p_a",), TIMEOUT)
    received.take(1.0e9, 5.0, {"p_a": 1.0e7})
    assert received.newest(5.0 + TIMEOUT).tolist() == [1.0e7, TIMEOUT]
    assert math.isnan(received.newest(5.1 + TIMEOUT)[0])


def jumps(shown: Callable[[float], float]) -> list[float]:
    """Of a wall clock over the monotonic one, in a minute."""
    clock, times = WallClock(shown(0.0), 0.0), np.arange(LOOK, 60.0, LOOK)
    return [jump for t in times if (jump := clock.jump(shown(t), t))]


@pytest.mark.parametrize("jump", [HOURS, -HOURS, 1.1 * JUMP])
def test_a_jump_is_noticed_once(jump: float):
    assert jumps(lambda t: 1.0e9 + t + jump * (t > 30.0)) == [pytest.approx(jump)]


@pytest.mark.parametrize("rate", [1.0 + 0.99 * SLEW, 1.0 - 0.99 * SLEW])
def test_a_clock_that_is_moved_slowly_does_not_jump(rate: float):
    assert jumps(lambda t: 1.0e9 + rate * t) == []


def test_a_clock_that_stands_still_is_noticed():
    assert len(jumps(lambda t: 1.0e9 + min(t, 55.0))) > 1


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    bench = Bench(tmp_path_factory.mktemp("clock"), compiled(tmp_path_factory.mktemp("shim")))
    with bench.injector:
        yield bench


@pytest.mark.long
@pytest.mark.parametrize("clock", [HOURS, -HOURS])
def test_a_command_gives_the_same_files_at_another_time(bench: Bench, clock: float):
    arguments, new = bench.complete(COMMANDS["fmu"])
    bench.reset()
    assert bench.run(arguments, clock=clock).code == 0
    assert bench.tree() == new
