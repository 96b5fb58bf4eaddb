"""Signals of another clock are brought onto the main one, and the repair is declared; where it cannot be found, it is refused."""

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook.logs.clock import _best_lag, _offsets
from stillhook.logs.log import mapping_from, read_log

REV = 2.0 * np.pi / 60.0
TIMELY = 0.1  # s: one bin; a reversal lasts longer


def mapping(clock="T2"):
    rows = {
        "time": {"column": "time", "unit": "s"},
        "omega_m": {"column": "omega_m", "unit": "rev/min"},
        "u_p": {"column": "u_p", "unit": "%"},
        "p_a": {"column": "p_a", "unit": "bar", "clock": clock},
        "p_b": {"column": "p_b", "unit": "bar", "clock": clock},
    }
    return mapping_from(rows, "m")


def by_two_clocks(staircase, offset, drift):
    """Every row holds what each logger had at that row; the second one started `offset` later and its stamps run fast by `drift`."""
    stamps = staircase["time"] * (1.0 + drift)
    late = {name: np.interp(staircase["time"] + offset, staircase["time"], staircase[name]) for name in ("p_a", "p_b")}
    return staircase.with_columns(**late, T2=stamps)


@pytest.mark.thorough
@pytest.mark.parametrize(("offset", "drift"), [(0.0, 0.0), (2.7, 0.0), (-1.3, 4e-4), (6.0, -1e-3), (0.4, 2e-3)])
def test_offset_and_drift_are_found_and_repaired(tmp_path, make_staircase, offset, drift):
    staircase = make_staircase(400.0)
    log = read_log(by_two_clocks(staircase, offset, drift).write(tmp_path / "clocks.csv"), mapping())
    (finding,) = [f for f in log.findings if f.kind == "clock-drift"]
    assert finding.action == "repaired"
    assert finding.text.startswith('p_a, p_b: the clock "T2" runs ')
    # the reversals of pressure and speed coincide again
    dp = log.signals["p_a"] - log.signals["p_b"]
    true = np.interp(log.t, staircase["time"], staircase["p_a"] - staircase["p_b"]) * 1e5
    good = np.isfinite(dp)
    shifts = np.arange(-20, 21)
    t = log.t[good]
    error = [np.mean((np.interp(t, log.t + 0.05 * s, true) - dp[good])[200:-200] ** 2) for s in shifts]
    assert abs(0.05 * shifts[int(np.argmin(error))]) <= TIMELY
    first, last = log.t < 100.0, log.t > 300.0  # and at both ends of the log
    for part in (first, last):
        here = good & part
        error = [np.mean((np.interp(log.t[here], log.t + 0.05 * s, true) - dp[here]) ** 2) for s in shifts]
        assert abs(0.05 * shifts[int(np.argmin(error))]) <= TIMELY


@pytest.mark.slow
def test_signals_of_a_clock_that_share_no_motion_are_refused(tmp_path, staircase):
    rng = np.random.default_rng(2)
    noise = staircase.with_columns(p_a=150 + rng.standard_normal(len(staircase)), T2=staircase["time"])
    text = refused(read_log, noise.write(tmp_path / "noise.csv"), mapping())
    assert text.startswith('noise.csv: clock "T2" of p_a, p_b: its offset cannot be found: a correlation of 0.')
    assert text.endswith(
        "connects its signals with those of the main clock. Log a signal with both clocks, or remove `clock`."
    )


@pytest.mark.slow
def test_a_staircase_that_repeats_itself_tells_no_offset(tmp_path, make_staircase):
    """Half a period apart both directions fit equally well, and neither offset is near the start of the file."""
    text = refused(
        read_log, by_two_clocks(make_staircase(400.0, regular=True), 12.0, 0.0).write(tmp_path / "even.csv"), mapping()
    )
    assert "its offset cannot be found: the motion repeats, so that" in text
    assert text.endswith("fit equally well. Give a log with moves that differ.")


@pytest.mark.slow
def test_of_offsets_that_fit_alike_the_one_at_the_start_is_taken_and_told(tmp_path, make_staircase):
    log = read_log(by_two_clocks(make_staircase(400.0, regular=True), 2.7, 0.0).write(tmp_path / "even.csv"), mapping())
    (finding,) = [f for f in log.findings if f.kind == "clock-drift"]
    assert "its first stamp is at 2." in finding.text
    assert "the motion repeats, and " in finding.text
    assert finding.text.endswith("s fits as well: the offset next to the start of the file was taken")


@pytest.mark.slow
def test_a_clock_that_is_set_during_the_log_is_refused(tmp_path, make_staircase):
    staircase = make_staircase(400.0)
    stamps = staircase["time"] + np.where(staircase["time"] > 200.0, 2.0, 0.0)
    text = refused(read_log, staircase.with_columns(T2=stamps).write(tmp_path / "set.csv"), mapping())
    assert "its drift is not steady" in text or "cannot be found" in text


@pytest.mark.slow
def test_a_log_whose_signals_all_have_another_clock_is_refused(tmp_path, staircase):
    rows = {name: row for name, row in mapping().items() if name in ("time", "p_a", "p_b")}
    text = refused(read_log, staircase.with_columns(T2=staircase["time"]).write(tmp_path / "x.csv"), rows)
    assert text == "x.csv: every signal has its own clock. Leave out `clock` where a signal is stamped by time."


@pytest.mark.slow
def test_dated_stamps_are_believed_where_motion_does_not_tell(tmp_path, staircase):
    rng = np.random.default_rng(4)
    slow = 150.0 + 0.05 * staircase["time"]  # a pressure that knows nothing of the moves
    staircase = staircase.with_columns(p_a=slow + 0.1 * rng.standard_normal(len(staircase)))
    start = np.datetime64("2020-05-01T12:00:00", "ms")
    cells = staircase.cells()
    cells["time"] = [str(start + np.timedelta64(round(1e3 * t), "ms")) for t in staircase["time"]]
    cells["T2"] = [str(start + np.timedelta64(round(1e3 * (t + 11.5)), "ms")) for t in staircase["time"]]
    rows = {name: {"column": name, "unit": unit} for name, unit in (("omega_m", "rev/min"), ("p_a", "bar"))}
    rows["p_a"]["clock"] = "T2"
    path = staircase.write(tmp_path / "dated.csv", cells=cells, header="time,p_a,p_b,omega_m,u_p,s_w,T2")
    log = read_log(path, mapping_from({"time": {"column": "time", "unit": "UTC"}, **rows}, "m"))
    (finding,) = log.findings
    assert finding.action == "noted"
    assert finding.text.startswith(
        'p_a: the stamps in "T2" are believed, both clocks state the date; its offset cannot be found: a correlation of 0.'
    )
    assert np.isnan(log.signals["p_a"][log.t < 11.35]).all()
    late = np.interp(log.t - 11.5, staircase["time"], slow) * 1e5
    np.testing.assert_allclose(
        log.signals["p_a"][150:-10], late[150:-10], atol=0.3e5
    )  # six deviations of a mean of ten samples, and more


def test_a_shift_that_leaves_little_in_common_is_no_match_and_one_that_leaves_a_quarter_is():
    """Both sides see the same moves at the same time; the strongest of one is at its end and that of the other at its
    beginning, so that laid over each other they agree best where next to nothing else is seen by both."""
    n, step = 400, 1.0
    moves = np.zeros(n)
    moves[12:-12:6] = np.random.default_rng(1).choice([-1.0, 1.0], len(moves[12:-12:6]))
    main, other = moves.copy(), moves.copy()
    main[3], other[-4] = 9.0, 9.0
    match, _, _, offsets = _offsets({"a": main}, {"b": other}, step)
    assert offsets[0] == 0.0
    assert match < 0.5
    for shared, found in ((n // 4, True), (n // 4 - 1, False)):
        shift = n - shared
        early, late = np.zeros(n), np.zeros(n)
        early[n - 20], late[n - 20 - shift] = 1.0, 1.0  # seen once by both, if so much of both may lie over each other
        assert (_offsets({"a": early}, {"b": late}, step)[3][:1] == [shift]) == found


@pytest.mark.parametrize(("early", "late", "lag"), [(0, 3, -3.0), (3, 0, 3.0), (0, 1, -1.0), (2, 2, 0.0)])
def test_the_lag_of_a_short_piece_may_be_as_long_as_the_piece(monkeypatch, early, late, lag):
    monkeypatch.setattr("stillhook.logs.clock.REACH", 10.0)
    x, y = np.zeros(4), np.zeros(4)
    x[early], y[late] = 1.0, 1.0
    assert _best_lag(x, y, 1.0, sign=1.0) == (lag, 1.0)
    assert _best_lag(-x, y, 1.0, sign=0.0) == (lag, -1.0)
    assert _best_lag(np.zeros(4), y, 1.0, sign=1.0) == (0.0, 0.0)
