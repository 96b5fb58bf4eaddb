"""Logs and tables of motion: what is read, what is counted, and every damage refused in one line that names the place."""

import os
from collections.abc import Callable, Iterable
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stillhook.errors import MotionError, StillhookError, UnitError
from stillhook.formats.motion.open import read_ship_motion, read_tip_motion
from stillhook.sea.motion.motion import Sine, Sum
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.ship_motion import tip_motion

HEAVE, ROLL, PITCH = Sine.from_si(1.5, 9.0), Sine.from_si(2.0, 11.0, 0.5), Sine.from_si(3.0, 9.0, 1.0)  # m, deg, deg
MIDNIGHT = datetime(2014, 8, 1, tzinfo=UTC)
HEADER = "time [s],heave [m],roll [deg],pitch [deg]"
T = np.arange(0.0, 60.0)
ORIGIN = ("0 m", "0 m", "0 m")


def sentence(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode()):02X}"


def columns(t: np.ndarray) -> list[np.ndarray]:
    return [motion.sample(t)[0] for motion in (ROLL, PITCH, HEAVE)]


def psxn_lines(t: np.ndarray = T, *, sign: float = -1.0, altitude: bool = True, day: datetime = MIDNIGHT) -> list[str]:
    """A log as a ship writes it; sign -1 for heave positive down, as a Seapath sends it."""
    lines = []
    for time, roll, pitch, heave in zip(t, *columns(t), strict=True):
        received = day + timedelta(seconds=float(time) + 0.95)
        measured = day + timedelta(seconds=float(time) + 0.7)
        stamp, clock = received.strftime("%Y-%m-%dT%H:%M:%S.%fZ "), measured.strftime("%H%M%S.%f")[:9]
        lines.append(stamp + sentence(f"GPZDA,{clock},01,08,2014,,"))
        if altitude:
            lines.append(stamp + sentence(f"GPGGA,{clock},2200.1,S,01756.3,W,1,10,0.9,{heave + 1.4:.2f},M,,M,,"))
        lines.append(stamp + sentence("PSXN,20,1,0,0,0"))
        lines.append(stamp + sentence(f"PSXN,23,{roll:.2f},{pitch:.2f},218.83,{sign * heave:.2f}"))
    return lines


def csv_lines(t: np.ndarray = T) -> list[str]:
    rows = zip(t, *(columns(t)[i] for i in (2, 0, 1)), strict=True)
    return [f"{time:g},{heave:.4f},{roll:.4f},{pitch:.4f}" for time, heave, roll, pitch in rows]


def written(folder: Path, content: str | bytes | Iterable[str], name: str = "log.txt") -> Path:
    file = folder / name
    if not isinstance(content, str | bytes):
        content = "\n".join(content) + "\n"
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return file


def refused(call: Callable[[], Any]) -> str:
    """The one line with which a call is refused."""
    with pytest.raises(MotionError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 600
    return text


# What is read.


def test_a_seapath_log_gives_heave_up_and_angles_in_radians(tmp_path: Path) -> None:
    ship = read_ship_motion(written(tmp_path, psxn_lines()))
    assert ship.roll is not None
    assert ship.pitch is not None
    for found, true in zip((ship.roll, ship.pitch, ship.heave), columns(T), strict=True):
        shown = found if found is ship.heave else np.degrees(found)
        assert np.abs(shown - true).max() <= 0.005 + 1e-9  # rounded to 0.01
    assert ship.t[0] == 0.0
    assert ship.report.heave == "down"
    assert ship.report.cautions == ()
    assert "positive down in the file, turned over" in ship.report.describe()


def test_the_altitude_tells_when_the_sign_of_heave_is_wrong(tmp_path: Path) -> None:
    up = written(tmp_path, psxn_lines(sign=1.0))
    wrong, right = read_ship_motion(up), read_ship_motion(up, heave="up")
    assert np.allclose(wrong.heave, -right.heave)
    assert 'so use heave="up"' in wrong.report.cautions[0]
    assert right.report.cautions == ()
    assert right.report.heave == "up"
    silent = written(tmp_path, psxn_lines(sign=1.0, altitude=False), "silent.txt")
    assert read_ship_motion(silent).report.cautions == ()


def test_the_instrument_clock_is_free_of_the_delays_of_the_logger(tmp_path: Path) -> None:
    late = np.random.default_rng(0).uniform(0.0, 0.4, len(T))
    lines = [
        f"{(MIDNIGHT + timedelta(seconds=float(t + d))).isoformat()} {line.split(' ', 1)[1]}"
        for t, d, group in zip(T, late, zip(*[iter(psxn_lines())] * 4, strict=True), strict=True)
        for line in group
    ]
    file = written(tmp_path, lines)
    logger, instrument = read_ship_motion(file), read_ship_motion(file, time="instrument")
    assert logger.report.jitter > 0.1
    assert any("jitter" in caution for caution in logger.report.cautions)
    assert instrument.report.jitter < 1e-9
    assert np.allclose(instrument.t, T)
    assert instrument.report.time == "instrument"


def test_the_instrument_clock_passes_midnight(tmp_path: Path) -> None:
    file = written(tmp_path, psxn_lines(day=MIDNIGHT - timedelta(seconds=30)))
    assert np.allclose(read_ship_motion(file, time="instrument").t, T)


@pytest.mark.parametrize(
    "before",
    [
        "2014-08-01T00:00:{:02d}.5Z ",
        "seap 2014-08-01T00:00:{:02d}.5+00:00\t",
        "2014-08-01 00:00:{:02d}.5 ",
        "20140801T0000{:02d},",
    ],
)
def test_times_of_receipt_in_several_spellings(tmp_path: Path, before: str) -> None:
    body = [line for line in psxn_lines() if "PSXN,23" in line]
    file = written(tmp_path, [before.format(i) + line.split(" ", 1)[1] for i, line in enumerate(body)])
    assert np.allclose(read_ship_motion(file).t, T)


def test_damaged_lines_are_left_out_and_counted(tmp_path: Path) -> None:
    lines = psxn_lines()
    samples = [i for i, line in enumerate(lines) if "PSXN,23" in line]
    lines[samples[3]] = lines[samples[3]].replace("218.83", "218.84")  # wrong checksum
    lines[samples[10]] = lines[samples[10]][:50]  # cut short
    stamp = lines[samples[20]].split(" ")[0]
    lines[samples[20]] = f"{stamp} {sentence('PSXN,23,,1.00,218.83,0.50')}"
    lines[samples[30] - 1] = f"{stamp} {sentence('PSXN,20,1,2,0,0')}"  # heave invalid until the next flag
    lines[samples[40]] = "x " + lines[samples[40]].split(" ", 1)[1]
    lines.insert(samples[50] + 1, lines[samples[50]])  # twice
    lines.append(lines[samples[45]])  # back in time
    lines.insert(7, "\x00\xff garbage $$$ \x1b*")
    report = read_ship_motion(written(tmp_path, lines)).report
    assert dict(report.counts) == {
        "lines": 243,
        "$PSXN,23 lines": 62,
        "checksum errors": 1,
        "without checksum": 1,
        "missing fields": 1,
        "flagged invalid": 1,
        "without time": 1,
        "duplicates": 1,
        "times running backwards": 1,
    }
    assert report.samples == 55
    assert report.gaps == 5
    assert report.longest == pytest.approx(2.0)
    assert "5 gaps (longest 2 s at 2 s)" in report.describe()
    assert "checksum errors 1" in report.describe()


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace(",", "\t"),
        lambda text: text.replace(",", ";").replace(".", ","),
        lambda text: text.replace(",", ", ").replace("time [s]", "Time [s]").replace(" [", "["),
        lambda text: "# comment\n\n" + text.replace("\n", "\n# more\n\n", 3) + "\n\n",
        lambda text: "\n".join(",".join(f'"{field}"' for field in line.split(",")) for line in text.split("\n")),
        lambda text: text.replace("\n", ",note\n"),
    ],
    ids=["plain", "mark", "crlf", "cr", "tab", "semicolon", "spaces", "comments", "quotes", "other-column"],
)
def test_tables_are_read_however_they_are_written(tmp_path: Path, change: Callable[[str], str]) -> None:
    ship = read_ship_motion(written(tmp_path, change("\n".join((HEADER, *csv_lines()))), "wrong.ending"))
    assert np.allclose(ship.heave, HEAVE.sample(T)[0], atol=1e-4)
    assert np.allclose(np.degrees(ship.roll), ROLL.sample(T)[0], atol=1e-4)
    assert np.allclose(np.degrees(ship.pitch), PITCH.sample(T)[0], atol=1e-4)
    assert ship.report.heave == "up"


def test_units_and_stamps_of_a_table_are_used(tmp_path: Path) -> None:
    rows = [f"{1000 * i},{100 * i % 700},{i % 3 / 100}" for i in range(60)]
    ship = read_ship_motion(written(tmp_path, ["time [ms],heave [mm],pitch [rev]", *rows]))
    assert ship.t[-1] == 59.0
    assert ship.heave[1] == pytest.approx(0.1)
    assert ship.pitch is not None
    assert ship.pitch[2] == pytest.approx(0.02 * 2 * np.pi)
    assert ship.roll is None


def test_stamps_of_a_table_are_times(tmp_path: Path) -> None:
    rows = [f"2014-08-01T00:00:{i:02d}.5Z,{np.sin(i / 2):.3f}" for i in range(60)]
    assert np.allclose(read_ship_motion(written(tmp_path, ["time [UTC],heave [m]", *rows])).t, T)


def test_heave_down_turns_a_table_over(tmp_path: Path) -> None:
    file = written(tmp_path, [HEADER, *csv_lines()])
    assert np.allclose(read_ship_motion(file, heave="down").heave, -read_ship_motion(file).heave)


def test_a_tip_column_is_the_motion_of_the_tip(tmp_path: Path) -> None:
    rows = [f"{t:g},{s:.4f}" for t, s in zip(T, HEAVE.sample(T)[0], strict=True)]
    motion = read_tip_motion(written(tmp_path, ["time [s],tip [m]", *rows]))
    assert isinstance(motion, Recorded)
    assert np.allclose(motion.heights, HEAVE.sample(T)[0], atol=1e-4)
    assert "tip positive up in the file" in motion.report


def test_both_kinds_of_file_give_the_same_tip(tmp_path: Path) -> None:
    log, table = written(tmp_path, psxn_lines()), written(tmp_path, [HEADER, *csv_lines()], "b.txt")
    tip = ("-20 m", "12 m", "35 m")
    a, b = (read_tip_motion(file, tip=tip) for file in (log, table))
    # 0.005 m and 0.005 deg of rounding, at 20 and 12 m, and 35 m at small angles.
    assert np.abs(a.heights - b.heights).max() < 0.005 + np.radians(0.005) * (20 + 12 + 35 * 0.1)
    assert "-20 m forward, 12 m to port, 35 m up" in a.report


def test_start_and_duration_choose_a_piece(tmp_path: Path) -> None:
    ship = read_ship_motion(written(tmp_path, psxn_lines()), start="10 s", duration="0.5 min")
    assert len(ship.t) == 31
    assert ship.t[0] == 0.0
    assert np.allclose(ship.heave, HEAVE.sample(T[10:41])[0], atol=0.006)


@pytest.mark.slow
def test_fast_logs_are_thinned_unless_told_otherwise(tmp_path: Path) -> None:
    t = np.arange(0.0, 60.0, 0.1)
    file = written(tmp_path, psxn_lines(t))
    motion = read_tip_motion(file, tip=ORIGIN)
    assert "Least squares with a point every 0.4992 s" in motion.report
    fine = np.arange(5.0, 55.0, 0.01)
    assert np.abs(motion.sample(fine)[2] - HEAVE.sample(fine)[2]).max() < 0.07
    assert "a point every 0.9983 s" in read_tip_motion(file, tip=ORIGIN, every="1 s").report
    assert "beyond gravity" in refused(lambda: read_tip_motion(file, tip=ORIGIN, every=None))


@pytest.mark.slow
@pytest.mark.parametrize(("gap", "error"), [(3.0, 0.06), (4.0, 0.2), (5.0, 0.6)])
def test_a_bridged_gap_costs_what_is_stated(tmp_path: Path, gap: float, error: float) -> None:
    # A sea of 0.84 m standard deviation, the worst of fifty.
    periods, amplitudes = (5.0, 6.0, 7.0, 8.5, 9.6, 11.0, 13.0, 15.0), (0.1, 0.15, 0.3, 0.5, 0.7, 0.6, 0.4, 0.2)
    t, worst = T[(T <= 30.0) | (T - gap >= 30.0)], 0.0
    random = np.random.default_rng(7)
    for _ in range(50):
        sea = Sum(Sine.from_si(A, P, random.uniform(0.0, 6.3)) for A, P in zip(amplitudes, periods, strict=True))
        rows = [f"{time:g},{s:.2f}" for time, s in zip(t, sea.sample(t)[0], strict=True)]
        motion = read_tip_motion(written(tmp_path, ["time [s],tip [m]", *rows]))
        fine = np.arange(25.0, 40.0, 0.01)
        worst = max(worst, float(np.abs(motion.sample(fine)[0] - sea.sample(fine)[0]).max()))
    assert error / 3 < worst < error


# What is refused.


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "log.txt: is empty."),
        (bytes(5000), "log.txt: is binary, not text."),
        (bytes(range(256)) * 40, "log.txt: is binary, not text."),
        (b"PK\x03\x04 whatever", "is a zip or Excel file"),
        (b"\x1f\x8b whatever", "is a gzip file"),
        ((HEADER + "\n0,0,0,0\n").encode("utf-16"), "is UTF-16 text. Save it as CSV UTF-8."),
        (b"hello world\nfoo\n", "is neither a log of"),
        (b"0,1\n1,2\n", "is neither a log of"),
        (b"# time\n# heave\n", "is neither a log of"),
        (HEADER, "has a header (line 1) and no data below it."),
        ("# only\n\n" + HEADER + "\n\n \n", "has a header (line 3) and no data below it."),
        ("time [s],roll [°]\n0,0".encode("latin-1"), 'line 1: no column "heave [m]" among "time [s]", "roll [°]"'),
        (f"{HEADER}\n0,0,0,0\n1,1,1,ä\n".encode("latin-1"), "line 3: is not UTF-8 text."),
        ("time [s],surge [m]\n0,1\n", 'line 1: no column "heave [m]" among "time [s]", "surge [m]". Begin with'),
        ("uhr [s],heave [m]\n0,1\n", 'line 1: no column "time [s]" among'),
        ("time [s],heave [m],heave [m]\n0,1,1\n", 'line 1: columns "heave [m]" and "heave [m]" both read as heave.'),
        ("time [s],tip [m]\n0,1\n", "holds a column tip, so the motion of a crane tip."),
        (f"{HEADER}\n0,0,0,0\n#\n1,1,x1,0\n2,0,0,0", 'line 4: roll [deg] = "x1" is not a finite number. Correct'),
        (f"{HEADER}\n0,0,0,0\n1,nan,0,0\n2,NaN,0,0\n3,0,0,0", 'line 3: heave [m] = "nan" is not a finite number (2'),
        (f"{HEADER}\n0,0,0,0\n1,inf,0,0\n2,0,0,0", 'line 3: heave [m] = "inf" is not a finite number'),
        (f"{HEADER}\n0,0,0,0\n1,,0,0\n2,0,0,0", 'line 3: heave [m] = "" is not a finite number'),
        (f"{HEADER}\n0,0,0,0\n1,0,0,0\n2,0", 'line 4: roll [deg] = "" is not a finite number. The file seems cut off'),
        (f"{HEADER}\n0,0,0,0\n1,0,0,0,0\n", "line 3: 5 fields where the header has 4. A decimal comma needs"),
        (f"{HEADER}\n0,0\n1,0,0,0\n", "line 2: 2 fields where the header has 4. Correct the line."),
        (f"{HEADER}\n0,0,0,0\n1,1,0,0\n1,2,0,0\n", "line 4: time repeats 1 s after 1 s (1 in all)."),
        (f"{HEADER}\n0,0,0,0\n2,1,0,0\n1,2,0,0\n", "line 4: time runs back to 1 s after 2 s (1 in all)."),
        (f"{HEADER}\n0,0,0,0\n1,1,1,1\n", "2 samples. A motion needs 6 or more."),
        ("time [UTC],heave [m]\nyesterday,1\n2014-08-01T00:00:00Z,2", 'line 2: time [UTC] = "yesterday" is not an ISO'),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path: Path, content: str | bytes, says: str) -> None:
    text = refused(lambda: read_ship_motion(written(tmp_path, content)))
    assert says in text
    assert text.startswith("log.txt: ")


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("time [s],heave", 'line 1: column "heave" has no unit. Write it as "heave [m]" (allowed: m, cm, mm, km).'),
        ("time,heave [m]", 'line 1: column "time" has no unit. Write it as "time [s]" (allowed: s, ms, min, h, d,'),
        ("time [s],heave [ft]", 'line 1: column "heave [ft]": unit "ft" is not one of m, cm, mm, km.'),
        ("time [s],heave [s]", 'line 1: column "heave [s]": unit "s" is not one of m, cm, mm, km.'),
        ("time [s],heave []", 'line 1: column "heave []": unit "" is not one of m, cm, mm, km.'),
    ],
)
def test_units_in_headers_are_demanded(tmp_path: Path, header: str, says: str) -> None:
    with pytest.raises(UnitError) as caught:
        read_ship_motion(written(tmp_path, [header, "0,1", "1,2"]))
    assert f"log.txt: {says}" in str(caught.value)


def change(lines: list[str], row: int, line: str) -> list[str]:
    return [*lines[:row], line, *lines[row + 1 :]]


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (change(csv_lines(), 30, "30,150,0,0"), "line 32: heave 150 m is beyond 20 m. Check the unit"),
        (change(csv_lines(), 30, "30,0,90,0"), "line 32: roll 90 deg is beyond 45 deg. Check the unit"),
        (change(csv_lines(), 30, "30,0,0,-46"), "line 32: pitch -46 deg is beyond 45 deg. Check the unit"),
        (change(csv_lines(), 30, "30,19,0,0"), "line 32: heave jumps from 1.477 m to 19 m in 1 s."),
        ([f"{i},0.5,0,0" for i in range(9)], "heave stays at 0.5 m throughout: the sensor was stuck or off."),
        (csv_lines(T[(T < 20) | (T > 30)]), "line 21: gap of 12 s from 19 s on is longer than max_gap 5 s. Choose a"),
    ],
)
def test_what_no_ship_does_is_refused(tmp_path: Path, lines: list[str], says: str) -> None:
    assert says in refused(lambda: read_ship_motion(written(tmp_path, [HEADER, *lines])))


def test_a_piece_without_the_fault_is_read(tmp_path: Path) -> None:
    file = written(tmp_path, [HEADER, *change(csv_lines(T[(T < 20) | (T > 30)]), 40, "51,150,0,0")])
    assert read_ship_motion(file, start="31 s", duration="15 s").duration == 15.0
    assert read_ship_motion(file, duration="19 s").report.gaps == 0


def test_units_that_are_off_are_pointed_out(tmp_path: Path) -> None:
    flat = written(tmp_path, [HEADER.replace("heave [m]", "heave [mm]"), *csv_lines()])
    assert any("heave hardly moves (standard deviation 1.0" in c for c in read_ship_motion(flat).report.cautions)
    rows = [f"{t:g},{h:.3f},{np.radians(r):.5f},{p:.3f}" for t, r, p, h in zip(T, *columns(T), strict=True)]
    radians = written(tmp_path, [HEADER, *rows])
    assert any("roll hardly turns" in caution for caution in read_ship_motion(radians).report.cautions)
    slow = written(tmp_path, [HEADER, *csv_lines(T[::2])])
    assert any("too slow for waves shorter than 10 s" in caution for caution in read_ship_motion(slow).report.cautions)
    stuck = [*csv_lines(T[:20]), *(f"{i},0.3,0.1,0.1" for i in range(20, 40)), *csv_lines(T[40:])]
    assert any(
        "heave is stationary for 20 s" in c
        for c in read_ship_motion(written(tmp_path, [HEADER, *stuck])).report.cautions
    )


@pytest.mark.parametrize(
    ("edit", "options", "says"),
    [
        (lambda line: line.split(" ", 1)[1], {}, "without time 60). Lines need a checksum and a time before their $"),
        (lambda line: line.split("*")[0], {}, "no usable $PSXN,23 line (lines 240, $PSXN,23 lines 60, without"),
        (
            lambda line: line.replace("ZDA", "XXX").replace("GGA", "XXX"),
            {"time": "instrument"},
            'or use time="logger".',
        ),
        (lambda line: line.replace("PSXN,23", "PSXN,24"), {}, "log.txt: no $PSXN,23 line in 240 lines. Give a Seapath"),
    ],
)
def test_logs_without_usable_lines_say_why(
    tmp_path: Path, edit: Callable[[str], str], options: dict[str, Any], says: str
) -> None:
    file = written(tmp_path, [edit(line) for line in psxn_lines()])
    assert says in refused(lambda: read_ship_motion(file, **options))


def test_gaps_of_a_log_name_line_place_and_way_out(tmp_path: Path) -> None:
    text = refused(lambda: read_ship_motion(written(tmp_path, psxn_lines(T[(T < 20) | (T >= 30)]))))
    assert "line 80: gap of 11 s from 19 s on is longer than max_gap 5 s." in text
    assert 'such as start="30 s", or raise max_gap.' in text
    backwards = [*psxn_lines(T[:20]), *psxn_lines(T[:10]), *psxn_lines(T[30:])]
    assert "max_gap 5 s (times running backwards 10). Choose" in refused(
        lambda: read_ship_motion(written(tmp_path, backwards))
    )


def test_samples_faster_than_the_instrument_clock_are_refused(tmp_path: Path) -> None:
    lines = [
        line
        for i, line in enumerate(psxn_lines(np.arange(0.0, 60.0, 0.1), altitude=False))
        if "ZDA" not in line or i % 30 == 0
    ]
    assert "share the instrument time of the one before" in refused(
        lambda: read_ship_motion(written(tmp_path, lines), time="instrument")
    )


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"heave": "sideways"}, 'heave = "sideways" is not one of "up", "down"'),
        ({"time": "sun"}, 'time = "sun" is not one of "logger", "instrument".'),
        ({"start": "70 s"}, "start 70 s and duration to its end are not within the record of 59 s."),
        ({"start": "50 s", "duration": "20 s"}, "start 50 s and duration 20 s are not within the record of 59 s."),
        ({"duration": "-5 s"}, "are not within the record"),
        ({"start": "10 s", "duration": "3 s"}, "4 samples. A motion needs 6 or more."),
    ],
)
def test_options_are_checked(tmp_path: Path, options: dict[str, Any], says: str) -> None:
    assert says in refused(lambda: read_ship_motion(written(tmp_path, psxn_lines()), **options))
    with pytest.raises(UnitError, match='max_gap = "5": no unit; write "5 s"'):
        read_ship_motion(written(tmp_path, psxn_lines()), max_gap="5")


def test_tip_and_file_must_fit(tmp_path: Path) -> None:
    ship = written(tmp_path, [HEADER, *csv_lines()])
    heave_only = written(
        tmp_path, ["time [s],heave [m]", *(",".join(row.split(",")[:2]) for row in csv_lines())], "heave.csv"
    )
    tip = written(tmp_path, ["time [s],tip [m]", *(",".join(row.split(",")[:2]) for row in csv_lines())], "tip.csv")
    assert "holds the motion of the ship, not of the crane tip. Give the way" in refused(lambda: read_tip_motion(ship))
    assert "has no roll and pitch" in refused(lambda: read_tip_motion(heave_only, tip=("1 m", "0 m", "0 m")))
    assert read_tip_motion(heave_only, tip=ORIGIN).duration == 59.0
    assert "Leave heave out" in refused(lambda: read_tip_motion(tip, heave="down"))
    assert "Read it without tip=" in refused(lambda: read_tip_motion(tip, tip=ORIGIN))
    assert "Leave time out" in refused(lambda: read_tip_motion(tip, time="logger"))
    assert "is not three lengths" in refused(lambda: read_tip_motion(ship, tip=("1 m", "2 m")))  # type: ignore[arg-type]
    assert "is more than 300 m" in refused(lambda: read_tip_motion(ship, tip=("1 km", "0 m", "0 m")))
    with pytest.raises(UnitError, match="tip x = 1: a bare number"):
        read_tip_motion(ship, tip=(1, 2, 3))  # type: ignore[arg-type]


def test_folders_absent_files_and_pipes_are_refused(tmp_path: Path) -> None:
    assert "is a folder. Give one log file in it." in refused(lambda: read_ship_motion(tmp_path))
    assert "no such file" in refused(lambda: read_ship_motion(tmp_path / "absent.csv"))
    assert "cannot be read" in refused(lambda: read_ship_motion("a\0b"))
    assert "cannot be read" in refused(lambda: read_ship_motion("x" * 5000))
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        assert "is not an ordinary file" in refused(lambda: read_ship_motion(tmp_path / "pipe"))


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="rights do not bind this user")
def test_a_file_without_rights_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, psxn_lines())
    file.chmod(0)
    assert "cannot be read (Permission denied)" in refused(lambda: read_ship_motion(file))


@pytest.mark.long
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150)
@given(st.data())
def test_damage_anywhere_gives_motion_or_one_line(tmp_path: Path, data: st.DataObject) -> None:
    whole = "\n".join(data.draw(st.sampled_from([psxn_lines(T[:20]), [HEADER, *csv_lines(T[:20])]]))).encode()
    begin = data.draw(st.integers(0, len(whole)))
    end = data.draw(st.integers(begin, min(len(whole), begin + 200)))
    damaged = whole[:begin] + data.draw(st.binary(max_size=60)) + whole[end:]
    try:
        motion = read_tip_motion(written(tmp_path, damaged), tip=("-20 m", "12 m", "35 m"))
    except StillhookError as problem:
        assert "\n" not in str(problem)  # noqa: PT017 - most damage is refused, some is harmless
    else:
        assert np.all(np.isfinite(motion.heights))


def test_one_reading_of_a_ship_serves_many_tips(tmp_path: Path) -> None:
    ship = read_ship_motion(written(tmp_path, psxn_lines()))
    assert np.array_equal(tip_motion(ship, ORIGIN).heights, ship.heave)
    assert not np.array_equal(tip_motion(ship, ("10 m", "0 m", "0 m")).heights, ship.heave)
