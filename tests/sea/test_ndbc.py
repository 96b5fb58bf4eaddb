"""Files of the US National Data Buoy Center: a measured year against plain numpy, every layout, and every way a file can be bad."""

import gzip
import math

import numpy as np
import pytest

from stillhook.errors import SeaError
from stillhook.formats.waves.buoys import read_directional, read_spectra, read_states
from stillhook.formats.waves.ndbc import bands
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.sea.spectra.measured import Measured
from stillhook.sea.spectra.text import spectrum_from_dict

ROUNDING = 1e-12
OLD = "YY MM DD hh   .030   .040   .050   .060\n96 01 01 00    .00   4.00   2.00    .50\n96 01 01 01    .00   1.00   1.00   1.00\n"
NEW = (
    "#YY  MM DD hh mm   .0300   .0400   .0500   .0600\n"
    "2019 01 01 00 40    0.00    4.00    2.00    0.50\n"
    "2019 01 01 01 40  999.00  999.00  999.00  999.00\n"
)
REAL_TIME = (
    "#YY  MM DD hh mm Sep_Freq  < spec_1 (freq_1) spec_2 (freq_2) spec_3 (freq_3) ... >\n"
    "2024 05 01 01 40 9.999 1.000 (0.033) 1.000 (0.038) 1.000 (0.043) \n"
    "2024 05 01 00 40 0.170 0.000 (0.033) 4.000 (0.038) 2.000 (0.043) \n"
)
WEATHER = (
    "#YY  MM DD hh mm WDIR WSPD GST  WVHT   DPD   APD MWD   PRES  ATMP  WTMP  DEWP  VIS  TIDE\n"
    "#yr  mo dy hr mn degT m/s  m/s     m   sec   sec degT   hPa  degC  degC  degC  nmi    ft\n"
    "2019 08 01 00 00 300  5.0  6.0 99.00 99.00 99.00 999 1015.0  14.0  15.0  13.0 99.0 99.00\n"
    "2019 08 01 00 50 300  5.0  6.0  1.50 11.00  7.00  99 1015.0  14.0  15.0  13.0 99.0 99.00\n"
)


def written(folder, text, name="waves.txt"):
    path = folder / name
    path.write_text(text)
    return path


class TestTheMeasuredYear:
    @pytest.mark.slow
    def test_counts_and_heights_are_those_of_plain_numpy(self, shared_data):
        path = shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz"
        table = np.genfromtxt(path, skip_header=1)[:, 4:]  # another reader, the rectangle rule over 0.01 Hz
        whole = (table != 999.0).all(axis=1)
        H = 4.0 * np.sqrt(0.01 * table[whole].sum(axis=1))
        series = read_spectra(path)
        assert (len(series), series.n_valid) == (8712, 8600) == (len(table), int(whole.sum()))
        found = series.H_m0
        assert np.isnan(found).sum() == 112
        assert found[series.valid] == pytest.approx(H, rel=ROUNDING)
        assert found[0] == pytest.approx(3.7320236, abs=5e-8)
        assert np.nanmean(found) == pytest.approx(2.1933776, abs=5e-8)
        assert np.nanmax(found) == pytest.approx(6.4683847, abs=5e-8)
        assert "112 of 8712 records are missing" in series.notes

    @pytest.mark.slow
    def test_periods_are_those_of_sums_over_frequency_in_hertz(self, shared_data):
        path = shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz"
        f = np.arange(3, 41) / 100.0
        S = np.genfromtxt(path, skip_header=1, max_rows=1)[4:]
        series = read_spectra(path)
        assert series.T_m02[0] == pytest.approx(math.sqrt(S.sum() / (S * f**2).sum()), rel=ROUNDING)
        assert series.T_m01[0] == pytest.approx(S.sum() / (S * f).sum(), rel=ROUNDING)
        assert series.T_e[0] == pytest.approx((S / f).sum() / S.sum(), rel=ROUNDING)
        assert series.T_p[0] == pytest.approx(1.0 / 0.06, rel=ROUNDING)

    @pytest.mark.slow
    def test_hours_that_the_file_lacks_are_told(self, shared_data):
        notes = read_spectra(shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz").notes
        assert (
            "72 more are absent from the file, in 2 gaps: its records are 60 min apart" in notes
        )  # 1996 has 8784 hours

    @pytest.mark.slow
    def test_one_record_is_a_spectrum_with_the_same_height(self, shared_data):
        series = read_spectra(shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz")
        one = series.spectrum(series.index("1996-01-01T00:00"))
        assert one.H_m0 == pytest.approx(series.H_m0[0], rel=ROUNDING)
        assert one.T_m02 == pytest.approx(series.T_m02[0], rel=ROUNDING)
        omega = np.linspace(0.0, 3.0, 300_001)
        assert float(np.trapezoid(one.density(omega), omega)) == pytest.approx(one.moment(0), rel=1e-4)
        again = spectrum_from_dict(one.to_dict())
        assert isinstance(again, Measured)
        assert np.array_equal(again.S, one.S)


class TestLayouts:
    def test_historical_with_two_digits_of_the_year(self, tmp_path):
        series = read_spectra(written(tmp_path, OLD))
        assert str(series.time[0]) == "1996-01-01T00:00:00"
        assert series.H_m0[0] == pytest.approx(4.0 * math.sqrt(0.065), rel=ROUNDING)
        assert (len(series), series.n_valid) == (2, 2)

    def test_historical_with_minutes_and_a_hash(self, tmp_path):
        series = read_spectra(written(tmp_path, NEW))
        assert str(series.time[0]) == "2019-01-01T00:40:00"
        assert series.valid.tolist() == [True, False]
        assert series.H_m0[0] == pytest.approx(4.0 * math.sqrt(0.065), rel=ROUNDING)
        assert math.isnan(series.H_m0[1])

    def test_real_time_comes_out_in_order_on_unrounded_frequencies_of_its_own_bands(self, tmp_path):
        series = read_spectra(written(tmp_path, REAL_TIME, "46042.data_spec"))
        assert [str(t)[11:16] for t in series.time] == ["00:40", "01:40"]
        assert series.H_m0[1] == pytest.approx(4.0 * math.sqrt(3.0 * 0.005), rel=1e-9)

    def test_packed_and_plain_are_the_same(self, tmp_path):
        packed = tmp_path / "waves.txt.gz"
        packed.write_bytes(gzip.compress(OLD.encode()))
        assert np.array_equal(read_spectra(packed).S, read_spectra(written(tmp_path, OLD)).S)

    def test_ninety_nine_is_missing_in_a_height_and_a_direction_in_a_direction(self, tmp_path):
        states = read_sea(written(tmp_path, WEATHER))
        assert states.valid.tolist() == [False, True]
        assert (states.H_m0[1], states.T_p[1], states.T_m02[1]) == (1.5, 11.0, 7.0)
        assert states.come_from[1] == pytest.approx(math.radians(99.0))
        assert states.notes == ("1 of 2 records have no wave height",)

    def test_weather_of_before_2007_and_mm_for_missing_are_read(self, tmp_path):
        text = "YYYY MM DD hh  WD  WSPD GST  WVHT  DPD   APD  MWD  BAR    ATMP  WTMP  DEWP  VIS\n"
        text += "1998 01 01 00 274  4.3  5.6  2.10 14.29  8.60 290 1015.9  MM  14.2 999.0 99.0\n"
        states = read_states(written(tmp_path, text))
        assert (states.H_m0[0], states.T_p[0]) == (2.1, 14.29)

    def test_a_record_with_one_missing_band_is_counted_and_not_used(self, tmp_path):
        series = read_spectra(written(tmp_path, OLD.replace("1.00   1.00   1.00", "1.00 999.00   1.00")))
        assert series.valid.tolist() == [True, False]
        assert np.isnan(series.S[1]).all()
        assert series.notes == ("1 of 2 records are missing, 1 of them in some bands only",)

    def test_a_time_that_comes_twice_counts_once_and_is_told(self, tmp_path):
        series = read_spectra(written(tmp_path, OLD + OLD.splitlines()[1] + "\n"))
        assert len(series) == 2
        assert series.notes == ("1 records repeat a time: the first of each is kept",)


class TestBands:
    def test_the_buoys_own_bands_have_the_published_widths(self):
        f = np.concatenate(
            ([0.02], np.arange(0.0325, 0.094, 0.005), np.arange(0.10, 0.355, 0.01), np.arange(0.365, 0.49, 0.02))
        )
        centre, width = bands(f, "file")
        assert len(centre) == 47
        assert width[0] == 0.01
        # bands 2 to 47 touch each other from 0.03 to 0.495 Hz
        assert width[1:].sum() == pytest.approx(0.465, rel=ROUNDING)
        assert (centre + width / 2.0)[1:-1] == pytest.approx((centre - width / 2.0)[2:], rel=1e-9)

    def test_bands_of_two_widths_touch_each_other(self):
        f = np.array([0.05, 0.06, 0.07, 0.085, 0.105, 0.125])
        _, width = bands(f, "file")
        assert width == pytest.approx([0.01, 0.01, 0.01, 0.02, 0.02, 0.02], rel=1e-9)

    def test_uneven_bands_reach_half_way(self):
        f = np.array([0.05, 0.06, 0.08, 0.11, 0.15])
        assert bands(f, "file")[1] == pytest.approx([0.01, 0.015, 0.025, 0.035, 0.04], rel=1e-9)


class TestBadFiles:
    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("", "is empty"),
            ("hello world\n", 'begins with "hello", not with YY'),
            (OLD.splitlines()[0] + "\n", "has a header and no records"),
            (OLD[:-8], "line 3: 3 values where the header names 4. The file is cut or mixed"),
            (OLD.replace("   .50", "  -.50"), "line 2: negative energy -0.5 m^2/Hz at 0.06 Hz"),
            (OLD.replace("   .50", "  five"), 'line 2: "five" is not a finite number'),
            (OLD.replace("   .50", "   nan"), 'line 2: "nan" is not a finite number'),
            (OLD.replace("96 01 01 01", "96 01 -1 01"), 'line 3: "96 01 -1 01" is not a date and hour'),
            (OLD.replace("96 01 01 01", "96 13 01 01"), 'line 3: "96 13 01 01" is not a date and hour'),
            (OLD.replace(".030   .040", ".040   .030"), "4 frequencies (0.04, 0.03, 0.05, ...) do not ascend"),
            (OLD.replace("4.00", "40000.00"), "line 2: Hm0 of 80 m is higher than any sea (40 m)"),
            (OLD + OLD.replace(".060", ".065"), "line 4: another header than line 1. Split the file there"),
            (WEATHER.replace("  1.50", " 41.50"), "line 4: WVHT = 41.5 is not between 0 and 40"),
            (
                "#YY MM DD hh mm WDIR WSPD\n2019 01 01 00 00 1 2\n",
                "has no column WVHT: after the time its header has WDIR WSPD",
            ),
            (REAL_TIME.replace("(0.043) \n2024", "(0.044) \n2024"), "line 2: other frequencies than line 3"),
            (REAL_TIME.replace(" (0.043) \n2024", " \n2024"), "where the header names"),
            ("<!DOCTYPE html><html>404</html>", "is a web page file"),
        ],
    )
    def test_ends_in_one_line_that_names_file_and_place(self, tmp_path, text, said):
        with pytest.raises(SeaError) as e:
            read_sea(written(tmp_path, text))
        assert str(e.value).startswith("waves.txt: ")
        assert said in str(e.value)
        assert "\n" not in str(e.value)

    @pytest.mark.parametrize(
        ("name", "content", "said"),
        [
            ("waves.txt.gz", gzip.compress(OLD.encode() * 50, mtime=0)[:-20], "the gz file is cut short or damaged"),
            ("waves.txt", b"\xff\xfe\x00\x81" * 20, "is not a text file"),
            ("46042d1996.txt", OLD.encode(), "holds the directions alpha1 .* Give the density file 46042w1996"),
            (".", None, "is a folder"),
            ("none.txt", None, "no such file"),
        ],
    )
    def test_a_file_that_is_something_else(self, tmp_path, name, content, said):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(SeaError, match=said):
            read_sea(tmp_path / name)

    @pytest.mark.parametrize(
        ("ending", "held"), [(".swdir", "alpha1"), (".swdir2", "alpha2"), (".swr1", "r1"), (".swr2", "r2")]
    )
    def test_real_time_directions_alone_are_no_waves(self, tmp_path, ending, held):
        # 120 deg in each of four narrow bands reads as waves of 6 m
        text = f"#YY  MM DD hh mm {held}_1 (freq_1) {held}_2 (freq_2) {held}_3 (freq_3) ... >\n2024 05 01 00 40 1.0 (0.033) 1.0 (0.038) 1.0 (0.043)\n"
        with pytest.raises(SeaError) as e:
            read_sea(written(tmp_path, text, f"46042{ending}"))
        said = f"46042{ending}: holds the directions {held} of a spectrum, not its wave density. Give the density file 46042.data_spec with"
        assert str(e.value).startswith(said)
        with pytest.raises(
            SeaError, match=f"renamed.txt: holds the directions {held} of a spectrum"
        ):  # its header says what it is
            read_sea(written(tmp_path, text, "renamed.txt"))

    def test_directions_end_the_commands_that_read_seas_in_one_line(self, tmp_path, capsys):
        from stillhook.cli import run

        text = (
            "#YY  MM DD hh mm alpha1_1 (freq_1) alpha1_2 (freq_2) ... >\n2024 05 01 00 40 120.0 (0.033) 130.0 (0.038)\n"
        )
        path = written(tmp_path, text, "46042.swdir")
        for command in (["sea", str(path)], ["weather", "show", str(path)]):
            assert run(command) == 2
            out, err = capsys.readouterr()
            assert out == ""
            assert err.count("\n") == 1
            assert "46042.data_spec" in err

    def test_a_missing_record_is_never_used(self, tmp_path):
        with pytest.raises(SeaError, match=r"record 1 of 2019-01-01T01:40:00Z is missing"):
            read_spectra(written(tmp_path, NEW)).spectrum(1)

    def test_a_measured_spectrum_holds_energy(self):
        with pytest.raises(SeaError, match="negative or no number"):
            Measured(np.array([0.5, 0.6]), np.array([0.1, 0.1]), np.array([1.0, -1.0]))


def directional(folder, alpha, r1, r2, *, hundred=100.0, density="   4.00   2.00   1.00   1.00"):
    """A record whose bands all come from alpha [deg], and its companions."""
    head = "#YY  MM DD hh mm   .0300   .0400   .0500   .0600\n"
    row = lambda values: head + "2019 01 01 00 40 " + values + "\n"
    written(folder, row(density), "46042w2019.txt")
    for letter, value in (("d", alpha), ("i", alpha), ("j", r1 * hundred), ("k", r2 * hundred)):
        written(folder, row(" ".join([f"{value:.2f}"] * 4)), f"46042{letter}2019.txt")
    return folder / "46042w2019.txt"


class TestDirections:
    def test_the_mean_direction_and_the_height_come_back(self, tmp_path):
        series = read_directional(directional(tmp_path, 300.0, 0.85, 0.55))
        assert math.degrees(series.come_from[0]) == pytest.approx(300.0, abs=1e-6)
        share = series.directional.shares(0)
        assert share.min() >= 0.0
        assert share.sum(axis=1) == pytest.approx(1.0, rel=ROUNDING)
        # first and second Fourier coefficients: what the buoy measured; sectors of 10 deg blur them by less than 1 %
        for n, r in ((1, 0.85), (2, 0.55)):
            c = (share * np.exp(1j * n * series.directional.theta)).sum(axis=1)
            assert np.abs(c) == pytest.approx(r, rel=1e-2)

    def test_waves_from_dead_ahead_are_a_head_sea_and_all_energy_is_kept(self, tmp_path):
        series = read_directional(directional(tmp_path, 300.0, 0.99, 0.97))
        sea = series.sea(0, math.radians(300.0))
        assert sea.H_m0 == pytest.approx(float(series.H_m0[0]), rel=1e-9)
        strongest = max(sea.trains, key=lambda train: train.spectrum.moment(0))
        assert math.degrees(strongest.beta) == pytest.approx(180.0, abs=1e-9)

    def test_hundredths_and_plain_lengths_are_told_apart(self, tmp_path):
        one, two = tmp_path / "a", tmp_path / "b"
        one.mkdir()
        two.mkdir()
        a = read_directional(directional(one, 20.0, 0.8, 0.5))
        b = read_directional(directional(two, 20.0, 0.8, 0.5, hundred=1.0))
        assert np.allclose(a.directional.shares(0), b.directional.shares(0), rtol=1e-9)

    def test_companions_beside_a_file_are_found(self, tmp_path):
        assert read_sea(directional(tmp_path, 20.0, 0.8, 0.5)).directional is not None

    def test_a_record_without_directions_is_not_used(self, tmp_path):
        series = read_directional(directional(tmp_path, 999.0, 9.99, 9.99))
        assert series.n_valid == 0
        assert "1 records have no directions" in series.notes

    def test_a_companion_that_lacks_is_named(self, tmp_path):
        path = directional(tmp_path, 20.0, 0.8, 0.5)
        (tmp_path / "46042j2019.txt").unlink()
        with pytest.raises(SeaError, match=r"46042j2019.txt: missing next to 46042w2019.txt: it holds r1"):
            read_directional(path)

    def test_a_companion_of_other_frequencies_is_refused(self, tmp_path):
        path = directional(tmp_path, 20.0, 0.8, 0.5)
        other = tmp_path / "46042d2019.txt"
        other.write_text(other.read_text().replace(".0600", ".0700"))
        with pytest.raises(SeaError, match="has other frequencies than 46042w2019"):
            read_directional(path)
