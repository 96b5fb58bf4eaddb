"""A case that loses its numbers, or that is refused, is a status: when and by what, at once, and every other case of the
batch has the bits that it has alone."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.engine.lifts import deep_lift, in_sea
from tests.engine.test_lowering_refusals import lift, water

from stillhook import Scenario, Session, Sine, load_crane, simulate
from stillhook.analysis.uncertainty.monte_carlo import run_draws
from stillhook.engine import runner
from stillhook.engine.inputs import CHUNK
from stillhook.engine.lowering.case import LoweringType
from stillhook.engine.runner import FAILED, Ending
from stillhook.engine.scenario.run import ScenarioType
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import LiftError, ScenarioError, SimulationError
from stillhook.kernels.lanes import VL, paths
from stillhook.library import changed
from stillhook.winches.registry import WINCH_TYPES

CRANE = load_crane("nov-250t")
LIBRARY = ("nov-250t", "nov-100t-pure-active", "nov-250t-secondary", "utility-20t-open-circuit")
LIBRARY += ("nov-100t-cylinder", "nov-100t-electric", "nov-250t-digital")
SOON = 1.0
"""Simulated time within which a lost lane is noticed [s]."""
STIFF = changed(CRANE, {"active": {"boost": {"conductance": "60000 L/min/bar"}}})
"""Its fastest mode is beyond what a step of 5 ms can follow."""


def case(load: float = 10.0, **more: object) -> Scenario:
    given = {"load": f"{load} t", "s_w": "100 m", "tip": "sine 1 m 10 s", "duration": "60 s", "warm_up": "20 s"}
    return Scenario(**(given | more))


def same(a: object, b: object) -> bool:
    """Equal to the last bit, NaN counting as itself."""
    return repr(a) == repr(b)


@pytest.fixture
def spoil(monkeypatch):
    """spoil(tip, cycle, value): from this PLC cycle on the tip of all cases that share this motion is at `value`."""
    fill, spoiled = runner.filled, {}

    def filled(drives, k, n):
        D = fill(drives, k, n)
        for lane, drive in enumerate(drives):
            cycle, value = spoiled.get(id(drive.case.tip), (math.inf, 0.0))
            if k + n > cycle:
                D[max(int(cycle) - k, 0) :, 0, lane] = value
        return D

    monkeypatch.setattr(runner, "filled", filled)
    return lambda tip, cycle, value=math.nan: spoiled.update({id(tip): (cycle, value)})


@pytest.mark.long
@pytest.mark.parametrize("name", LIBRARY)
def test_a_tip_that_is_no_number_is_noticed_on_every_winch_type_and_spoils_no_other(name, spoil):
    crane = load_crane(name)
    cases, bad = [case(2.0 + i) for i in range(5)], case(3.0, tip="sine 1 m 9 s")
    alone = [run_cases(crane, c)[0] for c in cases]
    spoil(bad.tip, cycle := round(31.4 / crane.control.t_cycle))
    rows = run_cases(crane, [bad, *cases])
    assert same(rows[1:], alone)
    assert rows[0]["status"] == Ending.DIVERGED
    assert rows[0]["notes"][-1] == f"lost its numbers at {cycle * crane.control.t_cycle:.2f} s: its input s_tip is nan"
    numbers = [x for key, x in rows[0].items() if key not in ("status", "notes", "validated")]
    assert np.isnan(numbers).all()


def test_every_winch_type_is_among_them():
    assert {load_crane(name).plant.value for name in LIBRARY} == set(WINCH_TYPES)


@pytest.mark.long
@settings(max_examples=5, deadline=None)
@given(st.dictionaries(st.integers(0, 18), st.integers(1, 5999), min_size=1, max_size=19), st.integers(0, 2))
def test_whoever_is_lost_and_when_the_others_have_the_bits_that_they_have_alone(lost, what):
    """More cases than a block of lanes has, lost in the warm-up, at its end, or in the last cycle of a piece."""
    value = (math.nan, math.inf, 1e40)[what]
    lost = {i: (2000, CHUNK, k)[k % 3] for i, k in lost.items()}
    cases = [case(1.0 + i, tip=f"sine {1.0 + 0.01 * i} m 10 s") for i in range(19)]
    with pytest.MonkeyPatch.context() as patch:
        fill = runner.filled

        def filled(drives, k, n):
            D = fill(drives, k, n)
            for lane, drive in enumerate(drives):
                i = round(drive.case.load / 1e3) - 1
                if i in lost and k + n > lost[i]:
                    D[max(lost[i] - k, 0) :, 0, lane] = value
            return D

        patch.setattr(runner, "filled", filled)
        runs = run_cases(CRANE, cases, lanes=VL, keep=unchanged)
    for i, (run, alone) in enumerate(zip(runs, ALONE.of(cases), strict=True)):
        if i not in lost:
            assert same(run.row, alone)
        else:
            assert run.ending is Ending.DIVERGED
            assert 0.0 <= run.t_end - lost[i] * CRANE.control.t_cycle <= SOON


class ALONE:
    """Summaries of cases, each run by itself, made once."""

    kept: list = []

    @classmethod
    def of(cls, cases):
        cls.kept = cls.kept or [run_cases(CRANE, c)[0] for c in cases]
        return cls.kept


@pytest.mark.slow
@pytest.mark.parametrize(("state", "value"), [("p_a", np.inf), ("p_a", -1e16), ("omega_m", np.nan), ("s_w", 1e300)])
def test_a_state_beyond_what_a_winch_can_reach_is_named(state, value):
    block = ScenarioType().block(ScenarioType().ready([CRANE] * 3, [case(50.0)] * 3, 2), lanes=VL, n_sub=2, every=0)
    steps = block.steps()
    next(steps)
    before = block.ran * block.drive.t_cycle
    names = [name.rpartition(".")[2] for name in paths(block.d.State)]
    block.A[names.index(state), 1] = value
    for _ in steps:
        pass
    sound, bad, other = block.results()
    assert bad.ending is Ending.DIVERGED
    assert before <= bad.t_end <= before + block.drive.t_cycle
    assert bad.loss == f"state {state} is {value:.3g}"
    assert same(sound.row, other.row)
    assert sound.row["status"] == "ok"


@pytest.mark.slow
def test_the_work_for_lost_lanes_is_not_done(spoil):
    """Blocks whose cases are all lost at 5 s do not run on."""
    cases = [case(1.0 + i) for i in range(VL)]
    for each in cases:
        spoil(each.tip, 500)
    of = ScenarioType()
    block = of.block(of.ready([CRANE] * VL, cases, 2), lanes=VL, n_sub=2, every=0)
    for _ in block.steps():
        pass
    assert block.ran == 500
    assert {run.ending for run in block.results()} == {Ending.DIVERGED}


@pytest.mark.slow
def test_the_series_of_a_lost_case_has_its_numbers_up_to_there_and_none_of_its_neighbours(spoil):
    bad = case(20.0, tip="sine 1 m 9 s")
    spoil(bad.tip, 3000)
    run = simulate(CRANE, [bad, *(case(10.0 + i) for i in range(8))], series=True, on_failure="mark")
    whole = simulate(CRANE, [case(20.0, tip="sine 1 m 9.0 s")], series=True)
    assert run.status.values[0] == "diverged"
    known = run.time.values < 30.0
    np.testing.assert_array_equal(run.p_a.values[0][known], whole.p_a.values[0][known])
    assert np.isnan(run.p_a.values[0][~known]).all()
    assert not np.isnan(run.p_a.values[1:]).any()


# Lowerings


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 2])
def test_a_lowering_in_water_that_is_no_number_is_noticed_and_spoils_no_other(place):
    cases = [lift(waves=water()), lift("120 t", waves=water()), lift("80 t", waves=water())]
    alone = [run_cases(CRANE, c)[0] for c in cases]
    bad = water()
    bad.w[213:] = np.nan
    cases[place] = lift(start_depth="0.5 m", waves=bad)
    rows = run_cases(CRANE, cases)
    lost = rows.pop(place)
    assert same(rows, [a for i, a in enumerate(alone) if i != place])
    assert lost["status"] == "diverged"
    t = float(lost["notes"][-1].split(" s: ")[0].rpartition(" ")[2])
    assert 21.0 < t <= 21.3 + SOON
    assert lost["notes"][-1].endswith("motion of its water is not a number")


@pytest.mark.slow
def test_a_lowering_whose_tip_is_no_number_is_noticed_and_spoils_no_other(spoil):
    cases = [in_sea(seed=seed) for seed in range(3)]
    alone = [run_cases(CRANE, c)[0] for c in cases]
    bad = deep_lift(tip=Sine(amplitude="1 m", period="9 s"))
    spoil(bad.tip, 1700)
    rows = run_cases(CRANE, [bad, *cases])
    assert same(rows[1:], alone)
    assert rows[0]["notes"][-1] == "lost its numbers at 17.00 s: its input s_tip is nan"


def test_what_ends_with_its_programme_is_not_cut_short_by_a_lost_lane(spoil):
    of = LoweringType(short=True)
    long, bad = deep_lift(duration="60 s"), deep_lift(duration="60 s", tip=Sine(amplitude="1 m", period="9 s"))
    spoil(bad.tip, 300)
    ran = []
    for cases in ([long], [bad, long]):
        block = of.block(of.ready([CRANE] * len(cases), cases, 2), lanes=VL, n_sub=2, every=0)
        for _ in block.steps():
            pass
        ran.append(block.results()[-1])
    assert same(ran[0].row, ran[1].row)


# Refused among others


def test_what_is_refused_is_marked_among_others():
    cases = [case(20.0), case(900.0), case(30.0), case(20.0, s_w="19000 m"), case(20.0)]
    cranes = [CRANE] * 4 + [STIFF]
    run = simulate(cranes, cases, on_failure="mark")
    assert run.status.values.tolist() == ["ok", "refused", "ok", "refused", "refused"]
    notes = run.notes.values
    assert notes[1].startswith("refused: Load 900 t exceeds the SWL 250 t")
    assert notes[3].startswith("refused: s_w 19000 m is more than")
    assert notes[4].startswith("refused: step 5 ms is too long for this crane")
    assert np.isnan(run.e_c_pp.values[[1, 3, 4]]).all()
    alone = simulate(CRANE, [cases[0], cases[2]])
    assert run.e_c_pp.values[[0, 2]].tolist() == alone.e_c_pp.values.tolist()


def test_without_a_mark_the_first_that_is_refused_stops_the_batch_before_it_runs():
    with pytest.raises(ScenarioError, match=r"^case 1: Load 900 t"):
        simulate(CRANE, [case(20.0), case(900.0)])
    with pytest.raises(ScenarioError, match=r"^Load 900 t"):
        simulate(CRANE, case(900.0), on_failure="mark")


def test_where_all_are_refused_nothing_is_kept():
    with pytest.raises(SimulationError, match=r"^2 of 2 cases refused: step 5 ms is too long"):
        simulate([STIFF, STIFF], case(20.0), on_failure="mark")


def test_a_series_keeps_room_for_what_is_refused():
    run = simulate(CRANE, [case(900.0), case(20.0)], series=True, on_failure="mark")
    assert np.isnan(run.p_a.values[0]).all()
    assert np.isfinite(run.p_a.values[1]).all()


def test_a_lift_that_is_refused_is_marked_among_others():
    run = simulate(CRANE, [lift(), lift("400 t")], on_failure="mark")
    assert run.status.values[1] == "refused"
    assert np.isfinite(run.F_w_max.values[0])
    assert np.isnan(run.F_w_max.values[1])
    with pytest.raises(LiftError, match="400 t"):
        simulate(CRANE, [lift(), lift("400 t")])


def test_what_is_refused_is_run_by_a_store_without_it(tmp_path):
    cases = [case(20.0), case(900.0), case(30.0)]
    first, again = (simulate(CRANE, cases, on_failure="mark", store=tmp_path) for _ in range(2))
    assert first.status.values.tolist() == again.status.values.tolist() == ["ok", "refused", "ok"]
    assert first.e_c_pp.values.tolist()[::2] == again.e_c_pp.values.tolist()[::2]


def test_draws_that_are_refused_count_as_failed_and_the_rest_has_its_numbers(monkeypatch):
    """One drawn crane too stiff for the step does not end ten thousand draws."""

    class Drawing:
        def __init__(self) -> None:
            self.crane, self.case = CRANE, case(20.0)

        def pairs(self, values):
            return iter([(CRANE, case(20.0)), (STIFF, case(20.0)), (CRANE, case(30.0))])

    numbers, status, _ = run_draws([Drawing()], np.zeros((3, 1)))
    assert status == [["ok", "refused", "ok"]]
    assert np.isnan(numbers[0, 1]).all()
    assert np.isfinite(numbers[0, 0, 0])
    assert set(itertools.chain(*status)) & FAILED


# A stepped winch


def test_a_session_names_what_is_no_number_in_the_cycle_where_it_is_lost():
    session = Session(CRANE, case(50.0))
    session.step(cycles=100)
    kept = session.save()
    lane = session._block.A
    names = [name.rpartition(".")[2] for name in paths(session._block.d.State)]
    lane[names.index("p_a"), 0] = np.nan
    with pytest.raises(SimulationError, match=r"^Session: state \w+ is nan after 1 s\. Restore a saved state") as error:
        session.step(cycles=50)
    assert "\n" not in str(error.value)
    session.restore(kept)
    session.step(cycles=50)
    assert math.isfinite(session.get("p_a"))
