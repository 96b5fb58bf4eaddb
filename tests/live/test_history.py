"""A history gives back what it acknowledged: every row once, in order and to the bit, wherever it lies by now."""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.live.histories import COLUMNS, HOUR, START, numbers, write_hours
from tests.parquet import read_parquet

import stillhook
from stillhook.base.variable import Variable
from stillhook.errors import LiveError
from stillhook.live.history import (
    Budget,
    Event,
    EventKind,
    History,
    archive,
    check,
    describe,
    overview,
    read,
    read_events,
    save,
)
from stillhook.logs.log import read_log
from stillhook.trust.manifest import NAME, Part, read_manifest

pytestmark = pytest.mark.slow  # each waits for the disk several times


def test_rows_come_back_to_the_bit_from_the_journal_and_from_parquet(tmp_path: Path):
    written = write_hours(tmp_path, hours=2.5)
    before = read(tmp_path)
    files = archive(tmp_path)
    after = read(tmp_path)
    assert len(files) == 2
    assert overview(tmp_path).rows_in_journal == len(written) - 2 * round(HOUR / 60.0)
    for run in (before, after):
        assert run["row"].values.tolist() == list(range(1, len(written) + 1))
        for i, name in enumerate(COLUMNS):
            assert run[name].values.tobytes() == written[:, 1 + i].tobytes(), name
    assert before.identical(after)


def test_nan_infinity_and_minus_zero_are_what_they_were(tmp_path: Path):
    values = [[np.nan, -0.0], [np.inf, 5e-324], [-np.inf, 1.7976931348623157e308]]
    with History(tmp_path, COLUMNS[:2]) as history:
        history.append([START, START + 1.0, START + 2.0], values)
        history.append(START + 2.0 * HOUR, [[0.0, 0.0]])
    (file,) = archive(tmp_path)
    run = read(tmp_path, end=START + HOUR)
    found = np.stack([run[name].values for name in COLUMNS[:2]], axis=1)
    assert np.array_equal(found, np.array(values), equal_nan=True)
    assert np.signbit(found[0, 1])
    assert file.is_file()


def test_a_status_belongs_to_each_row(tmp_path: Path):
    with History(tmp_path, COLUMNS) as history:
        history.append(START + np.arange(4.0), numbers(1, 4), [0, 1, 4, 2])
        history.append(START + 4.0 + np.arange(2.0), numbers(5, 2), 8)
    assert read(tmp_path)["status"].values.tolist() == [0, 1, 4, 2, 8, 8]
    assert read(tmp_path, every="2 s")["status"].values.tolist() == [0, 1 | 4, 2 | 8, 8]


def test_units_meanings_and_start_are_with_the_data(tmp_path: Path):
    own = Variable("c_f", "c_f", "1", "", "", "scale of the friction", "estimator")
    with History(tmp_path, ["p_a", "omega_m", own]) as history:
        history.append([START, START + 0.1], [[210e5, 90.0, 1.1], [211e5, 91.0, 1.2]])
    run = read(tmp_path)
    assert (run.p_a.attrs["units"], run.omega_m.attrs["units"], run.c_f.attrs["units"]) == ("Pa", "rad/s", "1")
    assert run.c_f.attrs["long_name"] == "scale of the friction"
    assert (run.attrs["start"], run.attrs["start_utc"]) == (START, "2026-11-28T12:00:00Z")
    assert run.utc.values[0] == np.datetime64("2026-11-28T12:00:00")
    assert run.time.values[0] == 0.0


def test_columns_may_change_and_each_row_has_its_own(tmp_path: Path):
    with History(tmp_path, ["p_a"]) as history:
        history.append(START + np.arange(3.0), [[1.0], [2.0], [3.0]])
    with History(tmp_path, ["omega_m", "p_a"]) as history:
        history.append(START + 3.0 + np.arange(2.0), [[7.0, 4.0], [8.0, 5.0]])
    for _ in range(2):
        run = read(tmp_path)
        assert run.p_a.values.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
        assert np.array_equal(run.omega_m.values, [np.nan, np.nan, np.nan, 7.0, 8.0], equal_nan=True)
        assert len(archive(tmp_path)) <= 1  # other columns begin another file
    assert overview(tmp_path).files == 1


def test_a_clock_that_goes_back_neither_loses_nor_reorders_rows(tmp_path: Path):
    steps = [0.0, 10.0, 20.0, -4000.0, -3990.0, 30.0, 3700.0, 15.0]
    with History(tmp_path, ["p_a"]) as history:
        for k, dt in enumerate(steps):
            history.append(START + dt, [[float(k)]])
    files = archive(tmp_path)
    run = read(tmp_path)
    assert run.p_a.values.tolist() == list(range(len(steps)))
    assert (run.time.values + run.attrs["start"] - START).tolist() == steps
    assert len(files) == 4  # 12 h, 10 h, 12 h again, 13 h; 12 h once more is being written
    back = [event for event in read_events(tmp_path) if event.kind is EventKind.CLOCK]
    assert [event.data["row"] for event in back] == [4, 8]
    assert back[0].text == "time goes back by 4020 s, to 2026-11-28T10:53:20Z, at row 4"
    evenly = read(tmp_path, every="10 s", start=START)
    assert evenly.p_a.values[:4].tolist() == [0.0, 1.0, 2.0, 5.0]


def test_a_clock_that_trembles_about_the_hour_makes_no_heap_of_files(tmp_path: Path):
    t = START + HOUR + 0.02 * np.where(np.arange(200) % 2, 1.0, -1.0) + 0.001 * np.arange(200)
    with History(tmp_path, ["p_a"]) as history:
        for each in t:
            history.append(each, [[each]])
        history.append(START + 2.0 * HOUR, [[0.0]])
    assert len(archive(tmp_path)) == 2
    assert len(read(tmp_path).row) == 201


def test_a_clock_that_stands_still_does_not_fill_the_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("stillhook.live.history.writer.LARGEST_FILE", 8 * 3 * 50)
    with History(tmp_path, ["p_a"]) as history:
        history.append(np.full(120, START), np.arange(120.0)[:, None])
    assert [len(read_file(file)) for file in archive(tmp_path)] == [50, 50]
    assert read(tmp_path).p_a.values.tolist() == list(range(120))


def read_file(path: Path) -> list[float]:
    return read_parquet(path)["row"].tolist()


def test_row_numbers_rise_over_restarts_and_removals(tmp_path: Path):
    write_hours(tmp_path, hours=3.5, budget=Budget(days=1e-6))
    archive(tmp_path)
    with History(tmp_path, COLUMNS) as history:
        assert history.last_row == 210
        assert history.append(START + 4.0 * HOUR, numbers(211, 1)) == 211


def test_events_are_in_their_order_with_the_row_before_them(tmp_path: Path):
    with History(tmp_path, ["p_a"]) as history:
        history.append(START, [[1.0]], events=[Event(EventKind.ALARM, "pressure high", {"p_a": 3.1e7}, START)])
        history.event(EventKind.REFUSED, "write of v_op from 10.0.0.9: no certificate", data={"value": 2.0})
    start, alarm, refused, stop = read_events(tmp_path)
    assert [e.kind.value for e in (start, alarm, refused, stop)] == ["start", "alarm", "refused-write", "stop"]
    assert (alarm.row, alarm.time, dict(alarm.data)) == (1, START, {"p_a": 3.1e7})
    assert start.number < alarm.number < refused.number < stop.number
    assert [e.text for e in read_events(tmp_path, kinds=[EventKind.ALARM], end="2026-11-28T12:00:01")] == [
        "pressure high"
    ]
    assert read_events(tmp_path, kinds=[EventKind.ALARM], end="2026-11-28T12:00:00") == []


def test_a_text_from_outside_forges_no_line_and_has_bounds(tmp_path: Path):
    with History(tmp_path, ["p_a"]) as history:
        history.event(EventKind.REFUSED, "a\n2026 ALARM\x1b[2J\udcff" + 10_000 * "x", data={"k": "y" * 100_000})
        history.event(EventKind.COMMAND, "set", data={"path": tmp_path})
    _, forged, command, _ = read_events(tmp_path)
    assert forged.text.isprintable()
    assert len(forged.text) == 500
    assert len(json.dumps(dict(forged.data))) < 4000
    assert command.data == {"path": str(tmp_path)}


def test_the_last_saved_states_are_there_and_a_damaged_one_is_passed_over(tmp_path: Path):
    with History(tmp_path, ["p_a"]) as history:
        for k in range(5):
            history.append(START + k, [[0.0]], states={"twin": bytes([k]), "estimator": b"e"})
        assert history.last_state("twin")[::2] == (5, b"\x04")
        assert history.last_state("nobody") is None
        c = history._connection
        assert c.execute("SELECT count(*) FROM states").fetchone() == (6,)
        c.execute("UPDATE states SET data = x'00' WHERE name = 'twin' AND row = 5")
        assert history.last_state("twin")[::2] == (4, b"\x03")
    damaged = [event.text for event in read_events(tmp_path, kinds=[EventKind.DAMAGED])]
    assert damaged == ["saved state twin after row 5 is damaged: the one before it is taken"]


def test_a_saved_session_goes_on_to_the_bit(tmp_path: Path):
    crane = stillhook.load_crane("nov-250t")
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc")
    session = stillhook.Session(crane, case)
    session.step(cycles=50)
    with History(tmp_path, ["e_c"]) as history:
        history.append(START, [[session.get("e_c")]], states={"twin": session.save()})
    session.step(cycles=50)
    other = stillhook.Session(crane, case)
    with History(tmp_path, ["e_c"]) as history:
        other.restore(history.last_state("twin").data)
    other.step(cycles=50)
    assert other.save() == session.save()


# Bounds


@pytest.mark.parametrize("bound", ["days", "bytes"])
def test_the_oldest_hours_go_first_and_each_is_an_event(tmp_path: Path, bound: str):
    written = write_hours(tmp_path, hours=8.5)
    archive(tmp_path)
    full = overview(tmp_path)
    three_files = Budget(bytes=full.journal_bytes + full.file_bytes * 7 // 16)
    with History(tmp_path, COLUMNS, budget=Budget(days=3.0 / 24.0) if bound == "days" else three_files):
        archive(tmp_path)
    found = overview(tmp_path)
    removed = read_events(tmp_path, kinds=[EventKind.REMOVED])
    assert (full.files, found.files) == (8, 3)
    assert [event.data["first"] for event in removed] == [1 + 60 * k for k in range(5)]
    assert removed[0].text == (
        "rows 1 to 60, 2026-11-28T12:00:00Z to 2026-11-28T12:59:00Z: removed, the history is at its budget"
    )
    assert read(tmp_path)["row"].values.tolist() == list(range(301, len(written) + 1))
    left = {path.name for path in (tmp_path / "hours").glob("*.parquet")}
    assert len(left) == 3
    assert {*read_manifest(tmp_path / "hours" / NAME).parts} == left
    assert (found.first_row, found.removed_rows) == (301, 300)
    assert "300 rows removed" in " ".join(describe(found))


def test_a_journal_that_was_long_not_archived_gives_its_space_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("stillhook.live.history.budget.SLACK", 100_000)
    monkeypatch.setattr("stillhook.live.history.writer.LARGEST_FILE", 8 * 5 * 5000)
    with History(tmp_path, COLUMNS) as history:
        for k in range(10):
            history.append(np.full(5000, START + k), numbers(1 + 5000 * k, 5000))
    before = (tmp_path / "journal.sqlite").stat().st_size
    archive(tmp_path)
    assert (tmp_path / "journal.sqlite").stat().st_size < 0.3 * before
    assert read(tmp_path, signals=["p_a"]).p_a.values.tolist() == numbers(1, 50000)[:, 0].tolist()


def test_a_jump_of_the_clock_removes_nothing(tmp_path: Path):
    with History(tmp_path, ["p_a"], budget=Budget(days=1.0)) as history:
        for day in (0.0, 9000.0, 1.0, 2.0):
            history.append(START + 86400.0 * day, [[day]])
    archive(tmp_path)
    assert len(read(tmp_path).row) == 4


def test_a_journal_beyond_the_budget_loses_its_oldest_hours(tmp_path: Path):
    write_hours(tmp_path, hours=4.5, budget=Budget(bytes=1))
    archive(tmp_path)
    assert overview(tmp_path).first_row == 241
    assert read(tmp_path)["row"].values.tolist() == list(range(241, 271))


def test_events_have_a_bound_of_their_own(tmp_path: Path):
    with History(tmp_path, ["p_a"], budget=Budget(events=20)) as history:
        history.append(START, [[0.0]], events=[Event(EventKind.REFUSED, f"write {k}") for k in range(50)])
    archive(tmp_path)
    events = read_events(tmp_path)
    assert len(events) == 20
    assert events[-1].text == "33 events, up to number 33: removed, the history holds 20"
    assert events[-3].text == "write 49"


# One table


def test_a_range_a_signal_and_a_spacing_are_chosen(tmp_path: Path):
    write_hours(tmp_path, hours=3.5)
    archive(tmp_path)
    run = read(tmp_path, start="2026-11-28T13:30", end="2026-11-28T15:15:00+00:00", signals=["omega_m"], every="5 min")
    assert list(run.data_vars) == ["omega_m", "row", "status"]
    assert run.time.values.tolist() == [300.0 * k for k in range(22)]
    assert run.row.values.tolist() == [*(91 + 5 * k for k in range(21)), 195]  # the last interval ends at 15:14
    assert run.utc.values[-2] == np.datetime64("2026-11-28T15:10:00")


@pytest.mark.skipif(sys.platform == "win32", reason="no such names there")
def test_a_folder_named_like_a_pattern_or_a_query_reads_itself_alone(tmp_path: Path):
    write_hours(tmp_path / "xay", hours=1.5)
    archive(tmp_path / "xay")
    for name in ("x*y", "x?y", "x[a]y", "it's; \"--", "k=v {a,b}", "%20#"):
        write_hours(tmp_path / name, hours=1.2)
        archive(tmp_path / name)
        assert len(read(tmp_path / name)["row"]) == 72, name


def test_intervals_hold_the_nearest_row_the_mean_the_least_or_the_most(tmp_path: Path):
    values = np.array([4.0, np.nan, 1.0, 7.0, 2.0, np.nan])
    with History(tmp_path, ["p_a"]) as history:
        history.append(START + np.array([0.0, 1.0, 2.0, 3.0, 11.0, 29.0]), values[:, None])
    expected = {"nearest": [4.0, 2.0, np.nan, np.nan], "mean": [4.0, 2.0, np.nan, np.nan]}
    expected |= {"least": [1.0, 2.0, np.nan, np.nan], "most": [7.0, 2.0, np.nan, np.nan]}
    for pick, numbers_of in expected.items():
        run = read(tmp_path, every="10 s", pick=pick)
        assert np.array_equal(run.p_a.values, numbers_of, equal_nan=True), pick
        assert run.row.values.tolist() == [1, 5, -1, 6]
        assert run.status.values.tolist() == [0, 0, -1, 0]


def test_metrics_read_a_history(tmp_path: Path):
    t = np.arange(1200) * 0.1
    with History(tmp_path, ["e_c"]) as history:
        history.append(START + t + 0.002 * np.sin(7.0 * t), 0.05 * np.sin(2.0 * np.pi * t / 10.0)[:, None])
    run = read(tmp_path, every="0.1 s")
    assert float(stillhook.metrics.e_c_pp(run).max()) == pytest.approx(0.1, abs=1e-4)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_what_is_written_out_is_a_log_without_a_mapping(tmp_path: Path, suffix: str):
    with History(tmp_path / "h", ["p_a", "omega_m"]) as history:
        history.append(
            START + np.arange(600) * 0.1, np.stack([210e5 + np.arange(600.0), np.sin(np.arange(600.0))], axis=1)
        )
    run = read(tmp_path / "h")
    log = read_log(save(run, tmp_path / f"out{suffix}"))
    assert log.signals["p_a"].tolist() == run.p_a.values.tolist()
    assert log.signals["omega_m"].tolist() == run.omega_m.values.tolist()


def test_an_hour_is_a_log_without_a_mapping(tmp_path: Path):
    with History(tmp_path, ["p_a"]) as history:
        history.append(START + np.arange(600) * 0.1, 1e5 * np.arange(600.0)[:, None])
        history.append(START + 2.0 * HOUR, [[0.0]])
    (hour,) = archive(tmp_path)
    assert hour.name == "2026-11-28T12Z-000000000001.parquet"
    assert read_log(hour).signals["p_a"].tolist() == (1e5 * np.arange(600.0)).tolist()


def test_netcdf_comes_back_as_it_was(tmp_path: Path):
    import xarray

    write_hours(tmp_path / "h", hours=0.5)
    run = read(tmp_path / "h")
    with xarray.open_dataset(save(run, tmp_path / "out.nc"), engine="h5netcdf") as again:
        assert again.p_a.values.tolist() == run.p_a.values.tolist()
        assert again.attrs["start"] == START


def test_the_journal_says_the_sha256_of_each_file(tmp_path: Path):
    write_hours(tmp_path, hours=1.5)
    (file,) = archive(tmp_path)
    with History(tmp_path, COLUMNS) as history:
        row = history._connection.execute("SELECT file, bytes, sha256 FROM hours").fetchone()
    assert row == (file.name, file.stat().st_size, hashlib.sha256(file.read_bytes()).hexdigest())
    assert check(tmp_path) == []
    assert read_manifest(file.parent / NAME).parts == {file.name: Part(*row[1:])}


EARLY = ("no rows yet", "no history", "its hours are removed as fast as they are read")
"""What a reader may be refused with while a writer begins, or removes hours at the pace of this test."""


def test_a_reader_beside_a_writer_and_an_archiver_sees_each_row_once(tmp_path: Path):
    done, problems, early, seen = threading.Event(), [], [], 0

    def write() -> None:
        try:
            with History(tmp_path, COLUMNS, budget=Budget(days=0.2)) as history:
                for k in range(0, 1200, 20):
                    history.append(START + 60.0 * np.arange(k, k + 20), numbers(k + 1, 20))
                    if k % 60 == 0:
                        archive(tmp_path)
        except Exception as problem:
            problems.append(problem)
        finally:
            done.set()

    thread = threading.Thread(target=write)
    thread.start()
    try:
        while not done.is_set():
            try:
                run = read(tmp_path)
            except LiveError as problem:
                early.append(str(problem))
                continue
            rows = run["row"].values
            assert rows.tolist() == list(range(rows[0], rows[-1] + 1))
            assert rows[-1] >= seen
            assert np.array_equal(run.p_a.values, numbers(1, 1200)[rows - 1, 0])
            assert run.attrs["left_out"] == ""
            seen = rows[-1]
    finally:
        thread.join()
    assert problems == []
    assert [line for line in early if not any(words in line for words in EARLY)] == []
    assert overview(tmp_path).last_row == 1200


STEPS = st.sampled_from([0.0, 0.1, 30.0, 61.0, 1800.0, 3601.0, -0.5, -59.0, -1900.0, -86400.0, 1e7])
ACTIONS = st.one_of(
    st.tuples(st.just("rows"), st.lists(STEPS, min_size=1, max_size=12)),
    st.sampled_from([("archive", []), ("restart", []), ("columns", [])]),
)


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(ACTIONS, min_size=1, max_size=10))
def test_whatever_the_clock_the_restarts_and_the_archives_rows_are_there_once_in_order(actions: list):
    with tempfile.TemporaryDirectory() as name:
        folder, at, order, times = Path(name) / "h", START + 2e7, COLUMNS, []
        history = History(folder, order)
        for action, steps in actions:
            if action == "rows":
                first = len(times) + 1
                times.extend(at := at + step for step in steps)
                values = numbers(first, len(steps))[:, [COLUMNS.index(each) for each in order]]
                assert history.append(times[first - 1 :], values) == len(times)
            elif action == "archive":
                archive(folder)
            else:
                history.close()
                order = order if action == "restart" else (*order[1:], order[0])
                history = History(folder, order)
        history.close()
        if not times:
            return
        run = read(folder)
        assert run["row"].values.tolist() == list(range(1, len(times) + 1))
        assert (run.time.values + run.attrs["start"]).tolist() == pytest.approx(times, abs=1e-6)
        for i, column in enumerate(COLUMNS):
            assert run[column].values.tobytes() == numbers(1, len(times))[:, i].tobytes()
        found = overview(folder)
        assert found.files == len(list(folder.glob("hours/*.parquet")))
        assert found.rows == found.last_row == len(times)
