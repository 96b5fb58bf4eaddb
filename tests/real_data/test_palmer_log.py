"""The Seapath log of R/V Nathaniel B. Palmer (cruise NBP1406, 1 August 2014, head sea, 9 kn): twelve minutes at 1 Hz.

The numbers to meet are those that came with the file. Roll and pitch are stated there for the ship's other Seapath,
whose log is not at hand (0.584 and 1.861 deg); this one must come close: same ship, same sea, another hour.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import coherence, csd

from stillhook.formats.motion.open import motion_form, read_ship_motion, read_tip_motion
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.ship_motion import ShipMotion, tip_motion

# Printed with four decimals.
STATED = 5e-5
# Two sensors on one ship at two times of one day.
SAME_SEA = 0.06


@pytest.fixture(scope="module")
def log(shared_data: Path) -> Path:
    file = shared_data / "ship_motion_palmer" / "NBP1406_seap-2014-08-01.txt"
    if not file.is_file():
        pytest.skip(f"no {file.name} among the measured data")
    return file


@pytest.fixture(scope="module")
def ship(log: Path) -> ShipMotion:
    return read_ship_motion(log)


@pytest.fixture(scope="module")
def heave(ship: ShipMotion) -> Recorded:
    return tip_motion(ship, ("0 m", "0 m", "0 m")).about_mean()


def altitude(log: Path) -> np.ndarray:
    """The GGA altitude of every epoch, which is positive up by the standard [m]."""
    lines = [line.split(",") for line in log.read_text().splitlines() if "$GPGGA" in line]
    return np.array([float(fields[9]) for fields in lines])


def test_the_log_is_whole(log: Path, ship: ShipMotion) -> None:
    assert motion_form(log) == "psxn"
    report = ship.report
    assert {name: count for name, count in report.counts.items() if count} == {"lines": 5000, "$PSXN,23 lines": 714}
    assert report.samples == 714
    assert report.gaps == 0
    assert report.cautions == ()
    assert report.interval == pytest.approx(1.0, abs=1e-3)
    assert report.jitter < 2e-3


def test_heave_has_the_stated_spread_and_period(ship: ShipMotion) -> None:
    assert np.std(ship.heave, ddof=1) == pytest.approx(1.0961, abs=STATED)
    # The stated period is the length of the log over its upward crossings of zero.
    crossings = int(np.sum((ship.heave[:-1] < 0.0) & (ship.heave[1:] >= 0.0)))
    assert ship.duration / crossings == pytest.approx(9.634, abs=5e-4)


def test_roll_and_pitch_come_close_to_those_of_the_other_sensor(ship: ShipMotion) -> None:
    assert ship.roll is not None
    assert ship.pitch is not None
    assert np.degrees(np.std(ship.roll, ddof=1)) == pytest.approx(0.584, rel=SAME_SEA)
    assert np.degrees(np.std(ship.pitch, ddof=1)) == pytest.approx(1.861, rel=SAME_SEA)


def test_the_altitude_shows_that_the_file_counts_heave_down(log: Path, ship: ShipMotion) -> None:
    f, cross = csd(altitude(log)[:714], ship.heave, nperseg=128)
    _, together = coherence(altitude(log)[:714], ship.heave, nperseg=128)
    waves = (f > 1 / 16.5) & (f < 1 / 5.5)
    assert together[waves].min() > 0.99
    assert np.abs(np.degrees(np.angle(cross[waves]))).max() < 3.0
    assert (
        read_ship_motion(log, heave="up")
        .report.cautions[0]
        .startswith("the $..GGA altitude moves against the heave (correlation -1.00)")
    )


def test_the_bow_rises_before_the_ship_as_it_does_in_a_head_sea(ship: ShipMotion) -> None:
    # In long head waves the slope under the ship, and so pitch, leads heave by 90 deg; in following waves it lags.
    assert ship.pitch is not None
    f, cross = csd(ship.heave, ship.pitch, nperseg=128)
    waves = (f > 0.07) & (f < 0.15)
    assert 45.0 < np.degrees(np.angle(cross[waves].sum())) < 100.0


def test_both_clocks_tell_the_same_motion(log: Path, heave: Recorded) -> None:
    other = tip_motion(read_ship_motion(log, time="instrument"), ("0 m", "0 m", "0 m")).about_mean()
    t = np.arange(5.0, 700.0, 0.1)
    # A few milliseconds of jitter at a heave velocity of up to 2.3 m/s.
    assert np.abs(other.sample(t)[0] - heave.sample(t)[0]).max() < 0.03


def test_a_wrong_sign_of_heave_would_misjudge_a_crane_aft_by_a_quarter(log: Path) -> None:
    tip = ("-30 m", "12 m", "35 m")
    right, wrong = (np.std(read_tip_motion(log, tip=tip, heave=sign).heights) for sign in ("down", "up"))
    assert wrong / right == pytest.approx(1.265, abs=0.01)


def test_a_tenth_of_a_second_of_delay_costs_about_seven_percent(heave: Recorded) -> None:
    t = np.arange(10.0, 700.0, 0.05)
    s = heave.sample(t)[0]
    for delay, cost in ((0.1, 0.07), (0.2, 0.13), (0.3, 0.20)):
        assert np.std(s - heave.sample(t - delay)[0]) / np.std(s) == pytest.approx(cost, abs=0.01)


def test_dropping_every_other_second_tells_how_good_one_hertz_is(heave: Recorded) -> None:
    # Even with 2 s between samples the curve holds this sea to a few centimetres at the seconds left out.
    even = Recorded(heave.times[::2], heave.heights[::2])
    left_out = slice(11, 691, 2)
    error = even.sample(heave.times[left_out])[0] - heave.heights[left_out]
    assert np.std(error) < 0.03 * np.std(heave.heights)


def test_velocity_and_acceleration_are_those_of_a_ship(heave: Recorded) -> None:
    _, v, a = heave.sample(np.arange(0.0, heave.duration, 0.05))
    assert np.abs(v).max() < 3.0
    assert np.abs(a).max() < 2.5
