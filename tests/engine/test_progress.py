"""Progress of long work is in proportion to time, so that the time left is right early on."""

from collections.abc import Callable, Iterable

import pytest

from stillhook.base.progress import Meter, Parts, Progress, TimeLeft

SEEN_FROM, WITHIN = 0.1, 0.25
"""From a tenth of the work on, the time left is right within a quarter of it."""


class Clock:
    """Seconds that pass when they are told to."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now

    def work(self, seconds: float) -> None:
        self.now += seconds


def errors_of(clock: Clock, whole: float, run: Callable[[Progress], None]) -> list[float]:
    """Relative error of the time left at every report after a tenth of work that takes `whole` seconds."""
    left, begin, errors = TimeLeft(clock), clock.now, []

    def report(share: float) -> None:
        left.report(share)
        truly = whole - (clock.now - begin)
        if clock.now - begin >= SEEN_FROM * whole and truly > 0.01 * whole and left.seconds is not None:
            errors.append(left.seconds / truly - 1.0)

    run(report)
    return errors


def steps(clock: Clock, seconds: float, n: int) -> Iterable[float]:
    for i in range(n):
        clock.work(seconds / n)
        yield (i + 1) / n


def test_time_left_of_uneven_cases_is_right_when_they_are_weighed() -> None:
    clock, costs = Clock(), [1.0, 9.0, 1.0, 1.0, 30.0, 2.0, 8.0, 1.0, 20.0, 2.0]

    def run(report: Progress) -> None:
        meter = Meter(sum(costs), report)
        meter.tell()
        for cost in costs:
            reached = meter.part(cost)
            for share in steps(clock, 0.7 * cost, 4):
                reached(share)

    errors = errors_of(clock, 0.7 * sum(costs), run)
    assert len(errors) > 20
    assert max(map(abs, errors)) < 0.01


def test_the_same_cases_counted_alike_would_mislead() -> None:
    clock, costs = Clock(), [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 30.0]

    def run(report: Progress) -> None:
        meter = Meter(len(costs), report)
        meter.tell()
        for cost in costs:
            clock.work(cost)
            meter.part(1.0)(1.0)

    assert max(map(abs, errors_of(clock, sum(costs), run))) > WITHIN


@pytest.mark.parametrize("slower", [0.3, 1.0, 4.0])
def test_time_left_of_parts_holds_on_machines_of_another_speed(slower: float) -> None:
    """One part is most of the work, as the highest tier of a plan is."""
    expected = {"frequency": 5.0, "time": 90.0, "report": 5.0}
    clock = Clock()

    def run(report: Progress) -> None:
        parts = Parts(report, expected, clock)
        for name, seconds in expected.items():
            reached = parts(name)
            for share in steps(clock, slower * seconds, 20):
                reached(share)

    whole = slower * sum(expected.values())
    assert max(map(abs, errors_of(clock, whole, run))) < 0.01


def test_a_part_whose_results_were_kept_leaves_the_others_their_share() -> None:
    clock, shares = Clock(), list[float]()
    parts = Parts(shares.append, {"kept": 50.0, "run": 50.0}, clock)
    parts("kept")
    clock.work(1.0)
    reached = parts("run")
    reached(0.5)
    assert shares == pytest.approx([0.0, 0.5])


def test_shares_never_fall() -> None:
    clock, shares = Clock(), list[float]()
    parts = Parts(shares.append, {"a": 10.0, "b": 90.0}, clock)
    parts("a")(1.0)
    clock.work(1.0)  # quicker than expected
    parts("b")(1.0)
    parts.at(0.5)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_results_that_were_kept_from_before_say_nothing_about_the_speed() -> None:
    clock = Clock()
    left = TimeLeft(clock)
    left.report(0.8)
    assert left.seconds is None
    assert str(left) == "-:--:--"
    clock.work(10.0)
    left.report(0.9)
    assert left.seconds == pytest.approx(10.0)


def test_time_left_counts_down_between_reports_and_stops_at_nothing() -> None:
    clock = Clock()
    left = TimeLeft(clock)
    left.report(0.0)
    clock.work(60.0)
    left.report(0.01)
    assert str(left) == "1:39:00"
    clock.work(45.0)
    assert str(left) == "1:38:15"
    clock.work(10000.0)
    assert left.seconds == 0.0
