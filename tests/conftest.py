"""What every test may use: the shared measured data, one profile for property-based tests, and skips of what takes a
library of tests/requirements.lock that is not installed."""

import importlib
import os
import re
import tempfile
from collections.abc import Generator
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]
os.environ["STILLHOOK_CONFIG"] = tempfile.mkdtemp(prefix="stillhook-config-")  # nobody's own keys and trust list

# The first example of a test may compile kernels, so time per example says nothing.
# Continuous integration repeats the same examples.
settings.register_profile("stillhook", deadline=None, print_blob=True, derandomize=bool(os.environ.get("CI")))
settings.load_profile("stillhook")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Before the workers of a whole run start, its kernels and modules are compiled."""
    config = session.config
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not config.option.collectonly
    if whole and getattr(config.option, "numprocesses", None):
        from tests.kernels import compile_all

        compile_all()


MISSING = re.compile(r"No module named '(numba|fmpy|capytaine)")


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """A file of tests that imports one of the libraries in tests/requirements.lock is skipped where it is missing."""
    report = yield
    if report.failed and (library := MISSING.search(str(report.longrepr))):
        report.outcome = "skipped"
        report.longrepr = (str(collector.path), 0, f"Skipped: {library[1]} is of tests/requirements.lock: make check")
    return report


@pytest.fixture(scope="session")
def numba() -> ModuleType:
    """Numba, with scalar functions as it inlines them; skipped where it is not installed, or compiles nothing."""
    library = pytest.importorskip("numba", reason="numba is of tests/requirements.lock: make check")
    if library.config.DISABLE_JIT:
        pytest.skip("NUMBA_DISABLE_JIT is set: nothing is compiled")
    importlib.import_module("stillhook.kernels.by_numba")
    return library


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the public measured data; it is not part of the repository."""
    named = os.environ.get("STILLHOOK_SHARED_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured data in {folder}: set STILLHOOK_SHARED_DATA to the folder that holds it")
    return folder
