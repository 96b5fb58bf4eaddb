"""Drum, wire and load: lengths are kept, wires pull, loads hang."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook import load_crane
from stillhook.engine.pack.winch import drum_record, load_record, pack
from stillhook.physics.load_path.drum import (
    K_wire,
    Load,
    drag_force,
    layer_diameter,
    layers_filled,
    load_acceleration,
    shaft_inertia,
    wire_at_end,
    wire_damping,
    wire_inertia,
    wire_stiffness,
    wire_tension,
    wire_to_layer,
    wire_usable,
)
from stillhook.physics.scalar import G
from stillhook.spec.crane import wire_inertia as full_wire_inertia
from stillhook.spec.scenario import Scenario, Water
from stillhook.winches.load_path import load as load_path
from stillhook.winches.load_path.load import Hoist, drag_loss, drum_geometry, wire_loss
from stillhook.winches.records import Geometry, Tip

NAMES = ("nov-250t", "nov-150t", "nov-100t-pure-active")
CRANES = {name: load_crane(name) for name in NAMES}
HOISTS = {name: pack(CRANES[name], Scenario(load="50 t", s_w="100 m")).params.hoist for name in NAMES}
LENGTH = 1.0e-9
"""Rounding of a square root over kilometres of wire [m]."""
PRINTED_INERTIA = 0.005
"""J_m_eff is printed with two digits and split by us."""
RINGS = 0.001
"""A hollow cylinder of wire against the sum of its layers as rings: the rings' wire lies at their centres."""

name = st.sampled_from(NAMES)
part = st.floats(0.0, 1.0)


class OnlyHoist(NamedTuple):
    """Parameters of a winch of which the load path reads the hoist alone."""

    hoist: Hoist


def hanging(
    omega: float, s_w: float, s_load: float, v_load: float, geo: Geometry, tip: Tip, h: Hoist
) -> load_path.Point:
    """Wire and load at an instant, at motor speed omega [rad/s]."""
    return load_path.at(omega * geo.r_eff, load_path.State(s_w, s_load, v_load), geo, tip, OnlyHoist(h))


@given(name, part)
def test_wire_on_the_drum_and_wire_paid_out_are_all_the_wire(name, part):
    drum = HOISTS[name].drum
    s_w = part * drum.L_full
    assert wire_to_layer(layers_filled(drum.L_full - s_w, drum), drum) + s_w == pytest.approx(drum.L_full, abs=LENGTH)


@pytest.mark.parametrize("name", NAMES)
def test_each_layer_takes_its_turns_times_its_circumference(name):
    drum = HOISTS[name].drum
    for n in range(1, int(drum.layers) + 1):
        on_layer = wire_to_layer(n, drum) - wire_to_layer(n - 1, drum)
        assert on_layer == pytest.approx(drum.turns * math.pi * layer_diameter(float(n), drum))


@pytest.mark.parametrize("name", NAMES)
def test_a_layer_that_is_exactly_full_is_still_the_layer_in_use(name):
    drum = HOISTS[name].drum
    for n in range(1, int(drum.layers)):
        L = wire_to_layer(n, drum)
        this, more = layers_filled(L, drum), layers_filled(L + 0.01, drum)
        assert layer_diameter(this, drum) == pytest.approx(drum.d + (2 * n - 1) * drum.d_wire)
        assert layer_diameter(more, drum) - layer_diameter(this, drum) == pytest.approx(2.0 * drum.d_wire)


@pytest.mark.parametrize("name", NAMES)
def test_a_full_drum_uses_its_last_layer_and_an_empty_one_its_first(name):
    drum = HOISTS[name].drum
    assert layers_filled(drum.L_full, drum) == pytest.approx(drum.layers)
    assert layers_filled(0.0, drum) == 0.0
    assert layer_diameter(0.0, drum) == pytest.approx(drum.d + drum.d_wire)
    assert layer_diameter(drum.layers, drum) == pytest.approx(drum.d_max - drum.d_wire, rel=0.001)


@given(name, part, part)
def test_paying_out_never_makes_the_drum_larger(name, a, b):
    h = HOISTS[name]
    more, less = (drum_geometry(s * h.drum.L_full, h) for s in (max(a, b), min(a, b)))
    assert more.d <= less.d
    assert more.r_eff <= less.r_eff
    assert more.i_J >= less.i_J * (1.0 - 1e-12)


@given(name, part)
def test_K_wire_is_never_below_one(name, part):
    drum = HOISTS[name].drum
    assert K_wire(layer_diameter(layers_filled(part * drum.L_full, drum), drum), drum) >= 1.0


@pytest.mark.parametrize("name", NAMES)
def test_inertia_of_the_full_drum_is_the_stated_one_and_an_empty_drum_has_less(name):
    h, J = HOISTS[name], CRANES[name].inertia.J_m_eff
    full = shaft_inertia(h.drum.L_full, h.drum.layers, h.drum, h.inertia)
    empty = shaft_inertia(0.0, 0.0, h.drum, h.inertia)
    assert full == pytest.approx(J, rel=PRINTED_INERTIA)
    assert 0.3 * full < empty < 0.8 * full  # figure 2.19 and paper F figure 7: wire is about half


@pytest.mark.parametrize("name", NAMES)
def test_wire_on_a_full_drum_has_the_inertia_of_its_layers(name):
    h, crane = HOISTS[name], CRANES[name]
    cylinder = wire_inertia(h.drum.L_full, h.drum.layers, h.drum)
    assert cylinder == pytest.approx(full_wire_inertia(crane.drum, crane.wire), rel=RINGS)


@given(st.floats(-5.0, 5.0), st.floats(-20.0, 20.0), st.floats(0.0, 2000.0))
def test_a_wire_cannot_push(stretch, rate, s_w):
    wire = HOISTS["nov-250t"].wire
    assert wire_tension(stretch, rate, wire_stiffness(s_w, wire), wire_damping(s_w, 1e5, wire)) >= 0.0


@given(st.floats(0.0, 2000.0), st.floats(1.0, 500.0))
def test_more_wire_is_softer_wire(s_w, more):
    wire = HOISTS["nov-250t"].wire
    assert wire_stiffness(s_w + more, wire) < wire_stiffness(s_w, wire)


@pytest.mark.slow
@given(st.floats(0.0, 250.0), st.floats(0.0, 2500.0))
def test_a_hanging_load_stays_where_it_hangs(tonnes, s_w):
    h = pack(CRANES["nov-250t"], Scenario(load=f"{tonnes!r} t", s_w=f"{s_w!r} m")).params.hoist
    sag = h.load.W / wire_stiffness(s_w, h.wire)
    q = hanging(0.0, s_w, -sag, 0.0, drum_geometry(s_w, h), Tip(0.0, 0.0), h)
    assert q.F_w == pytest.approx(h.load.W)
    assert q.a_load == pytest.approx(0.0, abs=1e-9)


def test_signs_of_the_stretch():
    """A rising tip, wire hauled in and a sinking load each pull the wire tighter."""
    h = HOISTS["nov-250t"]
    geo = drum_geometry(100.0, h)
    sag = h.load.W / wire_stiffness(100.0, h.wire)

    still = Tip(0.0, 0.0)

    def tension(omega=0.0, s_w=100.0, s_load=-sag, v_load=0.0, tip=still):
        return hanging(omega, s_w, s_load, v_load, geo, tip, h).F_w

    rest = tension()
    assert tension(tip=Tip(0.01, 0.0)) > rest
    assert tension(tip=Tip(0.0, 0.1)) > rest
    assert tension(s_w=99.99) > rest
    assert tension(omega=1.0) > rest
    assert tension(s_load=-sag - 0.01) > rest
    assert tension(v_load=-0.1) > rest


@given(st.floats(-3.0, 3.0), st.floats(0.0, 1e6), st.floats(0.0, 3.0))
def test_drag_opposes_the_motion_and_only_takes_power(v, b, U):
    load = Load(W=1e6, m=1e5, i_m=1e-5, b=b, U=U)
    assert drag_force(v, load) * v <= 0.0
    assert drag_loss(v, load) >= 0.0
    assert drag_force(-v, load) == -drag_force(v, load)


def test_a_cut_load_falls_freely_in_air_and_reaches_its_sinking_speed_in_water():
    crane = CRANES["nov-250t"]
    air = load_record(crane, Scenario(load="100 t", s_w="100 m"))
    assert load_acceleration(0.0, 0.0, air) == pytest.approx(-G)
    water = load_record(
        crane, Scenario(load="100 t", s_w="100 m", water=Water(volume="12.7 m^3", C_D=1.2, area="25 m^2"))
    )
    v_sink = math.sqrt(water.W / water.b)
    assert load_acceleration(0.0, -v_sink, water) == pytest.approx(0.0, abs=1e-12)
    assert load_acceleration(0.0, -2.0 * v_sink, water) > 0.0


@pytest.mark.parametrize("U", [0.3, 1.5])
def test_a_cut_load_in_a_cross_current_sinks_at_the_root_of_its_drag_and_weight(U):
    """1/2 rho C_D A v sqrt(v^2 + U^2) = W, of which v^2 is the root of a quadratic equation."""
    water = Water(volume="12.7 m^3", C_D=1.2, area="25 m^2", current=f"{U} m/s")
    load = load_record(CRANES["nov-250t"], Scenario(load="100 t", s_w="100 m", water=water))
    v = math.sqrt(0.5 * (math.sqrt(U**4 + 4.0 * (load.W / load.b) ** 2) - U**2))
    assert load_acceleration(0.0, -v, load) == pytest.approx(0.0, abs=1e-12)
    assert v < math.sqrt(load.W / load.b)


def test_a_hundred_tonnes_of_steel_weigh_87_in_sea_water():
    """Density 7850 kg/m^3: 12.74 m^3, which displaces 13.06 t; the hook's 3 t hang on top."""
    crane = CRANES["nov-250t"]
    load = load_record(crane, Scenario(load="100 t", s_w="100 m", water=Water(volume="12.739 m^3")))
    assert load.W / G - crane.hook_mass == pytest.approx(86.94e3, rel=1e-4)
    assert load.m == pytest.approx(103.0e3)


@given(st.floats(0.0, 50.0))
def test_added_mass_slows_the_load_and_weighs_nothing(tonnes):
    crane = CRANES["nov-250t"]

    def wet(**more):
        return load_record(crane, Scenario(load="100 t", s_w="100 m", water=Water(volume="12.7 m^3", **more)))

    bare, heavy = wet(), wet(added_mass=f"{tonnes!r} t")
    assert heavy.W == bare.W
    assert heavy.m == pytest.approx(bare.m + 1000.0 * tonnes)
    assert load_acceleration(2.0 * bare.W, 0.0, heavy) <= load_acceleration(2.0 * bare.W, 0.0, bare)


@given(st.floats(-0.05, 0.3), st.floats(-2.0, 2.0))
def test_wire_damping_only_takes_power_while_the_drum_stands(stretch, v_load):
    h = HOISTS["nov-250t"]
    q = hanging(0.0, 100.0, -stretch, v_load, drum_geometry(100.0, h), Tip(0.0, 0.0), h)
    if q.F_w > 0.0:
        assert wire_loss(q, h.wire) >= -1e-9 * abs(q.F_w)


def test_wire_left_at_the_printed_depths_is_in_the_range_of_the_drum():
    """Paper F table 3 pays out 2314 m from a 250 t crane: the drum must hold that much."""
    assert drum_record(CRANES["nov-250t"]).L_full > 2314.0
    L = np.array([drum_record(CRANES[n]).L_full for n in NAMES])
    assert np.all((L > 1500.0) & (L < 4000.0))


@pytest.mark.parametrize("crane", NAMES)
def test_the_wire_ends_where_the_hook_meets_the_tip_and_where_the_last_turns_begin(crane):
    """Three turns stay on the bare drum; 5 cm may be taken in beyond the hook's place. The flag is 1 or 0: its mean over
    a run is the share of the time."""
    drum = HOISTS[crane].drum
    kept = drum.L_full - wire_usable(drum)
    assert kept == pytest.approx(3.0 * math.pi * CRANES[crane].drum.d, rel=1e-9)
    ends = [-0.051, -0.049, 0.0, wire_usable(drum) - 0.001, wire_usable(drum) + 0.001]
    assert [wire_at_end(s_w, drum) for s_w in ends] == [1.0, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("crane", NAMES)
def test_a_falling_load_turns_height_into_speed_and_a_stretched_wire_holds_the_work_done_on_it(crane):
    h = HOISTS[crane]
    p = OnlyHoist(h)

    def point(s_w, s_load, v_load):
        y = load_path.State(s_w, s_load, v_load)
        geo = drum_geometry(s_w, h)
        q = load_path.at(0.0, y, geo, Tip(0.0, 0.0), p)
        return q, load_path.energy(q, y, p)

    height, slack = 0.5, 5.0
    _, above = point(100.0, slack + height, 0.0)
    _, below = point(100.0, slack, -math.sqrt(2.0 * height * h.load.W / h.load.m))
    assert below == pytest.approx(above, rel=1e-9)

    depths = np.linspace(0.0, 0.2, 401)
    pulls = [point(100.0, -d, 0.0) for d in depths]
    work = np.trapezoid([q.F_w - h.load.W for q, _ in pulls], depths)
    assert pulls[-1][1] - pulls[0][1] == pytest.approx(work, rel=1e-3)
