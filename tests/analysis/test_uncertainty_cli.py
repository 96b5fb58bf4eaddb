"""`stillhook uncertainty`: what a person reads, what a program reads, and what is refused."""

import json
from pathlib import Path

import pytest
from tests.commands import case_file

from stillhook.cli import run as command
from stillhook.formats.results import load_run
from stillhook.variables import BY_NAME

DRAWS = ["--draws", "16"]


def short(folder: Path, settings: str = "") -> str:
    """A case file of a short run."""
    return case_file(folder, settings=settings, tip="sine 2.8 m 12 s", duration="32 s", warm_up="20 s")


CASE = """crane = "nov-150t"
[scenario]
load = "60 t"
s_w = "100 m"
mode = "{mode}"
tip = "sine 1 m 9 s"
duration = "30 s"
warm_up = "20 s"
"""


@pytest.mark.thorough
def test_bands_of_every_mode_in_one_table(tmp_path, capsys):
    assert command(["uncertainty", short(tmp_path), *DRAWS, "--controllers", "ns,hs,ssc", "--verbose"]) == 0
    out = capsys.readouterr().out
    for words in ("friction", "lognormal 1", "assumed", "16 draws (seed 0)", "ns", "hs", "ssc / hs", "5 to 95 %"):
        assert words in out


@pytest.mark.thorough
def test_json_has_named_keys_and_everything_that_was_asked_for(tmp_path, capsys):
    assert (
        command(
            [
                "uncertainty",
                short(tmp_path),
                *DRAWS,
                "--controllers",
                "hs,ssc",
                "--sobol",
                "--limit",
                "e_c_pp <= 1 m",
                "--json",
            ]
        )
        == 0
    )
    data = json.loads(capsys.readouterr().out)
    assert set(data) <= set(BY_NAME)
    assert set(data["cases"]) == {"hs", "ssc"}
    assert set(data["differences"]) == {"ssc / hs"}
    assert data["cases"]["ssc"]["limits"]["e_c_pp <= 1 m"]["kept"] is True
    assert {(s["case"], s["output"]) for s in data["sensitivity"]} == {
        (c, o) for c in ("hs", "ssc", "ssc / hs") for o in ("e_c_pp", "p_max")
    }
    b = data["cases"]["ssc"]["band_90"]["p_max"]
    assert b["low"] < b["median"] < b["high"]


@pytest.mark.thorough
def test_the_answer_is_no_when_every_mode_goes_beyond_a_limit_too_often(tmp_path, capsys):
    limits = ["--limit", "p_max <= 150 bar"]
    assert command(["uncertainty", short(tmp_path), *DRAWS, *limits, "--verbose"]) == 1
    assert "exceeded" in capsys.readouterr().out
    assert command(["uncertainty", short(tmp_path, "at_most = 1.0"), *DRAWS, *limits]) == 0


@pytest.mark.thorough
def test_a_case_file_runs_in_its_own_mode_and_results_are_written_whole(tmp_path, capsys):
    (tmp_path / "case.toml").write_text(CASE.format(mode="hs"))
    (tmp_path / "factors.toml").write_text('[factors]\nfriction = "default"\nleakage = { uniform = [0.5, 2.0] }\n')
    out = tmp_path / "out"
    case, factors = (str(tmp_path / name) for name in ("case.toml", "factors.toml"))
    given = [case, "--factors", factors, "--draws", "16", "--out", str(out)]
    assert command(["uncertainty", *given, "--verbose"]) == 0
    assert {p.name for p in out.iterdir()} == {"uncertainty.nc", "uncertainty.json", "bands.png"}
    run = load_run(out / "uncertainty.nc")
    assert run["case"].values.tolist() == ["hs"]
    assert run["factor"].values.tolist() == ["friction", "leakage"]
    assert "written:" in capsys.readouterr().out


@pytest.mark.thorough
def test_a_stopped_run_goes_on_from_its_store(tmp_path, capsys):
    given = ["uncertainty", short(tmp_path, 'store = "store"'), *DRAWS, "--controllers", "ssc", "--json"]
    assert command(given) == 0
    first = capsys.readouterr().out
    assert any((tmp_path / "store").iterdir())
    assert command(given) == 0
    assert capsys.readouterr().out == first


@pytest.mark.slow
def test_a_limit_is_attributed_to_factors_and_pairs_of_them(tmp_path, capsys):
    (tmp_path / "factors.toml").write_text('[factors]\nleakage = { uniform = [1.0, 3.0] }\nboost = "default"\n')
    factors = ("--factors", str(tmp_path / "factors.toml"))
    given = [
        "uncertainty",
        short(tmp_path),
        *DRAWS,
        "--controllers",
        "ssc",
        *factors,
        "--limit",
        "e_c_pp >= 15 cm",
        "--attribute",
    ]
    command([*given, "--verbose"])
    out = capsys.readouterr().out
    assert "closes the gap" in out.split("leakage")[-2] + out.split("leakage")[-1]
    command([*given, "--json"])
    data = json.loads(capsys.readouterr().out)
    assert set(data) <= set(BY_NAME)
    (name,) = data["causes"]["as_described"]
    assert [row["cause"] for row in data["causes"]["ranking"]] == ["leakage", "boost"]
    assert data["causes"]["ranking"][0]["verdicts"][name] == "closes the gap"
    assert data["causes"]["closing"][name] == ["leakage × 2.95"]
