"""Every name that a script outside the package imports from the project is there: `make test` runs few of them."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PLACES = {"stillhook": ROOT / "src" / "stillhook", **{n: ROOT / n for n in ("benchmarks", "fuzz", "tests", "trials")}}
"""Packages of the project."""
SCRIPTS = ("hatch_build.py", "benchmarks", "docs", "fuzz", "release", "trials")
FILES = sorted(f for s in SCRIPTS for f in ([ROOT / s] if s.endswith(".py") else (ROOT / s).rglob("*.py")))


def source(module: str) -> Path | None:
    """The file of a module of the project; None where there is none. Of a package whose names are loaded when they are
    used its stub."""
    first, *rest = module.split(".")
    path = PLACES[first].joinpath(*rest)
    files = (path / "__init__.pyi", path / "__init__.py", path.with_suffix(".py"))
    return next((file for file in files if file.is_file()), path if path.is_dir() else None)


@functools.cache
def bound(file: Path) -> frozenset[str]:
    """Names that a module binds, in every branch; none of a folder."""
    return frozenset(_bound(ast.parse(file.read_text(encoding="utf-8")))) if file.is_file() else frozenset()


def _bound(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from ((alias.asname or alias.name).split(".")[0] for alias in node.names)


def missing(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in PLACES:
            of = source(node.module)
            for alias in node.names:
                if of is None or not (alias.name in bound(of) or source(f"{node.module}.{alias.name}")):
                    yield f"{file.relative_to(ROOT)}:{node.lineno}: {node.module}.{alias.name}"


@pytest.mark.long
def test_every_name_that_a_script_imports_is_there():
    assert [line for file in FILES for line in missing(file)] == []


@pytest.mark.parametrize("gone", ["stillhook.units.furlongs", "stillhook.nowhere.parse"])
def test_a_name_that_is_gone_is_found(tmp_path, gone, monkeypatch):
    module, name = gone.rsplit(".", 1)
    file = tmp_path / "script.py"
    file.write_text(f"from stillhook.units import parse\n\n\ndef late():\n    from {module} import {name}\n")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    assert list(missing(file)) == [f"script.py:5: {gone}"]
