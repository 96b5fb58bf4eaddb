"""Weather tables as people export them, and the mistakes that they make."""

import gzip
import math

import numpy as np
import pytest
import xarray as xr

from stillhook.errors import StillhookError
from stillhook.formats.weather.file import read_weather
from stillhook.formats.weather.times import read_times
from stillhook.sea.spectra.directions import DirectionSense

DECEMBER = np.array(["2013-12-31T22:00:00", "2013-12-31T23:00:00", "2014-01-01T00:00:00"], dtype="datetime64[s]")
KNOT = 1852.0 / 3600.0


@pytest.fixture
def read(tmp_path):
    def of(content, name="weather.csv", **options):
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_weather(tmp_path / name, **options)

    return of


@pytest.fixture
def refused(read):
    def of(content, name="weather.csv", **options):
        with pytest.raises(StillhookError) as caught:
            read(content, name, **options)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return of


class TestTimes:
    @pytest.mark.parametrize(
        "stamps",
        [
            ("2013-12-31 22:00", "2013-12-31 23:00", "2014-01-01 00:00"),
            ("2013-12-31T22:00:00Z", "2013-12-31T23:00:00Z", "2014-01-01T00:00:00Z"),
            ("2013-12-31 23:00:00+01:00", "2014-01-01 00:00:00+01:00", "2014-01-01 01:00:00.000+01:00"),
            ("12/31/13 22:00", "12/31/13 23:00", "1/1/14 0:00"),
            ("12/31/2013 10:00 PM", "12/31/2013 11:00 PM", "1/1/2014 12:00 AM"),
            ("31/12/2013 22:00", "31/12/2013 23:00", "01/01/2014 00:00"),
            ("31.12.2013 22:00", "31.12.2013 23:00", "01.01.2014 00:00"),
            ("31-Dec-2013 22:00", "31-Dec-2013 23:00", "01-Jan-2014 00:00"),
            ("2013123122", "2013123123", "2014010100"),
            ("2013-12-31 22:00", "2013-12-31 23:00", "2013-12-31 24:00"),
        ],
    )
    def test_dates_in_any_dress(self, read, stamps):
        found = read("time,Hs [m]\n" + "".join(f"{s},1.5\n" for s in stamps))
        np.testing.assert_array_equal(found.time, DECEMBER)
        assert found.step == 3600.0

    @pytest.mark.parametrize(
        ("digits", "when"),
        [
            ("2013010100", "2013-01-01T00"),
            ("2013123123", "2013-12-31T23"),
            ("1800010112", "1800-01-01T12"),
            ("2199123123", "2199-12-31T23"),
            ("1799123123", None),
            ("2013130100", None),
            ("2013000100", None),
            ("2013010000", None),
            ("2013013200", None),
        ],
    )
    def test_ten_digits_are_a_date_where_a_calendar_has_it_and_else_seconds_since_1970(self, digits, when):
        """No month 13 and no day 32: such a number counts, as the clock of Unix does."""
        second = (
            np.datetime64(when, "s") if when else np.datetime64("1970-01-01", "s") + np.timedelta64(int(digits), "s")
        )
        assert read_times([digits], [2], "w.csv").tolist() == [second.item()]

    def test_date_and_time_in_two_columns_and_in_five(self, read):
        two = read("Date;Time;Hs (m)\n31.12.2013;22:00;1,5\n31.12.2013;23:00;1,6\n01.01.2014;00:00;1,7\n")
        five = read("YEAR MONTH DAY HOUR HS\n2013 12 31 22 1.5\n2013 12 31 23 1.6\n2014 1 1 0 1.7\n")
        for found in (two, five):
            np.testing.assert_array_equal(found.time, DECEMBER)
            assert found.columns["H_m0"].tolist() == [1.5, 1.6, 1.7]

    def test_month_and_day_are_told_apart_by_even_steps(self, read):
        rows = "".join(f"{m}/1/2013 00:00,{m}\n" if m < 3 else "" for m in (1, 2))
        assert read("time,hs\n3/4/2013 23:00,1\n3/5/2013 0:00,1\n").time[1] == np.datetime64("2013-03-05T00:00:00")
        assert read("time,hs\n" + rows, date_order="dmy").time[1] == np.datetime64("2013-01-02T00:00:00")

    def test_where_either_may_be_the_month_it_must_be_said(self, read, refused):
        table = "time,hs\n1/2/2013 1:00,1\n1/2/2013 2:00,2\n"
        assert 'Say date_order = "mdy" or "dmy"' in refused(table)
        assert read(table, date_order="dmy").time[0] == np.datetime64("2013-02-01T01:00:00")

    @pytest.mark.parametrize(
        ("rows", "says"),
        [
            (
                "2013-03-31 01:00,1\n2013-03-31 01:00,1\n",
                "line 3: the time 2013-03-31T01:00 is given twice, first in line 2",
            ),
            (
                "2013-03-31 02:00,1\n2013-03-31 01:00,1\n",
                "line 3: the time 2013-03-31T01:00 is before that of line 2. Sort the rows",
            ),
            ("2013-02-30 01:00,1\n2013-03-01 01:00,1\n", 'line 2: "2013-02-30 01:00" is not a date'),
            ("2013-02-03 25:00,1\n2013-03-01 01:00,1\n", 'line 2: "2013-02-03 25:00" is not a time of the day'),
            ("2013-02-03 01:00,1\n03.02.2013 02:00,1\n", "line 3: its date is written in another way"),
        ],
    )
    def test_times_that_cannot_be(self, refused, rows, says):
        assert says in refused("time,hs\n" + rows)


class TestColumns:
    def test_units_and_missing_numbers_of_every_kind(self, read):
        table = "time,Hs [cm],Tp (s),wind speed [kn],MWD\n2013-12-31 22:00,150,999,10,99\n2013-12-31 23:00,,8,99,999\n2014-01-01 00:00,NaN,99,20,1\n"
        found = read(table, sense=DirectionSense.FROM_NORTH)
        np.testing.assert_array_equal(found.columns["H_m0"], [1.5, np.nan, np.nan])
        np.testing.assert_array_equal(found.columns["T_p"], [np.nan, 8.0, np.nan])
        np.testing.assert_allclose(found.columns["wind"], [10 * KNOT, np.nan, 20 * KNOT])
        np.testing.assert_allclose(found.columns["come_from"], np.radians([99.0, np.nan, 1.0]))

    def test_a_period_of_nought_is_missing_and_the_line_is_told(self, read):
        found = read("time,hs,tp\n2013-12-31 22:00,1,8\n2013-12-31 23:00,0,0\n2014-01-01 00:00,inf,9\n")
        np.testing.assert_array_equal(found.columns["T_p"], [8.0, np.nan, 9.0])
        assert any(
            "tp: 1 of 3 missing, 1 of them 0, first in weather.csv: line 3: tp = 0 s" in note for note in found.notes
        )
        assert any("hs: 1 of 3 missing, 1 of them marked by 99, inf or the like" in note for note in found.notes)

    def test_a_unit_named_by_the_user_goes_before_that_of_the_heading(self, read):
        rows = "time,hs [m]\n2013-12-31 22:00,150\n2013-12-31 23:00,160\n"
        assert read(rows, columns_as={"H_m0": "hs [cm]"}).columns["H_m0"].tolist() == [1.5, 1.6]
        assert read(rows.replace("[m]", "[cm]"), columns_as={"H_m0": "hs"}).columns["H_m0"].tolist() == [1.5, 1.6]

    @pytest.mark.parametrize(
        ("heading", "cell", "does"),
        [
            (
                "hs",
                "150",
                ': not a possible height. Correct the line or empty the cell; if the numbers are in cm, say columns.H_m0 = "hs [cm]".',
            ),
            ("hs (m)", "150", 'columns.H_m0 = "hs [cm]".'),
            ("hs", "-2", ": not a possible height. Correct the line or empty the cell."),
            (
                "tp [rpm]",
                "0.1",
                'unit "rpm" is not one of s, sec, second, seconds.',
            ),
            ("tp [ms]", "8000", 'Convert its numbers, or say columns.T_p = "tp [s]" where'),
            ("tp", "80", ": not a possible period. Correct the line or empty the cell."),
            ("wind", "120", 'if the numbers are in kn, say columns.wind = "wind [kn]".'),
            (
                "wave_from_direction",
                "400",
                "line 3: wave_from_direction = 400 deg: not a possible direction. Correct the line or empty the cell.",
            ),
            (
                "wave_from_direction [rad]",
                "180",
                'if the numbers are in deg, say columns.come_from = "wave_from_direction [deg]".',
            ),
        ],
    )
    def test_a_number_that_no_weather_has_is_answered_with_a_unit_that_it_would_fit(self, refused, heading, cell, does):
        assert does in refused(f"time,{heading}\n2013-12-31 22:00,\n2013-12-31 23:00,{cell}\n")

    def test_the_column_that_is_not_there_is_answered_with_those_of_weather(self, refused):
        assert "It has hs, tp." in refused(
            "time,hs,tp\n2013-12-31 22:00,1,8\n2013-12-31 23:00,1,8\n", columns_as={"H_m0": "nope"}
        )

    def test_a_step_longer_than_the_spacing_is_refused(self, read, refused):
        rows = "time,hs\n2013-12-31 22:00,1\n2013-12-31 23:00,1\n2014-01-01 00:00,1\n"
        assert (
            "step = 7 h: its records are 1 h apart, and a longer step would count time twice. Leave step out."
            in refused(rows, step=25200.0)
        )
        assert read(rows, step=3600.0).step == 3600.0

    def test_what_was_assumed_is_said(self, read):
        notes = " ".join(read("time,hs,extra\n2013-12-31 22:00,1,5\n2013-12-31 23:00,1,6\n").notes)
        assert "times taken as UTC" in notes
        assert "units are not in the file and were taken: hs in m" in notes
        assert "not read: extra" in notes

    def test_a_heading_of_ones_own_is_mapped_with_its_unit(self, read):
        found = read("time,a,b\n2013-12-31 22:00,150,36\n", columns_as={"H_m0": "a [cm]", "wind": "b [km/h]"})
        assert (found.columns["H_m0"][0], found.columns["wind"][0]) == (1.5, pytest.approx(10.0))

    def test_lines_before_the_header_a_row_of_units_and_an_old_code_page(self, read):
        table = "Export of point 12\nLat 60 N\n\nDatetime;Hs;Dir [°]\n-;m;-\n2013123122;1,5;90\n2013123123;1,6;90\n"
        assert read(table.encode("cp1252")).columns["H_m0"].tolist() == [1.5, 1.6]

    def test_gz_is_read_as_it_is(self, read):
        assert len(read(gzip.compress(b"time,hs\n2013-12-31 22:00,1\n2013-12-31 23:00,1\n"), "w.csv.gz")) == 2

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("table", "says"),
        [
            ("time,hs\n2013-02-01 01:00,1\n2013-02-01 02:00,-2\n", "line 3: hs = -2 m: not a possible height"),
            ("time,hs\n2013-02-01 01:00,150\n", "line 2: hs = 150 m: not a possible height"),
            ("time,hs\n2013-02-01 01:00,1\n2013-02-01 02:00,abc\n", 'line 3: hs = "abc" is not a finite number'),
            ("time,hs\n2013-02-01 01:00,1\n2013-02-01 02:00,1,3\n", "line 3: 3 fields where the header has 2"),
            (
                "time,hs,swh\n2013-02-01 01:00,1,1\n",
                'columns "hs" and "swh" both read as H_m0. Choose one, columns.H_m0 =',
            ),
            ("time,hs [bar]\n2013-02-01 01:00,1\n", 'unit "bar" is not one of m, cm, ft'),
            ("time,foo\n2013-02-01 01:00,1\n", 'no column of weather among "foo"'),
            ("when,hs\n2013-02-01 01:00,1\n", "no column of times among"),
            ("2013-02-01 01:00,1\n2013-02-01 02:00,1\n", "has no line of headings"),
            ("time,hs\n", "holds no table"),
            ("", "is empty"),
            ("\x89HDF....", "cannot be read as NetCDF"),
            ("PK\x03\x04....", "is a zip or Excel file. Export the place as CSV"),
        ],
    )
    def test_tables_that_cannot_be_read_are_refused_with_the_line(self, refused, table, says):
        assert says in refused(table.encode("latin-1"))

    def test_no_such_file_names_the_library(self):
        with pytest.raises(StillhookError, match="no such file, and no weather of the library, which has SYNTHETIC"):
            read_weather("nowhere.csv")


class TestNetcdf:
    def stored(self, tmp_path, engine="h5netcdf", **more):
        data = {
            "hs": (
                "time",
                np.array([1.0, 1.5, np.nan]),
                {"units": "m", "standard_name": "sea_surface_wave_significant_height"},
            ),
            "thq": (
                "time",
                np.array([10.0, 350.0, 20.0]),
                {"units": "degree", "standard_name": "sea_surface_wave_from_direction"},
            ),
            "ff": ("time", np.array([5.0, 6.0, 7.0]), {"units": "m/s"}),
        }
        xr.Dataset(data | more, coords={"time": DECEMBER.astype("datetime64[ns]")}).expand_dims("point").to_netcdf(
            tmp_path / "w.nc", engine=engine
        )
        return tmp_path / "w.nc"

    @pytest.mark.thorough
    @pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
    def test_one_place_is_read_by_standard_names_that_say_what_directions_mean(self, tmp_path, engine):
        found = read_weather(self.stored(tmp_path, engine))
        np.testing.assert_array_equal(found.time, DECEMBER)
        np.testing.assert_array_equal(found.columns["H_m0"], [1.0, 1.5, np.nan])
        np.testing.assert_allclose(np.degrees(found.columns["come_from"]), [10.0, 350.0, 20.0])
        assert found.columns["wind"].tolist() == [5.0, 6.0, 7.0]

    @pytest.mark.slow
    def test_several_places_are_refused(self, tmp_path):
        with pytest.raises(StillhookError, match=r"ws is over x \(2\) as well. Cut out one place"):
            read_weather(
                self.stored(tmp_path, ff=("time", np.zeros(3)), ws=(("time", "x"), np.zeros((3, 2)))),
                columns_as={"wind": "ws"},
            )


class TestDirections:
    TABLE = "time,Hs [m],mean wave direction [deg]\n2013-12-31 22:00,1,20\n2013-12-31 23:00,1,350\n"

    @pytest.mark.parametrize(
        ("sense", "come_from"),
        [
            (DirectionSense.FROM_NORTH, (20, 350)),
            (DirectionSense.TO_NORTH, (200, 170)),
            (DirectionSense.TO_EAST, (250, 280)),
            (DirectionSense.FROM_EAST, (70, 100)),
        ],
    )
    def test_every_sense_that_can_be_declared(self, read, sense, come_from):
        np.testing.assert_allclose(np.degrees(read(self.TABLE, sense=sense).columns["come_from"]), come_from)

    def test_without_one_directions_are_not_read_and_a_note_says_so(self, read):
        found = read(self.TABLE)
        assert list(found.columns) == ["H_m0"]
        assert any("does not say what its wave direction" in note for note in found.notes)

    def test_directions_that_look_like_radians_are_noted_and_read_so_on_demand(self, read):
        table = "time,MWD [deg]\n" + "".join(f"2013-12-31 0{i}:00,{i}.2\n" for i in range(6))
        note = 'MWD [deg]: all directions are within 6.3 deg of north. In radians? Then say columns.come_from = "MWD [rad]"'
        assert note in read(table, sense=DirectionSense.FROM_NORTH).notes
        told = read(table, sense=DirectionSense.FROM_NORTH, columns_as={"come_from": "MWD [rad]"})
        assert told.columns["come_from"][3] == pytest.approx(3.2)
        assert not any("radians" in note for note in told.notes)
        assert not any(
            "radians" in note for note in read(table.replace("5.2", "350"), sense=DirectionSense.FROM_NORTH).notes
        )

    def test_headings_and_comments_that_say_it_need_no_option(self, read):
        said = read(self.TABLE.replace("mean wave direction", "wave_to_direction"))
        comment = read("# wave direction: going to, clockwise from north\n" + self.TABLE)
        for found in (said, comment):
            assert found.columns["come_from"][0] == pytest.approx(math.radians(200.0))

    def test_an_option_that_contradicts_the_file_is_refused(self, refused):
        table = self.TABLE.replace("mean wave direction", "wave_from_direction")
        assert 'the file says its directions are "coming from, clockwise from north", sense says' in refused(
            table, sense=DirectionSense.TO_EAST
        )


@pytest.mark.slow
def test_the_public_year_comes_from_the_north_west(shared_data):
    """Oregon: the mean of all directions lies between west and north-west only if they are read as its SOURCE.txt says."""
    found = read_weather(
        shared_data / "sea_ndbc_46042" / "single_year_hindcast_multiparam.csv", sense=DirectionSense.TO_EAST
    )
    mean = np.degrees(np.angle(np.mean(np.exp(1j * found.columns["come_from"])))) % 360.0
    assert 270.0 < mean < 315.0


def test_a_buoys_weather_has_its_wind(read):
    lines = [
        "#YY  MM DD hh mm WDIR WSPD GST  WVHT   DPD   APD MWD",
        "#yr  mo dy hr mn degT m/s  m/s     m   sec   sec degT",
    ]
    lines += [f"2019 08 01 {h:02d} 00 320  {h}.0  6.0 1.50 99.00  6.00 270" for h in range(3)]
    found = read("\n".join(lines) + "\n", "46042h2019.txt")
    assert found.columns["wind"].tolist() == [0.0, 1.0, 2.0]
    assert np.all(np.isnan(found.columns["T_p"]))
    assert found.columns["come_from"][0] == pytest.approx(1.5 * math.pi)


@pytest.mark.slow
def test_the_librarys_weather_is_marked_as_synthetic_and_has_the_seasons():
    found = read_weather("SYNTHETIC-norwegian-sea")
    assert found.source.startswith("SYNTHETIC")
    assert any(note.startswith("SYNTHETIC") for note in found.notes)
    assert set(found.columns) == {"H_m0", "T_p", "come_from", "wind", "wind_from"}
    month = found.time.astype("datetime64[M]").astype(int) % 12
    Hs = found.columns["H_m0"]
    assert Hs[month == 0].mean() > 2.0 * Hs[month == 6].mean()
    assert np.all(
        2.0 * math.pi * Hs / (9.81 * found.columns["T_p"] ** 2) < 1.0 / 15.0
    )  # no record steeper than wind raises waves


def test_the_two_parts_of_a_wind_are_its_speed_together(read):
    found = read("time,swh,u10,v10\n2013-12-31 22:00,1,3,4\n2013-12-31 23:00,1,3,4\n")
    assert list(found.columns) == ["H_m0", "wind", "wind_from"]
    assert found.columns["wind"].tolist() == [5.0, 5.0]
    assert any("wind from its parts u10 and v10" in note for note in found.notes)
