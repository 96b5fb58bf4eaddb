"""`stillhook live` from the outside: a file, a process, its servers, and its end."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.live.test_modbus import read_request

from stillhook.cli import run
from stillhook.cli.live.twin import _EventLines
from stillhook.errors import StillhookError
from stillhook.library.examples import LIVE, example_files
from stillhook.live.live_file import read_live_file
from stillhook.live.runtime import event
from stillhook.live.runtime.doctor import ALLOWED_P999, ALLOWED_WORST, Diagnosis, Lateness
from stillhook.live.runtime.state import LiveState

PATIENCE = 60.0


def example(folder: Path, change: dict[str, str] | None = None) -> Path:
    example_files(LIVE, folder)
    path = folder / "live.toml"
    text = path.read_text()
    for old, new in (change or {}).items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def test_the_example_is_a_live_file_that_keeps_to_this_machine(tmp_path: Path):
    plan = read_live_file(example(tmp_path / "twin"))
    assert {plan.opcua.host, plan.modbus.host, plan.udp.host, plan.udp.to_host} == {"127.0.0.1"}
    assert (plan.opcua.insecure, plan.modbus.writes, plan.udp.writes) == (False, False, False)
    assert plan.folder == tmp_path / "twin" / "twin"
    with pytest.raises(StillhookError, match="already"):
        example_files(LIVE, tmp_path / "twin")


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({'"case.toml"': '"none.toml"'}, "no such file next to this file"),
        ({'"1 s"': '"1 m"'}, 'timeout = "1 m"'),
        ({'"1 s"': '"0 s"'}, "timeout"),
        ({"port = 4840": "port = 70000"}, "opcua.port"),
        ({"[opcua]": "[opcua]\ninsecure = true"}, "insecure"),
        ({'"json"': '"xml"'}, "udp.format"),
        ({'"registers.toml"': '"none.toml"'}, "modbus.registers"),
        ({'"0.1 s"': '"1 us"'}, "udp.every"),
    ],
)
def test_a_wrong_live_file_is_refused_in_one_line(change: dict[str, str], text: str, tmp_path: Path):
    path = example(tmp_path / "twin", change)
    with pytest.raises(StillhookError) as problem:
        read_live_file(path)
    assert text in str(problem.value)
    assert str(problem.value).startswith("live.toml")
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ('live doctor --duration "5 s"', "Give 10 s or more"),
        ('live demo --duration "5 s"', "Give 15 s or more"),
        ("live run none.toml", "none.toml"),
        ("live replay none.csv", "--load: missing"),
        ('live replay none.csv --load "82 t"', "none.csv"),
    ],
)
def test_what_does_not_do_is_refused_in_one_line(
    words: str, text: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    assert run(shlex.split(words)) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert text in err
    assert err.count("\n") == 1


def lateness(
    p999: float, worst: float, *, real_time: bool = True, missed: int = 0, causes: dict[str, int] | None = None
) -> Lateness:
    return Lateness(real_time, "", 3000, 1e-4, 1e-4, p999, worst, 4e-4, 5e-4, 0, 0, missed, 0, causes or {})


@pytest.mark.parametrize(
    ("measured", "good", "text"),
    [
        (lateness(ALLOWED_P999, ALLOWED_WORST), True, "keeps time"),
        (lateness(1.1 * ALLOWED_P999, ALLOWED_WORST), False, "real-time kernel"),
        (lateness(ALLOWED_P999, 1.1 * ALLOWED_WORST), False, "does not keep time"),
        (lateness(1e-4, 1e-4, missed=1), False, "does not keep time"),
        (lateness(0.02, 0.02, real_time=False), False, "Allow the real-time class first"),
        (lateness(0.02, 0.02, causes={"pages": 1, "host": 3}), False, "Use a physical machine"),
        (lateness(0.02, 0.02, causes={"processor": 3, "host": 1}), False, "other processes of the real-time class"),
    ],
)
def test_the_verdict_is_that_of_the_class_in_which_a_twin_would_run(measured: Lateness, good: bool, text: str):
    found = Diagnosis((measured, lateness(1.0, 1.0, real_time=False)), 2e-5, 2e-4, 0.01, 2, 0.5, 0.0, "Linux")
    assert found.good is good
    assert text in found.reason


def wait_for(what: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.long
def test_a_twin_is_served_until_sigterm_and_leaves_its_state_and_its_events(tmp_path: Path):
    path = example(tmp_path / "twin")
    begin, rest = path.read_text().split("[opcua]")
    path.write_text(begin + "[modbus]" + rest.split("[modbus]")[1].split("[udp]")[0].replace("port = 5020", "port = 0"))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "stillhook", "live", "run", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment) as of:
        line = of.stdout.readline()
        port = int(re.fullmatch(r"Modbus TCP 127\.0\.0\.1:(\d+), writes refused\n", line)[1])
        counts = [modbus_count(port)]
        wait_for(lambda: counts.append(modbus_count(port)) or counts[-1] > counts[0] + 10)
        of.send_signal(signal.SIGTERM)
        out, err = of.communicate(timeout=PATIENCE)
    assert of.returncode == 128 + signal.SIGTERM, err
    assert err.splitlines()[-1] == "stopped by SIGTERM: no file was left half-written"
    assert re.search(r"\d+ cycles, \d+ late, \d+ overrun, 0 missed; worst lateness", out)
    folder = tmp_path / "twin" / "twin"
    assert (folder / "state.bin").stat().st_size > 10_000
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [e["name"] for e in events if e["name"] != "late"] == ["started", "serving", "stopped"]


@pytest.mark.thorough
def test_the_state_is_saved_by_a_kernel_whose_servers_were_killed(tmp_path: Path):
    path = example(tmp_path / "twin")
    path.write_text(path.read_text().split("[opcua]")[0] + "[udp]\nport = 0\n")
    state = tmp_path / "twin" / "twin" / "state.bin"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "stillhook", "live", "run", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment) as of:
        of.stdout.readline()
        wait_for(state.exists)
        of.kill()
        of.wait()
        killed = time.time()
        wait_for(lambda: state.stat().st_mtime > killed)
    assert LiveState.from_bytes(state).session.startswith(b"stillhook session")


def modbus_count(port: int) -> int:
    """The number of cycles that a twin's first two registers hold."""
    frame = read_request(3, 0, 2)
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as of:
        of.sendall(struct.pack(">HHHB", 1, 0, len(frame) + 1, 1) + frame)
        data = of.recv(64)
    return int(struct.unpack(">I", data[9:13])[0])


@pytest.mark.thorough
def test_the_demonstration_ends_with_an_alarm_after_the_change_and_none_before(capsys: pytest.CaptureFixture[str]):
    assert run(["live", "demo", "--duration", "20 s", "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["false_alarms"] == 0
    assert outcome["changed"] < outcome["alarm"] < 20.0


@pytest.mark.skipif(os.name != "posix", reason="POSIX alone says whether a pipe takes a line")
def test_events_that_nobody_reads_hold_up_no_server(monkeypatch: pytest.MonkeyPatch):
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb", buffering=0) as heard, os.fdopen(writing, "w") as stderr:
        monkeypatch.setattr(sys, "stderr", stderr)
        lines = _EventLines()
        for n in range(2000):
            lines.event(event("kernel", "late", f"{n} {'x' * 5000}"))
        os.read(heard.fileno(), 1 << 20)
        lines.event(event("kernel", "late", "read again"))
        stderr.flush()
        text = os.read(heard.fileno(), 1 << 20).decode()
    assert "events were not read here: see events.jsonl." in text
    assert text.rstrip().endswith("kernel: read again")
