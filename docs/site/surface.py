"""`{surface} stillhook.plan`: every public name of a module with its docstring, so that no name can be forgotten."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from types import ModuleType

from sphinx.application import Sphinx

BLOCK = re.compile(r"^```\{surface\} (?P<module>[\w.]+)\n```$", re.MULTILINE)


def names(module: ModuleType) -> list[str]:
    """Public names of a module, in its own order; modules among them have pages of their own."""
    listed = getattr(module, "__all__", None) or dir(module)
    return [name for name in listed if not name.startswith("_") and not inspect.ismodule(getattr(module, name))]


def entry(module: ModuleType, name: str) -> list[str]:
    """Lines of reStructuredText that document one name."""
    thing, full = getattr(module, name), f"{module.__name__}.{name}"
    if inspect.isclass(thing):
        return [f".. autoclass:: {full}", "   :members:", "   :exclude-members: model_config", ""]
    return [f".. {'autofunction' if callable(thing) else 'autodata'}:: {full}", ""]


def documented(found: re.Match[str]) -> str:
    """A table of the module's names, then each of them with its docstring."""
    module = import_module(found["module"])
    listed = names(module)
    lines = [f".. currentmodule:: {module.__name__}", "", ".. autosummary::", ""]
    lines += [*(f"   {name}" for name in listed), ""]
    for name in listed:
        lines += entry(module, name)
    return "\n".join(["```{eval-rst}", *lines, "```"])


def fill(app: Sphinx, docname: str, source: list[str]) -> None:
    """Replace the blocks of a page by what they document."""
    source[0] = BLOCK.sub(documented, source[0])


def plain(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Begin the text of a property with an empty comment: napoleon takes what is before a colon for its type."""
    if what in ("property", "attribute"):
        lines[:0] = ["..", ""]


def skipped(app: Sphinx, what: str, name: str, thing: object, skip: bool, options: object) -> bool:
    """Whether a member is left out: fields of a named tuple that have no docstring of their own."""
    return skip or (inspect.getdoc(thing) or "").startswith("Alias for field number")


def setup(app: Sphinx) -> dict[str, bool]:
    """Entry point of the extension."""
    app.connect("source-read", fill)
    app.connect("autodoc-skip-member", skipped)
    app.connect("autodoc-process-docstring", plain, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
