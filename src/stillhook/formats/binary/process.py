"""What runs in the process that reads binary files for `stillhook.formats.binary.reader`: a function at a time, its
value sent back.

Nothing here is imported by the process that the user started, and nothing but what a function needs is imported here.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import IO, Any

from stillhook.errors import StillhookError

VALUE, REFUSED, FAILED = "value", "refused", "failed"
GRACE = 5.0
"""How long after its limit this process ends by itself [s]."""
LONGEST_REASON = 120
"""Characters of a library's message that are passed on."""

_worker_state: dict[str, Any] = {}
"""What a function leaves for the next one: an open log."""


def serve() -> None:
    """Answer requests from standard input on standard output until there are no more. Nothing else reaches either."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    requests = sys.stdin.buffer
    with contextlib.suppress(EOFError, BrokenPipeError, KeyboardInterrupt):
        _limit_memory(pickle.load(requests))
        while True:
            send(answers, *_answer(pickle.load(requests)))


def _limit_memory(size: int) -> None:
    """Let an allocation beyond this fail here, where the system can: Linux; elsewhere the sizes that a file declares
    are all there is."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_AS, (size, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _answer(request: tuple[float, Callable[..., Any], tuple[Any, ...]]) -> tuple[str, Any]:
    limit, function, arguments = request
    _end_after(limit + GRACE)
    try:
        return VALUE, function(*arguments)
    except StillhookError as problem:
        return REFUSED, problem
    except MemoryError:
        return FAILED, "needs more memory than is allowed"
    except BaseException as problem:  # readers raise many kinds for damaged files, some of them no Exception
        reason = " ".join(str(problem).split())[:LONGEST_REASON].rstrip(" .")
        return FAILED, reason or type(problem).__name__
    finally:
        _end_after(0.0)


def _end_after(seconds: float) -> None:
    """Have the system end this process where nobody is left to do it: the process that requested it may have been
    killed. 0: no more. Not on Windows."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)  # no handler of Python's, which a loop inside C would never reach


def send(stream: IO[bytes], kind: str, value: Any) -> None:
    """A value, the numbers of its arrays next to it so that no copy is made."""
    buffers: list[pickle.PickleBuffer] = []
    body = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    raw = [buffer.raw() for buffer in buffers]
    pickle.dump((kind, body, [len(part) for part in raw]), stream)
    for part in raw:
        stream.write(part)
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[str, Any]:
    """What `send` wrote. Errors: EOFError where the other side ended."""
    kind, body, sizes = pickle.load(stream)
    buffers = [bytearray(size) for size in sizes]
    for buffer in buffers:
        view = memoryview(buffer)
        while view:
            count = stream.readinto(view)  # type: ignore[attr-defined]
            if not count:
                raise EOFError
            view = view[count:]
    return kind, pickle.loads(body, buffers=buffers)


def open_source(factory: Callable[..., Any], *arguments: Any) -> Mapping[str, Any]:
    """Open a log and keep it; what `stillhook.logs.formats.open.BinaryLog` shows of it."""
    source = _worker_state["source"] = factory(*arguments)
    _worker_state["pieces"] = {}
    return {
        "name": source.name,
        "row": source.row,
        "time_base": source.time_base,
        "headings": source.headings,
        "units": source.units,
        "bases": tuple(source.base(place) for place in range(len(source.headings))),
    }


def sample(place: int) -> str:
    """`Source.sample` of the open log."""
    return str(_worker_state["source"].sample(place))


def begin(number: int, wants: Any, size: int) -> None:
    """Begin to read the open log: `Source.chunks`, under a number."""
    pieces: dict[int, Iterator[Any]] = _worker_state["pieces"]
    pieces[number] = _worker_state["source"].chunks(wants, size)


def piece(number: int) -> Any:
    """The next chunk under a number, None after the last."""
    return next(_worker_state["pieces"][number], None)


def end(number: int) -> None:
    """Read no more under a number."""
    _worker_state["pieces"].pop(number, None)
