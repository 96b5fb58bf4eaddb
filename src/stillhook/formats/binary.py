"""The one way in for binary files (HDF5, NetCDF, Parquet, Excel, MAT, MDF, TDMS): each is opened and read in a process
of its own.

The libraries that read these formats may wait for ever inside C on a damaged file, end the process, or take all memory,
and no thread or signal of Python can stop them. A process can be stopped: every step has a time limit, on Linux the
process has a memory limit, and every fault comes back as an `UnreadableError` with a reason in a few words. It
guards against damage; it is not a sandbox: the process runs with the rights of the user.

NetCDF files come back as labelled arrays (`read_dataset`).
What runs in that process (`serve`) is here too: it answers with the value of a function at a time.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

from stillhook.base.gateway import budget, template
from stillhook.base.gateway.access import first_bytes
from stillhook.base.gateway.budget import MEMORY, late, memory_limit, most_unpacked
from stillhook.base.gateway.guard import few_words
from stillhook.errors import StillhookError, UnreadableError
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray


VALUE, REFUSED, FAILED = "value", "refused", "failed"
GRACE = 5.0
"""How long after its limit this process ends by itself [s]."""

_worker_state: dict[str, Any] = {}
"""What a function leaves for the next one: an open log."""


def serve(requests: IO[bytes], answers: IO[bytes]) -> None:
    """Answer requests until there are no more, each with what was imported since the last."""
    known = set(sys.modules)
    with contextlib.suppress(EOFError, BrokenPipeError, KeyboardInterrupt):
        _limit_memory(pickle.load(requests))
        while True:
            kind, value = answer(pickle.load(requests))
            new = [name for name in list(sys.modules) if name not in known]
            known.update(new)
            send(answers, kind, value, new)


def _limit_memory(size: int) -> None:
    """Let an allocation beyond this fail here, where the system can: Linux."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_AS, (size, resource.getrlimit(resource.RLIMIT_AS)[1]))


def answer(request: tuple[float, Callable[..., Any], tuple[Any, ...]]) -> tuple[str, Any]:
    limit, function, arguments = request
    _end_after(limit + GRACE)
    try:
        return VALUE, function(*arguments)
    except StillhookError as problem:
        return REFUSED, problem
    except MemoryError:
        return FAILED, "needs more memory than is allowed"
    except BaseException as problem:  # readers raise many kinds for damaged files, some of them no Exception
        return FAILED, few_words(problem)
    finally:
        _end_after(0.0)


def _end_after(seconds: float) -> None:
    """Have the system end this process where no other is left to do it: the process that requested it may have been
    killed. 0: no more. Not on Windows."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)  # no handler of Python's, which a loop inside C would never reach


def send(stream: IO[bytes], kind: str, value: Any, modules: Sequence[str]) -> None:
    """A value, the numbers of its arrays next to it so that no copy is made; modules: imported for it."""
    buffers: list[pickle.PickleBuffer] = []
    body = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    raw = [buffer.raw() for buffer in buffers]
    pickle.dump((kind, body, [len(part) for part in raw], modules), stream)
    for part in raw:
        stream.write(part)
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[str, Any]:
    """What `send` wrote. Errors: EOFError where the other side ended."""
    kind, body, sizes, modules = pickle.load(stream)
    template.learn(modules)
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


T = TypeVar("T")


def read_binary(function: Callable[..., T], path: Path, *arguments: Any) -> T:
    """`function(path, *arguments)` in the process that reads, which is kept for the next file.

    function: of a module's top level, and its module light to import. Errors: StillhookError as the function raises it;
    UnreadableError for everything else that goes wrong, and where the time limit is passed.
    """
    return in_own_process(time_limit(path), function, Path(os.path.abspath(path)), *arguments)


def in_own_process(limit: float, function: Callable[..., T], *arguments: Any) -> T:
    """`function(*arguments)` in that process, within a time limit [s]. Errors: as `read_binary`."""
    with _LOCK:
        reader = _idle() or Reader()
        _IDLE.clear()
        try:
            value = reader.call(limit, function, *arguments)
        except BaseException:  # a library may hold on to what it could not read
            reader.close()
            raise
        _IDLE[os.getpid()] = reader
        return value


class Reader:
    """A process that reads. All requests go through `call`; `close` ends it."""

    def __init__(self) -> None:
        limit = memory_limit()
        try:
            self._process = template.begin()
        except OSError as problem:
            raise UnreadableError(f"no process to read it could be started: {problem.strerror or problem}") from None
        self._send(limit)

    def _send(self, message: Any) -> None:
        with contextlib.suppress(OSError):  # it has ended, which the wait for its answer finds
            pickle.dump(message, self._process.requests)
            self._process.requests.flush()

    def call(self, limit: float, function: Callable[..., T], *arguments: Any) -> T:
        """The function's value, within a time limit [s]. Errors: as `read_binary`; the process has ended after one of
        time."""
        answers: list[tuple[str, Any]] = []
        self._send((limit, function, arguments))
        waiting = threading.Thread(target=self._wait, args=(answers,), daemon=True)
        waiting.start()
        waiting.join(limit)
        if waiting.is_alive():
            self.close()
            raise UnreadableError(late(limit))
        if not answers:
            self.close()
            limits = f"{MEMORY} is {memory_limit() / 1e9:g} GB"
            raise UnreadableError(f"its reader broke down, on damage or for lack of memory; {limits}")
        kind, value = answers[0]
        if kind == REFUSED:
            raise value
        if kind == FAILED:
            raise UnreadableError(str(value))
        return value  # type: ignore[no-any-return]

    def _wait(self, answers: list[tuple[str, Any]]) -> None:
        with contextlib.suppress(EOFError, OSError, ValueError, pickle.UnpicklingError):  # ValueError: closed meanwhile
            answers.append(receive(self._process.answers))

    def close(self) -> None:
        """End the process, in any state."""
        self._process.close()


_LOCK = threading.Lock()
_IDLE: dict[int, Reader] = {}
"""The process that waits for the next file, by the process that started it: a fork has none."""


def _idle() -> Reader | None:
    return _IDLE.get(os.getpid())


@atexit.register
def end_readers() -> None:
    """End every process of this one that waits for the next file."""
    if (reader := _IDLE.pop(os.getpid(), None)) is not None:
        reader.close()
    template.close()


def time_limit(path: Path) -> float:
    """How long a step of reading a file may take [s]. Errors: as `stillhook.base.gateway.budget.time_limit`."""
    return budget.time_limit(_size(path))


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def refuse_bomb(path: Path, unpacked: float, *, allowed: float | None = None, at_once: bool = True) -> None:
    """Refuse a file that claims to hold more than its size can, or than memory can: before anything is unpacked.

    unpacked [bytes]: what its header claims; allowed: in place of what follows from its size; at_once: all of it is in
    memory together.
    Errors: UnreadableError.
    """
    most = most_unpacked(_size(path)) if allowed is None else allowed
    if unpacked > most:
        claim = f"claims to hold {_shown(unpacked)} in a file of {_shown(_size(path))}"
        raise UnreadableError(f"{claim}; up to {_shown(most)} is read")
    if at_once and unpacked > memory_limit():
        limit = f"up to {_shown(memory_limit())} is read at once"
        raise UnreadableError(f'holds {_shown(unpacked)}; {limit}, more with {MEMORY}="32 GB"')


def _shown(size: float) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB" if size >= 1e6 else f"{size:.0f} bytes"


HDF = b"\x89HDF"
MAGIC = {HDF: "h5netcdf", b"CDF\x01": "scipy", b"CDF\x02": "scipy"}
"""First bytes of a file, and what reads it."""


def read_dataset(path: Path) -> xarray.Dataset:
    """A complete NetCDF file in memory. Errors: UnreadableError with a reason in a few words."""
    return read_datasets(path, ())[0]


def read_datasets(path: Path, groups: Sequence[str]) -> tuple[xarray.Dataset, dict[str, xarray.Dataset]]:
    """A NetCDF file without its groups, and by name those of the groups that it has. Errors: UnreadableError."""
    _, first = first_bytes(path, 4, "NetCDF file", UnreadableError)
    if first not in MAGIC:
        raise UnreadableError("is empty" if not first else "does not begin as NetCDF does")
    return read_binary(_datasets, path, MAGIC[first], tuple(groups))


def _datasets(path: Path, engine: str, groups: Sequence[str]) -> tuple[xarray.Dataset, dict[str, xarray.Dataset]]:
    """In the process that reads."""
    required: Sequence[str] = ()
    if engine == MAGIC[HDF]:
        import h5py  # type: ignore[import-untyped]

        with h5py.File(path) as file:
            refuse_other_files(file)
            required = [name for name in groups if name in file]
    return _loaded(path, engine, None), {name: _loaded(path, engine, name) for name in required}


def _loaded(path: Path, engine: str, group: str | None) -> xarray.Dataset:
    import xarray

    with xarray.open_dataset(path, engine=engine, group=group) as data:
        refuse_bomb(path, data.nbytes)
        return data.load()


def refuse_other_files(file: Any) -> None:
    """Refuse an open HDF5 file whose links or data are in other files: it could name any file of the user. Errors:
    UnreadableError."""
    links: list[tuple[str, Any]] = []
    file.visititems_links(lambda name, link: links.append((name, link)))
    for name, link in links:
        if _leaves(file, name, link):
            raise UnreadableError(f"takes {quote(name)} from another file; only what is in the file itself is read")


def _leaves(file: Any, name: str, link: Any) -> bool:
    """Whether what is under a link of an HDF5 file is in another file. A soft link leads to what has a hard one."""
    import h5py

    if not isinstance(link, h5py.HardLink):
        return isinstance(link, h5py.ExternalLink)
    item = file[name]
    if not isinstance(item, h5py.Dataset):
        return False
    return bool(item.external) or (item.is_virtual and any(of.file_name != "." for of in item.virtual_sources()))
