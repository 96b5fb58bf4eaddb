"""`stillhook tune`: what it prints and writes, its exit codes, its refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.commands import case_file

from stillhook import load_crane
from stillhook.analysis.controllers import controller
from stillhook.cli import run as command
from stillhook.spec.scenario import Mode

QUICK = ["--loads", "40 %", "--speeds", "60 m/min", "--periods", "10 s"]


@pytest.fixture
def case(tmp_path: Path) -> str:
    """A case file of a short search."""
    return case_file(tmp_path, settings="budget = 20", sensors='{ delay = "0.05 s" }')


@pytest.mark.thorough
def test_it_writes_controllers_that_read_back_and_numbers_in_si(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "tuned"
    code = command(
        ["tune", case, "--controllers", "ns,ssc", "--free", "K_p,u_thr", *QUICK, "--json", "--out", str(out)]
    )
    found = json.loads(capsys.readouterr().out)
    assert code == 0
    files = ("ns-tuned.toml", "ssc-tuned.toml", "before-after.png", "trials.nc", "tune.json")
    assert {p.name for p in out.iterdir()} == set(files)
    assert found == json.loads((out / "tune.json").read_text(encoding="utf-8"))
    ssc = found["controllers"]["ssc"]
    assert [s["name"] for s in ssc["settings"]] == ["K_p", "u_thr"]
    assert [s["name"] for s in found["controllers"]["ns"]["settings"]] == ["K_p"]
    assert ssc["met"]
    assert ssc["after"]["score"] < ssc["before"]["score"] == pytest.approx(1.0)
    crane = controller(out / "ssc-tuned.toml").on(load_crane("nov-250t"))
    assert crane.control.K_p == pytest.approx(ssc["settings"][0]["after"])
    assert ssc["mode"] == Mode.SSC.value


@pytest.mark.thorough
def test_its_tables_name_before_and_after_hold_out_and_what_limits(
    case: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["tune", case, "--controllers", "strong-ssc", "--free", "K_1", *QUICK, "--verbose"]) == 0
    text = capsys.readouterr().out
    for part in ("K_1", "before", "tuned", "hold-out", "friction 30 % more", "active limits", "seed 0"):
        assert part in text


@pytest.mark.thorough
def test_a_limit_that_no_setting_keeps_gives_exit_1_and_is_named(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "none"
    code = command(
        ["tune", case, "--controllers", "ssc", "--limit", "p_max <= 60 bar", *QUICK, "--out", str(out), "--verbose"]
    )
    assert code == 1
    assert "no setting keeps the limits; exceeded: p_max" in capsys.readouterr().out
    assert not (out / "ssc-tuned.toml").exists()


@pytest.mark.thorough
def test_a_front_is_drawn_and_every_evaluation_kept(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "front"
    asked = ["tune", case, "--controllers", "ns", "--free", "K_p", "--pareto", *QUICK, "--json"]
    assert command([*asked, "--out", str(out)]) == 0
    front = json.loads(capsys.readouterr().out)["pareto"]["ns"]
    assert (out / "pareto.png").stat().st_size > 0
    errors = [p["e_c_pp_mean"] for p in front]
    assert errors == sorted(errors, reverse=True)
