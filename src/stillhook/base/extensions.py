"""Modules that extend Stillhook: those of a package's own folder, and modules of the user.

A user names them in the environment variable `STILLHOOK_EXTENSIONS`: paths of Python files, or importable modules,
separated as in PATH. Each is loaded once, before anything is simulated.
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
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

from stillhook.errors import SpecError

VARIABLE = "STILLHOOK_EXTENSIONS"
"""Environment variable with a user's own winch types, controllers and units."""
FUNCTIONS = ("cycle", "rates", "pull")
"""Functions by which a module is known for a controller, a winch type, or a unit between hook and slings."""


def modules_in(package: ModuleType) -> Iterator[ModuleType]:
    """The modules of a package's folder, by name."""
    for entry in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
        yield importlib.import_module(f"{package.__name__}.{entry.name}")


@functools.cache
def extensions() -> tuple[ModuleType, ...]:
    """The user's own modules. Errors: SpecError of one line where one cannot be loaded."""
    names = [text.strip() for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text.strip()]
    return tuple(_loaded(name) for name in names)


def extension_sources() -> list[Path]:
    """Files of the user's own modules: results follow from them too."""
    return [Path(str(module.__file__)) for module in extensions() if module.__file__]


def _loaded(name: str) -> ModuleType:
    path = Path(name)
    if path.suffix == ".py":
        if not path.is_file():
            raise SpecError(f"{VARIABLE}: no file {path}. Give paths of Python files, separated by {os.pathsep!r}.")
        return _checked(name, lambda: _from_file(path))
    return _checked(name, lambda: importlib.import_module(name))


def _checked(name: str, load: Callable[[], ModuleType]) -> ModuleType:
    """What load gives. Errors: SpecError of one line for whatever it raises, and where it is of neither kind."""
    try:
        module = load()
    except SpecError:
        raise
    except Exception as problem:
        raise SpecError(f"{VARIABLE}: {name}: {type(problem).__name__}: {' '.join(str(problem).split())}") from problem
    if not any(hasattr(module, function) for function in FUNCTIONS):
        raise SpecError(
            f"{VARIABLE}: {name}: no cycle, rates or pull. A controller has a cycle, a winch type has rates, a"
            " unit between hook and slings a pull."
        )
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


def _from_file(path: Path) -> ModuleType:
    name = f"stillhook_extension_{path.stem}"
    if name in sys.modules:
        raise SpecError(f"{VARIABLE}: two files are called {path.name}. Rename one of them.")
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
