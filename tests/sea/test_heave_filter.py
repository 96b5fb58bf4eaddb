"""What a motion unit's heave filter loses in waves: beside a filter that runs in time, in spectra and in runs."""

import math
from importlib.resources import files

import numpy as np
import pytest

import stillhook
from stillhook.errors import StillhookError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.lift_writer import Run, write_lift
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import vessel_file
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.tiers.time_domain.lowering import SeaState, Winch, course_of, in_sea, lowering_of, machine_of
from stillhook.plan.tiers.winch_residual import FLAT
from stillhook.response.forcing import filtered_forcing, forcing_of_seas
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.text import motion_from_json, motion_to_json
from stillhook.sea.spectra.directions import cos_power
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.heave_filter import FilteredTip, moved_by
from stillhook.sea.vessel.realisation import Resolution, realise
from stillhook.spec.lift.stored import lowerings_text, stored_lowerings

X, Y, Z = -20.0, -18.0, 30.0
UNIT = stillhook.MotionUnit(heave_period="25 s", at=("12 m", "3 m", "0 m"), rotations="small-angle")
SEA = Sea((Train(Jonswap(2.0, 11.0), math.radians(150.0), None),))
VESSEL = read_vessel(vessel_file("construction-vessel-130m"))
AT_POINT = stillhook.MotionUnit(heave_period="25 s", rotations="small-angle")
TURNED = 1e-4  # m: the ship's own rotation of the unit's place is in full
SAME = 1e-6  # m: curves of waves, coarse ones, and RK4 of the filter in time
BETWEEN = 0.01  # of a deviation: two grids of frequencies


@pytest.fixture(scope="module")
def waves():
    return realise(SEA, 600.0, 4)


def moved(waves, left=1.0, unit=UNIT):
    return moved_by(waves, VESSEL, X, Y, water=False, left=left, resolution=Resolution.FINE, unit=unit)[0]


@pytest.mark.long
@pytest.mark.parametrize(("unit", "close"), [(UNIT, TURNED), (AT_POINT, SAME)])
def test_the_plc_is_given_what_a_filter_in_time_makes_of_the_ships_motions(waves, unit, close):
    """Heave, roll and pitch of the same waves through the filter that is integrated in time, and the lever."""
    heave, roll, pitch = (IrregularTip(waves.spread(c), waves.repeat) for c in waves.motion(VESSEL)[2:5])
    bow_up = IrregularTip(-pitch.amplitudes, waves.repeat)
    boom = f"x={X - 20.0} m, y={Y} m, z={Z} m, slew 0 deg, main 20 m 0 deg"
    in_time = stillhook.VesselTip(boom, heave=heave, roll=roll, pitch=bow_up, unit=unit)
    t = np.arange(300.0, 600.0, 0.5)  # its start has died away
    for one, other in zip(moved(waves, unit=unit).measured(t), in_time.measured(t), strict=True):
        assert np.abs(one - other).max() < close
    lost = moved(waves).sample(t)[0] - moved(waves).measured(t)[0]
    assert lost.std() > 0.2 * moved(waves).sample(t)[0].std()


@pytest.mark.parametrize("left", [0.0, 0.2, 1.0])
def test_spectra_and_waves_have_the_same_motion_left(waves, left):
    """With all of the filter's loss where the winch leaves nothing of what it is given."""
    forcing = filtered_forcing(lambda vessel: forcing_of_seas(SEA, vessel, X, Y), VESSEL, UNIT)
    motion = moved(waves, left)
    tip = motion.tip if isinstance(motion, FilteredTip) else motion
    for order in range(3):
        assert forcing.remaining(left).deviation(order)[0] == pytest.approx(tip.deviation(order), rel=BETWEEN)
    assert forcing.remaining(1.0).tip == pytest.approx(forcing.tip, rel=1e-12)
    flat = FLAT.gaussian(forcing.omega, forcing.deviation(1))
    assert forcing.remaining(flat).tip == pytest.approx(forcing.remaining(0.2).tip, rel=1e-9)
    assert (forcing.remaining(flat).tip >= forcing.lost.tip).all()
    assert forcing.remaining(0.0).deviation()[0] == pytest.approx(forcing.lost.deviation()[0], rel=1e-12)


def test_a_complex_residual_turns_against_what_is_lost():
    """Of every wave of a spread sea: |C a + (1 - C) b|^2 of the complex amplitudes of tip and loss."""
    sea = Sea((Train(SEA.trains[0].spectrum, 2.0, 6.0),))
    forcing = filtered_forcing(lambda vessel: forcing_of_seas(sea, vessel, X, Y), VESSEL, UNIT)
    theta, share = cos_power(6.0)
    C = 0.3 - 0.25j
    a = VESSEL.vertical(forcing.omega, 2.0 + theta, X, Y)
    b = (1.0 - UNIT.response(forcing.omega)) * VESSEL.vertical(forcing.omega, 2.0 + theta, 12.0, 3.0)
    expected = forcing.wave[0] * (share @ np.abs(C * a + (1.0 - C) * b) ** 2)
    assert forcing.remaining(C).tip[0] == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_the_twin_leaves_what_the_filter_loses_and_its_plc_does_not_see_it(waves):
    tip = moved(waves)
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip=tip, mode="ssc", duration="160 s", warm_up="40 s")
    run = stillhook.simulate(stillhook.load_crane("nov-250t"), case)
    lost = tip.lost.sample(run.time.values)[0][run.time.values >= 40.0]
    e_c, seen = (run[name].values[run.time.values >= 40.0] for name in ("e_c", "e_c_measured"))
    assert (
        np.abs((e_c - seen) - (lost - lost[0]) - (e_c[0] - seen[0])).max() < 0.02
    )  # the samples are half a step early
    assert seen.std() < 0.2 * e_c.std()
    assert e_c.std() == pytest.approx(lost.std(), abs=2.0 * seen.std())


def test_a_filtered_motion_is_kept_as_text(waves):
    tip = moved(waves)
    again, t = motion_from_json(motion_to_json(tip)), np.linspace(0.0, 100.0, 7)
    np.testing.assert_array_equal(again.measured(t), tip.measured(t))
    assert "the heave filter of the motion unit loses irregular motion" in tip.describe()


@pytest.fixture
def plan_file(tmp_path):
    def written(table: str):
        text = (files("stillhook.library") / "data" / "lifts" / "template-to-1500m.toml").read_text()
        (tmp_path / "plan.toml").write_text(text.replace("[water]", f"{table}\n[water]", 1))
        return tmp_path / "plan.toml"

    return written


def test_runs_of_a_plan_have_the_filter_and_are_stored_with_it(plan_file, tmp_path):
    plan = load_plan(plan_file('[motion_unit]\nheave_period = "25 s"\nat = ["12 m", "3 m", "0 m"]'))
    assert plan.digest != load_plan("template-to-1500m").digest
    phase = plan.phase("deep")
    for winch, filtered in ((Winch(controller=Alternative.SSC), True), (Winch(left=0.2), True), (Winch(), False)):
        course = course_of(plan, phase, winch)
        calm = lowering_of(plan, phase, course, machine_of(plan, winch)[1])
        case = in_sea(plan, phase, winch, course, calm, SeaState(2.0, 11.0, math.pi), 1)
        assert (case.unit is not None) is filtered
        assert isinstance(case.lowering().tip, FilteredTip) is (winch.controller is not None)
        (again,) = stored_lowerings(lowerings_text([case]))
        assert again.unit == case.unit
        assert again.motion == case.motion
    winch = Winch(controller=Alternative.SSC)
    course, mode = course_of(plan, phase, winch), machine_of(plan, winch)[1]
    run = in_sea(plan, phase, winch, course, lowering_of(plan, phase, course, mode), SeaState(2.0, 11.0, math.pi), 1)
    write_lift(Run(plan.crane, run, step="5 ms"), tmp_path)
    t = np.linspace(0.0, 60.0, 13)
    np.testing.assert_array_equal(
        load_lift(tmp_path / "lift.toml").lift.tip.measured(t), run.lowering().tip.measured(t)
    )


@pytest.mark.parametrize(
    ("table", "line"),
    [
        (
            '[motion_unit]\nheave_period = "25 ms"',
            "plan.toml: unit: heave_period 0.025 s is not between 2 s and 1000 s.",
        ),
        ('[motion_unit]\nheave_period = "25 m"', "heave_period"),
        ("[motion_unit]\nheave_damping = 0.7", "heave_period"),
        ('[motion_unit]\nheave_period = "25 s"\ndelay = "20 ms"', "delay"),
        (
            '[motion_unit]\nheave_period = "25 s"\nheave_damping = 5.0',
            "unit: heave_damping 5.0 is not between 0.1 and 2.",
        ),
        ('[motion_unit]\nheave_period = "25 s"\nat = ["1 m", "0 m"]', "at"),
    ],
)
def test_a_motion_unit_that_is_none_is_refused_in_one_line(plan_file, table, line):
    with pytest.raises(StillhookError) as problem:
        load_plan(plan_file(table))
    assert line in str(problem.value)
    assert str(problem.value).startswith("plan.toml")
    assert "\n" not in str(problem.value)
