"""Tip statistics: limits, symmetries, and an independent reckoning straight from the transfer functions of a real vessel."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.interpolate import CubicSpline

from stillhook.errors import MotionError, SeaError, UnitError
from stillhook.formats.motion.open import read_tip_motion
from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.motion.motion import Sine, Still
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.boom import TipPoint, parse_point
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.sea.vessel.tip import motion_statistics, tip_response, tip_summary
from stillhook.statistics.extremes import MPM, Gumbel, gumbel, largest

INTERPOLATION = 0.01
"""Of a standard deviation: between two frequencies of a table nothing is known, and straight lines and splines differ by up to twice this."""
HOURS_3 = 10800.0


def sea(beta: float, H: float = 1.0, T: float = 8.0, gamma: float = 3.3, spread: float | None = None) -> Sea:
    return Sea((Train(Jonswap(H, T, gamma), math.radians(beta), spread),))


def buoy(last: float = 4.0, heave: complex = 1.0) -> Rao:
    """A body that heaves with the surface and does nothing else."""
    omega = np.linspace(0.05, last, 300)
    H = np.zeros((6, 8, 300), dtype=complex)
    H[2] = heave
    return Rao("buoy", omega, np.arange(8) * math.pi / 4.0, H)


class TestLimits:
    def test_a_buoy_moves_as_the_sea_does(self):
        response = tip_response(buoy(12.0 * 2.0 * math.pi / 8.0), sea(30.0), 0.0, 0.0)
        assert 4.0 * response.sigma_z == pytest.approx(1.0, rel=1e-4)
        assert response.T_z / 8.0 == pytest.approx(
            sea(0.0).trains[0].spectrum.T_m02 / 8.0, rel=4e-3
        )  # the tail beyond 12 omega_p, 0.7 % of m_2
        assert response.T_p == pytest.approx(8.0, rel=2e-3)  # cells of 0.002 rad/s
        assert response.share_beyond == 0.0

    def test_twice_the_sea_is_twice_the_motion_and_the_same_periods(self):
        small, large = (tip_response(buoy(), sea(30.0, H), 3.0, 4.0) for H in (1.0, 2.0))
        assert large.sigma_a == pytest.approx(2.0 * small.sigma_a)
        assert large.T_z == pytest.approx(small.T_z)

    def test_one_period_alone_has_no_bandwidth(self):
        """A vessel that answers to waves of 8 s alone, within 0.5 %."""
        omega = np.linspace(0.1, 2.0, 4000)
        H = np.zeros((6, 2, 4000), dtype=complex)
        H[2] = np.maximum(np.exp(-(((omega - 2.0 * math.pi / 8.0) / 0.004) ** 2)) - 1e-6, 0.0)
        response = tip_response(Rao("narrow", omega, np.array([0.0, math.pi]), H), sea(0.0), 0.0, 0.0)
        assert response.bandwidth < 0.02
        assert response.T_z == pytest.approx(8.0, rel=2e-3)

    def test_a_vessel_that_stands_still_has_no_periods(self):
        numbers = tip_response(buoy(heave=0.0), sea(0.0), 10.0, 0.0).statistics(HOURS_3)
        assert numbers["sigma_z"] == numbers["z_mpm"] == numbers["a_p90"] == 0.0
        assert math.isnan(numbers["T_z"])

    def test_trains_add_up_in_squares(self):
        both = Sea((*sea(30.0).trains, *sea(200.0, 0.7, 13.0).trains))
        parts = [tip_response(buoy(), s, 0.0, 0.0).moment(0) for s in (sea(30.0), sea(200.0, 0.7, 13.0))]
        assert tip_response(buoy(), both, 0.0, 0.0).moment(0) == pytest.approx(sum(parts), rel=1e-4)

    def test_what_lies_beyond_the_table_is_told_in_size(self):
        """A buoy's last value does stay: inside and beyond make the complete acceleration of the sea."""
        whole, cut = (tip_response(buoy(last), sea(0.0), 0.0, 0.0) for last in (12.0 * 2.0 * math.pi / 8.0, 1.2))
        assert math.hypot(cut.sigma_a, cut.sigma_a_beyond) == pytest.approx(whole.sigma_a, rel=1e-3)
        omega = np.linspace(1.2, 40.0, 200000)
        share = np.trapezoid(sea(0.0).trains[0].spectrum.density(omega), omega) * 16.0
        assert cut.share_beyond == pytest.approx(share, rel=1e-3)
        notes = tip_summary(buoy(1.2), sea(0.0), TipPoint(0.0, 0.0), HOURS_3)["notes"]
        assert "ends at a period of 5.236 s" in notes[0]
        assert notes[1].startswith("Caution")

    def test_waves_longer_than_the_table_are_told(self):
        omega = np.linspace(0.7, 3.0, 200)
        H = np.zeros((6, 2, 200), dtype=complex)
        H[2] = 1.0
        rao = Rao("short", omega, np.array([0.0, math.pi]), H)
        summary = tip_summary(rao, sea(0.0), TipPoint(0.0, 0.0), HOURS_3)
        assert 0.05 < summary["share_below"] < 0.3
        assert any("taken to follow the water" in note for note in summary["notes"])


@pytest.fixture(scope="module")
def supply(shared_data: Path) -> Rao:
    return read_vessel(shared_data / "vessel_mss_supply" / "input.re1")


class File:
    """The numbers of a VERES .re1 file, read here by counting them off; axes x aft, y starboard, z up, 0 head sea, 90 from port."""

    def __init__(self, path: Path) -> None:
        numbers = [float(token) for line in path.read_text().splitlines()[6:] for token in line.split()]
        headings, frequencies = int(numbers[8]), int(numbers[9])
        at = 11 + 5
        self.heading, self.H = [], np.zeros((headings, frequencies, 6), dtype=complex)
        for i in range(headings):
            self.heading.append(numbers[at])
            block = np.array(numbers[at + 1 : at + 1 + 19 * frequencies]).reshape(frequencies, 19)
            self.omega, rows = block[:, 0], block[:, 1:].reshape(frequencies, 6, 3)
            self.H[i] = rows[:, :, 1] + 1j * rows[:, :, 2]
            at += 1 + 19 * frequencies

    def vertical(self, beta: int, x: float, y: float) -> np.ndarray:
        """Of a tip x forward and y to port, waves travelling to beta (0 to 360, counter-clockwise from the bow) [deg].

        180 - beta is where VERES counts them, from its 0 (head) over 90 (from port); from starboard the ship is looked at in a mirror.
        """
        port = (beta - 180) % 360 <= 180
        i = self.heading.index(float((beta - 180) % 360 if port else (180 - beta) % 360))
        aft, starboard = -x, -y if port else y
        return self.H[i, :, 2] + starboard * self.H[i, :, 3] - aft * self.H[i, :, 4]

    def sigmas(self, beta: int, x: float, y: float, H: float, T: float, gamma: float, *, straight: bool) -> list[float]:
        """sigma_z, sigma_v, sigma_a in a JONSWAP sea, H(omega) straight or by a spline from frequency to frequency."""
        h, omega = self.vertical(beta, x, y), np.linspace(self.omega[0], self.omega[-1], 30001)
        if straight:
            h = np.interp(omega, self.omega, h.real) + 1j * np.interp(omega, self.omega, h.imag)
        else:
            h = CubicSpline(self.omega, h)(omega)
        S = jonswap(omega, H, T, gamma) * np.abs(h) ** 2
        return [math.sqrt(np.trapezoid(omega**n * S, omega)) for n in (0, 2, 4)]


def jonswap(omega: np.ndarray, H: float, T: float, gamma: float) -> np.ndarray:
    """Written here again, brought to its height by its own integral over a long axis."""
    f, axis, peak = omega / (2.0 * math.pi), np.linspace(0.01, 8.0, 200000), 1.0 / T

    def shape(f):
        sigma = np.where(f > peak, 0.09, 0.07)
        return f**-5.0 * np.exp(-1.25 * (peak / f) ** 4) * gamma ** np.exp(-(((f / peak - 1.0) / sigma) ** 2) / 2.0)

    return H**2 / 16.0 * shape(f) / np.trapezoid(shape(axis), axis) / (2.0 * math.pi)


class TestSupplyVessel:
    """82.8 m supply vessel, tip 20 m aft and 18 m to starboard of the reference point."""

    AT = (-20.0, -18.0)

    @pytest.mark.slow
    @pytest.mark.parametrize("beta", [0, 50, 90, 140, 180, 220, 270, 310])
    @pytest.mark.parametrize(("T", "gamma"), [(8.0, 3.3), (12.0, 1.0)])
    def test_deviations_are_those_reckoned_from_the_file_alone(self, supply, shared_data, beta, T, gamma):
        """Between what straight lines and what splines make of the table, or within 1 % of it."""
        file = File(shared_data / "vessel_mss_supply" / "input.re1")
        response = tip_response(supply, sea(beta, 1.0, T, gamma), *self.AT)
        straight, spline = (file.sigmas(beta, *self.AT, 1.0, T, gamma, straight=s) for s in (True, False))
        for found, a, b in zip((response.sigma_z, response.sigma_v, response.sigma_a), straight, spline, strict=True):
            assert min(a, b) * (1.0 - INTERPOLATION) < found < max(a, b) * (1.0 + INTERPOLATION)

    def test_what_the_table_leaves_open_is_stated(self, supply):
        found = tip_summary(supply, sea(180.0), TipPoint(*self.AT), HOURS_3)
        assert found["leeway"] == supply.leeway(*self.AT)
        assert any("of the motion open" in note for note in found["notes"])

    def test_waves_from_its_own_side_move_a_tip_more_than_twice_as_much_as_those_from_the_other(self, supply):
        from_starboard, from_port = (tip_response(supply, sea(b), *self.AT).sigma_z for b in (90.0, 270.0))
        assert from_starboard == pytest.approx(0.376, rel=INTERPOLATION)
        assert from_port == pytest.approx(0.179, rel=INTERPOLATION)

    def test_a_tip_to_port_is_the_mirror_image(self, supply):
        for beta in (0.0, 35.0, 90.0, 170.0, 200.0, 270.0, 333.0):
            here = tip_response(supply, sea(beta), -20.0, -18.0).sigma_a
            there = tip_response(supply, sea(360.0 - beta), -20.0, 18.0).sigma_a
            assert here == pytest.approx(there, rel=1e-5)  # the file has sway and roll of 1e-7 in a head sea

    def test_short_crested_seas_spare_the_worst_heading_and_raise_the_best(self, supply):
        long, short = (
            {b: tip_response(supply, sea(b, spread=n), *self.AT).sigma_z for b in (75.0, 315.0)} for n in (None, 4.0)
        )
        assert short[75.0] < long[75.0]
        assert short[315.0] > long[315.0]

    def test_narrow_spreading_is_long_crested(self, supply):
        """cos^200 has a standard deviation of 4 deg."""
        narrow, single = (tip_response(supply, sea(140.0, spread=n), *self.AT).sigma_z for n in (200.0, None))
        assert narrow == pytest.approx(single, rel=0.02)

    def test_series_have_the_deviations_of_the_spectra(self, supply):
        response = tip_response(supply, sea(90.0), *self.AT)
        motion = tip_motion(realise(sea(90.0), 3600.0, 1), supply, *self.AT)
        for order, expected in enumerate((response.sigma_z, response.sigma_v, response.sigma_a)):
            assert motion.deviation(order) == pytest.approx(
                expected, rel=2e-3
            )  # a resonance seen in bands of 0.002 rad/s

    @pytest.mark.slow
    def test_the_largest_of_an_hour_are_those_of_the_formula_on_average(self, supply):
        """60 seeds; maxima of Gaussian motion of some bandwidth stay a little below those of one period."""
        response = tip_response(supply, sea(90.0), *self.AT)
        numbers = response.statistics(3600.0)
        t = np.arange(0.0, 3600.0, 0.2)
        found = [tip_motion(realise(sea(90.0), 3600.0, s), supply, *self.AT).sample(t)[1].max() for s in range(60)]
        fit = gumbel(found)
        estimate = fit.estimate(MPM, 0.99)
        assert estimate.low < numbers["v_mpm"] * 1.01
        assert estimate.high > numbers["v_mpm"] * 0.97


class TestExtremes:
    def test_the_most_probable_maximum_is_the_peak_of_the_density_of_the_largest(self):
        """Of 1,000 Rayleigh maxima: the density of the largest is differentiated numerically."""
        x = np.linspace(2.0, 6.0, 400001)
        density = np.gradient(np.exp(1000.0 * np.log1p(-np.exp(-(x**2) / 2.0))), x)
        assert largest(1.0, 1000.0) == pytest.approx(x[np.argmax(density)], rel=0.01)

    def test_the_level_of_a_quantile_is_stayed_below_that_often(self):
        """Drawn: 4,000 times the largest of 500 Rayleigh maxima."""
        rng = np.random.default_rng(1)
        maxima = rng.rayleigh(0.7, size=(4000, 500)).max(axis=1)
        for q in (0.2, MPM, 0.9):
            assert np.mean(maxima < largest(0.7, 500.0, q)) == pytest.approx(
                q, abs=3.0 * math.sqrt(q * (1.0 - q) / 4000.0) + 1e-3
            )

    def test_longer_is_larger_but_slowly(self):
        assert largest(1.0, 2000.0) / largest(1.0, 1000.0) == pytest.approx(
            math.sqrt(math.log(2000.0) / math.log(1000.0))
        )

    @pytest.mark.parametrize(
        ("n", "q", "text"), [(0.5, 0.9 / 2, "too few for a largest value"), (100.0, 1.0, "quantile 1 is not")]
    )
    def test_what_has_no_largest_value_is_refused(self, n, q, text):
        with pytest.raises(SeaError, match=text):
            largest(1.0, n, q)


class TestGumbel:
    DRAWN = np.random.default_rng(3).gumbel(2.5, 0.4, size=25)

    def test_the_fit_is_that_of_maximum_likelihood(self):
        fit = gumbel(self.DRAWN)
        loc, scale = stats.gumbel_r.fit(self.DRAWN)
        assert (fit.mu, fit.beta) == pytest.approx((loc, scale), rel=1e-4)  # SciPy searches to that
        assert fit.quantile(MPM) == pytest.approx(fit.mu)
        assert fit.quantile(0.9) == pytest.approx(stats.gumbel_r.ppf(0.9, fit.mu, fit.beta))

    def test_other_units_give_the_same_fit_in_other_units(self):
        fit, other = gumbel(self.DRAWN), gumbel(1000.0 * self.DRAWN + 7.0)
        assert (other.mu, other.beta) == pytest.approx((1000.0 * fit.mu + 7.0, 1000.0 * fit.beta))
        assert other.estimate(0.9).high == pytest.approx(1000.0 * fit.estimate(0.9).high + 7.0)

    @pytest.mark.thorough
    @pytest.mark.parametrize("n", [6, 20])
    @pytest.mark.parametrize("q", [MPM, 0.9])
    def test_intervals_hold_the_truth_as_often_as_they_say(self, n, q):
        """2,000 sets of n maxima; three standard errors of 95 %."""
        rng = np.random.default_rng(n)
        truth = Gumbel(10.0, 2.0, n).quantile(q)
        hits = 0
        for _ in range(2000):
            hits += gumbel(rng.gumbel(10.0, 2.0, size=n)).estimate(q).contains(truth)
        assert hits / 2000.0 == pytest.approx(0.95, abs=3.0 * math.sqrt(0.05 * 0.95 / 2000.0))

    @pytest.mark.slow
    def test_more_seeds_close_the_interval(self):
        rng = np.random.default_rng(5)
        estimates = [gumbel(rng.gumbel(size=n)).estimate(0.9) for n in (10, 40, 160)]
        widths = [e.high - e.low for e in estimates]
        assert widths[0] > widths[1] > widths[2]

    @pytest.mark.parametrize(
        ("maxima", "text"),
        [
            ([1.0, 2.0], "Run more seeds"),
            ([1.0, 2.0, 3.0, 4.0, math.nan], "not a finite number"),
            ([2.0] * 6, "do not scatter"),
        ],
    )
    def test_what_is_no_set_of_maxima_is_refused(self, maxima, text):
        with pytest.raises(SeaError, match=text):
            gumbel(maxima)


class TestMotions:
    def test_a_measured_heave_has_the_deviation_and_period_of_its_log(self, shared_data):
        """seap: standard deviation 1.0961 m, mean period 9.634 s by another reckoning; ends and thinning move them by half a percent."""
        log = shared_data / "ship_motion_palmer" / "NBP1406_seap-2014-08-01.txt"
        numbers = motion_statistics(read_tip_motion(log, tip=("0 m", "0 m", "0 m")), HOURS_3)
        assert numbers["sigma_z"] == pytest.approx(1.0961, rel=0.01)
        assert numbers["T_z_counted"] == pytest.approx(9.634, rel=0.01)
        assert numbers["T_z"] == pytest.approx(
            numbers["T_z_counted"], rel=0.06
        )  # the two agree for a Gaussian motion without end
        assert numbers["z_max"] < 1.3 * numbers["z_p90"]

    def test_a_series_has_the_numbers_of_the_spectrum_it_is_from(self):
        response = tip_response(buoy(math.pi), sea(0.0), 0.0, 0.0)
        numbers = motion_statistics(tip_motion(realise(sea(0.0), 3600.0, 2), buoy(math.pi), 0.0, 0.0), HOURS_3)
        expected = response.statistics(HOURS_3)
        for name in ("sigma_z", "sigma_v", "sigma_a", "T_z", "z_mpm", "v_p90", "a_mpm"):
            assert numbers[name] == pytest.approx(expected[name], rel=0.01), name  # 10 s of the hour are left out

    @pytest.mark.parametrize("motion", [Sine(amplitude="1 m", period="8 s"), Still()])
    def test_a_motion_without_an_end_has_no_statistics(self, motion):
        with pytest.raises(SeaError, match="that has an end"):
            motion_statistics(motion, HOURS_3)


class TestPlaces:
    def test_a_place_is_read_in_any_order_and_unit(self):
        assert parse_point("x=-20 m, y=-18 m") == TipPoint(-20.0, -18.0)
        assert parse_point(" Y = 1800 cm,z=30 m , x=-20 m") == TipPoint(-20.0, 18.0, 30.0)

    @pytest.mark.parametrize(
        ("text", "line"),
        [
            ("x=-20 m", "y is missing"),
            ("x=-20 m, y=1 m, x=2 m", "x is given twice"),
            ("-20 m, -18 m", '"-20 m" is not x, y or z with a length'),
            ("x=-20 m, y=-18 m, w=3 m", '"w=3 m" is not x, y or z'),
            ("x=-20 km, y=-18 m", "more than 300 m"),
            ("", "is not x, y or z"),
        ],
    )
    def test_what_is_no_place_is_one_line(self, text, line):
        with pytest.raises(SeaError) as refused:
            parse_point(text, "--at")
        assert line in str(refused.value)
        assert str(refused.value).startswith("--at")

    def test_a_place_needs_units(self):
        with pytest.raises(UnitError, match="--at: y"):
            parse_point("x=-20 m, y=-18", "--at")


def test_a_log_without_roll_needs_no_lever_and_says_so(tmp_path):
    rows = "\n".join(f"{0.5 * i},{math.sin(0.7 * i / 2)}" for i in range(300))
    (tmp_path / "heave.csv").write_text(f"time [s],heave [m]\n{rows}\n")
    with pytest.raises(MotionError, match="has no roll and pitch"):
        read_tip_motion(tmp_path / "heave.csv", tip=("1 m", "0 m", "0 m"))
