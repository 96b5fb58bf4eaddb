"""The how-to for test engineers: its campaign file reads, its criteria file reads, its commands exist."""

import re
from pathlib import Path

import pytest

from stillhook.cli import run as command
from stillhook.validate import load_campaign, load_criteria

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "validate-a-twin.md"
TEXT = PAGE.read_text(encoding="utf-8")
TOML = re.findall(r"^```toml\n(.*?)^```", TEXT, flags=re.MULTILINE | re.DOTALL)
COMMANDS = sorted({" ".join(line.split()[1:3]) for line in re.findall(r"^stillhook .*$", TEXT, flags=re.MULTILINE)})


def test_the_campaign_file_of_the_how_to_reads(tmp_path):
    (tmp_path / "logs").mkdir()
    for name in re.findall(r'log = "(logs/\S+)"', TOML[0]):
        (tmp_path / name).write_text("")
    (tmp_path / "campaign.toml").write_text(TOML[0], encoding="utf-8")
    campaign = load_campaign(tmp_path / "campaign.toml")
    assert [t.name for t in campaign.tests] == ["1", "limits", "dynamics"]


def test_the_criteria_file_of_the_how_to_reads_and_says_what_it_changes(tmp_path):
    (tmp_path / "owner.toml").write_text(TOML[1], encoding="utf-8")
    changes = " ".join(load_criteria(tmp_path / "owner.toml").changes)
    assert "p-boost" in changes
    assert "at most 4 cm" in changes


@pytest.mark.slow
@pytest.mark.parametrize("words", COMMANDS)
def test_every_command_of_the_how_to_exists(words, capsys):
    first, second = words.split()
    arguments = [first, second] if first == "certificate" else [first]
    assert command([*arguments, "--help"]) == 0
    assert "Example" in capsys.readouterr().out


def test_every_criterion_that_counts_is_in_the_table_of_what_to_do():
    table = PAGE.with_name("correct-a-twin.md").read_text(encoding="utf-8").split("## Adopt")[0]
    named = set(re.findall(r"`([^`]+)`", table))
    judged = {c.key for c in load_criteria("paper-f").criteria if c.judged}
    assert judged - named == set()
