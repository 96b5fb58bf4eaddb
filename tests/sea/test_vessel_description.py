"""Vessel descriptions: a TOML beside a file of motions, wherever a vessel is named."""

from pathlib import Path

import numpy as np
import pytest
from tests.sea.other_programs import refused, wamit_text, written
from tests.sea.plank import plank_motions

from stillhook.cli import run
from stillhook.errors import SeaError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.toml.kinds import LIBRARY
from stillhook.plan.file import load_plan

OMEGA, SIDE = np.linspace(0.1, 1.5, 8), np.arange(0.0, 181.0, 30.0)


@pytest.fixture
def plank(tmp_path: Path) -> Path:
    """A description of a file whose rotations are times 60 m."""
    written(tmp_path / "plank.4", wamit_text(OMEGA, SIDE, plank_motions(OMEGA, np.radians(SIDE)), L=60.0))
    return written(tmp_path / "mine.toml", 'motions = "plank.4"\nlength_scale = "60 m"\n')


def test_the_command_line_reads_a_description(plank: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["vessel", "--check", str(plank), "--verbose"]) == 0
    assert "length scale 60 m" in capsys.readouterr().out
    assert run(["vessel", "--check", str(plank.parent / "plank.4")]) == 1
    waves = ("--wave", "jonswap Hs=2 m Tp=9 s", "--heading", "165 deg")
    assert run(["tip", str(plank), "--at", "x=-20 m, y=-8 m", *waves]) == 0


@pytest.mark.slow
def test_lift_files_and_plans_name_a_description(plank: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for kind, name in (("lift", "anchor-to-3000m"), ("plan", "template-to-1500m")):
        text = (LIBRARY / "lifts" / f"{name}.toml").read_text(encoding="utf-8")
        line = next(line for line in text.splitlines() if line.startswith("vessel ="))
        written(plank.parent / f"{kind}.toml", text.replace(line, 'vessel = "mine.toml"'))
    assert load_lift(plank.parent / "lift.toml").vessel.name == "plank"
    assert load_plan(plank.parent / "plan.toml").vessel.name == "plank"


def test_a_description_that_is_wrong_ends_in_one_line(plank: Path) -> None:
    def line(text: str) -> str:
        return refused(written(plank, text))

    assert "mine.toml: motions: missing" in line('length_scale = "60 m"\n')
    assert 'mine.toml: motions = "none.4": no such file next to this file' in line('motions = "none.4"\n')
    assert "is TOML as well. Name the file that holds the motions" in line('motions = "mine.toml"\n')
    assert "massive" in line('motions = "plank.4"\nmassive = "9 t"\n')
    assert "length_scale" in line('motions = "plank.4"\nlength_scale = "60 kg"\n')
    assert "length_scale" in line('motions = "plank.4"\nlength_scale = "-1 m"\n')
    assert "body" in line('motions = "plank.4"\nbody = 0\n')
    assert (
        "plank.4: mass is stated, and WAMIT .4 files have no use for it. They take body, length_scale, depth. Leave it"
        " out." in line('motions = "plank.4"\nmass = "9 t"\n')
    )
    assert "not valid TOML" in line("motions = plank")
    assert "is empty" in line("")
    written(plank.parent / "lift.toml", (LIBRARY / "lifts" / "anchor-to-3000m.toml").read_text(encoding="utf-8"))
    assert "is a lift file, not a vessel file" in refused(plank.parent / "lift.toml")


def test_forms_that_state_everything_take_nothing(plank: Path) -> None:
    from stillhook.formats.vessel.csv import write_rao_csv

    write_rao_csv(read_vessel(plank), plank.parent / "plank.csv", source="plank")
    assert (
        "CSV files with declared conventions have no use for it. They state everything themselves. Leave it out."
        in refused(written(plank, 'motions = "plank.csv"\ndepth = "90 m"\n'))
    )
    with pytest.raises(SeaError, match="is not a known vessel file"):
        read_vessel(written(plank.parent / "none.txt", "nothing\n"))


@pytest.mark.parametrize("content", [b"\x00\x01\x02", b"", b"PK\x03\x04", b"\xff\xfe1 2 3", b"1 2 3\n4 5 6\n"])
@pytest.mark.parametrize("ending", ["4", "lis", "rao", "yml", "toml"])
def test_files_that_are_something_else_end_in_one_line(tmp_path: Path, content: bytes, ending: str) -> None:
    path = tmp_path / f"hull.{ending}"
    path.write_bytes(content)
    assert path.name in refused(path)
