"""Files as new users bring them, each to its answer with at most one correction."""

import gzip
from collections.abc import Callable
from pathlib import Path
from shutil import copyfile

import numpy as np
import pytest

from stillhook.cli import run
from stillhook.formats.motion.open import read_ship_motion
from stillhook.logs.log import read_log
from stillhook.logs.understood import signals_of, understood_log
from stillhook.plan.definition.load_chart import read_load_chart

Plan = Callable[..., Path]


@pytest.fixture
def logs(shared_data: Path) -> Path:
    return shared_data / "journeys" / "logs"


@pytest.fixture
def planner(shared_data: Path, tmp_path: Path) -> Path:
    """The planner's folder with its hindcast unpacked, and the payload that m7-swl.toml names."""
    for path in (shared_data / "journeys" / "planner").iterdir():
        copyfile(path, tmp_path / path.name)
    with gzip.open(tmp_path / "hindcast.csv.gz") as packed:
        (tmp_path / "hindcast.csv").write_bytes(packed.read())
    module = (tmp_path / "module.toml").read_text(encoding="utf-8")
    (tmp_path / "big.toml").write_text(module.replace("140 t", "240 t"), encoding="utf-8")
    return tmp_path


def test_the_ship_s_log_is_read_as_it_is_and_turned_by_one_word(logs: Path) -> None:
    up = read_ship_motion(logs / "mru.csv")
    down = read_ship_motion(logs / "mru.csv", columns={"heave": "MRU_Heave_m [m] down"})
    np.testing.assert_array_equal(up.heave, -down.heave)
    assert len(up.t) == 1199


def test_the_plc_s_log_is_read_by_the_mapping_that_is_suggested(logs: Path, tmp_path: Path) -> None:
    found = {row.name: row for row in understood_log(logs / "plc-german.csv").rows}
    assert found["omega_m"].sign == -1
    mapping = tmp_path / "mapping.toml"
    assert run(["inspect", str(logs / "plc-german.csv"), "--save", str(mapping)]) == 0
    log = read_log(logs / "plc-german.csv", signals_of(logs / "plc-german.csv", mapping))
    assert set(log.signals) == {"p_a", "p_b", "omega_m", "u_p", "F_w", "s_w"}
    assert log.rate == pytest.approx(10.0)
    assert 20e3 < np.nanmedian(log.signals["F_w"]) < 40e3  # 2.9 t


def test_the_chart_as_a_matrix_is_the_stepped_chart(planner: Path) -> None:
    rows, matrix = (read_load_chart(planner / name) for name in ("lc.csv", "lc-matrix.csv"))
    assert matrix.digest == rows.digest


@pytest.mark.parametrize(
    ("name", "code", "says"),
    [
        ("mylift", 0, ()),
        ("nochart", 0, ()),
        ("m4-matrixchart", 0, ("not read, without waves", "matrix of 4 radii and 4 wave heights")),
        ("m7-swl", 1, ('by "static-load"', "2389 kN at rest")),
        ("m10-hs", 2, ('a range needs its step: write "0.5 m to 4 m by 0.5 m".',)),
        ("m11-slings", 2, ("Slings are one spring in [rigging]: write height",)),
    ],
)
@pytest.mark.filterwarnings("ignore:.*an old form:FutureWarning")
def test_a_planner_s_file_has_its_answer_or_one_line_with_the_cure(
    planner: Path, capsys: pytest.CaptureFixture[str], name: str, code: int, says: tuple[str, ...]
) -> None:
    assert run(["plan", str(planner / f"{name}.toml"), "--check", "--verbose"]) == code
    shown = capsys.readouterr()
    text = " ".join((shown.err if code == 2 else shown.out).split())
    for say in says:
        assert say in text
    assert sum(line.startswith("error") for line in shown.err.splitlines()) == (code == 2)


@pytest.mark.parametrize(
    ("name", "code", "says"),
    [
        ("zone_utcp3.csv", 0, "times moved by -3 h to UTC"),
        ("tz_is_freq.csv", 2, 'columns.T_m02 = "Tz [Hz]"'),
        ("epoch.csv", 0, "seconds since 1970"),
        ("nora3.csv", 0, "thq_swell"),
        ("era5_new.nc", 0, "wind from its parts"),
        ("m_scs.txt", 0, "400 samples"),
        ("pairs3.csv", 0, "M1 speed"),
        ("twincat_scope_small.csv", 1, "no heading is called as a signal is"),
        ("vessel_per_height_half.csv", 1, "no floating body moves so"),
        ("vessel_ok_reference.csv", 0, "met by 6 of 6 motions"),
        ("capytaine_rao_wrong_damping_sign.nc", 0, "contradicts its own matrices"),
        ("s_to.nc", 0, "go to"),
    ],
)
def test_what_other_programs_write_is_shown_as_it_is_understood(
    shared_data: Path, capsys: pytest.CaptureFixture[str], name: str, code: int, says: str
) -> None:
    assert run(["inspect", str(shared_data / "foreign" / name)]) == code
    shown = capsys.readouterr()
    assert says in " ".join((shown.out + shown.err).split())
