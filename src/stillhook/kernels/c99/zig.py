"""Zig's cache: what it keeps between runs, checked like every other file that may be damaged.

Zig builds the runtime of a platform once and links it into every library. It finds no damage in these objects, which
this module therefore knows by their SHA-256; damage in its indices it finds, or ends by a signal. What belongs to one
compilation alone is removed with it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

from stillhook.base.kept.checked import Kept, note, read_checked, write_checked
from stillhook.base.kept.leftovers import temporary_folder
from stillhook.errors import StillhookError

OBJECTS = "o"
"""Folder of the built objects in Zig's cache: each appears complete, and never changes."""
SUMS = "objects.json"
"""File with the checksums of the objects, by their path."""


@contextlib.contextmanager
def workplace(cache: Path) -> Iterator[tuple[Path, dict[str, str]]]:
    """A folder for one compilation, and the environment that Zig needs: it keeps its runtimes in `cache`."""
    _discard_damaged(cache)
    with temporary_folder("zig") as name:
        folder = Path(name)
        own = {"ZIG_LOCAL_CACHE_DIR": str(folder / "cache"), "ZIG_GLOBAL_CACHE_DIR": str(cache)}
        yield folder, os.environ | own
    _write_sums(cache)


CRASH = 0x80000000
"""Least exit code of a process of Windows that ended by an exception; elsewhere it is negative after a signal."""
Compile = Callable[[Path, dict[str, str]], "subprocess.CompletedProcess[str]"]
"""Runs Zig on a C text in a folder, with an environment; gives its answer, whatever that is."""


def compiled(cache: Path, compile_in: Compile) -> subprocess.CompletedProcess[str]:
    """The answer of Zig to a compilation in a workplace. A changed index can end Zig by a signal: what it keeps is then
    removed, and Zig runs once more."""
    kept = cache.is_dir()
    with workplace(cache) as (folder, environment):
        done = compile_in(folder, environment)
    if 0 <= done.returncode < CRASH or not kept:
        return done
    note(cache, "Zig crashed with what it kept", Kept.ZIG)
    shutil.rmtree(cache, ignore_errors=True)
    with workplace(cache) as (folder, environment):
        return compile_in(folder, environment)


def _discard_damaged(cache: Path) -> None:
    """Remove the cache where an object is not as it was built; Zig builds it again."""
    known = _sums(cache)
    if all(_sum(cache / OBJECTS / name) == expected for name, expected in known.items()):
        return
    note(cache, "an object in it has changed", Kept.ZIG)
    shutil.rmtree(cache, ignore_errors=True)


def _write_sums(cache: Path) -> None:
    """Add the checksums of new objects; a folder that cannot be written to is not a reason to fail."""
    known, objects = _sums(cache), cache / OBJECTS
    names = {path.relative_to(objects).as_posix() for path in objects.rglob("*") if path.is_file()}
    if names - known.keys():
        added = {name: _sum(objects / name) for name in names - known.keys()}
        with contextlib.suppress(StillhookError):
            write_checked(cache / SUMS, json.dumps(known | added, sort_keys=True).encode())


def _sums(cache: Path) -> dict[str, str]:
    content = read_checked(cache / SUMS, Kept.ZIG)
    return {} if content is None else dict(json.loads(content))


def _sum(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""
