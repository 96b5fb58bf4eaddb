"""State of a twin on the disk: there from before the first cycle on, and newer at the end."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.live.plants import CASE, CRANE

from stillhook.live.runtime import Task
from stillhook.live.runtime import kernel as module
from stillhook.live.runtime.board import Board
from stillhook.live.runtime.kernel import Kernel
from stillhook.live.runtime.state import LiveState

pytestmark = pytest.mark.slow
CYCLES = 3


@pytest.fixture
def board(monkeypatch: pytest.MonkeyPatch) -> Iterator[Board]:
    monkeypatch.setattr(module.memory, "hold", lambda: "")  # of the process that runs the tests
    made = Board()
    yield made
    made.close()


def run(board: Board, state: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[bytes | None, Kernel]:
    """A twin that stops by itself: its file as its first cycle begins, and the kernel."""
    kernel = Kernel(Task(CRANE, CASE, state=state, real_time=False, cycles=CYCLES), board)
    before: list[bytes | None] = []
    loops = kernel._run_loops

    def look(*arguments: object) -> None:
        before.append(state.read_bytes() if state.exists() else None)
        loops(*arguments)

    monkeypatch.setattr(kernel, "_run_loops", look)
    kernel.run()
    kernel._lock.close()  # as the end of its process does
    return before[0], kernel


def test_a_new_twin_writes_its_state_before_its_first_cycle_and_at_its_end(
    board: Board, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A process that is killed at once leaves a state to continue from."""
    state = tmp_path / "state.bin"
    first, kernel = run(board, state, monkeypatch)
    assert first is not None
    (tmp_path / "first.bin").write_bytes(first)
    begun, ended = LiveState.from_bytes(tmp_path / "first.bin"), LiveState.from_bytes(state)
    assert kernel.session.time == pytest.approx(CYCLES * kernel.session.cycle)
    assert ended.session == kernel.session.save()
    assert begun.session != ended.session
    assert ended.number > begun.number


def test_a_twin_that_goes_on_leaves_its_file_alone_until_it_has_something_newer(
    board: Board, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    state = tmp_path / "state.bin"
    run(board, state, monkeypatch)
    left = state.read_bytes()
    again = Board()
    try:
        found, kernel = run(again, state, monkeypatch)
    finally:
        again.close()
    assert found == left
    assert kernel.session.time == pytest.approx(2 * CYCLES * kernel.session.cycle)


def test_a_twin_without_a_file_runs_as_well(board: Board, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(Task(CRANE, CASE, real_time=False, cycles=CYCLES), board)
    kernel.run()
    assert board.rows.count == CYCLES
