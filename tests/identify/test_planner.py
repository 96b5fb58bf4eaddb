"""Proposed tests shrink the uncertainty, and repair what a poor campaign lacks."""

from itertools import pairwise

import numpy as np
import pytest
from tests.identify.staged import CM3, CRANE_2, LOSS, stage, truth

from stillhook.identify.system_friction.campaign import load_campaign
from stillhook.identify.system_friction.fitting.fit import fit_system, predicted_sd
from stillhook.identify.system_friction.fitting.uncertainty import propose

CAMPAIGN = """
crane = "nov-150t"
motors = 11
[[test]]
log = "1.csv"
D_m = "215 cm^3/rev"
load = "77 t"
layer = 6
"""
Y = truth("crane-1")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "1.csv").write_text("")
    (folder / "campaign.toml").write_text(CAMPAIGN)
    return load_campaign(folder / "campaign.toml")


@pytest.mark.slow
def test_every_proposal_lowers_the_uncertainty_and_no_two_are_alike(campaign):
    points = stage(Y, rng=np.random.default_rng(1))
    found = propose(campaign, points, LOSS, fit_system(points, LOSS), n=4)
    assert len({(p.load, p.D_m) for p in found}) == 4
    assert all(p.sd_after < p.sd_before for p in found)
    assert all(a.sd_after == pytest.approx(b.sd_before) for a, b in pairwise(found))


@pytest.mark.slow
def test_one_load_is_answered_with_another_load(campaign):
    points = stage(Y, [t for t in CRANE_2 if t[1] == 77 and not t[2]], rng=np.random.default_rng(1))
    first = propose(campaign, points, LOSS, fit_system(points, LOSS, keep_Y_2=True), n=1)[0]
    assert abs(first.load - 77e3) > 30e3
    assert first.sd_before is None  # nothing is known of it before
    assert first.sd_after < 5.0


@pytest.mark.thorough
def test_running_the_proposed_test_does_lower_the_uncertainty_as_promised(campaign):
    """The proposal is run (with the same scatter) and the campaign fitted again: the error band over loads shrinks as foretold, within
    what a handful of draws can show."""
    rng, poor = np.random.default_rng(3), [(215, 55, False), (164, 77, False)]
    wide = stage(Y, [(215, load, False) for load in (0, 37, 75, 112, 150)])
    foretold, seen = [], []
    for _ in range(12):
        points = stage(Y, poor, rng=rng)
        fit = fit_system(points, LOSS, keep_Y_2=False)
        p = propose(campaign, points, LOSS, fit, n=1)[0]
        more = stage(Y, [*poor, (p.D_m / CM3, p.load / 1e3, False)], rng=rng)
        after = fit_system(more, LOSS, keep_Y_2=False)
        foretold.append(p.sd_after / p.sd_before)
        seen.append(np.sqrt(np.mean(predicted_sd(wide, after) ** 2) / np.mean(predicted_sd(wide, fit) ** 2)))
    assert np.mean(seen) < 0.7
    assert np.median(seen) == pytest.approx(np.median(foretold), rel=0.5)


@pytest.mark.slow
def test_what_is_beyond_the_relief_pressure_is_not_proposed(campaign):
    points = stage(Y, rng=np.random.default_rng(1))
    a = campaign.crane.active
    for p in propose(campaign, points, LOSS, fit_system(points, LOSS), n=12):
        T_d = (p.load + campaign.crane.hook_mass) * 9.81 * 0.5 * campaign.diameter(campaign.tests[0])
        assert T_d / campaign.crane.i_hD / (campaign.count * p.D_m) < a.relief.p
