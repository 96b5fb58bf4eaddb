"""Wire and drum of the reference plant: energy of a stiffening wire, wire turn by turn."""

from types import SimpleNamespace

import numpy as np
import pytest
from trials.reference_plant.drum import CLIMB, TrueDrum, inertia_true, wire_on_layers, wound
from trials.reference_plant.pack import STRAIN, pack_reference
from trials.reference_plant.parameters import ReferenceCrane
from trials.reference_plant.rope import State, at, elastic_tension, energy, powers, rates, stretch_under

from stillhook import Scenario, load_crane
from stillhook.engine.pack.winch import drum_record
from stillhook.physics.load_path.drum import layer_diameter, layers_filled, wire_to_layer
from stillhook.winches.records import Tip

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
CASE = Scenario(load="94 t", s_w="487 m", tip="sine 0.75 m 10 s", mode="ssc", duration="60 s", warm_up="0 s")
ROPE = pack_reference(CRANE, CASE, ReferenceCrane()).params.extra.rope
DRUM = TrueDrum(2.8, 0.095, 19.0, 2800.0, 36.0, 3.0, 1.4e5, 1.0 / 501.6)
I_L = 2.0 / 547.0
JOULE = 1e-6
P = SimpleNamespace(extra=SimpleNamespace(rope=ROPE), hoist=SimpleNamespace(s_w_0=487.0))
"""Parameters of which the rope reads its own and the wire out at the start."""


def test_a_standing_wire_takes_the_stretch_of_its_tension():
    for F in (1e4, 1e6, 2e6):
        assert elastic_tension(stretch_under(F, I_L, ROPE), I_L, ROPE) == pytest.approx(F, rel=1e-12)


def test_the_wire_is_as_stiff_as_the_twins_under_half_a_load_and_softer_without():
    def tangent(e: float) -> float:
        d = 1e-7
        return (elastic_tension((e + d) / I_L, I_L, ROPE) - elastic_tension((e - d) / I_L, I_L, ROPE)) / (2.0 * d)

    EA = pack_reference(CRANE, CASE, ReferenceCrane()).params.hoist.wire.EA
    assert tangent(STRAIN) == pytest.approx(EA, rel=1e-6)
    assert tangent(1e-5) < 0.95 * EA


def test_what_winch_tip_and_load_give_the_wire_it_keeps_or_loses():
    """Rate of the energy, by differences along a motion, against the powers at its ends."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        x_up, x_low = rng.uniform(0.1, 0.5, 2)
        v = dict(
            zip(
                ("omega_m", "v_mid", "v_load", "y_up", "y_low"),
                rng.uniform(-0.3, 0.3, 5) * (100, 1, 1, 0.1, 0.1),
                strict=True,
            )
        )
        lever, tip_v, s_w = 0.0047, float(rng.uniform(-1.0, 1.0)), 487.0
        start = State(s_w, -x_up - x_low, v["v_load"], -x_up, v["v_mid"], v["y_up"], v["y_low"])
        v_w = v["omega_m"] * lever
        q = at(v_w, start, None, Tip(0.0, tip_v), P)
        slope = rates(q, start, P)

        def stored(h: float, start=start, slope=slope, v_w=v_w, tip_v=tip_v) -> float:
            x = State(*(y + h * dy for y, dy in zip(start, slope, strict=True)))
            return float(energy(at(v_w, x, None, Tip(h * tip_v, tip_v), P), x, P))

        h = 1e-5
        rate = (stored(h) - stored(-h)) / (2.0 * h)
        lost = powers(q, start, Tip(0.0, tip_v), P)
        into = q.F_w * (tip_v + q.v_w)
        assert rate == pytest.approx(into - lost.wire - lost.drag, rel=1e-5, abs=1.0)


def test_strands_lose_energy_in_a_swing_and_none_at_rest():
    still = Tip(0.0, 0.0)

    def lost(y_up: float) -> float:
        x = State(487.0, -0.6, 0.0, -0.3, 0.0, y_up, 0.0)
        return float(powers(at(0.0, x, None, still, P), x, still, P).wire)

    assert lost(0.0) == pytest.approx(0.0, abs=JOULE)
    assert lost(0.01) > 0.0


def test_layers_hold_the_wire_of_their_turns():
    """Turn by turn: the length on n layers is the sum over circles."""
    for n in (1, 3, 12):
        circles = [np.pi * (DRUM.d + (2 * i - 1) * DRUM.pitch) for i in range(1, n + 1) for _ in range(19)]
        assert wire_on_layers(float(n), DRUM) == pytest.approx(sum(circles), rel=1e-12)


def test_each_turn_away_from_a_crossing_lies_on_its_layers_circle_and_the_crossing_is_smooth():
    L = np.linspace(1.0, 2800.0, 200001)
    w = [wound(float(x), DRUM) for x in L]
    d, layer, turn = (np.array([getattr(i, n) for i in w]) for n in ("d", "layer", "turn"))
    away = (np.minimum(turn, 19.0 - turn) > 0.5 * CLIMB) | ((layer == 1.0) & (turn < 18.0))
    assert d[away] == pytest.approx(DRUM.d + (2.0 * layer[away] - 1.0) * DRUM.pitch)
    assert (np.diff(d) > -1e-9).all()
    assert np.diff(d).max() < 2e-3  # no step: a layer is 190 mm
    assert away.mean() > 0.9


def test_unpressed_wire_lies_where_the_twins_does():
    twin = drum_record(CRANE)
    own = DRUM._replace(pitch=twin.d_wire)
    for L in (200.0, 516.0, 1500.0, 2343.0):
        assert wound(L, own).d == pytest.approx(layer_diameter(layers_filled(L, twin), twin), rel=1e-12)
    assert wire_on_layers(12.0, own) == pytest.approx(wire_to_layer(12.0, twin), rel=1e-12)


def test_pressed_wire_makes_layers_thinner_and_inertia_grows_with_the_wire():
    thick, thin = wound(2300.0, DRUM._replace(pitch=0.096)), wound(2300.0, DRUM)
    assert thin.d < thick.d
    J = [inertia_true(L, wound(L, DRUM), DRUM) for L in (100.0, 1000.0, 2500.0)]
    assert J == sorted(J)
