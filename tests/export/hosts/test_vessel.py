"""A host that gives the vessel's motion beside the tension: the winch of one that gives the tip as the PLC makes it."""

import ctypes
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.engine.test_session_vessel import CRANE, MOVES, REST, case_of, columns
from tests.export.hosts.mock_orcaflex import OrcaFlex
from tests.export.hosts.test_native import SAME, STRICT, host_of, run_orcaflex, run_simo, samples

import stillhook
from stillhook.errors import SimulationError
from stillhook.export.hosts import Exchange, Sample, host_source, write_host
from stillhook.export.twin import ExportError, export

SMALL = stillhook.MotionUnit(at=("3 m", "1 m", "-2 m"), rotations="small-angle")


def given(case: stillhook.Scenario) -> list[tuple[float, float, dict[str, float]]]:
    """Time, tension and motion of the vessel, at steps that are no whole PLC cycles."""
    t = np.arange(80) * 0.017
    rows = columns(case.tip, t, boom=True, unit=True)
    return [(x, 1.01e6 * (1.0 + 0.04 * np.sin(2.0 * x)), row) for x, row in zip(t.tolist(), rows, strict=True)]


def test_the_vessel_of_a_host_is_the_tip_that_the_plc_of_a_simulation_reads():
    case = case_of(SMALL, **MOVES)
    exchange, plain = Exchange(CRANE, case), Exchange(CRANE, case.model_copy(update={"tip": stillhook.Still()}))
    found = []
    for time, F_w, row in given(case):
        seen = (float(x) for x in case.tip.measured(time))
        found.append(exchange.at(exchange.sample(time, F_w, row), new_step=True))
        assert found[-1] == plain.at(Sample(time, F_w, *seen), new_step=True)
    assert np.ptp([answer.s_w for answer in found]) > 0.1


@pytest.mark.long
def test_the_library_takes_the_vessel_as_the_python_host_does(compiled):
    case = case_of(SMALL, **MOVES)
    library = ctypes.CDLL(str(compiled(host_source(export(CRANE, case, coupling="wire"), "orcaflex"), STRICT)))
    number = ctypes.c_double
    library.stillhook_new.restype = ctypes.c_void_p
    library.stillhook_new.argtypes = [number] * 3
    library.stillhook_exchange_vessel.argtypes = [
        ctypes.c_void_p,
        number,
        number,
        number * 21,
        ctypes.c_int,
        *[ctypes.POINTER(number)] * 2,
    ]
    library.stillhook_free.argtypes = [ctypes.c_void_p]
    winch = library.stillhook_new(np.nan, 0.0, np.nan)
    exchange = Exchange(CRANE, case)
    names = stillhook.Session(CRANE, case).vessel_inputs
    payout, s_w = number(), number()
    for time, F_w, row in given(case):
        vessel = (number * 21)(*(row[name] for name in names))
        assert library.stillhook_exchange_vessel(winch, time, F_w, vessel, 1, payout, s_w) == 0
        expected = exchange.at(exchange.sample(time, F_w, row), new_step=True)
        assert abs(payout.value - expected.payout) < SAME
    assert abs(expected.payout) > 0.01
    library.stillhook_free(winch)


def test_heights_around_the_motion_unit_are_its_heave_roll_and_pitch():
    """Against a rotation matrix of another program; differences in time are the rates."""
    at = np.array([[3.0, 1.0, -2.0], [4.0, 1.0, -2.0], [3.0, 2.0, -2.0]])
    case = case_of(SMALL)
    tip, h = case.tip, 1e-4

    def heights(t: float) -> np.ndarray:
        heave, roll, pitch = (float(jet.x) for jet in tip._attitude(np.asarray(t)))
        return heave + Rotation.from_euler("ZYX", [0.0, -pitch, roll]).apply(at)[:, 2] + 55.0

    exchange = Exchange(CRANE, case)
    first = exchange.of_heights(0.0, 1e6, np.column_stack([heights(0.0), np.zeros((3, 2))])).s_tip
    for t in (1.3, 4.2, 7.7):
        before, now, after = (heights(x) for x in (t - h, t, t + h))
        z = np.column_stack([now, (after - before) / (2.0 * h), (after - 2.0 * now + before) / h**2])
        found, (s, v, a) = exchange.of_heights(t, 1e6, z), tip.measured(t)
        assert found.s_tip - first == pytest.approx(s - tip.measured(0.0)[0], abs=1e-12)
        assert found.v_tip == pytest.approx(v, abs=1e-7)
        assert found.a_tip == pytest.approx(a, abs=1e-4)


def test_a_winch_of_orcaflex_with_a_boom_follows_what_its_plc_makes_of_the_vessel(compiled, tmp_path):
    """The ship heels as it heaves: native and Python function alike, and not as a crane without a boom."""
    case, rows = case_of(SMALL), tmp_path / "rows.txt"
    rows.write_text("".join(f"{' '.join(map(repr, s))} {int(new)}\n" for s, new in samples()))
    host, out = host_of("host_orcaflex", tmp_path), {}
    for name, tip in (("boom", case.tip), ("plain", stillhook.Still())):
        of = case.model_copy(update={"tip": tip})
        library = compiled(host_source(export(CRANE, of, coupling="wire"), "orcaflex"), STRICT)
        _, *lines = run_orcaflex([str(host)], str(library), rows)
        out[name] = np.array([float(line) for line in lines])
    exchange, lever = Exchange(CRANE, case), np.array(case.tip.boom.tip) - SMALL.at
    expected = []
    for sample, new in samples():
        heeling = 1.0 + (np.eye(3)[[2, 0, 1]] * [1.0, 1.0, 0.0] - lever)[:, :2] @ [0.01, 0.02]
        z = np.outer(heeling, [sample.s_tip, sample.v_tip, sample.a_tip])
        expected.append(exchange.at(exchange.of_heights(sample.time, sample.F_w, z), new_step=new).payout)
    assert np.abs(out["boom"] - expected).max() < SAME
    assert np.abs(out["boom"] - out["plain"]).max() > 1e-3


def test_the_folder_for_orcaflex_keeps_the_boom(tmp_path):
    folder = write_host("orcaflex", CRANE, case_of(SMALL), tmp_path / "winch", platforms=())[0].parent
    space: dict[str, Any] = {"__file__": str(folder / "stillhook_winch.py")}
    exec((folder / "stillhook_winch.py").read_text(), space)
    model = OrcaFlex(space["StillhookWinch"], CRANE, case_of(SMALL), 0.05)
    assert np.ptp(model.run(2.0)[:, 1]) > 0.1
    with pytest.raises(
        ExportError, match=r"movements of the boom are not exported to a host with a wire. Leave them out"
    ):
        write_host("simo", CRANE, case_of(**MOVES), tmp_path / "other", platforms=())


@pytest.mark.long
def test_a_boom_on_a_ship_that_heaves_alone_changes_nothing_in_simo(compiled, tmp_path):
    case = case_of().model_copy(update={"tip": stillhook.Sine(amplitude="1 m", period="12 s")})
    host, out = host_of("host_simo", tmp_path), []
    for tip in (case_of().tip, stillhook.Still()):
        made = export(CRANE, case.model_copy(update={"tip": tip}), coupling="wire")
        library = str(compiled(host_source(made, "simo"), STRICT))
        out.append(run_simo([str(host)], library, tmp_path, CRANE, case, 0.05))
    assert np.abs(out[0][:, 1] - out[1][:, 1]).max() < 1e-9
    assert np.ptp(out[0][:, 1]) > 0.05


def test_a_host_with_a_vessel_and_a_case_without_a_boom_is_refused():
    case = case_of().model_copy(update={"tip": stillhook.Still()})
    with pytest.raises(SimulationError, match=r"The case's tip has no boom. Give a case with \[scenario.tip\] boom"):
        Exchange(CRANE, case).sample(0.0, 1e6, REST)
    with pytest.raises(SimulationError, match=r"The host's motion of the vessel: v_heave, a_heave missing"):
        Exchange(CRANE, case_of()).sample(0.0, 1e6, {"heave": 0.0})
