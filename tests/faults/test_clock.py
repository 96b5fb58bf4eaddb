"""The wall clock jumps by hours or stands still, and nothing waits for it."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.faults.bench import Bench
from tests.faults.commands import COMMANDS
from tests.faults.injector import compiled, preloaded

from stillhook.errors import LiveError
from stillhook.library.examples import LIVE, example_files
from stillhook.live.history import overview, read, read_events
from stillhook.live.observer.process import JUMP, SLEW, WallClock
from stillhook.live.observer.received import Received

HOURS = 7200.0
"""By which the clock is set forward and back [s]."""
TIMEOUT = 2.0
LOOK = 0.2
"""Time between two looks at the clock [s]."""
CYCLE = 0.01
"""Of the twin's PLC [s]."""
PATIENCE = 90.0
COMMIT = 1.0
"""Time between two commits of rows [s]."""
WATCHED = 4.0
"""Time for which a clock is as it was set [s]."""
LATE = 1.0
"""What cycles may be late on a busy machine [s]."""


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
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = compiled(tmp_path_factory.mktemp("shim"))
    if made is None:
        pytest.skip("the clock is libc's, on Linux with a C compiler")
    return made


@pytest.fixture(scope="module")
def bench(library: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    bench = Bench(tmp_path_factory.mktemp("clock"), library)
    with bench.injector:
        yield bench


@pytest.mark.long
@pytest.mark.parametrize("clock", [HOURS, -HOURS])
def test_a_command_gives_the_same_files_at_another_time(bench: Bench, clock: float):
    arguments, new = bench.complete(COMMANDS["fmu"])
    bench.reset()
    assert bench.run(arguments, clock=clock).code == 0
    assert bench.tree() == new


def started(folder: Path, environment: dict[str, str]) -> subprocess.Popen[bytes]:
    """A twin that stores every row, and is compared with measured values."""
    example_files(LIVE, folder)
    begin, _, rest = (folder / "live.toml").read_text(encoding="utf-8").partition("[opcua]")
    measured = "[measured]" + rest.partition("[measured]")[2]
    text = f'{begin}[udp]\nport = 0\n[history]\nevery = "0 s"\n{measured}'
    (folder / "live.toml").write_text(text, encoding="utf-8")
    words = [sys.executable, "-m", "stillhook", "live", "run", str(folder / "live.toml")]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)


def until(condition: Callable[[], bool]) -> None:
    """Wait, on a machine that does much else."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(LOOK)


@pytest.mark.thorough
@pytest.mark.parametrize("jump", [HOURS, -HOURS, None], ids=["forward", "back", "still"])
def test_a_twin_runs_on_by_the_monotonic_clock(library: Path, tmp_path: Path, jump: float | None):
    control, environment = preloaded(tmp_path / "control", library)
    history, events = tmp_path / "live" / "twin" / "history", tmp_path / "live" / "twin" / "events.jsonl"

    def rows() -> int:
        with contextlib.suppress(LiveError):
            return overview(history).last_row
        return 0

    def observed() -> bool:
        return '"source": "observer", "name": "clock"' in events.read_text(encoding="utf-8")

    process = started(tmp_path / "live", environment)
    try:
        until(lambda: rows() > 100)
        number, begin = rows(), time.monotonic()
        if jump is None:
            control.still = time.time_ns()
        while not observed():  # by an observer that has begun
            assert time.monotonic() < begin + PATIENCE
            control.clock += 0 if jump is None else round(1e9 * jump)
            time.sleep(WATCHED)
        seconds, stored = time.monotonic() - begin, rows() - number
        process.terminate()
        assert process.wait(PATIENCE) == 143
    finally:
        process.kill()
    assert CYCLE * stored == pytest.approx(seconds, abs=LATE + COMMIT)
    run = read(history)
    assert run["row"].values.tolist() == list(range(1, run.sizes["time"] + 1))
    assert np.allclose(np.diff(run["t_winch"]), CYCLE * np.diff(run["cycle_number"]), rtol=0.0, atol=1e-9)
    assert np.all(np.diff(run["cycle_number"]) > 0.0)
    steps = np.diff(run["utc"].values.astype("datetime64[ns]").astype(np.int64)) / 1e9
    if jump is None:
        assert CYCLE * np.sum(steps == 0.0) == pytest.approx(seconds, abs=LATE + COMMIT)
    else:
        set_by = steps[np.abs(steps) > 0.5 * HOURS]
        assert len(set_by) == control.clock / round(1e9 * jump)
        assert np.allclose(set_by, jump, rtol=0.0, atol=LATE)
    back = [each for each in read_events(history) if each.kind == "clock" and "goes back" in each.text]
    assert bool(back) == (jump is not None and jump < 0.0)
