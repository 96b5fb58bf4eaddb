"""A PLC is compared with the library: rounding is told apart from what really differs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from stillhook import load_crane
from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.export.plc.sequence import Reference, inputs, numbers
from stillhook.library import changed
from stillhook.live.hil.compare import Comparison, compare, stated_steps
from stillhook.live.hil.controller import INPUTS, OUTPUTS, SIGNALS, LibraryController
from stillhook.live.hil.plc_log import HEADINGS, STATUS, PlcLog, read_plc_log

CRANE, MODE = load_crane("nov-250t"), "ssc"
CASE = 'crane = "nov-250t"\n[scenario]\nload = "100 t"\ns_w = "100 m"\ntip = "still"\n'
PLC = 'case = "case.toml"\ncontroller = "ssc"\n'
CYCLES = 2400


@pytest.fixture(scope="module")
def healthy() -> np.ndarray:
    """Inputs of the exported test sequence before its faults: rest, brake, operator, compensation, mode changes."""
    block = LibraryController(CRANE, MODE).block
    rows = [numbers(o) for (o, _), _ in zip(inputs(block, Reference(block)), range(CYCLES), strict=False)]
    return np.array(rows)


def written(folder: Path, rows: np.ndarray, plc: LibraryController) -> Path:
    """The log of a PLC that saw these inputs."""
    path = folder / "log.csv"
    with PlcLog(path) as log:
        for k, (row, commands) in enumerate(zip(rows, plc.cycles(rows), strict=True)):
            log.add((k, 0.01 * k, 0.0, k, 0.01, 0.002), row, commands)
    return path


def compared(path: Path, stated: dict[str, object] | None = None) -> Comparison:
    recorded = read_plc_log(path, None, "plc.toml")
    return compare(CRANE, MODE, recorded, {**recorded.steps, **stated_steps(stated or {}, "plc.toml")})


def verdicts(of: Comparison) -> dict[str, str]:
    return {d.name: d.verdict.split()[0] for d in of.outputs}


def test_the_library_as_plc_is_equal_to_the_bit(healthy: np.ndarray, tmp_path: Path):
    result = compared(written(tmp_path, healthy, LibraryController(CRANE, MODE)))
    assert result.same
    assert result.cycles == CYCLES
    assert set(verdicts(result).values()) == {"equal"}
    assert result.absent == ()


@pytest.mark.parametrize(
    "rounding",
    [
        lambda frame: frame.round(4),
        lambda frame: frame.astype(np.float32).astype(np.float64),
        lambda frame: frame.assign(**{"s_w [m]": (frame["s_w [m]"] * 500).round() / 500}),
    ],
    ids=["four decimals", "float32", "encoder of 2 mm"],
)
def test_a_log_that_rounds_what_the_plc_saw_differs_by_rounding(
    rounding: Callable[[pd.DataFrame], pd.DataFrame], healthy: np.ndarray, tmp_path: Path
):
    path = written(tmp_path, healthy, LibraryController(CRANE, MODE))
    rounding(pd.read_csv(path)).to_csv(path, index=False)
    result = compared(path)
    assert result.same, result.outputs
    assert "rounding" in verdicts(result).values()


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "differ"),
    [
        ({"K_p": "0.1616 1/m"}, "u_p"),
        ({"u_thr": 0.61}, "u_m"),
        ({"tau_F": "0.6 s"}, "u_m"),
        ({"t_cycle": "20 ms"}, "u_p"),
        ({"t_lead": "5 ms"}, "e_c"),
    ],
)
@pytest.mark.parametrize("decimals", [None, 5])
def test_another_setting_on_the_plc_is_found(
    change: dict[str, object], differ: str, decimals: int | None, healthy: np.ndarray, tmp_path: Path
):
    path = written(tmp_path, healthy, LibraryController(changed(CRANE, {"control": change}), MODE))
    if decimals is not None:
        pd.read_csv(path).round(decimals).to_csv(path, index=False)
    result = compared(path)
    assert not result.same
    assert verdicts(result)[differ] == "differs"
    first = next(d for d in result.outputs if d.name == differ)
    assert abs(first.plc - first.library) > 0.0
    assert first.first < CYCLES


def test_the_first_cycle_that_differs_is_named(healthy: np.ndarray, tmp_path: Path):
    path = written(tmp_path, healthy, LibraryController(CRANE, MODE))
    frame = pd.read_csv(path)
    frame.loc[1234:, "u_p [1]"] += 1e-6
    frame.to_csv(path, index=False)
    result = compared(path)
    assert {d.name: d.first for d in result.outputs if d.first >= 0} == {"u_p": 1234.0}
    assert next(d for d in result.outputs if d.name == "u_p").largest == pytest.approx(1e-6)


def test_an_output_that_is_no_number_differs(healthy: np.ndarray, tmp_path: Path):
    path = written(tmp_path, healthy[:200], LibraryController(CRANE, MODE))
    frame = pd.read_csv(path)
    frame.loc[100, "u_m [1]"] = np.nan
    frame.to_csv(path, index=False)
    assert verdicts(compared(path))["u_m"] == "differs"


def test_faults_and_lost_inputs_are_replayed_as_they_were(tmp_path: Path):
    block = LibraryController(CRANE, MODE).block
    rows = np.array([numbers(o) for o, _ in inputs(block, Reference(block))])
    assert np.isnan(rows).any()
    path = written(tmp_path, rows, LibraryController(CRANE, MODE))
    text = path.read_text()
    assert "nan" in text
    assert "inf" in text
    result = compared(path)
    assert set(verdicts(result).values()) == {"equal"}


def foreign(folder: Path, rows: np.ndarray) -> tuple[Path, Path]:
    """A log of another PLC, its columns in its own words and units, and the PLC file that maps them."""
    out = LibraryController(CRANE, MODE).cycles(rows)
    columns = {f"GVL.{name}": rows[:, i] for i, name in enumerate(SIGNALS)}
    columns["GVL.s_w"] = 1e3 * columns["GVL.s_w"]
    columns["GVL.F"] = 1e-3 * columns["GVL.F"]
    columns["PumpCmd"] = 100.0 * out[:, OUTPUTS.index("u_p")]
    columns["MotorCmd"] = out[:, OUTPUTS.index("u_m")]
    frame = pd.DataFrame(columns)
    frame.round(6).to_csv(folder / "foreign.csv", sep=";", decimal=",", index=False)
    si = dict(zip((h.split(" [")[0] for h in HEADINGS), (h.split("[")[1][:-1] for h in HEADINGS), strict=True))
    plain = [f'{n} = {{ column = "GVL.{n}", unit = "{si[n]}" }}' for n in SIGNALS if n not in ("s_w", "F")]
    mapped = ['s_w = { column = "GVL.s_w", unit = "mm" }', 'F = { column = "GVL.F", unit = "kN" }']
    mapped += ['u_p = { column = "PumpCmd", unit = "%" }', 'u_m = { column = "MotorCmd", unit = "1" }']
    (folder / "case.toml").write_text(CASE)
    (folder / "plc.toml").write_text(PLC + "[signals]\n" + "\n".join(plain + mapped) + "\n")
    return folder / "foreign.csv", folder / "plc.toml"


def test_a_log_of_another_plc_is_compared_by_its_mapping(
    healthy: np.ndarray, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    log, plc = foreign(tmp_path, healthy)
    assert run(["plc", "compare", str(log), str(plc)]) == 0
    out = capsys.readouterr().out
    assert "PLC and library give the same." in out
    assert "Not in the log: u_ff, u_raw, e_c, brake" in out
    plc.write_text(plc.read_text().replace('unit = "%"', 'unit = "1"'))
    assert run(["plc", "compare", str(log), str(plc)]) == 1
    assert "First difference: cycle" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("edit", "line"),
    [
        (lambda lines: [*lines[:50], *lines[51:]], "cycle 48 is followed by 50"),
        (lambda lines: [",".join(line.split(",")[1:13]) for line in lines], "no column s_w"),
        (lambda lines: lines[:2], "1 cycles"),
        (lambda lines: [*lines[:50], "1,2,3", *lines[50:]], "line 51"),
        (lambda lines: [lines[0]], "no rows of numbers"),
        (lambda lines: [], "is empty"),
    ],
)
def test_a_log_without_every_cycle_and_input_is_refused_in_one_line(
    edit: Callable[[list[str]], list[str]],
    line: str,
    healthy: np.ndarray,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
):
    path = written(tmp_path, healthy[:100], LibraryController(CRANE, MODE))
    path.write_text("\n".join(edit(path.read_text().splitlines())) + "\n" if edit(["x", "y"]) else "")
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "plc.toml").write_text(PLC)
    assert run(["plc", "compare", str(path), str(tmp_path / "plc.toml")]) == 2
    error = capsys.readouterr().err
    assert line in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ({"s_wire": "1 mm"}, "no input or output"),
        ({"s_w": "1 bar"}, "resolution.s_w"),
        ({"u_p": -0.1}, "a number from 0 on"),
        ({"u_p": True}, "a number from 0 on"),
        ({"u_p": float("nan")}, "a number from 0 on"),
    ],
)
def test_a_wrong_step_is_refused(table: dict[str, object], line: str):
    with pytest.raises(StillhookError, match=line):
        stated_steps(table, "plc.toml")


def test_a_signal_that_no_controller_has_is_refused(healthy: np.ndarray, tmp_path: Path):
    path = written(tmp_path, healthy[:100], LibraryController(CRANE, MODE))
    with pytest.raises(StillhookError, match=r"signals.s_wire: no input or output"):
        read_plc_log(path, {"s_wire": "x"}, "plc.toml")


def test_headings_are_status_inputs_and_outputs_each_once():
    names = [h.split(" [")[0] for h in HEADINGS]
    assert names == [*STATUS, *INPUTS, *OUTPUTS]
    assert len(set(names)) == len(names)
