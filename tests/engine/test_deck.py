"""A payload in air and a deck that moves under it: contact, lift-off and second hits, set-down, and the reference of the
winch."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tests.conservation.test_lowering_energy import box
from tests.engine.lifts import RAO, X, Y, sea

from stillhook import load_crane
from stillhook.engine.lowering.checks import check_lift
from stillhook.engine.lowering.hoisting_speed import hoisting_speed
from stillhook.engine.simulate import simulate
from stillhook.errors import StillhookError
from stillhook.formats.results import load_run, rerun, save_run
from stillhook.library.catalogue import read_compensator
from stillhook.physics.load_path.deck import damping_ratio, restitution
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Profile
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.realisation import Resolution, realise, tip_motion
from stillhook.sea.vessel.relative import DeckMotion, OtherVessel, RelativeMotion
from stillhook.spec.lift.deck import Deck, TipOverDeck
from stillhook.spec.lift.lowering import DeepWire, InSea, Lowering, Rigging, WinchSettings
from stillhook.spec.lift.phase import Phase

CRANE = load_crane("nov-250t")
HOLDS = (Phase(mode="manual", time="5 s"),)
A, T = 1.0, 8.0
OMEGA = 2.0 * math.pi / T
ELASTIC_TIME, ELASTIC_SPEED = 0.05, 0.1
"""A light payload on short wire takes hundredths of a second to be taken up, and oscillates on the wire by a tenth of
the speed of the hit."""
FOLLOWED, LEFT = 0.02, 0.03
"""What the winch leaves of a deck as slow as 30 s: of the lowering speed, and of the deck's motion."""


def lift(deck: Deck, programme=HOLDS, **more) -> Lowering:
    given = {"payload": box(), "h_tip": "40 m", "depth": "60 m", "start_depth": "-6 m", "duration": "6 s"}
    return Lowering(**given | {"programme": programme, "deck": deck, "wire": DeepWire(nodes=5), **more})


def off(v: float, wait: str, **more) -> Lowering:
    """A light payload off a sine deck, at a constant speed by the time it is taken up."""
    programme = (Phase(mode="manual", time=wait), Phase(mode="manual", speed=f"{-v} m/s", depth="-20 m"))
    given = {
        "payload": box("5 t", V=1.0),
        "rigging": Rigging(stiffness="50 MN/m", height="4 m", zeta=1.0),
        "winch": WinchSettings(ramp="0.2 m/s^2"),
        "duration": "90 s",
    }
    return lift(Deck(height="6 m", motion=f"sine {A} m {T} s", slack="3 m"), programme, **given | more)


@pytest.mark.parametrize("e", [0.05, 0.3, 0.9])
def test_the_damper_makes_the_restitution_that_was_given(e):
    zeta = damping_ratio(e)

    def rates(_, y):
        return [y[1], -max(y[0] + 2.0 * zeta * y[1], 0.0)]

    def apart(_, y):
        return y[0] + 2.0 * zeta * y[1]

    apart.terminal, apart.direction = True, -1.0
    end = solve_ivp(rates, (0.0, 50.0), [0.0, 1.0], events=apart, rtol=1e-10, atol=1e-12, max_step=0.01)
    assert -end.y[1, -1] == pytest.approx(e, abs=1e-5)
    assert restitution(zeta) == pytest.approx(e, abs=1e-12)


def rebound_of(v: float, omega: float, zeta: float) -> float:
    """Speed at the height of the deck after a hit at v [m/s] on spring and damper, the weight included."""

    def rates(_, y):
        return [y[1], G - max(omega**2 * y[0] + 2.0 * zeta * omega * y[1], 0.0)]

    def apart(_, y):
        return y[0]

    apart.terminal, apart.direction = True, -1.0
    return -solve_ivp(rates, (0.0, 1.0), [0.0, v], events=apart, rtol=1e-10, atol=1e-13, max_step=1e-4).y[1, -1]


@pytest.mark.parametrize("e", [1.0, 0.6])
def test_a_payload_that_was_thrown_falls_on_the_deck_and_loses_what_the_restitution_says(e):
    """Deck up to 2 m/s, then stopped within 20 ms; 100 t in free flight, hit as free fall has it."""
    thrown = Profile(points=[("0 s", "0 m/s"), ("2 s", "2 m/s"), ("2.02 s", "0 m/s")])
    deck = Deck(height="6 m", motion=thrown, slack="9 m", settlement="0.2 mm", restitution=e)
    case = lift(deck, duration="2.6 s", ramp="0 s")
    run = simulate(CRANE, case, every="0.01 s", step="0.5 ms")
    z, t = run.z_load.values, run.time.values
    top, t_hit = float(z.max()), float(run.t_second_hit)
    fall = top - (6.0 + thrown.sample(np.array([3.0]))[0][0])
    v = math.sqrt(2.0 * G * fall)
    assert float(run.v_second_hit_max) == pytest.approx(v, rel=2e-3)
    flies = (t > t_hit + 0.03) & (t < t_hit + 0.06)
    rebound = np.sqrt(run.v_load.values[flies] ** 2 + 2.0 * G * (z[flies] - top + fall))
    assert rebound == pytest.approx(rebound_of(v, math.sqrt(G / 2e-4), damping_ratio(e)), rel=3e-3)
    assert rebound == pytest.approx(e * v, rel=0.03)
    before = simulate(CRANE, case.model_copy(update={"duration": round(t_hit, 2) - 0.05}), step="0.5 ms", series=False)
    lost = float(run.energy_deck) - float(before.energy_deck)
    assert lost == pytest.approx(0.5e5 * (v * v - rebound[0] ** 2), rel=5e-3, abs=1e-3 * 0.5e5 * v * v)
    assert abs(float(run.energy_unaccounted)) < 1e-3


@pytest.mark.parametrize("wait", [21, 22])
def test_a_second_hit_comes_where_a_line_at_hoisting_speed_meets_the_sine_again(wait):
    """Rigid wire: the payload leaves the deck where the hook's line meets it, and t_2 solves
    A sin(w t_1) + v (t_2 - t_1) = A sin(w t_2); it hits with A w cos(w t_2) - v."""
    v = 0.3
    run = simulate(CRANE, off(v, f"{wait} s"), every="0.02 s", step="2 ms")
    t = run.time.values
    line = float(run.s_w[0]) - run.s_w.values - 3.0
    above = int(np.argmax(line >= A * np.sin(OMEGA * t)))
    t_1 = brentq(lambda x: np.interp(x, t, line) - A * math.sin(OMEGA * x), t[above - 1], t[above])

    def gap(x: float) -> float:
        return A * math.sin(OMEGA * t_1) + v * (x - t_1) - A * math.sin(OMEGA * x)

    later = np.arange(t_1 + 0.2, t_1 + T, 1e-3)
    k = next(i for i, x in enumerate(later) if gap(x) < 0.0)
    t_2 = brentq(gap, later[k - 1], later[k])
    assert float(run.t_lift_off) == pytest.approx(t_1, abs=ELASTIC_TIME)
    assert float(run.t_second_hit) == pytest.approx(t_2, abs=2.0 * ELASTIC_TIME)
    assert float(run.v_second_hit_max) == pytest.approx(A * OMEGA * math.cos(OMEGA * t_2) - v, rel=ELASTIC_SPEED)
    assert "second hit" in str(run.status.item())
    assert f"{int(run.second_hits)} times" in str(run.notes.item())


def test_above_the_speed_of_the_deck_no_start_has_a_second_hit():
    """A line steeper than the sine at its steepest, A w, meets it once."""
    found = hoisting_speed(CRANE, off(0.3, "12 s"), [0.2, 1.1 * A * OMEGA], starts=8)
    assert found.span == T
    assert found.rows[0].share > 0.0
    assert found.rows[0].v_hit < A * OMEGA + 0.2
    assert found.lowest == 1.1 * A * OMEGA
    assert found.rows[1].share == 0.0


def test_a_deck_far_below_changes_no_bit_and_one_lane_is_as_sixteen():
    above = {"start_depth": "-12 m", "duration": "20 s", "tip": tip_motion(realise(sea(2.0), 60.0), RAO, X, Y)}
    programme = (Phase(mode="ahc", time="10 s"), Phase(mode="manual", speed="6 m/min", depth="-11 m"))
    dry = box().model_copy(update={"C_D": 0.0})
    bare = lift(Deck(height="1 m"), programme, payload=dry, **above)
    with_deck = simulate(CRANE, bare, every="0.1 s")
    without = simulate(CRANE, bare.model_copy(update={"deck": None}), every="0.1 s")
    for name in ("F_w", "s_w", "z_load", "e_c", "F_sling"):
        assert np.array_equal(with_deck[name], without[name]), name
    cases = [off(v, "12 s", duration="40 s") for v in (0.2, 0.3, 0.4)]
    many = simulate(CRANE, cases * 3)
    one = simulate(CRANE, cases[1], series=False)
    assert many.t_lift_off.values[1::3].tolist() == [float(one.t_lift_off)] * 3
    assert many.F_deck_max.values[1] == float(one.F_deck_max)


def test_a_payload_that_stays_on_its_deck_is_carried_by_it():
    run = simulate(CRANE, lift(Deck(height="6 m", motion="sine 1 m 8 s", slack="3 m"), duration="40 s"), every="0.1 s")
    last = run.sel(time=slice(20.0, 40.0))
    assert np.allclose(last.z_deck - last.z_load, last.F_deck / (1e5 * G / 5e-3), atol=2e-4)
    assert np.allclose(last.F_deck, 1e5 * (G - OMEGA**2 * (last.z_deck - 6.0)), rtol=2e-3)
    assert math.isnan(float(run.t_lift_off))
    assert float(run.sling_slack_time) == 0.0
    assert "sling" not in str(run.status.item())


SET_DOWN = (
    Phase(mode="ahc", time="30 s"),
    Phase(mode="landing", speed="12 m/min", tension="100 kN", time="10 s"),
)


def test_a_winch_that_follows_the_deck_sets_down_at_the_lowering_speed():
    cases = [
        lift(
            Deck(height="6 m", motion="sine 2 m 30 s 40 deg", followed=followed),
            SET_DOWN,
            start_depth="-9 m",
            duration="70 s",
        )
        for followed in (True, False)
    ]
    followed, alone = (simulate(CRANE, case, every="0.1 s") for case in cases)
    assert float(followed.v_landed) == pytest.approx(0.2, rel=FOLLOWED)
    assert abs(float(alone.v_landed) - 0.2) > 10.0 * FOLLOWED * 0.2
    held = followed.sel(time=slice(15.0, 30.0))
    moved = float(np.ptp(held.z_deck.values))
    assert moved > 3.0
    assert float(np.ptp((held.z_load - held.z_deck).values)) < LEFT * moved
    assert float(np.abs(held.e_c).max()) < LEFT * moved
    assert float(followed.phase_s_tip_pp[0]) == pytest.approx(moved, rel=0.3)
    assert float(followed.phase_eta_c[0]) > 1.0 - LEFT
    assert float(followed.phase_eta_load[0]) > 1.0 - LEFT


def test_the_reference_is_the_tip_less_the_deck_as_its_unit_measures_it():
    tip, deck = (Deck(height="1 m", motion=text).motion for text in ("sine 1 m 9 s", "sine 0.5 m 7 s"))
    of = TipOverDeck(tip, deck, 0.3, 0.0, 0.0, 0)
    t = np.linspace(1.0, 30.0, 200)
    assert np.allclose(of.measured(t)[1], tip.sample(t)[1] - deck.sample(t - 0.3)[1])
    assert np.array_equal(of.sample(t)[0], tip.sample(t)[0])
    noisy = TipOverDeck(tip, deck, 0.3, 0.02, 0.05, 4)
    t = np.arange(0.0, 100.0, 0.01)
    s, v, _ = (x - y for x, y in zip(noisy.measured(t), of.measured(t), strict=True))
    assert (s.std(), v.std()) == pytest.approx((0.02, 0.05), rel=0.03)
    assert np.array_equal(noisy.measured(t[5000:5100])[0], noisy.measured(t)[0][5000:5100])


OTHER = OtherVessel(RAO, TipPoint(-10.0, 3.0), heading=math.radians(20.0), position=(30.0, -45.0))


def test_tip_less_deck_is_the_relative_motion_of_the_same_waves():
    waves = realise(sea(2.0), 200.0, 3, depth=80.0)
    tip, deck, both = (
        tip_motion(waves, of, X, Y) for of in (RAO, DeckMotion(OTHER, 80.0), RelativeMotion(RAO, OTHER, 80.0))
    )
    t = np.linspace(0.0, 150.0, 500)
    assert np.allclose(tip.sample(t)[0] - deck.sample(t)[0], both.sample(t)[0], atol=1e-9)


@pytest.mark.long
def test_runs_of_a_table_have_the_deck_of_the_other_vessel_and_are_stored(tmp_path):
    calm = lift(Deck(height="6 m"), SET_DOWN, start_depth="-9 m", duration="60 s")
    cases = [InSea(calm, sea(1.5), seed, RAO, X, Y, other=OTHER) for seed in (0, 1)]
    run = simulate(CRANE, cases)
    waves = realise(sea(1.5), 60.0, 0, depth=calm.depth)
    deck = tip_motion(waves, DeckMotion(OTHER, calm.depth), X, Y, fine=Resolution.COARSE.angle)
    whole = cases[0].lowering()
    assert np.array_equal(whole.deck.motion.sample([7.0])[0], deck.sample([7.0])[0])
    single = simulate(CRANE, whole, series=False)
    assert float(single.F_deck_max) == float(run.F_deck_max[0])
    assert float(run.F_deck_max[0]) != float(run.F_deck_max[1])
    save_run(run, tmp_path / "run.nc")
    assert rerun(load_run(tmp_path / "run.nc")).v_landed.values.tolist() == run.v_landed.values.tolist()


ON = {"height": "6 m", "slack": "1 m"}
REFUSED = [
    ({"height": "6 m"}, {}, 'start_depth = -6 m: the payload would hang in the deck, 6 m above the water. Start above it'),
    (ON, {"start_depth": "-7 m"}, 'with deck.slack the payload starts on the deck, 6 m above the water. Give start_depth = "-6 m".'),
    (ON | {"motion": "sine 1 m 8 s"}, {"ramp": "0 s"}, 'ramp = 0 s: a payload that starts on a deck starts at rest.'),
    (ON, {"programme": (Phase(mode="manual", speed="6 m/min", depth="3 m"),)}, "depth = 3 m is below the water, and a lift with a deck is in air."),
    ({"height": "0 m"}, {}, "height"),
    (ON | {"restitution": 1.5}, {}, "restitution"),
    (ON | {"settlement": "0 mm"}, {}, "settlement"),
    (ON | {"motion": "up and down"}, {}, '"up and down" is not a motion'),
    (ON | {"colour": "red"}, {}, "colour"),
]  # fmt: skip


@pytest.mark.parametrize(("deck", "more", "text"), REFUSED, ids=[text[:20] for _, _, text in REFUSED])
def test_what_cannot_be_is_refused_in_one_line(deck, more, text):
    with pytest.raises(StillhookError) as problem:
        simulate(CRANE, lift(Deck(**deck), **more))
    assert text in str(problem.value)
    assert "\n" not in str(problem.value)


UNIT = read_compensator("phc-60t")


def test_a_passive_compensator_on_a_slack_wire_is_fully_in_and_comes_out_as_it_takes_up_the_load():
    """Off the deck it ends with the stroke, and the tension, of one that hung there from the start; joules are found
    again."""
    programme = (Phase(mode="manual", time="12 s"), Phase(mode="manual", speed="-12 m/min", depth="-12 m"))
    off = lift(
        Deck(height="6 m", motion="sine 0.2 m 8 s", slack="3 m"),
        (*programme, Phase(mode="manual", time="30 s")),
        payload=box("60 t"),
        compensator=UNIT,
        h_tip="60 m",
        duration="90 s",
    )
    hangs = lift(Deck(height="1 m"), payload=box("60 t"), compensator=UNIT, h_tip="60 m", start_depth="-12 m")
    run, still = (simulate(CRANE, case, every="0.1 s", step="2 ms") for case in (off, hangs))
    before = run.sel(time=slice(None, 20.0))
    assert float(before.s_c.max()) == 0.0
    assert float(before.F_sling.max()) == 0.0
    assert float(run.s_c[-1]) == pytest.approx(float(still.s_c[-1]), abs=0.01)
    assert float(run.F_sling[-1]) == pytest.approx(float(still.F_sling[-1]), rel=1e-3)
    assert float(run.z_load[-1]) == pytest.approx(12.0, abs=0.02)
    assert abs(float(run.energy_unaccounted)) < 1e-4
    assert float(run.DAF) < float(simulate(CRANE, off.model_copy(update={"compensator": None}), series=False).DAF)


def test_a_unit_with_a_body_between_hook_and_slings_does_not_start_above_a_deck():
    heavy = type("Heavy", (type(UNIT),), {"mass": property(lambda unit: 20e3)}).model_construct(**dict(UNIT))
    case = lift(Deck(height="6 m", slack="1 m")).model_copy(update={"compensator": heavy})
    with pytest.raises(StillhookError, match="compensator: its body between hook and slings has no place at rest"):
        check_lift(CRANE, case)


def test_clearance_is_the_least_height_over_the_deck_as_it_comes_closer():
    """Of the series: 0 where it is hit, and the height of its lowest turn where it is not."""
    hit, clear = (simulate(CRANE, off(v, "22 s"), every="0.02 s", step="2 ms") for v in (0.3, 0.6))
    assert float(hit.z_clear_min) == 0.0
    after = clear.sel(time=slice(float(clear.t_lift_off) + 0.5, None))
    gap = (after.z_load - after.z_deck).values
    falls = np.diff(gap) < 0.0
    assert float(clear.z_clear_min) == pytest.approx(gap[1:][falls].min(), abs=0.02)


def test_hoisting_speeds_need_a_lift_off_a_deck():
    with pytest.raises(StillhookError, match="a first phase that waits"):
        hoisting_speed(CRANE, lift(Deck(height="6 m"), SET_DOWN, start_depth="-9 m"), [0.2])
    with pytest.raises(StillhookError, match="give one or more above 0 m/s"):
        hoisting_speed(CRANE, off(0.3, "12 s"), [0.0])
    moving = tip_motion(realise(sea(1.0), 90.0), RAO, X, Y)
    with pytest.raises(StillhookError, match="all speeds and starts take"):
        hoisting_speed(CRANE, off(0.3, "12 s", tip=moving), [0.1])
