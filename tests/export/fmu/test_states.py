"""States of FMUs from outside, by FMPy: what is damaged is refused, and the instance goes on."""

import ctypes
from pathlib import Path

import numpy as np
import pytest
from tests.engine.damage import IMPOSSIBLE, damaged
from tests.export.fmu.slave import CLOSE, OWN, Slave, given
from tests.export.host_clock import added_up
from tests.export.twin.host import HEAD, remade
from tests.export.twin.test_core import case_of, rows

import stillhook
from stillhook.export.fmu import write_fmu
from stillhook.export.twin import export

pytestmark = pytest.mark.skipif(OWN is None, reason="an FMU has no library for this system")
CYCLES = 100
REFUSED = r"(?i)(serialize|set)FMUstate|fmi[23]Error|status 3"


@pytest.fixture(scope="module", params=["2", "3"])
def files(request: pytest.FixtureRequest, quick_fmus, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """An FMU, and one of another load."""
    crane, folder = stillhook.load_crane("nov-250t"), tmp_path_factory.mktemp("fmus")
    return {
        load: write_fmu(
            export(crane, stillhook.Scenario(load=load, s_w="100 m", tip="still", mode="ssc")),
            folder / f"{load.split()[0]}.fmu",
            fmi=request.param,
            platforms=[str(OWN)],
        )[0]
        for load in ("100 t", "90 t")
    }


def started(file: Path, folder: Path, cycles: int = CYCLES) -> Slave:
    slave = Slave(file, folder)
    slave.begin({"s_tip": 0.0}, {"input_time": 1})
    slave.set(v_tip=0.2, v_op=0.05)
    for k in range(cycles):
        slave.step(k * 0.01, 0.01)
    return slave


@pytest.fixture(scope="module")
def slave(files: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Slave:
    return started(files["100 t"], tmp_path_factory.mktemp("unzipped"))


def refused(slave: Slave, data: bytes, before: bytes) -> None:
    with pytest.raises(Exception, match=REFUSED):
        slave.restore(data)
    assert slave.saved() == before


@pytest.mark.long
def test_no_damaged_state_is_taken_and_the_instance_goes_on(slave: Slave, files: dict[str, Path], tmp_path: Path):
    data, n = slave.saved(), 0
    for bad in damaged(data, 2400):
        refused(slave, bad, data)
        n += 1
    assert n > 2300
    other = started(files["100 t"], tmp_path, 0)
    other.restore(data)
    for each in (slave, other):
        for k in range(CYCLES, CYCLES + 30):
            each.step(k * 0.01, 0.01)
    assert other.saved() == slave.saved()
    slave.restore(data)
    assert slave.saved() == data


@pytest.mark.long
def test_no_number_may_be_impossible_though_the_checksum_is_right(slave: Slave):
    data = slave.saved()
    for i in range((len(data) - HEAD - 4) // 8):
        for value in IMPOSSIBLE[:3]:
            bad = remade(data, {i: value})
            if bad != data:
                refused(slave, bad, data)


@pytest.mark.parametrize("own", [(0.0, 0.0), (1.0, 0.0), (4.0, 0.0), (-1.0, 0.0), (1.5, 0.0), (2.0, 1e300)])
def test_a_phase_or_a_start_that_cannot_be_is_refused(slave: Slave, own: tuple[float, float]):
    data = slave.saved()
    refused(slave, remade(data, dict(enumerate(own))), data)


def test_a_state_of_another_crane_or_version_of_fmi_is_refused(slave: Slave, files: dict[str, Path], tmp_path: Path):
    data = slave.saved()
    refused(slave, started(files["90 t"], tmp_path).saved(), data)
    refused(slave, b"", data)


def answers(slave: Slave, name: str, *arguments: object) -> int:
    """A function of the library itself, past what FMPy raises."""
    function = getattr(slave.fmu.dll, f"fmi{2 if slave.two else 3}{name}")
    function.restype = ctypes.c_int
    return int(function(slave.fmu.component, *arguments))


def test_a_pointer_that_is_no_state_of_this_instance_is_refused(slave: Slave, files: dict[str, Path], tmp_path: Path):
    """Freed, of another instance, of another model, and any memory: by its address alone, which is not read."""
    kind = "FMUstate" if slave.two else "FMUState"
    serialize = "SerializeFMUstate" if slave.two else "SerializeFMUState"
    data, room = slave.saved(), (ctypes.c_ubyte * 64)()
    same, other = started(files["100 t"], tmp_path / "a"), started(files["90 t"], tmp_path / "b")
    gone = ctypes.c_void_p()
    assert answers(slave, f"Get{kind}", ctypes.byref(gone)) == 0
    freed = ctypes.c_void_p(gone.value)
    assert answers(slave, f"Free{kind}", ctypes.byref(gone)) == 0
    assert gone.value is None
    strangers = [freed, ctypes.c_void_p(ctypes.addressof(room)), ctypes.c_void_p(16)]
    for each in (same, other):
        held = ctypes.c_void_p()
        assert answers(each, f"Get{kind}", ctypes.byref(held)) == 0
        strangers.append(held)
    for state in strangers:
        assert answers(slave, f"Set{kind}", state) == 3
        assert answers(slave, f"Free{kind}", ctypes.byref(ctypes.c_void_p(state.value))) == 3
        assert answers(slave, f"Get{kind}", ctypes.byref(ctypes.c_void_p(state.value))) == 3
        bytes_of = room if not slave.two else ctypes.cast(room, ctypes.c_char_p)
        assert answers(slave, serialize, state, bytes_of, ctypes.c_size_t(64)) == 3
        assert slave.saved() == data
    assert answers(slave, f"Set{kind}", None) == 3


def test_a_state_that_was_overwritten_in_memory_is_refused(slave: Slave):
    kind, data = "FMUstate" if slave.two else "FMUState", slave.saved()
    held = ctypes.c_void_p()
    assert answers(slave, f"Get{kind}", ctypes.byref(held)) == 0
    assert answers(slave, f"Set{kind}", held) == 0
    assert held.value is not None
    ctypes.memset(held.value + 500, 0x5A, 16)
    assert answers(slave, f"Set{kind}", held) == 3
    assert slave.saved() == data
    assert answers(slave, f"Free{kind}", ctypes.byref(held)) == 0


@pytest.mark.parametrize("years", [0.03, 10.0])
def test_a_host_that_adds_up_its_steps_is_served_for_years(slave: Slave, years: float):
    data, cycles = slave.saved(), round(years * 365 * 86400 * 100)
    t, clock = added_up(cycles, 0.01), clock_of(data)
    slave.restore(remade(data, {clock + 1: float(cycles), clock + 2: t}))
    for _ in range(100):
        slave.step(t, 0.01)
        t += 0.01
    for beside in (0.005, -0.005):
        with pytest.raises(Exception, match=r"(?i)doStep"):
            slave.step(t + beside, 0.01)
    saved = np.frombuffer(slave.saved()[HEAD:-4])
    assert saved[clock + 1] == cycles + 100
    slave.restore(data)


def clock_of(data: bytes) -> int:
    """Place of the time at the start: behind it are the cycles, and the host's time after them."""
    x = np.frombuffer(data[HEAD:-4])
    (found,) = [
        i for i in range(len(x) - 2) if x[i] == 0.0 and x[i + 1] == CYCLES and x[i + 2] == (CYCLES - 1) * 0.01 + 0.01
    ]
    return int(found)


def test_what_is_set_together_is_set_whole_or_not_at_all(slave: Slave):
    before = slave.saved()
    with pytest.raises(Exception, match=r"(?i)set"):
        slave.set(s_tip=1.0, v_tip=float("nan"))
    assert slave.saved() == before


@pytest.mark.long
def test_an_fmu_of_a_controller_that_learns_is_the_run_and_goes_on_from_a_saved_state(tmp_path: Path):
    crane = stillhook.load_crane("nov-250t")
    case = case_of(crane).with_mode("ff").model_copy(update={"duration": 60.0})
    tip, run = rows(crane, case), stillhook.simulate(crane, case, every="10 ms", series=True)
    file = write_fmu(export(crane, case), tmp_path / "ff.fmu", platforms=[str(OWN)])[0]
    slave = Slave(file, tmp_path)
    slave.begin(given(tip[0]), {"input_time": 0})
    kept, e_c = b"", []

    def on(first: int, last: int) -> bytes:
        for k in range(first, last):
            slave.set(**given(tip[k + 1]))
            slave.step(k * 0.01, 0.01)
            e_c.append(slave.get("e_c")[0])
        return slave.saved()

    kept = on(0, 4000)
    end = on(4000, 5000)
    assert np.abs(np.array(e_c) - run.e_c.values[1:5001]).max() < CLOSE
    slave.restore(kept)
    assert on(4000, 5000) == end
