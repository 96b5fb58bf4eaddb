"""One door to runs: the same numbers whoever makes them, alone or by the thousand, kept as they finish, found again, in
bounded memory; scenarios and lowerings alike."""

import os
import re
import signal
import subprocess
import sys
import time
import tracemalloc
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from tests.engine.clusters import local_client
from tests.engine.lifts import IN_SEAS, deep_lift, in_sea

from stillhook import Crane, Scenario, Sine, load_crane, simulate
from stillhook.engine import store
from stillhook.engine.scenario.summary import numbers_of
from stillhook.engine.simulate import run_cases
from stillhook.engine.store import SUFFIX, Summary
from stillhook.engine.tasks import Task, carried, cluster
from stillhook.errors import SimulationError, SpecError, StillhookError
from stillhook.library import changed
from stillhook.sea.motion.recorded import Recorded

pytestmark = pytest.mark.slow

CRANE, PURE = load_crane("nov-250t"), load_crane("nov-100t-pure-active")
STIFF = changed(CRANE, {"active": {"boost": {"conductance": "60000 L/min/bar"}}})
"""Its fastest mode is beyond what a step of 5 ms can follow."""
STRONG = changed(CRANE, {"control": {"K_p": "0.3 1/m"}})
MIB = 2**20


def case(i: int, **more: object) -> Scenario:
    tip = Sine(amplitude="1 m", period="10 s")
    given = {"load": f"{10 + i} t", "s_w": "100 m", "tip": tip, "duration": "20 s", "warm_up": "5 s"}
    return Scenario(**(given | more))


SCENARIOS = [case(i) for i in range(40)]


class Batch(NamedTuple):
    """Cases, and their summaries as one thread makes them."""

    cases: list[Any]
    expected: list[Summary]


def same(a: list[Summary], b: list[Summary]) -> bool:
    """Equal to the last bit, NaN counting as itself."""
    return repr(a) == repr(b)


@pytest.fixture(scope="module", params=[SCENARIOS, IN_SEAS], ids=["scenarios", "lowerings"])
def batch(request) -> Batch:
    return Batch(request.param, run_cases(CRANE, request.param, threads=1))


@pytest.fixture
def counted(monkeypatch) -> list[int]:
    """Places of the cases that were really run."""
    ran: list[int] = []
    run = Task.run
    monkeypatch.setattr(Task, "run", lambda task, progress=None: (ran.extend(task.indices), run(task, progress))[1])
    return ran


# The same bits


def test_threads_change_no_bit(batch):
    assert same(run_cases(CRANE, batch.cases, threads=3), batch.expected)


@pytest.mark.parametrize("lanes", [1, 16])
def test_a_case_has_the_same_numbers_alone_and_in_company(batch, lanes):
    assert same(run_cases(CRANE, batch.cases[17], lanes=lanes), [batch.expected[17]])


def test_a_list_through_simulate_has_these_numbers(batch):
    run = simulate(CRANE, batch.cases)
    names = [name for name in batch.expected[0] if name in run.data_vars and name not in ("status", "notes")]
    assert len(names) > len(numbers_of(CRANE)) - 5
    for name in names:
        np.testing.assert_array_equal(run[name].values, [s[name] for s in batch.expected], err_msg=name)


def test_every_case_may_have_its_crane(batch):
    usual, strong = run_cases([CRANE, STRONG], [batch.cases[0]] * 2)
    assert same([usual], batch.expected[:1])
    assert strong["e_c_pp"] < usual["e_c_pp"]


def test_lengths_and_drives_may_be_mixed_and_come_back_in_order():
    three = SCENARIOS[3:6]
    mixed = [three[0], case(0, duration="25 s"), three[1], case(0, sensors={"delay": "0.1 s"}), three[2]]
    found = run_cases(CRANE, mixed)
    assert same(found[::2], run_cases(CRANE, three))
    assert found[1]["counted_time"] == pytest.approx(20.0)
    assert found[3]["e_c_pp"] > found[0]["e_c_pp"]


# A store


def test_what_is_in_the_store_is_not_run_again(tmp_path, batch, counted):
    n = len(batch.cases) // 2
    assert same(run_cases(CRANE, batch.cases[:n], store=tmp_path), batch.expected[:n])
    assert sorted(counted) == list(range(n))
    counted.clear()
    assert same(run_cases(CRANE, batch.cases, store=tmp_path), batch.expected)
    assert sorted(counted) == list(range(n, len(batch.cases)))
    counted.clear()
    assert same(run_cases(CRANE, batch.cases[::-1], store=tmp_path), batch.expected[::-1])
    assert counted == []


T = np.arange(0.0, 30.0, 0.5)
RECORD = Recorded(T, np.sin(0.6 * T), source="log.csv", report="column 2")
RENAMED = Recorded(RECORD.times, RECORD.heights, source="copy of log.csv", report="column 3")
MOVED = Recorded(RECORD.times, np.nextafter(RECORD.heights, 2.0), source="log.csv", report="column 2")
FRICTION, TITLE = ({"friction": {"library": "crane-2"}}, {"title": "the same machine by another title"})


@pytest.mark.parametrize(
    ("before", "after", "known"),
    [
        ((CRANE, case(0)), (STRONG, case(0)), False),
        ((CRANE, case(0)), (changed(CRANE, FRICTION), case(0)), False),
        ((CRANE, case(0)), (changed(CRANE, TITLE), case(0)), True),
        ((CRANE, case(0)), (changed(CRANE, {"name": "another"}), case(0, name="again")), True),
        ((CRANE, case(0, tip=RECORD)), (CRANE, case(0, tip=RENAMED, name="again")), True),
        ((CRANE, case(0, tip=RECORD)), (CRANE, case(0, tip=MOVED)), False),
        ((CRANE, in_sea()), (CRANE, in_sea(deep_lift(name="again"))), True),
        *(
            ((CRANE, in_sea()), (CRANE, in_sea(**other)), False)
            for other in ({"seed": 1}, {"Hs": 2.1}, {"left": 0.5}, {"lift": deep_lift("1470 m")}, {"water": True})
        ),
    ],
)
def test_a_result_is_known_by_what_it_follows_from(tmp_path, counted, before, after, known):
    for crane, one in (before, after):
        run_cases(crane, [one], store=tmp_path)
    assert len(counted) == (1 if known else 2)


@pytest.mark.parametrize("options", [{"step": "2.5 ms"}, {"sampling": "20 ms"}, {"end": "programme"}])
def test_results_made_otherwise_are_kept_apart(tmp_path, counted, options):
    for each in ({}, options, options):
        simulate(CRANE, [in_sea()], store=tmp_path, **each)
    assert counted == [0, 0]


def test_other_code_is_another_result(tmp_path, counted, monkeypatch):
    run_cases(CRANE, SCENARIOS[:2], store=tmp_path)
    monkeypatch.setattr(store, "results_hash", lambda: "other code")
    run_cases(CRANE, SCENARIOS[:2], store=tmp_path)
    assert len(counted) == 4


def test_notes_and_status_come_back_from_the_store(tmp_path):
    fast = [case(i, tip=Sine(amplitude="4 m", period="9 s"), mode="ns") for i in range(3)]
    first = run_cases(CRANE, fast, store=tmp_path)
    assert first[0]["status"] != "ok"
    assert any("pumps will saturate" in note for note in first[0]["notes"])
    assert same(run_cases(CRANE, fast, store=tmp_path), first)


@pytest.mark.thorough
def test_a_store_that_fails_stops_the_work(tmp_path, counted, monkeypatch):
    def full(*_: object) -> None:
        raise SimulationError("no room")

    monkeypatch.setattr(store.Store, "put", full)
    long = [case(i, duration="1000 s") for i in range(160)]
    with pytest.raises(SimulationError, match="no room") as kept:
        run_cases(CRANE, long, store=tmp_path)
    begun = len(counted)
    time.sleep(0.5)
    assert kept.value.__traceback__ is not None
    assert len(counted) == begun < len(long)


def test_an_interrupted_run_keeps_what_had_finished(tmp_path, batch, counted):
    def stop(share: float) -> None:
        if any(tmp_path.glob(f"*{SUFFIX}")):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_cases(CRANE, batch.cases, store=tmp_path, threads=1, progress=stop)
    assert not [p for p in tmp_path.iterdir() if not p.name.endswith(SUFFIX) and "stillhook-manifest" not in p.name]
    counted.clear()
    assert same(run_cases(CRANE, batch.cases, store=tmp_path), batch.expected)
    assert 0 < len(counted) < len(batch.cases)


LONG = """
import sys
from stillhook import Scenario, Sine, load_crane
from stillhook.engine.simulate import run_cases
tip = Sine(amplitude="1 m", period="10 s")
cases = [Scenario(load=f"{10 + i} t", s_w="100 m", tip=tip, duration="2000 s", warm_up="5 s") for i in range(96)]
print(len(run_cases(load_crane("nov-250t"), cases, store=sys.argv[1])), flush=True)
"""


@pytest.mark.thorough
def test_a_killed_run_goes_on_where_it_stood(tmp_path, counted):
    run = subprocess.Popen(
        [sys.executable, "-c", LONG, str(tmp_path)], stdout=subprocess.DEVNULL, env=os.environ | {"PYTHONPATH": "src"}
    )
    end = time.monotonic() + 120.0
    while not any(tmp_path.glob(f"*{SUFFIX}")):
        assert time.monotonic() < end
        assert run.poll() is None
        time.sleep(0.005)
    os.kill(run.pid, signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
    run.wait()
    cases = [case(i, duration="2000 s") for i in range(96)]
    found = run_cases(CRANE, cases, store=tmp_path)
    assert len(found) == 96
    assert 0 < len(counted) < 96
    assert same(run_cases(CRANE, cases[90]), [found[90]])


@pytest.mark.thorough
def test_memory_does_not_grow_with_the_number_of_noisy_cases():
    """Noise of a 60 s run takes 240 kB; held for every case at once 600 of them would take 140 MiB."""
    noise = {"noise_s_tip": "1 mm", "noise_v_tip": "1 mm/s", "noise_a_tip": "0.001 m/s^2", "noise_s_w": "1 mm"}
    noise |= {"noise_F": "1 kN"}
    cases = [case(i % 200, duration="60 s", warm_up="50 s", sensors={**noise, "seed": i}) for i in range(600)]
    run_cases(CRANE, cases[:16])
    tracemalloc.start()
    run_cases(CRANE, cases, threads=1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100 * MIB


# Refusals


@pytest.mark.parametrize(
    ("crane", "cases", "options", "says"),
    [
        (CRANE, [], {}, "the list of cases is empty. Give at least one Scenario or Lowering"),
        (CRANE, 3, {}, "case 0 = 3: not a Scenario or Lowering"),
        (CRANE, [in_sea(), "lift"], {}, "case 1 = "),
        (
            CRANE,
            [deep_lift(), case(0)],
            {},
            "case 0 is a Lowering, case 1 a Scenario. Run scenarios and lowerings apart",
        ),
        ([CRANE], SCENARIOS[:2], {}, "1 cranes and 2 cases"),
        ([CRANE, PURE], SCENARIOS[:2], {}, "pure-active with a PLC cycle of 0.01 s. Run winches of one kind together"),
        (CRANE, [*SCENARIOS[:38], case(290)], {}, "case 38: Load 300 t exceeds the SWL"),
        (
            CRANE,
            [in_sea(), in_sea(deep_lift("1600 m"))],
            {},
            "case 1: start_depth = 1600 m: the payload would lie on the",
        ),
        (CRANE, case(0), {"on_failure": "ignore"}, 'on_failure = "ignore": give one of raise, mark.'),
        *((CRANE, case(0), {"threads": n}, "give a whole number from 1 to 1024.") for n in (0, -1, 1.5, "2")),
        (CRANE, case(0), {"store": "kept"}, "series=False"),
        *((CRANE, case(0), {"step": f"{h} ms"}, "is not a whole part of the PLC cycle") for h in (3, 20, 0)),
        (CRANE, deep_lift(), {"step": "3 ms"}, "is not a whole part of the PLC cycle"),
        (CRANE, case(0), {"step": "5"}, 'step = "5": no unit'),
        *((CRANE, case(0), {"every": t}, "is not a whole number of PLC cycles") for t in ("15 ms", "0 s", "1 ms")),
        (CRANE, in_sea(), {"end": "soon", "series": False}, 'end = "soon": give one of duration, programme'),
        (CRANE, case(0), {"end": "programme"}, "sampling and end are for lowerings"),
        (CRANE, case(0), {"sampling": "20 ms"}, "sampling and end are for lowerings"),
        (CRANE, in_sea(), {"sampling": "20 ms", "every": "50 ms"}, 'every = "50 ms" is not a whole number of samples'),
        (CRANE, in_sea(), {"sampling": "15 ms", "series": False}, 'sampling = "15 ms" is not a whole number of PLC'),
        (CRANE, in_sea(), {"sampling": "20 m", "series": False}, "sampling"),
    ],
)
def test_what_cannot_be_run_is_told_in_one_line_before_anything_runs(crane, cases, options, says, counted):
    with pytest.raises(StillhookError, match=re.escape(says)) as error:
        simulate(crane, cases, **options)
    assert "\n" not in str(error.value)
    assert counted == []


TOO_LONG = r"^case 33: step 5 ms is too long"
STIFF_CRANES: list[Crane] = [CRANE] * 33 + [STIFF] + [CRANE] * 6


def test_a_step_too_long_for_one_of_many_cranes_names_the_case():
    with pytest.raises(SpecError, match=TOO_LONG):
        run_cases(STIFF_CRANES, SCENARIOS)


def test_a_store_that_cannot_be_made_is_named(tmp_path, batch):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimulationError, match=r"cannot be written"):
        run_cases(CRANE, batch.cases[:2], store=tmp_path / "file" / "store")


# Progress


@pytest.mark.parametrize(
    "cases", [case(0, duration="200 s"), SCENARIOS, deep_lift(duration="90 s")], ids=["one", "many", "a lift"]
)
def test_progress_rises_from_nothing_to_all(cases):
    seen: list[float] = []
    simulate(CRANE, cases, progress=seen.append)
    assert all(a <= b for a, b in pairwise(seen))
    assert seen[0] == 0.0
    assert seen[-1] == pytest.approx(1.0)
    assert len(seen) > 2


def test_an_interrupted_batch_stops_and_returns_nothing():
    class Enough(Exception):
        pass

    def stop(share: float) -> None:
        raise Enough

    with pytest.raises(Enough):
        simulate(CRANE, SCENARIOS, progress=stop)


# A cluster


@pytest.fixture(scope="module")
def client():
    with local_client(2) as client:
        yield client


@pytest.mark.thorough
def test_a_cluster_gives_the_same_bits(client, batch, tmp_path):
    seen: list[float] = []
    assert same(run_cases(CRANE, batch.cases, client=client, store=tmp_path, progress=seen.append), batch.expected)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    assert same(run_cases(CRANE, batch.cases, store=tmp_path), batch.expected)


@pytest.mark.long
def test_many_cranes_go_over_a_cluster_as_they_are(client):
    cranes = [changed(CRANE, {"control": {"K_p": f"{k} 1/m"}}) for k in (0.1, 0.16, 0.3)]
    assert same(run_cases(cranes, SCENARIOS[0], client=client), run_cases(cranes, SCENARIOS[0]))


def test_a_wrong_case_is_named_by_a_worker_as_by_this_machine(client):
    with pytest.raises(SpecError, match=TOO_LONG):
        run_cases(STIFF_CRANES, SCENARIOS, client=client)


def test_workers_with_other_code_are_refused(client, monkeypatch):
    for module in (cluster, carried):
        monkeypatch.setattr(module, "results_hash", lambda: "other code")
    with pytest.raises(SimulationError, match=r"^cluster: a worker runs Stillhook .*, this machine other code\."):
        run_cases(CRANE, SCENARIOS[:2], client=client)


@pytest.mark.thorough
def test_a_killed_worker_loses_nothing(client):
    cases = [case(i, duration="4000 s") for i in range(96)]
    killed: list[int] = []

    def kill_one(share: float) -> None:
        if share > 0.0 and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)

    found = run_cases(CRANE, cases, client=client, progress=kill_one)
    assert killed
    assert len(found) == len(cases)
    assert same(run_cases(CRANE, cases[90]), [found[90]])


@pytest.fixture(autouse=True)
def _nothing_left(tmp_path: Path):
    yield
    assert not list(tmp_path.glob(".*"))
