"""A twin with its observer, in their processes: what is measured moves nothing, and whoever dies is started again."""

from __future__ import annotations

import json
import math
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.live.test_friction_estimate import certified

import stillhook
from stillhook.errors import LiveError
from stillhook.live.observer import AdaptSettings, ObservedTwin, ObserverSettings, observed
from stillhook.live.observer.adaptation import CERTIFIED
from stillhook.live.observer.panel import Proposal
from stillhook.live.runtime import Event, Row, Task
from stillhook.live.runtime.state import LiveState

pytestmark = pytest.mark.slow
CRANE = certified()
CASE = stillhook.Scenario(load="60 t", s_w="800 m", tip="sine 1 m 9 s", mode="ssc")
SETTINGS = ObserverSettings(("s_w", "p_a", "F_w"), timeout=0.5)
ADAPTS = SETTINGS._replace(adapt=AdaptSettings(step=0.05, every=1.0))
PATIENCE = 60.0


class Kept:
    """A sink that keeps everything."""

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.table: list[list[float]] = []
        self.events: list[Event] = []

    def rows(self, first: int, names: tuple[str, ...], rows: list) -> None:
        self.names = tuple(names)
        self.table += [row.tolist() for row in rows]

    def event(self, happened: Event) -> None:
        self.events.append(happened)

    def close(self) -> None:
        """Nothing to close."""

    def told(self, name: str) -> list[str]:
        return [e.text for e in self.events if e.name == name]

    def column(self, name: str) -> list[float]:
        return [row[self.names.index(name)] for row in self.table]


@contextmanager
def twin(
    settings: ObserverSettings = SETTINGS, folder: Path | None = None, task: Task | None = None
) -> Iterator[tuple[ObservedTwin, Kept]]:
    kept = Kept()
    state = None if folder is None else folder / "state.bin"
    with ObservedTwin(task or Task(CRANE, CASE, state=state), [kept], settings, folder) as of:
        yield of, kept


def wait(of: ObservedTwin, what: Callable[[Row], bool], each: Callable[[], None] = lambda: None) -> Row:
    end = time.monotonic() + PATIENCE
    while True:
        each()
        of.pump()
        row = of.latest()
        if row is not None and what(row):
            return row
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.long
def test_measured_values_are_shown_with_their_ages_and_never_move_the_winch(tmp_path: Path):
    """The state at the end is that of a session that nobody told anything, to the bit."""
    with twin(folder=tmp_path) as (of, kept):
        assert {"measured.p_a", "age.p_a", "deviation.p_a", "alarm.p_a", "estimate.friction_factor"} <= set(of.names)
        write = lambda: of.write({"measured.p_a": 3.0e7, "measured.s_w": 700.0}, "udp", time.time())
        row = wait(of, lambda row: row.values["measured.p_a"] == 3.0e7 and row.number > 40, write)
        assert 0.0 <= row.values["age.p_a"] < 0.5
        assert math.isnan(row.values["measured.F_w"])
        row = wait(of, lambda row: row.values["age.p_a"] > 0.6)
        assert math.isnan(row.values["measured.p_a"])  # stale
        assert set(row.values) == set(of.names)
    saved = LiveState.from_bytes(tmp_path / "state.bin")
    session = stillhook.Session(CRANE, CASE)
    session.step(cycles=len(kept.table))
    assert saved.session == session.save()
    assert saved.inputs == {}
    assert {3.0e7} <= set(kept.column("measured_p_a"))


@pytest.mark.long
@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"measured.p_a": math.nan}, "p_a = nan"),
        ({"measured.p_a": math.inf}, "p_a = inf"),
        ({"measured.p_a": 250e6}, "p_a = 2.5e+08: give a value from -200000 to 6e+07 Pa"),
        ({"measured.u_p": 0.1}, "u_p is not among the signals of [measured]"),
    ],
)
def test_what_no_sensor_shows_is_left_out_and_told_and_the_rest_is_taken(values: dict[str, float], text: str):
    with twin() as (of, kept):
        of.write({**values, "measured.s_w": 700.0}, "udp")
        row = wait(of, lambda row: True)
        assert math.isnan(row.values["measured.p_a"])
        assert row.values["measured.s_w"] == 700.0
        assert text in kept.told("refused-measured")[0]


@pytest.mark.long
def test_a_flood_is_cut_and_told_and_the_kernel_keeps_time():
    with twin() as (of, kept):
        wait(of, lambda row: row.number > 20)
        for i in range(20_000):
            of.write({"measured.p_a": 1e5 + i}, "udp", time.time())
        row = wait(of, lambda row: bool(kept.told("refused-measured")))
        assert "more than 200 messages a second" in kept.told("refused-measured")[0]
        assert of._panel.messages.count < 5000
        assert row.values["missed_cycles"] == 0.0


@pytest.mark.long
def test_a_wrong_input_is_refused_as_without_an_observer():
    with twin() as (of, _):
        with pytest.raises(LiveError, match="not an input"):
            of.write({"p_a": 1.0}, "udp")
        with pytest.raises(LiveError, match="finite"):
            of.write({"s_tip": math.nan, "measured.p_a": 1e7}, "udp")


@pytest.mark.long
def test_an_observer_that_is_killed_is_an_event_and_started_again_while_the_twin_goes_on():
    with twin() as (of, kept):
        wait(of, lambda row: row.number > 20)
        first, number = of.observer, of.latest().number
        os.kill(first, signal.SIGKILL)
        wait(of, lambda row: of.restarts == 1 and of.observer != first)
        assert ["is started again" in text for text in kept.told("observer-died")] == [True]
        heard = of._values
        row = wait(of, lambda row: of._values > heard)
        assert row.number > number
        numbers = kept.column("cycle_number")
        assert numbers == [float(i) for i in range(len(numbers))]
        assert row.values["missed_cycles"] == 0.0


@pytest.mark.thorough
def test_an_observer_that_hangs_is_killed_and_started_again(monkeypatch: pytest.MonkeyPatch):
    with twin() as (of, kept):
        heard = of._values
        wait(of, lambda row: of._values > heard + 2)
        monkeypatch.setattr(observed, "HUNG", 1.0)
        monkeypatch.setattr(observed, "FIRST_WAIT", 0.1)
        first = of.observer
        os.kill(first, signal.SIGSTOP)
        wait(of, lambda row: of.restarts >= 1)
        assert of.observer != first
        assert kept.told("observer-died")


def propose(of: ObservedTwin, proposal: Proposal) -> Callable[[], None]:
    """Say so in place of the observer."""
    of._listen = lambda: None

    def say() -> None:
        of._proposal = proposal._replace(time=time.monotonic())

    return say


GOOD = Proposal(0.0, known=True, value=1.1, low=1.08, high=1.12)


@pytest.mark.long
def test_the_factor_is_in_the_rows_and_every_change_is_an_event(tmp_path: Path):
    with twin(ADAPTS, tmp_path) as (of, kept):
        say = propose(of, GOOD)
        wait(of, lambda row: row.number > 20)
        row = wait(of, lambda row: row.values["friction_factor"] == 1.1, say)
        assert row.values["refused_inputs"] == 0.0
        leave = propose(of, GOOD._replace(value=None, reason="outside the validated envelope: load 200 t"))
        wait(of, lambda row: row.values["friction_factor"] == CERTIFIED, leave)
    factors = [round(x, 3) for x in kept.column("friction_factor")]
    assert list(dict.fromkeys(factors)) == [1.0, 1.05, 1.1]
    assert factors[-1] == CERTIFIED
    texts = kept.told("adapted")
    assert "from 1.000 to 1.050 (95 %: 1.080 to 1.120): estimate 1.100." in texts[0]
    assert "from 1.100 to 1.000: withdrawn, outside the validated envelope: load 200 t." in texts[-1]


@pytest.mark.long
def test_a_factor_is_refused_to_clients_while_it_follows_the_crane():
    with twin(ADAPTS) as (of, _):
        assert "friction_factor" not in of.inputs
        with pytest.raises(LiveError, match="follows the crane"):
            of.write({"friction_factor": 1.4, "v_op": 0.1}, "opcua")
        row = wait(of, lambda row: row.number > 30)
        assert row.values["friction_factor"] == CERTIFIED


@pytest.mark.thorough
def test_a_kernel_that_is_killed_gets_the_factor_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(observed, "AGAIN", 0.3)
    with twin(ADAPTS, tmp_path) as (of, _):
        say = propose(of, GOOD)
        wait(of, lambda row: row.values["friction_factor"] == 1.1, say)
        os.kill(of.twin.pid, signal.SIGKILL)
        wait(of, lambda row: of.twin.restarts == 1, say)
        number = of.latest().number
        wait(of, lambda row: row.number > number + 20 and row.values["friction_factor"] == 1.1, say)


def resumed(folder: Path, settings: ObserverSettings, crane: stillhook.Crane = CRANE) -> tuple[float, Kept]:
    """Factor a second after the start of a twin that was adapted to 1.1 before."""
    session = stillhook.Session(crane, CASE)
    session.step(cycles=100)
    session.set("friction_factor", 1.1)
    (folder / "state.bin").write_bytes(LiveState(session.save(), {}, 1).to_bytes())
    (folder / observed.FILE).write_text(json.dumps({"value": 1.1}))
    with twin(settings, folder, Task(crane, CASE, state=folder / "state.bin")) as (of, kept):
        row = wait(of, lambda row: row.number > 100)
        return row.values["friction_factor"], kept


@pytest.mark.long
def test_a_restart_goes_on_with_the_factor_that_it_had(tmp_path: Path):
    factor, kept = resumed(tmp_path, ADAPTS)
    assert factor == 1.1
    assert set(kept.column("friction_factor")) == {1.1}


@pytest.mark.parametrize(
    ("settings", "crane", "reason"),
    [
        (SETTINGS, CRANE, "[adapt] is left out"),
        (ADAPTS, certified(synthetic=True), "SYNTHETIC"),
        (ADAPTS, stillhook.load_crane("nov-250t"), "no certificate"),
    ],
)
@pytest.mark.thorough
def test_a_restart_that_no_longer_allows_the_factor_withdraws_it(
    settings: ObserverSettings, crane: stillhook.Crane, reason: str, tmp_path: Path
):
    factor, kept = resumed(tmp_path, settings, crane)
    assert factor == CERTIFIED
    assert reason in kept.told("adapted")[0]
    assert json.loads((tmp_path / observed.FILE).read_text())["value"] == CERTIFIED


@pytest.mark.parametrize(
    "text", ["", "{", '{"value": "x"}', '{"value": NaN}', '{"value": -3}', "[1]", "\0", "[" * 9999]
)
def test_a_file_of_the_factor_that_is_damaged_is_no_factor(text: str, tmp_path: Path):
    (tmp_path / observed.FILE).write_text(text)
    assert observed.factor_in(tmp_path / observed.FILE) == CERTIFIED
    assert observed.factor_in(tmp_path / "none") == CERTIFIED
