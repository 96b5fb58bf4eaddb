"""Which functions of the sources each quick test runs, found once by running them under a trace of calls.

A file of tests is traced again when it has changed. Functions go by name, so a source that has changed since leaves the
rest of the record right; a wrong entry costs time and changes no verdict, as it only says which tests run first.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NamedTuple, TextIO

import pytest

from trials.mutants.tree import environment

QUICK = "not slow and not long and not thorough"
"""Tests that are traced: all of them take a few minutes."""
WHOLE = ("tests/frozen/test_frozen.py",)
"""Files whose slow tests are traced as well, and to their end: stored answers, which run much of the sources."""
SEEN = 0.3
"""Another test is traced for so long [s of the processor]: what it calls later it has mostly called before."""
DECIMALS = 3
"""Of the seconds that are kept."""
EACH = 0.05
"""What a test takes beside: collecting its file, its share of imports [s]."""


class Trace(NamedTuple):
    """A test, the seconds of the processor that it took under the trace, and functions as file:qualified name."""

    test: str
    seconds: float
    functions: frozenset[str]


class Traces:
    """Traces of the quick tests of a root, from a folder where they are kept."""

    def __init__(self, root: Path, folder: Path) -> None:
        self._root, self._kept = root, folder / "traces.jsonl"
        self._by_function: dict[str, list[Trace]] = {}

    def update(self, report: Callable[[str], None], workers: int) -> None:
        """Trace the files of tests that are new or have changed since they were traced."""
        files = {p.relative_to(self._root).as_posix(): _digest(p) for p in sorted(_test_files(self._root))}
        kept = {file: row for file, row in _rows(self._kept) if files.get(file) == row["digest"]}
        left = [file for file in files if file not in kept]
        if left:
            report(f"tests are traced: {len(left)} of {len(files)} files")
            parts = [left[i::workers] for i in range(workers) if left[i::workers]]
            running = [self._start(part, number) for number, part in enumerate(parts)]
            for process, out in running:
                process.wait()
                kept |= {file: row | {"digest": files[file]} for file, row in _rows(out)}
            temporary = self._kept.with_suffix(".new")
            temporary.write_text("".join(f"{json.dumps([f, row])}\n" for f, row in kept.items()), encoding="utf-8")
            temporary.replace(self._kept)
        for file, row in kept.items():
            for name, (seconds, numbers) in row["tests"].items():
                trace = Trace(f"{file}::{name}", seconds, frozenset(row["functions"][n] for n in numbers))
                for function in trace.functions:
                    self._by_function.setdefault(function, []).append(trace)

    def tests(self, file: str, line: int, seconds: float) -> list[str]:
        """Quick tests that run the function of a line, as many as take so long: first those that run little else, and
        one case of each test before the next of any."""
        functions = functions_of(self._root, file, line)
        found = {trace.test: trace for function in functions for trace in self._by_function.get(function, ())}
        cases: Counter[str] = Counter()
        ranked = []
        for trace in sorted(found.values(), key=lambda t: (len(t.functions), t.seconds, t.test)):
            of = trace.test.split("[")[0]
            ranked.append((cases[of], len(trace.functions), trace))
            cases[of] += 1
        chosen, left = list[str](), seconds
        for _, _, trace in sorted(ranked, key=lambda r: r[:2]):
            if trace.seconds + EACH <= left:
                left -= trace.seconds + EACH
                chosen.append(trace.test)
        return chosen

    def _start(self, files: Sequence[str], number: int) -> tuple[subprocess.Popen[bytes], Path]:
        out = self._kept.with_name(f"traces-{number}.jsonl")
        out.unlink(missing_ok=True)
        variables = os.environ | environment(self._root, self._kept.with_name("cache"))
        command = [sys.executable, "-m", "trials.mutants.traces", str(out), *files]
        with out.with_suffix(".log").open("wb") as log:
            return subprocess.Popen(command, cwd=self._root, env=variables, stdout=log, stderr=log), out


class Tracer:
    """A plugin of pytest that notes which functions below a folder of sources each test calls, file after file."""

    def __init__(self, root: Path, out: TextIO) -> None:
        self._root, self._src, self._out = root, str(root / "src") + os.sep, out
        self._functions: dict[str, int] = {}
        self._tests: dict[str, tuple[float, list[int]]] = {}
        self.files: set[str] = set()

    def pytest_runtestloop(self, session: pytest.Session) -> None:
        signal.signal(signal.SIGVTALRM, lambda *_: sys.settrace(None))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
        calls: dict[int, CodeType] = {}

        def note(frame: FrameType, event: str, argument: object) -> None:
            code = frame.f_code
            if id(code) not in calls:
                calls[id(code)] = code

        file, name = item.nodeid.split("::", 1)
        begin = time.process_time()
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0 if file in WHOLE else SEEN)
        sys.settrace(note)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            self._note(name, time.process_time() - begin, calls.values())
            if nextitem is None or not nextitem.nodeid.startswith(f"{file}::"):
                self.write(file)

    def write(self, file: str) -> None:
        """The tests of a file that have been traced."""
        self._out.write(f"{json.dumps([file, {'functions': [*self._functions], 'tests': self._tests}])}\n")
        self._out.flush()
        self.files.add(file)
        self._functions, self._tests = {}, {}

    def _note(self, name: str, seconds: float, calls: Iterable[CodeType]) -> None:
        found = {self._name(c) for c in calls if c.co_filename.startswith(self._src) and c.co_name != "<module>"}
        for function in sorted(found):
            self._functions.setdefault(function, len(self._functions))
        self._tests[name] = round(seconds, DECIMALS), sorted(self._functions[f] for f in found)

    def _name(self, code: CodeType) -> str:
        """File and function; what is nested without a name belongs to the function around it."""
        name = code.co_qualname
        while name.rsplit(".", 1)[-1].startswith("<"):
            name = name.rsplit(".", 1)[0] if "." in name else ""
        return f"{Path(code.co_filename).relative_to(self._root).as_posix()}:{name}"


def functions_of(root: Path, file: str, line: int) -> list[str]:
    """Functions whose tests may notice a change of a line, as file:name: the function around it; of a constant those
    that name it, here or where it is imported; else every function of the source."""
    tree = ast.parse((root / file).read_text(encoding="utf-8"))
    every = dict(_functions(tree))
    around = [name for name, node in every.items() if node.lineno <= line <= (node.end_lineno or 0)]
    inside = [name for name in around if every[name].body[0].lineno <= line]
    if around:  # else a default in a signature
        return [f"{file}:{max(inside or around, key=len)}"]
    names = set(_constants(tree, line))
    users = [f"{file}:{name}" for name, node in every.items() if names & _names(node)]
    for other in sorted((root / "src").rglob("*.py")) if names else ():
        text = other.read_text(encoding="utf-8")
        if any(name in text for name in names) and names & _imported(tree := ast.parse(text), _dotted(file)):
            of = other.relative_to(root).as_posix()
            users += [f"{of}:{name}" for name, node in _functions(tree) if names & _names(node)]
    return users or [f"{file}:{name}" for name in every]


def _constants(tree: ast.Module, line: int) -> Iterator[str]:
    """Names that the statement of a line gives values to."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.lineno <= line <= (node.end_lineno or 0):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                yield from (n.id for n in ast.walk(target) if isinstance(n, ast.Name))


def _imported(tree: ast.Module, module: str) -> set[str]:
    """Names that are imported from a module."""
    froms = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module == module)
    return {alias.name for node in froms for alias in node.names}


def _dotted(file: str) -> str:
    return file.removeprefix("src/").removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _functions(node: ast.AST, before: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef):
            yield before + child.name, child
            yield from _functions(child, f"{before}{child.name}.<locals>.")
        elif isinstance(child, ast.ClassDef):
            yield from _functions(child, f"{before}{child.name}.")
        else:
            yield from _functions(child, before)


def _names(node: ast.AST) -> set[str]:
    """Names and attributes below a node."""
    found = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    return found | {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)}


def _test_files(root: Path) -> Iterator[Path]:
    return (root / "tests").rglob("test_*.py")


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _rows(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Traces of a file, a file of tests in each line."""
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        with contextlib.suppress(ValueError):  # cut short
            yield tuple(json.loads(line))


def trace(out: Path, files: Sequence[str]) -> None:
    """Run the quick tests of these files and write what they call."""
    whole = [file for file in files if file in WHOLE]
    with out.open("w", encoding="utf-8") as kept:
        tracer = Tracer(Path.cwd(), kept)
        for part, which in (([f for f in files if f not in whole], QUICK), (whole, "not thorough")):
            if part:
                options = ["-q", "--tb=no", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", which]
                pytest.main([*options, *part], plugins=[tracer])
        for file in files:
            if file not in tracer.files:
                tracer.write(file)


if __name__ == "__main__":
    trace(Path(sys.argv[1]), sys.argv[2:])
