"""What every test may use: the shared measured data, and one profile for property-based tests."""

import os
import tempfile
from pathlib import Path

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


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the public measured data; it is not part of the repository."""
    named = os.environ.get("STILLHOOK_SHARED_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured data in {folder}: set STILLHOOK_SHARED_DATA to the folder that holds it")
    return folder
