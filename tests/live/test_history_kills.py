"""Whoever kills a process of the twin, at whatever moment: nothing acknowledged is lost, nothing is there twice, and the
saved state goes on to the bit."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.live.histories import COLUMNS, HOUR, START, numbers

from stillhook.live.history import Budget, History, archive, check, overview, read, read_events

SEED = 39
SPACED = 89
"""Lines of code between two kills in the usual suite ..."""
CLOSE = 3
"""... and in the thorough one: every line was met when this was written, at ten times the cost."""

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL and no fork there")]


def assert_whole(folder: Path, acknowledged: int) -> int:
    """Every row once, in order and to the bit; returns the last one."""
    run = read(folder)
    rows = run["row"].values
    assert rows.tolist() == list(range(1, len(rows) + 1))
    assert len(rows) >= acknowledged
    expected = numbers(1, len(rows))
    for i, name in enumerate(COLUMNS):
        assert run[name].values.tobytes() == expected[:, i].tobytes()
    assert run.attrs["left_out"] == ""
    return len(rows)


MOST_LIVES, ENOUGH = 60, 100
"""Lives at most, and rows that they have to acknowledge together."""


@pytest.mark.long
@pytest.mark.parametrize("kills", [6, pytest.param(50, marks=pytest.mark.thorough)])
def test_killed_at_any_moment_nothing_acknowledged_is_lost(tmp_path: Path, kills: int):
    from tests.live.killed import CASE, CRANE

    import stillhook

    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    words = [sys.executable, str(Path(__file__).with_name("killed.py")), str(tmp_path), str(SEED)]
    acknowledged, reference = 0, stillhook.Session(CRANE, CASE)
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as nursery:
        lives = 0
        few = lambda: acknowledged <= ENOUGH or overview(tmp_path).files == 0  # a busy machine needs more lives
        while lives < kills or (few() and lives < MOST_LIVES):
            lives += 1
            nursery.stdin.write("live\n")
            nursery.stdin.flush()
            last, how = map(int, nursery.stdout.readline().split())
            assert how == signal.SIGKILL
            acknowledged = max(acknowledged, last)
            if not (tmp_path / "journal.sqlite").exists() or overview(tmp_path).last_row == 0:
                assert acknowledged == 0
                continue
            rows = assert_whole(tmp_path, acknowledged)
            with History(tmp_path, COLUMNS) as history:
                assert history.last_row == rows
                state = history.last_state("twin")
            assert state.row == rows
            if reference.time < (rows - 0.5) * reference.cycle:
                reference.step(cycles=rows - round(reference.time / reference.cycle))
            assert state.data == reference.save()
        nursery.stdin.close()
    assert acknowledged > ENOUGH
    assert overview(tmp_path).files > 0
    assert check(tmp_path) == []


def killed_at_line(n: int, work: Callable[[], object]) -> bool:
    """Do something in a child that kills itself at its n-th line of the history's code; whether it came so far."""
    child = os.fork()
    if child == 0:
        left = n

        def trace(frame, event, argument):
            nonlocal left
            if "/live/history/" not in frame.f_code.co_filename and not frame.f_code.co_filename.endswith("/atomic.py"):
                return None
            if event == "line":
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
            return trace

        try:
            sys.settrace(trace)
            work()
        finally:
            os._exit(0)
    _, status = os.waitpid(child, 0)
    return os.WIFSIGNALED(status)


@pytest.mark.long
@pytest.mark.parametrize("every", [SPACED, pytest.param(CLOSE, marks=pytest.mark.thorough)])
def test_an_archiver_may_be_killed_at_any_line_of_its_code(tmp_path: Path, every: int):
    source = tmp_path / "source"
    with History(source, COLUMNS, budget=Budget(days=1.2 / 24.0)) as history:
        history.append(START + 0.5 * HOUR * np.arange(7.0), numbers(1, 7))
    n, alive, seen = 1, False, set()
    while not alive:
        folder = tmp_path / f"{n}"
        shutil.copytree(source, folder)
        alive = not killed_at_line(n, lambda f=folder: archive(f))
        run = read(folder)
        assert run["row"].values.tolist() == list(range(run["row"].values[0], 8))
        seen.add((overview(folder).rows_in_journal, overview(folder).files, int(run["row"].values[0])))
        archive(folder)
        run = read(folder)
        assert run["row"].values.tolist() == list(range(3, 8))
        assert run.p_a.values.tobytes() == numbers(3, 5)[:, 0].tobytes()
        assert len(list((folder / "hours").glob("*.parquet"))) == overview(folder).files == 2
        assert len(read_events(folder, kinds=["removed"])) == 1
        assert check(folder) == []
        shutil.rmtree(folder)
        n += every
    assert n > 100
    assert len(seen) >= 4  # nothing written, one hour, two, three, and the oldest gone


@pytest.mark.parametrize("every", [SPACED, pytest.param(CLOSE, marks=pytest.mark.thorough)])
def test_a_writer_may_be_killed_at_any_line_of_its_code(tmp_path: Path, every: int):
    def work(folder: Path) -> None:
        with History(folder, COLUMNS) as history:
            history.append(START + np.arange(3.0), numbers(1, 3), states={"twin": b"one"})
            history.append(START + HOUR + np.arange(3.0), numbers(4, 3), states={"twin": b"two"})

    n, alive, seen = 1, False, set()
    while not alive:
        folder = tmp_path / f"{n}"
        alive = not killed_at_line(n, lambda f=folder: work(f))
        with History(folder, COLUMNS) as history:
            last, state = history.last_row, history.last_state("twin")
            seen.add(last)
            assert (None if state is None else state[::2]) == {0: None, 3: (3, b"one"), 6: (6, b"two")}[last]
            history.append(START + 2.0 * HOUR, numbers(last + 1, 1))
        assert assert_whole(folder, last) == last + 1
        assert not list(folder.glob(".*"))
        shutil.rmtree(folder)
        n += every
    assert seen == {0, 3, 6}
