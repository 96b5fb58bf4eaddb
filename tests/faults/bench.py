"""A command under faults: its files before and after, and what is wrong with them."""

from __future__ import annotations

import errno
import itertools
import os
import random
import shlex
import shutil
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from tests.faults.commands import PREPARED, Writes, prepare
from tests.faults.injector import STILL, Fault, Injector, Kind, Outcome

Tree = dict[str, bytes | None]
"""Content of files by their paths, None of folders."""
KINDS = (
    *((Kind.FAIL, error) for error in (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EINTR)),
    (Kind.FULL, errno.ENOSPC),
    (Kind.FAIL_ON, errno.EIO),
    (Kind.KILL, 0),
    (Kind.TORN, 0),
)
DEADLY = (Kind.KILL, Kind.TORN)
DAY = 86_400.0
TEMPORARY = "tmp"
"""Folder of temporary files, among the outputs so that its calls count."""


def faults(count: int, most: int | None = None, seed: int = 1) -> Iterator[Fault]:
    """All kinds at all calls, or some of them: each kind as often, spread over the calls."""
    every = [Fault(kind, at, error) for at in range(1, count + 1) for kind, error in KINDS]
    if most is None or most >= len(every):
        yield from every
        return
    chance = random.Random(seed)
    for kind, error in itertools.islice(itertools.cycle(KINDS), most):
        yield Fault(kind, chance.randint(1, count), error)


class Bench:
    """Command lines with their outputs below one folder. Parameters: folder, and the shim."""

    def __init__(self, folder: Path, library: Path) -> None:
        self.outputs, inputs = folder / "outputs", folder / "inputs"
        self.outputs.mkdir()
        inputs.mkdir()
        self.words, self._made = prepare(inputs), set[str]()
        self.injector = Injector(self.outputs, library)
        self.environment = {"TMPDIR": str(self.outputs / TEMPORARY)}

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
        return {
            str(path.relative_to(self.outputs)): _content(path) if path.is_file() else None
            for path in sorted(self.outputs.rglob("*"))
        }

    def reset(self, tree: Mapping[str, bytes | None] = {}) -> Tree:
        """Make it what is there, and a folder for temporary files."""
        shutil.rmtree(self.outputs)
        (self.outputs / TEMPORARY).mkdir(parents=True)
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

    def complete(self, writes: Writes) -> tuple[list[str], int, Tree]:
        """Command line, calls that change files, and the files when nothing fails; the same twice."""
        arguments = self.arguments(writes)
        self.reset()
        done = self.injector.learn(arguments, self.environment)
        assert done.code == writes.code, done.err
        self.reset()
        self.run(arguments)  # with what the first one left in the caches
        first = self.tree()
        self.reset()
        done = self.run(arguments)
        assert self.tree() == first, "a run leaves other files than the run before"
        return arguments, done.count, first

    def _age(self, tree: Tree) -> None:
        """Let what is left of a run that was killed be two days old: a later run sweeps it then."""
        for name in filter(_is_temporary, tree):
            os.utime(self.outputs / name, (STILL / 1e9 - 2 * DAY, STILL / 1e9 - 2 * DAY))

    def problems(self, writes: Writes, most: int | None, seed: int = 1) -> tuple[int, list[str]]:
        """Faults that were tried, and what was wrong after each."""
        arguments, count, new = self.complete(writes)
        old: Tree = {name: content if content is None else b"of an earlier run" for name, content in new.items()}
        number, problems = 0, list[str]()
        for i, fault in enumerate(faults(count, most, seed)):
            start = self.reset(old if writes.over and i % 2 else {})
            done = self.run(arguments, fault)
            after = self.tree()
            number += 1
            wrong = [*_said(writes, fault, done), *_left(writes, fault, done, start, after, new)]
            if done.code != writes.code and after != start and not wrong:
                self._age(after)
                again = self.run(arguments)
                wrong += [f"not swept: {name}" for name in self.tree() if _is_hidden(name) and name in after]
                later = {name: content for name, content in self.tree().items() if not _is_temporary(name)}
                complete = not writes.over and again.code == 2 and all(after.get(name) == new[name] for name in new)
                if not complete and (again.code != writes.code or later != _lasting(new)):
                    wrong.append(f"run again: {again.code} {again.err[-200:]}")
            state = "over" if writes.over and i % 2 else "new"
            problems += [f"{fault} ({done.struck}, {state}): exit {done.code}: {each}" for each in wrong]
        return number, problems


def _said(writes: Writes, fault: Fault, done: Outcome) -> Iterator[str]:
    """What is wrong with exit code and lines."""
    if any(word in done.err for word in ("Traceback", "Exception ignored", "Internal error")):
        yield f"no line: {done.err[-500:]}"
    if fault.kind in DEADLY and done.fired and done.code == -9:
        return
    errors = [line for line in done.lines if line.startswith("error: ")]
    if done.code not in (writes.code, 2) or (done.code == 2) != (len(errors) == 1):
        yield f"exit code and lines: {done.err[-300:]}"


def _left(writes: Writes, fault: Fault, done: Outcome, start: Tree, after: Tree, new: Tree) -> Iterator[str]:
    """What is wrong with the files."""
    may_leave = fault.kind in (*DEADLY, Kind.FAIL_ON) or done.struck == "unlink"
    may_change = writes.parts or may_leave or done.struck == "fsync"  # of the folder: the file is in place then
    for name in sorted(after.keys() | new.keys() | start.keys()):
        content = after.get(name, b"-")
        if _is_temporary(name):
            if name in after and name not in start and not may_leave:
                yield f"left: {name}"
        elif done.code == writes.code:
            if name not in new or content != new[name]:
                yield f"not as it is to be: {name}"
        elif content not in (start.get(name, b"-"), new.get(name, b"-")):
            yield f"neither old nor new: {name}"
        elif done.code == 2 and content != start.get(name, b"-") and not may_change:
            yield f"changed by a command that failed: {name}"


def _content(path: Path) -> bytes:
    """Bytes of a file; of a workbook those of its parts, without their times."""
    data = path.read_bytes()
    if path.suffix == ".xlsx" and zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            return b"".join(name.encode() + archive.read(name) for name in archive.namelist())
    return data


def _is_hidden(name: str) -> bool:
    return any(part.startswith(".") for part in Path(name).parts)


def _is_temporary(name: str) -> bool:
    return _is_hidden(name) or name.startswith(f"{TEMPORARY}/")


def _lasting(tree: Tree) -> Tree:
    return {name: content for name, content in tree.items() if not _is_temporary(name)}


def sample(usual: int) -> int | None:
    """How many faults of a command; all where STILLHOOK_FAULTS_ALL is set."""
    return None if os.environ.get("STILLHOOK_FAULTS_ALL") else usual
