"""The twin beside what the crane measures: its own crane does not deviate, a worn one does, bad values do no harm."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from tests.live.residuals import learned
from tests.live.test_friction_estimate import CRANE, certified, worn

import stillhook
from stillhook.engine.certificate import NO_CERTIFICATE
from stillhook.live.estimate.friction import MOST_WAVES
from stillhook.live.estimate.half_waves import LONGEST
from stillhook.live.observer.observer import DELAY, Observer, Task, shown_names
from stillhook.live.observer.settings import ObserverSettings
from stillhook.live.residual import write_model
from stillhook.live.servers.served import about
from stillhook.live.watch.deviation import COMPARED, LIMITS
from stillhook.live.watch.virtual import sensors_of
from stillhook.units import KINDS

BEGIN, CYCLE = 1.8e9, CRANE.control.t_cycle
SIGNALS = ("s_w", "omega_m", "p_a", "p_b", "p_hp", "u_p", "alpha_p", "alpha_m", "alpha_pm", "F_w")
pytestmark = pytest.mark.slow
MESSAGE = (*SIGNALS, "s_tip", "v_tip", "a_tip", "mode")
EVERY = 4
"""Cycles from message to message: 25 Hz."""
Message = dict[str, float]


@cache
def run_of(factor: float, duration: int = 150) -> dict[str, np.ndarray]:
    """Every cycle of a crane with so much system friction."""
    case = stillhook.Scenario(
        load="60 t", s_w="800 m", mode="ssc", duration=f"{duration} s", tip=stillhook.Sine(height="1.6 m", period="9 s")
    )
    run = stillhook.simulate(worn(CRANE, factor), case, every=f"{CYCLE!r} s")
    return {"time": run.time.values, **{n: run[n].values for n in MESSAGE}}


class Side:
    """An observer between a twin as filed and a crane with other friction; `change` is done to every message."""

    def __init__(self, crane: stillhook.Crane = CRANE, settings: ObserverSettings | None = None) -> None:
        twin = run_of(1.0)
        names = ("time", "time_utc", "lateness", *MESSAGE)
        task = Task(crane, names, settings or ObserverSettings(SIGNALS))
        self.events: list[tuple[str, str]] = []
        self.of = Observer(task, BEGIN, lambda name, text, value: self.events.append((name, text)))
        t = twin["time"]
        self.twin = np.column_stack([t, BEGIN + t - CYCLE, 0.0 * t, *(twin[n] for n in MESSAGE)])
        self.seen: list[dict[str, float]] = []

    def run(
        self,
        factor: float = 1.0,
        change: Callable[[float, Message], Message | None] = lambda t, x: x,
        stamp: Callable[[float], float] = lambda t: BEGIN + t,
        until: float = 150.0,
    ) -> Side:
        crane = run_of(factor)
        for i, t in enumerate(crane["time"].tolist()):
            if t > until:
                break
            self.of.see(self.twin[i])
            if i % EVERY == 0:
                message = change(t, {n: float(crane[n][i]) for n in MESSAGE})
                if message is not None:
                    self.of.hear(BEGIN + t + 0.005, stamp(t), message)
            if i % 20 == 0:
                self.of.advance(BEGIN + t)
                self.seen.append(dict(self.of.values))
        return self

    def most(self, name: str) -> float:
        return float(np.nanmax([x[name] for x in self.seen]))

    def told(self, name: str) -> list[str]:
        return [text for n, text in self.events if n == name]


@cache
def usual(factor: float) -> Side:
    """A run without anything wrong."""
    return Side(certified()).run(factor)


@pytest.mark.long
def test_the_twin_of_a_crane_does_not_deviate_and_has_its_friction():
    of = usual(1.0)
    assert of.events == []
    for name in COMPARED:
        assert of.most(f"deviation.{name}") < 0.05 * LIMITS[name]
        assert of.most(f"alarm.{name}") == 0.0
    assert of.of.values["low.friction_factor"] < 1.0 < of.of.values["high.friction_factor"]
    assert set(of.of.values) == set(shown_names(ObserverSettings(SIGNALS)))


@pytest.mark.long
def test_a_worn_crane_deviates_and_its_friction_is_found_but_not_applied_without_a_certificate():
    of = Side().run(1.2)
    assert of.most("deviation.p_a") > 3.0 * usual(1.0).most("deviation.p_a")
    assert of.of.values["low.friction_factor"] < 1.2 < of.of.values["high.friction_factor"]
    assert of.of.proposal.known
    assert of.of.proposal.value is None
    assert of.of.proposal.reason == NO_CERTIFICATE


@pytest.mark.long
def test_inside_the_envelope_the_estimate_is_proposed():
    of = usual(1.2)
    assert of.of.proposal.value == of.of.values["estimate.friction_factor"] == pytest.approx(1.2, rel=0.01)


@pytest.mark.thorough
def test_friction_far_from_the_file_is_an_alarm_that_is_told_once():
    of = Side().run(4.0)
    assert of.most("alarm.p_a") == 1.0
    assert len([text for text in of.told("alarm") if text.startswith("p_a deviates by")]) == 1
    assert "p_a" in of.of.proposal.deviating


@pytest.mark.thorough
def test_a_step_of_friction_is_an_alarm_with_its_time_and_is_proposed_as_a_step():
    of = Side(certified())
    of.run(1.0, until=149.0)
    twin = of.twin.copy()
    for part in (1, 2):  # the same waves again, with more friction
        of.twin = twin.copy()
        of.twin[:, :2] += part * 144.0
        crane = run_of(1.3)
        for i, t in enumerate(crane["time"].tolist()):
            if not 9.0 < t <= 153.0 - 3.0:
                continue
            of.of.see(of.twin[i])
            if i % EVERY == 0:
                now = BEGIN + t + part * 144.0
                of.of.hear(now + 0.005, now, {n: float(crane[n][i]) for n in MESSAGE})
            if i % 20 == 0:
                of.of.advance(BEGIN + t + part * 144.0)
                of.seen.append(dict(of.of.values))
    (text,) = [t for t in of.told("alarm") if "Total loss" in t]
    assert "Total loss has risen by" in text
    assert "s before this event" in text
    assert (of.of.proposal.steps, of.of.proposal.step) == (1, text)
    assert of.most("alarm.friction_factor") == 1.0
    assert of.of.values["alarm.friction_factor"] == 0.0  # an estimate after it is known
    assert of.of.proposal.value == pytest.approx(1.3, rel=0.01)


@pytest.mark.parametrize(
    "stamp",
    [lambda t: math.nan, lambda t: BEGIN + t + 7200.0, lambda t: BEGIN + t - 3.15e7, lambda t: t],
    ids=["none", "hours ahead", "a year behind", "since a start"],
)
@pytest.mark.thorough
def test_a_clock_that_is_off_changes_neither_deviations_nor_estimate(stamp: Callable[[float], float]):
    right, off = usual(1.2), Side().run(1.2, stamp=stamp)
    for name in ("deviation.p_a", "deviation.s_w"):
        assert off.most(name) == pytest.approx(right.most(name), rel=0.1, abs=0.01 * LIMITS[name.partition(".")[2]])
    low, high = right.of.values["low.friction_factor"], right.of.values["high.friction_factor"]
    assert low < off.of.values["estimate.friction_factor"] < high
    assert off.events == []


@pytest.mark.long
@pytest.mark.parametrize("jump", [-7200.0, 7200.0])
def test_a_clock_that_jumps_is_told_and_costs_a_moment(jump: float):
    of = Side().run(1.2, stamp=lambda t: BEGIN + t + (jump if t > 75.0 else 0.0))
    assert len(of.told("clock")) == 1
    assert of.told("alarm") == []
    assert of.of.values["low.friction_factor"] < 1.2 < of.of.values["high.friction_factor"]


@pytest.mark.parametrize(
    "change",
    [
        lambda t, x: None if t > 80.0 else x,
        lambda t, x: {**x, "p_a": math.nan} if t > 80.0 else x,
        lambda t, x: {n: v for n, v in x.items() if n != "F_w"} if t > 80.0 else x,
    ],
    ids=["nothing comes", "one is no number", "one stops"],
)
@pytest.mark.thorough
def test_signals_that_stop_end_the_estimate_within_a_minute(change: Callable[[float, Message], Message | None]):
    of = Side(certified()).run(1.2, change, until=80.0)
    assert of.of.proposal.value is not None
    of = Side(certified()).run(1.2, drop_unknown(change))
    at = BEGIN + 80.0 + LONGEST + DELAY + 9.0
    of.of.advance(at)
    assert not of.of.proposal.known
    assert of.of.proposal.value is None
    assert "half waves" in of.of.proposal.reason
    assert math.isnan(of.of.values["estimate.friction_factor"])


def drop_unknown(change: Callable[[float, Message], Message | None]) -> Callable[[float, Message], Message | None]:
    """As a message arrives at the observer: what is no number is not in it."""

    def known(t: float, x: Message) -> Message | None:
        message = change(t, x)
        return None if message is None else {n: v for n, v in message.items() if math.isfinite(v)}

    return known


@pytest.mark.thorough
def test_spikes_raise_no_alarm_and_move_no_estimate():
    rng = np.random.default_rng(4)

    def spiked(t: float, x: Message) -> Message:
        return {**x, "p_a": 580e5} if rng.random() < 0.02 else x

    of, right = Side().run(1.0, spiked), usual(1.0)
    assert of.told("alarm") == []
    assert of.most("deviation.p_a") < 0.3 * LIMITS["p_a"]
    half = right.of.values["high.friction_factor"] - right.of.values["estimate.friction_factor"]
    moved = of.of.values["estimate.friction_factor"] - right.of.values["estimate.friction_factor"]
    assert abs(moved) < half


@pytest.mark.long
@pytest.mark.parametrize(("name", "factor", "unit"), [("p_a", 1e-5, "bar"), ("F_w", 1e-3, "kN")])
def test_a_signal_in_a_wrong_unit_is_named_and_nothing_is_estimated_from_it(name: str, factor: float, unit: str):
    of = Side(certified()).run(1.0, lambda t, x: {**x, name: factor * x[name]})
    assert of.told("unit")[0].startswith(f"{name} seems to be in {unit}.")
    assert of.of.proposal.value is None
    if name in COMPARED:
        assert of.most(f"alarm.{name}") == 1.0


@pytest.mark.thorough
def test_a_wire_counter_with_another_zero_is_no_deviation_and_one_that_jumps_later_is():
    of = Side().run(1.0, lambda t, x: {**x, "s_w": x["s_w"] + 3.0})
    assert of.most("deviation.s_w") < 0.2 * LIMITS["s_w"]
    jumped = Side().run(1.0, lambda t, x: {**x, "s_w": x["s_w"] + (1.0 if t > 75.0 else 0.0)})
    assert any(text.startswith("s_w deviates by") for text in jumped.told("alarm"))


@pytest.mark.thorough
def test_an_encoder_whose_clock_is_off_is_compared_at_its_own_time():
    """Until the offset is found, in about a minute, the wire deviates by its speed times the offset."""
    run, late = run_of(1.0), 0.15

    def behind(t: float, x: Message) -> Message:
        at = {n: float(np.interp(t - late, run["time"], run[n])) for n in ("s_w", "omega_m")}
        return {**x, **at}

    of = Side().run(1.0, behind)
    (text,) = of.told("encoder-clock")
    assert "come 15" in text or "come 14" in text
    assert of.most("deviation.s_w") > LIMITS["s_w"]
    assert of.of.values["deviation.s_w"] < 0.3 * LIMITS["s_w"]


@pytest.mark.thorough
def test_a_twin_that_stood_still_meanwhile_is_not_compared():
    """Rows that are missing (a kernel that was started again) are no deviation."""
    of = Side()
    see = of.of.see
    of.of.see = lambda row: see(row) if not 60.0 < row[0] - BEGIN < 66.0 else None
    of.run(1.0)
    assert of.events == []
    assert of.most("deviation.p_a") < 0.05 * LIMITS["p_a"]


@pytest.mark.thorough
def test_an_observer_that_was_halted_for_minutes_goes_on_with_the_present():
    of = Side().run(1.0, until=100.0)
    of.of.advance(BEGIN + 2000.0)
    of.twin[:, :2] += 2000.0
    for part in of.twin[:3000], of.twin[3000:4000]:
        for row in part:
            of.of.see(row)
            of.of.hear(row[1] + 0.005, row[1] + CYCLE, dict(zip(MESSAGE, row[3:].tolist(), strict=True)))
        of.of.advance(row[1])
    assert of.told("alarm") == []


@pytest.mark.thorough
def test_memory_does_not_grow_with_time():
    """Sizes of everything that an observer keeps, over a time-lapse: the waves of two minutes again and again."""
    of, sizes = Side(), []
    run = run_of(1.0)
    use = (run["time"] > 9.0) & (run["time"] <= 144.0)
    rows, messages = of.twin[use], np.column_stack([run[n] for n in MESSAGE])[use]
    for lap in range(9):
        for i, row in enumerate(rows):
            shifted = row.copy()
            shifted[:2] += lap * 135.0
            if i % 10 == 0:
                of.of.see(shifted)
                of.of.hear(shifted[1] + 0.005, math.nan, dict(zip(MESSAGE, messages[i].tolist(), strict=True)))
            if i % 100 == 0:
                of.of.advance(shifted[1])
        sizes.append(sum(held(of.of)))
    assert max(sizes[5:]) <= 1.02 * max(sizes[2:5])
    assert of.of._estimator._waves.maxlen == MOST_WAVES


def held(of: Observer) -> Iterator[int]:
    """Numbers that are kept, by place."""
    yield sum(len(samples) for samples in of._stream._samples.values())
    yield len(of._twin)
    yield from (len(offsets) for offsets in of._standing.values())
    estimator = of._estimator
    yield sum(v.size for v in estimator._buffer.values())
    yield sum(v.size for v in chain.from_iterable(block.values() for block in estimator._pending))


@pytest.mark.long
def test_criteria_and_virtual_sensors_stand_beside_the_deviations():
    sensors = sensors_of(CRANE)
    of = Side(settings=ObserverSettings(SIGNALS, virtual=tuple(s.name for s in sensors))).run(1.0)
    assert of.most("alarm.criteria") == 0.0
    for s in sensors:
        assert about(f"virtual.{s.name}")[0] == KINDS[s.kind].si
        if s.value not in ("T_f", "s_load"):  # which the rows of this twin lack
            assert math.isfinite(of.of.values[f"virtual.{s.name}"])
    assert of.of.values["virtual_half.Q_m"] < 0.05 * of.most("virtual.Q_m")


@pytest.mark.long
def test_a_model_of_level_4_is_shown_and_nothing_of_it_may_be_used_without_a_certificate(tmp_path: Path):
    path = tmp_path / "model.json"
    write_model(path, learned())
    of = Side(settings=ObserverSettings(SIGNALS, residual=path)).run(1.0)
    said = np.array([x["level4.T_f"] for x in of.seen])
    assert np.isfinite(said).any()
    assert of.most("level4_applied.T_f") == 0.0
    assert of.of.values["level4_half.T_f"] > 0.0
