"""Logs in which every series has a column of times of its own, and exports of TwinCAT Scope."""

import math

import numpy as np
import pytest

from stillhook.logs.log import describe, mapping_from, read_log

MAPPING = {
    "time": {"column": "t1 [s]"},
    "p_a": {"column": "PT101"},
    "p_b": {"column": "PT102"},
    "omega_m": {"column": "M1 speed"},
}
PERIOD = 6.0


def pairs(folder, step_1=0.1, step_2=0.02, rows=900):
    """Pressures and a speed that swings in PERIOD [s], each in samples of its own."""
    lines = ["t1 [s];PT101 [bar];PT102 [bar];t2 [s];M1 speed [rev/min]"]
    for i in range(rows):
        t = i * step_2
        speed = 600.0 * math.sin(2.0 * math.pi * t / PERIOD)
        lines.append(f"{i * step_1:.3f};{150.0 + 0.1 * (i % 7):.2f};{25.0 + 0.1 * (i % 5):.2f};{t:.3f};{speed:.2f}")
    file = folder / "pairs.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def test_every_series_is_on_its_own_time(tmp_path):
    """A speed was stretched five times without a word."""
    log = read_log(pairs(tmp_path), mapping_from(MAPPING, "mapping"))
    speed = log.signals["omega_m"]
    known = np.isfinite(speed)
    tops = [i for i in range(5, known.sum() - 5) if speed[known][i] == speed[known][i - 5 : i + 6].max() > 0.0]
    assert np.diff(log.t[known][tops]) == pytest.approx(np.full(len(tops) - 1, PERIOD), abs=0.25)
    assert len(tops) == 3
    assert log.t[known][-1] == pytest.approx(900 * 0.02, abs=0.2)
    assert np.isfinite(log.signals["p_a"]).all()
    assert any('omega_m: stamped by the column of times before it, "t2 [s]"' in line for line in describe(log))


def test_a_second_column_of_times_that_says_the_same_changes_nothing(tmp_path):
    log = read_log(pairs(tmp_path, 0.02, 0.02), mapping_from(MAPPING, "mapping"))
    assert not any("stamped by" in line for line in describe(log))
    assert np.isfinite(log.signals["omega_m"]).all()


SCOPE = """Name\tcrane
File\tC:\\scope\\crane.csv
Starttime of export\t132959733843760000\tMontag, 2. Mai 2022\t15:56:24.376


Name\tPT101\tPT102\tM1
SymbolComment\t\t\t
Data-Type\tREAL32\tREAL32\tREAL32
SampleTime[ms]\t10\t10\t10
Unit\tbar\tbar\trpm

"""


def test_an_export_of_twincat_scope_opens(tmp_path):
    rows = "".join(f"{10 * i}\t{150 + i % 3},5\t25,{i % 10}\t60{i % 4},0\n" for i in range(400))
    file = tmp_path / "scope.csv"
    file.write_text(SCOPE + rows, encoding="utf-8")
    mapping = {"time": "time", "p_a": "PT101", "p_b": "PT102", "omega_m": "M1"}
    log = read_log(file, mapping_from(mapping, "mapping"))
    assert log.samples == 400
    assert log.rate == pytest.approx(100.0)
    assert log.signals["p_a"].mean() == pytest.approx(151.5e5, rel=1e-3)
    assert log.signals["omega_m"].mean() == pytest.approx(601.5 * 2.0 * math.pi / 60.0, rel=1e-3)


def test_groups_of_twincat_scope_are_on_their_own_times(tmp_path):
    head = SCOPE.replace("Name\tPT101\tPT102\tM1", "Name\tPT101\tPT102\tName\tM1").replace("bar\trpm", "bar\t\trpm")
    rows = "".join(f"{100 * i}\t150,{i % 7}\t25,{i % 10}\t{20 * i}\t60{i % 4},0\n" for i in range(400))
    file = tmp_path / "scope.csv"
    file.write_text(head + rows, encoding="utf-8")
    mapping = {"time": "time", "p_a": "PT101", "p_b": "PT102", "omega_m": "M1"}
    log = read_log(file, mapping_from(mapping, "mapping"))
    known = np.isfinite(log.signals["omega_m"])
    assert log.t[known][-1] == pytest.approx(8.0, abs=0.2)
    assert log.duration == pytest.approx(40.0, abs=0.3)
