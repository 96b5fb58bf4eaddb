"""The journal of a history: one SQLite file in WAL mode, which acknowledges what it was given.

A commit returns when its pages are on the disk (`synchronous = FULL`). A batch of rows is one record: time, status and
each column one after another as doubles with a checksum. Rows have a number that only rises, regardless of the clock.
Runs cut the rows into files: a run ends with the hour of its clock, with other columns, or when it is as large as a
file may be.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import durable_file
from stillhook.errors import LiveError

JOURNAL, LOCK, ARCHIVE_LOCK, HOURS = "journal.sqlite", "writer.lock", "archive.lock", "hours"
"""Names in the folder of a history."""
APPLICATION, VERSION = 0x53484C4C, 1
"""What marks the journal of a history, and the version of its tables."""
PATIENCE = 10.0
"""Time that another process may take to commit [s]."""
GLANCE = 0.5
"""Time that a look at whether a lock is held may take [s]."""
LARGEST_LOG = 16_000_000
"""Size to which the log of SQLite is cut when it is empty [bytes]."""
SETTINGS = (
    "synchronous = FULL",
    "fullfsync = 1",  # of macOS
    "checkpoint_fullfsync = 1",
    f"journal_size_limit = {LARGEST_LOG}",
)
NUMBER = 8
"""Bytes of a double."""
TABLES = Path(__file__).with_name("journal.sql").read_text(encoding="utf-8")
REASONS = {
    "SQLITE_FULL": "the disk is full. Free some space: what was acknowledged is safe",
    "SQLITE_BUSY": "another process holds it. Try again",
    "SQLITE_CORRUPT": "it is damaged. Move it away, and keep the files in hours",
    "SQLITE_NOTADB": "it is not a journal of a history. Choose another folder",
    "SQLITE_CANTOPEN": "it cannot be opened. Check the folder and its rights",
    "SQLITE_READONLY": "it cannot be written. Check the folder and its rights",
    "SQLITE_IOERR": "the disk does not take it. Check its space and its health: what was acknowledged is safe",
}


@contextlib.contextmanager
def in_one_line(path: Path) -> Iterator[None]:
    """Errors of SQLite and of the disk as a LiveError about a file."""
    try:
        yield
    except sqlite3.Error as problem:
        name = getattr(problem, "sqlite_errorname", "")
        text = next((text for code, text in REASONS.items() if name.startswith(code)), f"{problem}. Check the folder")
        raise LiveError(f"{path}: {text}.") from None
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise LiveError(f"{path}: {reason}. Check the folder, its rights and its space.") from None


def create(folder: Path) -> None:
    """Make the journal of a new history; it appears when it is complete."""
    for left in folder.glob(f".{Path(JOURNAL).stem}-*"):  # of a writer that was killed here
        left.unlink(missing_ok=True)
    settings = (f"application_id = {APPLICATION}", f"user_version = {VERSION}", "journal_mode = WAL")
    statements = [
        "PRAGMA auto_vacuum = INCREMENTAL",
        *TABLES.split(";\n"),
        *(f"PRAGMA {setting}" for setting in settings),
    ]
    with (
        in_one_line(folder / JOURNAL),
        durable_file(folder / JOURNAL) as part,
        contextlib.closing(sqlite3.connect(part, isolation_level=None)) as connection,
    ):
        for statement in statements:
            connection.execute(statement)


def connect(folder: Path) -> sqlite3.Connection:
    """An open journal; statements outside `transaction` read. Errors: LiveError where it is not there, not one, or of
    another version."""
    path = folder / JOURNAL
    if not path.is_file():
        raise LiveError(f"{folder}: no history is there, {JOURNAL} is missing. Give the folder of a history.")
    address = path.resolve().as_uri()
    if not os.access(folder, os.W_OK) and not Path(f"{path}-wal").exists():
        address += "?immutable=1"  # a closed history in a folder that may only be read
    with in_one_line(path):
        connection = sqlite3.connect(address, uri=True, timeout=PATIENCE, isolation_level=None, check_same_thread=False)
        try:
            _check_version(connection, path)
            for setting in SETTINGS:
                connection.execute(f"PRAGMA {setting}")
        except BaseException:
            connection.close()
            raise
    return connection


def _check_version(connection: sqlite3.Connection, path: Path) -> None:
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION:
        raise LiveError(f"{path}: it is not a journal of a history. Choose another folder.")
    if version != VERSION:
        raise LiveError(
            f"{path}: version {version}, and this Stillhook reads {VERSION}. Use the Stillhook that wrote it, or"
            " another folder."
        )


@contextlib.contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """All of it is on the disk when the block ends, or nothing of it."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        with contextlib.suppress(sqlite3.Error):
            connection.execute("ROLLBACK")
        raise


@contextlib.contextmanager
def snapshot(connection: sqlite3.Connection) -> Iterator[None]:
    """Everything that is read in the block is of one moment."""
    connection.execute("BEGIN")
    try:
        yield
    finally:
        with contextlib.suppress(sqlite3.Error):
            connection.execute("ROLLBACK")


def lock(folder: Path, name: str, patience: float = GLANCE) -> sqlite3.Connection | None:
    """A lock that ends with the process, however that ends; None where another one has it for so long [s]. It is an
    empty database that is held exclusively, which works alike on every platform, and within a process."""
    with in_one_line(folder / name):
        folder.mkdir(parents=True, exist_ok=True)
        connection = sqlite3.connect(folder / name, timeout=patience, isolation_level=None, check_same_thread=False)
        try:
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as problem:
            connection.close()
            if problem.sqlite_errorname.startswith("SQLITE_BUSY"):
                return None
            raise
    return connection


def locked(folder: Path, name: str) -> bool | None:
    """Whether a process holds a lock; None where one may not look."""
    path = folder / name
    if not (path.is_file() and os.access(folder, os.W_OK)):
        return None
    with in_one_line(path), contextlib.closing(sqlite3.connect(path, timeout=0.0)) as connection:
        try:
            connection.execute("SELECT 1 FROM sqlite_master").fetchall()
        except sqlite3.OperationalError:
            return True
    return False


def packed(time: FloatArray, status: FloatArray, values: FloatArray) -> bytes:
    """A batch as it is stored. Parameters: time, status (n,); values (n, columns)."""
    return np.vstack([time, status, values.T]).astype("<f8").tobytes()


def unpacked(data: bytes, rows: int, crc: int) -> FloatArray | None:
    """(2 + columns, rows) time, status and values of a batch; None where its checksum is another."""
    if zlib.crc32(data) != crc or len(data) % (NUMBER * rows):
        return None
    return np.frombuffer(data, dtype="<f8").reshape(-1, rows)
