"""A certificate lapses with every change of code that its numbers follow from: what the steps import is in its hashes."""

from __future__ import annotations

import functools
import re

import grimp
import pytest

from stillhook.base.kept.sources import PACKAGE
from stillhook.kernels.build import RESULT_FILES, RESULT_FOLDERS
from stillhook.validate.certificate.content import METHOD_FILES, METHOD_FOLDERS

ROOTS = ("stillhook.validate.validation", "stillhook.validate.report.view")
"""All steps, and what a certificate says of them: lines, envelope, data."""
APART = {"validate/certificate/content.py", "units.toml"}
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
    "base/gateway/template.py": "begins the process of a reader, whose module its caller names",
    "base/kept/": "keeps, and hashes",
    "base/progress.py": "shows what is done",
    "report/document.py": "holds words",
    "report/formatting.py": "writes numbers in words",
    "trust/": "says who vouches",
}


@functools.cache
def reached() -> frozenset[str]:
    """Every file that the roots import, at once or through others, also inside functions, but not for types alone."""
    graph = grimp.build_graph("stillhook", exclude_type_checking_imports=True, cache_dir=None)
    modules = {module for root in ROOTS for module in {root, *graph.find_upstream_modules(root)}}
    paths = (module.removeprefix("stillhook.").replace(".", "/") for module in modules - {"stillhook"})
    return frozenset(f"{path}/__init__.py" if (PACKAGE.folder / path).is_dir() else f"{path}.py" for path in paths)


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
    assert {*METHOD_FILES} - files == APART
    assert {folder for folder in METHOD_FOLDERS if not any(file.startswith(f"{folder}/") for file in files)} == set()


@pytest.mark.slow
def test_nothing_on_that_path_is_imported_by_a_name_that_is_put_together():
    known = "base/extensions.py", "base/gateway/template.py"  # of the user, in the hash of the twin; readers
    twin = (*(f"{folder}/" for folder in RESULT_FOLDERS), *known)
    for file in reached():
        text = (PACKAGE.folder / file).read_text(encoding="utf-8")
        assert file.startswith(twin) or not re.search(r"import_module\(|__import__\(|lazy", text), file


def test_what_the_method_names_is_there():
    assert [name for name in METHOD_FILES if not (PACKAGE.folder / name).is_file()] == []
    assert [name for name in METHOD_FOLDERS if not PACKAGE.inside([name], (".py",))] == []
