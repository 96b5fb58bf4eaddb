"""The demonstration of an alarm, its clock taken away: the crane's friction grows, and the twin's file does not."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import pytest

import stillhook
from stillhook.live import demo
from stillhook.live.runtime import Event, Row, Task

CRANE = stillhook.load_crane("nov-250t")
DURATION = 18.0


class Parallel:
    """A twin that steps when it gets the tip's motion, in this process; its first row comes after ten cycles."""

    def __init__(self, task: Task) -> None:
        self.session = stillhook.Session(task.crane, task.scenario)
        self.face, self.events, self.cycles, self.pumped = SimpleNamespace(scheduling="none"), list[Event](), 0, 0

    def __enter__(self) -> Parallel:
        return self

    def __exit__(self, *of: object) -> None:
        pass

    def write(self, values: Mapping[str, float], source: str, stamp: float) -> None:
        self.session.step(dict(values))
        self.cycles += 1

    def latest(self) -> Row | None:
        counts = {"late_cycles": 3.0, "overrun_cycles": 1.0}
        values = {name: self.session.get(name) for name in demo.COMPARED} | counts
        return Row(self.cycles, values) if self.cycles > 10 else None

    def pump(self) -> None:
        self.pumped += 1

    def tell(self, happened: Event) -> None:
        self.events.append(happened)


@pytest.fixture(scope="module")
def shown() -> tuple[demo.Outcome, list[demo.Moment]]:
    moments: list[demo.Moment] = []
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(demo, "LiveTwin", Parallel)
        patched.setattr(demo, "Deadlines", lambda cycle: SimpleNamespace(wait=lambda n: 0.011 if n == 7 else 0.009))
        outcome = demo.demonstrate(CRANE, DURATION, moments.append)
    return outcome, moments


@pytest.mark.slow
def test_ten_moments_a_second_are_shown_from_the_first_row_on(shown: tuple[demo.Outcome, list[demo.Moment]]) -> None:
    _, moments = shown
    assert [m.time for m in moments] == pytest.approx([0.1 * k for k in range(1, round(10 * DURATION))])


@pytest.mark.slow
def test_the_alarm_comes_after_the_change_and_none_before(shown: tuple[demo.Outcome, list[demo.Moment]]) -> None:
    """The friction grows after a third. No deviation before: the twin is the crane then, and gets its motion."""
    outcome, moments = shown
    assert outcome.changed == pytest.approx(DURATION / 3.0)
    assert outcome.changed < outcome.alarm < DURATION
    assert outcome.false_alarms == 0
    before = [d.rms for m in moments if m.time < outcome.changed for d in m.deviations if d.rms == d.rms]
    assert before
    assert max(before) < 1e-9
    names = [e.name for m in moments for e in m.events]
    assert names.index("friction") < names.index("alarm")
    assert names.count("friction") == 1


@pytest.mark.slow
def test_late_cycles_of_both_are_counted(shown: tuple[demo.Outcome, list[demo.Moment]]) -> None:
    outcome, _ = shown
    assert (outcome.late, outcome.overrun, outcome.plc_late) == (3, 1, 1)
    assert outcome.reason.startswith("The crane's friction grew by 30% at 6.0 s, the alarm came ")
    assert outcome.reason.endswith("; 3 late cycles of the twin.")


def test_the_cranes_friction_grows_in_each_of_its_terms() -> None:
    """Of the law, not of where it bends: Stribeck's speed stays."""
    grown, filed = demo.with_friction(CRANE, 1.3).friction.system, CRANE.friction.system
    ratios = {name: getattr(grown, name) / getattr(filed, name) for name in ("Y_1", "Y_3", "Y_4", "Y_5")}
    assert ratios == pytest.approx({"Y_1": 1.3, "Y_3": 1.3, "Y_4": 1.0, "Y_5": 1.3})
