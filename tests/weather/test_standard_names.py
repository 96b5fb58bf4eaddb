"""Columns of a NetCDF file of weather by the standard name that says what they are."""

import numpy as np
import pytest
import xarray as xr

from stillhook.errors import StillhookError
from stillhook.formats.weather.file import read_weather

TIMES = np.array(["2013-12-31T22:00", "2013-12-31T23:00", "2014-01-01T00:00"], dtype="datetime64[ns]")
HEIGHT = {"units": "m", "standard_name": "sea_surface_wave_significant_height"}


def stored(path, **heights):
    xr.Dataset({name: ("time", values, HEIGHT) for name, values in heights.items()}, {"time": TIMES}).to_netcdf(
        path, engine="scipy"
    )
    return path


@pytest.mark.slow
def test_a_variable_of_any_name_is_the_height_where_it_alone_has_the_standard_name(tmp_path):
    found = read_weather(stored(tmp_path / "w.nc", q17=[1.0, 1.5, 2.0]))
    assert found.columns["H_m0"].tolist() == [1.0, 1.5, 2.0]


@pytest.mark.slow
def test_of_two_variables_with_the_same_standard_name_none_is_chosen(tmp_path):
    with pytest.raises(StillhookError, match="Hs"):
        read_weather(stored(tmp_path / "w.nc", q17=[1.0, 1.5, 2.0], q18=[1.1, 1.6, 2.1]))
