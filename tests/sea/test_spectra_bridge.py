"""Files that the library wavespectra reads: written by its own writers, read back as our series."""

import math

import numpy as np
import pytest

from stillhook.errors import SeaError
from stillhook.formats.waves.wavespectra import FORMATS, _series, from_wavespectra, read_wavespectra

pytestmark = pytest.mark.slow

wavespectra = pytest.importorskip("wavespectra")

PRINTED = 2e-3  # the text formats keep four to five digits, of energies that fall off over decades


def dataset(points: int = 1):
    """Three hours of waves of 2, 4 and 2 m from 300 deg, in cos^4 about it."""
    import xarray

    f, direction = np.arange(0.04, 0.4, 0.01), np.arange(0.0, 360.0, 15.0)
    shape = f**-5.0 * np.exp(-1.25 * (0.1 / f) ** 4)
    around = np.clip(np.cos(np.radians(direction - 300.0)), 0.0, None) ** 4
    E = np.outer(shape, around)
    E *= (2.0 / 4.0) ** 2 / (E.sum() * 0.01 * 15.0)
    stack = np.stack([E, 4.0 * E, E])[:, None].repeat(points, axis=1)
    time = np.array(["2020-01-01T00", "2020-01-01T01", "2020-01-01T02"], dtype="datetime64[ns]")
    coords = {"time": time, "site": np.arange(points), "freq": f, "dir": direction}
    data = xarray.Dataset({"efth": (("time", "site", "freq", "dir"), stack)}, coords=coords)
    data["lat"], data["lon"] = ("site", np.full(points, 60.0)), ("site", np.full(points, 3.0))
    for name in ("wspd", "wdir", "dpt"):
        data[name] = (("time", "site"), np.ones((3, points)))
    return data


class TestReading:
    @pytest.mark.thorough
    @pytest.mark.parametrize("form", ["octopus", "swan", "ww3", "wavespectra"])
    def test_heights_and_directions_come_back(self, tmp_path, form):
        path = tmp_path / "waves"
        writer = {"wavespectra": "to_netcdf"}.get(form, f"to_{form}")
        getattr(dataset().spec, writer)(str(path))
        series = read_wavespectra(path, form)
        assert series.H_m0 == pytest.approx([2.0, 4.0, 2.0], rel=PRINTED)
        assert np.degrees(series.come_from) == pytest.approx(300.0, abs=0.1)
        assert str(series.time[1]) == "2020-01-01T01:00:00"

    def test_era5_counts_directions_towards_and_holds_logarithms(self, tmp_path):
        # ECMWF: 10^d2fd in m^2 s/rad over 30 frequencies, each 1.1 times the one before, and 24 directions that waves go to
        import xarray

        f, going_to = 0.03453 * 1.1 ** np.arange(30), np.arange(7.5, 360.0, 15.0)
        df = np.gradient(f)
        E = np.full((1, 30, 24), np.nan)
        E[0, 12, 7] = (3.0 / 4.0) ** 2 / (df[12] * math.radians(15.0))  # 3 m in one bin, going to 112.5 deg
        coords = {
            "time": np.array(["2020-01-01"], dtype="datetime64[ns]"),
            "frequency": np.arange(1, 31),
            "direction": np.arange(1, 25),
        }
        path = tmp_path / "era5.nc"
        stack = np.log10(E)[:, :, :, None, None]
        places = {"latitude": [60.0], "longitude": [3.0]}
        dims = ("time", "frequency", "direction", "latitude", "longitude")
        xarray.Dataset({"d2fd": (dims, stack)}, coords=coords | places).to_netcdf(path)
        series = read_wavespectra(path, "era5")
        assert going_to[7] == 112.5
        assert series.H_m0[0] == pytest.approx(3.0, rel=PRINTED)
        assert math.degrees(series.come_from[0]) == pytest.approx(292.5, abs=0.1)

    def test_a_sea_keeps_the_energy_and_turns_with_the_ship(self):
        series = from_wavespectra(dataset())
        for heading, beta in ((300.0, 180.0), (210.0, 90.0), (120.0, 0.0)):
            sea = series.sea(0, math.radians(heading))
            assert sea.H_m0 == pytest.approx(2.0, rel=1e-9)
            strongest = max(sea.trains, key=lambda train: train.spectrum.moment(0))
            assert math.degrees(math.remainder(strongest.beta - math.radians(beta), 2.0 * math.pi)) == pytest.approx(
                0.0, abs=1e-6
            )

    def test_records_with_missing_numbers_are_counted_and_not_used(self):
        data = dataset()
        data["efth"][1, 0, 3, 4] = np.nan
        series = from_wavespectra(data)
        assert series.valid.tolist() == [True, False, True]
        assert series.notes == ("1 of 3 records are missing",)
        assert math.isnan(series.come_from[1])


TRIAXYS_HEAD = """TRIAXYS BUOY DATA REPORT
VERSION = 5a.02.09
TYPE    = DIRECTIONAL SPECTRUM
DATE    = 2020 Jan 01 00:00(UTC)
NUMBER OF FREQUENCIES      =  60
INITIAL FREQUENCY (Hz)     = 0.000
FREQUENCY SPACING (Hz)     = 0.005
RESOLVABLE FREQUENCY RANGE (Hz)  =  0.030 TO 0.290
NUMBER OF DIRECTIONS       =  25
DIRECTION SPACING (DEG)    =  15.0
COLUMNS: DIRECTIONS
ROWS:    FREQUENCIES
"""


class TestADirectionThatComesTwice:
    """The first and the last ray of a closed circle are one direction: its waves count once."""

    def test_a_triaxys_file_with_0_and_360_deg_keeps_its_energy(self, tmp_path):
        # all waves from north: what a second count of north would double
        direction = np.arange(0.0, 361.0, 15.0)
        around = np.clip(np.cos(np.radians(direction)), 0.0, None) ** 8
        rows = [around * (5.0 if 0.08 <= 0.005 * i <= 0.12 else 0.0) for i in range(60)]
        path = tmp_path / "20200101.DIRSPEC"
        path.write_text(TRIAXYS_HEAD + "\n".join(" ".join(f"{x:.6f}" for x in row) for row in rows) + "\n")
        m_0 = (
            sum(float(f"{x:.6f}") for row in rows for x in row[:-1]) * 0.005 * 15.0
        )  # plain sum over 24 rays, each once
        series = read_wavespectra(path, "triaxys")
        assert series.H_m0[0] == pytest.approx(4.0 * math.sqrt(m_0), rel=1e-9)
        assert len(series.directional.theta) == 24
        assert math.remainder(float(series.come_from[0]), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert series.sea(0, 0.0).H_m0 == pytest.approx(4.0 * math.sqrt(m_0), rel=1e-9)
        assert series.notes == ("1 of 25 directions repeat another (such as 0 and 360 deg): each is counted once",)

    @pytest.mark.parametrize("first", [0.0, -180.0, 7.5, -90.0])
    def test_a_closed_circle_is_the_open_one_wherever_it_begins(self, first):
        import xarray

        data = dataset()
        data = data.assign_coords(dir=(data["dir"] - first) % 360.0 + first).sortby("dir")
        if first == 7.5:
            data = data.assign_coords(dir=data["dir"] + 7.5)
        again = data.isel(dir=[0])
        closed = xarray.concat([data, again.assign_coords(dir=again["dir"] + 360.0)], "dir", data_vars="minimal")
        open_, twice = from_wavespectra(data), from_wavespectra(closed)
        assert twice.H_m0 == pytest.approx(open_.H_m0, rel=1e-12)
        assert np.allclose(twice.directional.theta, open_.directional.theta, rtol=0.0, atol=1e-12)
        assert np.allclose(twice.directional.shares(0), open_.directional.shares(0), rtol=0.0, atol=1e-12)
        assert open_.notes == ()

    def test_two_printings_that_differ_count_half_each_and_are_told(self):
        # the trapezoidal rule over the closed circle gives both ends half a sector
        import xarray

        data = dataset().assign_coords(dir=(dataset()["dir"] + 60.0) % 360.0).sortby("dir")  # the most of it from north
        last = (data.isel(dir=[0]) * 0.5).assign_coords(dir=[360.0])
        closed = xarray.concat([data[["efth"]], last[["efth"]]], "dir").transpose("time", "site", "freq", "dir")
        E = closed["efth"].values[0, 0]
        m_0 = float(((E[:, 1:] + E[:, :-1]) / 2.0 * 15.0).sum() * 0.01)
        series = from_wavespectra(closed)
        assert series.H_m0[0] == pytest.approx(4.0 * math.sqrt(m_0), rel=1e-9)
        assert series.notes[0].endswith("with the mean of densities that differ in 3 records")


class TestRefusals:
    def test_a_point_must_be_chosen_where_there_are_several(self):
        with pytest.raises(SeaError, match=r"holds 2 points. Choose one with --point 0 to 1"):
            from_wavespectra(dataset(2))
        assert from_wavespectra(dataset(2), point=1).n_valid == 3
        with pytest.raises(SeaError, match=r"--point 2: is not between 0 and 1"):
            from_wavespectra(dataset(2), point=2)

    def test_half_a_circle_is_no_directional_spectrum(self):
        with pytest.raises(SeaError, match="not even over the full circle"):
            from_wavespectra(dataset().isel(dir=slice(0, 12)))

    def test_negative_energy_is_told(self):
        data = dataset()
        data["efth"][2] = -data["efth"][2]
        with pytest.raises(SeaError, match="negative energy in 1 records"):
            from_wavespectra(data)

    @pytest.mark.thorough
    @pytest.mark.parametrize("form", list(FORMATS))
    def test_a_file_of_another_kind_is_one_line(self, tmp_path, form):
        path = tmp_path / "waves.txt"
        path.write_text("nothing of the kind\n")
        with pytest.raises(SeaError) as e:
            read_wavespectra(path, form)
        assert str(e.value).startswith(f"waves.txt: cannot be read as {form} (")
        assert "\n" not in str(e.value)

    def test_an_unknown_format_is_told(self, tmp_path):
        with pytest.raises(SeaError, match=r'--format "grib": is not one of era5, ww3'):
            read_wavespectra(tmp_path / "x", "grib")


def test_where_a_spectrum_has_no_energy_no_direction_is_preferred_and_shares_are_still_a_whole():
    f, theta = np.array([0.08, 0.1, 0.12, 0.15]), np.radians([0.0, 90.0, 180.0, 270.0])
    E = np.zeros((2, 4, 4))
    E[0, 1] = (3.0, 1.0, 0.0, 0.0)
    series = _series("made up", f, theta, E, np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[s]"), [])
    share = series.directional.share
    np.testing.assert_allclose(share.sum(axis=2), 1.0)
    np.testing.assert_allclose(share[0, 1], (0.75, 0.25, 0.0, 0.0))
    np.testing.assert_allclose(share[1], 0.25)
