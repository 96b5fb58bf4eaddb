"""Elongation of the wire in the load cell: a softer wire is refused or listed as not detectable, and no healthy one is."""

import math

import numpy as np
import pytest
from tests.validate.ahc_logs import TWIN, campaign
from tests.validate.parameter_logs import checked, records

from stillhook.library import changed
from stillhook.statistics.estimate import Estimate
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import StepNumber, Verdict
from stillhook.validate.parameters import wire
from stillhook.validate.parameters.segments import ByTest

pytestmark = pytest.mark.slow


def wire_line(step):
    return next(x for x in judge(campaign().criteria, step.measures, (StepNumber.PARAMETERS,)) if x.key == "p-wire")


@pytest.mark.slow
def test_a_softer_wire_is_refused_by_the_force_of_the_hook():
    """30 % softer: in no control error, so that nothing judged it. It elongates by 43 % more."""
    softer = changed(TWIN, {"wire": {"E": f"{0.7 * TWIN.wire.E / 1e9} GPa"}})
    own_step, soft_step = checked(records(), TWIN), checked(records(softer), TWIN)
    (own_wire,), (soft,) = (x.measures_of("wire_elongation_error") for x in (own_step, soft_step))
    assert own_wire.low < 0.0 < own_wire.high
    assert abs(own_wire.value) < 0.08
    assert not wire_line(own_step).failed
    assert soft.value == pytest.approx(0.43, abs=0.08)
    assert soft.low < 1.0 / 0.7 - 1.0 < soft.high
    assert wire_line(soft_step).failed


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.5])
def test_a_wire_whose_mass_is_part_of_the_load_shows_less_of_its_elongation(share):
    """Against the exact motion of a uniform rod with a mass at its end, lifted and lowered slowly at its top."""
    M, L, EA = 100e3, 2000.0, 5e8
    mu, m, c = share * M / L, (1.0 - share) * M, L / EA
    w = 0.02 / math.sqrt(M * c)  # far below the first eigenfrequency
    if share == 0.0:
        top = m * w**2 / (1.0 - m * c * w**2)
    else:
        k, z = w * math.sqrt(mu / EA), EA * w * math.sqrt(mu / EA)
        t = math.tan(k * L)
        top = z * (z * t + m * w**2) / (z - m * w**2 * t)
    shown = (top / (M * w**2) - 1.0) / (M * c * w**2)
    assert wire.shown_with_mass(share) == pytest.approx(shown, rel=2e-3)


def test_a_wire_with_mass_is_open_towards_a_softer_one_and_never_refused_for_a_stiffer_reading():
    """The reference plant's wire, whose mass is part of the load, reads -15 to -20 % where its stiffness is right."""
    one = Estimate.around(-0.17, 0.05, 8)
    e = wire.WireElongation(ByTest(one, {"3": one}), 0.6).overall
    assert e.low < 0.0 < e.high
    assert not wire.detected(e)


@pytest.mark.slow
def test_a_wire_that_the_load_cell_cannot_tell_is_listed_as_not_detectable():
    rng = np.random.default_rng(3)
    step = checked(records(spoil=lambda log: {**log, "F_w": log["F_w"] + 1e5 * rng.standard_normal(len(log["F_w"]))}))
    (measure,) = step.measures_of("wire_elongation_error")
    assert measure.undetectable
    assert "do not detect a wire 30 % softer" in measure.note
    line = wire_line(step)
    assert (line.verdict, line.failed) == (Verdict.NOT_COVERED, False)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_noise_of_the_load_cell_never_turns_down_the_wire_of_a_healthy_crane(seed):
    """A fit of the stiffness ran to a soft wire, whose interval shrinks with it."""
    rng = np.random.default_rng(seed)
    step = checked(records(spoil=lambda log: {**log, "F_w": log["F_w"] + 6e4 * rng.standard_normal(len(log["F_w"]))}))
    assert not wire_line(step).failed
