"""The residual of a winch: rules that hold for any describing function, and what the twin does."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf
from tests.engine.damage import damaged

from stillhook import Scenario, load_crane, simulate
from stillhook.base.kept import checked
from stillhook.engine.pack.winch import plant_parameters
from stillhook.errors import LiftError
from stillhook.response.winch import identify as module
from stillhook.response.winch.duty import FINE, QUICK, Duty, soft
from stillhook.response.winch.identify import identify_residual
from stillhook.response.winch.linear_form import HARMONICS, Residual
from stillhook.spec.scenario import Sensors

pytestmark = pytest.mark.slow

OMEGA = np.array([0.4, 0.8, 1.6])
V = np.geomspace(0.005, 5.0, 80)


def of(C):
    """A residual with C over amplitude (80,), the same at every frequency."""
    table = np.repeat(np.asarray(C, dtype=complex)[None, :], len(OMEGA), axis=0)
    return Residual(OMEGA, V, table, np.zeros((len(HARMONICS), *table.shape)), np.zeros(table.shape))


def test_a_constant_residual_is_the_same_for_sines_and_irregular_motions():
    half = Residual.constant(0.2 - 0.1j)
    assert half.at([0.3, 3.0], [0.01, 30.0]) == pytest.approx(0.2 - 0.1j)
    assert half.gaussian(OMEGA, [0.01, 2.0]) == pytest.approx(np.full((2, 3), 0.2 - 0.1j))


def test_a_relay_has_the_gaussian_gain_of_the_textbook():
    b = 0.01  # m/s of error whatever the tip does: relay of size b pi/4, whose gain is sqrt(2/pi) M/sigma (Gelb and Vander Velde, table 2.3)
    for sigma in (0.05, 0.2, 0.8):
        expected = math.sqrt(2.0 / math.pi) * (b * math.pi / 4.0) / sigma
        assert of(b / V).gaussian(OMEGA, sigma).real == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("sigma", [0.3, 0.6, 1.0, 2.0, 6.0])
def test_a_saturated_follower_has_the_gaussian_gain_of_the_textbook(sigma):
    limit = 1.0
    r = np.minimum(limit / V, 1.0)
    follows = np.where(V > limit, 2.0 / np.pi * (np.arcsin(r) + r * np.sqrt(1.0 - r**2)), 1.0)
    expected = 1.0 - erf(limit / (math.sqrt(2.0) * sigma))
    assert of(1.0 - follows).gaussian(OMEGA, sigma).real == pytest.approx(expected, abs=4e-3)  # grid of amplitudes


def test_beyond_the_last_amplitude_the_wire_takes_all_that_the_tip_moves_more():
    C = of(0.1 * np.ones(len(V)))
    assert C.at(0.8, V[-1]) == pytest.approx(0.1)
    assert C.at(0.8, 100.0 * V[-1]) == pytest.approx(1.0 - 0.9 / 100.0)


def test_below_the_first_amplitude_nothing_changes():
    C = of(1.0 / (1.0 + V))
    assert C.at(0.8, 1e-6) == pytest.approx(C.at(0.8, V[0]))


def test_tables_of_another_shape_are_refused_in_one_line():
    with pytest.raises(LiftError, match="residual: tables of shape"):
        Residual(OMEGA, V, np.zeros((2, 80), dtype=complex), np.zeros((4, 3, 80)), np.zeros((3, 80)))
    with pytest.raises(LiftError, match="residual: v must be above 0 and ascend"):
        Residual(OMEGA, V[::-1], np.zeros((3, 80), dtype=complex), np.zeros((4, 3, 80)), np.zeros((3, 80)))


@pytest.fixture(scope="module")
def crane():
    return load_crane("nov-250t")


@pytest.fixture(scope="module")
def duty():
    return Duty(F=1.0e6, s_w=500.0)


@pytest.fixture(scope="module")
def residual(crane, duty):
    return identify_residual(crane, duty, "ssc")


@pytest.fixture(scope="module", params=[QUICK, pytest.param(FINE, marks=pytest.mark.thorough)], ids=["quick", "fine"])
def winch_residual(crane, duty, request):
    return identify_residual(crane, duty, "ssc", excitation=request.param)


@pytest.mark.thorough
@pytest.mark.parametrize(("period", "speed"), [(7.0, 0.05), (12.0, 0.3), (9.0, 0.8), (10.0, 1.2)])
def test_a_sine_leaves_what_a_run_of_its_own_leaves(crane, duty, residual, period, speed):
    """Between the table's sines, and on the crane's own wire in place of the soft one."""
    a, T = speed * period / (2.0 * math.pi), period
    case = Scenario(
        load=f"{duty.F / 9.80665 / 1e3 - crane.hook_mass / 1e3} t",
        s_w="500 m",
        mode="ssc",
        duration=f"{60.0 + 8.0 * T} s",
        tip=f"sine {a} m {T} s",
    )
    run = simulate(crane, case, every="50 ms").sel(time=slice(60.0, None))
    n = round(8.0 * T / 0.05)
    e, z = (np.fft.rfft(run[name].values[:n] - run[name].values[:n].mean())[8] for name in ("e_c", "s_tip"))
    C = complex(residual.at(2.0 * math.pi / T, speed))
    assert abs(C - e / z) < 0.08 * abs(e / z)  # interpolation between periods and speeds


def test_friction_holds_a_winch_and_saturation_leaves_it_behind(winch_residual):
    slow, middle, fast = (abs(complex(winch_residual.at(0.8, v))) for v in (0.004, 0.6, 4.0))
    assert slow > 0.9
    assert middle < 0.05
    assert fast > 0.4
    assert winch_residual.saturated[:, -1].min() > 0.5
    assert winch_residual.saturated[:, 0].max() == 0.0


def test_irregular_motion_wanders_more_at_low_frequencies_than_at_high(winch_residual):
    remnant = winch_residual.remnant
    low, high = np.searchsorted(remnant.omega, [0.1, 2.0])
    moves = remnant.sigma_v > 0.01  # where the winch moves at all
    assert (remnant.S[:, moves, low] > 10.0 * remnant.S[:, moves, high]).all()
    assert np.abs(remnant.gain - 1.0).max() < 0.25


def test_what_friction_leaves_is_bounded_and_peaks_less_than_a_gaussian_motion(winch_residual):
    """Over 30 s, in ten minutes and more: a Gaussian motion of some hundred cycles reaches 6 to 7 standard deviations peak to peak."""
    peak = winch_residual.remnant.peak_at([0.1, 0.2, 0.3], [8.0, 8.0, 8.0])
    assert np.all((peak > 3.0) & (peak < 6.5))


def test_a_winch_gives_less_than_a_tenth_of_a_millimetre_to_a_kilonewton(winch_residual):
    assert np.abs(winch_residual.compliance.at(np.geomspace(0.5, 6.0, 5), 0.3)).max() < 1e-7


def other_tables(written: bytes, factor: float) -> bytes:
    """A sound file of NumPy with other numbers, as a program writes it that knows no checksum."""
    out = io.BytesIO()
    with np.load(io.BytesIO(written), allow_pickle=False) as data:
        np.savez_compressed(out, **{name: x if x.dtype.kind == "U" else factor * x for name, x in data.items()})
    return out.getvalue()


@pytest.mark.thorough
def test_the_same_table_is_found_again_and_a_damaged_one_made_anew(
    crane, duty, residual, tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr(module, "cache_root", lambda: tmp_path)
    few = {"excitation": replace(QUICK, periods=(8.0, 12.0), speeds=(0.1, 0.3))}
    made = identify_residual(crane, duty, "hs", **few)
    (file,) = (tmp_path / "residuals").iterdir()
    monkeypatch.setattr(module, "run_twin", None)  # nothing may run
    found = identify_residual(crane, duty, "hs", **few)
    for name in ("omega", "v", "C", "harmonics", "saturated"):
        assert np.array_equal(getattr(found, name), getattr(made, name))
    assert np.array_equal(found.remnant.S, made.remnant.S)
    assert np.array_equal(found.compliance.Y, made.compliance.Y)
    assert found.about == made.about
    monkeypatch.setattr(module, "cache_root", lambda: tmp_path / "of another user")
    monkeypatch.setattr(module, "SHIPPED", tmp_path)  # as a wheel holds it
    assert np.array_equal(identify_residual(crane, duty, "hs", **few).C, made.C)
    monkeypatch.undo()
    monkeypatch.setattr(module, "cache_root", lambda: tmp_path)
    checked._NOTED.discard(checked.Kept.RESIDUAL)
    written = file.read_bytes()
    for wrong in (written[:200], other_tables(written, 0.5), other_tables(written, np.nan), *damaged(written, 4)):
        file.write_bytes(wrong)
        again = identify_residual(crane, duty, "hs", **few)
        assert np.array_equal(again.C, made.C)
        assert np.array_equal(again.remnant.S, made.remnant.S)
        assert file.read_bytes() == written
    (note,) = caplog.records
    assert note.getMessage().endswith(" The winch is identified again.")
    identify_residual(crane, duty, "ns", **few)
    assert len(list((tmp_path / "residuals").iterdir())) == 2


def test_manual_mode_has_no_residual(crane):
    with pytest.raises(LiftError, match='mode "manual" does not compensate'):
        identify_residual(crane, Duty(F=1e6, s_w=100.0), "manual", cache=False)


@pytest.mark.thorough
def test_a_plc_on_a_soft_wire_knows_the_wire_that_the_crane_has(crane, duty):
    on_soft = soft(crane, duty)
    assert on_soft.wire.E < 0.1 * crane.wire.E
    assert plant_parameters(on_soft) == plant_parameters(crane)


@pytest.mark.long
def test_a_tension_loop_is_identified_on_a_long_wire_and_yields_to_tension():
    """On a spring stiffer than the wire that it is set for it would swing, and nothing could be said of it."""
    deep = load_crane("deep-250t")
    found = {
        mode: identify_residual(deep, Duty(F=1.25e6, s_w=1500.0), mode, excitation=QUICK, cache=False)
        for mode in ("ssc", "rope")
    }
    slow = [np.abs(table.compliance.Y[0]).mean() for table in found.values()]
    assert slow[1] > slow[0]


def test_a_late_sensor_costs_what_a_pure_delay_costs(crane):
    """0.2 s on a heave of 9.6 s leaves 2 sin(omega tau/2) = 13 %, beside the friction of the winch."""
    late = identify_residual(crane, Duty(F=1e6, s_w=500.0, sensors=Sensors(delay="0.2 s")), "ssc")
    omega = 2.0 * math.pi / 9.6
    assert abs(complex(late.at(omega, 0.8))) == pytest.approx(2.0 * math.sin(0.1 * omega), abs=0.03)


def test_a_tension_below_the_hook_and_a_load_beyond_the_crane_are_refused(crane):
    with pytest.raises(LiftError, match="less than the weight of the hook, 3 t"):
        identify_residual(crane, Duty(F=1e3, s_w=100.0), cache=False)
    with pytest.raises(Exception, match="exceeds the SWL"):
        identify_residual(crane, Duty(F=5e6, s_w=100.0), cache=False)
