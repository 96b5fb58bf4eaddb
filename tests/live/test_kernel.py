"""The kernel's process: absolute deadlines, counted late cycles, a saved state that goes on with the same bits."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import stillhook
from stillhook.errors import LiveError
from stillhook.live.runtime import Flag, LiveTwin, Task
from stillhook.live.runtime.board import Board
from stillhook.live.runtime.kernel import CATCH_UP, LATE, SAVE_EVERY, Kernel
from stillhook.live.runtime.state import LiveState

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc")
CYCLE = CRANE.control.t_cycle
HALT = 0.3
"""Time for which the kernel's process is halted [s]."""
pytestmark = pytest.mark.slow


class Clock:
    """Deadlines that come when the test says so: no time passes here, `late` is what each wake-up is late by [s]."""

    def __init__(self, late: list[float]) -> None:
        self.late = late

    def at(self, n: int) -> float:
        return 100.0 + n * CYCLE

    def lateness(self, n: int) -> float:
        return 0.0


@pytest.fixture(scope="module")
def board() -> Iterator[Board]:
    made = Board()
    yield made
    made.close()


@pytest.fixture(scope="module")
def kernel(board: Board) -> Kernel:
    return Kernel(Task(CRANE, CASE), board)


def rows_of(kernel: Kernel, number: int) -> list[dict[str, float]]:
    first = kernel.board.rows.count - number
    found = [kernel.board.rows.at(first + i) for i in range(number)]
    return [dict(zip(kernel.names, row.tolist(), strict=False)) for row in found]


def test_a_late_cycle_is_counted_with_its_size_and_no_cycle_is_left_out(kernel: Kernel):
    late = [0.0, 0.5 * LATE, 7.0e-3, 1.0e-4]
    begin, time_before = kernel.late, kernel.session.time
    for n, each in enumerate(late):
        kernel._cycle(n, Clock(late), each)
    rows = rows_of(kernel, len(late))
    assert [row["late_cycles"] - begin for row in rows] == [0.0, 0.0, 1.0, 1.0]
    assert [bool(int(row["cycle_flags"]) & Flag.LATE) for row in rows] == [False, False, True, False]
    assert [row["lateness"] for row in rows] == late
    assert rows[-1]["worst_lateness"] == max(late)
    assert [row["time"] for row in rows] == pytest.approx([time_before + (i + 1) * CYCLE for i in range(len(late))])


def test_every_signal_of_the_winch_is_in_the_row(kernel: Kernel):
    kernel._cycle(0, Clock([]), 0.0)
    (row,) = rows_of(kernel, 1)
    assert {name: row[name] for name in kernel.session.signals} == {
        name: kernel.session.get(name) for name in kernel.session.signals
    }


def test_an_input_that_the_winch_does_not_take_is_refused_and_counted(kernel: Kernel):
    from stillhook.live.runtime.inputs import InputWriter

    writer = InputWriter(kernel.board.inputs, kernel._input_names)
    before = kernel.refused
    writer.write({"K_p": 1.0e9, "mode": 77.0, "s_tip": 5.0e5, "v_tip": 0.0, "a_tip": 0.0}, 100.0)
    kernel._cycle(0, Clock([]), 0.0)
    assert kernel.refused == before + 3
    assert rows_of(kernel, 1)[0]["cycle_flags"] >= Flag.REFUSED
    writer.write({"K_p": 0.3, "mode": 3.0}, 100.01)
    kernel._cycle(1, Clock([]), 0.0)
    (row,) = rows_of(kernel, 1)
    assert (row["K_p"], row["mode"], kernel.refused) == (0.3, 3.0, before + 3)


def test_a_state_that_is_no_number_goes_back_to_the_last_good_one(kernel: Kernel):
    kernel._kept = kernel.session.keep()
    at = kernel.session.time
    kernel.session._A[kernel.session._names.index(".x.winch.p_a")] = float("nan")
    kernel._cycle(0, Clock([]), 0.0)
    kernel._cycle(1, Clock([]), 0.0)
    row = rows_of(kernel, 1)[0]
    assert row["time"] == pytest.approx(at + CYCLE)
    assert all(abs(row[name]) < float("inf") for name in kernel.session.signals)


class Ran(NamedTuple):
    """A twin that ran: time of the winch at its end [s], and all of its rows."""

    end: float
    rows: list[dict[str, float]]


def test_a_fault_that_comes_back_ends_at_the_state_of_the_start(kernel: Kernel):
    kernel._was_reset = False
    kernel._kept = kernel.session.keep()
    kept, broken = kernel.session.time, kernel.session._names.index(".x.winch.p_a")
    for time_after in (kept, 0.0):
        kernel.session._A[broken] = float("nan")
        kernel._cycle(0, Clock([]), 0.0)
        assert rows_of(kernel, 1)[0]["time"] == pytest.approx(time_after)


@pytest.mark.thorough
def test_a_kernel_that_was_killed_goes_on_from_its_newest_state(tmp_path: Path):
    with LiveTwin(Task(CRANE, CASE, state=tmp_path / "state.bin")) as twin:
        wait_for_row(twin, 130)
        twin.pump()
        before = twin.latest().values["time"]
        os.kill(twin.pid, signal.SIGKILL)
        while twin.alive:
            time.sleep(0.01)
        twin.pump()
        count = twin.latest().number
        wait_for_row(twin, count + 5)
        twin.pump()
        _, rows, _ = twin._board.rows.since(count + 1)
        first = dict(zip(twin.names, rows[0].tolist(), strict=False))
        assert before - SAVE_EVERY - 0.1 < first["time"] <= before + 1.0
        assert [e.name for e in twin.events if e.source == "twin"] == ["kernel-died"]


@pytest.fixture(scope="module")
def resumed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Ran, Ran]:
    """A twin that was stopped by SIGTERM, started again, halted for a while, and stopped: file of its state."""
    state = tmp_path_factory.mktemp("twin") / "state.bin"
    ran = [run_twin(Task(CRANE, CASE, state=state), halted) for halted in (False, True)]
    return state, *ran


def run_twin(task: Task, halted: bool) -> Ran:
    with LiveTwin(task) as twin:
        wait_for_row(twin, 10)
        if halted:
            os.kill(twin.pid, signal.SIGSTOP)
            time.sleep(HALT)
            os.kill(twin.pid, signal.SIGCONT)
            wait_for_row(twin, twin.latest().number + round(2.0 * HALT / CYCLE))
        os.kill(twin.pid, signal.SIGTERM)
        while twin.alive:
            time.sleep(0.01)
        _, rows, lost = twin._board.rows.since(0)
        assert lost == 0
        twin.pump()
        assert not twin.alive
        table = [dict(zip(twin.names, row.tolist(), strict=False)) for row in rows]
    return Ran(table[-1]["time"], table)


def wait_for_row(twin: LiveTwin, number: int) -> None:
    while (row := twin.latest()) is None or row.number < number:
        time.sleep(0.01)


@pytest.mark.long
def test_a_stopped_twin_goes_on_with_the_same_bits(resumed: tuple[Path, Ran, Ran]):
    state, first, second = resumed
    session = stillhook.Session(CRANE, CASE)
    session.step(cycles=round(second.end / CYCLE))
    assert LiveState.from_bytes(state).session == session.save()
    assert second.rows[0]["time"] == pytest.approx(first.end + CYCLE)


def test_a_stall_is_made_up_for_and_its_cycles_are_marked(resumed: tuple[Path, Ran, Ran]):
    """Numbers of cycles go on without a hole, the size is counted, and the clock is that of the wall again."""
    rows = resumed[2].rows
    assert HALT < CATCH_UP
    assert [row["cycle_number"] for row in rows] == list(range(len(rows)))
    worst = max(row["lateness"] for row in rows)
    assert HALT - 2.0 * CYCLE < worst < 2.0 * HALT
    assert rows[-1]["worst_lateness"] == worst
    assert rows[-1]["late_cycles"] == sum(row["lateness"] > LATE for row in rows) >= round(0.5 * HALT / CYCLE)
    assert rows[-1]["missed_cycles"] == 0.0
    assert rows[-1]["lateness"] < 0.5 * HALT
    marked = [bool(int(row["cycle_flags"]) & Flag.LATE) for row in rows]
    assert marked == [row["lateness"] > LATE for row in rows]


def test_a_state_of_another_crane_or_a_damaged_one_is_refused_in_one_line(
    resumed: tuple[Path, Ran, Ran], board: Board, tmp_path: Path
):
    data = bytearray(resumed[0].read_bytes())
    data[len(data) // 2] ^= 1
    damaged = tmp_path / "state.bin"
    damaged.write_bytes(data)
    other = CASE.model_copy(update={"load": 50_000.0})
    for task, text in (
        (Task(CRANE, CASE, state=damaged), "damaged or not complete"),
        (Task(CRANE, other, state=resumed[0]), "of another crane, scenario, step or version"),
    ):
        with pytest.raises(LiveError, match=text) as problem:
            Kernel(task, board)._resumed()
        assert str(problem.value).startswith(str(task.state))
        assert "move the file away" in str(problem.value)
        assert "\n" not in str(problem.value)
