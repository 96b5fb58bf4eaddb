"""A certificate lapses with every change of code that its numbers follow from: what the steps import is in its hashes."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator

import pytest

from stillhook.base.kept.sources import PACKAGE
from stillhook.kernels.build import RESULT_FILES, RESULT_FOLDERS
from stillhook.validate.certificate.certificate import METHOD_FILES, METHOD_FOLDERS

ROOTS = ("validate/validation.py", "validate/report/view.py")
"""All steps, and what a certificate says of them: lines, envelope, data."""
APART = {"validate/certificate/certificate.py", "units.toml"}
"""In the hash, and imported by no step: level and contents of the certificate; the units of `units.py`."""
NOT_NUMBERS = {
    "_version.py": "is in the certificate by itself",
    "errors.py": "names of refusals",
    "base/atomic.py": "writes files",
    "base/choice.py": "suggests a name in a refusal",
    "base/extras.py": "says which library is missing",
    "base/gateway/access.py": "gives the bytes of a file, or refuses it",
    "base/gateway/budget.py": "refuses what is too large",
    "base/gateway/guard.py": "refuses what a reader does not expect",
    "base/gateway/inputs.py": "names files in manifests",
    "base/gateway/named_files.py": "refuses paths",
    "base/kept/": "keeps, and hashes",
    "base/progress.py": "shows what is done",
    "report/document.py": "holds words",
    "report/formatting.py": "writes numbers in words",
    "trust/": "says who vouches",
}


@functools.cache
def module(name: str) -> str | None:
    """File of a module or package by its name without "stillhook."."""
    path = name.replace(".", "/")
    return next((file for file in (f"{path}.py", f"{path}/__init__.py") if (PACKAGE.folder / file).is_file()), None)


def imports(tree: ast.AST) -> Iterator[str]:
    """Modules of the package that a module imports, at its top or in functions, but not for types alone."""
    statements = [
        each for name in ("body", "orelse", "finalbody", "handlers", "cases") for each in getattr(tree, name, [])
    ]
    for node in statements:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            for alias in node.names:
                inside = f"{node.module}.{alias.name}"
                yield inside if module(inside.removeprefix("stillhook.")) else str(node.module)
        else:
            yield from imports(node)


@functools.cache
def reached() -> dict[str, str]:
    """Text of every file that the roots import, at once or through others."""
    files: dict[str, str] = {}
    waiting = [*ROOTS]
    while waiting:
        file = waiting.pop()
        if file in files:
            continue
        text = files[file] = (PACKAGE.folder / file).read_text(encoding="utf-8")
        found = (name.removeprefix("stillhook.") for name in imports(ast.parse(text)) if name.startswith("stillhook."))
        waiting += [of for name in found if (of := module(name)) is not None]
    return files


def hashed(file: str) -> bool:
    """Whether a file is in the hash of the twin or in that of the method."""
    folders = tuple(f"{folder}/" for folder in (*RESULT_FOLDERS, *METHOD_FOLDERS))
    return file.startswith(folders) or file in (*RESULT_FILES, *METHOD_FILES)


@pytest.mark.slow
def test_every_module_that_a_validation_follows_from_is_hashed_or_makes_no_number():
    files = reached()
    assert len(files) > 200
    left_out = {file for file in files if not hashed(file)}
    assert {file for file in left_out if not file.startswith(tuple(NOT_NUMBERS))} == set()
    assert {reason for reason in NOT_NUMBERS if not any(file.startswith(reason) for file in left_out)} == set()
    assert {*METHOD_FILES} - files.keys() == APART
    assert {folder for folder in METHOD_FOLDERS if not any(file.startswith(f"{folder}/") for file in files)} == set()


@pytest.mark.slow
def test_nothing_is_imported_on_that_path_in_a_way_that_imports_do_not_show():
    twin = tuple(f"{folder}/" for folder in RESULT_FOLDERS)
    for file, text in reached().items():
        if not file.startswith(twin) and file != "base/extensions.py":  # of the user: in the hash of the twin
            assert "import_module(" not in text, file
            assert "__import__(" not in text, file
            assert not (PACKAGE.folder / file).with_suffix(".pyi").exists() or "lazy" not in text, file


def test_what_the_method_names_is_there():
    assert [name for name in METHOD_FILES if not (PACKAGE.folder / name).is_file()] == []
    assert [name for name in METHOD_FOLDERS if not PACKAGE.inside([name], (".py",))] == []
