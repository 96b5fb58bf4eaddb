"""What a table of weather says about its times and numbers is used, or contradicted aloud."""

import math

import numpy as np
import pytest
import xarray

from stillhook.errors import WeatherError
from stillhook.formats.weather.file import read_weather
from stillhook.formats.weather.times import zone_in
from stillhook.sea.spectra.directions import DirectionSense

ROWS = "".join(f"2024-03-11 {h:02d}:00,{1.5 + 0.1 * h:.2f},9.0\n" for h in range(6))


def table(folder, text):
    file = folder / "weather.csv"
    file.write_text(text, encoding="utf-8")
    return file


def first(folder, text, **more):
    return str(read_weather(table(folder, text), **more).time[0])


@pytest.mark.parametrize(
    ("head", "utc"),
    [
        ("time,Hs [m],Tp [s]\n", "2024-03-11T00:00:00"),
        ("time [UTC],Hs [m],Tp [s]\n", "2024-03-11T00:00:00"),
        ("time_utc,Hs [m],Tp [s]\n", "2024-03-11T00:00:00"),
        ("time [UTC+3],Hs [m],Tp [s]\n", "2024-03-10T21:00:00"),
        ("time (CET),Hs [m],Tp [s]\n", "2024-03-10T23:00:00"),
        ("time_cet,Hs [m],Tp [s]\n", "2024-03-10T23:00:00"),
        ("Title: Forecast for X,,\nTime zone: UTC+3,,\n\ntime,Hs,Tp\nUTC+3,m,s\n", "2024-03-10T21:00:00"),
        ("# times are in UTC-03:30\ntime,Hs [m],Tp [s]\n", "2024-03-11T03:30:00"),
        ("# site GMT Harbour 3\ntime,Hs [m],Tp [s]\n", "2024-03-11T00:00:00"),
    ],
)
def test_a_stated_zone_is_used(tmp_path, head, utc):
    assert first(tmp_path, head + ROWS) == utc


def test_stamps_that_name_their_zone_are_not_moved_twice(tmp_path):
    rows = ROWS.replace(":00,", ":00 UTC+3,")
    assert first(tmp_path, "time [UTC+3],Hs [m],Tp [s]\n" + rows) == "2024-03-10T21:00:00"
    with pytest.raises(WeatherError, match="Leave time_zone out"):
        first(tmp_path, "time,Hs [m],Tp [s]\n" + rows, time_zone="UTC+3")


def test_local_times_are_asked_about(tmp_path):
    text = "local time,Hs [m],Tp [s]\n" + ROWS
    with pytest.raises(WeatherError, match='time_zone = "UTC\\+1"'):
        read_weather(table(tmp_path, text))
    weather = read_weather(table(tmp_path, text), time_zone="UTC+1")
    assert str(weather.time[0]) == "2024-03-10T23:00:00"
    assert any("moved by -1 h to UTC, as stated" in note for note in weather.notes)


def test_user_and_file_that_differ_are_refused(tmp_path):
    with pytest.raises(WeatherError, match="the file says that its times are UTC\\+3"):
        first(tmp_path, "time [UTC+3],Hs [m],Tp [s]\n" + ROWS, time_zone="UTC+2")
    with pytest.raises(WeatherError, match="is not a time zone that is known"):
        first(tmp_path, "time,Hs [m],Tp [s]\n" + ROWS, time_zone="IST")


def test_words_that_are_no_zones():
    for text in ("date", "wave set", "Date/time", "estimated", "metocean", "height 2 m", "Hs-3"):
        assert zone_in(text) is None


@pytest.mark.parametrize(
    ("texts", "utc"),
    [
        (("1632834721", "1632836521"), "2021-09-28T13:12:01"),
        (("1632834721000", "1632836521000"), "2021-09-28T13:12:01"),
        (("43831.0", "43831.041667"), "2020-01-01T00:00:00"),
        (("20161011.000000", "20161011.010000"), "2016-10-11T00:00:00"),
        (("1996-01-01-00", "1996-01-01-03"), "1996-01-01T00:00:00"),
        (("2016-123 06:00", "2016-123 07:00"), "2016-05-02T06:00:00"),
        (("2013123123", "2014010100"), "2013-12-31T23:00:00"),
        (("2024-03-11T00:00:00+01:00", "2024-03-11T01:00:00+01:00"), "2024-03-10T23:00:00"),
    ],
)
def test_stamps_of_other_programs_are_read(tmp_path, texts, utc):
    rows = "".join(f"{text},1.5,9.0\n" for text in texts)
    assert first(tmp_path, "time,Hs [m],Tp [s]\n" + rows) == utc


def test_days_of_the_year_in_columns_are_read(tmp_path):
    rows = "".join(f"2016,123,{h},1.5,9.0\n" for h in range(3))
    assert first(tmp_path, "year,doy,hour,Hs [m],Tp [s]\n" + rows) == "2016-05-02T00:00:00"
    with pytest.raises(WeatherError, match="day 367 of 2016 is not a date"):
        first(tmp_path, "year,doy,hour,Hs [m],Tp [s]\n2016,367,0,1.5,9\n2016,367,1,1.5,9\n")


def test_a_frequency_under_the_name_of_a_period_is_asked_about_and_read_as_one(tmp_path):
    text = "time,Hs [m],Tz [s]\n" + ROWS.replace(",9.0", ",0.1429")
    with pytest.raises(WeatherError, match=r'no sea has such a period.*columns.T_m02 = "Tz \[Hz\]"'):
        read_weather(table(tmp_path, text))
    weather = read_weather(table(tmp_path, text), columns_as={"T_m02": "Tz [Hz]"})
    assert weather.columns["T_m02"][0] == pytest.approx(1.0 / 0.1429)


def test_a_peak_frequency_is_the_peak_period(tmp_path):
    weather = read_weather(table(tmp_path, "time,hs,fp\n" + ROWS.replace(",9.0", ",0.125")))
    assert weather.columns["T_p"] == pytest.approx(np.full(6, 8.0))


def test_heights_that_no_place_has_are_asked_about(tmp_path):
    text = "time,Hs [m],Tp [s]\n" + "".join(f"2024-03-11 {h:02d}:00,{15 + h},9.0\n" for h in range(6))
    with pytest.raises(WeatherError, match=r'no place has such waves.*columns.H_m0 = "Hs \[cm\]"'):
        read_weather(table(tmp_path, text))
    assert read_weather(table(tmp_path, text), columns_as={"H_m0": "Hs [m]"}).columns["H_m0"][0] == 15.0
    assert read_weather(table(tmp_path, text), columns_as={"H_m0": "Hs [cm]"}).columns["H_m0"][0] == pytest.approx(0.15)


def test_a_direction_of_minus_170_is_190(tmp_path):
    rows = "".join(f"2024-03-11 {h:02d}:00,1.5,9.0,-170\n" for h in range(6))
    weather = read_weather(table(tmp_path, "time,Hs,Tp,mwd\n" + rows), sense=DirectionSense.FROM_NORTH)
    assert weather.columns["come_from"] == pytest.approx(np.full(6, math.radians(190.0)))


def test_wind_of_its_parts(tmp_path):
    """Wind towards the east comes from the west."""
    time = np.datetime64("2023-01-01", "ns") + np.arange(4) * np.timedelta64(3600, "s")
    shape = ("valid_time", "latitude", "longitude")
    parts = {
        "swh": (1.5, "m"),
        "pp1d": (8.0, "s"),
        "mwd": (190.0, "Degree true"),
        "u10": (3.0, "m s**-1"),
        "v10": (4.0, "m s**-1"),
    }
    data = xarray.Dataset(
        {name: (shape, np.full((4, 1, 1), value), {"units": unit}) for name, (value, unit) in parts.items()},
        {"valid_time": time, "latitude": [60.0], "longitude": [3.0]},
    )
    data.to_netcdf(tmp_path / "era5.nc", engine="h5netcdf")
    weather = read_weather(tmp_path / "era5.nc", sense=DirectionSense.FROM_NORTH)
    assert weather.columns["wind"] == pytest.approx(np.full(4, 5.0))
    assert weather.columns["wind_from"] == pytest.approx(np.full(4, math.pi + math.atan2(3.0, 4.0)))
    assert weather.columns["come_from"] == pytest.approx(np.full(4, math.radians(190.0)))
    rows = "".join(f"2024-03-11 {h:02d}:00,1.5,9.0,-3.0,0.0\n" for h in range(6))
    weather = read_weather(table(tmp_path, "time,Hs,Tp,u10,v10\n" + rows))
    assert weather.columns["wind_from"] == pytest.approx(np.full(6, math.radians(90.0)))
