"""A cluster: what is decoded from it, who is spoken to, and that nothing is lost or done twice whatever ends in between."""

import datetime
import functools
import os
import pickle
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.engine.clusters import local_client
from tests.engine.lifts import IN_SEAS
from tests.engine.test_door import case, same

from stillhook import load_crane, simulate
from stillhook.base.atomic import cannot_write
from stillhook.base.kept import checked
from stillhook.engine import store as store_module
from stillhook.engine.lowering.case import LoweringType
from stillhook.engine.scenario.run import ScenarioType
from stillhook.engine.simulate import row_of, run_cases
from stillhook.engine.store import KEY, SUFFIX
from stillhook.engine.tasks import Task, carried, cluster
from stillhook.engine.tasks.carried import Answer, CarriedError, answer_to, pack_task, unpack_answer, unpack_task
from stillhook.engine.tasks.cluster import VARIABLE, check_address, check_certificates
from stillhook.errors import SimulationError, SpecError
from stillhook.kernels.build import results_hash
from stillhook.library import changed

CRANE = load_crane("nov-250t")
LIBRARY = ("nov-250t", "nov-100t-pure-active", "nov-250t-secondary", "utility-20t-open-circuit")
LIBRARY += ("nov-100t-cylinder", "nov-100t-electric", "nov-250t-digital")


def task(crane=CRANE, cases=None, of=None, keep=row_of) -> Task:
    cases = [case(0)] if cases is None else cases
    of = ScenarioType() if of is None else of
    return Task(of, list(range(len(cases))), [crane] * len(cases), cases, 2, 16, 0, keep)


def stored(folder: Path) -> list[bytes]:
    """Key of every row of a store."""
    keys: list[bytes] = []
    for file in folder.glob(f"*{SUFFIX}"):
        with np.load(file) as data:
            keys += [key.tobytes() for key in data["keys"]]
    return keys


def each_once(folder: Path, n: int) -> bool:
    keys = stored(folder)
    return len(keys) == len(set(keys)) == n and all(len(key) == KEY for key in keys)


# What is decoded


@pytest.mark.parametrize("name", LIBRARY)
def test_a_task_with_any_crane_arrives_as_it_left(name):
    """Two winch types have tables of a controller, whose classes are made when the package is loaded."""
    crane = load_crane(name)
    sent = task(crane, [case(0, load="10 t", sensors={"delay": "0.1 s"}, tip="sine 1 m 9 s")]).light()
    got = unpack_task(pack_task(sent))
    assert got.cranes == sent.cranes
    assert got.cases == sent.cases
    assert got.keep is row_of


@pytest.mark.slow
def test_a_task_of_lowerings_gives_the_same_bits_behind_the_wire():
    lifts = IN_SEAS[-3:]
    answer = unpack_answer(answer_to(pack_task(task(cases=lifts[:2], of=LoweringType()))))
    assert same(answer.kept, run_cases(CRANE, lifts[:2], step=2))


class Hostile:
    """What a pickle can do: call anything while it is decoded."""

    def __init__(self, function, *arguments):
        self.of = function, arguments

    def __reduce__(self):
        return self.of


@pytest.mark.parametrize(
    "hostile",
    [
        Hostile(os.system, "true"),
        Hostile(eval, "1"),
        Hostile(getattr, "", "join"),
        Hostile(simulate, None, None),
        Hostile(Path, "/"),
        Hostile(functools.partial, print),
        Hostile(store_module.Store, Path("made-by-a-task")),
        Hostile(np.load, "x"),
    ],
    ids=["system", "eval", "getattr", "function", "path", "partial", "store", "load"],
)
def test_what_could_be_called_is_not_decoded(hostile, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for kind, decode in (("task", unpack_task), ("answer", unpack_answer)):
        data = f"stillhook {kind} {results_hash()}\n".encode() + pickle.dumps((hostile, "x", {}), 5)
        with pytest.raises(CarriedError, match="is not a record of Stillhook, and only those are decoded") as error:
            decode(data)
        assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["os:system", "stillhook.engine.simulate:simulate", "stillhook.__main__:main", "x"])
def test_a_task_names_no_function_but_those_for_workers(name):
    fields = {key: value for key, value in task().light()._asdict().items() if key != "keep"}
    data = f"stillhook task {results_hash()}\n".encode() + pickle.dumps((fields, name, {}), 5)
    with pytest.raises(CarriedError, match=f"keep = {name}: not a function of Stillhook"):
        unpack_task(data)


def test_a_function_of_the_user_does_not_travel():
    with pytest.raises(CarriedError, match="not a function of Stillhook that workers may call"):
        pack_task(task(keep=lambda run: run))


def test_the_code_is_compared_before_anything_is_decoded(monkeypatch):
    """A worker of another version says which, and decodes and runs nothing."""
    sent = pack_task(task())
    monkeypatch.setattr(carried, "results_hash", lambda: "another")
    monkeypatch.setattr(carried, "_unpacked", None)
    back = answer_to(sent)
    monkeypatch.undo()
    monkeypatch.setattr(carried, "_unpacked", None)
    assert unpack_answer(back) == Answer("another")


@pytest.mark.parametrize("cut", [0, 10, 40, 200, -1])
def test_what_is_damaged_is_one_line(cut):
    sent = pack_task(task())[:cut]
    with pytest.raises(CarriedError, match=r"^cluster: (not a task of Stillhook|a task is damaged)") as error:
        unpack_task(sent)
    assert "\n" not in str(error.value)


def test_a_case_that_is_refused_travels_as_words_and_keeps_its_class():
    stiff = changed(CRANE, {"active": {"boost": {"conductance": "60000 L/min/bar"}}})
    answer = unpack_answer(answer_to(pack_task(task(stiff))))
    assert answer.kept is None
    error = cluster.error_of(*answer.error)
    assert type(error) is SpecError
    assert str(error).startswith("step 5 ms is too long for this crane")
    assert type(cluster.error_of("OSError", "x")) is SimulationError


def test_summaries_take_no_more_room_than_their_numbers():
    rows = run_cases(CRANE, [case(i) for i in range(16)])
    sent = carried._packed("answer", (rows, None))
    assert len(sent) / 16 < 8 * len(rows[0]) + sum(map(len, rows[0]["notes"])) + 200
    assert same(unpack_answer(sent).kept, rows)


# Who is spoken to


@pytest.mark.parametrize(
    "address",
    ["tls://10.0.0.1:8786", "tcp://127.0.0.1:8786", "tcp://[::1]:8786", "localhost:8786", "inproc://10.1.1.1/7/1"],
)
def test_a_scheduler_with_certificates_or_on_this_machine_is_spoken_to(address):
    check_address(address)


@pytest.mark.parametrize(
    "address", ["tcp://10.0.0.1:8786", "10.0.0.1:8786", "ucx://a:1", "ws://h:1", "localhost.x.y:1"]
)
def test_another_is_refused_unless_its_network_is_closed(address, monkeypatch):
    with pytest.raises(
        SimulationError, match=r"without TLS anyone who reaches it runs code .* STILLHOOK_CLOSED_NETWORK="
    ):
        check_address(address)
    host = address.split("://")[-1].rpartition(":")[0]
    monkeypatch.setenv(VARIABLE, f"elsewhere, {host}")
    check_address(address)


def test_what_is_no_address_is_refused_in_one_line():
    with pytest.raises(SimulationError, match=r"no address \(.*\)\. Write tls://HOST:PORT"):
        check_address("tcp://[::1")


def test_an_address_without_tls_is_refused_where_dask_is_set_to_require_it():
    """As the settings of the how-to are, with the address of an older case file."""
    pytest.importorskip("distributed")  # reads Dask's settings
    required = pytest.importorskip("dask").config.set({"distributed.comm.require-encryption": True})
    with required, pytest.raises(SimulationError, match=r"Dask's settings require encryption\. Write tls://"):
        check_certificates("tcp://127.0.0.1:8786")
    check_certificates("tcp://127.0.0.1:8786")


def certificates(folder: Path) -> dict[str, str]:
    """An authority and a certificate that it signed, as `distributed.Security` takes them."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    now, keys = datetime.datetime.now(datetime.UTC), {}
    for name, issuer in (("ca", "ca"), ("member", "ca")):
        keys[name] = ec.generate_private_key(ec.SECP256R1())
        made = (
            x509.CertificateBuilder()
            .subject_name(x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)]))
            .issuer_name(x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, issuer)]))
            .public_key(keys[name].public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(minutes=5))
            .not_valid_after(now + datetime.timedelta(days=1))
            .add_extension(x509.BasicConstraints(ca=name == "ca", path_length=None), critical=True)
            .sign(keys[issuer], hashes.SHA256())
        )
        (folder / f"{name}.pem").write_bytes(made.public_bytes(serialization.Encoding.PEM))
    plain = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    (folder / "key.pem").write_bytes(keys["member"].private_bytes(serialization.Encoding.PEM, *plain))
    roles = ("client", "worker", "scheduler")
    named = {f"tls_{role}_cert": str(folder / "member.pem") for role in roles}
    named |= {f"tls_{role}_key": str(folder / "key.pem") for role in roles}
    return {"tls_ca_file": str(folder / "ca.pem"), **named}


@pytest.mark.slow
def test_runs_go_over_tls_and_a_stranger_is_not_let_in(tmp_path):
    distributed = pytest.importorskip("distributed")
    for name in ("ours", "theirs"):
        (tmp_path / name).mkdir()
    ours = distributed.Security(require_encryption=True, **certificates(tmp_path / "ours"))
    theirs = distributed.Security(require_encryption=True, **certificates(tmp_path / "theirs"))
    of = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(protocol="tls://", security=ours, **of) as local:
        with distributed.Client(local.scheduler_address, security=ours) as client:
            assert client.scheduler.address.startswith("tls://")
            assert same(run_cases(CRANE, [case(0)], client=client), run_cases(CRANE, [case(0)]))
        with pytest.raises(OSError, match="certificate"):
            distributed.Client(local.scheduler_address, security=theirs, timeout=3)


# Nothing is lost, nothing done twice


@pytest.fixture(scope="module")
def client():
    with local_client(1) as client:
        yield client


@pytest.mark.long
def test_a_slow_store_keeps_every_case_once(client, tmp_path, monkeypatch):
    """A file system that stalls at every file."""

    class Stalled(checked.atomic_file):
        def __exit__(self, *of: object) -> None:
            time.sleep(0.2)
            super().__exit__(*of)

    monkeypatch.setattr(checked, "atomic_file", Stalled)
    cases = [case(i) for i in range(80)]
    found = run_cases(CRANE, cases, client=client, store=tmp_path)
    assert each_once(tmp_path, 80)
    assert same(found, run_cases(CRANE, cases))


@pytest.mark.long
def test_a_store_that_cannot_be_written_stops_the_batch_in_one_line(client, tmp_path, monkeypatch):
    written: list[int] = []

    class Full(checked.atomic_file):
        def __enter__(self) -> Path:
            written.append(1)
            if len(written) > 2:
                raise cannot_write(tmp_path, OSError(28, "No space left on device"))
            return super().__enter__()

    monkeypatch.setattr(checked, "atomic_file", Full)
    cases = [case(i) for i in range(160)]
    with pytest.raises(SimulationError, match="No space left on device") as error:
        run_cases(CRANE, cases, client=client, store=tmp_path)
    assert "\n" not in str(error.value)
    monkeypatch.undo()
    done = len(stored(tmp_path))
    assert 0 < done < 160
    assert same(run_cases(CRANE, cases, client=client, store=tmp_path), run_cases(CRANE, cases))
    assert each_once(tmp_path, 160)


CLIENT = """
import sys
from distributed import Client
from stillhook.engine.simulate import run_cases
from tests.engine.test_cluster import CRANE
from tests.engine.test_door import case
with Client(sys.argv[1]) as client:
    run_cases(CRANE, [case(i, duration="600 s") for i in range(160)], client=client, store=sys.argv[2])
"""


@pytest.mark.thorough
def test_a_client_that_is_killed_leaves_whole_files_and_the_next_one_does_the_rest(client, tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", CLIENT, client.scheduler.address, str(tmp_path)])
    while gone.poll() is None and not list(tmp_path.glob(f"*{SUFFIX}")):
        time.sleep(0.02)
    gone.kill()
    gone.wait()
    for left in tmp_path.glob(".*"):
        left.unlink()  # of the file that was being written
    before = len(stored(tmp_path))
    assert 0 < before < 160
    cases = [case(i, duration="600 s") for i in range(160)]
    found = run_cases(CRANE, cases, client=client, store=tmp_path)
    assert each_once(tmp_path, 160)
    assert same(found[::40], run_cases(CRANE, cases[::40]))


@pytest.mark.thorough
def test_a_worker_that_is_killed_loses_no_case_and_does_none_twice(client, tmp_path):
    cases, killed = [case(i, duration="1000 s") for i in range(96)], []

    def kill_one(share: float) -> None:
        if share > 0.0 and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGTERM if os.name == "nt" else signal.SIGKILL)

    found = run_cases(CRANE, cases, client=client, store=tmp_path, progress=kill_one)
    assert killed
    assert each_once(tmp_path, 96)
    assert same(found[::24], run_cases(CRANE, cases[::24]))


class Processes:
    """A scheduler and a worker of their own processes at a fixed address."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self.running: list[subprocess.Popen] = []

    def start(self) -> None:
        for command in (
            ("scheduler", "--host", self.address, "--no-dashboard", "--dashboard-address", ":0"),
            ("worker", self.address, "--nthreads", "1", "--no-dashboard", "--no-nanny", "--death-timeout", "60"),
        ):
            whole = [sys.executable, "-m", f"distributed.cli.dask_{command[0]}", *command[1:]]
            self.running.append(subprocess.Popen(whole, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def kill(self) -> None:
        for process in self.running:
            process.kill()
            process.wait()
        self.running.clear()


@pytest.fixture
def processes():
    made = Processes()
    made.start()
    yield made
    made.kill()


@pytest.mark.thorough
@pytest.mark.parametrize("returns", [True, False], ids=["returns", "stays away"])
def test_a_scheduler_that_is_restarted_gets_again_what_was_under_way(processes, tmp_path, monkeypatch, returns):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "RETURN", 60.0 if returns else 2.0)
    cases, lost = [case(i, duration="600 s") for i in range(160)], []
    folder = tmp_path / "store"

    def restart(share: float) -> None:
        if share > 0.1 and not lost:
            lost.append(share)
            processes.kill()
            if returns:
                processes.start()

    with distributed.Client(processes.address, timeout=60) as client:
        client.wait_for_workers(1, timeout=60)
        if returns:
            found = run_cases(CRANE, cases, client=client, store=folder, progress=restart)
            assert each_once(folder, 160)
        else:
            with pytest.raises(SimulationError, match=r"^cluster: the scheduler was lost, and did not return"):
                run_cases(CRANE, cases, client=client, store=folder, progress=restart)
            assert 0 < len(stored(folder)) < 160
            found = run_cases(CRANE, cases, store=folder)
            assert each_once(folder, 160)
    assert lost
    assert same(found[::40], run_cases(CRANE, cases[::40]))
