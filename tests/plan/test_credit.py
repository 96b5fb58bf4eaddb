"""A certificate covers the seas in which its envelope holds, and none where it does not hold itself."""

import math
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from tests.signers import signed

from stillhook.errors import StillhookError
from stillhook.kernels.build import results_hash
from stillhook.plan.answer.metadata import _crane as facts_of_crane
from stillhook.plan.definition.capacities import at_rest, places
from stillhook.plan.definition.rules import Alternative, Seas
from stillhook.plan.file import load_plan
from stillhook.plan.table import inside
from stillhook.plan.tiers.closed_form import duration_of, tip_motion
from stillhook.spec.crane import content
from stillhook.spec.lift.phase import PhaseKind
from stillhook.spec.validity import Certified
from stillhook.trust.trust_list import users_trust

SEAS = Seas(np.array([0.5, 1.5, 2.5, 4.0]), np.full(4, 9.0), np.full(4, math.pi))
ENVELOPE = {
    "load": ("60 t", "160 t"),
    "s_w": ("500 m", "2000 m"),
    "s_tip_pp": ("0.5 m", "2 m"),
    "period": ("4 s", "12 s"),
    "modes": ("ssc",),
}


@pytest.fixture(scope="module")
def example():
    return load_plan("template-to-1500m")


@pytest.fixture(scope="module")
def plan(example):
    """The example, of a crane without any certificate."""
    return replace(example, crane=example.crane.model_copy(update={"certified": None}), credits_synthetic=False)


def test_a_certificate_that_nobody_signed_covers_no_sea_and_counts_as_synthetic(plan):
    """An envelope that was widened by hand, its seal made anew, was credited once."""
    assert facts_of_crane(plan.crane, False)["certificate"] is None
    forged = certified(plan, sign=False, load=("1 t", "250 t"))
    found = asked(forged)
    assert not found[0].any()
    assert "unsigned" in found[1][0]
    told = facts_of_crane(forged.crane, False)["certificate"]
    assert told["synthetic"]
    assert told["signature"]["standing"] == "unsigned"
    assert "level 2" not in told["statement"]


def test_a_record_with_the_signature_of_another_covers_no_sea(plan):
    signature = certified(plan).crane.certified.signature
    record = certified(plan, sign=False, load=("1 t", "250 t")).crane.certified
    stolen = record.model_copy(update={"signature": signature}).judged(users_trust())
    found = asked(replace(plan, crane=plan.crane.model_copy(update={"certified": stolen})))
    assert not found[0].any()
    assert "the signature does not fit" in found[1][0]


def certified(plan, *, synthetic=False, code=None, sign=True, **envelope):
    record = Certified.of(
        digest="0" * 64,
        date="2026-05-03",
        criteria="paper-f version 1",
        passed=True,
        synthetic=synthetic,
        level=2,
        variant=2,
        version="0",
        code=code or results_hash(),
        content=content(plan.crane),
        envelope={**ENVELOPE, **envelope},
    )
    record = signed(record) if sign else record
    return replace(plan, crane=plan.crane.model_copy(update={"certified": record}))


def asked(plan, alternative=Alternative.SSC, kind=PhaseKind.DEEP):
    return inside(plan, next(p for p in plan.phases if p.kind is kind), alternative, SEAS)


def test_seas_in_which_the_tip_moves_more_than_in_the_tests_are_not_covered(plan):
    found = asked(certified(plan))
    assert found[0].tolist() == [False, True, True, False]  # the smallest moves the tip less than any test did
    assert len(found[1]) == 1
    assert "in 2 of 4 seas: tip motion over 30 s" in found[1][0]
    assert "(validated 0.5 m to 2 m) and the like" in found[1][0]


def test_the_load_of_a_certificate_is_what_the_winch_feels_wire_included(plan):
    F = at_rest(plan, next(p for p in plan.phases if p.kind is PhaseKind.DEEP), -1475.0).F_tip
    felt = F / 9.80665 - plan.crane.hook_mass
    assert felt > plan.payload.mass
    less = asked(certified(plan, load=("60 t", f"{0.97 * felt / 1000.0:.1f} t")))
    assert not less[0].any()
    assert "in 4 of 4 seas: load" in less[1][0]
    assert "and the like" not in less[1][0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("alternative", "said"),
    [(Alternative.NS, "mode ns (validated ssc)"), (Alternative.STRONG_SSC, "other settings of the controller")],
)
def test_a_controller_that_was_not_tested_is_not_covered(plan, alternative, said):
    found = asked(certified(plan), alternative)
    assert not found[0].any()
    assert any(said in line for line in found[1])


def test_a_certificate_of_simulated_logs_covers_nothing(plan):
    found = asked(certified(plan, synthetic=True))
    assert not found[0].any()
    assert "SYNTHETIC" in found[1][0]


def test_a_certificate_that_the_plan_assumes_is_credited_in_its_envelope_and_said_to_be_synthetic(example):
    assert asked(example)[0].all()
    swell, deep = Seas(np.array([1.0]), np.array([14.0]), np.array([math.pi])), PhaseKind.DEEP
    phase = next(p for p in example.phases if p.kind is deep)
    assert "period of the tip" in inside(example, phase, Alternative.SSC, swell)[1][0]
    assert not asked(replace(example, credits_synthetic=False))[0].any()
    told = facts_of_crane(example.crane, example.credits_synthetic)["certificate"]
    assert told["synthetic"]
    assert told["assumed"]


def test_a_crane_with_a_certificate_of_its_own_is_given_no_other(example, tmp_path, monkeypatch):
    file = tmp_path / "lift.toml"
    text = (files("stillhook.library") / "data" / "lifts" / "template-to-1500m.toml").read_text(encoding="utf-8")
    file.write_text(text.replace('load = ["80 t", "180 t"]', 'load = ["180 t", "80 t"]'), encoding="utf-8")
    with pytest.raises(StillhookError, match=r"synthetic_certificate.*load: from 180000 to 80000"):
        load_plan(file)
    file.write_text(text, encoding="utf-8")
    monkeypatch.setattr("stillhook.plan.file.crane_of", lambda file, table: example.crane)
    with pytest.raises(StillhookError, match="the crane has a certificate of its own"):
        load_plan(file)


def test_a_certificate_of_other_code_or_of_another_crane_does_not_hold(plan):
    assert "computes with other code" in asked(certified(plan, code="0123456789abcdef"))[1][0]
    changed = certified(plan)
    crane = changed.crane.model_copy(update={"SWL": 260e3})
    found = asked(replace(changed, crane=crane))
    assert not found[0].any()
    assert "the crane was changed since in SWL" in found[1][0]


def test_where_the_twin_compensates_nothing_no_certificate_is_asked_for(plan):
    """A phase without compensation, and the flat cap or a winch that stands, leave nothing to credit."""
    for alternative in (Alternative.NONE, Alternative.CAP):
        assert asked(plan, alternative)[0].all()
        assert asked(plan, alternative)[1] == ()
    for phase in plan.phases:
        covered, reasons = inside(plan, phase, Alternative.SSC, SEAS)
        assert covered.tolist() == [not phase.compensated] * len(SEAS)
        assert bool(reasons) == phase.compensated
    assert {phase.compensated for phase in plan.phases} == {True, False}


def test_the_wire_goes_half_the_tip_s_motion_beyond_where_the_phase_holds_it(plan, monkeypatch):
    """An envelope that ends just where the phase ends at rest covers no sea that moves the tip; half of its motion more
    on both sides covers it."""
    monkeypatch.setattr("stillhook.spec.validity.EDGE", 0.0)
    deep = next(p for p in plan.phases if p.kind is PhaseKind.DEEP)
    wire = [at_rest(plan, deep, z).s_w for z in places(deep)]
    motion = 2.0 * float(tip_motion(plan, deep, SEAS).largest(duration_of(plan, deep))[0][1])
    everything = {"s_tip_pp": ("0 m", "20 m"), "period": ("1 s", "30 s")}

    def covered(less: float, more: float) -> bool:
        wires = {"s_w": (f"{min(wire) - less!r} m", f"{max(wire) + more!r} m")}
        return bool(asked(certified(plan, **wires, **everything))[0][1])

    enough, too_little = 0.505 * motion, 0.495 * motion
    assert covered(enough, enough)
    assert not covered(too_little, enough)
    assert not covered(enough, too_little)
