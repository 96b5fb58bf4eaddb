"""Processes for the readers of binary files, each of which begins in milliseconds (Linux).

They begin as copies of one process, the template, which has imported what readers need and opens no file itself: what a
damaged file did to a library ends with the copy. What to import is learned from what the copies report. Elsewhere, and
where a library has begun a thread, with which a process must not be copied, each starts by itself and takes as long as
its imports do.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from functools import partial
from typing import IO, NamedTuple

PATIENCE = 60.0
"""How long the template may take to answer [s]: to start, or to import."""
LONGEST = 1 << 20
"""Bytes of a message to the template."""
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1")

_SERVE = "from stillhook.formats.binary import serve"
_ALONE = (
    f"import os, sys, pickle; sys.path[:] = pickle.load(sys.stdin.buffer); {_SERVE};"
    " answers = os.fdopen(os.dup(1), 'wb'); os.dup2(2, 1); serve(sys.stdin.buffer, answers)"
)
"""Nothing but answers reaches standard output."""
_TEMPLATE = (
    "import pickle, socket, sys; control = socket.socket(fileno=int(sys.argv[1]));"
    f" sys.path[:] = pickle.loads(control.recv({LONGEST})); {_SERVE};"
    " from stillhook.base.gateway.template import copied; copied(control, serve)"
)


class Begun(NamedTuple):
    """A process that serves: where it takes requests, where it answers, and what ends it in any state."""

    requests: IO[bytes]
    answers: IO[bytes]
    end: Callable[[], None]

    def close(self) -> None:
        self.end()
        for stream in (self.requests, self.answers):
            with contextlib.suppress(OSError):
                stream.close()


def begin() -> Begun:
    """A new process that serves. Errors: OSError where the system starts none."""
    process, template = os.getpid(), None
    if sys.platform == "linux":
        with _LOCK, contextlib.suppress(OSError, EOFError):
            if process not in _TEMPLATES:
                _TEMPLATES[process] = None  # of one that does not start there is no second
                _TEMPLATES[process] = _Template()
            if (template := _TEMPLATES[process]) is not None:
                return template.begin()
        if template is not None:
            template.close()
            _TEMPLATES[process] = None
    return _alone()


def learn(modules: Iterable[str]) -> None:
    """What a process has imported, for those that begin after it."""
    _LEARNED.update(dict.fromkeys(modules))


_LOCK = threading.Lock()
_LEARNED: dict[str, None] = {}
_TEMPLATES: dict[int, _Template | None] = {}
"""By the process that started it: a fork has none. None: it does not work here."""


def close() -> None:
    """End the template of this process, and its copies; the next file starts another."""
    if (template := _TEMPLATES.pop(os.getpid(), None)) is not None:
        template.close()


class _Template:
    """The template, as seen by who started it."""

    def __init__(self) -> None:
        self._control, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._control.settimeout(PATIENCE)
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-c", _TEMPLATE, str(other.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=(other.fileno(),),
                env=os.environ | ONE_THREAD,
            )
        self._told = 0
        self._control.send(pickle.dumps(sys.path))

    def begin(self) -> Begun:
        """A copy. Errors: OSError, EOFError where there is none."""
        new = list(_LEARNED)[self._told :]
        requests, to = os.pipe()
        of, answers = os.pipe()
        streams = os.fdopen(to, "wb"), os.fdopen(of, "rb")
        try:
            socket.send_fds(self._control, [pickle.dumps(new)], [requests, answers])
            self._told += len(new)
            copy = pickle.loads(self._control.recv(LONGEST))
            if not copy:
                raise OSError("no copy")
        except BaseException:
            for stream in streams:
                stream.close()
            raise
        finally:
            os.close(requests)
            os.close(answers)
        return Begun(*streams, partial(self._end, copy))

    def _end(self, copy: int) -> None:
        """Have a copy ended by the process whose child it is, which alone knows that it is still this one. No answer is
        waited for: this may be called wherever memory is freed."""
        with contextlib.suppress(OSError):
            self._control.send(pickle.dumps(copy))

    def close(self) -> None:
        self._control.close()
        self._process.kill()
        self._process.wait()


def copied(control: socket.socket, serve: Callable[[IO[bytes], IO[bytes]], None]) -> None:
    """In the template: make and end copies as they are requested, until there are no more requests."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started it ends it
    copies: set[int] = set()
    while data := (message := socket.recv_fds(control, LONGEST, 2))[0]:
        request = pickle.loads(data)
        if isinstance(request, int):
            if request in copies:  # not yet waited for, so no other process has its number
                copies.remove(request)
                _kill(request)
            continue
        for module in request:
            with contextlib.suppress(BaseException):  # a copy did, and this one may not need it
                importlib.import_module(module)
        copy = 0
        if len(os.listdir("/proc/self/task")) == 1:
            copies.add(copy := _copy(control, serve, *message[1]))
        control.send(pickle.dumps(copy))
    for copy in copies:
        _kill(copy)


def _copy(control: socket.socket, serve: Callable[[IO[bytes], IO[bytes]], None], requests: int, answers: int) -> int:
    gc.freeze()  # what is never looked at again is shared between the copies
    if copy := os.fork():
        os.close(requests)
        os.close(answers)
        return copy
    try:
        control.close()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        serve(os.fdopen(requests, "rb"), os.fdopen(answers, "wb"))
    finally:
        os._exit(0)


def _kill(copy: int) -> None:
    with contextlib.suppress(OSError):
        os.kill(copy, signal.SIGKILL)
        os.waitpid(copy, 0)


def _alone() -> Begun:
    process = subprocess.Popen(
        [sys.executable, "-I", "-c", _ALONE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        env=os.environ | ONE_THREAD,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    with contextlib.suppress(OSError):  # it has ended, which the wait for its answer finds
        pickle.dump(sys.path, process.stdin)
    return Begun(process.stdin, process.stdout, partial(_ended, process))


def _ended(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
