"""Compiled sources, shared by all tests of a session: the same one is compiled once."""

import hashlib
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

import stillhook
from stillhook.export.fmu import package
from stillhook.export.twin import compile_library, own_platform

QUICK = ("-O0", "-fno-sanitize=undefined")
"""Flags that compile in a third of the time: arithmetic is strict, so every result has the bits of the shipped ones."""


@pytest.fixture(scope="session")
def compiled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Library of a C source with flags, for this system, compiled by the first of all workers that asks for it."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if hasattr(request.config, "workerinput") else base) / "compiled"
    folder.mkdir(exist_ok=True)

    def library(source: str, flags: Sequence[str] = ()) -> Path:
        platform = own_platform()
        if platform is None:
            pytest.skip("no library for this system")
        key = hashlib.sha256("\n".join([*flags, source]).encode()).hexdigest()
        file = folder / f"{key[:32]}.lib"
        if not file.exists():
            compile_library(source, platform, file, (*QUICK, *flags))
        return file

    return library


@pytest.fixture(scope="session")
def nov() -> stillhook.Crane:
    return stillhook.load_crane("nov-250t")


@pytest.fixture(scope="module")
def quick_fmus(compiled: Callable[..., Path]):
    """FMUs are written with libraries of quick flags."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(package, "compile_library", lambda source, _, file: shutil.copy(compiled(source), file))
        yield
