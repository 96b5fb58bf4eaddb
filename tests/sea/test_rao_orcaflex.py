"""OrcaFlex text files: the plank in every convention that a vessel type can state, and refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.sea.other_programs import refused
from tests.sea.plank import plank_motions

from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.vessel.rao import wavenumber

yaml = pytest.importorskip("yaml")

OMEGA, DIRECTIONS = np.linspace(0.1, 1.5, 8), np.arange(0.0, 360.0, 30.0)
SAME = 1e-9  # floats as text and back
KEY = "RAOPeriodOrFrequency, " + ", ".join(
    f"RAO{d}Amp, RAO{d}Phase" for d in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
)
PLAIN = {
    "RAOResponseUnits": "degrees",
    "RAOWaveUnit": "amplitude",
    "WavesReferredToBy": "period (s)",
    "RAOPhaseConvention": "lags",
    "RAOPhaseUnitsConvention": "degrees",
    "RAOPhaseRelativeToConvention": "crest",
    "Symmetry": "None",
    "SurgePositive": "forward",
    "SwayPositive": "port",
    "HeavePositive": "up",
    "RollPositiveStarboard": "down",
    "PitchPositiveBow": "down",
    "YawPositiveBow": "port",
}


def rows(H: np.ndarray, said: dict[str, Any]) -> list[list[float]]:
    """Lines of one direction, H (6, n), as the conventions that are said write them."""
    waves = {"period (s)": 2 * np.pi / OMEGA, "frequency (rad/s)": OMEGA, "frequency (Hz)": OMEGA / (2 * np.pi)}[
        said["WavesReferredToBy"]
    ]
    other = ("aft", "starboard", "down", "up", "up", "starboard")
    keys = (
        "SurgePositive",
        "SwayPositive",
        "HeavePositive",
        "RollPositiveStarboard",
        "PitchPositiveBow",
        "YawPositiveBow",
    )
    signs = np.array([-1.0 if said[k] == o else 1.0 for k, o in zip(keys, other, strict=True)])
    rotation = 180 / np.pi if said["RAOResponseUnits"] == "degrees" else 1.0
    quarter = {"crest": 0, "zero down-crossing": 1, "trough": 2, "zero up-crossing": 3}[
        said["RAOPhaseRelativeToConvention"]
    ]
    lag = (
        -np.angle(signs[:, None] * H) - quarter * np.pi / 2
    )  # behind the crest, then behind what comes a quarter of a wave later
    phase = (lag if said["RAOPhaseConvention"] == "lags" else -lag) * (
        180 / np.pi if said["RAOPhaseUnitsConvention"] == "degrees" else 1.0
    )
    size = np.abs(H) * np.array([1.0] * 3 + [rotation] * 3)[:, None]
    return [[float(waves[k]), *np.column_stack([size[:, k], phase[:, k]]).ravel().tolist()] for k in range(len(OMEGA))]


def model(directions: np.ndarray = DIRECTIONS, phase_origin: list[Any] | None = None, **changes: Any) -> dict[str, Any]:
    said = PLAIN | changes
    point = phase_origin or [None, None, None]
    tables = []
    for degrees in directions:
        beta = np.radians([degrees])
        H = plank_motions(OMEGA, beta)[:, 0]
        if phase_origin:
            H = H * np.exp(1j * wavenumber(OMEGA) * (point[0] * np.cos(beta) + point[1] * np.sin(beta)))
        tables.append({"RAODirection": float(degrees), KEY: [[0.0] * 13, *rows(H, said)]})
    raos = {"RAOOrigin": [0.0, 0.0, 0.0], "PhaseOrigin": point, "RAOs": tables}
    kind = {
        "Name": "Plank",
        **{k: v for k, v in said.items() if v is not None},
        "Draughts": [{"Name": "Draught1", "DisplacementRAOs": raos}],
    }
    return {"General": {"UnitsSystem": "SI"}, "VesselTypes": [kind]}


def in_units(general: dict[str, Any], length: float) -> dict[str, Any]:
    """The model with lengths in a unit [m]: points, and rotations per length of wave amplitude."""
    data = model(phase_origin=[12.0, -5.0, 0.0]) | {"General": general}
    raos = data["VesselTypes"][0]["Draughts"][0]["DisplacementRAOs"]
    raos["PhaseOrigin"] = [v / length for v in raos["PhaseOrigin"]]
    for table in raos["RAOs"]:
        table[KEY] = [
            [*row[:7], *(v * (length if i % 2 == 0 else 1.0) for i, v in enumerate(row[7:]))] for row in table[KEY]
        ]
    return data


def written(folder: Path, data: dict[str, Any]) -> Path:
    path = folder / "plank.yml"
    path.write_text(
        "%YAML 1.1\n# Type: Model\n---\n" + yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=9999)
    )
    return path


def assert_plank(path: Path) -> None:
    ship = read_vessel(path)
    assert np.allclose(np.degrees(ship.beta), DIRECTIONS)
    assert np.abs(ship.H - plank_motions(ship.omega, ship.beta)).max() < SAME


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"RAOResponseUnits": "radians", "RAOPhaseUnitsConvention": "radians"},
        {"WavesReferredToBy": "frequency (rad/s)"},
        {"WavesReferredToBy": "frequency (Hz)", "RAOPhaseConvention": "leads"},
        *(
            {"RAOPhaseRelativeToConvention": r, "RAOPhaseConvention": c}
            for r in ("trough", "zero down-crossing", "zero up-crossing")
            for c in ("lags", "leads")
        ),
        {"SurgePositive": "aft", "SwayPositive": "starboard"},
        {
            "HeavePositive": "down",
            "RollPositiveStarboard": "up",
            "PitchPositiveBow": "up",
            "YawPositiveBow": "starboard",
        },
    ],
)
def test_the_plank_comes_back_from_every_convention(tmp_path: Path, changes: dict[str, Any]) -> None:
    assert_plank(written(tmp_path, model(**changes)))


def test_one_side_and_symmetry_give_the_whole_ship(tmp_path: Path) -> None:
    assert_plank(written(tmp_path, model(DIRECTIONS[:7], Symmetry="xz plane")))


def test_phases_from_another_point_are_moved_to_the_origin(tmp_path: Path) -> None:
    assert_plank(written(tmp_path, model(phase_origin=[12.0, -5.0, 0.0])))


def test_what_the_file_leaves_out_is_said(tmp_path: Path) -> None:
    path = written(tmp_path, model(SwayPositive=None, RAOWaveUnit=None) | {})
    assert any(
        "not in the file, OrcaFlex's defaults: RAOWaveUnit amplitude, SwayPositive port" in note
        for note in read_vessel(path).notes
    )


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"RAOWaveUnit": "max wave slope"}, 'RAOWaveUnit "max wave slope" is not read. Allowed: amplitude'),
        ({"Symmetry": "Circular"}, 'Symmetry "Circular" is not read'),
    ],
)
def test_conventions_that_are_not_read_are_refused(tmp_path: Path, changes: dict[str, Any], text: str) -> None:
    assert text in refused(written(tmp_path, model(**changes)))


def test_a_convention_that_was_changed_without_the_data_is_refused(tmp_path: Path) -> None:
    data = model()
    data["VesselTypes"][0]["RAOPhaseConvention"] = "leads"
    assert "It would fit with time the other way" in refused(written(tmp_path, data))


def test_half_a_ship_without_symmetry_is_refused(tmp_path: Path) -> None:
    assert "no heading within" in refused(written(tmp_path, model(DIRECTIONS[:7])))


def described(folder: Path, *lines: str) -> Path:
    path = folder / "plank.toml"
    path.write_text("\n".join(('motions = "plank.yml"', *lines)))
    return path


def test_one_of_several_vessel_types_and_draughts_is_stated(tmp_path: Path) -> None:
    data = model()
    (kind,) = data["VesselTypes"]
    draught = {**kind["Draughts"][0], "Name": "Light"}
    data["VesselTypes"] = [{"Name": "Empty"}, {**kind, "Draughts": [{"Name": "Deep"}, draught]}]
    line = refused(written(tmp_path, data))
    assert line == (
        "plank.yml: holds 2 VesselTypes (Empty, Plank). Write a vessel description (TOML) with motions ="
        ' "plank.yml", vessel_type = "Empty", and give it instead.'
    )
    assert "Plank: holds 2 Draughts (Deep, Light). Write a vessel description" in refused(
        described(tmp_path, 'vessel_type = "Plank"')
    )
    path = described(tmp_path, 'vessel_type = "Plank"', 'draught = "Light"')
    assert_plank(path)
    assert "(OrcaFlex, draught Light)" in read_vessel(path).source
    assert 'and vessel_type = "Plonk": none is this' in refused(described(tmp_path, 'vessel_type = "Plonk"'))


@pytest.mark.parametrize(
    ("general", "length"),
    [
        ({"UnitsSystem": "User", "LengthUnits": "km", "MassUnits": "kg", "ForceUnits": "N", "g": 0.00980665}, 1000.0),
        ({"UnitsSystem": "User", "LengthUnits": "m", "MassUnits": "kg", "ForceUnits": "N", "g": 9.80665}, 1.0),
        ({"UnitsSystem": "User", "LengthUnits": "ft", "MassUnits": "lbm", "ForceUnits": "lbf"}, 0.3048),
        ({"UnitsSystem": "US"}, 0.3048),
    ],
)
def test_lengths_and_rotations_are_in_the_units_of_the_model(
    tmp_path: Path, general: dict[str, Any], length: float
) -> None:
    assert_plank(written(tmp_path, in_units(general, length)))


@pytest.mark.parametrize(
    ("general", "text"),
    [
        ({"UnitsSystem": "User"}, "UnitsSystem User without LengthUnits. Allowed: m, km, cm, mm, ft, in"),
        ({"UnitsSystem": "User", "LengthUnits": "fathom"}, 'LengthUnits "fathom" is not read. Allowed: m, km'),
        ({"UnitsSystem": "User", "LengthUnits": "km", "g": 9.80665}, "g 9.80665 is not that of the earth in km/s^2"),
        ({"UnitsSystem": "User", "LengthUnits": "m", "g": "much"}, 'g "much" is not that of the earth'),
        ({"UnitsSystem": "User", "LengthUnits": "m", "TimeUnits": "min"}, 'TimeUnits "min", s is read'),
        ({"UnitsSystem": "Imperial"}, 'UnitsSystem "Imperial" is not read. Allowed: SI, US, User'),
    ],
)
def test_units_that_are_not_read_are_refused(tmp_path: Path, general: dict[str, Any], text: str) -> None:
    assert text in refused(written(tmp_path, model() | {"General": general}))


BOTH = "xz and yz planes"


@pytest.mark.parametrize("directions", [DIRECTIONS[:4], DIRECTIONS[3:7], DIRECTIONS[:7], DIRECTIONS])
def test_a_quarter_and_two_planes_of_symmetry_give_the_whole_ship(tmp_path: Path, directions: np.ndarray) -> None:
    path = written(tmp_path, model(directions, Symmetry=BOTH))
    assert_plank(path)
    quarter = len(directions) == 4
    assert any("fore and aft mirrored" in note for note in read_vessel(path).notes) is quarter


def test_a_quarter_that_is_none_is_refused(tmp_path: Path) -> None:
    assert "goes from 0 to 90 deg, both included" in refused(written(tmp_path, model(DIRECTIONS[:3], Symmetry=BOTH)))
    assert "PhaseOrigin is not at the x of RAOOrigin" in refused(
        written(tmp_path, model(DIRECTIONS[:4], phase_origin=[12.0, 0.0, 0.0], Symmetry=BOTH))
    )
    data = model(DIRECTIONS[:4], Symmetry=BOTH)
    for row in data["VesselTypes"][0]["Draughts"][0]["DisplacementRAOs"]["RAOs"][3][KEY]:
        row[1] = 0.2
    assert "surge in beam sea reaches 0.2 per metre of wave" in refused(written(tmp_path, data))


@pytest.mark.slow
def test_short_rows_and_lost_tables_are_refused(tmp_path: Path) -> None:
    raos = (data := model())["VesselTypes"][0]["Draughts"][0]["DisplacementRAOs"]
    raos["RAOs"][1][KEY][2] = raos["RAOs"][1][KEY][2][:-2]
    assert "RAODirection 30.0: row 3 has 11 numbers, 13 are needed" in refused(written(tmp_path, data))
    raos["RAOs"][1][KEY] = raos["RAOs"][0][KEY][:-1]
    assert "RAODirection 30.0: has other periods or frequencies" in refused(written(tmp_path, data))
    raos["RAOs"][1] = {"RAODirection": 30.0}
    assert "without RAODirection or without a table" in refused(written(tmp_path, data))
    raos["RAOs"][1] = {**raos["RAOs"][0], "RAODirection": "abeam"}
    assert "RAODirection abeam: is not a number of degrees" in refused(written(tmp_path, data))
    del data["VesselTypes"][0]["Draughts"][0]["DisplacementRAOs"]
    assert "has no DisplacementRAOs" in refused(written(tmp_path, data))


@pytest.mark.parametrize("number", [1e308, -1e13, 1e-300])
def test_numbers_that_no_vessel_has_are_refused(tmp_path: Path, number: float) -> None:
    """Beyond them squares and products overflow, with a warning and without a line."""
    raos = (data := model())["VesselTypes"][0]["Draughts"][0]["DisplacementRAOs"]
    for table in raos["RAOs"]:
        table[KEY][1][0 if number == 1e-300 else 1] = number
    assert "holds a number that no vessel has" in refused(written(tmp_path, data))


def test_names_of_several_lines_stay_on_one(tmp_path: Path) -> None:
    types = (data := model())["VesselTypes"]
    types.append({**types[0], "Name": "second\nline " + "x" * 1000})
    line = refused(written(tmp_path, data))
    assert line.isprintable()
    assert len(line) < 600
