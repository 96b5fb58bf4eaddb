"""The crane of the adaptation trial stays independent, and the estimator does on it what its page says."""

import ast
from pathlib import Path

import numpy as np
import pytest
from trials.adaptation import crane, run
from trials.adaptation.plant import OTHER_FORM

from stillhook.library import load_crane
from stillhook.live.estimate.balance import Balance

NUMBERS = {
    "stillhook": {"Crane"},
    "stillhook.engine.pack.winch": {"gains"},
    "stillhook.library": {"load_crane"},
}
"""All that it may take of the package: the crane file and numbers that follow from it."""
OIL = 0.12
"""Part of the losses by which warm or cold oil may move them: 6 K of 3.5 % on what goes with speed, below half of
them."""


@pytest.mark.parametrize("name", ["crane", "plant"])
def test_the_crane_takes_numbers_and_no_law_of_the_package(name):
    for node in ast.walk(ast.parse(Path(crane.__file__).with_name(f"{name}.py").read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(alias.name.partition(".")[0] == "stillhook" for alias in node.names)
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "stillhook":
            assert {alias.name for alias in node.names} <= NUMBERS.get(node.module, set())


def test_judged_seeds_are_apart_from_those_of_development():
    assert min(case.seed for case in run.CASES.values()) >= run.JUDGED > 202
    seeds = [(run.trial_of(c).seed, c.group) for c in run.CASES.values()]
    with_step = {seed for seed, group in seeds if group != "quiet"}
    assert with_step.isdisjoint({seed for seed, group in seeds if group == "quiet"})


@pytest.fixture(scope="module")
def short():
    """Some minutes of a crane with a step in the middle."""
    return crane.simulate(crane.Trial(seed=7, before=150.0, after=150.0))


@pytest.mark.thorough
def test_the_truth_steps_by_what_the_plant_is_given(short):
    balance = Balance(load_crane(crane.CRANE_FILE))
    before = run.true_scales(short, 40.0, short.t_step - 5.0, balance)[1]
    after = run.true_scales(short, short.t_step + 5.0, 295.0, balance)[1]
    assert after / before == pytest.approx(1.3, rel=0.03)  # oil warms by a tenth of a kelvin or so meanwhile
    assert before == pytest.approx(short.scale[0], abs=2.0 * OIL)


@pytest.mark.thorough
def test_sensors_err_within_what_is_stated(short):
    rows, truth = short.rows, short.truth
    assert np.abs(rows["alpha_m"] - truth["alpha_m"]).mean() <= crane.SETTING + 1e-3
    for name in ("p_a", "p_b", "p_hp"):
        assert np.abs(np.mean(rows[name] - truth[name])) <= crane.DRIFT + 1e4
    late = np.interp(rows["time"] - short.clock, rows["time"], truth["omega_m"])
    assert np.std(rows["omega_m"] - late) < 0.2
    wrong = np.mean(rows["F_w"] - truth["F_w"])
    assert abs(wrong) <= crane.CELL_ZERO + crane.CELL_GAIN * truth["F_w"].max()


@pytest.mark.thorough
@pytest.mark.parametrize("key", ["file-step/2000", "other-step/2001"])
def test_a_kept_outcome_comes_again(key):
    again, kept = run.outcome(run.CASES[key]), run.kept()[key]
    assert run.GROUPS[run.CASES[key].group].form in (0.0, OTHER_FORM)
    for moment in ("before", "soon", "late"):
        assert again[moment]["loss"] == pytest.approx(kept[moment]["loss"], abs=1e-4)
    assert len(again["alarms"]) == len(kept["alarms"])
