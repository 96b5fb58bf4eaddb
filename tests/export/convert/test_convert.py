"""Runs and logs in other formats, read back by other programs: to the bit."""

import json
import os
import shutil

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat
from tests.parquet import read_parquet

import stillhook
from stillhook.cli import run as command
from stillhook.formats.out import FORMATS, of_run, write_table
from stillhook.logs.formats.open import open_log
from stillhook.logs.log import read_log

SIGNALS = ("s_tip", "e_c", "F_w", "p_a", "u_p")


@pytest.fixture(scope="module")
def run():
    crane = stillhook.load_crane("nov-250t")
    case = stillhook.Scenario(
        load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="20 s", warm_up="2 s", name="one"
    )
    return stillhook.simulate(crane, case, every="0.1 s", series=True)


@pytest.fixture(scope="module")
def several():
    crane = stillhook.load_crane("nov-250t")
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="8 s", warm_up="2 s")
    cases = [case.model_copy(update={"name": n, "mode": stillhook.Mode(n)}) for n in ("ns", "ssc")]
    return stillhook.simulate(crane, cases, series=True)


@pytest.fixture(scope="module")
def statistics(several):
    return several.drop_dims("time")


def test_csv_is_read_back_by_our_own_reader_with_its_units(run, tmp_path):
    file = write_table(of_run(run), tmp_path / "run.csv")
    source = open_log(file)
    assert source.headings[:2] == ("time [s]", "s_tip [m]")
    log = read_log(file)
    for name in SIGNALS:
        assert log.signals[name] == pytest.approx(run[name].values, rel=1e-12), name


def test_csv_holds_every_number_to_the_bit(run, tmp_path):
    file = write_table(of_run(run), tmp_path / "run.csv")
    table = np.genfromtxt(file, delimiter=",", names=True, deletechars="", replace_space=" ")
    for name, unit in (("e_c", "m"), ("p_a", "Pa"), ("a_tip", "m/s^2")):
        assert np.array_equal(table[f"{name} [{unit}]"], run[name].values)


def test_mat_has_vectors_units_and_origin(run, tmp_path):
    data = loadmat(write_table(of_run(run), tmp_path / "run.mat"), squeeze_me=True)
    for name in (*SIGNALS, "time"):
        assert np.array_equal(data[name], run[name].values), name
    assert str(data["units"]["p_a"]) == "Pa"
    assert "nov-250t" in str(data["facts"]["crane"])


def test_mat_of_several_cases_has_a_struct_for_each(several, tmp_path):
    data = loadmat(write_table(of_run(several), tmp_path / "runs.mat"), squeeze_me=True)
    for case in ("ns", "ssc"):
        assert np.array_equal(data[case]["e_c"].item(), several["e_c"].sel(case=case).values)


def test_mdf_has_a_group_for_each_case_with_units_and_meanings(several, tmp_path):
    from asammdf import MDF

    with MDF(write_table(of_run(several), tmp_path / "runs.mf4")) as file:
        assert len(file.groups) == 2
        for i, case in enumerate(("ns", "ssc")):
            signal = file.get("F_w", group=i)
            assert np.array_equal(signal.samples, several["F_w"].sel(case=case).values)
            assert np.array_equal(signal.timestamps, several["time"].values)
            assert signal.unit == "N"
            assert signal.comment == "wire tension"
        assert "nov-250t" in file.header.comment


def test_parquet_has_columns_with_units_and_the_case_first(several, tmp_path):
    table = read_parquet(write_table(of_run(several), tmp_path / "runs.parquet"))
    assert list(table.columns[:2]) == ["case", "time [s]"]
    for case in ("ns", "ssc"):
        column = table[table["case"] == case]["e_c [m]"].to_numpy()
        assert np.array_equal(column, several["e_c"].sel(case=case).values)


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_numbers_without_a_time_have_a_row_for_each_case(form, statistics, tmp_path):
    file = write_table(of_run(statistics), tmp_path / f"n.{form}")
    table = pd.read_csv(file, float_precision="round_trip") if form == "csv" else read_parquet(file)
    assert table["case"].tolist() == ["ns", "ssc"]
    assert table["e_c_pp [m]"].tolist() == statistics["e_c_pp"].values.tolist()
    assert table["status"].tolist() == [str(x) for x in statistics["status"].values]


def test_orcaflex_and_sima_get_kilonewtons_and_a_time_column(run, tmp_path):
    for form, separator, skip in (("orcaflex", "\t", 0), ("sima", " ", 2)):
        file = write_table(of_run(run), tmp_path / form, form)
        names = file.read_text().splitlines()[0][skip:].split(separator)
        table = np.loadtxt(file, skiprows=1, delimiter=separator)
        assert names[0] in ("Time", "time")
        assert np.array_equal(table[:, 0], run["time"].values)
        assert table[:, names.index("F_w")] == pytest.approx(run["F_w"].values / 1e3, rel=1e-15)
        assert np.array_equal(table[:, names.index("s_tip")], run["s_tip"].values)


@pytest.fixture(scope="module")
def saved(run, several, tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    for name, each in (("run", run), ("runs", several), ("numbers", several.drop_dims("time"))):
        stillhook.save_run(each, folder / f"{name}.nc")
    return folder


@pytest.fixture
def stored(saved, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file in saved.iterdir():
        shutil.copy(file, tmp_path)
    return tmp_path


@pytest.mark.long
def test_the_command_takes_signals_a_case_and_a_spacing(stored, several, capsys):
    line = ["convert", "runs.nc", "o.csv", "--case", "ssc", "--signals", "e_c,s_tip", "--every", "0.2 s", "--json"]
    assert command(line) == 0
    assert json.loads(capsys.readouterr().out)["columns"] == ["time", "e_c", "s_tip"]
    table = np.loadtxt("o.csv", delimiter=",", skiprows=1)
    assert np.array_equal(table[:, 1], several["e_c"].sel(case="ssc").values[::2])


def test_a_log_becomes_a_file_of_another_format(stored, run, capsys):
    assert command(["convert", "run.nc", "log.csv"]) == 0
    assert command(["convert", "log.csv", "log.mat"]) == 0
    data = loadmat("log.mat", squeeze_me=True)
    assert data["F_w"] == pytest.approx(run["F_w"].values, rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(
    ("line", "says"),
    [
        (["run.nc", "x.docx"], "'.docx'|\".docx\""),
        (["run.nc", "x", "--format", "tdms"], "--format"),
        (["gone.nc", "x.csv"], "no such file"),
        (["gone.csv", "x.mat"], "no such file"),
        (["run.nc", "x.csv", "--signals", "e_c,nothing"], "nothing"),
        (["runs.nc", "x.csv", "--case", "hs"], "--case"),
        (["runs.nc", "x.txt"], "--case"),
        (["numbers.nc", "x.mf4"], "time series"),
        (["numbers.nc", "x.csv", "--every", "1 s"], "--every"),
        (["run.nc", "x.csv", "--every", "0.15 s"], "whole number"),
        (["run.nc", "run.nc", "--format", "csv"], "source itself"),
        (["run.nc", "x.csv", "--mapping", "m.toml"], "--mapping"),
    ],
)
def test_what_cannot_be_converted_is_one_line_and_leaves_nothing(line, says, stored, capsys):
    import re

    before = sorted(p.name for p in stored.iterdir())
    assert command(["convert", *line]) == 2
    error = capsys.readouterr().err.strip()
    assert re.search(says, error), error
    assert "\n" not in error
    assert sorted(p.name for p in stored.iterdir()) == before


def test_a_file_that_cannot_be_finished_leaves_nothing(run, tmp_path, monkeypatch):
    def broken(content, file):
        file.write_text("half")
        raise OSError(28, os.strerror(28))

    monkeypatch.setitem(FORMATS, "csv", FORMATS["csv"]._replace(write=broken))
    with pytest.raises(stillhook.StillhookError, match=r"run\.csv"):
        write_table(of_run(run), tmp_path / "run.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_extra_is_named(run, tmp_path, monkeypatch):
    from stillhook.base import extras

    monkeypatch.setattr(extras, "installed", lambda library: False)
    with pytest.raises(stillhook.StillhookError, match=r"stillhook\[logs\]"):
        write_table(of_run(run), tmp_path / "run.parquet")
    assert list(tmp_path.iterdir()) == []
