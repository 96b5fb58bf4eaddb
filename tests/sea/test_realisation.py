"""Random seas in time: what they hold, how they move a tip, and the water that goes with them."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from stillhook.errors import MotionError, SeaError
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.text import motion_from_json, motion_to_json, scaled
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import Realisation, realise, regular, tip_motion, tip_motion_exact, wave_field
from stillhook.sea.vessel.tip import tip_response

G = 9.80665
HEAD, PORTWARD = math.pi, math.pi / 2.0
SEA = Sea((Train(Jonswap(2.0, 8.0, 3.3), HEAD),))
CURVE = 1e-8  # of a standard deviation: what the curve between nodes may add (irregular.FINE promises 4e-9 of the fastest harmonic)
CUBIC = 2e-4  # of a standard deviation: what cubics between samples of the water may add (wave_field promises 1e-4 of waves of 4 s)


def raft() -> Rao:
    """A body so small that it goes where the surface goes, and turns with its slope; waves shorter than 2 s are not in its table."""
    omega, beta = np.linspace(0.05, math.pi, 400), np.radians(np.arange(0.0, 360.0, 15.0))
    k = omega**2 / G
    H = np.zeros((6, len(beta), len(omega)), dtype=complex)
    H[2] = 1.0
    H[3] = -1j * k * np.sin(beta)[:, None]
    H[4] = 1j * k * np.cos(beta)[:, None]
    return Rao("raft", omega, beta, H)


def direct(c: np.ndarray, repeat: float, t: np.ndarray, order: int = 0) -> np.ndarray:
    """The sum of harmonics term by term."""
    omega = 2.0 * math.pi / repeat * np.arange(len(c))
    return np.real(np.exp(1j * np.outer(t, omega)) @ ((1j * omega) ** order * c))


class TestIrregularTip:
    def motion(self) -> IrregularTip:
        return tip_motion(realise(SEA, 1200.0, 3), raft(), 10.0, 5.0)

    def test_height_speed_and_acceleration_are_the_sum_of_the_harmonics_at_any_time(self):
        motion = self.motion()
        t = np.random.default_rng(0).uniform(0.0, motion.repeat, 400)
        for order, found in enumerate(motion.sample(t)):
            assert np.abs(found - direct(motion.amplitudes, motion.repeat, t, order)).max() < CURVE * motion.deviation(
                order
            )

    def test_deviations_are_those_of_the_samples_over_one_period(self):
        motion = self.motion()
        t = np.arange(0.0, motion.repeat, 0.05)
        for order, found in enumerate(motion.sample(t)):
            assert np.std(found) == pytest.approx(motion.deviation(order), rel=CURVE)

    def test_it_repeats_exactly(self):
        motion = self.motion()
        t = np.linspace(0.0, motion.repeat, 777)
        for now, later in zip(motion.sample(t), motion.sample(t + 3.0 * motion.repeat), strict=True):
            np.testing.assert_allclose(later, now, atol=1e-9)  # rounding of times of an hour against slopes of 1 m/s
        assert motion.duration == motion.repeat

    def test_a_single_time_gives_single_numbers(self):
        assert all(np.ndim(x) == 0 for x in self.motion().sample(12.3))

    def test_stored_and_read_back_pickled_and_scaled_it_is_the_same(self):
        motion = self.motion()
        assert motion_from_json(motion_to_json(motion)) == motion
        assert pickle.loads(pickle.dumps(motion)) == motion
        assert hash(motion_from_json(motion_to_json(motion))) == hash(motion)
        assert scaled(motion, 2.0).sample(7.0)[1] == pytest.approx(2.0 * motion.sample(7.0)[1])
        assert motion != scaled(motion, 1.5)

    @pytest.mark.parametrize(
        ("amplitudes", "repeat", "text"),
        [
            ([0.0, "a"], 60.0, "are not numbers"),
            ([0.0, math.nan], 60.0, "finite amplitudes"),
            ([1j, 1.0], 60.0, "of the mean (real)"),
            ([0.0], 60.0, "one harmonic or more"),
            ([0.0, 1.0], 1e9, "repeat 1e+09 s is not between"),
        ],
    )
    def test_what_is_no_motion_is_refused(self, amplitudes, repeat, text):
        with pytest.raises(MotionError, match=text.replace("(", r"\(").replace(")", r"\)").replace("+", r"\+")):
            IrregularTip(amplitudes, repeat)

    def test_a_stored_motion_that_was_spoilt_is_one_line(self):
        with pytest.raises(MotionError, match="Generate it again"):
            motion_from_json('{"type": "irregular", "repeat": 60.0, "re": "x", "im": "y"}')


class TestRealisation:
    def test_the_surface_has_the_height_of_the_sea_whatever_the_seed(self):
        """But for the waves of less than 2 s that are left out, 0.32 % of the variance at T_p 8 s."""
        for seed in (0, 1, 99):
            eta = realise(SEA, 3600.0, seed).elevation(0.0, 0.0)
            H = 4.0 * math.sqrt(np.sum(np.abs(eta) ** 2) / 2.0)
            assert H == pytest.approx(2.0 * math.sqrt(1.0 - 0.00316), rel=1e-4)

    def test_short_pieces_hold_the_variance_of_the_spectrum_too(self):
        """Bands are averaged over: 100 s leaves 2 harmonics to the peak of the spectrum."""
        eta = realise(SEA, 100.0, 1).elevation(0.0, 0.0)
        assert np.sum(np.abs(eta) ** 2) / 2.0 == pytest.approx(0.25 * (1.0 - 0.00316), rel=3e-3)

    @pytest.mark.slow
    def test_rayleigh_amplitudes_scatter_as_records_of_that_length_do(self):
        """Mean variance that of the sea; its scatter 2 pi/T int S^2 over the square of int S, both within three standard errors."""
        omega = np.linspace(0.2, 9.0, 20000)
        S = SEA.trains[0].spectrum.density(omega)
        seeds, repeat = 400, 600.0
        found = [
            np.sum(np.abs(realise(SEA, repeat, s, amplitudes="rayleigh").elevation(0.0, 0.0)) ** 2) / 2.0
            for s in range(seeds)
        ]
        expected = math.sqrt(2.0 * math.pi / repeat * np.trapezoid(S**2, omega))
        assert np.mean(found) == pytest.approx(0.25 * (1.0 - 0.00316), abs=3.0 * expected / math.sqrt(seeds))
        assert np.std(found) == pytest.approx(expected, rel=3.0 / math.sqrt(2.0 * seeds))

    def test_the_same_seed_is_the_same_sea_and_another_is_not(self):
        a, b, c = (realise(SEA, 300.0, seed).a for seed in (5, 5, 6))
        assert np.array_equal(a, b)
        assert not np.allclose(a, c)

    def test_a_head_sea_meets_the_bow_first(self):
        waves = regular(1.0, 8.0, HEAD)
        k = 4.0 * math.pi**2 / 64.0 / G
        bow, stern = waves.elevation(10.0, 3.0)[0], waves.elevation(-10.0, 3.0)[0]
        assert np.angle(bow / stern) == pytest.approx(20.0 * k)  # exp(+i omega t): ahead in phase, so earlier

    def test_waves_from_starboard_reach_starboard_first(self):
        waves = regular(1.0, 8.0, PORTWARD)
        assert np.angle(waves.elevation(0.0, -5.0)[0]) > 0.0 > np.angle(waves.elevation(0.0, 5.0)[0])

    def test_a_raft_on_a_long_wave_rides_on_the_water_at_every_corner(self):
        """Wave of 40 s, 2.5 km: a plane through the raft leaves the surface by (k r)^2/2."""
        waves = regular(1.5, 40.0, math.radians(130.0), cycles=3)
        k = waves.wave_number[0]
        for x, y in ((20.0, 0.0), (0.0, 15.0), (-20.0, -15.0)):
            tip = waves.spread(waves.elevation(x, y))[-1]
            c = tip_motion(waves, raft(), x, y).amplitudes[-1]
            assert abs(c - tip) <= 1.5 * 0.51 * k**2 * (x**2 + y**2)

    def test_time_and_frequency_domain_give_the_same_tip(self):
        rao = raft()
        response = tip_response(rao, SEA, -15.0, 12.0)
        motion = tip_motion(realise(SEA, 3600.0, 4), rao, -15.0, 12.0)
        assert motion.deviation(0) == pytest.approx(
            response.sigma_z, rel=1e-3
        )  # bands of 0.002 rad/s about the harmonics
        assert motion.deviation(1) == pytest.approx(response.sigma_v, rel=1e-3)
        assert motion.deviation(2) == pytest.approx(response.sigma_a, rel=1e-3)

    @pytest.mark.slow
    def test_short_crested_waves_move_the_tip_as_their_spectrum_says(self):
        """Mean variance over seeds within three standard errors."""
        sea = Sea((Train(Jonswap(2.0, 8.0, 3.3), HEAD, 4.0),))
        rao = raft()
        found = np.array([tip_motion(realise(sea, 600.0, s), rao, -15.0, 12.0).deviation(0) ** 2 for s in range(60)])
        assert found.mean() == pytest.approx(
            tip_response(rao, sea, -15.0, 12.0).moment(0), abs=3.0 * found.std() / math.sqrt(60.0)
        )

    def test_exact_rotations_lower_a_high_tip_and_leave_a_low_one_alone(self):
        waves = realise(SEA, 600.0, 1)
        high, low = (tip_motion_exact(waves, raft(), 0.0, 0.0, z) for z in (40.0, 0.0))
        eta = [waves.spread(c) for c in waves.motion(raft())[3:5]]
        sinking = 40.0 * sum(np.sum(np.abs(c) ** 2) / 4.0 for c in eta)  # z (roll^2 + pitch^2)/2 on average
        assert high.amplitudes[0].real == pytest.approx(
            -sinking, rel=0.02
        )  # what the next order of the cosine takes off
        linear = tip_motion(waves, raft(), 0.0, 0.0)
        t = np.linspace(0.0, 600.0, 5000)
        np.testing.assert_allclose(low.sample(t)[0], linear.sample(t)[0], atol=1e-6)

    def test_exact_rotations_are_those_of_the_ship_at_every_moment(self):
        """Against matrices of rotation, roll first and then pitch (bow down positive)."""
        waves, rao = realise(SEA, 120.0, 2), raft()
        x, y, z = -20.0, 15.0, 30.0
        motion = tip_motion_exact(waves, rao, x, y, z)
        heave, roll, pitch = (
            np.array([direct(waves.spread(c), 120.0, np.array([31.4]))]).ravel()[0] for c in waves.motion(rao)[2:5]
        )
        R_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
        R_y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
        height = heave + (R_y @ R_x @ np.array([x, y, z]))[2] - z
        assert motion.sample(31.4)[0] == pytest.approx(height, abs=1e-6)

    @pytest.mark.parametrize(
        ("make", "text"),
        [
            (lambda: realise(SEA, 20.0), "too few to be random"),
            (lambda: realise(SEA, 600.0, -1), "whole number of 0 or more"),
            (lambda: realise(SEA, 600.0, amplitudes="wild"), "not one of fixed, rayleigh"),
            (lambda: realise(SEA, math.inf), "Give the length of the run"),
            (lambda: realise(SEA, 1e7), "longer than 111 h, the most for this sea"),
            (lambda: realise(SEA, 600.0, depth=0.0), "depth 0 m is not more than 0 m"),
            (lambda: regular(-1.0, 8.0, 0.0), "regular wave of -1 m"),
        ],
    )
    def test_what_is_no_realisation_is_refused(self, make, text):
        with pytest.raises(SeaError, match=text):
            make()


class TestDepth:
    def test_crests_of_a_realisation_in_shallow_water_lie_closer(self):
        waves = regular(1.0, 14.0, 0.0)
        shallow = replace(waves, depth=12.0)
        assert np.angle(shallow.elevation(-10.0, 0.0)[0]) > 1.3 * np.angle(waves.elevation(-10.0, 0.0)[0])


def water_at(field, z: float) -> np.ndarray:
    """Vertical speed at a height between levels, by cubics through the four nearest levels."""
    u = math.log(1.0 - z / field.z_0) / field.ds
    j = min(max(int(u), 1), field.w.shape[1] - 3)
    nodes = np.arange(j - 1, j + 3)
    weights = [math.prod((u - b) / (a - b) for b in nodes if b != a) for a in nodes]
    return field.w[:, nodes] @ np.array(weights)


class TestWaveField:
    def waves(self) -> Realisation:
        return realise(SEA, 600.0, 7)

    @pytest.mark.slow
    def test_the_surface_is_that_of_the_waves_and_its_rate_is_the_speed_of_the_water(self):
        waves = self.waves()
        field = wave_field(waves, -20.0, -18.0)
        c = waves.spread(waves.elevation(-20.0, -18.0))
        t = field.dt * np.arange(len(field.eta))
        np.testing.assert_allclose(field.eta, direct(c, 600.0, t), atol=1e-10)
        np.testing.assert_allclose(field.w[:, 0], field.eta_dot, atol=1e-12)
        assert field.duration == pytest.approx(600.0)
        assert field.dt <= 0.1
        assert field.eta[0] == field.eta[-1]

    def test_a_light_raft_and_the_water_at_its_place_move_together(self):
        """The tip over the reference point of a raft is the surface there: coherent to the last digit."""
        waves = self.waves()
        field, motion = wave_field(waves, 0.0, 0.0), tip_motion(waves, raft(), 0.0, 0.0)
        t = field.dt * np.arange(len(field.eta))
        np.testing.assert_allclose(field.eta, motion.sample(t)[0], atol=1e-8)

    def test_acceleration_is_the_rate_of_the_speed_at_every_level(self):
        """Cubic Hermite of speed and acceleration through two samples meets the sample between them."""
        field = wave_field(self.waves(), 0.0, 0.0)
        w, a, h = field.w, field.a, 2.0 * field.dt
        middle = (w[2:] + w[:-2]) / 2.0 + h / 8.0 * (a[:-2] - a[2:])
        assert np.abs(middle - w[1:-1]).max() < 16.0 * CUBIC * w[:, 0].std()  # twice the spacing: 2^4 times the error

    def test_between_levels_cubics_find_the_motion_of_a_regular_wave(self):
        for period, within in ((12.0, CUBIC), (6.0, CUBIC), (4.0, CUBIC), (2.0, 2e-3)):
            waves = regular(1.0, period, HEAD, cycles=20)
            field, k = wave_field(waves, 0.0, 0.0), float(waves.wave_number[0])
            speed = 2.0 * math.pi / period
            for z in (-0.3, -1.7, -5.2, -13.0, -31.0):
                if z > -field.z_0 * math.expm1(field.ds * (field.w.shape[1] - 3)):
                    found = np.abs(water_at(field, z)).max()
                    assert found == pytest.approx(speed * math.exp(k * z), abs=within * speed), (period, z)

    def test_every_seed_of_a_sea_has_the_same_levels(self):
        sea = Sea((Train(Jonswap(2.0, 8.0, 3.3), HEAD, 4.0),))
        fields = [wave_field(realise(sea, 120.0, seed, amplitudes="rayleigh"), 0.0, 0.0) for seed in range(12)]
        assert len({(field.dt, field.w.shape) for field in fields}) == 1

    def test_the_lowest_level_stands_and_the_one_above_hardly_moves(self):
        field = wave_field(self.waves(), 0.0, 0.0)
        assert not field.w[:, -1].any()
        assert not field.a[:, -1].any()
        assert field.w[:, -2].std() < 3e-3 * field.w[:, 0].std()

    def test_at_the_bed_nothing_moves_up_or_down_and_above_it_the_water_is_faster_than_deep_water(self):
        waves = regular(1.0, 10.0, HEAD, cycles=10)
        shallow = replace(waves, depth=15.0)
        field = wave_field(shallow, 0.0, 0.0)
        z = -field.z_0 * np.expm1(field.ds * np.arange(field.w.shape[1]))
        k = float(shallow.wave_number[0])
        for j in np.flatnonzero(z > -15.0):
            expected = 2.0 * math.pi / 10.0 * math.sinh(k * (z[j] + 15.0)) / math.sinh(k * 15.0)
            assert np.abs(field.w[:, j]).max() == pytest.approx(
                expected, rel=2e-3, abs=1e-12
            )  # samples miss the crest by 1e-3
        assert not field.w[:, z <= -15.0].any()

    def test_two_places_along_the_waves_see_the_same_water_one_after_the_other(self):
        waves = regular(1.0, 10.0, 0.0, cycles=10)
        k = float(waves.wave_number[0])
        here, there = (wave_field(waves, x, 0.0).eta for x in (0.0, 0.1 * (2.0 * math.pi / k)))
        shift = round(1.0 / 0.1)
        np.testing.assert_allclose(there[shift:], here[:-shift], atol=1e-9)
