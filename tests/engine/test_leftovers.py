"""Temporary files of processes that were killed are removed by the next that writes there; those of a living process,
and everything else, stay."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from stillhook.base.atomic import atomic_file, atomic_folder
from stillhook.base.kept import leftovers
from stillhook.base.kept.leftovers import AGE, prefix, sweep, temporary_folder
from stillhook.base.kept.one_at_a_time import one_at_a_time, remove_old_locks

posix = pytest.mark.skipif(os.name == "nt", reason="processes are not asked there")
OLD = time.time() - AGE - 3600.0


@pytest.fixture(autouse=True)
def _not_swept_yet():
    leftovers._SWEPT.clear()
    yield
    leftovers._SWEPT.clear()


def dead() -> int:
    """Number of a process that has ended."""
    run = subprocess.Popen([sys.executable, "-c", ""])
    run.wait()
    return run.pid


def left(file: Path, *, old: bool = True) -> Path:
    file.write_text("half")
    if old:
        os.utime(file, (OLD, OLD))
    return file


def name(process: int, stem: str = "run", suffix: str = ".nc") -> str:
    return f".{stem}-{process}.part-ab_12xyz{suffix}"


def test_a_killed_writer_leaves_a_file_of_that_name(tmp_path):
    text = """
import os, sys
from pathlib import Path
from stillhook.base.atomic import atomic_file, atomic_folder
with atomic_file(Path(sys.argv[1]) / "run.nc"), atomic_folder(Path(sys.argv[1])):
    print(os.getpid(), flush=True)
    os._exit(1)  # as a signal ends it
"""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run([sys.executable, "-c", text, tmp_path], capture_output=True, text=True, env=environment)
    process = run.stdout.strip()
    names = sorted(path.name.partition(".part-")[0] for path in tmp_path.iterdir())
    assert names == [f".folder-{process}", f".run-{process}"]
    for path in tmp_path.iterdir():
        os.utime(path, (OLD, OLD))
    with atomic_file(tmp_path / "run.nc") as part:
        part.write_text("complete")
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


@posix
def test_an_old_file_of_a_dead_process_is_removed_and_no_other(tmp_path):
    process = dead()
    gone = [left(tmp_path / name(process)), left(tmp_path / name(process, "very long name", ""))]
    stays = [
        left(tmp_path / name(os.getpid())),  # of a living process
        left(tmp_path / name(os.getppid())),
        left(tmp_path / name(process, "young"), old=False),
        left(tmp_path / "run.nc"),
        left(tmp_path / ".hidden"),
        left(tmp_path / f".run-{process}.nc"),
        left(tmp_path / f"run-{process}.part-ab_12xyz.nc"),  # not hidden
        left(tmp_path / f".run-{process}.part-ab_12xyz9.nc"),  # one character too many
    ]
    sweep(tmp_path)
    assert not any(path.exists() for path in gone)
    assert all(path.exists() for path in stays)


@posix
def test_a_folder_is_as_old_as_its_youngest_file(tmp_path):
    old, young = tmp_path / name(dead(), "folder", ""), tmp_path / name(dead(), "other", "")
    for folder in (old, young):
        folder.mkdir()
        left(folder / "run.nc", old=folder == old)
        os.utime(folder, (OLD, OLD))
    with atomic_folder(tmp_path) as part:
        (part / "plan.json").write_text("{}")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([young.name, "plan.json"])


@posix
def test_a_link_is_left_alone(tmp_path):
    kept = left(tmp_path / "kept")
    link = tmp_path / name(dead())
    link.symlink_to(kept)
    os.utime(link, (OLD, OLD), follow_symlinks=False)
    sweep(tmp_path)
    assert link.is_symlink()
    assert kept.exists()


@posix
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give a file away")
def test_a_file_of_another_user_is_left_alone(tmp_path):
    theirs = left(tmp_path / name(dead()))
    os.chown(theirs, 65533, -1)
    sweep(tmp_path)
    assert theirs.exists()


def test_a_folder_of_the_cache_holds_no_hidden_file_for_long(tmp_path):
    """Earlier versions named no process."""
    gone, stays = left(tmp_path / ".9265d2ca-pot4xheq.c"), left(tmp_path / ".young-pot4xheq.c", old=False)
    sweep(tmp_path, own=True)
    assert not gone.exists()
    assert stays.exists()


def test_a_folder_is_swept_once(tmp_path):
    sweep(tmp_path)
    stays = left(tmp_path / name(dead()))
    sweep(tmp_path)
    assert stays.exists()


def test_what_cannot_be_listed_is_no_error(tmp_path):
    sweep(tmp_path / "absent")
    sweep(left(tmp_path / "file"))


@posix
def test_temporary_folders_of_killed_processes_are_removed_by_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr(leftovers.tempfile, "tempdir", str(tmp_path))
    killed = tmp_path / f"stillhook-zig-{dead()}.part-ab_12xyz"
    killed.mkdir()
    os.utime(killed, (OLD, OLD))
    with temporary_folder("zig") as folder:
        assert [str(path) for path in tmp_path.iterdir()] == [folder]
        assert Path(folder).name.startswith(f"stillhook-zig-{os.getpid()}.part-")
    assert not any(tmp_path.iterdir())


def test_a_long_name_has_room_for_a_temporary_one(tmp_path):
    file = tmp_path / ("n" * 250 + ".txt")
    with atomic_file(file) as part:
        part.write_text("complete")
    assert file.read_text() == "complete"
    assert len(prefix("." + "n" * 250)) < 60


# Locks


def test_an_old_lock_goes_unless_it_is_held(tmp_path):
    pytest.importorskip("filelock")
    gone, young = left(tmp_path / "a.lock"), left(tmp_path / "b.lock", old=False)
    with one_at_a_time(tmp_path / "held.lock"):
        os.utime(tmp_path / "held.lock", (OLD, OLD))
        remove_old_locks(tmp_path)
        assert (tmp_path / "held.lock").exists()
    assert not gone.exists()
    assert young.exists()


def test_work_goes_on_where_no_lock_can_be_had(tmp_path):
    pytest.importorskip("filelock")
    done = []
    with one_at_a_time(tmp_path / "absent" / "a.lock"):
        done.append("no folder")
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "b.lock")], stdout=subprocess.PIPE, text=True)
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    with one_at_a_time(tmp_path / "b.lock", wait=0.2):
        done.append("held for too long")
    holder.kill()
    holder.wait()
    start = time.monotonic()
    with one_at_a_time(tmp_path / "b.lock"):
        done.append("its holder was killed")
    assert time.monotonic() - start < 10.0
    assert len(done) == 3


HOLD = """
import sys, time
from filelock import FileLock
with FileLock(sys.argv[1]):
    print("held", flush=True)
    time.sleep(600.0)
"""
