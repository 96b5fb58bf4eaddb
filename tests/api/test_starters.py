"""Starter files: complete as they are, and every line in them is one that their reader takes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from tests.commands import refusal

import stillhook
from stillhook.analysis.drives.costs import load_costs
from stillhook.cli import run
from stillhook.formats.lift_file import load_lift
from stillhook.library import load_crane
from stillhook.library.catalogue import read_payload
from stillhook.library.toml.tree import shelf
from stillhook.plan.file import load_plan, plans
from stillhook.spec.crane import content
from stillhook.validate.data_set.campaign import load_campaign
from stillhook.winches.registry import WINCH_TYPES

OFF = re.compile(r"^# (\w+ = (?!\"\"|#).*)$", re.MULTILINE)
"""A line that is a remark until its # is removed, with a value."""


def new(what: str, out: Path, *like: str) -> str:
    assert run(["new", what, str(out), *like]) == 0
    return out.read_text(encoding="utf-8") if out.is_file() else ""


def uncommented(text: str) -> str:
    """The file with every line that has a value, in tables that are there."""
    on, out = True, []
    for line in text.splitlines():
        on = line.startswith("[") or (on and not line.startswith("# ["))
        out.append(OFF.sub(r"\1", line) if on else line)
    return "\n".join(out)


@pytest.mark.parametrize("like", stillhook.cranes())
def test_a_crane_on_any_base_is_that_crane_and_each_of_its_lines_is_true(tmp_path: Path, like: str):
    file = tmp_path / "mine.toml"
    text = new("crane", file, like)
    assert content(load_crane(file)) == content(load_crane(like))
    file.write_text(uncommented(text), encoding="utf-8")
    assert len(tomllib.loads(file.read_text("utf-8"))) > 10
    assert content(load_crane(file)) == content(load_crane(like))


def test_a_number_that_is_changed_in_the_starter_changes_the_crane(tmp_path: Path):
    file = tmp_path / "mine.toml"
    text = new("crane", file)
    line = next(line for line in text.splitlines() if line.startswith("# hook_mass"))
    assert "hook block; kg, t, te; >= 0; built: 0 to 300 t; assumed in nov-250t" in line
    file.write_text(text.replace(line, line[2:].replace('"3 t"', '"4 t"')), encoding="utf-8")
    assert load_crane(file).hook_mass == 4000.0
    assert load_crane(file).name == "mine"


@pytest.mark.parametrize("like", shelf("payloads"))
def test_a_payload_keeps_the_numbers_and_says_that_they_are_to_be_replaced(tmp_path: Path, like: str):
    file = tmp_path / "mine.toml"
    text = new("payload", file, like)
    read, of = read_payload(str(file)), read_payload(like)
    plain = {"name", "title", "source", "sources"}
    assert read.model_dump(exclude=plain) == of.model_dump(exclude=plain)
    assert {source.text for source in read.sources.values()} == {f"{like}: replace"}
    file.write_text(uncommented(text), encoding="utf-8")
    assert read_payload(str(file)).model_dump(exclude=plain) == of.model_dump(exclude=plain)


@pytest.mark.long
@pytest.mark.parametrize("like", shelf("lifts"))
def test_a_lift_is_planned_and_lowered_as_its_example(tmp_path: Path, like: str):
    file = tmp_path / "mine.toml"
    text = new("lift", file, like)
    for content_of in (text, uncommented(text)):
        file.write_text(content_of, encoding="utf-8")
        assert load_lift(str(file), moving=False).lift.payload == load_lift(like, moving=False).lift.payload
        if like in plans():
            mine, of = load_plan(file), load_plan(like)
            assert mine.phases == of.phases
            assert mine.environment == of.environment
            assert mine.crane.certified is None


def test_a_campaign_is_read_with_its_logs(tmp_path: Path):
    new("campaign", tmp_path / "trials")
    campaign = load_campaign(tmp_path / "trials" / "campaign.toml")
    assert campaign.synthetic
    assert all(test.log.is_file() for test in campaign.tests)
    assert 'kind = "ahc"' in (tmp_path / "trials" / "campaign.toml").read_text("utf-8")


def test_a_table_of_costs_names_every_drive_and_is_empty(tmp_path: Path):
    text = new("drives", tmp_path / "costs.toml")
    costs = load_costs(tmp_path / "costs.toml")
    assert tuple(costs.drive) == tuple(WINCH_TYPES)
    assert costs.currency == ""
    examples = re.findall(r'such as "([^"]+)"', text)
    assert len(examples) == 4


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("ship x.toml", 'new "ship": choose crane, lift, campaign, payload, drives.'),
        ("crane x.toml nov-25t", 'new crane: LIKE "nov-25t": choose deep-250t,'),
        ("drives x.toml nov-250t", 'new drives: LIKE "nov-250t": leave it out.'),
        ("crane x.txt", "x.txt: name a file that ends in .toml."),
        ("crane there.toml", "there.toml: is there already. Choose another name."),
    ],
)
def test_a_starter_that_cannot_be_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: str, line: str
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.toml").touch()
    assert line in refusal(capsys, "new", *words.split())
