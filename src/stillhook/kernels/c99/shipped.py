"""Libraries of kernels that a wheel holds, compiled when it was made: one for each platform and level of processor.

The index names what they were made from. A library is used only where that is what is installed: all sources, or the
C source of a kernel. A checkout holds none.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import json
import platform
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from stillhook.kernels.cache import SHIPPED

INDEX = "kernels.json"
SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "macos"}
X86 = ("amd64", "x86_64")
V2, V3, ARM = "x86_64_v2", "x86_64_v3", "aarch64"


class Index(NamedTuple):
    """sources: hash of everything that the kernels were translated from; kernels: symbol -> hash of its C source;
    libraries: platform -> file."""

    sources: str
    kernels: Mapping[str, str]
    libraries: Mapping[str, str]


def code_hash(source: str) -> str:
    """Identity of a C source."""
    return hashlib.sha256(source.encode()).hexdigest()[:24]


@functools.cache
def level() -> str:
    """Processor that code is made for: x86-64 with AVX2 where this one has it, else with SSE4.2; "aarch64"; "" for
    any other."""
    machine = platform.machine().lower()
    if machine not in X86:
        return ARM if machine in ("arm64", "aarch64") else ""
    core = "numpy._core" if importlib.util.find_spec("numpy._core") else "numpy.core"
    features = importlib.import_module(f"{core}._multiarray_umath").__cpu_features__
    return V3 if features["AVX2"] and features["FMA3"] else V2


@functools.cache
def index(folder: Path) -> Index | None:
    """Index of the libraries in a folder; None where it holds none that can be read."""
    try:
        return Index(**json.loads((folder / INDEX).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def shipped_library(
    symbols: Iterable[str], *, sources: str = "", code: str = "", folder: Path = SHIPPED
) -> Path | None:
    """File of the library with these kernels for this machine.

    sources: hash of the installed sources, code: hash of the kernels' C source; None where neither is what the library
    was made from.
    """
    known, system = index(folder), SYSTEMS.get(sys.platform)
    if known is None or (name := known.libraries.get(f"{system}-{level()}")) is None:
        return None
    codes = {known.kernels.get(symbol) for symbol in symbols}
    if None in codes or not (known.sources == sources or codes == {code}):
        return None
    return folder / name
