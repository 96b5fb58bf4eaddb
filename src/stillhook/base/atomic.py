"""Files and folders that appear complete or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

from stillhook.base.kept.leftovers import prefix, sweep
from stillhook.errors import SimulationError


class atomic_file:
    """A temporary name next to the target, renamed when the block ends well and removed when it does not."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __enter__(self) -> Path:
        try:
            self.target.parent.mkdir(parents=True, exist_ok=True)
            sweep(self.target.parent)
            handle, name = tempfile.mkstemp(
                dir=self.target.parent, prefix=prefix(f".{self.target.stem}"), suffix=self.target.suffix
            )
        except (OSError, ValueError) as e:
            raise cannot_write(self.target, e) from None
        os.close(handle)
        self.part = Path(name)
        return self.part

    def __exit__(self, kind: object, error: BaseException | None, *rest: object) -> None:
        try:
            if error is None:
                os.chmod(self.part, 0o644)
                os.replace(self.part, self.target)
        except OSError as e:
            error = e
        finally:
            self.part.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise cannot_write(self.target, error) from None


class durable_file(atomic_file):
    """The same, and on the disk before its name is: a power cut leaves the complete file or none."""

    def __exit__(self, kind: object, error: BaseException | None, *rest: object) -> None:
        if error is None:
            try:
                _to_disk(self.part)
            except OSError as e:
                error = e
        super().__exit__(kind, error, *rest)
        if error is None and os.name != "nt":  # Windows writes names with their files
            _to_disk(self.target.parent)


def _to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class atomic_folder:
    """A temporary folder inside the target, whose files move into the target together when the block ends well."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __enter__(self) -> Path:
        try:
            self.created = not self.target.is_dir()
            self.target.mkdir(parents=True, exist_ok=True)
            sweep(self.target)
            self.part = Path(tempfile.mkdtemp(dir=self.target, prefix=prefix(".folder")))
        except (OSError, ValueError) as e:
            raise cannot_write(self.target, e) from None
        return self.part

    def __exit__(self, kind: object, error: BaseException | None, *rest: object) -> None:
        try:
            if error is None:
                for part in sorted(self.part.iterdir()):
                    os.replace(part, self.target / part.name)
        except OSError as e:
            error = e
        finally:
            shutil.rmtree(self.part, ignore_errors=True)
            if error is not None and self.created:
                shutil.rmtree(self.target, ignore_errors=True)
        if isinstance(error, OSError):
            raise cannot_write(self.target, error) from None
        if isinstance(error, SimulationError):  # a file in the temporary folder: name the folder that was requested
            raise SimulationError(str(error).replace(f"{self.part}{os.sep}", f"{self.target}{os.sep}")) from None


def cannot_write(target: Path, problem: Exception) -> SimulationError:
    """What is in the way of writing a file or folder."""
    reason = getattr(problem, "strerror", None) or problem
    return SimulationError(f"{target}: cannot be written ({reason}). Choose another folder.")


def check_folder(target: Path, names: tuple[str, ...]) -> None:
    """Refuse a folder that files of these names cannot be written to, before the work is done. Errors:
    SimulationError."""
    path = target
    for path in (target, *target.parents):
        if os.path.lexists(path):
            break
    if not path.is_dir():
        raise cannot_write(target, NotADirectoryError(None, f"{path.name} is not a folder"))
    if not os.access(path, os.W_OK):
        raise cannot_write(target, PermissionError(None, "no right to write there"))
    for name in names:
        if (target / name).is_dir():
            raise cannot_write(target / name, IsADirectoryError(None, "a folder of that name is in the way"))
