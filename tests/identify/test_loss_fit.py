"""Loss models fitted to maps: parameters come back, errors cover, and what a map cannot determine is said."""

import numpy as np
import pytest
from trials.campaigns.motor_map import Extra, synthetic_map

from stillhook.errors import IdentifyError
from stillhook.identify.motor.fit import CARDS, LossModel, fit_loss, indeterminate, spread_of_levels
from stillhook.identify.motor.map import LossMap
from stillhook.library import motor

MODELS = list(LossModel)
TWO_LINES = (LossModel.HUHTALA_14, LossModel.HUHTALA_28)
BACK = 1e-6
"""Relative: exact data through least squares on scaled columns."""
BACK_BENT = 1e-3
"""The same where a search for an exponent or a break is part of the fit."""


def noisy(m: LossMap, T_f, sigma: float, seed: int) -> LossMap:
    from dataclasses import replace

    return replace(m, T_f=T_f + sigma * np.random.default_rng(seed).standard_normal(len(m)))


@pytest.fixture(scope="module")
def m() -> LossMap:
    return synthetic_map("A6VM215", seed=0)


@pytest.fixture(scope="module")
def coarse(m: LossMap) -> LossMap:
    """Every third speed: enough for a fit, and quick."""
    return m.at(np.isin(m.omega_m, np.unique(m.omega_m)[::3]))


@pytest.mark.parametrize("model", [x for x in MODELS if x not in TWO_LINES])
def test_parameters_come_back_from_a_map_that_the_model_made(model, m):
    """The truth is what a realistic map gives this model, so every term has its usual size."""
    truth = fit_loss(m, model)
    T_f = truth.torque(m.omega_m, m.D_m, m.dp_m) * np.ones(len(m))
    back = fit_loss(noisy(m, T_f, 0.0, 0), model)
    allowed = BACK_BENT if CARDS[model].bent else BACK
    assert back.rms <= allowed * T_f.mean()
    there = truth.values != 0.0
    assert back.values[there] == pytest.approx(truth.values[there], rel=allowed, abs=0.0)
    assert set(truth.at_bound) <= set(back.at_bound)


@pytest.mark.thorough
@pytest.mark.parametrize("model", TWO_LINES)
def test_two_lines_with_their_break_inside_the_map_come_back(model, m):
    """The loss comes back; its polynomial coefficients are nearly alike, so they are not compared."""
    truth = fit_loss(m, model)
    inside = {"p_0": 1.2e7, "p_1": 2e4, "p_2": 0.0, "p_0D": 4e6, "p_1D": 1e4, "p_2D": 0.0, "b_0": 2e-7, "c_0": 5e-7}
    values = np.array([inside.get(name, value) for name, value in zip(truth.names, truth.values, strict=True)])
    T_f = CARDS[model].torque(m.omega_m, m.D_m, m.dp_m, values, m.motor)
    back = fit_loss(noisy(m, T_f, 0.0, 0), model)
    assert back.rms <= BACK_BENT * np.abs(T_f).mean()


@pytest.mark.parametrize("name", ["A6VM170", "A6VM215", "A6VM280"])
def test_a_map_of_the_published_motor_gives_the_published_parameters(name):
    clean = synthetic_map(name, extra=Extra(0.0, 0.0, 0.0, 0.0), printed=0.0)
    loss = motor(name).loss
    assert fit_loss(clean, LossModel.MJ4).values == pytest.approx(
        [loss.X_1, loss.X_2, loss.X_3, loss.X_4, loss.X_5], rel=BACK
    )


def test_rounding_to_a_tenth_of_a_per_cent_costs_little():
    """A supplier's efficiency of one decimal moves the loss by far less than what MJ4 lacks."""
    printed = synthetic_map("A6VM215", extra=Extra(0.0, 0.0, 0.0, 0.0))
    assert 0.0 < fit_loss(printed, LossModel.MJ4).rms_share < 0.0005


@pytest.mark.slow
def test_stated_errors_cover_the_truth(coarse):
    """95 % intervals over 200 maps with independent noise; 5 parameters, each within what chance allows (4 standard deviations)."""
    truth = fit_loss(coarse, LossModel.MJ4)
    T_f = truth.torque(coarse.omega_m, coarse.D_m, coarse.dp_m)
    fits = [fit_loss(noisy(coarse, T_f, 1.0, seed), LossModel.MJ4) for seed in range(200)]
    inside = np.mean([np.abs(f.values - truth.values) <= 1.96 * f.errors for f in fits], axis=0)
    assert (np.abs(inside - 0.95) <= 4.0 * np.sqrt(0.95 * 0.05 / 200)).all(), inside
    spread = np.cov([f.values for f in fits], rowvar=False)
    assert np.sqrt(np.diag(spread)) == pytest.approx(np.mean([f.errors for f in fits], axis=0), rel=0.2)


@pytest.mark.slow
def test_exponent_of_mj5_is_found_with_an_honest_error(coarse):
    truth = np.array([14.0, 0.005, 0.1, 1.0, 1.6, 1e-14])
    card = CARDS[LossModel.MJ5]
    unit = card.torque(coarse.omega_m, coarse.D_m, coarse.dp_m, [0.0, 0.0, 0.0, 1.0, 1.6, 0.0], coarse.motor)
    truth[3] = 30.0 / unit.mean()
    T_f = card.torque(coarse.omega_m, coarse.D_m, coarse.dp_m, truth, coarse.motor)
    fits = [fit_loss(noisy(coarse, T_f, 1.0, seed), LossModel.MJ5) for seed in range(60)]
    off = [(f["C_n"] - 1.6) / f.errors[f.names.index("C_n")] for f in fits]
    assert 0.7 < np.std(off) < 1.3
    assert abs(np.mean(off)) < 0.5


def test_terms_add_up_to_the_loss(m):
    fit = fit_loss(m, LossModel.MJ6)
    assert sum(fit.terms(m.omega_m, m.D_m, m.dp_m).values()) == pytest.approx(
        fit.torque(m.omega_m, m.D_m, m.dp_m), rel=1e-12
    )


def test_physical_parameters_are_never_negative_and_a_bound_claims_no_error(m):
    """A motor whose loss falls with pressure squared asks for a negative X_5."""
    fit = fit_loss(noisy(m, m.T_f - 4e-14 * m.dp_m**2, 0.0, 0), LossModel.MJ4)
    assert (fit.values >= 0.0).all()
    assert fit["X_5"] == 0.0
    assert "X_5" in fit.at_bound
    free = [n not in fit.at_bound for n in fit.names]
    assert (np.isfinite(fit.errors) == free).all()
    assert any("X_5 is at its bound" in line for line in indeterminate(fit))


def test_interpolations_may_be_negative(m):
    assert (fit_loss(m, LossModel.ORTWIG).values < 0.0).any()


@pytest.mark.parametrize(
    ("axis", "model", "group"),
    [
        ("dp_m", LossModel.MJ2, {"C_e", "C_f", "C_m"}),
        ("omega_m", LossModel.MJ3, {"C_e", "C_g"}),
        ("D_m", LossModel.ORTWIG, {"C_e", "C_j"}),
    ],
)
def test_one_level_of_an_axis_confounds_parameters_and_says_which(m, axis, model, group):
    value = m.axis(axis).max()
    fit = fit_loss(m.at(m.axis(axis) == value), model)
    assert any(set(g) & group for g in fit.confounded)
    assert any("cannot be distinguished" in line for line in indeterminate(fit))
    named = {n for g in fit.confounded for n in g}
    assert np.isnan(fit.errors[[fit.names.index(n) for n in named]]).all()
    assert np.isfinite(fit.rms)


def test_too_few_cells_for_a_model_are_refused(m):
    with pytest.raises(IdentifyError, match=r"12 cells for the 28 parameters of Huhtala, 28\. Give more cells"):
        fit_loss(m.at(np.arange(12)), LossModel.HUHTALA_28)


def test_leaving_out_displacements_spreads_more_than_independent_cells_claim(m):
    """MJ4 is not the truth of this map: neighbouring cells deviate alike."""
    fit = fit_loss(m, LossModel.MJ4)
    spread = spread_of_levels(m, fit)
    assert spread is not None
    assert (np.sqrt(np.diag(spread))[[0, 1, 3]] > 2.0 * fit.errors[[0, 1, 3]]).all()
    assert np.linalg.eigvalsh(spread / np.outer(*[np.sqrt(np.diag(spread))] * 2)).min() > -1e-9


@pytest.mark.slow
def test_the_two_spreads_agree_where_the_model_is_right(m):
    truth = fit_loss(m, LossModel.MJ4)
    T_f = truth.torque(m.omega_m, m.D_m, m.dp_m)
    ratios = []
    for seed in range(20):
        made = noisy(m, T_f, 1.0, seed)
        fit = fit_loss(made, LossModel.MJ4)
        ratios.append(np.sqrt(np.diag(spread_of_levels(made, fit))) / fit.errors)
    assert np.mean(ratios, axis=0) == pytest.approx(1.0, abs=0.35)


def test_few_displacements_give_no_spread_of_levels(m):
    few = m.at(np.isin(m.D_m, np.unique(m.D_m)[-3:]))
    assert spread_of_levels(few, fit_loss(few, LossModel.MJ4)) is None
