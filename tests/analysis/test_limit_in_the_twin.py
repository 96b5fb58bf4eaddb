"""The gain limit of the complete linearised plant, on the crane's own wire, is where the twin begins to swing: a tenth
below it a disturbance dies out, a tenth above it grows or stays as a cycle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt

from stillhook import Crane, Profile, Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.governing import PlaceLimit, place_limits
from stillhook.analysis.loop_stability.places import Place, has_cylinder
from stillhook.analysis.loop_stability.stability import full_stability
from stillhook.library import changed
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Mode, Operator

WITHIN = 0.1
"""How far the linear limit may be from that of the twin (WINCHES.md) [-]."""
STEP_TIME, TO_SETTLE = 10.0, 4.0
"""Time of the operator's step, and after which other modes than the one at the limit have died out [s]."""
KICK = 0.05
"""Speed that the step gives the wire over the tip's, about [-]."""
CYCLE, STAYS = 0.01, 0.2
"""A lasting cycle: amplitude of the wire's speed over the tip's, and growth or decay over that of the linear plant."""

QUICK = [
    ("nov-250t", "ssc", 1.0, 300.0, 20.0),
    ("nov-100t-pure-active", "ssc", 0.6, 15.0, 5.0),
    ("nov-250t-secondary", "position", 1.0, 100.0, 2.0),
    ("nov-250t-digital", "position", 1.0, 100.0, 2.0),
    ("utility-20t-open-circuit", "position", 1.0, 100.0, 2.0),
    ("nov-100t-cylinder", "position", 1.0, 15.0, 2.0),
    ("nov-100t-electric", "position", 1.0, 15.0, 2.0),
]
MORE = [
    ("nov-250t", "ssc", 1.0, 300.0, 60.0),
    ("nov-250t", "ssc", 0.0, 15.0, -5.0),
    ("nov-250t", "hs", 0.6, 100.0, 20.0),
    ("nov-250t", "ns", 1.0, 300.0, -20.0),
    ("nov-100t-pure-active", "ssc", 1.0, 100.0, 10.0),
    ("nov-100t-pure-active", "ssc", 0.6, 100.0, -60.0),
    ("nov-250t-secondary", "position", 1.0, 205.0, -2.0),
    ("nov-250t-secondary", "position", 0.3, 15.0, 2.0),
    ("nov-250t-digital", "position", 0.3, 15.0, 2.0),
    ("nov-250t-digital", "position", 1.0, 205.0, -2.0),
    ("nov-250t-digital", "position", 0.0, 100.0, 10.0),
    ("utility-20t-open-circuit", "position", 0.3, 15.0, -2.0),
    ("utility-20t-open-circuit", "position", 1.0, 100.0, 10.0),
    ("nov-100t-cylinder", "position", 0.3, 100.0, 2.0),
    ("nov-100t-cylinder", "position", 1.0, 100.0, -0.5),
    ("nov-100t-electric", "position", 1.0, 15.0, 10.0),
    ("nov-100t-electric", "position", 0.0, 100.0, 5.0),
]


def envelope(
    crane: Crane, mode: Mode, at: PlaceLimit, s_w: float, K_p: float, time: float
) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and amplitude of the wire's speed about the frequency of the limit, over the tip's speed [-]."""
    load, v = at.place.load, at.place.v_tip
    omega = at.gains.omega_c
    tip = Profile([("0 s", "0 m/s"), ("5 s", f"{v} m/s"), (f"{time} s", f"{v} m/s"), (f"{time + 5.0} s", "0 m/s")])
    step = Operator(steps=((f"{STEP_TIME} s", f"{KICK * abs(v) / omega * 1e3} mm"),))
    held = {"gas_held": True} if crane.passive is not None else {}
    case = Scenario(
        load=f"{load!r} kg",
        s_w=f"{s_w!r} m",
        tip=tip,
        mode=mode,
        operator=step,
        duration=f"{time} s",
        warm_up="0 s",
        ramp="0 s",
        **held,
    )
    run = simulate(
        crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": K_p})}),
        case,
        every="0.02 s",
        on_failure="mark",
    )
    band = np.array([0.6, 1.6]) * omega / (2.0 * math.pi)
    t = run.time.values
    after = t > STEP_TIME + 0.5
    sos = butter(3, band, "bandpass", fs=50.0, output="sos")
    size = np.abs(hilbert(sosfiltfilt(sos, (run["v_w"].values + v)[after]))) / abs(v)
    keep = (t[after] > STEP_TIME + TO_SETTLE) & (t[after] < time - TO_SETTLE)
    return t[after][keep], size[keep]


def rate(t: np.ndarray, size: np.ndarray) -> float:
    """Growth rate of an envelope [1/s]."""
    return float(np.polyfit(t, np.log(size), 1)[0])


def linear_rate(at: PlaceLimit, K_p: float) -> float:
    """Growth rate of the closed loop's poles about the frequency of the limit [1/s]."""
    assert at.loop is not None
    z = at.loop.closed_poles(K_p)
    s = np.log(z[np.abs(z) > 1e-9]) / at.loop.t_cycle
    return float(max(p.real for p in s if abs(p.imag - at.gains.omega_c) < 0.3 * at.gains.omega_c))


def run_time(crane: Crane, v: float) -> float:
    """Duration [s]: until growth shows, within 25 m of wire, and with a cylinder within a part of its stroke."""
    return 40.0 if has_cylinder(crane) else min(90.0, max(30.0, 5.0 + 25.0 / abs(v)))


def place_of(crane: Crane, share: float, s_w: float, v: float) -> Place:
    """Where a run is on the mean: wire has moved by then, and a cylinder."""
    load, moved = share * crane.SWL, 0.5 * v * run_time(crane, v)
    stroke = crane.plant.type.stroke(crane, (load + crane.hook_mass) * G)
    return Place(load, s_w + moved, v, moved / float(stroke.length) if has_cylinder(crane) and stroke else 0.0)


@pytest.mark.parametrize(
    ("name", "law", "share", "s_w", "v"),
    [*QUICK, *(pytest.param(*c, marks=pytest.mark.slow) for c in MORE)],
)
def test_the_twin_begins_to_swing_within_a_tenth_of_the_linear_limit(
    name: str, law: str, share: float, s_w: float, v: float
) -> None:
    crane, mode = load_crane(name), Mode(law)
    v_tip = v / 60.0
    (at,) = place_limits(crane, mode, [place_of(crane, share, s_w, v_tip)])
    assert at.gains.low == 0.0
    limit, time = at.gains.high, run_time(crane, v_tip)
    t, size = envelope(crane, mode, at, s_w, (1.0 - WITHIN) * limit, time)
    assert rate(t, size) < 0.0
    t, size = envelope(crane, mode, at, s_w, (1.0 + WITHIN) * limit, time)
    late = t > 0.5 * (t[0] + t[-1])
    growth = rate(t[late], size[late])
    stays = size[-1] > CYCLE and abs(growth) < STAYS * abs(linear_rate(at, (1.0 + WITHIN) * limit))
    assert rate(t, size) > 0.0 or stays or size[late].max() > 0.25


WITHIN_TIME = 0.05
"""How far the delay margin may be from the dead time at which the twin begins to swing [-]."""
STRONG = 0.8
"""Gain over its limit [-]: so near that the load's second crossing has a delay margin of fewer than 20 PLC cycles."""


def test_the_twin_begins_to_swing_at_a_dead_time_of_its_pumps_of_the_delay_margin_as_stability_prints_it() -> None:
    """A dead time below the margin only makes the load ring longer; one above it makes a cycle that stays. The margin
    comes from the crossings of the loop's response without dead time, the twin from commands that it keeps."""
    s_w, v = 15.0, 5.0 / 60.0
    crane = changed(load_crane("nov-100t-pure-active"), {"control": {"t_cycle": "20 ms"}})
    (free,) = place_limits(crane, Mode.SSC, [place_of(crane, 0.6, s_w, v)])
    K_p = STRONG * free.gains.high
    crane = crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": K_p})})
    place = free.place
    printed, _ = full_stability(crane, load=place.load, s_w=place.s_w, v_tip=v)
    margin = printed.delay_margin_plc
    assert 0.1 < margin < 0.2
    sizes = {}
    for part in (1.0 - WITHIN_TIME, 1.0, 1.0 + WITHIN_TIME):
        late = changed(crane, {"active": {"pump": {"servo": {"dead_time": f"{part * margin!r} s"}}}})
        (at,) = place_limits(late, Mode.SSC, [place])
        if part == 1.0:  # the limit with the dead time in every loop of the pumps is the gain of the margin
            assert at.gains.high == pytest.approx(K_p, rel=1e-5)
            continue
        left, _ = full_stability(late, load=place.load, s_w=place.s_w, v_tip=v)
        assert left.delay_margin_plc == pytest.approx((1.0 - part) * margin, abs=1e-5) or part > 1.0
        assert left.stable_plc == (part < 1.0)
        t, size = envelope(late, Mode.SSC, at, s_w, K_p, run_time(crane, v))
        sizes[part] = t, size, linear_rate(at, K_p)
    t, size, linear = sizes[1.0 - WITHIN_TIME]
    assert rate(t, size) == pytest.approx(linear, rel=0.1)
    assert linear < 0.0
    t, size, linear = sizes[1.0 + WITHIN_TIME]
    assert linear > 0.0
    assert size.min() > 10.0 * CYCLE
    assert abs(rate(t, size)) < STAYS * linear
