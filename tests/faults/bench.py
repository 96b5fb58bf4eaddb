"""A command under faults: its files before and after, and what is wrong with them."""

from __future__ import annotations

import os
import shlex
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.faults.commands import CONFIG, PREPARED, Writes, prepare
from tests.faults.injector import STILL, Fault, Injector, Outcome

Tree = dict[str, bytes | None]
"""Content of files by their paths, None of folders."""
DAY = 86_400.0
TEMPORARY = "tmp"
"""Folder of temporary files, among the outputs so that its calls count."""


class Bench:
    """Command lines with their outputs below one folder. Parameters: folder, and the shim."""

    def __init__(self, folder: Path, library: Path) -> None:
        self.outputs, inputs = folder / "outputs", folder / "inputs"
        self.outputs.mkdir()
        inputs.mkdir()
        self.words, self._made = prepare(inputs), set[str]()
        self.injector = Injector(self.outputs, library)
        self.environment = {"TMPDIR": str(self.outputs / TEMPORARY), "STILLHOOK_CONFIG": str(self.outputs / CONFIG)}

    def arguments(self, writes: Writes) -> list[str]:
        """Its command line with the paths of files."""
        return [self._word(word, writes.target) for word in shlex.split(writes.line)]

    def _word(self, word: str, target: str) -> str:
        head, slash, rest = word.partition("/")
        if head == "OUT":
            return str(self.outputs / target) + slash + rest
        if head in PREPARED and head not in self._made:
            self._made.add(head)
            done = self.injector.run([self._word(each, "") for each in shlex.split(PREPARED[head])])
            assert done.code == 0, done.err
        path = f"{self.words[head]}{slash}{rest}" if head in self.words else word
        return str(sorted(Path(path).parent.iterdir())[0]) if rest.endswith("LOG") else path

    def tree(self) -> Tree:
        """What is there."""
        return _tree(self.outputs)

    def given(self, writes: Writes) -> Tree:
        """What is there before a command line that changes files."""
        if not writes.given:
            return {}
        folder = _tree(Path(self._word(writes.given, "")))
        return {writes.target: None} | {f"{writes.target}/{name}": content for name, content in folder.items()}

    def reset(self, tree: Mapping[str, bytes | None] = {}) -> Tree:
        """Make it what is there, and a folder for temporary files."""
        for each in self.outputs.iterdir():
            shutil.rmtree(each) if each.is_dir() else each.unlink()
        (self.outputs / TEMPORARY).mkdir()
        for name, content in tree.items():
            path = self.outputs / name
            if content is None:
                path.mkdir(exist_ok=True)
            else:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        return self.tree()

    def run(self, arguments: Sequence[str], fault: Fault | None = None, **more: object) -> Outcome:
        """Run a command line."""
        return self.injector.run(arguments, fault or Fault(), env=self.environment, **more)  # type: ignore[arg-type]

    def complete(self, writes: Writes) -> tuple[list[str], Tree]:
        """Command line, and the files when nothing fails; the same twice, of which the first run may find empty
        caches."""
        arguments, given = self.arguments(writes), self.given(writes)
        self.reset(given)
        done = self.injector.learn(arguments, self.environment)
        assert done.code == writes.code, done.err
        first = self.tree()
        self.reset(given)
        self.run(arguments)
        changed = [name for name, content in self.tree().items() if first.get(name, b"") != content]
        assert self.tree() == first, f"a run leaves other files than the run before: {changed}"
        return arguments, first

    def age(self, tree: Tree) -> None:
        """Let what is left of a run that was killed be two days old: a later run sweeps it then."""
        for name in filter(is_temporary, tree):
            os.utime(self.outputs / name, (STILL / 1e9 - 2 * DAY, STILL / 1e9 - 2 * DAY))


def _tree(folder: Path) -> Tree:
    return {
        str(path.relative_to(folder)): _content(path) if path.is_file() else None for path in sorted(folder.rglob("*"))
    }


def _content(path: Path) -> bytes:
    """Bytes of a file; of a workbook those of its parts, without their times."""
    data = path.read_bytes()
    if path.suffix == ".xlsx" and zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            return b"".join(name.encode() + archive.read(name) for name in archive.namelist())
    return data


def is_hidden(name: str) -> bool:
    return any(part.startswith(".") for part in Path(name).parts)


def is_temporary(name: str) -> bool:
    return is_hidden(name) or name.startswith(f"{TEMPORARY}/")


def sample(usual: int) -> int | None:
    """How many faults of a command; all where STILLHOOK_FAULTS_ALL is set."""
    return None if os.environ.get("STILLHOOK_FAULTS_ALL") else usual
