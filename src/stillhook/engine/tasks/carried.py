"""Tasks and answers as bytes that travel between machines: the hash of the code that made them, then records alone.

Layout: a line "stillhook KIND HASH", then a pickle of protocol 5. The hash is compared before anything is decoded, and
what is decoded can name no function: records of Stillhook (models, NamedTuples, dataclasses, enums, types of case) and
NumPy's arrays. Another name ends the decoding before anything is made of it.

This limits what Stillhook itself decodes. Dask decodes its own messages by pickle, and runs what a client sends: who
may speak to a scheduler is settled by its certificates alone (`stillhook.engine.tasks.cluster`).
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import io
import pickle
from collections.abc import Callable
from enum import Enum
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel

from stillhook import errors
from stillhook.engine.store import Summary
from stillhook.engine.tasks import CaseType, Task
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.build import results_hash

Kept = TypeVar("Kept", bound=Callable[..., Any])
RECORDS = (BaseModel, tuple, Enum, CaseType, Summary)
"""Classes whose subclasses in Stillhook are records, besides dataclasses."""
OF_ARRAYS = frozenset(
    {
        ("numpy", "dtype"),
        ("numpy", "ndarray"),
        ("numpy._core.multiarray", "_reconstruct"),
        ("numpy._core.multiarray", "scalar"),
        ("numpy._core.numeric", "_frombuffer"),
        ("stillhook.base.arrays", "_revive"),
        ("array", "_array_reconstructor"),
        ("array", "array"),
    }
)
"""What arrays of numbers are made with, by module and name."""


class CarriedError(SimulationError):
    """Bytes that are no task or answer of this version of Stillhook."""


class Answer(NamedTuple):
    """What came of a task: what is kept of its runs, or class and words of the error that ended it; made_by: hash of
    the code of the worker, which ran nothing where it is another than the task's."""

    made_by: str
    kept: list[Any] | None = None
    error: tuple[str, str] | None = None


def kept_on_workers(function: Kept) -> Kept:
    """Decorator of what may be kept of a run on a worker (`keep` of `stillhook.engine.simulate.run_cases`): a function
    of a module of Stillhook, which travels by its name."""
    vars(function)["kept_on_workers"] = True
    return function


def pack_task(task: Task) -> bytes:
    """A task, without the sources of the cranes' numbers. Errors: SimulationError for a `keep` that does not
    travel."""
    keep, arguments = _name_of(task.keep)
    fields = {name: value for name, value in task.light()._asdict().items() if name != "keep"}
    return _packed("task", (fields, keep, arguments))


def unpack_task(data: bytes) -> Task:
    """A task of the same code. Errors: CarriedError."""
    fields, keep, arguments = _unpacked("task", data)
    function = _named(keep)
    return Task(**fields, keep=functools.partial(function, **arguments) if arguments else function)


def answer_to(data: bytes) -> bytes:
    """Run a packed task, on a worker; what came of it, or which code the worker runs where it is another. What is no
    task is an error of this machine."""
    if code_of("task", data) != results_hash():
        return _packed("answer", None)
    try:
        return _packed("answer", (unpack_task(data).run(), None))
    except StillhookError as problem:
        return _packed("answer", (None, (type(problem).__name__, str(problem))))


def unpack_answer(data: bytes) -> Answer:
    """What a worker gave back. Errors: CarriedError."""
    made_by = code_of("answer", data)
    if made_by != results_hash():
        return Answer(made_by)
    kept, error = _unpacked("answer", data) or (None, None)
    return Answer(made_by, kept, error)


def error_of(name: str, text: str) -> StillhookError:
    """An error of a case, as this machine raises it; one of a class that it does not know is a SimulationError."""
    of = getattr(errors, name, None)
    known = isinstance(of, type) and issubclass(of, StillhookError)
    return of(text) if known else SimulationError(text)  # type: ignore[misc]


def is_public(module: str) -> bool:
    """Whether this is a module of Stillhook that is there to be imported, unlike one that is run."""
    return module.startswith("stillhook.") and "__" not in module


def code_of(kind: str, data: bytes) -> str:
    """Hash of the code that made these bytes. Errors: CarriedError where they are none of this kind."""
    first, _, _ = data[:128].partition(b"\n")
    words = first.decode("ascii", "replace").split(" ", 2)
    if len(words) != 3 or words[:2] != ["stillhook", kind]:
        raise CarriedError(f"cluster: not a {kind} of Stillhook. Install the same version everywhere.")
    return words[2]


def _packed(kind: str, content: Any) -> bytes:
    return f"stillhook {kind} {results_hash()}\n".encode() + pickle.dumps(content, 5)


def _unpacked(kind: str, data: bytes) -> Any:
    code_of(kind, data)
    try:
        return _Records(io.BytesIO(data[data.index(b"\n") + 1 :])).load()
    except CarriedError:
        raise
    except Exception as problem:  # of damaged bytes many kinds come
        reason = f"{type(problem).__name__}: {' '.join(str(problem).split())}"
        raise CarriedError(f"cluster: a {kind} is damaged ({reason[:120]}). Run again.") from None


class _Records(pickle.Unpickler):
    """Decodes records, and nothing that could be called for what it does."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in OF_ARRAYS:
            return super().find_class(module, name)
        if is_public(module) and "." not in name:
            found = super().find_class(module, name)
            if isinstance(found, type) and (issubclass(found, RECORDS) or dataclasses.is_dataclass(found)):
                return found
        raise CarriedError(
            f"cluster: {module}.{name} is not a record of Stillhook, and only those are decoded. Use motions and cases"
            " of the package."
        )


def _name_of(keep: Callable[[Any], Any]) -> tuple[str, dict[str, Any]]:
    """Module and name of what is kept of a run, and the arguments that it is called with besides."""
    function: Any = keep
    arguments: dict[str, Any] = {}
    if isinstance(keep, functools.partial) and not keep.args:
        function, arguments = keep.func, keep.keywords
    name = f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', '')}"
    _named(name)
    return name, arguments


def _named(name: str) -> Callable[..., Any]:
    """The function of this name. Errors: CarriedError where it is none that may be kept on workers."""
    module, _, function = name.partition(":")
    found = None
    if is_public(module):
        found = vars(importlib.import_module(module)).get(function)
    if not getattr(found, "kept_on_workers", False):
        raise CarriedError(
            f"cluster: keep = {name}: not a function of Stillhook that workers may call. Leave client out, or keep"
            " summaries."
        )
    return found  # type: ignore[return-value]
