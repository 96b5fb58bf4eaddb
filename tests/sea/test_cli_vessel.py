"""stillhook vessel: list, show, check, as a user meets them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.commands import answer, refusal
from tests.sea.plank import plank

from stillhook.cli import run
from stillhook.formats.vessel.csv import write_rao_csv
from stillhook.library.catalogue import vessels
from stillhook.variables import BY_NAME

SHIP = plank(np.linspace(0.1, 1.5, 8), np.radians(np.arange(0.0, 360.0, 30.0)))
NESTED = {
    "motion",
    "size",
    "value_re",
    "value_im",
    "limit_re",
    "limit_im",
}  # names within the rows of peaks and motions


@pytest.fixture
def file(tmp_path: Path) -> str:
    return str(write_rao_csv(SHIP, tmp_path / "plank.csv", source="closed form"))


@pytest.mark.slow
def test_the_library_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["list", "vessels", "--verbose"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in vessels())


def test_a_file_is_shown_with_its_reference_point_range_and_largest_motions(
    capsys: pytest.CaptureFixture[str], file: str
) -> None:
    assert run(["vessel", file, "--verbose"]) == 0
    text = capsys.readouterr().out
    assert "reference point: middle" in text
    assert "8 periods from 4.189 to 62.83 s, 12 headings at most 30 deg apart, deep water" in text
    assert "exp(+i omega t); x forward, y port, z up" in text


def test_the_answer_for_machines_has_known_names_and_si_units(capsys: pytest.CaptureFixture[str], file: str) -> None:
    shown = answer(capsys, "vessel", file, "--at", "x=-20 m, y=5 m")
    checked = answer(capsys, "vessel", "--check", file)
    nested = [key for row in (*shown["peaks"], *checked["motions"]) for key in row]
    assert not {key for key in (*shown, *checked, *nested) if key not in BY_NAME} - NESTED
    assert shown["water_depth"] is None
    assert np.allclose(
        shown["z_per_wave"], np.abs(SHIP.vertical(SHIP.omega, SHIP.beta, -20.0, 5.0)), atol=1e-4
    )  # six digits in the file
    assert checked["passed"]
    assert checked["motions"][2]["share"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.thorough
def test_a_picture_and_the_numbers_are_written(capsys: pytest.CaptureFixture[str], file: str, tmp_path: Path) -> None:
    assert run(["vessel", file, "--at", "x=-20 m, y=5 m", "--out", str(tmp_path / "out")]) == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "stillhook-manifest.json",
        "vessel.json",
        "vessel.png",
    ]


def test_a_vessel_that_does_not_ride_is_shown_with_its_numbers_by_check_and_refused_by_show(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    wrong = str(write_rao_csv(replace(SHIP, H=np.conj(SHIP.H)), tmp_path / "wrong.csv", source="closed form"))
    assert run(["vessel", "--check", wrong, "--verbose"]) == 1
    text = capsys.readouterr().out
    assert "wrong" in text
    assert "It would fit with time the other way" in text
    assert not answer(capsys, "vessel", "--check", wrong, code=1)["passed"]
    assert "wrong.csv" in refusal(capsys, "vessel", wrong)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("no-such-ship",), "no such vessel file"),
        (("no-such-ship", "--check"), "no such vessel file"),
        (("FILE", "--at", "x=-20, y=3 m"), 'write "-20 m"'),
        (("FILE", "--at", "-20 m"), "is not x, y or z with a length"),
        ((), "Missing argument"),
    ],
)
def test_bad_input_ends_in_one_line(
    capsys: pytest.CaptureFixture[str], file: str, arguments: tuple[str, ...], text: str
) -> None:
    assert text in refusal(capsys, "vessel", *(file if a == "FILE" else a for a in arguments))
