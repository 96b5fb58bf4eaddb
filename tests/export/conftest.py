"""Compiled sources, shared by all tests of a session: the same one is compiled once."""

import contextlib
import hashlib
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

import stillhook
from stillhook.export.fmu import package
from stillhook.export.twin import compile_library, own_platform

QUICK = ("-O0", "-fno-sanitize=undefined")
"""Flags that compile in a third of the time: arithmetic is strict, so every result has the bits of the shipped ones."""


@pytest.fixture(scope="session")
def compiled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Library of a C source with flags, for this system, compiled by the first of all workers that asks for it; shipped:
    with the flags of an export, which take longer."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if hasattr(request.config, "workerinput") else base) / "compiled"
    folder.mkdir(exist_ok=True)

    def library(source: str, flags: Sequence[str] = (), *, shipped: bool = False) -> Path:
        platform = own_platform()
        if platform is None:
            pytest.skip("no library for this system")
        every = flags if shipped else (*QUICK, *flags)
        key = hashlib.sha256("\n".join([*every, source]).encode()).hexdigest()
        file = folder / f"{key[:32]}.lib"
        if not file.exists():
            compile_library(source, platform, file, every)
        return file

    return library


@pytest.fixture(scope="session")
def nov() -> stillhook.Crane:
    return stillhook.load_crane("nov-250t")


@contextlib.contextmanager
def sharing(compiled: Callable[..., Path], *, shipped: bool) -> Iterator[None]:
    """FMUs are written with libraries that all workers share."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            package, "compile_library", lambda source, _, file: shutil.copy(compiled(source, shipped=shipped), file)
        )
        yield


@pytest.fixture(scope="module")
def quick_fmus(compiled: Callable[..., Path]) -> Iterator[None]:
    """FMUs are written with libraries of quick flags."""
    with sharing(compiled, shipped=False):
        yield


@pytest.fixture(scope="session")
def shipped_fmus(compiled: Callable[..., Path]) -> Callable[[], contextlib.AbstractContextManager[None]]:
    """In its context FMUs are written with libraries of the flags that are shipped."""
    return lambda: sharing(compiled, shipped=True)
