"""A running twin whose wall clock jumps, or whose disk takes nothing for a while: it continues, and stores every row."""

from __future__ import annotations

import contextlib
import errno
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.faults.injector import Kind, compiled, preloaded

from stillhook.errors import LiveError
from stillhook.library.examples import LIVE, example_files
from stillhook.live.history import HistorySink, overview, read, read_events
from stillhook.live.runtime.state import LiveState

HOURS = 7200.0
"""By which the clock is set forward and back [s]."""
CYCLE = 0.01
"""Of the twin's PLC [s]."""
PATIENCE = 90.0
COMMIT = 1.0
"""Time between two commits of rows [s]."""
WATCHED = 4.0
"""Time for which a clock is as it was set [s]."""
LATE = 1.0
"""What cycles may be late on a busy machine [s]."""
LOOK = 0.2
"""Time between two looks at what is stored [s]."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("shim"))


def started(folder: Path, environment: dict[str, str]) -> subprocess.Popen[bytes]:
    """A twin that stores every row, and is compared with measured values."""
    example_files(LIVE, folder)
    begin, _, rest = (folder / "live.toml").read_text(encoding="utf-8").partition("[opcua]")
    measured = "[measured]" + rest.partition("[measured]")[2]
    text = f'{begin}[udp]\nport = 0\n[history]\nevery = "0 s"\n{measured}'
    (folder / "live.toml").write_text(text, encoding="utf-8")
    words = [sys.executable, "-m", "stillhook", "live", "run", str(folder / "live.toml")]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment)


def until(condition: Callable[[], bool]) -> None:
    """Wait, on a machine that does much else."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(LOOK)


def rows_of(history: Path) -> int:
    """Rows that are stored."""
    with contextlib.suppress(LiveError):
        return overview(history).last_row
    return 0


@pytest.mark.thorough
@pytest.mark.parametrize("jump", [HOURS, -HOURS, None], ids=["forward", "back", "still"])
def test_a_twin_runs_on_by_the_monotonic_clock(library: Path, tmp_path: Path, jump: float | None):
    control, environment = preloaded(tmp_path / "control", library)
    history, events = tmp_path / "live" / "twin" / "history", tmp_path / "live" / "twin" / "events.jsonl"

    def observed() -> bool:
        return '"source": "observer", "name": "clock"' in events.read_text(encoding="utf-8")

    process = started(tmp_path / "live", environment)
    try:
        until(lambda: rows_of(history) > 100)
        number, begin = rows_of(history), time.monotonic()
        if jump is None:
            control.still = time.time_ns()
        while not observed():  # by an observer that has begun
            assert time.monotonic() < begin + PATIENCE
            control.clock += 0 if jump is None else round(1e9 * jump)
            time.sleep(WATCHED)
        seconds, stored = time.monotonic() - begin, rows_of(history) - number
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


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "error"), [(Kind.FULL, errno.ENOSPC), (Kind.FAIL_ON, errno.EIO), (Kind.FAIL_ON, errno.EACCES)], ids=str
)
def test_a_twin_stores_what_waited_while_its_disk_took_nothing(library: Path, tmp_path: Path, kind: Kind, error: int):
    control, environment = preloaded(tmp_path / "control", library)
    folder = tmp_path / "live"
    history = folder / "twin" / "history"
    process = started(folder, environment)
    try:
        until(lambda: rows_of(history) > 100)
        control.below = f"{folder}/".encode()
        control.at, control.error = control.count + 1, error
        control.kind = kind
        until(lambda: control.fired > 0)
        before = rows_of(history)
        time.sleep(WATCHED)
        assert process.poll() is None
        assert rows_of(history) <= before + 1.0 / CYCLE
        control.kind = Kind.NONE
        until(lambda: rows_of(history) > before + 2.0 * WATCHED / CYCLE)
        process.terminate()
        _, said = process.communicate(timeout=60.0)
    finally:
        process.kill()
    assert process.returncode == 143
    lines = [line for line in said.decode().splitlines() if line.endswith("The twin continues.")]
    assert sorted(line.split(":")[0] for line in lines) == [
        "history",
        "twin",
    ]  # once each, though it is tried every second
    run = read(history)
    assert run["row"].values.tolist() == list(range(1, run.sizes["time"] + 1))
    assert np.all(np.diff(run["cycle_number"]) == 1.0)
    assert [event.data.get("name") for event in read_events(history)].count("state-not-saved") == 1
    assert '"name": "lost-events"' in (folder / "twin" / "events.jsonl").read_text(encoding="utf-8")
    kept = HistorySink(history).last_state()
    assert kept is not None
    assert LiveState.from_bytes(kept).number == LiveState.from_bytes(folder / "twin" / "state.bin").number
