"""The tension loop damps the load on a long wire, and is SSC where it has nothing to give."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stillhook import Profile, Scenario, load_crane, load_lift, simulate
from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.places import Place
from stillhook.control.controllers.rope import WANDER
from stillhook.library import changed
from stillhook.spec.scenario import Mode

LIFT = """name = "hold"
crane = "deep-250t"
payload = "{payload}"
start_depth = "{depth} m"
[sensors]
seed = 5
F.noise = "{noise} kN"
[tip]
height = "36 m"
motion = "sine 0.5 m {T} s"
[water]
depth = "{bottom} m"
[rigging]
height = "12 m"
[wire]
nodes = 20
"""
HOLD = '[[phase]]\nname = "hold"\nmode = "{mode}"\ntime = "160 s"\n'
DOWN = """[[phase]]
name = "stop"
mode = "ahc"
time = "40 s"
[[phase]]
name = "landing"
mode = "landing"
speed = "9 m/min"
tension = "150 kN"
time = "20 s"
"""
SEA = """[sea]
wave = "jonswap Hs=2.5 m Tp=8 s gamma=2"
heading = "165 deg"
seed = {seed}
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
"""
THROUGH_THE_SURFACE = """[[phase]]
name = "through the surface"
mode = "ahc"
speed = "9 m/min"
depth = "20 m"
[[phase]]
name = "hold"
mode = "ahc"
time = "60 s"
"""
SETTLED = 100.0
"""Time after which the load of a hold is looked at [s]: several natural periods of load and wire."""


def lift(
    path: Path,
    controller: str,
    phases: str,
    *,
    depth=2000,
    T=6,
    payload="suction-anchor-85t",
    noise=0,
    above=200,
    sensors="",
):
    text = LIFT.format(payload=payload, depth=depth, T=T, noise=noise, bottom=depth + above) + phases
    text = text.replace("[tip]", f"{sensors}\n[tip]")
    (path / "lift.toml").write_text(f'controller = "{controller}"\n{text}', encoding="utf-8")
    file = load_lift(path / "lift.toml")
    return simulate(file.crane, file.lift, series=True)


def in_a_sea(path: Path, controller: str, phases: str, *, payload="mud-mat-25t", seed=1):
    """From 3 m above the surface, in waves."""
    plain = LIFT.format(payload=payload, depth=-3, T=9, noise=5, bottom=200)
    text = 'vessel = "construction-vessel-130m"\n' + plain.split("[tip]")[0] + SEA.format(seed=seed)
    text += "[water]" + plain.split("[water]")[1] + phases
    (path / "lift.toml").write_text(f'controller = "{controller}"\n{text}', encoding="utf-8")
    file = load_lift(path / "lift.toml")
    return simulate(file.crane, file.lift, series=True)


def motion(path: Path, controller: str, mode: str = "ahc", **of) -> float:
    """Standard deviation of the load [m]."""
    run = lift(path, controller, HOLD.format(mode=mode), **of)
    return float(np.std(run.z_load.values.ravel()[run.time.values > SETTLED]))


@pytest.mark.long
@pytest.mark.parametrize(
    ("payload", "depth", "T", "most"),
    [
        ("suction-anchor-85t", 2000, 8, 0.3),
        ("ventilated-box-30t", 2000, 5, 0.3),
        ("template-120t", 3000, 8, 0.3),
        ("manifold-60t", 2000, 6, 0.3),
        ("suction-anchor-85t", 300, 10, 1.0),
    ],
)
def test_the_load_near_resonance_is_stiller_than_under_a_still_wire(tmp_path, payload, depth, T, most):
    of = {"depth": depth, "T": T, "payload": payload, "noise": 5}
    damped, ssc = (motion(tmp_path, controller, **of) for controller in ("rope", "ssc"))
    assert damped < most * ssc
    assert damped < motion(tmp_path, "ssc", "manual", **of)


def test_where_noise_asks_for_as_much_wire_as_the_load_the_winch_is_left_with_ssc(tmp_path):
    of = {"depth": 1000, "T": 12, "payload": "spool-20t", "noise": 5}
    damped, ssc = (motion(tmp_path, controller, **of) for controller in ("rope", "ssc"))
    assert damped == pytest.approx(ssc, rel=1e-4)


SWINGING = "sine 0.4 m 6.1 s + sine 0.5 m 7.3 s + sine 0.4 m 8.9 s"
CHANGED = (60.0, 62.37, 64.74)
"""Times of a change of mode at other parts of the load's swing [s]."""


@pytest.mark.parametrize("before", ["manual", "hs"])
def test_a_load_that_swings_when_the_loop_comes_into_force_is_not_given_wire_for_its_swing(before):
    """Until the mean force is known the winch has SSC; then the wire is given for what differs from that mean."""

    def case(at: float, mode: str) -> Scenario:
        times = {"duration": "150 s", "warm_up": "0 s", "modes": [(f"{at} s", mode)]}
        return Scenario(load="120 t", s_w="1000 m", tip=SWINGING, mode=before, **times)

    cases = [case(at, mode) for mode in ("rope", "ssc") for at in CHANGED]
    run = simulate(load_crane("deep-250t"), cases, every="100 ms", series=True)
    t, load = run.time.values, run.s_load.values
    after = [(t > c + 20.0) & (t < c + 80.0) for c in 2 * CHANGED]
    swing = np.array([np.ptp(z[seen]) for z, seen in zip(load, after, strict=True)]).reshape(2, -1)
    error = [np.abs(e[seen]).max() for e, seen in zip(run.e_c.values[: len(CHANGED)], after, strict=False)]
    assert (swing[0] < 0.8 * swing[1]).all()
    assert max(error) < 0.06  # the wire given for a load that hardly swings, and SSC's error


def test_noise_of_the_load_cell_costs_no_more_than_the_wander_that_is_allowed(tmp_path):
    """5 s is quicker than this load on 3,000 m of wire: it hardly moves, and the loop has nothing to damp."""
    damped, ssc = (motion(tmp_path, controller, depth=3000, T=5, noise=5) for controller in ("rope", "ssc"))
    assert damped < ssc + WANDER


def test_the_load_lands_no_faster_than_with_ssc_and_is_not_lifted_again(tmp_path):
    """The fastest of several landings: each meets another part of the swing that the start of the lowering leaves."""
    worst = {}
    for controller in ("rope", "ssc"):
        of = {"payload": "manifold-60t", "depth": 3000, "T": 9}
        runs = [lift(tmp_path, controller, DOWN, above=above, **of) for above in (4.0, 4.4, 4.8, 5.2)]
        worst[controller] = max(float(run.v_hit_max.item()) for run in runs)
        for run in runs:
            after = run.time.values > float(run.t_landed.item()) + 10.0
            assert np.min(run.F_bottom.values.ravel()[after]) > 0.0
    assert worst["rope"] < worst["ssc"]


@pytest.mark.long
def test_slack_slings_in_the_splash_zone_neither_jerk_the_winch_nor_take_more_wire(tmp_path):
    """The loop fades where the load cell deviates by a tenth of the weight, and acts again under the waves."""
    runs = {c: in_a_sea(tmp_path, c, THROUGH_THE_SURFACE) for c in ("rope", "ssc")}
    rope, ssc = (runs[c] for c in ("rope", "ssc"))
    assert np.min(ssc.F_sling.values) == 0.0
    assert np.max(np.abs(np.diff(rope.u_p.values.ravel()))) < 1.1 * np.max(np.abs(np.diff(ssc.u_p.values.ravel())))
    assert np.max(np.abs(rope.e_c.values)) < np.max(np.abs(ssc.e_c.values)) + 0.02
    assert float(rope.sling_slack_time.item()) < 1.1 * float(ssc.sling_slack_time.item())


@pytest.mark.long
@pytest.mark.parametrize(
    "error",
    [{"noise": 5, "sensors": 'F.drift = "24.5 kN"'}, {"noise": 5, "sensors": 'F.offset = "24.5 kN"'}, {"noise": 10}],
)
def test_a_load_cell_that_is_off_by_a_hundredth_of_the_swl_changes_nothing(tmp_path, error):
    """Drift in an hour, and offset; and twice the noise that is stated."""
    exact, off = (motion(tmp_path, "rope", depth=2000, T=8, **of) for of in ({"noise": 5}, error))
    assert off < 1.05 * exact


def test_a_change_of_mode_is_without_a_bump():
    """Half way through a heave from manual mode, and then to SSC while wire is given."""
    steps = {}
    for controller in ("rope", "ssc"):
        case = Scenario(
            load="100 t",
            s_w="2000 m",
            tip="sine 1 m 9 s",
            mode="manual",
            modes=(("31 s", controller), ("50 s", "ssc")),
            duration="70 s",
            warm_up="0 s",
        )
        run = simulate(load_crane("deep-250t"), case)
        steps[controller] = float(np.max(np.abs(np.diff(run.u_p.values.ravel()))))
    assert steps["rope"] < 1.1 * steps["ssc"]


@pytest.mark.parametrize("s_w", [200.0, 1000.0])
def test_the_linear_loop_has_the_tension_loop_which_lets_the_position_gain_be_larger(s_w):
    ssc, rope = (place_limits(load_crane("deep-250t"), Mode(m), [Place(120e3, s_w, 0.5)])[0] for m in ("ssc", "rope"))
    assert rope.gains.high > 1.2 * ssc.gains.high
    assert rope.loop is not None
    assert np.max(np.abs(rope.loop.closed_poles(0.16))) < 1.0


@pytest.mark.parametrize(("K_c", "stable"), [(2.0, False), (2.8, True)])
def test_the_twin_swings_where_the_linear_tension_loop_is_unstable_and_only_there(K_c, stable):
    """A filter of 50 ms on 200 m of wire: the oil's resonance limits the loop, at a third of the c that is shipped.
    The limits of speed and load are taken away, so that a swing grows."""
    of_loop = {"K_c": K_c, "noise": 0.0, "tau_f": "50 ms", "v_max": "2 m/s", "share": 1.0}
    crane = changed(load_crane("deep-250t"), {"control": {"rope": of_loop}})
    (at,) = place_limits(crane, Mode("rope"), [Place(120e3, 200.0, 0.5)])
    assert at.loop is not None
    assert bool(np.max(np.abs(at.loop.closed_poles(crane.control.K_p))) < 1.0) is stable
    tip = Profile([("0 s", "0 m/s"), ("5 s", "0.5 m/s"), ("90 s", "0.5 m/s"), ("95 s", "0 m/s")])
    case = Scenario(load="120 t", s_w="174 m", tip=tip, mode="rope", duration="82 s", warm_up="0 s", ramp="0 s")
    run = simulate(crane, case)
    late = run.v_w.values.ravel()[run.time.values > 67.0]
    assert bool(np.std(late) < 0.002) is stable
