"""Libraries that a core installation lacks: the extra that brings each, and what to say where one is missing."""

from __future__ import annotations

from importlib.util import find_spec

from stillhook.errors import StillhookError

EXTRAS = {
    "matplotlib": "report",
    "typst": "report",
    "control": "stability",
    "duckdb": "logs",
    "asammdf": "logs",
    "nptdms": "logs",
    "openpyxl": "logs",
    "asyncua": "live",
    "pymodbus": "live",
    "lightgbm": "learn",
}
"""Name of a library as it is imported, and the extra that it belongs to."""


def installed(library: str) -> bool:
    """Whether a library can be imported; it is not loaded."""
    return find_spec(library) is not None


def need(library: str, subject: str, error: type[StillhookError]) -> None:
    """Refuse a request where its library is missing. Errors: error, one line."""
    if not installed(library):
        raise error(f"{subject}: {library} is not installed. Get it with: {how_to_get(library)}.")


def missing(problem: ModuleNotFoundError) -> str:
    """A line on the library of an extra that could not be imported; empty where it is another module."""
    library = (problem.name or "").partition(".")[0]
    if library not in EXTRAS:
        return ""
    return f"{library} is not installed. Get it with: {how_to_get(library)}."


def how_to_get(library: str) -> str:
    """The command that installs a library."""
    return f'pip install "stillhook[{EXTRAS[library]}]"'
