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
import re
import sys
import traceback
from collections.abc import Iterator
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType

from stillhook.errors import SpecError

VARIABLE = "STILLHOOK_EXTENSIONS"
"""Environment variable with the files of a user's own winch types and controllers."""
GROUP = "stillhook.extensions"
"""Group of entry points of installed packages with winch types and controllers."""
FUNCTIONS = ("cycle", "rates")
"""Functions by which a module is known for a controller or a winch type."""


def modules_in(package: ModuleType) -> Iterator[ModuleType]:
    """The modules of a package's folder, by name."""
    for found in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
        yield importlib.import_module(f"{package.__name__}.{found.name}")


@functools.cache
def extensions() -> tuple[ModuleType, ...]:
    """The user's own modules. Errors: SpecError of one line where one cannot be loaded."""
    paths = [Path(text) for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text.strip()]
    installed = [_from_package(point) for point in sorted(entry_points(group=GROUP), key=lambda p: p.name)]
    return tuple(_checked(module) for module in (*(_from_file(path) for path in paths), *installed))


def extension_sources() -> list[Path]:
    """Files of the user's own modules: results follow from them too."""
    return [Path(str(module.__file__)) for module in extensions() if module.__file__]


def _checked(module: ModuleType) -> ModuleType:
    if not any(hasattr(module, function) for function in FUNCTIONS):
        name = Path(str(module.__file__)).name
        raise SpecError(f"{name}: neither cycle nor rates. A controller has a cycle, a winch type has rates.")
    return module


def place_in_extension(problem: BaseException) -> str:
    """File and line of a user's own module at which an exception was raised, or which a compiler could not compile; ""
    where none is involved."""
    files = {str(path.resolve()): path.name for path in extension_sources()}
    frames = [(frame.filename, str(frame.lineno)) for frame in traceback.extract_tb(problem.__traceback__)]
    compiled = re.findall(r'File "([^"]+)", line (\d+)', str(problem))  # innermost first
    for file, line in (*reversed(frames), *compiled):
        if (name := files.get(str(Path(file).resolve()))) is not None:
            return f"{name}, line {line}"
    return ""


def _from_package(point: EntryPoint) -> ModuleType:
    try:
        module: ModuleType = point.load()
    except Exception as problem:  # whatever a user's module raises
        raise SpecError(f"{GROUP}: {point.name}: {_in_one_line(problem)}") from problem
    return module


def _in_one_line(problem: Exception) -> str:
    return f"{type(problem).__name__}: {' '.join(str(problem).split())}"


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
        raise SpecError(f"{VARIABLE}: {path}: {_in_one_line(problem)}") from problem
    return module
