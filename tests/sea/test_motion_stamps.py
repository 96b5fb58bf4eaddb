"""Times and checksums of motion logs as other loggers write them."""

import math
from functools import reduce
from operator import xor

import numpy as np
import pytest

from stillhook.errors import MotionError
from stillhook.formats.motion.open import read_ship_motion
from stillhook.formats.motion.ship_log import evened

RATE, PERIOD = 10, 8.0


def sentence(t, *, zero=True):
    body = f"PSXN,23,{math.sin(t):.2f},{0.5 * math.cos(t):.2f},235.000,{-math.sin(2.0 * math.pi * t / PERIOD):.2f}"
    checksum = f"{reduce(xor, body.encode(), 0):02X}"
    return f"${body}*{checksum if zero else checksum.lstrip('0') or '0'}"


def log(folder, stamp, *, zero=True, n=400, more=""):
    file = folder / "ship.txt"
    file.write_text("".join(f"{stamp(i / RATE)},{sentence(i / RATE, zero=zero)}\n" for i in range(n)) + more)
    return file


def clock(t):
    return f"{7 + int(t // 3600):02d}:{int(t // 60) % 60:02d}:{t % 60:06.3f}"


def heave(motion):
    return np.sin(2.0 * math.pi * motion.t / PERIOD)


def test_dates_of_noaas_logger_are_read_month_first(tmp_path):
    motion = read_ship_motion(log(tmp_path, lambda t: f"11/04/2017,{clock(t)}"))
    assert len(motion.t) == 400
    assert motion.heave == pytest.approx(heave(motion), abs=0.006)
    assert "month/day/year" in motion.report.describe()


def test_a_day_above_twelve_says_that_days_come_first(tmp_path):
    motion = read_ship_motion(log(tmp_path, lambda t: f"23/04/2017,{clock(t)}"))
    assert "day/month/year" in motion.report.describe()


def test_checksums_without_their_leading_zero_count(tmp_path):
    file = log(tmp_path, lambda t: f"2017-11-04T{clock(t)}", zero=False)
    assert any(len(line.strip().rpartition("*")[2]) == 1 for line in file.read_text().splitlines())
    assert len(read_ship_motion(file).t) == 400


def test_stamps_in_full_seconds_are_spread_and_no_sample_is_dropped(tmp_path):
    """Nine of ten samples were dropped as duplicates."""
    motion = read_ship_motion(log(tmp_path, lambda t: f"2017-11-04T{clock(math.floor(t))}"))
    assert len(motion.t) == 400
    assert np.diff(motion.t) == pytest.approx(np.full(399, 0.1), abs=1e-6)
    assert motion.heave == pytest.approx(heave(motion), abs=0.006)
    assert "full seconds with 10 samples in each" in motion.report.describe()


def test_a_csv_in_full_seconds_is_spread_too(tmp_path):
    file = tmp_path / "ship.csv"
    rows = "".join(f"{i // RATE},{math.sin(2.0 * math.pi * i / RATE / PERIOD):.4f}\n" for i in range(400))
    file.write_text("time [s],heave [m]\n" + rows)
    motion = read_ship_motion(file)
    assert len(motion.t) == 400
    assert motion.heave == pytest.approx(heave(motion), abs=1e-3)


def test_a_second_that_begins_or_ends_within_the_log_is_not_stretched():
    t = np.repeat([5.0, 6.0, 7.0, 8.0], [3, 10, 10, 4])
    spread, cautions = evened(t)
    assert len(cautions) == 1
    assert np.diff(spread) == pytest.approx(np.full(len(t) - 1, 0.1), abs=1e-9)
    for other in (np.arange(0.0, 10.0, 0.1), np.arange(0.0, 100.0)):
        assert evened(other)[1] == ()


def test_the_advice_on_dates_is_one_that_works(tmp_path):
    with pytest.raises(MotionError, match=r"11/04/2017 07:00:00\.1"):
        read_ship_motion(log(tmp_path, lambda t: "noon"))
