"""`stillhook payload`: tables for people, SI for machines, one line for mistakes."""

import json

import pytest
from tests import commands

from stillhook.cli import run
from stillhook.library.catalogue import payloads, read_payload
from stillhook.variables import BY_NAME


def answer(capsys, *arguments):
    return commands.answer(capsys, "payload", *arguments)


def test_the_list_names_every_payload(capsys):
    assert [row["payload"] for row in commands.answer(capsys, "list", "payloads")] == list(payloads())
    assert run(["list", "payloads", "--verbose"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in payloads())


@pytest.mark.slow
@pytest.mark.parametrize("name", payloads())
def test_a_sheet_gives_its_numbers_in_si_under_known_names(capsys, name):
    found = answer(capsys, name)
    load = read_payload(name)
    assert set(found) | set(found["levels"][0]) | set(found["sources"][0]) - {"source"} <= set(BY_NAME)
    assert found["mass"] == load.mass
    assert found["A33"] == pytest.approx(load.covered(1025.0).A33)
    assert found["levels"][-1]["h"] == pytest.approx(found["reach"])
    assert {s["field"] for s in found["sources"]} >= set(load.sources)


@pytest.mark.slow
def test_a_payload_of_ones_own_is_shown_in_the_water_that_is_asked_for(capsys, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('mass = "40 t"\nshape = "disc"\ndiameter = "5 m"\nheight = "0.4 m"\n', encoding="utf-8")
    salt, fresh = (answer(capsys, str(path), "--rho", f"{rho} kg/m^3") for rho in (1025, 1000))
    assert fresh["A33"] == pytest.approx(salt["A33"] * 1000.0 / 1025.0)
    assert fresh["W_sub"] > salt["W_sub"]
    assert run(["payload", str(path), "--verbose"]) == 0
    out = capsys.readouterr().out
    assert "mine: payload of your own (disc)" in out
    assert "given in mine.toml" in out


@pytest.mark.slow
def test_a_picture_and_numbers_are_written_on_request_only(capsys, tmp_path):
    out = tmp_path / "sheet"
    assert run(["payload", "spool-20t"]) == 0
    assert not out.exists()
    assert run(["payload", "spool-20t", "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["payload.json", "payload.png", "stillhook-manifest.json"]
    assert json.loads((out / "payload.json").read_text(encoding="utf-8"))["payload"] == "spool-20t"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("mud-mat",), 'error: No payload "mud-mat": the library has manifold-60t'),
        (("spool-20t", "--rho", "1025"), 'error: --rho = "1025": no unit; write "1025 kg/m^3"'),
        (
            ("spool-20t", "--rho", "0 kg/m^3"),
            'error: --rho = "0 kg/m^3": is not the density of sea water, 900 to 1300 kg/m^3',
        ),
        (
            ("spool-20t", "--rho", "9000 kg/m^3"),
            'error: --rho = "9000 kg/m^3": is not the density of sea water',
        ),
        (("missing.toml",), 'error: "missing.toml": no such file.'),
    ],
)
def test_mistakes_end_in_one_line(capsys, arguments, line):
    assert run(["payload", *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith(line)
    assert said.count("\n") == 1
