"""What a live file says of measured signals and adaptation, and where servers show and take them."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.live import test_opcua
from tests.live.served import Counting
from tests.live.test_live_run import PATIENCE, example

from stillhook import load_crane
from stillhook.errors import StillhookError, UnitError
from stillhook.live.estimate.friction import FrictionEstimator
from stillhook.live.history import read, read_events
from stillhook.live.live_file import read_live_file
from stillhook.live.observer import AdaptSettings, ObserverSettings
from stillhook.live.servers.registers import read_registers

ADAPT = "# [adapt]  "
"""In the example, where it is off."""


def test_the_example_measures_and_does_not_adapt(tmp_path: Path):
    plan = read_live_file(example(tmp_path / "twin"))
    assert plan.observer.adapt is None
    assert "p_a" in plan.observer.signals
    on = read_live_file(example(tmp_path / "on", {ADAPT: "[adapt]"}))
    assert on.observer.adapt == AdaptSettings()


def test_without_the_table_nothing_is_measured(tmp_path: Path):
    path = example(tmp_path / "twin")
    path.write_text(path.read_text().split("[measured]")[0])
    assert read_live_file(path).observer is None


def test_without_keys_a_crane_is_measured_as_its_estimator_would_by_itself(tmp_path: Path):
    """The window of five minutes of `stillhook live parameters`, and a signal that is old after a second."""
    found = read_live_file(example(tmp_path / "twin")).observer
    estimator = FrictionEstimator(load_crane("nov-250t"), load=60e3)
    assert (found.window, found.gas_side) == (estimator.window, False)
    assert ObserverSettings().window == estimator.window == 300.0
    assert found.timeout == ObserverSettings().timeout == 1.0


def test_keys_of_both_tables_are_read(tmp_path: Path):
    keys = 'timeout = "2 s"\nload = "60 t"\nwindow = "2 min"\ngas_side = true\naccuracies = {F_zero = 5e3}\n'
    change = {"[measured]  ": f"[measured]\n{keys}#", ADAPT: '[adapt]\nstep = 0.02\nevery = "10 s"\n#'}
    found = read_live_file(example(tmp_path / "twin", change)).observer
    assert (found.timeout, found.load, found.window, found.gas_side) == (2.0, 60e3, 120.0, True)
    assert found.accuracies.F_zero == 5e3
    assert found.adapt == AdaptSettings(0.02, 10.0)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({'signals = ["s_w"': 'signals = ["e_c"'}, "no signal that is measured. Choose of s_w"),
        ({'signals = ["s_w"': 'signals = ["p_a"'}, "a signal is named twice"),
        ({"[measured]  ": '[measured]\ntimeout = "1 ms"\n#'}, "measured.timeout"),
        ({"[measured]  ": '[measured]\nwindow = "1 s"\n#'}, "allowed are 60 s to 3600 s"),
        ({"[measured]  ": "[measured]\naccuracies = {F = 1.0}\n#"}, "an unknown name. Choose of F_gain"),
        ({"[measured]  ": "[measured]\naccuracies = {p = -1.0}\n#"}, "a limit of error is a number from 0 on"),
        ({ADAPT: "[adapt]\nstep = 2.0\n#"}, "adapt.step"),
        ({ADAPT: "[adapt]\non = true\n#"}, "adapt.on"),
        ({ADAPT: "[adapt]", '"p_hp", ': ""}, "needs p_hp to estimate friction"),
        ({ADAPT: "[adapt]", "[measured]": "#", 'signals = ["s_w"': '# ["s_w"'}, "Add the table [measured]"),
    ],
)
def test_wrong_tables_are_refused_in_one_line(change: dict[str, str], text: str, tmp_path: Path):
    path = example(tmp_path / "twin", change)
    with pytest.raises(StillhookError) as problem:
        read_live_file(path)
    assert text in str(problem.value)
    assert str(problem.value).startswith("live.toml")
    assert "\n" not in str(problem.value)


def test_a_winch_whose_friction_is_not_estimated_is_measured_and_never_adapted(tmp_path: Path):
    change = {"[measured]  ": "[measured]", ADAPT: "# [adapt]"}
    path = example(tmp_path / "twin", change)
    case = tmp_path / "twin" / "case.toml"
    case.write_text('crane = "nov-100t-electric"\n\n[scenario]\nload = "40 t"\ns_w = "100 m"\ntip = "still"\n')
    assert read_live_file(path).observer.adapt is None
    path.write_text(path.read_text().replace("# [adapt]", "[adapt]"))
    with pytest.raises(StillhookError, match="no pressures of both lines of its motors"):
        read_live_file(path)


NAMES = ("p_a", "measured.p_a", "age.p_a", "alarm.p_a")


def registers(folder: Path, text: str) -> Any:
    (folder / "map.toml").write_text(text)
    return read_registers(folder / "map.toml", NAMES, ("s_tip", "measured.p_a"))


def test_a_register_takes_a_measured_pressure_in_its_unit(tmp_path: Path):
    row = 'name = "measured.p_a"\ntype = "uint16"\nscale = 0.1\nunit = "bar"\n'
    text = f'[[register]]\n{row}address = 0\naccess = "write"\n[[register]]\n{row}address = 1\n'
    written, read = registers(tmp_path, text)
    assert written.decode([2405]) == pytest.approx(240.5e5)
    assert written.decode([65535]) is None
    assert read.encode(240.5e5) == [2405]
    assert read.encode(math.nan) == [65535]


@pytest.mark.parametrize("name", ["age.p_a", "alarm.p_a"])
def test_ages_and_alarms_are_in_no_pressure(name: str, tmp_path: Path):
    with pytest.raises(UnitError, match=name):
        registers(tmp_path, f'[[register]]\nname = "{name}"\naddress = 0\nunit = "bar"\n')


class Measuring(Counting):
    """A twin that takes a measured pressure."""

    names = (*Counting.names, "measured.p_a")
    inputs = (*Counting.inputs, "measured.p_a")


@pytest.mark.long
def test_a_trusted_client_writes_measured_values_with_their_stamp_and_unit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    pytest.importorskip("asyncua", reason="the extra live is not installed")
    monkeypatch.setattr(test_opcua, "Counting", Measuring)
    room = test_opcua.Room(tmp_path)
    try:

        async def write(of: Any, node: Any) -> tuple[float, str]:
            await of.write_values([node("Measured.p_a"), node("Inputs.s_tip")], [2.4e7, 0.5])
            await node("Measured.p_a").write_value(math.nan)
            await room.server.publish()
            unit = await node("Measured.p_a.unit").read_value()
            return await node("measured.p_a").read_value(), unit.DisplayName.Text

        shown, unit = room.run(write)
    finally:
        room.close()
    assert room.served.written[0] == {"measured.p_a": 2.4e7, "s_tip": 0.5}
    assert math.isnan(room.served.written[1]["measured.p_a"])
    assert room.served.stamps[0] > 1.7e9
    assert (shown, unit) == (float(room.served.count), "Pa")
    assert room.served.told("refused-write") == []


@pytest.mark.slow
@pytest.mark.thorough
def test_a_twin_that_is_run_from_a_file_stores_what_is_measured_beside_its_rows(tmp_path: Path):
    """From the command line: over UDP into the history, with the factor of every moment."""
    pytest.importorskip("duckdb", reason="the extra live is not installed")
    path = example(tmp_path / "twin")
    head, rest = path.read_text().split("[opcua]")
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(PATIENCE)
    udp = f"[udp]\nport = 0\nto_port = {receiver.getsockname()[1]}\n\n[history]" + rest.split("[history]")[1]
    path.write_text(head + udp)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "stillhook", "live", "run", str(path), "--allow-writes"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment) as of:
        port = int(re.search(r"UDP 127\.0\.0\.1:(\d+) to", of.stdout.readline())[1])
        shown: list[float | None] = []
        while len([x for x in shown if x is not None]) < 20:
            message = {"measured.p_a": 2.4e7, "measured.F_w": 1e99, "s_tip": 0.0, "v_tip": 0.0, "a_tip": 0.0}
            receiver.sendto(json.dumps({**message, "time": time.time()}).encode(), ("127.0.0.1", port))
            shown.append(json.loads(receiver.recv(65_536))["measured.p_a"])
        of.send_signal(signal.SIGTERM)
        _, err = of.communicate(timeout=PATIENCE)
    receiver.close()
    assert of.returncode == 0, err
    assert shown[-1] == 2.4e7
    run = read(tmp_path / "twin" / "twin" / "history", signals=["p_a", "measured_p_a", "age_p_a", "friction_factor"])
    measured = run["measured_p_a"].values
    assert math.isnan(measured[0])
    assert measured[np.isfinite(measured)] == pytest.approx(2.4e7)
    assert run["measured_p_a"].attrs["units"] == run["p_a"].attrs["units"] == "Pa"
    assert set(run["friction_factor"].values) == {1.0}
    texts = [e.text for e in read_events(tmp_path / "twin" / "twin" / "history")]
    assert any(text.startswith("Compared with measured s_w, omega_m") and "level 1" in text for text in texts)
    assert any("F_w = 1e+99" in text for text in texts)


PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "adapt-a-running-twin.md"


def test_the_tables_of_the_how_to_read(tmp_path: Path):
    (tables,) = re.findall(r"^```toml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    path = example(tmp_path / "twin")
    path.write_text(path.read_text().split("[measured]")[0] + tables)
    assert read_live_file(path).observer.adapt == AdaptSettings(0.05, 5.0)
