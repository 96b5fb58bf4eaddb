"""Modules that extend Stillhook: those of a package's own folder, and modules of the user.

A user names them in the environment variable `STILLHOOK_EXTENSIONS`: paths of Python files, or importable modules,
separated as in PATH. Each is loaded once, before anything is simulated. A file may hold its tests: they are left out
here, for pytest to run, see `without_tests`.
"""

from __future__ import annotations
import __future__

import ast
import functools
import importlib
import importlib.util
import os
import pkgutil
import re
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from stillhook.errors import SpecError

VARIABLE = "STILLHOOK_EXTENSIONS"
"""Environment variable with a user's own winch types, controllers, units and sensors."""
KINDS = {
    "cycle": "a controller",
    "rates": "a winch type",
    "pull": "a unit between hook and slings",
    "reading": "a sensor",
}
"""Function by which a module is known, and what it is then."""
BELOW = ("base", "control", "errors", "physics", "statistics", "tables", "units", "winches")
"""Rooms that a module may import while it is loaded; those above know the modules that are loaded."""
ANNOTATIONS = __future__.annotations.compiler_flag
"""Leaves annotations unread while a file is loaded: they may name what only its tests import."""
OF_TESTS = ("pytest", "hypothesis")
"""Libraries that only tests import."""


def modules_in(package: ModuleType) -> Iterator[ModuleType]:
    """The modules of a package's folder, by name."""
    for entry in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
        yield importlib.import_module(f"{package.__name__}.{entry.name}")


@functools.cache
def extensions() -> tuple[ModuleType, ...]:
    """The user's own modules. Errors: SpecError of one line where one cannot be loaded."""
    names = [text.strip() for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text.strip()]
    return tuple(load(name) for name in names)


def extension_sources() -> list[Path]:
    """Files of the user's own modules: results follow from them too."""
    return [Path(str(module.__file__)) for module in extensions() if module.__file__]


def load(name: str) -> ModuleType:
    """A module by the path of its file or its import path. Errors: SpecError of one line for all that it raises, and
    where it is nothing that Stillhook uses."""
    path = Path(name)
    if path.suffix == ".py" and not path.is_file():
        raise SpecError(f"{VARIABLE}: no file {path}. Give paths of Python files, separated by {os.pathsep!r}.")
    try:
        module = _from_file(path) if path.suffix == ".py" else importlib.import_module(name)
    except (SpecError, KeyboardInterrupt):
        raise
    except BaseException as problem:
        lines = [f.lineno for f in traceback.extract_tb(problem.__traceback__) if Path(f.filename) == path.resolve()]
        line = problem.lineno if isinstance(problem, SyntaxError) else lines[-1] if lines else None
        place = f"{path.name}, line {line}" if line else f"{VARIABLE}: {name}"
        reason = problem.msg if isinstance(problem, SyntaxError) else " ".join(str(problem).split())
        do = "Correct it." if line else "Give paths of Python files, or modules that can be imported."
        raise SpecError(f"{place}: {type(problem).__name__}: {reason.rstrip('.')}. {do}") from problem
    kinds = {function: kind for function, kind in KINDS.items() if hasattr(module, function)}
    if not kinds:
        choices = ", ".join(f"{kind} has {function}" for function, kind in KINDS.items())
        raise SpecError(f"{path.name}: no cycle, rates, pull or reading. Declare one: {choices}.")
    if len(kinds) > 1:
        raise SpecError(
            f"{path.name}: both {' and '.join(kinds)}. A file is {' or '.join(kinds.values())}: make two files."
        )
    return module


def without_tests(tree: ast.Module) -> ast.Module:
    """A module without its tests, and without what only tests can use: functions and classes called test, libraries of
    tests, rooms that are above winches and controllers, and every statement that needs one of these to be executed."""
    gone: set[str] = set()
    body: list[ast.stmt] = []
    for each in tree.body:
        if isinstance(each, ast.Import | ast.ImportFrom):
            own = [alias for alias in each.names if not _of_tests(each, alias)]
            gone |= {(alias.asname or alias.name).partition(".")[0] for alias in each.names if alias not in own}
            if own:
                each.names = own
                body.append(each)
        elif re.match("test_|Test", getattr(each, "name", "")) or gone & _used_at_once(each):
            gone |= _bound(each)
        else:
            body.append(each)
    tree.body = body
    return tree


def _of_tests(statement: ast.Import | ast.ImportFrom, alias: ast.alias) -> bool:
    """Whether only tests can import this."""
    parts = (
        alias.name.split(".") if isinstance(statement, ast.Import) else [*str(statement.module).split("."), alias.name]
    )
    if parts[0] == "stillhook":
        return parts[1:2] != [] and (parts[1] not in BELOW or "registry" in parts)
    return parts[0] in OF_TESTS


def _used_at_once(statement: ast.stmt) -> set[str]:
    """Names that a statement uses when it is executed: of a function its decorators and defaults."""
    parts: list[ast.AST | None] = [statement]
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
        parts = [*statement.decorator_list, *statement.args.defaults, *statement.args.kw_defaults]
    nodes = [node for part in parts if part is not None for node in ast.walk(part)]
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}


def _bound(statement: ast.stmt) -> set[str]:
    """Names that a statement gives a value."""
    if hasattr(statement, "name"):
        return {str(statement.name)}
    return {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


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
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        tree = without_tests(ast.parse(path.read_bytes(), filename=str(path.resolve())))
        exec(compile(tree, str(path.resolve()), "exec", flags=ANNOTATIONS, dont_inherit=True), vars(module))
    except BaseException:
        del sys.modules[name]
        raise
    return module
