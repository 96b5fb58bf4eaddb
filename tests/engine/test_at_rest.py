"""What is known of a lift before anything moves: in air the water does nothing, motors hold at full displacement, and of
a deck that was not touched nothing happened."""

import math
from types import SimpleNamespace

import pytest
from tests.engine.test_lowering import whole_lift

from stillhook import Scenario, load_crane
from stillhook.engine.lowering.summary import held_load
from stillhook.engine.pack.winch import drum_record, load_record, water_around
from stillhook.engine.scenario.checks import alpha_wanted
from stillhook.physics.scalar import G
from stillhook.winches.circuits.tables import LeakPoint
from stillhook.winches.interface import Undeclared
from stillhook.winches.load_path import deck
from stillhook.winches.load_path.payload import ahead
from stillhook.winches.shaft import readings

CRANE = load_crane("nov-250t")
LIFT = Scenario(load="100 t", s_w="500 m", mode="ssc")
IN_AIR = 1e-12  # relative: a sum of two masses times G


def test_in_air_the_water_does_nothing():
    assert water_around(LIFT) == (0.0, 0.0, 0.0, 0.0)
    assert load_record(CRANE, LIFT).W == pytest.approx((100e3 + CRANE.hook_mass) * G, rel=IN_AIR)


def test_a_compensating_winch_holds_the_load_at_full_displacement_and_reduces_it_for_speed_alone():
    """Semi-secondary control: the largest motor needs the least pressure, and a smaller one turns the drum faster."""
    held = held_load(CRANE, whole_lift(), 0.0)
    assert held.compensates
    assert held.alpha == 1.0
    assert alpha_wanted(CRANE, LIFT, 1.0, 1.0) < held.alpha


def test_of_a_deck_that_was_not_left_nothing_happened():
    found = deck.numbers(deck.blank())
    counts = {name: value for name, value in found.items() if not math.isnan(value)}
    assert set(counts.values()) == {0.0}
    assert deck.blank().v_again == 0.0  # the fastest touch so far: any that comes is faster
    assert len(found) - len(counts) == 4  # no time of lift-off, none of touching again, no gap, no speed of a blow


def test_controllers_of_a_winch_without_oil_are_told_of_none():
    """No motor, no pump, no line: nothing that a feedforward by the plant could take a flow from."""
    assert set(Undeclared.hydraulics(load_crane("nov-100t-electric"))) == {0.0}
    assert min(Undeclared.hydraulics(CRANE)) > 0.0


def test_a_winch_without_oil_has_no_pressures_to_read_and_its_encoder_and_load_cell_read_as_they_are():
    tick = SimpleNamespace(s_m=0.1, v_m=0.2, a_m=0.3, v_op=0.4, s_op=0.5, mode=2.0, f_known=1.0, n_s=0.0, n_F=0.0)
    p = SimpleNamespace(sensors=SimpleNamespace(q_s=0.0, q_F=0.0), hoist=SimpleNamespace(drum=drum_record(CRANE)))
    path, force, layer = SimpleNamespace(s_w=50.0), SimpleNamespace(F_w=1e6), SimpleNamespace(d=CRANE.drum.d_max)
    read = readings(100.0, path, force, tick, layer, p)
    assert (read.p_a, read.p_b, read.p_hp, read.dp, read.dp_load) == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert (read.s_w, read.F, read.omega_m) == (50.0, 1e6, 100.0)
    assert (read.s_tip, read.v_tip, read.a_tip) == (0.1, 0.2, 0.3)


def test_a_load_that_falls_free_for_two_seconds_is_where_newton_has_it():
    """Half g t^2, and by two steps of a second as by one of two."""
    assert ahead(0.0, 0.0, -G, 2.0) == pytest.approx(-2.0 * G)
    half_way = ahead(5.0, 1.0, -G, 1.0)
    assert ahead(half_way, 1.0 - G, -G, 1.0) == pytest.approx(ahead(5.0, 1.0, -G, 2.0))


def test_a_leak_without_further_words_is_that_of_pumps_at_full_stroke_and_motors_at_a_thousand_revolutions():
    stated = LeakPoint(alpha_p=1.0, n_m="1000 rev/min")
    assert LeakPoint().alpha_p == stated.alpha_p
    assert LeakPoint().n_m == pytest.approx(stated.n_m)
