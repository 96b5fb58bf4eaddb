"""Many lowerings in seas: the bits that each has alone, kept in a store, shared by a cluster; motions straight into the lanes."""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from stillhook import load_crane, read_payload
from stillhook.engine import batch as module
from stillhook.engine.inputs import CycleInputs, filled
from stillhook.engine.pack.lift import stand_in
from stillhook.engine.simulate import simulate
from stillhook.errors import LiftError, SimulationError, StillhookError
from stillhook.formats.results import rerun
from stillhook.formats.vessel.open import read_vessel
from stillhook.library import changed
from stillhook.library.catalogue import vessel_file
from stillhook.sea.motion.irregular import COARSE
from stillhook.sea.motion.motion import Sine
from stillhook.sea.motion.text import motion_from_dict
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Scenario, Sensors

CRANE = load_crane("nov-250t")
SCENARIO = Scenario(load="60 t", s_w="100 m", tip="sine 1 m 10 s", duration="30 s", warm_up="10 s")
STRONG = changed(CRANE, {"control": {"K_p": "0.3 1/m"}})
RAO = read_vessel(vessel_file("construction-vessel-130m"))
X, Y = -15.0, -24.0
RARELY, RARELY_BETWEEN = 0.01, 1e-3
"""Share by which numbers may differ with statistics every 20 ms: those taken at cycles (measured 0.7 % of a winch's speed in the splash
zone), and those of every step, for the wire is laid out anew less often."""
AUDITED = 2e-3
CURVE = 1e-6
"""Height, speed and acceleration of a tip on the coarser curve over their standard deviations; measured 3e-11, 1e-9 and 1e-7."""


def lift(start_depth: str = "1480 m", **more: object) -> Lowering:
    given = {
        "payload": read_payload("manifold-60t"),
        "h_tip": "36 m",
        "depth": "1500 m",
        "start_depth": start_depth,
        "duration": "30 s",
    }
    return Lowering(**{**given, "programme": (Phase(mode="ahc", time="20 s"),), **more})


DEEP, SPLASH = (
    lift(),
    lift("10 m", programme=(Phase(mode="splash", speed="6 m/min", time="10 s"), Phase(mode="ahc", time="12 s"))),
)


def sea(Hs: float, Tp: float = 8.0) -> Sea:
    return Sea((Train(Jonswap(Hs, Tp), np.radians(165.0), 4.0),))


def in_sea(lift: Lowering = DEEP, Hs: float = 2.0, seed: int = 0, **more: object) -> InSea:
    return InSea(lift, sea(Hs), seed, RAO, X, Y, **more)


CASES = [in_sea(seed=seed, Hs=Hs) for Hs in (1.0, 2.5) for seed in range(9)] + [
    in_sea(SPLASH, seed=3, water=True, left=0.2)
]


@pytest.fixture(scope="module")
def truth():
    return simulate(CRANE, CASES)


@pytest.fixture
def counted(monkeypatch):
    """Cases that were run."""
    ran: list[int] = []
    work = module.work
    monkeypatch.setattr(module, "work", lambda task, progress=None: (ran.extend(task.indices), work(task, progress))[1])
    return ran


@pytest.mark.slow
def test_many_lowerings_have_the_bits_of_each_alone(truth):
    some = [0, 12, 18]
    assert (
        truth.isel(case=some)
        .drop_attrs()
        .equals(simulate(CRANE, [CASES[i].lowering() for i in some]).drop_attrs().assign_coords(case=truth.case[some]))
    )


@pytest.mark.slow
def test_statistics_taken_every_other_cycle_are_those_of_the_same_motion(truth):
    """Sling tensions count every step all the same; what is taken at cycles misses next to nothing of slow motions."""
    rare = simulate(CRANE, CASES, sampling="20 ms")
    for name in ("F_sling_max", "F_sling_min", "v_load_max", "z_load_end", "s_w_end"):
        np.testing.assert_allclose(rare[name], truth[name], rtol=RARELY_BETWEEN, err_msg=name)
    for name in ("e_c_pp", "load_pp", "F_w_max", "v_w_max"):
        np.testing.assert_allclose(rare[name], truth[name], rtol=RARELY, err_msg=name)
    assert float(abs(rare.energy_unaccounted).max()) < AUDITED
    assert (rare.status == truth.status).all()


@pytest.mark.slow
def test_rarer_statistics_have_the_same_bits_alone_as_side_by_side(truth):
    several = simulate(CRANE, CASES[:3], sampling="20 ms")
    alone = simulate(CRANE, [CASES[1]], sampling="20 ms")
    assert float(alone.F_w_max[0]) == float(several.F_w_max[1])


def test_statistics_every_so_often_are_kept_apart_from_others_in_a_store(tmp_path, counted):
    simulate(CRANE, [CASES[0]], store=tmp_path)
    simulate(CRANE, [CASES[0]], store=tmp_path, sampling="20 ms")
    assert counted == [0, 0]


@pytest.mark.slow
def test_a_run_that_ends_with_its_programme_has_the_bits_of_its_stages(truth):
    """Whoever runs beside it, and however long they go on; what follows the programme is shorter."""
    ending = simulate(CRANE, CASES, end="programme")
    alone = simulate(CRANE, CASES[:1], end="programme")
    of_stages = [name for name in truth if name.startswith("stage_")]
    for name in of_stages:
        np.testing.assert_array_equal(ending[name].isel(stage=0), truth[name].isel(stage=0), err_msg=name)
        np.testing.assert_array_equal(ending[name][0, :2], alone[name][0], err_msg=name)
    assert float(ending.stage_duration[0, 1]) < float(truth.stage_duration[0, 1])  # after the programme
    assert (ending.status == truth.status).all()
    whole = np.isfinite(ending.peak_F_w_max)
    np.testing.assert_array_equal(ending.peak_F_w_max.values[whole], truth.peak_F_w_max.values[whole])
    assert whole.any()
    assert not whole.all()


@pytest.mark.slow
def test_a_run_whose_programme_does_not_end_goes_on_for_its_duration():
    unfinished = in_sea(lift(programme=(Phase(mode="ahc", time="40 s"),)))
    ended, whole = (simulate(CRANE, [unfinished], end=end) for end in ("programme", "duration"))
    assert ended.drop_attrs().equals(whole.drop_attrs())
    assert ended.status[0] == "unfinished"


def test_a_series_of_a_run_that_ends_with_its_programme_has_its_statistics_and_ends_there():
    options = {"sampling": "20 ms", "end": "programme"}
    many = simulate(CRANE, CASES[:3], **options)
    alone = simulate(CRANE, CASES[0], **options)
    for name in many.data_vars:
        np.testing.assert_array_equal(many[name].values[0], alone[name].values, err_msg=name)
    last = float(alone.time[-1])
    assert float(alone.programme_time) < last < CASES[0].lift.duration
    assert np.isfinite(alone.z_load).all()
    assert rerun(alone).identical(alone)


def test_runs_that_end_with_their_programme_are_kept_apart_from_others_in_a_store(tmp_path, counted):
    simulate(CRANE, [CASES[0]], store=tmp_path)
    simulate(CRANE, [CASES[0]], store=tmp_path, end="programme")
    assert counted == [0, 0]


@pytest.mark.parametrize(
    ("case", "options", "says"),
    [
        (CASES[0], {"end": "soon", "series": False}, 'end = "soon": give one of duration, programme'),
        (SCENARIO, {"end": "programme"}, "sampling and end are for lowerings"),
        (CASES[0], {"sampling": "20 ms", "every": "50 ms"}, 'every = "50 ms" is not a whole number of samples'),
        (CASES[0], {"sampling": "15 ms", "series": False}, 'sampling = "15 ms" is not a whole number of PLC cycles'),
        (CASES[0], {"sampling": "20 m", "series": False}, "sampling"),
        (SCENARIO, {"sampling": "20 ms"}, "sampling and end are for lowerings"),
    ],
)
def test_intervals_of_statistics_that_cannot_be_are_refused_in_one_line(case, options, says):
    with pytest.raises(StillhookError, match=re.escape(says)):
        simulate(CRANE, case, **options)


def test_water_comes_where_it_is_asked_for_and_a_flat_cap_leaves_its_part_of_the_tips_motion():
    still, moved = (in_sea(SPLASH, water=water).lowering().waves for water in (False, True))
    assert still is None
    assert moved is not None
    whole, left = in_sea().lowering().tip, in_sea(left=0.2).lowering().tip
    assert left.deviation() == pytest.approx(0.2 * whole.deviation(), rel=1e-12)


@pytest.mark.slow
def test_every_case_may_have_its_crane(truth):
    run = simulate([CRANE, STRONG], [CASES[0], CASES[0]])
    assert float(run.e_c_pp[0]) == float(truth.e_c_pp[0])
    assert float(run.e_c_pp[1]) < float(run.e_c_pp[0])


@pytest.mark.slow
def test_what_is_in_the_store_is_not_run_again_whatever_it_is_called(tmp_path, truth, counted):
    first = simulate(CRANE, CASES[:4], store=tmp_path)
    part = truth.isel(case=slice(4), stage=slice(2)).assign_coords(stage=first.stage, case=first.case)
    part.attrs["lowerings"] = first.attrs["lowerings"]  # which is of four cases
    assert first.identical(part)
    assert sorted(counted) == [0, 1, 2, 3]
    again = simulate(CRANE, [in_sea(lift(name="again"), seed=c.seed, Hs=1.0) for c in CASES[3::-1]], store=tmp_path)
    assert len(counted) == 4
    assert np.array_equal(again.e_c_pp.values, first.e_c_pp.values[::-1])
    assert again.case.values.tolist() == ["again"] * 4


@pytest.mark.slow
@pytest.mark.parametrize("other", [{"seed": 1}, {"Hs": 2.1}, {"left": 0.5}, {"lift": lift("1470 m")}, {"water": True}])
def test_what_changes_a_result_is_run(tmp_path, counted, other):
    simulate(CRANE, [in_sea()], store=tmp_path)
    simulate(CRANE, [in_sea(**other)], store=tmp_path)
    simulate(STRONG, [in_sea()], store=tmp_path)
    assert len(counted) == 3


@pytest.mark.slow
def test_an_interrupted_run_goes_on_where_it_stood(tmp_path, truth, counted):
    def stop(share: float) -> None:
        if share > 0.9:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(CRANE, CASES, store=tmp_path, threads=1, progress=stop)
    before = len(counted)
    assert simulate(CRANE, CASES, store=tmp_path).identical(truth)
    assert 0 < len(counted) - before < len(CASES)


@pytest.mark.slow
def test_a_cluster_gives_the_same_bits(truth):
    distributed = pytest.importorskip("distributed")
    seen: list[float] = []
    local = distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None)
    with local as cluster, distributed.Client(cluster) as client:
        assert simulate(CRANE, CASES, client=client, progress=seen.append).identical(truth)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)


SENSED = (
    {},
    {"delay": "100 ms"},
    {"delay": "0.25 s", "noise_s_tip": "10 mm", "step_v_tip": "0.01 m/s", "seed": 3},
    {"delay": "0.1 s", "noise_F": "1 kN"},
)


@pytest.mark.parametrize("sensors", SENSED, ids=("ideal", "late", "late and rough", "with a rough load cell"))
def test_motions_go_into_the_lanes_with_the_bits_that_they_have_alone(sensors):
    cases = [c.lowering().model_copy(update={"sensors": Sensors(**sensors)}) for c in CASES[:3]]
    cases.append(cases[0].model_copy(update={"tip": Sine(amplitude="1 m", period="9 s")}))
    drives = [CycleInputs(CRANE, stand_in(CRANE, c, 0.0)) for c in cases]
    for k, n in ((0, 1500), (700, 2300)):
        assert np.array_equal(filled(drives, k, n), np.stack([d.rows(k, n) for d in drives], axis=-1))


def test_the_coarser_curve_of_runs_in_great_numbers_leaves_the_tip_where_it_was():
    waves = realise(sea(2.0, Tp=5.0), 60.0, 1, depth=1500.0)
    fine, coarse = tip_motion(waves, RAO, X, Y), tip_motion(waves, RAO, X, Y, fine=COARSE)
    t = np.linspace(0.0, 60.0, 5000)
    for order, (a, b) in enumerate(zip(fine.sample(t), coarse.sample(t), strict=True)):
        assert np.abs(a - b).max() < CURVE * fine.deviation(order)
    assert motion_from_dict(coarse.to_dict()) == pickle.loads(pickle.dumps(coarse)) == coarse != fine


@pytest.mark.parametrize(
    ("crane", "cases", "says"),
    [
        (CRANE, [], "the list of cases is empty"),
        (CRANE, [7], "case 0 = 7: not a Scenario or Lowering"),
        ([CRANE], CASES[:2], "1 cranes and 2 cases"),
        (
            [CRANE, load_crane("nov-100t-pure-active")],
            CASES[:2],
            'crane 1 "nov-100t-pure-active" pure-active with a PLC cycle of 0.01 s. Run winches of one kind together',
        ),
        (
            CRANE,
            [CASES[0], in_sea(lift("1600 m"))],
            "case 1: start_depth = 1600 m: the payload would lie on the seabed",
        ),
    ],
)
def test_what_cannot_be_run_is_told_before_anything_runs(crane, cases, says, counted):
    with pytest.raises(Exception, match=says):
        simulate(crane, cases)
    assert counted == []


def test_a_lift_in_a_sea_has_no_motion_of_its_own():
    with pytest.raises(LiftError, match="has a tip motion or waves already"):
        in_sea(lift(name="rocked", tip=Sine(amplitude="1 m", period="9 s")))


def test_lifts_of_unlike_durations_meet_the_same_waves_where_these_repeat_alike():
    short, long = (in_sea(lift(duration=f"{T} s"), repeat=60.0).lowering().tip for T in (30, 45))
    assert short == long != in_sea().lowering().tip
    with pytest.raises(LiftError, match="repeat 20 s is shorter than the lift, 30 s"):
        in_sea(repeat=20.0)


def test_a_store_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimulationError, match="cannot be written"):
        simulate(CRANE, CASES[:1], store=tmp_path / "file" / "store")


HOW_TO = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "run-many-lifts.md"


@pytest.mark.slow
def test_the_page_on_many_lifts_runs(tmp_path, monkeypatch, capsys):
    code = HOW_TO.read_text().split("```python\n")[1].split("```")[0]
    for long, short in (('"10 min"', '"20 s"'), ('"620 s"', '"30 s"'), ("range(20)", "range(2)"), ("3, 20)", "3, 2)")):
        assert long in code
        code = code.replace(long, short)
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert len(capsys.readouterr().out.split()) >= 3
    assert list((tmp_path / "runs").glob("*.npz"))
