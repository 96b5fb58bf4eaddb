"""What the winch modes of a lift order, cycle by cycle, on loads simple enough to reckon by hand."""

import itertools
import math
from collections.abc import Callable

import pytest

from stillhook.control.plc import MANUAL
from stillhook.control.registry import code_of
from stillhook.control.supervisor import (
    STAGE_AHC,
    STAGE_LANDING,
    STAGE_MANUAL,
    STAGE_SPLASH,
    STAGE_TENSION,
    STOPPED,
    UNTIL_LANDED,
    UNTIL_TENSION,
    UNTIL_TIME,
    UNTIL_WIRE,
    LiftSettings,
    Orders,
    Stage,
    Supervisor,
    Watch,
    supervise,
    supervisor_at_rest,
)

pytestmark = pytest.mark.slow

SSC = code_of("ssc")
CYCLE = 0.01
SET = LiftSettings(
    t_cycle=CYCLE,
    a_max=0.2,
    v_max=0.5,
    v_enter=0.1,
    omega_T=0.5,
    v_soft=0.9,
    F_soft=3.0e6,
    omega_soft=5.0,
    omega_s=0.1,
    tau_F=0.5,
    tau_slow=20.0,
    tau_suspended=200.0,
    t_fade=2.0,
    F_landed=0.5e6,
    F_least=15e3,
    EA=8.4e8,
    L_0=60.0,
    q_dry=0.0,
    q_wet=0.0,
    h_tip=30.0,
    code=SSC,
)
F_0 = 1.0e6
AT_TARGET = 5e-3
"""Wire at the end of a stop against its target [m]: less than a cycle at full speed; measured 0.1 mm, and 4.6 mm in splash mode, whose return
to the slow position lags."""
ROUNDING = 1e-9
"""Sums of ten thousand cycles in doubles."""

Force = Callable[[float, float], float]


def stage(
    mode: float,
    v: float = 0.0,
    until: float = UNTIL_TIME,
    value: float = 1e6,
    F_set: float = 0.0,
    last: float = 1.0,
    v_end: float = 0.0,
) -> Stage:
    return Stage(mode, v, F_set, until, value, timeout=3600.0, last=last, v_end=v_end)


def hangs(t: float, s_w: float) -> float:
    return F_0


def run(
    stages: list[Stage],
    duration: float,
    *,
    force: Force = hangs,
    v_tip: Force = lambda t, s_w: 0.0,
    s_w: float = 100.0,
    settings: LiftSettings = SET,
    heave: Callable[[float], float] = lambda t: 0.0,
    winch: Callable[[float], float] = lambda v_op: v_op,
) -> list[tuple[Watch, Orders, Supervisor]]:
    """`force` is the tension over time and wire out; `winch` the speed that a winch makes of the speed asked of it; where it compensates the
    wire goes with `heave` of the tip."""
    m, rows = supervisor_at_rest(Watch(0.0, s_w, force(0.0, s_w), 0.0, 0.0), settings), []
    for k in range(round(duration / CYCLE)):
        t = k * CYCLE
        y = Watch(t, s_w, force(t, s_w), heave(t), v_tip(t, s_w))
        orders, m = supervise(y, m, stages[int(m.stage)], settings)
        rows.append((y, orders, m))
        s_w -= winch(orders.v_op) * CYCLE
        s_w += heave(t + CYCLE) - heave(t) if orders.mode > MANUAL else 0.0
    return rows


def test_the_joystick_ramps_and_its_integral_is_the_wire_asked_for():
    rows = run([stage(STAGE_AHC, v=-0.3)], 10.0)
    speeds = [o.v_op for _, o, _ in rows]
    assert max(abs(b - a) for a, b in itertools.pairwise(speeds)) <= SET.a_max * CYCLE + ROUNDING
    assert speeds[-1] == pytest.approx(-0.3)
    # A ramp of 1.5 s and the rest at full speed: 0.3 (10 - 0.75) m, less half a cycle's speed at the first sample.
    assert rows[-1][1].s_op == pytest.approx(-0.3 * (10.0 - 0.75), abs=0.3 * 2 * CYCLE)
    assert {o.mode for _, o, _ in rows} == {SSC}


def test_manual_mode_does_not_compensate_and_leaves_the_passive_circuit_alone():
    orders = [o for _, o, _ in run([stage(STAGE_MANUAL, v=0.1)], 3.0)]
    assert {(o.mode, o.hold) for o in orders} == {(MANUAL, 0.0)}


def test_a_stage_ends_where_its_wire_is_out_and_the_next_begins():
    rows = run(
        [
            stage(STAGE_AHC, v=-0.2, until=UNTIL_WIRE, value=101.0, last=0.0),
            stage(STAGE_AHC, until=UNTIL_TIME, value=5.0),
        ],
        30.0,
    )
    turn = next(y for y, _, m in rows if m.stage == 1.0)
    assert turn.s_w == pytest.approx(101.0, abs=STOPPED)
    done = next(y for y, _, m in rows if m.done)
    assert done.t - turn.t == pytest.approx(5.0, abs=3 * CYCLE)
    assert rows[-1][1].v_op == 0.0
    assert rows[-1][1].mode == SSC


def test_hoisting_ends_where_the_wire_has_come_in():
    rows = run([stage(STAGE_MANUAL, v=0.2, until=UNTIL_WIRE, value=99.0)], 30.0)
    assert next(y.s_w for y, _, m in rows if m.done) == pytest.approx(99.0, abs=STOPPED)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [STAGE_MANUAL, STAGE_AHC, STAGE_SPLASH])
@pytest.mark.parametrize("way", [20.0, 0.5, -20.0])
def test_a_stage_before_a_stop_comes_to_rest_on_its_wire_and_not_beyond_it(mode, way):
    """From 0.6 m/s the ramp of 0.2 m/s^2 takes 0.9 m, and of a way of 0.5 m it leaves room for less speed."""
    target, v = 100.0 + way, -math.copysign(0.6, way)
    rows = run([stage(mode, v=v, until=UNTIL_WIRE, value=target, last=0.0), stage(mode, value=30.0)], 80.0)
    assert rows[-1][2].done
    assert rows[-1][0].s_w == pytest.approx(target, abs=AT_TARGET)
    assert max((y.s_w - target) * math.copysign(1.0, way) for y, _, _ in rows) < AT_TARGET
    speeds = [o.v_op for _, o, _ in rows]
    assert (
        max(abs(b - a) for a, b in itertools.pairwise(speeds)) < 1.3 * SET.a_max * CYCLE
    )  # the return of splash mode adds to the ramp
    # no later than the ramps need: a trapezium of speed, or a triangle
    top = min(0.6, math.sqrt(SET.a_max * abs(way)))
    needed = abs(way) / top + top / SET.a_max
    assert next(y.t for y, _, m in rows if m.stage == 1.0) == pytest.approx(needed, abs=1.0)


def test_a_stage_before_one_of_the_same_speed_does_not_slow_down():
    down = stage(STAGE_AHC, v=-0.3, until=UNTIL_WIRE, value=105.0, last=0.0, v_end=-0.3)
    rows = run([down, stage(STAGE_AHC, v=-0.3, until=UNTIL_WIRE, value=110.0)], 60.0)
    passes = next(i for i, (_, _, m) in enumerate(rows) if m.stage == 1.0)
    assert rows[passes][0].s_w == pytest.approx(105.0, abs=0.3 * 2 * CYCLE)
    assert all(o.v_op == pytest.approx(-0.3) for _, o, _ in rows[passes - 300 : passes + 300])


def test_a_stage_before_a_slower_one_passes_its_wire_at_that_speed():
    down = stage(STAGE_AHC, v=-0.5, until=UNTIL_WIRE, value=105.0, last=0.0, v_end=-0.1)
    rows = run([down, stage(STAGE_AHC, v=-0.1)], 40.0)
    y, o, _ = next(row for row in rows if row[2].stage == 1.0)
    assert y.s_w == pytest.approx(105.0, abs=0.5 * 2 * CYCLE)
    assert o.v_op == pytest.approx(-0.1, abs=2.0 * SET.a_max * CYCLE)


def test_wire_that_compensation_adds_for_the_tip_does_not_end_a_stage():
    """The tip heaves by 1.5 m and the wire with it: the stage ends where the joystick has paid out its way, not on the first crest."""
    heave = lambda t: 1.5 * math.sin(2.0 * math.pi * t / 8.0)
    rows = run(
        [stage(STAGE_AHC, v=-0.2, until=UNTIL_WIRE, value=110.0, last=0.0), stage(STAGE_AHC, value=10.0)],
        90.0,
        heave=heave,
    )
    assert rows[-1][2].done
    y = rows[-1][0]
    assert y.s_w - y.s_tip == pytest.approx(110.0, abs=AT_TARGET)
    assert max(y.s_w for y, _, m in rows if m.stage == 0.0) > 110.2


@pytest.mark.thorough
@pytest.mark.parametrize("lost", [0.02, 0.1, -0.1])
@pytest.mark.parametrize("v", [-0.5, -0.1, 0.3])
def test_manual_mode_pays_out_what_the_joystick_asks_for_though_the_winch_leaks(v, lost):
    """Pumps that deliver less, and oil that creeps past the motors whichever way they turn."""
    leaks = lambda v_op: (1.0 - lost) * v_op + 0.1 * abs(lost)
    rows = run([stage(STAGE_MANUAL, v=v, value=100.0)], 100.0, winch=leaks)
    late = [(y.t, y.s_w) for y, _, _ in rows if y.t > 60.0]
    speed = (late[-1][1] - late[0][1]) / (late[-1][0] - late[0][0])
    assert speed == pytest.approx(-v, rel=2e-3)
    begun = 100.0 - v * (late[-1][0] - 0.5 * abs(v) / SET.a_max)
    leak = (abs(lost * v) + 0.1 * abs(lost)) / min(1.0 - lost, 1.0)
    behind = leak / SET.omega_s  # drives the correction, and grows no more however long it is lowered
    assert abs(late[-1][1] - begun) < 1.01 * behind


def test_manual_mode_at_rest_asks_for_nothing_though_the_winch_sinks():
    """A brake closes on a command of zero: no correction may hold it open, and what was lost at rest is not made up for afterwards."""
    sinks = lambda v_op: v_op - 0.02
    stages = [
        stage(STAGE_MANUAL, v=-0.2, value=10.0, last=0.0),
        stage(STAGE_MANUAL, value=60.0, last=0.0),
        stage(STAGE_MANUAL, v=-0.2),
    ]
    rows = run(stages, 80.0, winch=sinks)
    stands = [o.v_op for y, o, _ in rows if 15.0 < y.t < 69.0]
    assert set(stands) == {0.0}
    speeds = [o.v_op for _, o, _ in rows]
    assert max(abs(b - a) for a, b in itertools.pairwise(speeds)) < 1.3 * SET.a_max * CYCLE
    assert min(speeds) > -0.2 * 1.25 - ROUNDING


def test_compensation_waits_for_the_tip_to_turn():
    v_tip = lambda t, s_w: math.cos(2.0 * math.pi * t / 8.0)
    rows = run([stage(STAGE_AHC, v=-0.1)], 8.0, v_tip=v_tip)
    first = next(y for y, o, _ in rows if o.mode == SSC)
    assert abs(first.v_tip) <= SET.v_enter
    assert 1.7 < first.t < 2.0  # the crest comes at 2 s
    assert all(o.v_op == 0.0 and o.mode == MANUAL for y, o, _ in rows if y.t < first.t)


def test_a_stage_after_a_compensated_one_does_not_wait_for_the_tip_to_turn():
    stages = [stage(STAGE_AHC, until=UNTIL_TIME, value=1.0, last=0.0), stage(STAGE_AHC, v=-0.1)]
    rows = run(stages, 3.0, v_tip=lambda t, s_w: 1.0 if t > 0.0 else 0.0)
    assert all(o.mode == SSC for _, o, _ in rows)


@pytest.mark.parametrize("mode", [STAGE_AHC, STAGE_TENSION, STAGE_SPLASH, STAGE_LANDING])
def test_a_slack_wire_is_waited_for_and_in_the_end_the_programme_is_stuck(mode):
    it = stage(mode, v=-0.1, F_set=2e5)._replace(timeout=5.0)
    rows = run([it], 6.0, force=lambda t, s_w: 0.0)
    assert all(o.v_op == 0.0 and o.hold == 0.0 and o.mode == MANUAL for _, o, _ in rows)
    stuck = next(y.t for y, _, m in rows if m.stuck)
    assert stuck == pytest.approx(5.0, abs=2 * CYCLE)
    assert not rows[-1][2].done


def test_a_stage_whose_end_never_comes_is_stuck_with_the_joystick_at_rest():
    it = stage(STAGE_AHC, v=-0.2, until=UNTIL_LANDED)._replace(timeout=5.0)
    rows = run([it], 10.0)
    assert rows[-1][2].stuck == 1.0
    assert rows[-1][1].v_op == 0.0
    assert rows[-1][1].mode == SSC


def stands(k: float, s_w_0: float) -> Force:
    """A load on the ground: the wire's stretch is what is not out."""
    return lambda t, s_w: max(F_0 - k * (s_w - s_w_0), 0.0)


@pytest.mark.long
def test_constant_tension_takes_a_standing_load_to_its_set_value_from_either_side():
    k = SET.EA / (SET.L_0 + 1000.0)
    for F_set in (0.3 * F_0, 1.4 * F_0):
        rows = run([stage(STAGE_TENSION, F_set=F_set)], 60.0, force=stands(k, 1000.0), s_w=1000.0)
        assert rows[-1][0].F == pytest.approx(F_set, rel=1e-3)
        late = [y.F for y, _, _ in rows[2000:]]
        assert all(abs(b - F_set) <= abs(a - F_set) + 1.0 for a, b in itertools.pairwise(late))
        speeds = [o.v_op for _, o, _ in rows]
        assert max(map(abs, speeds)) <= SET.v_max
        # bumpless: from rest, no faster than the set value moves (t_fade) through the filter allows
        assert max(abs(b - a) for a, b in itertools.pairwise(speeds)) < 0.02
        assert all(o.hold == 1.0 and o.mode == SSC for _, o, _ in rows)


def test_tension_control_ends_where_the_tension_is_reached():
    k = SET.EA / (SET.L_0 + 1000.0)
    down = stage(STAGE_TENSION, F_set=0.3 * F_0, until=UNTIL_TENSION, value=0.35 * F_0)
    rows = run([down], 60.0, force=stands(k, 1000.0), s_w=1000.0)
    assert next(y.F for y, _, m in rows if m.done) == pytest.approx(0.35 * F_0, rel=0.1)
    assert next(m.F_1 for _, _, m in rows if m.done) <= 0.35 * F_0


def test_landing_keeps_its_speed_until_the_load_stands_and_then_holds_the_set_tension():
    bottom, k = 1001.0, SET.EA / (SET.L_0 + 1000.0)
    force = lambda t, s_w: F_0 if s_w < bottom else max(F_0 - k * (s_w - bottom), 0.0)
    rows = run(
        [stage(STAGE_LANDING, v=-0.1, F_set=0.4 * F_0, until=UNTIL_TIME, value=30.0)], 120.0, force=force, s_w=1000.0
    )
    down = next(y for y, _, m in rows if m.landed)
    assert 0.4 * F_0 < down.F < 0.5 * F_0  # half the weight has gone, and the filter's lag
    before = [o for y, o, _ in rows if 2.0 < y.t < down.t]
    assert all(o.v_op == pytest.approx(-0.1) and o.hold == 0.0 for o in before)
    done = next(y for y, _, m in rows if m.done)
    assert done.t - down.t == pytest.approx(30.0, abs=3 * CYCLE)  # the time counts from touch-down
    assert done.F == pytest.approx(0.4 * F_0, rel=0.02)


def test_a_load_that_swings_a_little_has_not_landed():
    force = lambda t, s_w: F_0 * (1.0 + 0.25 * math.sin(2.0 * math.pi * t / 8.0))
    rows = run([stage(STAGE_LANDING, v=-0.1, F_set=0.4 * F_0, until=UNTIL_LANDED)], 60.0, force=force)
    assert not any(m.landed for _, _, m in rows)


@pytest.mark.long
def test_a_landing_so_slow_that_the_mean_follows_is_still_noticed():
    rows = run(
        [stage(STAGE_LANDING, v=-0.02, F_set=0.3 * F_0, until=UNTIL_LANDED)], 300.0, force=stands(F_0 / 4.0, 100.0)
    )
    assert any(m.landed for _, _, m in rows)  # 200 s from full tension to none


@pytest.mark.long
def test_splash_mode_gives_way_to_the_force_of_a_wave_and_keeps_its_slow_position():
    force = lambda t, s_w: F_0 * (1.0 + 0.3 * math.sin(2.0 * math.pi * t / 8.0))
    rows = run([stage(STAGE_SPLASH, v=-0.1)], 240.0, force=force)
    late = rows[16000:]
    speeds = [o.v_op + 0.1 for _, o, _ in late]
    assert (
        0.5 < (max(speeds) - min(speeds)) / (2.0 * 0.3 * F_0 / SET.F_soft * SET.v_soft) < 1.0
    )  # a filter of 0.5 s takes a part at 8 s
    pull = [math.sin(2.0 * math.pi * y.t / 8.0) for y, _, _ in late]
    assert sum(p * v for p, v in zip(pull, speeds, strict=True)) < 0.0  # pays out while the load pulls
    # the wire is where the programme wants it, but for the swing itself
    middle = sum(y.s_w - m.s_ref for y, _, m in late) / len(late)
    assert abs(middle) < 0.02
    assert late[-1][2].s_ref == pytest.approx(100.0 + 0.1 * 240.0, abs=0.1)
    assert all(o.mode == MANUAL and o.hold == 1.0 for _, o, _ in rows)
    assert all(abs(o.F_hold - F_0) < 0.06 * F_0 for _, o, _ in rows)  # the passive circuit carries the mean


def test_speeds_go_on_without_a_step_from_law_to_law():
    force = lambda t, s_w: F_0 * (1.0 + 0.3 * math.sin(2.0 * math.pi * t / 8.0))
    modes = (STAGE_SPLASH, STAGE_AHC, STAGE_TENSION, STAGE_MANUAL, STAGE_SPLASH)
    stages = [stage(mode, v=-0.2, F_set=0.9 * F_0, value=13.0, last=float(i == 4)) for i, mode in enumerate(modes)]
    rows = run(stages, 80.0, force=force, s_w=1000.0)
    assert rows[-1][2].done
    steps = [abs(b[1].v_op - a[1].v_op) for a, b in itertools.pairwise(rows)]
    assert max(steps) < 0.02  # of 0.5 m/s that a law may ask for; a switch without fading steps by 0.1 m/s and more


def test_a_light_load_on_a_long_wire_is_felt_as_it_lands():
    """3,000 m of wire weigh as much as 100 t: of the tension at the tip the load is a sixth, and that is what goes."""
    q, W = 313.0, 0.2e6
    heavy = SET._replace(q_dry=350.0, q_wet=q, F_landed=0.5 * W)
    k, bottom = SET.EA / (SET.L_0 + 3000.0), 3001.0
    wire = lambda s_w: 350.0 * 30.0 + q * (s_w - 30.0)
    force = lambda t, s_w: wire(s_w) + (W if s_w < bottom else max(W - k * (s_w - bottom), 0.0))
    it = stage(STAGE_LANDING, v=-0.1, F_set=0.3 * W, until=UNTIL_TIME, value=30.0)
    rows = run([it], 90.0, force=force, s_w=3000.0, settings=heavy)
    down = next(y for y, _, m in rows if m.landed)
    assert down.s_w == pytest.approx(bottom + 0.5 * W / k, abs=0.1)
    assert rows[-1][2].done
    assert rows[-1][0].F - wire(rows[-1][0].s_w) == pytest.approx(0.3 * W, rel=0.03)
    assert rows[-1][1].F_hold == pytest.approx(rows[-1][0].F, rel=0.01)  # the passive circuit carries the wire as well


def test_a_landed_load_is_not_given_slack_by_the_ramp_of_the_joystick():
    """From 0.5 m/s the ramp alone would pay out 1.25 m more; what is paid out stays within the filters' second."""
    bottom = 101.0
    force = lambda t, s_w: F_0 if s_w < bottom else max(F_0 - 8e6 * (s_w - bottom), 0.0)
    rows = run([stage(STAGE_LANDING, v=-0.5, F_set=0.4 * F_0, value=30.0)], 10.0, force=force)
    assert max(y.s_w for y, _, _ in rows) - bottom < 0.5 * 1.3


def test_splash_mode_is_no_softer_for_a_light_load_than_the_wire_allows():
    """Half the moving mass, twice the answer; but below what the wire swings at 5 rad/s the answer grows no more."""
    force = lambda t, s_w: F_0 * (1.0 + 0.1 * math.sin(2.0 * math.pi * t / 8.0))

    def swing(F_soft: float) -> float:
        rows = run([stage(STAGE_SPLASH)], 60.0, force=force, settings=SET._replace(F_soft=F_soft))
        speeds = [o.v_op for _, o, _ in rows[3000:]]
        return max(speeds) - min(speeds)

    assert swing(3.0e6) == pytest.approx(2.0 * swing(6.0e6), rel=0.01)
    assert swing(1.0e5) == pytest.approx(swing(1.0e6), rel=1e-9)
