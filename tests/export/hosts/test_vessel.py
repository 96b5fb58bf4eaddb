"""A host that gives the vessel's motion beside the tension: the winch of one that gives the tip as the PLC makes it."""

import ctypes

import numpy as np
import pytest
from tests.engine.test_session_vessel import CRANE, MOVES, REST, case_of, columns
from tests.export.hosts.test_native import SAME, STRICT

import stillhook
from stillhook.errors import SimulationError
from stillhook.export.hosts import Exchange, Sample, host_source
from stillhook.export.twin import export

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


def test_a_host_with_a_vessel_and_a_case_without_a_boom_is_refused():
    case = case_of().model_copy(update={"tip": stillhook.Still()})
    with pytest.raises(SimulationError, match=r"The case's tip has no boom. Give a case with \[scenario.tip\] boom"):
        Exchange(CRANE, case).sample(0.0, 1e6, REST)
    with pytest.raises(SimulationError, match=r"The host's motion of the vessel: v_heave, a_heave missing"):
        Exchange(CRANE, case_of()).sample(0.0, 1e6, {"heave": 0.0})
