"""`stillhook live history` prints what is stored and writes a range of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from tests.live.histories import write_hours

from stillhook.cli.groups import Entry, build
from stillhook.errors import StillhookError
from stillhook.live.history import archive, read
from stillhook.report.terminal import MOST_LINES

pytestmark = pytest.mark.slow  # each waits for the disk several times


def ask(*words: str | Path) -> Any:
    """The exit code of the command."""
    return build("history", Entry("live.history", "history"))([str(word) for word in words], standalone_mode=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_hours(tmp_path / "twin", hours=2.5)
    archive(tmp_path / "twin")
    return tmp_path / "twin"


def test_it_prints_what_is_there(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert not ask(folder, "--verbose")
    out = capsys.readouterr().out
    assert "2026-11-28T12:00:00Z to 2026-11-28T14:29:00Z, not written now" in out
    assert "rows 1 to 150 (150): 120 in 2 files" in out
    assert "budget: 20 GB, 1000000 events; 0 rows removed" in out
    assert "writes, after row 0" in out


def test_its_answer_is_short(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert not ask(folder, "--check")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= MOST_LINES
    assert "No damage found." in lines
    assert lines[-2].startswith("Last event ")


def test_json_is_in_si_and_strict(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert not ask(folder, "--json", "--check")
    answer = json.loads(capsys.readouterr().out)
    assert (answer["rows"], answer["files"], answer["damaged"]) == (150, 2, [])
    assert [event["kind"] for event in answer["events_in_range"]] == ["start", "stop"]


def test_a_range_goes_to_a_file(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    words = ("--from", "2026-11-28T12:30", "--to", "2026-11-28T13:30", "--signals", "p_a, F_w", "--every", "1 min")
    assert not ask(folder, *words, "--out", tmp_path / "hour.nc")
    assert f"written: {tmp_path / 'hour.nc'}, 60 rows" in capsys.readouterr().out
    assert not ask(folder, "--out", tmp_path / "all.csv")
    assert (tmp_path / "all.csv").read_text().splitlines()[
        0
    ] == "time [s],p_a [Pa],omega_m [rad/s],F_w [N],row [1],status [1]"


def test_damage_is_said_with_exit_code_1(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    hour = next((folder / "hours").glob("*.parquet"))
    hour.write_bytes(hour.read_bytes()[:-1])
    assert ask(folder, "--check", "--out", tmp_path / "rest.csv") == 1
    said = capsys.readouterr()
    assert "bytes in place of" in said.out
    assert said.err.count("bytes in place of") == 1
    assert len(read(folder)["row"]) == 90


def test_what_has_no_meaning_is_refused(folder: Path, tmp_path: Path):
    for words in (("--signals", "p_a"), ("--every", "1 s")):
        with pytest.raises(StillhookError, match="belongs to --out"):
            ask(folder, *words)
    with pytest.raises(StillhookError, match="no history is there"):
        ask(tmp_path)
