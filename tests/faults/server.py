"""The process that runs command lines for `injector.Injector`, each in a fork of itself."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import json
import os
import signal
import sys
import time
from typing import Any

THREADED = ("polars", "_polars")
"""Packages with threads of their own, which no fork of them has: each child imports them itself."""
PR_SET_PDEATHSIG = 1
STEP = 0.002
"""Time between two looks at a child [s]."""


def end_with_parent() -> None:
    """Let this process be killed when the one that started it ends."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def wait(child: int, limit: float) -> int:
    """Exit code of a child, negative for a signal; it is killed after a time [s], and what it started with it."""
    end = time.monotonic() + limit
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
        time.sleep(STEP)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(status)


def become(request: dict[str, Any]) -> None:
    """Turn this process into one that is about to run a command line."""
    from tests.faults.injector import Control

    end_with_parent()
    os.setsid()
    os.chdir(request["cwd"])
    os.environ.update(request["env"])
    for name, number in (("out", 1), ("err", 2)):
        file = os.open(request[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, number)
        os.close(file)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    sys.argv = ["stillhook", *request["arguments"]]
    with open(request["shared"], "r+b") as file:  # last: from now on calls count
        file.seek(Control.below.offset)
        file.write(request["below"].encode().ljust(Control.below.size, b"\0"))


def preload(modules: list[str]) -> None:
    """Import modules, where that can be done by their names."""
    for module in modules:
        if module not in sys.modules and not module.startswith(("__", *THREADED)):
            with contextlib.suppress(Exception):
                importlib.import_module(module)
    gc.freeze()  # a child has no copies to make of what it does not change


def serve() -> None:
    """Until the input ends; returns in a child whose command line is to be run."""
    for line in sys.stdin:
        request = json.loads(line)
        if "import" in request:
            with open(request["import"], encoding="utf-8") as file:
                preload(file.read().split())
            print("{}", flush=True)
            continue
        child = os.fork()
        if child == 0:
            become(request)
            return
        code = wait(child, request["limit"])
        with open(request["shared"], "r+b") as file:
            from tests.faults.injector import Control

            file.seek(Control.below.offset)
            file.write(bytes(1))
        print(json.dumps({"code": code}), flush=True)
    sys.exit(0)


if __name__ == "__main__":
    from tests.faults.injector import MODULES

    end_with_parent()
    preload(sys.argv[1:])
    serve()
    from stillhook.__main__ import main

    try:
        if sys.argv[1] == "python":
            from tests.faults.writers import write

            write(*sys.argv[2:])
        else:
            main()
    finally:
        if MODULES in os.environ:
            with open(os.environ[MODULES], "w", encoding="utf-8") as file:
                file.write("\n".join(sys.modules))
