"""Which test files are likely to notice a change of a module: those that import it, at once or through others, use its
names, and are called like it. Texts and imports alone say so: no run of all tests under a tracer is needed first."""

from __future__ import annotations

import ast
import math
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

IMPORTS, NEXT = 10.0, 0.5
"""Points of a test file that imports the module, and what is left of them for each module in between."""
NAMES, WORDS = 6.0, 6.0
"""Points, at most, for names of the module in the text, and for words that the paths of both have, rare ones first."""
RUNS = 6.0
"""Points, at most, of a test file whose quick tests run the function of the mutant."""
SHORTEST = 3
"""Letters of a word that says something."""
READS_SOURCES = ("tests/api/test_language.py", "tests/api/test_public_names.py", "tests/api/test_project.py")
"""Tests that read the sources instead of running them: they say nothing about a change of a number."""


class Module(NamedTuple):
    name: str
    imports: frozenset[str]
    defines: frozenset[str]


class Choice:
    """Imports and names of sources and tests below a root, read once."""

    def __init__(self, root: Path) -> None:
        src = root / "src"
        self._modules = {
            path.relative_to(root).as_posix(): _module(path, _dotted(path.relative_to(src)))
            for path in sorted((src / "stillhook").rglob("*.py"))
        }
        self._imports = {module.name: module.imports for module in self._modules.values()}
        helpers = {
            _dotted(path.relative_to(root)): path
            for path in sorted((root / "tests").rglob("*.py"))
            if not path.name.startswith("test_")
        }
        self._tests: dict[str, tuple[dict[str, int], frozenset[str]]] = {}
        for path in sorted((root / "tests").rglob("test_*.py")):
            file = path.relative_to(root).as_posix()
            if file not in READS_SOURCES:
                imports, names = _with_helpers(path, helpers)
                self._tests[file] = self._distances(imports), names
        self._usage = Counter(name for _, names in self._tests.values() for name in names)
        self._in_paths = Counter(word for test in self._tests for word in _words(test))

    def tests(self, file: str, quick: Iterable[str] = ()) -> list[str]:
        """Test files for a source file, the likeliest first; none without points. quick: tests that run the place."""
        runs = Counter(test.split("::")[0] for test in quick)
        points = {test: self._points(file, test) + RUNS * _few(runs[test]) for test in self._tests}
        return sorted((test for test, value in points.items() if value > 0.0), key=lambda test: (-points[test], test))

    def _points(self, file: str, test: str) -> float:
        module, (distances, names) = self._modules[file], self._tests[test]
        points = IMPORTS * NEXT ** distances[module.name] if module.name in distances else 0.0
        rare = sum(1.0 / self._usage[name] for name in module.defines & names if len(name) > SHORTEST)
        alike = sum(1.0 / self._in_paths[word] for word in _words(file) & _words(test))
        return points + NAMES * _few(2.0 * rare) + WORDS * _few(4.0 * alike)

    def _distances(self, imports: Iterable[str]) -> dict[str, int]:
        """Modules that a test reaches, and how many are in between."""
        front, found = {name for name in imports if name in self._imports}, dict[str, int]()
        distance = 0
        while front:
            found |= dict.fromkeys(front, distance)
            front = {name for each in front for name in self._imports[each] if name in self._imports} - found.keys()
            distance += 1
        return found


def _few(number: float) -> float:
    """From 0 to 1: the first counts most."""
    return 1.0 - math.exp(-number)


def _words(file: str) -> set[str]:
    """Words of a path below src/stillhook or tests, in the singular."""
    parts = Path(file).with_suffix("").parts
    words = re.split(r"[/_]", "/".join(parts[2:] if parts[0] == "src" else parts[1:]))
    return {word.removesuffix("s") for word in words if len(word) >= SHORTEST and word != "test"}


def _dotted(path: Path) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def _module(path: Path, name: str) -> Module:
    """A module; the names of a package that are loaded when they are used are in the stub beside it."""
    tree, stub = ast.parse(path.read_text(encoding="utf-8")), path.with_suffix(".pyi")
    imports = {*_imports(tree), *(_imports(ast.parse(stub.read_text(encoding="utf-8"))) if stub.is_file() else ())}
    return Module(name, frozenset(imports), frozenset(_defines(tree)))


def _imports(tree: ast.AST) -> Iterable[str]:
    """Modules that are imported, at the top or inside a function; of `from a import b` both a and a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _defines(tree: ast.Module) -> Iterable[str]:
    """Public functions, classes, methods and constants."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node.name
    for statement in tree.body:
        if isinstance(statement, ast.Assign):
            yield from (target.id for target in statement.targets if isinstance(target, ast.Name))


def _with_helpers(path: Path, helpers: dict[str, Path]) -> tuple[set[str], frozenset[str]]:
    """Imports and names of a test file and of the modules of tests that it imports."""
    imports: set[str] = set()
    names: set[str] = set()
    waiting, seen = [path], {path}
    while waiting:
        text = waiting.pop().read_text(encoding="utf-8")
        found = set(_imports(ast.parse(text)))
        imports |= found
        names |= set(re.findall(r"\w+", text))
        new = [helpers[name] for name in sorted(found & helpers.keys()) if helpers[name] not in seen]
        seen |= {*new}
        waiting += new
    return imports, frozenset(names)
