"""The external function for OrcaFlex in a mock of it: signs, units, steps, iterations, restart; against `simulate`."""

import math
import random

import numpy as np
import pytest
from tests.export.hosts.mock_orcaflex import OrcaFlex

import stillhook
from stillhook.errors import ScenarioError, SimulationError
from stillhook.export.hosts import Exchange, Sample
from stillhook.export.hosts.orcaflex import Winch

SHORT = 8.0
"""Time in which the tip has its full motion and has turned round [s]."""
ORDER = (1.5, 2.5)
"""Order in the host's step: 2 is that of the trapezoidal rule and of tension on a line; largest differences of a few
swings leave some tenths. Seen: 1.7 wire out, 1.9 load, 1.6 tension."""
HALF = 1e-3
"""Wire out beside `simulate` with steps of 50 ms [m]: 0.7 mm is seen."""
NEAR = {0.004: 5e-5, 0.01: 5e-5, 0.017: 2e-4, 0.02: 2e-4}
"""Wire out beside `simulate` [m], of 1 m of tip motion, by the host's step [s]: above a PLC cycle the host's own rule
and the tension on a line count, with the square of the step; below, what holding the tension within a cycle costs."""
CURVED = 0.01
"""Part of a cycle's change of the rate by which its course within the cycle may be beside a line: 0.003 is seen."""


class Function(Winch):
    crane = "nov-250t"
    case = {"load": "100 t", "s_w": "100 m", "mode": "ssc"}


@pytest.fixture(scope="module")
def case() -> stillhook.Scenario:
    return stillhook.Scenario(
        load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="10 s", ramp="2 s", warm_up="0 s"
    )


@pytest.fixture(scope="module")
def run(nov, case):
    return stillhook.simulate(nov, case, every="10 ms", series=True)


def off(rows: np.ndarray, run) -> np.ndarray:
    """Largest differences of wire out, height of the load and tension."""
    t = run.time.values
    names = ("s_w", "s_load", "F_w")
    return np.array(
        [np.abs(rows[:, 1 + i] - np.interp(rows[:, 0], t, run[n].values)).max() for i, n in enumerate(names)]
    )


@pytest.mark.thorough
def test_a_load_that_hangs_in_the_host_moves_as_in_simulate_with_the_square_of_the_hosts_step(nov, case, run):
    wide, half = (off(OrcaFlex(Function, nov, case, h).run(SHORT), run) for h in (0.1, 0.05))
    order = np.log2(wide / half)
    assert ((order > ORDER[0]) & (order < ORDER[1])).all(), order
    assert half[0] < HALF


@pytest.mark.thorough
@pytest.mark.parametrize("h", NEAR)
def test_steps_shorter_than_a_plc_cycle_equal_to_it_and_no_part_of_it_give_the_run_of_simulate(nov, case, run, h):
    found = off(OrcaFlex(Function, nov, case, h).run(4.0), run)
    assert found[0] < NEAR[h]


@pytest.mark.thorough
def test_wire_goes_out_where_the_tip_rises(nov, case):
    host = OrcaFlex(Function, nov, case, 0.05)
    rows = host.run(SHORT)
    rising = np.array([host.tip(t)[1] for t in rows[:, 0]])
    fast = np.abs(rising) > 0.2
    assert (np.sign(rows[fast, 4]) == np.sign(rising[fast])).all()


@pytest.mark.thorough
def test_a_model_in_us_units_that_begins_before_zero_gives_the_same_run(nov, case):
    plain = OrcaFlex(Function, nov, case, 0.05).run(4.0)
    factors = {"force": 1.0 / 4.4482216152605, "length": 1.0 / 0.3048}
    other = OrcaFlex(Function, nov, case, 0.05, start=-10.0, datum=-3.0, **factors).run(4.0)
    assert np.abs(plain[:, 1] - other[:, 1]).max() < 1e-9
    assert np.abs(plain[:, 4] - other[:, 4]).max() < 1e-9


@pytest.mark.thorough
def test_a_resumed_simulation_goes_on_as_one_that_was_never_stored(nov, case):
    whole, first = OrcaFlex(Function, nov, case, 0.017), OrcaFlex(Function, nov, case, 0.017)
    first.run(2.0)
    first.function.StoreState(first.info)
    again = Function()
    again.Initialise(first.info)
    first.function = again
    assert (first.run(3.0) == whole.run(3.0)).all()


def sample(t: float, change: float = 0.0) -> Sample:
    w = 2.0 * math.pi / 12.0
    F_w = 1.01e6 * (1.0 + 0.05 * math.sin(t) + change)
    return Sample(t, F_w, 20.0 + 1.0 - math.cos(w * t), w * math.sin(w * t), w * w * math.cos(w * t))


@pytest.mark.slow
def test_a_time_that_is_asked_often_has_the_answer_of_one_that_is_asked_once(nov, case):
    once, often, chance = Exchange(nov, case), Exchange(nov, case), random.Random(2)
    t = 0.0
    while t < 1.5:
        answer = once.at(sample(t), new_step=True)
        for i in range(3):
            often.at(sample(t, chance.uniform(-0.2, 0.2)), new_step=i == 0)
        assert often.at(sample(t), new_step=False) == answer
        t += chance.choice([0.003, 0.01, 0.017, 0.05])


@pytest.mark.slow
def test_a_step_that_the_host_drops_leaves_no_trace(nov, case):
    plain, other = Exchange(nov, case), Exchange(nov, case)
    for i in range(30):
        t = 0.02 * i
        answer = plain.at(sample(t), new_step=True)
        if i % 3 == 2:
            other.at(sample(t + 0.03, 0.3), new_step=True)  # too long: tried, and then a shorter one
        assert other.at(sample(t), new_step=True) == answer


@pytest.mark.slow
def test_an_answer_between_two_plc_cycles_is_between_theirs(nov, case):
    exchange = Exchange(nov, case)
    for i in range(101):
        exchange.at(sample(0.01 * i), new_step=True)
    here = exchange.at(sample(1.0), new_step=False)
    inside = exchange.at(sample(1.0 + 0.004), new_step=True)
    there = exchange.at(sample(1.01), new_step=True)
    assert here.payout < inside.payout < there.payout
    bound = CURVED * nov.control.t_cycle * (there.payout - here.payout)
    assert abs(inside.s_w - here.s_w - 0.004 * 0.5 * (here.payout + inside.payout)) < bound


def test_a_wire_in_compression_is_slack(nov, case):
    a, b = Exchange(nov, case), Exchange(nov, case)
    for exchange, F_w in ((a, -5e5), (b, 0.0)):
        exchange.at(sample(0.0), new_step=True)
        exchange.at(sample(0.05)._replace(F_w=F_w), new_step=True)
    assert a.at(sample(0.1), new_step=True) == b.at(sample(0.1), new_step=True)


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ("", "TipObject is missing"),
        ("TipObject=Vessel\nTipPosition=1, 2", 'TipPosition = "1, 2": give 3 numbers'),
        ("TipObject=Vessel\nWireOut=long", 'WireOut = "long": give one number'),
    ],
)
def test_wrong_parameters_are_said_in_one_line(nov, case, parameters, line):
    with pytest.raises(SimulationError, match=line.replace("[", r"\[")):
        OrcaFlex(Function, nov, case, 0.05, parameters=parameters)


def test_a_result_that_the_model_lacks_is_named_with_its_parameter(nov, case):
    host = OrcaFlex(Function, nov, case, 0.05, parameters="TipObject=Vessel // the ship\nSpeedResult=Heave speed")
    with pytest.raises(SimulationError, match=r'"Vessel" has no result "Heave speed".*parameter SpeedResult'):
        host.run(0.1)


def test_what_no_winch_can_answer_is_refused(nov, case):
    exchange = Exchange(nov, case)
    with pytest.raises(SimulationError, match="finite numbers"):
        exchange.at(sample(0.0)._replace(F_w=math.nan), new_step=True)
    with pytest.raises(ScenarioError, match="SWL"):
        exchange.at(sample(0.0)._replace(F_w=9e6), new_step=True)
    for i in range(4):
        exchange.at(sample(0.02 * i), new_step=True)
    with pytest.raises(SimulationError, match=r"went back to 0\.02 s, before its last accepted step at 0\.04 s"):
        exchange.at(sample(0.02), new_step=True)
    with pytest.raises(SimulationError, match="not one of Stillhook's"):
        exchange.restore("{}")
    other = Exchange(nov, case.model_copy(update={"s_w": 200.0}))
    with pytest.raises(SimulationError, match="saved of another crane"):
        other.restore(exchange.save())


def test_tension_cannot_be_asked_of_the_function(nov, case):
    host = OrcaFlex(Function, nov, case, 0.05)
    host.info.DataName = "WholeSimulationTension"
    with pytest.raises(SimulationError, match="gives a rate of pay-out"):
        Function().Initialise(host.info)
