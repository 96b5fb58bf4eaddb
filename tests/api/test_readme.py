"""Command lines of README and of the tour as a reader types them, one after the other in a fresh clone: each parses,
and names only files that are there."""

import re
import shlex
from pathlib import Path

import pytest
import typer

from stillhook.cli import app, run

ROOT = Path(__file__).resolve().parents[2]
README, TOUR = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/tutorials/tour.md"))
MOST_WORDS = 450
PROGRAM = typer.main.get_command(app)
FILE = re.compile(r"[\w./-]+\.(?:toml|csv|txt|json|nc|re1|gz|pdf|log)")
WRITES = {
    "example friction-tests": ("campaign.toml",),
    "identify friction": ("friction.toml",),
    "example sea-trials": ("campaign.toml",),
    "validate": ("certificate.json",),
    "example plan": ("template-to-1500m.toml",),
    "example live": ("live.toml",),
    "tip": ("tip.json",),
    "compare": ("runs.nc",),
}
"""What a command leaves in the folder that it is given."""


def lines_of(page: str) -> list[list[str]]:
    """Words of every command line of a page, in order: blocks, and commands in running text."""
    found = []
    for block, inline in re.findall(r"^```\w*\n(.*?)^```$|`(stillhook [^`\n]+)`", page, re.MULTILINE | re.DOTALL):
        found += [
            shlex.split(line, comments=True)[1:]
            for line in (block or inline).splitlines()
            if line.startswith("stillhook ")
        ]
    return found


PAGES = {"README": lines_of(README), "tour": lines_of(TOUR)}
LINES = [words for page in PAGES.values() for words in page]


def resolved(words):
    """The command of a line, its name, and its arguments."""
    command, name = PROGRAM, []
    while hasattr(command, "commands"):
        name, command, words = [*name, words[0]], command.commands[words[0]], words[1:]
    return command, " ".join(name), words


def test_readme_is_short_and_the_tour_has_the_command_lines():
    assert len(README.split()) <= MOST_WORDS
    assert README.count("![") == 1
    assert len(PAGES["tour"]) > 20
    assert ["stability", "nov-250t"] in [words[:2] for words in LINES]


@pytest.mark.parametrize("words", LINES, ids=lambda words: " ".join(words[:3]))
def test_every_command_line_is_one_that_the_program_takes(words):
    command, name, arguments = resolved(words)
    if arguments:  # "stillhook identify motor" in running text names a command
        command.make_context(name, list(arguments))


@pytest.mark.parametrize("page", PAGES)
def test_every_file_that_is_named_ships_or_is_written_by_an_earlier_line(page: str):
    there: set[str] = set()
    for words in PAGES[page]:
        _, name, arguments = resolved(words)
        written = arguments[-1] if name == "example" else None
        out = arguments[arguments.index("--out") + 1] if "--out" in arguments else written
        read = [word for word in arguments if FILE.fullmatch(word) and word != out]
        for path in read:
            assert path in there or (ROOT / path).is_file(), f"{page}: stillhook {' '.join(words)}: {path} is not there"
        if out is not None:
            key = " ".join(words[:2]) if " ".join(words[:2]) in WRITES else name
            there |= {out} | {f"{out}/{file}" for file in WRITES.get(key, ())}


@pytest.mark.parametrize("page", PAGES)
def test_no_folder_is_written_by_two_lines(page: str):
    written = [words[-1] for words in PAGES[page] if words[0] == "example"]
    written += [words[words.index("--out") + 1] for words in PAGES[page] if "--out" in words]
    assert len(written) == len(set(written))


@pytest.mark.thorough
def test_the_first_lines_run_as_printed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for start in (
        ["tip"],
        ["compare"],
        ["example", "plan"],
        ["sea"],
        ["vessel"],
        ["weather", "alpha"],
        ["example", "motor-map"],
    ):
        words = next(words for words in PAGES["tour"] if words[: len(start)] == start)
        assert run(words) == 0, words
        capsys.readouterr()
    for folder, file in (("tip", "tip.json"), ("my-lift", "template-to-1500m.toml"), ("results", "summary.json")):
        assert (tmp_path / folder / file).is_file()
