"""Libraries that a core installation lacks: the extra that brings each, and what to say where one is missing."""

from __future__ import annotations

from importlib.util import find_spec

EXTRAS = {
    "matplotlib": "report",
    "typst": "report",
    "control": "stability",
    "polars": "logs",
    "asammdf": "logs",
    "nptdms": "logs",
    "openpyxl": "logs",
}
"""Name of a library as it is imported, and the extra that it belongs to."""


def installed(library: str) -> bool:
    """Whether a library can be imported; it is not loaded."""
    return find_spec(library) is not None


def how_to_get(library: str) -> str:
    """The command that installs a library."""
    return f'pip install "stillhook[{EXTRAS[library]}]"'
