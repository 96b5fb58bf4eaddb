"""Compiled code is machine code: it is loaded only from a folder that nobody else may write to."""

import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

from stillhook.base.kept.checked import write_checked
from stillhook.errors import SimulationError
from stillhook.kernels import build, cache

pytestmark = pytest.mark.slow

posix = pytest.mark.skipif(os.name == "nt", reason="rights are kept otherwise there")
root = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give a folder away")
SOMEBODY = 65533
LOAD = """
import sys
from stillhook.kernels import build
from stillhook.physics.scalar import scalar
def triple(x):
    return 3.0 * x
print(build.compiled(triple, "triple")(2.0))
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    """A temporary folder of the system for each test, and notes that were not given yet."""
    folder = tmp_path / "system"
    folder.mkdir(mode=0o700)
    monkeypatch.setattr(cache.tempfile, "gettempdir", lambda: str(folder))
    for kept in (cache.private_folder, cache._note):
        kept.cache_clear()
    yield folder
    for kept in (cache.private_folder, cache._note):
        kept.cache_clear()


def made(folder: Path, mode: int) -> Path:
    folder.mkdir(parents=True)
    folder.chmod(mode)
    return folder


def chosen(monkeypatch, folder: Path) -> Path:
    monkeypatch.setenv("STILLHOOK_CACHE", str(folder))
    return cache.cache_root()


def test_a_folder_that_only_the_user_can_write_to_is_taken_without_a_word(tmp_path, monkeypatch, caplog):
    assert chosen(monkeypatch, tmp_path / "new" / "below") == tmp_path / "new" / "below"
    assert chosen(monkeypatch, made(tmp_path / "read", 0o755)) == tmp_path / "read"
    assert not caplog.records


@posix
def test_folders_made_for_the_cache_are_closed_to_others_whatever_the_umask(tmp_path, monkeypatch):
    before = os.umask(0o002)
    try:
        folder = chosen(monkeypatch, tmp_path / "new" / "below")
        assert [path.stat().st_mode & 0o777 for path in (folder, folder.parent)] == [0o700, 0o700]
    finally:
        os.umask(before)


def test_a_cache_folder_that_cannot_be_made_is_replaced(tmp_path, monkeypatch, temporary):
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert chosen(monkeypatch, blocked / "below") == temporary / "stillhook-cache"
    assert chosen(monkeypatch, blocked) == temporary / "stillhook-cache"


@posix
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o757, 0o1777])
def test_a_folder_that_others_can_write_to_is_replaced_with_one_note(tmp_path, monkeypatch, temporary, caplog, mode):
    folder = made(tmp_path / "shared", mode)
    with caplog.at_level(logging.WARNING, "stillhook"):
        assert [chosen(monkeypatch, folder) for _ in range(3)] == [temporary / "stillhook-cache"] * 3
    (note,) = [record.getMessage() for record in caplog.records]
    assert note == (
        f"Cache folder {folder}: others may write to it, so compiled code is kept in {temporary / 'stillhook-cache'} instead. "
        "Remove the folder, or set STILLHOOK_CACHE to one that only you can write to."
    )


@posix
def test_a_folder_that_others_can_move_away_is_replaced(tmp_path, monkeypatch, temporary, caplog):
    folder = made(made(tmp_path / "open", 0o777) / "mine", 0o700)
    assert chosen(monkeypatch, folder) == temporary / "stillhook-cache"
    assert f"others may write to {tmp_path / 'open'}, so" in caplog.text
    (tmp_path / "open").chmod(0o1777)  # with the sticky bit nobody can move what is mine
    assert chosen(monkeypatch, folder) == folder


@posix
def test_a_link_is_followed_before_rights_are_looked_at(tmp_path, monkeypatch, temporary):
    bad, good = made(tmp_path / "bad", 0o777), made(tmp_path / "good", 0o700)
    for name, target in (("to_bad", bad), ("to_good", good)):
        (tmp_path / name).symlink_to(target)
    assert chosen(monkeypatch, tmp_path / "to_bad") == temporary / "stillhook-cache"
    assert chosen(monkeypatch, tmp_path / "to_good") == good


@posix
@root
def test_a_folder_of_somebody_else_is_replaced(tmp_path, monkeypatch, temporary, caplog):
    folder = made(tmp_path / "theirs", 0o755)
    os.chown(folder, SOMEBODY, -1)
    assert chosen(monkeypatch, folder) == temporary / "stillhook-cache"
    below = made(folder / "mine", 0o700)
    assert chosen(monkeypatch, below) == temporary / "stillhook-cache"
    assert "belongs to another user" in caplog.text


@posix
def test_the_temporary_folder_is_held_to_the_same_rule(tmp_path, temporary, monkeypatch):
    for name in ("stillhook-cache", f"stillhook-cache-{cache.getpass.getuser()}"):
        made(temporary / name, 0o777)
    fresh = made(temporary / "fresh", 0o700)
    monkeypatch.setattr(cache.tempfile, "mkdtemp", lambda prefix: str(fresh))
    assert cache.private_folder() == fresh
    cache.private_folder.cache_clear()
    temporary.chmod(0o777)
    with pytest.raises(
        SimulationError, match=r"others may write to .*\. Set STILLHOOK_CACHE to a folder that only you can write to\.$"
    ):
        cache.private_folder()


@posix
@pytest.mark.parametrize("spoiled", ["file", "folder", "link"])
def test_kernels_that_others_may_have_put_there_are_not_loaded(tmp_path, monkeypatch, temporary, caplog, spoiled):
    folder = chosen(monkeypatch, made(tmp_path / "mine", 0o755)) / "kernels"
    inner = made(folder / "sub", 0o755)
    (inner / "f.nbc").write_bytes(b"code")
    assert cache.kernel_folder("kernels") == folder
    if spoiled == "link":
        (inner / "g.nbc").symlink_to(inner / "f.nbc")
    else:
        (inner / "f.nbc" if spoiled == "file" else inner).chmod(0o777)
    assert cache.kernel_folder("kernels") == temporary / "stillhook-cache" / "kernels"
    assert f"Cache folder {folder}: " in caplog.text


@posix
def test_files_that_a_group_may_write_do_no_harm_where_the_group_cannot_reach_them(tmp_path, monkeypatch):
    folder = made(chosen(monkeypatch, tmp_path / "mine") / "kernels", 0o775)
    (folder / "f.nbc").write_bytes(b"code")
    (folder / "f.nbc").chmod(0o664)
    assert cache.kernel_folder("kernels") == folder


@posix
@pytest.mark.parametrize(
    ("mode", "weak"),
    [(0o600, False), (0o644, False), (0o755, False), (0o620, True), (0o602, True), (0o664, True), (0o646, True)],
)
def test_a_file_that_group_or_others_may_write_is_not_loaded_and_one_that_they_may_read_or_run_is(tmp_path, mode, weak):
    """Both may enter the folder and the one above it."""
    folder = made(made(tmp_path / "read", 0o755) / "kernels", 0o755)
    (folder / "f.nbc").write_bytes(b"code")
    (folder / "f.nbc").chmod(mode)
    assert cache.weak_content(folder) == ("others may write to f.nbc in it" if weak else "")


@posix
@root
def test_kernels_of_somebody_else_are_not_loaded(tmp_path, monkeypatch, temporary):
    folder = made(chosen(monkeypatch, tmp_path / "mine") / "kernels", 0o700)
    (folder / "f.nbc").write_bytes(b"code")
    os.chown(folder / "f.nbc", SOMEBODY, -1)
    assert cache.kernel_folder("kernels") == temporary / "stillhook-cache" / "kernels"


@pytest.mark.long
@posix
@pytest.mark.usefixtures("numba")
def test_planted_code_is_never_unpickled(tmp_path):
    """The attack itself: machine code that runs a command when it is unpickled, with a checksum that fits, in a folder
    that others may write to."""
    script, shared = tmp_path / "load.py", tmp_path / "shared"
    script.write_text(LOAD)

    def load(mode: int) -> subprocess.CompletedProcess:
        shared.mkdir(exist_ok=True)
        shared.chmod(mode)
        environment = os.environ | {"STILLHOOK_CACHE": str(shared), "TMPDIR": str(tmp_path / "system")}
        return subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, check=True)

    assert load(0o700).stderr == ""
    (code,) = shared.rglob("*.nbc")
    write_checked(code, f"cos\nsystem\n(S'touch {tmp_path / 'owned'}'\ntR.".encode())
    done = load(0o777)
    assert done.stdout == "6.0\n"
    assert done.stderr.startswith(f"Cache folder {shared}: others may write to it")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "owned").exists()
    load(0o700)
    assert (tmp_path / "owned").exists()  # so that the attack is one


def test_the_drivers_take_their_folder_from_here(tmp_path, monkeypatch):
    folder = chosen(monkeypatch, tmp_path / "mine")
    assert build.cache_folder("active-passive", 1).parent == folder
