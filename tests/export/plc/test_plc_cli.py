"""`stillhook plc`: files, checksums and refusals."""

from __future__ import annotations

import json

import pytest

from stillhook.cli import run
from stillhook.export.plc import checksum

EXPORT = ["plc", "export", "nov-250t", "--controller", "ssc"]


def test_the_command_writes_text_xml_settings_and_test_sequence(tmp_path, capsys):
    assert run([*EXPORT, "--language", "st", "--out", str(tmp_path), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "nov-250t-ssc-settings.json",
        "nov-250t-ssc-test.csv",
        "nov-250t-ssc.st",
        "nov-250t-ssc.xml",
        "stillhook-manifest.json",
    ]
    text = (tmp_path / "nov-250t-ssc.st").read_text()
    saved = json.loads((tmp_path / "nov-250t-ssc-settings.json").read_text())
    assert facts["sha256"] == saved["sha256"] == checksum(text)
    assert saved["settings"]["plc.gains.K_p"] == 0.16


@pytest.mark.long
def test_a_text_is_recognised_whatever_its_line_ends_and_not_after_a_change(tmp_path, capsys):
    assert run([*EXPORT, "--out", str(tmp_path)]) == 0
    file = tmp_path / "nov-250t-ssc.st"
    text = file.read_text()
    assert run(["plc", "check", str(file)]) == 0
    file.write_bytes(text.replace("\n", "\r\n").encode())
    assert run(["plc", "check", str(file), "--verbose"]) == 0
    file.write_text(text.replace("K_p : LREAL := 0.16", "K_p : LREAL := 0.17"))
    capsys.readouterr()
    assert run(["plc", "check", str(file), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["holds"] is False


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no-such-crane"], "no-such-crane"),
        (["nov-250t", "--controller", "scc"], "--controller"),
        (["nov-250t", "--controller", "position"], "takes no such commands"),
        (["nov-250t", "--language", "ladder"], "Choose st"),
    ],
)
def test_bad_input_is_one_line_and_leaves_no_file(arguments, words, tmp_path, capsys):
    assert run(["plc", "export", *arguments, "--out", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert words in error
    assert not (tmp_path / "new").exists()


def test_a_folder_that_is_a_file_is_refused(tmp_path, capsys):
    place = tmp_path / "file"
    place.write_text("x")
    assert run([*EXPORT, "--out", str(place)]) == 2
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"FUNCTION_BLOCK x", b"\xff\xfe\x00"])
def test_a_file_without_a_checksum_cannot_be_checked(content, tmp_path, capsys):
    file = tmp_path / "other.st"
    file.write_bytes(content)
    assert run(["plc", "check", str(file)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert run(["plc", "check", str(tmp_path / "missing.st")]) == 2
