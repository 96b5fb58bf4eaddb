"""Uncertainty of friction carried into a lift: draws of cranes, what physics allows, and what is refused."""

import json

import numpy as np
import pytest
from tests.commands import case_file
from tests.identify.refusals import refused

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.uncertainty.draws import Drawing, Uncertainty, draws
from stillhook.cli import run as command
from stillhook.errors import StillhookError
from stillhook.library import FrictionSet, LossSet, changed, load_friction, load_losses
from stillhook.library.draws import crane_with, draw, draw_cranes
from stillhook.library.parameter_sets import Evidence, save_set
from stillhook.winches.circuits.tables import Motor

CRANE = load_crane("nov-150t")
CASE = Scenario(load="60 t", s_w="100 m", tip="sine 1 m 9 s", duration="30 s", warm_up="10 s")
MANY = 20_000
SAMPLING = 0.05
"""Relative: deviations and correlations of twenty thousand draws, ten of their standard errors."""


def friction_with(names, covariance, **values) -> FrictionSet:
    base = load_friction("crane-2")
    evidence = Evidence(names=names, covariance=covariance, dof=100.0, data="made-up tests")
    return FrictionSet("made-up", "made up", base.system.model_copy(update=values), base.sources, evidence)


KNOWN = friction_with(("Y_1", "Y_4", "Y_6"), ((1e-12, -4e-7, 0.0), (-4e-7, 1.0, 0.0), (0.0, 0.0, 2.5e-13)))


def test_draws_have_the_covariance_of_the_evidence():
    drawn = draw(KNOWN, MANY, np.random.default_rng(1))
    assert drawn.names == ("Y_1", "Y_4", "Y_6")
    assert drawn.values.shape == (MANY, 3)
    assert np.std(drawn.values, axis=0) == pytest.approx([1e-6, 1.0, 5e-7], rel=SAMPLING)
    assert np.corrcoef(drawn.values[:, 0], drawn.values[:, 1])[0, 1] == pytest.approx(-0.4, rel=SAMPLING)
    assert np.mean(drawn.values, axis=0) == pytest.approx([1.55e-5, KNOWN.system.Y_4, 1.62e-5], rel=0.01)
    assert drawn.allowed == pytest.approx(1.0)


def test_parameters_that_cannot_be_told_apart_are_drawn_along_their_line():
    """A covariance without full rank: only the sum of Y_2 and Y_3 is known."""
    item = friction_with(("Y_2", "Y_3"), ((0.04, -0.04), (-0.04, 0.04)), Y_2=2.0, Y_3=3.0)
    drawn = draw(item, 1000, np.random.default_rng(0)).values
    assert np.sum(drawn, axis=1) == pytest.approx(np.full(1000, 5.0), abs=1e-7)
    assert np.std(drawn[:, 0]) == pytest.approx(0.2, rel=0.1)


@pytest.mark.slow
def test_no_draw_is_negative_and_none_is_clipped():
    item = friction_with(("Y_2", "Y_3"), ((1.0, 0.0), (0.0, 1.0)), Y_2=0.0, Y_3=0.5)
    drawn = draw(item, MANY, np.random.default_rng(2))
    assert drawn.values.min() > 0.0  # clipped ones would sit at 0
    assert len(np.unique(drawn.values[:, 0])) == MANY
    assert drawn.allowed == pytest.approx(0.5 * 0.6915, rel=SAMPLING)
    assert np.mean(drawn.values[:, 0]) == pytest.approx(
        np.sqrt(2.0 / np.pi), rel=SAMPLING
    )  # half a normal distribution


def test_a_set_whose_draws_are_hardly_allowed_is_refused():
    item = friction_with(("Y_1", "Y_2", "Y_3", "Y_5", "Y_6"), (0.25 * np.eye(5)).tolist(), Y_2=0.0, Y_3=-1.0)
    line = refused(draw, item, 10, np.random.default_rng(0))
    assert line.startswith('set "made-up": only 0.')
    assert "of the draws have no negative parameter (Y_1 1.55e-05 ± 0.5, Y_2 0 ± 0.5" in line


@pytest.mark.slow
def test_the_same_seed_gives_the_same_cranes_and_all_else_stays():
    one, two, other = (draw_cranes(CRANE, KNOWN, n=5, seed=s) for s in (3, 3, 4))
    assert one == two
    assert one != other
    assert len({c.friction.system.Y_1 for c in one}) == 5
    of_crane = {n: getattr(CRANE.friction.system, n) for n in ("Y_1", "Y_4", "Y_6")}
    back = {"friction": {"system": of_crane | {"Y_4": f"{of_crane['Y_4']!r} rad/s"}}}
    for crane in one:
        kept = changed(crane, back)
        assert kept.model_copy(update={"sources": {}}) == CRANE.model_copy(update={"sources": {}})
        assert crane.friction.system.Y_5 == CRANE.friction.system.Y_5
    assert one[2].sources["friction.system.Y_1"].text == "draw 2 of 5 (seed 3) from made-up"
    assert one[2].sources["friction.system.Y_5"] == KNOWN.sources["Y_5"]


def test_a_motor_set_is_drawn_for_every_circuit_that_has_the_motor_with_one_draw_for_all():
    base = load_losses("A6VM215")
    item = LossSet(
        "motor",
        "made up",
        base.motor,
        base.sources,
        Evidence(names=("X_4",), covariance=((0.25,),), dof=9.0, data="a map"),
    )
    drawn = draw_cranes(CRANE, KNOWN, item, n=4)
    for crane in drawn:
        assert crane.passive is not None
        assert crane.active.motor.loss == crane.passive.motor.loss
        assert crane.active.motor.loss.X_3 == base.motor.loss.X_3
        assert crane.active.motor.C_1 == CRANE.active.motor.C_1
    assert len({c.active.motor.loss.X_4 for c in drawn}) == 4
    assert [c.friction for c in drawn] == [c.friction for c in draw_cranes(CRANE, KNOWN, n=4)]
    small = LossSet("small", "made up", load_losses("A6VM170").motor, base.sources, item.evidence)
    line = refused(draw_cranes, CRANE, None, small)
    assert 'set "small" is of a motor of 170 cm^3/rev, and those of "nov-150t" have 215' in line


def refined(law, names, covariance, **model) -> LossSet:
    """A motor of the library with another model of its loss, and what tests of a crane leave open of it."""
    of = changed(CRANE, {"active": {"motor": {"loss_model": {"law": law, **model}}}}).active.motor
    plain = Motor.model_construct(None, **{name: getattr(of, name) for name in Motor.model_fields})
    evidence = Evidence(names=names, covariance=covariance, dof=50.0, data="made-up tests")
    return LossSet("refined", "refined", plain, load_losses("A6VM215").sources, evidence)


THREE = refined("mj3", ("C_e", "C_g"), ((0.04, 0.0), (0.0, 1e-4)), C=(12.0, 6e-7, 0.5, 4e7), scale=1.1)
MAPPED = refined("map", ("scale",), ((1e-4,),), map="motor-map")


@pytest.mark.parametrize(("item", "mean", "deviation"), [(THREE, [13.2, 0.55], [0.2, 0.01]), (MAPPED, [1.0], [0.01])])
def test_a_set_of_another_model_is_read_back_drawn_and_runs(item, mean, deviation, tmp_path):
    again = load_losses(save_set(item, tmp_path / "refined.toml"))
    assert (again.motor.loss_model, again.evidence) == (item.motor.loss_model, item.evidence)
    values = draw(again, MANY, np.random.default_rng(2)).values
    assert np.mean(values, axis=0) == pytest.approx(mean, rel=0.01)
    assert np.std(values, axis=0) == pytest.approx(deviation, rel=SAMPLING)
    cranes = draw_cranes(CRANE, loss_set=again, n=4, seed=1)
    models = [crane.active.motor.loss_model for crane in cranes]
    assert len({(model.C, model.scale) for model in models}) == 4
    assert all(crane.passive.motor.loss_model == model for crane, model in zip(cranes, models, strict=True))
    assert cranes[0].sources["active.motor.loss_model.scale"].text == "draw 0 of 4 (seed 1) from refined"
    assert np.ptp(simulate(cranes, CASE).p_max.values) > 0.0


def test_the_factor_of_a_set_of_another_model_has_its_parameters(tmp_path):
    path = save_set(THREE, tmp_path / "refined.toml")
    crane = crane_with(CRANE, load_losses(path))
    known = Uncertainty.of({"motor_loss": {"set": str(path)}, "passive_motor_loss": {"uniform": [0.4, 0.6]}})
    columns = draws(known.on((crane, CASE.model_copy(update={"load": 0.0}))), 8, 1)
    assert columns.columns == ("motor_loss.C_e", "motor_loss.C_g", "passive_motor_loss")
    for (drawn, _), row in zip(
        Drawing(crane, CASE, columns.columns[:2]).pairs(columns.values), columns.values, strict=True
    ):
        assert drawn.active.motor.loss_model.C == pytest.approx((row[0], 6.6e-7, row[1], 4.4e7))
        assert drawn.active.motor.loss_model.scale == 1.0


def test_evidence_of_another_model_than_the_motors_is_refused(tmp_path):
    path = save_set(THREE, tmp_path / "refined.toml")
    path.write_text(path.read_text().replace('names = ["C_e", "C_g"]', 'names = ["C_e", "C_k"]'))
    allowed = "X_1, X_2, X_3, X_4, X_5, C_e, C_f, C_g, C_i"
    assert refused(load_losses, path) == f'refined.toml: evidence.names: "C_k" is not one of {allowed}.'


@pytest.mark.thorough
def test_more_uncertain_friction_makes_a_wider_band_of_peak_pressure():
    wide = friction_with(("Y_6",), ((4e-12,),))
    narrow = friction_with(("Y_6",), ((4e-14,),))
    pressures = [simulate(draw_cranes(CRANE, item, n=32), CASE).p_max.values for item in (wide, narrow)]
    assert np.std(pressures[0]) > 5.0 * np.std(pressures[1]) > 0.0
    middle = float(simulate(crane_with(CRANE, wide), CASE).p_max)
    assert all(p.min() < middle < p.max() for p in pressures)


@pytest.mark.parametrize(
    ("sets", "more", "text"),
    [
        ([], {}, "draw_cranes: no set. Give a friction set, a loss set, or both, with evidence."),
        ([KNOWN], {"n": 0}, "n = 0: give a whole number of draws from 1 to 10000."),
        ([load_friction("crane-2")], {}, 'set "crane-2": it has no [evidence], so its uncertainty is unknown.'),
    ],
)
def test_what_cannot_be_drawn_is_one_line(sets, more, text):
    assert refused(draw_cranes, CRANE, *sets, **more).startswith(text)


@pytest.mark.thorough
def test_the_command_prints_median_and_band(tmp_path, capsys):
    path = str(save_set(KNOWN, tmp_path / "my.friction.toml"))
    options = ["--crane", case_file(tmp_path, "nov-150t", load="60 t", tip="sine 1 m 9 s"), "--draws", "16"]
    assert command(["friction", "draws", path, *options, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    band = data["band_90"]["p_max"]
    assert band["low"] < data["at_values"]["p_max"] < band["high"]
    assert command(["friction", "draws", path, *options, "--verbose"]) == 0
    said = capsys.readouterr().out
    assert "highest pressure of both sides" in said
    assert command(["friction", "draws", path, *options, "--controller", "manual", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["band_90"]["e_c_pp"] == {"low": None, "median": None, "high": None}
    assert command(["friction", "draws", path, path, *options]) == 2
    assert "two sets of one kind" in capsys.readouterr().err


def test_two_sets_that_replace_the_same_numbers_are_refused():
    with pytest.raises(StillhookError, match='Sets "crane-1" and "crane-2" replace the same numbers of'):
        crane_with(CRANE, load_friction("crane-1"), load_friction("crane-2"))
