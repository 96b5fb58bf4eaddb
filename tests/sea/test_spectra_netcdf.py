"""Spectra in NetCDF are read by what their attributes say, and files of spectra by their content."""

import math

import numpy as np
import pytest
import xarray

from stillhook.errors import SeaError
from stillhook.formats.waves.netcdf import form_of
from stillhook.formats.waves.wavespectra import read_sea

F, DIRECTION = np.arange(0.04, 0.4, 0.01), np.arange(0.0, 360.0, 15.0)
PER_DEGREE, PER_RADIAN = "m2 s degree-1", "m2 s rad-1"


def written(folder, *, unit=PER_DEGREE, direction=None, freq="Hz", names=("freq", "dir"), degrees=True):
    """Waves of 2 m about 300 deg, in the numbers of the file."""
    shape = F**-5.0 * np.exp(-1.25 * (0.1 / F) ** 4)
    E = np.outer(shape, np.clip(np.cos(np.radians(DIRECTION - 300.0)), 0.0, None) ** 4)
    E *= (2.0 / 4.0) ** 2 / (E.sum() * 0.01 * 15.0)
    E = E * (180.0 / math.pi if unit == PER_RADIAN else 1.0) / (2.0 * math.pi if freq == "rad/s" else 1.0)
    data = xarray.Dataset(
        {"efth": (("time", *names), E[None], {"units": unit})},
        {
            "time": np.array(["2024-01-01"], dtype="datetime64[ns]"),
            names[0]: (names[0], F * (2.0 * math.pi if freq == "rad/s" else 1.0), {"units": freq}),
            names[1]: (
                names[1],
                DIRECTION if degrees else np.radians(DIRECTION),
                {"units": "degree" if degrees else "radian"} | (direction or {}),
            ),
        },
    )
    path = folder / "spectra.nc"
    data.to_netcdf(path, engine="h5netcdf")
    return path


TO, FROM = {"standard_name": "sea_surface_wave_to_direction"}, {"standard_name": "sea_surface_wave_from_direction"}


@pytest.mark.parametrize(
    ("how", "from_deg", "note"),
    [
        ({"direction": FROM}, 300.0, ""),
        ({"direction": TO}, 120.0, "waves go to, as the file says"),
        ({"direction": {"long_name": "direction the waves are going to"}}, 120.0, "waves go to"),
        ({"direction": FROM, "unit": PER_RADIAN}, 300.0, "for each radian, as the file says"),
        ({"direction": FROM, "freq": "rad/s"}, 300.0, "frequencies in rad/s, as the file says"),
        ({"direction": FROM, "names": ("frequency", "direction")}, 300.0, ""),
        ({"direction": FROM, "degrees": False}, 300.0, ""),
        ({}, 300.0, "does not say what its directions mean"),
    ],
)
def test_attributes_of_directions_and_densities_are_used(tmp_path, how, from_deg, note):
    series = read_sea(written(tmp_path, **how))
    assert series.H_m0[0] == pytest.approx(2.0, rel=2e-3)
    assert math.degrees(series.come_from[0]) == pytest.approx(from_deg, abs=0.1)
    assert any(note in line for line in series.notes) if note else not series.notes


def test_units_that_are_not_known_and_attributes_that_differ_are_refused(tmp_path):
    with pytest.raises(SeaError, match='efth in "kw/m" is not known'):
        read_sea(written(tmp_path, unit="kW/m"))
    with pytest.raises(SeaError, match="both going to and coming from"):
        read_sea(written(tmp_path, direction=TO | {"long_name": "direction waves come from"}))


def test_the_format_is_seen_from_the_content(tmp_path):
    assert form_of(written(tmp_path)) == "wavespectra"
    for name, text, form in (
        ("a.txt", b"SWAN   1   Swan standard spectral file", "swan"),
        ("b.txt", b"TRIAXYS BUOY DATA REPORT", "triaxys"),
        ("c.txt", b"Forecast valid for 1 Jan\nnfreqs,30\n", "octopus"),
        ("d.json", b'{"data": {"spotterId": "SPOT-1"}}', "spotter"),
        ("e.txt", b"YYYY MM DD hh  .0200\n", None),
    ):
        (tmp_path / name).write_bytes(text)
        assert form_of(tmp_path / name) == form
    data = xarray.Dataset({"swh": ("time", [1.0])}, {"time": np.array(["2024-01-01"], dtype="datetime64[ns]")})
    data.to_netcdf(tmp_path / "weather.nc", engine="h5netcdf")
    with pytest.raises(SeaError, match="no directional spectra among swh"):
        form_of(tmp_path / "weather.nc")
