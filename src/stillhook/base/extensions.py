"""Modules that extend Stillhook: those of a package's own folder, and files or installed packages of the user.

A user names files in the environment variable `STILLHOOK_EXTENSIONS` (separated as in PATH), or installs a package with
an entry point in the group `stillhook.extensions`. Each is loaded once, before anything is simulated.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
import pkgutil
import sys
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from stillhook.errors import SpecError

VARIABLE = "STILLHOOK_EXTENSIONS"
"""Environment variable with the files of a user's own winch types and controllers."""
GROUP = "stillhook.extensions"
"""Group of entry points of installed packages with winch types and controllers."""


def modules_in(package: ModuleType) -> Iterator[ModuleType]:
    """The modules of a package's folder, by name."""
    for found in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
        yield importlib.import_module(f"{package.__name__}.{found.name}")


@functools.cache
def extensions() -> tuple[ModuleType, ...]:
    """The user's own modules. Errors: SpecError of one line where one cannot be loaded."""
    paths = [Path(text) for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text.strip()]
    installed = [point.load() for point in sorted(entry_points(group=GROUP), key=lambda p: p.name)]
    return (*(_from_file(path) for path in paths), *installed)


def extension_sources() -> list[Path]:
    """Files of the user's own modules: results follow from them too."""
    return [Path(str(module.__file__)) for module in extensions() if module.__file__]


def _from_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise SpecError(f"{VARIABLE}: no file {path}. Give paths of Python files, separated by {os.pathsep!r}.")
    name = f"stillhook_extension_{path.stem}"
    if name in sys.modules:
        raise SpecError(f"{VARIABLE}: two files are called {path.name}. Rename one of them.")
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise SpecError(f"{VARIABLE}: {path} is not a Python file. Its name must end in .py.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as problem:  # whatever a user's module raises
        del sys.modules[name]
        raise SpecError(f"{VARIABLE}: {path}: {type(problem).__name__}: {problem}") from problem
    return module
