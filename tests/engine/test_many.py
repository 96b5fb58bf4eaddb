"""Runs by the thousand: the same numbers whoever makes them, kept as they finish, found again, in bounded memory."""

import os
import signal
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.engine import store as stored
from stillhook.engine import tasks
from stillhook.engine.scenario.summary import numbers_of
from stillhook.engine.simulate import run_cases
from stillhook.engine.store import SUFFIX
from stillhook.engine.tasks import Task
from stillhook.errors import ScenarioError, SimulationError, SpecError
from stillhook.library import changed
from stillhook.sea.motion.recorded import Recorded

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
MIB = 2**20


def case(i: int, **more: object) -> Scenario:
    asked = {
        "load": f"{10 + i} t",
        "s_w": "100 m",
        "tip": Sine(amplitude="1 m", period="10 s"),
        "duration": "20 s",
        "warm_up": "5 s",
    }
    return Scenario(**(asked | more))


CASES = [case(i) for i in range(40)]


def same(a: list[dict], b: list[dict]) -> bool:
    """Equal to the last bit, NaN counting as itself."""
    return repr(a) == repr(b)


@pytest.fixture(scope="module")
def truth():
    return run_cases(CRANE, CASES, threads=1)


@pytest.fixture
def counted(monkeypatch):
    """How many cases were really run."""
    ran: list[int] = []
    inner = Task.run
    monkeypatch.setattr(Task, "run", lambda task, progress=None: (ran.extend(task.indices), inner(task, progress))[1])
    return ran


def test_threads_change_no_bit(truth):
    assert same(run_cases(CRANE, CASES, threads=3), truth)


def test_a_case_has_the_same_numbers_alone_and_in_company(truth):
    assert same(run_cases(CRANE, CASES[17]), [truth[17]])


def test_a_list_through_simulate_has_these_numbers(truth):
    run = simulate(CRANE, CASES)
    for name in numbers_of(CRANE):
        np.testing.assert_array_equal(run[name].values, [s[name] for s in truth])


def test_lengths_and_drives_may_be_mixed_and_come_back_in_order(truth):
    mixed = [CASES[3], case(0, duration="25 s"), CASES[4], case(0, sensors={"delay": "0.1 s"}), CASES[5]]
    found = run_cases(CRANE, mixed)
    assert same([found[0], found[2], found[4]], truth[3:6])
    assert found[1]["counted_time"] == pytest.approx(20.0)
    assert found[3]["e_c_pp"] > found[0]["e_c_pp"]


def test_what_is_in_the_store_is_not_run_again(tmp_path, truth, counted):
    assert same(run_cases(CRANE, CASES[:24], store=tmp_path), truth[:24])
    assert sorted(counted) == list(range(24))
    counted.clear()
    assert same(run_cases(CRANE, CASES, store=tmp_path), truth)
    assert sorted(counted) == list(range(24, 40))
    counted.clear()
    assert same(run_cases(CRANE, CASES[::-1], store=tmp_path), truth[::-1])
    assert counted == []


@pytest.mark.parametrize(
    ("what", "known"),
    [
        ({"control": {"K_p": "0.17 1/m"}}, False),
        ({"friction": {"library": "crane-2"}}, False),
        ({"title": "the same machine by another title"}, True),
        ({"name": "the-same-machine-by-another-name"}, True),
    ],
)
def test_a_result_is_known_by_what_it_follows_from(tmp_path, counted, what, known):
    run_cases(CRANE, CASES[:2], store=tmp_path)
    counted.clear()
    run_cases(changed(CRANE, what), CASES[:2], store=tmp_path)
    assert (counted == []) is known


def test_a_record_is_known_by_its_points_and_not_by_its_file(tmp_path, counted):
    t = np.arange(0.0, 30.0, 0.5)
    one = Recorded(t, np.sin(0.6 * t), source="log.csv", report="column 2")
    run_cases(CRANE, [case(0, tip=one)], store=tmp_path)
    counted.clear()
    renamed = Recorded(one.times, one.heights, source="copy of log.csv", report="column 3")
    run_cases(CRANE, [case(0, tip=renamed, name="again")], store=tmp_path)
    assert counted == []
    run_cases(
        CRANE, [case(0, tip=Recorded(one.times, np.nextafter(one.heights, 2.0), source="log.csv"))], store=tmp_path
    )
    assert counted == [0]


def test_another_step_or_other_code_is_another_result(tmp_path, counted, monkeypatch):
    run_cases(CRANE, CASES[:2], store=tmp_path)
    counted.clear()
    run_cases(CRANE, CASES[:2], store=tmp_path, step="2.5 ms")
    assert len(counted) == 2
    counted.clear()
    monkeypatch.setattr(stored, "results_hash", lambda: "other code")
    run_cases(CRANE, CASES[:2], store=tmp_path)
    assert len(counted) == 2


def test_notes_and_status_come_back_from_the_store(tmp_path):
    fast = [case(i, tip=Sine(amplitude="4 m", period="9 s"), mode="ns") for i in range(3)]
    first = run_cases(CRANE, fast, store=tmp_path)
    assert first[0]["status"] != "ok"
    assert any("pumps will saturate" in note for note in first[0]["notes"])
    assert same(run_cases(CRANE, fast, store=tmp_path), first)


def test_a_file_that_is_not_of_the_store_is_named(tmp_path):
    bad = tmp_path / f"broken{SUFFIX}"
    bad.write_bytes(b"PK half a file")
    with pytest.raises(
        SimulationError, match=rf"broken{SUFFIX}: not a result file of Stillhook .*Remove it, and run again\.$"
    ):
        run_cases(CRANE, CASES[:2], store=tmp_path)


def test_damage_anywhere_in_a_file_is_named_or_harmless(tmp_path):
    first = run_cases(CRANE, CASES[:2], store=tmp_path)
    file = next(tmp_path.iterdir())
    sound, rng, named = file.read_bytes(), np.random.default_rng(0), 0
    for i in rng.integers(len(sound), size=200):
        damaged = bytearray(sound)
        damaged[i] ^= 0xFF
        file.write_bytes(bytes(damaged))
        try:
            found = run_cases(CRANE, CASES[:2], store=tmp_path)
        except SimulationError:
            named += 1
        else:
            assert same(found, first)
    assert named > 100


@pytest.mark.thorough
def test_a_store_that_fails_stops_the_work(tmp_path, counted, monkeypatch):
    def full(*_: object) -> None:
        raise SimulationError("no room")

    monkeypatch.setattr(stored.Store, "put", full)
    long = [case(i, duration="1000 s") for i in range(160)]
    with pytest.raises(SimulationError, match="no room") as kept:
        run_cases(CRANE, long, store=tmp_path)
    begun = len(counted)
    time.sleep(0.5)
    assert kept.value.__traceback__ is not None
    assert len(counted) == begun < len(long)


def test_a_store_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimulationError, match=r"cannot be written"):
        run_cases(CRANE, CASES[:2], store=tmp_path / "file" / "store")


def test_series_and_a_store_exclude_each_other(tmp_path):
    with pytest.raises(ScenarioError, match=r"series=False"):
        simulate(CRANE, CASES[0], store=tmp_path)


@pytest.mark.parametrize("threads", [0, -1, 1.5, "2"])
def test_threads_are_a_whole_number(threads):
    with pytest.raises(ScenarioError, match=r"^threads = .*: give a whole number from 1 to 1024\.$"):
        run_cases(CRANE, CASES[:2], threads=threads)


def test_the_first_wrong_case_is_named_by_its_place_before_anything_runs(counted):
    with pytest.raises(ScenarioError, match=r"^case 38: Load 300 t exceeds the SWL"):
        run_cases(CRANE, [*CASES[:38], case(290)])
    assert counted == []


def test_a_step_too_long_for_one_of_many_cranes_names_the_case():
    stiff = changed(CRANE, {"active": {"boost": {"conductance": "60000 L/min/bar"}}})
    with pytest.raises(SpecError, match=r"^case 33: step 5 ms is too long"):
        run_cases([CRANE] * 33 + [stiff] + [CRANE] * 6, CASES)


def test_an_interrupted_run_keeps_what_had_finished(tmp_path, truth, counted):
    def stop(share: float) -> None:
        if any(tmp_path.glob(f"*{SUFFIX}")):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_cases(CRANE, CASES, store=tmp_path, threads=1, progress=stop)
    assert not [p for p in tmp_path.iterdir() if not p.name.endswith(SUFFIX)]
    counted.clear()
    assert same(run_cases(CRANE, CASES, store=tmp_path), truth)
    assert 0 < len(counted) < len(CASES)


LONG = """
import sys
from stillhook import Scenario, Sine, load_crane
from stillhook.engine.simulate import run_cases
cases = [Scenario(load=f"{10 + i} t", s_w="100 m", tip=Sine(amplitude="1 m", period="10 s"), duration="2000 s") for i in range(96)]
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
    asked = {"s_w": "100 m", "tip": Sine(amplitude="1 m", period="10 s"), "duration": "2000 s"}
    cases = [Scenario(load=f"{10 + i} t", **asked) for i in range(96)]
    found = run_cases(CRANE, cases, store=tmp_path)
    assert len(found) == 96
    assert 0 < len(counted) < 96
    assert same(run_cases(CRANE, cases[90]), [found[90]])


@pytest.mark.thorough
def test_memory_does_not_grow_with_the_number_of_noisy_cases():
    """Noise of a 60 s run takes 240 kB; held for every case at once 600 of them would take 140 MiB."""
    noise = {
        "noise_s_tip": "1 mm",
        "noise_v_tip": "1 mm/s",
        "noise_a_tip": "0.001 m/s^2",
        "noise_s_w": "1 mm",
        "noise_F": "1 kN",
    }
    cases = [case(i % 200, duration="60 s", warm_up="50 s", sensors={**noise, "seed": i}) for i in range(600)]
    run_cases(CRANE, cases[:16])
    tracemalloc.start()
    run_cases(CRANE, cases, threads=1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100 * MIB


# A cluster


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as c,
        distributed.Client(c) as client,
    ):
        yield c, client


@pytest.mark.thorough
def test_a_cluster_gives_the_same_bits(cluster, truth, tmp_path):
    seen: list[float] = []
    assert same(run_cases(CRANE, CASES, client=cluster[1], store=tmp_path, progress=seen.append), truth)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    assert same(run_cases(CRANE, CASES, store=tmp_path), truth)


def test_many_cranes_go_over_a_cluster_as_they_are(cluster):
    cranes = [changed(CRANE, {"control": {"K_p": f"{k} 1/m"}}) for k in (0.1, 0.16, 0.3)]
    assert same(run_cases(cranes, CASES[0], client=cluster[1]), run_cases(cranes, CASES[0]))


def test_a_wrong_case_is_named_by_a_worker_as_by_this_machine(cluster):
    stiff = changed(CRANE, {"active": {"boost": {"conductance": "60000 L/min/bar"}}})
    with pytest.raises(SpecError, match=r"^case 33: step 5 ms is too long"):
        run_cases([CRANE] * 33 + [stiff] + [CRANE] * 6, CASES, client=cluster[1])


def test_workers_with_other_code_are_refused(cluster, monkeypatch):
    monkeypatch.setattr(tasks, "results_hash", lambda: "other code")
    with pytest.raises(SimulationError, match=r"^cluster: a worker runs Stillhook .*, this machine other code\."):
        run_cases(CRANE, CASES[:2], client=cluster[1])


@pytest.mark.thorough
def test_a_killed_worker_loses_nothing(cluster):
    _, client = cluster
    asked = {"s_w": "100 m", "tip": Sine(amplitude="1 m", period="10 s"), "duration": "4000 s"}
    cases = [Scenario(load=f"{10 + i} t", **asked) for i in range(96)]
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
