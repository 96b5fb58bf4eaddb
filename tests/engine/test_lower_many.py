"""Many lowerings in seas: the bits that each has alone, rarer statistics, an end with the programme; motions straight
into the lanes."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.engine.lifts import IN_SEAS, RAO, SPLASH, X, Y, deep_lift, in_sea, sea

from stillhook import load_crane
from stillhook.engine.inputs import CycleInputs, filled
from stillhook.engine.pack.lift import stand_in
from stillhook.engine.simulate import simulate
from stillhook.errors import LiftError
from stillhook.formats.results import load_run, rerun, save_run
from stillhook.sea.motion.irregular import COARSE
from stillhook.sea.motion.motion import Sine
from stillhook.sea.motion.text import motion_from_dict
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Sensors

CRANE = load_crane("nov-250t")
RARELY, RARELY_BETWEEN = 0.01, 1e-3
"""Share by which numbers may differ with statistics every 20 ms: those taken at cycles (measured 0.7 % of a winch's speed in the splash
zone), and those of every step, for the wire is laid out anew less often."""
AUDITED = 2e-3
CURVE = 1e-6
"""Height, speed and acceleration of a tip on the coarser curve over their standard deviations; measured 3e-11, 1e-9 and 1e-7."""


@pytest.fixture(scope="module")
def truth():
    return simulate(CRANE, IN_SEAS)


@pytest.mark.slow
def test_many_lowerings_have_the_bits_of_each_alone(truth):
    some = [0, 12, 18]
    assert (
        truth.isel(case=some)
        .drop_attrs()
        .equals(
            simulate(CRANE, [IN_SEAS[i].lowering() for i in some]).drop_attrs().assign_coords(case=truth.case[some])
        )
    )


@pytest.mark.slow
def test_lifts_that_differ_after_their_first_phase_have_the_bits_of_each_alone():
    """They are packed once."""
    first, lift = Phase(mode="ahc", time="5 s"), in_sea()
    programmes = [
        (first, Phase(mode="emergency-stop", time="15 s")),
        (first, Phase(mode="ahc", speed="12 m/min", time="12 s")),
    ]
    cases = [replace(lift, lift=lift.lift.model_copy(update={"programme": each})) for each in programmes]
    together = simulate(CRANE, cases).drop_attrs()
    for i, each in enumerate(programmes):
        alone = simulate(CRANE, [in_sea(deep_lift(programme=tuple(p.model_copy() for p in each)))]).drop_attrs()
        assert together.isel(case=[i]).equals(alone.assign_coords(case=together.case[[i]], phase=together.phase))
    assert float(together.s_w_end[1] - together.s_w_end[0]) > 1.0


@pytest.mark.slow
def test_statistics_taken_every_other_cycle_are_those_of_the_same_motion(truth):
    """Sling tensions count every step all the same; what is taken at cycles misses next to nothing of slow motions."""
    rare = simulate(CRANE, IN_SEAS, sampling="20 ms")
    for name in ("F_sling_max", "F_sling_min", "v_load_max", "z_load_end", "s_w_end"):
        np.testing.assert_allclose(rare[name], truth[name], rtol=RARELY_BETWEEN, err_msg=name)
    for name in ("e_c_pp", "load_pp", "F_w_max", "v_w_max"):
        np.testing.assert_allclose(rare[name], truth[name], rtol=RARELY, err_msg=name)
    assert float(abs(rare.energy_unaccounted).max()) < AUDITED
    assert (rare.status == truth.status).all()


@pytest.mark.slow
def test_rarer_statistics_have_the_same_bits_alone_as_side_by_side(truth):
    several = simulate(CRANE, IN_SEAS[:3], sampling="20 ms")
    alone = simulate(CRANE, [IN_SEAS[1]], sampling="20 ms")
    assert float(alone.F_w_max[0]) == float(several.F_w_max[1])


@pytest.mark.long
def test_a_result_of_an_older_version_is_read_with_the_names_of_today(truth, tmp_path):
    old = truth.rename({name: name.replace("phase", "stage") for name in truth.variables if name.startswith("phase")})
    read = load_run(save_run(old, tmp_path / "old.nc"))
    assert set(read.variables) == set(truth.variables)
    assert read.sizes == truth.sizes
    np.testing.assert_array_equal(read.phase_duration, truth.phase_duration)


@pytest.mark.slow
def test_a_run_that_ends_with_its_programme_has_the_bits_of_its_phases(truth):
    """Whoever runs beside it, and however long they go on; what follows the programme is shorter."""
    ending = simulate(CRANE, IN_SEAS, end="programme")
    alone = simulate(CRANE, IN_SEAS[:1], end="programme")
    of_phases = [name for name in truth if name.startswith("phase_")]
    for name in of_phases:
        np.testing.assert_array_equal(ending[name].isel(phase=0), truth[name].isel(phase=0), err_msg=name)
        np.testing.assert_array_equal(ending[name][0, :2], alone[name][0], err_msg=name)
    assert float(ending.phase_duration[0, 1]) < float(truth.phase_duration[0, 1])  # after the programme
    assert (ending.status == truth.status).all()
    whole = np.isfinite(ending.peak_F_w_max)
    np.testing.assert_array_equal(ending.peak_F_w_max.values[whole], truth.peak_F_w_max.values[whole])
    assert whole.any()
    assert not whole.all()


@pytest.mark.slow
def test_a_run_whose_programme_does_not_end_goes_on_for_its_duration():
    unfinished = in_sea(deep_lift(programme=(Phase(mode="ahc", time="40 s"),)))
    ended, whole = (simulate(CRANE, [unfinished], end=end) for end in ("programme", "duration"))
    assert ended.drop_attrs().equals(whole.drop_attrs())
    assert ended.status[0] == "unfinished"


def test_a_series_of_a_run_that_ends_with_its_programme_has_its_statistics_and_ends_there():
    options = {"sampling": "20 ms", "end": "programme"}
    many = simulate(CRANE, IN_SEAS[:3], **options)
    alone = simulate(CRANE, IN_SEAS[0], **options)
    for name in many.data_vars:
        np.testing.assert_array_equal(many[name].values[0], alone[name].values, err_msg=name)
    last = float(alone.time[-1])
    assert float(alone.programme_time) < last < IN_SEAS[0].lift.duration
    assert np.isfinite(alone.z_load).all()
    assert rerun(alone).identical(alone)


def test_water_comes_where_it_is_asked_for_and_a_flat_cap_leaves_its_part_of_the_tips_motion():
    still, moved = (in_sea(SPLASH, water=water).lowering().waves for water in (False, True))
    assert still is None
    assert moved is not None
    whole, left = in_sea().lowering().tip, in_sea(left=0.2).lowering().tip
    assert left.deviation() == pytest.approx(0.2 * whole.deviation(), rel=1e-12)


SENSED = (
    {},
    {"delay": "100 ms"},
    {"delay": "0.25 s", "noise_s_tip": "10 mm", "step_v_tip": "0.01 m/s", "seed": 3},
    {"delay": "0.1 s", "noise_F": "1 kN"},
)


@pytest.mark.parametrize("sensors", SENSED, ids=("ideal", "late", "late and rough", "with a rough load cell"))
def test_motions_go_into_the_lanes_with_the_bits_that_they_have_alone(sensors):
    cases = [c.lowering().model_copy(update={"sensors": Sensors(**sensors)}) for c in IN_SEAS[:3]]
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


def test_a_lift_in_a_sea_has_no_motion_of_its_own():
    with pytest.raises(LiftError, match="has a tip motion or waves already"):
        in_sea(deep_lift(name="rocked", tip=Sine(amplitude="1 m", period="9 s")))


def test_lifts_of_unlike_durations_meet_the_same_waves_where_these_repeat_alike():
    short, long = (in_sea(deep_lift(duration=f"{T} s"), repeat=60.0).lowering().tip for T in (30, 45))
    assert short == long != in_sea().lowering().tip
    with pytest.raises(LiftError, match="repeat 20 s is shorter than the lift, 30 s"):
        in_sea(repeat=20.0)


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
