"""The twin's state: on the disk before it counts, in file and journal, and the newer of both goes on."""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.live.histories import START

import stillhook
from stillhook.errors import LiveError, SimulationError
from stillhook.live.history import HistorySink, read
from stillhook.live.runtime import EventLog, LiveTwin, Task, event
from stillhook.live.runtime import sink as sink_module
from stillhook.live.runtime import state as state_module
from stillhook.live.runtime import twin as twin_module
from stillhook.live.runtime.board import Board
from stillhook.live.runtime.kernel import Kernel
from stillhook.live.runtime.sink import LONGEST
from stillhook.live.runtime.state import LiveState, lock_state, newest_state, write_state
from stillhook.live.runtime.twin import RESTARTS, WITHIN

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc")
NAMES = ("time_utc", "e_c")
pytestmark = pytest.mark.slow


def state_of(cycles: int, number: int) -> bytes:
    session = stillhook.Session(CRANE, CASE)
    session.step(cycles=cycles)
    return LiveState(session.save(), {"v_op": (0.5, 0.2)}, number).to_bytes()


OLDER, NEWER = state_of(100, 5), state_of(200, 9)


@pytest.fixture
def board() -> Iterator[Board]:
    made = Board()
    yield made
    made.close()


@pytest.mark.parametrize(("in_file", "handed"), [(OLDER, NEWER), (NEWER, OLDER), (NEWER, None)])
def test_the_state_with_the_higher_number_goes_on_wherever_it_is(
    in_file: bytes, handed: bytes | None, board: Board, tmp_path: Path
):
    path = tmp_path / "state.bin"
    write_state(path, in_file)
    if handed is not None:
        board.states.add(handed)
    kernel = Kernel(Task(CRANE, CASE, state=path), board)
    assert kernel._resumed() == LiveState.from_bytes(NEWER)
    assert kernel.session.time == pytest.approx(2.0)
    assert LiveState.from_bytes(kernel._state(100.0)).number == 10


def test_without_its_file_a_twin_begins_anew_and_its_states_count_on(board: Board, tmp_path: Path):
    board.states.add(NEWER)
    kernel = Kernel(Task(CRANE, CASE, state=tmp_path / "state.bin"), board)
    assert kernel._resumed() is None
    assert kernel.session.time == 0.0
    assert LiveState.from_bytes(kernel._state(100.0)).number == 10


def test_a_damaged_file_gives_way_to_the_journal_and_that_is_an_event(board: Board, tmp_path: Path):
    path = tmp_path / "state.bin"
    path.write_bytes(NEWER[:-1])
    board.states.add(OLDER)
    kernel = Kernel(Task(CRANE, CASE, state=path), board)
    assert kernel._resumed() == LiveState.from_bytes(OLDER)
    ((line,),) = (board.events.records(0)[1],)
    assert b"damaged-state" in line
    assert str(path).encode() in line


def test_states_that_are_all_damaged_are_refused_in_one_line(tmp_path: Path):
    path = tmp_path / "state.bin"
    path.write_bytes(NEWER[:-1])
    with pytest.raises(LiveError, match="move the file away") as problem:
        newest_state(path, OLDER[:-1])
    assert str(problem.value).startswith(str(path))
    assert "\n" not in str(problem.value)


def test_two_twins_never_go_on_from_one_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(state_module, "PATIENCE", 0.1)
    path = tmp_path / "state.bin"
    held = lock_state(path)
    with pytest.raises(LiveError, match="another twin continues from it"):
        lock_state(path)
    held.close()
    lock_state(path).close()


def test_a_folder_that_takes_no_state_is_refused_in_one_line_before_the_first_cycle(board: Board, tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(SimulationError, match="cannot be written") as problem:
        Kernel(Task(CRANE, CASE, state=tmp_path / "file" / "state.bin"), board).run()
    assert "\n" not in str(problem.value)
    assert board.rows.count == 0


def test_a_state_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path, order = tmp_path / "state.bin", []
    fsync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: order.append("disk") or fsync(handle))
    monkeypatch.setattr(os, "replace", lambda *names: order.append("name") or replace(*names))
    write_state(path, OLDER)
    assert order == ["disk", "name"] + (["disk"] if os.name != "nt" else [])
    assert path.read_bytes() == OLDER


class Keeper:
    """Keeps states in memory."""

    def __init__(self) -> None:
        self.kept: list[bytes] = []

    def save_state(self, data: bytes) -> None:
        self.kept.append(data)

    def last_state(self) -> bytes | None:
        return self.kept[-1] if self.kept else None


def test_a_disk_that_takes_no_state_is_one_event_and_the_twin_goes_on(tmp_path: Path):
    (tmp_path / "file").touch()
    keeper = Keeper()
    twin = LiveTwin(Task(CRANE, CASE, state=tmp_path / "file" / "state.bin"), (), keeper)
    for data in (OLDER, NEWER):
        twin._board.states.add(data)
        twin._save()
    assert [each.name for each in twin.events] == ["state-not-saved"]
    assert keeper.kept == [OLDER, NEWER]
    twin._board.close()


def rows(first: int, n: int) -> list[np.ndarray]:
    return [np.array([START + k, np.sin(k)]) for k in range(first, first + n)]


def test_a_journal_has_a_state_with_the_rows_before_it_and_gives_back_the_newest(tmp_path: Path):
    sink = HistorySink(tmp_path, every=1)
    sink.save_state(OLDER)  # before the first row: there with it
    assert sink.last_state() is None
    sink.rows(0, NAMES, rows(0, 5))
    assert HistorySink(tmp_path).last_state() == OLDER
    sink.rows(5, NAMES, rows(5, 2))
    assert read(tmp_path).sizes["time"] == 5  # a second is not over
    sink.save_state(NEWER)
    assert read(tmp_path).sizes["time"] == 7
    sink.close()
    assert HistorySink(tmp_path).last_state() == NEWER


def test_a_damaged_state_in_the_journal_gives_way_to_the_one_before_it(tmp_path: Path):
    sink = HistorySink(tmp_path, every=1)
    sink.rows(0, NAMES, rows(0, 1))
    sink.save_state(OLDER)
    sink.save_state(NEWER)
    sink.close()
    with closing(sqlite3.connect(tmp_path / "journal.sqlite")) as journal, journal:
        journal.execute("UPDATE states SET data = ? WHERE data = ?", (NEWER[:-1], NEWER))
    assert HistorySink(tmp_path).last_state() == OLDER


def test_a_kernel_that_dies_too_often_is_not_started_again_but_one_that_dies_once_a_month_is(
    monkeypatch: pytest.MonkeyPatch,
):
    twin, now = LiveTwin(Task(CRANE, CASE)), [0.0]
    twin._process = SimpleNamespace(exitcode=-9)
    monkeypatch.setattr(twin, "_start", lambda: None)
    monkeypatch.setattr(twin_module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    for _ in range(3 * RESTARTS):
        now[0] += 1.01 * WITHIN / RESTARTS
        twin._restart()
    assert [each.name for each in twin.events] == 3 * RESTARTS * ["kernel-died"]
    now[0] += 2.0 * WITHIN
    for _ in range(RESTARTS):
        twin._restart()
    with pytest.raises(LiveError, match="ended 6 times within 3600 s, last with -9"):
        twin._restart()
    twin._board.close()


def test_files_of_events_are_bounded_and_the_newest_events_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sink_module, "FULL", 1000)
    path = tmp_path / "events.jsonl"
    log = EventLog(path)
    for i in range(100):
        log.event(event("opcua", "refused-write", f"number {i}", float(i)))
    log.close()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["events.1.jsonl", "events.jsonl"]
    lines = [json.loads(each) for p in sorted(tmp_path.iterdir()) for each in p.read_text().splitlines()]
    assert [row["value"] for row in lines] == [float(i) for i in range(100 - len(lines), 100)]
    assert all(p.stat().st_size < 1000 + LONGEST for p in tmp_path.iterdir())


def test_a_file_of_events_begins_with_the_first_event(tmp_path: Path):
    log = EventLog(tmp_path / "events.jsonl")
    log.event(event("twin", "serving", "Servers are ready."))
    log.close()
    (line,) = (tmp_path / "events.jsonl").read_text(encoding="utf-8").splitlines()
    assert json.loads(line)["name"] == "serving"
