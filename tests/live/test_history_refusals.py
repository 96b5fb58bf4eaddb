"""What a history refuses, in one line, and what it bears: damage, a full disk, a second writer, another version."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.live.histories import COLUMNS, HOUR, START, numbers, write_hours

from stillhook.base.variable import Variable
from stillhook.errors import StillhookError
from stillhook.live.history import Budget, Event, EventKind, History, archive, check, overview, read, read_events, save

pytestmark = pytest.mark.slow  # each waits for the disk several times

OWN = Variable("c_f", "c_f", "1", "", "", "scale", "")


def refused(call: Callable[[], object]) -> str:
    """The one line of a refusal."""
    with pytest.raises(StillhookError) as problem:
        call()
    text = str(problem.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("columns", "line"),
    [
        ([], "0 columns: give 1 to 2000."),
        (["p_a", "p_q"], 'column "p_q" is not a variable of Stillhook.'),
        (["p_a", "p_a"], "p_a is given twice."),
        (["p_a", OWN._replace(name="P_a")], "p_a and P_a differ in capitals alone."),
        ([OWN._replace(name="p_a")], 'p_a is in Pa, and was given in "1". Give it in SI.'),
        ([OWN._replace(name="row")], 'column "row": a name is a letter'),
        ([OWN._replace(name='x"; DROP TABLE hours; --')], "a name is a letter"),
        ([OWN._replace(name="ü")], "a name is a letter"),
        (["status"], 'column "status": a name is a letter'),
        ([OWN._replace(unit="")], "c_f has no unit that can be stored."),
        ([OWN._replace(unit='m] "x')], "c_f has no unit that can be stored."),
        ([3], "column 3: give a name, or a Variable."),
        ([OWN._replace(name=f"x_{k}") for k in range(2001)], "2001 columns: give 1 to 2000."),
    ],
)
def test_columns_that_cannot_be_stored_are_refused_before_anything_is_made(tmp_path: Path, columns: list, line: str):
    assert line in refused(lambda: History(tmp_path / "h", columns))
    assert not (tmp_path / "h").exists()


@pytest.mark.parametrize(
    ("time_of", "values", "status", "line"),
    [
        (np.nan, [[1.0, 2.0, 3.0]], 0, "time = nan: give UTC in seconds since 1970."),
        (START * 1e3, [[1.0, 2.0, 3.0]], 0, "time = 1.79587e+12: give UTC in seconds since 1970."),
        (-1.0, [[1.0, 2.0, 3.0]], 0, "time = -1: give UTC"),
        ([START, np.inf], np.ones((2, 3)), 0, "time = inf: give UTC"),
        (START, [1.0, 2.0, 3.0], 0, "3 values: give 1 rows of 3 columns."),
        (START, [[1.0, 2.0]], 0, "1 x 2 values: give 1 rows of 3 columns."),
        ([START, START], [[1.0, 2.0, 3.0]], 0, "1 x 3 values: give 2 rows of 3 columns."),
        (START, [["a", "b", "c"]], 0, "rows cannot be stored (could not convert string to float"),
        (START, [[1.0, 2.0, 3.0]], -1, "status = -1: give a whole number from 0"),
        (START, [[1.0, 2.0, 3.0]], 0.5, "status = 0.5: give a whole number from 0"),
        (START, [[1.0, 2.0, 3.0]], np.nan, "status = nan: give a whole number from 0"),
        (START, [[1.0, 2.0, 3.0]], [0, 1], "rows cannot be stored"),
        (np.full(100_001, START), np.ones((100_001, 3)), 0, "100001 rows at once: give at most 100000."),
    ],
)
def test_rows_that_are_none_are_refused_and_nothing_is_stored(tmp_path: Path, time_of, values, status, line: str):
    with History(tmp_path, COLUMNS) as history:
        history.append(START, numbers(1, 1))
        assert line in refused(lambda: history.append(time_of, values, status))
        assert history.append(START, numbers(2, 1)) == 2
    assert read(tmp_path)["row"].values.tolist() == [1, 2]


def test_a_batch_with_a_wrong_event_or_state_is_refused_as_a_whole(tmp_path: Path):
    endless: dict = {}
    endless["self"] = endless
    with History(tmp_path, COLUMNS) as history:
        for events, states, line in (
            ([Event("siren", "x")], {}, 'event: kind = "siren": choose one of alarm, command'),
            ([Event(EventKind.ALARM, "x", {}, np.nan)], {}, "give UTC such as"),
            ([Event(EventKind.ALARM, "x", endless)], {}, "its data cannot be stored"),
            ((), {"../twin": b""}, 'saved state "../twin": a name is a letter'),
            ((), {"twin": "text"}, "saved state twin: give bytes, at most 64 MB."),
        ):
            call = lambda e=events, s=states: history.append(START, numbers(1, 1), events=e, states=s)
            assert line in refused(call)
        assert history.last_row == 0
        assert history.append(START, numbers(1, 1)) == 1
    assert len(read(tmp_path).row) == 1


@pytest.mark.long
def test_a_second_writer_is_refused_and_the_lock_ends_with_the_process(tmp_path: Path):
    with History(tmp_path, COLUMNS) as history:
        history.append(START, numbers(1, 1))
        line = refused(lambda: History(tmp_path, COLUMNS))
        assert f"process {os.getpid()} on " in line
        assert line.endswith("Stop it, or choose another folder.")
        code = "import sys; from stillhook.live.history import History; History(sys.argv[1], ['p_a'])"
        other = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False)
        assert "one line" not in other.stderr
        assert f"LiveError: {line}" in other.stderr
        assert overview(tmp_path).written
        assert history.append(START + 1.0, numbers(2, 1)) == 2
    assert not overview(tmp_path).written
    holder = subprocess.Popen(
        [sys.executable, "-c", f"{code}; print(1, flush=True); input()", str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert holder.stdout.readline() == "1\n"
    assert f"process {holder.pid} on " in refused(lambda: History(tmp_path, COLUMNS))
    holder.kill()
    holder.communicate()
    with History(tmp_path, COLUMNS) as history:
        assert history.last_row == 2


def test_a_second_archiver_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_hours(tmp_path, hours=1.5)
    lines = []
    monkeypatch.setattr(
        "stillhook.live.history.hours._archive_run", lambda *of: lines.append(refused(lambda: archive(tmp_path))) or []
    )
    archive(tmp_path)
    assert lines == [f"{tmp_path}: another process archives it. Wait until it is done."]


def test_a_history_is_refused_after_a_fork_and_after_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    history = History(tmp_path, COLUMNS)
    own = os.getpid()
    monkeypatch.setattr("os.getpid", lambda: own + 1)
    assert f"opened by process {own}. Open it in the process that writes." in refused(
        lambda: history.append(START, numbers(1, 1))
    )
    history.close()  # a child closes nothing
    monkeypatch.undo()
    assert history.append(START, numbers(1, 1)) == 1
    history.close()
    history.close()
    assert refused(lambda: history.append(START, numbers(2, 1))) == f"{tmp_path}: closed. Open it again."


def test_a_unit_that_changes_is_refused(tmp_path: Path):
    with History(tmp_path, [OWN._replace(unit="m")]):
        pass
    line = "c_f in s is stored as c_f in m. Choose another name."
    assert line in refused(lambda: History(tmp_path, [OWN._replace(unit="s")]))
    assert "C_f in m is stored as c_f in m" in refused(lambda: History(tmp_path, [OWN._replace(name="C_f", unit="m")]))
    with History(tmp_path, COLUMNS) as history:
        assert history.last_row == 0


@pytest.mark.parametrize("budget", [Budget(bytes=0), Budget(days=-1.0), Budget(days=np.nan), Budget(events=0)])
def test_a_budget_that_nothing_fits_into_is_refused(tmp_path: Path, budget: Budget):
    assert "give a number above 0, or None" in refused(lambda: History(tmp_path / "h", COLUMNS, budget=budget))
    assert not (tmp_path / "h").exists()


# Journals that are none


def test_a_journal_of_another_version_is_refused_and_left_alone(tmp_path: Path):
    write_hours(tmp_path, hours=0.1)
    with sqlite3.connect(tmp_path / "journal.sqlite") as connection:
        connection.execute("PRAGMA user_version = 7")
    connection.close()
    line = "version 7, and this Stillhook reads 1. Use the Stillhook that wrote it, or another folder."
    for call in (lambda: History(tmp_path, COLUMNS), lambda: read(tmp_path), lambda: archive(tmp_path)):
        assert line in refused(call)


@pytest.mark.parametrize("content", [b"", b"not a database at all" * 400, None])
def test_another_file_in_its_place_is_refused_and_left_alone(tmp_path: Path, content: bytes | None):
    journal = tmp_path / "journal.sqlite"
    if content is None:
        with sqlite3.connect(journal) as connection:
            connection.execute("CREATE TABLE own (x)")
        connection.close()
    else:
        journal.write_bytes(content)
    before = journal.read_bytes()
    for call in (lambda: History(tmp_path, COLUMNS), lambda: read(tmp_path), lambda: overview(tmp_path)):
        assert "it is not a journal of a history. Choose another folder." in refused(call)
    assert journal.read_bytes() == before


def test_a_folder_without_a_history_is_refused_and_nothing_is_made_in_it(tmp_path: Path):
    for call in (lambda: read(tmp_path), lambda: archive(tmp_path), lambda: read_events(tmp_path)):
        assert "no history is there, journal.sqlite is missing. Give the folder of a history." in refused(call)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("x")
    assert "Check the folder" in refused(lambda: History(tmp_path / "file", COLUMNS))
    assert "Check the folder" in refused(lambda: History(tmp_path / "file" / "h", COLUMNS))


def test_a_journal_cut_in_its_middle_is_one_line_and_its_files_stay_readable_elsewhere(tmp_path: Path):
    write_hours(tmp_path, hours=30.0)
    (journal := tmp_path / "journal.sqlite").write_bytes(journal.read_bytes()[: 9 * 4096])
    assert "it is damaged. Move it away, and keep the files in hours." in refused(lambda: read(tmp_path))


def test_a_bit_that_flips_in_the_journal_costs_its_batch_and_is_said(tmp_path: Path):
    write_hours(tmp_path, hours=1.5)
    with sqlite3.connect(tmp_path / "journal.sqlite") as connection:
        (data,) = connection.execute("SELECT data FROM batches WHERE first = 26").fetchone()
        flipped = bytes([data[0] ^ 1]) + data[1:]
        connection.execute("UPDATE batches SET data = ? WHERE first = 26", (flipped,))
    connection.close()
    run = read(tmp_path)
    assert run.attrs["left_out"] == "rows 26 to 50: damaged in the journal: left out"
    assert run["row"].values.tolist() == [*range(1, 26), *range(51, 91)]
    archive(tmp_path)
    assert read(tmp_path)["row"].values.tolist() == [*range(1, 26), *range(51, 91)]
    damaged = [event.text for event in read_events(tmp_path, kinds=[EventKind.DAMAGED])]
    assert damaged == ["rows 26 to 50 are damaged in the journal: left out"]


# Files that are damaged


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 4
    path.write_bytes(bytes(data))


def other(path: Path) -> None:
    path.write_bytes(b"PAR1" + bytes(path.stat().st_size - 8) + b"PAR1")


@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (cut, "bytes in place of"),
        (flip, "has another SHA-256"),
        (other, "has another SHA-256"),
        (Path.unlink, "is gone"),
    ],
)
def test_a_damaged_hour_is_left_out_and_said_and_the_others_are_read(tmp_path: Path, harm: Callable, reason: str):
    write_hours(tmp_path, hours=3.5)
    _, second, _ = archive(tmp_path)
    os.utime(second, (0, 0))
    read(tmp_path)
    harm(second)
    run = read(tmp_path)
    assert run["row"].values.tolist() == [*range(1, 61), *range(121, 211)]
    assert run.attrs["left_out"].startswith("rows 61 to 120: hours/2026-11-28T13Z-000000000061.parquet ")
    assert reason in run.attrs["left_out"]
    (line,) = check(tmp_path)
    assert reason in line
    assert refused(lambda: read(tmp_path, start="2026-11-28T13:10", end="2026-11-28T13:20")).count(reason) == 1


def test_a_file_that_was_deleted_is_an_event_once(tmp_path: Path):
    write_hours(tmp_path, hours=2.5)
    first, _ = archive(tmp_path)
    first.unlink()
    archive(tmp_path)
    archive(tmp_path)
    damaged = [event.text for event in read_events(tmp_path, kinds=[EventKind.DAMAGED])]
    assert damaged == ["hours/2026-11-28T12Z-000000000001.parquet is gone"]
    assert read(tmp_path).attrs["left_out"] == ""


def test_a_strangers_file_beside_the_hours_is_not_read(tmp_path: Path):
    write_hours(tmp_path, hours=1.5)
    (hour,) = archive(tmp_path)
    (tmp_path / "hours" / "copy.txt").write_text("mine")
    (tmp_path / "hours" / "zz.parquet").write_bytes(hour.read_bytes())
    assert read(tmp_path)["row"].values.tolist() == list(range(1, 91))
    archive(tmp_path)
    assert (tmp_path / "hours" / "copy.txt").exists()
    assert read(tmp_path)["row"].values.tolist() == list(range(1, 91))


# A full disk


FULL = """
import resource, sys
import numpy as np
from stillhook.errors import LiveError
from stillhook.live.history import History, archive
from tests.live.histories import COLUMNS, START, numbers

folder, most = sys.argv[1], int(sys.argv[2])
with History(folder, COLUMNS) as history:
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))  # a file that outgrows it: as a full disk
    lines = []
    for k in range(0, 4000, 100):
        try:
            history.append(START + 10.0 * np.arange(k, k + 100), numbers(k + 1, 100))
        except LiveError as problem:
            lines.append(str(problem))
    print(history.last_row, flush=True)
    assert lines, "nothing was full"
    assert all("what was acknowledged is safe" in line and "\\n" not in line for line in lines), lines[0]
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    first = history.last_row + 1
    history.append(START + 40000.0 + np.arange(100), numbers(first, 100))
    print(history.last_row)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limit on the size of files there")
def test_a_full_disk_is_one_line_and_the_journal_stays_right(tmp_path: Path):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path), "100000"],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    full, last = map(int, done.stdout.split())
    assert 0 < full < last < 4000
    assert last == full + 100
    run = read(tmp_path)
    assert run["row"].values.tolist() == list(range(1, last + 1))
    assert run.p_a.values.tolist() == numbers(1, last)[:, 0].tolist()


ARCHIVE_FULL = """
import resource, sys
from stillhook.errors import LiveError
from stillhook.live.history import archive

resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, resource.RLIM_INFINITY))
try:
    archive(sys.argv[1])
except LiveError as problem:
    print(problem)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limit on the size of files there")
def test_a_disk_that_is_full_while_an_hour_is_written_costs_no_row(tmp_path: Path):
    with History(tmp_path, COLUMNS) as history:
        history.append(START + np.arange(4000.0), numbers(1, 4000))
    before = read(tmp_path)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", ARCHIVE_FULL, str(tmp_path)],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    assert line.startswith(f"{tmp_path}/hours/2026-11-28T12Z-000000000001.parquet: cannot be written (")
    assert line.endswith("Free some space: its rows stay in the journal.")
    assert not list(tmp_path.glob("hours/*"))
    assert read(tmp_path).identical(before)
    assert len(archive(tmp_path)) == 1
    assert read(tmp_path).identical(before)


# Questions that cannot be answered


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ({"signals": ["p_b"]}, '"p_b" is not in this range. Choose from p_a, omega_m, F_w.'),
        ({"start": "yesterday"}, 'start = "yesterday": give UTC such as 2026-11-28T13:00, or seconds since 1970.'),
        ({"end": np.nan}, "end = "),
        ({"start": "2026-11-28T13:00", "end": "2026-11-28T12:00"}, "the end must come after the start."),
        ({"start": "2027-01-01"}, "There are rows from 2026-11-28T12:00:00Z to 2026-11-28T13:29:00Z."),
        ({"end": "1970-01-02"}, "There are rows from 2026-11-28T12:00:00Z"),
        ({"every": "0 s"}, 'every = "0 s": give a time above 0'),
        ({"every": "-1 s"}, "every"),
        ({"every": "1 m"}, "every"),
        ({"every": "1e-6 s"}, "are more than fits into memory. Choose signals, a shorter range, or a longer every."),
    ],
)
def test_a_question_that_cannot_be_answered_is_refused(tmp_path: Path, words: dict, line: str):
    write_hours(tmp_path, hours=1.5)
    assert line in refused(lambda: read(tmp_path, **words))


def test_more_than_fits_into_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_hours(tmp_path, hours=1.5)
    monkeypatch.setattr("stillhook.live.history.reading.MOST_NUMBERS", 500)
    assert "90 rows of 3 columns are more than fits into memory." in refused(lambda: read(tmp_path))
    assert len(read(tmp_path, signals=["p_a"], end=START + HOUR).row) == 60


def test_a_journal_that_was_not_archived_for_long_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_hours(tmp_path, hours=1.5)
    monkeypatch.setattr("stillhook.live.history.selection.MOST_IN_JOURNAL", 3000)
    assert "of this range are not archived. Archive them, or choose a shorter range." in refused(lambda: read(tmp_path))
    archive(tmp_path)
    assert len(read(tmp_path).row) == 90


def test_a_folder_that_may_only_be_read_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_hours(tmp_path, hours=1.5)
    archive(tmp_path)
    before = read(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    monkeypatch.setattr("os.access", lambda *of: False)
    assert read(tmp_path).identical(before)
    assert overview(tmp_path).written is None
    assert {path.name for path in tmp_path.iterdir()} == names


def test_looking_at_a_history_keeps_no_writer_out(tmp_path: Path):
    write_hours(tmp_path, hours=0.1)
    stop = threading.Event()

    def look() -> None:
        while not stop.is_set():
            overview(tmp_path)

    thread = threading.Thread(target=look)
    thread.start()
    try:
        for _ in range(30):
            with History(tmp_path, COLUMNS):
                pass
    finally:
        stop.set()
        thread.join()


def test_a_file_that_cannot_be_written_out_is_refused(tmp_path: Path):
    write_hours(tmp_path / "h", hours=0.1)
    run = read(tmp_path / "h")
    assert '".xyz" is not an ending of a format' in refused(lambda: save(run, tmp_path / "out.xyz"))
    assert "cannot be written" in refused(lambda: save(run, tmp_path / "h" / "journal.sqlite" / "out.nc"))


def test_without_duckdb_one_line_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_hours(tmp_path / "h", hours=0.1)
    monkeypatch.setattr("stillhook.base.extras.find_spec", lambda name: None)
    for call in (
        lambda: History(tmp_path / "new", COLUMNS),
        lambda: archive(tmp_path / "h"),
        lambda: read(tmp_path / "h"),
    ):
        assert 'duckdb is not installed. Get it with: pip install "stillhook[logs]".' in refused(call)
    assert not (tmp_path / "new").exists()
    assert overview(tmp_path / "h").rows == 6
