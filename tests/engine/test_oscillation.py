"""An oscillation that the tip does not explain is named with its period and size, and nothing else is."""

import math
from typing import Any

import numpy as np
import pytest
from tests.engine.test_lowering import box

from stillhook import Crane, Scenario, Sine, load_crane, simulate
from stillhook.kernels import oscillation
from stillhook.kernels.oscillation import (
    Oscillation,
    begun_again,
    blank_oscillation,
    fold_period,
    fold_watched,
    joined,
)
from stillhook.library import changed
from stillhook.sea.motion.motion import Motion, Profile
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase

DT = 0.01
PERIOD = 0.02
"""Of the period that is found: one sample of a period of half a second."""
SIZE = 0.05
"""Of the size: what the filter takes off is put on again, in the mean of the corner."""
SPECTRUM = 0.1
"""Of the period against the highest line of a spectrum over 30 s."""


def watched(error: np.ndarray, v_tip: np.ndarray, a_tip: np.ndarray, F: np.ndarray, dt: float = DT) -> Oscillation:
    """What is found in an error of speed over a motion of the tip."""
    found = blank_oscillation()
    for e, v, a, f in zip(error.tolist(), v_tip.tolist(), a_tip.tolist(), F.tolist(), strict=True):
        found = found._replace(watched=fold_watched(found.watched, dt, e - v, v, a, v, f))
        if found.watched.up > 0.0:
            found = fold_period(found)
    return found


def sea(t: np.ndarray, period: float = 12.0, speed: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    w = 2.0 * math.pi / period
    return speed * np.cos(w * t), -speed * w * np.sin(w * t)


T = np.arange(0.0, 120.0, DT)
STILL = (np.zeros_like(T), np.zeros_like(T))
EVEN = (np.full_like(T, 0.03), np.zeros_like(T))


def swing(period: float, size: float) -> np.ndarray:
    return 0.5 * size * np.sin(2.0 * math.pi * T / period)


@pytest.mark.parametrize(("motion", "longest"), [(STILL, 12.0), (EVEN, 12.0), (sea(T), 2.5), (sea(T, 8.0), 1.7)])
@pytest.mark.parametrize("period", [0.2, 0.5, 1.1, 2.3, 7.0])
def test_an_oscillation_is_found_with_its_period_and_size(motion, longest, period):
    found = watched(swing(period, 0.05), *motion, 5e4 * np.sin(2.0 * math.pi * T / period)).largest
    if period > longest:
        assert found.time == 0.0
        return
    assert found.period == pytest.approx(period, rel=PERIOD, abs=DT)
    assert found.v_w == pytest.approx(0.05, rel=SIZE)
    assert found.F_w == pytest.approx(1e5, rel=SIZE)
    assert 60.0 < found.time <= 120.0


def test_one_that_grows_out_of_nothing_is_found():
    grown = 1e-4 * np.exp(T / 12.0) * np.sin(2.0 * math.pi * T / 0.83)
    found = watched(grown, *sea(T), np.zeros_like(T)).largest
    assert found.period == pytest.approx(0.83, rel=PERIOD)
    assert 0.0 < found.time < 80.0


def test_one_of_double_period_is_found_where_the_tip_moves_evenly():
    found = watched(swing(0.7, 0.04) * (1.0 + 0.6 * np.sign(np.sin(math.pi * T / 0.7))), *EVEN, np.zeros_like(T))
    assert found.largest.time > 60.0


@pytest.mark.parametrize("zeta", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("period", [0.45, 1.1, 1.5])
def test_what_every_reversal_kicks_off_and_rings_down_is_none(zeta, period):
    """Friction turns its sign twice a period of the tip."""
    w = 2.0 * math.pi / period
    since = np.mod(T - 3.0, 6.0)
    ring = 0.05 * np.exp(-zeta * w * since) * np.sin(w * since) * np.where(np.mod(T - 3.0, 12.0) < 6.0, 1.0, -1.0)
    assert watched(ring, *sea(T), np.zeros_like(T)).largest.time == 0.0


@pytest.mark.parametrize("zeta", [0.005, 0.02])
def test_a_ring_down_is_none(zeta):
    ring = np.exp(-zeta * 2.0 * math.pi / 0.6 * T) * swing(0.6, 0.5)
    assert watched(ring, *EVEN, np.zeros_like(T)).largest.time == 0.0


@pytest.mark.parametrize("harmonic", [5, 7, 11])
def test_harmonics_of_the_tip_are_none(harmonic):
    assert watched(swing(12.0 / harmonic, 0.05), *sea(T), np.zeros_like(T)).largest.time == 0.0


def test_what_the_tip_does_itself_is_none():
    """A ripple of the tip that the wire does not follow."""
    v, a = sea(T)
    ripple = swing(0.8, 0.05)
    assert watched(ripple, v + ripple, a, np.zeros_like(T)).largest.time == 0.0


def test_micro_ripple_and_noise_are_none():
    assert watched(swing(0.5, 0.9 * oscillation.SMALLEST), *STILL, np.zeros_like(T)).largest.time == 0.0
    noise = np.random.default_rng(1).normal(0.0, 0.02, len(T))
    assert watched(noise, *sea(T), np.zeros_like(T)).largest.time == 0.0


def test_parts_of_a_run_join_to_their_time_and_the_largest():
    parts = [watched(swing(0.5, size), *EVEN, np.zeros_like(T)) for size in (0.03, 0.06, 0.04)]
    whole = joined(parts).largest
    assert whole.time == pytest.approx(sum(p.largest.time for p in parts))
    assert whole.v_w == parts[1].largest.v_w
    assert begun_again(parts[0]).largest.time == 0.0


def even(speed: str = "2 m/min", time: str = "200 s") -> Motion:
    return Profile([("0 s", "0 m/s"), ("4 s", speed), (time, speed), ("300 s", "0 m/s")])


FIRST = {
    "nov-250t-secondary": {"secondary": {"drive": {"K": "15 1/s"}}, "control": {"tau_F": "0.5 s"}},
    "utility-20t-open-circuit": {"open": {"drive": {"share": 0.9}}},
}
"""Settings of the drives with which the first files oscillated."""


def with_gain(name: str, times: float) -> Crane:
    crane = changed(load_crane(name), FIRST.get(name, {}))
    return crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": times * crane.control.K_p})})


def case(crane: Crane, tip: Motion, **more: Any) -> Scenario:
    fields = {"s_w": "100 m", "duration": "60 s", "warm_up": "10 s"} | more
    return Scenario(load=f"{crane.SWL!r} kg", tip=tip, **fields)


@pytest.mark.parametrize("name", ["nov-250t-secondary", "utility-20t-open-circuit", "nov-100t-cylinder"])
def test_a_gain_above_the_limit_is_an_oscillation_as_a_spectrum_has_it(name):
    """Three times the first files' gains, which were above the limit; the series knows nothing of the statistics."""
    gain = {"nov-250t-secondary": 3.0, "utility-20t-open-circuit": 6.0, "nov-100t-cylinder": 1.2}[name]
    crane = load_crane(name)
    crane = with_gain(name, gain / crane.control.K_p)
    run = simulate(crane, case(crane, even()), every="10 ms")
    late = run.sel(time=slice(30.0, 60.0))
    v = late["v_w"].values - late["v_w"].values.mean()
    line = np.abs(np.fft.rfft(v * np.hanning(len(v))))
    highest = float(late["time"][-1] - late["time"][0]) / int(np.argmax(line))
    assert "oscillates" in run["status"].item()
    assert run["oscillation_period"].item() == pytest.approx(highest, rel=SPECTRUM)
    assert 0.5 * np.ptp(v) < run["oscillation_v_w"].item() < 1.3 * np.ptp(v)
    assert 0.5 * np.ptp(late["F_w"].values) < run["oscillation_F_w"].item() < 1.5 * np.ptp(late["F_w"].values)
    assert 30.0 < run["oscillation_time"].item() <= 50.0
    assert "K_p" in run["notes"].item()
    assert "oscillates for" in run["notes"].item()


@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-electric", "nov-250t-secondary", "nov-100t-cylinder"])
def test_a_tenth_of_the_gain_in_waves_is_none(name):
    crane = with_gain(name, 0.1)
    for tip in (Sine(height="1 m", period="12 s"), Sine(height="0.3 m", period="6 s")):
        run = simulate(crane, case(crane, tip, duration="120 s", warm_up="20 s"), every="1 s")
        assert "oscillates" not in run["status"].item()
        assert run["oscillation_time"].item() == 0.0
        assert math.isnan(run["oscillation_period"].item())


def test_an_unstable_gain_is_found_in_waves():
    crane = load_crane("nov-250t-secondary")
    crane = with_gain("nov-250t-secondary", 3.0 / crane.control.K_p)
    run = simulate(crane, case(crane, Sine(height="1 m", period="12 s"), duration="120 s", warm_up="20 s"), every="1 s")
    assert "oscillates" in run["status"].item()
    assert run["oscillation_period"].item() < 3.0


def test_statistics_alone_side_by_side_find_what_the_series_has():
    crane = load_crane("nov-250t-secondary")
    crane = with_gain("nov-250t-secondary", 3.0 / crane.control.K_p)
    tips = (even(), even("-2 m/min"), Sine(height="0.5 m", period="10 s"))
    many = simulate(crane, [case(crane, tip) for tip in tips], step="5 ms")
    for i, tip in enumerate(tips):
        one = simulate(crane, case(crane, tip), step="5 ms")
        for name in ("oscillation_time", "oscillation_period", "oscillation_v_w", "oscillation_F_w"):
            np.testing.assert_array_equal(one[name].item(), many[name].values[i])


@pytest.mark.slow
def test_a_lowering_says_in_which_phase_it_oscillates():
    crane = load_crane("nov-250t-secondary")
    crane = with_gain("nov-250t-secondary", 3.0 / crane.control.K_p)
    lift = Lowering(
        payload=box("200 t"),
        tip=even("2 m/min"),
        h_tip="40 m",
        depth="500 m",
        start_depth="-20 m",
        controller=crane.plant.type.default_mode,
        programme=(Phase(mode="manual", time="20 s"), Phase(mode="ahc", time="60 s")),
        duration="85 s",
        ramp="0 s",
    )
    run = simulate(crane, lift)
    assert "oscillates" in run["status"].item()
    times = run["phase_oscillation_time"].values
    assert times[0] == 0.0
    assert 20.0 < times[1] <= 61.0
    assert run["oscillation_time"].item() == pytest.approx(np.nansum(times))
    rare = simulate(crane, [lift], sampling="20 ms")
    assert rare["oscillation_period"].values[0] == pytest.approx(run["oscillation_period"].item(), rel=PERIOD)
