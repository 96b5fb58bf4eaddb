"""Long work says what it does, can be cancelled, and keeps what was finished."""

import threading
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import stillhook
from stillhook.base.progress import Event, Monitor, Parts, Relay

CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="30 s", warm_up="10 s")
MANY = [CASE.model_copy(update={"load": 1000.0 * t, "name": f"{t} t"}) for t in range(20, 84)]
SMALL_MAP = {"loads": "50 t, 100 t", "speeds": "20 m/min to 60 m/min by 2 m/min", "controllers": ["ns", "ssc"]}


def check_order(events: list[Event]) -> None:
    """Shares never fall; within a stage neither does what is done, and it is never more than there is."""
    assert all(a.share <= b.share for a, b in pairwise(events))
    assert all(a.done <= b.done for a, b in pairwise(events) if a.stage == b.stage)
    assert all(0 <= e.done <= e.total for e in events)
    assert all(e.remaining is None or e.remaining >= 0.0 for e in events)


def cancelled_at(done: int) -> tuple[Monitor, list[Event]]:
    """A monitor that cancels once so many parts are finished, and the events that it saw."""
    token, events = stillhook.CancelToken(), list[Event]()

    def listen(event: Event) -> None:
        events.append(event)
        if event.done >= done:
            token.cancel()

    return Monitor(listen, cancel=token), events


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
def test_events_of_many_runs_never_go_back_and_end_with_all_done(threads: int) -> None:
    events: list[Event] = []
    stillhook.simulate(CRANE, MANY, threads=threads, progress=Monitor(events.append))
    check_order(events)
    assert {e.stage for e in events} == {"runs"}
    assert (events[0].done, events[0].share) == (0, 0.0)
    assert (events[-1].done, events[-1].total, events[-1].share) == (64, 64, 1.0)
    assert events[-1].cell in {case.name for case in MANY}


@pytest.mark.slow
def test_a_cancelled_batch_returns_its_finished_runs_and_resumes_from_its_store(tmp_path: Path) -> None:
    monitor, seen = cancelled_at(16)
    with pytest.raises(stillhook.Cancelled) as stopped:
        stillhook.simulate(CRANE, MANY, threads=1, store=tmp_path / "runs", progress=monitor)
    check_order(seen)
    partial = stopped.value.partial
    assert 16 <= partial.sizes["case"] < len(MANY)
    events: list[Event] = []
    whole = stillhook.simulate(CRANE, MANY, threads=1, store=tmp_path / "runs", progress=Monitor(events.append))
    assert events[0].done == partial.sizes["case"]
    kept = whole.sel(case=partial["case"].values)
    assert np.array_equal(kept["e_c_pp"].values, partial["e_c_pp"].values)
    assert np.array_equal(whole["e_c_pp"].values, stillhook.simulate(CRANE, MANY)["e_c_pp"].values)


@pytest.mark.parametrize("token", [threading.Event, stillhook.CancelToken])
def test_work_that_was_cancelled_before_it_began_runs_nothing(token: Callable[[], threading.Event]) -> None:
    cancel = token()
    getattr(cancel, "cancel", getattr(cancel, "set", None))()
    with pytest.raises(stillhook.Cancelled) as stopped:
        stillhook.simulate(CRANE, MANY, progress=Monitor(cancel=cancel))
    assert stopped.value.partial is None


def test_cancelling_is_no_error_that_a_handler_of_errors_swallows() -> None:
    assert not issubclass(stillhook.Cancelled, stillhook.StillhookError)


@pytest.mark.slow
def test_a_cancelled_map_says_which_cells_it_has_not_run() -> None:
    monitor, seen = cancelled_at(32)
    with pytest.raises(stillhook.Cancelled) as stopped:
        stillhook.analysis.operability_map(CRANE, threads=1, progress=monitor, **SMALL_MAP)
    partial = stopped.value.partial
    assert {e.stage for e in seen} == {"map"}
    whole = stillhook.analysis.operability_map(CRANE, **SMALL_MAP).sel(controller=["ns", "ssc"])
    partial = partial.sel(controller=["ns", "ssc"])
    missing = partial["cause"].values == "not run"
    assert 0 < missing.sum() <= 84 - 32
    assert np.isnan(partial["e_c_pp"].values[missing]).all()
    assert not partial["applicable"].values[missing].any()
    assert np.array_equal(partial["e_c_pp"].values[~missing], whole["e_c_pp"].values[~missing])


@pytest.mark.long
def test_a_plan_that_is_cancelled_gives_the_limits_of_the_tier_below() -> None:
    token, events = stillhook.CancelToken(), list[Event]()

    def listen(event: Event) -> None:
        events.append(event)
        if event.stage.startswith("frequency domain"):
            token.cancel()

    with pytest.raises(stillhook.Cancelled) as stopped:
        stillhook.plan.plan("template-to-1500m", tier="frequency", progress=Monitor(listen, cancel=token))
    check_order(events)
    assert events[0].stage == "preparation"
    partial = stopped.value.partial
    assert partial.facts["tiers"] == ["closed-form"]
    assert partial.workable


def test_stages_inside_a_stage_are_named_after_it() -> None:
    events: list[Event] = []
    outer = Parts(Monitor(events.append), {"time domain": 1.0, "weather": 1.0}, clock=lambda: 0.0)
    inner = Parts(outer("time domain"), {"first": 1.0, "second": 1.0}, clock=lambda: 0.0)
    inner("first")(1.0)
    inner("second")(1.0)
    outer("weather")(1.0)
    stages = list(dict.fromkeys(e.stage for e in events))
    assert stages == ["time domain", "time domain: first", "time domain: second", "weather"]
    check_order(events)


def test_rounds_of_a_search_count_on_and_their_total_may_grow() -> None:
    events: list[Event] = []
    monitor = Monitor(events.append)
    for before, total in ((0, 100), (40, 90), (80, 140)):
        part = Relay(monitor, monitor, before, total)
        for done in (10, 40):
            part.count("cell", done, 40)
    check_order(events)
    assert [e.done for e in events] == [10, 40, 50, 80, 90, 120]
    assert events[-1].total == 140
