"""Shared libraries of an export, for this system and for others."""

from __future__ import annotations

import importlib.util
import platform as machine
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from stillhook import units
from stillhook.base.atomic import atomic_file
from stillhook.errors import ExportError
from stillhook.kernels.c99.zig import compiled
from stillhook.kernels.cache import cache_root


class Platform(NamedTuple):
    """A system and processor: target of Zig, suffix of a shared library, and what Python calls both."""

    target: str
    suffix: str
    system: str
    processors: tuple[str, ...]

    @property
    def own(self) -> bool:
        """Whether this machine is one."""
        return sys.platform == self.system and machine.machine().lower() in self.processors


INTEL = ("x86_64", "amd64")
PLATFORMS: Mapping[str, Platform] = {
    "linux64": Platform("x86_64-linux-gnu.2.17", ".so", "linux", INTEL),
    "win64": Platform("x86_64-windows-gnu", ".dll", "win32", INTEL),
    "macos-arm64": Platform("aarch64-macos", ".dylib", "darwin", ("arm64", "aarch64")),
}
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-shared", "-s")
"""Strict arithmetic, on the oldest processor of the platform."""


def own_platform() -> str | None:
    """Name of this machine's platform; None where it is not one of `PLATFORMS`."""
    return next((name for name, each in PLATFORMS.items() if each.own), None)


def check_platform(platform: str) -> None:
    """Errors: ExportError for an unknown platform, and for one whose compiler is absent."""
    _compiler(platform)


def _compiler(platform: str) -> list[str]:
    if platform not in PLATFORMS:
        allowed = ", ".join(PLATFORMS)
        raise ExportError(f"platform {units.quote(platform)} is not one of {allowed}. Choose among them, or source.")
    each = PLATFORMS[platform]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", "-target", each.target]
    for name in ("cc", "gcc", "clang") if each.own else ():
        if found := shutil.which(name):
            return [found]
    raise ExportError(
        f"platform {platform}: no compiler for it is here. Install Zig, which compiles for every platform:"
        ' pip install "stillhook[native]"; or choose source, which needs none.'
    )


def first_of(platforms: Sequence[str]) -> list[str]:
    """Those of the platforms for which no library was compiled with Zig yet: it then builds the platform's C runtime,
    which takes a minute or two of a core, and keeps it."""
    return [name for name in platforms if _compiler(name)[0] == sys.executable and not _mark(name).is_file()]


def _kept() -> Path:
    """Folder in which Zig keeps what it built, for one user."""
    return cache_root() / "zig"


def _mark(platform: str) -> Path:
    return _kept() / f"{platform}.ready"


def compile_library(source: str, platform: str, file: Path, flags: Sequence[str] = ()) -> None:
    """Compile C99 text to a shared library, which appears under its name when it is complete.

    Errors: ExportError, one line, for an unknown platform, a compiler that is absent, and one that fails.
    """
    command = _compiler(platform)
    libraries = ["-lm"] if platform == "linux64" else []
    hidden = [] if platform == "win64" else ["-fPIC"]
    with atomic_file(file) as part:

        def compile_in(folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
            code, made = folder / "model.c", folder / f"model{PLATFORMS[platform].suffix}"
            code.write_text(source, encoding="utf-8")
            done = subprocess.run(
                [*command, *FLAGS, *hidden, *flags, "-o", str(made), str(code), *libraries],
                capture_output=True,
                text=True,
                env=environment,
                check=False,
            )
            if done.returncode == 0:
                part.write_bytes(made.read_bytes())
            return done

        done = compiled(_kept(), compile_in)
        if done.returncode != 0:
            lines = [line for line in done.stderr.splitlines() if "error" in line] or done.stderr.splitlines() or ["?"]
            raise ExportError(f"platform {platform}: {Path(command[0]).name} failed: {lines[0].strip()[:300]}")
        if command[0] == sys.executable:
            _mark(platform).touch()
