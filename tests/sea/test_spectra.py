"""Wave spectra: their moments against gamma functions, against integration of another kind, and against published fits."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillhook.errors import SeaError
from stillhook.sea.spectra.directions import cos_power, maximum_entropy, sectors
from stillhook.sea.spectra.parametric import (
    CUT,
    Hump,
    Jonswap,
    Mixed,
    OchiHubble,
    Torsethaugen,
    gamma_of,
    pierson_moskowitz,
)
from stillhook.sea.spectra.spectrum import Sea, Train, doubts, steepest
from stillhook.sea.spectra.text import parse_wave, spectrum_from_dict

MOMENT = 1e-4  # what spectral moments must be right to
PRINTED = 5e-6  # five printed digits
INTEGRATED = 1e-8  # an adaptive integral's own error
ROUNDING = 1e-12

gammas = st.floats(1.0, 10.0)
heights = st.floats(0.1, 15.0)
periods = st.floats(3.0, 20.0)
angles = st.floats(-math.pi, math.pi)


def integral(wave, n, upper):
    """m_n by adaptive Gauss-Kronrod integration over the logarithm of frequency, up to upper [rad/s]."""
    from scipy.integrate import quad

    peak = math.log(2.0 * math.pi / wave.peak_period)
    f = lambda u: math.exp(u * (n + 1)) * float(wave.density(np.array([math.exp(u)]))[0])
    edges = [peak - 2.0, *(peak + d for d in (-0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 2.0)), math.log(upper)]
    return sum(quad(f, a, b, epsabs=0.0, epsrel=1e-10, limit=200)[0] for a, b in pairwise(edges) if b > a)


class TestPiersonMoskowitz:
    def test_periods_stand_in_the_published_ratios(self):
        wave = pierson_moskowitz(2.0, 10.0)
        assert wave.T_m02 / wave.T_p == pytest.approx(0.71037, abs=PRINTED)
        assert wave.T_m01 / wave.T_p == pytest.approx(0.77177, abs=PRINTED)
        assert wave.T_e / wave.T_p == pytest.approx(0.85722, abs=PRINTED)  # Gamma(5/4) (4/5)^(1/4)

    @pytest.mark.slow
    @given(heights, periods)
    def test_the_height_is_the_one_asked_for(self, H_s, T_p):
        assert pierson_moskowitz(H_s, T_p).H_m0 == pytest.approx(H_s, rel=ROUNDING)

    def test_the_classic_form_over_omega_to_the_fifth_gives_the_same_density(self):
        # alpha g^2 omega^-5 exp(-1.25 (omega_p/omega)^4), with alpha from H_s
        H_s, T_p = 3.0, 9.0
        omega_p = 2.0 * math.pi / T_p
        omega = np.linspace(0.3, 3.0, 50)
        classic = 5.0 / 16.0 * H_s**2 * omega_p**4 * omega**-5.0 * np.exp(-1.25 * (omega_p / omega) ** 4)
        assert pierson_moskowitz(H_s, T_p).density(omega) == pytest.approx(classic, rel=ROUNDING)

    def test_the_fourth_moment_grows_with_the_logarithm_of_its_cut(self):
        wave = pierson_moskowitz(2.0, 10.0)
        # far above the peak the integrand is 5/16 H_s^2 omega_p^4 / omega, so doubling the cut adds that times ln 2
        omega_p = 2.0 * math.pi / 10.0
        more = integral(wave, 4, 2.0 * CUT * omega_p) - wave.moment(4)
        assert more == pytest.approx(5.0 / 16.0 * 4.0 * omega_p**4 * math.log(2.0), rel=MOMENT)


class TestJonswap:
    @pytest.mark.slow
    @pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 5.0, 7.0, 10.0])
    @pytest.mark.parametrize("n", [-1, 0, 1, 2, 3])
    def test_moments_agree_with_adaptive_integration_to_a_far_tail(self, gamma, n):
        wave = Jonswap(2.0, 8.0, gamma)
        far = 1e6  # rad/s: what is left above it is added in closed form below
        S = float(wave.density(np.array([far]))[0])
        tail = S * far ** (n + 1) / (4.0 - n)  # of a density that falls with omega^-5
        assert integral(wave, n, far) + tail == pytest.approx(wave.moment(n), rel=INTEGRATED)

    @pytest.mark.parametrize("gamma", [1.0, 3.3, 7.0])
    def test_the_fourth_moment_is_the_integral_up_to_the_cut(self, gamma):
        wave = Jonswap(2.0, 8.0, gamma)
        assert wave.omega_cut == pytest.approx(CUT * 2.0 * math.pi / 8.0, rel=ROUNDING)
        assert wave.moment(4) == pytest.approx(integral(wave, 4, wave.omega_cut), rel=INTEGRATED)

    @pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 5.0, 7.0])
    def test_periods_follow_the_published_fits(self, gamma):
        # DNV-RP-C205: cubic fits in gamma, themselves within 0.3 % up to 7
        wave = Jonswap(2.0, 10.0, gamma)
        zero_crossing = 0.6673 + 0.05037 * gamma - 0.006230 * gamma**2 + 0.0003341 * gamma**3
        mean = 0.7303 + 0.04936 * gamma - 0.006556 * gamma**2 + 0.0003610 * gamma**3
        assert wave.T_m02 / wave.T_p == pytest.approx(zero_crossing, rel=3e-3)
        assert wave.T_m01 / wave.T_p == pytest.approx(mean, rel=3e-3)

    @pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 5.0, 7.0])
    def test_the_printed_norm_misses_the_height_by_less_than_one_per_cent(self, gamma):
        assert Jonswap(2.0, 10.0, gamma, "printed").H_m0 == pytest.approx(2.0, rel=1e-2)

    @pytest.mark.slow
    @settings(max_examples=30)
    @given(heights, periods, gammas)
    def test_the_grid_gives_every_moment_up_to_its_end(self, H_s, T_p, gamma):
        wave = Jonswap(H_s, T_p, gamma)
        omega, weight = wave.grid(), wave.weights()
        fine = np.geomspace(omega[0], omega[-1], 20001)
        for n in range(5):
            held = float(np.sum(weight * omega**n * wave.density(omega)))
            u = np.log(fine)
            assert held == pytest.approx(float(np.trapezoid(fine ** (n + 1) * wave.density(fine), u)), rel=MOMENT)
        assert float(np.sum(weight * wave.density(omega))) == pytest.approx(wave.moment(0), rel=MOMENT)

    def test_a_sharper_peak_is_higher_and_leaves_the_height(self):
        blunt, sharp = Jonswap(2.0, 8.0, 1.0), Jonswap(2.0, 8.0, 5.0)
        peak = np.array([2.0 * math.pi / 8.0])
        assert sharp.density(peak)[0] > 2.0 * blunt.density(peak)[0]
        assert sharp.H_m0 == pytest.approx(blunt.H_m0, rel=ROUNDING)

    def test_gamma_follows_steepness_without_a_step(self):
        assert gamma_of(4.0, 7.2) == 5.0
        assert gamma_of(4.0, 7.2 + 1e-9) == pytest.approx(5.0, rel=1e-2)
        assert gamma_of(4.0, 10.0) == 1.0
        assert gamma_of(4.0, 10.0 - 1e-9) == pytest.approx(1.0, rel=1e-6)
        assert Jonswap(4.0, 8.0).gamma == pytest.approx(math.exp(1.15), rel=ROUNDING)

    @settings(max_examples=30)
    @given(heights, periods, gammas, st.floats(1.1, 2.0))
    def test_scaling_time_scales_moments(self, H_s, T_p, gamma, factor):
        slow, quick = Jonswap(H_s, T_p * factor, gamma), Jonswap(H_s, T_p, gamma)
        for n in (-1, 0, 1, 2, 3, 4):
            assert slow.moment(n) == pytest.approx(quick.moment(n) / factor**n, rel=1e-9)

    def test_density_is_nothing_at_and_below_zero_frequency(self):
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            assert not np.any(Jonswap(2.0, 8.0).density(np.array([-1.0, 0.0, 1e-9])))

    def test_still_water_has_no_period(self):
        wave = Jonswap(0.0, 8.0)
        assert wave.H_m0 == 0.0
        assert math.isnan(wave.T_m02)


class TestTorsethaugen:
    @pytest.mark.parametrize(("H_s", "T_p"), [(3.0, 6.0), (3.0, 9.0), (3.0, 14.0), (8.0, 12.0), (0.5, 16.0)])
    def test_the_height_is_the_one_asked_for(self, H_s, T_p):
        wave = Torsethaugen(H_s, T_p)
        assert wave.H_m0 == pytest.approx(H_s, rel=ROUNDING)
        far = 1e7
        tail = float(wave.density(np.array([far]))[0]) * far / 3.0
        assert integral(wave, 0, far) + tail == pytest.approx(wave.moment(0), rel=INTEGRATED)

    @pytest.mark.parametrize(("H_s", "T_p"), [(3.0, 6.0), (3.0, 14.0), (8.0, 12.0)])
    def test_the_printed_norm_misses_the_height_by_less_than_two_per_cent(self, H_s, T_p):
        assert Torsethaugen(H_s, T_p, "printed").H_m0 == pytest.approx(H_s, rel=2e-2)

    def test_a_fully_developed_sea_has_one_peak(self):
        assert len(Torsethaugen(3.0, 6.6 * 3.0 ** (1.0 / 3.0)).peaks) == 1

    def test_a_wind_sea_and_a_swell_meet_at_the_fully_developed_sea(self):
        T_f = 6.6 * 3.0 ** (1.0 / 3.0)
        omega = np.linspace(0.3, 3.0, 200)
        below, above = (Torsethaugen(3.0, T_f * x).density(omega) for x in (1.0 - 1e-6, 1.0 + 1e-6))
        assert below == pytest.approx(above, rel=1e-3)

    def test_swell_brings_a_second_peak_above_the_first_frequency_and_wind_sea_one_below(self):
        for T_p, side in ((14.0, 1.0), (6.0, -1.0)):
            first, second = Torsethaugen(3.0, T_p).peaks
            assert math.copysign(1.0, second.omega_p - first.omega_p) == side

    def test_a_primary_peak_flatter_than_the_plain_one_is_told(self):
        wave = Torsethaugen(1.0, 6.5)
        assert wave.peaks[0].gamma == 1.0
        assert wave.notes() == ("gamma of the primary peak is calculated as 0.966 and is taken as 1",)
        assert Mixed((wave, pierson_moskowitz(1.0, 8.0))).notes() == wave.notes()
        assert Torsethaugen(3.0, 8.0).notes() == ()

    def test_seas_outside_the_fit_are_refused(self):
        with pytest.raises(SeaError, match=r"Tp = 4 s with Hs = 9 m is outside the fit, 6 s"):
            Torsethaugen(9.0, 4.0)
        with pytest.raises(SeaError, match="outside the fit"):
            Torsethaugen(2.0, 25.0)


class TestOchiHubble:
    def test_lambda_one_is_pierson_moskowitz(self):
        omega = np.linspace(0.2, 3.0, 100)
        two = OchiHubble((Hump(2.0, 10.0, 1.0), Hump(0.0, 5.0, 1.0)))
        assert two.density(omega) == pytest.approx(pierson_moskowitz(2.0, 10.0).density(omega), rel=ROUNDING)

    @pytest.mark.slow
    @pytest.mark.parametrize("shape", [0.8, 1.0, 3.0, 10.0])
    @pytest.mark.parametrize("n", [-1, 0, 1, 2])
    def test_moments_are_those_of_the_gamma_density_that_omega_to_minus_four_has(self, shape, n):
        # omega^-4 is gamma distributed with this shape: another road than the integral over omega
        from scipy.stats import gamma

        H_s, T_p = 2.0, 10.0
        rate = (4.0 * shape + 1.0) / 4.0 * (2.0 * math.pi / T_p) ** 4
        of_omega = gamma(shape, scale=1.0 / rate).expect(lambda y: y ** (-n / 4.0), epsabs=0.0, epsrel=1e-10, limit=400)
        wave = OchiHubble((Hump(H_s, T_p, shape), Hump(0.0, 5.0, 1.0)))
        assert wave.moment(n) == pytest.approx(H_s**2 / 16.0 * of_omega, rel=1e-6)

    @pytest.mark.parametrize("shape", [0.8, 1.0, 1.5])
    def test_the_fourth_moment_is_the_integral_up_to_the_cut_or_to_infinity(self, shape):
        wave = OchiHubble((Hump(2.0, 10.0, shape), Hump(0.0, 10.0, 1.0)))
        upper = wave.omega_cut if shape <= 1.0 else 1e8
        assert wave.moment(4) == pytest.approx(integral(wave, 4, upper), rel=1e-7)


class TestSums:
    def test_energies_add(self):
        both = parse_wave("jonswap Hs=3 m Tp=14 s gamma=5 + pm Hs=4 m Tp=7 s")
        assert isinstance(both, Mixed)
        assert both.H_m0 == pytest.approx(5.0, rel=ROUNDING)

    def test_the_grid_serves_both_peaks(self):
        both = parse_wave("jonswap Hs=3 m Tp=16 s gamma=10 + jonswap Hs=1 m Tp=4 s gamma=10")
        omega, weight = both.grid(), both.weights()
        for n in (0, 1, 2):
            fine = np.geomspace(omega[0], omega[-1], 100001)
            exact = float(np.trapezoid(fine ** (n + 1) * both.density(fine), np.log(fine)))
            assert float(np.sum(weight * omega**n * both.density(omega))) == pytest.approx(exact, rel=MOMENT)

    def test_the_peak_is_that_of_the_higher_density(self):
        assert parse_wave("pm Hs=3 m Tp=14 s + pm Hs=1 m Tp=7 s").peak_period == pytest.approx(14.0, rel=2e-3)

    def test_trains_of_a_sea_add(self):
        sea = Sea((Train(pierson_moskowitz(3.0, 14.0), 0.0), Train(pierson_moskowitz(4.0, 7.0), 1.0, 2.0)))
        assert sea.H_m0 == pytest.approx(5.0, rel=ROUNDING)


class TestSpreading:
    @pytest.mark.slow
    @given(st.floats(1.0, 200.0), st.integers(4, 90))
    def test_shares_add_up_to_one_to_the_last_digit(self, n, count):
        weight = cos_power(n, count)[1]
        assert math.fsum(weight) == sum(weight) == sum(weight[::-1]) == 1.0

    @pytest.mark.parametrize("n", [1.0, 2.0, 4.0, 10.0, 50.0])
    def test_the_mean_squared_cosine_is_the_closed_form(self, n):
        theta, weight = cos_power(n)
        assert float(np.sum(weight * np.cos(theta) ** 2)) == pytest.approx(
            (n + 1.0) / (n + 2.0), rel=1e-3 if n == 1.0 else 1e-9
        )

    def test_shares_are_symmetric_and_narrower_with_a_larger_exponent(self):
        theta, wide = cos_power(2.0)
        narrow = cos_power(20.0)[1]
        assert np.array_equal(theta, -theta[::-1])
        assert np.allclose(wide, wide[::-1], rtol=0.0, atol=1e-15)
        assert np.sum(narrow * theta**2) < 0.2 * np.sum(wide * theta**2)

    def test_a_long_crested_train_has_one_direction(self):
        beta, share = Train(pierson_moskowitz(1.0, 8.0), math.pi).directions()
        assert list(beta) == [math.pi]
        assert list(share) == [1.0]

    @pytest.mark.parametrize("n", [0.0, 0.5, 201.0, math.nan])
    def test_an_exponent_that_is_none_is_refused(self, n):
        with pytest.raises(SeaError, match="is not between 1 and 200"):
            Train(pierson_moskowitz(1.0, 8.0), 0.0, n)


class TestMaximumEntropy:
    @pytest.mark.slow
    @given(st.lists(st.tuples(st.floats(0.0, 1.0), angles, st.floats(0.0, 1.0), angles), min_size=1, max_size=5))
    def test_any_four_numbers_give_shares_that_are_shares(self, four):
        r_1, a_1, r_2, a_2 = np.array(four).T
        share = maximum_entropy(r_1 * np.exp(1j * a_1), r_2 * np.exp(2j * a_2))
        assert np.all(np.isfinite(share))
        assert share.min() >= 0.0
        assert share.sum(axis=-1) == pytest.approx(1.0, rel=ROUNDING)

    def test_nothing_known_is_all_round_alike(self):
        share = maximum_entropy(np.zeros(1, dtype=complex), np.zeros(1, dtype=complex))
        assert share[0] == pytest.approx(1.0 / 36.0, rel=ROUNDING)

    @pytest.mark.parametrize("n", [2.0, 4.0, 8.0])
    def test_a_cosine_power_sea_comes_back_in_its_first_two_coefficients(self, n):
        theta, weight = cos_power(n, 720)
        c_1, c_2 = (np.array([np.sum(weight * np.exp(1j * k * (theta + 1.0)))]) for k in (1, 2))
        share = maximum_entropy(c_1, c_2)[0]
        for k, c in ((1, c_1[0]), (2, c_2[0])):
            assert np.sum(share * np.exp(1j * k * sectors())) == pytest.approx(
                c, abs=1e-2
            )  # sectors of 10 deg blur by 0.6 %

    def test_turning_the_sea_by_a_sector_turns_the_shares(self):
        turn = math.radians(10.0)
        c_1, c_2 = np.array([0.7 + 0.1j]), np.array([0.3 - 0.1j])
        here, there = maximum_entropy(c_1, c_2)[0], maximum_entropy(c_1 * np.exp(1j * turn), c_2 * np.exp(2j * turn))[0]
        assert np.roll(here, 1) == pytest.approx(there, rel=1e-9)


class TestSteepness:
    def test_a_sea_that_wind_cannot_raise_is_told(self):
        wave = pierson_moskowitz(8.0, 6.0)
        lines = doubts(wave.H_m0, wave.T_p, wave.T_m02)
        assert len(lines) == 2
        assert "limit 0.0667" in lines[0]

    def test_an_ordinary_sea_is_not(self):
        wave = Jonswap(3.0, 9.0)
        assert doubts(wave.H_m0, wave.T_p, wave.T_m02) == ()

    def test_the_limit_runs_straight_between_its_two_ends(self):
        assert steepest(5.0, "T_p") == steepest(8.0, "T_p") == pytest.approx(1 / 15)
        assert steepest(11.5, "T_p") == pytest.approx((1 / 15 + 1 / 25) / 2)


class TestStored:
    @pytest.mark.parametrize(
        "text",
        [
            "pm Hs=2 m Tp=10 s",
            "jonswap Hs=2 m Tp=9 s gamma=1",
            "jonswap Hs=2 m Tp=10 s gamma=2 norm=printed",
            "torsethaugen Hs=2 m Tp=10 s",
            "ochi-hubble Hs1=2 m Tp1=14 s lambda1=3 Hs2=1 m Tp2=7 s lambda2=1",
            "pm Hs=2 m Tp=10 s + torsethaugen Hs=1 m Tp=8 s",
        ],
    )
    def test_every_kind_comes_back_from_plain_numbers_and_from_its_own_words(self, text):
        wave = parse_wave(text)
        assert spectrum_from_dict(wave.to_dict()) == wave
        assert parse_wave(wave.describe()) == wave
        assert wave.describe() == text
