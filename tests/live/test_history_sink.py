"""A running twin's rows and events are in a history, and what is wrong with the history never holds the twin up."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from tests.live.histories import HOUR, START

from stillhook import Scenario, Session, load_crane
from stillhook.errors import LiveError
from stillhook.live.history import EventKind, History, HistorySink, overview, read, read_events
from stillhook.live.history import sink as sink_module
from stillhook.live.history.events import event

pytestmark = pytest.mark.slow  # each waits for the disk several times

NAMES = ("cycle_number", "time", "time_utc", "lateness", "cycle_flags", "e_c", "mode")
OWN = {name: ("s" if name in ("time", "lateness") else "1", f"meaning of {name}") for name in NAMES[:5]}


def rows_of(first: int, n: int, *, start: float = START, flags: int = 0) -> list[np.ndarray]:
    """Cycles of 10 ms."""
    return [np.array([k, 0.01 * k, start + 0.01 * k, 1e-4, flags, np.sin(k), 5.0]) for k in range(first, first + n)]


def test_rows_are_stored_at_a_tenth_of_the_cycles_with_the_flags_of_all(tmp_path: Path):
    sink = HistorySink(tmp_path, OWN)
    late = rows_of(0, 200)
    late[37][4], late[39][4] = 1.0, 8.0
    sink.rows(0, NAMES, late[:123])
    sink.rows(123, NAMES, late[123:])
    sink.close()
    run = read(tmp_path)
    assert run.cycle_number.values.tolist() == list(range(0, 200, 10))
    assert run.e_c.values.tolist() == [float(np.sin(k)) for k in range(0, 200, 10)]
    assert run.status.values.tolist() == [9 if k == 40 else 0 for k in range(0, 200, 10)]
    assert run.t_winch.attrs["long_name"] == "meaning of time"
    assert run.lateness.attrs["units"] == "s"
    assert set(run.data_vars) == {"cycle_number", "t_winch", "lateness", "e_c", "mode", "row", "status"}


def test_the_settings_of_a_controller_are_columns_with_names_that_a_history_takes(tmp_path: Path):
    twin = Session(load_crane("nov-250t"), Scenario(load="100 t", s_w="100 m", mode="ff"))
    settings = [name for name in twin.parameters if name.startswith("ff.")]
    assert settings
    sink = HistorySink(tmp_path, OWN)
    sink.rows(0, (*NAMES, *settings), [np.append(row, np.ones(len(settings))) for row in rows_of(0, 20)])
    sink.close()
    assert {name.replace(".", "_") for name in settings} <= set(read(tmp_path).data_vars)


def test_events_keep_who_what_and_how_much(tmp_path: Path):
    sink = HistorySink(tmp_path, OWN)
    sink.event(event("kernel", "started", "At 0 s of the winch.", np.nan, START))
    sink.rows(0, NAMES, rows_of(0, 10))
    for name, value in (
        ("alarm", 0.3),
        ("refused-write", 7.0),
        ("refused-input", 1.0),
        ("malformed", np.nan),
        ("late", 2.0),
    ):
        sink.event(event("modbus", name, f"{name}\nforged", value, START + 1.0))
    sink.close()
    events = [event for event in read_events(tmp_path) if "source" in event.data]
    assert [event.data["name"] for event in events[:2]] == ["started", "alarm"]
    kinds = [event.kind for event in events]
    assert kinds == [EventKind.START, EventKind.ALARM, *3 * [EventKind.REFUSED], EventKind.STATE]
    assert [event.data["value"] for event in events] == [None, 0.3, 7.0, 1.0, None, 2.0]
    assert all(event.text.isprintable() for event in events)


def test_an_event_that_came_alone_is_there_before_it_is_answered(tmp_path: Path):
    sink = HistorySink(tmp_path, OWN)
    sink.rows(0, NAMES, rows_of(0, 10))
    time.sleep(sink_module.EVENT_COMMIT)
    sink.event(event("opcua", "refused-write", "v_op from 10.0.0.9", 1.0, START))
    assert [e.text for e in read_events(tmp_path, kinds=[EventKind.REFUSED])] == ["v_op from 10.0.0.9"]
    sink.close()


def test_a_full_disk_holds_no_twin_up_and_what_is_lost_is_said_once(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setattr(sink_module, "COMMIT", 0.0)
    monkeypatch.setattr(sink_module, "MOST_WAITING", 5)
    sink = HistorySink(tmp_path, OWN, every=1)
    sink.rows(0, NAMES, rows_of(0, 10))
    append = History.append

    def full(*of, **named):
        raise LiveError("the disk is full.")

    monkeypatch.setattr(History, "append", full)
    for k in range(10, 30, 2):
        sink.rows(k, NAMES, rows_of(k, 2))
    monkeypatch.setattr(History, "append", append)
    sink.rows(30, NAMES, rows_of(30, 10))
    sink.close()
    assert read(tmp_path).cycle_number.values.tolist() == [*range(10), *range(25, 40)]
    assert [e.text for e in read_events(tmp_path, kinds=[EventKind.DAMAGED])] == [
        "15 rows or events were not stored: the disk is full."
    ]
    assert capsys.readouterr().err == "history: the disk is full. The twin continues.\n"


def test_a_row_without_a_time_is_left_out_and_said_and_the_others_are_stored(tmp_path: Path):
    sink = HistorySink(tmp_path, OWN, every=1)
    rows = rows_of(0, 3)
    rows[1][2] = np.nan
    sink.rows(0, NAMES, rows)
    sink.close()
    assert read(tmp_path).cycle_number.values.tolist() == [0, 2]
    assert [e.text for e in read_events(tmp_path, kinds=[EventKind.DAMAGED])] == [
        "1 rows or events were not stored: time nan"
    ]


@pytest.mark.long
def test_full_hours_are_archived_in_a_process_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sink_module, "COMMIT", 0.0)
    sink = HistorySink(tmp_path, OWN, every=1)
    sink.rows(0, NAMES, rows_of(0, 3))
    sink._archiver.join()
    for hour in (1, 2):
        sink.rows(3 * hour, NAMES, rows_of(3 * hour, 3, start=START + hour * HOUR))
        sink._archiver.join()
    sink.close()
    assert sink._archiver.exitcode == 0
    assert overview(tmp_path).files == 2
    assert read(tmp_path).cycle_number.values.tolist() == list(range(9))


def test_a_history_that_is_refused_is_refused_with_the_first_row(tmp_path: Path):
    with History(tmp_path, ["p_a"]), pytest.raises(LiveError, match="Stop it, or choose another folder"):
        HistorySink(tmp_path, OWN).rows(0, NAMES, rows_of(0, 1))
    with pytest.raises(LiveError, match="every = 0: give a whole number of rows from 1"):
        HistorySink(tmp_path, every=0)
