"""Files and folders that appear complete or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from stillhook.base.kept.leftovers import prefix, sweep
from stillhook.errors import SimulationError


class atomic_files:
    """Temporary names next to the targets, which all get their names when the block ends well; else all targets are as
    they were, and neither temporary files nor folders made for them are left. modes: rights of the files, at no time
    more."""

    def __init__(self, *targets: Path, modes: Sequence[int] | None = None) -> None:
        self.targets, self.modes = targets, modes or [0o644] * len(targets)

    def __enter__(self) -> tuple[Path, ...]:
        self._made: list[Path] = []
        parts: list[Path] = []
        target = self.targets[0]
        try:
            for target in self.targets:
                self._made[:0] = _make_folder(target.parent)
                sweep(target.parent)
                handle, name = tempfile.mkstemp(
                    dir=target.parent, prefix=prefix(f".{target.stem}"), suffix=target.suffix
                )
                parts.append(Path(name))
                os.close(handle)
        except (OSError, ValueError) as e:
            _discard(parts, self._made)
            raise cannot_write(target, e) from None
        self._parts = tuple(parts)
        return self._parts

    def __exit__(self, kind: object, error: BaseException | None, *rest: object) -> None:
        try:
            if error is None:
                self._finish()
        except OSError as e:
            error = e
        except BaseException:
            _discard(self._parts, self._made)
            raise
        if error is not None:
            _discard(self._parts, self._made)
        if isinstance(error, OSError):
            raise cannot_write(self.targets[0], error) from None

    def _finish(self) -> None:
        for part, mode in zip(self._parts, self.modes, strict=True):
            os.chmod(part, mode)
        _put(list(zip(self._parts, self.targets, strict=True)))


class atomic_file:
    """A temporary name next to the target, renamed when the block ends well and removed when it does not."""

    files = atomic_files

    def __init__(self, target: Path) -> None:
        self._one = self.files(target)

    def __enter__(self) -> Path:
        return self._one.__enter__()[0]

    def __exit__(self, kind: object, error: BaseException | None, *rest: object) -> None:
        self._one.__exit__(kind, error)


class _durable_files(atomic_files):
    def _finish(self) -> None:
        for part in self._parts:
            _to_disk(part)
        super()._finish()
        if os.name != "nt":  # Windows writes names with their files
            for folder in {target.parent for target in self.targets}:
                _to_disk(folder)


class durable_file(atomic_file):
    """The same, and on the disk before its name is: a power cut leaves the complete file or none."""

    files = _durable_files


def _to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class atomic_folder:
    """A temporary folder whose files get their places together when the block ends well: it becomes the target where
    that is new, in one step; else its files move into the target, and what they replace comes back where one cannot."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __enter__(self) -> Path:
        self._made: list[Path] = []
        try:
            self._new = not self.target.is_dir()
            if self._new and self.target.exists():
                raise NotADirectoryError(None, f"{self.target.name} is not a folder")
            above = self.target.absolute().parent if self._new else self.target
            self._made = _make_folder(above)
            sweep(above)
            self.part = Path(
                tempfile.mkdtemp(dir=above, prefix=prefix(f".{self.target.name}" if self._new else ".folder"))
            )
        except (OSError, ValueError) as e:
            _discard((), self._made)
            raise cannot_write(self.target, e) from None
        return self.part

    def __exit__(self, kind: object, error: BaseException | None, *rest: object) -> None:
        try:
            if error is None:
                self._finish()
        except OSError as e:
            error = e
        finally:
            shutil.rmtree(self.part, ignore_errors=True)
            if error is not None:
                _discard((), self._made)
        if isinstance(error, OSError):
            raise cannot_write(self.target, error) from None
        if isinstance(error, SimulationError):  # a file in the temporary folder: name the folder that was requested
            raise SimulationError(str(error).replace(f"{self.part}{os.sep}", f"{self.target}{os.sep}")) from None

    def _finish(self) -> None:
        if self._new and not self.target.exists():
            os.chmod(self.part, 0o755)
            os.rename(self.part, self.target)
        else:
            _put([(part, self.target / part.name) for part in sorted(self.part.iterdir())])


def _make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it. Gives what was made, the innermost first."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        _discard((), missing)
        raise
    return missing


def _discard(files: Sequence[Path], folders: Sequence[Path]) -> None:
    """Remove temporary files, then folders that are empty."""
    for file in files:
        with contextlib.suppress(OSError):
            file.unlink()
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def _put(pairs: Sequence[tuple[Path, Path]]) -> None:
    """Move files, and folders that are new, to their targets; where one cannot be moved, all targets are as they were.
    A process that is killed leaves each target as it was or as it is to be."""
    if len(pairs) == 1:
        os.replace(*pairs[0])
        return
    begun: list[tuple[Path, Path, Path | None]] = []
    try:
        for part, target in pairs:
            before = part.with_name(f"{part.name}.before") if target.is_file() else None
            begun.append((part, target, before))
            if before is not None:
                _second_name(target, before)
            os.replace(part, target)
    except BaseException:
        for part, target, before in reversed(begun):
            with contextlib.suppress(OSError):
                if before is not None:
                    os.replace(before, target)
                elif not part.exists():
                    os.replace(target, part)
        raise
    finally:
        for _, _, before in begun:
            if before is not None:
                with contextlib.suppress(OSError):
                    before.unlink(missing_ok=True)


def _second_name(file: Path, name: Path) -> None:
    """A second name of a file, or a copy of it where the file system has no such names."""
    try:
        os.link(file, name)
    except OSError:
        shutil.copy2(file, name)


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
