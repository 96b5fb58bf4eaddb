"""The frequency-domain method against lowerings in time, winch and wire in the loop: a load that hangs, under irregular waves, several seeds."""

import math

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.engine.simulate import simulate
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import read_payload, vessel_file
from stillhook.response.forcing import Forcing
from stillhook.response.frequency_domain import Sigmas, sigmas
from stillhook.response.suspended_load import suspended_load
from stillhook.response.winch.identify import identify_residual
from stillhook.response.winch.linear_form import Residual
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.realisation import realise, tip_motion, wave_field
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase

pytestmark = pytest.mark.slow

LENGTH, SETTLED, SEEDS = 900.0, 150.0, 4
X, Y = -20.0, 18.0
LINEAR = 0.02  # the agreement that is asked for where nothing but drag is not linear
DRAG = 0.06  # resonance against drag: the equivalent drag of a Gaussian motion, which a motion limited by drag is not
STICTION = 0.12  # a winch that sticks, and the scatter of four quarters of an hour


@pytest.fixture(scope="module")
def crane():
    return load_crane("deep-250t")


@pytest.fixture(scope="module")
def vessel():
    return read_vessel(vessel_file("construction-vessel-130m"))


def both(crane, vessel, payload, z, H_s, T_p, mode, beta=150.0):
    """Deviations by the frequency-domain method and in time, over the same waves: phases differ by seed, heights are fixed."""
    sea = Sea((Train(Jonswap(H_s, T_p, 2.0), math.radians(beta)),))
    cases, tips, waves, cross = [], [], [], []
    for seed in range(SEEDS):
        w = realise(sea, LENGTH, seed)
        tip = tip_motion(w, vessel, X, Y)
        here, there = tip.amplitudes[w.harmonic], w.elevation(X, Y)
        (
            tips.append(np.abs(here) ** 2 / 2.0),
            waves.append(np.abs(there) ** 2 / 2.0),
            cross.append(here * np.conj(there) / 2.0),
        )
        field = None if z > 0.0 else wave_field(w, X, Y)
        stage = Phase(mode=mode, time=f"{LENGTH} s")
        cases.append(
            Lowering(
                payload=read_payload(payload),
                tip=tip,
                waves=field,
                h_tip="30 m",
                depth="3000 m",
                start_depth=f"{-z} m",
                programme=(stage,),
                duration=f"{LENGTH} s",
            )
        )
    run = simulate(crane, cases, series=True).sel(time=slice(SETTLED, None))
    t = np.linspace(-1.0, 1.0, run.sizes["time"])
    in_time = {}
    for name, column in (("u", "e_c"), ("load", "s_load"), ("top", "F_w"), ("sling", "F_sling")):
        rows = run[column].values
        in_time[name] = float(np.sqrt(np.mean([np.var(y - np.polynomial.Polynomial.fit(t, y, 1)(t)) for y in rows])))
    h = suspended_load(crane, cases[0], z)
    residual = identify_residual(crane, h.duty) if mode == "ahc" else Residual.constant(1.0)
    mean = [np.mean(rows, axis=0)[None, :] for rows in (tips, waves, cross)]
    found: Sigmas = sigmas(Forcing(w.omega, np.full(len(w.omega), 2.0 * math.pi / LENGTH), *mean), h, residual)
    return {name: getattr(found, name)[0] for name in in_time}, in_time


@pytest.mark.long
@pytest.mark.parametrize(
    ("payload", "z", "H_s", "T_p"),
    [("manifold-60t", 5.0, 2.0, 9.0), ("manifold-60t", -25.0, 1.0, 9.0), ("suction-anchor-85t", -300.0, 1.0, 9.0)],
)
def test_on_the_brake_road_and_time_agree_in_air_near_the_surface_and_below(crane, vessel, payload, z, H_s, T_p):
    computed, in_time = both(crane, vessel, payload, z, H_s, T_p, "manual")
    for name in ("load", "top", "sling"):
        assert computed[name] == pytest.approx(in_time[name], rel=LINEAR), name


@pytest.mark.long
def test_on_the_brake_at_resonance_drag_limits_both_alike(crane, vessel):
    computed, in_time = both(crane, vessel, "suction-anchor-85t", -2900.0, 1.0, 9.5, "manual")
    for name in ("load", "top", "sling"):
        assert computed[name] == pytest.approx(in_time[name], rel=DRAG), name


@pytest.mark.thorough
@pytest.mark.parametrize(("payload", "z"), [("suction-anchor-85t", -2900.0), ("manifold-60t", -1500.0)])
def test_compensated_in_deep_water_what_friction_leaves_and_the_wire_makes_of_it_agree(crane, vessel, payload, z):
    computed, in_time = both(crane, vessel, payload, z, 1.5, 9.0, "ahc")
    for name in ("u", "load", "top", "sling"):
        assert computed[name] == pytest.approx(in_time[name], rel=STICTION), name


@pytest.mark.thorough
def test_compensated_on_a_short_wire_the_winch_gives_and_takes_most_of_the_ringing(crane, vessel):
    """Without the compliance of the winch the method would give twice the tension or more."""
    computed, in_time = both(crane, vessel, "manifold-60t", -25.0, 2.5, 10.0, "ahc")
    assert computed["u"] == pytest.approx(in_time["u"], rel=STICTION)
    assert computed["load"] == pytest.approx(in_time["load"], rel=STICTION)
    assert computed["sling"] == pytest.approx(
        in_time["sling"], rel=0.3
    )  # friction at the wire's own frequency, see explanation/frequency-domain-method.md
