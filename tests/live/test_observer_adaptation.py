"""Which friction factor the twin runs with: small steps towards the estimate, at once back to the certified one."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest
from tests.live.test_friction_estimate import CRANE, certified

from stillhook.live.observer.adaptation import (
    CERTIFIED,
    CONFIRM,
    REST,
    SETTLED,
    SILENT,
    Adaptation,
    Change,
    not_allowed,
)
from stillhook.live.observer.panel import Proposal
from stillhook.live.observer.settings import AdaptSettings

SETTINGS = AdaptSettings(step=0.05, every=5.0)
GOOD = Proposal(0.0, known=True, value=1.3, low=1.27, high=1.33)
STEPPED = "Total loss has risen by 12 %."


class Twin:
    """An adaptation, and its changes with their times, looked at every second."""

    def __init__(self, value: float = CERTIFIED) -> None:
        self.of, self.now = Adaptation(SETTINGS, value, 0.0), 0.0
        self.changes: list[tuple[float, Change]] = []

    def run(self, seconds: float, proposal: Callable[[float], Proposal | None] | Proposal | None) -> Twin:
        end = self.now + seconds
        while self.now < end:
            self.now += 1.0
            given = proposal(self.now) if callable(proposal) else proposal
            fresh = given._replace(time=self.now) if isinstance(given, Proposal) else given
            if (change := self.of.next(fresh, self.now)) is not None:
                self.changes.append((self.now, change))
        return self


def adapted() -> Twin:
    of = Twin().run(120.0, GOOD)
    assert of.of.value == pytest.approx(1.3, abs=0.01)
    of.changes.clear()
    return of


def test_the_factor_follows_in_steps_no_larger_and_no_quicker_than_allowed():
    of = Twin().run(120.0, GOOD)
    sizes = [abs(c.new - c.old) for _, c in of.changes]
    times = [t for t, _ in of.changes]
    assert max(sizes) <= SETTINGS.step + 1e-12
    assert min(b - a for a, b in itertools.pairwise(times)) >= SETTINGS.every
    assert of.of.value == pytest.approx(1.3)
    assert all(c.old == pytest.approx(b.new) for (_, b), (_, c) in zip(of.changes, of.changes[1:], strict=False))
    assert all((c.low, c.high) == (1.27, 1.33) for _, c in of.changes)
    assert "Friction factor from 1.000 to 1.050 (95 %: 1.270 to 1.330): estimate 1.300." in of.changes[0][1].text


def test_what_is_less_than_the_deadband_changes_nothing():
    of = adapted().run(300.0, GOOD._replace(value=1.305))
    assert of.changes == []


@pytest.mark.parametrize(
    ("proposal", "reason"),
    [
        (GOOD._replace(value=None, reason="outside the validated envelope: load 200 t"), "load 200 t"),
        (GOOD._replace(known=False, value=None, reason="no half waves any more"), "no half waves"),
        (GOOD._replace(steps=1, step=STEPPED), "Total loss has risen"),
    ],
)
def test_bounds_that_are_left_an_estimate_that_is_lost_and_a_step_withdraw_at_once(proposal: Proposal, reason: str):
    of = adapted().run(1.0, proposal)
    (change,) = [c for _, c in of.changes]
    assert change.new == of.of.value == CERTIFIED
    assert reason in change.reason
    assert change.reason.startswith("withdrawn, ")


def test_an_observer_that_is_silent_withdraws():
    of = adapted()
    of.run(2.0 * SILENT, lambda now: None)
    assert of.of.value == CERTIFIED
    assert "silent" in of.changes[0][1].reason
    old = adapted()
    assert old.of.next(GOOD._replace(time=old.now), old.now + SILENT - 1.0) is None
    assert old.of.next(GOOD._replace(time=old.now), old.now + SILENT + 1.0).new == CERTIFIED


def test_after_a_step_the_new_estimate_is_followed_as_soon_as_it_is_there():
    of = adapted().run(1.0, GOOD._replace(steps=1, step=STEPPED))
    of.run(30.0, Proposal(0.0, reason="3 of 8 half waves", steps=1))
    assert of.of.value == CERTIFIED
    of.run(60.0, GOOD._replace(value=1.5, steps=1))
    assert of.of.value == pytest.approx(1.5)


def test_a_deviation_on_the_way_to_the_estimate_stops_nothing():
    """It may be what the factor is about."""
    of = Twin().run(60.0, GOOD._replace(deviating="p_a"))
    assert of.of.value == pytest.approx(1.3, abs=0.01)


def test_a_deviation_that_stays_although_the_factor_is_the_estimate_withdraws_until_it_is_over():
    of = adapted().run(SETTLED + 2.0, GOOD).run(1.0, GOOD._replace(deviating="p_a"))
    assert of.of.value == CERTIFIED
    assert "p_a deviates although" in of.changes[-1][1].reason
    of.run(1000.0, GOOD._replace(deviating="p_a"))
    assert of.of.value == CERTIFIED
    of.run(100.0, GOOD)
    assert of.of.value > 1.2


def test_what_is_withdrawn_again_and_again_rests_longer_each_time():
    """A deviation at its limit must not shake the twin."""
    of = adapted()
    of.run(20_000.0, lambda now: GOOD._replace(deviating="s_w" if now % 60.0 < 30.0 else ""))
    withdrawn = [t for t, c in of.changes if c.new == CERTIFIED]
    rests = [b - a for a, b in itertools.pairwise(withdrawn)]
    assert 3 <= len(withdrawn) <= 12
    assert all(later > earlier for earlier, later in itertools.pairwise(rests) if earlier < 2000.0)
    assert rests[0] > REST


def test_outside_the_envelope_the_twin_is_as_certified_for_a_while():
    of = adapted().run(1.0, GOOD._replace(value=None, reason="outside"))
    of.run(0.5 * REST, GOOD)
    assert of.of.value == CERTIFIED


def test_a_factor_from_before_the_start_is_held_until_an_estimate_can_be_there_and_no_longer():
    of = Twin(1.2).run(CONFIRM - 5.0, Proposal(0.0))
    assert of.of.value == 1.2
    of.run(10.0, Proposal(0.0))
    assert of.of.value == CERTIFIED


@pytest.mark.parametrize(
    "proposal",
    [GOOD._replace(value=None, reason="outside"), GOOD._replace(steps=1, step=STEPPED)],
)
def test_a_factor_from_before_the_start_is_withdrawn_as_any_other(proposal: Proposal):
    assert Twin(1.2).run(1.0, proposal).of.value == CERTIFIED


def test_an_estimate_confirms_the_factor_from_before_the_start():
    of = Twin(1.2).run(2.0 * CONFIRM, GOOD._replace(value=1.205))
    assert (of.of.value, of.changes) == (1.2, [])


def test_an_observer_that_was_started_again_gets_time_to_confirm():
    of = adapted()
    of.of.begin_again(of.now)
    assert of.run(CONFIRM - 5.0, Proposal(0.0)).of.value > 1.2
    assert of.run(10.0, Proposal(0.0)).of.value == CERTIFIED


def test_an_observer_that_dies_again_and_again_holds_no_factor_for_ever():
    of = adapted()
    for _ in range(10):
        of.of.begin_again(of.now)
        of.run(60.0, lambda now: None)
    assert of.changes[0][1].new == CERTIFIED
    assert of.changes[0][0] == pytest.approx(120.0 + CONFIRM, abs=2.0)
    assert len(of.changes) == 1


def test_only_a_certificate_of_real_logs_allows_a_factor():
    assert "no certificate" in not_allowed(CRANE)
    assert "SYNTHETIC" in not_allowed(certified(synthetic=True))
    assert "does not hold" in not_allowed(certified(code="other"))
    assert not_allowed(certified()) == ""
