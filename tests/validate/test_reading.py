"""Logs on an even grid: nothing moves in time, holes stay holes, what is wrong is told."""

import numpy as np
import pandas as pd
import pytest
from tests.validate.crane_logs import ahc, at, changed, manual, read, write

from stillhook.errors import LogError, ValidateError
from stillhook.validate.data_set.campaign import load_campaign
from stillhook.validate.data_set.read import read_records

pytestmark = pytest.mark.slow

DIGITS = 2e-3  # m: noise and last digit of a tip sample, so that a value between two samples is known to no better
PROMPT = 1e-3  # s: what a value is late by, found from how tip and tip speed fit


def refusal(folder, frame, **more):
    with pytest.raises((LogError, ValidateError)) as caught:
        read(folder, frame, **more)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def lateness(record, frame):
    """By how much the tip of a record is later than that of the log [s]."""
    t, tip, v = (frame[h].to_numpy() for h in ("Time", "Tip pos", "Tip speed"))
    known = np.isfinite(record.signals["s_tip"])
    true, speed = (np.interp(record.t[known] + record.zero, t, x) for x in (tip, v))
    return float(-np.sum((record.signals["s_tip"][known] - true) * speed) / np.sum(speed**2))


@pytest.mark.long
@pytest.mark.parametrize("hertz", [10.0, 40.0, 50.0, 100.0, 500.0])
def test_a_log_of_any_rate_lies_on_whole_plc_cycles_and_not_later(tmp_path, hertz):
    frame = ahc()
    record = read(tmp_path, at(frame, np.arange(0.0, 140.0, 1.0 / hertz)))
    assert record.step == pytest.approx(max(0.01, round(1.0 / hertz, 2)), abs=0.011)
    assert round(record.step / 0.01) == pytest.approx(record.step / 0.01, abs=1e-9)
    assert np.ptp(np.diff(record.t)) < 1e-9
    assert abs(lateness(record, frame)) < PROMPT
    (segment,) = record.segments
    assert segment.duration > 139.8
    assert record.lost < 1e-3


def test_stamps_that_jitter_move_no_value(tmp_path):
    rng = np.random.default_rng(3)
    frame = ahc()
    stamps = np.sort(np.arange(0.0, 140.0, 0.01) + 0.002 * rng.standard_normal(14000))
    jittered = at(frame, np.concatenate(([0.0], stamps[stamps > 0.0])))
    record = read(tmp_path, jittered.drop_duplicates("Time"))
    true = np.interp(record.t + record.zero, frame["Time"].to_numpy(), frame["Tip pos"].to_numpy())
    assert np.nanstd(record.signals["s_tip"] - true) < DIGITS
    assert abs(lateness(record, frame)) < 0.2 * PROMPT
    assert len(record.segments) == 1
    assert record.lost < 0.01  # samples that two jittered stamps of one moment cost


def test_a_log_that_writes_by_turns_after_8_and_12_ms_loses_nothing(tmp_path):
    record = read(tmp_path, at(ahc(), np.cumsum(np.where(np.arange(13900) % 2, 0.008, 0.012))))
    assert record.step == 0.01
    assert record.lost < 1e-3


def test_samples_lost_one_by_one_are_counted_and_bridged(tmp_path):
    frame = ahc()
    keep = np.random.default_rng(0).random(len(frame)) > 0.05
    record = read(tmp_path, frame[keep])
    assert record.lost == pytest.approx(0.05, abs=0.01)
    assert len(record.segments) == 1
    assert np.isfinite(record.signals["s_tip"]).all()


def test_a_gap_stays_a_gap_and_both_sides_are_used(tmp_path):
    frame = ahc(170.0)
    frame = frame[(frame["Time"] < 70.0) | (frame["Time"] >= 90.0)]
    record = read(tmp_path, frame)
    inside = (record.t > 70.1) & (record.t < 89.9)
    assert all(np.isnan(record.signals[name][inside]).all() for name in ("s_tip", "s_w", "u_p", "mode"))
    first, second = record.segments
    assert first.start + first.duration == pytest.approx(70.0, abs=0.02)
    assert second.start == pytest.approx(90.0, abs=0.02)
    assert record.longest_hole == pytest.approx(20.0, abs=0.02)
    assert record.lost == pytest.approx(20.0 / 170.0, rel=0.01)
    assert any("no samples for 20.01 s" in text for text in record.statements)
    assert all(np.isfinite(record.part(s, "s_tip")).all() for s in record.segments)


def hidden(frame):
    """20 s are missing, and the stamps go on."""
    rest = frame[(frame["Time"] < 70.0) | (frame["Time"] >= 90.0)]
    return rest.assign(Time=frame["Time"].to_numpy()[: len(frame) - 2000])


def spoiled(heading, part, value):
    """A column of a log with other values in a part."""

    def change(frame):
        x = frame[heading].to_numpy().copy()
        x[part] = value(x[part])
        return changed(frame, heading, x)

    return change


SPOILED = {  # what is wrong with a log -> how it is made, parts that are used, words of the statement
    "gap": (hidden, 2, "jump: samples are missing without a gap in the time stamps; the parts before and after"),
    "counter": (
        spoiled("Wire out", slice(7000, None), lambda x: x + 1.2),
        *(2, "wire paid out jumps, and no other signal does: its sensor was reset"),
    ),
    "spike": (spoiled("Wire out", slice(7000, 7001), lambda x: x + 3.0), 1, "1 sample of s_w left out as spikes far"),
    "tip": (spoiled("Tip pos", slice(8000, 8500), lambda x: np.nan), 2, "500 samples missing (empty cells)"),
    "error": (spoiled("AHC error", slice(8000, 8500), lambda x: np.nan), 1, "500 samples missing (empty cells)"),
    "stuck": (spoiled("Tip pos", slice(8000, 8800), lambda x: x[0]), 2, "while v_tip moves: stuck"),
}


@pytest.mark.long
@pytest.mark.parametrize("case", SPOILED)
def test_what_is_wrong_with_a_log_is_left_out_and_stated(tmp_path, case):
    spoil, parts, words = SPOILED[case]
    record = read(tmp_path, spoil(ahc(170.0)))
    assert len(record.segments) == parts
    assert any(words in text for text in record.statements), record.statements
    if case == "gap":
        assert [round(s.start, 1) for s in record.segments] == [0.0, 70.0]
    if case == "spike":
        assert record.segments[0].s_w_max < 489.0
    if case == "stuck":
        assert np.isnan(record.signals["s_tip"][8005:8795]).all()


def test_friction_that_breaks_away_is_no_seam(tmp_path):
    """At rest and in slow waves the winch's speed steps; the tip does not."""
    for frame, kind, load in ((ahc(), "ahc", "90 t"), (manual(), "dynamics", "0 t")):
        assert len(read(tmp_path, frame, kind=kind, test=f'load = "{load}"').segments) == 1


def test_a_winch_at_rest_below_a_tip_that_moves_is_not_stuck(tmp_path):
    frame = manual()
    t = frame["Time"].to_numpy()
    waves = np.round(0.4 * np.sin(0.7 * t), 3)
    record = read(
        tmp_path,
        frame.assign(**{"Tip pos": waves, "Tip speed": np.round(0.28 * np.cos(0.7 * t), 3), "Tip acc": -0.49 * waves}),
        kind="dynamics",
        test='load = "0 t"',
    )
    assert not any("stuck" in text for text in record.statements)
    assert np.isfinite(record.signals["v_w"]).all()


def test_only_the_part_that_counts_is_read(tmp_path):
    record = read(tmp_path, ahc(), test='load = "90 t"\nstart = "30 s"\nend = "110 s"')
    assert record.zero == pytest.approx(30.0, abs=0.01)
    assert record.t[-1] == pytest.approx(80.0, abs=0.01)
    text = refusal(tmp_path, ahc(), test='load = "90 t"\nstart = "500 s"')
    assert text == 'test "1": start = 500 s: x.csv goes from 0 s to 140 s and has no samples in that range.'


def test_two_tests_may_share_a_log(tmp_path):
    path = write(tmp_path, ahc(), test='load = "90 t"\nend = "70 s"')
    path.write_text(
        path.read_text() + '[[test]]\nname = "2"\nlog = "x.csv"\nkind = "ahc"\nload = "90 t"\nstart = "70 s"\n'
    )
    shares = []
    first, second = read_records(load_campaign(path), shares.append)
    assert first.log is second.log
    assert (first.segments[0].duration, second.segments[0].duration) == (
        pytest.approx(70.0, abs=0.1),
        pytest.approx(70.0, abs=0.1),
    )
    assert shares[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "x.csv: is empty."),
        ("Time,Tip pos\n", "holds no table"),
        ("\x00\x01\x02" * 500, "holds no table"),
        ("<html></html>\n" * 20, "x.csv: "),
    ],
)
def test_a_file_that_is_no_log_is_refused_in_one_line(tmp_path, content, told):
    path = write(tmp_path, ahc())
    (tmp_path / "x.csv").write_text(content)
    with pytest.raises(LogError) as caught:
        read_records(load_campaign(path), lambda share: None)
    text = str(caught.value)
    assert text.startswith('test "1": ')
    assert told in text
    assert "\n" not in text


def test_time_that_starts_anew_and_columns_that_are_not_there_are_refused(tmp_path):
    frame = ahc()
    assert 'time in "Time" runs back by 99.99 s. The clock restarted' in refusal(
        tmp_path, pd.concat([frame[:10000], frame[:10000]])
    )
    assert 'x.csv: s_w: no column "Wire out" in the file.' in refusal(tmp_path, frame.drop(columns="Wire out"))
