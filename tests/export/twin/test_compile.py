"""What is kept between two compilations, and what is said before the first."""

import subprocess
import sys
from pathlib import Path

import pytest

from stillhook.export.twin import compile as compiling
from stillhook.export.twin import compile_library, first_of


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    """A compiler that writes a library at once; folders in which it kept what it built."""
    seen = []

    def run(command, *, env, **_):
        seen.append(Path(env["ZIG_GLOBAL_CACHE_DIR"]))
        seen[-1].mkdir(parents=True, exist_ok=True)
        Path(command[command.index("-o") + 1]).write_bytes(b"library")
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setenv("STILLHOOK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(compiling.subprocess, "run", run)
    monkeypatch.setattr(compiling, "_compiler", lambda platform: [sys.executable, "-m", "ziglang", "cc"])
    return seen


def test_the_first_library_of_a_platform_is_announced_and_what_it_took_is_kept(compiled, tmp_path):
    assert first_of(["win64", "linux64"]) == ["win64", "linux64"]
    compile_library("int x;", "win64", tmp_path / "x.dll")
    assert (tmp_path / "x.dll").read_bytes() == b"library"
    assert first_of(["win64", "linux64"]) == ["linux64"]
    assert compiled == [(tmp_path / "cache").resolve() / "zig"]


def test_a_compiler_that_keeps_nothing_is_not_announced(compiled, monkeypatch):
    monkeypatch.setattr(compiling, "_compiler", lambda platform: ["/usr/bin/cc"])
    assert first_of(["linux64"]) == []
