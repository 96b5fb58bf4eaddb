"""Steady stretches are found in staircases with everything that real ones have: settling, noise, converters, layers, holes, creep."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from tests.identify.refusals import refused

from stillhook.errors import IdentifyError
from stillhook.identify.steady_state.search import Search
from stillhook.identify.steady_state.steps import Steady, WindowSettings
from stillhook.identify.steady_state.windows import steady_windows
from stillhook.logs.log import Finding, Log
from stillhook.statistics.correlated_mean import converter_step, mean_and_uncertainty
from stillhook.units import parse

RPM = parse("1 rev/min", "rotation")
BAR = 1e5
RAW = 0.01  # s: samples of the PLC
LOAD, LAG = 150 * BAR, 0.3
SPEEDS = (5.0, 50.0, 250.0, 800.0, 1600.0, 2500.0)
CONVERTER = (2.0 * 2800.0 * RPM / 4096, 400 * BAR / 4096)  # 12 bits over both ranges


def friction(v: float) -> float:
    """A curve with a Stribeck part [Pa] over rev/min; the shape does not matter here."""
    return BAR * (12.0 + 10.0 * math.exp(-v / 200.0) + 0.006 * v)


def staircase(
    speeds: tuple[float, ...] = SPEEDS,
    *,
    hold: float = 15.0,
    ramp: float = 2.0,
    every: float = 0.1,
    tau: float = 0.5,
    speed_noise: float = 0.0,
    effort_noise: float = 0.0,
    converter: tuple[float, float] | None = None,
    leak: float = 0.08,
    seed: int = 0,
    spoil: Callable[[np.ndarray, np.ndarray, np.ndarray], None] | None = None,
) -> Log:
    """Hoist and lower in turn at these speeds [rev/min]; first-order settling; white noise on the raw samples; then bin means.

    speed_noise as part of the speed, effort_noise in Pa; spoil may change (t, speed, effort) of the raw samples.
    """
    rng = np.random.default_rng(seed)
    set_speed: list[np.ndarray] = []
    for s in speeds:
        for v in (s * RPM, -s * RPM * (1.0 + leak)):
            set_speed += [
                np.linspace(0.0, v, round(ramp / RAW)),
                np.full(round(hold / RAW), v),
                np.linspace(v, 0.0, round(ramp / RAW)),
            ]
            set_speed.append(np.zeros(round(3.0 / RAW)))
    wanted = np.concatenate(set_speed)
    v = lfilter([RAW / tau], [1.0, RAW / tau - 1.0], wanted)
    steady = np.array([friction(x) for x in speeds for _ in (0, 1)])
    sign = np.sign(wanted)
    stage = np.minimum(np.arange(len(wanted)) // (len(wanted) // len(steady)), len(steady) - 1)
    e = LOAD + lfilter([RAW / LAG], [1.0, RAW / LAG - 1.0], sign * steady[stage])
    t = RAW * np.arange(len(v))
    if spoil is not None:
        spoil(t, v, e)
    v = v * (1.0 + speed_noise * rng.standard_normal(len(v)))
    e = e + effort_noise * rng.standard_normal(len(e))
    if converter is not None:
        v, e = np.round(v / converter[0]) * converter[0], np.round(e / converter[1]) * converter[1]
    return log_of(v, e, every)


NOISE = {"speed_noise": 0.002, "effort_noise": 0.5 * BAR}


def log_of(v: np.ndarray, e: np.ndarray, every: float) -> Log:
    m = round(every / RAW)
    n = len(v) // m
    signals = {"omega_m": v[: n * m].reshape(n, m).mean(axis=1), "dp_m": e[: n * m].reshape(n, m).mean(axis=1)}
    none = {k: np.zeros(n, dtype=bool) for k in signals}
    return Log("stairs.csv", every * (np.arange(n) + 0.5), signals, none, (), (), 1.0 / RAW, len(v), every)


def changed(log: Log, **what: object) -> Log:
    return Log(**{**log.__dict__, **what})  # type: ignore[arg-type]


def with_signals(log: Log, **signals: np.ndarray) -> Log:
    return changed(log, signals={**log.signals, **signals})


Change = Callable[[np.ndarray], np.ndarray]


def spoilt(
    speeds: tuple[float, ...],
    a: float,
    b: float,
    *,
    speed: Change | None = None,
    effort: Change | None = None,
    **more: Any,
) -> Log:
    """A noisy staircase whose speed is multiplied, or whose effort is added to, from a to b [s] by a function of time."""

    def spoil(t: np.ndarray, v: np.ndarray, e: np.ndarray) -> None:
        on = (t > a) & (t < b)
        if speed is not None:
            v[on] *= speed(t[on])
        if effort is not None:
            e[on] += effort(t[on])

    return staircase(speeds, spoil=spoil, **NOISE, **more)


def find(log: Log, **more: object) -> Steady:
    return steady_windows(log, "omega_m", "dp_m", **more)  # type: ignore[arg-type]


def nominal(found: Steady, speeds: tuple[float, ...] = SPEEDS, leak: float = 0.08) -> list[tuple[float, float]]:
    """What speed [rad/s] and effort [Pa] every window should have, by the nearest step of its direction."""
    out = []
    for w in found.windows:
        truth = [s * RPM if w.direction > 0 else -s * RPM * (1.0 + leak) for s in speeds]
        k = int(np.argmin([abs(w.speed - v) for v in truth]))
        out.append((truth[k], LOAD + w.direction * friction(speeds[k])))
    return out


@pytest.mark.slow
@pytest.mark.parametrize("every", [0.01, 0.1, 1.0])
@pytest.mark.parametrize(
    "case",
    [{}, NOISE, {**NOISE, "converter": CONVERTER}, {"converter": CONVERTER}],
    ids=["clean", "noise", "noisy-12-bit", "12-bit"],
)
def test_every_step_of_a_staircase_gives_one_window_with_its_true_means(case: dict, every: float) -> None:
    """At 1, 10 and 100 bins a second, with and without noise and converter: 6 speeds in 2 directions are 12 windows."""
    found = find(staircase(every=every, **case))
    assert [w.direction for w in found.windows] == [1, -1] * len(SPEEDS)
    for w, (speed, effort) in zip(found.windows, nominal(found), strict=True):
        # Four standard uncertainties, since 144 windows are looked at here.
        assert abs(w.speed - speed) < 4.0 * w.u_speed
        assert abs(w.effort - effort) < 4.0 * w.u_effort
        assert w.u_effort < 0.3 * BAR
        assert w.u_speed < 0.002 * abs(speed) + (CONVERTER[0] if "converter" in case else 0.1 * RPM)
        assert w.others["omega_m"] == pytest.approx(w.speed)
    assert not found.rejected


@pytest.mark.parametrize("hold", [5.0, 60.0])
def test_short_and_long_steps_are_used(hold: float) -> None:
    found = find(staircase(hold=hold, **NOISE))
    assert len(found.windows) == 2 * len(SPEEDS)
    assert all(w.end - w.start > 2.0 - 1e-9 for w in found.windows)
    if hold > 5.0:
        assert all(w.end - w.start > 0.5 * hold for w in found.windows)


def test_windows_end_before_their_step_ends_and_begin_after_it_has_settled() -> None:
    log = staircase((800.0,), **NOISE)
    for w, end in zip(find(log).windows, (17.0, 39.0), strict=True):
        assert end - 1.5 < w.end <= end - 0.2
        assert w.start > end - 15.0 + 2.0 * 0.5  # two time constants into the step


@pytest.mark.slow
def test_the_tail_of_a_decay_that_hides_in_noise_does_not_push_all_means_one_way() -> None:
    """Friction that comes up over seconds under noise: each mean may be off by its uncertainty, but not all of them to one side."""

    def slow_start(t: np.ndarray, v: np.ndarray, e: np.ndarray) -> None:
        moving = np.abs(v) > 1.0 * RPM
        begun = np.maximum.accumulate(np.where(~moving, t, 0.0))
        e -= np.sign(v) * np.where(moving, 0.6 * BAR * np.exp(-(t - begun) / 2.0), 0.0)

    off = []
    for seed in range(12):
        found = find(staircase(hold=15.0, seed=seed, spoil=slow_start, **NOISE))
        off += [
            w.direction * (w.effort - effort) / w.u_effort
            for w, (_, effort) in zip(found.windows, nominal(found), strict=True)
        ]
    assert len(off) > 100
    assert abs(np.mean(off)) < 0.4  # uncertainties; 0.5 where no spare is left out


def test_what_is_left_out_at_the_start_of_a_step_is_said() -> None:
    found = find(staircase(**NOISE))
    assert found.trimmed
    assert all(r.code == "start" and "settling" in r.reason and " off for " in r.reason for r in found.trimmed)


def test_a_noise_free_log_gives_all_windows_the_same_weight() -> None:
    """Nothing scatters, so nothing may count more: the least uncertainty is one number for the log, and not zero."""
    u = np.array([w.u_effort for w in find(staircase()).windows])
    assert u.min() > 0.0
    assert u.max() < 1.1 * u.min()
    assert u.max() < 0.02 * BAR


def test_a_quantised_log_without_noise_does_not_claim_to_know_more_than_its_converter() -> None:
    found = find(staircase(converter=CONVERTER))
    assert all(w.u_effort >= CONVERTER[1] / math.sqrt(12.0) for w in found.windows)
    assert all(w.u_speed >= CONVERTER[0] / math.sqrt(12.0) for w in found.windows)


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_the_step_of_a_converter_is_found_and_set_speeds_are_not_taken_for_one(noise: float) -> None:
    log = staircase(converter=CONVERTER, effort_noise=noise * CONVERTER[1])
    assert converter_step(log.signals["omega_m"]) == pytest.approx(CONVERTER[0])
    assert converter_step(staircase().signals["omega_m"]) == 0.0
    assert converter_step(np.repeat([0.0, 100.0, 200.0, 300.0, 400.0, 500.0], 50)) == 0.0
    assert converter_step(np.repeat(np.random.default_rng(1).uniform(0.0, 1000.0, 60), 50)) == 0.0


# ---- uncertainty of a mean


def noise_of_kind(kind: str, n: int, rng: np.random.Generator) -> np.ndarray:
    white = rng.standard_normal(n + 400)
    if kind == "white":
        return white[400:]
    r = {"correlated": 0.8, "slow": 0.95}[kind]
    return np.asarray(lfilter([math.sqrt(1.0 - r * r)], [1.0, -r], white)[400:])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "n"),
    [("white", 5), ("white", 20), ("white", 1000), ("correlated", 60), ("correlated", 600), ("slow", 600)],
)
def test_95_percent_intervals_of_a_mean_hold_the_truth(kind: str, n: int) -> None:
    """True mean 0. Between 90 and 99 % of 600 draws (500 for the long ones) must be inside, however the noise is correlated."""
    rng = np.random.default_rng(7)
    inside = [abs(m) < 1.96 * u for m, u in (mean_and_uncertainty(noise_of_kind(kind, n, rng)) for _ in range(600))]
    assert 0.90 <= np.mean(inside) <= 0.99


@pytest.mark.thorough
@pytest.mark.parametrize("correlation", [0.0, 0.7])
def test_95_percent_intervals_of_windows_hold_the_steady_values_that_a_step_settles_to(correlation: float) -> None:
    """The choice of the last part is inside: settling, noise and search together, 30 staircases of 12 windows."""
    inside_v, inside_e = [], []
    for seed in range(30):
        rng = np.random.default_rng(1000 + seed)

        def spoil(t: np.ndarray, v: np.ndarray, e: np.ndarray, rng: np.random.Generator = rng) -> None:
            if correlation:
                r = correlation ** (RAW / 0.1)
                e += 0.3 * BAR * lfilter([math.sqrt(1.0 - r * r)], [1.0, -r], rng.standard_normal(len(e)))

        found = find(staircase(seed=seed, spoil=spoil, **NOISE))
        for w, (v, e) in zip(found.windows, nominal(found), strict=True):
            inside_v.append(abs(w.speed - v) < 1.96 * w.u_speed)
            inside_e.append(abs(w.effort - e) < 1.96 * w.u_effort)
    assert len(inside_e) == 360
    assert 0.90 <= np.mean(inside_e) <= 0.99
    assert (
        np.mean(inside_v) >= 0.90
    )  # may be wider: at low speed the least uncertainty of the log is larger than 0.2 % of the speed


# ---- what is not used, and why


def one(found: Steady, code: str) -> str:
    reasons = [r.reason for r in found.rejected if r.code == code]
    assert reasons, (code, found.rejected)
    return reasons[0]


def test_a_step_that_never_settles_is_rejected_with_its_drift() -> None:
    found = find(spoilt(SPEEDS, 2.0, 17.0, effort=lambda t: 3.0 * BAR * (t - 2.0)))
    assert len(found.windows) == 2 * len(SPEEDS) - 1
    reason = one(found, "settling")
    assert all(part in reason for part in ("effort still drifted by", "bar", "allowed is"))


def test_a_change_of_layer_splits_a_step_into_two_windows() -> None:
    """The wire's lever arm jumps by 4 % in the middle of a step: both levels are used, nothing is averaged over the jump."""
    found = find(spoilt((800.0, 1600.0), 10.0, 20.0, effort=lambda t: 0.04 * LOAD))
    inside = [w for w in found.windows if w.end < 20.0]
    assert len(inside) == 2
    assert inside[1].effort - inside[0].effort == pytest.approx(0.04 * LOAD, abs=0.2 * BAR)
    assert inside[0].end < 10.0 < inside[1].start


def test_a_layer_just_before_the_end_of_a_step_costs_that_end_only() -> None:
    found = find(spoilt((800.0, 1600.0), 15.5, 20.0, effort=lambda t: 0.04 * LOAD))
    assert len(found.windows) == 4
    assert found.windows[0].end < 15.5
    assert found.windows[0].effort == pytest.approx(LOAD + friction(800.0), abs=4.0 * found.windows[0].u_effort)
    assert "change of layer" in one(found, "layer change")


def test_layer_limits_cut_a_step_where_the_wire_says_so() -> None:
    log = staircase((800.0,), **NOISE)
    s_w = 100.0 - np.cumsum(log.signals["omega_m"]) * 0.1 * 0.01
    at = float(np.interp(10.0, log.t, s_w))
    ends = [(w.start, w.end) for w in find(with_signals(log, s_w=s_w), layer_limits=(at,)).windows]
    assert any(b <= 10.1 for _, b in ends)
    assert any(a >= 9.9 for a, _ in ends)
    assert not any(a < 9.9 and b > 10.1 for a, b in ends)


def test_a_swinging_speed_is_called_oscillating() -> None:
    swing = lambda t: 1.0 + 0.2 * np.sin(2.0 * np.pi * 0.8 * t)
    found = find(spoilt((800.0, 1600.0), -1.0, 17.0, speed=swing))
    assert all(part in one(found, "oscillating") for part in ("period of 1.2", "rev/min"))
    assert len(found.windows) == 3


def test_a_load_that_swings_a_little_and_dies_out_is_waited_for() -> None:
    swing = lambda t: 15.0 * BAR * np.exp(-(t - 2.0) / 3.0) * np.sin(2.0 * np.pi * 1.0 * t)
    found = find(spoilt((800.0,), 2.0, 60.0, effort=swing, hold=30.0))
    w = found.windows[0]
    assert abs(w.effort - (LOAD + friction(800.0))) < 4.0 * w.u_effort
    assert len(found.windows) == 2


def test_a_displacement_that_moves_is_told() -> None:
    log = staircase((800.0, 1600.0), **NOISE)
    alpha = np.where(log.t < 20.0, 1.0 - 0.01 * log.t, 0.7)
    found = find(with_signals(log, alpha_m=alpha), held=("alpha_m",))
    assert "alpha_m moved by" in one(found, "displacement moved")
    assert len(found.windows) == 3


def test_creep_and_stick_slip_are_too_slow() -> None:
    found = find(staircase(**NOISE), settings=WindowSettings(least_speed="20 rev/min"))
    assert "below the least speed 20 rev/min" in one(found, "too slow")
    assert len(found.windows) == 2 * len(SPEEDS) - 2

    stick = lambda t: 2.0 * (np.sin(2.0 * np.pi * 2.0 * t) > 0.0)
    assert "stick-slip: at rest for" in one(find(spoilt((20.0, 800.0), -1.0, 17.0, speed=stick)), "too slow")


def test_a_gap_splits_a_step_and_short_ends_are_told() -> None:
    log = staircase((800.0,), hold=12.0, **NOISE)
    keep = (log.t < 5.4) | (log.t > 7.9)
    cut = changed(
        log,
        t=log.t[keep],
        signals={k: x[keep] for k, x in log.signals.items()},
        doubtful={k: x[keep] for k, x in log.doubtful.items()},
    )
    found = find(cut)
    assert not any(w.start < 7.9 and w.end > 5.4 for w in found.windows)
    assert "next to a gap in the log" in one(found, "gap")


@pytest.mark.parametrize("kind", ["stuck", "saturated", "missing"])
def test_doubtful_pressures_are_left_out_and_named(kind: str) -> None:
    log = staircase((800.0, 1600.0), **NOISE)
    bad = log.t < 16.0
    finding = Finding("dp_m", kind, 0.0, 16.0, 1600, "noted", f"dp_m {kind}")
    found = find(changed(log, doubtful={**log.doubtful, "dp_m": bad}, findings=(finding,)))
    assert "cannot be trusted" in one(found, kind)
    assert all(w.start > 16.0 for w in found.windows)
    assert len(found.windows) == 3


def test_a_lost_speed_is_told_and_single_missing_samples_do_no_harm() -> None:
    log = staircase((800.0,), **NOISE)
    lost = with_signals(log, omega_m=np.where(log.t < 17.0, np.nan, log.signals["omega_m"]))
    assert "no speed to trust for 17 s" in one(find(lost), "missing")
    e = log.signals["dp_m"].copy()
    e[::37] = np.nan
    assert len(find(with_signals(log, dp_m=e)).windows) == 2


def test_steps_that_are_too_short_are_told() -> None:
    assert "at no time at steady speed" in one(find(staircase((800.0, 1600.0), hold=1.0, **NOISE)), "short")
    found = find(staircase((800.0, 1600.0), hold=2.5, **NOISE))
    assert "a window needs 2 s" in one(found, "short")
    assert len(found.rejected) == 4


def test_steps_without_a_stop_between_them_are_told_apart_by_speed_and_by_command() -> None:
    """300, then 320, then 340 rev/min without a stop, ramps of 1 s: three windows, whether a command is there or not."""
    speeds = [0.0, 300.0, 320.0, 340.0, 0.0]
    parts = [np.zeros(300)]
    for a, b in pairwise(speeds):
        parts += [np.linspace(a, b, 100), np.full(1200, b)]
    wanted = RPM * np.concatenate(parts)
    v = lfilter([RAW / 0.3], [1.0, RAW / 0.3 - 1.0], wanted)
    rng = np.random.default_rng(0)
    log = log_of(v * (1.0 + 0.002 * rng.standard_normal(len(v))), LOAD + 0.5 * BAR * rng.standard_normal(len(v)), 0.1)
    log = with_signals(log, u_p=wanted[: 10 * len(log.t)].reshape(-1, 10).mean(axis=1) / (400.0 * RPM))
    for more in ({}, {"command": "u_p"}):
        assert [round(w.speed / RPM) for w in find(log, **more).windows] == [300, 320, 340]


# ---- words and limits


@pytest.mark.parametrize(
    ("call", "more", "words"),
    [
        (find, {"command": "u_q"}, 'no signal "u_q". It has dp_m, omega_m. Name it in the mapping.'),
        (find, {"held": ("u_q",)}, 'no signal "u_q". It has dp_m, omega_m. Name it in the mapping.'),
        (lambda log: steady_windows(log, "omega_m", np.zeros(3)), {}, "Give one for each bin"),
        (lambda _, **settings: WindowSettings(**settings), {"least_length": "-1 s"}, "least_length"),
        (lambda _, **settings: WindowSettings(**settings), {"least_length": 2.0}, "a bare number"),
        (lambda _, **settings: WindowSettings(**settings), {"speed_drift": 0.0}, "speed_drift"),
        (lambda _, **settings: WindowSettings(**settings), {"wrong": 1}, "wrong"),
        (lambda _: WindowSettings(least_speed="20 bar").slowest(), {}, "write a speed such as"),
    ],
)
def test_signals_and_settings_are_refused_with_a_reason(call: Callable[..., Any], more: dict, words: str) -> None:
    assert words in refused(call, staircase((800.0,)), error=IdentifyError, **more)


def test_a_least_speed_is_a_rotation_or_a_travel() -> None:
    assert WindowSettings(least_speed="2 m/min").slowest() == pytest.approx(2.0 / 60.0)


def test_pauses_and_ramps_are_not_reported_as_rejected_stretches():
    """What was taken for a short step and is the winch at rest or between two speeds is left out of the reasons; a short step is not."""
    v = np.concatenate([np.full(20, 0.001), np.linspace(0.0, 1.0, 20), np.full(20, 1.0)])
    v = v + 1e-4 * np.random.default_rng(1).standard_normal(len(v))
    none, t = np.zeros(len(v), dtype=bool), 0.1 * (np.arange(len(v)) + 0.5)
    signals = {"speed": v, "effort": np.ones(len(v))}
    log = Log("steps.csv", t, signals, dict.fromkeys(signals, none), (), (), 10.0, len(v))
    search = Search(log, "speed", "effort", None, (), {}, WindowSettings())
    pause, ramp, step = (search.rejected(a, b, 1, "short", "too short") for a, b in ((2, 18), (22, 38), (42, 58)))
    assert [search.pause_or_ramp(r) for r in (pause, ramp, step)] == [True, True, False]
