"""What runs on Windows calls nothing that Windows lacks: every such place is listed here with what guards it."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from stillhook.live.runtime import deadlines, memory

SOURCE = Path(__file__).resolve().parents[2] / "src" / "stillhook"
MODULES = {"fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "posix", "syslog", "crypt", "spwd"}
"""Modules that Windows does not have."""
OF_OS = {
    *("fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "setuid", "setgid", "getpgid", "killpg", "setsid"),
    *("nice", "uname", "mkfifo", "mknod", "chown", "lchown", "chroot", "statvfs", "sysconf", "pread", "pwrite", "wait"),
    *("waitpid", "getloadavg", "getpriority", "setpriority", "sched_yield", "sched_setscheduler", "sched_setaffinity"),
    *(
        "sched_getaffinity",
        "sched_param",
        "SCHED_FIFO",
        "SCHED_OTHER",
        "SCHED_RR",
        "posix_spawn",
        "pipe2",
        "O_NONBLOCK",
    ),
}
"""Names of `os` that Windows does not have."""
OF_SIGNAL = {
    *("SIGKILL", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGPIPE", "SIGQUIT", "setitimer", "ITIMER_REAL", "alarm"),
    *("pthread_kill", "pthread_sigmask", "sigwait", "pause"),
}
OF_SOCKET = {"AF_UNIX", "SO_REUSEPORT"}
NAMES = {"os": OF_OS, "signal": OF_SIGNAL, "socket": OF_SOCKET}
KEYWORDS = {"shell", "preexec_fn", "start_new_session"}
"""Arguments of a subprocess that Windows lacks or that take the user's shell."""
PLACES = ("/proc", "/tmp", "/dev/", "/etc/", "/var/", "/usr/")

GUARDED = {
    ("kernels/cache.py", "os.geteuid"): "both functions return before it where os.name is nt",
    ("base/kept/leftovers.py", "os.geteuid"): "only where os.name is not nt",
    ("trust/home.py", "os.geteuid"): "only where os.name is posix",
    ("base/gateway/template.py", "/proc/self/task"): "in the template, which Linux alone has",
    ("base/gateway/template.py", "os.fork"): "in the template, which Linux alone has",
    ("base/gateway/template.py", "os.waitpid"): "in the template, which Linux alone has",
    ("base/gateway/template.py", "signal.SIGKILL"): "in the template, which Linux alone has",
    ("base/gateway/template.py", "socket.AF_UNIX"): "only where sys.platform is linux",
    ("base/signals.py", "signal.pthread_sigmask"): "hasattr",
    ("formats/binary.py", "import resource"): "ImportError is suppressed",
    ("formats/binary.py", "signal.setitimer"): "hasattr",
    ("formats/binary.py", "signal.ITIMER_REAL"): "hasattr of setitimer",
    ("live/runtime/causes.py", "/proc/thread-self/schedstat"): "_opened gives None where it is not there",
    ("live/runtime/causes.py", "/proc/stat"): "_opened gives None where it is not there",
    ("live/runtime/causes.py", "os.pread"): "only of a file of /proc that was opened",
    ("live/runtime/deadlines.py", "os.sched_setscheduler"): "hasattr",
    ("live/runtime/deadlines.py", "os.sched_param"): "hasattr of sched_setscheduler",
    ("live/runtime/deadlines.py", "os.SCHED_FIFO"): "hasattr of sched_setscheduler",
    ("live/runtime/deadlines.py", "os.SCHED_OTHER"): "hasattr of sched_setscheduler",
    ("live/runtime/deadlines.py", "os.sched_yield"): "hasattr",
    ("live/runtime/deadlines.py", "os.sched_getaffinity"): "hasattr",
    ("live/runtime/doctor.py", "/proc/stat"): "OSError gives NaN",
    ("live/runtime/doctor.py", "os.getloadavg"): "hasattr",
    ("live/runtime/doctor.py", "os.sysconf"): "AttributeError gives NaN",
    ("live/runtime/kernel.py", "os.sched_setaffinity"): "only with the shares of two_shares, of which Windows has none",
    ("live/runtime/memory.py", "import resource"): "returns before it where sys.platform is win32",
    ("live/history/sink.py", "os.nice"): "hasattr",
    ("live/observer/process.py", "os.nice"): "hasattr",
}
"""File and name, and what keeps Windows from it."""


def found(path: Path) -> Iterator[str]:
    """Names of a file that Windows does not have, and texts with the encoding of the machine."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (f"import {name.name}" for name in node.names if name.name.partition(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            yield from [f"import {module}"] if module in MODULES else []
            yield from (f"{module}.{name.name}" for name in node.names if name.name in NAMES.get(module, ()))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in NAMES.get(node.value.id, ()):
                yield f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            if node.value.startswith(PLACES):
                yield node.value
        elif isinstance(node, ast.Call):
            yield from (f"{k.arg}=" for k in node.keywords if k.arg in KEYWORDS)
            yield from _text_without_encoding(node)


def _text_without_encoding(call: ast.Call) -> Iterator[str]:
    """A file of text in the encoding of the machine, which on Windows is none that holds every letter."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    given = {k.arg for k in call.keywords}
    if name == "read_text" and not call.args and "encoding" not in given:
        yield "read_text() without encoding"
    if name == "write_text" and len(call.args) < 2 and "encoding" not in given:
        yield "write_text() without encoding"
    if name == "open" and isinstance(call.func, ast.Name) and "encoding" not in given:
        mode = next((a.value for a in call.args[1:2] if isinstance(a, ast.Constant)), "r")
        if "b" not in str(mode):
            yield "open() without encoding"


@pytest.mark.long
def test_every_call_that_windows_lacks_is_guarded_and_listed():
    places = {
        (path.relative_to(SOURCE).as_posix(), name) for path in sorted(SOURCE.rglob("*.py")) for name in found(path)
    }
    assert places == set(GUARDED)


def test_the_search_finds_what_it_looks_for(tmp_path: Path):
    file = tmp_path / "x.py"
    file.write_text(
        "import fcntl\nfrom os import fork\nimport os, signal, subprocess\nos.kill(1, signal.SIGKILL)\n"
        'subprocess.run("x", shell=True)\nopen("/tmp/x")\n',
        encoding="utf-8",
    )
    assert sorted(found(file)) == [
        "/tmp/x",
        "import fcntl",
        "open() without encoding",
        "os.fork",
        "shell=",
        "signal.SIGKILL",
    ]


def test_without_the_scheduler_of_linux_a_twin_runs_in_the_ordinary_class(monkeypatch: pytest.MonkeyPatch):
    """As on Windows."""
    for name in OF_OS:
        monkeypatch.delattr(os, name, raising=False)
    monkeypatch.setattr(sys, "platform", "win32")
    scheduling = deadlines.ask_for_real_time()
    assert not scheduling.real_time
    assert "no SCHED_FIFO" in scheduling.line
    deadlines.leave_real_time()
    deadlines.yield_processor()
    assert tuple(deadlines.two_shares()) == ()
    assert memory.page_faults() == 0


@pytest.mark.thorough
@pytest.mark.skipif(shutil.which("wine") is None, reason="wine is not installed")
def test_windows_prints_the_version():
    """With a Python for Windows that STILLHOOK_WINDOWS_PYTHON names, with the core's dependencies."""
    python = os.environ.get("STILLHOOK_WINDOWS_PYTHON")
    if python is None:
        pytest.skip("STILLHOOK_WINDOWS_PYTHON names no python.exe")
    command = ["wine", python, "-m", "stillhook", "--version"]
    environment = os.environ | {"PYTHONPATH": str(SOURCE.parent)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=600)
    assert done.stdout.startswith("stillhook ")
