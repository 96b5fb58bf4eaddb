"""`stillhook live parameters` reads a log as any other command does, and answers with an interval, or with one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import stillhook
from stillhook.cli import run

NAMES = ("s_tip", "s_w", "omega_m", "p_a", "p_b", "p_hp", "alpha_m", "alpha_pm", "alpha_p", "F_w")
UNITS = {"s_tip": "m", "s_w": "m", "omega_m": "rad/s", "p_a": "Pa", "p_b": "Pa", "p_hp": "Pa", "F_w": "N"}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of the crane file's own winch."""
    crane = stillhook.load_crane("nov-250t")
    case = stillhook.Scenario(load="60 t", s_w="800 m", mode="ssc", tip="sine 0.8 m 9 s", duration="150 s")
    data = stillhook.simulate(crane, case, every="0.02 s")
    file = tmp_path_factory.mktemp("friction") / "log.csv"
    head = ",".join(["time [s]", *(f"{name} [{UNITS.get(name, '1')}]" for name in NAMES)])
    np.savetxt(file, np.column_stack([data.time, *(data[n] for n in NAMES)]), delimiter=",", header=head, comments="")
    return file


def test_a_winch_that_is_its_file_has_the_friction_of_its_file(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["live", "parameters", str(log), "--crane", "nov-250t", "--json"]) == 0
    last = json.loads(capsys.readouterr().out)["last"]
    for scale in (last["estimate"]["loss"], last["estimate"]["system"]):
        assert scale["low"] < 1.0 < scale["high"]
        assert scale["high"] - scale["low"] < 0.1
    assert last["applied"] is None  # the crane has no certificate
    gas = last["parameters"]["gas"]["estimate"]["value"]
    assert gas["low"] < 1.0 < gas["high"]


def test_the_table_says_what_the_estimate_rests_on(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["live", "parameters", str(log), "--crane", "nov-250t", "--verbose"]) == 0
    out = capsys.readouterr().out
    assert "system friction, if the motors' loss is as in the file" in out
    assert "no certificate" in out
    assert "leakage of the active circuit over the crane file's" in out
    assert "signals missing: u_p" in out


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--crane", "nov-100t-electric"], "has no pressures of both lines"),
        (["--crane", "nov-250t", "--load", "60"], "--load"),
        (["--crane", "nov-250t", "--mapping", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_what_cannot_be_is_one_line(log: Path, words: list[str], line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["live", "parameters", str(log), *words]) == 2
    error = capsys.readouterr().err
    assert line in error
    assert error.count("\n") == 1
