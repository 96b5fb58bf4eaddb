"""The frequency-domain method: rules of linear systems, drag by numerical averaging, and seas that are missing or calm."""

import math

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.errors import LiftError, SeaError
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import read_payload, vessel_file
from stillhook.response.forcing import Forcing, forcing_of_seas, forcing_of_series
from stillhook.response.frequency_domain import frequency_response, sigmas
from stillhook.response.suspended_load import End, Rod, SuspendedLoad, drag_of_gaussian, suspended_load, transfers
from stillhook.response.winch.linear_form import Residual
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.tip import tip_response
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase

X, Y = -20.0, 18.0  # m
BRAKED = Residual.constant(1.0)
LINEAR = SuspendedLoad(
    rod=Rod(L=3000.0, EA=836e6, mu=36.0, beta=0.02), end=End(m=100e3, A33=50e3), s_w=3000.0, F_top=2.0e6, F_sling=0.9e6
)


@pytest.fixture(scope="module")
def vessel():
    return read_vessel(vessel_file("construction-vessel-130m"))


def sea(H_s=1.0, T_p=8.0, beta=math.pi, spread=None):
    return Sea((Train(Jonswap(H_s, T_p, 2.0), beta, spread),))


def lift(payload="manifold-60t", depth="3000 m"):
    programme = (Phase(mode="ahc", time="60 s"),)
    return Lowering(
        payload=read_payload(payload),
        h_tip="30 m",
        depth=depth,
        start_depth="-5 m",
        programme=programme,
        duration="60 s",
    )


@pytest.mark.slow
def test_linear_drag_takes_the_power_of_the_square_law_out_of_a_sine_and_of_noise():
    B, v = 3e4, 0.7
    wave = v * np.cos(2.0 * np.pi * (np.arange(100_000) + 0.5) / 100_000)
    noise = v * np.random.default_rng(2).standard_normal(4_000_000)
    for speed, drag in ((wave, 8.0 / (3.0 * np.pi) * B * v), (noise, drag_of_gaussian(B, v))):
        assert drag * np.mean(speed**2) == pytest.approx(
            np.mean(B * np.abs(speed) ** 3), rel=3e-3
        )  # scatter of the noise


def test_without_drag_everything_is_proportional_to_the_sea(vessel):
    f = forcing_of_seas([sea(1.0), sea(2.5)], vessel, X, Y)
    s = sigmas(f, LINEAR, BRAKED)
    for name in ("u", "load", "top", "sling"):
        one, more = getattr(s, name)
        assert more == pytest.approx(2.5 * one, rel=1e-9), name


def test_a_compensation_of_four_fifths_leaves_a_fifth_at_the_wire_and_more_at_a_load_that_resonates(vessel):
    f = forcing_of_seas(sea(1.5, 8.0), vessel, X, Y)
    run = frequency_response(f, LINEAR, Residual.constant(0.2))
    gain = np.abs(transfers(f.omega, LINEAR.rod, LINEAR.end).load_u)
    direct = 0.2 * math.sqrt(float(np.sum(gain**2 * f.tip[0])))
    assert run["eta_sigma_wire"].item() == pytest.approx(0.8, rel=1e-9)
    assert run["sigma_load"].item() == pytest.approx(direct, rel=1e-9)
    assert run["eta_sigma_load"].item() < 0.8
    assert run["sigma_load_braked"].item() == pytest.approx(5.0 * direct, rel=1e-9)


def test_drag_agrees_with_the_speed_that_it_leaves(vessel):
    h = suspended_load(load_crane("deep-250t"), lift(), -1500.0)
    f = forcing_of_seas([sea(H, T) for H in (0.5, 2.0, 4.0) for T in (6.0, 9.0)], vessel, X, Y)
    s = sigmas(f, h, BRAKED)
    assert s.drag == pytest.approx(drag_of_gaussian(h.B, s.relative), rel=5e-3)  # between the speeds of the table


def test_more_drag_leaves_less_motion_at_resonance(vessel):
    h = suspended_load(load_crane("deep-250t"), lift(), -1500.0)
    f = forcing_of_seas(sea(2.0, 6.0), vessel, X, Y)
    loads = [sigmas(f, SuspendedLoad(**{**vars(h), "B": part * h.B}), BRAKED).load[0] for part in (0.0, 0.3, 1.0, 3.0)]
    assert (np.diff(loads) < 0.0).all()


def test_deep_water_around_the_load_stands_still(vessel):
    f = forcing_of_seas(sea(2.0, 9.0, math.pi / 2.0), vessel, X, Y)
    h = suspended_load(load_crane("deep-250t"), lift(), -1500.0)
    calm = Forcing(f.omega, f.width, f.tip, 0.0 * f.wave, 0.0 * f.cross)
    assert np.array(sigmas(f, h, BRAKED)) == pytest.approx(np.array(sigmas(calm, h, BRAKED)), rel=1e-6)


def test_a_load_that_the_tip_holds_still_is_moved_by_the_water_alone(vessel):
    h = suspended_load(load_crane("deep-250t"), lift(), -25.0)
    f = forcing_of_seas(sea(2.0, 10.0), vessel, X, Y)
    still = sigmas(f, h, Residual.constant(0.0))
    assert still.u[0] == 0.0
    assert 0.0 < still.load[0] < 0.2 * sigmas(f, h, BRAKED).load[0] + 0.02
    assert still.sling[0] > 0.0


def test_a_tip_that_rides_on_the_wave_moves_a_light_short_load_with_it():
    omega = np.linspace(0.3, 1.2, 91)
    wave = np.full((1, 91), 1e-3)
    f = Forcing(omega, np.full(91, 0.01), wave, wave, wave + 0j)
    s = sigmas(f, SuspendedLoad(Rod(L=30.0, EA=8e8, mu=0.0), End(m=2e3), s_w=30.0, F_top=2e4, F_sling=2e4), BRAKED)
    assert s.load[0] == pytest.approx(f.deviation()[0], rel=1e-4)


@pytest.fixture(scope="module")
def series():
    omega = np.arange(0.2, 2.5, 0.06)
    S = np.array([Jonswap(H, T, 2.0).density(omega) for H, T in ((1.0, 7.0), (2.0, 9.0), (3.0, 12.0), (1.0, 8.0))])
    S[1], S[2] = np.nan, 0.0
    hours = np.datetime64("2026-01-01T00:00") + np.arange(4) * np.timedelta64(1, "h")
    return SpectrumSeries(omega, np.full(len(omega), 0.06), S, hours, np.array([True, False, True, True]))


def test_a_missing_record_stays_missing_and_in_a_calm_one_nothing_moves(series, vessel):
    run = frequency_response(forcing_of_series(series, vessel, X, Y, math.pi), LINEAR, Residual.constant(0.2))
    for name in run:
        assert np.isnan(run[name].values[1]), name
        assert np.isfinite(run[name].values[[0, 3]]).all(), name
    assert run["sigma_load"].values[2] == 0.0
    assert run["F_top_mpm"].values[2] == LINEAR.F_top


def test_a_record_by_itself_comes_out_as_among_others(series, vessel):
    alone = SpectrumSeries(series.omega, series.width, series.S[3:], series.time[3:], series.valid[3:])
    a, b = (
        frequency_response(forcing_of_series(each, vessel, X, Y, 2.0), LINEAR, Residual.constant(0.3))
        for each in (series, alone)
    )
    for name in a:
        assert a[name].values[3] == pytest.approx(b[name].values[0], rel=1e-9, nan_ok=True), name


def test_every_record_may_have_its_own_heading(series, vessel):
    headings = np.array([0.5, 1.0, 1.5, 4.0])
    mixed = forcing_of_series(series, vessel, X, Y, headings).deviation(1)
    for i in (0, 3):
        assert mixed[i] == pytest.approx(forcing_of_series(series, vessel, X, Y, headings[i]).deviation(1)[i], rel=1e-9)
    with pytest.raises(SeaError, match="3 headings for 4 records"):
        forcing_of_series(series, vessel, X, Y, headings[:3])


def test_on_shallow_water_the_wave_comes_later_to_a_load_beside_the_ship(vessel):
    deep, shallow = (forcing_of_seas(sea(1.0, 12.0, math.pi / 2.0), vessel, X, Y, depth=d) for d in (math.inf, 20.0))
    assert shallow.tip == pytest.approx(deep.tip)  # the vessel's motions are those of its file
    i = int(np.argmax(deep.wave[0]))
    k_0 = k = deep.omega[i] ** 2 / 9.80665
    for _ in range(200):  # omega^2 = g k tanh(k 20 m)
        k = 0.5 * (k + k_0 / np.tanh(20.0 * k))
    turned = np.angle(shallow.cross[0, i] / deep.cross[0, i])
    assert turned == pytest.approx((k - k_0) * Y, rel=1e-6)


@pytest.mark.parametrize("spread", [None, 4.0])
def test_tip_is_that_of_the_tip_statistics(vessel, spread):
    waves = sea(2.0, 9.0, 2.2, spread)
    f, response = forcing_of_seas(waves, vessel, X, Y), tip_response(vessel, waves, X, Y)
    assert f.deviation()[0] == pytest.approx(response.sigma_z, rel=3e-3)  # other grids of frequencies
    assert f.deviation(1)[0] == pytest.approx(response.sigma_v, rel=5e-3)


def test_a_payload_in_the_surface_or_below_the_seabed_is_refused_in_one_line():
    crane = load_crane("deep-250t")
    with pytest.raises(
        LiftError, match='payload "manifold-60t": with its underside 2 m under water it pierces the surface'
    ):
        suspended_load(crane, lift(), -2.0)
    with pytest.raises(LiftError, match="z -400 m is below the seabed at 300 m"):
        suspended_load(crane, lift(depth="300 m"), -400.0)
    with pytest.raises(LiftError, match="hook and rigging do not fit under the crane tip"):
        suspended_load(crane, lift(), 25.0)


def test_no_duration_is_refused(vessel):
    with pytest.raises(LiftError, match="duration 0 s must be longer than 0 s"):
        frequency_response(forcing_of_seas(sea(), vessel, X, Y), LINEAR, BRAKED, duration=0.0)
