"""Public names of a package that are loaded when they are first used, so that importing the package costs nothing."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any


def public(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, from its stub `__init__.pyi`: a line
    `from module import name as name` for each name. Type checkers read the same lines."""
    stub = Path(str(sys.modules[package].__file__)).with_suffix(".pyi").read_text(encoding="utf-8")
    lines = [line for line in ast.parse(stub).body if isinstance(line, ast.ImportFrom)]
    modules = {alias.name: str(line.module) for line in lines for alias in line.names}

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = modules[name]
        submodule = module == package
        value = import_module(f"{module}.{name}") if submodule else getattr(import_module(module), name)
        setattr(sys.modules[package], name, value)
        return value

    return get, lambda: sorted(modules), sorted(modules)


class _After:
    """Finds a library as any finder does, and imports a module of ours once it is loaded."""

    def __init__(self, library: str, module: str) -> None:
        self.library, self.module = library, module

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != self.library or self not in sys.meta_path:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        loader = None if spec is None else spec.loader
        if loader is None:
            return spec
        run = loader.exec_module

        def then(module: ModuleType) -> None:
            run(module)
            import_module(self.module)

        loader.exec_module = then  # type: ignore[method-assign]
        return spec


def after(library: str, module: str) -> None:
    """Import a module once a library is loaded, which is now where it is: neither costs anything before."""
    if library in sys.modules:
        import_module(module)
    else:
        sys.meta_path.insert(0, _After(library, module))
