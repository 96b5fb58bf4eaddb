"""After a fault at any call that changes a file: the file is the old one or the new one, the command says one line, and
the same command run again gives the same files.

The calls are those of libc, see shim.c; of those of one kind to one file the first and the last are taken.
STILLHOOK_FAULTS_ALL=1 tries every kind of fault at all of them in every command, which takes hours, and otherwise each is
tried at some.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.commands import commands
from tests.faults.bench import Bench, sample
from tests.faults.commands import COMMANDS, ELSEWHERE, Writes
from tests.faults.injector import compiled
from tests.faults.sweep import sweep
from tests.faults.writers import WRITERS

OUTPUTS = {"out", "save", "store", "reference", "target"}
"""Names of parameters that a command writes to."""
SLOWER = ("run_file", "stored", "keys")
"""Writers that take tenths of a second."""
FOLDERS = ("stored", "keys")
"""Writers that make a folder before their files."""
QUICK, LONG = 3, 16
"""Faults of a command in the default tests and in the thorough ones."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    library = compiled(tmp_path_factory.mktemp("shim"))
    bench = Bench(tmp_path_factory.mktemp("faults"), library)
    with bench.injector:
        yield bench


def test_every_command_that_writes_is_here():
    writing = {name for name, of in commands().items() if OUTPUTS & {p.name for p in of.params}}
    words = [writes.line.split() for writes in COMMANDS.values()]
    here = {name for name in writing if any(line[: len(name.split())] == name.split() for line in words)}
    assert here | ELSEWHERE.keys() == writing
    assert not here & ELSEWHERE.keys()


@pytest.mark.long
@pytest.mark.parametrize("name", WRITERS)
def test_all_faults_at_all_calls_of_what_writes(bench: Bench, name: str):
    writes = Writes(f"python {name} OUT", over=name != "keys", parts=name in FOLDERS)
    tried, problems = sweep(bench, writes, 12 if name in SLOWER else None)
    assert not problems, f"{len(problems)} of {tried}: {problems[:5]}"


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name, writes in COMMANDS.items() if writes.quick])
def test_quick_commands_survive_faults(bench: Bench, name: str):
    tried, problems = sweep(bench, COMMANDS[name], sample(QUICK))
    assert not problems, f"{len(problems)} of {tried}: {problems[:5]}"


@pytest.mark.thorough
@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_survives_faults(bench: Bench, name: str):
    tried, problems = sweep(bench, COMMANDS[name], sample(LONG), seed=2)
    assert not problems, f"{len(problems)} of {tried}: {problems[:5]}"
