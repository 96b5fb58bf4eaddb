"""Processes that know modules of the user, as those of a user who has named them in STILLHOOK_EXTENSIONS.

Where the system can fork, one process of each worker has loaded what no such module changes, and a new one begins as
its copy: `python -m tests.contract.processes` reads requests from its input, a line each, and answers them in turn.
"""

from __future__ import annotations

import atexit
import functools
import importlib
import json
import os
import runpy
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.scripts import DOCS

ROOT = DOCS.parent
VARIABLE = "STILLHOOK_EXTENSIONS"
LIBRARIES = (
    "numpy",
    "pydantic",
    "rich.console",
    "rich.table",
    "scipy.interpolate",
    "scipy.optimize",
    "typer",
    "typer.main",
)
BELOW = (
    "stillhook.cli",
    "stillhook.kernels.c99.library",
    "stillhook.sea.motion.text",
    "stillhook.winches.types.active_passive",
)
"""Modules that know no others by name, with all that they import."""
PROGRAMS = ("stillhook", "tests.contract.commands")
"""What can begin as a copy: any other program has a process of its own."""
KNOWS = ("stillhook.control.registry", "stillhook.winches.registry")
"""Modules that ask for those of the user when they are loaded."""


def python(*arguments: str, extensions: list[Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """A process that knows the user's modules."""
    paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    environment = os.environ | {VARIABLE: os.pathsep.join(map(str, extensions)), "PYTHONPATH": paths}
    if hasattr(os, "fork") and arguments[0] == "-m" and arguments[1] in PROGRAMS:
        return _forked(arguments[1:], environment, folder)
    command = [sys.executable, *arguments]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)


@functools.cache
def _server() -> subprocess.Popen[str]:
    """The process that forks the others: it ends with this one."""
    paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    environment |= {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "tests.contract.processes"]
    server = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(server.communicate)
    return server


def _forked(words: tuple[str, ...], environment: Mapping[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    with tempfile.TemporaryDirectory() as place:
        request = {"words": words, "environment": dict(environment), "folder": str(folder), "place": place}
        server = _server()
        assert server.stdin is not None
        assert server.stdout is not None
        print(json.dumps(request), file=server.stdin, flush=True)
        code = int(server.stdout.readline())
        out, err = (Path(place, name).read_text(encoding="utf-8") for name in ("out", "err"))
    return subprocess.CompletedProcess([*words], code, out, err)


def _serve() -> None:
    for name in (*LIBRARIES, *BELOW):
        importlib.import_module(name)
    assert not any(name in sys.modules for name in KNOWS)
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            _become(**json.loads(line))
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def _become(words: list[str], environment: dict[str, str], folder: str, place: str) -> None:
    """Runs `python -m` with these words and ends. place: folder of what it prints."""
    code: Any = 1
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        for number, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(os.path.join(place, name), os.O_WRONLY | os.O_CREAT), number)
        os.environ.clear()
        os.environ.update(environment)
        os.chdir(folder)
        sys.argv = list(words)
        sys.path[0] = folder
        runpy.run_module(words[0], run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as end:
        code = end.code or 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 1)


if __name__ == "__main__":
    _serve()
