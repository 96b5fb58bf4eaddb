"""A signal ends every command in one line, with 128 plus its number, and leaves nothing half-written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.faults.injector import ROOT

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(os.name == "nt", reason="no such signals there; CTRL_BREAK is handled alike"),
]
PATIENCE = 120.0
"""Time for a command to end on a machine that does much else [s]."""
EVALUATING = 8.0
"""Processor time after which a tuning has begun to evaluate, and is not at its end [s]."""
NAMED = {signal.SIGINT: "stopped", signal.SIGTERM: "stopped by SIGTERM", signal.SIGHUP: "stopped by SIGHUP"}


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}

    def listening() -> None:
        for each in NAMED:
            signal.signal(each, signal.default_int_handler if each == signal.SIGINT else signal.SIG_DFL)

    return subprocess.Popen(
        [sys.executable, "-m", "stillhook", *arguments],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        start_new_session=True, preexec_fn=listening,
    )  # fmt: skip


def ended(process: subprocess.Popen[str], number: signal.Signals, *, group: bool) -> list[str]:
    """Send a signal, to the process or to all that it started, and give the lines on standard error."""
    (os.killpg if group else os.kill)(process.pid, number)
    _, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number, error
    lines = error.splitlines()
    assert lines[-1] == f"{NAMED[number]}: no file was left half-written"
    assert not any("Traceback" in line or "Warning" in line or "Exception" in line for line in lines)
    return lines


def worked(process: int) -> float:
    """Processor time of a process [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("number", NAMED)
@pytest.mark.parametrize("after", [1.0, 4.0])
def test_a_long_run_ends_without_its_files(tmp_path: Path, number: signal.Signals, after: float):
    of = started(tmp_path, "compare", "--duration", "24 h", "--out", "out")
    time.sleep(after)
    assert len(ended(of, number, group=False)) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not Path("/proc/self/stat").is_file(), reason="when it evaluates is seen from its processor time")
def test_what_a_tuning_has_found_is_kept(tmp_path: Path):
    of = started(tmp_path, "tune", "nov-250t", "--controllers", "ssc", "--out", "out")
    while worked(of.pid) < EVALUATING:
        time.sleep(0.2)
    assert any("the best found so far" in line for line in ended(of, signal.SIGTERM, group=False))
    assert (tmp_path / "out" / "tune.json").is_file()


@pytest.mark.parametrize("after", [1.0, 2.0, 4.0, 8.0])
@pytest.mark.parametrize("group", [False, True], ids=["process", "group"])
def test_a_live_twin_that_starts_ends_without_a_traceback(tmp_path: Path, after: float, group: bool):
    assert started(tmp_path, "example", "live", "twin").wait() == 0
    file = tmp_path / "twin" / "live.toml"
    begin, _ = file.read_text().split("[opcua]")
    file.write_text(begin + "[udp]\nport = 0\n")
    of = started(tmp_path, "live", "run", "twin/live.toml")
    time.sleep(after)
    begun = time.monotonic()
    ended(of, signal.SIGTERM, group=group)
    assert time.monotonic() - begun < PATIENCE / 2
