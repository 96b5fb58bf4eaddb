"""One name for one thing on the command line, and old names that still work."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from tests.commands import commands

from stillhook.cli import run
from stillhook.cli.names import MOVED, OLD_COMMANDS, OLD_OPTIONS, modern

MOST_COMMANDS, MOST_OPTIONS = 46, 172
LIVE, MOST_LIVE_COMMANDS, MOST_LIVE_OPTIONS = ("live ", "plc run", "plc compare", "condition"), 10, 25
"""The live twin beside them: a program of its own that runs on for days, with few options, as its files say the rest."""
OF_ALL = {"--help", "--verbose", "--json", "--mapping", "--column"}
"""Options that every command has, or every one that reads a table or a log: learnt once."""
MEANINGS = tomllib.loads(Path(__file__).with_name("options.toml").read_text(encoding="utf-8"))
"""Every option of every command, with the one thing that it means."""

COMMANDS = commands()


def options(command: Any) -> set[str]:
    return {name for p in command.params if p.param_type_name == "option" for name in p.opts if name.startswith("--")}


def test_every_option_is_in_the_table_and_no_two_have_one_meaning():
    used = {option for command in COMMANDS.values() for option in options(command)} | {"--version", "--help"}
    assert {f"--{name}" for name in MEANINGS} == used
    assert len(set(MEANINGS.values())) == len(MEANINGS)


def test_a_plural_names_several_and_its_singular_one():
    """What `--controllers` is to one command, `--controller` is not to another: a list and a single value."""
    for command, of in COMMANDS.items():
        both = options(of) & {"--controller", "--controllers"}
        assert len(both) < 2, command


def test_there_are_few_commands_and_few_options():
    budgets = {False: (MOST_COMMANDS, MOST_OPTIONS), True: (MOST_LIVE_COMMANDS, MOST_LIVE_OPTIONS)}
    for live, (most_commands, most_options) in budgets.items():
        of = [command for name, command in COMMANDS.items() if name.startswith(LIVE) is live]
        assert len(of) <= most_commands
        assert sum(len(options(command) - OF_ALL) for command in of) <= most_options


def test_every_command_shows_an_example():
    assert [name for name, command in COMMANDS.items() if "Example: stillhook " not in (command.help or "")] == []


def test_no_old_name_is_a_name_of_today():
    assert not [" ".join(words) for words in OLD_COMMANDS if " ".join(words) in COMMANDS]
    for words, renamed in OLD_OPTIONS.items():
        here = options(COMMANDS[" ".join(words)])
        assert here >= {new.partition("=")[0] for new in renamed.values() if new.startswith("--")}
        assert not here & renamed.keys()


@pytest.mark.parametrize("words", MOVED, ids=" ".join)
def test_what_moved_is_refused_with_its_place(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]):
    assert not options(COMMANDS[" ".join(words)]) & MOVED[words].keys()
    for option, place in MOVED[words].items():
        assert run([*words, option, "1"]) == 2
        assert capsys.readouterr().err == f"error: {option}: moved. Write {place}.\n"


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ("cranes --json", "list cranes --json", '"stillhook cranes" is called "stillhook list cranes" now'),
        ("vessel check FILE --json", "vessel FILE --json --check", "stillhook vessel ... --check"),
        ("compare --crane nov-250t --modes ns,hs", "compare nov-250t --controllers ns,hs", "--controllers"),
        ("compare --crane=nov-250t --modes=ns", "compare nov-250t --controllers=ns", "--crane is an argument now"),
        ("friction draws a --n 8 --mode ssc", "friction draws a --draws 8 --controller ssc", "--draws"),
        ("weather alpha --table own.toml", "weather alpha --forecast-factors own.toml", "--forecast-factors"),
        ("compare -- --modes", "compare -- --modes", ""),
        ("plan p --quick --json", "plan p --tier=frequency --json", "--tier=frequency"),
        ("calc drum c --layer 6 --json", "calc drum c layer=6 --json", "--layer VALUE is written layer=VALUE now"),
        ("calc steady c --v-w=8 --mode ssc", "calc steady c v_w=8 controller=ssc", "v_w=VALUE"),
        ("tip --vessel v --at x", "tip v --at x", "--vessel is an argument now"),
        ("map nov-250t --controllers ns", "map nov-250t --controllers ns", ""),
    ],
)
def test_old_names_are_read_as_those_of_today_with_a_note(old: str, new: str, note: str):
    words, notes = modern(old.split())
    assert words == new.split()
    assert note in " ".join(notes)
    assert bool(notes) is bool(note)


def test_an_old_command_runs_and_its_note_goes_to_standard_error(capsys: pytest.CaptureFixture[str]):
    assert run(["cranes", "--json"]) == 0
    old = capsys.readouterr()
    assert run(["list", "cranes", "--json"]) == 0
    assert old.out == capsys.readouterr().out
    assert old.err == 'note: "stillhook cranes" is called "stillhook list cranes" now.\n'


def test_each_note_is_said_once(capsys: pytest.CaptureFixture[str]):
    assert run(["envelope", "nov-150t", "--load", "90 t", "--load", "100 t", "--modes", "ns", "--json"]) == 0
    assert capsys.readouterr().err.count("--load is called") == 1


@pytest.mark.parametrize("what", ["cranes", "vessels", "payloads", "compensators", "frictions", "controllers"])
def test_a_list_prints_what_may_be_named(what: str, capsys: pytest.CaptureFixture[str]):
    assert run(["list", what]) == 0
    assert len(capsys.readouterr().out.splitlines()) > 4


def test_a_list_of_something_else_is_refused(capsys: pytest.CaptureFixture[str]):
    assert run(["list", "ships"]) == 2
    assert 'list "ships": choose cranes, vessels' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("calc drumm nov-250t", 'calc "drumm": choose motor-loss, friction'),
        ("calc drum nov-250t dp_m=2bar", '"dp_m=2bar": drum follows from layer'),
        ("calc drum nov-250t layer=2 layer=3", "layer: given twice."),
        ("calc friction crane-1", "T_d: missing, and friction follows from it."),
        ("certificate c.json --quick", "--quick: belongs to --check."),
        ("vessel construction-vessel-130m --check --out o", "--out: --check writes nothing."),
        ("example maps o", 'example "maps": choose plan, sea-trials'),
    ],
)
def test_what_has_no_meaning_is_refused_in_one_line(words: str, line: str, capsys: pytest.CaptureFixture[str]):
    assert run(words.split()) == 2
    assert line in capsys.readouterr().err
