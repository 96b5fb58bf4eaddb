"""Why a cycle was late, and the second thread that takes it where the first one is held up."""

from __future__ import annotations

import math
import multiprocessing
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

import stillhook
from stillhook.live.runtime import STATUS, Task
from stillhook.live.runtime.board import Board
from stillhook.live.runtime.causes import Cause, Mark, Watch
from stillhook.live.runtime.deadlines import Deadlines, two_shares
from stillhook.live.runtime.doctor import throttled_time
from stillhook.live.runtime.kernel import BEHIND, LATE, PARENT_EVERY, Kernel
from stillhook.live.runtime.sink import Event

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc")
LATER = 8.0e-3
"""Of a cycle that is late [s]."""
pytestmark = pytest.mark.slow


@pytest.fixture
def kernel() -> Iterator[Kernel]:
    board = Board()
    yield Kernel(Task(CRANE, CASE, real_time=False), board)
    board.close()


def numbers(kernel: Kernel, name: str) -> list[float]:
    return [row[kernel.names.index(name)] for row in kernel.board.rows.since(0)[1]]


@pytest.mark.parametrize(
    ("over", "now", "cause"),
    [
        (False, Mark(0.6 * LATER, 0), Cause.PROCESSOR),
        (False, Mark(0.4 * LATER, 0), Cause.TIMER),
        (False, Mark(0.0, 1), Cause.PAGES),
        (True, Mark(0.0, 0), Cause.CYCLE),
    ],
)
def test_a_thread_tells_what_it_waited_for(over: bool, now: Mark, cause: Cause, monkeypatch: pytest.MonkeyPatch):
    watch = Watch()
    monkeypatch.setattr(watch, "_mark", lambda: Mark(0.0, 0))
    watch.begin(False)
    watch.begin(over)
    monkeypatch.setattr(watch, "_mark", lambda: now)
    assert watch.look(LATER) is cause
    watch.close()


@pytest.mark.parametrize(
    ("seen", "stolen", "told"),
    [
        ([Cause.TIMER, Cause.CYCLE], True, [Cause.HOST, Cause.HOST]),
        ([Cause.TIMER, Cause.CYCLE], False, [Cause.TIMER, Cause.TIMER]),
        ([Cause.PAGES, Cause.CYCLE], True, [Cause.PAGES, Cause.HOST]),
        ([Cause.PROCESSOR, Cause.CYCLE, Cause.CYCLE], False, 3 * [Cause.PROCESSOR]),
        ([Cause.CYCLE, Cause.CYCLE], False, [Cause.CYCLE, Cause.CYCLE]),
    ],
)
def test_a_row_has_the_cause_of_the_late_cycle_before_it(
    kernel: Kernel, seen: list[Cause], stolen: bool, told: list[Cause]
):
    """And cycles that are late because of a late one have its cause."""
    kernel._stolen = SimpleNamespace(more=lambda: stolen, close=lambda: None)
    clock = SimpleNamespace(at=lambda n: 100.0 + 0.01 * n, lateness=lambda n: LATER)
    for n, cause in enumerate([*seen, Cause.NONE, Cause.NONE]):
        watch = SimpleNamespace(look=lambda lateness, cause=cause: cause)
        lateness = LATER if cause else 0.0
        clock.lateness = lambda n, of=lateness: of
        kernel._due(n, clock, watch)
    assert numbers(kernel, "late_cause") == [0.0, *told, 0.0]
    (event,) = [Event.from_json(each) for each in kernel.board.events.records(0)[1]]
    assert event.text == f"1 late cycles, the latest by 8.0 ms: {told[0].text}."


def test_the_meaning_of_the_causes_is_that_of_their_numbers():
    meaning = STATUS["late_cause"].meaning
    assert [int(each.split()[0]) for each in meaning.partition(": ")[2].split(", ")] == list(Cause)


class Held(Deadlines):
    """Deadlines at which the first thread is held up at one cycle until the second one has begun it."""

    def __init__(self, at: int) -> None:
        super().__init__(0.01)
        self.held, self.passed = at, threading.Event()

    def wait(self, n: int, behind: float = 0.0) -> float:
        lateness = super().wait(n, behind)
        if n == self.held and not behind:
            assert self.passed.wait(30.0)
        return lateness


@pytest.mark.skipif(not two_shares(), reason="one processor, or a system that lets nobody choose")
def test_a_second_thread_takes_a_cycle_whose_first_one_is_held_up(kernel: Kernel, monkeypatch: pytest.MonkeyPatch):
    held, by, due = Held(5), [], kernel._due

    def noted(n: int, deadlines: Deadlines, watch: Watch) -> None:
        by.append(threading.current_thread())
        due(n, deadlines, watch)
        if n == held.held + 3:
            held.passed.set()
        if n == 20:
            kernel.board.stop()

    monkeypatch.setattr(kernel, "_due", noted)
    monkeypatch.setattr("os.sched_setaffinity", lambda pid, processors: None)
    kernel._run_loops(held, two_shares())
    assert numbers(kernel, "cycle_number") == list(range(21))
    assert threading.main_thread() not in by[5:9]
    assert numbers(kernel, "time") == pytest.approx([0.01 * (n + 1) for n in range(21)])


@pytest.mark.skipif(not two_shares(), reason="one processor, or a system that lets nobody choose")
@pytest.mark.parametrize("of_main", [True, False])
def test_an_error_of_either_thread_ends_the_kernel_with_it(
    kernel: Kernel, of_main: bool, monkeypatch: pytest.MonkeyPatch
):
    def broken(n: int, deadlines: Deadlines, watch: Watch) -> None:
        if (threading.current_thread() is threading.main_thread()) == of_main:
            raise ZeroDivisionError
        kernel._n += 1

    monkeypatch.setattr(kernel, "_due", broken)
    monkeypatch.setattr("os.sched_setaffinity", lambda pid, processors: None)
    deadlines = Deadlines(0.01)
    if not of_main:
        wait = deadlines.wait
        monkeypatch.setattr(deadlines, "wait", lambda n, behind=0.0: wait(n, behind if behind else 10 * BEHIND))
    with pytest.raises(ZeroDivisionError):
        kernel._run_loops(deadlines, two_shares())
    assert not kernel.board.stopping


def test_a_kernel_whose_servers_died_before_it_was_ready_ends(kernel: Kernel, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: SimpleNamespace(is_alive=lambda: False))
    kernel._loop(SimpleNamespace(at=lambda n: 100.0, lateness=lambda n: 0.0, wait=lambda n, behind: 0.0))
    assert kernel._n == PARENT_EVERY
    assert not kernel.board.stopping


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="memory is held on Linux alone")
def test_memory_is_held_where_it_is_said_to_be():
    code = "from stillhook.live.runtime.memory import hold; print(hold()); print(open('/proc/self/status').read())"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    locked = int(out.split("VmLck:")[1].split()[0])
    assert (locked > 0) == out.startswith("Its memory is held.")
    assert locked > 0 or "memlock" in out.splitlines()[0]


@pytest.mark.parametrize(
    ("group", "folder", "counts", "expected"),
    [
        ("0::/twin\n", "sys/fs/cgroup/twin", "nr_throttled 3\nthrottled_usec 250000\n", 0.25),
        ("4:cpu,cpuacct:/a/b\n0::/\n", "sys/fs/cgroup/cpu/a/b", "throttled_time 2000000000\n", 2.0),
        ("0::/twin\n", "elsewhere", "throttled_usec 1\n", math.nan),
    ],
)
def test_the_doctor_reads_what_a_limit_of_a_group_took(
    group: str, folder: str, counts: str, expected: float, tmp_path: Path
):
    for path, text in (("proc/self/cgroup", group), (f"{folder}/cpu.stat", counts)):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    assert throttled_time(tmp_path) == pytest.approx(expected, nan_ok=True)


def test_lateness_that_is_none_has_no_cause(kernel: Kernel):
    watch = SimpleNamespace(look=lambda lateness: pytest.fail("asked for a cause"))
    kernel._due(0, SimpleNamespace(at=lambda n: 100.0, lateness=lambda n: 0.9 * LATE), watch)
    assert kernel._cause is Cause.NONE
