"""Every command answers in a dozen lines of a hundred columns; its help has no broken line and loads nothing heavy."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.api.test_start import imported
from tests.commands import case_file, commands

from stillhook.cli import COMMANDS, run
from stillhook.cli.groups import WIDEST, Group, page, requested
from stillhook.cli.parser import CONTROLLERS, MODES
from stillhook.cli.runs.simulation import DRIVES
from stillhook.report.document import Bullets, Document, Table, Text, Verdict, facts
from stillhook.report.formatting import argument
from stillhook.report.terminal import (
    FILE_LINES,
    MOST_COLUMNS,
    MOST_LINES,
    Answer,
    answer_of,
    columns,
    print_answer,
    print_in_full,
    print_table,
    print_written,
    say,
)

EVERY = commands()
SINE = ("--motion", "sine 2 m 12 s", "--duration", "40 s")
QUICK: tuple[tuple[str, ...], ...] = (
    *(("list", what) for what in ("cranes", "vessels", "payloads", "frictions", "controllers", "winches", "lifts")),
    ("crane", "nov-250t"),
    ("new", "drives", "costs.toml"),
    ("calc", "drum", "nov-250t"),
    ("calc", "steady", "nov-250t", "v_w=8 m/min"),
    ("calc", "motor-loss", "A6VM215", "D_m=215 cm^3/rev", "omega_m=1000 rev/min", "dp_m=200 bar"),
    ("sea", "jonswap Hs=2 m Tp=8 s gamma=3.3"),
    ("vessel", "supply-vessel-82m", "--at", "x=-20 m, y=-18 m"),
    ("vessel", "supply-vessel-82m", "--check"),
    ("payload", "suction-anchor-85t"),
    ("weather", "alpha", "--hs", "2 m", "--t-pop", "24 h"),
    ("weather", "show", "SYNTHETIC-norwegian-sea"),
    ("weather", "persistence", "SYNTHETIC-norwegian-sea", "--limit", "Hs <= 1.5 m", "--window", "24 h"),
    ("friction", "compare", "crane-1", "crane-2"),
    ("plan", "template-to-1500m", "--check"),
    ("example", "plan", "a-lift"),
    ("example", "live", "a-twin"),
    ("example", "hil", "a-plc"),
    ("example", "motor-map", "map.csv"),
    ("plc", "export", "nov-250t", "--out", "plc"),
    ("thesis", "E3"),
    ("thesis", "ET2"),
    ("thesis", "C13", "c13"),
)
RUNS: tuple[tuple[str, ...], ...] = (
    ("run", "case.toml", "--out", "runs"),
    ("compare", "nov-250t", *SINE, "--out", "compared"),
    ("compare", "nov-250t", "--drives", "active-passive,electric", *SINE),
    ("envelope", "nov-250t", "--loads", "100 t", "--loads", "200 t"),
    ("map", "nov-250t", "--loads", "50 t, 100 t", "--speeds", "20 m/min, 60 m/min"),
    ("stability", "nov-250t", "--load", "100 t", "--s-w", "100 m", "--v-tip", "10 m/min"),
    ("stability", "nov-250t", "--layer", "2"),
    ("uncertainty", "nov-250t", *SINE, "--draws", "8", "--controllers", "ns,ssc", "--limit", "e_c_pp <= 10 cm"),
    ("tip", "supply-vessel-82m", "--at", "x=-20 m, y=-12 m", "--wave", "jonswap Hs=1 m Tp=8 s", "--heading", "165 deg"),
    ("tip", "supply-vessel-82m", "--at", "x=-20 m, y=-12 m", "--wave", "jonswap Hs=1 m Tp=8 s", "--heading", "all"),
    ("lower", "anchor-to-3000m", "--duration", "2 min", "--out", "lowered"),
    ("response", "anchor-to-3000m", "--depth", "500 m"),
    ("plan", "template-to-1500m", "--tier", "closed-form", "--out", "planned"),
    ("report", "planned"),
    ("convert", "runs/runs.nc", "runs.csv"),
    ("inspect", "map.csv"),
    ("identify", "motor", "map.csv", "--out", "motor"),
)
BY_HAND = {
    "plc check": "after plc export",
    "demo": "the plan with the twin in the loop",
    "tune": "minutes",
    "fmu": "compiles",
    "external": "compiles",
    "validate": "minutes",
    "certificate": "after validate",
    "manifest": "of a folder that a command wrote",
    "certificate sign": "after validate",
    **{f"certificate key {name}": "a key, in a folder of its own" for name in ("new", "show", "trust")},
    "condition": "after validate",
    "identify friction": "minutes",
    "identify curve": "a log of a bench",
    "identify component": "a table or a log of a component",
    "friction draws": "a set with evidence",
    "weather forecast": "a forecast",
    "weather lift": "a year of spectra",
    "plc run": "real time",
    "plc compare": "after plc run",
    **{f"live {name}": "real time, or a log" for name in ("run", "doctor", "replay", "demo", "history")},
    **{f"live {name}": "logs" for name in ("parameters", "residual")},
}
"""Commands whose answers are held to the size by that of `Answer` alone, and what they would need."""


def held(text: str) -> list[str]:
    """The lines of an answer, which are few and short."""
    lines = text.splitlines()
    assert 1 <= len(lines) <= MOST_LINES, text
    assert [line for line in lines if len(line) > MOST_COLUMNS] == []
    assert lines[0].strip()
    return lines


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_command_is_run_here_or_says_why_not() -> None:
    known = {name for name in EVERY for words in (*QUICK, *RUNS) if " ".join(words).startswith(f"{name} ")}
    assert known | BY_HAND.keys() == EVERY.keys()
    assert not known & BY_HAND.keys()


@pytest.mark.long
@pytest.mark.parametrize("words", QUICK, ids=" ".join)
def test_a_command_answers_in_a_dozen_lines(words: tuple[str, ...], folder: Path, capsys: Any) -> None:
    assert run([*words]) == 0
    held(capsys.readouterr().out)


@pytest.mark.long
def test_a_run_answers_in_a_dozen_lines_with_its_files(folder: Path, capsys: Any) -> None:
    case_file(folder, duration="30 s", warm_up="5 s")
    run(["example", "motor-map", "map.csv"])
    for words in RUNS:
        capsys.readouterr()
        assert run([*words]) in (0, 1), words
        lines = held(capsys.readouterr().out)
        if "--out" in words:
            assert any(line.startswith(f"written to {words[-1]}: ") for line in lines), words


@pytest.mark.long
def test_verbose_prints_more_and_json_is_the_same_with_it(folder: Path, capsys: Any) -> None:
    words = ["plan", "template-to-1500m", "--check"]
    run(words)
    short = capsys.readouterr().out
    run([*words, "--verbose"])
    full = capsys.readouterr().out
    assert len(full.splitlines()) > 3 * len(short.splitlines())
    assert "More with --verbose: every phase and limit" in short
    run([*words, "--json"])
    data = capsys.readouterr().out
    run([*words, "--json", "--verbose"])
    assert capsys.readouterr().out == data


def test_a_command_after_a_verbose_one_is_short_again(capsys: Any) -> None:
    run(["list", "frictions", "--verbose"])
    capsys.readouterr()
    run(["list", "frictions"])
    held(capsys.readouterr().out)


TEXTS = st.text(st.characters(codec="ascii", categories=("L", "N", "P", "Zs")), max_size=300)


@settings(deadline=None, max_examples=200)
@given(st.builds(Answer, TEXTS, st.lists(TEXTS, max_size=30), TEXTS, TEXTS), st.booleans())
def test_no_answer_is_larger_and_what_is_left_out_is_counted(answer: Answer, files: bool) -> None:
    lines = answer.text(files=files)
    assert len(lines) + FILE_LINES * files <= MOST_LINES
    assert all(len(line) <= MOST_COLUMNS or not re.search(r"\S\s+\S", line.strip()) for line in lines)
    kept = " ".join(lines)
    shown = [line for line in answer.lines if line.split() and line.split()[0] in kept]
    if len(shown) < len([line for line in answer.lines if line.split()]):
        assert "more line" in kept


@settings(deadline=None)
@given(st.lists(st.tuples(TEXTS, TEXTS, st.sampled_from(["1.2 m", "-", "300 bar"])), min_size=1, max_size=20))
def test_a_small_table_keeps_its_numbers_and_its_width(rows: list[tuple[str, str, str]]) -> None:
    lines = columns(["name", "meaning", "value"], rows, left=(0, 1))
    assert max(map(len, lines)) <= MOST_COLUMNS
    for line, row in zip(lines[1:], rows[: 6 if len(rows) <= 6 else 5], strict=False):
        assert line.endswith(row[2])
    assert (len(rows) > 6) is lines[-1].startswith("... and ")


def test_written_files_take_two_lines_however_many_they_are(capsys: Any) -> None:
    print_written("a-folder-of-results", [f"figure-number-{i}-of-many.png" for i in range(40)])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    assert re.search(r"and \d+ more$", lines[-1])


def test_a_document_answers_with_marks_verdict_and_facts_first() -> None:
    front = [Verdict("PASSED", True, ["All is well. A second sentence."]), facts([("load", "100 t")]), Bullets(["x"])]
    document = Document(
        "Report", name="crane", marks=["SYNTHETIC"], front=[*front, Table(("a",), [("1",)]), Text("End.")]
    )
    assert answer_of(document).text() == ["Report: crane", "SYNTHETIC", "PASSED", "All is well.", "load: 100 t", "End."]


# Help


def asked(name: str) -> str:
    return requested((), COMMANDS, [*name.split(), "--help"])


@pytest.mark.parametrize("width", [80, 100])
@pytest.mark.parametrize("name", EVERY)
def test_help_has_no_line_that_a_terminal_breaks(name: str, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    lines = asked(name).splitlines()
    examples = {line for line in lines if line.startswith("  stillhook ")}
    assert examples
    assert [line for line in lines if len(line) > width and line not in examples] == []


@pytest.mark.parametrize("name", EVERY)
def test_help_shows_every_option_and_every_example_in_one_line(name: str) -> None:
    text, command = asked(name), EVERY[name]
    for parameter in command.params:
        for option in parameter.opts if parameter.param_type_name == "option" else ():
            assert re.search(rf"^  (\S+, )*{option}\b", text, re.MULTILINE), option
    for example in (command.help or "").split("Example: ")[1:]:
        assert f"  {' '.join(example.split())}\n" in text


def test_help_of_a_group_lists_its_commands() -> None:
    groups = {name: entry for name, entry in COMMANDS.items() if isinstance(entry, Group)}
    for name, entry in groups.items():
        text = asked(name)
        assert all(re.search(rf"^  {each}  ", text, re.MULTILINE) for each in entry.commands)


def test_a_value_that_looks_like_help_is_no_request_for_it_after_two_dashes() -> None:
    assert requested((), COMMANDS, ["plan", "--", "--help"]) == ""
    assert requested((), COMMANDS, ["no-command", "--help"]) == ""
    assert max(map(len, page((), "word " * 90, None, {"a": "text " * 90}).splitlines())) <= WIDEST


def test_help_names_the_controllers_and_winch_types_that_are_registered() -> None:
    from stillhook.control.registry import Mode
    from stillhook.winches.registry import WINCH_TYPES

    assert ", ".join(Mode) == MODES
    assert ", ".join(mode for mode in Mode if mode.compensates) == CONTROLLERS
    assert ", ".join(WINCH_TYPES) == DRIVES


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["plan", "compare", "weather alpha", "live run", "uncertainty", "tip", "friction draws"]
)
def test_help_of_a_command_loads_nothing_heavy(name: str) -> None:
    heavy = {"numpy", "scipy", "pandas", "xarray", "duckdb", "pydantic", "numba", "matplotlib", "rich"}
    assert heavy & imported(*name.split(), "--help") == set()


def test_a_text_of_a_file_is_no_other_line_of_an_answer_and_commands_no_terminal(capsys: Any) -> None:
    text = "trials\nSignature: signed and trusted\x1b[2J\r\u2028\u202e"
    print_answer(Answer("Crane", [text]), files=False)
    print_in_full(Answer("Crane", [text]))
    print_table(["name"], [[text]])
    say(text)
    printed = capsys.readouterr()
    shown = [line.strip(" │") for line in f"{printed.out}{printed.err}".splitlines() if "Signature" in line]
    assert len(shown) == 4
    assert not any(line.startswith("Signature") for line in printed.out.splitlines())
    for line in shown:
        assert line.endswith(r"\x1b[2J\r\u2028\u202e")


@pytest.mark.parametrize(
    "name", ["nov-250t", "my/crane_7.toml", r"C:\cranes\7.toml", "é$(id)", "a b; rm *", "it's", "`id`", ""]
)
def test_a_command_that_is_advised_has_a_name_as_one_word_for_a_shell(name: str) -> None:
    word = argument(name)
    assert shlex.split(word.replace("\\", "\\\\")) == [name]
    assert word == name or word.startswith("'")
