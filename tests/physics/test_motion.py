"""Motions of the crane tip: height, velocity and acceleration belong together, and records keep what the sea did."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson
from scipy.spatial.transform import Rotation

from stillhook.errors import MotionError
from stillhook.sea.motion.motion import Motion, Profile, Ramped, Sine, Still, Sum
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.ship_motion import mean_zero_crossing_period, tip_height

# A sea of 0.84 m standard deviation, nothing shorter than 5 s: what a 1 Hz log of a ship holds.
PERIODS = np.array([5.0, 6.0, 7.0, 8.5, 9.6, 11.0, 13.0, 15.0])
AMPLITUDES = np.array([0.1, 0.15, 0.3, 0.5, 0.7, 0.6, 0.4, 0.2])

# Integrals by Simpson's rule at 2 ms: where a ramp ends, acceleration has a kink, which costs dt^2 times its size.
INTEGRATED = 1e-5

sines = st.builds(Sine.from_si, st.floats(0.0, 5.0), st.floats(2.0, 30.0), st.floats(-7.0, 7.0))
profiles = st.lists(st.tuples(st.floats(0.5, 20.0), st.floats(-2.0, 2.0)), min_size=1, max_size=6).map(
    lambda steps: Profile.from_si(
        [0.0, *np.cumsum([step for step, _ in steps]), 200.0], [0.0, *(v for _, v in steps), 0.0]
    )
)
smooth = st.one_of(
    sines,
    st.lists(sines, min_size=1, max_size=4).map(Sum),
    st.builds(Ramped.from_si, sines, st.floats(1.0, 20.0)),
    st.just(Still()),
)


def sea(seed: int) -> Sum:
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(PERIODS))
    return Sum(Sine.from_si(a, T, p) for a, T, p in zip(AMPLITUDES, PERIODS, phases, strict=True))


def worst(found: tuple[np.ndarray, ...], true: tuple[np.ndarray, ...], where: np.ndarray | None = None) -> list[float]:
    keep = slice(None) if where is None else where
    return [float(np.abs(x - y)[keep].max()) for x, y in zip(found, true, strict=True)]


@pytest.mark.slow
@given(smooth)
def test_velocity_and_acceleration_are_the_derivatives_of_height(motion: Motion) -> None:
    t = np.arange(0.0, 40.0, 0.002)
    s, v, a = motion.sample(t)
    assert np.abs(cumulative_simpson(v, x=t, initial=0.0) + s[0] - s).max() < INTEGRATED * (1.0 + np.abs(v).max())
    assert np.abs(cumulative_simpson(a, x=t, initial=0.0) + v[0] - v).max() < INTEGRATED * (1.0 + np.abs(a).max())


@pytest.mark.slow
@given(profiles, st.lists(st.floats(0.0, 250.0), min_size=1, max_size=20))
def test_the_height_of_a_profile_is_the_area_under_its_velocity(profile: Profile, times: list[float]) -> None:
    for t in times:
        knots = np.unique([0.0, *(x for x in profile.t if x < t), t])
        v = profile.sample(knots)[1]
        area = float(np.sum(np.diff(knots) * (v[1:] + v[:-1]) / 2.0))
        assert profile.sample(t)[0] == pytest.approx(area, abs=1e-9)


def test_a_profile_accelerates_steadily_between_points_and_rests_after_the_last() -> None:
    up = Profile(points=[("0 s", "0 m/min"), ("2 s", "60 m/min"), ("4 s", "60 m/min"), ("8 s", "0 m/min")])
    s, v, a = up.sample([-1.0, 0.0, 1.0, 2.0, 3.0, 6.0, 8.0, 100.0])
    assert np.allclose(a, [0.0, 0.5, 0.5, 0.0, 0.0, -0.25, 0.0, 0.0])
    assert np.allclose(v, [0.0, 0.0, 0.5, 1.0, 1.0, 0.5, 0.0, 0.0])
    assert np.allclose(s, [0.0, 0.0, 0.25, 1.0, 2.0, 4.5, 5.0, 5.0])
    assert up.duration is None


def test_a_sine_has_its_amplitude_speed_and_phase() -> None:
    s, v, a = Sine(amplitude="2.8 m", period="12 s", phase="-90 deg").sample(np.array([0.0, 3.0, 6.0]))
    assert np.allclose(s, [-2.8, 0.0, 2.8])
    assert np.allclose(v, [0.0, 2.8 * 2 * np.pi / 12, 0.0])
    assert np.allclose(a, [2.8 * (2 * np.pi / 12) ** 2, 0.0, -2.8 * (2 * np.pi / 12) ** 2])


@pytest.mark.slow
@given(sines, st.floats(1.0, 30.0))
def test_a_ramp_starts_at_rest_and_ends_as_the_motion(motion: Sine, t_ramp: float) -> None:
    ramped = Ramped.from_si(motion, t_ramp)
    assert [float(x) for x in ramped.sample(0.0)] == [0.0, 0.0, 0.0]
    t = np.linspace(t_ramp, t_ramp + 50.0, 100)
    assert max(worst(ramped.sample(t), motion.sample(t))) < 1e-9


@pytest.mark.slow
def test_one_hertz_samples_hold_a_sea_of_five_seconds_and_longer() -> None:
    # The bounds that the docstring of Recorded states, in m, m/s, m/s^2, over twenty seas.
    for seed in range(20):
        motion, t, fine = sea(seed), np.arange(0.0, 200.5), np.arange(0.0, 200.0, 0.01)
        record = Recorded(t, motion.sample(t)[0])
        inside = (fine >= 5.0) & (fine <= 195.0)
        errors = worst(record.sample(fine), motion.sample(fine), inside)
        assert np.all(np.array(errors) < [0.2e-3, 0.5e-3, 2e-3]), errors
        ends = worst(record.sample(fine), motion.sample(fine), ~inside)
        assert np.all(np.array(ends) < [0.01, 0.08, 0.4]), ends


@pytest.mark.parametrize(("period", "height", "acceleration"), [(3.0, 0.03, 0.08), (4.0, 0.0025, 0.015)])
def test_waves_near_the_sampling_limit_come_out_as_wrong_as_stated(
    period: float, height: float, acceleration: float
) -> None:
    motion, t, fine = Sine.from_si(1.0, period), np.arange(0.0, 200.5), np.arange(15.0, 185.0, 0.01)
    s, _, a = worst(Recorded(t, motion.sample(t)[0]).sample(fine), motion.sample(fine))
    assert height / 2 < s < height
    assert acceleration / 2 < a / (2 * np.pi / period) ** 2 < acceleration


def test_rounding_to_a_centimetre_costs_little_at_one_hertz() -> None:
    motion, t, fine = sea(3), np.arange(0.0, 200.5), np.arange(10.0, 190.0, 0.01)
    record = Recorded(t, np.round(motion.sample(t)[0], 2))
    assert np.all(np.array(worst(record.sample(fine), motion.sample(fine))) < [8e-3, 16e-3, 45e-3])


@pytest.mark.parametrize("rate", [10.0, 50.0])
def test_fast_logs_are_thinned_so_that_rounding_is_no_acceleration(rate: float) -> None:
    motion, t = sea(4), np.arange(0.0, 120.0, 1.0 / rate)
    record = Recorded(t, np.round(motion.sample(t)[0], 2))
    fine = np.arange(10.0, 110.0, 0.01)
    assert worst(record.sample(fine), motion.sample(fine))[2] > 2.0, "the test needs a log that swings by its rounding"
    thinned = record.thinned()
    errors = worst(thinned.sample(fine), motion.sample(fine))
    assert np.all(np.array(errors) < [5e-3, 15e-3, 70e-3]), errors
    assert worst(thinned.sample(t), motion.sample(t))[2] < 0.3
    assert thinned.duration == record.duration


def test_thinning_passes_the_sea_unchanged_and_without_delay() -> None:
    t, fine = np.arange(0.0, 120.0, 0.1), np.arange(10.0, 110.0, 0.01)
    for period, share in ((2.0, 1.5e-3), (3.0, 1e-4), (5.0, 3e-6)):
        motion = Sine.from_si(1.0, period)
        assert worst(Recorded(t, motion.sample(t)[0]).thinned().sample(fine), motion.sample(fine))[0] < share


def test_thinning_bridges_a_gap() -> None:
    motion, t, fine = sea(5), np.arange(0.0, 120.0, 0.1), np.arange(10.0, 110.0, 0.01)
    kept = t[(t <= 60.0) | (t >= 63.0)]
    thinned = Recorded(kept, np.round(motion.sample(kept)[0], 2)).thinned()
    assert worst(thinned.sample(fine), motion.sample(fine))[0] < 0.1
    away = (fine < 55.0) | (fine > 68.0)
    assert worst(thinned.sample(fine), motion.sample(fine), away)[0] < 8e-3


def test_thinning_refuses_a_log_that_is_not_faster() -> None:
    with pytest.raises(MotionError, match=r"a point every 0.5 s is not possible with 59 s of samples every 1 s"):
        Recorded(np.arange(60.0), np.sin(np.arange(60.0))).thinned("0.5 s")


def test_a_record_passes_through_its_points_and_starts_at_time_zero() -> None:
    t, s = np.array([10.0, 11.0, 12.5, 13.0, 14.0, 15.5, 16.0]), np.array([0.0, 1.0, 0.5, 0.2, -1.0, 0.0, 0.3])
    record = Recorded(t, s)
    assert record.duration == 6.0
    assert np.allclose(record.sample(t - 10.0)[0], s)
    assert [record.sample(x)[0] for x in (0.0, 6.0)] == pytest.approx([0.0, 0.3])


@pytest.mark.parametrize("t", [-0.001, 6.001, np.nan])
def test_a_record_is_silent_outside_its_time(t: float) -> None:
    record = Recorded(np.arange(7.0), np.arange(7.0), source="a.csv")
    with pytest.raises(MotionError, match=r"a.csv: no motion at t = .* s: the record runs from 0 s to 6 s"):
        record.sample([1.0, t])


def test_the_mean_is_kept_unless_asked_away() -> None:
    t = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 8.0])
    record = Recorded(t, np.full(6, 2.0) + np.sin(t))
    assert record.heights[0] == 2.0
    level = record.about_mean()
    assert level.mean == pytest.approx(0.0, abs=1e-12)
    assert "removed" in level.report


@pytest.mark.parametrize(
    ("times", "heights", "says"),
    [
        (np.arange(5.0), np.zeros(5), "5 points. A recorded motion needs 6 or more."),
        (np.arange(6.0), np.zeros(7), "6 times but 7 heights"),
        ([0, 1, 2, 2, 3, 4], np.zeros(6), "point 4 at 2.000000 s does not come after 2.000000 s"),
        ([0, 1, 2, 3, 4, np.nan], np.zeros(6), "point 6 .* is not finite"),
        (np.arange(6.0), [0, 1, np.inf, 0, 0, 0], "point 3 .* is not finite"),
        (np.zeros((2, 6)), np.zeros((2, 6)), "times have 2 dimensions"),
        (["a"] * 6, np.zeros(6), "times are not numbers"),
        ([0, 1, 2, 3, 4, 4 + 1e-300], np.zeros(6), "does not come after"),
    ],
)
def test_bad_records_are_refused_in_one_line(times: object, heights: object, says: str) -> None:
    with pytest.raises(MotionError, match=says) as caught:
        Recorded(times, heights)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_records_are_equal_by_content_and_cannot_be_changed() -> None:
    t, s = np.arange(10.0), np.sin(np.arange(10.0))
    first, second = Recorded(t, s, source="x"), Recorded(t.copy(), s.copy(), source="x")
    assert first == second
    assert hash(first) == hash(second)
    assert first != Recorded(t, s + 1e-12, source="x")
    assert pickle.loads(pickle.dumps(first)) == first
    s[0] = 99.0
    assert first.heights[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        first.heights[0] = 1.0
    with pytest.raises(AttributeError):
        first.source = "y"  # type: ignore[misc]


def test_a_sum_lasts_as_long_as_its_shortest_record() -> None:
    short, long = (Recorded(np.arange(n), np.sin(np.arange(n))) for n in (10.0, 20.0))
    both = short + long + Sine(height="2 m", period="12 s")
    assert both.duration == 9.0
    assert isinstance(both, Sum)
    assert len(both.terms) == 3
    assert np.allclose(both.sample(3.0)[0], short.sample(3.0)[0] + long.sample(3.0)[0] + 1.0)


angles = st.floats(-0.7, 0.7)
lengths = st.floats(-100.0, 100.0)


@pytest.mark.slow
@given(angles, angles, st.floats(-np.pi, np.pi), lengths, lengths, lengths, st.floats(-10.0, 10.0))
def test_the_tip_moves_as_the_rotation_matrix_says(
    roll: float, pitch: float, heading: float, x: float, y: float, z: float, heave: float
) -> None:
    # Right-handed axes x forward, y to port, z up: port up is right-handed about x, bow up left-handed about y.
    lever = np.array([x, y, z])
    turned = Rotation.from_euler("xyz", [roll, -pitch, heading]).apply(lever)
    assert float(tip_height(heave, roll, pitch, x, y, z)) == pytest.approx(heave + turned[2] - z, abs=1e-9)  # type: ignore[arg-type]


@pytest.mark.slow
@given(st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3), lengths, lengths, lengths)
def test_small_angles_give_the_formula_of_wave_loads(roll: float, pitch: float, x: float, y: float, z: float) -> None:
    eta_4, eta_5 = roll, -pitch
    linear = 1.5 + y * eta_4 - x * eta_5
    second_order = (abs(x) + abs(y) + abs(z)) * 1e-6 + 1e-12
    assert float(tip_height(1.5, roll, pitch, x, y, z)) == pytest.approx(linear, abs=second_order)  # type: ignore[arg-type]


def test_bow_up_lifts_the_bow_and_port_up_lifts_port() -> None:
    up = np.radians(5.0)
    assert tip_height(0.0, 0.0, up, 40.0, 0.0, 0.0) > 3.0  # type: ignore[arg-type]
    assert tip_height(0.0, up, 0.0, 0.0, 12.0, 0.0) > 1.0  # type: ignore[arg-type]
    assert tip_height(0.0, up, 0.0, 0.0, 0.0, 30.0) < 0.0  # type: ignore[arg-type]


def test_the_mean_period_of_a_sine_is_its_period() -> None:
    t = np.arange(0.0, 300.0)
    assert mean_zero_crossing_period(t, Sine.from_si(1.0, 9.6).sample(t)[0]) == pytest.approx(9.6, rel=1e-3)
    assert mean_zero_crossing_period(t, t) is None
